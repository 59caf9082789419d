"""Draws before-after.svg from the demo's simulated six-axis arm: python docs/img/make.py [FOLDER]."""

from __future__ import annotations

import csv
import sys
import tempfile
from pathlib import Path

from robocal.cli import main
from robocal.report.pictures import before_after


def columns(path: Path) -> dict[str, list[object]]:
    """residuals.csv by column; empty cells are None."""
    with path.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    texts = ("configuration", "set", "group", "kind", "target")
    return {
        name: [row[name] if name in texts else float(row[name]) if row[name] else None for row in rows]
        for name in rows[0]
    }


def draw() -> str:
    """The picture as SVG text."""
    with tempfile.TemporaryDirectory() as folder:
        status = main(["demo", "tracker", "-o", folder])
        if status:
            raise SystemExit(status)
        return before_after(columns(next(Path(folder).rglob("residuals.csv"))))


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    (target / "before-after.svg").write_text(draw(), encoding="utf-8")
    print(target / "before-after.svg")
