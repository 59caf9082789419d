"""How fast a platform moves under its controller, and where that stops."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from robocal._record import record
from robocal.control.layout._kernels import AXES, JOINTS, LINE, POSE
from robocal.control.trapezoid._kernels import LOGARITHM, PROJECTION
from robocal.errors import look_up, require

__all__ = ["PATHS", "ROTATIONS", "SPACES", "MotionLimits", "SafeLimits"]

ROTATIONS: Mapping[str, int] = MappingProxyType({"log": LOGARITHM, "projection": PROJECTION})
SPACES: Mapping[str, int] = MappingProxyType({"pose": POSE, "joints": JOINTS})
PATHS: Mapping[str, int] = MappingProxyType({"line": LINE, "axes": AXES})


@record
class MotionLimits:
    """How a platform moves: speed and acceleration (m/s, m/s2; rad/s, rad/s2), and the gain (1/s) of the loop near the goal, at most one
    per period. It stands once within `stop` (m; `turn_stop` rad) of its goal, and goes again beyond `go`.

    rotation "log" or "projection"; space "pose" or "joints"; path "line" or, each component by itself, "axes". shift: the most that a place
    or a length moves in a period as parameters change (m). Raises ModelError for what is none.
    """

    speed: float = 0.3
    acceleration: float = 0.5
    turn_speed: float = 0.5
    turn_acceleration: float = 1.0
    gain: float = 15.0
    stop: float = 1e-4
    go: float = 5e-4
    turn_stop: float = 3e-4
    turn_go: float = 1.5e-3
    rotation: str = "log"
    space: str = "pose"
    path: str = "line"
    shift: float = 1e-5

    def __post_init__(self) -> None:
        numbers = ("speed", "acceleration", "turn_speed", "turn_acceleration", "gain", "stop", "turn_stop", "shift")
        for key in numbers:
            value = getattr(self, key)
            require(0 < value < math.inf, "not above zero", key=key, found=value, expected="above 0, finite")
        for near, far in (("stop", "go"), ("turn_stop", "turn_go")):
            value, least = getattr(self, far), getattr(self, near)
            require(least <= value < math.inf, "no hysteresis", key=far, found=value, expected=f"{near} or more")
        for key, names in (("rotation", ROTATIONS), ("space", SPACES), ("path", PATHS)):
            look_up(names, getattr(self, key), f"unknown {key}", key)


@record
class SafeLimits:
    """Where a controller stops: rms of lengths that no pose explains (m), a motor's speed beside what was asked (rad/s), and tensions of
    sensors (N), the last two for longer than `patience` (s).

    least, most: None is half the least tension of the robot's limits below and above these, halfway from what is planned to a cable that
    hangs. Raises ModelError for what is none.
    """

    residual: float = 0.1
    follow: float = 20.0
    least: float | None = None
    most: float | None = None
    patience: float = 0.1

    def __post_init__(self) -> None:
        for key in ("residual", "follow", "most", "patience"):
            value = getattr(self, key)
            require(value is None or value > 0, "not above zero", key=key, found=value, expected="above 0")
        least, most = self.least, self.most
        known = least is None or 0 <= least < (math.inf if most is None else most)
        require(known, "no such tension", key="least", found=least, expected="0 or more, below `most`")
