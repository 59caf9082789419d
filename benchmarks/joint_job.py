"""The joint jobs: a platform on eight cables carries a camera over markers on the floor; poses, markers, anchors, zeros of the
length sensors, the camera and where it sits are estimated together. Everything here is made, nothing measured.

Units m, rad, px. Frame vectors are (x, y, z, rotation vector). The first marker is known: it is the frame. What is known before:
the camera's place with a covariance over its six numbers, the lens with a standard deviation each.
"""

from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
SIZE, CORNER, LENGTH = 0.15, 0.3, 2e-3  # of a marker, noise of a corner, noise of a length
CORNERS = SIZE / 2 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
LENS = np.array([900.0, 900.9, 640.0, 512.0, -0.18, 0.09, 5e-4, -4e-4, 0.0])
LENS_PRIOR = np.array([10.0] * 4 + [0.05] * 4)  # fx fy cx cy k1 k2 p1 p2; k3 is zero
EYE = np.array([0.02, 0.01, -0.25, np.pi, 0.0, 0.0])
EYE_SD = np.array([2e-3] * 3 + [5e-3] * 3)
EYE_COVARIANCE = np.outer(EYE_SD, EYE_SD) * (0.7 * np.eye(6) + 0.3)
PLATFORM = np.array([[s * 0.1, t * 0.1, z] for z in (-0.3, 0.3) for s in (1, -1) for t in (1, -1)])
TUNING = {"none": 0.0, "huber": 1.345, "tukey": 4.685}


def rotation(w):
    """Rodrigues for (..., 3)."""
    w = np.asarray(w, float)
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    k = np.zeros((*w.shape[:-1], 3, 3))
    k[..., 0, 1], k[..., 0, 2], k[..., 1, 2] = -w[..., 2], w[..., 1], -w[..., 0]
    k = k - np.swapaxes(k, -1, -2)
    k = k / np.where(angle > 0, angle, 1.0)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def project(points, lens):
    """Pixels (..., 2) of points (..., 3) in the camera's frame, Brown's distortion."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = lens
    x, y = points[..., 0] / points[..., 2], points[..., 1] / points[..., 2]
    r2 = x * x + y * y
    d = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    u = fx * (x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx
    v = fy * (y * d + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy
    return np.stack([u, v], axis=-1)


def corners_seen(views, eye, markers, lens):
    """Pixels (V, M, 4, 2) and which markers each view sees, (V, M)."""
    rv, re, rm = rotation(views[:, 3:]), rotation(eye[3:]), rotation(markers[:, 3:])
    rc = rv @ re
    pc = views[:, :3] + rv @ eye[:3]
    world = np.einsum("mij,cj->mci", rm, CORNERS) + markers[:, None, :3]
    inside = np.einsum("vji,vmcj->vmci", rc, world[None] - pc[:, None, None])
    ahead = inside[..., 2] > 0.1
    uv = project(np.where(ahead[..., None], inside, 1.0), lens)
    steep = np.hypot(inside[..., 0], inside[..., 1]) < np.abs(inside[..., 2])
    held = ((uv > 8) & (uv < [1272, 1016])).all(axis=-1)
    side = np.linalg.norm(uv - np.roll(uv, 1, axis=2), axis=-1).min(axis=-1)
    return uv, (ahead & steep & held).all(axis=-1) & (side > 20)


def make(
    views: int, grid: tuple[int, int], seed: int = 0, gross: float = 0.0, loss: str = "none", room: float = 1.0
) -> dict:
    """One job; `grid` markers on the floor, whose sides are `room` times 4.2 and 3.4 m."""
    rng = np.random.default_rng(seed)
    floor = room * np.array([4.2, 3.4])
    place = [(np.arange(k) + 0.5) / k * s - s / 2 for k, s in zip(grid, floor, strict=True)]
    xy = np.stack(np.meshgrid(*place, indexing="ij"), axis=-1).reshape(-1, 2)
    count = len(xy)
    turn = np.column_stack([rng.normal(scale=5e-3, size=(count, 2)), rng.uniform(-np.pi, np.pi, count)])
    markers = np.column_stack([xy, rng.normal(scale=1.5e-3, size=count), turn])
    markers[:, :2] += rng.uniform(-0.05, 0.05, xy.shape)
    middle = int(np.argmin(np.hypot(*xy.T)))
    markers[[0, middle]] = markers[[middle, 0]]
    reach = np.array([1.5, 1.1]) + (floor - [4.2, 3.4]) / 2
    low, high = np.array([*-reach, 0.9]), np.array([*reach, 2.0])
    at = np.column_stack([rng.uniform(low, high, (views, 3)), rng.normal(scale=0.08, size=(views, 3))])
    half = floor / 2 + [0.35, 0.25]
    anchors = np.array([[s * half[0], t * half[1], z] for z in (2.95, 0.15) for s in (1, -1) for t in (1, -1)])
    eye = EYE.copy()
    off = np.linalg.cholesky(EYE_COVARIANCE) @ rng.normal(size=6)
    true_eye = np.concatenate([eye[:3] + off[:3], vector(rotation(off[3:]) @ rotation(eye[3:]))])
    lens = LENS + np.append(rng.normal(size=8) * LENS_PRIOR * 0.5, 0.0)
    true_anchors = anchors + rng.normal(scale=0.03, size=anchors.shape)
    zeros = rng.normal(scale=0.01, size=8)
    uv, seen = corners_seen(at, true_eye, markers, LENS)
    view, marker = np.nonzero(seen)
    uv = uv[view, marker] + rng.normal(scale=CORNER, size=(len(view), 4, 2))
    wrong = rng.random((len(view), 4)) < gross
    uv[wrong] += rng.normal(scale=20.0, size=(int(wrong.sum()), 2))
    tips = at[:, None, :3] + np.einsum("vij,cj->vci", rotation(at[:, 3:]), PLATFORM)
    length = np.linalg.norm(tips - true_anchors, axis=-1) - zeros + rng.normal(scale=LENGTH, size=(views, 8))

    def moved(frames, shift, angle):
        turned = rotation(rng.normal(scale=angle, size=(len(frames), 3))) @ rotation(frames[:, 3:])
        return np.column_stack([frames[:, :3] + rng.normal(scale=shift, size=(len(frames), 3)), vector(turned)])

    first = moved(markers, 5e-3, 0.01)
    first[0] = markers[0]
    return {
        "views": moved(at, 0.02, 0.01), "markers": first, "eye": eye, "lens": lens, "anchors": anchors, "platform": PLATFORM,
        "view": view, "marker": marker, "uv": uv, "length": length, "corner": CORNER, "sigma": LENGTH, "corners": CORNERS,
        "eye_covariance": EYE_COVARIANCE, "lens_prior": LENS_PRIOR, "loss": loss, "tuning": TUNING[loss],
    }  # fmt: skip


def vector(r):
    """Rotation vectors (..., 3) of rotations (..., 3, 3), also near half a turn."""
    w = np.stack([r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=-1)
    q = np.empty((*r.shape[:-2], 4))
    trace = np.trace(r, axis1=-2, axis2=-1)
    q[..., 0] = np.sqrt(np.maximum(1 + trace, 0)) / 2
    for i in range(3):
        size = np.sqrt(np.maximum(1 + 2 * r[..., i, i] - trace, 0)) / 2
        q[..., 1 + i] = np.copysign(size, w[..., i])
    # Near half a turn the signs come from the symmetric part: those of the largest axis' column.
    flat = q[..., 0] < 1e-6
    if flat.any():
        axis = np.argmax(q[..., 1:] ** 2, axis=-1)
        column = np.take_along_axis(r, axis[..., None, None], axis=-1)[..., 0]
        sign = np.sign(np.where(np.abs(column) > 1e-12, column, 1.0))
        np.put_along_axis(sign, axis[..., None], 1.0, axis=-1)
        q[..., 1:] = np.where(flat[..., None], np.abs(q[..., 1:]) * sign, q[..., 1:])
    size = np.linalg.norm(q[..., 1:], axis=-1)
    angle = 2 * np.arctan2(size, q[..., 0])
    return q[..., 1:] * (angle / np.where(size > 0, size, 1.0))[..., None]


def save(name: str, job: dict) -> Path:
    """The job as a file, by name."""
    path = HERE / ".cache" / "jobs" / f"{name}.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **job)
    return path
