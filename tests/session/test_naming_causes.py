"""Every cause of a misfit is named with its line; with the line obeyed, the robot is improved."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from causes import CAUSES, PAIRS, Setting, obey, obey_both
from cli.runs import robocal

from robocal.arms import catalog

QUICK = ("shared", "dh_as_mdh", "urdf_angles", "by_columns", "rows_off")


def named(case, message: str) -> str:
    assert re.search(case.words, message), message
    return message


# obeys: one-change-explains
# obeys: rows-of-another-robot
# obeys: rows-of-two-robots
# obeys: rows-off
@pytest.mark.parametrize(
    ("name", "arm"),
    [
        pytest.param(name, arm, marks=() if name in QUICK and arm == "irb-120" else pytest.mark.slow)
        for name in CAUSES
        for arm in ("irb-120", "panda")
    ],
)
def test_a_cause_is_named_and_its_line_helps(name: str, arm: str, tmp_path: Path) -> None:
    rng = np.random.default_rng([list(CAUSES).index(name), 4])
    case = CAUSES[name](tmp_path, arm, rng, Setting(bool(rng.integers(2))))
    ran = robocal("identify", case.robot, case.data)
    assert ran.status == 2, ran.out
    robot, data, more = obey(case, named(case, " ".join(ran.err.split())))
    ran = robocal("identify", robot, data, *more, "--json")
    assert ran.status == 0, (ran.out, ran.err)
    assert ran.document["verdict"]["status"] == "improved"


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name == "unit_and_signs" else pytest.mark.slow)
        for name in ("unit_and_signs", "angles_and_signs", "shared_and_unit", "late_and_unit", "convention_and_unit")
    ],
)
def test_two_causes_are_named_and_their_lines_help(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng([list(PAIRS).index(name), 2])
    case = PAIRS[name](tmp_path, "irb-120", rng, Setting(bool(rng.integers(2))))
    ran = robocal("identify", case.robot, case.data)
    assert ran.status == 2, ran.out
    robot, data, more = obey_both(case, named(case, " ".join(ran.err.split())))
    ran = robocal("identify", robot, data, *more, "--json")
    assert ran.status == 0, (ran.out, ran.err)
    assert ran.document["verdict"]["status"] == "improved"


@pytest.mark.parametrize("arm", ["irb-120", "ur10"])
@pytest.mark.parametrize("count", [10, 12])
def test_gross_rows_are_no_other_robot(tmp_path, arm, count):
    """Ten and twelve of sixty rows that are 0.3 m off are gross rows: `check` names no cause."""
    rng = np.random.default_rng(count)
    chain = catalog.get(arm)
    q = rng.uniform(-1.2, 1.2, (60, len(chain.joints)))
    p = chain.pose(q)[:, :3, 3] + 1e-4 * rng.normal(size=(60, 3))
    p[rng.permutation(60)[:count]] += 0.3 * rng.normal(size=(count, 3))
    head = ",".join([*(f"j{i + 1} [rad]" for i in range(q.shape[1])), "x [m]", "y [m]", "z [m]"])
    (tmp_path / "data.csv").write_text(
        "\n".join([head, *(",".join(map(repr, map(float, r))) for r in np.hstack([q, p]))])
    )
    assert robocal("check", arm, tmp_path / "data.csv").status == 0
