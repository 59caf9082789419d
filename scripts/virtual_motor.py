"""What a simulated motor's compensation is worth, over seeds and gains of the sweep, and whether the repair of escaped arcs ever harms.

    python scripts/virtual_motor.py examples/cogging/motor.yaml --seeds 0-4
    python scripts/virtual_motor.py examples/cogging/motor.yaml --seeds 0-4 --escapes
    python scripts/virtual_motor.py --pool FOLDER

One line of JSON for each seed and gain on stdout, then the table of what was asked and what was measured. `--pool` reads the lines of other
runs from the files of a folder. With `--escapes` the gains are those from which the rotor escapes, each identified with its escaped rows
and without them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from robocal.files.motor_simulation import MotorSimulation, read_motor_simulation
from robocal.session.drive import drive_result
from robocal.session.drive.motor_trial import MotorTrial, try_motor

GAINS = (2.0, 5.0)  # N m/rad, of the document's bounds


def main() -> None:
    """Runs seeds, or pools them, and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("spec", nargs="?", type=Path, help="motor.yaml of a motor to be simulated")
    parser.add_argument("--seeds", default="0-0", help="first and last seed, as 0-4")
    parser.add_argument("--gains", default="", help="gains of the sweep in N m/rad, as 2,5")
    parser.add_argument(
        "--escapes", action="store_true", help="gains from which the rotor escapes, with and without repair"
    )
    parser.add_argument("--pool", type=Path, help="folder with the lines of other runs")
    asked = parser.parse_args()
    if asked.pool is not None:
        lines = [line for file in sorted(asked.pool.iterdir()) for line in file.read_text().splitlines()]
        rows = [json.loads(line) for line in lines if line.startswith("{")]
    else:
        motor = read_motor_simulation(asked.spec)
        usual = motor.escapes if asked.escapes else GAINS
        gains = tuple(float(g) for g in asked.gains.split(",")) if asked.gains else usual
        first, _, last = asked.seeds.partition("-")
        rows = []
        for seed in range(int(first), int(last or first) + 1):
            for row in trials(motor, gains, seed, asked.escapes):
                print(json.dumps(row), flush=True)
                rows.append(row)
    plain, repairs = [r for r in rows if "none" not in r], [r for r in rows if "none" in r]
    if plain:
        print(bounds(plain))
    if repairs:
        print(repair(repairs))


def trials(motor: MotorSimulation, gains: tuple[float, ...], seed: int, escapes: bool) -> Iterator[dict[str, Any]]:
    """A row for each gain: the curve's error as a share of the peak, and what compensation divides by at each PID."""
    for gain in gains:
        row = {"seed": seed, "gain": gain, **numbers(try_motor(motor, gain, seed, None, ""))}
        if escapes:
            row["none"] = numbers(_without_repair(motor, gain, seed))
        yield row


def numbers(made: MotorTrial) -> dict[str, Any]:
    """What is asked of one trial."""
    return {
        "curve": made.curve_error / made.peak,
        "rms": float(np.sqrt(np.mean((made.curves[2] - made.curves[1]) ** 2))) / made.peak,
        "position": [r.gain.position for r in made.ramps],
        "effort": [r.gain.effort for r in made.ramps],
        "speed": [r.gain.speed for r in made.ramps],
        "no_mean": [r.gain_no_mean.effort for r in made.ramps],
        "status": made.identified.verdict.status,
        "orders": list(made.identified.motor_file.cogging.orders),
    }


def _without_repair(motor: MotorSimulation, gain: float, seed: int) -> MotorTrial:
    """The same where escaped rows are taken as they are."""
    kept = drive_result.escaped_rows
    drive_result.escaped_rows = lambda sweep: np.zeros(len(sweep), dtype=bool)
    try:
        return try_motor(motor, gain, seed, None, "")
    finally:
        drive_result.escaped_rows = kept


def bounds(rows: list[dict[str, Any]]) -> str:
    """What was asked and what was measured, gain by gain."""
    out = ["", "| sweep gain | seeds | asked | measured | |", "|---|---|---|---|---|"]
    for gain in sorted({r["gain"] for r in rows}):
        own = [r for r in rows if r["gain"] == gain]
        head = f"| {gain:g} | {len(own)} |"
        curve = 100 * max(r["curve"] for r in own)
        out.append(f"{head} curve within 2 % of the peak | at most {curve:.2f} % | {_met(curve <= 2)} |")
        for name, least, words in (("position", 3.0, "rms position error / 3"), ("effort", 6.0, "peak effort / 6")):
            values = np.array([r[name] for r in own])
            each = ", ".join(f"/ {v:.1f}" for v in values.min(axis=0))
            out.append(f"{head} {words} at every PID | at least {each} | {_met(values.min() >= least)} |")
        speed, mean = (np.array([r[name] for r in own]) for name in ("speed", "no_mean"))
        out.append(f"{head} peak speed error, document / 5 (1.6 to 7.3 seen) | {_ranges(speed)} | printed |")
        out.append(f"{head} effort with a table without mean, 1.8 | {_ranges(mean)} | printed |")
    return "\n".join(out)


def repair(rows: list[dict[str, Any]]) -> str:
    """The curve's error and the ramp with the repair and without it."""
    out = [
        "",
        "| sweep gain | seeds | curve, % of the peak, repaired | not repaired | position / | not | effort / | not | repair worse |",
    ]
    out.append("|---|---|---|---|---|---|---|---|---|")
    for gain in sorted({r["gain"] for r in rows}):
        own = [r for r in rows if r["gain"] == gain]
        worse = sum(map(_is_worse, own))
        cells = [
            _ranges(100 * np.array([[r["curve"]] for r in own])),
            _ranges(100 * np.array([[r["none"]["curve"]] for r in own])),
        ]
        for name in ("position", "effort"):
            cells += [_ranges(np.array([r[name] for r in own])), _ranges(np.array([r["none"][name] for r in own]))]
        out.append(
            f"| {gain:g} | {len(own)} | {' | '.join(cells)} | {worse} of {len(own)} | {', '.join(sorted({r['status'] for r in own}))} |"
        )
    met = _met(not any(map(_is_worse, rows)))
    return "\n".join([*out, "", f"asked: never worse than none, in curve or ramp; {met}"])


def _is_worse(row: dict[str, Any]) -> bool:
    """Whether the repaired curve is farther from the truth, or its ramp is followed less well at any PID."""
    none = row["none"]
    ramps = ((a, b) for name in ("position", "effort") for a, b in zip(row[name], none[name], strict=True))
    return row["curve"] > none["curve"] or row["rms"] > none["rms"] or any(a < b for a, b in ramps)


def _ranges(values: Any) -> str:
    """Least and greatest of each column (seeds, columns)."""
    return ", ".join(f"{a:.3g} to {b:.3g}" for a, b in zip(values.min(axis=0), values.max(axis=0), strict=True))


def _met(good: Any) -> str:
    return "met" if good else "NOT MET"


if __name__ == "__main__":
    main()
