"""Torques and speeds of an arm's joints in units that are not theirs."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cli.runs import robocal
from session.test_joint_torques import arm, write  # noqa: F401

from robocal.diagnose.limits import ARM_DENSITY
from robocal.geometry.gravity import GRAVITY
from robocal.measure.reach import size_of
from robocal.session.inputs import open_machine


def scaled(folder, start, factor):
    """The columns of that name times a factor."""
    path = folder / "run.csv"
    heads = path.read_text().splitlines()[0].split(",")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    table[:, [h.startswith(start) for h in heads]] *= factor
    np.savetxt(path, table, delimiter=",", header=",".join(heads), comments="", fmt="%.9g")


# obeys: torque-size
@pytest.mark.parametrize("sigma", [", sigma: 0.1", ""])
@pytest.mark.parametrize(("factor", "wrong", "right"), [(1e3, "Nm", "Nmm"), (1.0, "Nmm", "Nm")])
def test_newton_millimetres_for_newton_metres_are_refused(tmp_path, arm, factor, wrong, right, sigma):  # noqa: F811
    _, data = write(tmp_path, arm)
    scaled(tmp_path, "torque.", factor)
    text = (tmp_path / "torque.yaml").read_text().replace(", sigma: 0.1", sigma.replace("0.1", f"{0.1 * factor}"))

    def ran(unit):
        (tmp_path / "torque.yaml").write_text(
            text.replace("unit: Nm,", f"unit: {unit},").replace("unit: Nm}", f"unit: {unit}}}")
        )
        return robocal("identify", "rv-2aj", data)

    told = ran(wrong)
    assert told.status == 2 and "torque.unit" in told.err and "no arm of this reach is so" in told.err
    assert ran(right).status == 0


# obeys: torque-speed
def test_degrees_that_are_read_as_radians_are_no_slow_motion(tmp_path, arm):  # noqa: F811
    _, data = write(tmp_path, arm)
    text = (tmp_path / "torque.yaml").read_text()

    def remarks():
        return {r["code"] for r in json.loads(robocal("identify", "rv-2aj", data, "--json").out)["remarks"]}

    assert "torque-speed" not in remarks()
    (tmp_path / "torque.yaml").write_text(text.replace("deg/s", "rad/s"))
    assert "torque-speed" in remarks()


# Mass and where the shoulder bears most, from data sheets: kg, and the share of it that counts at the reach.
SHEETS = {"rv-2aj": 17.0, "ur10": 28.9, "panda": 18.0, "iiwa-14": 29.9, "irb-120": 25.0}


@pytest.mark.parametrize("name", SHEETS)
def test_arms_of_data_sheets_lie_between_and_a_thousandfold_does_not(name):
    reach, g = size_of(open_machine(name).machine), float(np.linalg.norm(GRAVITY))
    for share in (0.15, 0.5):  # of the mass, at the end of the reach
        density = SHEETS[name] * share * g * reach / (g * reach**4)
        assert ARM_DENSITY["light"] < density < ARM_DENSITY["heavy"]
        assert density * 1e3 > ARM_DENSITY["heavy"] and density / 1e3 < ARM_DENSITY["light"]
