"""Sentences of the command line in the words of Python: `--hold-out 0.2` is `hold_out=0.2`, `robocal cable forward` is `rc.cable.forward`.

Errors, remarks, sections and help are written once, with the options of the command line. Whoever calls from Python reads them through this
file. Names, kinds and choices come from the `Options` of the verbs; nothing is decided by what a sentence says.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from importlib import import_module
from typing import Any, TypeVar, cast

from robocal._record import record
from robocal.errors import InputError, ToWrite
from robocal.remarks.remark import Message, Number
from robocal.report.sections import Detail, Figure, Remarks, Section, Sentence
from robocal.verbs.option import Option, OptionField, entries
from robocal.verbs.registry import COMMAND_NAMES, GROUPS, PATHS

__all__ = ["PythonRemark", "python_error", "python_message", "python_sections", "python_text"]

S = TypeVar("S")
# Words of the terminal alone, and what stands for them here.
TERMINAL = ("demo", "report")  # verbs that Python lacks
ANYWHERE = {"--verbose": "report(file)", "--json": "document", "--debug": "the traceback"}
# An option, perhaps with its value: a word that is quoted, or goes on to the next space or mark.
OPTION = re.compile(
    r"(?<![\w-])(--[a-z][a-z0-9-]*|-[a-zA-Z](?= ?[\w<]))(?:([ =])('[^']*'|\"[^\"]*\"|[^\s;:,()`'\"](?:[^\s;:()`'\"]|:(?=\S))*))?"
)
NUMBER = re.compile(r"[-+]?\d[\d.e+-]*[a-z%]*(?:,[-+]?\d[\d.e+-]*)*")
PLACEHOLDER = re.compile(r"[A-Z][A-Z_0-9.]*(?:[,=:-][A-Z_0-9]+)*")
# What a verb is called with: files, in capitals or by their names, then options as Python has them by now.
GIVEN = r"(?:\.\.\.|'[^']+'|[\w./-]*\w[./][\w./-]*\w|[A-Z][A-Z_]+(?![\w-])|\w+=(?:\"[^\"]*\"|'[^']*'|[\w.-]*\w|))"


@cache
def _options(path: str) -> Mapping[str, OptionField]:
    """The options of a verb, or of all where there is no path, by every word that the command line has for them."""
    out: dict[str, OptionField] = {}
    for verb in (path,) if path else PATHS:
        for entry in entries(import_module(f"robocal.verbs.{verb}").Options):
            if isinstance(entry.facts, Option):
                for word in filter(None, (entry.word, entry.facts.short, entry.facts.negative)):
                    out.setdefault(word, entry)
    return out


@cache
def _calls() -> re.Pattern[str]:
    """Verbs as sentences name them: `robocal cable drift`, and without the first word where options or files follow."""
    names = {path: _command(path) for path in PATHS}
    alone = "|".join(sorted(map(re.escape, names.values()), key=len, reverse=True))
    return re.compile(rf"(?:\brobocal ({alone})\b(?!-)|(?<![\w.-])({alone})(?= {GIVEN}))((?: {GIVEN})*)")


def _command(path: str) -> str:
    """What the command line calls a verb: `vision hand-eye`."""
    group, _, name = path.rpartition(".")
    return f"{group} {COMMAND_NAMES.get(name, name)}".strip()


def python_text(text: str, path: str = "") -> str:
    """A text in the words of Python; `path` is the verb that says it."""
    if "-" in text and (OPTION.search(text) or ANYWHERE.keys() & set(text.split())):
        text = OPTION.sub(lambda found: _option(found, path), text)
    if "robocal " in text or "=" in text or " RUN" in text:
        text = _calls().sub(_call, text)
    return text


def _option(found: re.Match[str], path: str) -> str:
    word, mark, value = found[1], found[2] or "", found[3] or ""
    if word in ANYWHERE:
        return f"{ANYWHERE[word]}{mark}{value}"
    known = _options(path) if path else {}
    entry = known.get(word) or (_options("").get(word) if word.startswith("--") else None)
    if entry is None:
        return found[0]
    if entry.kind is bool:
        no = isinstance(entry.facts, Option) and entry.facts.negative == word
        return f"{entry.python}={not no}{mark}{value}"
    stop = value[len(value.rstrip(".,")) :]
    value = value.removesuffix(stop)
    if not value or not (
        mark == "=" or _is_value(value, entry, closed=found.string[found.end() :][:1] in ("", ")", "`"))
    ):
        return f"{entry.python}={mark if value else ''}{value}{stop if value or not mark else mark + stop}"
    return f"{entry.python}={_literal(value, entry)}{stop}"


def _is_value(word: str, entry: OptionField, closed: bool) -> bool:
    """Whether the word behind an option is its value, and not the next word of the sentence."""
    facts = cast(Option, entry.facts)
    if word[:1].isdigit() or NUMBER.fullmatch(word) or PLACEHOLDER.fullmatch(word) or word[:1] in "'\"{":
        return True
    if entry.kind in (int, float) and not entry.numeric:
        return False
    named = {w for w in re.findall(r"[\w-]+", f"{facts.help} {' '.join(facts.choices)}") if entry.kind is str}
    return (closed and word not in _COMMON) or any(sign in word for sign in "=./,_") or word in named - _COMMON


_COMMON = frozenset(
    "a an and or the to of by in is are with where it from for this that one all on too alone also instead".split()
)


def _literal(value: str, entry: OptionField) -> str:
    bare = value.strip("'\"")
    plain = (
        NUMBER.fullmatch(bare)
        and _is_number(bare)
        and (entry.kind in (int, float) or entry.numeric or entry.kind is str)
    )
    if (plain and not entry.several) or PLACEHOLDER.fullmatch(bare):
        return bare
    return f'"{bare}"'


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _call(found: re.Match[str]) -> str:
    command, words = found[1] or found[2], found[3].split()
    path = next(p for p in PATHS if _command(p) == command)
    group, _, name = path.rpartition(".")
    if path in TERMINAL:
        return found[0]
    word = f"rc.{GROUPS[group].python}.{name}" if group else f"rc.{name}"
    return f"{word}({', '.join(f'{w}...' if w.endswith('=') else w for w in words)})" if words else word


# --- what carries texts ------------------------------------------------------------------------------------------------------


@record
class PythonRemark:
    """A remark in the words of Python: sentence and advice, with its code and its numbers."""

    sentence: str
    advice: str
    code: str = ""
    numbers: Mapping[str, Number] | None = None

    def __str__(self) -> str:
        return self.sentence


def python_message(said: Message, path: str = "") -> PythonRemark:
    """A remark in the words of Python."""
    sentence, advice = python_text(said.sentence, path), python_text(said.advice, path)
    return PythonRemark(sentence, advice, getattr(said, "code", ""), getattr(said, "numbers", None))


def python_sections(told: Iterable[Section], path: str = "") -> tuple[Section, ...]:
    """Sections in the words of Python; pictures stay."""
    return tuple(_part(section, path) for section in told)


def _part(part: S, path: str) -> S:
    """A part of a section: texts change, whatever they stand in."""
    new: Any = part
    if isinstance(part, str):
        new = python_text(part, path)
    elif isinstance(part, tuple):
        new = tuple(_part(p, path) for p in part)
    elif isinstance(part, Detail):
        make = part.make
        new = Detail(lambda: [None if block is None else _part(block, path) for block in make()])
    elif isinstance(part, Remarks):
        told = (python_message(m, path) for m in part.messages)
        new = Remarks(tuple(Sentence(m.sentence, m.advice) for m in told))
    elif isinstance(part, Figure):
        new = replace(part, caption=python_text(part.caption, path))
    elif is_dataclass(part) and not isinstance(part, type):
        old = {f.name: getattr(part, f.name) for f in fields(part)}
        changed = {
            name: moved for name, value in old.items() if (moved := _part(value, path)) is not value and moved != value
        }
        new = replace(part, **changed) if changed else part
    return cast(S, new)


def python_error(error: InputError, path: str = "") -> InputError:
    """The same error in the words of Python: `argument` is what the command line calls an option or a word."""
    words = {e.word: e for e in entries(import_module(f"robocal.verbs.{path}").Options)} if path else {}
    known = words.get(error.key or "") or _options("").get(error.key or "")
    if known is not None:
        error.argument, error.key = known.python, None
    error.message = python_text(error.message, path)
    if isinstance(error.expected, str) and not isinstance(error.expected, ToWrite):
        error.expected = python_text(error.expected, path)
    if error.suggestion and error.suggestion.startswith("--"):
        error.suggestion = python_text(error.suggestion, path).rstrip("=")
    error.args = (str(error),)
    return error
