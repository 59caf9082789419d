"""Where an improvement holds, from the command line: the range that is named, and what the exit status says of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal

from robocal.files.robot import open_robot, read_robot
from robocal.measure.data import Configurations, DataSet
from robocal.session.arm import OpenedArm
from robocal.verbs.identify.result import working_range

RANGES = "robocal: 1\nkind: region\nunits: {length: mm, angle: deg}\njoints: {j1: [-20, 20], j2: [0, 30]}\n"
POSES = "j1 [deg],j2 [deg],j3 [deg]\n0,10,20\n10,20,30\n"


def ends(*words: str) -> tuple[int, str, str]:
    """Exit status, region, and the name of the working range."""
    ran = robocal("identify", "robot.yaml", "data.yaml", "--json", *words)
    return ran.status, ran.document["verdict"]["region"], ran.document["working_range"]["name"]


def test_limits_that_somebody_wrote_are_the_working_range(case: Path) -> None:
    assert ends() == (0, "working", "joint limits")
    text = Path("robot.yaml").read_text()
    Path("robot.yaml").write_text(
        "\n".join(line.split(", limits")[0] + "}" if "limits" in line else line for line in text.split("\n"))
    )
    assert ends() == (0, "working", "range that the measured joints span")


@pytest.mark.parametrize(("name", "text"), [("near.yaml", RANGES), ("near.csv", POSES)])
def test_a_region_in_a_file(case: Path, name: str, text: str) -> None:
    Path(name).write_text(text)
    status, region, words = ends("--region", name)
    assert (status, region, words) == (0, "working", f"region of {name}")
    ran = robocal("identify", "robot.yaml", "data.yaml", "--json", "--region", name).document
    assert ran["working_range"]["n"] == (2 if name.endswith("csv") else 500)
    assert [Path(i["file"]).name for i in ran["provenance"]["inputs"]][-1] == name


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (RANGES.replace("j2", "jj2"), "no joint has this name"),
        (RANGES.replace("[0, 30]", "[30, 0]"), "wrong order"),
        (RANGES.replace("[0, 30]", "30"), "not a range"),
        (RANGES.replace("units: {length: mm, angle: deg}\n", ""), "units"),
    ],
)
def test_a_wrong_region_is_named_and_nothing_written(case: Path, text: str, words: str) -> None:
    Path("wrong.yaml").write_text(text)
    ran = robocal("identify", "robot.yaml", "data.yaml", "--region", "wrong.yaml", "-o", "run")
    assert ran.status == 2 and words in ran.err and not Path("run").exists()
    assert robocal("identify", "robot.yaml", "data.yaml", "--region", "absent.csv").status == 2


def test_measured_near_one_place_is_no_license_for_all(case: Path) -> None:
    """An arm that is hardly off, measured in a corner: status 3, unless the corner is all that was wanted."""
    Path("corner.csv").write_text(
        "j1 [deg],j2 [deg],j3 [deg]\n"
        + "\n".join(f"{a},{b},{c}" for a, b, c in np.random.default_rng(0).uniform(0, 25, (40, 3)))
    )
    words = ("--noise", "0.02", "--length-error", "0.3", "--angle-error", "0.02", "--at", "corner.csv", "--force")
    assert robocal("simulate", "robot.yaml", *words, "-o", "sim").status == 0
    before = robocal("identify", "sim/robot.yaml", "sim/data.yaml", "--json")
    assert before.document["verdict"]["status"] == "improved"
    assert (before.status, before.document["verdict"]["region"]) == (3, "measured")
    assert before.document["verdict"]["remarks"][-1]["code"] == "holds-where-measured"
    after = robocal("identify", "sim/robot.yaml", "sim/data.yaml", "--json", "--region", "measured")
    assert (after.status, after.document["verdict"]["region"]) == (0, "measured")
    shown = robocal("identify", "sim/robot.yaml", "sim/data.yaml")
    assert shown.status == 3 and "IMPROVED WHERE MEASURED" in shown.out


def test_a_catalogue_and_a_urdf_bring_the_makers_limits(tmp_path: Path) -> None:
    nothing = DataSet(Configurations(("a", "b"), np.zeros((2, 5))), ())
    robot = open_robot("rv-2aj")
    assert working_range(OpenedArm(robot), nothing, None) == (None, ())
    (tmp_path / "robot.yaml").write_text(robot.text)
    assert working_range(OpenedArm(read_robot(tmp_path / "robot.yaml")), nothing, None)[0] is None
    (tmp_path / "robot.yaml").write_text(robot.text.replace("[-150, 150]", "[-90, 90]"))
    region, _ = working_range(OpenedArm(read_robot(tmp_path / "robot.yaml")), nothing, None)
    assert region is not None and np.abs(np.degrees(region.joints[:, 0])).max() <= 90
