"""What a user waits for: whole commands, a process for each, of this state of the project and of another one in the same run.

    python -m benchmarks --section waits [--against OTHER/src] [--waits-rounds 5] [--waits-out FOLDER] [--waits-minutes 9] [--waits-jobs 4]

CPU seconds (user and system), seconds by the clock and the largest memory of the process; medians of rounds in which both states take
turns, after one run of each that fills its cache. First runs begin with an empty cache, and CPU counts the process that compiles beside.
Calls of Python (`wait_calls.py`) count themselves: seconds of the call, without the start. The data are made by `robocal simulate` of
this state, once; both states read the same files, and run folders that they have written themselves. A command that a state does not
finish has no numbers of it. Rows stand in `wait_rows.py`, what is asked of them in `wait_asked.py`.

FOLDER keeps data and rounds: the same command goes on where it ended, when `--waits-minutes` were over or it was stopped. Several jobs
measure several rows at a time, for machines with many cores; the rounds of a row stay one after the other.
"""

import csv
import json
import os
import shutil
import statistics
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import table
import wait_asked
from contestants import THREADS
from wait_calls import CALLS
from wait_rows import ALONE, CORNERS, CUT, FIRST, IMPORTS, MADE, RUNS, SERIES, TEXTS, TRACKER, WAITS
from wait_states import Late, Log, State

HERE = Path(__file__).resolve().parent
OWN = HERE.parent / "src"
DATA = HERE / ".cache" / "waits"
ROUNDS = 5
LONG = 120.0  # seconds of CPU: what takes a state longer is run once
ONCE = ("56-pose job", "parity", "make test")  # programs that count by themselves, of this state


@dataclass(frozen=True)
class Run:
    """A whole run: its states, the new one first, how many rounds, and what was measured so far."""

    states: list[State]
    rounds: int
    log: Log
    lock: threading.Lock

    def row(self, name: str) -> dict:
        """All rounds of a row that are not in the log yet; what is over before is a row of what there is."""
        try:
            if name in ONCE:
                self.once(name)
            else:
                self.turns(name)
        except Late:
            pass
        made = summarise(name, self.log.of(name), self.rounds)
        print(made, file=sys.stderr, flush=True)
        return made

    def turns(self, name: str) -> None:
        asked = self.states[:1] if name in ALONE else list(self.states)
        warm = name in WAITS or name in IMPORTS  # what begins empty, or has its own warm-up, needs none
        for turn in range(not warm, self.rounds + 1):
            for state in list(asked):
                known = [x for x in self.log.of(name) if x["state"] == state.name]
                done = next((x for x in known if x["turn"] == turn), None) or self.visit(name, state, turn)
                if done["cpu"] is None or done["cpu"] > LONG:
                    asked.remove(state)

    def visit(self, name: str, state: State, turn: int) -> dict:
        """One process of one state, told to the log."""
        why = ""
        if name in CALLS:
            cost = state.call(name)
        elif name in IMPORTS:
            cost = state.imports(IMPORTS[name])
        else:
            cost, why = state.attempt((WAITS | FIRST)[name], name in FIRST, turn)
        numbers = {"cpu": cost and cost.cpu, "wall": cost and cost.wall, "memory": cost and cost.memory}
        if why:
            print(f"{state.name}: {name}: {why}", file=sys.stderr, flush=True)
        return self.tell({"row": name, "state": state.name, "turn": turn} | numbers)

    def once(self, name: str) -> None:
        if not self.log.of(name):
            self.tell(
                {"row": name} | {"56-pose job": race, "parity": parity, "make test": make_test}[name](self.states[0])
            )

    def tell(self, line: dict) -> dict:
        with self.lock:
            self.log.add(line)
        return line


def race(state: State) -> dict:
    """The 56-pose job beside pyceres: robocal's time over that of its best form."""
    result = state.data / "race.json"
    command = [sys.executable, str(HERE / "run.py"), "--only", "robocal", "pyceres", "--no-sections", "--rounds", "5"]
    state.wait([*command, "-o", str(result)])
    found = json.loads(result.read_text()) if result.exists() else {"contestants": [], "skipped": []}
    times = {row["name"]: row["seconds"]["median"] for row in found["contestants"]}
    peers = [seconds for name, seconds in times.items() if name.startswith("pyceres")]
    if not peers or "robocal" not in times:
        why = next((s["reason"] for s in found["skipped"]), "no result")
        return {"said": f"pyceres is not installed: {why}"}
    return {"over_pyceres": times["robocal"] / min(peers)}


def parity(state: State) -> dict:
    """How many commands say something else than the reference of `scripts/parity.py`."""
    said = state.wait([str(state.python), str(HERE.parent / "scripts" / "parity.py")])[1]
    words = [line.split()[0] for line in said.splitlines() if line.startswith(("same ", "differs "))]
    return {"differ": words.count("differs"), "of": len(words)} if words else {"said": "did not finish"}


def make_test(state: State) -> dict:
    """Minutes of `make clean test`, which needs the internet: only where it was asked for by its name."""
    began = time.monotonic()
    status = state.wait(["make", "-C", str(HERE.parent), "clean", "test"])[0]
    return {"minutes": (time.monotonic() - began) / 60, "status": status} | (
        {"said": "a test failed"} if status else {}
    )


def prepare(wanted, state: State) -> None:
    """Makes the data that some commands read, where they are not there."""
    data = state.data
    data.mkdir(parents=True, exist_ok=True)
    for name, text in TEXTS.items():
        (data / name).parent.mkdir(exist_ok=True)
        (data / name).write_text(text)
    (data / "ur10").mkdir(exist_ok=True)
    for file in (TRACKER / "robot.yaml", TRACKER / "data.yaml", SERIES):
        if file.exists():
            shutil.copy(file, data / "ur10" / file.name)
    for folder in [f for f in MADE if f in wanted and not (data / f / "done").exists()]:
        shutil.rmtree(data / folder, ignore_errors=True)
        cost, why = state.attempt(f"{MADE[folder]} -o {folder}")
        if cost is None:
            raise RuntimeError(f"data could not be made: robocal {MADE[folder]}: {why}")
        for name, (source, columns) in CUT.items():
            if name.startswith(f"{folder}/"):
                cut(data / source, data / name, columns)
        (data / folder / "done").touch()
    for folder in [f for f in CORNERS if f in wanted and not (data / f / "done").exists()]:
        made = [sys.executable, str(HERE / "corner_data.py"), folder, str(data / folder)]
        subprocess.run(made, env=os.environ | THREADS | {"PYTHONPATH": str(OWN)}, check=True)
        (data / folder / "done").touch()


def prepare_runs(wanted, state: State) -> None:
    """Writes the run folders that commands read, where they are not there."""
    for folder in [f for f in RUNS if f in wanted]:
        if not (state.data / folder / f"run-{state.name}" / "result.json").exists():
            cost, why = state.attempt(f"identify {RUNS[folder]} -o {folder}/RUN --force")
            if cost is None:
                print(f"{state.name}: no run folder of {folder}: {why}", file=sys.stderr, flush=True)


def cut(source: Path, target: Path, begins) -> None:
    """A table with those columns whose names begin so; the first one is the id."""
    with source.open(newline="") as given, target.open("w", newline="") as out:
        rows = csv.reader(line for line in given if not line.startswith("#"))
        header = next(rows)
        kept = [i for i, name in enumerate(header) if name.startswith(begins)]
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["id", *(header[i] for i in kept[1:])])
        writer.writerows([row[i] for i in kept] for row in rows)


def measure(names, states: list[State], rounds: int, out: Path | None, jobs: int) -> list[dict]:
    """A row for each command: medians of this state, of the other one, and what this one takes of that."""
    commands = WAITS | FIRST | IMPORTS
    wanted = {word.split("/")[0] for name in names for word in commands.get(name, "").split() if "/" in word}
    log = Log(out, states)
    try:
        prepare(wanted, states[0])
        for state in states:
            cost, why = state.attempt("--version")
            if cost is None:
                missing = "make its .venv beside it, or write --against SRC:FOLDER with the packages that it lacks"
                raise RuntimeError(f"{state.source}: robocal does not start by {state.python}; {missing}: {why}")
            prepare_runs(wanted, state)
    except Late:
        return [summarise(name, log.of(name), rounds) for name in names]
    run = Run(states, rounds, log, threading.Lock())
    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(run.row, names))


def summarise(name: str, told: list[dict], rounds: int) -> dict:
    """A row of the results from the lines of the log: medians, ratios, and why there is no number where there is none."""
    row: dict = {"what": name}
    if name in ONCE:
        kept = (
            told[-1]
            if told
            else {"said": "not measured: ask for it by its name" if name == "make test" else "not measured"}
        )
        return row | {key: value for key, value in kept.items() if key != "row"}
    # A state that takes long was run once, and that counts; else the first one filled the cache.
    counted = [x for x in told if x["cpu"] is not None and (x["turn"] or x["cpu"] > LONG)]
    counts = []
    for key, state in (("", "new"), ("before_", "before")):
        own = [x for x in counted if x["state"] == state]
        counts.append(len(own))
        for of, to in (("cpu", "cpu_s"), ("wall", "wall_s"), ("memory", "peak_MB")):
            row[key + to] = statistics.median(x[of] for x in own) or None if own else None
    row["rounds"] = max(counts)
    for what in ("cpu_s", "wall_s", "peak_MB"):
        now, before = row[what], row[f"before_{what}"]
        row[f"{what}_over_before"] = now / before if now and before else None
    stopped = sorted({x["state"] for x in told if x["cpu"] is None})
    if stopped and "UR10" in name and not SERIES.exists():
        row["said"] = f"needs {SERIES.name} in ../shared/data"
    elif stopped:
        row["said"] = f"not finished by: {', '.join(stopped)}"
    elif row["rounds"] < rounds and not any(x["cpu"] > LONG for x in told):
        row["said"] = f"{row['rounds']} of {rounds} rounds"
    return row


def chosen(words) -> list[str]:
    """Every row, or those whose names hold one of these words; the suite of tests only by its name."""
    every = (*IMPORTS, *WAITS, *FIRST, *CALLS, *ONCE)
    return [n for n in every if any(word in n for word in words) or (not words and n != "make test")]


def section(against=None, rounds: int = ROUNDS, words=(), out=None, minutes=None, jobs: int = 1) -> list[dict]:
    """The rows, and on the terminal what was asked and measured."""
    out = out and out.resolve()  # commands run in another folder
    data = out / "data" if out else DATA
    data.mkdir(parents=True, exist_ok=True)
    until = time.monotonic() + 60.0 * minutes if minutes else float("inf")
    states = [State("new", OWN, data, until)]
    if against:  # like PYTHONPATH: the sources first, then packages that only they need
        source, *packages = against.split(os.pathsep)
        folders = tuple([str(Path(folder).resolve()) for folder in packages if folder])
        states.append(State("before", Path(source).resolve(), data, until, folders))
    rows = measure(chosen(words), states, rounds, out, jobs)
    print(f"\nwhat a user waits for: asked and measured\n{table.section_table(wait_asked.judged(rows))}")
    return rows
