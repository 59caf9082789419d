"""What a camera would show of printed sheets: lens, blur, light, motion and noise, to grey levels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robocal._jit import as_kernel_array, as_kernel_indices
from robocal._record import record
from robocal._scipy import special
from robocal._types import Array, Ints
from robocal.errors import require
from robocal.simulation._kernels import expose
from robocal.vision.camera import fold_radius, model_of
from robocal.vision.sheets import Sheet, patches

__all__ = ["Photograph", "irradiance", "render", "texture"]

SAMPLES = 8  # along a pixel's side, at least
REACH = 4.5  # standard deviations of the blur beyond which nothing is added: 7e-6
PIXEL = 12**-0.5  # standard deviation of a pixel's own square, px
BINS = 48  # places along a side of the paper by which patches are looked up
FULL = 255.0


@record(eq=False)
class Photograph:
    """How an image is taken.

    blur: standard deviation, px; noise: of one pixel, in grey levels before gamma; vignette: share of the light that corners lack; motion:
    of the image while it is exposed, (du, dv) px; white, black: grey levels of paper and print at exposure 1; growth: px by which white
    grows into black; gamma: grey = 255 (light / 255)^gamma; discs (u, v, radius, grey): what hides the sheets; samples: along a pixel.
    """

    blur: float = 0.8
    noise: float = 0.0
    vignette: float = 0.0
    motion: tuple[float, float] = (0.0, 0.0)
    white: float = 200.0
    black: float = 30.0
    growth: float = 0.0
    exposure: float = 1.0
    gamma: float = 1.0
    discs: tuple[tuple[float, float, float, float], ...] = ()
    samples: int = SAMPLES


def render(
    sheets: Sequence[tuple[Sheet, Array]],
    intrinsics: Array,
    size: tuple[int, int],
    photograph: Photograph | None = None,
    background: Array | float = 110.0,
    rng: np.random.Generator | None = None,
) -> NDArray[np.uint8]:
    """The image (h, w) of sheets with their T_camera_sheet (4, 4), through a lens of intrinsics (n,), of size (width, height).

    background (h, w) or one number: grey levels where no sheet is, at exposure 1. Of two sheets the nearer hides the other; the back of a
    sheet is white. Raises ModelError.
    """
    p = photograph or Photograph()
    require(p.noise >= 0, "a noise is a standard deviation", found=p.noise)
    require(p.noise == 0 or rng is not None, "noise needs a generator of random numbers")
    grey = irradiance(sheets, intrinsics, size, p, background)
    if p.noise > 0 and rng is not None:
        grey += rng.normal(0.0, p.noise, grey.shape)
    grey = FULL * (np.clip(grey, 0.0, FULL) / FULL) ** p.gamma
    return np.floor(grey + 0.5).astype(np.uint8)


def irradiance(
    sheets: Sequence[tuple[Sheet, Array]],
    intrinsics: Array,
    size: tuple[int, int],
    photograph: Photograph,
    background: Array | float = 110.0,
) -> Array:
    """The same image (h, w) as light, before noise, gamma, and rounding. Raises ModelError."""
    p, (width, height) = photograph, size
    require(p.samples >= SAMPLES, "too few samples a pixel", found=p.samples, expected=f"{SAMPLES} or more")
    require(p.blur >= 0, "a blur is a standard deviation", found=p.blur)
    light, cover = np.empty((height, width)), np.empty((height, width))
    lens = as_kernel_array(intrinsics)
    reach, wx, wy = weights(p)
    discs = as_kernel_array(np.array(p.discs, dtype=float).reshape(-1, 4))
    levels = np.array([p.black, p.white])
    expose(lens, fold(lens), *arrange(sheets), levels, p.growth, discs, p.samples, reach, wx, wy, light, cover)
    out: Array = light + (1.0 - cover) * background
    out *= p.exposure * falloff(size, p.vignette)
    return out


def texture(size: tuple[int, int], seed: int, mean: float = 110.0, spread: float = 35.0) -> Array:
    """A smooth random background (h, w) of grey levels, with structure of every size."""
    width, height = size
    noise = np.fft.rfft2(np.random.default_rng(seed).normal(size=(height, width)))
    far = np.hypot(np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(width)[None, :])
    far[0, 0] = np.inf
    smooth = np.fft.irfft2(noise / far**1.5, s=(height, width))
    out: Array = np.clip(mean + spread * smooth / smooth.std(), 0.0, FULL)
    return out


def falloff(size: tuple[int, int], vignette: float) -> Array:
    """The light (h, w) that is left: 1 in the middle, 1 - vignette in the corners, with the square of the radius."""
    u, v = (np.arange(n) - (n - 1) / 2 for n in size)
    left: Array = 1.0 - vignette * (u**2 + v[:, None] ** 2) / (u[0] ** 2 + v[0] ** 2)
    return left


def fold(lens: Array) -> float:
    """The square of the slope of a ray at which the lens folds back; infinite where it does not before a right angle."""
    radius = fold_radius(lens)
    if model_of(lens).name == "fisheye":
        radius = np.tan(radius) if radius < np.pi / 2 else np.inf
    return float(radius**2)


def weights(p: Photograph) -> tuple[int, Array, Array]:
    """Pixels that the blur reaches, and the weights (n, taps) of samples about a pixel, in u and v, at n moments of the motion."""
    length = float(np.hypot(*p.motion))
    reach = int(np.ceil(REACH * p.blur + length / 2))
    # As many of Gauss' moments as keep the error below 0.1 grey levels, by what blur and pixel smooth; the most that is needed at 0.3 px.
    node, mass = np.polynomial.legendre.leggauss(2 + int(np.ceil(length / np.hypot(p.blur, PIXEL))) if length else 1)
    mass = mass / mass.sum()
    at = (np.arange((2 * reach + 1) * p.samples) + 0.5) / p.samples - 0.5 - reach
    # The sample's own square has a variance too, which is no blur of the lens.
    sigma = np.sqrt(max(p.blur**2 - 1 / (12 * p.samples**2), 1e-6))
    out = []
    for move in p.motion:
        d = at - node[:, None] * move / 2
        w = special.ndtr((d + 0.5) / sigma) - special.ndtr((d - 0.5) / sigma)
        out.append(w / w.sum(axis=1, keepdims=True))
    return reach, as_kernel_array(out[0]), as_kernel_array(out[1] * mass[:, None])


def arrange(sheets: Sequence[tuple[Sheet, Array]]) -> tuple[Array, Array, Ints, Ints, Ints, Array, Ints, Array]:
    """Sheets as kernels read them: inverse poses, papers, and patches by the places of the paper that they touch."""
    backs: list[Array] = []
    papers: list[list[float]] = []
    boxes: list[list[float]] = []
    bins: list[list[int]] = []
    shapes: list[list[int]] = []
    ink: list[Array] = []
    first: list[int] = [0]
    members: list[int] = []
    filled = 0
    for sheet, pose in sheets:
        backs.append(np.linalg.inv(np.column_stack([pose[:3, 0], pose[:3, 1], pose[:3, 3]])))
        papers.append([sheet.width, sheet.height, float(pose[:3, 2] @ pose[:3, 3] < 0)])
        bins.append([BINS, BINS, len(first) - 1])
        lists: list[list[int]] = [[] for _ in range(BINS * BINS)]
        for patch in patches(sheet):
            rows, columns = patch.values.shape
            # A patch is known a cell and a place around itself: a pixel beside it sees its edge.
            size, margin = (
                np.array([sheet.width, sheet.height]),
                patch.cell + np.array([sheet.width, sheet.height]) / BINS,
            )
            low = (np.array([patch.left, patch.top - rows * patch.cell]) - margin) / size
            high = (np.array([patch.left + columns * patch.cell, patch.top]) + margin) / size
            a = np.clip(np.floor((low + 0.5) * BINS), 0, BINS - 1).astype(int)
            b = np.clip(np.floor((high + 0.5) * BINS), 0, BINS - 1).astype(int)
            for j in range(a[1], b[1] + 1):
                for i in range(a[0], b[0] + 1):
                    lists[j * BINS + i].append(len(boxes))
            boxes.append([patch.left, patch.top, patch.cell])
            shapes.append([rows, columns, filled])
            ink.append(1.0 - patch.values.ravel())
            filled += rows * columns
        for entries in lists:
            members += entries
            first.append(len(members))
    floats = [
        np.array(part, dtype=float).reshape(-1, *shape)
        for part, shape in ((backs, (3, 3)), (papers, (3,)), (boxes, (3,)))
    ]
    whole = [np.array(part, dtype=np.int64).reshape(-1, *shape) for part, shape in ((bins, (3,)), (shapes, (3,)))]
    paper_bins, counts = as_kernel_indices(*whole)
    starts, inside = as_kernel_indices(np.array(first), np.array(members, dtype=np.int64))
    inverse, sizes, places = as_kernel_array(*floats)
    return inverse, sizes, paper_bins, starts, inside, places, counts, as_kernel_array(np.concatenate([*ink, []]))
