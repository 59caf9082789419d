"""A number of a cable verb may name its unit: then the units of the robot's file say nothing of it."""

from __future__ import annotations

import pytest
from cli.runs import robocal

from robocal.errors import FormatError
from robocal.files.cable.cable_robot import read_cable
from robocal.verbs.cable import poses, workspace


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    home = tmp_path_factory.mktemp("units")
    assert robocal("new", "cable", "-o", home).status == 0
    return home / "robot.yaml"


LIST = ("-n", 20, "--choose", 15, "--json")


@pytest.mark.parametrize(
    ("plain", "named"),
    [
        (("--sigma", "0.5"), ("--sigma", "0.5mm")),
        (("--sigma", "0.5"), ("--sigma", "500 um")),
        (("--sigma", "0.5", "--pose-noise", "0.2,0.05"), ("--sigma", "5e-4m", "--pose-noise", "200um,3arcmin")),
        (("--turn", "15", "--limits", "20,600"), ("--turn", "15deg", "--limits", "20N,0.6kN")),
        (("--payload", "0.5", "--start", "0,0,1400"), ("--payload", "500g", "--start", "0,0,1.4m")),
    ],
)
def test_the_same_number_in_another_unit_is_the_same(plain, named, robot):
    one, other = (robocal("cable", "poses", robot, *LIST, *words) for words in (plain, named))
    first, second = one.document, other.document
    assert one.status == other.status == 0
    assert _close(first, second)


def _close(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(_close(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(_close, a, b))
    return a == pytest.approx(b, rel=1e-9, abs=1e-9) if isinstance(a, float) else a == b


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--sigma", "0.5kg"), "a length is needed; found 'kg'"),
        (("--sigma", "0.5mmm"), "unknown unit; found 'mmm'"),
        (("--sigma=-1mm",), "found -1mm; expected above 0"),
        (("--sigma", "mm"), "'mm' is not a number"),
        (("--pose-noise", "0.2mm"), "expected POSITION,ORIENTATION"),
        (("--pose-noise", "0.2deg,0.2"), "a length is needed; found 'deg'"),
        (("--limits", "20N,600mm"), "a force is needed; found 'mm'"),
        (("--start", "0,0,1.4kg"), "a length is needed; found 'kg'"),
        (("--mass", "inf"), "a finite number"),
    ],
)
def test_another_quantity_is_named(words, said, robot):
    ran = robocal("cable", "poses", robot, *LIST[:-1], *words)
    assert ran.status == 2 and said in ran.remarks and words[0].partition("=")[0] in ran.remarks, ran.remarks


def test_what_was_typed_is_what_is_found(robot):
    made = poses.Options(robot=str(robot), wanted=5, sigma="0.5 mm")
    assert f"{made.sigma}" == "0.5 mm"
    assert made.si(read_cable(robot).units).sigma == pytest.approx(5e-4, rel=1e-15)
    with pytest.raises(FormatError, match="unit is of another quantity"):
        workspace.Options(robot=str(robot), reserve="1mm")
