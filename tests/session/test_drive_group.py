"""Several motors in one call: a file each, or columns each in one file; the strange one is named."""

from __future__ import annotations

import json

import numpy as np
import pytest

from robocal.drives.cogging import Cogging
from robocal.drives.motor_group import unlike_others
from robocal.errors import InputError
from robocal.files.drive_log import read_drive_log
from robocal.remarks.code import Code
from robocal.verbs.drive import identify
from tests.session.test_drive_logs import TRUTH, log, rows

MANY = 8


def motor(number: int, friction: float = 0.0):
    """A sweep of one of eight motors, whose amplitudes and friction differ by a few percent."""
    rng = np.random.default_rng(number)
    like = Cogging(
        TRUTH.orders, *(tuple(v * rng.normal(1, 0.03) for v in p) for p in (TRUTH.cosine, TRUTH.sine)), 0.005
    )
    values = rows(like, count=700)
    values[:, 2] += rng.normal(0, 0.01, len(values)) + np.sign(np.gradient(values[:, 1])) * (
        friction + rng.normal(0, 0.004)
    )
    return values


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("motors")


def identify_files(place, friction, output=None):
    paths = [log(place, f"m{i}.csv", motor(i, friction if i == 5 else 0.0)) for i in range(MANY)]
    return identify.run(identify.Options(logs=tuple(paths), each=True, output=output))


# obeys: drive-strange
def test_the_strange_one_of_eight_motors_is_named(place):
    made = identify_files(place, 0.1, place / "runs")
    assert made.trusted
    assert made.result.strange == ("m5",)
    said = json.loads((place / "runs" / "motors.json").read_text())
    assert said["strange"] == ["m5"] and said["remarks"][0]["numbers"]["what"] == "Coulomb friction"
    for i in range(MANY):
        assert {p.name for p in (place / "runs" / f"m{i}").iterdir()} >= {"motor.yaml", "drive.json", "report.html"}
    with pytest.raises(InputError, match="not replaced"):
        identify_files(place, 0.1, place / "runs")
    assert Code.DRIVE_STRANGE not in {r.code for r in identify_files(place, 0.0).result.warnings}


def test_columns_of_several_motors_in_one_file(place):
    one, two = motor(1), motor(2)
    values = np.column_stack([one, two[:, 1:]])
    path = log(place, "both.csv", values, "time [s],angle 1 [rad],current 1 [A],angle 2 [rad],current 2 [A]")
    made = identify.run(identify.Options(logs=(path,)))
    assert list(made.result.members) == ["1", "2"]
    words = (
        "time=time:s",
        "angle.left=angle 1:rad",
        "current.left=current 1:A",
        "angle.right=angle 2:rad",
        "current.right=current 2:A",
    )
    again = identify.run(identify.Options(logs=(path,), columns=words, output=place / "both"))
    assert (place / "both" / "left" / "motor.yaml").exists() and (place / "both" / "report.html").exists()
    assert [m.taken.share for m in again.result.members.values()] == [
        m.taken.share for m in made.result.members.values()
    ]
    alone = identify.run(identify.Options(logs=(log(place, "two.csv", two),)))
    assert made.result.members["2"].taken.share == pytest.approx(alone.result.taken.share, abs=1e-9)
    with pytest.raises(InputError, match="several motors"):
        read_drive_log(path)


def test_a_data_file_of_several_motors(place):
    log(place, "plain.csv", np.column_stack([motor(1), motor(2)[:, 1:]]), "t,a,i,b,k")
    text = "robocal: 1\nkind: current\nfile: plain.csv\ntime: {column: t, unit: s}\nmotors:\n"
    text += "  - {name: left, angle: {column: a, unit: rad}, current: {column: i, unit: A}, slots: 6, poles: 8}\n"
    text += "  - {name: right, angle: {column: b, unit: rad}, current: {column: k, unit: A}}\n"
    (place / "data.yaml").write_text(text)
    made = identify.run(identify.Options(logs=(place / "data.yaml",)))
    assert [m.taken.motor.slots for m in made.result.members.values()] == [6, None]
    (place / "data.yaml").write_text(text.replace("right", "left"))
    with pytest.raises(InputError, match="one name"):
        identify.run(identify.Options(logs=(place / "data.yaml",)))


def test_two_logs_of_one_name_need_two_names(place):
    (place / "other").mkdir()
    paths = (log(place, "m.csv", motor(1)), log(place / "other", "m.csv", motor(2)))
    with pytest.raises(InputError, match="one name"):
        identify.run(identify.Options(logs=paths, each=True))


def test_alike_motors_are_called_strange_as_often_as_is_said():
    rng = np.random.default_rng(0)
    named = [unlike_others(np.exp(0.3 * rng.standard_normal(MANY)), 0.05, 1.0) for _ in range(2000)]
    assert 0.02 < np.mean([bool(n) for n in named]) <= 0.05
    values = np.exp(0.02 * rng.standard_normal(MANY))
    values[2] *= 2
    assert unlike_others(values, 0.05, 1.2) == (2,)
    values[6] *= 1.9
    assert set(unlike_others(values, 0.05, 1.2)) == {2, 6}
    assert unlike_others(values[:3], 0.05, 1.2) == ()
