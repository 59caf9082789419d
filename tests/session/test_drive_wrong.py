"""Logs and runs that a hostile reader tried: what looked right and was not is told with its cause, and what looked wrong and was not
is taken."""

from __future__ import annotations

import json

import numpy as np
import pytest

from robocal.drives.cogging import Cogging
from robocal.errors import FileError, FormatError, InputError, ModelError
from robocal.files.drive_tables import FORMS, compensation_table, read_table, table_text
from robocal.files.motor_file import MotorFile, read_motor
from robocal.remarks.code import Code
from robocal.verbs.drive import compensate, validate
from tests.session.test_drive_logs import HEAD, TRUTH, codes, found, log, rows


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("wrong")


@pytest.fixture(scope="module")
def runs(place):
    """A run that is improved, one that is not, one that is refused."""
    noise = rows()
    noise[:, 2] += 0.3 * np.random.default_rng(2).standard_normal(len(noise))
    made = {
        "improved": found(place, log(place), output=place / "improved"),
        "not_improved": found(place, log(place, "one.csv", rows(back=False)), output=place / "not_improved"),
        "refused": found(place, log(place, "noise.csv", noise), output=place / "refused"),
    }
    for word, one in made.items():
        assert one.result.verdict.status == word
    return place


@pytest.fixture
def run(runs):
    return runs / "improved"


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
        for r in validate.run(
            validate.Options(motor=run, log=log(place, "us.csv", rows() * [1e6, 1, 1]))
        ).result.warnings
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


# obeys: drive-arc-unread
def test_holes_that_held_out_arcs_do_not_notice_are_told(place):
    truth = Cogging((4, 8, 12, 24), (0.057, 0.014, 0.015, -0.005), (-0.018, -0.027, 0.013, -0.011), 0.0105)
    values = rows(truth, turns=2.2, count=6000, noise=0.02)
    at = np.mod(np.degrees(values[:, 1]), 90)
    for name, kept, told in (
        ("holes.csv", (at > 55) | ((at > 25) & (at < 30)), True),
        ("narrow.csv", (at < 20) | (at > 40), False),
        ("whole.csv", at >= 0, False),
    ):
        made = found(place, log(place, name, values[kept]))
        assert made.trusted != told and (Code.DRIVE_ARC_UNREAD in codes(made)) == told, name


def test_currents_without_their_sign_are_named_and_a_weight_is_none(place):
    values = rows()
    values[:, 2] = np.abs(values[:, 2])
    made = found(place, log(place, "size.csv", values))
    assert made.result.verdict.status == "refused" and Code.DRIVE_OTHER_READING in codes(made)
    assert "the effort with the sign of its direction" in made.result.verdict.remarks[0].sentence
    assert found(place, log(place, "weight.csv", rows() + [0, 0, 1.0])).trusted  # all above zero, and right


# obeys: drive-lag-far
@pytest.mark.parametrize("count", [10, 20, 41])  # 4, 7 and 15 degrees: of order 24 the last is a whole period
def test_efforts_of_another_moment_than_their_angles_are_told(place, count):
    values, late = rows(), rows()
    late[:, 2] = np.roll(late[:, 2], count)
    made = found(place, log(place, "late.csv", late))
    assert not made.trusted and Code.DRIVE_LAG_FAR in codes(made)
    assert found(place, log(place, "at-once.csv", values)).trusted


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


def test_a_run_that_found_nothing_has_no_table(place):
    flat = rows(Cogging((), (), (), 0.0))
    assert not found(place, log(place, "flat.csv", flat), output=place / "flat").trusted
    with pytest.raises(ModelError, match="nothing to compensate"):
        compensate.run(compensate.Options(motor=place / "flat"))


def test_a_folder_of_several_motors_names_them(place, run):
    with pytest.raises(FileError) as told:
        compensate.run(compensate.Options(motor=place))
    assert "not_improved" in str(told.value) and "--force" not in str(told.value)


@pytest.mark.parametrize(
    "text",
    ["", f"{HEAD}\n", f"{HEAD}\n{HEAD}\n0,0,0\n", f"{HEAD}\n0,0,0,0,0,0\n"],
    ids=["empty", "bare", "two heads", "commas"],
)
def test_files_that_hold_no_log(place, text):
    (place / "none.csv").write_text(text)
    with pytest.raises(InputError):
        found(place, place / "none.csv")


# obeys: drive-other-reading
@pytest.mark.parametrize("turns", [7, 12])
def test_turns_that_are_read_as_radians_are_named_though_low_orders_explain_much(place, turns):
    made = rows(turns=float(turns), count=1000 * turns) * [1, 1 / (2 * np.pi), 1]
    wrong = found(place, log(place, "turns.csv", made))
    assert wrong.result.taken.share > 0.5  # so that nothing else refuses it
    assert wrong.result.verdict.status == "refused" and Code.DRIVE_OTHER_READING in codes(wrong)
    right = found(place, log(place, "right.csv", made, HEAD.replace("rad", "turn")))
    assert right.trusted and Code.DRIVE_OTHER_READING not in codes(right)


@pytest.mark.parametrize("row", [1500, 700, 2300])
def test_an_hour_without_rows_is_no_slow_sweep(place, row):
    values = rows()
    values[row:, 0] += 3600
    made = found(place, log(place, "hour.csv", values))
    assert made.trusted and not any(e.any() for e in made.result.escaped)


def test_time_that_is_exchanged_with_the_angle_is_named(place):
    path = log(place, "exchanged.csv", None, "angle [rad],time [s],current [A]")
    with pytest.raises(FormatError, match="time runs backwards") as told:
        found(place, path)
    assert "the angle never falls" in str(told.value)


# obeys: drive-unproven
@pytest.mark.parametrize("word", ["not_improved", "refused"])
@pytest.mark.parametrize("form", ["csv", "json", "c", "c-float", "array"])
def test_a_table_that_is_not_proven_says_so(runs, word, form):
    made = compensate.run(compensate.Options(motor=runs / word, format=form))
    assert not made.trusted and [r.code for r in made.result.reasons] == [Code.DRIVE_UNPROVEN]
    assert ("NOT PROVEN" in made.text) == (form != "array")
    proven = compensate.run(compensate.Options(motor=runs / "improved", format=form))
    assert proven.trusted and "NOT PROVEN" not in proven.text and not proven.remarks


def test_a_motor_that_is_not_proven_is_said_beside_another_log(runs):
    path = log(runs, "other.csv")
    kept = validate.run(validate.Options(motor=runs / "not_improved", log=path))
    assert kept.trusted and Code.DRIVE_UNPROVEN in {r.code for r in kept.result.warnings}
    assert not validate.run(validate.Options(motor=runs / "refused", log=path)).trusted
    told = validate.run(validate.Options(motor=runs / "improved", log=path)).result
    assert Code.DRIVE_UNPROVEN not in {r.code for r in (*told.warnings, *told.reasons)}


def test_a_motor_that_somebody_wrote_is_no_run(runs):
    own = runs / "own.yaml"
    text = (runs / "not_improved" / "motor.yaml").read_text()
    own.write_text(text.replace("verdict: not_improved\n", ""))
    assert compensate.run(compensate.Options(motor=own)).trusted
    own.write_text(text.replace("verdict: not_improved", "verdict: fine"))
    with pytest.raises(FormatError, match="verdict"):
        read_motor(own)


@pytest.mark.parametrize(
    ("key", "more"), [("--cells", {"cells": 720}), ("--unit", {"unit": "A"}), ("--friction", {"friction": True})]
)
def test_what_the_map_of_odrive_has_not_is_refused(runs, key, more):
    o = compensate.Options(motor=runs / "improved", format="odrive", torque_constant=0.5, **more)
    with pytest.raises(FormatError) as told:
        compensate.run(o)
    assert told.value.key == key


def test_a_torque_constant_in_another_unit_is_refused(runs):
    for k_c in (561.0, 0.561e-6):  # of 0.561 N m/A: mN m for N m, and uA for A
        with pytest.raises(FormatError, match="no motor has this torque constant"):
            compensate.run(compensate.Options(motor=runs / "improved", unit="Nm", torque_constant=k_c))
    assert compensate.run(compensate.Options(motor=runs / "improved", unit="Nm", torque_constant=0.561)).trusted


def test_a_torque_constant_that_makes_numbers_no_controller_has_is_refused(runs):
    for k_c in (1e300, 1e40):
        with pytest.raises(FormatError, match="no controller holds"):
            compensate.run(compensate.Options(motor=runs / "improved", format="odrive", torque_constant=k_c))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("seed", range(3))
def test_any_motor_is_read_back_bit_for_bit_by_a_reader_of_its_own(form, seed):
    """Signs, sizes from 1e-9 to 1e6 and names that end comments or lines."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-9, 6)
    cogging = Cogging((6, 72), tuple(size * rng.normal(size=2)), tuple(size * rng.normal(size=2)), 0.001)
    motor = MotorFile("axis */ 1\n3,4,5", "N m", cogging, 0.0, size)
    table = compensation_table(motor, form, 3600, None, False, None)
    text = table_text(table, form)
    assert read_table(text, form).tobytes() == table.values.tobytes()
    if form == "c":
        numbers = [
            [int(v) for v in r.split("{")[1].rstrip("};").split(",")] for r in text.splitlines() if "int16_t" in r
        ]
        assert max(abs(v) for r in numbers for v in r) == 32767
        assert np.abs(np.array(numbers) * table.scale - motor.curves(3600)).max() <= table.scale * 0.5000001
    elif form == "c-float":
        lines = [r for r in text.splitlines() if "static const float" in r]
        own = np.array([[v.strip() for v in r.split("{")[1].rstrip("};").split(",")] for r in lines])
        assert (np.char.rstrip(own, "f").astype(np.float32) == motor.curves(3600).astype(np.float32)).all()
        assert all(("." in v or "e" in v) and v.endswith("f") for v in own.ravel())
    elif form == "json":
        assert json.loads(text)["forward"] == motor.curves(3600)[0].tolist()
    elif form == "csv":
        kept = [r for r in text.splitlines() if not r.startswith("#")][1:]
        assert len(kept) == 3600
        assert [float(r.split(",")[2]) for r in kept] == motor.curves(3600)[1].tolist()
