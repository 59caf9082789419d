"""Running the command line from tests, in this process or in one of its own, and the small arm that most of them
calibrate."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from advised import advice_heard, lacking, verb_of
from simulated import simulation_files, true_chain

from robocal.cli.main import main
from robocal.files.robot import parse_robot
from robocal.files.text import Source
from robocal.session.simulated_robot import Errors, Instrument, measure

ROBOT = """robocal: 1
name: three axes
kind: arm
units: {length: mm, angle: deg}
convention: khalil-hayati
joints:
  - {name: j1, alpha: 0, d: 0, theta: 0, r: 300, limits: [-150, 150]}
  - {name: j2, alpha: -90, d: 40, theta: -90, r: 0, limits: [-60, 120]}
  - {name: j3, alpha: 20, d: 250, theta: 0, r: 30, limits: [-110, 120]}
tool: {xyz: [160, 0, 20], free: false}
calibrate: {free: [j2.alpha, j2.d, j2.theta, j3.alpha, j3.d, j3.theta]}
source: invented for tests
"""


@dataclass(frozen=True)
class Ran:
    """How a command ended and what it wrote."""

    status: int
    out: str
    err: str

    @property
    def document(self) -> dict[str, Any]:
        """stdout as JSON, all of it."""
        return json.loads(self.out)

    @property
    def remarks(self) -> str:
        """stderr but for the note that a command gives when it is the first to need its kernels."""
        return "".join(line for line in self.err.splitlines(True) if not line.startswith("note: compiling kernels"))

    @property
    def said(self) -> str:
        """Everything that was printed, as one line: a remark may be wrapped."""
        return " ".join((self.out + self.remarks).split())

    def assert_refused(self, *words: str) -> None:
        """Exit status 2, one message on stderr that says all of `words`, nothing on stdout but the error where
        JSON is wanted, no traceback."""
        assert self.status == 2, (self.status, self.out, self.err)
        assert self.out == "" or list(self.document) == ["error"]
        lines = self.err.strip().splitlines()
        errors = [line for line in lines if "error:" in line]
        assert len(errors) == 1 and "Traceback" not in self.err, self.err
        for word in words:
            assert word in errors[0], (word, errors[0])


def robocal(*arguments: object, verbose: bool = True) -> Ran:
    """A command in this process, with all that it has to say; tests of what it says otherwise are in report/test_brief.py. What it advises
    it can do: every option that is named is one of its own, or stands beside the verb that has it."""
    out, err = io.StringIO(), io.StringIO()
    words = [*map(str, arguments), *(["--verbose"] if verbose else [])]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), advice_heard() as heard:
        status = main(words)
    verb = verb_of(words)
    assert not (wrong := lacking(verb, heard)), f"{verb} advises options that it has not: {wrong}"
    return Ran(status, out.getvalue(), err.getvalue())


_SAID: dict[tuple[object, ...], Ran] = {}


def shared(*arguments: object) -> Ran:
    """What `robocal` says of files that it only reads, run once for all tests that ask the same of the same content, wherever they lie.

    Beside the words counts every file of the folders that they name. Paths in what is printed are those of the first who asked.
    """
    words = [str(a) for a in arguments]
    assert not {"-o", "--output"} & set(words), "what writes is nobody else's"
    places = [Path(w) for w in words if Path(w).exists()]
    folders = list(dict.fromkeys(p if p.is_dir() else p.parent for p in places))
    content = [(f.name, f.read_bytes()) for folder in folders for f in sorted(folder.rglob("*")) if f.is_file()]
    asked = tuple(Path(w).name if Path(w) in places else w for w in words)
    key = (asked, os.environ.get("COLUMNS"), hashlib.sha256(repr(content).encode()).digest())
    if key not in _SAID:
        _SAID[key] = robocal(*arguments)
    return _SAID[key]


def process(*arguments: object, **options: Any) -> subprocess.Popen[str]:
    """A command in a process of its own, started."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | options
    environment = {**os.environ, "COLUMNS": "100"} | options.pop("env", {})
    return subprocess.Popen([sys.executable, "-m", "robocal.cli", *map(str, arguments)], env=environment, **options)


def finished(started: subprocess.Popen[str]) -> Ran:
    """The same when it has ended."""
    out, err = started.communicate(timeout=120)
    return Ran(started.returncode, out or "", err or "")


def small(
    folder: Path, *, poses: int = 30, noise: float = 5e-5, frame: bool = True, seed: int = 3, error: float = 1.0
) -> dict[str, str]:
    """Writes robot.yaml, truth.yaml, data.csv and data.yaml of the small arm; returns their texts."""
    robot = parse_robot(Source(Path("robot.yaml"), ROBOT, "0" * 64))
    rng = np.random.default_rng(seed)
    geometry = Errors(
        values=tuple((n, robot.chain.table[n].value + error * rng.normal(0, 1e-3)) for n in robot.chain.table.free)
    )
    truth = true_chain(robot.chain, Errors(0.0, 0.0, geometry.values), rng)
    low, high = robot.chain.limits.T
    # Degrees with few digits, so that files stay short.
    q = np.radians(np.round(np.degrees(rng.uniform(0.6 * low, 0.6 * high, (poses, 3))), 3))
    instrument = Instrument(noise=noise, frame=(0.9, -0.6, 0.4, 0.02, -0.03, 2.1) if frame else None)
    texts = simulation_files(robot, truth, measure(truth, q, instrument, rng), "for tests")
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return texts


def files(folder: Path) -> set[str]:
    """Every file below a folder."""
    return {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()} if folder.exists() else set()
