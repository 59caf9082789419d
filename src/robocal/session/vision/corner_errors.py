"""What a fit leaves of corners, and by how much it misses those of views that were left out, row by row of the table."""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools
from robocal.fit.misfit import by_unit
from robocal.fit.noise import owners
from robocal.measure.machine import Rig
from robocal.prove.decision import Decision
from robocal.prove.statistics import Statistic

__all__ = ["CornerErrors", "corner_errors"]


@record(eq=False)
class CornerErrors:
    """What is left of corners (n, 2) and the error (n,) of each when its view was left out, NaN where it was not, px; which were not set
    aside (n,); `noise` is what a corner is off by (px, both axes together), of which a fit leaves less where a view has few corners."""

    left: Array
    missed: Array
    used: Bools
    noise: float

    @property
    def fitted(self) -> Statistic:
        """Of all corners but those that were set aside, as fitted."""
        every = Statistic.of(np.linalg.norm(self.left[self.used], axis=1))
        assert every is not None
        return every

    @property
    def left_out(self) -> Statistic | None:
        """Of the same, of views that were left out one by one or in turn."""
        return Statistic.of(self.missed[self.used & np.isfinite(self.missed)], profiled=True)


def corner_errors(made: Decision[Rig]) -> CornerErrors:
    """The errors of a fit to one list of corners."""
    (obs,) = made.need_data.observations
    terms = made.need_fit.problem.terms
    row = by_unit(terms, [t.index for _, t in owners(made.need_data, made.need_fit.problem)], "px")
    left, missed = np.full((len(obs), 2), np.nan), np.full(len(obs), np.nan)
    left[row] = np.concatenate([r.value for r in made.residuals])
    proofs = made.proven.proofs
    for name in ("leave_one_out", "k_fold", "held_out"):
        if name in proofs:
            missed[row] = proofs[name]().errors("px", everything=True)[1]
            break
    used = np.ones(len(obs), dtype=np.bool_) if obs.used is None else obs.used
    square = np.sum(left[used] ** 2)
    return CornerErrors(left, missed, used, float(np.sqrt(2 * square / max(made.uncertainty.dof, 1))))
