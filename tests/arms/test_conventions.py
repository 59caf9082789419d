"""Conventions against their textbooks, against each other, and against central differences."""

from __future__ import annotations

import numpy as np
import pytest
from arms.arm_samples import (
    BASE,
    HOME,
    NAMES,
    TOOL,
    arm,
    joint_values,
    moved,
    pose_difference,
    rows,
    step_table,
    textbook_pose,
)
from laws import check_jacobian

from robocal.arms.conventions import CONVENTIONS, QUANTITIES, chain
from robocal.arms.conventions import rows as rows_of
from robocal.errors import ModelError
from robocal.geometry import se3, so3

GLOBAL = ("zero-reference", "poe")


def kinds(convention):
    return ("RRRRRR", "RPR", "PRP", "RRPRR") + (() if convention in GLOBAL else ("FRRF", "RFPR"))


@pytest.mark.parametrize("convention", NAMES)
def test_pose_is_the_textbook_product(convention, rng):
    for types in kinds(convention):
        robot = arm(convention, types, rng)
        for q in joint_values(types, rng, 5):
            np.testing.assert_allclose(robot.pose(q)[0], textbook_pose(robot, q), atol=1e-13)


@pytest.mark.parametrize("convention", GLOBAL)
def test_home_stands_between_joints_and_tool(convention, rng):
    robot = arm(convention, "RRP", rng, home=HOME)
    q = joint_values("RRP", rng, 1)[0]
    np.testing.assert_allclose(robot.pose(q)[0], textbook_pose(robot, q, HOME), atol=1e-13)
    assert not any(n.startswith("home") for n in robot.usual)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("convention", NAMES)
def test_parameter_jacobian(convention, rng):
    for types in ("RRPR", "PRR"):
        robot = arm(convention, types, rng)
        q = joint_values(types, rng, 4)
        check_jacobian(
            lambda x, robot=robot, q=q: robot.with_values(x).pose(q),
            lambda x, robot=robot, q=q: robot.with_values(x).parameter_jacobian(q),
            robot.table.values,
            add=step_table(robot.table),
            subtract=pose_difference,
        )


@pytest.mark.parametrize("convention", NAMES)
def test_joint_jacobian(convention, rng):
    robot = arm(convention, "RPRR", rng)
    for q in joint_values("RPRR", rng, 3):
        check_jacobian(lambda x: robot.pose(x)[0], lambda x: robot.jacobian(x)[0], q, subtract=pose_difference)


@pytest.mark.parametrize("convention", NAMES)
def test_rows_come_back_with_the_tables_values(convention, rng):
    types = "RRP" if convention in GLOBAL else "RFRP"
    robot = arm(convention, types, rng)
    other = robot.with_values({n: robot.table[n].value + rng.normal(0, 0.01) for n in (*robot.geometric, "j1.gain")})
    again = chain("again", convention, rows_of(other), base=BASE, tool=TOOL)
    assert again.table.names == other.table.names
    np.testing.assert_allclose(again.table.values, other.table.values, atol=1e-13)
    q = joint_values(types, rng, 6)
    np.testing.assert_allclose(again.pose(q), other.pose(q), atol=1e-13)
    assert np.abs(robot.pose(q) - other.pose(q)).max() > 1e-3


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_urdf_origin_comes_back_where_roll_and_yaw_are_one(pitch):
    row = {"xyz": [0.1, 0.2, 0.3], "rpy": [0.4, pitch, -0.3]}
    robot = chain("u", "urdf", [row])
    again = chain("u", "urdf", rows_of(robot))
    np.testing.assert_allclose(again.pose([0.3]), robot.pose([0.3]), atol=1e-12)


# --- one robot, many descriptions -----------------------------------------------------------------------------------

MDH = [  # alpha, a, theta, d, type: an arm with parallel, skew and crossing axes and a slide
    (0.0, 0.1, 0.0, 0.4, "revolute"),
    (-np.pi / 2, 0.05, -np.pi / 2, 0.0, "revolute"),
    (0.0, 0.55, 0.2, 0.1, "revolute"),
    (np.pi / 2, 0.0, 0.0, 0.35, "prismatic"),
    (-0.9, 0.07, 0.3, 0.2, "revolute"),
    (1.1, 0.02, -0.1, 0.15, "revolute"),
]
GRIP = (0.02, -0.01, 0.12, 0.3, -0.2, 0.5)


def described(convention):
    """The arm of MDH in another convention, converted here with matrices."""
    axes, at, origins = [], np.eye(4), []
    for alpha, a, theta, d, _ in MDH:
        origin = moved("rx", alpha) @ moved("tx", a) @ moved("rz", theta) @ moved("tz", d)
        origins.append(origin)
        at = at @ origin
        axes.append((at[:3, 2].copy(), at[:3, 3].copy()))
    types = [row[4] for row in MDH]
    home = se3.to_vector(at)
    made = []
    if convention == "mdh":
        made = [{"alpha": al, "a": a, "theta": th, "d": d} for al, a, th, d, _ in MDH]
    elif convention == "dh":
        # The first two factors go to the base; every other pair moves to the end of the row before.
        ends = [*[(al, a) for al, a, *_ in MDH[1:]], (0.0, 0.0)]
        made = [{"theta": th, "d": d, "a": a, "alpha": al} for (_, _, th, d, _), (al, a) in zip(MDH, ends, strict=True)]
        base = se3.to_vector(moved("rx", MDH[0][0]) @ moved("tx", MDH[0][1]))
        return chain("dh", "dh", typed(made, types), base=base, tool=GRIP)
    elif convention == "urdf":
        for o in origins:
            r = o[:3, :3]
            rpy = [np.arctan2(r[2, 1], r[2, 2]), np.arcsin(-r[2, 0]), np.arctan2(r[1, 0], r[0, 0])]
            made.append({"xyz": list(o[:3, 3]), "rpy": rpy, "axis": [0, 0, 1]})
    elif convention == "urdf-negative":
        # The same joints about -z, driven backwards: gain -1.
        return chain(
            "urdf", "urdf", [{**r, "axis": [0, 0, -1], "gain": -1.0} for r in described("urdf").meta["rows"]], tool=GRIP
        )  # fmt: skip
    elif convention in ("offsets", "poe-local"):
        made = [dict(zip(("x", "y", "z", "rx", "ry", "rz"), se3.to_vector(o), strict=True)) for o in origins]
    elif convention == "poe":
        made = [
            {"v": list(np.cross(p, w)), "w": list(w)} if t == "revolute" else {"v": list(w)}
            for (w, p), t in zip(axes, types, strict=True)
        ]
        return chain("poe", "poe", typed(made, types), home=home, tool=GRIP)
    elif convention == "zero-reference":
        made = [{"axis": list(w), "point": list(p)} for w, p in axes]
        return chain("zero", convention, typed(made, types), tool=se3.to_vector(at @ se3.from_vector(GRIP)))
    elif convention == "elements":
        for alpha, a, theta, d, t in MDH:
            steps = [("rx", "alpha", alpha), ("tx", "a", a), ("rz", "theta", theta), ("tz", "d", d)]
            driven = "rz" if t == "revolute" else "tz"
            made.append(
                {"elements": [{"axis": x, "symbol": s, "value": v, "driven": x == driven} for x, s, v in steps]}
            )
    elif convention == "cpc":
        # Each row's V_i is Rx(alpha) Tx(a) Rz(theta) Tz(d) of the next: R(b) is a turn about x, beta = theta.
        following = [*MDH[1:], (0.0, 0.0, 0.0, 0.0, "")]
        for alpha, a, theta, d, _ in following:
            beside = np.array([a, 0, 0]) @ so3.exp([0, 0, theta])  # the shift seen after the turns
            made.append(
                {"b": [0, -np.sin(alpha), np.cos(alpha)], "beta": theta, "lx": beside[0], "ly": beside[1], "lz": d}
            )
        first = moved("rx", MDH[0][0]) @ moved("tx", MDH[0][1]) @ moved("rz", MDH[0][2]) @ moved("tz", MDH[0][3])
        return chain("cpc", "cpc", typed(made, types), base=se3.to_vector(first), tool=GRIP)
    return chain(convention, convention, typed(made, types), tool=GRIP)


def typed(made, types):
    return [{**row, "type": t} for row, t in zip(made, types, strict=True)]


OTHERS = ("dh", "urdf", "urdf-negative", "offsets", "poe-local", "poe", "zero-reference", "elements", "cpc")


@pytest.mark.parametrize("convention", OTHERS)
def test_one_robot_has_one_pose(convention, rng):
    q = joint_values("RRRPRR", rng, 40)
    np.testing.assert_allclose(described(convention).pose(q), described("mdh").pose(q), atol=1e-12)


@pytest.mark.parametrize("convention", OTHERS)
def test_one_robot_has_one_picture(convention, rng):
    """The way along the axes belongs to the arm, not to the frames in which it is written; the base stands at its own origin."""
    q = joint_values("RRRPRR", rng, 5)
    ways = [robot.lines(q, robot.pose(q))[""] for robot in (described(convention), described("mdh"))]
    one = ways[0]
    np.testing.assert_allclose(one[:, 2:], ways[1][:, 2:], atol=1e-9)
    assert one.shape == (5, 14, 3)
    base = [described(convention).table[f"base.{s}"].value for s in "xyz"]
    np.testing.assert_allclose(one[:, 0], np.tile(base, (5, 1)), atol=1e-12)
    np.testing.assert_allclose(one[:, -1], described("mdh").pose(q)[:, :3, 3], atol=1e-12)
    # Each piece along an axis that turns lies on it: what the joint moves behind it leaves the piece where it is.
    turned = q.copy()
    turned[:, 2] += 0.3
    other = described(convention)
    np.testing.assert_allclose(other.lines(turned, other.pose(turned))[""][:, :6], one[:, :6], atol=1e-9)


def test_a_gantry_is_drawn_slide_by_slide():
    """Three slides across one another: each piece is as long as its joint has gone, and ends where the next begins."""
    robot = chain("gantry", "urdf", [{"axis": a, "type": "prismatic"} for a in ([1, 0, 0], [0, 1, 0], [0, 0, 1])])
    q = np.array([[0.3, -0.2, 0.5]])
    (way,) = robot.lines(q, robot.pose(q))[""]
    np.testing.assert_allclose(
        way[[0, 2, 4, 6]], [[0, 0, 0], [0.3, 0, 0], [0.3, -0.2, 0], [0.3, -0.2, 0.5]], atol=1e-12
    )
    np.testing.assert_allclose(way[-1], robot.pose(q)[0, :3, 3], atol=1e-12)


def test_an_arm_whose_joints_count_with_others_is_drawn_like_one_whose_do_not(rng):
    """What joint 2 adds to joint 3 turns about the axis of joint 3: each axis stands where it stands."""
    made = [{"alpha": al, "a": a, "theta": th, "d": d} for al, a, th, d, _ in MDH]
    alone = chain("mdh", "mdh", typed(made, [row[4] for row in MDH]), tool=GRIP)
    shared = [{**row, "with": {"j2": -1.0}} if i == 2 else row for i, row in enumerate(made)]
    both = chain("mdh", "mdh", typed(shared, [row[4] for row in MDH]), tool=GRIP)
    q = joint_values("RRRPRR", rng, 5)
    own = q.copy()
    own[:, 2] -= q[:, 1]
    np.testing.assert_allclose(both.pose(q), alone.pose(own), atol=1e-12)
    np.testing.assert_allclose(both.lines(q, both.pose(q))[""], alone.lines(own, alone.pose(own))[""], atol=1e-9)


def test_an_aligned_axis_is_a_plain_element():
    robot = chain("u", "urdf", [{"axis": [0, -1, 0]}, {"axis": [0, 0, 2], "type": "prismatic"}, {"axis": [1, 1, 0]}])
    driven = [e for e in robot.elements if any(t.column != "1" for t in e.terms)]
    assert [e.axis for e in driven] == ["ry", "tz", "screw"]
    np.testing.assert_allclose(robot.pose([0.3, 0, 0])[0], moved("ry", -0.3), atol=1e-15)


# --- what a convention declares -------------------------------------------------------------------------------------


@pytest.mark.parametrize("convention", NAMES)
def test_declared_keys_are_what_a_row_may_give(convention, rng):
    rule = CONVENTIONS[convention]
    assert all(k.quantity in QUANTITIES for k in rule.key.values())
    assert len(rule.key) == len(rule.keys) + 5
    robot = arm(convention, "RP", rng)
    units = {"length": "m", "angle": "rad"}
    for k in rule.keys:
        name = f"j1.{k.name}"
        if k.quantity in units:
            assert robot.table[name].unit == units[k.quantity]
    for joint, unit in (("j1", "rad"), ("j2", "m")):
        driven = rule.revolute if joint == "j1" else rule.prismatic
        if convention != "elements":
            assert robot.table[f"{joint}.{driven}"].unit == unit
    # A required key is really required; all others may be left out.
    row = rows(convention, "R", rng)[0]
    for k in rule.keys:
        less = {key: v for key, v in row.items() if key != k.name}
        if k.required:
            with pytest.raises(ModelError, match=f"j1.{k.name}"):
                chain("x", convention, [less])
        elif (convention, k.name) != ("poe", "w"):  # zero, and so right for a prismatic joint only
            chain("x", convention, [less])


@pytest.mark.parametrize("convention", NAMES)
def test_default_free_is_the_geometry_and_the_tool(convention, rng):
    robot = arm(convention, "RPR", rng)
    free = robot.usual
    assert {f"tool.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")} <= set(free)
    held = {n for n in robot.table.names if n.startswith("base.") or n.endswith((".gain", ".offset"))}
    assert free == tuple(n for n in robot.table.names if n not in held)


BAD = [
    ("dh", {"alhpa": 1.0}, "j1.alhpa", "alpha"),
    ("dh", {"alpha": "90"}, "j1.alpha", None),
    ("dh", {"alpha": True}, "j1.alpha", None),
    ("dh", {"alpha": float("nan")}, "j1.alpha", None),
    ("dh", {"type": "rotary"}, "j1.type", None),
    ("dh", {"type": "prismatik"}, "j1.type", "prismatic"),
    ("dh", {"limits": [1.0]}, "j1.limits", None),
    ("dh", {"limits": [1.0, -1.0]}, "j1.limits", None),
    ("dh", {"name": "tool"}, "joint 1.name", None),
    ("dh", {"name": ""}, "joint 1.name", None),
    ("urdf", {"axis": [0, 0, 0]}, "j1.axis", None),
    ("urdf", {"rpy": [0, 0]}, "j1.rpy", None),
    ("urdf", {"xyz": "123"}, "j1.xyz", None),
    ("poe", {"v": [0, 0, 0]}, "j1.w", None),
    ("poe", {"v": [0, 0, 1], "w": [0, 0, 2]}, "j1.w", None),
    ("poe", {"type": "prismatic", "v": [0, 0, 1], "w": [0, 0, 1]}, "j1.w", None),
    ("poe", {"type": "prismatic", "v": [0, 0, 3]}, "j1.v", None),
    ("poe", {"type": "fixed", "v": [0, 0, 1]}, "j1.type", None),
    ("cpc", {"b": [0, 0, -1]}, "j1.b", None),
    ("elements", {"elements": "rx"}, "j1.elements", None),
    ("elements", {"elements": []}, "j1.elements", None),
    ("elements", {"elements": [{"axis": "tz", "driven": True}]}, "j1.elements", None),
    ("elements", {"elements": [{"axis": "rq", "driven": True}]}, "j1.elements[0].axis", "rx"),
    ("elements", {"elements": [{"axis": "rz", "drive": True}]}, "j1.elements[0].drive", "driven"),
    ("elements", {"elements": [{"axis": "rz", "driven": 2}]}, "j1.elements[0].driven", None),
    ("elements", {"elements": [{"axis": "rz", "driven": 1, "symbol": "gain"}]}, "j1.elements[0].symbol", None),
    ("elements", {"elements": [{"axis": "rz", "driven": 1, "value": "a"}]}, "j1.elements[0].value", None),
]


@pytest.mark.parametrize(("convention", "row", "key", "suggestion"), BAD)
def test_a_bad_row_is_named(convention, row, key, suggestion):
    with pytest.raises(ModelError) as caught:
        chain("x", convention, [row])
    assert caught.value.key == key
    assert caught.value.suggestion == suggestion


def test_bad_arms_are_named():
    with pytest.raises(ModelError) as caught:
        chain("x", "dh-hayatti", [{}])
    assert caught.value.suggestion == "dh-hayati"
    with pytest.raises(ModelError, match="twice"):
        chain("x", "dh", [{"name": "a"}, {"name": "a"}])
    with pytest.raises(ModelError, match="base"):
        chain("x", "dh", [{}], base=(0, 0, 0))
    with pytest.raises(ModelError, match="home"):
        chain("x", "dh", [{}], home=(0,) * 6)
