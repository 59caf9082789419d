"""A frame anchor that moved by 5 mm between two calibrations is named, and none is where nothing moved."""

from __future__ import annotations

import numpy as np
import pytest
from cables.cable_robots import published
from cables.precise import measured
from sizes import size

from robocal.apply.anchors import compare_anchors as compared
from robocal.apply.difference import Known
from robocal.cables.geometry import cable_robot
from robocal.prove.identify import identify

DRIFT = 5e-3


def known(nominal, robot, rng):
    found = identify(nominal, measured(robot, rng))
    kept = tuple(found.identifiability.basis)
    values = {p.name: p.identified for p in found.parameters}
    return Known(kept, np.array([values[n] for n in kept]), found.covariance)


@pytest.mark.slow
def test_five_millimetres_are_named():
    robot = published("laval")
    rng = np.random.default_rng(0)
    off = {n: robot.table[n].value + 0.01 * rng.normal() for n in robot.table.names if n[-2] == "a" or n.endswith("l0")}
    at_first = robot.with_values(off)
    nominal = cable_robot("laval", at_first.a, robot.b, at_first.zeros, free=("ax", "ay", "az", "l0"))
    draws = size(100, 8)
    right = quiet = 0
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        first, same = (known(nominal, robot, rng) for _ in range(2))
        cable, way = rng.integers(8), rng.normal(size=3)
        way *= DRIFT / np.linalg.norm(way)
        moved = robot.with_values({f"c{cable + 1}.a{s}": robot.a[cable][i] + way[i] for i, s in enumerate("xyz")})
        later = known(nominal, moved, rng)
        right += compared(robot, first, later, zeros_unchanged=True).cables_moved == (f"c{cable + 1}",)
        quiet += not compared(robot, first, same, zeros_unchanged=True).cables_moved
    print(f"{draws} draws: {right} named, {quiet} of those without a drift quiet")
    assert right >= 0.95 * draws and quiet >= 0.95 * draws - 1 * (draws < 20)
