"""Where a frame can hold its platform, and what a grid of cells makes up."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.cables.geometry import cable_robot
from robocal.cables.grid_regions import cut_off, frame_box, regions, visible_share
from robocal.cables.pulley import Pulleys
from robocal.cables.workspace import Demand, Grid, grid, holds
from robocal.errors import ModelError
from robocal.geometry import so3

HALL = np.array([[x, y, z] for z in (0.0, 3.0) for x, y in ((-4, -3), (4, -3), (4, 3), (-4, 3))])
BODY = np.array([[x, y, z] for z in (0.5, -0.2) for x, y in ((0.1, -0.4), (0.1, -0.35), (-0.1, 0.4), (-0.1, 0.35))])


def robot(a=HALL, b=BODY, **known):
    return cable_robot("r", a, b, limits=np.tile([10.0, 400.0], (len(a), 1)), mass=30.0, **known)


def cells(text, size=(1.0, 2.0, 0.5)):
    """A grid from layers of rows of characters, # for a held cell: layers along x, rows along y, characters along z."""
    held = np.array([[[c == "#" for c in row] for row in layer.split()] for layer in text.split("|")])
    axes = tuple(s * (np.arange(n) + 0.5) for s, n in zip(size, held.shape, strict=True))
    return Grid(axes, np.array(size), held, None)


def test_nothing_beyond_the_sides_and_the_top_can_be_held(rng):
    """Whatever the platform weighs and however strong the cables are; right inside, something can."""
    turned = so3.exp(np.array([[0.1, -0.2, 0.3]]))
    for a in (HALL, HALL + rng.normal(0, 0.4, (8, 3))):
        able = robot(a)
        box, _ = frame_box(able, turned)
        where = rng.uniform(box[:, 0] - 3, box[:, 1] + 3, (4000, 3))
        beyond = ((where < box[:, 0])[:, :2].any(axis=1)) | (where > box[:, 1]).any(axis=1)
        held = holds(able, Demand(np.array([5.0]), turned), where)
        assert not held[beyond].any() and held[~beyond].any() and beyond.sum() > 1000


def test_how_far_down():
    standing, words = frame_box(robot())
    assert np.allclose(standing, [[-4.1, 4.1], [-3.4, 3.4], [0.2, 3.2]]) and words.endswith("down to z = 0")
    # The base in the middle of the frame: down to the lowest anchors.
    low, words = frame_box(robot(HALL - [0, 0, 2]))
    assert np.allclose(low[2], [-1.8, 1.2]) and words.endswith("down to the lowest one")
    # Hung from a flat frame: down to the floor where the base stands there, and as far as it is wide where it does not.
    flat = np.where(np.arange(8)[:, None] < 4, HALL + [0, 0, 5], HALL + [0, 0, 2.1])
    hung, words = frame_box(robot(flat))
    assert np.allclose(hung[2], [0.2, 5.3]) and words.endswith("down to z = 0")
    hung, words = frame_box(robot(flat - [0, 0, 5.05]))
    assert np.allclose(hung[2], [-0.05 - 8 + 0.2, 0.25]) and words.endswith("as far below the frame as it is large")
    # A frame far above the base: not all the way down.
    assert frame_box(robot(HALL + [0, 0, 100]))[0][2, 0] == pytest.approx(100 - 8 + 0.2)


def test_pulleys_orientations_and_planes():
    wheels = Pulleys(np.full(8, 0.1), np.tile([0.0, 0, 1], (8, 1)))
    plain, turned = frame_box(robot())[0], so3.exp(np.array([[0, 0, 0.0], [0, 0, np.pi / 2]]))
    assert np.allclose(frame_box(robot(pulleys=wheels))[0][:2], plain[:2] + [-0.2, 0.2])
    assert np.allclose(frame_box(robot(), turned)[0][0], [-4.4, 4.4])
    three, point = HALL[[4, 5, 0], :] * [1, 0, 1], np.zeros((3, 3))
    upright, _ = frame_box(robot(three + [0, 1, 0], point, degrees="2T", plane="xz"))
    assert np.allclose(upright, [[-4, 4], [1, 1], [0, 3]])
    lying, words = frame_box(robot(three[:, [0, 2, 1]] + [0, 0, 0.7], point, degrees="2T", plane="xy"))
    assert np.allclose(lying, [[-4, 4], [0, 3], [0.7, 0.7]]) and "down" not in words


def test_parts_holes_and_what_is_cut_off():
    found = regions(
        cells("..... ..... ..... |..... .###. ..... |..... .#.#. ....# |..... .###. ..... |..... ..... .....")
    )
    assert (found.parts, found.holes) == ((8, 1), ())
    ring = cells("##### ##### ##### |##### #.#.# ##### |##### ##### #####")
    found = regions(ring)
    assert (found.parts, found.holes) == ((43,), (1, 1)) and cut_off(found.extent, found.extent) == (
        "x-",
        "x+",
        "y-",
        "y+",
        "z-",
        "z+",
    )
    assert np.allclose(found.extent, [[0, 3], [0, 6], [0, 2.5]]) and np.allclose(found.centre, [1.5, 3, 1.25])
    # A section has no thickness: a ring in it is closed, and its heart is a held cell.
    flat = cells("..... ..... |.###. ..... |.#.#. ..... |.###. ##...")
    one = Grid((flat.axes[0], flat.axes[1][:1], flat.axes[2]), np.array([1.0, 0, 0.5]), flat.inside[:, :1], None)
    found = regions(one)
    assert (found.parts, found.holes) == ((8,), (1,))
    assert cut_off(found.extent, [[0, 4], [1, 1], [0, 2.5]]) == ("x+",)
    assert one.inside[found.heart] and found.extent[1].tolist() == [1.0, 1.0]
    with pytest.raises(ModelError, match="no cell"):
        regions(cells("... ..."))


def test_what_is_seen_from_a_point():
    bend = cells("########## |#......... |#......... |#......... |#......... |#.........", (1.0, 1.0, 1.0))
    assert visible_share(bend, [0.5, 0.5, 0.5]) == 1.0
    assert visible_share(bend, [0.5, 0.5, 9.5]) == pytest.approx(10 / 15)
    able = robot()
    made = grid(able, Demand(np.array([30.0])), frame_box(able)[0], (15, 15, 15))
    middle = np.array([made.axes[i][k] for i, k in enumerate(regions(made).heart)])
    assert visible_share(made, middle) > 0.99
