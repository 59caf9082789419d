"""The map of `vision map` beside Ceres: the same corners and priors, residuals by formulas of the tests' own, a start that is off."""

from __future__ import annotations

import numpy as np
import pytest
from lens_world import LENS, see, turn
from map_world import EDGE
from session.test_map_fit import KNOWN, known_lens, look

from robocal.geometry import se3
from robocal.parameters import FRAME_SYMBOLS
from robocal.session.vision.lens_fit import view_poses
from robocal.session.vision.map_fit import fit_map
from robocal.session.vision.map_sizes import EdgeErrors

pyceres = pytest.importorskip("pyceres", reason="Ceres is in the extra `oracles`")


def errors(lens, view, marker, edge, unit, pixel, sigma):
    """Whitened (2 m,), of corners `unit` (m, 3) times half an edge."""
    seen = (unit * edge / 2 @ turn(marker[3:]).T + marker[:3]) @ turn(view[3:]).T + view[:3]
    return ((see(seen, dict(zip(LENS, lens, strict=True))) - pixel) / sigma).ravel()


class Cost(pyceres.CostFunction):
    """A function of some blocks, with derivatives by central differences."""

    def __init__(self, function, count, blocks):
        super().__init__()
        self.function = function
        self.set_num_residuals(count)
        self.set_parameter_block_sizes(blocks)

    def Evaluate(self, parameters, residuals, jacobians):
        at = [np.array(p) for p in parameters]
        residuals[:] = self.function(*at)
        for b, jacobian in enumerate(jacobians or ()):
            if jacobian is None:
                continue
            steps = 1e-6 * np.maximum(1, np.abs(at[b]))
            columns = []
            for step in np.diag(steps):
                ahead, back = ([*at[:b], at[b] + s * step, *at[b + 1 :]] for s in (1, -1))
                columns.append((self.function(*ahead) - self.function(*back)) / (2 * step.sum()))
            jacobian[:] = np.array(columns).T.ravel()
        return True


@pytest.mark.parametrize("told", [None, EdgeErrors(2e-4, 3e-3)], ids=["exact edges", "free edges"])
def test_the_map_is_that_of_ceres(tmp_path, told):
    """Cost to 1e-9 of itself, and every number: places, turns, lens, edges with the error that they share."""
    table, _ = look(tmp_path, 2, 20)
    found = fit_map(table, known_lens(), "none", edges=told).decision
    obs = found.need_fit.data.observations[0]
    lens = np.array([found.values[f"lens.{s}"] for s in LENS])
    names = [f.name for f in obs.targets]
    markers = np.array([[found.values[f"{n}.{s}"] for s in FRAME_SYMBOLS] for n in names])
    edges = EDGE + np.array([found.values.get(f"{n}.edge", 0.0) for n in names])
    root = None if told is None else np.linalg.inv(np.linalg.cholesky(told.covariance(np.full(len(names), EDGE))))
    views = se3.to_vector(view_poses(found))
    prior, before = np.array(list(KNOWN.values())), np.array(list(LENS.values()))
    rng = np.random.default_rng(0)
    theirs = lens + 0.3 * prior * rng.normal(size=9)
    fixed = [not any(f.free) for f in obs.targets]
    blocks = [m + (0 if f else 2e-3) * rng.normal(size=6) for m, f in zip(markers, fixed, strict=True)]
    poses = [v + 2e-3 * rng.normal(size=6) for v in views]
    sides = [np.array([EDGE]) for _ in names]
    parts = {}
    for i, key in enumerate(zip(obs.configuration.tolist(), obs.target.tolist(), strict=True)):
        parts.setdefault(key, []).append(i)
    problem, costs = pyceres.Problem(), []

    def rows_of(rows):
        known = np.sign(obs.extra["point"][rows]), obs.value[rows], obs.sigma[rows]
        return lambda lens, view, marker, edge: errors(lens, view, marker, edge, *known)

    for (v, m), rows in parts.items():
        costs.append(Cost(rows_of(rows), 2 * len(rows), [9, 6, 6, 1]))
        problem.add_residual_block(costs[-1], None, [theirs, poses[v], blocks[m], sides[m]])
    costs.append(Cost(lambda lens: (lens - before) / prior, 9, [9]))
    problem.add_residual_block(costs[-1], None, [theirs])
    if root is not None:
        costs.append(Cost(lambda *e: root @ (np.concatenate(e) - EDGE), len(sides), [1] * len(sides)))
        problem.add_residual_block(costs[-1], None, sides)
    still = [block for block, f in zip(blocks, fixed, strict=True) if f]
    for block in still + ([] if told else sides):
        problem.set_parameter_block_constant(block)
    options, summary = pyceres.SolverOptions(), pyceres.SolverSummary()
    options.max_num_iterations, options.linear_solver_type = 200, pyceres.LinearSolverType.DENSE_QR
    options.function_tolerance, options.gradient_tolerance, options.parameter_tolerance = 1e-16, 1e-14, 1e-14
    pyceres.solve(options, problem, summary)
    side = np.concatenate(sides)

    def cost(lens, views, markers, edges):
        left = [np.sum(rows_of(rows)(lens, views[v], markers[m], edges[m]) ** 2) for (v, m), rows in parts.items()]
        own = 0.0 if root is None else float(np.sum((root @ (edges - EDGE)) ** 2))
        return sum(left) + own + float(np.sum(((lens - before) / prior) ** 2))

    mine, other = cost(lens, views, markers, edges), cost(theirs, poses, blocks, side)
    away = np.abs(np.array(blocks) - markers).max(), np.abs(side - edges).max(), (np.abs(theirs - lens) / prior).max()
    print(f"cost {mine:.6f}, {(mine - other) / other:.1e} of it above that of Ceres; "
          f"places and turns {away[0]:.1e} m and rad, edges {away[1]:.1e} m, lens {away[2]:.1e} sigma apart")  # fmt: skip
    assert mine == pytest.approx(other, rel=1e-9)
    assert away[0] < 1e-8 and away[1] < 1e-9 and away[2] < 1e-6
