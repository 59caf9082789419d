"""What a user waits for: whole commands, a process for each, of this state of the project and of another one in the same run.

    python -m benchmarks --section waits [--against OTHER/src] [--waits-rounds 5]

CPU seconds (user and system), seconds by the clock and the largest memory of the process; medians of rounds in which both states take
turns, after one run of each that fills its cache. First runs begin with an empty cache, and CPU counts the process that compiles beside.
Calls of Python (`wait_calls.py`) count themselves: seconds of the call, without the start. The data are made by `robocal simulate` of
this state, once, under `.cache/waits`; both states read the same files, and run folders that they have written themselves. A command that
a state does not finish has no numbers of it.
"""

import csv
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from contestants import THREADS
from wait_calls import CALLS

HERE = Path(__file__).resolve().parent
OWN = HERE.parent / "src"
DATA = HERE / ".cache" / "waits"
CABLES = HERE.parent / "examples" / "cable-laval" / "robot.yaml"
ROUNDS = 5
MEGABYTE = 1024.0  # in what the system counts

SEEN = "--free ax,ay,az,l0"  # without anything free of the robot there would be nothing to compare

# What makes the folders of data, and a run folder beside the data.
MADE = {
    "few": "simulate irb-120 -n 80",
    "rows": "simulate irb-120 -n 10000",
    "many": "simulate irb-120 -n 100000",
    "seen": "simulate irb-120 -n 100000 --kind pose --noise 0.05",
    "seen-again": "simulate irb-120 -n 100000 --kind pose --noise 0.1",
    "cables-few": f"simulate {CABLES} -n 80",
    "cables": f"simulate {CABLES} -n 10000",
    "cables-later": f"simulate {CABLES} -n 10000 --seed 1",
}
# What `corner_data.py` makes of the same name.
CORNERS = ("cable", "cable-map", "arm-map", "cameras")
RUNS = {"few": "few/robot.yaml few/data.yaml"} | {
    name: f"{name}/robot.yaml {name}/lengths.yaml {name}/pose.yaml {SEEN}" for name in ("cables", "cables-later")
}
# Columns of a folder's table that a file of its own has.
CUT = {
    "few/program.csv": ("few/data.csv", ("configuration", "j")),
    "rows/program.csv": ("rows/data.csv", ("configuration", "j")),
    "seen/poses.csv": ("seen/data.csv", ("configuration", "x", "y", "z", "r")),
    "seen-again/poses.csv": ("seen-again/data.csv", ("configuration", "x", "y", "z", "r")),
}
WAITS = {
    "version": "--version",
    "identify -o, 80 poses": "identify few/robot.yaml few/data.yaml -o OUT",
    "identify -o, 10 000 rows": "identify rows/robot.yaml rows/data.yaml -o OUT",
    "identify -o, 100 000 rows": "identify many/robot.yaml many/data.yaml -o OUT",
    "check, 100 000 rows": "check many/robot.yaml many/data.yaml",
    "verify -o, 100 000 poses": "verify seen/poses.csv seen-again/poses.csv -o OUT",
    "validate, 80 rows": "validate few/RUN few/data.yaml",
    "validate, 10 000 rows": "validate few/RUN rows/data.yaml",
    "compensate, 80 rows": "compensate few/RUN few/program.csv -o OUT",
    "compensate, 10 000 rows": "compensate few/RUN rows/program.csv -o OUT",
    "check, 1 000 corners of a cable robot": "check cable/robot.yaml cable/lengths.yaml cable/camera.yaml",
    "check, 10 000 corners of a cable robot": "check cable-map/robot.yaml cable-map/lengths.yaml cable-map/camera.yaml",
    "identify, 9 500 corners of four cameras": "identify irb-120 "
    + " ".join(f"cameras/camera{k}.yaml" for k in range(4)),
    "identify, 10 000 corners, arm and map": "identify irb-120 arm-map/camera.yaml",
    "identify, 10 000 corners, cables and map": "identify cable-map/robot.yaml cable-map/lengths.yaml cable-map/camera.yaml",
    "cable drift, two runs of 10 000 rows": "cable drift cables/RUN cables-later/RUN",
}
# The same with an empty cache: what is compiled counts.
FIRST = {
    "first identify of an arm": "identify few/robot.yaml few/data.yaml -o OUT",
    "first cable poses": f"cable poses {CABLES} -n 100 -o OUT",
    "first identify of a cable robot": f"identify cables-few/robot.yaml cables-few/lengths.yaml cables-few/pose.yaml {SEEN} -o OUT",
}
# What is asked of some: CPU seconds, or which share of those of the other state.
ASKED = {
    "identify, 10 000 corners, arm and map": {"cpu_s": 10.0},
    "identify, 10 000 corners, cables and map": {"cpu_s": 10.0},
    "check, 1 000 corners of a cable robot": {"cpu_s_over_before": 0.15},
    "identify, 9 500 corners of four cameras": {"cpu_s_over_before": 0.12},
}
# Counts a command with all that it starts, also what outlives it: of those it is the parent (on Linux).
COUNT = """
import ctypes, os, resource, subprocess, sys, time
getattr(ctypes.CDLL(None), "prctl", lambda *_: None)(36, 1, 0, 0, 0)
began, quiet = time.perf_counter(), subprocess.DEVNULL
status = subprocess.call(sys.argv[1:], stdout=quiet, stderr=quiet)
wall = time.perf_counter() - began
try:
    while True:
        os.wait()
except ChildProcessError:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(status, wall, used.ru_utime + used.ru_stime, used.ru_maxrss)
"""
LONG = 60.0  # seconds of CPU: what takes a state longer is run once
MOST = 600  # seconds of CPU: what takes longer is not finished


@dataclass(frozen=True)
class Cost:
    """Of one process: CPU seconds, the largest memory in MB, and seconds by the clock."""

    cpu: float
    memory: float
    wall: float = 0.0


@dataclass(frozen=True)
class State:
    """A state of the project: what it is called in the results, and its sources."""

    name: str
    source: Path

    @property
    def python(self) -> Path:
        """The interpreter beside its sources, in `.venv`, where there is one: it has the packages of that state."""
        own = self.source.parent / ".venv" / "bin" / "python"
        return own if own.exists() else Path(sys.executable)

    @property
    def environment(self) -> dict[str, str]:
        """One thread, its sources, and a cache of its own: robocal keeps few, and other states would take turns in it."""
        own = {"PYTHONPATH": str(self.source), "ROBOCAL_CACHE_DIR": str(DATA / f"cache-{self.name}")}
        return os.environ | THREADS | own

    def run(self, words: str, first: bool = False) -> Cost | None:
        """A command in the folder of the data, `first` with an empty cache; None where it does not finish."""
        with tempfile.TemporaryDirectory() as folder:
            words = words.replace("OUT", f"{folder}/out").replace("RUN", f"run-{self.name}")
            empty = {"ROBOCAL_CACHE_DIR": f"{folder}/cache"} if first else {}
            command = [sys.executable, "-c", COUNT, str(self.python), "-m", "robocal", *words.split()]
            limit = partial(resource.setrlimit, resource.RLIMIT_CPU, (MOST, MOST))
            kept = {"env": self.environment | empty, "cwd": DATA, "preexec_fn": limit}
            done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, **kept)
        status, wall, cpu, memory = map(float, done.stdout.split())
        # 3 says that a result must not be trusted: it was computed all the same.
        return Cost(cpu, memory / MEGABYTE, wall) if status in (0, 3) else None

    def call(self, name: str) -> Cost | None:
        """A call of Python, by its own clock; None where the state has no benchmarks, or not this one."""
        command = [str(self.python), str(HERE / "wait_calls.py"), str(self.source.parent / "benchmarks"), name]
        done = subprocess.run(command, env=self.environment, cwd=HERE, capture_output=True, text=True)
        return Cost(float(done.stdout), 0.0) if done.returncode == 0 else None

    def prepare(self, wanted) -> None:
        """Writes the run folders that commands read."""
        for folder in [f for f in RUNS if f in wanted]:
            self.run(f"identify {RUNS[folder]} -o {folder}/RUN --force")


def prepare(wanted) -> None:
    """Makes the data that some commands read, where they are not there."""
    for folder in [f for f in MADE if f in wanted and not (DATA / f / "done").exists()]:
        shutil.rmtree(DATA / folder, ignore_errors=True)
        DATA.mkdir(parents=True, exist_ok=True)
        if State("new", OWN).run(f"{MADE[folder]} -o {folder}") is None:
            raise RuntimeError(f"data could not be made: robocal {MADE[folder]}")
        for name, (source, columns) in CUT.items():
            if name.startswith(f"{folder}/"):
                cut(DATA / source, DATA / name, columns)
        (DATA / folder / "done").touch()
    for folder in [f for f in CORNERS if f in wanted and not (DATA / f / "done").exists()]:
        made = [sys.executable, str(HERE / "corner_data.py"), folder, str(DATA / folder)]
        subprocess.run(made, env=os.environ | THREADS | {"PYTHONPATH": str(OWN)}, check=True)
        (DATA / folder / "done").touch()


def cut(source: Path, target: Path, begins) -> None:
    """A table with those columns whose names begin so; the first one is the id."""
    with source.open(newline="") as given, target.open("w", newline="") as out:
        rows = csv.reader(line for line in given if not line.startswith("#"))
        header = next(rows)
        kept = [i for i, name in enumerate(header) if name.startswith(begins)]
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["id", *(header[i] for i in kept[1:])])
        writer.writerows([row[i] for i in kept] for row in rows)


def measure(names, against: Path | None, rounds: int) -> list[dict]:
    """A row for each command: medians of this state, of the other one, and what this one takes of that."""
    commands = WAITS | FIRST
    wanted = {word.split("/")[0] for name in names for word in commands.get(name, "").split() if "/" in word}
    prepare(wanted)
    states = [State("new", OWN)] + ([State("before", against)] if against else [])
    for state in states:
        if state.run("--version") is None:
            raise RuntimeError(f"{state.source}: robocal does not start by {state.python}; make its .venv beside it")
        state.prepare(wanted)
    rows = []
    for name in names:
        costs: dict[str, list[Cost]] = {state.name: [] for state in states}
        asked = list(states)
        for turn in range(name not in WAITS, rounds + 1):  # what begins empty, or has its own warm-up, needs none
            for state in list(asked):
                cost = state.run(commands[name], name in FIRST) if name in commands else state.call(name)
                if cost is None or cost.cpu > LONG:
                    asked.remove(state)
                if cost is not None and (turn or cost.cpu > LONG):  # the first one fills the cache
                    costs[state.name].append(cost)
        rows.append(summarise(name, costs))
        print(rows[-1], file=sys.stderr, flush=True)
    return rows


def summarise(name: str, costs: dict[str, list[Cost]]) -> dict:
    """A command as a row of the results."""
    row: dict = {"what": name, "rounds": max(map(len, costs.values()))}
    for state, found in costs.items():
        key = "before_" if state == "before" else ""
        row[f"{key}cpu_s"] = statistics.median(c.cpu for c in found) if found else None
        row[f"{key}wall_s"] = statistics.median(c.wall for c in found) or None if found else None
        row[f"{key}peak_MB"] = statistics.median(c.memory for c in found) or None if found else None
    for what in ("cpu_s", "wall_s", "peak_MB"):
        now, before = row[what], row.get(f"before_{what}")
        row[f"{what}_over_before"] = now / before if now and before else None
    return row | {f"asked_{what}": most for what, most in ASKED.get(name, {}).items()}


def section(against: Path | None = None, rounds: int = ROUNDS, names=()) -> list[dict]:
    """Every command and call, or those whose names hold one of these words."""
    every = (*WAITS, *FIRST, *CALLS)
    return measure([n for n in every if not names or any(word in n for word in names)], against, rounds)
