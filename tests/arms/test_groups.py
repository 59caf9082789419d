"""Groups beyond geometry: zero changes nothing, the Jacobian is exact in every convention, gravity is what statics
says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms.arm_samples import BASE, HOME, NAMES, TOOL, rows
from laws import check_jacobian

from robocal.arms import catalog
from robocal.arms.conventions import chain
from robocal.arms.gravity_load import Gravity, Load
from robocal.arms.groups import GROUPS, add, fix_groups, free_groups
from robocal.arms.joints import with_compliance, with_eccentricity
from robocal.errors import ModelError

LINKS = (Load("j1", 3.0, (0.1, 0.2, -0.1)), Load("j3", 2.0, (0.0, 0.1, 0.3)), Load("", 1.5))
OPTIONS = {
    "eccentricity": {"harmonics": (1, 2, 3)},
    "ripple": {"harmonics": {"j1": (7.0, 40.5), "j3": (11.0,)}},
    "compliance": {"links": LINKS},
    "bending": {"links": LINKS},
}
POINTS = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.2, 0.1]])


def arm(convention, rng):
    kind = "RPR"
    home = HOME if convention in ("zero-reference", "poe") else None
    return chain("sample", convention, rows(convention, kind, rng), base=BASE, tool=TOOL, home=home)


def recorded(model, m, rng):
    out = {"temperature": rng.uniform(288, 303, m), "payload": rng.uniform(0, 5, m)}
    return out | {f"approach.{j}": rng.choice([-1.0, 1.0], m) for j in model.joint_names}


def grown(model):
    """Every group that this convention takes."""
    for name in GROUPS:
        if name == "expansion" and model.convention in ("zero-reference", "poe"):
            with pytest.raises(ModelError, match="lengths of the links"):
                add(model, name)
            continue
        model = add(model, name, OPTIONS.get(name))
    return model


@pytest.mark.sampled(5)
@pytest.mark.parametrize("convention", NAMES)
def test_zero_changes_nothing_and_the_jacobian_is_exact(convention, rng):
    bare = arm(convention, rng)
    model = grown(bare)
    q, columns = rng.uniform(-1.5, 1.5, (4, 3)), recorded(bare, 4, rng)
    np.testing.assert_allclose(model.pose(q, columns), bare.pose(q), atol=1e-14)
    names = [p for g in model.groups for p in g.parameters]
    assert len(names) == len(set(names)) > 30
    start, scale = np.array([model.table[n].value for n in names]), np.array([model.table[n].scale for n in names])
    start = start + scale * rng.normal(size=len(names))
    scale = 100 * scale  # a step of 1e-4 of it stays well above rounding

    def lagged(u):
        """The model with other values, columns as they were: what a solver sees."""
        return replace(model, table=model.table.with_values(dict(zip(names, start + scale * u, strict=True))))

    def points(u):
        t = lagged(u).pose(q, columns)
        return t[:, None, :3, 3] + np.einsum("mij,pj->mpi", t[:, :3, :3], POINTS)

    def jacobian(u):
        there = lagged(u)
        j = there.parameter_jacobian(q, names, columns)
        lever = points(u) - there.pose(q, columns)[:, None, :3, 3]
        return (j[:, None, :3] + np.cross(j[:, None, 3:], lever[..., None], axis=2)) * scale

    seen = np.abs(jacobian(np.zeros(len(names)))).max(axis=(0, 1, 2)) > 1e-9
    # A bend across the last axis can be seen by no lever when its moment is none; everything else moves something.
    assert seen.mean() > 0.8
    check_jacobian(points, jacobian, np.zeros(len(names)), step=1e-3)


def test_gravity_is_what_statics_says():
    """A planar arm stretched out along x: the torque about the shoulder is sum m g x, and it falls with the cosine."""
    table = [{"name": "j1", "a": 0.5, "alpha": 0.0}, {"name": "j2", "a": 0.3, "alpha": 0.0}]
    lying = chain("planar", "dh", table, base=(0, 0, 0, np.pi / 2, 0, 0))
    weight = Gravity(
        lying, ("j1", "j2"), (Load("j1", 4.0, (-0.25, 0, 0)), Load("j2", 2.0), Load("", 1.0, column="payload"))
    )
    q = np.array([[0.0, 0.0], [0.7, 0.0], [0.0, np.pi / 2]])
    known = {"j1": q[:, 0], "j2": q[:, 1], "payload": np.array([0.0, 0.0, 5.0])}
    found = weight.columns(q, known)
    g = 9.80665
    stretched = -g * (4 * 0.25 + 2 * 0.8)
    np.testing.assert_allclose(
        found["gravity.j1"], [stretched, stretched * np.cos(0.7), -g * (4 * 0.25 + 7 * 0.5)], rtol=1e-12
    )
    np.testing.assert_allclose(found["gravity.j2"], [-g * 0.6, -g * 0.6 * np.cos(0.7), 0.0], atol=1e-12)
    np.testing.assert_allclose(found["gravity.j1.u"], 0, atol=1e-12)


def test_a_soft_joint_sags_and_a_payload_sags_it_more(rng):
    soft = with_compliance(catalog.get("ur10"), ("j2",), (Load("j3", 5.0),)).with_values({"j2.compliance": 1e-4})
    q = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    height = [soft.pose(q, {"payload": kg})[0, 2, 3] for kg in (0.0, 5.0)]
    assert catalog.get("ur10").pose(q)[0, 2, 3] - 1e-3 > height[0] > height[1] + 1e-3
    # Not recorded is no payload.
    assert soft.pose(q)[0, 2, 3] == height[0]


def test_a_refresh_of_gravity_is_second_order(rng):
    """Torques at the nominal and at the true model: what that changes is a thousandth of the deflection."""
    nominal = add(catalog.get("ur10"), "compliance")
    true = {n: nominal.table[n].value + rng.normal() * 1e-3 for n in nominal.geometric}
    soft = {f"j{i}.compliance": 5e-5 for i in range(1, 7)}
    model = nominal.with_values(true | soft)
    lagged = replace(model, derived=nominal.derived)
    q = rng.uniform(-np.pi, np.pi, (200, 6))
    place = [c.pose(q)[:, :3, 3] for c in (nominal.with_values(true), model, lagged)]
    sag, moved = np.linalg.norm(place[1] - place[0], axis=1), np.linalg.norm(place[2] - place[1], axis=1)
    print(f"\ndeflection {1e3 * sag.mean():.3f} mm, changed by a refresh {1e6 * moved.mean():.2f} um")
    assert 0 < moved.max() < 5e-3 * sag.max()


def test_orders_of_one_joint_and_orders_that_are_there_already():
    model = with_eccentricity(add(catalog.get("ur10"), "eccentricity"), harmonics={"j1": (2, 20.5)})
    assert [n for n in model.table.names if n.startswith("j1.cos")] == ["j1.cos1", "j1.cos2", "j1.cos20_5"]


def test_ripple_fades_where_nothing_was_measured():
    bare = catalog.get("ur10")
    options = {"harmonics": {"j2": (9.0, 14.0)}, "range": {"j2": (-1.0, 0.5)}}
    values = {"j2.cos9": 1e-3, "j2.sin14": 1e-3}
    model, wide = (add(bare, "ripple", o).with_values(values) for o in (options, {"harmonics": options["harmonics"]}))
    q = np.zeros((61, 6))
    q[:, 1] = np.linspace(-2, 2, 61)
    inside, outside = (q[:, 1] >= -1) & (q[:, 1] <= 0.5), (q[:, 1] < -1.1) | (q[:, 1] > 0.6)
    np.testing.assert_allclose(model.pose(q[inside]), wide.pose(q[inside]), atol=1e-15)
    np.testing.assert_allclose(model.pose(q[outside]), bare.pose(q[outside]), atol=1e-15)
    fine = np.zeros((2001, 6))
    fine[:, 1] = np.linspace(-1.2, -0.9, 2001)
    place = model.pose(fine)[:, :3, 3] - bare.pose(fine)[:, :3, 3]
    assert np.linalg.norm(np.diff(place, axis=0), axis=1).max() < 1e-5


def test_held_and_released():
    model = fix_groups(add(add(catalog.get("ur10"), "gain"), "eccentricity"))
    assert not model.table.free
    assert set(free_groups(model, ["gain"]).table.free) == {f"j{i}.gain" for i in range(1, 7)}


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("gains", {}, "gain"),
        ("gain", {"joint": ["j1"]}, "joints"),
        ("eccentricity", {"joints": ["j9"]}, "no joint has this name"),
        ("eccentricity", {"harmonics": [0]}, "order"),
        ("compliance", {"links": (Load("j7", 1.0),)}, "no joint has this name"),
        ("sag", {"gravity": (0, 0, 0)}, "direction"),
    ],
)
def test_what_is_wrong_is_named(name, options, words):
    with pytest.raises(ModelError, match=words):
        add(catalog.get("ur10"), name, options)


def test_unknown_masses_are_said():
    with pytest.raises(ModelError, match="not known"):
        add(catalog.get("irb-120"), "compliance")
    with pytest.raises(ModelError, match="there already"):
        add(add(catalog.get("ur10"), "gain"), "gain")
