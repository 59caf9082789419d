"""Drift of machines that robocal has never heard of: a turntable with places, and a motor that has nothing but a table."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from prove import machines as made

from robocal.apply.drift import compare, compare_models
from robocal.apply.truth import CHANCE, compare_truth
from robocal.estimate.uncertainty import Total
from robocal.parameters import Parameter, ParameterTable
from robocal.prove.identify import identify


@dataclass(frozen=True)
class Motor:
    """A model without places: a torque constant, friction, and what its cogging is."""

    table: ParameterTable
    name: str = "motor"


MOTOR = Motor(
    ParameterTable((
        Parameter("motor.kt", 0.561, "N m/A", True, expected=0.01), Parameter("motor.friction", 0.02, "N m", True, expected=0.01),
        Parameter("cogging.sine", 0.0, "N m", True, expected=0.02), Parameter("cogging.cosine", 0.0, "N m", True, expected=0.02),
    ))
)  # fmt: skip
ROOT = np.array([[2e-4, 0, 0, 0], [1e-4, 3e-4, 0, 0], [0, 0, 4e-4, 0], [0, 0, 2e-4, 4e-4]])
KNOWN = Total(MOTOR.table.names, ROOT @ ROOT.T, np.zeros((4, 4)), np.array([p.expected for p in MOTOR.table.rows]))


def estimated(truth, rng):
    """A calibration: the truth with noise of the covariance."""
    return replace(truth, table=truth.table.with_values(truth.table.values + ROOT @ rng.normal(size=4)))


def test_a_motor_that_did_not_change_is_seldom_called_so_and_a_change_is_named():
    rng = np.random.default_rng(0)
    worn = replace(MOTOR, table=MOTOR.table.with_values({"motor.friction": 0.026}))
    chances, drifted, named, alone = [], 0, 0, 0
    for _ in range(400):
        first, again, later = estimated(MOTOR, rng), estimated(MOTOR, rng), estimated(worn, rng)
        chances.append(compare_models(first, again, (KNOWN, KNOWN)).p_value)
        found = compare_models(first, later, (KNOWN, KNOWN))
        drifted += found.status == "drifted"
        named += min(found.changes, key=lambda c: c.p_of_all).name == "motor.friction"
        alone += found.singles[0].name == "motor.friction"
        assert found.rank == 4 and found.singles[0].change == pytest.approx(6e-3, abs=2.5e-3)
    assert np.mean(np.array(chances) < 0.05) == pytest.approx(0.05, abs=4 * np.sqrt(0.05 * 0.95 / 400))
    assert drifted > 0.98 * 400 and named > 0.98 * 400 and alone > 0.98 * 400


def test_the_truth_of_a_motor_is_a_calibration_without_an_error():
    rng = np.random.default_rng(1)
    first = estimated(MOTOR, rng)
    exact = replace(KNOWN, noise=np.zeros((4, 4)), response=np.zeros((4, 4)))
    both = compare_models(MOTOR, first, (exact, KNOWN))
    alone = compare_truth(first.table, MOTOR.table, KNOWN, MOTOR.table.names)
    assert both.statistic * both.rank == pytest.approx(alone.total.chi2) and both.p_value > CHANCE
    assert [c.sigma for c in both.changes] == pytest.approx([p.sigma for p in alone.parameters])
    assert [g.group for g in alone.groups] == ["all", "N m/A", "N m", "motor", "cogging"]
    off = MOTOR.table.with_values({"cogging.sine": 10 * alone.parameters[2].sigma})
    assert compare_truth(first.table, off, KNOWN, MOTOR.table.names).named == ("cogging.sine",)


def calibrated(robot, truth, data, rng):
    """An identification of the turntable from fresh measurements."""
    return identify(robot, made.recorded(truth, data, rng, forget=False))


def test_a_turntable_whose_plate_slipped_is_told_in_millimetres():
    rng = np.random.default_rng(5)
    robot, truth, data = made.turntable(rng, 40)
    slipped = truth.with_values({"plate.x": truth.table["plate.x"].value + 1e-3})
    first, again, later = (calibrated(robot, t, data, rng) for t in (truth, truth, slipped))
    q = data.configurations.joints

    def compared(one, other):
        rows = (one.whitened_rows, other.whitened_rows)
        return compare(one.corrected, other.corrected, (one.total, other.total), q, {}, rows=rows, matters=3e-4)

    same, moved = compared(first, again), compared(first, later)
    assert same.status == "unchanged" and same.p_value > 1e-3
    assert moved.status == "drifted" and moved.singles[0].name == "plate.x"
    assert moved.singles[0].change == pytest.approx(1e-3, abs=2e-4)
    # Turned through all angles, a plate that sits 1 mm elsewhere is nearly as far off on average, the base placed best.
    assert moved.difference.change == pytest.approx(1e-3, rel=0.4) and moved.difference.n == 40
    found = compare_truth(first.corrected.table, truth.table, first.total, ("axis.gain", "plate.x", "plate.y"))
    assert not found.named and {g.group for g in found.groups} == {"all", "lengths", "ratios", "axis", "plate"}
