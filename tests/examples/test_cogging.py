"""The example of a winch motor: its commands end as its README says, and the log is one that `drive identify` reads."""

from __future__ import annotations

import json
import re
import shlex

import numpy as np
import pytest
from examples.test_examples import EXAMPLES, commands
from examples.test_examples import place as place

from robocal.cli.main import main

SMALL = {"turns: 2": "turns: 1", "log_rate_Hz: 100": "log_rate_Hz: 25"}


def run(command, capsys, *more):
    capsys.readouterr()
    status = main([*shlex.split(command)[1:], *more, "--json"])
    return status, json.loads(capsys.readouterr().out)


def ratios(document, name):
    (values,) = [c["values"] for c in document["ramps"]["columns"] if c["name"] == name]
    return values


def shrink(place):
    """A quarter of the rows, of one turn."""
    file = place / "examples" / "cogging" / "motor.yaml"
    text = file.read_text(encoding="utf-8")
    for old, new in SMALL.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    file.write_text(text, encoding="utf-8")


def test_the_log_is_read_as_it_was_simulated(place, capsys):
    """`drive identify` of the written log finds the curve of `drive simulate` to the last digit."""
    shrink(place)
    status, document = run(commands("cogging")[0], capsys)
    assert status == 0 and document["improved"]
    assert min(ratios(document, "position_ratio")) > 3 and min(ratios(document, "effort_ratio")) > 6
    status, found = run(commands("cogging")[1], capsys)
    assert status == 0
    assert found["lag"]["value"] == pytest.approx(document["lag"]["value"], rel=1e-9)
    assert found["friction"]["value"] == pytest.approx(document["friction"]["value"], rel=1e-9)
    assert main([*shlex.split(commands("cogging")[2])[1:]]) == 0
    truth = np.loadtxt(place / "motor-run" / "truth.csv", delimiter=",", skiprows=1)
    error = np.abs(truth[:, 2] - truth[:, 1]).max()
    assert error == pytest.approx(document["curve_error"]["value"], rel=1e-5)
    assert error < 0.05 * np.abs(truth[:, 1]).max()


def test_a_folder_is_not_replaced_unasked(place, capsys):
    shrink(place)
    (place / "motor-run").mkdir()
    (place / "motor-run" / "sweep.csv").write_text("mine", encoding="utf-8")
    assert main(shlex.split(commands("cogging")[0])[1:]) == 2
    assert [p.name for p in (place / "motor-run").iterdir()] == ["sweep.csv"]


@pytest.mark.slow
def test_the_numbers_of_the_readme(place, capsys):
    text = " ".join((EXAMPLES / "cogging" / "README.md").read_text(encoding="utf-8").split())
    status, document = run(commands("cogging")[0], capsys)
    assert status == 0
    told = re.search(r"within ([\d.]+) % of the true peak", text)
    assert float(told[1]) == pytest.approx(100 * document["curve_error"]["value"] / document["peak"]["value"], abs=0.01)
    told = re.search(
        r"divided by ([\d.]+) and ([\d.]+), and the peak effort of the controller by ([\d.]+) and ([\d.]+)\.", text
    )
    measured = [*ratios(document, "position_ratio"), *ratios(document, "effort_ratio")]
    assert [float(v) for v in told.groups()] == pytest.approx(measured, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("number", "status"), [(3, 0), (4, 3)])
def test_escapes(place, capsys, number, status):
    ended, document = run(commands("cogging")[number], capsys)
    assert ended == status
    assert any(r["code"] == "drive-escaped" for r in document["remarks"])
    if status == 0:
        assert document["curve_error"]["value"] < 0.03 * document["peak"]["value"]


def test_a_faster_sweep_is_held_back(place, capsys):
    shrink(place)
    for number in (0, 5):
        assert run(commands("cogging")[number], capsys)[0] == 0
    status, document = run(commands("cogging")[6], capsys)
    assert status == 0
    (told,) = [r for r in document["remarks"] if r["code"] == "drive-held-back"]
    assert "quick-run" in told["sentence"]
