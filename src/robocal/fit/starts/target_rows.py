"""What a closed-form start may look at: the rows of one instrument, and what the nominal machine says of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.geometry import se3
from robocal.measure.data import Frame, Observations
from robocal.measure.machine import Model
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["STARTS", "Start", "TargetRows", "frame_values", "start"]


@record
class TargetRows:
    """Rows of one instrument that share one target.

    `index` (k,) are the rows, `value` (k, d) what they read; `machine` (k, 4, 4) is the nominal T_base_tool at their
    configurations, `other` at the second ones, where the kind compares two.
    """

    model: Model
    obs: Observations
    index: Ints
    value: Array
    target: Frame | None
    machine: Array
    other: Array | None = None

    @cached_property
    def target_pose(self) -> Array:
        """T_tool_target as stated, (4, 4)."""
        return np.eye(4) if self.target is None else se3.from_vector(self.target.value)

    @cached_property
    def points(self) -> Array:
        """Where the nominal machine has the target, on the base, (k, 3)."""
        return self.at(self.machine)[:, :3, 3]

    def at(self, machine: Array) -> Array:
        """T_base_target for a target on the tool or on the base, (k, 4, 4)."""
        if self.target is not None and self.target.mount == "base":
            return np.broadcast_to(self.target_pose, machine.shape)
        return np.asarray(machine @ self.target_pose)

    @property
    def loose(self) -> bool:
        """Whether the place of the target on the tool is to be found."""
        if self.target is not None:
            return self.target.mount == "tool" and any(self.target.free)
        names = [f"tool.{s}" for s in FRAME_SYMBOLS]
        return any(n in self.model.table and self.model.table[n].free for n in names)

    @property
    def outside(self) -> Frame | None:
        """The instrument, where it stands free on the base and watches the tool."""
        frame, target = self.obs.frame, self.target
        if frame is None or frame.mount != "base" or not any(frame.free):
            return None
        return frame if target is None or target.mount == "tool" else None

    def shift_target(self, shift: Array) -> dict[str, float]:
        """The target (or the tool) with a shift (4, 4) behind it."""
        if self.target is not None:
            return frame_values(self.target.name, self.target_pose @ shift)
        nominal = np.array([self.model.table[f"tool.{s}"].value for s in FRAME_SYMBOLS])
        return frame_values("tool", se3.from_vector(nominal) @ shift)


Start = Callable[[TargetRows], list[dict[str, float]]]
STARTS: dict[str, Start] = {}


def start(*kinds: str) -> Callable[[Start], Start]:
    """Registers the start of some kinds of measurement: candidates, each with values by parameter name."""

    def enter(function: Start) -> Start:
        STARTS.update(dict.fromkeys(kinds, function))
        return function

    return enter


def frame_values(owner: str, frame: Array) -> dict[str, float]:
    """The six parameters of a frame (4, 4)."""
    from robocal.geometry._kernels import vector_from_rotation

    vector = np.empty(6)
    vector[:3] = frame[:3, 3]
    vector_from_rotation(np.ascontiguousarray(frame[:3, :3]), vector[3:])
    return {f"{owner}.{s}": v for s, v in zip(FRAME_SYMBOLS, vector.tolist(), strict=True)}
