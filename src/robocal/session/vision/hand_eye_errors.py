"""How far off a hand-eye calibration is in mm at the target: in views that were left out, and what is normal for such a robot.

    e_i = | p(T_i) - p(T_i') |,    expected^2 = 3 s_p^2 + 2 (l s_r)^2

p is the middle of the target in the camera: T_i with the robot where it says, T_i' where the view itself puts it. An arm that nobody
calibrated stands off by s_p and s_r, and l is the way from the flange to the target.
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.diagnose.vision_limits import ROBOT_PLACE, ROBOT_TURN
from robocal.fit.free_poses import own_poses
from robocal.geometry import se3
from robocal.measure.base import problem as build
from robocal.measure.machine import Rig
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.decision import Decision
from robocal.prove.judge import Proof
from robocal.prove.statistics import Statistic
from robocal.session.vision.hand_eye_data import EYE
from robocal.session.vision.hand_eye_unknowns import DELAY, SHRINK, flange_at

__all__ = ["HandEyeErrors", "chain_of", "find_errors", "frame_of", "middle_of"]


@record(eq=False)
class HandEyeErrors:
    """Of every view (V,) the error at the target, m, and of its corners, px (NaN of poses, and where it was not left out); the statistic of
    these errors, how views were left out, what is normal, m, and the root mean square of corners along u and v, px. `lost`: they are larger
    than the distance of the target, and mean nothing."""

    each: Array
    corners: Array
    left_out: Statistic | None
    pixels: Statistic | None
    axes: tuple[float, float] | None
    how: str
    normal: float
    lost: bool = False


def frame_of(made: Decision[Rig], name: str) -> Array:
    """The frame (4, 4) as it is stored: T_mount_frame, or T_camera_base of a camera on the base."""
    return np.asarray(se3.from_vector(np.array([[made.values[f"{name}.{s}"] for s in FRAME_SYMBOLS]]))[0])


def middle_of(made: Decision[Rig]) -> tuple[str, Array]:
    """The target that most rows show, and the middle (3,) of its points."""
    obs = made.need_data.observations[0]
    which = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
    most = int(np.bincount(which).argmax())
    if obs.kind == "pose":
        return obs.targets[most].name, np.zeros(3)
    points = obs.extra["point"][which == most]
    return obs.targets[most].name, (points.min(axis=0) + points.max(axis=0)) / 2


def chain_of(camera: Array, target: Array, inhand: bool) -> tuple[Array, Array]:
    """A and B (4, 4) with T_camera_target = A M B, M = T_base_flange or its inverse of a camera in the hand."""
    return (se3.inverse(camera), target) if inhand else (camera, target)


def find_errors(made: Decision[Rig], flange: Array, inhand: bool, target_distance: float = np.inf) -> HandEyeErrors:
    """Of views that were left out one by one, or else of held-out ones; the target is at a `target_distance` (m) in most views."""
    proofs, obs = made.proven.proofs, made.need_data.observations[0]
    name = next((n for n in ("leave_one_out", "k_fold", "held_out") if n in proofs), None)
    target, middle = middle_of(made)
    lever = _lever(made, flange, target, middle, inhand)
    normal = float(np.sqrt(3 * ROBOT_PLACE**2 + 2 * (lever * ROBOT_TURN) ** 2))
    each, corners = np.full(len(flange), np.nan), np.full(len(flange), np.nan)
    if name is None:
        return HandEyeErrors(each, corners, None, None, None, "", normal)
    proof = proofs[name]()
    pixels, axes = None, None
    if obs.kind == "pixels":
        _, after, told = proof.errors("px")
        pixels = Statistic.of(after[told])
        where = np.concatenate([t.configuration for t in made.need_fit.problem.terms])
        many = np.maximum(np.bincount(where[told], minlength=len(flange)), 1)
        corners = np.sqrt(np.bincount(where[told], after[told] ** 2, minlength=len(flange)) / many)
        corners[np.bincount(where[told], minlength=len(flange)) == 0] = np.nan
    each = _at_target(made, proof, flange, target, middle, inhand)
    left = Statistic.of(each[np.isfinite(each)])
    if left is not None and not left.rms <= target_distance:
        none = np.full(len(flange), np.nan)
        return HandEyeErrors(none, none, None, None, None, proof.split.how, normal, lost=True)
    return HandEyeErrors(each, corners, left, pixels, axes, proof.split.how, normal)


def _lever(made: Decision[Rig], flange: Array, target: str, middle: Array, inhand: bool) -> float:
    """The distance from the flange to the target, m: the median over views."""
    place = frame_of(made, target) @ np.append(middle, 1.0)
    if not inhand:
        return float(np.linalg.norm(place[:3]))
    return float(np.median(np.linalg.norm(flange[:, :3, 3] - place[:3], axis=1)))


def _at_target(made: Decision[Rig], proof: Proof, flange: Array, target: str, middle: Array, inhand: bool) -> Array:
    """The error (V,) in m of every view that was left out, by the frames of its round and its own pose."""
    out = np.full(len(flange), np.nan)
    ends = proof.after.x
    if ends is None and len(proof.split) == 1:  # one round: the fit that saw nothing of what was held out
        ends = made.proven.part.solution.x
    if ends is None:
        return out
    table = made.need_fit.problem.table
    free = build(Rig(), made.need_fit.data).with_free(())
    names = free.table.names
    at = [table.index[n] for n in names]
    start = np.repeat(free.start, len(ends), axis=0)
    start[:, : len(names)] = ends[:, at]
    placed, _, _ = own_poses(free, start, proof.split.held_out)
    poses = placed[:, len(names) : len(names) + 6 * len(flange)].reshape(len(ends), len(flange), 6)
    frames = {n: [names.index(f"{n}.{s}") for s in FRAME_SYMBOLS] for n in (EYE, target)}
    columns = made.need_data.configurations.columns
    change, shrink = (ends[:, table.index[n]] if n in table.index else np.zeros(len(ends)) for n in (DELAY, SHRINK))
    enough = free.numbers >= 6  # tolerance: numbers of a pose
    for k, held in enumerate(proof.split.held_out):
        some = np.flatnonzero(held & enough & free.in_use)
        camera, board = (se3.from_vector(ends[k, [at[i] for i in frames[n]]][None])[0] for n in (EYE, target))
        a, b = chain_of(camera, board, inhand)
        own = se3.from_vector(poses[k, some])
        said = flange_at(flange, columns, change[k], shrink[k])[some]
        there = [a @ (se3.inverse(t) if inhand else t) @ b for t in (said, own)]
        robot, image = (t[:, :3, :3] @ middle + t[:, :3, 3] for t in there)
        out[some] = np.linalg.norm(robot - image, axis=1)
    return out
