"""The joint benchmark: its jobs are what robocal's model says, contestants agree, rows say how far they are apart."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.optimize

from robocal.estimate.least_squares import least_squares

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def bench(monkeypatch):
    """The benchmark's modules, which import each other as neighbours."""
    monkeypatch.syspath_prepend(str(BENCHMARKS / "peers"))
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    names = ("joint_job", "joint_worker", "joint_sections", "joint_kernel")
    yield SimpleNamespace(**{n: importlib.import_module(n) for n in names})
    for name in names:
        sys.modules.pop(name, None)


def small(bench, **more):
    return SimpleNamespace(**bench.joint_job.make(8, (4, 3), **more))


def test_the_job_is_what_the_model_says(bench, monkeypatch):
    """Without noise and from the truth, nothing is left."""
    for name in ("CORNER", "LENGTH"):
        monkeypatch.setattr(bench.joint_job, name, 1e-12)
    job = small(bench)
    made = bench.joint_worker.problem_of(job)
    found = least_squares(made.with_table(made.table.with_priors(dict.fromkeys(made.table.names))))
    assert max(np.abs(r.value).max() for r in made.residuals(found.x)) < 1e-6


@pytest.mark.slow
def test_markers_as_blocks_as_columns_and_by_scipy(bench):
    job = small(bench)
    blocks, columns = (bench.joint_worker.problem_of(job, way) for way in ("families", "columns"))
    cost = least_squares(blocks).cost[0]
    assert least_squares(columns).cost[0] == pytest.approx(cost, rel=1e-9)
    scale = np.concatenate([columns.scales, np.full(6 * len(job.views), 0.01)])

    def at(z):
        step = scale * z
        return columns.retract(columns.start, step[None, : columns.n], step[columns.n :].reshape(1, -1, 6))

    def residuals(z):
        x = at(z)
        return np.concatenate([columns.linearize(x).r, columns.prior_root @ columns.difference(x)[0]])

    oracle = scipy.optimize.least_squares(residuals, np.zeros(len(scale)), xtol=1e-14, ftol=1e-14, gtol=1e-12)
    assert oracle.cost == pytest.approx(cost, rel=1e-8)


def test_the_peers_model_is_the_job(bench):
    """The residuals that scipy and pyceres are given make the same cost, and their derivatives are those of the residuals."""
    job = small(bench)
    kernel = bench.joint_kernel
    views, markers, eye, lens = (np.array(v, float) for v in (job.views, job.markers, job.eye, job.lens[:8]))
    cables = np.column_stack([job.anchors, np.zeros(8)])
    uv = np.array(job.uv, float).reshape(len(job.view), 8)
    corners, more = np.array(job.corners, float).ravel(), np.array([job.corner, job.sigma])
    view, marker = (np.asarray(i, np.int64) for i in (job.view, job.marker))
    r, data = np.empty(8 * len(view) + 8 * len(views)), np.empty(208 * len(view) + 80 * len(views))
    fixed = (np.array(job.platform), view, marker, uv, np.array(job.length).ravel(), corners, more)
    kernel.rows_of(views, markers, eye, lens, cables, *fixed, r, data)
    made = bench.joint_worker.problem_of(job)
    assert 0.5 * r @ r == pytest.approx(made.normal(made.start).cost[0], rel=1e-9)
    rng = np.random.default_rng(0)
    parts = [views, markers, eye, lens, cables]
    steps = [rng.normal(size=p.shape) for p in parts]
    ends = []
    for sign in (1, -1):
        moved, out = [p + sign * 1e-6 * s for p, s in zip(parts, steps, strict=True)], np.empty_like(r)
        kernel.rows_of(*moved, *fixed, out, np.empty_like(data))
        ends.append(out)
    along = []
    for s, (v, m) in enumerate(zip(view, marker, strict=True)):
        step = np.concatenate([steps[0][v], steps[1][m], steps[2], steps[3]])
        along.append(data[208 * s : 208 * (s + 1)].reshape(8, 26) @ step)
    tail = data[208 * len(view) :].reshape(-1, 10)
    along.append([row @ np.concatenate([steps[0][i // 8], steps[4][i % 8]]) for i, row in enumerate(tail)])
    slope = (ends[0] - ends[1]) / 2e-6
    np.testing.assert_allclose(np.concatenate(along), slope, rtol=1e-5, atol=1e-5 * np.abs(slope).max())


def test_half_turns_keep_their_axes(bench):
    rng = np.random.default_rng(0)
    w = rng.normal(size=(50, 3))
    w *= (np.pi * rng.choice([1e-9, 0.5, 1 - 1e-9, 1.0], 50) / np.linalg.norm(w, axis=1))[:, None]
    r = bench.joint_job.rotation(w)
    np.testing.assert_allclose(bench.joint_job.rotation(bench.joint_job.vector(r)), r, atol=1e-7)


def test_rows_say_who_ended_higher(bench, monkeypatch):
    class Runner:
        def __init__(self, cost, seconds):
            self.answer, self.time = {"joint-a": {"cost": cost, "iterations": 3}}, seconds

        def seconds(self, job):
            return self.time, self.time

    monkeypatch.setattr(
        bench.joint_sections, "race", lambda *_: {"robocal": Runner(2.0, 0.1), "other": Runner(2.2, 0.3)}
    )
    mine, other = bench.joint_sections.rows_of((), {"a": {"view": [0, 1]}}, 1)
    assert mine["off_cost"] == 0 and mine["corners"] == 8
    assert other["off_cost"] == pytest.approx(0.1) and other["cpu_over_robocal"] == pytest.approx(3)
