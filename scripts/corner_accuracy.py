"""How well corners of markers are found in drawn images: `python scripts/corner_accuracy.py [ROW ...] [--count N] [--seed S]`.

Every row draws images with the product's renderer (8 x 8 samples a pixel, noise, blur, a lens with k1 -0.25, texture around the markers),
lets OpenCV find the markers and fits their corners with the lens known. The markers have one cell of quiet zone. A row tells:
rms        of the error of a corner, per axis (px)
outward    mean of the error away from the middle of the marker (px)
shift      the larger of the mean errors of u and v (px)
chi2       mean of e' C^-1 e / 8 with the covariance (8, 8) of each marker
found      share of the markers that are found and fitted
named      share of the images in which a motion is named, by `vision detect` without the lens
blur       mean of the blur that is fitted, less the true one (px)
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from robocal._types import Array
from robocal.diagnose.vision_limits import IMAGE_SMEAR
from robocal.files.image_files import GreyImage
from robocal.files.images import family_cells, opencv
from robocal.files.marker_search import find_markers
from robocal.files.text import InputFile
from robocal.session.vision.target import Target
from robocal.session.vision.views import look_at
from robocal.simulation.images import Photograph, render, texture
from robocal.vision.camera import image_of
from robocal.vision.sheets import Marker, Sheet, marker_corners
from robocal.vision.sightings import METHODS, Sighting, fit_sighting

SIZE = (1040, 780)
LENS = np.array([840.0, 845.0, 521.3, 386.4, -0.25, 0.0, 0.0, 0.0, 0.0])
FAMILIES = ("6x6_250", "36h11")
EDGE = 0.1  # m, of a marker
TILT = 50.0  # deg, at most
SMALL, LARGE = (20.0, 40.0), (40.0, 120.0)  # px: roots of the markers' areas
NEAR = 5.0  # px: what a search may be off by
TEXTURES = 100


class Row(NamedTuple):
    """What is drawn, and what is asked for: rms and bias (px), chi2."""

    sides: tuple[float, float]
    how: dict[str, Any]
    rms: float
    bias: float
    chi2: tuple[float, float] = (0.8, 1.6)
    jpeg: int = 0


SHARP, USUAL, SOFT = {"blur": 0.5, "noise": 2.0}, {"blur": 0.8, "noise": 5.0}, {"blur": 1.5, "noise": 5.0}
ROWS = {
    "sharp": Row(LARGE, SHARP, 0.012, 0.005),
    "usual": Row(LARGE, USUAL, 0.018, 0.01),
    "soft": Row(LARGE, SOFT, 0.035, 0.02),
    "sharp-small": Row(SMALL, SHARP, 0.018, 0.005),
    "usual-small": Row(SMALL, USUAL, 0.035, 0.01),
    "soft-small": Row(SMALL, SOFT, 0.08, 0.02),
    "grown": Row(LARGE, USUAL | {"growth": 0.2}, 0.02, 0.01),
    "gamma": Row(LARGE, USUAL | {"gamma": 0.45}, 0.03, 0.01),
    "jpeg": Row(LARGE, USUAL, 0.018, 0.01, jpeg=75),
    "motion": Row(LARGE, USUAL | {"motion": (3.0, 2.0)}, np.inf, np.inf, (0.0, 2.0)),
}


class Scene(NamedTuple):
    """An image with the numbers and true corners (4, 2) of its markers."""

    grey: Array
    numbers: list[int]
    corners: list[Array]


def scenes(row: Row, family: str, count: int, seed: int) -> Iterator[Scene]:
    """Images with at least `count` markers in all, turned and tilted at random, in a grid of places."""
    rng = np.random.default_rng(seed)
    cells = family_cells(family, range(200))
    pitch = 2.15 * row.sides[1]
    columns, rows = (int(n / pitch) for n in SIZE)
    made = 0
    while made < count:
        sheets, numbers, corners = [], [], []
        for k, number in enumerate(rng.permutation(200)[: columns * rows]):
            middle = (np.array([k % columns, k // columns]) + 0.5) * SIZE / [columns, rows]
            at = place(middle, rng.uniform(*row.sides), rng)
            n = cells.shape[1]
            marker = Marker(family, int(number), cells[number], 0.0, 0.0, EDGE)
            sheets.append((Sheet("one", EDGE * (1 + 2 / n), EDGE * (1 + 2 / n), (marker,)), at))
            corners.append(image_of(marker_corners(marker) @ at[:3, :3].T + at[:3, 3], LENS))
            numbers.append(int(number))
        photograph = Photograph(vignette=0.2, **row.how)
        grey = render(sheets, LENS, SIZE, photograph, texture(SIZE, int(rng.integers(1 << 30))), rng)
        if row.jpeg:
            cv2 = opencv()
            grey = cv2.imdecode(cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, row.jpeg])[1], 0)
        made += len(numbers)
        yield Scene(grey, numbers, corners)


def place(middle: Array, side: float, rng: np.random.Generator) -> Array:
    """A pose (4, 4) at which the marker is seen about a pixel, with an image of area side^2."""
    ray = np.append((middle - LENS[2:4]) / LENS[:2], 1.0)
    for _ in range(8):
        ray[:2] += (middle - image_of(ray, LENS)) / LENS[:2]
    about, spin = rng.uniform(0, 2 * np.pi, 2)
    tilt = np.radians(rng.uniform(0, TILT))
    z = -ray / np.linalg.norm(ray)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    z = np.cos(tilt) * z + np.sin(tilt) * (np.cos(about) * x + np.sin(about) * y)
    x = np.cross([np.cos(spin), np.sin(spin), 0.3], z)
    x /= np.linalg.norm(x)
    at = np.eye(4)
    at[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    far = LENS[0] * EDGE / side
    square = np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * EDGE / 2
    for _ in range(8):
        at[:3, 3] = far * ray
        u, v = image_of(square @ at[:3, :3].T + at[:3, 3], LENS).T
        far *= np.sqrt(0.5 * abs(u @ np.roll(v, 1) - v @ np.roll(u, 1))) / side
    return at


def names_motion(scene: Scene, family: str) -> bool:
    """Whether `vision detect` calls an image smeared."""
    image = GreyImage("one", InputFile(Path("one.png"), ""), scene.grey, scene.grey.astype(float))
    return look_at(image, Target(family)).summary.motion >= IMAGE_SMEAR


def fits(scene: Scene, family: str) -> Iterator[tuple[Array, Sighting | None]]:
    """The true corners of each marker, and what is found of it."""
    levels = scene.grey.astype(float)
    found = find_markers(scene.grey, family)
    for number, corners in zip(scene.numbers, scene.corners, strict=True):
        near = [c for c in found.corners[found.ids == number] if np.abs(c - corners).max() < NEAR]
        cells = family_cells(family, [number])[0]
        yield corners, fit_sighting(levels, number, near[0], cells, LENS) if near else None


def measure(row: Row, family: str, count: int, seed: int) -> dict[str, float]:
    """What a row tells."""
    errors, outward, chi2, blurs, named = [], [], [], [], []
    total = 0
    start = time.process_time()
    for scene in scenes(row, family, count, seed):
        if "motion" in row.how:
            named.append(names_motion(scene, family))
        for corners, one in fits(scene, family):
            total += 1
            if one is None or one.method != METHODS[0]:
                continue
            e = one.place - corners
            away = corners - corners.mean(axis=0)
            errors.append(e)
            outward.append((e * away).sum(axis=1) / np.hypot(*away.T))
            chi2.append(e.ravel() @ np.linalg.solve(one.covariance, e.ravel()) / 8)
            blurs.append(one.blur)
    return {
        "count": total,
        "found": len(errors) / total,
        "rms": float(np.sqrt(np.mean(np.square(errors)))),
        "outward": float(np.mean(outward)),
        "shift": float(np.abs(np.mean(errors, axis=(0, 1))).max()),
        "chi2": float(np.mean(chi2)),
        "blur": float(np.mean(blurs)) - row.how["blur"],
        "named": float(np.mean(named)) if named else np.nan,
        "seconds": time.process_time() - start,
    }


def false_markers(family: str, seed: int) -> int:
    """How many markers are found and fitted in images of texture alone."""
    count = 0
    for k in range(TEXTURES):
        spread = np.random.default_rng(seed + k).uniform(20, 70)
        grey = np.floor(texture(SIZE, seed + k, spread=spread) + 0.5).astype(np.uint8)
        found = find_markers(grey, family)
        for number, corners in zip(found.ids.tolist(), found.corners, strict=True):
            count += fit_sighting(grey.astype(float), number, corners, family_cells(family, [number])[0]) is not None
    return count


def main() -> None:
    """Prints a line for each row and dictionary."""
    words = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    words.add_argument("rows", nargs="*", help=f"of {' '.join(ROWS)} textures; all where none is named")
    words.add_argument("--count", type=int, default=200, help="markers of a row, at least")
    words.add_argument("--seed", type=int, default=1)
    told = words.parse_args()
    names = told.rows or [*ROWS, "textures"]
    head = ("count", "found", "rms", "asked", "outward", "shift", "asked", "chi2", "blur", "named")
    print(f"{'row':12} {'dictionary':10} " + " ".join(f"{h:>7}" for h in head))
    for name in names:
        for family in FAMILIES:
            if name == "textures":
                print(
                    f"{name:12} {family:10} false markers in {TEXTURES} images: {false_markers(family, told.seed)}",
                    flush=True,
                )
                continue
            row = ROWS[name]
            m = measure(row, family, told.count, told.seed)
            values = (
                m["found"],
                m["rms"],
                row.rms,
                m["outward"],
                m["shift"],
                row.bias,
                m["chi2"],
                m["blur"],
                m["named"],
            )
            print(f"{name:12} {family:10} {m['count']:7d} " + " ".join(f"{v:7.4f}" for v in values), flush=True)


if __name__ == "__main__":
    main()
