"""Wrong shapes, units and names are answered by the name of the argument and what was expected: calls of a stranger with arrays."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robocal as rc
from robocal.errors import InputError
from robocal.geometry import so3

A = np.array([[x, y, z] for x in (-2.0, 2.0) for y in (-1.5, 1.5) for z in (0.2, 2.5)])
B = np.array([[x, y, z] for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (0.15, -0.15)])
DH = {"convention": "dh", "columns": ("theta", "d", "a", "alpha")}
TABLE = np.ones((6, 4))


@cache
def lab() -> SimpleNamespace:
    """An arm and a cable robot with poses, as a stranger has them: q, T, p, quaternions with the scalar last, L, P."""
    rng = np.random.default_rng(0)
    arm = rc.robot("irb-120")
    true = arm.model.chain.with_values({"j2.a": 0.271, "j3.theta": 0.002})
    q = rng.uniform(-1.2, 1.2, (40, 6))
    pose = true.pose(q)
    pose[:, :3, 3] += rng.normal(0, 5e-5, (40, 3))
    w = so3.log(pose[:, :3, :3])
    half = np.linalg.norm(w, axis=1, keepdims=True) / 2
    robot = rc.cable.robot(frame_anchors=A, platform_anchors=B, platform={"mass": 20})
    places = np.tile(np.eye(4), (40, 1, 1))
    places[:, :3, 3] = rng.uniform(-0.6, 0.6, (40, 3)) + [0, 0, 1.3]
    return SimpleNamespace(
        arm=arm, q=q, T=pose, p=pose[:, :3, 3], R=pose[:, :3, :3], w=w,
        Q=np.column_stack([np.sin(half) * w / (2 * half), np.cos(half)]), robot=robot, P=places, L=robot.inverse(places),
    )  # fmt: skip


def nan(values: np.ndarray) -> np.ndarray:
    out = values.copy()
    out[3, 1] = np.nan
    return out


def scaled(pose: np.ndarray) -> np.ndarray:
    out = pose.copy()
    out[:, :3, 3] *= 1e3
    return out


def made(**given: Any) -> rc.Measurements:
    return rc.measurements(lab().q, **given)


Call = Callable[[SimpleNamespace], object]
# What is called; the argument that is named; words of what was expected.
ARRAYS: dict[str, tuple[Call, str, str]] = {
    "positions by columns": (lambda s: made(position=s.p.T), "position", "(40, 3): one row for each measurement, position.T"),
    "joints by columns": (lambda s: rc.measurements(s.q.T, position=s.p), "joints", "joints.T"),
    "fewer positions": (lambda s: made(position=s.p[:39]), "position", "40, as many as"),
    "two coordinates": (lambda s: made(position=s.p[:, :2]), "position", "(40, 3)"),
    "no order": (lambda s: made(position=s.p, quaternion=s.Q), "quaternion_order", '"xyzw" or "wxyz"'),
    "an order that is none": (
        lambda s: made(position=s.p, quaternion=s.Q, quaternion_order="xyz"), "quaternion_order", "did you mean 'xyzw'"
    ),
    "an order without quaternions": (lambda s: made(position=s.p, quaternion_order="xyzw"), "quaternion_order", "quaternion= (m, 4)"),
    "not normalised": (
        lambda s: made(position=s.p, quaternion=2 * s.Q, quaternion_order="xyzw"), "quaternion", "divide each by its norm"
    ),
    "quaternions of three": (lambda s: made(position=s.p, quaternion=s.w, quaternion_order="xyzw"), "quaternion", "(40, 4)"),
    "rotation vectors in degrees": (lambda s: made(position=s.p, rotation_vector=np.degrees(s.w)), "rotation_vector", '"deg"'),
    "no unit of positions": (lambda s: made(position=s.p, units=("rad", "milimeter")), "units[1]", "m, dm, cm, mm"),
    "units exchanged": (lambda s: made(position=s.p, units=("m", "rad")), "units[1]", "m, dm, cm, mm"),
    "one unit": (lambda s: made(position=s.p, units="mm"), "units", '("deg", "mm")'),
    "a name that is none": (lambda s: made(positions=s.p), "positions", "did you mean 'position'"),
    "lists of other lengths": (lambda s: rc.measurements([[1, 2], [3]], position=s.p), "joints", "an array"),
    "NaN": (lambda s: made(position=nan(s.p)), "position", "finite numbers"),
    "nothing in lists": (lambda s: rc.measurements([], position=[]), "joints", "(m, n)"),
    "no rows": (lambda s: rc.measurements(np.zeros((0, 6)), position=np.zeros((0, 3))), "joints", "at least one row"),
    "words": (lambda s: made(position=[["a"] * 3] * 40), "position", "an array (40, 3)"),
    "masked": (lambda s: made(position=np.ma.masked_greater(s.p, 0)), "position", "the rows that were measured"),
    "pose and position": (lambda s: made(position=s.p, pose=s.T), "position", "pose= alone"),
    "two rotations": (lambda s: made(position=s.p, rotation=s.R, rotation_vector=s.w), "rotation_vector", "one of"),
    "poses of seven": (lambda s: made(pose=np.hstack([s.p, s.Q])), "pose", "position= with quaternion="),
    "one pose": (lambda s: made(pose=s.T[0]), "pose", "(m, 4, 4)"),
    "poses transposed": (lambda s: made(pose=s.T.transpose(0, 2, 1)), "pose", "pose.transpose(0, 2, 1)"),
    "a rotation alone": (lambda s: made(rotation=s.R), "position", "(40, 3)"),
    "rotations that stretch": (lambda s: made(position=s.p, rotation=1.1 * s.R), "rotation", "orthonormal"),
    "left-handed axes": (lambda s: made(position=s.p, rotation=s.R * [1, 1, -1]), "rotation", "determinant 1"),
    "rotations of four": (lambda s: made(position=s.p, rotation=s.Q), "rotation", "a quaternion= (m, 4)"),
    "nothing measured": (lambda s: made(), "position", "pose= (40, 4, 4)"),
    "nothing given": (lambda s: rc.measurements(), "joints", "lengths= (m, n) of a cable robot"),
    "joints and lengths": (lambda s: made(lengths=s.L, pose=s.P), "joints", "joints= (m, n) of an arm, or lengths="),
    "a sigma below 0": (lambda s: made(position=s.p, sigma=-1), "sigma", "above 0"),
    "a sigma of 0": (lambda s: made(position=s.p, sigma=0), "sigma", "above 0"),
    "sigmas of two": (lambda s: made(position=s.p, sigma=[1, 2]), "sigma", "a number, (3,) or (40, 3)"),
    "turn_sigma alone": (lambda s: made(position=s.p, turn_sigma=1e-3), "turn_sigma", "pose="),
    "one sigma of two": (lambda s: made(pose=s.T, sigma=1e-4), "turn_sigma", "both, or neither"),
    "length_sigma of an arm": (lambda s: made(position=s.p, length_sigma=1e-3), "length_sigma", "lengths="),
    "names of cables of an arm": (lambda s: made(position=s.p, cables=["a"]), "cables", "lengths="),
    "a column too short": (lambda s: made(position=s.p, columns={"t [s]": [1.0]}), "columns['t [s]']", "(40,)"),
    "a column twice": (lambda s: made(position=s.p, columns={"x [mm]": np.zeros(40)}), "columns['x [mm]']", "another header"),
    "columns of a list": (lambda s: made(position=s.p, columns=[1, 2]), "columns", "a mapping by header"),
    "lengths in degrees": (lambda s: rc.measurements(lengths=s.L, pose=s.P, units=("deg", "m")), "units[0]", "m, dm, cm, mm"),
    "other names of cables": (lambda s: rc.measurements(lengths=s.L, pose=s.P, cables=["a"]), "cables", "8 names"),
    "no convention": (lambda s: rc.robot(TABLE), "convention", '"mdh" (modified, Craig)'),
    "no columns": (lambda s: rc.robot(TABLE, convention="dh"), "columns", "'theta', 'd', 'a', 'alpha'"),
    "a column of another convention": (
        lambda s: rc.robot(TABLE, convention="dh", columns=("theta", "d", "r", "alpha")), "columns", "theta, d, a, alpha"
    ),
    "a convention that is none": (lambda s: rc.robot(TABLE, **DH | {"convention": "DH"}), "convention", "did you mean 'dh'"),
    "three names": (lambda s: rc.robot(TABLE, **DH | {"columns": ("theta", "d", "a")}), "columns", "4 of theta"),
    "a type that is none": (lambda s: rc.robot(TABLE, **DH, types="RRXRRR"), "types", "R, P or F"),
    "types of five": (lambda s: rc.robot(TABLE, **DH, types="RRRRR"), "types", "expected 6"),
    "units of a table": (lambda s: rc.robot(TABLE, **DH, units=("mm", "rad")), "units[0]", "rad, mrad"),
    "columns of a file": (lambda s: rc.robot("ur10", columns=("theta",)), "columns", "a table of parameters"),
    "a robot that is none": (lambda s: rc.robot("ur100"), "source", "did you mean 'ur10'"),
    "a number": (lambda s: rc.robot(3), "source", "an array (n, 4)"),
    "a key too few": (lambda s: rc.robot({"convention": "dh", "joints": [{"theta": 0}], "name": "x"}), "source", "key units"),
    "a key that is none": (
        lambda s: rc.robot({"name": "x", "convension": "dh", "joints": [{"theta": 0}]}), "source", "did you mean 'convention'"
    ),
    "a cable robot": (lambda s: rc.robot({"kind": "cable"}), "source", "rc.cable.robot"),
    "joints of four": (lambda s: s.arm.pose(s.q[:, :4]), "joints", "(m, 6)"),
    "anchors by columns": (lambda s: rc.cable.robot(frame_anchors=A.T, platform_anchors=B), "frame_anchors", "frame_anchors.T"),
    "anchors of one side": (lambda s: rc.cable.robot(frame_anchors=A), "platform_anchors", "(n, 3)"),
    "seven anchors": (lambda s: rc.cable.robot(frame_anchors=A, platform_anchors=B[:7]), "platform_anchors", "expected 8"),
    "two zeros": (lambda s: rc.cable.robot(frame_anchors=A, platform_anchors=B, zeros=[1, 2]), "zeros", "(8,)"),
    "degrees that are none": (lambda s: rc.cable.robot(frame_anchors=A, platform_anchors=B, degrees="6"), "degrees", "3R3T"),
    "a unit for all": (lambda s: rc.cable.robot(frame_anchors=A, platform_anchors=B, units="mm"), "units", '{"length": "mm"}'),
    "a unit that is none": (
        lambda s: rc.cable.robot(frame_anchors=A, platform_anchors=B, units={"length": "metre_"}), "units", "key units.length"
    ),
    "a key of cables": (
        lambda s: rc.cable.robot(frame_anchors=A, platform_anchors=B, every_cable={"tensions": [1, 2]}), "every_cable", "'tension'"
    ),
    "three lengths": (lambda s: s.robot.forward(s.L[:, :3]), "lengths", "(k, 8) or (8,)"),
    "a wrench of two": (lambda s: rc.cable.robot(
        frame_anchors=A, platform_anchors=B, platform={"mass": 20}, every_cable={"tension": [10, 500]}
    ).tension(s.P, wrench=[1, 2]), "wrench", "(6,) or (40, 6)"),
}  # fmt: skip
VERBS: dict[str, tuple[Call, str, str]] = {
    "arrays alone": (lambda s: rc.identify(s.arm, (s.q, s.p)), "data", "rc.measurements(joints, position=...)"),
    "one array": (lambda s: rc.identify(s.arm, s.q), "data", "found 'ndarray'"),
    "a mapping": (lambda s: rc.identify(s.arm, {"q": s.q}), "data", "rc.measurements"),
    "no robot": (lambda s: rc.identify(None, made(position=s.p)), "robot", "rc.robot(...)"),
    "an array as robot": (lambda s: rc.identify(TABLE, made(position=s.p)), "robot", "rc.robot(...)"),
    "a robot that is none": (lambda s: rc.check("ur100", made(position=s.p)), "robot", "ur10"),
    "five joints": (lambda s: rc.identify(s.arm, rc.measurements(s.q[:, :5], position=s.p)), "joints", "(m, 6)"),
    "an option that is none": (lambda s: rc.identify(s.arm, made(position=s.p), hold_outt=0.2), "hold_outt", "'hold_out'"),
    "a value that is none": (lambda s: rc.identify(s.arm, made(position=s.p), loss="hubert"), "loss", "none, huber, cauchy"),
    "out of range": (lambda s: rc.identify(s.arm, made(position=s.p), hold_out=1.2), "hold_out", "0 and 0.5"),
    "a column that is none": (lambda s: rc.identify(s.arm, made(position=s.p), group_by="day"), "group_by", "q1, q2"),
    "a parameter that is none": (lambda s: rc.identify(s.arm, made(position=s.p), free="j2.aa"), "free", "'j2.a'"),
    "a row that is none": (lambda s: rc.identify(s.arm, made(position=s.p), exclude="999"), "exclude", "a row"),
    "no folder": (lambda s: rc.identify(s.arm, made(position=s.p), output=3), "output", "a path"),
    "data of the other machine": (lambda s: rc.identify(s.robot, made(position=s.p)), "data", "lengths=lengths"),
    "lengths for an arm": (lambda s: rc.identify(s.arm, rc.measurements(lengths=s.L, pose=s.P)), "data", "joints"),
    "seven lengths": (lambda s: rc.identify(s.robot, rc.measurements(lengths=s.L[:, :7], pose=s.P)), "lengths", "(m, 8)"),
    "other cables": (
        lambda s: rc.identify(s.robot, rc.measurements(lengths=s.L, pose=s.P, cables=list("abcdefgh"))), "cables", "c1, c2"
    ),
    "two tables where one belongs": (
        lambda s: rc.cable.forward(s.robot, rc.measurements(lengths=s.L, pose=s.P)), "lengths", "lengths= alone"
    ),
    "an empty study": (lambda s: rc.study({}), "study", "key of"),
    "a key of a study": (
        lambda s: rc.study({"of": "identification", "robot": s.arm, "trials": 3, "poses": {"count": 30}, "trails": 3}), "study", "'trials'"
    ),
    "a value of a study": (lambda s: rc.study({"of": object()}), "study", "numbers, texts, lists"),
}  # fmt: skip
FITTED: dict[str, tuple[Call, str, str]] = {
    "degrees as radians": (lambda s: rc.identify(s.arm, rc.measurements(np.degrees(s.q), pose=s.T)), "units[0]", "expected deg"),
    "mm as m": (lambda s: rc.identify(s.arm, made(position=s.p * 1e3)), "units[1]", "expected mm"),
    "poses in mm as m": (lambda s: rc.identify(s.arm, made(pose=scaled(s.T))), "units[1]", "expected mm"),
    "m as mm": (lambda s: rc.identify(s.arm, made(position=s.p, units=("rad", "mm"))), "units[1]", "expected m"),
    "rotations transposed": (
        lambda s: rc.identify(s.arm, made(position=s.p, rotation=s.R.transpose(0, 2, 1))), "rotation", "its inverse"
    ),
    "the scalar first": (
        lambda s: rc.identify(s.arm, made(position=s.p, quaternion=s.Q[:, [3, 0, 1, 2]], quaternion_order="xyzw")),
        "quaternion_order", "the other order",
    ),
    "the scalar last": (
        lambda s: rc.identify(s.arm, made(position=s.p, quaternion=s.Q, quaternion_order="wxyz")),
        "quaternion_order", "the other order",
    ),
    "lengths in mm as m": (lambda s: rc.identify(s.robot, rc.measurements(lengths=1e3 * s.L, pose=s.P)), "units[0]", "the same"),
    "places in mm as m": (lambda s: rc.identify(s.robot, rc.measurements(lengths=s.L, pose=scaled(s.P))), "units[1]", "the same"),
}  # fmt: skip
CASES = {
    f"{kind}: {name}": case
    for kind, cases in (("arrays", ARRAYS), ("verbs", VERBS), ("fit", FITTED))
    for name, case in cases.items()
}


@pytest.mark.parametrize("name", CASES)
def test_a_wrong_call_is_answered_by_its_argument(name: str) -> None:
    call, argument, expected = CASES[name]
    with pytest.raises(InputError) as caught:
        call(lab())
    said = str(caught.value)
    assert caught.value.argument == argument, said
    assert f"argument {argument}" in said and expected in said, said
    assert "--" not in said and "/tmp" not in said and "robocal " not in said, said


def test_a_call_without_what_it_needs_says_what() -> None:
    with pytest.raises(TypeError, match="missing argument data: data.yaml, or a CSV"):
        rc.identify(lab().arm)  # type: ignore[call-arg]
    with pytest.raises(InputError, match="at most 2 without a name: robot, data"):
        rc.identify("ur10", "data.yaml", "run")  # type: ignore[misc]


def test_an_odd_table_is_told_where_it_is_shown() -> None:
    table = np.array(
        [[0, 290, 0, -1.57], [0, 0, 270, 0], [0, 0, 70, -1.57], [0, 302, 0, 1.57], [0, 0, 0, -1.57], [0, 72, 0, 0]]
    )
    assert "the lengths add up to 1e+03 m" in repr(rc.robot(table, **DH))
    assert "more than a whole turn" in repr(rc.robot(np.array([[0, 0.3, 0, -90.0], [0, 0, 0.3, 0]]), **DH))
