"""Mistakes in the files of a platform with a camera: each is named, and once it is mended nothing is said."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli.runs import shared

EXAMPLE = Path(__file__).parents[2] / "examples" / "cable-camera"
pytestmark = pytest.mark.slow
CODES = {
    "frame-moved",
    "frame-elsewhere",
    "view-of-another",
    "corners-reordered",
    "target-unit",
    "views-shifted",
    "axes-exchanged",
    "image-mirrored",
    "v-upward",
    "copied",
}


def run(folder, rows, words=lambda text: text):
    """The example with other rows of corners, or another pixels.yaml."""
    for name in ("robot.yaml", "lengths.yaml", "lengths.csv"):
        (folder / name).write_text((EXAMPLE / name).read_text())
    head, *table = (EXAMPLE / "pixels.csv").read_text().splitlines()
    changed = rows([line.split(",") for line in table])
    (folder / "pixels.csv").write_text("\n".join([head, *map(",".join, changed)]) + "\n")
    (folder / "pixels.yaml").write_text(words((EXAMPLE / "pixels.yaml").read_text()))
    files = [folder / n for n in ("robot.yaml", "lengths.yaml", "pixels.yaml")]
    return shared("identify", *files, "--no-leave-one-out", "--json")


def identify(folder, rows=lambda rows: rows, words=lambda text: text):
    """How it ended, and what is said of mistakes."""
    ran = run(folder, rows, words)
    every = {r["code"]: r for r in (*ran.document["verdict"]["remarks"], *ran.document["remarks"])}
    return ran.status, {code: r for code, r in every.items() if code in CODES}


def pose(row):
    return int(row[0][1:])


def slide(rows, marker, size, first=15):
    """A marker that looks `size` px to the right from a pose on."""
    return [[*r[:3], f"{float(r[3]) + size:.4f}", r[4]] if r[1] == marker and pose(r) >= first else r for r in rows]


def test_nothing_is_said_of_the_example(tmp_path):
    assert identify(tmp_path) == (0, {})


def test_a_marker_that_moved_half_way_is_named(tmp_path):
    _, told = identify(tmp_path, lambda rows: slide(rows, "m7", 6.0))
    assert set(told) == {"frame-moved"} and "the target m7" in told["frame-moved"]["sentence"]


def test_a_camera_that_was_turned_half_way_is_refused_by_name(tmp_path):
    def turned(rows):
        return [[*r[:3], f"{float(r[3]) + 15:.4f}", r[4]] if pose(r) >= 15 else r for r in rows]

    status, told = identify(tmp_path, turned)
    assert status == 3 and set(told) == {"frame-moved"} and "the instrument eye" in told["frame-moved"]["sentence"]
    assert "from p15 on" in told["frame-moved"]["sentence"]


# obeys: view-of-another
def test_a_view_beside_the_readings_of_the_next_is_named(tmp_path):
    def other(rows):
        return [r for r in rows if pose(r) != 12] + [["p12", *r[1:]] for r in rows if pose(r) == 13]

    _, told = identify(tmp_path, other)
    assert set(told) >= {"view-of-another"}
    assert "the view p12" in told["view-of-another"]["sentence"] and "of p13" in told["view-of-another"]["sentence"]
    assert "view-of-another" not in identify(tmp_path, lambda rows: [r for r in other(rows) if pose(r) != 12])[1]


def test_views_that_are_out_of_step_by_one_are_named(tmp_path):
    status, told = identify(tmp_path, lambda rows: [[f"p{(pose(r) + 1) % 30}", *r[1:]] for r in rows])
    assert status == 3 and "views-shifted" in told


def test_columns_that_are_exchanged_and_images_that_are_mirrored_are_named(tmp_path):
    """Markers and poses started from images that were read so: what undoes it starts anew."""
    status, told = identify(tmp_path, lambda rows: [[*r[:3], r[4], r[3]] for r in rows])
    assert status == 3 and "axes-exchanged" in told
    status, told = identify(tmp_path, lambda rows: [[*r[:3], f"{1279 - float(r[3]):.4f}", r[4]] for r in rows])
    assert status == 3 and "image-mirrored" in told


# obeys: v-upward
def test_rows_that_are_counted_from_below_are_named(tmp_path):
    """How the camera is turned is known to 0.3 deg, so that a mirrored image is no explanation."""

    def upward(rows):
        return [[*r[:4], f"{1023 - float(r[4]):.4f}"] for r in rows]

    status, told = identify(tmp_path, upward)
    assert status == 3 and "v-upward" in told and not {"axes-exchanged", "image-mirrored"} & set(told)
    assert "v-upward" not in identify(tmp_path, lambda rows: upward(upward(rows)))[1]


# obeys: corners-reordered
def test_corners_that_are_counted_the_other_way_round_are_named(tmp_path):
    order = {"0": "3", "1": "2", "2": "1", "3": "0"}

    def reverse(rows):
        return [[*r[:2], order[r[2]], *r[3:]] for r in rows]

    status, told = identify(tmp_path, reverse)
    assert status == 3 and "corners-reordered" in told
    assert identify(tmp_path, lambda rows: reverse(reverse(rows))) == (0, {})


# obeys: target-unit
def test_a_size_in_another_unit_is_named(tmp_path):
    status, told = identify(tmp_path, words=lambda text: text.replace("size: 0.15", "size: 5.9055"))
    assert status == 3 and "inches read as m" in told["target-unit"]["sentence"]


def test_rows_that_stand_twice_are_named(tmp_path):
    _, told = identify(tmp_path, lambda rows: rows + rows[-40:])
    assert set(told) == {"copied"}
    ran = run(tmp_path, lambda rows: rows + rows[300:])
    assert ran.status == 2 and "equal others to the last digit" in ran.said and "332 of 964 rows" in ran.said
