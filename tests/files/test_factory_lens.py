"""Lenses of depth cameras as their maker has them, images of distances, and cameras that are not read."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cli.runs import robocal
from hand_eye_stream import stream
from hand_eye_world import IMAGE, corners, hand_eye, named, poses, world
from lens_world import LENS

from robocal.errors import InputError
from robocal.files.image_files import find_images, read_images
from robocal.files.images import opencv
from robocal.files.lens import read_lens

MADE = {"width": 1280, "height": 960, "ppx": 651.0, "ppy": 471.0, "fx": 1052.0, "fy": 1053.0}
LISTING = """\
Device info:
    Name                          :     Intel RealSense D435

Intrinsic of "Depth" / 640x480 / {Z16}
  Width:        640
  Height:       480
  PPX:          320.1
  PPY:          240.2
  Fx:           385.1
  Fy:           385.1
  Distortion:   Brown Conrady
  Coeffs:       0  0  0  0  0
  FOV (deg):    79.4 x 63.8

Intrinsic of "Color" / 1280x960 / {YUYV/RGB8}
  Width:        1280
  Height:       960
  PPX:          651.0
  PPY:          471.0
  Fx:           1052.0
  Fy:           1053.0
  Distortion:   Inverse Brown Conrady
  Coeffs:       0  0  0  0  0
  FOV (deg):    69.1 x 49.1

Intrinsic of "Color" / 640x480 / {YUYV/RGB8}
  Width:        640
  Height:       480
  PPX:          325.5
  PPY:          235.5
  Fx:           526.0
  Fy:           526.5
  Distortion:   Inverse Brown Conrady
  Coeffs:       0  0  0  0  0

Extrinsic from "Depth"	  To	  "Color" :
 Rotation Matrix:
"""


def write(place, data):
    place.write_text(data if isinstance(data, str) else json.dumps(data))
    return place


def test_json_and_listing_are_one_lens_with_a_prior(tmp_path):
    given = MADE | {"model": "distortion.inverse_brown_conrady", "coeffs": [0.0] * 5}
    one = read_lens(write(tmp_path / "a.json", given)).lens
    other = read_lens(write(tmp_path / "b.txt", LISTING), size=(1280, 960)).lens
    assert one == other and one.size == (1280, 960) and one.numbers[:4] == (1052.0, 1053.0, 651.0, 471.0)
    assert one.sigma["fx"] == pytest.approx(5) and one.sigma["k1"] == pytest.approx(0.1)
    small = read_lens(tmp_path / "b.txt", size=(640, 480)).lens
    assert small.numbers[0] == 526.0
    assert read_lens(tmp_path / "b.txt", "Depth").lens.numbers[0] == 385.1
    bent = read_lens(
        write(tmp_path / "c.json", MADE | {"model": "brown_conrady", "coeffs": [0.1, -0.2, 0.001, 0, 0.05]})
    )
    assert bent.lens.numbers[4:] == (0.1, -0.2, 0.001, 0.0, 0.05) and bent.form == "factory"


@pytest.mark.parametrize(
    ("data", "size", "said"),
    [
        (LISTING, None, "several streams.*1280x960"),
        (LISTING, (1920, 1080), "no stream is that of the images.*color 1920x1080"),
        (LISTING.replace("PPX:          651.0", "PPX:          x"), (1280, 960), "cannot be read"),
        (MADE | {"model": "inverse_brown_conrady", "coeffs": [0.1, 0, 0, 0, 0]}, None, "a distortion that is not read"),
        (MADE | {"model": "ftheta", "coeffs": [0.1]}, None, "a distortion that is not read"),
        (MADE | {"coeffs": "none"}, None, "not a list of numbers"),
        (MADE | {"fx": -3}, None, "not a number above 0"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, data, size, said):
    with pytest.raises(InputError, match=said):
        read_lens(write(tmp_path / "lens.json", data), size=size)


def test_a_factory_lens_is_a_prior_of_a_hand_eye(tmp_path):
    """The lens bends, and the maker says that it does not: what is found is nearer. Another size is refused."""
    made = world(41, count=18)
    place = write(tmp_path / "factory.txt", LISTING)
    words = [corners(tmp_path, made), poses(tmp_path, made.told, names=named(made)), "--lens", place]
    told, status = hand_eye(*words, "--image", IMAGE)
    found = dict(zip(*(told["lens"]["columns"][i]["values"] for i in (0, 2)), strict=True))
    assert status in (0, 3) and abs(found["k1"] - LENS["k1"]) < 0.02 and abs(found["fx"] - LENS["fx"]) < 5
    place = write(tmp_path / "other.json", MADE | {"width": 1920, "height": 1440})
    ran = robocal("vision", "hand-eye", *map(str, [*words[:3], place]), "--image", IMAGE)
    assert ran.status == 2 and "images of another size" in ran.err


def test_depth_images_are_refused(tmp_path):
    """Distances in mm with holes; one without holes by its name; a dark image of 16 bits is read."""
    rng = np.random.default_rng(1)
    wall = (600 + 0.3 * np.arange(320) + rng.normal(0, 2, (240, 320))).astype(np.uint16)
    holed = wall * (rng.uniform(size=wall.shape) > 0.03)
    dark = np.clip(rng.normal(3, 5, wall.shape) + 900 * (np.arange(320) > 160), 0, 4095).astype(np.uint16)
    dark = opencv().GaussianBlur(dark, (0, 0), 0.8)
    for name, image, good in (("a.png", holed, False), ("depth_1.png", wall, False), ("b.png", dark, True)):
        opencv().imwrite(str(tmp_path / name), image)
        if good:
            assert len(list(read_images(find_images([str(tmp_path / name)])))) == 1
            continue
        with pytest.raises(InputError, match="depth image"):
            list(read_images(find_images([str(tmp_path / name)])))


def test_line_scan_and_rolling_shutter_in_motion_are_refused(tmp_path):
    _, words = stream(tmp_path, views=12)
    lens = tmp_path / "lens.yaml"
    text = lens.read_text()
    assert robocal("vision", "hand-eye", *words).status in (0, 3)
    lens.write_text(text + "shutter: rolling\n")
    ran = robocal("vision", "hand-eye", *words)
    assert ran.status == 2 and "rolling shutter in motion" in ran.err
    made = world(42, count=12)
    stops = [
        corners(tmp_path, made),
        poses(tmp_path, made.told, names=named(made)),
        "--lens",
        str(lens),
        "--image",
        IMAGE,
    ]
    assert hand_eye(*stops)[1] == 0
    lens.write_text(text.replace("brown", "line-scan"))
    ran = robocal("vision", "hand-eye", *words)
    assert ran.status == 2 and "line-scan camera is not read" in ran.err
