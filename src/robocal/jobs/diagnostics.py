"""What stands beside an identification: how linear it was, and the other estimators, from SI to result.json."""

from __future__ import annotations

from collections.abc import Sequence

from robocal.arms.chain import Chain
from robocal.calibrate.estimators import ESTIMATORS, estimator
from robocal.calibrate.evidence import Statistic
from robocal.calibrate.identification import Identification
from robocal.calibrate.linear import Linearity
from robocal.calibrate.options import Options
from robocal.errors import ModelError
from robocal.estimate.linearity import Step
from robocal.files import diagnostics as files
from robocal.files.units import UNITS
from robocal.jobs.watching import Watch
from robocal.measure.data import DataSet

__all__ = ["compared", "linear", "methods_of"]

SHOWN = {"m": UNITS["mm"], "rad": UNITS["deg"], "px": UNITS["px"]}


def linear(found: Linearity | None) -> files.Linearity | None:
    """How linear an identification was, in mm or deg."""
    if found is None:
        return None
    unit = SHOWN.get(found.fitted.unit, UNITS["1"])

    def step(s: Step) -> files.LinearStep:
        k = 1.0 / unit.factor
        return files.LinearStep(
            before=s.before * k, promised=s.promised * k, left=s.left * k, neglected=s.neglected * k, share=s.share, noise=s.noise * k
        )  # fmt: skip

    bend = found.curvature
    return files.Linearity(
        unit=unit.name,
        fitted=step(found.fitted),
        everything=step(found.everything) if found.everything is not None else None,
        curvature=None if bend is None else bend.value,
        curvature_parameter="" if bend is None else bend.parameter,
        misleads=found.misleads,
        ruins=found.ruins,
    )


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
    unit = SHOWN.get(found.unit, UNITS["1"])

    def mean(s: Statistic | None) -> float | None:
        return None if s is None else s.mean / unit.factor

    return files.Comparison(
        unit=unit.name,
        reference=next(e.method for e in found.entries if not e.failed),
        methods=[
            files.Compared(
                method=e.method,
                title=e.title,
                verdict=e.verdict,  # type: ignore[arg-type]
                reason=e.reason,
                stopped=e.stopped,
                after=mean(e.after),
                held_out=mean(e.held_out),
                leave_one_out=mean(e.leave_one_out),
                k_fold=mean(e.k_fold),
                farthest=e.farthest,
                sigmas=e.sigmas,
                seconds=None if e.seconds is None else round(e.seconds, 3),
                failed=e.failed,
            )
            for e in found.entries
        ],
        before=mean(found.before),
        held_out_before=mean(found.held_out_before),
        leave_one_out_before=mean(found.leave_one_out_before),
        constant=mean(found.constant),
        k_fold_before=mean(found.k_fold_before),
    )
