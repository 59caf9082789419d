"""A state of the project, and what one process of it costs: a command, the imports of a command, or a call of Python."""

import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from contestants import THREADS

HERE = Path(__file__).resolve().parent
MEGABYTE = 1024.0  # in what the system counts
MOST = 600  # seconds of CPU: what takes longer is not finished
SAID = 2000  # characters of what a command says of its failure
# Counts a command with all that it starts, also what outlives it: of those it is the parent (on Linux).
COUNT = f"""
import ctypes, os, resource, subprocess, sys, time
resource.setrlimit(resource.RLIMIT_CPU, ({MOST}, {MOST}))
getattr(ctypes.CDLL(None), "prctl", lambda *_: None)(36, 1, 0, 0, 0)
began, quiet = time.perf_counter(), subprocess.DEVNULL
status = subprocess.call(sys.argv[1:], stdout=quiet)
wall = time.perf_counter() - began
try:
    while True:
        os.wait()
except ChildProcessError:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(status, wall, used.ru_utime + used.ru_stime, used.ru_maxrss)
"""
# Runs a command, and writes the CPU seconds that went into its imports, wherever they stand.
IMPORTS = """
import _frozen_importlib as machinery, json, sys, time
load, state = machinery._find_and_load, [0, 0.0]
def counted(*given):
    if state[0]:
        return load(*given)
    state[0], began = 1, time.process_time()
    try:
        return load(*given)
    finally:
        state[0], state[1] = 0, state[1] + time.process_time() - began
machinery._find_and_load = counted
from robocal.cli.main import main
status = main(sys.argv[2:])
with open(sys.argv[1], "w") as out:
    json.dump([status, state[1]], out)
"""


class Late(Exception):
    """The time of the whole run is over: what was going on was stopped, and counts for nothing."""


@dataclass(frozen=True)
class Cost:
    """Of one process: CPU seconds, the largest memory in MB, and seconds by the clock."""

    cpu: float
    memory: float
    wall: float = 0.0


@dataclass(frozen=True)
class State:
    """A state of the project: its name in the results, its sources, the folder of the data, when everything ends, and folders of packages
    that it needs beside those of the interpreter."""

    name: str
    source: Path
    data: Path
    until: float = float("inf")  # by time.monotonic()
    packages: tuple[str, ...] = ()

    @property
    def python(self) -> Path:
        """The interpreter beside its sources, in `.venv`, where there is one: it has the packages of that state."""
        own = self.source.parent / ".venv" / "bin" / "python"
        return own if own.exists() else Path(sys.executable)

    @property
    def environment(self) -> dict[str, str]:
        """One thread, its sources, and a cache of its own: robocal keeps few, and other states would take turns in it."""
        path = os.pathsep.join([str(self.source), *self.packages])
        own = {"PYTHONPATH": path, "ROBOCAL_CACHE_DIR": str(self.data / f"cache-{self.name}")}
        return {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"} | THREADS | own

    def digest(self) -> str:
        """Of all sources: rounds of others are not mixed with these."""
        found = hashlib.sha256()
        for file in sorted(self.source.rglob("*.py")):
            found.update(file.read_bytes())
        return found.hexdigest()[:16]

    def run(self, words: str, first: bool = False, turn: int = 0) -> Cost | None:
        """A command in the folder of the data, `first` with an empty cache; None where it does not finish."""
        return self.attempt(words, first, turn)[0]

    def attempt(self, words: str, first: bool = False, turn: int = 0) -> tuple[Cost | None, str]:
        """The same, and why it did not finish."""
        with tempfile.TemporaryDirectory() as folder:
            empty = {"ROBOCAL_CACHE_DIR": f"{folder}/cache"} if first else {}
            return self._count([str(self.python), "-m", "robocal", *self._words(words, folder, turn)], empty)

    def imports(self, words: str) -> Cost | None:
        """What the imports of a command take, those included that stand in functions; without the interpreter's start."""
        with tempfile.TemporaryDirectory() as folder:
            counted = Path(folder) / "imports.json"
            self.wait([str(self.python), "-c", IMPORTS, str(counted), *self._words(words, folder, 0)])
            status, cpu = json.loads(counted.read_text()) if counted.exists() else (1, 0.0)
        return Cost(cpu, 0.0) if status in (0, 3) else None

    def call(self, name: str) -> Cost | None:
        """A call of Python, by its own clock; None where the state has not what it calls."""
        command = [str(self.python), str(HERE / "wait_calls.py"), name]
        status, said = self.wait(command)
        return Cost(float(said.split()[-1]), 0.0) if status == 0 and said.split() else None

    def wait(self, command: list[str]) -> tuple[int, str]:
        """Status of a program, and what it said."""
        return self._wait(command, {"env": self.environment, "cwd": self.data})[:2]

    def _words(self, words: str, folder: str, turn: int) -> list[str]:
        known = {"OUT": f"{folder}/out", "RUN": f"run-{self.name}", "ROUND": str(turn)}
        for name, value in known.items():
            words = words.replace(name, value)
        return words.split()

    def _count(self, command: list[str], extra: dict[str, str] | None = None) -> tuple[Cost | None, str]:
        """What a command costs; else None, and its exit status or the limit that it met, with what it wrote of that."""
        kept = {"env": self.environment | (extra or {}), "cwd": self.data}
        ended, said, wrong = self._wait([sys.executable, "-c", COUNT, *command], kept)
        if len(said.split()) != 4:
            how = f"stopped after {2 * MOST} s by the clock" if ended is None else f"not counted, status {ended}"
            return None, f"{how}: {wrong}"
        status, wall, cpu, memory = map(float, said.split())
        # 3 says that a result must not be trusted: it was computed all the same.
        if status in (0, 3):
            return Cost(cpu, memory / MEGABYTE, wall), ""
        limit = -status in (signal.SIGXCPU, signal.SIGKILL) and cpu >= MOST
        how = f"stopped after {MOST} s of CPU" if limit else f"exit status {status:.0f}"
        return None, f"{how}: {wrong or 'it said nothing'}"

    def _wait(self, command: list[str], kept: dict) -> tuple[int | None, str, str]:
        """Status, what was said, and the end of what was said of faults. At the end of the whole run, or twice the limit by the clock,
        all of it is stopped: status None."""
        left = self.until - time.monotonic()
        if left <= 0:
            raise Late
        with tempfile.TemporaryFile("w+", errors="replace") as faults:
            pipes = {"stdout": subprocess.PIPE, "stderr": faults, "text": True, "start_new_session": True}
            with subprocess.Popen(command, **pipes, **kept) as running:
                try:
                    said = running.communicate(timeout=min(left, 2.0 * MOST))[0]
                except BaseException as why:
                    with contextlib.suppress(ProcessLookupError):
                        os.killpg(running.pid, signal.SIGKILL)
                    running.wait()
                    if isinstance(why, subprocess.TimeoutExpired):
                        if left <= 2.0 * MOST:
                            raise Late from None
                        return None, "", _end(faults)
                    raise
            return running.returncode, said, _end(faults)


def _end(faults) -> str:
    faults.seek(0)
    return faults.read().strip()[-SAID:]


class Log:
    """The rounds of a run, each written when it ends, so that a run that was stopped goes on: lines of JSON in a folder."""

    def __init__(self, folder: Path | None, states: list[State]):
        self.path = folder and folder / "rounds.jsonl"
        self.lines: list[dict] = []
        own = {"states": {s.name: s.digest() for s in states}}
        if self.path and self.path.exists():
            # The last line of a run that was killed may be torn; what follows must not be glued to it.
            with self.path.open("a") as out:
                out.write("\n")
            for text in self.path.read_text().splitlines():
                with contextlib.suppress(json.JSONDecodeError):
                    self.lines.append(json.loads(text))
            if self.lines and self.lines[0] != own:
                raise RuntimeError(f"{folder}: holds rounds of other sources; name another folder")
        if not self.lines:
            self.add(own)

    def add(self, line: dict) -> None:
        self.lines.append(line)
        if self.path:
            with self.path.open("a") as out:
                out.write(json.dumps(line) + "\n")

    def of(self, row: str) -> list[dict]:
        return [line for line in self.lines if line.get("row") == row]
