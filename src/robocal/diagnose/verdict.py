"""The verdict on an identification."""

from __future__ import annotations

from dataclasses import dataclass, replace

from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Verdict"]


@dataclass(frozen=True)
class Verdict:
    """improved, not_improved or refused, with the reasons; `region` says where an improvement holds: working or measured."""

    status: str
    reasons: tuple[Remark, ...]
    region: str | None = None

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """The reasons, each once."""
        return tuple(dict.fromkeys(self.reasons))

    def refused(self, *why: Remark) -> Verdict:
        """Refused after all: these reasons first."""
        return self.instead("refused", *why)

    def instead(self, status: str, *why: Remark) -> Verdict:
        """Another status after all: these reasons first, and a gain that was proven is only told, for nobody should act on it."""
        gains = (Code.GAIN_PROVEN, Code.GAIN_NOT_PROVEN, Code.EXACT)
        kept = (replace(r, code=Code.GAIN_ANYWAY) if r.code in gains[:2] else r for r in self.reasons)
        return Verdict(status, (*why, *(r for r in kept if r.code not in gains)))
