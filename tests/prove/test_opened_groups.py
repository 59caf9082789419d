"""Which groups of numbers are opened beside a camera on a platform: a flat field from one height, and what opens the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from prove.machines import hung, lengths

from robocal.fit.options import Options
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.identify import identify
from robocal.vision.camera import project
from robocal.vision.sheets import SQUARE

LENS = (900.0, 901.0, 642.0, 509.0, -0.18, 0.09, 5e-4, -4e-4, 0.0)
KNOWN = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
SIGMA = (10.0, 10.0, 10.0, 10.0, 0.05, 0.05, 0.05, 0.05)
EYE = se3.compose(np.diag([1.0, -1.0, -1.0]), np.array([0.02, 0.01, -0.1]))
OF_EYE = (0.002,) * 3 + (np.radians(0.3),) * 3
EDGE, HALF = 0.15, 75e-3
PLACES = [(x, y) for x in (-1.5, -0.9, -0.3, 0.3, 0.9, 1.5) for y in (-1.0, -0.5, 0.0, 0.5, 1.0)]


def poses(rng, count, level):
    """Platforms over the field: all level at one height, or tilted at several."""
    out = np.zeros((count, 6))
    out[:, :2] = rng.uniform(-1, 1, (count, 2)) * [1.2, 0.9]
    out[:, 2] = 1.4 if level else rng.uniform(0.9, 1.9, count)
    if not level:
        out[:, 3:] = rng.uniform(-0.17, 0.17, (count, 3))
    return out


def rig(level, seed=5, count=60):
    """A robot on cables whose camera looks at thirty markers on a flat floor; the model, the truth, and what was measured."""
    rng = np.random.default_rng(seed)
    model = hung()
    model = replace(model, table=model.table.with_priors({n: 0.03 for n in model.table.free if ".a" in n}))
    truth = model.with_values({n: model.table[n].value + rng.normal(0, 0.01) for n in model.table.free})
    start = poses(rng, count, level)
    markers = np.array([(x, y, 0.0, 0.0, 0.0, 0.7 * i) for i, (x, y) in enumerate(PLACES)])
    camera = se3.inverse(se3.from_vector(start) @ EYE)
    rows = []
    for p, m in np.ndindex(count, len(markers)):
        t = camera[p] @ se3.from_vector(markers[m])
        points = HALF * SQUARE @ t[:3, :3].T + t[:3, 3]
        uv = project(points, np.array(LENS))[0]
        if (points[:, 2] > 0.2).all() and (uv > 8).all() and (uv < [1272, 1016]).all():
            rows.append((p, m))
    view, target = np.repeat(np.array(rows).T, 4, axis=1)
    corner = np.tile(np.arange(4), len(rows))
    seen = Observations(
        "pixels", view, np.zeros((len(view), 2)), np.full((len(view), 2), 0.3),
        Frame("eye", tuple(se3.to_vector(EYE)), (True,) * 6, "tool", prior=OF_EYE),
        tuple(Frame(f"m{i}", tuple(v), (i > 0,) * 6) for i, v in enumerate(markers)), target,
        {"point": HALF * SQUARE[corner]},
        {"camera": "lens", "intrinsics": LENS, "free": KNOWN, "known": KNOWN, "covariance": tuple(map(tuple, np.diag(np.square(SIGMA)).tolist())),
         "print": "print", "print sigma": 0.003},
        group="pixels",
    )  # fmt: skip
    data = synthesise(
        truth, DataSet(Configurations(tuple(map(str, range(count))), start=start), (lengths(model, count), seen)), rng
    )
    return model, truth, data


def opened(model, data):
    found = identify(model, data, Options(leave_one_out=False))
    return found, {g.name: g for g in found.opened}


def test_a_flat_field_from_one_height_opens_what_it_tells_and_no_more():
    """Level, at one height: focal length is the height of the robot above the field, and the place of the camera a shift and a turn of the
    robot in the frame of the field. What bends pixels, the markers to one another and their size beside the cables stay."""
    model, _, data = rig(level=True)
    found, said = opened(model, data)
    for g in said.values():
        rest = "; ".join(f"{', '.join(o.names)} ({' and '.join(o.rivals) or o.why})" for o in g.rest)
        print(f"{g.name}: {g.state}, {len(g.told)} of {g.n} told, {g.new} new. {rest or g.asked}")
    assert list(said) == ["robot", "lens", "hand-eye", "map", "size", "delay"]
    assert {n: g.state for n, g in said.items()} == {
        "robot": "open", "lens": "in part", "hand-eye": "not open", "map": "open", "size": "open", "delay": "fixed"
    }  # fmt: skip
    (focal,) = said["lens"].rest
    assert focal.names == ("lens.fx", "lens.fy") and focal.rivals == ("robot",)
    place, turn = said["hand-eye"].rest
    assert place.names == ("eye.x", "eye.y", "eye.z") and place.rivals == ("robot", "lens")
    assert turn.names == ("eye.rx", "eye.ry", "eye.rz") and turn.rivals == ("robot",)
    assert said["hand-eye"].new == 0 and said["delay"].asked == "path"
    assert sum(g.new for g in said.values()) == pytest.approx(found.identifiability.rank, abs=2)
    # What is told is what the table of parameters calls identified.
    told = {p.name for p in found.parameters if p.status == "identified"}
    assert told == {n for g in said.values() for n in g.told}


def test_the_groups_that_would_have_to_be_known_are_told_truly():
    """With the robot known the same pictures tell the focal length and the camera's turn, with the lens as well its place."""
    _, truth, data = rig(level=True)
    robot = replace(truth, table=truth.table.with_free([]))
    _, said = opened(robot, data)
    assert said["robot"].state == "fixed" and said["lens"].state == "open"
    assert {"eye.rx", "eye.ry", "eye.rz"} <= set(said["hand-eye"].told)
    options = data.observations[1].options | {"free": (), "known": (), "covariance": ()}
    known = replace(data, observations=(data.observations[0], replace(data.observations[1], options=options)))
    _, said = opened(robot, known)
    assert said["lens"].state == "fixed" and said["hand-eye"].state == "open"


def test_tilts_and_heights_open_the_rest():
    _, said = opened(*rig(level=False)[::2])
    assert said["lens"].state == "open" and set(said["hand-eye"].told) == {
        "eye.x",
        "eye.y",
        "eye.rx",
        "eye.ry",
        "eye.rz",
    }


def test_what_no_camera_sees_has_no_groups():
    model, _, data = rig(level=False)
    robot = replace(model, table=model.table.with_free([n for n in model.table.free if n.startswith("c1.")]))
    alone = replace(data, observations=data.observations[:1])
    start = replace(alone.configurations)
    pose = Observations("pose", np.arange(60), data.configurations.start, np.full((60, 6), 1e-4))
    assert (
        identify(
            robot,
            replace(alone, configurations=start, observations=(*alone.observations, pose)),
            Options(leave_one_out=False),
        ).opened
        == ()
    )
