"""The cable benchmark: contestants agree before they are timed, a section alone joins the results, the docs show what was measured."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def bench(monkeypatch):
    """Imports a module of the benchmarks, which are neighbours and no package."""
    for folder in ("peers", "."):
        monkeypatch.syspath_prepend(str(BENCHMARKS / folder))
    return importlib.import_module


@pytest.fixture
def solver(bench):
    """A solver of the peers by name; skips where it is not installed."""

    def find(name):
        make, packages = bench("worker_cables").SOLVERS[name]
        pytest.importorskip(packages[0])
        return make()

    return find


@pytest.fixture
def as_read(bench, tmp_path):
    """A job as a contestant reads it."""

    def read(job):
        np.savez(tmp_path / "job.npz", **job)
        return bench("protocol").load(tmp_path / "job.npz")

    return read


@pytest.mark.slow
@pytest.mark.parametrize("name", ["quadprog", "daqp", "daqp.Model", "osqp", "linprog", "highspy"])
def test_every_solver_finds_robocals_tensions(bench, solver, as_read, name):
    balance, least = solver(name), name not in ("linprog", "highspy")
    worker, cables = bench("cable_worker"), bench("cable_job")
    for kind, job in cables.tension_jobs(30).items():
        solve, answer = worker.tension_of_poses(as_read(job))
        own = np.array(answer(solve())["tension"])
        assert (np.isfinite(own).all(axis=1) == (kind == "feasible")).all()
        for w, load, mine in zip(job["structure"], job["wrench"], own, strict=True):
            found = balance(w, load)
            assert (found is not None) == (kind == "feasible")
            if found is not None and least:
                np.testing.assert_allclose(found, mine, atol=1e-5 if name == "osqp" else 1e-7)
            elif found is not None:
                np.testing.assert_allclose(w @ found, -load, atol=1e-6)


@pytest.mark.slow
def test_the_search_along_rays_finds_robocals_poses(bench, solver, as_read):
    search = bench("cable_search").Search(solver("linprog"), solver("quadprog"))
    job = bench("cable_job").pose_job(4)
    solve, answer = bench("cable_worker").poses(as_read(job), 1)
    own = answer(solve())
    assert min(own["furthest"]) < 0.9
    for i in range(4):
        furthest, tension, length = search.reach(job["start"], job["translation"][i], job["rotation"][i])
        assert furthest == pytest.approx(own["furthest"][i], abs=5e-5)  # the last micrometre, and halvings to 1e-6
        np.testing.assert_allclose(length, own["length"][i], atol=5e-4)
        np.testing.assert_allclose(tension, own["tension"][i], atol=1.0)


@pytest.mark.slow
def test_cells_and_margins_are_those_of_linear_programs_and_hulls(bench, as_read):
    cables, worker, peers = bench("cable_job"), bench("cable_worker"), bench("worker_cables")
    job = as_read(cables.grid_job(9, 40, 2))
    solve, answer = worker.cells(job, True)
    own = answer(solve())
    solve, answer = peers.grid(job, peers.by_linprog)
    assert answer(solve())["feasible"] == own["feasible"] and 5 < sum(own["feasible"]) < 35
    solve, answer = peers.margins(job, None)
    np.testing.assert_allclose(answer(solve())["margin"], own["margin"], rtol=1e-8)


def test_motions_are_drawn_as_a_list_of_poses_draws_them(bench):
    """Else the contestants would search along other rays than robocal."""
    from robocal.cables.geometry import home
    from robocal.cables.pose_list import default_box, reachable_poses

    cables = bench("cable_job")
    job = cables.pose_job(5)
    shape = default_box(cables.A, cables.SCALE, cables.TURN)
    made = reachable_poses(
        cables.A, cables.B, 5, np.random.default_rng(job["seed"]), box=shape, diameter=cables.DIAMETER
    )
    np.testing.assert_allclose(made.translation, job["translation"], atol=1e-14)
    np.testing.assert_allclose(made.rotation, job["rotation"], atol=1e-14)
    np.testing.assert_allclose(home(cables.A)[:3, 3], job["start"])


def test_a_section_alone_takes_its_place_in_the_results(bench, monkeypatch, tmp_path, capsys):
    run, path = bench("run"), tmp_path / "results.json"
    path.write_text(json.dumps({"contestants": [1], "sections": {"batch": [2], "cable_grid": [3]}}))
    monkeypatch.setattr(run, "SECTIONS", {"cables": lambda: {"cable_grid": [{"cells": 7}]}})
    monkeypatch.setattr("sys.argv", ["run.py", "--section", "cables", "-o", str(path)])
    assert run.main() == 0
    document = json.loads(path.read_text())
    assert document["contestants"] == [1]
    assert document["sections"] == {"batch": [2], "cable_grid": [{"cells": 7}]}
    assert document["measured"]["cables"]["date"]
    assert "cells" in capsys.readouterr().out


def test_the_documentation_shows_the_results(bench, tmp_path):
    publish = bench("publish")
    document = json.loads((BENCHMARKS / "results.json").read_text())
    page = tmp_path / "benchmarks.md"
    text = publish.PAGE.read_text(encoding="utf-8")
    begin, end = "<!-- cables: begin -->\n", "<!-- cables: end -->"
    head, rest = text.split(begin)
    page.write_text(head + begin + "old\n" + end + rest.split(end)[1], encoding="utf-8")
    publish.publish(document, page)
    assert page.read_text(encoding="utf-8") == text
