"""Logs of drives from file to table: what is found, what a log cannot tell, and that advice, obeyed, leaves nothing to say."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from robocal.drives.cogging import Cogging
from robocal.errors import FormatError, InputError
from robocal.files.drive_tables import FORMS, compensation_table, read_table, table_text
from robocal.files.motor_file import motor_text, read_motor
from robocal.remarks.code import Code
from robocal.verbs.drive import compensate, identify, validate

TRUTH = Cogging((4, 6, 24), (0.06, 0.02, 0.05), (0.01, 0.03, -0.04), 0.005)
HEAD = "time [s],angle [rad],current [A]"


def rows(
    truth: Cogging = TRUTH,
    *,
    turns: float = 1.5,
    back: bool = True,
    speed: float = 0.2,
    count: int = 1500,
    noise: float = 0.01,
):
    rng = np.random.default_rng(1)
    way = np.linspace(0, turns * 2 * np.pi, count)
    angle = np.concatenate([way, way[::-1]]) if back else way
    d = np.concatenate([np.ones(count), -np.ones(count)]) if back else np.ones(count)
    y = truth.at(angle, d) + 0.1 * d + 0.01 + noise * rng.standard_normal(len(angle))
    return np.column_stack([np.arange(len(angle)) * (way[1] / speed), angle, y])


def log(folder: Path, name: str = "sweep.csv", values=None, head: str = HEAD) -> Path:
    path = folder / name
    np.savetxt(path, rows() if values is None else values, delimiter=",", header=head, comments="", fmt="%.10g")
    return path


def found(folder: Path, *paths: Path, **more):
    return identify.run(identify.Options(logs=tuple(paths) or (log(folder),), **more))


def codes(made) -> set[str]:
    return {r.code for r in (*made.result.warnings, *made.result.verdict.remarks)}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("drive")


@pytest.fixture(scope="module")
def run(place):
    made = found(place, log(place), output=place / "run")
    assert made.trusted
    return place / "run"


def test_a_motor_is_found_with_its_orders_friction_and_lag(place, run):
    motor = read_motor(run)
    assert set(motor.cogging.orders) == {4, 6, 24}
    some = np.linspace(0, 6, 200)
    for d in (1.0, -1.0):
        assert np.abs(motor.cogging.at(some, d) - TRUTH.at(some, d)).max() < 0.004
    assert motor.coulomb == pytest.approx(0.1, abs=1e-3)
    document = json.loads((run / "drive.json").read_text())
    assert document["verdict"]["status"] == "improved"
    assert document["share"] == pytest.approx(document["ceiling"], abs=0.01)
    assert (run / "report.html").stat().st_size > 10_000


def test_the_seed_s_method_by_name(place):
    made = found(place, log(place), method="seed", window=2.0, output=place / "seed")
    assert made.trusted
    motor = read_motor(place / "seed")
    assert motor.table is not None
    some = np.linspace(0, 6, 200)
    assert (
        np.abs(np.interp(some, np.arange(3600) * 2 * np.pi / 3600, motor.curves(3600)[0]) - TRUTH.at(some, 1.0)).max()
        < 0.03
    )


# obeys: drive-table-lost
def test_a_table_with_gaps_is_told(place):
    some = rows(count=6000)
    gap = np.abs(np.mod(some[:, 1], 2 * np.pi) - 1.0) > 0.1
    made = found(place, log(place, "gap.csv", some[gap]), method="seed", window=2.0)
    assert not made.trusted
    assert Code.DRIVE_TABLE_LOST in codes(made)
    assert Code.DRIVE_TABLE_LOST not in codes(found(place, log(place, "whole.csv", some), method="seed", window=2.0))


@pytest.mark.parametrize("form", FORMS)
def test_a_table_is_read_back_bit_for_bit(run, form):
    table = compensation_table(read_motor(run), form, 3600 if form == "odrive" else 720, None, False, 0.561)
    again = read_table(table_text(table, form), form)
    assert again.tobytes() == table.values.tobytes()
    curves = read_motor(run).curves(720)
    if form not in ("odrive",):
        assert np.abs(table.values - curves).max() < 1e-4


def test_torque_needs_its_constant(run):
    with pytest.raises(FormatError, match="torque constant"):
        compensation_table(read_motor(run), "odrive", 3600, None, False, None)
    made = compensate.run(
        compensate.Options(motor=run, format="csv", unit="Nm", torque_constant=2.0, cells=360, friction=True)
    )
    values = read_table(made.text, "csv")
    assert values.mean(axis=1) == pytest.approx([0.2, -0.2], abs=0.01)


def test_motor_yaml_says_what_it_is_made_of(run):
    motor = read_motor(run)
    assert motor_text(motor).partition("source:")[0] == (run / "motor.yaml").read_text().partition("source:")[0]


# obeys: drive-one-direction
def test_one_direction_is_not_enough(place):
    made = found(place, log(place, "one.csv", rows(back=False)))
    assert not made.trusted
    assert Code.DRIVE_ONE_DIRECTION in codes(made)
    assert Code.DRIVE_ONE_DIRECTION not in codes(found(place, log(place)))


# obeys: drive-under-turn
def test_half_a_turn_is_not_enough(place):
    made = found(place, log(place, "half.csv", rows(turns=0.5)))
    assert not made.trusted
    assert Code.DRIVE_UNDER_TURN in codes(made)
    assert Code.DRIVE_UNDER_TURN not in codes(found(place, log(place, "two.csv", rows(turns=2.0))))


# obeys: drive-orders-unseen
def test_few_rows_tell_few_orders(place):
    assert Code.DRIVE_ORDERS_UNSEEN in codes(found(place, log(place, "few.csv", rows(count=400))))
    assert Code.DRIVE_ORDERS_UNSEEN not in codes(found(place, log(place)))


# obeys: drive-other-reading
@pytest.mark.parametrize(("head", "factor"), [(HEAD, 180 / np.pi), (HEAD.replace("rad", "deg"), 1.0)])
def test_a_wrong_unit_is_named(place, head, factor):
    right, path = "deg" if factor > 1 else "rad", log(place, "unit.csv", rows() * [1, factor, 1], head)
    if right == "rad":
        with pytest.raises(InputError, match="the angle in rad"):
            found(place, path)
    else:
        made = found(place, path)
        assert made.result.verdict.status == "refused"
        assert Code.DRIVE_OTHER_READING in codes(made)
        assert f"the angle in {right}" in " ".join(r.sentence for r in made.result.verdict.remarks)
    assert found(place, log(place, "unit.csv", rows() * [1, factor, 1], HEAD.replace("rad", right))).trusted


def test_exchanged_columns_are_named(place):
    made = found(place, log(place, "swapped.csv", None, "time [s],current [A],angle [rad]"))
    assert made.result.verdict.status == "refused"
    assert "angle and effort exchanged" in " ".join(r.sentence for r in made.result.verdict.remarks)


# obeys: drive-explains-little
# obeys: drive-speed-hides
def test_effort_that_does_not_come_again_is_refused(place):
    values = rows()
    values[:, 2] = 0.1 * np.random.default_rng(2).standard_normal(len(values)) + 0.1 * np.sign(
        np.gradient(values[:, 1])
    )
    made = found(place, log(place, "noise.csv", values))
    assert made.result.verdict.status == "refused"
    assert Code.DRIVE_EXPLAINS_LITTLE in codes(made)
    quick = values.copy()
    quick[:, 0] /= 40 + 30 * np.sin(values[:, 1])
    quick = quick[np.argsort(quick[:, 0])]
    quick[:, 1] = values[:, 1] + 0.03 * np.sin(9 * values[:, 1])
    assert Code.DRIVE_SPEED_HIDES in codes(found(place, log(place, "quick.csv", quick)))
    assert not {Code.DRIVE_EXPLAINS_LITTLE, Code.DRIVE_SPEED_HIDES} & codes(found(place, log(place)))


# obeys: drive-gear
# obeys: drive-slots-unlike
def test_slots_poles_and_gears_are_asked_of_the_orders(place):
    winding = Cogging(
        (36, 9, 4), (0.06, 0.03, 0.02), (0.0, 0.01, 0.01), 0.001
    )  # 9 slots, 8 poles would be 72; 12 and 18: 36
    path = log(place, "slots.csv", rows(winding, count=4000))
    assert Code.DRIVE_SLOTS_UNLIKE in codes(found(place, path, slots=15, poles=14))
    motor = Cogging((24, 6), (0.06, 0.03), (0.0, 0.01), 0.001)
    assert Code.DRIVE_SLOTS_UNLIKE not in codes(
        found(place, log(place, "own.csv", rows(motor, count=4000)), slots=6, poles=8)
    )
    geared = Cogging((120, 30), (0.06, 0.03), (0.0, 0.01), 0.001)
    assert Code.DRIVE_GEAR in codes(found(place, log(place, "gear.csv", rows(geared, count=4000)), slots=6, poles=8))
    assert Code.DRIVE_GEAR not in codes(found(place, place / "own.csv", slots=6, poles=8))


# obeys: drive-other-motor
# obeys: drive-other-zero
def test_a_log_of_another_motor_or_zero_is_told(place, run):
    def reasons(values, name):
        made = validate.run(validate.Options(motor=run, log=log(place, name, values)))
        return {r.code for r in made.result.reasons}

    other = Cogging((5, 21), (0.05, 0.03), (0.02, 0.01), 0.0)
    assert reasons(rows(other), "other.csv") == {Code.DRIVE_OTHER_MOTOR}
    assert reasons(rows() + [0, 0.7, 0], "moved.csv") == {Code.DRIVE_OTHER_ZERO}
    assert reasons(rows() * [1, -1, -1], "mirrored.csv") == {Code.DRIVE_OTHER_ZERO}
    assert reasons(rows(), "same.csv") == set()


# obeys: drive-flag
def test_the_effort_is_believed_before_the_flag(place, run):
    values = rows(turns=8, back=False, speed=3.0, count=6000)
    off = values[:, 1] > 8 * np.pi
    values[off, 2] = 0.1 + 0.03 * np.random.default_rng(3).standard_normal(off.sum())

    def said(flag):
        path = log(place, "flag.csv", np.column_stack([values, flag]), HEAD + ",flag")
        return {r.code for r in validate.run(validate.Options(motor=run, log=path)).result.warnings}

    assert Code.DRIVE_FLAG not in said(~off)
    assert Code.DRIVE_FLAG in said(off)


# obeys: drive-escaped
def test_escapes_are_masked_and_told(place):
    values = rows(turns=2.0, count=6000)
    jump = values.copy()
    first = 1500
    jump[first : first + 100, 1] = np.maximum(values[first : first + 100, 1], values[first, 1] + 0.15)
    jump[first : first + 100, 2] -= 0.2
    made = found(place, log(place, "escape.csv", jump))
    assert Code.DRIVE_ESCAPED in codes(made)
    assert np.abs(made.result.taken.motor.cogging.at(1.0, 1.0) - TRUTH.at(1.0, 1.0)) < 0.004
    assert Code.DRIVE_ESCAPED not in codes(found(place, log(place, "led.csv", values)))


def test_lost_samples_are_left_out(place):
    values = rows()
    values[100::500, 2] += 40.0
    made = found(place, log(place, "lost.csv", values))
    assert made.trusted
    assert Code.DRIVE_LONE_ROWS in codes(made)
    assert made.result.taken.share == pytest.approx(found(place, log(place)).result.taken.share, abs=0.005)


def test_other_speeds_are_held_back(place):
    fast = log(place, "fast.csv", rows(speed=2.0, noise=0.05))
    made = found(place, log(place), fast)
    assert made.result.fitted == (0,)
    assert made.result.other_logs[1].alone > 0.5
    assert Code.DRIVE_HELD_BACK in codes(made)


BAD = {
    "nan": (lambda v: v.__setitem__((50, 2), np.nan), HEAD, "not a finite number"),
    "constant": (lambda v: v.__setitem__((slice(None), 1), 2.0), HEAD, "never changes"),
    "units": (lambda v: None, "time,angle,current", "unit of the time"),
    "counts": (lambda v: v.__setitem__((slice(None), 1), np.round(v[:, 1] * 3000)), HEAD, "encoder counts"),
    "time": (lambda v: v.__setitem__((70, 0), -5.0), HEAD, "time runs backwards"),
    "column": (lambda v: None, "time [s],angle [rad],volts", "no column is a current"),
}


@pytest.mark.parametrize("what", BAD)
def test_a_bad_log_is_refused_with_its_cause(place, what):
    change, head, words = BAD[what]
    values = rows()
    change(values)
    with pytest.raises(InputError, match=words):
        found(place, log(place, f"{what}.csv", values, head))


def test_a_data_file_says_it_all(place):
    log(place, "plain.csv", rows(), "t,theta,iq")
    text = "robocal: 1\nkind: current\nfile: plain.csv\ntime: {column: t, unit: s}\nangle: {column: theta, unit: rad}\n"
    text += "current: {column: iq, unit: A}\nmotor: {name: axis, slots: 6, poles: 8, torque_constant: {value: 0.5, unit: Nm/A}}\n"
    (place / "data.yaml").write_text(text)
    made = found(place, place / "data.yaml", output=place / "described")
    motor = read_motor(place / "described")
    assert made.trusted
    assert (motor.torque_constant, motor.unit) == (0.5, "A")
    (place / "data.yaml").write_text(text.replace("poles: 8", "poles: 7"))
    with pytest.raises(FormatError, match="pairs"):
        found(place, place / "data.yaml")
