"""What a platform's controller remembers from one period to the next, and the words of its stops."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from robocal._jit import as_kernel_array
from robocal._record import record
from robocal._types import Array, Ints
from robocal.cables.single._kernels import slopes
from robocal.control.layout import _kernels as layout

__all__ = ["STOPS", "PlatformState"]

# Why a controller stopped, by the word of its state.
STOPS: Mapping[int, str] = MappingProxyType({
    layout.RUNNING: "", layout.UNHELD: "no-tensions", layout.LOST: "no-pose", layout.UNMATCHED: "lengths-disagree",
    layout.UNFOLLOWED: "motor-does-not-follow", layout.LOW: "cable-slack", layout.HIGH: "cable-overloaded",
    layout.NO_TARGET: "no-such-goal", layout.MUTE: "sensor-is-silent",
})  # fmt: skip


@record(eq=False)
class PlatformState:
    """What a controller remembers from one period to the next; its properties say what it means."""

    memory: Array
    now: Array
    drum: Array
    rows: Ints

    def copy(self) -> PlatformState:
        """One that a kernel may write into."""
        return PlatformState(self.memory.copy(), self.now.copy(), self.drum.copy(), self.rows)

    @property
    def pose(self) -> Array:
        """Where it believes the platform to be (4, 4); where it was last known, once it stopped for want of a pose."""
        return self.memory[:16].reshape(4, 4).copy()

    @property
    def twist(self) -> Array:
        """The velocity (v, w) (6,) that it asks for, m/s and rad/s in base axes."""
        return self.memory[layout.TWIST : layout.TWIST + 6].copy()

    @property
    def left(self) -> tuple[float, float]:
        """What is left of the way, m and rad."""
        return float(self.memory[layout.LEFT]), float(self.memory[layout.LEFT_TURN])

    @property
    def arrived(self) -> bool:
        """Whether it stands at its goal."""
        memory = self.memory
        return not (memory[layout.MOVING] or memory[layout.TURNING] or memory[layout.CODE])

    @property
    def stop(self) -> str:
        """Why it stopped, a word of STOPS; empty while it runs."""
        return STOPS[int(self.memory[layout.CODE])]

    @property
    def cable(self) -> int | None:
        """The cable (from 0) for which it stopped, where it is one's."""
        which = int(self.memory[layout.WHICH])
        return which if self.stop and which >= 0 else None

    @property
    def value(self) -> float:
        """The number for which it stopped: rms (m), speed (rad/s), tension (N) or silence (s)."""
        return float(self.memory[layout.VALUE])

    @property
    def residual(self) -> float:
        """Rms of what no pose explains of the lengths, m."""
        return float(self.memory[layout.RMS])

    @property
    def tension(self) -> Array:
        """The tensions (m,) that hold the platform, N."""
        return self._each(layout.TENSION)

    @property
    def trim(self) -> Array:
        """What is added (m,) to these because of tension sensors, N."""
        return self._each(layout.TRIM)

    @property
    def stretch(self) -> Array:
        """What cables are longer (m,) by than at power-up, by their elasticity and tension, m: no encoder sees it. Not a number where no
        elasticity is known."""
        return np.where(self.drum[:, 5] > 0, self._each(layout.STRAIN), math.nan)

    @property
    def unseen(self) -> Array:
        """How far (6,) the stretch that is not corrected moves the platform from where it is believed to be, m and rad; not numbers where
        no elasticity is known."""
        m = len(self.drum)
        full, slope = np.empty(m), np.empty((m, 6))
        slopes(as_kernel_array(self.pose), self.now, full, slope)
        more, out = self.stretch - self._each(layout.MEND), np.zeros(6)
        known = bool(np.isfinite(more).all())
        out[self.rows] = np.linalg.lstsq(slope[:, self.rows], more, rcond=None)[0] if known else math.nan
        return out

    def _each(self, index: int) -> Array:
        return np.array(self.memory[layout.MEMORY :].reshape(layout.EACH, -1)[index])
