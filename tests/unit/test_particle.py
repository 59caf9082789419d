"""The particle filter: weights that never underflow, resampling without bias, the Gaussian case, and heavy tails."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate
from unit.plain_terms import linear, plain_problem

from robocal.errors import ModelError
from robocal.estimate.kalman import kalman
from robocal.estimate.least_squares import least_squares
from robocal.estimate.particle import density, effective, normalise, particles, systematic
from robocal.estimate.uncertainty import uncertainty

TAILS = np.sqrt(2.0)  # a Cauchy loss with c^2 = nu + 1 has the tails of Student's t with nu = 1


def test_logarithms_never_underflow():
    w = normalise(np.array([-1e9, -1e9 - np.log(3.0), -2e9]))
    np.testing.assert_allclose(w, [0.75, 0.25, 0.0], atol=1e-7)
    assert effective(np.full(10, -1e12)) == pytest.approx(10)
    with pytest.raises(ModelError, match="no particle"):
        normalise(np.array([-np.inf, -np.inf]))


def test_systematic_resampling_is_unbiased_and_never_off_by_one(rng):
    w = rng.dirichlet(np.full(20, 0.5))
    trials, count = 4000, 50
    drawn = np.array([np.bincount(systematic(w, rng, count), minlength=20) for _ in range(trials)])
    assert (drawn.sum(axis=1) == count).all()
    assert (drawn >= np.floor(count * w)).all() and (drawn <= np.ceil(count * w)).all()
    # A count varies between two neighbours, so its mean scatters by at most half over the root of the trials.
    np.testing.assert_allclose(drawn.mean(axis=0), count * w, atol=4 * 0.5 / np.sqrt(trials))


def test_one_particle_with_all_the_weight_is_all_that_is_drawn(rng):
    assert (systematic(np.eye(5)[2], rng) == 2).all()


def test_log_likelihood_by_configuration(rng):
    a, y, x = rng.normal(size=(12, 3)), rng.normal(size=12), rng.normal(size=(600, 3))
    unit = rng.permutation(np.repeat(np.arange(4), 3))
    p = plain_problem(linear(a, y, sigma=0.5, configuration=unit), np.zeros(3))
    found = density(p, x)
    s = ((x @ a.T - y) / 0.5) ** 2
    expected = np.stack([-0.5 * s[:, unit == u].sum(axis=1) for u in range(4)], axis=1)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    for loss in ("huber", "cauchy", "tukey"):
        np.testing.assert_allclose(-density(p.with_loss(loss), x).sum(axis=1), p.with_loss(loss).normal(x).cost)


def test_gaussian_noise_gives_the_least_squares_answer_and_its_covariance(rng):
    a, y = rng.normal(size=(60, 5)), rng.normal(size=60)
    p = plain_problem(linear(a, y, configuration=np.repeat(np.arange(20), 3)), np.zeros(5))
    s = least_squares(p)
    cloud = particles(p, s.x, rng, count=4000)
    c = uncertainty(p, s.x).covariance
    sigma = np.sqrt(np.diag(c))
    assert (np.abs(cloud.mean - s.x)[0] / sigma).max() < 5 / np.sqrt(4000)
    np.testing.assert_allclose(np.sqrt(np.diag(cloud.covariance)) / sigma, 1, atol=0.06)
    assert cloud.fewest > 1000 and cloud.accepted > 0.5 and cloud.x.shape == (4000, 5)


def test_an_answer_a_few_sigma_off_is_put_right(rng):
    """The particles know the true density, not only where the filter ended."""
    a, y = rng.normal(size=(40, 3)), rng.normal(size=40)
    p = plain_problem(linear(a, y), np.zeros(3))
    s, u = least_squares(p), uncertainty(p, least_squares(p).x)
    cloud = particles(p, s.x + 3 * u.sigma_instrument, rng, count=3000)
    assert (np.abs(cloud.mean - s.x)[0] / u.sigma_instrument).max() < 0.15


def test_the_mean_is_that_of_the_posterior(rng):
    """One parameter, a skewed posterior with one hill (another one far away would not be found): against quadrature."""
    y = np.array([0.0, 0.1, -0.2, 0.15, 0.9, 1.2])
    p = plain_problem(linear(np.ones((6, 1)), y, sigma=0.3), [0.0], prior=[5.0]).with_loss("cauchy", TAILS)
    grid = np.linspace(-15, 15, 20001)
    log_p = density(p, grid[:, None]).sum(axis=1) - 0.5 * (grid / 5) ** 2
    mass = np.exp(log_p - log_p.max())
    z, mean = integrate.trapezoid(mass, grid), integrate.trapezoid(mass * grid, grid)
    mean /= z
    spread = np.sqrt(integrate.trapezoid(mass * (grid - mean) ** 2, grid) / z)
    cloud = particles(p, least_squares(p).x, rng, count=6000)
    assert cloud.mean[0, 0] == pytest.approx(mean, abs=0.08 * spread)
    assert np.sqrt(cloud.covariance[0, 0]) == pytest.approx(spread, rel=0.1)


def heavy(seed, m=30):
    """Errors of the filter, the filter with the same loss, and the particles, under Cauchy-like noise."""
    rng = np.random.default_rng(seed)
    a, x = rng.normal(size=(m, 3)), rng.normal(size=3)
    y = a @ x + 0.1 * rng.standard_t(1.0, size=m)
    p = plain_problem(linear(a, y, sigma=0.1), np.zeros(3), prior=[10.0] * 3)
    r = p.with_loss("cauchy", TAILS)
    robust = kalman(r)
    cloud = particles(r, least_squares(r, robust.x).x, rng, count=400)
    return [np.linalg.norm(found - x) for found in (kalman(p).x[0], robust.x[0], cloud.mean[0])]


@pytest.mark.slow
def test_heavy_tails_are_where_particles_pay():
    plain, robust, cloud = np.median([heavy(s) for s in range(60)], axis=0)
    print(f"median error of 60 trials: ekf {plain:.3f}, robust ekf {robust:.3f}, particles {cloud:.3f}")
    assert cloud < 0.5 * plain
    assert cloud < robust


def test_the_same_seed_gives_the_same_cloud(rng):
    p = plain_problem(linear(rng.normal(size=(9, 2)), rng.normal(size=9)), np.zeros(2))
    one, two = (particles(p, p.start, np.random.default_rng(4), count=100) for _ in range(2))
    np.testing.assert_array_equal(one.x, two.x)


def test_bounds_hold_every_particle(rng):
    p = plain_problem(linear(np.ones((4, 1)), np.zeros(4)), [0.1], lower=[0.0], upper=[9.0])
    cloud = particles(p, p.start, rng, count=500)
    assert (cloud.x >= 0).all() and cloud.mean[0, 0] == pytest.approx(np.sqrt(2 / np.pi) / 2, abs=0.06)


def test_bounds_that_hold_the_answer_far_away_are_told(rng):
    p = plain_problem(linear(np.ones((4, 1)), np.zeros(4)), [3e3], lower=[2e3], upper=[9e3])
    with pytest.raises(ModelError, match="beyond its bounds"):
        particles(p, p.start, rng, count=100)


def test_a_free_direction_is_refused(rng):
    p = plain_problem(linear(np.array([[1.0, 1.0]]), np.ones(1)), np.zeros(2))
    with pytest.raises(ModelError, match="leave a direction free"):
        particles(p, p.start, rng)
