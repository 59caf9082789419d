"""Valid files, damaged at random: never a traceback, never exit status 0 with a wrong model.

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
import random
import string
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli.runs import Ran, files, robocal, small

from robocal.arms.chain import Chain
from robocal.files.dataset import read_dataset
from robocal.files.robot import read_robot
from robocal.geometry import fits
from robocal.jobs.validate import model_errors
from robocal.measure.data import DataSet

CHUNKS, EACH = 20, 105  # 2100 mutations
NOISE = 0.1  # mm, twice the noise per axis
NAMES = ("robot.yaml", "data.yaml", "data.csv")
WORDS = (
    "nan .nan inf -inf 0 -1 1e308 1e-308 999999999999999999999 true null ~ [] {} '' \"\" deg rad mm m cm inch khalil dh mdh poe "
    "elements fixed prismatic revolute position pose euler tool base j1 j2 j9 x 0x10 1_000 .5 5. "
    "1,5 - : # & * ! % @ | > \t \0 é \u2028 <robot/> ---"
).split(" ")


# --- mutations: text in, text out -------------------------------------------------------------------------------------------


def drop(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + text[at + rng.choice((1, 1, 1, 3, 20)) :]


def insert(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + rng.choice((rng.choice(string.printable), rng.choice(WORDS))) + text[at:]


def other_character(rng: random.Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(string.printable) + text[at + 1 :]


def other_digit(rng: random.Random, text: str) -> str:
    places = [i for i, c in enumerate(text) if c.isdigit()]
    at = rng.choice(places)
    return text[:at] + rng.choice(string.digits) + text[at + 1 :]


def _tokens(text: str) -> list[tuple[int, int]]:
    out, start = [], None
    for i, c in enumerate(text + " "):
        if c.isalnum() or c in "._-+":
            start = i if start is None else start
        elif start is not None:
            out.append((start, i))
            start = None
    return out


def other_word(rng: random.Random, text: str) -> str:
    a, b = rng.choice(_tokens(text))
    return text[:a] + rng.choice(WORDS) + text[b:]


def other_number(rng: random.Random, text: str) -> str:
    numbers = [(a, b) for a, b in _tokens(text) if _is_number(text[a:b])]
    a, b = rng.choice(numbers)
    value = float(text[a:b])
    made = rng.choice(
        (-value, value * 1000, value / 1000, value * 57.29578, value + rng.gauss(0, 1), value * 25.4, 0.0, value * 1e9)
    )
    return text[:a] + repr(made) + text[b:]


def _is_number(word: str) -> bool:
    try:
        return np.isfinite(float(word))
    except ValueError:
        return False


def swap_words(rng: random.Random, text: str) -> str:
    (a, b), (c, d) = sorted(rng.sample(_tokens(text), 2))
    return text[:a] + text[c:d] + text[b:c] + text[a:b] + text[d:]


def lines(rng: random.Random, text: str) -> str:
    rows = text.splitlines(keepends=True)
    i, j = rng.randrange(len(rows)), rng.randrange(len(rows))
    match rng.randrange(4):
        case 0:
            del rows[i]
        case 1:
            rows.insert(j, rows[i])
        case 2:
            rows[i], rows[j] = rows[j], rows[i]
        case _:
            rows[i] = rng.choice(("  ", "\t", "- ")) + rows[i]
    return "".join(rows)


def truncate(rng: random.Random, text: str) -> str:
    return text[: rng.randrange(len(text))]


def column(rng: random.Random, text: str) -> str:
    """A whole column of the table scaled, shifted, emptied or exchanged with another."""
    rows = [row.split(",") for row in text.splitlines()]
    width = min(len(row) for row in rows[1:])
    if width < 3:
        return truncate(rng, text)
    a, b, how = rng.randrange(width), rng.randrange(width), rng.randrange(4)
    factor = rng.choice((-1.0, 1e-3, 1e3, 10.0, 57.29578, 0.0174533, 1.02))
    for row in rows[2:] if how < 3 else rows[1:]:
        if how == 3:
            row[a], row[b] = row[b], row[a]
        elif _is_number(row[a]):
            row[a] = repr(float(row[a]) * factor) if how == 0 else repr(float(row[a]) + factor) if how == 1 else row[b]
    return "\n".join([",".join(row) for row in rows]) + "\n"


ANY: tuple[Callable[[random.Random, str], str], ...] = (
    drop, insert, other_character, other_digit, other_digit, other_word, other_word,
    other_number, other_number, swap_words, lines, truncate,
)  # fmt: skip


def mutate(rng: random.Random, texts: dict[str, str]) -> tuple[str, str, str]:
    """One file damaged once, sometimes twice, or a whole column of the table: what was done, the file, its new text."""
    name = rng.choice(NAMES)
    if name == "data.csv" and rng.random() < 0.15:
        return "column", name, column(rng, texts[name])
    done, text = [], texts[name]
    for _ in range(rng.choice((1, 1, 1, 2))):
        how = rng.choice(ANY)
        text = how(rng, text) if text.strip() else text
        done.append(how.__name__)
        if not _tokens(text) or not any(c.isdigit() for c in text):
            break
    return "+".join(done), name, text


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


@pytest.fixture
def one_app(monkeypatch: pytest.MonkeyPatch) -> None:
    """Builds the command line once: a third of the time of a small run."""
    import typer

    from robocal.cli import app

    built = functools.cache(lambda: typer.main.get_command(app.build()))()
    monkeypatch.setattr(app, "build", lambda: built)


@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_damaged_files(tmp_path: Path, one_app: None, chunk: int) -> None:
    texts = small(tmp_path, poses=14, seed=chunk)
    further = small(tmp_path / "fresh", poses=60, seed=chunk, noise=1e-9)["data.csv"]
    truth = read_robot(tmp_path / "truth.yaml").chain
    rng = random.Random(chunk)
    ends = {0: 0, 2: 0, 3: 0}
    for i in range(EACH):
        state = rng.getstate()
        how, name, text = mutate(rng, texts)
        data = text.encode("utf-8", "surrogateescape")
        (tmp_path / name).write_bytes(data if rng.random() < 0.97 else data.replace(b"e", b"\xe9", 1))
        # Reports and fsync cost most of the time: only some runs write, all that fail must not.
        writes = rng.random() < 0.05
        output = ("-o", tmp_path / "run") if writes else ()
        ran = robocal("identify", tmp_path / "robot.yaml", tmp_path / "data.yaml", "--json", *output)
        about = f"chunk {chunk}, mutation {i}: {how} of {name}\n{text}\n--- status {ran.status}\n{ran.err}"
        assert "Traceback" not in ran.err, about
        assert ran.status in ends, about
        ends[ran.status] += 1
        if ran.status == 2:
            ran.assert_refused()
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
    assert ends[0] > 10 and ends[2] > 10, ends
