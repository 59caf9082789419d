"""What Python is told names Python's arguments: no option of the command line is left in a remark, an error, a help text or a page."""

from __future__ import annotations

import inspect
import re
from importlib import import_module

import pytest

import robocal as rc
from robocal.errors import InputError
from robocal.front.spelling import python_text
from robocal.remarks.english import DECLARED, TABLE
from robocal.verbs.option import Option, entries
from robocal.verbs.registry import PATHS

OPTION = re.compile(
    r"(?<![\w-])--[a-z][a-z-]*|\brobocal (?!demo|report)(?:cable |vision |drive )?(?:[a-z]+)\b(?= [A-Z-])"
)
PAIRS = {
    "Hold out a part (--hold-out 0.2).": "Hold out a part (hold_out=0.2).",
    "Hold out blocks of time (--hold-out blocks).": 'Hold out blocks of time (hold_out="blocks").',
    "--loss cauchy allows heavy tails.": 'loss="cauchy" allows heavy tails.',
    "do without them (--exclude 3-7).": 'do without them (exclude="3-7").',
    "identify it too: leave out --free.": "identify it too: leave out free=.",
    "--leave-one-out runs it": "leave_one_out=True runs it",
    "--no-leave-one-out": "leave_one_out=False",
    "judge by --folds 5, which": "judge by folds=5, which",
    "robocal export --format offsets writes them": 'rc.export(form="offsets") writes them',
    "`cable drift --zeros-unchanged` separates": "`rc.cable.drift(zeros_unchanged=True)` separates",
    "corners.csv of robocal vision detect": "corners.csv of rc.camera.detect",
    "robocal vision hand-eye": "rc.camera.hand_eye",
    "robocal new --list shows them": "rc.new(listing=True) shows them",
    "-o DIR keeps the result": "output=DIR keeps the result",
    "robocal cable forward RUN LENGTHS": "rc.cable.forward(RUN, LENGTHS)",
    "2 more reasons: --verbose": "2 more reasons: report(file)",
    "x - y and -1 to -5 deg": "x - y and -1 to -5 deg",
    "write zeros: NAME": "write zeros: NAME",
}


@pytest.mark.parametrize("text", PAIRS)
def test_options_are_spelt_as_arguments(text: str) -> None:
    assert python_text(text, "identify") == PAIRS[text]


def test_no_remark_keeps_an_option() -> None:
    import robocal.diagnose.check_registry  # noqa: F401  the checks declare theirs

    told = [t for phrase in {**TABLE, **DECLARED}.values() for t in (phrase.sentence, phrase.advice)]
    assert sum("--" in t for t in told) > 50
    left = {t: python_text(t) for t in told if OPTION.search(python_text(t))}
    assert not left, left


@pytest.mark.parametrize("path", [p for p in PATHS if p not in ("demo", "report")])
def test_help_speaks_python(path: str) -> None:
    from robocal.front.calls import call

    said = inspect.getdoc(call(path)) or ""
    assert not OPTION.search(said), OPTION.search(said)
    assert "\nTakes\n" in said and "\nReturns\n" in said and "Raises InputError" in said
    for entry in entries(import_module(f"robocal.verbs.{path}").Options):
        assert f"\n{entry.python}: " in said


def test_every_refusal_of_an_option_names_its_argument() -> None:
    """A value of the wrong kind, of every option of every verb: the argument stands in the error, and its option does not."""
    from robocal.front.spelling import python_error

    count = 0
    for path in PATHS:
        kind = import_module(f"robocal.verbs.{path}").Options
        needed = {e.name: "a" if not e.several else ("a",) for e in entries(kind) if e.required}
        for entry in entries(kind):
            if not isinstance(entry.facts, Option) or entry.kind not in (int, float, bool) or entry.numeric:
                continue
            wrong = ("many",) if entry.several else "many"
            with pytest.raises(InputError) as caught:
                kind(**{**needed, entry.name: wrong})
            error = python_error(caught.value, path)
            assert (
                error.argument == entry.python and f"argument {entry.python}: " in str(error) and "--" not in str(error)
            )
            count += 1
    assert count > 100


def test_a_result_speaks_python(tmp_path, monkeypatch) -> None:
    from cli.runs import small

    monkeypatch.chdir(tmp_path)
    small(tmp_path)
    found = rc.identify("robot.yaml", "data.yaml")
    for said in (
        found.summary(),
        repr(found),
        found._repr_html_(),
        *(f"{r.sentence} {r.advice}" for r in found.remarks),
    ):
        text = re.sub(r"<style>.*?</style>", "", said, flags=re.DOTALL)
        text = re.sub(r"<svg.*?</svg>|<[^>]+>", " ", text, flags=re.DOTALL)
        assert not OPTION.search(text), OPTION.search(text)
    assert "output=DIR" in found.summary()
