"""A tool that never turns: what nothing holds stays where making leaves it, the fit converges, and the region counts what is not known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocal.arms.conventions import chain
from robocal.arms.inverse_kinematics import inverse_pose
from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.geometry import se3, so3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.identify import baseline, identify

TARGET = (0.015, 0.04, 0.08, 0.0, 0.0, 0.0)
WIDE = (0.2, 1.0)
BETWEEN = np.array([0.3, 0.4, 0.2, 0.3, 0.7, -0.2])


def six_axes(rng, count, turned):
    """A catalogue arm at places of one orientation, but for what it is `turned` (rad)."""
    nominal = open_robot("irb-120").chain
    nominal = replace(nominal, table=nominal.table.with_free(nominal.usual))
    first = nominal.pose(BETWEEN[None], {})[0]
    away = se3.compose(so3.exp(turned * rng.normal(size=(2 * count, 3))), rng.uniform(-0.15, 0.15, (2 * count, 3)))
    around = se3.compose(np.eye(3), first[:3, 3]) @ away @ se3.compose(first[:3, :3], np.zeros(3))
    found = inverse_pose(nominal, around, start=BETWEEN, restarts=0)
    return nominal, found.joints[found.success][:count]


def gantry(rng, count, _):
    """Three slides: its tool cannot turn."""
    rows = [
        {"type": "prismatic", "alpha": a, "theta": t}
        for a, t in ((0.0, 0.0), (-np.pi / 2, -np.pi / 2), (np.pi / 2, 0.0))
    ]
    nominal = chain("gantry", "dh", rows)
    nominal = replace(nominal, table=nominal.table.with_free(nominal.usual))
    return nominal, rng.uniform(0.1, 0.9, (count, 3))


def recorded(machine, count=70, noise=4e-5, errors=1.0, turned=0.0, seed=0, kind="position"):
    """The nominal robot, and what a tracker somewhere reads of a target somewhere on the tool."""
    rng = np.random.default_rng(seed)
    nominal, q = machine(rng, count, turned)
    off = {"m": 4e-4, "rad": 1e-3, "1": 0.0}
    geometric = [n for n in nominal.table.free if not n.startswith("tool.")]
    truth = nominal.with_values(
        {n: nominal.table[n].value + errors * rng.normal(0, off[nominal.table[n].unit]) for n in geometric}
    )
    size = {"position": 3, "pose": 6}[kind]
    sigma = np.full((len(q), size), 1e-9)
    tracker = Frame("tracker", (1.2, -2.1, 0.4, 0.3, -0.2, 1.1), (True,) * 6, expected=(10.0, 3.0))
    ball = Frame("ball", TARGET, (True,) * 3 + (kind == "pose",) * 3, mount="tool", expected=WIDE)
    seen = Observations(
        kind, np.arange(len(q)), np.zeros((len(q), size)), sigma, tracker, (ball,), np.zeros(len(q), dtype=int)
    )
    where = Configurations(tuple(map(str, range(len(q)))), q)
    (read,) = synthesise(truth, DataSet(where, (seen,)), rng).observations
    value = read.value + noise * rng.normal(size=read.value.shape)
    unknown = replace(tracker, value=(0.0,) * 6), (replace(ball, value=(0.0,) * 6),)
    return nominal, DataSet(where, (replace(read, value=value, sigma=None, frame=unknown[0], targets=unknown[1]),))


@pytest.mark.parametrize("machine", [six_axes, gantry])
@pytest.mark.parametrize("turned", [0.0, 1e-9, 1e-5])
def test_the_baseline_of_a_tool_that_never_turns_stays_near(machine, turned):
    nominal, data = recorded(machine, errors=0.0, turned=turned)
    problem, x = baseline(nominal, data, np.arange(len(data.configurations)))
    assert np.linalg.norm(problem.residuals(x)[0].value, axis=1).mean() < 1e-4
    place = x[0, [problem.table.index[f"ball.{s}"] for s in "xyz"]]
    assert np.abs(place).max() < WIDE[0]


@pytest.mark.sampled(4)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("noise", [0.0, 4e-5])
@pytest.mark.parametrize("turned", [0.0, 1e-5])
def test_it_converges_and_counts_what_nothing_holds(seed, noise, turned):
    nominal, data = recorded(six_axes, noise=noise, turned=turned, seed=seed)
    found = identify(nominal, data, Options(leave_one_out=False))
    assert found.reason.converged
    assert found.verdict.status == "improved"
    told = {p.name: p for p in found.parameters if p.name.split(".")[0] in ("tool", "ball")}
    assert all(p.status != "identified" for p in told.values())
    assert all(told[f"ball.{s}"].status == "prior" and told[f"ball.{s}"].sigma > 0.9 * WIDE[0] for s in "xyz")
    known = dict(zip(found.total.names, found.total.sigma, strict=True))
    assert all(known[f"ball.{s}"] == pytest.approx(WIDE[0], rel=0.01) for s in "xyz")
    assert all(abs(p.identified) <= WIDE[0] for n, p in told.items() if n[-2:] in (".x", ".y", ".z"))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("noise", [0.0, 4e-5])
@pytest.mark.parametrize("turned", [1e-6, 3e-5, 1e-4, 1e-3, 1e-2])
def test_it_converges_however_little_the_tool_turns(turned, noise):
    for seed in (1, 4):  # with noise and 1e-4 the second did not, before what the nominal robot hardly tells was held
        nominal, data = recorded(six_axes, count=60, noise=noise, turned=turned, seed=seed)
        found = identify(nominal, data, Options(leave_one_out=False))
        assert found.reason.converged and found.verdict.status == "improved"
        same, data = recorded(six_axes, count=60, noise=noise, errors=0.0, turned=turned, seed=seed)
        problem, x = baseline(same, data, np.arange(60))
        assert np.linalg.norm(problem.residuals(x)[0].value, axis=1).mean() < 2e-4


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 4e-5])
@pytest.mark.parametrize("turned", [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
def test_many_rows_converge_too(turned, noise):
    nominal, data = recorded(six_axes, count=2500, noise=noise, turned=turned)
    found = identify(nominal, data, Options(leave_one_out=False))
    assert found.reason.converged and found.verdict.status == "improved"
