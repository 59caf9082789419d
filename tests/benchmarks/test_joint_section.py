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
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    names = ("joint_job", "joint_worker", "joint_sections")
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
