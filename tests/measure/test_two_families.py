"""Poses and targets that are local blocks together: the same optimum and the same bars as one dense problem, and as SciPy's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize
from cables.thesis_rig import SIX, specification, thesis_rig
from measure.scenarios import build
from unseen import leave_one_out

from robocal.errors import ModelError
from robocal.estimate import elimination
from robocal.estimate.damping import steps
from robocal.estimate.elimination import squares
from robocal.estimate.identifiability import analyse
from robocal.estimate.kalman import kalman
from robocal.estimate.least_squares import least_squares
from robocal.estimate.schur.system import structure
from robocal.estimate.uncertainty import uncertainty
from robocal.measure.base import problem

EYE = [f"eye.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")]


def joint(rig, **more):
    """The rig's problem with its free markers as a family of their own."""
    names = tuple(t.name for t in rig.data.observations[0].targets if t.free == SIX)
    made = problem(rig.robot, rig.data, local_targets=names)
    priors = {p.name: p.prior for p in rig.problem.table.rows if p.prior is not None and p.name in made.table.index}
    return made.with_table(made.table.with_priors(priors))


def shared_prior(rng, p):
    """The same problem, where the camera was calibrated: what it stands at is known with a covariance."""
    a = rng.normal(size=(6, 6))
    scale = np.array([2e-3] * 3 + [5e-3] * 3)
    return p.with_table(p.table.with_covariance(EYE, np.outer(scale, scale) * (a @ a.T + np.eye(6)) / 6))


@pytest.fixture
def rig(shared_data):
    return thesis_rig(specification(shared_data), 3, poses=14, grid=(5, 4))


@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", range(5))
def test_the_optimum_and_the_bars_are_those_of_scipy(shared_data, seed):
    rng = np.random.default_rng(seed)
    rig = thesis_rig(specification(shared_data), seed, poses=10, grid=(4, 3))
    p = (
        shared_prior(rng, joint(rig))
        .with_local_prior(sigma=[0.02] * 3 + [0.01] * 3)
        .with_local_prior(sigma=[0.01] * 6, family=1)
    )
    sizes = [f.count * f.size for f in p.families]

    def moved(step):
        ends = np.cumsum([p.n, *sizes])
        parts = [step[a:b].reshape(1, f.count, f.size) for a, b, f in zip(ends[:-1], ends[1:], p.families, strict=True)]
        return p.retract(p.start, step[None, : p.n], *parts)

    def residuals(step):
        x = moved(step)
        rows = [*((r.value * r.scale).ravel() for r in p.residuals(x)), p.prior_root @ p.difference(x)[0]]
        return np.concatenate([*rows, *(f.prior.rows(p.values_of(i, x))[0].ravel() for i, f in enumerate(p.families))])

    scale = np.concatenate([p.scales, np.full(sum(sizes), 0.01)])
    oracle = scipy.optimize.least_squares(
        lambda z: residuals(scale * z),
        np.zeros(len(scale)),
        ftol=1e-14,
        xtol=1e-14,
        gtol=1e-12,
        jac="3-point",
        max_nfev=40,
    )
    s = least_squares(p, cost_tolerance=1e-14)
    assert s.reasons[0].converged
    assert s.cost[0] == pytest.approx(oracle.cost, rel=1e-9)
    np.testing.assert_allclose(s.x, moved(scale * oracle.x), atol=1e-6)
    bars = scale * np.sqrt(np.diag(np.linalg.inv(oracle.jac.T @ oracle.jac)))
    np.testing.assert_allclose(uncertainty(p, s.x).sigma_instrument, bars[: p.n], rtol=1e-3)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("loss", ["none", "huber", "cauchy", "tukey"])
def test_markers_as_blocks_are_markers_as_columns(rig, loss):
    """One problem, written twice; with a robust loss too."""
    two, one = joint(rig).with_loss(loss), rig.problem.with_loss(loss)
    first = least_squares(two, cost_tolerance=1e-14)
    second = least_squares(one, cost_tolerance=1e-14)
    assert first.cost[0] == pytest.approx(second.cost[0], rel=1e-10)
    rows = [one.table.index[n] for n in two.table.names]
    np.testing.assert_allclose(first.x[0, : len(rows)], second.x[0, rows], atol=1e-7)
    a, b = uncertainty(two, first.x), uncertainty(one, second.x)
    at = [one.free.index(n) for n in two.free]
    np.testing.assert_allclose(a.sigma_instrument, b.sigma_instrument[at], rtol=1e-5)
    assert (a.dof, round(a.chi2, 4)) == (b.dof, round(b.chi2, 4))


def test_what_is_not_formed_says_the_same(rig, monkeypatch):
    """Rank, bars and degrees of freedom from the reduced normal equations and from the dense Jacobian."""
    p = joint(rig)
    x = least_squares(p).x
    reduced, dense = squares(p, x), squares(p, x, p.linearize(x))
    np.testing.assert_allclose(
        reduced.root.T @ reduced.root,
        dense.root.T @ dense.root,
        rtol=1e-6,
        atol=1e-6 * np.abs(dense.root.T @ dense.root).max(),
    )
    assert (reduced.rows, reduced.taken) == (dense.rows, dense.taken)
    assert reduced.square == pytest.approx(dense.square, rel=1e-10)
    one = analyse(p, x)
    two = analyse(p, x, known=squares(p, x, p.linearize(x)))
    assert one.basis == two.basis and one.rank == two.rank
    np.testing.assert_allclose(one.share, two.share, atol=1e-6)
    # One family and many free columns: the same two ways.
    alone, at = rig.problem, least_squares(rig.problem).x
    first = uncertainty(alone, at)
    monkeypatch.setattr(elimination, "DENSE", 0)
    second = uncertainty(alone, at)
    assert first.dof == second.dof
    np.testing.assert_allclose(first.sigma_instrument, second.sigma_instrument, rtol=1e-5)


@pytest.mark.parametrize(
    "name", ["pixels/free poses, free markers", "position/free poses, free targets", "pose/free poses, free targets"]
)
@pytest.mark.parametrize("out", [0, 1])
def test_either_family_may_be_eliminated(name, out):
    from robocal.estimate.schur.system import System

    p = build(name)
    normal, rng = p.normal(p.start), np.random.default_rng(0)
    system = System(out, p.n, p.sizes, p.pairs)
    damp = rng.uniform(1, 2, p.n)
    local = tuple(rng.uniform(1, 2, s) for s in p.sizes)
    lam = 1e-3 * max(np.abs(normal.a).max(), np.abs(normal.al).max(), np.abs(normal.am).max())
    held = np.zeros(p.n, dtype=bool)
    held[::4] = True
    step, steps_ = np.zeros(p.n), tuple(np.zeros(s) for s in p.sizes)
    assert system.solve(normal, 0, lam, damp, local, held, step, steps_)
    whole = matrix(p, normal) + lam * np.diag(np.concatenate([damp, *(x.ravel() for x in local)]))
    g = np.concatenate([normal.g[0], normal.gl[0].ravel(), normal.gm[0].ravel()])
    free = np.concatenate([~held, np.ones(len(g) - p.n, dtype=bool)])
    expected = np.zeros(len(g))
    expected[free] = -np.linalg.solve(whole[np.ix_(free, free)], g[free])
    np.testing.assert_allclose(
        np.concatenate([step, *(x.ravel() for x in steps_)]), expected, rtol=1e-7, atol=1e-12 * np.abs(expected).max()
    )


def matrix(p, normal):
    """The Gauss-Newton matrix of all columns, free ones first."""
    sizes = [s[0] * s[1] for s in p.sizes]
    ends = np.cumsum([0, p.n, *sizes])
    out = np.zeros((ends[-1], ends[-1]))
    out[: p.n, : p.n] = normal.a[0]
    for i, (count, size) in enumerate(p.sizes):
        for b in range(count):
            at = slice(ends[i + 1] + b * size, ends[i + 1] + (b + 1) * size)
            out[at, at], out[at, : p.n] = normal.of_family(i)[1][0, b], normal.of_family(i)[2][0, b].T
    for (one, two), cross in zip(p.pairs, normal.cross[0], strict=True):
        (_, l), (_, q) = p.sizes
        out[ends[2] + two * q : ends[2] + two * q + q, ends[1] + one * l : ends[1] + one * l + l] += cross.T
    return np.tril(out) + np.tril(out, -1).T


def test_large_and_small_problems_take_the_same_steps(rig, monkeypatch):
    """LAPACK and the compiled solver, on one family with a hundred free columns."""
    p = rig.problem
    assert p.n > steps.LARGE
    large = least_squares(p)
    monkeypatch.setattr(steps, "LARGE", 10_000)
    small = least_squares(p)
    np.testing.assert_allclose(large.history[:4], small.history[:4], rtol=1e-6)
    assert large.cost[0] == pytest.approx(small.cost[0], rel=1e-10)


def test_the_cheaper_family_goes():
    pairs = np.stack(np.meshgrid(np.arange(5), np.arange(40), indexing="ij"), axis=-1).reshape(-1, 2)
    assert structure(3, ((5, 6), (40, 6)), pairs).out == 1
    assert structure(3, ((40, 6), (5, 6)), pairs[:, ::-1]).out == 0


def test_what_two_families_cannot_do_is_said(rig):
    p = joint(rig)
    with pytest.raises(ModelError, match="one family"):
        kalman(p)
    with pytest.raises(ModelError, match="no such target"):
        problem(rig.robot, rig.data, local_targets=("nowhere",))
    pixels, lengths = rig.data.observations
    odd = tuple(
        replace(t, free=(True, True, True, False, False, False)) if t.name == "m3" else t for t in pixels.targets
    )
    with pytest.raises(ModelError, match="same components"):
        problem(
            rig.robot,
            replace(rig.data, observations=(replace(pixels, targets=odd), lengths)),
            local_targets=("m3", "m4"),
        )


def test_tukey_is_never_first(rig):
    """From 20 mm off everything is an outlier: what Tukey's loss would leave of it is nothing to go by."""
    p = joint(rig).with_loss("tukey")
    near = least_squares(p, least_squares(p.with_loss("huber")).x)
    assert least_squares(p).cost[0] == pytest.approx(near.cost[0], rel=1e-6)
    trapped = least_squares(p, p.start)
    assert trapped.cost[0] > 1.5 * near.cost[0]


def test_held_out_poses_are_found_without_moving_the_markers(rig):
    """Leaving one configuration out: its pose is profiled from its own rows, everything else is what the others say."""
    p = joint(rig)
    x = least_squares(p).x
    out = leave_one_out(p, x, np.arange(p.configurations), unit="px")
    at = np.concatenate([r.configuration for r in p.residuals(x) if r.parts[0][2] == "px"])
    for k in range(3):
        weights = np.ones(p.configurations)
        weights[k] = 0
        alone = least_squares(p.with_weights(weights), x, cost_tolerance=1e-14).x
        held = p.with_fixed_blocks(1).with_free(()).with_weights(1 - weights)
        placed = least_squares(held, alone, cost_tolerance=1e-14).x
        np.testing.assert_array_equal(placed[0, : p.places[0].start], alone[0, : p.places[0].start])
        np.testing.assert_array_equal(placed[0, p.places[1]], alone[0, p.places[1]])
        pixels = np.concatenate([r.length() for r in p.residuals(placed) if r.parts[0][2] == "px"])
        ratio = out[at == k] / pixels[at == k]
        np.testing.assert_allclose(ratio, ratio[0], rtol=1e-4)  # one factor for the numbers that the pose took
        assert ratio[0] >= 1


def test_what_free_poses_take_up_is_not_said_to_have_no_effect(rig):
    """A camera that sees only the floor: where it sits on a platform whose pose is anybody's guess cannot be told."""
    seen = replace(rig.data, observations=rig.data.observations[:1])
    made = problem(rig.robot, seen)
    made = made.with_table(made.table.with_priors(dict.fromkeys(made.table.names)))
    for local, said in ((), "the free poses"), (("m1",), "the free poses, the free targets"):
        names = tuple(t.name for t in seen.observations[0].targets if t.free == SIX) if local else ()
        both = problem(rig.robot, seen, local_targets=names) if local else made
        both = both.with_table(both.table.with_priors(dict.fromkeys(both.table.names)))
        found = analyse(both.with_free(EYE), both.start)
        assert found.dropped == tuple(EYE)
        for c in found.combinations:
            assert c.remark.sentence == f"{c.name} cannot be separated from {said}"
    unseen = analyse(made.with_free(["c1.ax"]), made.start).combinations[0]
    assert unseen.remark.sentence == "c1.ax has no effect on these measurements"
