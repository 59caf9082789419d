"""Files of joint offsets: what is written is read, in every form; what is wrong is one clear error."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cli.runs import ROBOT, robocal, small

from robocal.errors import FormatError, InputError
from robocal.files.offset_file import OFFSETS, Offset, read_offsets
from robocal.files.robot import open_robot
from robocal.files.units import UNITS

NAMES = {"offsets": "offsets.csv", "ros": "offsets.yaml", "xacro": "offsets.xacro"}


@pytest.fixture
def robot(tmp_path: Path):
    (tmp_path / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    return open_robot(tmp_path / "robot.yaml").chain


@pytest.mark.parametrize("form", list(OFFSETS))
def test_what_is_written_is_read(form: str, robot, tmp_path: Path, rng: np.random.Generator) -> None:
    values = dict(zip(robot.joint_names, rng.normal(0, 0.01, 3), strict=True))
    lines = [Offset(n, v, 1e-4, UNITS["deg"]) for n, v in values.items()]
    path = tmp_path / NAMES[form]
    path.write_text(OFFSETS[form](lines, "three -- axes", ("a note -- with dashes",)), encoding="utf-8")
    found = read_offsets(path, robot)
    assert found.values == pytest.approx(values, abs=1e-15) and not found.missing
    path.write_text(OFFSETS[form](lines[:2], "some", ()), encoding="utf-8")
    assert read_offsets(path, robot).missing == ("j3",)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", "joint,offset,unit\nj9,1,deg\n", ("no such joint", "j9")),
        ("a.csv", "joint,offset,unit\nj1,1,mm\n", ("another quantity", "mm")),
        ("a.csv", "joint,offset,unit\nj1,1,deg\nj1,2,deg\n", ("twice", "j1")),
        ("a.csv", "joint,offset,unit\nj1,nan,deg\n", ("finite", "nan")),
        ("a.csv", "joint,offset\nj1,1\n", ("no such column", "unit")),
        ("a.csv", "x,y\n1,2\n", ("no such column", "joint")),
        ("a.yaml", "/**:\n  ros__parameters:\n    joint_offsets:\n      j1: true\n", ("not a finite number", "j1")),
        ("a.yaml", "/**:\n  ros__parameters:\n    other: 1\n", ("no joint offsets",)),
        ("a.yaml", "/**: 3\n", ("no joint offsets",)),
        ("a.xml", '<robot><xacro:property name="j1_offset" value="1_0"/></robot>', ("not a finite number", "1_0")),
        ("a.xml", '<robot><xacro:property name="j9_offset" value="1"/></robot>', ("no such joint", "j9")),
        ("a.xml", "<robot/>", ("no joint offsets",)),
        ("a.xml", "<robot>", ("not valid XML",)),
    ],
)
def test_what_is_wrong_is_one_error(name: str, text: str, words: tuple[str, ...], robot, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(FormatError) as error:
        read_offsets(tmp_path / name, robot)
    for word in words:
        assert word in str(error.value)


def test_a_header_may_carry_the_unit(robot, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("joint,offset [mrad]\nj1,2\n", encoding="utf-8")
    assert read_offsets(tmp_path / "a.csv", robot).values == pytest.approx({"j1": 2e-3})


def test_exported_offsets_are_judged_on_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the nominal robot, of the run folder, and with what the run printed; where nothing is proven, nothing is written."""
    monkeypatch.chdir(tmp_path)
    small(tmp_path)
    assert robocal("identify", "robot.yaml", "data.yaml", "-o", "run").status in (0, 3)
    ran = robocal("export", "run", "--format", "offsets", "-o", "offsets.csv", "--json")
    if ran.status == 2:
        assert "joint offsets" in ran.err and not Path("offsets.csv").exists()
        Path("offsets.csv").write_text("joint,offset,unit\nj1,0.1,deg\nj2,0,deg\nj3,0,deg\n", encoding="utf-8")
    else:
        assert ran.document["worth"]["code"] == "worth-alone"
    robocal("simulate", "robot.yaml", "-o", "other", "--seed", 5, "--poses", 40)
    for robot in ("robot.yaml", "run"):
        found = robocal("validate", robot, "other/data.yaml", "--offsets", "offsets.csv", "--json").document
        assert found["offsets"] == "offsets.csv" and found["errors"]["against"] is not None
    bad = robocal("validate", "robot.yaml", "other/data.yaml", "--offsets", "robot.yaml")
    bad.assert_refused("joint offsets")


def test_preferred_parameters_are_read(tmp_path: Path) -> None:
    text = ROBOT.replace("calibrate: {", "calibrate: {prefer: [j3.d, theta], ")
    (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
    table = open_robot(tmp_path / "robot.yaml").chain.table
    assert table["j3.d"].preference > table["j1.theta"].preference > table["j1.alpha"].preference
    assert table["j1.alpha"].preference > table["j1.beta"].preference
    (tmp_path / "robot.yaml").write_text(text.replace("theta]", "thet]"), encoding="utf-8")
    with pytest.raises(InputError, match="theta"):
        open_robot(tmp_path / "robot.yaml")
