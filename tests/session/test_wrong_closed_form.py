"""A closed form that found nothing does not leave frames unfitted: where what is stated leaves far less, that is where fits begin."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np

from robocal.estimate.least_squares import least_squares
from robocal.fit.baseline import fit_baseline, frame_names
from robocal.fit.starts import search
from robocal.geometry import se3
from robocal.session.inputs import read_inputs

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def test_a_camera_put_into_a_marker_leaves_no_frame_unfitted(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    corner_data = importlib.import_module("corner_data")
    # So many numbers that normal equations stand in for rows: one column that is huge hides all others there.
    assert corner_data.cable(tmp_path, np.random.default_rng(0), 20, 9, 0.1, 0.07) > 4500
    inputs = read_inputs(tmp_path / "robot.yaml", [tmp_path / "lengths.yaml", tmp_path / "camera.yaml"])
    machine, data = inputs.opened.machine, inputs.data
    places = {t.name: se3.from_vector(t.value) for o in data.observations for t in o.targets}
    inside = se3.inverse(se3.from_vector(data.configurations.starts[0])) @ places["m0"]
    eye = {f"eye.{s}": float(v) for s, v in zip(("x", "y", "z", "rx", "ry", "rz"), se3.to_vector(inside), strict=True)}
    monkeypatch.setattr(search, "combine_starts", lambda *_: [eye])
    found = fit_baseline(machine, data, np.arange(len(data.configurations)))
    frames = found.problem.with_free(frame_names(machine, found.problem))
    cost = frames.normal(found.x).cost[0]
    assert found.converged and least_squares(frames, found.x).cost[0] > (1 - 1e-6) * cost
