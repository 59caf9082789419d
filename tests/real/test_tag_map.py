"""96 tags of unknown place before a camera in a hand, as Apriltag found them; they hang on 16 boards printed as grids of 2 x 3."""

from __future__ import annotations

import csv
import json
import os

import numpy as np
import pytest
import yaml
from cli.runs import robocal as run

from robocal.files.map import read_map
from robocal.geometry.fits import rigid

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


@pytest.mark.slow
def test_tags_are_where_they_were_printed(inputs):
    """0.40 mm, median 0.11 px, rms 0.22 px per axis of all 12871 corners, 0.19 px both axes together without 43 gross ones (full)."""
    place, boards = inputs
    ran = run(
        "vision", "map", str(place / "corners.csv"), "--lens", str(place / "lens.yaml"), "--size", "120", "-o", str(place / "map.yaml"),
        "--force",
    )  # fmt: skip
    assert ran.status == 0, ran.said
    told = json.loads((place / "map.json").read_text())
    known = read_map(place / "map.yaml").map
    assert len(known.names) == 96 and len(boards) == 16
    left = 1e3 * np.sqrt(np.mean(np.sum(off_grid(known, boards) ** 2, axis=2)))
    print("on the grids", left, "mm;", told["errors"])
    full = bool(os.environ.get("ROBOCAL_FULL"))
    assert left < (0.44 if full else 0.6)
    errors = told["errors"]
    assert errors["median"] < 0.13 and errors["fitted"]["rms"] < 0.23 and errors["left_out"]["rms"] < 0.23
    assert not full or errors["every"] < 0.23 * np.sqrt(2)
    assert "corners-outside" in {r["code"] for r in told["remarks"]}
