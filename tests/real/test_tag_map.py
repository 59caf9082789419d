"""96 tags of unknown place before a camera in a hand, as Apriltag found them; they hang on 16 boards printed as grids of 2 x 3."""

from __future__ import annotations

import csv
import os
from dataclasses import replace

import numpy as np
import pytest
import yaml

import robocal as rc
from robocal.estimate.least_squares import least_squares
from robocal.files.map import read_map
from robocal.geometry.fits import rigid
from robocal.measure.base import problem as build
from robocal.measure.machine import Rig

TAG, PITCH = 0.12, 0.15
# Theirs are counter-clockwise from the bottom left, and the middle of the first pixel is (0.5, 0.5).
ORDER = (3, 2, 1, 0)


@pytest.fixture(scope="module")
def inputs(shared_data, tmp_path_factory):
    """Corners and the lens as files of ours, and the first tag of every board. One view in two, all with ROBOCAL_FULL."""
    source, place = shared_data / "tag-map", tmp_path_factory.mktemp("tag-map")
    with (source / "detections.csv").open() as file:
        rows = list(csv.reader(file))[1:]
    views = sorted({int(r[0]) for r in rows})
    some = set(views if os.environ.get("ROBOCAL_FULL") else views[::2])
    with (place / "corners.csv").open("w") as file:
        out = csv.writer(file)
        out.writerow(["view", "marker", "corner", "u", "v"])
        for row in rows:
            if int(row[0]) in some:
                for corner, i in enumerate(ORDER):
                    u, v = (float(x) - 0.5 for x in row[2 + 2 * i : 4 + 2 * i])
                    out.writerow([row[0], row[1], corner, u, v])
    camera = yaml.safe_load((source / "cameras.yaml").read_text())["cam0"]
    chain = {"cam0": camera | {"distortion_model": "radtan"}}
    (place / "lens.yaml").write_text(yaml.safe_dump(chain))
    bodies = yaml.safe_load((source / "tagslam.yaml").read_text())["bodies"]
    boards = [b["board"]["tag_start_id"] for body in bodies for b in body.values() if b["type"] == "board"]
    return place, boards


def off_grid(known, boards):
    """What the six tags of each board are off the printed grid by, (boards, 6, 3) m: the grid is laid on them."""
    at = {int(n): known.vector[i, :3] for i, n in enumerate(known.names)}
    out = []
    for first in boards:
        there = np.array([at[first + k] for k in range(6)])
        column, row = np.arange(6) % 3, np.arange(6) // 3
        printed = np.stack([column * PITCH, row * PITCH, np.zeros(6)], axis=1)
        t = rigid(printed, there)
        out.append(there - printed @ t[:3, :3].T - t[:3, 3])
    return np.array(out)


def least(fit):
    """The error of all corners, rms of both axes together, that no map, lens, edges and poses of views can be below: least squares of all
    of them, none set aside, none weighed down."""
    (obs,) = fit.need_data.observations
    every = replace(fit.need_data, observations=(replace(obs, used=None),))
    made = build(Rig("map"), every)
    ended = least_squares(made, fit.need_fit.solution.x).x
    left = np.concatenate([r.value.ravel() for r in made.residuals(ended)])
    return float(np.sqrt(np.mean(left**2) * 2))


@pytest.mark.slow
def test_tags_are_where_they_were_printed(inputs):
    """0.41 mm; median 0.11 px; over all 12871 corners rms 0.22 px per axis, 0.31 of both axes, which least squares of all corners has at 0.30: the 0.23
    that is asked over all is that of an axis, or, at 0.18, of both axes without the 44 that were set aside (full)."""
    place, boards = inputs
    made = rc.camera.map(
        place / "corners.csv", lens=place / "lens.yaml", size="120", output=place / "map.yaml", force=True
    )
    result, known, full = made.result, read_map(place / "map.yaml").map, bool(os.environ.get("ROBOCAL_FULL"))
    assert result.trusted and len(known.names) == 96 and len(boards) == 16
    left = 1e3 * np.sqrt(np.mean(np.sum(off_grid(known, boards) ** 2, axis=2)))
    errors, off, used = result.errors, result.off.left, result.off.used
    bound, axis = least(result.fit.decision), float(np.sqrt(np.mean(off**2)))
    print(
        f"asked: 0.44 mm on the grids, median 0.13 px, rms 0.23 px over all\n"
        f"on the grids {left:.3f} mm rms of {'all' if full else 'half of the'} views\n"
        f"{len(off)} corners, {int((~used).sum())} of them set aside; both axes together: median {errors.median:.3f}, "
        f"mean {np.linalg.norm(off, axis=1).mean():.3f}, rms {errors.every:.3f} px; of an axis: rms {axis:.3f}, "
        f"median {np.median(np.abs(off)):.3f} px\n"
        f"without those that were set aside: rms {errors.fitted.rms:.3f} of both, {errors.fitted.rms / np.sqrt(2):.3f} px of an axis; "
        f"of views that were left out {errors.left_out.rms:.3f} px\n"
        f"least squares of all corners, below which no map of this lens comes: rms {bound:.3f} of both, {bound / np.sqrt(2):.3f} px of an axis"
    )
    assert left < (0.44 if full else 0.6)
    assert errors.median < 0.13 and errors.fitted.rms < 0.23 and errors.left_out.rms < 0.23
    assert axis < (0.23 if full else 0.26) and 0.23 < bound <= errors.every
    assert "corners-outside" in {r.code for r in made.remarks}
