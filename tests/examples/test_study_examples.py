"""Studies: the numbers of the README are those of its commands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from examples.test_examples import EXAMPLES, commands
from examples.test_examples import place as place
from listings import points_of
from sizes import size

from robocal.cli.main import main


def points(command, capsys):
    import json

    capsys.readouterr()
    assert main([*shlex.split(command)[1:], "--json"]) == 0
    return points_of(json.loads(capsys.readouterr().out))


def said():
    return " ".join((EXAMPLES / "studies" / "README.md").read_text(encoding="utf-8").split())


def spec(name):
    return next(c for c in commands("studies") if f"/{name}.yaml" in c)


@pytest.mark.slow
def test_figures(place, capsys):
    columns = []
    for command in commands("studies")[:2]:
        found = points(command, capsys)
        columns += [
            [f"{1e3 * p['anchors']['rms']:.1f}" for p in found if p["varied"]["residual"] == r]
            for r in ("squared", "length")
        ]
    rows = [f"| {n} | " + " | ".join(c[i] for c in columns) + " |" for i, n in enumerate((10, 20, 50, 100, 200, 400))]
    for row in rows:
        assert row in said(), row


def test_the_first_row_of_table_3_1_is_near_what_is_printed(place, capsys):
    """13.0 mm of the anchors and 20.0 mm of the zeros, of one list."""
    found = points(commands("studies")[2], capsys)
    row = next(p for p in found if p["varied"] == {"noise": "length 2.8 mm", "residual": "squared"})
    assert 1e3 * row["anchors"]["mean"] == pytest.approx(13.0, rel=0.25)
    assert 1e3 * row["zeros"]["mean"] == pytest.approx(20.0, rel=0.25)


@pytest.mark.slow
def test_arms(place, capsys):
    poses, losses = (spec("poses-of-an-arm"), spec("outliers-against-losses"))
    after = [1e3 * p["after"]["mean"] for p in points(poses, capsys)]
    told = re.search(r"to ([\d.]+), ([\d.]+) and ([\d.]+) mm with 30, 56 and 100", said())
    assert after == pytest.approx([float(v) for v in told.groups()], rel=0.02)
    none, huber, tukey = (1e3 * p["after"]["mean"] for p in points(losses, capsys))
    ends = re.search(r"ends at ([\d.]+) mm in the mean\. A Huber or Tukey loss ends at ([\d.]+) mm", said())
    assert none == pytest.approx(float(ends[1]), rel=0.02)
    assert [huber, tukey] == pytest.approx([float(ends[2])] * 2, rel=0.02)


def mm(found, output, **varied):
    """The root mean square of an output at the point with these words, and what is foretold."""
    (point,) = [p for p in found if p["varied"] == {k.replace("__", "."): v for k, v in varied.items()}]
    return 1e3 * point[output]["rms"], 1e3 * point[output]["foretold"]


def test_constant_errors_of_lengths_and_positions(place, capsys):
    """B.1 and B.2: the one is in the zeros alone, the other in the anchors alone."""
    for p in points(spec("figure-b.1"), capsys):
        assert p["anchors"]["rms"] < 1e-12
        assert 1e3 * p["zeros"]["rms"] == pytest.approx(float(p["varied"]["bias.length"].split()[0]), rel=1e-9)
    for p in points(spec("figure-b.2"), capsys):
        assert p["zeros"]["rms"] < 1e-12
        size = float(p["varied"]["bias.position"].split()[0])
        assert 1e3 * p["anchors"]["rms"] == pytest.approx(size / 3**0.5, rel=1e-9)


def test_constant_errors_of_orientations_and_noise_of_lengths(place, capsys):
    """B.3 and B.4, as the README says."""
    turned = points(spec("figure-b.3"), capsys)
    told = re.search(
        r"errs by ([\d.]+) mm \(anchors, ([\d.]+) % more than predicted\), lengths by ([\d.]+) mm \(([\d.]+) % less",
        said(),
    )
    of = [mm(turned, "anchors", bias__orientation="10 deg", residual=r) for r in ("squared", "length")]
    assert [of[0][0], of[1][0]] == pytest.approx([float(told[1]), float(told[3])], rel=0.01)
    assert 100 * (of[0][0] / of[0][1] - 1) == pytest.approx(float(told[2]), abs=1)
    assert 100 * (1 - of[1][0] / of[1][1]) == pytest.approx(float(told[4]), abs=1)
    noisy = points(spec("figure-b.4"), capsys)
    told = re.search(r"give ([\d.]+) mm of ([\d.]+) predicted, and lengths ([\d.]+) mm of ([\d.]+)\.", said())
    of = [v for r in ("squared", "length") for v in mm(noisy, "anchors", noise__length="2.8 mm", residual=r)]
    assert of == pytest.approx([float(v) for v in told.groups()], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["figure-b.5", "figure-b.6", "figure-c.1", "figure-c.3", "figure-c.5"])
def test_what_is_found_is_what_is_foretold(place, capsys, name):
    """Of lengths to a twentieth: lists differ. Zeros err about 1.7 times as anchors, as the thesis says of annex C."""
    for p in points(spec(name), capsys):
        if p["varied"]["residual"] == "length":
            for output in ("anchors", "zeros"):
                assert p[output]["rms"] == pytest.approx(p[output]["foretold"], rel=0.06)
            assert p["zeros"]["rms"] / p["anchors"]["rms"] == pytest.approx(3**0.5, rel=0.06)


def reduced(command, capsys, usual):
    """A command's points with so many trials, the first of those that the printed numbers are of; all of them with ROBOCAL_FULL=1."""
    file = Path(shlex.split(command)[2])
    text = file.read_text(encoding="utf-8")
    file.write_text(re.sub(r"^trials: (\d+)$", lambda m: f"trials: {size(int(m[1]), usual)}", text, flags=re.MULTILINE))
    return points(command, capsys)


def rows_of(heading):
    """The rows of the first table below a heading of the README, without its head."""
    text = (EXAMPLES / "studies" / "README.md").read_text(encoding="utf-8").partition(heading)[2].partition("\n## ")[0]
    table = [[c.strip() for c in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    return table[2:]


def agrees(found, output, printed, count):
    """A mean with the printed one: within four of its own standard errors, or, with all trials, to the digits that are printed."""
    unit = 1e3 if output == "elsewhere" else 1e2
    mean, error = unit * found[output]["mean"], unit * found[output]["scatter"] / np.sqrt(count)
    digit = 10.0 ** -len(printed.partition(".")[2])
    assert mean == pytest.approx(float(printed), abs=1.01 * digit if size(1, 0) else 4 * error + digit), (
        found,
        printed,
    )


@pytest.mark.slow
def test_planned_against_random(place, capsys):
    rows = rows_of("## What planned poses are worth")
    usual, full = 20, 200
    found = [p for c in commands("studies") if "planned" in c for p in reduced(c, capsys, usual)]
    assert len(found) == 3 * len(rows)
    for row, k in zip(rows, range(0, len(found), 3), strict=True):
        for point, printed in zip(found[k : k + 3], row[3:6], strict=True):
            agrees(point, "elsewhere", printed, size(full, usual))
        planned, few, many = (p["elsewhere"]["mean"] for p in found[k : k + 3])
        assert planned < few and many < few
        assert row[6].split()[0] == f"{float(row[3]) / float(row[5]):.2f}"
        if row[0].startswith("as the random"):
            assert planned > 1.1 * many


@pytest.mark.slow
def test_coverage_of_an_arm(place, capsys):
    rows = rows_of("## Do intervals hold the truth")
    usual, full = 20, 200
    found = reduced(spec("coverage-of-an-arm"), capsys, usual)
    assert len(found) == 2 * len(rows)
    for row, k in zip(rows, range(0, len(found), 2), strict=True):
        for point, printed in zip(found[k : k + 2], row[2:4], strict=True):
            assert point["coverage"]["lost"] == 0
            agrees(point, "coverage", printed.split()[0], size(full, usual))
            assert 0.9 < point["coverage"]["mean"] < 0.99
