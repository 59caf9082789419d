"""What was read of all files, and what may be wrong with it: other units, each of which can be tried, changes of the data, other
chains of the robot's file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from robocal._record import record, replace
from robocal.diagnose.check_registry import Context, M_co
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet, Observations
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

if TYPE_CHECKING:
    from robocal.diagnose.hypotheses.changes import Change
    from robocal.diagnose.hypotheses.explain import Doubt

__all__ = ["OtherChain", "OtherUnit", "ReadContext"]


class OtherChain(Protocol):
    """Another reading of the robot's file, or another chain of it, that explains the data."""

    @property
    def text(self) -> str:
        """What it is, in words."""

    @property
    def line(self) -> str:
        """What to write."""

    @property
    def key(self) -> str:
        """Where."""

    @property
    def left(self) -> float:
        """What it leaves (m)."""


@record
class ReadContext(Context[M_co]):
    """Beside the data: units that look wrong (`suspicions`) or that people mix up (`alternatives`), `forgotten` keys that may explain
    a misfit as well, the `changes` that are worth a trial, and the other chains (`others`) that explain
    a misfit, alone or with one change more."""

    suspicions: tuple[OtherUnit, ...] = ()
    alternatives: tuple[OtherUnit, ...] = ()
    forgotten: tuple[Remark, ...] = ()
    changes: Callable[[], Sequence[Change]] | None = None
    others: Callable[[Doubt, bool], Sequence[OtherChain]] | None = None


@record
class OtherUnit:
    """`part` (joints, or the section that holds lengths) of `source` is stated in `stated` but looks like
    `alternative`: its SI values times `factor`."""

    part: str
    source: str
    stated: str
    alternative: str
    factor: float
    reason: Remark
    columns: tuple[int, ...] = ()

    def apply(self, data: DataSet) -> DataSet:
        """The data set as it would be in the other unit; also when it was joined with others."""
        if self.part != "joints":
            return DataSet(data.configurations, tuple(map(self._scaled, data.observations)))
        if data.configurations.joints is None:
            return data
        joints = data.configurations.joints.copy()
        rows = data.configurations_of([self.source])
        joints[np.ix_(rows, np.array(self.columns, dtype=int))] *= self.factor
        return DataSet(replace(data.configurations, joints=joints), data.observations)

    def _scaled(self, obs: Observations) -> Observations:
        if obs.source != self.source:
            return obs
        scale = np.ones(obs.value.shape[-1])
        for first, last, unit in kind_of(obs).parts:
            if unit == "m":
                scale[first:last] = self.factor
        return replace(obs, value=obs.value * scale, sigma=None if obs.sigma is None else obs.sigma * scale)

    @property
    def remark(self) -> Remark:
        """What is said where nothing proves it."""
        names = {"file": self.source, "part": self.part, "stated": self.stated, "alternative": self.alternative}
        return Remark.of(Code.OTHER_UNIT, **names, why=self.reason.sentence)
