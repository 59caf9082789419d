"""Which further views of a target would say most of a lens: of poses before the camera, those that make its pixels surest.

    A = (1 - Q Q^T) J_lens / sigma     Q spans the columns of the view's own pose, which nobody knows

Each candidate is a block of the information about the lens; they are chosen one after the other, by criterion I at places all over
the image (see `estimate.selection`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.estimate.criteria import criterion_of
from robocal.estimate.selection import Pool
from robocal.geometry import so3
from robocal.vision.camera import project, unproject

__all__ = ["NextView", "next_views"]

WIDTHS = 0.3, 0.5, 0.75  # grid: of the image's width (or height, where that fills first) that the target fills
TILTS = 0.0, np.radians(40.0)  # grid: of the target about an axis of the image
PLACES = 4, 3  # grid: where the target's middle is in the image
RIM = 0.03  # grid: of the image's width, that corners stay inside
ACROSS = 7, 5  # grid: places at which pixels are to be sure


@record(eq=False)
class NextView:
    """One view: T_camera_target (4, 4); where in the image the target's middle is, from (-1, -1) top left to (1, 1) bottom right; the
    share of the image that the target fills along the side that it fills first; how far it is tilted (rad), and which edge lies away from
    the camera, as a direction (du, dv), (0, 0) where it is not tilted; how sure a pixel is with this view and those before it (px)."""

    pose: Array
    middle: tuple[float, float]
    share: float
    tilt: float
    away: tuple[int, int]
    sure: float


def next_views(
    points: Array,
    poses: Array,
    lens: Array,
    free: Sequence[int],
    expected: Array,
    size: tuple[int, int],
    sigma: float,
    count: int,
) -> tuple[float, tuple[NextView, ...]]:
    """How sure a pixel is now (px, a mean), and the views that would help most, the first first.

    points (n, 3) on a target, m; poses (v, 4, 4) T_camera_target of the views that there are; lens (k,) with the columns that are `free`
    and what these are expected to be off by without data; size: width and height; sigma: of a corner, px.
    """
    columns = list(free)
    tests = _tests(lens, columns, expected, size)
    known = np.eye(len(columns))
    for pose in poses:
        block = _blocks(points, pose[None], lens, columns, expected, sigma)[0]
        known += block.T @ block
    candidates, facts = _candidates(points, lens, size)
    if not len(candidates):
        return _sure(tests, known), ()
    blocks = _blocks(points, candidates, lens, columns, expected, sigma)
    pool = Pool(blocks, criterion_of("I", len(columns), tests), known)
    out: list[NextView] = []
    before, so_far = _sure(tests, known), known
    for i in pool.greedy(min(count, len(candidates))):
        so_far = so_far + blocks[i].T @ blocks[i]
        middle, share, tilt, away = facts[i]
        out.append(NextView(candidates[i], middle, share, tilt, away, _sure(tests, so_far)))
    return before, tuple(out)


def _sure(tests: Array, known: Array) -> float:
    """The mean standard deviation of a pixel (px, both axes together)."""
    c = np.linalg.inv(known)
    return float(np.sqrt(np.mean(np.einsum("tdi,ij,tdj->t", tests, c, tests, optimize=True))))


def _tests(lens: Array, columns: Sequence[int], expected: Array, size: tuple[int, int]) -> Array:
    """How pixels (t, 2) all over the image follow from the numbers of the lens, (t, 2, n)."""
    u, v = np.meshgrid(*(np.linspace(0, n - 1, k) for n, k in zip(size, ACROSS, strict=True)))
    ways = unproject(np.stack([u.ravel(), v.ravel()], axis=1), lens)
    ways = ways[np.isfinite(ways).all(axis=1)]
    return np.ascontiguousarray(project(ways, lens)[2][:, :, columns] * expected)


def _blocks(points: Array, poses: Array, lens: Array, columns: Sequence[int], expected: Array, sigma: float) -> Array:
    """What each view says of the lens beside its own pose, (m, n, n) triangles in units of what is expected."""
    seen = np.einsum("mij,pj->mpi", poses[:, :3, :3], points) + poses[:, None, :3, 3]
    _, by_point, by_lens = project(seen, lens)
    by_pose = np.concatenate([by_point, -by_point @ so3.skew(seen)], axis=-1).reshape(len(poses), -1, 6)
    rows = (by_lens[..., columns] * (expected / sigma)).reshape(len(poses), by_pose.shape[1], -1)
    q = np.linalg.qr(by_pose)[0]
    rows -= q @ (np.swapaxes(q, 1, 2) @ rows)
    return np.ascontiguousarray(np.linalg.qr(rows, mode="r"))


Facts = tuple[tuple[float, float], float, float, tuple[int, int]]


def _candidates(points: Array, lens: Array, size: tuple[int, int]) -> tuple[Array, list[Facts]]:
    """Poses before the camera that show the whole target, and what is to be said of each."""
    centre = (points.max(axis=0) + points.min(axis=0)) / 2
    extent = np.ptp(points[:, :2], axis=0)
    width, height = size
    focal = float(np.sqrt(lens[0] * lens[1]))
    # The target's z towards the camera: x right, y up on it.
    facing = np.diag([1.0, -1.0, -1.0])
    poses, facts = [], []
    for share in WIDTHS:
        far = focal * max(extent[0] / (share * width), extent[1] / (share * height))
        for x in np.linspace(-1, 1, PLACES[0] + 2)[1:-1]:
            for y in np.linspace(-1, 1, PLACES[1] + 2)[1:-1]:
                pixel = np.array([[(width - 1) * (1 + x) / 2, (height - 1) * (1 + y) / 2]])
                way = unproject(pixel, lens)[0]
                for tilt in TILTS:
                    for away in ((0, 0),) if tilt == 0 else ((-1, 0), (1, 0), (0, -1), (0, 1)):
                        # About the axis across this direction, so that the edge that lies there moves away (z forward, v down).
                        turn = so3.exp(np.array([[away[1], -away[0], 0.0]]) * tilt)[0]
                        pose = np.eye(4)
                        pose[:3, :3] = turn @ facing
                        pose[:3, 3] = way * far - pose[:3, :3] @ centre
                        poses.append(pose)
                        facts.append(((float(x), float(y)), share, tilt, away))
    made = np.array(poses)
    seen = np.einsum("mij,pj->mpi", made[:, :3, :3], points) + made[:, None, :3, 3]
    uv = project(seen, lens)[0]
    rim = RIM * width
    inside = (uv >= rim).all(axis=(1, 2)) & (uv[..., 0] <= width - 1 - rim).all(axis=1)
    inside &= (uv[..., 1] <= height - 1 - rim).all(axis=1) & (seen[..., 2] > 0).all(axis=1)
    # Beyond the fold of a lens other directions come back into the image.
    back = unproject(uv.reshape(-1, 2), lens).reshape(seen.shape)
    along = seen / np.linalg.norm(seen, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        inside &= (np.abs(back - along) < 1e-6).all(axis=(1, 2))  # tolerance: of arithmetic
    return made[inside], [f for f, i in zip(facts, inside, strict=True) if i]
