"""Four cables from files: lengths, swivel angles and inclinations, tied by the ids of their rows; nothing measures a pose."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cables.four import LENGTH, SWIVEL, TILT, measured, robots
from cli.runs import robocal
from cli.test_cable_identify import LENGTHS, table

from robocal.files.cable.write import describe_cable

TURNED = """robocal: 1
kind: swivel
file: swivel.csv
swivel: {columns: [s1, s2, s3, s4], unit: deg, sigma: 0.1}
configuration: {id: id}
"""
LEVEL = """robocal: 1
kind: inclination
file: tilt.csv
inclination: {columns: [tilt_x, tilt_y], unit: deg, sigma: 0.05}
configuration: {id: id}
"""
FILES = ("robot.yaml", "lengths.yaml", "swivel.yaml", "tilt.yaml")


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    folder = tmp_path_factory.mktemp("four")
    rng = np.random.default_rng(7)
    truth, nominal = robots(rng, 0.02)
    data, _ = measured(truth, rng, 60)
    length, turned, tilt = data.observations
    ids = data.configurations.ids
    (folder / "robot.yaml").write_text(describe_cable(nominal))
    (folder / "lengths.csv").write_text(
        table([f"c{i} [mm]" for i in range(1, 5)], ids, 1e3 * length.value.reshape(-1, 4))
    )
    (folder / "swivel.csv").write_text(
        table([f"s{i}" for i in range(1, 5)], ids, np.degrees(turned.value.reshape(-1, 4)))
    )
    (folder / "tilt.csv").write_text(table(["tilt_x", "tilt_y"], ids, np.degrees(tilt.value)))
    (folder / "lengths.yaml").write_text(
        LENGTHS.replace("COLUMNS", "c1, c2, c3, c4").replace("sigma: 1", f"sigma: {1e3 * LENGTH}")
    )
    (folder / "swivel.yaml").write_text(TURNED)
    (folder / "tilt.yaml").write_text(LEVEL)
    assert np.isclose(np.degrees([SWIVEL, TILT]), [0.1, 0.05]).all()
    return folder


def test_four_cables_are_identified_without_a_camera(cell):
    ran = robocal("identify", *(cell / f for f in FILES), "-o", cell / "run", "--json")
    assert ran.status == 0, ran.remarks
    found = json.loads(ran.out)
    assert found["verdict"]["status"] == "improved"
    assert "the base along x, the base along y, the base along z, the base about z" in ran.remarks
    # The whole result is told on the page and can be used again.
    again = robocal("check", cell / "run", *(cell / f for f in FILES[1:]), "--json")
    assert again.status == 0, again.remarks
    assert (cell / "run" / "report.html").exists()


def test_lengths_alone_of_four_cables_tell_nothing(cell):
    ran = robocal("identify", cell / "robot.yaml", cell / "lengths.yaml", "--json")
    assert ran.status == 3 and json.loads(ran.out)["verdict"]["status"] != "improved"


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("swivel", ("s4]", "s3]"), "twice"),
        ("swivel", ("s1, ", ""), "not the cables of the robot"),
        ("swivel", ("columns: [s1, s2, s3, s4], ", ""), "swivel.columns"),
        ("swivel", ("unit: deg", "unit: mm"), "another quantity"),
        ("tilt", ("tilt_y]", "tilt_x, tilt_y]"), "inclination.columns"),
        ("tilt", ("unit: deg", "unit: rad"), "beyond a quarter turn"),
        ("tilt", ("kind: inclination", "kind: inclinations"), "unknown kind"),
    ],
)
def test_what_cannot_be_meant_is_refused(cell, tmp_path, name, change, words):
    text = (cell / f"{name}.yaml").read_text()
    assert change[0] in text
    (cell / "wrong.yaml").write_text(text.replace(*change))
    others = [f for f in FILES[1:] if f != f"{name}.yaml"]
    ran = robocal(
        "identify", cell / "robot.yaml", *(cell / f for f in others), cell / "wrong.yaml", "-o", tmp_path / "run"
    )
    assert ran.status == 2 and words in ran.remarks and not (tmp_path / "run").exists(), ran.remarks


def test_a_zero_that_is_known_holds_the_base(cell):
    """Encoders that count from the base's x tell how the base lies about plumb."""
    (cell / "known.yaml").write_text(TURNED + "zero: {value: 0, unit: deg, free: false}\n")
    ran = robocal(
        "identify", cell / "robot.yaml", cell / "lengths.yaml", cell / "known.yaml", cell / "tilt.yaml", "--json"
    )
    # These encoders do not: their zeros are far elsewhere, and what they are said to be is not believed.
    assert ran.status == 3 and json.loads(ran.out)["verdict"]["status"] != "improved"
