"""How logs of drives are read: rows that repeat, time that starts anew, headers of others, loads, electrical angles, signs and units."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.drives.cogging import Cogging
from robocal.errors import FormatError
from robocal.remarks.code import Code
from robocal.verbs.drive import validate
from tests.session.test_drive_logs import HEAD, TRUTH, codes, found, log, rows


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("readings")


@pytest.fixture(scope="module")
def plain(place):
    made = found(place, log(place), output=place / "run")
    assert made.trusted
    return made.result


@pytest.mark.parametrize("clock", ["stands", "runs"])
def test_rows_that_repeat_change_neither_noise_nor_intervals(place, plain, clock):
    again = np.repeat(rows(), 3, axis=0)
    if clock == "runs":
        again[:, 0] = np.arange(len(again)) * again[3, 0] / 3
    made = found(place, log(place, f"{clock}.csv", again))
    assert Code.DRIVE_REPEATED_ROWS in codes(made)
    assert made.result.noise == pytest.approx(plain.noise, rel=0.01)
    assert made.result.log_shares[0].noise == pytest.approx(plain.log_shares[0].noise, rel=0.02)
    assert made.result.taken.sigma("order4.cos") == pytest.approx(plain.taken.sigma("order4.cos"), rel=0.01)


def test_equal_readings_of_a_coarse_effort_are_readings(place):
    coarse = rows()
    coarse[:, 2] = np.round(coarse[:, 2], 1)
    coarse[:, 1] = np.round(coarse[:, 1], 2)
    assert Code.DRIVE_REPEATED_ROWS not in codes(found(place, log(place, "coarse.csv", coarse)))


@pytest.mark.parametrize("way", ["back", "again"])
def test_two_sweeps_in_one_file_each_with_its_own_time(place, way):
    one = rows(back=False, turns=2.0)
    two = one.copy()
    two[:, 1] = two[::-1, 1] if way == "back" else two[:, 1]
    two[:, 2] = (
        TRUTH.at(two[:, 1], -1.0 if way == "back" else 1.0)
        + (-0.1 if way == "back" else 0.1)
        + 0.01 * np.random.default_rng(3).standard_normal(len(two))
    )
    made = found(place, log(place, f"anew-{way}.csv", np.concatenate([one, two])))
    assert Code.DRIVE_TIME_ANEW in codes(made)
    assert made.trusted == (way == "back")  # two of one direction are one direction
    assert not any(e.any() for e in made.result.escaped)
    assert np.abs(made.result.taken.motor.cogging.at(1.0, 1.0) - TRUTH.at(1.0, 1.0)) < 0.006


def test_a_stamp_that_is_wrong_is_no_second_sweep(place):
    wrong = rows()
    wrong[700, 0] = -5.0
    with pytest.raises(FormatError, match="time runs backwards"):
        found(place, log(place, "stamp.csv", wrong))


HEADERS = {
    "Zeit,Winkel [deg],Strom": "time=Zeit:s,angle=Winkel:deg,current=Strom:A, with the units",
    "timestamp [s],axis0.encoder.pos_estimate,axis0.motor.Iq_measured": (
        "time=timestamp:s,angle=axis0.encoder.pos_estimate:turn,current=axis0.motor.Iq_measured:A; or"
    ),
    "timestamp [s],position,q_current": "time=timestamp:s,angle=position:turn,current=q_current:A; or",
    "time [s],shaft_angle,torque": "time=time:s,angle=shaft_angle:rad,torque=torque:Nm",
}


@pytest.mark.parametrize("head", HEADERS)
def test_all_that_is_missing_is_told_at_once_with_what_reads_it(place, head):
    path = log(place, "headers.csv", rows(), head)
    with pytest.raises(FormatError) as told:
        found(place, path)
    assert f"--columns {HEADERS[head]}" in str(told.value).replace("'", "")


def test_both_units_that_are_missing_are_told_at_once(place):
    with pytest.raises(FormatError, match="the unit of the time, the angle and the current are not named"):
        found(place, log(place, "units.csv", rows(), "time,angle,current"))


# obeys: drive-weight
def test_the_weight_of_a_load_is_no_cogging(place):
    hung = rows(turns=2.0)
    hung[:, 2] += 0.15 * np.sin(hung[:, 1] + 1.0)
    path = log(place, "hung.csv", hung)
    made = found(place, path)
    assert not made.trusted and Code.DRIVE_WEIGHT in codes(made)
    said = found(place, path, loaded=True)
    assert said.trusted and Code.DRIVE_WEIGHT not in codes(said)
    assert 1 not in said.result.taken.motor.orders
    assert said.result.taken.decision.values["log1.weight_cos"] == pytest.approx(0.15 * np.sin(1.0), abs=0.003)
    free = found(place, log(place, "free.csv", rows(turns=2.0)))
    assert said.result.taken.share == pytest.approx(free.result.taken.share, abs=0.003)


# obeys: drive-electrical
def test_an_electrical_angle_is_told(place):
    electrical = rows(turns=2.0) * [1, 4, 1]
    made = found(place, log(place, "electrical.csv", electrical))
    assert not made.trusted and Code.DRIVE_ELECTRICAL in codes(made)
    winding = rows(Cogging((72, 24), (0.1, 0.03), (0.0, 0.01), 0.001), turns=2.0, count=8000)
    known = found(place, log(place, "known.csv", winding * [1, 12, 1]), slots=18, poles=24)
    assert not known.trusted and Code.DRIVE_ELECTRICAL in codes(known)
    own = found(place, log(place, "shaft.csv", winding), slots=18, poles=24)
    assert own.trusted and Code.DRIVE_ELECTRICAL not in codes(own)
    with pytest.raises(FormatError, match="electrical"):
        found(
            place, log(place, "named.csv", rows(), "time [s],angle elec [rad],current [A]"),
            columns=("time=time:s", "angle=angle elec:rad", "current=current:A"),
        )  # fmt: skip


# obeys: drive-other-sign
def test_an_effort_of_the_other_sign_is_told(place, plain):
    def said(values, name):
        made = validate.run(validate.Options(motor=place / "run", log=log(place, name, values)))
        return {r.code for r in made.result.reasons}

    assert said(rows() * [1, 1, -1], "sign.csv") == {Code.DRIVE_OTHER_SIGN}
    assert said(rows(), "own.csv") == set()


def test_a_validation_speaks_the_units_of_its_log(place, plain):
    path = log(place, "deg.csv", rows() * [1, 180 / np.pi, 1], HEAD.replace("rad", "deg"))
    listing = validate.run(validate.Options(motor=place / "run", log=path)).result.listing
    columns = {c.name: c for c in listing.columns}
    assert columns["speed"].unit == "deg/s" and columns["lag"].unit == "deg"
    assert columns["speed"].values[0] == pytest.approx(np.degrees(0.2), rel=0.01)


def test_tables_of_the_seed_s_method_beside_harmonics(place, plain):
    found(place, log(place), method="seed", output=place / "seed")
    other = log(place, "second.csv", rows(turns=2.0, noise=0.02))
    made = validate.run(validate.Options(motor=place / "run", log=other, beside=(place / "seed",)))
    columns = {c.name: list(c.values) for c in made.result.listing.columns}
    assert columns["table"] == ["run, harmonics", "seed, tables of the seed"]
    assert min(columns["alone"]) > 0.85
    alone = validate.run(validate.Options(motor=place / "seed", log=other)).result
    assert alone.trusted and next(iter(alone.parts.values())).alone == pytest.approx(columns["alone"][1])


def test_nobody_speaks_of_poses_to_a_motor(place, plain):
    for result in (plain, found(place, log(place, "noise.csv", rows(noise=2.0))).result):
        said = " ".join(r.sentence + r.advice for r in (*result.warnings, *result.verdict.remarks))
        assert "pose" not in said and "readings" not in said and "configuration" not in said


def test_detached_and_loaded_logs_are_one_motor_with_two_frictions(place):
    hung = rows(turns=2.0)
    hung[:, 2] += 0.15 * np.sin(hung[:, 1]) + 0.08 * np.sign(np.gradient(hung[:, 1]))
    log(place, "loaded.csv", hung, "t,a,i")
    text = "robocal: 1\nkind: current\nfile: loaded.csv\nload: loaded\n"
    text += "time: {column: t, unit: s}\nangle: {column: a, unit: rad}\ncurrent: {column: i, unit: A}\n"
    (place / "loaded.yaml").write_text(text)
    made = found(place, log(place), place / "loaded.yaml", output=place / "both")
    assert made.trusted and 1 not in made.result.taken.motor.orders
    columns = {c.name: list(c.values) for c in made.result.friction_listing.columns}
    assert columns["friction"] == pytest.approx([0.1, 0.18], abs=0.002)
    assert columns["weight"] == pytest.approx([0.0, 0.15], abs=0.003)
    page = (place / "both" / "report.html").read_text()
    assert "Friction of each log" in page and "Noise and speed" in page


def test_noise_of_faster_sweeps_is_larger_beside_the_cogging(place):
    made = found(place, log(place), log(place, "fast.csv", rows(speed=2.0, noise=0.05)), method="seed")
    columns = {c.name: list(c.values) for c in made.result.log_listing.columns}
    assert columns["use"] == ["fitted", "held back"]
    assert columns["noise_share"][1] > 4 * columns["noise_share"][0]
    methods = {c.name: list(c.values) for c in made.result.document.methods.columns}
    assert methods["method"] == ["harmonics", "tables of the seed"] and min(methods["same"]) > 0.95


def test_a_quarter_of_a_turn_is_told_whatever_else_is_wrong(place):
    made = found(place, log(place, "quarter.csv", rows(turns=0.2)))
    assert not made.trusted and Code.DRIVE_UNDER_TURN in codes(made) and Code.FEW_UNSEEN not in codes(made)
