"""Tables at any width say the same: every number that stands in a wide terminal stands, whole, in a narrow one."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest
from cli.runs import robocal, small
from cli.test_cable_poses import robot as free
from cli.worlds import CABLE, PLACES, POSES, TARGETS
from files.test_cable import caspr
from rich.console import Console
from rich.text import Text

from robocal.cli.draw import PlainTable
from robocal.cli.terminal import Terminal
from robocal.files.cable.write import describe_cable

WIDTHS = (60, 80, 120)
NUMBER = re.compile(r"[+-]?\d[\d.]*(?:e[+-]?\d+)?")
VERBS = {
    "identify": "identify robot.yaml data.yaml -o run",
    "compared": "identify robot.yaml data.yaml --compare lm,pinv",
    "folds": "identify robot.yaml data.yaml --folds 3",
    "check robot": "check robot.yaml",
    "check": "check robot.yaml data.yaml",
    "predict": "predict run poses.csv",
    "validate": "validate truth.yaml data.yaml",
    "drift": "drift run run",
    "compensate": "compensate run targets.csv",
    "export": "export run --format markdown",
    "simulate": "simulate robot.yaml -n 5 -o sim",
    "plan": "plan robot.yaml -n 8",
    "new": "new --list",
    "import": "import flat_cables.xml -o imported.yaml --force",
    "inverse": "cable inverse cable.yaml places.csv",
    "forward": "cable forward cable.yaml lengths.csv",
    "tension": "cable tension cable.yaml places.csv",
    "workspace": "cable workspace cable.yaml --cells 7 --rays 100",
    "poses": "cable poses free.yaml -n 5",
}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tables")
    small(folder)
    for name, text in (
        ("poses.csv", POSES),
        ("targets.csv", TARGETS),
        ("cable.yaml", CABLE),
        ("places.csv", PLACES),
        ("free.yaml", describe_cable(free())),
    ):
        (folder / name).write_text(text, encoding="utf-8")
    assert robocal("identify", folder / "robot.yaml", folder / "data.yaml", "-o", folder / "run").status == 0
    caspr(folder)
    lengths = robocal("cable", "inverse", folder / "cable.yaml", folder / "places.csv").out
    (folder / "lengths.csv").write_text(lengths, encoding="utf-8")
    return folder


def shown(parts: list[object], width: int) -> str:
    stream = io.StringIO()
    console = Console(file=stream, width=width, highlight=False, markup=False, emoji=False)
    for part in parts:
        console.print(part)
    return stream.getvalue()


@pytest.mark.sampled(2)
@pytest.mark.parametrize("verb", VERBS)
def test_no_number_breaks(place: Path, monkeypatch: pytest.MonkeyPatch, verb: str) -> None:
    parts: list[object] = []
    monkeypatch.setattr(Terminal, "show", lambda self, *more: parts.extend(more))
    monkeypatch.chdir(place)
    ran = robocal(*VERBS[verb].split(), *(["--force"] if "identify" in verb else []))
    assert ran.status in (0, 3), ran.err
    wide = shown(parts, 1_000)
    for width in WIDTHS:
        narrow = shown(parts, width)
        assert sorted(NUMBER.findall(narrow)) == sorted(NUMBER.findall(wide)) or rows_said_anew(narrow, wide), narrow
        assert max(map(len, narrow.splitlines()), default=0) <= width


def rows_said_anew(narrow: str, wide: str) -> bool:
    """Rows as lines repeat their headers or leave them out, of which one holds a number ("95 %"): no other is lost, none is
    new."""
    once, known = NUMBER.findall(narrow), NUMBER.findall(wide)
    return set(once) <= set(known) and all(once.count(n) >= known.count(n) for n in set(known) - {"95"})


@pytest.mark.parametrize("width", range(12, 90, 3))
def test_a_table_of_any_width(width: int) -> None:
    """Down to its widest number, words give way; below, rows become lines."""
    made = PlainTable(
        "a long name of a row", "mean", "95 %", "what was found there, in words", right=(1, 2), title="title"
    )
    made.add_row(
        "before the calibration",
        "1234.5678",
        "-0.000123",
        Text("0.25 mm beside the axis of j2, in file tracker_2024.csv"),
    )
    made.add_row("after", "1.25e-09", "+12.5", "")
    said = shown([made], width)
    assert max(map(len, said.splitlines())) <= width
    for number in ("1234.5678", "-0.000123", "1.25e-09", "+12.5", "0.25"):
        assert number in NUMBER.findall(said), said
    assert "..." not in said and "…" not in said and "title" in said
