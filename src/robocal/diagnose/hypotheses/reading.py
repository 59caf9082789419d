"""What was read of all files, and what may be wrong with it: other units, changes of the data, other chains of the robot's file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from robocal.diagnose.check_registry import Context, M_co
from robocal.diagnose.hypotheses.other_units import OtherUnit
from robocal.remarks.remark import Remark

if TYPE_CHECKING:
    from robocal.diagnose.hypotheses.changes import Change
    from robocal.diagnose.hypotheses.explain import Doubt

__all__ = ["OtherChain", "ReadContext"]


class OtherChain(Protocol):
    """Another chain that explains the data."""

    @property
    def robot(self) -> Any:
        """The robot with that chain."""

    @property
    def left(self) -> float:
        """What it leaves (m)."""


@dataclass(frozen=True)
class ReadContext(Context[M_co]):
    """Beside the data: units that look wrong (`suspicions`) or that people mix up (`alternatives`), `forgotten` keys that may explain
    a misfit as well, the `changes` that are worth a trial, and the other chains (`others`) that explain a misfit."""

    suspicions: tuple[OtherUnit, ...] = ()
    alternatives: tuple[OtherUnit, ...] = ()
    forgotten: tuple[Remark, ...] = ()
    changes: Callable[[], Sequence[Change]] | None = None
    others: Callable[[Doubt], Sequence[OtherChain]] | None = None
