"""Verbs as functions: made from the same Options as the commands, with their names, defaults, ranges and help."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from robocal.errors import InputError, ModelError, nearest
from robocal.files.text import MemoryFile
from robocal.front.arrays import Arm, Measurements
from robocal.front.spelling import python_error, python_text
from robocal.front.verb_result import Found, Identified
from robocal.verbs.option import Arg, Option, OptionField, entries
from robocal.verbs.registry import GROUPS

__all__ = ["call", "docstring_of"]

SIZE = "WIDTHxHEIGHT"  # what options of two numbers of pixels are called
WATCH = "watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call."


@cache
def call(path: str) -> Callable[..., Any]:
    """The function for the verb in robocal.verbs.PATH: arguments in their order, options by name, and `watch`."""
    module = import_module(f"robocal.verbs.{path}")
    told = {e.python: e for e in entries(module.Options)}
    made = Identified if path == "identify" else Found

    def verb(*words: Any, watch: Any = None, **options: Any) -> Found[Any]:
        try:
            given = _links(_bind(signature, words, options, told), told)
            values = {told[name].name: _value(told[name], value) for name, value in given.items()}
            return made(path, module.run(module.Options(**values), watch, f"{verb.__module__}.{verb.__name__}(...)"))
        except InputError as error:
            python_error(error, path)
            raise

    signature = inspect.Signature([_parameter(e) for e in told.values()])
    whole = [*signature.parameters.values(), inspect.Parameter("watch", inspect.Parameter.KEYWORD_ONLY, default=None)]
    verb.__name__ = verb.__qualname__ = path.rpartition(".")[2]
    verb.__module__ = f"robocal.{GROUPS[path.partition('.')[0]].python}" if "." in path else "robocal"
    verb.__signature__ = inspect.Signature(whole)  # type: ignore[attr-defined]
    verb.__doc__ = docstring_of(path)
    return verb


def docstring_of(path: str) -> str:
    """The docstring of a verb: what it does, every option with unit, range and default, what it raises."""
    module = import_module(f"robocal.verbs.{path}")
    about = inspect.cleandoc(module.Options.__doc__ or "").split("\n\n\b")[0]
    said = {e.python: e.facts for e in entries(module.Options)}
    texts = {name: f.help.rstrip(".") + "." if isinstance(f, Arg) else f.text for name, f in said.items()}
    lines = (f"{name}: {text}" for name, text in texts.items())
    return "\n".join([about, "", *lines, WATCH, "", "Raises InputError."])


def _parameter(entry: OptionField) -> inspect.Parameter:
    plain = isinstance(entry.facts, Arg)
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD if plain else inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(entry.python, kind, default=inspect.Parameter.empty if entry.required else entry.default)


def _bind(
    signature: inspect.Signature, words: Sequence[Any], options: Mapping[str, Any], told: Mapping[str, OptionField]
) -> dict[str, Any]:
    """What was given, by the names of arguments. Raises ModelError for a name that is none, and for what is missing."""
    for name in options:
        if name not in told:
            known = [*told, "watch"]
            raise ModelError("unknown argument", argument=name, expected=", ".join(known), suggestion=nearest(name, known))
    first = [name for name, e in told.items() if isinstance(e.facts, Arg)]
    if len(words) > len(first):
        kept = next(name for name in told if name not in first)
        expected = f"at most {len(first)} without a name: {', '.join(first)}; others by name, such as {kept}=..."
        raise ModelError("too many arguments", found=f"{len(words)} without a name", expected=expected)
    if twice := [name for name in first[: len(words)] if name in options]:
        raise ModelError("this argument is given twice", argument=twice[0], expected="once")
    given = dict(zip(first, words, strict=False)) | dict(options)
    if lacking := [name for name, e in told.items() if e.required and name not in given]:
        raise TypeError(f"missing argument {lacking[0]}: {python_text(told[lacking[0]].facts.help)}")
    return signature.bind(**given).arguments


def _links(given: dict[str, Any], told: dict[str, OptionField]) -> dict[str, Any]:
    """The links of a URDF, where an opened arm knows them."""
    arms = [v for v in given.values() if isinstance(v, Arm)]
    if not arms or "base" not in told:
        return given
    if len({(a.base, a.tip) for a in arms}) > 1 or not isinstance(given.get("robot"), Arm):
        found = ", ".join(f"{a.opened} from {a.base} to {a.tip}" for a in arms)
        if any(a.base or a.tip for a in arms):
            message = "links are the same for every robot of a call"
            raise ModelError(message, found=found, expected="files, and base= and tip=")
        return given
    return {"base": arms[0].base, "tip": arms[0].tip} | given


def _value(entry: OptionField, given: Any) -> Any:
    """A value as the options want it: words and numbers as they are; several in a tuple; robots, tables and runs as files."""
    if entry.several:
        alone = not isinstance(given, Iterable) or isinstance(given, str | os.PathLike | Found | Mapping)
        return tuple(_one(entry, v) for v in ((given,) if alone else given))
    return None if given is None and not entry.required else _one(entry, given)


def _one(entry: OptionField, given: Any) -> Any:
    if getattr(entry.facts, "metavar", "") == SIZE and isinstance(given, tuple | list) and len(given) == 2:
        return "x".join(map(str, given))
    if isinstance(opened := getattr(given, "opened", None), str):
        return opened  # an arm or a cable robot
    if isinstance(given, Measurements):
        return given.file
    if isinstance(given, Found):
        if not given.written:
            expected = "output=FOLDER, or save(FOLDER) and the folder"
            raise ModelError("this was not written", key=entry.python, expected=expected)
        given = given.written[0].parent
    if isinstance(entry.facts, Arg) and not isinstance(given, str | os.PathLike):
        expected = "a file, rc.table(...), rc.measurements(...), a robot, or what identify gave and wrote"
        raise ModelError("not what this takes", key=entry.python, found=type(given).__name__, expected=expected)
    if entry.kind is Path and not isinstance(given, MemoryFile):
        return Path(given)
    return os.fspath(given) if isinstance(given, os.PathLike) and not isinstance(given, MemoryFile) else given
