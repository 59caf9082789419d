"""Advice names options that exist. What a verb prints is held to its own options wherever a test runs it (`cli/runs.py`)."""

from __future__ import annotations

import pytest
from advised import NAMED, lacking, options_of, verb_of

from robocal.remarks.english import DECLARED, TABLE
from robocal.verbs.registry import PATHS


def test_every_option_that_advice_names_is_one_of_some_verb():
    every = frozenset().union(*map(options_of, PATHS))
    phrases = {**TABLE, **DECLARED}.items()
    assert not {(code, o) for code, phrase in phrases for o in NAMED.findall(phrase.advice) if o not in every}


@pytest.mark.parametrize(
    ("words", "advice", "wrong"),
    [
        (["vision", "hand-eye", "a", "b"], "Leave out --free.", {("c", "--free")}),
        (["vision", "hand-eye", "a", "b"], "Find it too: --free-lens.", set()),
        (["vision", "hand-eye", "a", "b"], "Errors of the robot need robocal identify --free x.", set()),
        (["identify", "a", "b"], "--iterations allows more steps.", set()),
        (["verify", "a", "b"], "--iterations allows more steps.", {("c", "--iterations")}),
        (["validate", "a", "b"], "Try robocal vision hand-eye --iterations 9.", {("c", "--iterations")}),
    ],
)
def test_what_a_verb_lacks_is_found(words, advice, wrong):
    assert lacking(verb_of(words), [("c", advice)]) == wrong
