"""Which configurations are held out, and how large the noise is found to be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from unit.arm_data import arm, measured, true_arm

from robocal.errors import ModelError
from robocal.fit.fit import fit
from robocal.fit.noise import apply_noise, assess
from robocal.fit.options import Options
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet
from robocal.prove.identify import baseline
from robocal.prove.split import stratify


def joints(rng, m, n=3):
    return Configurations(tuple(map(str, range(m))), rng.uniform(-1, 2, (m, n)))


@given(st.integers(1, 120), st.floats(0, 0.5), st.integers(0, 5))
def test_split_sizes_and_disjoint(m, fraction, seed):
    fitted, held = stratify(joints(np.random.default_rng(0), m), fraction, seed)
    assert len(held) == round(fraction * m)
    np.testing.assert_array_equal(np.sort(np.concatenate([fitted, held])), np.arange(m))


def test_split_is_seeded(rng):
    where = joints(rng, 50)
    np.testing.assert_array_equal(stratify(where, 0.2, 7)[1], stratify(where, 0.2, 7)[1])
    assert any(not np.array_equal(stratify(where, 0.2, 7)[1], stratify(where, 0.2, s)[1]) for s in range(3))


def test_held_out_units_are_spread_over_the_space(rng):
    """Eight corners of a cube, ten configurations at each: a fifth held out must come from all of them; plain drawing
    would miss some."""
    corner = np.repeat(np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]), 10, axis=0).astype(float)
    where = Configurations(tuple(map(str, range(80))), corner + 0.1 * rng.normal(size=(80, 3)))
    for seed in range(5):
        fitted, held = stratify(where, 0.2, seed)
        counts = np.bincount(held // 10, minlength=8)
        assert counts.tolist() == [2] * 8
        q = where.joints
        assert (q[held] >= q[fitted].min(axis=0) - 0.3).all() and (q[held] <= q[fitted].max(axis=0) + 0.3).all()


def test_split_without_joints_with_equal_joints_and_with_missing_joints(rng):
    some = rng.normal(size=(20, 2))
    for q in (None, np.where(rng.random((20, 2)) < 0.3, np.nan, some), np.full((20, 2), np.nan)):
        fitted, held = stratify(Configurations(tuple(map(str, range(20))), q), 0.2, 1)
        assert len(held) == 4 and len(fitted) == 16
    # Repeats of a single place leave nothing to hold out.
    assert not len(stratify(Configurations(tuple(map(str, range(20))), np.zeros((20, 2))), 0.2, 1)[1])
    free = Configurations(tuple(map(str, range(20))), start=rng.normal(size=(20, 6)))
    assert len(stratify(free, 0.25, 0)[1]) == 5


def test_repeats_of_a_place_are_held_out_together(rng):
    """Ten places, three visits each: no place is both fitted and held out."""
    place = np.tile(rng.normal(size=(10, 3)), (3, 1))
    fitted, held = stratify(Configurations(tuple(map(str, range(30))), place), 0.2, 0)
    assert len(held) == 6 and not set(fitted % 10) & set(held % 10)


def test_file_order_does_not_decide(rng):
    """Configurations that nothing tells apart, in file order: every one is held out now and then."""
    where = Configurations(tuple(map(str, range(10))))
    seen = {int(u) for seed in range(60) for u in stratify(where, 0.2, seed)[1]}
    assert seen == set(range(10))


@pytest.mark.parametrize("fraction", [-0.1, 0.51, 1.0])
def test_impossible_shares_are_refused(rng, fraction):
    with pytest.raises(ModelError, match="between 0 and 0.5"):
        stratify(joints(rng, 10), fraction, 0)


# --- noise ------------------------------------------------------------------------------------------------------------------


def groups_of(data, robot=None, **options):
    robot = robot or arm()
    units = np.arange(len(data.configurations))
    _, x = baseline(robot, data, units)
    return fit(robot, data, units, Options(**options), x)


def test_a_right_sigma_stands():
    found = groups_of(measured(80))
    (g,) = found.groups
    assert g.tau == 0 and g.sigma_source == "stated" and g.sigma == g.stated == pytest.approx(2e-5)
    assert 0.7 < g.chi2 / g.dof < 1.3 and g.rms == pytest.approx(2e-5, rel=0.2) and g.n == 240
    np.testing.assert_array_equal(found.data.observations[0].sigma, 2e-5)


def test_a_sigma_that_is_too_small_is_enlarged_to_what_the_model_leaves():
    data = measured(200, sigma=1e-4)
    small = DataSet(data.configurations, (replace(data.observations[0], sigma=np.full((200, 3), 1e-5)),))
    (g,) = groups_of(small).groups
    assert (
        g.sigma_source == "stated, with model error added"
        and g.sigma == pytest.approx(1e-4, rel=0.1)
        and g.tau == pytest.approx(1e-4, rel=0.1)
    )
    large = DataSet(data.configurations, (replace(data.observations[0], sigma=np.full((200, 3), 1e-3)),))
    assert groups_of(large).groups[0].tau == 0, "a cautious sigma is never shrunk"


def test_unstated_sigma_is_estimated():
    (g,) = groups_of(measured(200, sigma=7e-5, stated=False)).groups
    assert g.sigma_source == "estimated" and g.stated is None and g.chi2 is None
    assert g.sigma == g.tau == pytest.approx(7e-5, rel=0.1)


def test_poses_have_a_group_in_metres_and_one_in_radians():
    data = measured(100, kind="pose", sigma=1e-4)
    obs = data.observations[0]
    noisy = replace(
        obs, value=obs.value + np.random.default_rng(0).normal(size=obs.value.shape) * [0, 0, 0, 1e-3, 1e-3, 1e-3]
    )
    metres, radians = groups_of(DataSet(data.configurations, (noisy,))).groups
    assert (metres.unit, radians.unit) == ("m", "rad") and metres.n == radians.n == 300
    assert metres.tau == 0 and radians.tau == pytest.approx(1e-3, rel=0.15)


def test_two_instruments_have_noise_of_their_own():
    both = measured(100, sigma=2e-5, stated=False)
    other = replace(both.observations[0], frame=replace(both.observations[0].frame, name="camera"))
    coarse = replace(other, value=other.value + np.random.default_rng(5).normal(scale=5e-4, size=(100, 3)))
    fine, rough = groups_of(DataSet(both.configurations, (*both.observations, coarse))).groups
    assert fine.sigma == pytest.approx(2e-5, rel=0.15) and rough.sigma == pytest.approx(5e-4, rel=0.15)


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize("loss", ["huber", "cauchy", "tukey"])
def test_outliers_do_not_decide_the_noise_of_a_robust_fit(stated, loss):
    data = measured(120, stated=stated)
    obs = data.observations[0]
    value = obs.value.copy()
    value[::20] += 5e-3
    dirty = DataSet(data.configurations, (replace(obs, value=value),))
    (g,) = groups_of(dirty, loss=loss).groups
    assert g.sigma == pytest.approx(2e-5, rel=0.4)
    assert groups_of(dirty).groups[0].sigma > 5e-4, "a plain fit must take them seriously"


def test_a_robust_fit_still_sees_model_error():
    data = measured(200, sigma=1e-4)
    small = DataSet(data.configurations, (replace(data.observations[0], sigma=np.full((200, 3), 1e-5)),))
    (g,) = groups_of(small, loss="huber").groups
    assert g.sigma == pytest.approx(1e-4, rel=0.25) and g.tau > 0


@pytest.mark.parametrize("m", [2, 3, 4])
def test_no_degree_of_freedom_is_no_evidence_of_perfection(m):
    """Unstated noise and no more numbers than parameters: the residual is zero, the noise is not."""
    (g,) = groups_of(measured(m, stated=False)).groups
    assert g.dof < 1 and 1e-5 < g.sigma < 1e-2


def test_apply_noise_adds_in_squares():
    data = measured(4, kind="pose", sigma=3e-4)
    (obs,) = apply_noise(data, {("tracker", "m"): 4e-4}).observations
    np.testing.assert_allclose(obs.sigma[:, :3], 5e-4)
    np.testing.assert_allclose(obs.sigma[:, 3:], 3e-4)
    silent = measured(4, stated=False)
    assert apply_noise(silent, {}).observations[0].sigma is None
    np.testing.assert_allclose(apply_noise(silent, {("tracker", "m"): 4e-4}).observations[0].sigma, 4e-4)


def test_assess_looks_at_the_fitted_units_only():
    truth = true_arm(size=0.0)
    data = measured(40, truth=truth, known=True)
    obs = data.observations[0]
    value = obs.value.copy()
    value[30:] += 1.0
    broken = DataSet(data.configurations, (replace(obs, value=value),))
    p = problem(arm(), broken)
    (good,) = assess(broken, p, p.start, np.arange(30), 0)
    (bad,) = assess(broken, p, p.start, np.arange(40), 0)
    assert good.tau == 0 and good.n == 90 and bad.tau > 0.1
    assert good.chi2 == pytest.approx(np.sum((p.residuals(p.start)[0].value[:30] / 2e-5) ** 2))
    # tau is the root of sum r^2 / (s^2 + tau^2) = dof.
    r = p.residuals(p.start)[0].value
    assert np.sum(r**2 / (4e-10 + bad.tau**2)) == pytest.approx(bad.dof)
    assert assess(broken, p, p.start, np.arange(40), 20)[0].dof == pytest.approx(100)
