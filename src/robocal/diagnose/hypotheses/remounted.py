"""A target that was put on anew between files: worth a place of its own for each, or not.

The nominal model, softly held, is fitted twice: with one place of the target on the tool for all files, and with one for
each. What the second leaves less is what it is worth. By chance F - 1 more places explain next to nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robocal.diagnose.hypotheses.explain import SOFT, rows_of, taken
from robocal.diagnose.hypotheses.lockstep import SoftPrior, fit_trials, reach_of
from robocal.diagnose.hypotheses.sights import Sights, sights, usable
from robocal.diagnose.limits import (
    EXPLAINED_CLEARLY,
    HYPOTHESIS_PLACES,
    MAKING_LEAVES,
    REMOUNT_FILES,
    REMOUNT_LEAST,
    REMOUNT_WORTH,
)
from robocal.measure.data import DataSet
from robocal.measure.machine import Mechanism

__all__ = ["Remounted", "find_remount"]


@dataclass(frozen=True)
class Remounted:
    """A target that sits otherwise in each of some files, the median errors (m) with one place and with several, and
    whether that alone explains what no arm's making leaves."""

    target: str
    sources: tuple[str, ...]
    together: float
    separate: float
    alone: bool


def find_remount(chain: Mechanism, data: DataSet) -> Remounted | None:
    """Whether the one target that several files share was put on anew between them; None where it was not, or nobody can
    tell."""
    shared = [o for o in data.observations if usable(o)]
    sources = tuple(dict.fromkeys(o.source for o in shared))
    names = {t.name for o in shared for t in o.targets} or {"tool"}
    if (
        not 2 <= len(sources) <= REMOUNT_FILES
        or len(names) != 1
        or any(bool(o.targets) != bool(shared[0].targets) for o in shared)
    ):
        return None
    if any(o.frame is not None and o.frame.mount != "base" for o in shared):
        return None
    chosen = rows_of(data)
    if chosen is None:
        return None
    small = taken(data, chosen)
    one = sights(chain, [small])
    if (
        one is None
        or one.places < HYPOTHESIS_PLACES
        or not one.things_free[0, :3].any()
        or not np.isfinite(one.joints).all()
    ):
        return None
    each = np.concatenate([np.full(len(o), sources.index(o.source)) for o in small.observations if usable(o)])
    several = replace(
        one, thing=each[None], things=np.repeat(one.things, len(sources), axis=0),
        things_free=np.repeat(one.things_free, len(sources), axis=0),
    )  # fmt: skip
    with np.errstate(all="ignore"):
        together, apart = (_left(chain, s) for s in (one, several))
    if together <= REMOUNT_WORTH * apart or together - apart <= REMOUNT_LEAST:
        return None
    making = MAKING_LEAVES * reach_of(chain, one)
    alone = apart <= making < together and EXPLAINED_CLEARLY * apart <= together
    return Remounted(names.pop(), sources, together, apart, alone)


def _left(chain: Mechanism, trial: Sights) -> float:
    return float(fit_trials(chain, trial, SoftPrior.of_chain(chain, SOFT)).left[0])
