"""The AprilTag library as a second search: the same numbers, and corners in the same order and at the same places as OpenCV's."""

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal as run
from cli.test_vision_detect import detect, grid, save
from printed import image_of, places

from robocal.files import apriltag_search
from robocal.files.apriltag_search import TAGS, find_tags
from robocal.files.marker_search import find_markers

cv2 = pytest.importorskip("cv2")
NUMBERS = (3, 20)
SIZE = 260, 260
# Turned by 0, 130 and 260 deg, seen from the side.
TURNS = [
    np.array([[np.cos(a), -np.sin(a), 130.0], [np.sin(a), np.cos(a), 125.0], [2e-4, 1e-4, 1.0]])
    @ np.array([[1.0, 0.1, -62.0], [0.0, 1.0, -24.0], [0, 0, 1]])
    for a in np.radians([0.0, 130.0, 260.0])
]


def library():
    pytest.importorskip("pyapriltags", reason="the AprilTag library is an extra: pip install 'robocal[apriltag]'")


@pytest.mark.parametrize(("family", "turn"), list(zip(TAGS, TURNS, strict=True)))
def test_corners_are_those_of_opencv(family, turn):
    """Without the half pixel all of them were off by it: their mean tells."""
    library()
    sheet, corners = grid(family, NUMBERS, gap=20.0)
    grey = image_of(sheet, turn, *SIZE)
    for search in (find_tags, find_markers):
        found = search(grey, family)
        assert set(NUMBERS) <= set(found.ids.tolist())  # few bits of 16h5 agree with a part of another tag
        off = np.array([found.corners[found.ids == n][0] - places(turn, corners[n]) for n in NUMBERS])
        assert np.abs(off).max() < 2.0
        if search is find_tags:
            assert np.abs(off.mean(axis=(0, 1))).max() < 0.3


def test_both_searches_lead_to_the_same_corners(tmp_path):
    library()
    sheet, _ = grid("36h11", NUMBERS, gap=20.0)
    image = save(tmp_path, "a.png", image_of(sheet, TURNS[1], *SIZE))
    told = [detect(image, "--dictionary", "36h11", "--size", 48, "--search", s) for s in ("opencv", "apriltag")]
    columns = [{c["name"]: c["values"] for c in document["corners"]["columns"]} for document, _ in told]
    assert [status for _, status in told] == [0, 0] and len(columns[0]["u"]) == 8
    for name in ("marker", "corner", "method"):
        assert columns[0][name] == columns[1][name]
    for name in "uv":
        np.testing.assert_allclose(columns[1][name], columns[0][name], atol=0.005)


def test_what_is_wrong_is_one_sentence(tmp_path, monkeypatch):
    sheet, _ = grid("36h11", NUMBERS, gap=20.0)
    image = save(tmp_path, "a.png", image_of(sheet, TURNS[0], *SIZE))
    for words, said in (
        (["--dictionary", "6x6_250"], "36h11, 25h9, 16h5; or --search opencv"),
        ([], "--dictionary or --sheet of AprilTags"),
        (["--checker", "8x6"], "single tags"),
        (["--charuco", "8x6", "--dictionary", "36h11"], "single tags"),
    ):
        ran = run("vision", "detect", image, *words, "--search", "apriltag")
        assert ran.status == 2 and said in ran.err, ran.err
    monkeypatch.setitem(__import__("sys").modules, "pyapriltags", None)
    apriltag_search.tag_search.cache_clear()
    ran = run("vision", "detect", image, "--dictionary", "36h11", "--search", "apriltag")
    assert ran.status == 2 and "pip install 'robocal[apriltag]'" in ran.err
