"""What stands beside an identification: the other estimators."""

from __future__ import annotations

from collections.abc import Sequence

from robocal.arms.chain import Chain
from robocal.calibrate.estimators import ESTIMATORS, estimator
from robocal.calibrate.identification import Identification
from robocal.calibrate.options import Options
from robocal.errors import ModelError
from robocal.files import evidence as files
from robocal.files.shown import shown
from robocal.jobs.watching import Watch
from robocal.measure.data import DataSet

__all__ = ["compared", "methods_of"]


def methods_of(words: str | None, chosen: str) -> tuple[str, ...]:
    """The methods of `--compare`: all that are worth it, or those named, the chosen one first where it is among them.
    Raises ModelError for an unknown name."""
    if words is None:
        return ()
    from robocal.calibrate import compare as solver

    named = solver.DEFAULT if words == "all" else tuple(w.strip() for w in words.split(",") if w.strip())
    if not named:
        raise ModelError("no method is named", key="--compare", found=words, expected=", ".join(ESTIMATORS))
    for name in named:
        estimator(name)
    return tuple(dict.fromkeys((chosen, *named)))


def compared(
    chain: Chain, data: DataSet, methods: Sequence[str], options: Options, known: tuple[Identification[Chain], float], watch: Watch | None
) -> files.Comparison:  # fmt: skip
    """The methods side by side, in mm or deg; `known` is the identification that was done, with its seconds."""
    from robocal.calibrate import compare as solver

    found = solver.compare(chain, data, methods, options, known=known, watch=watch)
    return shown(files.Comparison, found)
