"""The law of advice: a verb names no option that it lacks, unless the advice names the verb that has it."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from functools import cache
from importlib import import_module

from robocal.remarks.remark import Remark
from robocal.verbs.option import entries
from robocal.verbs.registry import COMMAND_NAMES, PATHS

NAMED = re.compile(r"--[a-z][a-z-]*[a-z]")


@cache
def options_of(verb: str) -> frozenset[str]:
    """The options of a verb, as `vision.hand_eye`; none of what is no verb."""
    if verb not in PATHS:
        return frozenset()
    return frozenset(e.word for e in entries(import_module(f"robocal.verbs.{verb}").Options))


def word_of(verb: str) -> str:
    """What the command line calls it: `vision hand-eye`."""
    return " ".join(COMMAND_NAMES.get(part, part) for part in verb.split("."))


def verb_of(words: Sequence[str]) -> str:
    """The verb of a command line; empty where there is none."""
    by_word = {word_of(v): v for v in PATHS}
    return by_word.get(" ".join(words[:2])) or by_word.get(words[0] if words else "", "")


def lacking(verb: str, advice: Iterator[tuple[str, str]] | Sequence[tuple[str, str]]) -> set[tuple[str, str]]:
    """Code and option of what is advised and cannot be done, of advice by code."""
    out = set()
    for code, text in advice:
        others = [options_of(v) for v in PATHS if re.search(rf"\b{word_of(v)}\b", text)]
        have = options_of(verb).union(*others)
        out |= {(code, option) for option in NAMED.findall(text) if option not in have}
    return out if verb else set()


@contextlib.contextmanager
def advice_heard() -> Iterator[list[tuple[str, str]]]:
    """What is read of advice meanwhile, with its code."""
    read, heard = Remark.advice, list[tuple[str, str]]()

    def advice(said: Remark) -> str:
        text = str(read.fget(said))
        heard.append((said.code, text))
        return text

    Remark.advice = property(advice)
    try:
        yield heard
    finally:
        Remark.advice = read
