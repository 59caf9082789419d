"""What is asked of the identification of a motor, beside what is measured on a real one.

python scripts/drive_acceptance.py ../shared/data/cogging-motor       # 20 s
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

COLUMNS = "time=Time:s,angle=Position:rad,current=Iq:A"
SWEEP, SPEED = "quasi_static_sweep.txt", "speed_with_and_without_compensation.txt"


def line(what: str, asked: float, found: float, at_least: bool = True) -> None:
    """One line: asked, measured, met or not."""
    met = found >= asked if at_least else found <= asked
    word = "at least" if at_least else "at most"
    print(f"{what:<66} {word:>8} {asked:8.4g}   measured {found:8.4g}   {'met' if met else 'NOT MET'}")


def run(*words: str) -> tuple[int, dict, float, str]:
    """Status, document, processor time and messages of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-m", "robocal", "drive", *words, "--json"], capture_output=True, text=True, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return (
        done.returncode,
        json.loads(done.stdout) if done.stdout.strip().startswith("{") else {},
        cpu,
        done.stderr.strip(),
    )


def columns(listing: dict) -> dict:
    """The columns of a listing by name."""
    return {c["name"]: c["values"] for c in listing["columns"]}


def real_motor(folder: Path, out: Path) -> None:
    """The sweep and the speed log of the real motor."""
    print(
        "1. The real motor's sweep: 12 arcs of 30 degrees, each held out in turn in both directions, friction removed"
    )
    run("identify", str(folder / SWEEP), "--columns", COLUMNS)  # kernels are compiled once
    status, found, cpu, _ = run(
        "identify", str(folder / SWEEP), "--columns", COLUMNS, "-o", str(out / "run"), "--force"
    )
    orders = columns(found["orders"])
    strongest = orders["order"][int(np.argmax(orders["amplitude"]))]
    print(
        f"{'largest order':<66} {'asked':>8} {72:8d}   measured {strongest:8d}   {'met' if strongest == 72 else 'NOT MET'}"
    )
    line("orders", 20, len(orders["order"]), at_least=False)
    line("share with one lag, %", 98.5, 100 * found["share_lag"])
    line("share with phases per direction, %", 98.9, 100 * found["share_directions"])
    line("share of one direction from the other and the lag, %", 97.5, 100 * found["share_other_direction"])
    print(f"   the noise leaves {100 * found['ceiling']:.2f} % to any curve (99.1 to 99.3 were said); status {status}")
    line("processor time, s", 10, cpu, at_least=False)
    print("2. Its speed log: halves told by the effort, not by the flag")
    words = f"{COLUMNS},flag=Function Activated"
    status, found, cpu, _ = run("validate", str(out / "run"), str(folder / SPEED), "--columns", words)
    parts = columns(found["parts"])
    of = {p: i for i, p in enumerate(parts["part"])}
    on, off = of["compensated"], of["not compensated"]
    line("smooth half: the table alone, %", 80, 100 * parts["alone"][on])
    line("smooth half: with lag, gain, inertia, %", 90, 100 * parts["fitted"][on])
    print(
        f"   rough half: own fit of the same orders {100 * parts['best'][off]:.1f} % (32 was said); said: {found['warnings'][0]}"
    )
    _, found, _, _ = run("validate", str(out / "run"), str(folder / SPEED), "--columns", COLUMNS)
    again = columns(found["parts"])
    print(
        f"   without the flag: {dict(zip(again['part'], again['rows'], strict=True))} rows; {cpu:.1f} s, status {status}"
    )


def bad_input(folder: Path, out: Path) -> None:
    """Wrong logs: status 2 or 3 with the cause."""
    print("6. Wrong logs: status 2 or 3, and the cause")
    rows = np.loadtxt(folder / SWEEP, delimiter=",", skiprows=1)[:, [0, 1, 3]]
    head = "time [s],angle [rad],current [A]"

    def log(name: str, values: np.ndarray, header: str = head) -> str:
        path = out / f"{name}.csv"
        np.savetxt(path, values, delimiter=",", header=header, comments="", fmt="%.9g")
        return str(path)

    degrees = rows * [1, 180 / np.pi, 1]
    absent = rows.copy()
    absent[500, 2] = np.nan
    still = rows.copy()
    still[:, 1] = 1.0
    counts = rows.copy()
    counts[:, 1] = np.round(rows[:, 1] / (2 * np.pi) * 20000)
    rng = np.random.default_rng(1)
    other = rows.copy()
    other[:, 2] = (
        0.1 * np.sin(42 * rows[:, 1] + 1) + 0.05 * np.cos(14 * rows[:, 1]) + 0.01 * rng.standard_normal(len(rows))
    )
    shifted = rows + [0, 0.73, 0]
    half = rows[(rows[:, 1] > 0.2) & (rows[:, 1] < 3.0)]
    cases = {
        "degrees under rad": ("identify", log("degrees", degrees)),
        "columns exchanged": ("identify", log("swapped", rows, "time [s],current [A],angle [rad]")),
        "constant angle": ("identify", log("constant", still)),
        "NaN": ("identify", log("nan", absent)),
        "no units": ("identify", log("bare", rows, "time,angle,current")),
        "encoder counts": ("identify", log("counts", counts)),
        "half a turn": ("identify", log("half", half)),
        "one direction": ("identify", log("one", rows[:15716])),
        "a log of another motor under the run": ("validate", str(out / "run"), log("other", other)),
        "the angle from another zero": ("validate", str(out / "run"), log("shifted", shifted)),
    }
    for what, words in cases.items():
        status, found, _, said = run(*words)
        why = (
            said.splitlines()[0]
            if status == 2 and said
            else "; ".join((found.get("verdict") or {}).get("reasons", []) or found.get("warnings", []))
        )
        print(f"   {what:<38} status {status} {'met' if status in (2, 3) and why else 'NOT MET'}: {why[:230]}")


def main() -> None:
    """Every line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    o = parser.parse_args()
    with tempfile.TemporaryDirectory() as out:
        real_motor(o.folder, Path(out))
        bad_input(o.folder, Path(out))


if __name__ == "__main__":
    main()
