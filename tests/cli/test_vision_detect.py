"""`vision detect`: images that the tests draw, corners that they know."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest
from cli.runs import robocal as run
from printed import image_of, paper, places

from robocal.files.dataset import read_datasets
from robocal.measure.machine import Rig

cv2 = pytest.importorskip("cv2")
TILT = np.array([[1.0, 0.08, 40.0], [-0.05, 1.02, 45.0], [1e-4, 2e-4, 1.0]])


def cells_of(family, number):
    from robocal.files.images import family_cells

    return family_cells(family, [number])[0]


def grid(family, numbers, cell=6.0, gap=30.0):
    """Markers side by side, and the corners of each."""
    sheet, corners, left = None, {}, 0.0
    for n in numbers:
        cells = cells_of(family, n)
        sheet = paper(cells, left, 0.0, cell, sheet)
        side = len(cells) * cell
        corners[n] = np.array([[left, 0], [left + side, 0], [left + side, side], [left, side]])
        left += side + gap
    return sheet, corners


def save(folder, name, image):
    folder.mkdir(exist_ok=True)
    assert cv2.imwrite(str(folder / name), image)
    return folder / name


def detect(*words):
    """The document of a run, and its status."""
    ran = run("vision", "detect", *words, "--json")
    return json.loads(ran.out), ran.status


def codes(document):
    return {r["code"] for r in document["remarks"]}


@pytest.fixture(scope="module")
def sheets(tmp_path_factory):
    """Three images of four markers of 6x6_250."""
    folder = tmp_path_factory.mktemp("sheets")
    sheet, corners = grid("6x6_250", (3, 17, 40, 201))
    for k in (1, 2, 10):
        h = TILT @ np.array([[1, 0, 2.3 * k], [0, 1, 1.7 * k], [0, 0, 1.0]])
        save(folder, f"img{k}.png", image_of(sheet, h, 400, 160, seed=k))
    return folder, corners


def test_corners_are_where_they_were_drawn_and_pixels_reads_them(sheets, tmp_path):
    folder, corners = sheets
    ran = run("vision", "detect", str(folder), "--size", 48, "-o", str(tmp_path / "cam.csv"))
    assert ran.status == 0, ran.err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cam.csv", "cam.html", "cam.json"]
    rows = list(csv.DictReader(io.StringIO((tmp_path / "cam.csv").read_text())))
    assert list(dict.fromkeys(r["view"] for r in rows)) == ["img1", "img2", "img10"]  # not img1, img10, img2
    assert len(rows) == 3 * 4 * 4 and {r["method"] for r in rows} == {"all pixels"}
    apart = []
    for r in rows:
        k = int(r["view"][3:])
        h = TILT @ np.array([[1, 0, 2.3 * k], [0, 1, 1.7 * k], [0, 0, 1.0]])
        apart.append(
            np.array([float(r["u [px]"]), float(r["v [px]"])]) - places(h, corners[int(r["marker"])])[int(r["corner"])]
        )
    assert np.sqrt(np.mean(np.square(apart))) < 0.015 and np.abs(np.mean(apart, axis=0)).max() < 0.005
    (tmp_path / "data.yaml").write_text(
        "robocal: 1\nkind: pixels\nfile: cam.csv\nunits: {length: mm, angle: deg}\ntarget: marker\n"
        "pixels: {columns: [u, v], sigma: {columns: [su, sv]}}\ncorners: {column: corner, size: 48}\n"
        "camera: {name: lens, fx: 300, fy: 300, cx: 200, cy: 80, free: true}\n"
        "frame: {name: camera, free: true, mount: base}\nconfiguration: {id: view}\n"
    )
    read = read_datasets([str(tmp_path / "data.yaml")], Rig())
    (pixels,) = read.dataset.observations
    assert (
        pixels.kind == "pixels"
        and len(pixels.value) == 48
        and read.dataset.configurations.ids == ("img1", "img2", "img10")
    )
    assert "data:image/jpeg" in (tmp_path / "cam.html").read_text()
    again = run("vision", "detect", str(folder), "-o", str(tmp_path / "cam.csv"))
    assert again.status == 2 and "cam.csv" in again.err


@pytest.mark.parametrize(("family", "numbers", "smallest"), [
    ("6x6_1000", (3, 17, 40), "6x6_50"), ("4x4_250", (5, 120), "4x4_250"), ("36h11", (0, 400), "36h11"), ("7x7_1000", (10, 700), "7x7_1000"),
])  # fmt: skip
def test_the_dictionary_is_found(tmp_path, family, numbers, smallest):
    sheet, _ = grid(family, numbers)
    for k in range(3):
        save(tmp_path, f"{k}.png", image_of(sheet, TILT, 330, 170, seed=k))
    told, status = detect(str(tmp_path))
    assert status == 0 and told["target"]["dictionary"] == smallest
    assert {"dictionary-found", "size-not-stated"} <= codes(told) and told["target"]["size"] is None


def test_numbers_of_any_image_count_for_the_dictionary(tmp_path):
    few, _ = grid("6x6_1000", (3, 17))
    more, _ = grid("6x6_1000", (3, 90))
    for k in range(5):
        save(tmp_path, f"{k}.png", image_of(more if k == 1 else few, TILT, 300, 160, seed=k))
    told, _ = detect(str(tmp_path))
    assert told["target"]["dictionary"] == "6x6_100" and {
        c["name"]: set(c["values"]) for c in told["corners"]["columns"]
    }["marker"] == {3, 17, 90}


def test_noise_is_no_target(tmp_path):
    for k in range(3):
        save(tmp_path, f"{k}.png", np.random.default_rng(k).integers(0, 255, (700, 900)).astype(np.uint8))
    told, status = detect(str(tmp_path))
    assert status == 3 and told["target"]["kind"] == "none" and told["corners"]["columns"][0]["values"] == []


def test_a_wrong_dictionary_is_told_the_right_one(sheets):
    told, status = detect(str(sheets[0]), "--dictionary", "5x5_100")
    said = next(r for r in told["remarks"] if r["code"] == "other-dictionary")
    assert status == 3 and said["numbers"]["better"] == "6x6_250"
    assert detect(str(sheets[0]), "--dictionary", said["numbers"]["better"])[1] == 0


def checker(columns, rows, cell):
    cells = (np.indices((rows, columns)).sum(axis=0) % 2).astype(float)
    inner = np.array([(i * cell, j * cell) for j in range(1, rows) for i in range(1, columns)], dtype=float)
    return paper(cells, 0.0, 0.0, cell), inner


@pytest.mark.parametrize("words", [(), ("--checker", "8x6")])
def test_a_checkerboard(tmp_path, words):
    sheet, inner = checker(8, 6, 20.0)
    for k in range(2):
        save(tmp_path, f"{k}.png", image_of(sheet, TILT, 260, 220, seed=k))
    told, status = detect(str(tmp_path), "--square", 20, *words)
    assert status == 0 and told["target"]["squares"] == [8, 6]
    columns = {c["name"]: c["values"] for c in told["corners"]["columns"]}
    assert len(columns["u"]) == 2 * 35
    found = np.column_stack([columns["u"], columns["v"]])
    true = places(TILT, inner)
    # The board looks the same turned by half: corners are numbered from either end.
    apart = min((found[:35] - order for order in (true, true[::-1])), key=lambda d: np.abs(d).max())
    assert np.sqrt(np.mean(apart**2)) < 0.02
    assert np.ptp(columns["point_x"]) == pytest.approx(120) and np.ptp(columns["point_y"]) == pytest.approx(80)


def test_a_charuco_board(tmp_path):
    board = cv2.aruco.CharucoBoard((5, 4), 24, 14, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_50))
    drawn = board.generateImage((5 * 96, 4 * 96)) / 255.0
    save(tmp_path, "board.png", image_of(paper(drawn, 0, 0, 0.5), TILT, 330, 290))
    told, status = detect(str(tmp_path), "--charuco", "5x4", "--dictionary", "6x6_50", "--square", 48, "--size", 28)
    assert status == 0
    columns = {c["name"]: c["values"] for c in told["corners"]["columns"]}
    found, points = (
        np.column_stack([columns["u"], columns["v"]]),
        np.column_stack([columns["point_x"], columns["point_y"]]),
    )
    assert columns["marker"].count("board") == 12 and len(found) == 12 + 10 * 4
    true = places(TILT, points * [1, -1] + [120, 96])  # y up, about the middle
    assert np.abs(found - true).max() < 0.15  # OpenCV draws to half a pixel of its own


def test_what_is_wrong_is_named(tmp_path):
    sheet, _ = grid("6x6_250", (3, 17))
    twin, _ = grid("6x6_250", (3, 3, 5))
    plain = image_of(sheet, TILT, 300, 160)
    save(tmp_path, "a.png", plain)
    told, status = detect(
        str(tmp_path / "a.png"), str(save(tmp_path, "b.png", plain[:150, :290])), "--dictionary", "6x6_250"
    )
    assert status == 3 and "image-sizes-differ" in codes(told)
    told, status = detect(str(save(tmp_path, "c.png", plain[:, ::-1])), "--dictionary", "6x6_250")
    assert status == 3 and {"mirrored-image", "no-target-found"} <= codes(told) and told["views"][0]["mirrored"]
    told, status = detect(str(save(tmp_path, "d.png", image_of(twin, TILT, 320, 160))), "--dictionary", "6x6_250")
    assert "two-of-one-number" in codes(told) and set(told["corners"]["columns"][1]["values"]) == {5}
    white = image_of(sheet, TILT, 300, 160, bright=290)
    assert "image-overexposed" in codes(detect(str(save(tmp_path, "e.png", white)))[0])
    save(tmp_path, "f.png", np.full((160, 300), 128, np.uint8))
    told, status = detect(str(tmp_path / "a.png"), str(tmp_path / "f.png"))
    assert status == 0 and next(r for r in told["remarks"] if r["code"] == "no-marker-in-view")["numbers"]["views"] == [
        "f"
    ]
    told, status = detect(str(tmp_path / "f.png"))
    assert status == 3 and codes(told) == {"no-target-found"} and told["corners"]["columns"][0]["values"] == []
    other, _ = grid("6x6_250", (90, 91))
    told, _ = detect(str(tmp_path / "a.png"), str(save(tmp_path, "g.png", image_of(other, TILT, 300, 160))))
    assert "markers-apart" in codes(told) and sorted(map(sorted, told["islands"])) == [[3, 17], [90, 91]]
    lone, _ = grid("6x6_250", (3,))
    told, _ = detect(str(tmp_path / "a.png"), str(save(tmp_path, "h.png", image_of(lone, TILT, 300, 160))))
    assert next(r for r in told["remarks"] if r["code"] == "one-marker-in-view")["numbers"]["views"] == ["h"]
    shift = np.array([[1, 0, -38.0], [0, 1, 0], [0, 0, 1]])
    told, _ = detect(str(save(tmp_path, "i.png", image_of(sheet, shift @ TILT, 300, 160))))
    assert "markers-at-border" in codes(told)


@pytest.mark.parametrize(("smear", "wanted"), [((0, 0), False), ((3.6, 2.2), True), ((0, 5.0), True)])
def test_a_motion_is_told_from_a_blur(tmp_path, smear, wanted):
    sheet, _ = grid("6x6_250", (3, 17), cell=8.0)
    blur = 0.7 if wanted else 1.6
    told, _ = detect(str(save(tmp_path, "a.png", image_of(sheet, TILT, 340, 180, blur=blur, smear=smear))))
    assert ("motion-blur" in codes(told)) is wanted
    if wanted:
        (view,) = told["views"]
        assert view["motion"] == pytest.approx(np.hypot(*smear), rel=0.3)  # a box law is taken for a normal one
        assert abs((view["direction"] - np.degrees(np.arctan2(smear[1], smear[0])) + 90) % 180 - 90) < 12


def test_wrong_words_and_no_opencv(sheets, tmp_path, monkeypatch):
    folder = str(sheets[0])
    for words, said in (
        (["--dictionary", "6x6_25"], "6x6_250"),
        (["--charuco", "5x7"], "--dictionary"),
        (["--checker", "8"], "10x8"),
        (["--checker", "8x6", "--dictionary", "36h11"], "--charuco"),
        (["-o", str(tmp_path / "c.json")], ".csv"),
    ):
        ran = run("vision", "detect", folder, *words)
        assert ran.status == 2 and said in ran.err, ran.err
    monkeypatch.setitem(__import__("sys").modules, "cv2", None)
    ran = run("vision", "detect", folder)
    assert ran.status == 2 and "robocal[vision]" in ran.err


# obeys: marker-has-two-poses
def test_one_marker_that_faces_the_camera_has_two_poses(tmp_path):
    sheet, _ = grid("6x6_250", (3,), cell=9.0)
    both, _ = grid("6x6_250", (3, 17), cell=9.0)
    steep = np.array([[0.62, 0.1, 40.0], [-0.05, 1.0, 30.0], [-4.5e-3, 2e-4, 1.0]])
    words = ("--dictionary", "6x6_250", "--size", 72)
    for name, image, wanted in (
        ("a", image_of(sheet, TILT, 260, 200), True),
        ("b", image_of(sheet, steep, 260, 200), False),  # turned by more
        ("c", image_of(both, TILT, 330, 200), False),  # several of one sheet
    ):
        told, status = detect(str(save(tmp_path, f"{name}.png", image)), *words)
        (view,) = told["views"]
        assert status == 0 and ("marker-has-two-poses" in codes(told)) is wanted
        assert len(view["tilts"]) == (2 if view["markers"] == 1 else 0)
        assert not view["tilts"] or (min(view["tilts"]) < 20) is wanted
        if wanted:  # both angles are told in words too
            one, other = sorted(view["tilts"])
            (said,) = [r for r in told["remarks"] if r["code"] == "marker-has-two-poses"]
            assert said["numbers"]["tilts"] == [f"{one:.1f} or {other:.1f} deg"]


@pytest.mark.parametrize(("smear", "wanted"), [((0, 0), False), ((2.2, 2.2), True), ((0, 3.0), True)])
def test_a_motion_of_a_board_is_told(tmp_path, smear, wanted):
    sheet, _ = checker(8, 6, 20.0)
    blur = 0.8 if wanted else 1.6
    told, _ = detect(str(save(tmp_path, "a.png", image_of(sheet, TILT, 260, 220, blur=blur, smear=smear))))
    assert ("motion-blur" in codes(told)) is wanted
    (view,) = told["views"]
    assert not wanted or view["motion"] == pytest.approx(np.hypot(*smear), rel=0.3)
