"""Hand-eye calibration of a real UR3 before four cameras: what is wrong with its data is named, and obeyed it ends at half a pixel.

Measured (robot nominal; held out by i mod 4; rms of the distance in the image): camera 1 0.63 px, 2 0.76 px, 4 0.82 px alone; all four
together 0.63 and 0.76 px on 1 and 2, the board's centre 1.6 mm from where all four see it. Published, with the lens unscaled: 8 mm with one
camera, 7 to 40 mm with four.
"""

from __future__ import annotations

import csv

import numpy as np
import pytest
from cli.runs import robocal
from real.ur3_cell import EXCHANGED, FOREIGN, IMAGE, write_cell

from robocal.remarks.code import Code
from robocal.session.inputs import read_inputs

pytestmark = pytest.mark.slow
FREE = {k: f"eye{k},board" for k in range(4)} | {4: "eye0,eye1,eye2,eye3,board"}
LABELS = "half_turns: undo\n"
SIZE = f"image: [{IMAGE[0]}, {IMAGE[1]}]\n"


@pytest.fixture
def source(shared_data):
    return shared_data / "ur3-cameras"


def free(files, k):
    """The words of an identification of one camera (k below 4) or of all."""
    return "identify", files[0], *(files[1:] if k == 4 else (files[1 + k],)), "--free", FREE[k]


def coded(told, code):
    return [r for r in (*told["remarks"], *told.get("verdict", {}).get("remarks", ())) if r["code"] == code]


def test_lenses_of_larger_images_are_told_and_scaled_on_consent(source, tmp_path):
    """The size of the images beside that of the lens says it, else the data do: those of each camera."""
    files = write_cell(tmp_path, source, lens="", more=SIZE)
    told = robocal("check", *files[:2])
    assert told.status == 2 and "1280 x 720 px, and the lens is of 1920 x 1080 px" in told.said
    assert "scale: 0.6666666666" in told.said
    files = write_cell(tmp_path, source, lens=", scale: 0.666666666666667", more=SIZE)
    assert read_inputs(files[0], files[1:2]).data.observations[0].options["intrinsics"][0] == pytest.approx(
        1048.62, abs=0.01
    )
    files = write_cell(tmp_path, source, lens="", leave_out=FOREIGN, more=LABELS)
    for k in range(4):
        ran = robocal(*free(files, k), "--json")
        (one,) = coded(ran.document, "lens-factor")
        assert ran.status == 3 and one["numbers"]["ratio"] == "2/3" and "scale: 0.66667" in one["advice"]


# obeys: target-turned
def test_half_turns_are_undone_on_consent(source, tmp_path):
    """Each view gets the label that the author's own transforms say, those with wrong joint values too."""
    read = []
    for name, said in (("here", {"more": LABELS}), ("undone", {"labels": "undone"})):
        (tmp_path / name).mkdir()
        files = write_cell(tmp_path / name, source, **said)
        read.append(read_inputs(files[0], files[1:]))
    (told,) = [dict(r.items) for r in read[0].warnings if r.code == Code.HALF_TURNS_UNDONE]
    assert (told["count"], told["total"]) == (88, 159)
    for pair in zip(*(r.data.observations for r in read), strict=True):
        mine, right = (
            {(c, *uv): p for c, uv, p in zip(o.configuration, map(tuple, o.value), o.extra["point"], strict=True)}
            for o in pair
        )
        assert max(np.linalg.norm(mine[at] - p) for at, p in right.items()) < 1e-6


@pytest.mark.parametrize("k", range(5))
def test_wrong_views_are_named_by_each_camera_and_by_all(k, source, tmp_path):
    files = write_cell(tmp_path, source, more=LABELS)
    told = robocal(*free(files, k), "--json").document
    (one,) = coded(told, "views-exchanged")
    assert not coded(told, "target-turned")
    numbers = one["numbers"]
    assert (numbers["view"], numbers["partner"], numbers.get("every")) == ("p24", "p25", 4 if k == 4 else None)
    assert numbers["instruments"] == ([f"eye{c}" for c in range(4)] if k == 4 else [f"eye{k}"])
    named = {(o["group"], int(o["configuration"][1:])) for o in told["outliers"] if o["rows"] == 63}
    cameras = range(4) if k == 4 else (k,)
    assert named == {(f"eye{c}", i) for c in cameras for i in (*EXCHANGED, *FOREIGN.get(c, ()))}
    # A fifth of the rows of camera 4 alone are of other moments: it is refused until they are left out. Camera 3 alone leaves 2 px.
    assert told["verdict"]["status"] == {3: "refused", 2: "not_improved"}.get(k, "located")


@pytest.mark.parametrize("k", range(4))
def test_camera_3_moved_while_its_views_were_taken(k, source, tmp_path):
    """It leaves 2 px, and 0.4 px with a speed of its own: ten views that follow one another agree to 0.3 to 0.5 px, each tenth view to 2."""
    files = write_cell(tmp_path, source, exchange=True, leave_out=FOREIGN, more=LABELS)
    told = coded(robocal(*free(files, k), "--json").document, "camera-drift")
    assert len(told) == (k == 2)
    if told:
        numbers = told[0]["numbers"]
        assert numbers["group"] == "eye2" and numbers["share"] > 0.95 and 2 < numbers["shift"]["value"] < 8


@pytest.mark.parametrize(("k", "most"), [(0, 0.65), (1, 0.80), (3, 0.86)])
def test_one_camera_is_placed_to_a_pixel(k, most, source, tmp_path):
    files = write_cell(tmp_path, source, exchange=True, leave_out=FOREIGN, more=LABELS)
    told = robocal(*free(files, k), "--hold-out", "group", "--folds", 4, "--json").document
    assert told["verdict"]["status"] == "located" and not [o for o in told["outliers"] if o["rows"] > 1]
    residuals = told["residuals"]
    found = (residuals["all_rows"] or residuals)["k_fold"]
    assert found["n"] == 63 * (33 if k == 3 else 40)
    assert found["rms"] < most  # of the distance; per axis it is this over sqrt 2


def test_a_lens_that_is_free_meets_the_pixels_and_loses_the_place(source, tmp_path):
    """The robot's own errors go into the numbers of the lens, and the camera is where nobody knows: it is told."""
    files = write_cell(tmp_path, source, exchange=True, leave_out=FOREIGN, more=LABELS)
    text = files[1].read_text()
    files[1].write_text(text.replace("camera: {", "camera: {sigma: {fx: 5, fy: 5, cx: 5, cy: 5}, "))
    told = robocal(*free(files, 0), "--hold-out", "group", "--folds", 4, "--json").document
    assert told["residuals"]["k_fold"]["rms"] < 0.57
    assert told["verdict"]["status"] == "not_improved" and coded(told, "frames-loose")


def test_four_cameras_share_one_board(source, tmp_path):
    files = write_cell(tmp_path, source, exchange=True, leave_out=FOREIGN, more=LABELS)
    ran = robocal(*free(files, 4), "--hold-out", "group", "--folds", 4, "-o", tmp_path / "run", "--json")
    assert ran.status == 0
    with (tmp_path / "run" / "residuals.csv").open() as file:
        rows = list(csv.DictReader(file))
    for k in (0, 1):
        found = np.array([float(r["held_out_px"]) for r in rows if r["group"] == f"eye{k}"])
        assert len(found) == 2520 and np.sqrt(np.mean(found**2)) < 0.8
    (places,) = coded(ran.document, "image-places")
    assert places["numbers"]["poses"] == 40 and places["numbers"]["mean"]["value"] < 2.4
    assert places["numbers"]["mean"]["unit"] == "mm"
