"""Which groups of numbers are opened beside a camera on a platform: a flat field from one height, and what opens the rest."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from field_world import rig

from robocal.fit.options import Options
from robocal.measure.data import Observations
from robocal.prove.identify import identify
from robocal.prove.opened_groups import _rivals


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
        print(f"{g.name}: {g.state}, {len(g.identified)} of {g.n} identified, {g.new} new. {rest or g.asked}")
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
    assert told == {n for g in said.values() for n in g.identified}


def test_the_groups_that_would_have_to_be_known_are_told_truly():
    """With the robot known the same pictures tell the focal length and the camera's turn, with the lens as well its place."""
    _, truth, data = rig(level=True)
    robot = replace(truth, table=truth.table.with_free([]))
    _, said = opened(robot, data)
    assert said["robot"].state == "fixed" and said["lens"].state == "open"
    assert {"eye.rx", "eye.ry", "eye.rz"} <= set(said["hand-eye"].identified)
    options = data.observations[1].options | {"free": (), "known": (), "covariance": ()}
    known = replace(data, observations=(data.observations[0], replace(data.observations[1], options=options)))
    _, said = opened(robot, known)
    assert said["lens"].state == "fixed" and said["hand-eye"].state == "open"


def test_tilts_and_heights_open_the_rest():
    _, said = opened(*rig(level=False)[::2])
    assert said["lens"].state == "open" and set(said["hand-eye"].identified) == {
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


def test_numbers_that_only_others_of_their_own_group_would_open_are_told_so():
    """a + b and c + d are seen sharply, and hardly e: a and b are of one group, c and d of two, and with them nothing helps e."""
    root = np.diag([1e3, 1e3, 0.1]) @ np.array([[1.0, 1, 0, 0, 0], [0, 0, 1, 1, 0], [0, 0, 0, 0, 1]])
    known = np.linalg.inv(root.T @ root + np.eye(5))
    problem = SimpleNamespace(scales=np.ones(5), spread_root=np.eye(5))
    seen = SimpleNamespace(names=tuple("abcde"), share=1 - np.diag(known), root=root, noise=1.0, problem=problem)
    assert _rivals(seen, np.array([0, 0, 0, 1, 1])) == {"a": (0,), "b": (0,), "c": (1,), "d": (0,), "e": None}
