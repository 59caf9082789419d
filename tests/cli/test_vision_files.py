"""`vision detect` and `vision sheet` with files and words as people leave them: one message, status 2, nothing written, nothing lost."""

from __future__ import annotations

import os

import numpy as np
import pytest
from cli.runs import robocal as run
from cli.test_vision_advice import NAME, folder, plain
from cli.test_vision_detect import detect, save
from files.test_image_files import bad_files

cv2 = pytest.importorskip("cv2")


@pytest.fixture(scope="module")
def views(tmp_path_factory):
    """A folder of two images."""
    place = tmp_path_factory.mktemp("views") / "images"
    return folder(place, plain(), plain(seed=1))


def left(place):
    """What is in a folder, file by file."""
    return {str(p.relative_to(place)): p.read_bytes() for p in place.rglob("*") if p.is_file()}


@pytest.mark.parametrize("json", [(), ("--json",)])
def test_a_bad_file_among_good_ones(tmp_path, json):
    for name, (data, word) in bad_files(tmp_path).items():
        place = tmp_path / name.replace(".", "-")
        folder(place, plain())
        (place / name).write_bytes(data)
        before = left(place)
        run("vision", "detect", place, *NAME, "-o", place / "corners.csv", *json).assert_refused(name, word)
        assert left(place) == before, name


def test_places_without_images(tmp_path, views):
    (tmp_path / "none").mkdir()
    (tmp_path / "none" / "notes.md").write_text("x")
    (tmp_path / "list.txt").write_text("missing.png\n")
    (tmp_path / "empty.txt").write_text("")
    (tmp_path / "comments.txt").write_text("# nothing\n")
    (tmp_path / "dead.png").symlink_to(tmp_path / "gone.png")
    for place, word in (
        ("none", "no images"), ("missing.png", "no such file"), ("list.txt", "missing.png"), ("empty.txt", "empty"),
        ("comments.txt", "no images"), ("no*.png", "no file"), ("dead.png", "dead.png"),
    ):  # fmt: skip
        run("vision", "detect", views, tmp_path / place, *NAME, "-o", tmp_path / "c" / "c.csv").assert_refused(word)
        assert not (tmp_path / "c").exists(), place


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() == 0, reason="the superuser may read everything")
def test_what_may_not_be_read(tmp_path):
    place = tmp_path / "images"
    folder(place, plain())
    (place / "img0.png").chmod(0)
    run("vision", "detect", place, *NAME).assert_refused("img0.png", "permission")
    place.chmod(0)
    try:
        run("vision", "detect", place, *NAME).assert_refused("images", "permission")
    finally:
        place.chmod(0o700)


def test_images_of_every_kind_have_the_same_corners(tmp_path):
    """Colour with transparency, 16 bits, and a folder named as an image beside them."""
    grey = plain()
    deep = (grey.astype(np.uint16) + 1) * 257 - 1
    made = {
        "a.png": grey,
        "b.png": cv2.cvtColor(grey, cv2.COLOR_GRAY2BGRA),
        "c.png": deep,
        "d.tiff": deep,
        "e.bmp": grey,
    }
    for name, image in made.items():
        save(tmp_path / "images", name, image)
    (tmp_path / "images" / "more.png").mkdir()
    told, status = detect(str(tmp_path / "images"), *NAME)
    assert status == 0
    columns = {c["name"]: np.array(c["values"]) for c in told["corners"]["columns"]}
    places = np.column_stack([columns["u"], columns["v"]]).reshape(len(made), -1, 2)
    assert len(columns["u"]) == 8 * len(made) and np.abs(places - places[0]).max() < 2e-3


def test_where_corners_are_written(tmp_path, views, monkeypatch):
    """A folder that is missing is made; what exists stays; only a CSV is written, so that no image is replaced."""
    new = tmp_path / "new" / "deep" / "corners.csv"
    ran = run("vision", "detect", views, *NAME, "-o", new, "--json")
    assert ran.status == 0 and ran.document["written"] == [str(new.with_suffix(e)) for e in (".csv", ".json", ".html")]
    before = left(new.parent)
    for name in ("corners.csv", "corners.json", "corners.html"):
        for other in before:
            (new.parent / other).unlink(missing_ok=True)
        (new.parent / name).write_bytes(b"mine")
        run("vision", "detect", views, *NAME, "-o", new).assert_refused(name, "--force")
        assert left(new.parent) == {name: b"mine"}
    assert run("vision", "detect", views, *NAME, "-o", new, "--force").status == 0
    assert left(new.parent)["corners.csv"] == before["corners.csv"]
    images = left(new.parents[2] / "new")
    for name in (f"{views}/img0.png", views, str(tmp_path / "corners"), str(tmp_path / "corners.txt")):
        run("vision", "detect", views, *NAME, "-o", name, "--force").assert_refused("--output", ".csv")
    assert left(new.parents[2] / "new") == images and cv2.imread(f"{views}/img0.png") is not None
    (tmp_path / "file").write_text("mine")
    run("vision", "detect", views, *NAME, "-o", tmp_path / "file" / "c.csv").assert_refused("file")
    monkeypatch.chdir(tmp_path)
    assert (
        "Written: corners.csv, corners.html, corners.json"
        in run("vision", "detect", views, *NAME, "-o", "corners.csv").said
    )


@pytest.mark.parametrize("verb", ["detect", "sheet"])
@pytest.mark.parametrize(("words", "said"), [
    (("--size", "100lb"), ("--size", "a length is needed")), (("--size", "nan"), ("--size", "finite")), (("--square", "-3"), ("--square",)),
    (("--size", "1e400"), ("--size",)), (("--seize", "3"), ("--size",)),
])  # fmt: skip
def test_numbers_and_words(tmp_path, views, verb, words, said):
    places = [views] if verb == "detect" else []
    for json in ([], ["--json"]):
        ran = run("vision", verb, *places, *words, "-o", tmp_path / ("a.csv" if verb == "detect" else "a.pdf"), *json)
        ran.assert_refused(*said)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("words", "said"), [
    ("--size 0.5", "1 or more"), ("--pattern charuco --columns 1 --rows 1", "at least 3"), ("--pattern checkerboard --rows 2", "at least 4"),
])  # fmt: skip
def test_sheets_that_nobody_could_use(tmp_path, words, said):
    run("vision", "sheet", *words.split(), "-o", tmp_path / "a.pdf").assert_refused(said)
    assert not list(tmp_path.iterdir())


def test_where_sheets_are_written(tmp_path, monkeypatch):
    new = tmp_path / "new" / "deep" / "a.pdf"
    ran = run("vision", "sheet", "-o", new, "--json")
    assert ran.status == 0 and ran.document["written"] == [str(new), str(new.with_suffix(".yaml"))]
    run("vision", "sheet", "-o", new, "--json").assert_refused("a.pdf", "--force")
    (tmp_path / "file").write_text("mine")
    run("vision", "sheet", "-o", tmp_path / "file" / "a.pdf").assert_refused("file")
    run("vision", "sheet", "-o", tmp_path / "a.txt", "--force").assert_refused(".pdf")
    assert (tmp_path / "file").read_text() == "mine" and not (tmp_path / "a.txt").exists()


def test_no_opencv_is_one_sentence(tmp_path, views, monkeypatch):
    """Of both verbs; a checkerboard is printed without it."""
    monkeypatch.setitem(__import__("sys").modules, "cv2", None)
    run("vision", "detect", views, *NAME, "-o", tmp_path / "a.csv").assert_refused("robocal[vision]")
    run("vision", "sheet", "-o", tmp_path / "a.pdf").assert_refused("robocal[vision]")
    assert not list(tmp_path.iterdir())
    assert run("vision", "sheet", "--pattern", "checkerboard", "-o", tmp_path / "a.pdf").status == 0


@pytest.mark.parametrize(("old", "new", "said"), [
    ("columns: 5", "columns: 6", "expected 21, one in each white square"), ("columns: 5", "columns: 1", "at least 3"),
    ("columns: 5", "columns: 100000", "checkerboards[0]"), ("border: 1", "border: 9", "border"), ("6x6_250", "6x6_20", "6x6_250"),
    ("id: 3,", "id: 300,", "0 to 249"),
])  # fmt: skip
def test_a_sheet_that_is_wrong_is_named(tmp_path, views, old, new, said):
    assert run("vision", "sheet", "--pattern", "charuco", "-o", tmp_path / "a.pdf").status == 0
    sheet = tmp_path / "a.yaml"
    text = sheet.read_text()
    assert old in text
    sheet.write_text(text.replace(old, new))
    run("vision", "detect", views, "--sheet", sheet).assert_refused("a.yaml", said)


def test_a_board_of_more_markers_than_its_dictionary_has(views):
    run("vision", "detect", views, "--charuco", "20x20", "--dictionary", "4x4_50").assert_refused("at most 50 markers")
