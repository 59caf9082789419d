"""A real UR3 before four cameras, hand-eye only: `python scripts/ur3_cameras.py DATA`, DATA being the folder ur3-cameras.

    asked      rms of the distance in the image over views that were left out, folds i mod 4; and the board's centre against all images
    named      what is wrong in the files as recorded: lenses of larger images, two joint rows, views of other moments, half turns

The robot is nominal; lenses and frames stay as the issue states them. Each line has what was asked and what is measured.
"""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from real.ur3_cell import EXCHANGED, FOREIGN, IMAGE, write_cell

ASKED = {0: 0.65, 1: 0.80, 3: 0.86}
CENTRE, TOGETHER = 2.4, 0.8
LABELS = "half_turns: undo\n"
EYES = [f"eye{k}" for k in range(4)]


def robocal(*words: object) -> Any:
    """The document of a run, or its error."""
    ran = subprocess.run(
        [sys.executable, "-m", "robocal.cli", *map(str, words), "--json"], capture_output=True, text=True
    )
    return json.loads(ran.stdout) if ran.stdout.strip() else {"error": ran.stderr}


def of(told: Any, code: str) -> list[Any]:
    """The numbers of the remarks with a code."""
    every = (*told.get("remarks", ()), *told.get("verdict", {}).get("remarks", ()))
    return [r["numbers"] for r in every if r["code"] == code]


def line(what: str, asked: str, measured: str, met: bool) -> None:
    print(f"| {what} | {asked} | {measured} | {'met' if met else 'NOT MET'} |", flush=True)


def main() -> None:
    """The table."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("data", type=Path)
    given = words.parse_args()
    print("| what | asked | measured | |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _lenses(folder, given.data)
        _named(folder, given.data)
        _placed(folder, given.data)


def _lenses(folder: Path, source: Path) -> None:
    size = f"image: [{IMAGE[0]}, {IMAGE[1]}]\n"
    files = write_cell(folder, source, lens="", more=size)
    error = str(robocal("check", *files[:2]))
    told = "1280 x 720 px, and the lens is of 1920 x 1080 px" in error and "scale: 0.6666666666" in error
    line("lens of 1920 x 1080", "told, 2/3 on consent", "told, `scale: 0.66667`" if told else error[:80], told)
    files = write_cell(folder, source, lens="", leave_out=FOREIGN, more=LABELS)
    ratios = []
    for k in range(4):
        found = of(robocal("identify", files[0], files[1 + k], "--free", f"{EYES[k]},board"), "lens-factor")
        ratios.append(found[0]["ratio"] if found else "none")
    line("the same where no size is stated", "by each camera", ", ".join(ratios), ratios == ["2/3"] * 4)


def _named(folder: Path, source: Path) -> None:
    told = robocal("check", *write_cell(folder, source))
    turned = of(told, "target-turned")
    count = turned[0]["count"] if turned else 0
    line(
        "half turns",
        "named, undone",
        f"named in {count} views of {len(turned[0]['instruments']) if turned else 0} cameras",
        bool(turned),
    )
    files = write_cell(folder, source, more=LABELS)
    told = robocal("identify", *files, "--free", ",".join([*EYES, "board"]))
    pairs = [(n["view"], n["partner"], n["every"]) for n in of(told, "views-exchanged")]
    text = "; ".join(f"rows {int(a[1:]) + 1} and {int(b[1:]) + 1} by all {n}" for a, b, n in pairs)
    line(
        "joint rows 25 and 26",
        "an exchange, by all four",
        text or "none",
        pairs == [*[(*(f"p{i}" for i in EXCHANGED), 4)]],
    )
    views = sorted(int(o["configuration"][1:]) for o in told["outliers"] if o["rows"] > 1 and o["group"] == EYES[3])
    other = [v + 1 for v in views if v not in EXCHANGED]
    wanted = [v + 1 for v in FOREIGN[3]]
    line("views of camera 4", ", ".join(map(str, wanted)), ", ".join(map(str, other)), other == wanted)


def _placed(folder: Path, source: Path) -> None:
    files = write_cell(folder, source, exchange=True, leave_out=FOREIGN, more=LABELS)
    folds = ("--hold-out", "group", "--folds", 4)
    for k, most in ASKED.items():
        told = robocal("identify", files[0], files[1 + k], "--free", f"{EYES[k]},board", *folds)
        residuals = told["residuals"]
        found = (residuals["all_rows"] or residuals)["k_fold"]
        line(
            f"camera {k + 1} alone, {found['n']} corners", f"{most} px", f"{found['rms']:.3f} px", found["rms"] <= most
        )
    run = folder / "run"
    told = robocal("identify", *files, "--free", ",".join([*EYES, "board"]), *folds, "-o", run)
    with (run / "residuals.csv").open() as file:
        rows = list(csv.DictReader(file))
    for k in (0, 1):
        found = np.array([float(r["held_out_px"]) for r in rows if r["group"] == EYES[k]])
        rms = float(np.sqrt(np.mean(found**2)))
        line(f"camera {k + 1} of four, {len(found)} corners", f"{TOGETHER} px", f"{rms:.3f} px", rms <= TOGETHER)
    (places,) = of(told, "image-places")
    mean = places["mean"]["value"]
    line(f"board's centre, {places['poses']} poses, mean", f"{CENTRE} mm", f"{mean:.2f} mm", mean <= CENTRE)


if __name__ == "__main__":
    main()
