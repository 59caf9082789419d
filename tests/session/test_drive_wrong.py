"""What looked right and was not: a turn that is read as another, efforts in another unit, tables of runs that prove nothing, options that
a form does not have; and logs with gaps, which looked wrong and were not."""

from __future__ import annotations

import json

import numpy as np
import pytest

from robocal.drives.cogging import Cogging
from robocal.errors import FormatError
from robocal.files.drive_tables import FORMS, compensation_table, read_table, table_text
from robocal.files.motor_file import MotorFile, read_motor
from robocal.remarks.code import Code
from robocal.verbs.drive import compensate, validate
from tests.session.test_drive_logs import HEAD, codes, found, log, rows


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("wrong")


@pytest.fixture(scope="module")
def runs(place):
    """A run that is improved, one that is not, one that is refused."""
    noise = rows()
    noise[:, 2] = 0.1 * np.random.default_rng(2).standard_normal(len(noise)) + 0.1 * np.sign(np.gradient(noise[:, 1]))
    made = {
        "improved": found(place, log(place), output=place / "improved"),
        "not_improved": found(place, log(place, "one.csv", rows(back=False)), output=place / "not_improved"),
        "refused": found(place, log(place, "noise.csv", noise), output=place / "refused"),
    }
    for word, one in made.items():
        assert one.result.verdict.status == word
    return place


# obeys: drive-other-reading
@pytest.mark.parametrize("turns", [7, 12])
def test_turns_that_are_read_as_radians_are_named_though_low_orders_explain_much(place, turns):
    made = rows(turns=float(turns), count=1000 * turns) * [1, 1 / (2 * np.pi), 1]
    wrong = found(place, log(place, "turns.csv", made))
    assert wrong.result.taken.share > 0.5  # so that nothing else refuses it
    assert wrong.result.verdict.status == "refused" and Code.DRIVE_OTHER_READING in codes(wrong)
    right = found(place, log(place, "right.csv", made, HEAD.replace("rad", "turn")))
    assert right.trusted and Code.DRIVE_OTHER_READING not in codes(right)


# obeys: drive-effort-size
@pytest.mark.parametrize(("unit", "factor"), [("mA", 1e3), ("A", 1e-3)])
def test_an_effort_that_no_motor_has_is_told(place, unit, factor):
    wrong, right = ("A", "mA") if unit == "mA" else ("mA", "A")
    values = rows() * [1, 1, 1e3 if unit == "mA" else 1]
    made = found(place, log(place, "size.csv", values, HEAD.replace("[A]", f"[{wrong}]")))
    assert not made.trusted and Code.DRIVE_EFFORT_SIZE in codes(made)
    made = found(place, log(place, "size.csv", values, HEAD.replace("[A]", f"[{right}]")))
    assert made.trusted and Code.DRIVE_EFFORT_SIZE not in codes(made)


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
