"""One marker: its four corners from all its pixels, with their covariance."""

from __future__ import annotations

import numpy as np

from robocal._jit import as_kernel_array
from robocal._record import record
from robocal._types import Array
from robocal.vision.camera import project
from robocal.vision.marker._kernels import (
    BLUR,
    LIGHT,
    PRINT,
    SHIFT,
    SIZE,
    choose,
    farthest,
    fit_pixels,
    share_misfits,
    sum_pixels,
)
from robocal.vision.marker.bend import OTHER_LENS, bend_of, ideal_points, without_distortion
from robocal.vision.marker.misfits import (
    PARTS,
    around,
    foreign_pixels,
    glare_pixels,
    parts_of,
    pull_of_parts,
    shares_parts,
)

__all__ = ["SQUARE", "MarkerFit", "fit_marker", "homography"]

# Corners in the order of detectors: top left, top right, bottom right, bottom left; Y down, as in the image.
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
QUIET = 1.0  # cells of quiet zone that every marker has around it
CLEAR = 2.5  # tolerance: blur widths that stay away from its rim: beyond it nobody knows what is seen
SURROUND = 3.0  # grid: px, around it
FIRST_BLUR = 1.0  # px
QUANTUM = 0.3  # grey levels: the step of a camera's numbers, as noise
COARSE, COARSE_STILL = 600, 0.05  # pixels of the first look, and when it ends (px)
STILL, SAME_PIXELS = 3e-3, 0.1  # tolerance: px: corners at rest; corners so little moved that the same pixels are used
ROUNDS = 12  # grid: of pixels and fit; two or three end it
OFF = 12.0  # tolerance: of chi-square with two degrees of freedom: what is in the square was printed off its place (1 of 400 by chance)
NEAR = 2  # grid: px along u and v, within which misfits may be of one cause
OFF_LEAST = 0.03  # tolerance: cells: what is off by less may be the lens, or a sheet that is not flat; a print of 300 dpi is off by so much


@record(eq=False)
class MarkerFit:
    """Corners (4, 2) in pixels, their covariance (8, 8), blur and edge shift (px; white grows), light (6,) in grey levels, noise in grey
    levels (one pixel), how many pixels were used, and where (2,) in cells that which is in the square is, if not in its place."""

    corners: Array
    covariance: Array
    blur: float
    shift: float
    light: Array
    noise: float
    pixels: int
    off: Array


def fit_marker(image: Array, corners: Array, cells: Array, lens: Array | None = None) -> MarkerFit | None:
    """A marker of cells (n, n), 1 white and 0 black, near corners (4, 2) of a grey image (h, w); lens (n,) as in `vision.camera`.
    None where its pixels do not tell.

    Without a lens straight edges are taken as straight, and the covariance carries what a wide lens may bend (`COMMON_LENS`)."""
    grey, box = _box(image, corners, len(cells))
    ideal, slope = without_distortion(box, lens)
    ink = as_kernel_array(cells - 1.0)
    joints = as_kernel_array(np.diff(np.diff(np.pad(ink, 1), axis=0), axis=1))
    p, a = np.zeros(SIZE), np.zeros((SIZE, SIZE))
    p[:8] = homography(SQUARE, corners if lens is None else ideal_points(corners, lens))
    p[BLUR] = FIRST_BLUR
    # Two cells of black around the code: the markers of an AprilGrid, between which there are squares.
    joined = bool((np.concatenate([cells[1], cells[-2], cells[:, 1], cells[:, -2]]) == 0).all())
    inside = np.empty(len(ideal), dtype=bool)
    limit, noise, count, foreign = np.inf, 0.0, 0, np.zeros(len(grey), dtype=bool)
    for step in range(ROUNDS):
        count = choose(ideal, slope, p, p[BLUR], 2 * QUIET / len(cells), CLEAR, joined, inside)
        if step == 0 and count:
            dark, bright = np.percentile(grey[np.flatnonzero(inside)[:: max(count // COARSE, 1)]], [10, 90])
            foreign = glare_pixels(grey, bright, box[2])
        inside &= ~foreign
        number = np.flatnonzero(inside)
        count = len(number)
        if count < 2 * SIZE:
            return None
        some = number[:: max(count // COARSE, 1)] if step == 0 else number
        seen, at, by = (part.take(some, axis=0) for part in (grey, ideal, slope))
        if step == 0:
            p[LIGHT], p[LIGHT + 3], limit = dark, bright - dark, 0.3 * (bright - dark)
        before = p.copy()
        rest = np.empty(len(seen))
        cost = fit_pixels(seen, at, by, p, ink, joints, limit, ROUNDS, STILL if step else COARSE_STILL, PRINT, a, rest)
        if not cost >= 0.0:
            return None
        noise = _noise(cost, rest)
        limit = 3 * max(noise, QUANTUM)
        if step == 0:
            continue
        wrong = foreign_pixels(rest, noise, p[LIGHT + 3])
        if wrong.any():
            marked = np.zeros(len(inside), dtype=bool)
            marked[number[wrong]] = True
            foreign |= around(marked, box[2])
        elif farthest(before, p) < SAME_PIXELS:
            break
    g, size = np.empty(SIZE), PRINT
    sum_pixels(seen, at, by, p, ink, joints, limit, SIZE, g, a, rest)
    try:
        if _is_off(g, a, noise**2) and _is_off(g, a, noise**2 * share_misfits(grey, inside, rest, box[2], limit, NEAR)):
            size = SIZE
            for _ in range(2):  # the noise falls
                cost = fit_pixels(seen, at, by, p, ink, joints, limit, ROUNDS, STILL, SIZE, a, rest)
                if not cost >= 0.0:
                    return None
                noise = _noise(cost, rest)
                limit = 3 * max(noise, QUANTUM)
            sum_pixels(seen, at, by, p, ink, joints, limit, SIZE, g, a, rest)
        inverse = np.linalg.inv(_whole(a)[:size, :size])
    except np.linalg.LinAlgError:
        return None
    found, by_h = corners_of(p[:8])
    spread = noise**2 * (by_h @ inverse[:8, :8] @ by_h.T)
    share = share_misfits(grey, inside, rest, box[2], limit, NEAR)
    if shares_parts(number, rest, box[2], limit):
        # How far the misfits of each part pull the corners, beside how far noise would: the fit has taken a share of both.
        part = parts_of(number, box[2])
        pull, own = np.empty((PARTS**2, size)), np.empty((PARTS**2, size, size))
        for k in range(PARTS**2):
            some = part == k
            sum_pixels(seen[some], at[some], by[some], p, ink, joints, limit, size, g, a, rest[some])
            pull[k], own[k] = g[:size], _whole(a)[:size, :size]
        share = max(share, pull_of_parts(pull, own, by_h @ inverse[:8], inverse) / noise**2)
    spread *= share
    if lens is None:
        # What the fit would be if that lens had moved the pixels: a step from here.
        bent, left = bend_of(at, found, image.shape)
        sum_pixels(seen, as_kernel_array(at - bent), by, p, ink, joints, limit, SIZE, g, a, rest)
        moved = left.ravel() - by_h @ np.linalg.solve(_whole(a)[:size, :size], g[:size])[:8]
        spread += np.outer(moved, moved) + (OTHER_LENS**2 * moved @ moved / 8) * np.eye(8)
    else:
        rays = np.column_stack([(found - lens[2:4]) / lens[:2], np.ones(4)])
        found, by, _ = project(rays, lens)
        turn = np.zeros((8, 8))
        for i in range(4):
            turn[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = by[i, :, :2] / lens[:2]
        spread = turn @ spread @ turn.T
    return MarkerFit(
        found, spread, float(p[BLUR]), float(p[SHIFT]), p[LIGHT:PRINT].copy(), noise, int(count), p[PRINT:].copy()
    )


def _noise(cost: float, rest: Array) -> float:
    """The standard deviation of a pixel by the robust cost and what is left; pixels that are cut off and may be right say nothing."""
    return float(np.sqrt(2 * cost / max(int(np.count_nonzero(rest)) - SIZE, 1)))


def _whole(a: Array) -> Array:
    """A symmetric matrix from its lower triangle."""
    return np.asarray(np.tril(a) + np.tril(a, -1).T)


def _is_off(g: Array, a: Array, variance: float) -> bool:
    """Whether what is in the square has a place of its own that is far, and explains more than chance does (score test).

    Raises LinAlgError.
    """
    a = _whole(a)
    by_rest = np.linalg.solve(a[:PRINT, :PRINT], np.column_stack([a[:PRINT, PRINT:], g[:PRINT]]))
    left = g[PRINT:] - a[PRINT:, :PRINT] @ by_rest[:, 2]
    free = a[PRINT:, PRINT:] - a[PRINT:, :PRINT] @ by_rest[:, :2]
    off = np.linalg.solve(free, left)
    return bool(left @ off > OFF * variance and np.hypot(*off) > OFF_LEAST)


def _box(image: Array, corners: Array, n: int) -> tuple[Array, tuple[int, int, int, int]]:
    """The grey levels of the pixels around a marker of n cells, and where they lie: u0, v0, width, height."""
    h, w = image.shape
    reach = SURROUND + QUIET * 1.5 * np.ptp(corners, axis=0).max() / n
    u0, v0 = np.clip(np.floor(corners.min(axis=0) - reach), 0, (w - 1, h - 1)).astype(int)
    u1, v1 = np.clip(np.ceil(corners.max(axis=0) + reach) + 1, 1, (w, h)).astype(int)
    return as_kernel_array(image[v0:v1, u0:u1].ravel()), (int(u0), int(v0), int(u1 - u0), int(v1 - v0))


def corners_of(h: Array) -> tuple[Array, Array]:
    """Corners (4, 2) of a homography (8,), and their derivatives (8, 8)."""
    points, by = _image(h, SQUARE[:, 0], SQUARE[:, 1])
    return points, by.reshape(8, 8)


def _image(h: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """The image (k, 2) of points of the square, and its derivatives (k, 2, 8) by the homography."""
    w = 1 / (h[6] * x + h[7] * y + 1)
    u, v = (h[0] * x + h[1] * y + h[2]) * w, (h[3] * x + h[4] * y + h[5]) * w
    by = np.zeros((len(x), 2, 8))
    for i, f in enumerate((x, y, np.ones(len(x)))):
        by[:, 0, i] = by[:, 1, 3 + i] = f * w
    for i, f in ((6, x), (7, y)):
        by[:, 0, i], by[:, 1, i] = -u * f * w, -v * f * w
    return np.stack([u, v], axis=1), by


def homography(points: Array, image: Array) -> Array:
    """The eight numbers that take four points (4, 2) to the image (4, 2)."""
    x, y = points.T
    u, v = image.T
    one, none = np.ones(4), np.zeros((4, 3))
    first = np.column_stack([x, y, one, none, -u * x, -u * y])
    second = np.column_stack([none, x, y, one, -v * x, -v * y])
    return np.linalg.solve(np.vstack([first, second]), np.concatenate([u, v]))
