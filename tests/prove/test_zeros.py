"""A joint that lost its zero is found as such, also where the data see it only as a length that no making leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from trials import joints, observations, perturbed

from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.measure.data import DataSet
from robocal.prove.identify import identify


def written(chain, **values):
    """The model as somebody wrote it, with other nominal values."""
    return chain.with_values({n.replace("_", "."): v for n, v in values.items()})


@pytest.fixture(scope="module")
def measured():
    chain, rng = open_robot("irb-120").chain, np.random.default_rng(3)
    truth = perturbed(chain, rng)
    where = joints(truth, rng, 60)
    return chain, truth, synthesise(truth, DataSet(where, (replace(observations("position", 60), frame=None),)), rng)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("off", [(0, 0, -28), (0, 17, -28), (20, 17, -28), (0, 0, 15)])
def test_a_lost_zero_is_no_length(measured, off):
    chain, truth, data = measured
    turned = {
        f"j{i}_theta": chain.table[f"j{i}.theta"].value + np.deg2rad(v) for i, v in zip((2, 3, 5), off, strict=True)
    }
    found = identify(written(chain, **turned), data, Options(leave_one_out=False))
    assert found.verdict.status == "improved"
    told = {p.name: p.identified for p in found.parameters}
    for name in ("j2.theta", "j3.theta", "j5.theta"):
        assert told[name] == pytest.approx(truth.table[name].value, abs=0.02)
    assert told["j5.a"] == pytest.approx(truth.table["j5.a"].value, abs=3e-3)


def test_a_length_by_a_decimal_is_still_refused(measured):
    chain, _, data = measured
    found = identify(written(chain, j2_a=0.027), data, Options(leave_one_out=False))
    assert found.verdict.status == "refused" and "j2.a" in str(found.verdict.reasons[0])


def test_a_zero_that_somebody_vouches_for_stays(measured):
    """Its prior is believed, and nothing is tried for ever."""
    chain, _, data = measured
    wrong = written(chain, j5_theta=chain.table["j5.theta"].value + np.deg2rad(-28))
    sure = replace(wrong, table=wrong.table.with_priors({"j5.theta": 1e-4}))
    found = identify(sure, data, Options(leave_one_out=False))
    assert found.verdict.status == "refused"
