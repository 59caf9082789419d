"""robocal cable require: what it writes agrees with itself and with the error model, and what is refused."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from cables.cable_robots import poses, published
from cli.runs import files, robocal
from listings import rows_of

from robocal.cables.calibration.propagation import ErrorPropagation, Noise, Requirement
from robocal.geometry import se3

LAVAL = Path(__file__).parents[2] / "examples" / "cable-laval" / "robot.yaml"
NOISES = ("--sigma", "3mm", "--sigma-position", "2mm", "--sigma-orientation", "1deg")


def listed(place, n=60, seed=0, robot=None):
    """A list of poses as CSV, and the poses."""
    t = poses(robot or published("laval"), np.random.default_rng(seed), n)
    rows = se3.to_vector(t) * ([1e3] * 3 + [180 / np.pi] * 3)
    head = "id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]"
    body = "\n".join(f"p{i}," + ",".join(f"{v:.12g}" for v in row) for i, row in enumerate(rows))
    place.write_text(f"{head}\n{body}\n")
    return t


def test_the_document_is_the_error_model(tmp_path):
    t = listed(tmp_path / "poses.csv")
    out = tmp_path / "out"
    ran = robocal("cable", "require", LAVAL, tmp_path / "poses.csv", *NOISES, "--accuracy", "20mm", "-o", out, "--json")
    assert ran.status == 0 and files(out) == {"require.json", "contours.csv", "report.html"}
    found = json.loads((out / "require.json").read_text())
    assert {k: v for k, v in ran.document.items() if k not in ("written", "provenance")} == {
        k: v for k, v in found.items() if k != "provenance"
    }
    robot = published("laval")
    known = Requirement(ErrorPropagation(robot, t), Noise(3e-3, 2e-3, np.deg2rad(1.0)))
    assert found["poses"] == 60 and found["estimator"] == "maximum-likelihood"
    said = found["expected"]["maximum-likelihood"]
    assert [said["anchors"]["value"], said["position"]["value"]] == pytest.approx(
        [known.rms_errors.anchors, known.rms_errors.position], rel=1e-6
    )
    sigma = np.array([[c[k] for k in ("ax", "ay", "az", "l0")] for c in rows_of(found["sigma"])])
    assert np.sqrt((sigma[:, :3] ** 2).mean()) == pytest.approx(said["anchors"]["value"], rel=1e-9)
    needed = found["accuracy"]
    assert needed["reached"] and needed["scale"] == pytest.approx(0.02 / known.rms_errors.anchors, rel=1e-6)
    for level, one, a, two, b in list(csv.reader(io.StringIO((out / "contours.csv").read_text())))[1::40]:
        noise = Noise(**{one: float(a), two: float(b)})
        got = Requirement(ErrorPropagation(robot, t), noise, "per-cable").rms_errors.anchors
        assert got == pytest.approx(float(level), rel=1e-6)


def test_what_is_not_reached_has_status_3_and_says_what_would(tmp_path):
    listed(tmp_path / "poses.csv")
    ran = robocal("cable", "require", LAVAL, tmp_path / "poses.csv", *NOISES, "--accuracy", "1mm")
    assert ran.status == 3
    text = " ".join(ran.out.split())
    assert "is not reached" in text and "poses like these" in text and "alone cannot" in text
    again = robocal(
        "cable", "require", LAVAL, tmp_path / "poses.csv", *NOISES, "--of", "orientation", "--accuracy", "1deg"
    )
    assert again.status == 0 and "1.000 deg rms of the platform's orientation afterwards" in " ".join(again.out.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--sigma", "3"), "with its unit"),
        (("--sigma", "3deg"), "--sigma"),
        (("--accuracy", "5deg"), "--accuracy"),
        (("--of", "anchor"), "unknown option"),
        (("--estimator", "least-squares"), "unknown option"),
    ],
)
def test_bad_words_are_named(tmp_path, words, said):
    listed(tmp_path / "poses.csv")
    ran = robocal("cable", "require", LAVAL, tmp_path / "poses.csv", *words, "-o", tmp_path / "out")
    assert ran.status == 2 and said in ran.err and not (tmp_path / "out").exists()


def test_lists_that_cannot_tell_are_refused(tmp_path):
    place = tmp_path / "poses.csv"
    listed(place, 3)
    ran = robocal("cable", "require", LAVAL, place)
    assert ran.status == 2 and "too few poses" in ran.err and "poses.csv" in ran.err
    head = "id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]\n"
    place.write_text(head + "".join(f"p{i},0,0,1800,0,0,0\n" for i in range(12)))
    ran = robocal("cable", "require", LAVAL, place)
    assert ran.status == 2 and "do not tell an anchor and a zero" in ran.err and "c1" in ran.err
