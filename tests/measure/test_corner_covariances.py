"""Corners of a marker whose errors are correlated, from the columns that `vision detect` writes."""

from __future__ import annotations

import numpy as np
import pytest
from lens_world import SIZE, SQUARE, look, marker_rows, write

from robocal.errors import FormatError
from robocal.estimate.least_squares import least_squares
from robocal.session.vision.corner_table import read_corners
from robocal.session.vision.lens_fit import fit_lens, plain_lens

# Four markers of 30 mm.
MIDDLES = np.array([(x, y, 0.0) for x in (-0.04, 0.04) for y in (-0.03, 0.03)])
POINTS = (MIDDLES[:, None] + 0.015 * SQUARE).reshape(-1, 3)
OTHERS = [f"c{a}_{b}{j}" for a in "uv" for j in range(4) for b in "uv"]


def rows(seed, views=12, noise=0.1, bend=0.3):
    """Rows with the truth's own covariance: even noise, and a bend of each marker that all its corners share. Beside them uv, C and e."""
    rng = np.random.default_rng(seed)
    uv = look(rng, views, POINTS)
    modes = rng.normal(0, bend, (views, 4, 8))
    covariance = noise**2 * np.eye(8) + modes[..., :, None] * modes[..., None, :]
    error = np.einsum("vmij,vmj->vmi", np.linalg.cholesky(covariance), rng.normal(size=modes.shape))
    made = marker_rows(uv + error.reshape(uv.shape), 0.0, rng, [str(k) for k in range(4)])
    places = 1e3 * np.tile(POINTS, (views, 1))
    for row, c, p, k in zip(made, covariance.reshape(-1, 2, 8), places, np.tile(np.arange(4), 4 * views), strict=True):
        own = c[:, 2 * k : 2 * k + 2]
        row |= {"su [px]": own[0, 0] ** 0.5, "sv [px]": own[1, 1] ** 0.5, "suv [px^2]": own[0, 1]}
        row |= {f"point_{a} [mm]": v for a, v in zip("xyz", p, strict=True)}
        row |= {f"{n} [px^2]": f"{v:.12g}" for n, v in zip(OTHERS, c.ravel(), strict=True)}
    return made, covariance, error


def read(place, made):
    return read_corners(
        (place / "corners.csv") if write(place / "corners.csv", made) else None,
        size=None, square=None, checker=None, sheet=None, image="1280x960", exclude=(),
    )  # fmt: skip


def squares(made):
    """chi2 of a decided lens by what is used there, and the degrees of freedom."""
    (group,) = made.need_fit.groups
    return group.chi2, group.dof


def test_the_rows_of_a_marker_are_whitened_together(tmp_path):
    """At any lens: r' C^-1 r, the same by normal equations, and residuals that are told are those that were read."""
    made, covariance, _ = rows(3)
    table = read(tmp_path, made)
    found = fit_lens(table, plain_lens(SIZE, "brown"))
    fit = found.need_fit
    problem, x = fit.problem.with_priors(False), fit.problem.start
    (seen,) = problem.residuals(x)
    order = np.argsort(problem.terms[0].index)
    r = seen.value[order].reshape(-1, 8)
    whole = np.einsum("mi,mij,mj->", r, np.linalg.inv(covariance.reshape(-1, 8, 8)), r)
    assert (seen.white**2).sum() == pytest.approx(whole, rel=1e-6)
    assert problem.linearize(x).r @ problem.linearize(x).r == pytest.approx(whole, rel=1e-6)
    assert 2 * problem.normal(x).cost[0] == pytest.approx(whole, rel=1e-6)
    white = (seen.value * seen.scale) ** 2
    assert abs(white.sum() / whole - 1) > 0.1  # what rows alone would say
    lin, n = problem.linearize(x), problem.n
    assert np.allclose(lin.j.T @ lin.r, problem.normal(x).g[0], rtol=1e-8, atol=1e-6)
    assert n == 9


def test_a_corner_that_is_set_aside_takes_its_share_of_the_covariance_with_it(tmp_path):
    made, covariance, _ = rows(4)
    problem = fit_lens(read(tmp_path, made), plain_lens(SIZE, "brown")).need_fit.problem
    (term,) = problem.terms
    out = np.zeros(len(term.index), dtype=bool)
    out[5] = True
    less = problem.without([out])
    (all_rows,), (seen,) = problem.residuals(problem.start), less.residuals(problem.start)
    row = int(term.index[5])
    block, corner = row // 4, row % 4
    kept = np.delete(np.arange(8), [2 * corner, 2 * corner + 1])
    c = covariance.reshape(-1, 8, 8)[block]
    mine = np.flatnonzero(term.index // 4 == block)
    r = all_rows.value[mine[np.argsort(term.index[mine])]].ravel()
    lost = r @ np.linalg.solve(c, r) - r[kept] @ np.linalg.solve(c[np.ix_(kept, kept)], r[kept])
    assert (all_rows.white**2).sum() - (seen.white**2).sum() == pytest.approx(lost, rel=1e-5)
    assert 2 * less.with_priors(False).normal(problem.start).cost[0] == pytest.approx((seen.white**2).sum(), rel=1e-6)


def test_the_lens_is_surer_and_chi2_is_right(tmp_path):
    """Rows taken one by one know less, and their chi2 says nothing of it."""
    spread, chi2 = {}, {}
    for name, drop in (("whole", ()), ("corner", OTHERS), ("rows", [*OTHERS, "suv"])):
        total, dof, sigma = 0.0, 0.0, []
        for seed in range(3):
            made, _, _ = rows(20 + seed)
            kept = [{k: v for k, v in row.items() if k.split(" ")[0] not in drop} for row in made]
            found = fit_lens(read(tmp_path, kept), plain_lens(SIZE, "brown"))
            one = squares(found)
            total, dof = total + one[0], dof + one[1]
            names, covariance = found.spread
            sigma.append(covariance[names.index("lens.fx"), names.index("lens.fx")] ** 0.5)
        spread[name], chi2[name] = float(np.mean(sigma)), total / dof
    assert 0.8 < chi2["whole"] < 1.25, chi2
    assert spread["whole"] < 0.6 * spread["rows"], spread
    assert spread["corner"] < spread["rows"], spread


def test_cells_that_are_no_covariance_are_named(tmp_path):
    made, _, _ = rows(5, views=4)
    made[7]["suv [px^2]"] = 9.0
    with pytest.raises(FormatError, match="no covariance of u and v") as told:
        read(tmp_path, made)
    assert told.value.row == 9
    made[7]["suv [px^2]"] = 0.0
    made[7]["cu_u0 [px^2]"] = "a"
    with pytest.raises(FormatError, match="not a number"):
        read(tmp_path, made)


def test_rows_without_covariances_are_taken_one_by_one(tmp_path):
    """Of a list with boards and markers some cells are empty: no row is lost."""
    made, _, _ = rows(6, views=4)
    for row in made[:8]:
        row |= {f"{n} [px^2]": "" for n in (*OTHERS, "suv")}
    table = read(tmp_path, made)
    assert len(table.pixels) == len(made)
    problem = fit_lens(table, plain_lens(SIZE, "brown")).need_fit.problem
    (seen,) = problem.residuals(problem.start)
    first = problem.terms[0].index < 8
    assert np.allclose(seen.white[first], (seen.value * seen.scale)[first])
    assert not np.allclose(seen.white[~first], (seen.value * seen.scale)[~first])
    assert least_squares(problem, problem.start).cost[0] > 0


def test_markers_with_places_of_their_own_are_summed_view_by_view(tmp_path):
    """Several targets of one view, whose places are free too: the short way to the normal equations says what the rows say."""
    made, _, _ = rows(7)
    write(tmp_path / "m.csv", [{k: v for k, v in row.items() if not k.startswith("point")} for row in made])
    table = read_corners(
        tmp_path / "m.csv", size=30.0, square=None, checker=None, sheet=None, image="1280x960", exclude=()
    )
    problem = fit_lens(table, plain_lens(SIZE, "brown")).need_fit.problem.with_priors(False)
    assert len(problem.terms) == 4 and len(problem._summed) == 1
    x = problem.start
    lin, normal = problem.linearize(x), problem.normal(x)
    lower = np.tril(normal.a[0])
    assert np.allclose(np.tril(lin.j.T @ lin.j), lower, rtol=1e-7, atol=1e-7 * np.abs(lower).max())
    assert np.allclose(lin.j.T @ lin.r, normal.g[0], rtol=1e-7, atol=1e-7 * np.abs(normal.g[0]).max())
    assert 2 * normal.cost[0] == pytest.approx(lin.r @ lin.r, rel=1e-9)
    assert 2 * normal.cost[0] == pytest.approx(sum((r.white**2).sum() for r in problem.residuals(x)), rel=1e-9)


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_a_robust_loss_weighs_independent_numbers(tmp_path, loss):
    """Of the short way, against rows one by one."""
    made, _, _ = rows(8)
    problem = fit_lens(read(tmp_path, made), plain_lens(SIZE, "brown")).need_fit.problem.with_loss(loss)
    x = problem.start
    normal = problem.normal(x)
    (seen,) = problem.residuals(x)
    square = (seen.white**2).sum(axis=1)
    step = np.zeros(len(x[0]))
    at = problem.table.index["lens.fx"]
    step[at] = 1e-3
    low, high = (problem.normal(x + s * step).cost[0] for s in (-1, 1))
    column = list(problem.free).index("lens.fx")
    assert (high - low) / 2e-3 == pytest.approx(normal.g[0, column], rel=1e-5)
    lin = problem.linearize(x)
    weight = problem.slopes(lin.r**2, lin)
    assert (lin.j[:, column] * weight) @ lin.r == pytest.approx(normal.g[0, column], rel=1e-8)
    assert square.max() > 1
