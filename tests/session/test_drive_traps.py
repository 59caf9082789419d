"""Logs that look right and are not, and right logs that look odd: what strangers' files did to `drive`."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.drives.cogging import Cogging
from robocal.drives.order_names import guess_motor
from robocal.errors import FormatError
from robocal.files.drive_tables import compensation_table
from robocal.files.motor_file import read_motor
from robocal.remarks.code import Code
from robocal.verbs.drive import validate
from tests.session.test_drive_logs import HEAD, TRUTH, codes, found, log, rows


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("traps")


@pytest.fixture(scope="module")
def run(place):
    found(place, log(place), output=place / "run")
    return place / "run"


def test_a_drive_that_waits_before_and_after_is_no_worse(place):
    swept = rows()
    tick, many = swept[1, 0], 600
    wait = np.arange(many) * tick
    rng = np.random.default_rng(2)
    stand = [
        np.column_stack([wait, np.full(many, swept[i, 1]), 0.3 + 0.01 * rng.standard_normal(many)]) for i in (0, -1)
    ]
    swept[:, 0] += stand[0][-1, 0] + tick
    stand[1][:, 0] += swept[-1, 0] + tick
    path = log(place, "waits.csv", np.concatenate([stand[0], swept, stand[1]]))
    assert found(place, path, output=place / "waits").trusted
    angle = np.linspace(0, 6, 200)
    assert np.abs(read_motor(place / "waits").cogging.at(angle, 1.0) - TRUTH.at(angle, 1.0)).max() < 0.005


# obeys: drive-at-limit
def test_a_limit_of_the_drive_is_told(place):
    cut = rows()
    cut[:, 2] = np.clip(cut[:, 2], -0.15, 0.15)
    made = found(place, log(place, "cut.csv", cut))
    assert Code.DRIVE_AT_LIMIT in codes(made) and not made.trusted
    assert Code.DRIVE_AT_LIMIT not in codes(found(place, log(place)))
    steps = rows(noise=0.0)
    steps[:, 2] = np.round(steps[:, 2], 2)
    assert Code.DRIVE_AT_LIMIT not in codes(found(place, log(place, "steps.csv", steps)))


# obeys: drive-pace
@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_a_wrong_unit_of_time_is_told(place, factor):
    other = rows() * [factor, 1, 1]
    made = found(place, log(place, "time.csv", other))
    assert Code.DRIVE_PACE in codes(made) and not made.trusted
    right = rows() * [1e3, 1, 1]
    assert Code.DRIVE_PACE not in codes(found(place, log(place, "ms.csv", right, HEAD.replace("[s]", "[ms]"))))


# obeys: drive-other-gain
def test_a_wrong_unit_of_effort_does_not_validate(place, run):
    said = lambda made: {r.code for r in made.result.reasons}  # noqa: E731
    other = rows() * [1, 1, 1e3]
    wrong = validate.run(validate.Options(motor=run, log=log(place, "milli.csv", other)))
    assert said(wrong) == {Code.DRIVE_OTHER_GAIN}
    right = log(place, "mA.csv", other, HEAD.replace("[A]", "[mA]"))
    assert not said(validate.run(validate.Options(motor=run, log=right)))


def test_a_small_move_of_the_zero_is_no_other_motor(place, run):
    quick = Cogging((7, 12, 84), (0.05, 0.04, 0.2), (0.0, 0.0, 0.1), 0.0)
    made = found(place, log(place, "quick.csv", rows(quick, count=4000)), output=place / "quick")
    assert made.trusted
    moved = rows(quick, count=4000) + [0, np.radians(2.0), 0]
    checked = validate.run(validate.Options(motor=place / "quick", log=log(place, "moved.csv", moved)))
    assert {r.code for r in checked.result.reasons} == {Code.DRIVE_OTHER_ZERO}


def test_twice_per_pole_pair_is_not_taken_for_once():
    amplitudes = np.array([0.3, 0.12, 0.08, 0.05])
    assert guess_motor((84, 14, 12, 7), amplitudes) == (12, 14)
    assert guess_motor((72, 18, 12), amplitudes[:3]) == (18, 24)


def test_slots_and_poles_of_another_motor_are_told(place):
    made = found(
        place, log(place, "own.csv", rows(Cogging((12, 14, 84), (0.08, 0.1, 0.3), (0, 0, 0), 0.0), count=4000))
    )
    assert Code.DRIVE_SLOTS_UNLIKE not in codes(made)
    path = place / "own.csv"
    assert Code.DRIVE_SLOTS_UNLIKE in codes(found(place, path, slots=9, poles=8))
    assert Code.DRIVE_SLOTS_UNLIKE not in codes(found(place, path, slots=12, poles=14))


def test_cells_too_few_for_the_curve_are_refused(run):
    motor = read_motor(run)
    with pytest.raises(FormatError) as told:
        compensation_table(motor, "csv", 36, None, False, None)
    assert told.value.key == "--cells" and told.value.expected == "at least 192"
    assert compensation_table(motor, "csv", 192, None, False, None).values.shape == (2, 192)


def test_a_sign_for_degrees_is_the_unit_deg(place):
    path = log(place, "sign.csv", rows() * [1, 180 / np.pi, 1], "Zeit [s],Winkel [°],Strom [A]")
    assert found(place, path, columns=("time=Zeit:s", "angle=Winkel:deg", "current=Strom:A")).trusted


def test_counts_called_turns_are_counts(place):
    values = rows(count=3000)
    values[:, 1] = np.round(values[:, 1] / (2 * np.pi) * 4096)
    with pytest.raises(FormatError, match="counts"):
        found(place, log(place, "counted.csv", values, HEAD.replace("rad", "turn")))


# obeys: drive-orders-unseen
def test_orders_that_appear_as_lower_ones_are_not_improved(place):
    quick = Cogging((84,), (0.2,), (0.0,), 0.0)
    few = log(place, "few-angles.csv", rows(quick, turns=2.0, count=241))
    assert not found(place, few).trusted  # 120 angles of a turn: order 84 looks like 36
    assert not found(place, few, slots=12, poles=14).trusted
    made = found(place, log(place, "many-angles.csv", rows(quick, turns=2.0, count=2401)), slots=12, poles=14)
    assert made.trusted and Code.DRIVE_ORDERS_UNSEEN not in codes(made) | {r.code for r in made.result.reasons}
    low = log(place, "low.csv", rows(Cogging((12,), (0.2,), (0.0,), 0.0), turns=2.0, count=241))
    assert found(place, low, slots=6, poles=4).trusted
