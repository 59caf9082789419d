"""Markers on the floor below a cable robot whose places nobody states begin where its camera shows them."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from robocal.fit.baseline import fit_baseline
from robocal.session.inputs import read_inputs

EXAMPLE = Path(__file__).parents[2] / "examples" / "cable-camera"
FILES = ("robot.yaml", "lengths.csv", "lengths.yaml", "pixels.csv", "pixels.yaml")


@pytest.mark.parametrize("camera", ["stated", "unknown"])
def test_markers_and_camera_begin_where_views_show_them(tmp_path, camera):
    for name in FILES:
        shutil.copy(EXAMPLE / name, tmp_path)
    text = (tmp_path / "pixels.yaml").read_text()
    if camera == "unknown":
        known = (
            r"(frame: \{name: eye, mount: tool, free: true), xyz: \[.*?\], rotation_vector: \[.*?\], prior: \{.*?\}\}"
        )
        text, count = re.subn(known, r"\1}", text)
        assert count == 1
        (tmp_path / "pixels.yaml").write_text(text)
    inputs = read_inputs(tmp_path / "robot.yaml", [tmp_path / "lengths.yaml", tmp_path / "pixels.yaml"])
    pixels = next(o for o in inputs.data.observations if o.kind == "pixels")
    assert all(any(t.value) for t in pixels.targets)
    # A tape measure's anchors are off by centimetres, and so is where the platform is believed to be.
    assert np.abs(np.array(pixels.frame.value[:3]) - [0.02, 0.01, -0.25]).max() < 0.1
    found = fit_baseline(inputs.opened.machine, inputs.data, np.arange(len(inputs.data.configurations)))
    left = np.concatenate([np.abs(r.value).ravel() for r in found.problem.residuals(found.x) if r.kind == "pixels"])
    assert found.converged and np.median(left) < 3.0
