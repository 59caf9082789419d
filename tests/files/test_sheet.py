"""Laws of printed sheets: what the PDF has is what sheet.yaml says, at true scale, and OpenCV finds it."""

from __future__ import annotations

import re
import sys

import numpy as np
import pytest
from cli.runs import robocal

from robocal.errors import InputError
from robocal.files.images import FAMILIES, opencv
from robocal.files.sheet import read_sheet
from robocal.vision.marker.fit import fit_marker
from robocal.vision.sheets import inner_corners, marker_corners, patches

pytest.importorskip("cv2")
DPI = 600
# Options, and how many markers they print; small papers, which a test can look at 600 dpi.
SHEETS = {
    "marker": ("--pattern marker --paper 60x100 --first 17", 1),
    "grid": ("--paper 100x130 --columns 2 --rows 2 --ids 3,200,7,11 --size 20 --pitch 30", 4),
    "tags": ("--paper 120x120 --columns 3 --rows 2 --dictionary 36h11 --border 2", 6),
    "checkerboard": ("--pattern checkerboard --paper 90x110 --columns 5 --rows 6", 0),
    "charuco": ("--pattern charuco --paper 130x140 --columns 4 --rows 4 --dictionary 4x4_50", 8),
    "aprilgrid": ("--pattern aprilgrid --paper 120x120 --columns 3 --rows 3 --first 5", 9),
}


def printed(folder, words):
    """The boxes of the PDF in mm from the middle of the paper with their grey, in the order of printing; the paper; the sheet."""
    ran = robocal("vision", "sheet", *words.split(), "-o", folder / "a.pdf")
    assert ran.status == 0, ran.err
    text = (folder / "a.pdf").read_text()
    paper = np.array([float(v) for v in re.search(r"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", text).groups()]) / 72 * 25.4
    scale, grey, boxes = 1.0, 0.0, []
    for line in text.splitlines():
        if line.endswith(" cm"):
            scale = float(line.split()[0]) / 72 * 25.4
        elif line.endswith(" g"):
            grey = float(line.split()[0])
        elif line.endswith(" re"):
            x, y, w, h = (float(v) * scale for v in line.split()[:4])
            boxes.append((x - paper[0] / 2, y - paper[1] / 2, w, h, grey))
    return np.array(boxes), paper, read_sheet(folder / "a.yaml")


def scan(boxes, paper):
    """The print at 600 dpi, each pixel by the share of it that is covered; (h, w) of grey, and pixels in a mm."""
    per = DPI / 25.4
    w, h = np.round(paper * per).astype(int)
    page = np.full((h, w), 255.0)
    for x, y, width, height, grey in boxes:
        left, top = (x + paper[0] / 2) * per, (paper[1] / 2 - y - height) * per
        a, b = int(max(left, 0)), int(max(top, 0))
        c, d = int(np.ceil(left + width * per)) + 1, int(np.ceil(top + height * per)) + 1
        u, v = np.arange(a, min(c, w)), np.arange(b, min(d, h))
        across = np.clip(np.minimum(left + width * per, u + 1) - np.maximum(left, u), 0, 1)
        along = np.clip(np.minimum(top + height * per, v + 1) - np.maximum(top, v), 0, 1)
        share = along[:, None] * across
        part = page[b : min(d, h), a : min(c, w)]
        part += share * (255.0 * grey - (part if grey else 255.0))
    return np.clip(page, 0, 255).astype(np.uint8), per


@pytest.mark.parametrize("name", SHEETS)
def test_the_pdf_has_what_the_yaml_says(tmp_path, name):
    words, count = SHEETS[name]
    boxes, paper, sheet = printed(tmp_path, words)
    assert np.allclose(paper, [1e3 * sheet.width, 1e3 * sheet.height]) and len(sheet.markers) == count
    # Every cell of every patch has its colour where it says, at its middle and just inside its corners.
    for patch in patches(sheet):
        rows, columns = patch.values.shape
        for i in range(rows):
            for j in range(columns):
                left, top, cell = 1e3 * patch.left, 1e3 * patch.top, 1e3 * patch.cell
                for a, b in ((0.5, 0.5), (0.01, 0.01), (0.99, 0.01), (0.01, 0.99), (0.99, 0.99)):
                    x, y = left + (j + a) * cell, top - (i + b) * cell
                    over = (np.abs(boxes[:, :2] + boxes[:, 2:4] / 2 - [x, y]) <= boxes[:, 2:4] / 2).all(axis=1)
                    inside = [
                        m for m in sheet.markers if np.abs(1e3 * np.array([m.x, m.y]) - [x, y]).max() < 500 * m.size
                    ]
                    if inside and rows != len(inside[0].cells):
                        continue  # of a square with a marker on it
                    assert (boxes[over][-1, 4] if over.any() else 1.0) == patch.values[i, j], (i, j)
    # Sizes of what is printed, to 0.1 %.
    for m in sheet.markers:
        half = 500 * m.size
        low, high = 1e3 * np.array([m.x, m.y]) - half, 1e3 * np.array([m.x, m.y]) + half
        mine = boxes[
            (boxes[:, 4] == 0) & (boxes[:, :2] > low - 1e-3).all(axis=1) & (boxes[:, :2] < high - 1e-3).all(axis=1)
        ]
        span = np.concatenate([mine[:, :2].min(axis=0), (mine[:, :2] + mine[:, 2:4]).max(axis=0)])
        assert np.allclose(span, [*low, *high], atol=1e-3 * half)


@pytest.mark.parametrize("name", SHEETS)
def test_opencv_finds_all_of_the_print_at_600_dpi(tmp_path, name):
    cv2 = opencv()
    boxes, paper, sheet = printed(tmp_path, SHEETS[name][0])
    page, per = scan(boxes, paper)

    def pixels(points):
        return (
            np.stack(
                [(1e3 * points[..., 0] + paper[0] / 2) * per, (paper[1] / 2 - 1e3 * points[..., 1]) * per], axis=-1
            )
            - 0.5
        )

    if sheet.markers:
        family = sheet.markers[0].family
        aruco = cv2.aruco
        parameters = aruco.DetectorParameters()
        parameters.cornerRefinementMethod = aruco.CORNER_REFINE_SUBPIX  # a quarter of a pixel off
        parameters.relativeCornerRefinmentWinSize = 0.3
        parameters.markerBorderBits = 2 if name in ("tags", "aprilgrid") else 1
        dictionary = aruco.getPredefinedDictionary(getattr(aruco, FAMILIES[family]))
        found, ids, _ = aruco.ArucoDetector(dictionary, parameters).detectMarkers(page)
        assert sorted(ids.ravel()) == sorted(m.id for m in sheet.markers)
        for m in sheet.markers:
            corners = found[list(ids.ravel()).index(m.id)][0]
            if name != "aprilgrid":  # its corners touch squares, at which this refinement turns
                assert np.abs(corners - pixels(marker_corners(m))).max() < 1.0
                sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) / per
                assert np.abs(sides.mean() / (1e3 * m.size) - 1) < 1e-3
            elif m in sheet.markers[::4]:
                fitted = fit_marker(page.astype(float), corners.astype(float), m.cells).corners
                assert np.abs(fitted - pixels(marker_corners(m))).max() < 0.5
                sides = np.linalg.norm(fitted - np.roll(fitted, 1, axis=0), axis=1) / per
                assert np.abs(sides.mean() / (1e3 * m.size) - 1) < 1e-3
    if name == "checkerboard":
        (board,) = sheet.checkers
        there, corners = cv2.findChessboardCornersSB(page, (board.columns - 1, board.rows - 1))
        assert there
        corners, true = corners.reshape(-1, 2), pixels(inner_corners(board)).reshape(-1, 2)
        assert min(np.abs(corners - true).max(), np.abs(corners[::-1] - true).max()) < 0.5
    if name == "charuco":
        board = aruco.CharucoBoard(
            (4, 5), float(1e3 * sheet.checkers[0].square), float(1e3 * sheet.markers[0].size), dictionary
        )
        corners, numbers, _, _ = aruco.CharucoDetector(board).detectBoard(page)
        assert len(numbers) == 9
        off = corners.reshape(-1, 2) - pixels(inner_corners(sheet.checkers[0])).reshape(-1, 2)
        assert np.abs(off - off.mean(axis=0)).max() < 0.2
        assert np.abs(off.mean(axis=0)).max() < 0.7  # OpenCV 4.10 has all corners of a ChArUco board half a pixel off


@pytest.mark.parametrize("name", SHEETS)
def test_markers_keep_two_cells_of_white(tmp_path, name):
    boxes, paper, sheet = printed(tmp_path, SHEETS[name][0])
    page, per = scan(boxes, paper)
    for m in sheet.markers if name != "aprilgrid" else ():
        half, cell = 500 * m.size, 1e3 * m.size / len(m.cells)
        x, y = 1e3 * m.x + paper[0] / 2, paper[1] / 2 - 1e3 * m.y
        near, far = (np.round((half + k) * per).astype(int) for k in (0.1, 2 * cell - 0.1))
        u, v = int(x * per), int(y * per)
        around = page[v - far : v + far, u - far : u + far].copy()
        assert around.shape == (2 * far, 2 * far)  # on the paper
        around[far - near : far + near, far - near : far + near] = 255
        assert (around == 255).all()


def test_the_scale_of_a_print_counts(tmp_path):
    _, _, sheet = printed(tmp_path, SHEETS["charuco"][0])
    file = tmp_path / "a.yaml"
    file.write_text(file.read_text().replace("scale: 1 ", "scale: 1.004 "))
    again = read_sheet(file)
    assert again.markers[3].size == pytest.approx(1.004 * sheet.markers[3].size)
    assert again.markers[3].x == pytest.approx(1.004 * sheet.markers[3].x)
    assert again.checkers[0].square == pytest.approx(1.004 * sheet.checkers[0].square)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--size 60", ["60 mm", "at most 40 mm"]),
        ("--pattern checkerboard --square 40", ["at most 26.5 mm"]),
        ("--pattern marker --paper 30x30", ["larger paper"]),
        ("--size 30 --pitch 34", ["at least 37.5 mm"]),
        ("--pattern charuco --square 30 --size 25", ["at most 20 mm"]),
        ("--paper A5", ["A4"]),
        ("--paper 9x9", ["30 to 5000 mm"]),
        ("--dictionary 6x6_200", ["6x6_250"]),
        ("--first 240", ["0 to 249"]),
        ("--ids 1,2", ["20 different numbers"]),
        ("--ids 1,a", ["3,7,12"]),
        ("--pattern checkerboard --first 3", ["checkerboard has no such option"]),
        ("--pattern grib", ["grid"]),
    ],
)
def test_what_cannot_be_printed_is_refused(tmp_path, words, said):
    robocal("vision", "sheet", *words.split(), "-o", tmp_path / "a.pdf").assert_refused(*said)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("robocal: 1", "robocal: 7", "robocal"),
        ("kind: sheet", "kind: sheets", "kind"),
        ("scale: 1 ", "scale: 100 ", "about 1"),
        ("unit: mm", "unit: kg", "length"),
        ("id: 200", "id: 3", "twice"),
        ("id: 200", "id: 250", "0 to 249"),
        ("paper: [100, 130]", "paper: [100]", "two numbers"),
        ("corners: [[-25,", "corners: [[-24,", "upright"),
        ("dictionary:", "dictionry:", "dictionary"),
    ],
)
def test_a_yaml_that_is_wrong_is_refused(tmp_path, old, new, said):
    from robocal.errors import InputError

    printed(tmp_path, SHEETS["grid"][0])
    file = tmp_path / "a.yaml"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(InputError, match=said):
        read_sheet(file)


def test_nothing_is_replaced_and_nothing_is_half_there(tmp_path, monkeypatch):
    words = ["vision", "sheet", "-o", tmp_path / "a.pdf"]
    assert robocal(*words).status == 0
    robocal(*words).assert_refused("--force")
    (tmp_path / "a.pdf").unlink()
    robocal(*words).assert_refused("--force")  # the YAML is there
    assert robocal(*words, "--force").status == 0
    robocal("vision", "sheet", "-o", tmp_path / "a.png").assert_refused(".pdf")
    monkeypatch.setitem(sys.modules, "cv2", None)
    ran = robocal("vision", "sheet", "-o", tmp_path / "b.pdf")
    assert ran.status != 0 and "pip install 'robocal[vision]'" in ran.said and not (tmp_path / "b.pdf").exists()


# The first codes of 36h11 as Kalibr and the AprilTag library have them, by rows from the top left, 1 white.
CODES = (0xD5D628584, 0xD97F18B49)
APRILGRID = "target_type: 'aprilgrid'\ntagCols: 3\ntagRows: 2\ntagSize: 0.02\ntagSpacing: 0.3\n"
BOARD = "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 4\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.06\n"


def test_an_aprilgrid_is_what_kalibr_draws(tmp_path):
    """Codes upright, two cells of black, numbers by rows from the bottom left, gaps and squares of tagSpacing tagSize."""
    boxes, paper, ours = printed(tmp_path, "--pattern aprilgrid --paper 120x120 --columns 3 --rows 2 --size 20")
    (tmp_path / "grid.yaml").write_text(APRILGRID)
    theirs = read_sheet(tmp_path / "grid.yaml")
    for one, other in zip(ours.markers, theirs.markers, strict=True):
        shift = np.array([ours.markers[0].x - theirs.markers[0].x, ours.markers[0].y - theirs.markers[0].y, 0.0])
        assert one.id == other.id and np.abs(marker_corners(one) - marker_corners(other) - shift).max() < 1e-9
    assert theirs.markers[1].x - theirs.markers[0].x == pytest.approx(0.026)
    assert theirs.markers[3].y - theirs.markers[0].y == pytest.approx(0.026)
    assert {round(e, 9) for *_, e in theirs.squares} == {0.006} and len(theirs.squares) == 12
    seen, per = scan(boxes, paper)
    for m, code in zip(ours.markers, CODES, strict=False):
        at = (np.arange(6) - 2.5) * 0.02 / 10
        u, v = (
            ((1e3 * (m.x + at) + paper[0] / 2) * per).astype(int),
            ((paper[1] / 2 - 1e3 * (m.y - at)) * per).astype(int),
        )
        bits = (seen[np.ix_(v, u)] > 127).astype(int).ravel()
        assert int("".join(map(str, bits)), 2) == code


def test_targets_of_kalibr_are_sheets_and_what_is_wrong_is_named(tmp_path):
    (tmp_path / "a.yaml").write_text(BOARD)
    (board,) = read_sheet(tmp_path / "a.yaml").checkers
    assert (board.columns, board.rows, board.square) == (7, 5, 0.06)
    wrong = {
        "rectangles": BOARD.replace("colSpacingMeters: 0.06", "colSpacingMeters: 0.05"),
        "circlegrid": BOARD.replace("checkerboard", "circlegrid"),
        "tagSpacing": APRILGRID.replace("0.3", "6"),
        "tagCols": APRILGRID.replace("tagCols: 3", "tagCols: 150").replace("tagRows: 2", "tagRows: 150"),
    }
    for word, text in wrong.items():
        (tmp_path / "b.yaml").write_text(text)
        with pytest.raises(InputError, match=word):
            read_sheet(tmp_path / "b.yaml")
