"""Valid files of every sort, damaged at random, by mistake and on purpose: never a traceback, never a hang, never a message
that cannot be read, never exit status 0 with a wrong model.

ROBOCAL_MUTATIONS is how many are made (4000 otherwise, an eighth of them in `make quick`); with ROBOCAL_MUTATIONS_LOG every one
is written down there: what was done, how it ended, seconds of the processor.

What is "wrong", when a mutation may also have changed what the files *mean* (another unit, another free parameter, another row)? The data
are simulated, so the truth is known, and with it what a claim is worth. Exit status 0 says two things, and both are checked on
configurations that nobody measured, with the instrument's place fitted again (it is no part of the claim):

- *improved*: the corrected model errs less than the nominal one that the (damaged) robot file gave;
- *by how much*: its mean error there is at most three times the unseen error that it states, plus the noise.

A damaged robot file, or a damaged cell, row or line of the table, leaves the true arm what it was: there the model is compared with
that arm itself. A damaged data file, or a whole column scaled, shifted or exchanged, describes another world (an encoder with an
offset, say), which a calibration must take as it finds it: there the model is compared with further exact measurements of the true
arm, damaged and read in the same way. Everything else must end with status 2, one message and nothing written, or with status 3.
"""

from __future__ import annotations

import functools
import json
import os
import random
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli.mutations import SLIPS, column, damaged, misspelt
from cli.runs import Ran, files, robocal, small
from cli.worlds import ARMS, WORLDS, held, run

from robocal.arms.chain import Chain
from robocal.errors import CONTROL, MESSAGE_LIMIT
from robocal.files.dataset import read_dataset
from robocal.files.robot import read_robot
from robocal.geometry import fits
from robocal.measure.data import DataSet
from robocal.prove.model_errors import model_errors

TOTAL = int(os.environ.get("ROBOCAL_MUTATIONS", "4000"))
LOG = os.environ.get("ROBOCAL_MUTATIONS_LOG")
CHUNKS = 8  # the first of them is quick
HANG = 5.0  # s of the processor
NOISE = 0.1  # mm, twice the noise per axis
NAMES = ("robot.yaml", "data.yaml", "data.csv")


class Hang(BaseException):
    """It took too long; nothing catches this."""


@contextmanager
def no_hang() -> Iterator[None]:
    """Raises Hang after five seconds of the processor."""

    def stop(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, HANG)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def attempt(about: str, act: Callable[[], Ran]) -> Ran:
    """What a command makes of damaged files; whatever must hold of any."""
    began = time.process_time()
    try:
        with no_hang():
            ran = act()
    except Hang:
        raise AssertionError(f"it hangs: {about}") from None
    if LOG:
        with open(LOG, "a", encoding="utf-8") as log:
            first = " ".join(about.splitlines()[0].split())
            log.write(f"{ran.status}\t{time.process_time() - began:.2f}\t{first}\t{ran.err.strip()[:150]!r}\n")
    about += f"\n--- status {ran.status}\n{ran.err}"
    assert "Traceback" not in ran.err and ran.status in (0, 2, 3), about
    for stream, lines in ((ran.out, "\n\t\r"), (ran.err, "\n")):  # a document may end its lines as its file does
        strange = CONTROL.search(stream.translate(dict.fromkeys(map(ord, lines), " ")))
        assert strange is None, f"{strange} reaches the terminal: {about}"
    for line in ran.err.splitlines():
        # A message is told apart from what stands before it, and from the advice that may stand behind it.
        assert len(re.sub(r"^(error|warning|note): ", "", line)) < MESSAGE_LIMIT or not line.startswith("error"), about
    if ran.status == 2:
        ran.assert_refused()
    return ran


def share(of: int, chunk: int) -> int:
    """Mutations of one chunk, for a world that gets `of` in a hundred."""
    return max(1, round(TOTAL * of / 100 / CHUNKS))


def chunks(*first: object) -> list[object]:
    return [pytest.param(*first, i, marks=[pytest.mark.slow] if i else []) for i in range(CHUNKS)]


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("name", "chunk"), [p for name in WORLDS for p in chunks(name)])
def test_damaged_files(tmp_path: Path, one_app: None, name: str, chunk: int) -> None:
    make, of = WORLDS[name]
    rng = random.Random(f"{name} {chunk}")
    folder, out = tmp_path / "world", tmp_path / "out"
    folder.mkdir()
    ends = {0: 0, 2: 0, 3: 0}
    world = make(folder, rng)
    world.write(folder)
    for command in dict.fromkeys(world.commands):
        assert run(folder, command).status in (0, 3), command  # what is right is read, and kernels are compiled
    for i in range(share(of, chunk)):
        if i % 25 == 24:
            world = make(folder, rng)
            world.write(folder)
        at = rng.choice(list(world.files))
        how, text = damaged(rng, world.files[at])
        (folder / at).write_bytes(text.encode("utf-8", "surrogatepass"))
        seal = world.sealed and at.startswith("run/") and at != "run/result.json" and rng.random() < 0.6
        if seal:
            world.seal(folder, at)
        command = rng.choice(world.commands)
        about = f"{name} {chunk}.{i}: {how} of {at}, {' '.join(map(str, command))}\n{text[:3000]}"
        before = files(folder)
        ran = attempt(about, functools.partial(run, folder, command))
        ends[ran.status] += 1
        if ran.status == 2:
            assert files(folder) == before and not out.exists(), about
        elif world.judge is not None:
            world.judge(folder, ran)
        world.write(folder)
    assert sum(ends.values()) < 60 or (ends[2] > 5 and ends[0] + ends[3] > 5), (
        ends
    )  # a fuzz that sees one end tests nothing


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", ["robots", "kinds", "cables"])
def test_a_misspelt_key_is_never_passed_over(tmp_path: Path, one_app: None, name: str) -> None:
    """It is refused, or its word is said."""
    rng = random.Random(name)
    for _ in range(30):
        world = WORLDS[name][0](tmp_path, rng)
        world.write(tmp_path)
        at = rng.choice([f for f in world.files if f.endswith(".yaml")])
        wrong, text = misspelt(rng, world.files[at])
        (tmp_path / at).write_text(text, encoding="utf-8")
        ran = run(tmp_path, world.commands[0])
        assert ran.status == 2 or wrong in ran.out + ran.err, f"{wrong} in {at}\n{text}\n{ran.err}"
        if ran.status == 2:
            assert wrong in ran.err or "key is missing" in ran.err, (wrong, ran.err)


def test_tensions_that_are_right_are_looked_at(tmp_path: Path) -> None:
    """So that `held` is no empty promise: it passes what is right, and not a tension that is a millionth off."""
    seen = set()
    for seed in range(6):
        world = WORLDS["cables"][0](tmp_path, random.Random(seed))
        world.write(tmp_path)
        ran = robocal("cable", "tension", tmp_path / "robot.yaml", tmp_path / "list.csv", "--json")
        assert ran.status == 0
        held(tmp_path, ran)
        document = ran.document
        next(c for c in document["poses"]["columns"] if c["name"].endswith(".tension"))["values"][1] *= 1 + 1e-6
        looked = "pulley" not in world.files["robot.yaml"]
        seen.add(looked)
        if looked:
            with pytest.raises(AssertionError):
                held(tmp_path, replace(ran, out=json.dumps(document)))
    assert seen == {True, False}


def mutate(rng: random.Random, texts: dict[str, str]) -> tuple[str, str, str]:
    """One file damaged once, sometimes twice, or a whole column of the table: what was done, the file, its new text."""
    name = rng.choice(NAMES)
    if name == "data.csv" and rng.random() < 0.15:
        return "column", name, column(rng, texts[name])
    how, text = damaged(rng, texts[name], SLIPS)
    return how, name, text


# --- the claim and the truth ------------------------------------------------------------------------------------------------


def true_error(model: Chain, truth: Chain) -> float:
    """Mean distance (mm) of two arms' tools on 200 configurations, after the best rigid alignment."""
    q = np.random.default_rng(5).uniform(-0.9, 0.9, (200, len(truth.joints)))
    a, b = model.pose(q)[:, :3, 3], truth.pose(q)[:, :3, 3]
    t = fits.rigid(a, b)
    return float(np.linalg.norm(a @ t[:3, :3].T + t[:3, 3] - b, axis=1).mean() * 1e3)


def wrong(ran: Ran, folder: Path, errors: Callable[[Chain], float]) -> str | None:
    """Why a result that was claimed to be an improvement is none; None when the claim holds."""
    document = ran.document
    robot = read_robot(folder / "robot.yaml")
    values = {
        p["name"]: robot.unit_of(p["name"]).to_si(p["identified"])
        for p in document["parameters"]
        if p["name"] in robot.chain.table
    }
    before, after = errors(robot.chain), errors(robot.chain.with_values(values))
    if not any(p["status"] in ("identified", "prior") and p["name"] in values for p in document["parameters"]):
        return "nothing of the robot was identified"
    claimed = document["residuals"]["held_out"] or document["residuals"]["leave_one_out"]
    if after > before + NOISE:
        return f"not improved: {before:.4g} to {after:.4g} mm"
    if after > 3 * claimed["mean"] + NOISE:
        return f"{after:.4g} mm where {claimed['mean']:.4g} mm were claimed"
    return None


def fresh_error(model: Chain, folder: Path) -> float:
    """Mean error (mm) of a model on further measurements, read through the data file as it is; every row counts alike."""
    data = read_dataset(folder / "fresh" / "data.yaml", model).dataset
    data = DataSet(data.configurations, tuple(replace(o, sigma=None) for o in data.observations))
    return float(model_errors(model, data).position.mean() * 1e3)


@pytest.mark.parametrize("chunk", chunks())
def test_what_is_called_an_improvement_is_one(tmp_path: Path, one_app: None, chunk: int) -> None:
    texts = small(tmp_path, poses=14, seed=chunk)
    further = small(tmp_path / "fresh", poses=60, seed=chunk, noise=1e-9)["data.csv"]
    truth = read_robot(tmp_path / "truth.yaml").chain
    rng = random.Random(chunk)
    ends = {0: 0, 2: 0, 3: 0}
    for i in range(share(ARMS, chunk)):
        state = rng.getstate()
        how, name, text = mutate(rng, texts)
        data = text.encode("utf-8", "surrogateescape")
        (tmp_path / name).write_bytes(data if rng.random() < 0.97 else data.replace(b"e", b"\xe9", 1))
        # Reports and fsync cost most of the time: only some runs write, all that fail must not.
        writes = rng.random() < 0.05
        output = ("-o", tmp_path / "run") if writes else ()
        command = ("identify", tmp_path / "robot.yaml", tmp_path / "data.yaml", "--json", *output)
        about = f"identify {chunk}.{i}: {how} of {name}\n{text}"
        ran = attempt(about, functools.partial(robocal, *command))
        ends[ran.status] += 1
        if ran.status == 2:
            assert not files(tmp_path / "run"), about
        elif ran.status == 0:
            if name == "data.yaml" or how == "column":
                rng_of_then = random.Random()
                rng_of_then.setstate(state)
                same = mutate(rng_of_then, {**texts, "data.csv": further})[2] if how == "column" else further
                (tmp_path / "fresh" / "data.csv").write_text(same, encoding="utf-8")
                (tmp_path / "fresh" / "data.yaml").write_bytes((tmp_path / "data.yaml").read_bytes())
                why = wrong(ran, tmp_path, functools.partial(fresh_error, folder=tmp_path))
            else:
                why = wrong(ran, tmp_path, functools.partial(true_error, truth=truth))
            assert why is None, f"{why}\n{about}"
        for path in sorted((tmp_path / "run").rglob("*"), reverse=True):
            path.unlink()
        (tmp_path / name).write_text(texts[name], encoding="utf-8")
    # A fuzz that only ever sees one end tests nothing.
    assert sum(ends.values()) < 50 or (ends[0] > 5 and ends[2] > 5), ends


def test_a_fingerprint_that_is_none(tmp_path: Path) -> None:
    """Found by mutation: a table that a stranger sealed again, with something else in the column of fingerprints."""
    world = WORLDS["runs"][0](tmp_path, random.Random(0))
    rows = world.files["run/residuals.csv"].splitlines()
    at = rows[0].split(",").index("fingerprint")
    for wrong in ("file:///etc/passwd", "f" * 17, "-1", "0x12", "1_0"):
        world.write(tmp_path)
        cells = rows[3].split(",")
        cells[at] = wrong
        text = "\n".join([*rows[:3], ",".join(cells), *rows[4:]]) + "\n"
        (tmp_path / "run" / "residuals.csv").write_text(text, encoding="utf-8")
        world.seal(tmp_path, "run/residuals.csv")
        ran = robocal("validate", tmp_path / "run", tmp_path / "data.yaml")
        ran.assert_refused("residuals.csv", "fingerprint")
