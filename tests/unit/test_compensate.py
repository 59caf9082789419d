"""Compensation: simulated robots with the catalogue's typical errors are identified from noisy poses, and the corrected
targets are judged on the true robot, which the compensation never sees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated import true_chain

from robocal.apply.compensate import STATUS, Targets, compensate, generic_rank
from robocal.arms import catalog
from robocal.arms.conventions import chain
from robocal.arms.joints import with_eccentricity, with_sag
from robocal.errors import ModelError
from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.geometry import so3
from robocal.geometry.path.program import Element, Term
from robocal.parameters import Parameter, ParameterTable
from robocal.prove.identify import identify
from robocal.session.simulated_robot import Errors, Instrument, measure, sample_joints

# The defaults of `robocal simulate`: lengths 0.3 mm, angles 1 mrad; a laser tracker with an orientation sensor.
TRACKER = Instrument("pose", 2e-5, 5e-5, None)


def perturbed(robot, rng, size=1e-3):
    return robot.with_values({n: robot.table[n].value + rng.normal(0, size) for n in robot.geometric})


def words(made):
    return [STATUS[s] for s in made.status]


def gaps(robot, q, target):
    return np.linalg.norm(robot.pose(q)[:, :3, 3] - target[:, :3, 3], axis=1)


def judged(name, instrument, seed):
    """Mean error (mm) of the true robot before and after, and the share of 200 targets that are reached: identified from
    150 poses with the base known, targets anywhere within the limits."""
    rng = np.random.default_rng(seed)
    nominal = open_robot(name).chain
    nominal = replace(nominal, table=nominal.table.with_free(set(nominal.geometric)))
    truth = true_chain(nominal, Errors(), rng)
    data = measure(truth, sample_joints(nominal, 150, rng), instrument, rng)
    found = identify(nominal, data, Options(hold_out=0.0, leave_one_out=False))
    q = sample_joints(nominal, 200, rng)
    target = nominal.pose(q)
    made = compensate(nominal, found.corrected, Targets(target[:, :3, 3], target[:, :3, :3], q))
    reached = made.reachable
    low, high = nominal.limits.T
    assert len(made.status) == 200
    assert (made.joints[reached] >= low).all() and (made.joints[reached] <= high).all()
    assert np.isnan(made.joints[~reached]).all() and np.isnan(made.command[~reached]).all()
    before, after = gaps(truth, made.nominal, target)[reached], gaps(truth, made.joints[reached], target[reached])
    return 1e3 * before.mean(), 1e3 * after.mean(), reached.mean()


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", ["rv-2aj", "ur10", "panda", "rx-90", "iiwa-14", "irb-120"])
def test_true_robots_come_within_two_percent(name):
    """Noise 0.02 mm and 0.05 mrad per axis."""
    before, after, share = judged(name, TRACKER, 0)
    print(f"\n{name}: {before:.3f} -> {after:.4f} mm, {after / before:.2%}, {share:.1%} of the targets reached")
    assert before > 0.4 and after / before < 0.02 and share >= 0.85


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rv-2aj", "ur10", "panda", "fr3", "rx-90", "iiwa-14", "irb-120"])
def test_a_worse_instrument_does_too(name):
    """Noise 0.05 mm and 0.1 mrad, what `robocal simulate` takes: median of five robots."""
    figures = np.array([judged(name, Instrument("pose", 5e-5, 1e-4, None), seed) for seed in range(5)])
    ratio = figures[:, 1] / figures[:, 0]
    print(f"\n{name}: {np.median(ratio):.2%}, worst {ratio.max():.2%}")
    assert np.median(ratio) < 0.02


def test_the_nominal_inverse_kinematics_leads_the_command_to_the_corrected_joints(rng):
    nominal = catalog.get("ur10")
    real = perturbed(nominal, rng)
    q = rng.uniform(-1.5, 1.5, (100, 6))
    target = nominal.pose(q)
    made = compensate(nominal, real, Targets(target[:, :3, 3], target[:, :3, :3], q))
    fine = made.status == 0
    assert fine.sum() > 60
    np.testing.assert_allclose(nominal.pose(made.joints[fine]), made.command[fine], atol=1e-12)
    assert made.after[fine].max() < 1e-7 and made.by_command[fine].max() < 1e-7
    assert made.before[fine].mean() > 1e-3 and (made.after_angle[fine] < 1e-6).all()
    np.testing.assert_allclose(made.before, gaps(real, q, target), atol=1e-12)


def test_a_joint_program_and_its_poses_are_the_same_targets(rng):
    nominal = catalog.get("irb-120")
    real = perturbed(nominal, rng)
    q = rng.uniform(-1.0, 1.0, (30, 6))
    target = nominal.pose(q)
    a = compensate(nominal, real, Targets(joints=q))
    b = compensate(nominal, real, Targets(target[:, :3, 3], target[:, :3, :3], q))
    np.testing.assert_allclose(a.joints, b.joints, atol=1e-9, equal_nan=True)
    np.testing.assert_array_equal(a.status, b.status)


def test_order_and_company_change_nothing(rng):
    nominal = catalog.get("rv-2aj")
    real = perturbed(nominal, rng)
    q = sample_joints(nominal, 20, rng)
    whole = compensate(nominal, real, Targets(joints=q))
    back = compensate(nominal, real, Targets(joints=q[::-1].copy()))
    np.testing.assert_allclose(back.joints[::-1], whole.joints, atol=1e-9, equal_nan=True)


def test_five_axes_keep_the_position_and_as_much_orientation_as_they_can(rng):
    nominal = catalog.get("rv-2aj").with_values({"tool.z": 0.1})
    real = perturbed(nominal, rng, 5e-4)
    assert generic_rank(nominal) == 5 and generic_rank(catalog.get("panda")) == 6
    q = rng.uniform([-1, 0.2, 0.5, 0.2, -1], [1, 1.0, 1.5, 1.0, 1], (40, 5))
    target = nominal.pose(q)
    made = compensate(nominal, real, Targets(joints=q))
    assert set(words(made)) == {"orientation relaxed"}
    assert made.after.max() < 1e-9 and made.after_angle.max() < 0.02
    # No small step keeps the position and turns the tool nearer to the target.
    jac, pose = real.jacobian(made.joints), real.pose(made.joints)
    turn = so3.log(target[:, :3, :3] @ np.swapaxes(pose[:, :3, :3], 1, 2))
    null = np.linalg.svd(jac[:, :3])[2][:, 3:]
    gain = jac[:, 3:] @ np.swapaxes(null, 1, 2)
    assert np.abs(np.swapaxes(gain, 1, 2) @ turn[..., None]).max() < 1e-6


def test_five_axes_at_a_limit_do_not_swing_the_tool_elsewhere():
    nominal = catalog.get("rv-2aj")
    real = nominal.with_values({"j1.theta": nominal.table["j1.theta"].value - 2e-3})
    q = np.array([[0.3, 0.4, 1.3, -0.8, -3.1]] * 2)
    q[1, 0] = nominal.limits[0, 1] - 1e-3
    made = compensate(nominal, real, Targets(joints=q))
    assert words(made) == ["ok", "outside limits"] and np.isnan(made.joints[1]).all()
    assert made.limit_excess[1] == pytest.approx([1e-3, 0, 0, 0, 0], abs=1e-5)


def test_seven_axes_stay_near_the_nominal_joints(rng):
    nominal = catalog.get("panda")
    real = perturbed(nominal, rng)
    q = 0.5 * sample_joints(nominal, 40, rng) + 0.5 * nominal.limits.mean(axis=1)
    made = compensate(nominal, real, Targets(joints=q))
    fine = made.status == 0
    assert fine.sum() > 25 and made.after[fine].max() < 1e-9
    # The correction has no part along the motion that leaves the tool where it is.
    null = np.linalg.svd(real.jacobian(made.joints[fine]))[2][:, 6]
    assert np.abs(np.einsum("mi,mi->m", null, made.joints[fine] - q[fine])).max() < 1e-6


def test_positions_alone_leave_the_orientation_free(rng):
    nominal = catalog.get("ur10")
    real = perturbed(nominal, rng)
    q = rng.uniform(-1.2, 1.2, (20, 6))
    made = compensate(nominal, real, Targets(nominal.pose(q)[:, :3, 3], None, q))
    assert not made.oriented and set(words(made)) == {"ok"}
    whole = compensate(nominal, real, Targets(joints=q))
    # With fewer demands the joints move less.
    fine = whole.reachable
    assert np.linalg.norm(made.joints - q, axis=1)[fine].mean() < np.linalg.norm(whole.joints - q, axis=1)[fine].mean()


def test_what_cannot_be_reached_is_listed_with_what_is_left():
    rows = [{"limits": (-2.0, 1.0)}, {"a": 0.5, "limits": (0.3, 2.5)}]
    nominal = chain("elbow", "mdh", rows, tool=(0.4, 0, 0, 0, 0, 0))
    real = nominal.with_values({"j1.theta": -0.01})
    inside, edge, away = nominal.pose([[0.2, 0.8], [0.995, 0.8], [0.0, 0.8]])[:, :3, 3]
    made = compensate(nominal, real, Targets(np.array([away * 3, inside, edge, inside + [0, 0, 0.02]])))
    assert words(made) == ["unreachable", "ok", "outside limits", "unreachable"]
    assert made.limit_excess[2] == pytest.approx([0.005, 0], abs=1e-6) and (made.limit_excess[[0, 1, 3]] == 0).all()
    assert made.after[3] == pytest.approx(0.02, abs=1e-6) and np.isnan(made.joints[[0, 2, 3]]).all()
    assert made.joints[1] == pytest.approx([0.21, 0.8], abs=1e-6)
    assert np.isnan(made.before[[0, 3]]).all() and np.isfinite(made.before[[1, 2]]).all()


def test_a_wrist_that_is_nearly_stretched_is_said():
    nominal = catalog.get("irb-120")
    real = perturbed(nominal, np.random.default_rng(2), 1e-4)
    q = np.tile([0.3, 0.4, -0.2, 0.5, 1.0, 0.2], (2, 1))
    q[1, 4] = 1e-3
    assert words(compensate(nominal, real, Targets(joints=q))) == ["ok", "near singular"]


def test_columns_of_a_configuration_count(rng):
    """A lift that grows with temperature is corrected at each target's own temperature; without the column: refused."""
    nominal = catalog.get("irb-120")
    lift = Element("tz", (Term("growth", "temperature"),))
    table = nominal.table + ParameterTable((Parameter("growth", 1e-4, "m"),))
    warm = replace(nominal, elements=(nominal.elements[0], lift, *nominal.elements[1:]), table=table)
    q, kelvin = rng.uniform(-1, 1, (10, 6)), rng.uniform(0, 20, 10)
    made = compensate(nominal, warm, Targets(joints=q, extra={"temperature": kelvin}))
    np.testing.assert_allclose(made.before, 1e-4 * kelvin, atol=1e-12)
    assert made.after[made.reachable].max() < 1e-7
    with pytest.raises(ModelError, match="temperature"):
        compensate(nominal, warm, Targets(joints=q))


def test_what_lies_beyond_geometry_is_corrected_too(rng):
    """Sag and eccentric gears move with the joints; the Jacobian leaves that out, and the steps still close."""
    nominal = catalog.get("ur10")
    soft = with_eccentricity(with_sag(nominal))
    new = [n for n in soft.table.names if n not in nominal.table]
    real = soft.with_values({n: rng.normal(0, 1e-3 if "sag" not in n else 3e-5) for n in new})
    q = rng.uniform(0.3, 1.2, (30, 6))
    made = compensate(nominal, real, Targets(joints=q))
    fine = made.status == 0
    assert fine.sum() > 25 and made.after[fine].max() < 1e-7 and made.before[fine].mean() > 1e-4


def test_refusals_and_nothing(rng):
    ur10, panda = catalog.get("ur10"), catalog.get("panda")
    with pytest.raises(ModelError, match="other joints"):
        compensate(ur10, panda, Targets(joints=np.zeros((1, 6))))
    with pytest.raises(ModelError, match="no targets"):
        compensate(ur10, ur10, Targets())
    with pytest.raises(ModelError, match="shape"):
        compensate(ur10, ur10, Targets(np.zeros((2, 2))))
    none = compensate(ur10, ur10, Targets(np.zeros((0, 3))))
    assert none.joints.shape == (0, 6) and none.command.shape == (0, 4, 4)
