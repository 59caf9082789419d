"""Studies: the numbers of the README are those of its commands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from examples.test_examples import EXAMPLES, commands
from examples.test_examples import place as place
from sizes import size

from robocal.cli.main import main


def points(command, capsys):
    import json

    capsys.readouterr()
    assert main([*shlex.split(command)[1:], "--json"]) == 0
    return json.loads(capsys.readouterr().out)["points"]


def said():
    return " ".join((EXAMPLES / "studies" / "README.md").read_text(encoding="utf-8").split())


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
    poses, losses = spec("poses-of-an-arm"), spec("outliers-against-losses")
    after = [1e3 * p["after"]["mean"] for p in points(poses, capsys)]
    told = re.search(r"to ([\d.]+), ([\d.]+) and ([\d.]+) mm with 30, 56 and 100", said())
    assert after == pytest.approx([float(v) for v in told.groups()], rel=0.02)
    none, huber, tukey = (1e3 * p["after"]["mean"] for p in points(losses, capsys))
    ends = re.search(r"ends at ([\d.]+) mm in the mean, a Huber or Tukey loss at ([\d.]+) mm", said())
    assert none == pytest.approx(float(ends[1]), rel=0.02)
    assert [huber, tukey] == pytest.approx([float(ends[2])] * 2, rel=0.02)


    poses, losses = spec("poses-of-an-arm"), spec("outliers-against-losses")
