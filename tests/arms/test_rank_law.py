"""The rank law: with base and tool free, poses show 4 R + 2 P + 6 numbers of a complete model, and never more.

Source: Mooring, Roth and Driels, Fundamentals of manipulator calibration (1991), for R revolute and P prismatic joints.
"""

from __future__ import annotations

import numpy as np
import pytest
from arms.arm_samples import COMPLETE, NAMES, arm, joint_values

from robocal.arms.conventions import chain

BASE = tuple(f"base.{s}" for s in ("x", "y", "z", "rx", "ry", "rz"))
MIXED = ("RRRRRR", "RRRRR", "RRRRRRR", "RRRP", "PRR", "RPRPR", "PPPRRR", "RRPR")


def singular_values(robot, types, rng, m=60, spread=1.0):
    """Of the Jacobian of m random poses with columns scaled to one, largest first and divided by the largest."""
    names = (*BASE, *robot.usual)
    j = robot.parameter_jacobian(joint_values(types, rng, m) * spread, names).reshape(-1, len(names))
    size = np.linalg.norm(j, axis=0)
    s = np.linalg.svd(j / np.where(size > 0, size, 1), compute_uv=False)
    return s / s[0]


def law(types):
    return 4 * types.count("R") + 2 * types.count("P") + 6


def assert_rank(robot, types, rng, expected, kept=1e-5):
    """Exactly `expected` singular values stand clear of rounding: the next one is a gap of at least five decades
    below."""
    s = singular_values(robot, types, rng)
    assert s[expected - 1] > kept, (expected, s)
    assert len(s) == expected or s[expected] < 1e-10, (expected, s)


@pytest.mark.parametrize("convention", COMPLETE)
def test_generic_arms(convention, rng):
    for types in MIXED:
        assert_rank(arm(convention, types, rng), types, rng, law(types))


@pytest.mark.parametrize("convention", [n for n in NAMES if n not in COMPLETE and n != "elements"])
def test_dh_and_its_kin_are_complete_for_skew_axes_only(convention, rng):
    for types in MIXED:
        assert_rank(arm(convention, types, rng), types, rng, law(types))


def straight(convention, types, tilt, rng):
    """Axes parallel to within `tilt` rad, 0.3 to 0.5 m apart sideways and one above the other."""
    rows = []
    at = np.zeros(3)
    for i, letter in enumerate(types):
        e = tilt * rng.uniform(0.5, 1, 3) * rng.choice([-1, 1], 3)
        step = np.array([rng.uniform(0.3, 0.5), 0.1 * (-1) ** i, 0.12])
        at = at + step
        row = {"type": "revolute" if letter == "R" else "prismatic"}
        if convention.startswith("khalil"):
            row |= {"alpha": e[0], "d": step[0], "r": step[2], "theta": 0.3}
            row |= {"beta": e[1]} if "hayati" in convention else {}
        elif "dh" in convention:
            row |= {"alpha": e[0], "a": step[0], "d": step[2], "theta": 0.3}
            row |= {"beta": e[1]} if "hayati" in convention else {}
        elif convention == "s-model":
            row |= {"alpha": e[0], "a": step[0], "d": step[2], "beta": 0.3}
        elif convention == "mcpc":
            row |= {"alpha": e[0], "beta": e[1], "x": step[0], "y": step[1], "d": step[2]}
        elif convention == "cpc":
            row |= {"b": [e[0], e[1], 1.0], "lx": step[0], "ly": step[1], "lz": step[2]}
        elif convention == "zero-reference":
            row |= {"axis": [e[0], e[1], 1.0], "point": list(at)}
        elif convention == "poe":
            w = np.array([e[0], e[1], 1.0]) / np.linalg.norm([e[0], e[1], 1.0])
            row |= {"v": list(np.cross(at, w)), "w": list(w)} if letter == "R" else {"v": list(w)}
        elif convention == "urdf":
            row |= {"xyz": list(step), "rpy": list(e), "axis": [0, 0, 1]}
        else:
            row |= {"x": step[0], "y": step[1], "z": step[2], "rx": e[0], "ry": e[1], "rz": e[2]}
        rows.append(row)
    return chain(f"straight {convention}", convention, rows, tool=(0.1, 0.05, 0.2, 0.1, 0.2, 0.3))


@pytest.mark.parametrize("tilt", [0.0, 1e-6, 1e-2])
@pytest.mark.parametrize("convention", COMPLETE)
def test_parallel_and_nearly_parallel_axes(convention, tilt, rng):
    for types in ("RRRR", "RRPR", "PRRR"):
        robot = straight(convention, types, tilt, rng)
        assert len(robot.parallel_axes()) == 3
        assert_rank(robot, types, rng, law(types))


@pytest.mark.parametrize(("convention", "seen"), [("dh", 19), ("mdh", 19), ("khalil", 19), ("s-model", 19)])
def test_what_parallel_axes_hide_from_an_incomplete_model(convention, seen, rng):
    """Each of the three parallel pairs hides one tilt, so 4 x 4 + 6 - 3 = 19 are left: a model without beta is not
    complete."""
    assert_rank(straight(convention, "RRRR", 0.0, rng), "RRRR", rng, seen)


def test_parallel_axes_are_named(rng):
    ur = chain(
        "ur",
        "dh",
        [{"alpha": np.pi / 2}, {"a": -0.6}, {"a": -0.5}, {"alpha": np.pi / 2}, {"alpha": -np.pi / 2, "d": 0.1}, {}],
    )
    assert ur.parallel_axes() == (("j2", "j3"), ("j3", "j4"))
    bent = ur.with_values({"j2.alpha": 0.04, "j3.alpha": np.pi - 0.06})
    assert bent.parallel_axes() == (("j2", "j3"),)
    assert bent.parallel_axes(0.07) == (("j2", "j3"), ("j3", "j4"))
    slide = chain("rp", "mdh", [{"name": "turn"}, {"name": "lift", "type": "prismatic"}])
    assert slide.parallel_axes() == (("turn", "lift"),)
    assert chain("one", "dh", [{}]).parallel_axes() == ()
