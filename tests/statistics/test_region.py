"""Where a correction holds: arms measured within 15 % of each joint's range and used in all of it; whole identifications."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest
from trials import SIGMA, TRACKER

from robocal.files.robot import open_robot
from robocal.fit.options import JointRegion, Options
from robocal.measure.base import problem, synthesise
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.prove.bands import range_of_joints
from robocal.prove.identify import identify
from robocal.prove.place_bands import between
from robocal.prove.region import region_of_limits

pytestmark = pytest.mark.slow
ARMS = ("rv-2aj", "ur10", "panda", "irb-120")
TRIALS = int(os.environ.get("ROBOCAL_TRIALS", "10"))  # of each arm
TURN = 2.8  # where a joint may turn farther than anybody lets it
FIT, ELSEWHERE, SHARE = 50, 1000, 0.15


def positions(q, frame, sigma=SIGMA["position"]):
    m = len(q)
    obs = Observations("position", np.arange(m), np.zeros((m, 3)), np.tile(sigma, (m, 1)), frame)
    return DataSet(Configurations(tuple(f"p{i}" for i in range(m)), q), (obs,))


def limited_arm(name):
    """An arm of the catalogue with limits that somebody wrote."""
    arm = open_robot(name).chain
    low, high = np.clip(arm.limits, -TURN, TURN).T
    joints = [replace(j, lower=float(a), upper=float(b)) for j, a, b in zip(arm.joints, low, high, strict=True)]
    return replace(arm, joints=tuple(joints))


def near_one_place(name, seed):
    """Nominal and true arm (0.3 mm and 1 mrad per parameter), and positions within a part of the range of each joint."""
    model, rng = limited_arm(name), np.random.default_rng(1000 + seed)
    sizes = {n: 3e-4 if model.table[n].unit == "m" else 1e-3 for n in model.table.free}
    truth = model.with_values({n: model.table[n].value + rng.normal(0, s) for n, s in sizes.items()})
    low, high = model.limits.T
    width = SHARE * (high - low)
    first = rng.uniform(low, high - width)
    q = rng.uniform(first, first + width, (FIT, len(low)))
    data = synthesise(truth, positions(q, replace(TRACKER, free=(False,) * 6)), rng)
    return model, truth, replace(data, observations=(replace(data.observations[0], frame=TRACKER),)), rng


def draw(name, seed):
    """What came of an identification, and the rms errors (m) over all of the arm's range of the identified model and of the
    baseline, each with its own frame and tool."""
    model, truth, data, rng = near_one_place(name, seed)
    found = identify(model, data, Options(region=region_of_limits(model, data)))
    away = positions(rng.uniform(*model.limits.T, (ELSEWHERE, len(model.joints))), TRACKER)
    made = problem(truth, away)
    true = made.residuals(made.start)[0].value
    missed = []
    for table in (found.table, found.baseline):
        told = problem(model, away, values={n: table[n].value for n in made.table.names})
        missed.append(float(np.sqrt(np.mean(np.sum((told.residuals(told.start)[0].value - true) ** 2, axis=1)))))
    return found, missed


def test_the_verdict_says_where_it_holds():
    """Asked: at most 5 % of the unqualified improvements are worse elsewhere than the nominal model; the predicted error
    elsewhere is right within a factor of 2 in 75 %."""
    unqualified = worse = qualified = rightly = 0
    ratios = []
    for name in ARMS:
        for seed in range(TRIALS):
            found, (identified, nominal) = draw(name, seed)
            ratios.append(found.band.mean / identified)
            if found.verdict.status != "improved":
                assert found.verdict.region is None
                continue
            if found.verdict.region == "working":
                unqualified, worse = unqualified + 1, worse + (identified > nominal)
            else:
                qualified, rightly = qualified + 1, rightly + (identified > nominal)
    within = float(np.mean((np.array(ratios) > 0.5) & (np.array(ratios) < 2.0)))
    print(
        f"\n{len(ratios)} draws: {unqualified} unqualified, {worse} of them worse; {qualified} qualified, {rightly} worse"
    )
    print(f"predicted error elsewhere within a factor of 2 in {within:.1%}, median ratio {np.median(ratios):.2f}")
    # Two of forty are within what 5 % allow by chance; the whole acceptance is ROBOCAL_TRIALS=20.
    assert worse <= max(0.05 * unqualified, 2) and within >= 0.75
    assert unqualified > qualified


def test_the_range_decides():
    """The same data: good where they were measured, and not for all that the arm can reach."""
    model, _, data, _ = near_one_place("rv-2aj", 7)
    near, wide = JointRegion(between(range_of_joints(data.configurations), 200), "near"), region_of_limits(model, data)
    found = [identify(model, data, Options(region=r)) for r in (None, near, wide)]
    print("\nspanned, near, joint limits:", [(f.verdict.region, f.holds.band, f.holds.moved) for f in found])
    assert [f.verdict.region for f in found] == ["working", "working", "measured"]
    assert [r.code for r in found[2].verdict.reasons][-1] == "holds-where-measured"
