"""Where the frames of instruments, targets and places are, in both directions, for whoever copies them.

    T = (R, t),    T^-1 = (R^T, -R^T t)
    dT = (v, w): t + v, exp(w) R,    dT^-1 = (-R^T v - R^T [t] w, -R^T w)

Sigma of a turn is about the axes of the frame in which the pose is told. Source: Barfoot and Furgale, IEEE T-RO 30 (2014).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.geometry import so3
from robocal.measure.data import Frame
from robocal.measure.machine import Model
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.decision import Decision
from robocal.quantities import Amount, OwnUnit, Value

__all__ = ["FramePose", "FramePosition", "FrameTurn", "LocatedFrame", "locate_frames"]


@record(kw_only=True)
class FramePosition:
    """x, y, z with their standard deviations."""

    unit: OwnUnit
    xyz: list[Value]
    sigma: list[Amount]


@record(kw_only=True)
class FrameTurn:
    """Roll, pitch and yaw, R = Rz(yaw) Ry(pitch) Rx(roll), and the standard deviations of small turns about x, y, z; none where the
    orientation was not fitted."""

    unit: OwnUnit
    rpy: list[Value]
    sigma: list[Amount] | None = None


@record(kw_only=True)
class FramePose:
    """T_parent_child: `child` in coordinates of `parent`; as a quaternion (x, y, z, w) and as roll, pitch, yaw."""

    parent: str
    child: str
    position: FramePosition
    quaternion_xyzw: list[float]
    turn: FrameTurn


@record(kw_only=True)
class LocatedFrame:
    """A frame that was fitted, its pose and the inverse; `aboard`: an instrument that the robot carries."""

    name: str
    pose: FramePose
    inverse: FramePose
    aboard: bool = False


def locate_frames(context: Decision[Model]) -> list[LocatedFrame]:
    """All frames of the data of which something was fitted; of frames alone the tool too."""
    names, covariance = context.spread
    fitted = {n.rpartition(".")[0] for n in context.need_fit.problem.free}
    instruments = {o.frame.name for o in context.need_data.observations if o.frame is not None}
    frames = [f for f in context.frames.values() if f.name in fitted]
    found = [_locate(context, f, names, covariance, f.name in instruments) for f in frames]
    if context.frames_alone and "tool" in fitted:
        found.append(_locate(context, Frame("tool", mount="flange"), names, covariance, False))
    return found


def _locate(
    context: Decision[Model], frame: Frame, names: Sequence[str], covariance: Array, instrument: bool
) -> LocatedFrame:
    own = [f"{frame.name}.{s}" for s in FRAME_SYMBOLS]
    vector = np.array([context.values[n] for n in own])
    r, t = so3.exp(vector[3:]), vector[:3]
    c = np.zeros((6, 6))
    unseen = {c.name for c in context.need_fit.identifiability.combinations if not c.partners}
    at = [i for i, n in enumerate(own) if n in names and n not in unseen]
    known = [names.index(own[i]) for i in at]
    c[np.ix_(at, at)] = covariance[np.ix_(known, known)]
    turned = any(i > 2 for i in at)
    back = np.zeros((6, 6))
    back[:3, :3] = back[3:, 3:] = -r.T
    back[:3, 3:] = -r.T @ so3.skew(t)
    # An instrument that stands on the base is stored the other way round.
    stored = (frame.name, frame.mount) if instrument and frame.mount == "base" else (frame.mount, frame.name)
    one = _pose(*stored, r, t, c, turned)
    other = _pose(*stored[::-1], r.T, -r.T @ t, back @ c @ back.T, turned)
    pose, inverse = (one, other) if stored[1] == frame.name else (other, one)
    return LocatedFrame(name=frame.name, pose=pose, inverse=inverse, aboard=instrument and frame.mount == "tool")


def _pose(parent: str, child: str, r: Array, t: Array, c: Array, turned: bool) -> FramePose:
    sigma = np.sqrt(np.maximum(np.diag(c), 0.0)).tolist()
    w = so3.log(r)
    half = float(np.linalg.norm(w)) / 2
    quaternion = [*(0.5 * np.sinc(half / np.pi) * w).tolist(), float(np.cos(half))]
    rpy = [
        float(np.arctan2(r[2, 1], r[2, 2])),
        float(np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0]))),
        float(np.arctan2(r[1, 0], r[0, 0])),
    ]
    position = FramePosition(unit="m", xyz=t.tolist(), sigma=sigma[:3])
    turn = FrameTurn(unit="rad", rpy=rpy, sigma=sigma[3:] if turned else None)
    return FramePose(parent=parent, child=child, position=position, quaternion_xyzw=quaternion, turn=turn)
