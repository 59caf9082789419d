"""An ultrasound probe and an N-wire phantom: from the two files of PLUS to a verdict, and what validation images say of it."""

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal

from robocal.fit.options import Options
from robocal.measure.base import problem
from robocal.prove.decision import decide
from robocal.session.inputs import read_inputs

ITS_OWN_TOOL = 0.41e-3  # m
BOUND = 0.355e-3


@pytest.fixture(scope="module")
def files(shared_data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("probe")
    data = shared_data / "ultrasound-nwire"
    ran = robocal("vision", "probe", data / "res2.xml", data / "conf2.xml", "-o", folder, "--json")
    assert ran.status == 0 and ran.document["images"] == {"calibration": 184, "validation": 103}
    assert ran.document["left_out"] == {"calibration": 6, "validation": 0}
    return folder


def distances(files, prior="", held=False):
    """Distances (m) of validation points from their wires, by a calibration that saw none of them."""
    text = (files / "calibration.yaml").read_text()
    if prior:
        start = text.index("prior: {")
        text = text[:start] + prior + text[text.index("}", start) + 1 :]
    (files / "other.yaml").write_text(text)
    inputs = read_inputs(files / "robot.yaml", [files / "other.yaml"])
    found = decide(inputs.opened.machine, inputs.data, Options())
    seen = read_inputs(files / "robot.yaml", [files / "validation.yaml"]).data
    made = problem(inputs.opened.machine, seen, values=found.values)
    return np.concatenate([np.linalg.norm(r.value, axis=1) for r in made.residuals(made.start)])


def test_two_commands_and_a_verdict(files):
    ran = robocal("identify", files / "robot.yaml", files / "calibration.yaml", "-o", files / "run", "--json")
    assert ran.status == 0 and ran.document["verdict"]["status"] == "located"
    assert not [r for r in ran.document["remarks"] if r["code"] in ("pixel-size", "phantom-exchanged")]
    far = distances(files)
    print(
        f"validation: mean {far.mean() * 1e3:.3f} mm, rms {np.sqrt((far**2).mean()) * 1e3:.3f} mm of {len(far)} points"
    )
    assert len(far) == 927 and far.mean() <= BOUND < ITS_OWN_TOOL


def test_a_phantom_without_its_prior_is_worse_and_warned_of(files):
    free = distances(files, "free: true")
    assert free.mean() > 1.05 * max(BOUND, distances(files).mean())
    text = (files / "other.yaml").read_text()
    assert "free: true" not in text  # the last call wrote the file with its prior
    distances(files, "free: true")
    ran = robocal("identify", files / "robot.yaml", files / "other.yaml", "--json")
    assert ran.status == 3 and ran.document["verdict"]["status"] == "refused"
    assert "the hand hardly turns" in " ".join(ran.document["verdict"]["reasons"])


def test_validation_takes_the_image_plane_of_the_run(files):
    """Nothing is fitted to validation images: the error is that of the calibration."""
    robocal("identify", files / "robot.yaml", files / "calibration.yaml", "-o", files / "again")
    ran = robocal("validate", files / "again", files / "validation.yaml", "--json")
    assert ran.status == 0 and ran.document["profiled"] == []
    mean = (
        ran.document["errors"]["position"]["mean"]
        if "position" in ran.document["errors"]
        else ran.document["errors"]["this"]["mean"]
    )
    assert mean == pytest.approx(distances(files).mean() * 1e3, rel=1e-4)
