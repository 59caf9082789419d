"""Sentences that must be true of odd data: too much noise stated, a prior that is too tight, clusters, three poses, one wild number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from judging import judge
from trials import joints, observations

from robocal.files.data_checks import suspicions
from robocal.files.robot import open_robot
from robocal.files.units import UNITS
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet
from robocal.prove.identify import identify
from robocal.prove.region import Holds, beside
from robocal.prove.split import Split, make_split
from robocal.remarks.code import Code

MODEL = open_robot("irb-120").chain


def measured(m=40, seed=0, **change):
    """Positions of an arm with errors of 0.3 mm and 1 mrad, with noise of 0.05 mm."""
    rng = np.random.default_rng(seed)
    off = {n: rng.normal(0, 3e-4 if MODEL.table[n].unit == "m" else 1e-3) for n in MODEL.geometric}
    truth = MODEL.with_values({n: MODEL.table[n].value + v for n, v in off.items()})
    data = synthesise(truth, DataSet(joints(MODEL, rng, m), (observations("position", m),)), rng)
    return DataSet(data.configurations, tuple(replace(o, **change) for o in data.observations))


def codes(found):
    return {r.code for r in (*found.verdict.reasons, *found.warnings)}


@pytest.mark.parametrize(("times", "said"), [(1, False), (30, True), (200, True)])
def test_a_stated_sigma_that_is_far_too_large_is_named(times, said):
    data = measured()
    loud = replace(data.observations[0], sigma=times * data.observations[0].sigma)
    found = identify(MODEL, DataSet(data.configurations, (loud,)), Options(leave_one_out=False))
    assert (Code.BELOW_STATED_NOISE in codes(found)) is said


@pytest.mark.sampled(1)
@pytest.mark.parametrize("prior", [1e-12, 1e-8, 1e-5])
def test_a_prior_that_is_too_tight_is_no_wrong_scale(prior):
    rows = tuple(
        replace(p, prior=prior) if p.name in MODEL.geometric and p.unit == "m" else p for p in MODEL.table.rows
    )
    tight = replace(MODEL, table=replace(MODEL.table, rows=rows))
    for seed in range(6):
        found = identify(tight, measured(60, seed), Options(leave_one_out=False))
        assert Code.SCALE_WRONG not in codes(found) and found.verdict.status != "refused"


def test_three_poses_are_too_few_and_were_held_out():
    found = identify(MODEL, measured(3))
    assert [r.code for r in found.verdict.reasons] == [Code.FEW_UNSEEN]


@pytest.mark.parametrize(("jitter", "repeated"), [(1e-3, True), (0.3, False)])
def test_held_out_members_of_a_cluster_prove_nothing_of_the_way_to_the_next(jitter, repeated):
    """What six clusters of twenty poses leave open between them decides as a named range would; loose ones are poses like any."""
    rng = np.random.default_rng(0)
    place = np.repeat(joints(MODEL, rng, 6).joints, 20, axis=0) + rng.normal(0, jitter, (120, 6))
    where = Configurations(tuple(map(str, range(120))), place)
    data = DataSet(where, (observations("position", 120),))
    # As a split would that took every pose for a place of its own.
    held = (np.arange(120) % 5 == 0)[None]
    assert beside(place, Split(held, ~held, ("held out",), "held out")) is repeated
    assert not beside(place, make_split(data, 0.2, folds=None, blocks=10, seed=0)), "a cluster is one place"
    groups = replace(where, groups=tuple(str(i // 20) for i in range(120)))
    apart = make_split(DataSet(groups, data.observations), "group", folds=6, blocks=10, seed=0)
    assert not beside(place, apart), "whole clusters that are held out are elsewhere"
    assert Holds("span", 1.0, 1.2, 0.13, 500, asked=True).region == "measured"
    assert Holds("span", 1.0, 1.2, 0.13, 500, asked=False).region == "working"


@pytest.mark.parametrize(("left", "status"), [(0.2, "refused"), (0.02, "not_improved")])
def test_a_model_that_leaves_far_more_than_making_does_explains_nothing(left, status):
    """No gain, and two decimetres left of positions that scatter by one metre: nobody should keep the nominal model for that."""
    rng = np.random.default_rng(0)
    before = left * rng.uniform(0.5, 1.5, 30)
    found = judge(before, before, np.ones(30), np.arange(30), blind=False, converged=True, seed=0, kind="held out")
    assert found.status == status
    assert found.reasons[0].code is (Code.UNEXPLAINED if status == "refused" else Code.GAIN_NOT_PROVEN)


def test_one_wild_number_makes_no_unit_and_no_plane():
    data = measured()
    value = data.observations[0].value.copy()
    value[4, 0] = 100.0
    wild = replace(data.observations[0], value=value, source="x.csv")
    assert not suspicions(wild, data.configurations.joints, MODEL, UNITS["rad"], UNITS["m"])
    far = replace(wild, value=1000 * data.observations[0].value)
    assert suspicions(far, data.configurations.joints, MODEL, UNITS["rad"], UNITS["m"])
    found = identify(MODEL, DataSet(data.configurations, (wild,)), Options(leave_one_out=False))
    assert Code.ONE_PLANE not in codes(found) and found.verdict.status == "improved"
