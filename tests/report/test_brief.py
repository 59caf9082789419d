"""What a person sees first: the terminal in 180 words, the page in 1100 above its fold, and no number that the whole page lacks."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from advice import arm
from cli.runs import robocal

EXAMPLES = Path(__file__).parents[2] / "examples"
TERMINAL, PAGE = 180, 1100  # words
# What the first screen has to say of its own numbers.
SAID = {
    "tracker": (
        r"mean error of 16 unseen measurements",
        r"mean error of 80 unseen measurements, each predicted from all others",
    ),
    "hand-eye": (
        r"Where\s+tested at the 7 unseen of 36 configurations; over the joint limits a reading is predicted to 0\.\d+ mm",
    ),
    "cables and tracker": (
        r"mean error of the position from lengths of 20 unseen poses",
        r"mean error of all readings \(68\.57 to 2\.675 mm\) on unseen poses falls by 65\.9 mm",
        r"inner 70 % of the frame, wherever its base stands: better than nominal with over 99\.9 %; off by 2\.84 mm",
    ),
    "refused": (r"Where\s+nowhere",),
    "corners": (r"differs by 0\.\d+ mm from the nominal one; measured in px, the error before is not known in mm",),
}
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.])")


def _step(q, p, rng):
    p[len(p) // 2 :] += [2e-3, -1.4e-3, 0]
    return q, p


def _of_example(*names, options=()):
    return lambda folder: (*(EXAMPLES / name for name in names), *options)


def _of_cables(*names):
    return _of_example(*(f"cable-calibration/eight/{name}.yaml" for name in names))


RUNS = {
    "tracker": lambda folder: arm(folder, m=80),
    "refused": lambda folder: arm(folder, m=80, spoil=_step),
    "hand-eye": _of_example("hand-eye/robot.yaml", "hand-eye/data.yaml", options=("--free", "camera,board")),
    "cables and tracker": _of_cables("robot", "lengths", "poses"),
    "cables alone": _of_cables("robot", "lengths"),
    "corners": _of_example("instruments/pixels/robot.yaml", "instruments/pixels/data.yaml"),
}


def body_of(page: str) -> str:
    """The body of a page without scripts and what only screen readers read."""
    body = page[page.index("<body") :]
    return re.sub(r"<(script|style|desc|title)\b.*?</\1>", "", body, flags=re.S)


def words_of(body: str) -> str:
    return unescape(re.sub(r"<[^>]+>", " ", body)).replace("\u2212", "-")


def above_fold(body: str) -> str:
    """What is seen before anything is opened."""
    inner = re.compile(r"<details[^>]*>(?:(?!<details)(?!</details>).)*</details>", re.S)
    while found := inner.search(body):
        summary = re.search(r"<summary>.*?</summary>", found[0], re.S)
        body = body[: found.start()] + (summary[0] if summary else "") + body[found.end() :]
    return body


def numbers_of(text: str) -> set[str]:
    return {n.lstrip("+") for n in NUMBER.findall(text)}


def lost(told: str, whole: str) -> set[str]:
    """Numbers that are told and are none of the whole, rounded to their digits."""
    known = np.array(sorted(float(n) for n in numbers_of(whole)))
    missing = set()
    for word in numbers_of(told):
        digits, _, power = word.partition("e")
        step = 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))
        if np.abs(np.abs(known) - abs(float(word))).min() > 0.501 * step:
            missing.add(word)
    return missing


@pytest.mark.parametrize("name", RUNS)
def test_the_first_screens_are_short_and_say_no_number_of_their_own(name, tmp_path, monkeypatch):
    read = RUNS[name](tmp_path)
    monkeypatch.chdir(tmp_path)  # a long path is parted into words
    ran = robocal("identify", *read, "-o", "run", verbose=False)
    assert ran.status == (3 if name == "refused" else 0), ran.said
    assert len(ran.out.split()) <= TERMINAL, ran.out
    body = body_of((tmp_path / "run" / "report.html").read_text(encoding="utf-8"))
    shown = above_fold(body)
    assert len(words_of(shown).split()) <= PAGE
    assert 'id="specialist"' in body and words_of(body).count("Correlation of parameters") >= 1
    result = (tmp_path / "run" / "result.json").read_text(encoding="utf-8")
    told = "\n".join(line for line in ran.out.splitlines() if str(tmp_path) not in line)
    assert not lost(told, words_of(body) + result)
    first = words_of(body[: body.index('<section id="')])
    assert all(re.search(words, first) for words in SAID.get(name, ())), first


@pytest.mark.parametrize("name", ["tracker", "cables and tracker"])
def test_verbose_says_what_the_terminal_leaves_out(name, tmp_path):
    read = RUNS[name](tmp_path)
    brief = robocal("identify", *read, "-o", tmp_path / "brief", verbose=False)
    whole = robocal("identify", *read, "-o", tmp_path / "whole", verbose=True)
    assert len(whole.out.split()) > 2 * len(brief.out.split())
    body = words_of(body_of((tmp_path / "brief" / "report.html").read_text(encoding="utf-8")))
    result = (tmp_path / "brief" / "result.json").read_text(encoding="utf-8")
    assert not lost(whole.out, body + result)


def test_the_first_screen_answers_the_first_questions(tmp_path):
    robocal("identify", *RUNS["tracker"](tmp_path), "-o", tmp_path / "run", verbose=False)
    page = body_of((tmp_path / "run" / "report.html").read_text(encoding="utf-8"))
    first = words_of(page[: page.index('<section id="')])
    for asked in ("Improved", "95 % interval", "Where", "Moved most", "Left out", "Next", "robocal validate"):
        assert asked in first, asked


def test_a_link_may_lead_into_the_fold(tmp_path):
    robocal("identify", *RUNS["tracker"](tmp_path), "-o", tmp_path / "run", verbose=False)
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    links = re.findall(r'href="#([^"]+)"', page)
    assert {"recipe", "parameters"} <= set(links)
    assert all(f'id="{link}"' in page for link in links) and np.unique(links).size == len(links)
