"""A run of a URDF: the folder knows the tool that the file cannot hold, and every verb says or uses it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli.runs import robocal

URDF = """<robot name="four"><link name="b"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="l4"/>
<joint name="s1" type="revolute"><parent link="b"/><child link="l1"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
<limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint>
<joint name="s2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.04 0 0"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
<joint name="s3" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="0.25 0 0" rpy="0.3 0 0"/>
<axis xyz="0 1 0"/><limit lower="-1.9" upper="2" effort="1" velocity="1"/></joint>
<joint name="s4" type="revolute"><parent link="l3"/><child link="l4"/><origin xyz="0.2 0 0" rpy="0 0.2 0"/>
<axis xyz="1 0 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A URDF, two sets of data of one true arm whose target sits at 120 mm, and the run of the first."""
    folder = tmp_path_factory.mktemp("urdf")
    (folder / "u.urdf").write_text(URDF, encoding="utf-8")
    assert robocal("export", folder / "u.urdf", "-o", folder / "u.yaml").status == 0
    ran = robocal(
        "simulate", folder / "u.yaml", "-n", 60, "--set", "tool.x=0.12", "--set", "tool.z=0.03", "-o", folder / "one"
    )
    assert ran.status == 0, ran.err
    still = ("--length-error", 0, "--angle-error", 0, "--seed", 5)
    ran = robocal("simulate", folder / "one" / "truth.yaml", "-n", 60, *still, "-o", folder / "two")
    assert ran.status == 0, ran.err
    return folder


# obeys: urdf-lacks
# obeys: urdf-cannot-hold
def test_the_folder_is_the_identified_robot(place: Path) -> None:
    ran = robocal("identify", place / "u.urdf", place / "one" / "data.yaml", "-o", place / "run")
    assert ran.status == 0, ran.out + ran.err
    said = " ".join(ran.out.split())
    assert "calibrated.urdf does not hold tool.x" in said and "cannot hold the fitted tool.x" in said
    result = json.loads((place / "run" / "result.json").read_text(encoding="utf-8"))
    assert any("cannot hold the fitted tool.x" in w for w in result["warnings"])
    seen = result["residuals"]["held_out"]["mean"]
    against = ("--against", place / "u.urdf", "--json")
    found = robocal("validate", place / "run", place / "two" / "data.yaml", *against)
    assert found.status == 0, found.err
    errors = found.document["errors"]
    assert errors["this"]["mean"] < 1.6 * seen
    # Both are judged alike: the free tool is fitted to either, and 120 mm of tool are no gain of ours.
    for robot in ("profiled", "profiled_against"):
        assert any(n.startswith("tool.") for n in found.document[robot])
    assert errors["this"]["profiled"] and errors["against"]["profiled"]
    assert 0.3 < errors["against"]["mean"] / result["residuals"]["before"]["mean"] < 3
    # By itself the file is another robot, and that is said.
    alone = robocal("validate", place / "run" / "calibrated.urdf", place / "two" / "data.yaml")
    assert "does not hold the fitted tool.x" in " ".join(alone.out.split())
    made = robocal("export", place / "run", "--format", "yaml").out
    assert "tool: {xyz: [0.1" in made
    assert "cannot hold the fitted" in robocal("export", place / "run", "--format", "urdf").err
    assert robocal("check", place / "run", place / "two" / "data.yaml").status == 0
    simulated = robocal("simulate", place / "run", "-n", 5, "-o", place / "again")
    assert simulated.status == 0, simulated.err
    assert "tool: {xyz: [0.1" in (place / "again" / "truth.yaml").read_text(encoding="utf-8")
    # Zero errors of the joints sit in the origins of a URDF; the run has fitted them by themselves as well.
    ran = robocal("export", place / "run", "--format", "ros")
    assert ran.status == 0 and "offsets only: " in ran.err, ran.err


def test_simulated_errors_are_the_same_in_every_unit(place: Path) -> None:
    in_metres = robocal("simulate", place / "u.urdf", "-o", place / "metres", "--json").document
    assert 0.1 < in_metres["largest_error"]["value"] < 5
    assert "noise 5e-05 m" in (place / "metres" / "data.csv").read_text(encoding="utf-8")
