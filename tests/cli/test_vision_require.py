"""`vision require` on the command line: rows of plans, an accuracy that is reached or not, and what cannot be planned."""

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal
from lens_world import LENS, SIZE, turn

from robocal.geometry import so3

GRID = ("--grid", "5x4", "--field", "1000x700")


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """Poses that look down on a field, and a lens that states nothing."""
    place = tmp_path_factory.mktemp("plan")
    rng = np.random.default_rng(3)
    rows = ["x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]"]
    for _ in range(12):
        lean = rng.normal(0, 0.15, 3) * [1, 1, 4]
        at = rng.uniform([-400, -250, 600], [400, 250, 1100])
        rows.append(",".join(f"{v:.6f}" for v in [*at, *np.degrees(so3.log(turn(lean) @ np.diag([1.0, -1.0, -1.0])))]))
    (place / "poses.csv").write_text("\n".join(rows) + "\n")
    numbers = ", ".join(f"{s}: {v}" for s, v in LENS.items())
    (place / "lens.yaml").write_text(
        f"robocal: 1\nkind: lens\nmodel: brown\nimage: {list(SIZE)}\nnumbers: {{{numbers}}}\n"
    )
    return place


def require(world, *words):
    """Status, stdout and stderr."""
    return robocal("vision", "require", str(world / "poses.csv"), "--lens", str(world / "lens.yaml"), *map(str, words))


# obeys: plan-too-coarse
def test_an_accuracy_that_is_not_reached_says_what_would_help(world):
    plain = require(world, *GRID, "--size", "60", "--accuracy", "0.5", "--json")
    assert plain.status == 3 and "plan-too-coarse" in plain.out
    obeyed = require(
        world, *GRID, "--size", "60,120", "--height", "0,150", "--survey", "0.1", "--accuracy", "0.5", "--json"
    )
    assert obeyed.status == 0 and "plan-too-coarse" not in obeyed.out


def test_every_combination_is_a_row_and_a_folder_has_a_page(world, tmp_path):
    out = tmp_path / "needed"
    done = require(world, *GRID, "--size", "60,120", "--height", "0,150", "-o", out)
    assert done.status == 0 and "best of 4 plans" in done.said
    assert {p.name for p in out.iterdir()} == {"require.json", "markers.csv", "report.html"}
    assert "<svg" in (out / "report.html").read_text()
    assert len((out / "markers.csv").read_text().splitlines()) > 10


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ((), "nobody says where the markers will be"),
        (("--grid", "5x", "--field", "1000x700", "--size", "60"), "--grid: not two numbers"),
        (("--grid", "1x1", "--field", "1000x700", "--size", "60"), "one marker is no map"),
        ((*GRID, "--size", "-3"), "not a number that this can be"),
        ((*GRID, "--size", "300"), "markers would overlap"),
        ((*GRID, "--size", "1"), "no pose shows a marker"),
        ((*GRID, "--size", "60", "--tilt", "80"), "from -60 to 60"),
        ((*GRID, "--size", "60", "--tilt=-80"), "from -60 to 60"),
        ((*GRID, "--size", "60,1"), "markers of 1 mm"),
        ((*GRID, "--size", "60", "--image", "2560x2048"), "the lens is of images of another size"),
    ],
)
def test_what_cannot_be_planned_is_said(world, words, found):
    done = require(world, *words)
    assert done.status == 2 and found in done.said


def test_degrees_without_a_unit_are_mended_by_their_header(world, tmp_path):
    """There is no option for units here, so that none is advised."""
    text = (world / "poses.csv").read_text()
    (tmp_path / "poses.csv").write_text(text.replace(" [deg]", ""))
    words = ("--lens", str(world / "lens.yaml"), *GRID, "--size", "60")
    bare = robocal("vision", "require", str(tmp_path / "poses.csv"), *words)
    assert bare.status == 2 and "rz [deg] in the header" in bare.said and "--units" not in bare.said
    (tmp_path / "poses.csv").write_text(text)
    assert robocal("vision", "require", str(tmp_path / "poses.csv"), *words).status == 0
