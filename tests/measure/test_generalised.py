"""Poses that are errors of the lengths they enter: the explicit covariance, the free poses' optimum, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.thesis_rig import specification, thesis_rig

from robocal.cables.geometry import cable_robot
from robocal.errors import ModelError
from robocal.estimate.generalised.solver import ENOUGH, correlate_rows, follow, generalised_least_squares
from robocal.estimate.least_squares import least_squares
from robocal.geometry import so3
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Observations

LENGTH, PLACE, TURN = 3e-3, 2e-3, np.deg2rad(1.0)  # one sigma, those of figure 3.8 of the thesis
SIGMA = np.array([PLACE] * 3 + [TURN] * 3)
OFF = 0.02  # m, of where a fit starts


class Draws:
    """Lists of poses with their errors, `batch` of them around the same measured poses, and the truth that made the lengths."""

    def __init__(self, shared, poses=100, batch=8, seed=0, noise=1.0, missing=()):
        said = specification(shared)
        rng = np.random.default_rng(seed)
        robot = cable_robot(
            "eight", np.array(said["frame_anchors_nominal"]), np.array(said["platform_anchors"]), free=("ax", "ay", "az", "l0")
        )  # fmt: skip
        middle = np.mean(np.array(said["frame_anchors_nominal"]), axis=0)
        at = np.column_stack([middle + rng.uniform(-0.4, 0.4, (poses, 3)), rng.uniform(-0.3, 0.3, (poses, 3))])
        u, c = (part.ravel() for part in np.mgrid[:poses, :8])
        keep = ~np.isin(np.arange(8 * poses), missing)
        u, c = u[keep], c[keep]
        lengths = Observations(
            "lengths", u, np.zeros((len(u), 1)), np.full((len(u), 1), noise * LENGTH), extra={"cable": c}
        )
        data = DataSet(Configurations(tuple(map(str, range(poses))), start=at), (lengths,))
        p = problem(robot, data)
        true = np.repeat(p.start, batch, axis=0)
        blocks = p.values_of(0, true).copy()
        e = noise * SIGMA * rng.normal(size=blocks.shape)
        blocks[..., :3] += e[..., :3]
        blocks[..., 3:] = so3.log(so3.exp(e[..., 3:]) @ so3.exp(blocks[..., 3:]))
        true[:, p.places[0]] = blocks.reshape(batch, -1)
        read = np.zeros((batch, len(u), 1))
        clean = p.residuals(true)[0].value.reshape(batch, len(u), 1)
        read[:, p.terms[0].index] = clean + noise * LENGTH * rng.normal(size=clean.shape)
        self.problem = problem(
            robot, replace(data, observations=(replace(lengths, value=read),))
        ).with_local_prior(sigma=noise * SIGMA)  # fmt: skip
        self.start = np.repeat(self.problem.start, batch, axis=0)
        self.start[:, self.problem.index] += OFF * noise * rng.normal(size=(batch, self.problem.n))
        self.poses = poses


@pytest.fixture
def draws(shared_data):
    return Draws(shared_data)


def in_sigma(p, found, x):
    """How far the free columns of a generalised fit are from x, in its own sigma."""
    sigma = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    return (found.x - x)[:, p.index] / sigma


def explicit(p, x, b):
    """W of every pose by the covariance itself, and residuals and Jacobians, pose by pose: (U, 8, 8), (U, 8), (U, 8, n)."""
    term = p.bound_terms[0]
    r, jac, jloc = (part[0] for part in term.evaluate(x[b : b + 1], np.array([b]), 0, len(term.scale)))
    order = np.argsort(term.configuration, kind="stable").reshape(-1, 8)
    dense = np.zeros((len(r), p.n))
    np.add.at(dense.T, term.columns, jac[:, 0].T)
    by = jloc[order][:, :, 0]
    cov = np.diag(term.sigma[0] ** 2 * np.ones(8)) + by @ np.diag(SIGMA**2) @ np.swapaxes(by, 1, 2)
    return np.linalg.inv(cov), r[order][..., 0], dense[order]


def test_the_normal_equations_are_those_of_the_explicit_covariance(draws):
    p, x = draws.problem, draws.start
    got = correlate_rows(p, x).normal(x)
    for b in range(2):
        w, r, j = explicit(p, x, b)
        np.testing.assert_allclose(got.cost[b], 0.5 * np.einsum("ui,uij,uj", r, w, r), rtol=1e-10)
        g = np.einsum("uia,uij,uj->a", j, w, r)
        np.testing.assert_allclose(got.g[b], g, rtol=1e-9, atol=1e-9 * np.abs(g).max())
        a = np.einsum("uia,uij,ujb->ab", j, w, j)
        np.testing.assert_allclose(np.tril(got.a[b]), np.tril(a), rtol=1e-9, atol=1e-9 * np.abs(a).max())


def test_the_normal_equations_are_those_of_the_whitened_rows(shared_data):
    """The law of every term, with lengths that are missing and a configuration held out."""
    one = Draws(shared_data, poses=12, batch=1, missing=(3, 9, 17, 18))
    p = one.problem.with_weights(np.where(np.arange(12) == 5, 0.0, 1.0)[None])
    made = correlate_rows(p, one.start)
    normal, lin = made.normal(one.start), made.linearize(one.start)
    np.testing.assert_allclose(normal.cost[0], 0.5 * lin.r @ lin.r, rtol=1e-10)
    np.testing.assert_allclose(normal.g[0], lin.j.T @ lin.r, rtol=1e-7, atol=1e-7 * np.abs(normal.g).max())
    a = lin.j.T @ lin.j
    np.testing.assert_allclose(np.tril(normal.a[0]), np.tril(a), rtol=1e-8, atol=1e-8 * np.abs(a).max())
    told = sum(r.used.sum() * r.value.shape[-1] for r in made.residuals(one.start))
    assert told == 8 * 12 - 4


def test_what_stays_of_the_free_poses_when_they_are_eliminated(draws):
    """Linearised where the free poses ended, generalised least squares has its minimum there, and the same bars."""
    p = draws.problem
    free = least_squares(p, draws.start)
    made = correlate_rows(p, free.x)
    again = least_squares(made, free.x)
    np.testing.assert_allclose(again.cost, free.cost, rtol=1e-9)
    found = generalised_least_squares(p, free.x)
    assert np.abs(in_sigma(p, found, free.x)).max() < 1e-5
    lin = p.linearize(free.x[:1])
    blocks = np.concatenate([lin.jl[lin.local == i].T @ lin.jl[lin.local == i] for i in range(draws.poses)])
    s = blocks.reshape(-1, 6, 6) + np.swapaxes(lin.hold, 1, 2) @ lin.hold
    shared = np.stack([lin.jl[lin.local == i].T @ lin.j[lin.local == i] for i in range(draws.poses)])
    a = lin.j.T @ lin.j - np.einsum("ula,ulb->ab", shared, np.linalg.solve(s, shared))
    bars = np.sqrt(np.diag(np.linalg.inv(a)))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance[0])), bars, rtol=1e-6)


def test_it_is_the_maximum_likelihood_of_free_poses_at_the_noises_of_figure_3_8(draws):
    p = draws.problem
    free = least_squares(p, draws.start)
    found = generalised_least_squares(p, draws.start)
    assert found.exact.all()
    assert (found.moved <= ENOUGH).all()
    assert np.abs(in_sigma(p, found, free.x)).max() < ENOUGH
    poses = p.values_of(0, found.x) - p.values_of(0, free.x)
    assert (np.abs(poses) < ENOUGH * SIGMA).all()


def test_one_pass_is_right_to_first_order(shared_data):
    """A tenth of the noise, in lengths and poses: what one pass is off by, in sigma, falls to a tenth."""
    off = []
    for noise in (1.0, 0.1):
        some = Draws(shared_data, noise=noise)
        p = some.problem
        free = least_squares(p, some.start)
        one = least_squares(correlate_rows(p, some.start), some.start)
        bars = generalised_least_squares(p, some.start)
        off.append(np.sqrt(np.mean(in_sigma(p, replace(bars, x=one.x), free.x) ** 2)))
    assert 0.005 < off[0] < 0.1
    assert off[1] == pytest.approx(off[0] / 10, rel=0.3)


def test_one_linearisation_serves_a_batch(draws):
    """The information of one list of poses weighs the lists of all: right to first order, and each as if it were alone."""
    p = draws.problem
    made = correlate_rows(p)
    together = least_squares(made, draws.start)
    for b in (0, 5):
        alone = replace(p, terms=tuple(_of(t, b) for t in p.terms))
        single = least_squares(correlate_rows(alone), draws.start[b : b + 1])
        np.testing.assert_allclose(together.x[b], single.x[0], rtol=1e-9, atol=1e-10)


def _of(term, b):
    """The term with the readings of one problem of the batch."""
    other = object.__new__(type(term))
    other.__dict__.update(term.__dict__)
    other.value = term.value[b : b + 1]
    return other


def test_poses_follow_the_shared_columns(draws):
    """Where the free poses ended nothing moves; elsewhere one step takes the pose back."""
    p = draws.problem
    free = least_squares(p, draws.start)
    np.testing.assert_allclose(follow(p, free.x), free.x, atol=1e-6)
    away = free.x.copy()
    away[:, p.places[0]] = p.start[:, p.places[0]]
    assert np.abs(follow(p, away) - free.x).max() < 0.05 * np.abs(away - free.x).max()


def test_a_component_of_which_nothing_is_known_beforehand(draws):
    """Prior of the position alone: the turn is what the lengths say of it."""
    p = draws.problem.with_local_prior(sigma=[PLACE] * 3 + [np.inf] * 3)
    free = least_squares(p, draws.start)
    found = generalised_least_squares(p, draws.start)
    assert np.abs(in_sigma(p, found, free.x)).max() < ENOUGH


def test_where_passes_do_not_suffice_the_free_poses_are_fitted_and_it_is_said(draws):
    p = draws.problem
    found = generalised_least_squares(p, draws.start, passes=1)
    assert not found.exact.any()
    np.testing.assert_allclose(found.x, least_squares(p, found.x).x, atol=1e-9)


def test_a_row_that_is_set_aside_says_nothing(shared_data):
    one = Draws(shared_data, poses=12, batch=1)
    gross = Draws(shared_data, poses=12, batch=1)
    term = gross.problem.terms[0]
    aside = np.zeros(len(term.scale), dtype=bool)
    aside[[7, 40]] = True
    for made in (one, gross):
        made.problem = replace(made.problem, terms=(made.problem.terms[0].without(aside),))
    gross.problem.terms[0].value[:, aside] += 1.0
    a, b = (generalised_least_squares(d.problem, d.start) for d in (one, gross))
    np.testing.assert_array_equal(a.x[:, one.problem.index], b.x[:, one.problem.index])


def test_what_it_cannot_do_is_refused(shared_data, draws):
    p = draws.problem
    for wrong, match in (
        (p.with_loss("huber"), "robust loss"),
        (p.with_local_prior(), "needs a prior"),
        (p.with_fixed_blocks(0), "one family"),
        (thesis_rig(specification(shared_data), 0, poses=4, grid=(2, 2)).problem, "touched by one sensor"),
    ):
        with pytest.raises(ModelError, match=match):
            correlate_rows(wrong)
    few = Draws(shared_data, poses=12, batch=1, missing=tuple(range(40, 45)))
    with pytest.raises(ModelError, match="neither by its prior nor by its rows"):
        correlate_rows(few.problem.with_local_prior(sigma=[np.inf] * 6))
