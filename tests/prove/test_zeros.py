"""A joint that lost its zero is found as such, also where the data see it only as a length that no making leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from trials import joints, observations, perturbed

from robocal.arms.chain import joint_offsets, with_offsets
from robocal.files.robot import open_robot, render_robot
from robocal.files.urdf_into import urdf_text
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


@pytest.fixture(scope="module")
def urdf(tmp_path_factory):
    """A robot in the conventions that hold a joint's zero: its frames say the same."""
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(urdf_text(open_robot("irb-120").chain)[0])
    return open_robot(str(path))


LOST = [{"j3": -118.0}, {"j4": 12.0}, {"j2": 64.0, "j5": -141.0}, {"j2": -27.0, "j3": 61.0, "j4": 166.0}]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("written_as", ["urdf", "dh"])
@pytest.mark.parametrize("lost", LOST, ids=lambda v: "-".join(v))
def test_zeros_are_found_at_any_angle_in_any_convention(urdf, written_as, lost):
    chain = urdf.chain if written_as == "urdf" else open_robot("irb-120").chain
    rng = np.random.default_rng(11)
    truth = with_offsets(perturbed(chain, rng, 0.5), {j: float(np.deg2rad(v)) for j, v in lost.items()})
    data = synthesise(truth, DataSet(joints(chain, rng, 50), (replace(observations("position", 50), frame=None),)), rng)
    found = identify(chain, data, Options(leave_one_out=False))
    assert found.verdict.status == "improved", found.verdict.reasons
    told = dict(joint_offsets(chain, {n: found.corrected.table[n].value for n in chain.table.names}))
    for joint in chain.joint_names[1:-1]:
        assert np.rad2deg(told[joint]) == pytest.approx(lost.get(joint, 0.0), abs=3.0), joint
    remark = next(str(w) for w in found.warnings if w.code == "zero-lost")
    assert all(j in remark for j in lost)


def test_a_urdf_holds_zeros_in_its_origins(urdf, tmp_path):
    chain = urdf.chain
    values = {"j2.offset": 0.9, "j4.offset": -2.4, "j4.x": chain.table["j4.x"].value + 2e-3}
    text, left_out = render_robot(urdf, values)
    assert not left_out
    (tmp_path / "turned.urdf").write_text(text)
    q = np.random.default_rng(1).uniform(-1, 1, (20, 6))
    again = open_robot(str(tmp_path / "turned.urdf")).chain.pose(q)
    assert np.abs(again - chain.with_values(values).pose(q)).max() < 1e-12
