"""Logs and runs that a hostile reader tried: each is told with its cause, and none gives a table that looks right."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.drives.cogging import Cogging
from robocal.errors import FileError, FormatError, InputError, ModelError
from robocal.remarks.code import Code
from robocal.verbs.drive import compensate, validate
from tests.session.test_drive_logs import HEAD, TRUTH, codes, found, log, rows


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("wrong")


@pytest.fixture(scope="module")
def run(place):
    assert found(place, log(place), output=place / "run").trusted
    return place / "run"


def reasons(run, path, **more):
    return {r.code: r for r in validate.run(validate.Options(motor=run, log=path, **more)).result.reasons}


# obeys: drive-effort-size
@pytest.mark.parametrize(("unit", "milli", "factor"), [("A", "mA", 1e3), ("Nm", "Nmm", 1e3), ("A", "mA", 1e-4)])
def test_an_effort_in_another_unit_is_told_by_its_size(place, unit, milli, factor):
    head = HEAD.replace("current [A]", "torque [Nm]" if unit == "Nm" else "current [A]")
    path = log(place, "size.csv", rows() * [1, 1, factor], head)
    made = found(place, path)
    assert not made.trusted and Code.DRIVE_EFFORT_SIZE in codes(made)
    if factor > 1:
        right = found(place, log(place, "right.csv", rows() * [1, 1, factor], head.replace(f"[{unit}]", f"[{milli}]")))
        assert right.trusted and Code.DRIVE_EFFORT_SIZE not in codes(right)
        assert Code.DRIVE_EFFORT_SIZE not in codes(found(place, path, loaded=True))


def test_an_angle_in_turns_called_rad_is_named(place, run):
    path = log(place, "turns.csv", rows() / [1, 2 * np.pi, 1])
    made = found(place, path)
    assert not made.trusted and Code.DRIVE_OTHER_READING in codes(made)
    assert "the angle in turn" in next(r for r in made.result.verdict.remarks).sentence
    assert "the angle in turn" in reasons(run, path)[Code.DRIVE_OTHER_READING].sentence


@pytest.mark.parametrize("what", ["deg", "exchanged"])
def test_a_log_in_another_unit_is_not_called_another_motor(place, run, what):
    values, head = rows(), HEAD
    if what == "deg":
        values = values * [1, 180 / np.pi, 1]
    else:
        head = "time [s],current [A],angle [rad]"
    assert set(reasons(run, log(place, "other.csv", values, head))) == {Code.DRIVE_OTHER_READING}


def test_half_the_curve_is_another_gain_and_another_phase_another_motor(place, run):
    assert set(reasons(run, log(place, "half.csv", rows() * [1, 1, 0.5]))) == {Code.DRIVE_OTHER_GAIN}
    same = Cogging(TRUTH.orders, (-0.06, 0.02, 0.02), (0.03, 0.0, 0.05), 0.003)
    assert set(reasons(run, log(place, "phase.csv", rows(same)))) == {Code.DRIVE_OTHER_MOTOR}


def test_what_a_short_log_does_not_show_is_told(place, run):
    made = validate.run(validate.Options(motor=run, log=log(place, "arc.csv", rows(turns=0.05)))).result
    assert Code.DRIVE_PART_COMPARED in {r.code for r in made.warnings} and not made.reasons
    assert Code.DRIVE_PACE in {
        r.code
        for r in validate.run(validate.Options(motor=run, log=log(place, "us.csv", rows() * [1e6, 1, 1]))).result.warnings
    }


def test_logs_of_one_call_that_contradict_each_other_are_told(place):
    path, other = log(place), rows()
    other[:, 2] += 0.002 * np.random.default_rng(5).standard_normal(len(other))
    for name, values, code in (
        ("gain.csv", other * [1, 1, 2], Code.DRIVE_OTHER_GAIN),
        ("zero.csv", other + [0, 0.3, 0], Code.DRIVE_OTHER_ZERO),
    ):
        made = found(place, path, log(place, name, values))
        assert not made.trusted and code in codes(made), name
    assert found(place, path, log(place, "again.csv", other)).trusted


def test_two_files_of_one_direction_each_are_one_motor(place):
    both = rows(turns=2.0)
    half = len(both) // 2
    made = found(place, log(place, "there.csv", both[:half]), log(place, "back.csv", both[half:]))
    assert made.trusted and Code.DRIVE_ONE_DIRECTION not in codes(made)
    assert made.result.motor_file.coulomb == pytest.approx(0.1, abs=1e-3)
    assert made.result.motor_file.cogging.lag == pytest.approx(TRUTH.lag, abs=5e-4)
    assert not found(place, place / "there.csv", place / "back.csv", method="seed").trusted  # its tables are of one log


def test_what_is_given_twice_is_refused(place):
    path = log(place)
    with pytest.raises(ModelError, match="two logs are the same"):
        found(place, path, path)
    with pytest.raises(FormatError, match="a sweep stands here twice"):
        found(place, log(place, "twice.csv", np.concatenate([rows(), rows()])))


# obeys: drive-one-unlike
def test_slots_or_poles_alone_are_heeded(place):
    path = log(place)
    assert Code.DRIVE_ONE_UNLIKE in codes(found(place, path, slots=9))
    for known in ({"slots": 6}, {"poles": 8}):
        made = found(place, path, **known)
        assert Code.DRIVE_ONE_UNLIKE not in codes(made)
        names = next(c for c in made.result.orders.columns if c.name == "name").values
        assert "slots" in list(names)
    unknown = log(place, "seven.csv", rows(Cogging((7, 14), (0.05, 0.03), (0.0, 0.01), 0.003)))
    made = found(place, unknown, poles=14)
    names = next(c for c in made.result.orders.columns if c.name == "name").values
    assert "once per pole pair: sensor zero, not torque" in list(names)


def test_a_gear_whose_orders_meet_the_common_multiple_is_told(place):
    geared = Cogging((16, 24, 96), TRUTH.cosine, TRUTH.sine, TRUTH.lag / 4)
    assert Code.DRIVE_GEAR in codes(found(place, log(place, "geared.csv", rows(geared, count=4000)), slots=6, poles=8))


# obeys: drive-run-unproven
@pytest.mark.parametrize("form", ["csv", "c", "array", "odrive"])
def test_a_table_of_a_run_that_was_not_improved_says_so(place, run, form):
    assert not found(place, log(place, "one.csv", rows(back=False)), output=place / "one", force=True).trusted

    def table(motor):
        more = {} if form != "odrive" else {"torque_constant": 0.5}
        return compensate.run(compensate.Options(motor=motor, format=form, **more))

    made = table(place / "one")
    assert not made.trusted and Code.DRIVE_RUN_UNPROVEN in {r.code for r in made.result.reasons}
    assert ("verdict of the run is not improved" in made.text) == (form != "array")
    assert table(run).trusted and "verdict" not in table(run).text
    checked = validate.run(validate.Options(motor=place / "one", log=log(place))).result
    assert Code.DRIVE_RUN_UNPROVEN in {r.code for r in checked.warnings}


def test_a_run_that_found_nothing_has_no_table(place):
    flat = rows(Cogging((), (), (), 0.0))
    assert not found(place, log(place, "flat.csv", flat), output=place / "flat").trusted
    with pytest.raises(ModelError, match="nothing to compensate"):
        compensate.run(compensate.Options(motor=place / "flat"))


@pytest.mark.parametrize(
    ("more", "key"), [({"cells": 100}, "--cells"), ({"friction": True}, "--friction"), ({"unit": "A"}, "--unit")]
)
def test_what_a_map_of_odrive_cannot_have_is_refused(run, more, key):
    with pytest.raises(ModelError) as told:
        compensate.run(compensate.Options(motor=run, format="odrive", torque_constant=0.5, **more))
    assert told.value.key == key


def test_a_folder_of_several_motors_names_them(place, run):
    with pytest.raises(FileError) as told:
        compensate.run(compensate.Options(motor=place))
    assert "run" in str(told.value) and "--force" not in str(told.value)


@pytest.mark.parametrize(
    "text", ["", f"{HEAD}\n", f"{HEAD}\n{HEAD}\n0,0,0\n", f"{HEAD}\n0,0,0,0,0,0\n"], ids=["empty", "bare", "two heads", "commas"]
)
def test_files_that_hold_no_log(place, text):
    (place / "none.csv").write_text(text)
    with pytest.raises(InputError):
        found(place, place / "none.csv")
