"""`vision detect --sheet`: sheets that the product prints, seen through the lens of its renderer, at known poses."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cli.runs import robocal as run
from scipy.spatial.transform import Rotation

from robocal.errors import ModelError
from robocal.files.marker_search import charuco_markers, find_charuco
from robocal.files.sheet import read_sheet
from robocal.simulation.images import Photograph, render, texture
from robocal.vision.camera import image_of

cv2 = pytest.importorskip("cv2")
SIZE = 640, 480
LENS = np.array([500.0, 500.0, 320.0, 240.0, 0, 0, 0, 0, 0])


def poses(seed, height, spread=0.3):
    """T_camera_sheet of three tilted views."""
    rng, out = np.random.default_rng(seed), np.tile(np.eye(4), (3, 1, 1))
    for k, t in enumerate(out):
        turn = Rotation.from_rotvec(rng.normal(0.0, spread, 3)) * Rotation.from_euler("z", 170.0 * k, degrees=True)
        t[:3, :3] = (Rotation.from_rotvec([np.pi, 0.0, 0.0]) * turn).as_matrix()
        t[:3, 3] = [0.003, -0.002, height]
    return out


def photographs(folder, words, height=0.22, turn=0.3):
    """A sheet as `vision sheet` prints it, three photographs of it, and the poses."""
    folder.mkdir()
    assert run("vision", "sheet", *words.split(), "-o", str(folder / "sheet.pdf")).status == 0
    sheet, there = read_sheet(folder / "sheet.yaml"), poses(4, height, turn)
    (folder / "images").mkdir()
    for k, t in enumerate(there):
        light = Photograph(blur=0.7, noise=1.0)
        image = render([(sheet, t)], LENS, SIZE, light, texture(SIZE, k), np.random.default_rng(k))
        assert cv2.imwrite(str(folder / "images" / f"{k}.png"), image)
    return there


def detect(folder, *words):
    """Rows of corners as (view, marker, u, v, x, y, z), and the codes of remarks."""
    ran = run("vision", "detect", str(folder / "images"), *words, "--json")
    assert ran.status == 0, ran.err
    document = json.loads(ran.out)
    columns = {c["name"]: c["values"] for c in document["corners"]["columns"]}
    names = ("view", "u", "v", "point_x", "point_y", "point_z")
    rows = np.array([[float(x) for x in columns[n]] for n in names]).T
    return rows, columns["marker"], {r["code"] for r in document["remarks"]}


def apart(rows, there):
    """How far (px) corners are from where the poses put the places that are stated for them, in mm."""
    pose = there[rows[:, 0].astype(int)]
    points = np.einsum("kij,kj->ki", pose[:, :3, :3], rows[:, 3:] / 1e3) + pose[:, :3, 3]
    return rows[:, 1:3] - image_of(points, LENS)


@pytest.mark.parametrize(("words", "corners"), [
    ("--pattern grid --paper 130x130 --columns 2 --rows 2 --first 30", 48),
    ("--pattern charuco --paper 130x140 --columns 4 --rows 4 --first 17 --dictionary 4x4_50", 3 * (9 + 32)),
    ("--pattern aprilgrid --paper 120x130 --columns 2 --rows 2", 48),
    ("--pattern checkerboard --paper 130x150 --columns 5 --rows 6", 60),
])  # fmt: skip
def test_a_sheet_says_what_stands_where(tmp_path, words, corners):
    there = photographs(tmp_path / "s", words)
    rows, _, codes = detect(tmp_path / "s", "--sheet", str(tmp_path / "s" / "sheet.yaml"))
    off = apart(rows, there)
    assert len(rows) == corners and np.abs(off).max() < 0.1 and np.sqrt(np.mean(off**2)) < 0.03
    assert not {"size-not-stated", "dictionary-found", "board-turns"} & codes


# obeys: markers-off-sheet
def test_markers_of_another_sheet_are_left_out_until_their_sheet_is_given(tmp_path):
    photographs(tmp_path / "s", "--pattern grid --paper 130x130 --columns 2 --rows 2 --first 30")
    photographs(tmp_path / "t", "--pattern grid --paper 130x130 --columns 2 --rows 2 --first 32")
    rows, marker, codes = detect(tmp_path / "s", "--sheet", str(tmp_path / "t" / "sheet.yaml"))
    assert set(marker) == {32, 33} and len(rows) == 24 and "markers-off-sheet" in codes
    rows, marker, codes = detect(tmp_path / "s", "--sheet", str(tmp_path / "s" / "sheet.yaml"))
    assert set(marker) == {30, 31, 32, 33} and "markers-off-sheet" not in codes


# obeys: board-turns
def test_a_board_that_looks_the_same_turned_by_half_is_said(tmp_path):
    there = photographs(tmp_path / "s", "--pattern checkerboard --paper 130x150 --columns 5 --rows 7")
    rows, _, codes = detect(tmp_path / "s", "--sheet", str(tmp_path / "s" / "sheet.yaml"))
    turned = rows * [1, 1, 1, -1, -1, 1]
    middle = (rows[:, 3:].max(axis=0) + rows[:, 3:].min(axis=0)) * [0, 1, 0]
    turned[:, 3:] += middle
    either = np.minimum(*(np.abs(apart(r, there)).max(axis=1) for r in (rows, turned)))
    assert "board-turns" in codes and either.max() < 0.1
    photographs(tmp_path / "t", "--pattern checkerboard --paper 130x150 --columns 5 --rows 6")
    assert "board-turns" not in detect(tmp_path / "t", "--checker", "5x6", "--square", "20")[2]


@pytest.mark.parametrize("words", ["--dictionary 6x6_50", "--size 40", "--checker 5x6"])
def test_a_sheet_and_what_it_says_are_not_given_together(tmp_path, words):
    photographs(tmp_path / "s", "--pattern marker --paper 130x130")
    told = run(
        "vision",
        "detect",
        str(tmp_path / "s" / "images"),
        "--sheet",
        str(tmp_path / "s" / "sheet.yaml"),
        *words.split(),
    )
    assert told.status == 2 and words.split()[0] in told.err and "--sheet alone" in told.err


def test_a_sheet_of_nothing_is_refused(tmp_path):
    photographs(tmp_path / "s", "--pattern marker --paper 130x130")
    file = tmp_path / "s" / "sheet.yaml"
    file.write_text("robocal: 1\nkind: sheet\nunit: mm\npaper: [210, 297]\n")
    told = run("vision", "detect", str(tmp_path / "s" / "images"), "--sheet", str(file))
    assert told.status == 2 and "sheet.yaml" in told.err


def test_views_that_would_help_most_are_listed_before_a_lens_is_known(tmp_path):
    photographs(tmp_path / "s", "--pattern checkerboard --paper 130x150 --columns 5 --rows 6")
    ran = run(
        "vision", "detect", str(tmp_path / "s" / "images"), "--checker", "5x6", "--json"
    )  # no size: a lens needs none
    further = {c["name"]: c["values"] for c in json.loads(ran.out)["further"]["columns"]}
    assert further["view"] == ["now", *(f"+ {k}" for k in range(1, 11))]
    assert further["sure"] == sorted(further["sure"], reverse=True) and further["sure"][1] < 0.7 * further["sure"][0]
    several = photographs(tmp_path / "g", "--pattern grid --paper 130x130 --columns 2 --rows 2")
    assert len(several) == 3
    ran = run("vision", "detect", str(tmp_path / "g" / "images"), "--dictionary", "6x6_50", "--json")
    assert json.loads(ran.out)["further"] is None  # nobody states where the markers are


def test_of_a_board_that_is_larger_than_stated_no_lines_are_left_out(tmp_path):
    """Inner corners in place of squares: OpenCV's search finds every third line of such a board, and the corners fit no plane."""
    photographs(tmp_path / "s", "--pattern checkerboard --paper 130x150 --columns 5 --rows 6", turn=0.5)
    ran = run("vision", "detect", str(tmp_path / "s" / "images"), "--checker", "4x5", "--square", "20", "--json")
    columns = {c["name"]: np.array(c["values"]) for c in json.loads(ran.out)["corners"]["columns"]}
    for view in set(columns["view"].tolist()):
        of = columns["view"] == view
        places, seen = (np.stack([columns[n][of] for n in names], axis=1) for names in (("point_x", "point_y"), "uv"))
        left = seen - cv2.perspectiveTransform(places[None], cv2.findHomography(places, seen)[0])[0]
        assert np.abs(left).max() < 1, view


@pytest.mark.parametrize(
    "words", ["vision detect . --checker 3x4", "vision sheet --pattern checkerboard --columns 3 --rows 4"]
)
def test_boards_that_opencv_does_not_look_for_are_refused(tmp_path, words):
    assert cv2.imwrite(str(tmp_path / "1.png"), np.zeros((64, 64), np.uint8))
    told = run(*[str(tmp_path) if w == "." else w for w in words.split()])
    assert told.status == 2 and "at least 4" in told.err, told.said


def test_what_was_looked_for_is_a_sentence(tmp_path):
    assert cv2.imwrite(str(tmp_path / "1.png"), np.full((64, 64), 99, np.uint8))
    for words, said in (
        ("--checker 7x9", "a checkerboard of 7 x 9 squares was"),
        ("--dictionary 36h11", "markers of 36h11 were"),
    ):
        told = run("vision", "detect", str(tmp_path), *words.split())
        assert told.status == 3 and f"{said} looked for" in told.said


# obeys: board-other
def test_another_board_than_the_one_that_was_named(tmp_path):
    """Of 4 x 4 squares: the markers of 5 x 5 would be elsewhere; with as many columns more rows are no contradiction."""
    photographs(tmp_path / "a", "--pattern charuco --paper 130x140 --columns 4 --rows 4 --dictionary 4x4_50")
    words = ("--dictionary", "4x4_50", "--square", 24, "--size", 16)
    ran = run("vision", "detect", str(tmp_path / "a" / "images"), "--charuco", "5x5", *words, "--json")
    (said,) = [r for r in json.loads(ran.out)["remarks"] if r["code"] == "board-other"]
    assert "not where a board of 5 x 5 squares has them, but where one of 4 x 4 has them" in said["sentence"]
    for squares in ("4x4", "4x5"):
        ran = run("vision", "detect", str(tmp_path / "a" / "images"), "--charuco", squares, *words, "--json")
        assert "board-other" not in ran.out


def test_a_board_that_is_numbered_from_elsewhere_than_0_needs_its_sheet(tmp_path):
    photographs(tmp_path / "a", "--pattern charuco --paper 130x140 --columns 4 --rows 4 --first 20")
    images, words = str(tmp_path / "a" / "images"), ("--charuco", "4x4", "--dictionary", "6x6_250", "--square", 24)
    ran = run("vision", "detect", images, *words, "--json")
    (said,) = [r for r in json.loads(ran.out)["remarks"] if r["code"] == "board-other"]
    assert "--sheet" in said["advice"]
    (sheet,) = (tmp_path / "a").rglob("*.yaml")
    ran = run("vision", "detect", images, "--sheet", str(sheet), "--json")
    assert ran.status == 0 and "board-other" not in ran.out, ran.said


def test_a_marker_as_large_as_its_square_to_single_precision_has_places():
    """OpenCV's constructor knows single precision, and refuses such a board with a SystemError."""
    places = charuco_markers((5, 7), "6x6_250", False, 1 - 1e-9)
    assert np.allclose(np.ptp(np.array([*places.values()]), axis=1)[:, :2], 1, atol=1e-6)


def test_numbers_that_are_not_those_of_a_board_are_refused():
    with pytest.raises(ModelError, match="knows no such board"):
        find_charuco(np.zeros((64, 64), np.uint8), (5, 7), "6x6_250", False, (1, 2))
