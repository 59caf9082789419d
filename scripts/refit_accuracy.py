"""How well corners are found whose lens is not known: `python scripts/refit_accuracy.py [ROW ...] [--views N] [--seed S]`.

Views of a sheet are drawn with a lens of k1 -0.25, detected without it, and fitted again with the lens that they told, as
`robocal vision intrinsics --images` does. A row tells, for markers of 40 to 120 px or of 20 to 40 px, or for a checkerboard:
before     rms of the error of a corner as it was detected, per axis (px)
again      the same after `intrinsics`
known      the same of a fit with the lens that is the truth
ratio      of these two: 1.3 at most
chi2       of the corners that were fitted again, e' C^-1 e by the number of corners' coordinates
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from corner_accuracy import LENS, SIZE, SOFT, USUAL

from robocal._types import Array
from robocal.files.images import family_cells, opencv
from robocal.front import vision
from robocal.geometry import so3
from robocal.measure.sights.correlations import COVARIANCES
from robocal.session.vision.corner_refit import refit_corners
from robocal.session.vision.corner_table import CornerTable, read_corners
from robocal.session.vision.lens_fit import fit_lens, lens_of, plain_lens
from robocal.simulation.images import Photograph, render, texture
from robocal.vision.camera import image_of
from robocal.vision.lenses import Lens
from robocal.vision.sheets import Checker, Marker, Sheet, inner_corners, marker_corners

EDGE, FAMILY = 0.05, "6x6_250"  # m
TILT = 0.6  # rad


class Row(NamedTuple):
    """How many markers or squares there are, how large in pixels, and how they are taken."""

    grid: tuple[int, int]
    sides: tuple[float, float]
    how: dict[str, Any]
    board: bool = False


SHARP = {"blur": 0.5, "noise": 2.0}
ROWS = {
    "sharp": Row((4, 3), (60.0, 110.0), SHARP),
    "usual": Row((4, 3), (60.0, 110.0), USUAL),
    "usual-small": Row((9, 7), (25.0, 40.0), USUAL),
    "soft-small": Row((9, 7), (28.0, 40.0), SOFT),
    "board": Row((9, 6), (45.0, 80.0), USUAL, board=True),
    "board-small": Row((15, 10), (22.0, 38.0), USUAL, board=True),
}


def sheet_of(row: Row) -> Sheet:
    """Markers with two cells between them, or a checkerboard."""
    columns, rows = row.grid
    if row.board:
        return Sheet("board", EDGE * (columns + 2), EDGE * (rows + 2), (), (Checker(columns, rows, EDGE),))
    pitch, cells = 1.25 * EDGE, family_cells(FAMILY, range(columns * rows))
    at = [
        ((k % columns - (columns - 1) / 2) * pitch, ((rows - 1) / 2 - k // columns) * pitch) for k in range(len(cells))
    ]
    markers = tuple(Marker(FAMILY, k, cells[k], *place, EDGE) for k, place in enumerate(at))
    return Sheet("markers", pitch * columns, pitch * rows, markers)


def poses(row: Row, count: int, rng: np.random.Generator) -> Array:
    """T_camera_sheet (count, 4, 4), to all sides."""
    out = np.tile(np.eye(4), (count, 1, 1))
    for k, at in enumerate(out):
        way, depth = 2 * np.pi * k / count, LENS[0] * EDGE / rng.uniform(*row.sides)
        tilt = so3.exp(TILT * rng.uniform(0.5, 1.0) * np.array([np.cos(2.4 * way), np.sin(2.4 * way), 0.0]))
        at[:3, :3] = tilt @ so3.exp(np.array([0.0, 0.0, rng.uniform(-0.5, 0.5)])) @ np.diag([1.0, -1.0, -1.0])
        at[:3, 3] = depth * np.array([0.2 * np.cos(way), 0.15 * np.sin(way), 1.0])
    return out


def errors(table: CornerTable, true: dict[tuple[str, str, int], Array]) -> Array:
    """What every corner is off by, (n, 2) px."""
    ids = table.data.configurations.ids
    keys = zip((ids[c] for c in table.pixels.configuration), table.marker, table.corner.tolist(), strict=True)
    return np.asarray(table.pixels.value - np.array([true[key] for key in keys]))


def measure(row: Row, views: int, seed: int) -> dict[str, float]:
    """What a row tells."""
    rng, sheet, true = np.random.default_rng(seed), sheet_of(row), {}
    with tempfile.TemporaryDirectory() as folder:
        images = Path(folder) / "images"
        images.mkdir()
        for k, at in enumerate(poses(row, views, rng)):
            places = [(str(m.id), marker_corners(m)) for m in sheet.markers]
            places += [("board", inner_corners(c).reshape(-1, 3)) for c in sheet.checkers]
            for name, points in places:
                for n, uv in enumerate(image_of(points @ at[:3, :3].T + at[:3, 3], LENS)):
                    true[f"v{k}", name, n] = uv
            grey = render([(sheet, at)], LENS, SIZE, Photograph(vignette=0.2, **row.how), texture(SIZE, seed + k), rng)
            opencv().imwrite(str(images / f"v{k}.png"), grey)
        corners = Path(folder) / "corners.csv"
        words = {"dictionary": FAMILY, "size": 1e3 * EDGE}
        if row.board:
            words = {"checker": f"{row.grid[0]}x{row.grid[1]}", "square": 1e3 * EDGE}
        vision.detect(str(images), output=str(corners), **words)
        table = read_corners(
            corners, size=None if row.board else 1e3 * EDGE, square=None, checker=None, sheet=None, image=None, exclude=()
        )  # fmt: skip
        plain = plain_lens(SIZE, "brown")

        def fit(one: CornerTable) -> tuple[Any, Lens]:
            made = fit_lens(one, plain)
            return made, lens_of(made, plain, SIZE)

        again, _, lens, _ = refit_corners(table, fit(table)[1], [str(images)], fit)
        truth = Lens.of("brown", LENS.tolist(), SIZE)
        known, _, _, _ = refit_corners(table, truth, [str(images)], lambda t: (None, truth))
    rms = [float(np.sqrt(np.mean(np.square(errors(t, true))))) for t in (table, again, known)]
    chi2 = [weighed(t, errors(t, true), row.board) for t in (table, again)]
    values = (*rms, rms[1] / rms[2], *chi2)
    return dict(
        zip(("before", "again", "known", "ratio", "first", "chi2"), values, strict=True), count=len(table.corner)
    )


def weighed(table: CornerTable, e: Array, board: bool) -> float:
    """chi2 over the number of coordinates, of errors (n, 2)."""
    obs = table.pixels
    if board:
        assert obs.sigma is not None
        return float(np.mean(np.square(e / obs.sigma)))
    c = obs.extra[COVARIANCES].reshape(-1, 8, 8)
    return float(np.einsum("mi,mi->", e.reshape(-1, 8), np.linalg.solve(c, e.reshape(-1, 8, 1))[..., 0])) / e.size


def main() -> None:
    """Prints a line for each row."""
    words = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    words.add_argument("rows", nargs="*", help=f"of {' '.join(ROWS)}; all where none is named")
    words.add_argument("--views", type=int, default=14)
    words.add_argument("--seed", type=int, default=1)
    told = words.parse_args()
    print(f"{'row':12} " + " ".join(f"{h:>7}" for h in ("count", "before", "again", "known", "ratio", "first", "chi2")))
    for name in told.rows or ROWS:
        m = measure(ROWS[name], told.views, told.seed)
        print(f"{name:12} {m.pop('count'):7.0f} " + " ".join(f"{v:7.4f}" for v in m.values()), flush=True)


if __name__ == "__main__":
    main()
