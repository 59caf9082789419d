"""Cameras that are bolted to the one in the hand: rows of their own through lenses of their own, of one body on the flange.

    T_flange_k = T_flange_camera T_camera_k,    e_i = T_camera_k Y_ki m - Y_i m and the turn of Y_ki beside Y_i

Y_i and Y_ki are poses of the target in views of one moment, m is its middle. Their mean e over n views is tested by
T2 = n e^T S^-1 e, where (n - 6) / (6 (n - 1)) T2 is F(6, n - 6), S with the prior of the rig. Source: Hotelling (1931).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import numpy as np

from robocal import _scipy as scipy
from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.camera_changes import view_poses
from robocal.diagnose.vision_limits import LENS_MATERIAL, RIG_CHANCE
from robocal.errors import ModelError
from robocal.files.camera_rig import FurtherCamera, read_camera_rig
from robocal.files.lens import read_lens
from robocal.files.robot_poses import RobotPoses
from robocal.files.text import InputFile
from robocal.geometry import se3, so3
from robocal.measure.builder import OFFSET
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.corner_table import read_corners
from robocal.session.vision.hand_eye_pair import Pairs, pair_views, some_names
from robocal.vision.lenses import Lens

__all__ = ["RigViews", "contradict_rig", "join_rig", "mount_rig", "open_rig"]

FEWEST = 3  # tolerance: views that both cameras have, where nobody states a place
BESIDE = ("free_lens", "free_delay", "free_size", "arm", "undo_half_turns")


@record(eq=False)
class RigViews:
    """Further cameras with what they saw: rows, the names of their views, and the pose of the robot (v,) of each view."""

    cameras: tuple[FurtherCamera, ...]
    lenses: tuple[Lens, ...]
    rows: tuple[Observations, ...]
    pairs: tuple[Pairs, ...]
    names: tuple[tuple[str, ...], ...]
    files: tuple[InputFile, ...]
    remarks: tuple[Any, ...]


def open_rig(o: Any, robot: RobotPoses, first: Observations, taken: tuple[str, ...]) -> RigViews:
    """Reads the cameras of --rig. Raises InputError."""
    o.refuse(BESIDE, "a rig has one lens for each camera, at stops", "--rig without it")
    if o.camera != "hand":
        raise ModelError(
            "a rig beside the robot is not read", key="--rig", found=f"--camera {o.camera}",
            expected="a rig in the hand; or robocal identify with a data file for each camera",
        )  # fmt: skip
    if o.pair == "time" or first.kind != "pixels":
        found = "--pair time" if o.pair == "time" else "poses of a target"
        raise ModelError(
            "cameras of a rig are read from corners of stops", key="--rig", found=found, expected="corners"
        )
    rig = read_camera_rig(o.rig, taken)
    lenses, rows, pairs, names, files = [], [], [], [], [rig.file]
    said: list[Any] = []
    owners = {os.path.realpath(o.lens): "the first camera", os.path.realpath(o.corners): "the first camera"}
    for camera in rig.cameras:
        for key, file in (("corners", camera.corners), ("lens", camera.lens)):
            owner = owners.setdefault(os.path.realpath(file), camera.frame.name)
            if owner != camera.frame.name:
                message = f"{owner} and {camera.frame.name} have one file of {'a lens' if key == 'lens' else key}"
                expected = "a file of its own for each camera: what one lens is known to says nothing of another"
                raise ModelError(message, key=f"cameras.{camera.frame.name}.{key}", found=file.name, expected=expected)
        table = read_corners(
            camera.corners, size=o.size, square=o.square, checker=o.checker, sheet=o.sheet, image=None if _known(camera) else o.image,
            exclude=(),
        )  # fmt: skip
        read = read_lens(camera.lens, size=table.size)
        lens = read.lens
        if lens.size is not None and lens.size != table.size:
            found, expected = "{} x {}".format(*lens.size), "{} x {} px, as the corners".format(*table.size)
            raise ModelError(
                f"{camera.frame.name}: a lens of images of another size", key="--rig", found=found, expected=expected
            )
        obs = table.pixels
        options = {**obs.options, "camera": camera.frame.name, "intrinsics": lens.numbers, "free": lens.known}
        if lens.known:
            options |= {"known": lens.known, "covariance": lens.covariance}
        mine, theirs = ({t.name for t in some.targets} for some in (obs, first))
        if (mine or theirs) and not mine & theirs:
            raise ModelError(
                f"{camera.frame.name} sees none of the targets of the first camera", key="--rig", found=some_names(sorted(mine)),
                expected="one target at least that both see",
            )  # fmt: skip
        views = table.data.configurations.ids
        found_pairs = pair_views(views, robot, o.pair, named=True)
        lenses.append(replace(lens, size=table.size))
        rows.append(replace(obs, options=options, group=camera.frame.name))
        pairs.append(found_pairs)
        names.append(views)
        files += [*table.files, read.file]
        said += table.remarks
    return RigViews(rig.cameras, tuple(lenses), tuple(rows), tuple(pairs), tuple(names), tuple(files), tuple(said))


def _known(camera: FurtherCamera) -> bool:
    return camera.corners.with_suffix(".json").exists()


def join_rig(rig: RigViews, data: DataSet, pairs: Pairs) -> tuple[DataSet, Pairs]:
    """The data of the first camera with the rows of the others: one configuration for each pose of the robot. Raises ModelError where
    nothing says where a camera is."""
    poses = np.unique(np.concatenate([pairs.pose, *(p.pose for p in rig.pairs)]))
    names: dict[int, str] = {}
    seen = [(pairs.pose, data.configurations.ids)]
    seen += [(p.pose, tuple(own[i] for i in p.view.tolist())) for own, p in zip(rig.names, rig.pairs, strict=True)]
    for where, each in seen:
        for pose, name in zip(where.tolist(), each, strict=True):
            names.setdefault(pose, name)
    at = np.searchsorted(poses, pairs.pose)
    (first,) = data.observations
    rows = [replace(first, configuration=at[first.configuration])]
    for obs, own, views in zip(rig.rows, rig.pairs, rig.names, strict=True):
        number = np.full(len(views), -1, dtype=np.int64)
        number[own.view] = np.searchsorted(poses, own.pose)
        moved = number[obs.configuration]
        kept = np.flatnonzero(moved >= 0)
        rows.append(replace(obs.take(kept), configuration=moved[kept]))
    whole = Configurations(tuple(names[p] for p in poses.tolist()))
    alone = tuple(dict.fromkeys(v for p in (pairs, *rig.pairs) for v in p.views_alone))
    rest = set(pairs.poses_alone).intersection(*(p.poses_alone for p in rig.pairs))
    beside = some_names([c.frame.name for c in rig.cameras])
    left = tuple(p for p in pairs.poses_alone if p in rest)
    both = Pairs(
        np.arange(len(poses)), poses, pairs.method, f"{pairs.description}, beside views of {beside}", alone, left
    )
    return DataSet(whole, tuple(rows)), both


def mount_rig(rig: RigViews, data: DataSet) -> DataSet:
    """The same with every further camera on the frame of the first: where the file has it, else where views of one moment have it. Raises
    ModelError."""
    first, *others = data.observations
    rows = [first]
    for camera, obs in zip(rig.cameras, others, strict=True):
        offset = camera.frame
        one, two = _both(first, obs)
        guess = camera.stated and all(offset.free) and offset.prior is None
        if len(one) < FEWEST and not guess:
            what = "checks" if camera.stated else "says"
            raise ModelError(
                f"nothing {what} where {offset.name} is", key="--rig", found=f"{len(one)} views of moments that both cameras have",
                expected=f"{FEWEST} of them at least, or xyz of a first guess beside free: true",
            )  # fmt: skip
        if not camera.stated:
            offset = replace(offset, value=tuple(se3.to_vector(_middle(one @ se3.inverse(two))[None])[0].tolist()))
        targets = [next((t for t in first.targets if t.name == mine.name), mine) for mine in obs.targets]
        rows.append(replace(obs, frame=first.frame, targets=tuple(targets), options={**obs.options, OFFSET: offset}))
    return replace(data, observations=tuple(rows))


def _both(first: Observations, other: Observations) -> tuple[Array, Array]:
    """Poses of the target that both have most, (n, 4, 4) each, in views of one moment."""
    found = []
    for obs in _of_one(first, other):
        seen = view_poses(obs)
        found.append((seen.configuration, seen.pose))
    (a, one), (b, two) = found
    _, i, j = np.intersect1d(a, b, return_indices=True)
    return one[i], two[j]


def _of_one(first: Observations, other: Observations) -> tuple[Observations, Observations]:
    """The rows of the target that both show most."""
    counts = [
        np.bincount(o.target, minlength=len(o.targets)) if o.target is not None else np.ones(1) for o in (first, other)
    ]
    shares = [
        {t.name: n for t, n in zip(o.targets, c.tolist(), strict=True)}
        for o, c in zip((first, other), counts, strict=True)
    ]
    name = max(shares[0], key=lambda n: min(shares[0][n], shares[1].get(n, 0)))
    out = []
    for obs in (first, other):
        number = next((i for i, t in enumerate(obs.targets) if t.name == name), -1)
        rows = np.arange(len(obs)) if obs.target is None else np.flatnonzero(obs.target == number)
        out.append(replace(obs.take(rows), targets=(), target=None))
    return out[0], out[1]


def _middle(poses: Array) -> Array:
    """The pose (4, 4) in the middle of some (n, 4, 4): the median of places, the mean of turns."""
    return np.asarray(se3.compose(so3.project(poses[:, :3, :3].mean(axis=0)), np.median(poses[:, :3, 3], axis=0)))


def contradict_rig(data: DataSet, middle: Array, normal: float) -> Iterator[Remark]:
    """Cameras that views of one moment have elsewhere than the rig's file, by enough to put a target elsewhere; `middle` (3,) of the
    target, and what is normal, m."""
    first, *others = data.observations
    for obs in others:
        offset = obs.options[OFFSET]
        assert isinstance(offset, Frame)
        if all(offset.free) and offset.prior is None:
            continue
        one, two = _both(first, obs)
        there = se3.from_vector(np.array([offset.value]))[0] @ two
        n, q = len(one), 6
        if n < FEWEST:
            continue
        shift = (there[:, :3, :3] - one[:, :3, :3]) @ middle + there[:, :3, 3] - one[:, :3, 3]
        turn = so3.log(there[:, :3, :3] @ np.swapaxes(one[:, :3, :3], 1, 2))
        off = np.hstack([shift, turn])
        mean, spread = off.mean(axis=0), np.cov(off.T) / n
        if offset.prior is not None:
            spread = spread + _prior_there(offset.prior, one, middle)
        far = float(np.linalg.norm(mean[:3]))
        if n > q:
            square = float(mean @ np.linalg.solve(spread, mean)) * (n - q) / (q * (n - 1))
            chance = float(scipy.special.fdtrc(q, n - q, square))
        else:  # too few for correlations: places alone, alike in all directions
            own = float(np.trace(spread[:3, :3])) / 3
            chance = float(scipy.special.fdtrc(3, 3 * (n - 1), far**2 / (3 * own)))
        if chance < RIG_CHANCE and far > LENS_MATERIAL * normal:
            yield Remark.of(
                Code.RIG_CONTRADICTED, camera=offset.name, shift=Quantity(far),
                turn=Quantity(float(np.linalg.norm(mean[3:])), "rad"), count=n,
            )  # fmt: skip


def _prior_there(prior: tuple[float, ...], seen: Array, middle: Array) -> Array:
    """What a prior of the rig leaves of the place (m) of a target and its turn, (6, 6)."""
    lever = so3.skew(np.median(seen[:, :3, :3] @ middle + seen[:, :3, 3], axis=0))
    move = np.block([[np.eye(3), -lever], [np.zeros((3, 3)), np.eye(3)]])
    return np.asarray(move @ np.diag(np.square(prior)) @ move.T)
