"""Readings of a thing on the tool by an instrument outside, of many trials at once, in one form.

    Y_bk = W_f T(q_b,c) X_t        W: T_frame_base of frame f, X: T_tool_thing of thing t; of a point only Y's place is known

A camera in hand that sees a board is the same with everything inverted: Y^-1 = T_board_base T T_tool_camera.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.geometry import se3, so3
from robocal.measure.bearing import directions
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Mechanism
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["Sights", "rows_of", "sights", "taken", "usable"]

KINDS = ("position", "pose", "spherical")
ROWS = 40  # readings that are enough to tell


@record
class Sights:
    """B trials of k readings: joint values (B, k, n) at each reading, places (B, k, 3) and turns (B, k, 3, 3) that were
    read, whether a turn was read (k,), frame (k,) and thing (B, k) of each; starts (F or T, 4, 4) and what of them is
    free (F or T, 6)."""

    joints: Array
    columns: dict[str, Array]
    place: Array
    turn: Array
    turned: NDArray[np.bool_]
    frame: Ints
    thing: Ints
    frames: Array
    frames_free: NDArray[np.bool_]
    things: Array
    things_free: NDArray[np.bool_]

    @property
    def places(self) -> int:
        """At how many different places the joints stood, in the first trial."""
        return len(np.unique(np.round(self.joints[0], 9), axis=0))

    @property
    def spread(self) -> Array:
        """How far the places that were read spread, (B,) in m: the median distance from their median."""
        away = self.place - np.median(self.place, axis=1, keepdims=True)
        return np.asarray(np.median(np.linalg.norm(away, axis=-1), axis=1))

    def take(self, index: Ints) -> Sights:
        """Some of the trials."""
        own = {name: getattr(self, name)[index] for name in ("joints", "place", "turn", "thing")}
        return replace(self, **own)


def usable(obs: Observations) -> bool:
    """Whether an observation has this form."""
    if obs.kind not in KINDS or obs.frame is None or obs.value.ndim != 2 or obs.second is not None:
        return False
    mounts = {t.mount for t in obs.targets} or {"tool"}
    if obs.frame.mount == "base":
        return mounts == {"tool"}
    return obs.kind == "pose" and mounts == {"base"}


def sights(chain: Mechanism, trials: Sequence[DataSet]) -> Sights | None:
    """The trials in this form, whose observations are alike but for joint values, readings and targets; None where none
    is of this form."""
    first = [i for i, o in enumerate(trials[0].observations) if usable(o)]
    if not first:
        return None
    frames: dict[str, tuple[Array, Array]] = {}
    things: dict[str, tuple[Array, Array]] = {}
    free = set(chain.table.free)
    tool = tuple(f"tool.{s}" in free for s in FRAME_SYMBOLS)
    for data in trials:
        for i in first:
            obs = data.observations[i]
            outer, inner = _ends(obs, tool)
            frames |= {f.name: _start(f, _outside(obs)) for f in outer if f.name not in frames}
            things |= {f.name: _start(f, True) for f in inner if f.name not in things}
    names = {n: i for i, n in enumerate(frames)}, {n: i for i, n in enumerate(things)}
    parts = [[_rows(data, data.observations[i], names, tool) for i in first] for data in trials]
    seen = [trials[0].observations[i] for i in first]
    at = np.concatenate([o.configuration for o in seen])
    columns = {k: v[at] for k, v in trials[0].configurations.columns.items()}
    joints, place, turn, frame, thing = (
        np.stack([np.concatenate([p[j] for p in trial]) for trial in parts]) for j in range(5)
    )
    turned = np.concatenate([np.full(len(o), o.kind == "pose") for o in seen])
    ends = (np.stack(v) for known in (frames, things) for v in zip(*known.values(), strict=True))
    return Sights(joints, columns, place, turn, turned, frame[0], thing, *ends)


def _outside(obs: Observations) -> bool:
    return obs.frame is not None and obs.frame.mount == "base"


def _ends(obs: Observations, tool: tuple[bool, ...]) -> tuple[tuple[Frame, ...], tuple[Frame, ...]]:
    """What stands still and what moves with the tool."""
    assert obs.frame is not None
    if not _outside(obs):
        return obs.targets, (obs.frame,)
    return (obs.frame,), obs.targets or (Frame("tool", free=tool),)


def _start(frame: Frame, stored: bool) -> tuple[Array, Array]:
    t = se3.from_vector(np.array(frame.value))
    return (t if stored else se3.inverse(t)), np.array(frame.free)


def _rows(
    data: DataSet, obs: Observations, names: tuple[dict[str, int], dict[str, int]], tool: tuple[bool, ...]
) -> tuple[Array, Array, Array, Ints, Ints]:
    outer, inner = _ends(obs, tool)
    joints = data.configurations.joints
    assert joints is not None
    own = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
    turn = np.broadcast_to(np.eye(3), (len(obs), 3, 3))
    place = obs.value[:, :3]
    if obs.kind == "spherical":
        place = obs.value[:, :1] * directions(obs.value[:, 1:])
    if obs.kind == "pose":
        turn = so3.exp(obs.value[:, 3:])
    if not _outside(obs):
        turn = np.swapaxes(turn, 1, 2)
        place = -np.einsum("kij,kj->ki", turn, place)
    still, moving = (own if len(end) > 1 else np.zeros_like(own) for end in (outer, inner))
    frame = np.array([names[0][f.name] for f in outer])[still]
    thing = np.array([names[1][f.name] for f in inner])[moving]
    return joints[obs.configuration], np.asarray(place), np.asarray(turn), frame, thing


def rows_of(data: DataSet) -> list[NDArray[np.int64]] | None:
    """Some rows of every instrument that can be looked at; None where they are too few to tell."""
    seen = [i for i, o in enumerate(data.observations) if usable(o)]
    if data.configurations.joints is None or not seen:
        return None
    rng = np.random.default_rng(0)
    each = max(ROWS // len(seen), 12)
    out = [np.zeros(0, dtype=np.int64)] * len(data.observations)
    for i in seen:
        out[i] = np.sort(rng.permutation(len(data.observations[i]))[:each])
    return out if sum(len(r) for r in out) >= limits.HYPOTHESIS_PLACES else None


def taken(data: DataSet, rows: list[NDArray[np.int64]]) -> DataSet:
    """Some rows of every instrument."""
    some = (o.take(r) for o, r in zip(data.observations, rows, strict=True) if len(r))
    return DataSet(data.configurations, tuple(some))
