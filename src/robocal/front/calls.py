"""Verbs as functions: made from the same Options as the commands, with their names, defaults, ranges and help."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module
from numbers import Real
from pathlib import Path
from typing import Any

from robocal.errors import FormatError, InputError, ModelError
from robocal.files.text import MemoryFile
from robocal.front.arguments import locate_argument, refuse_unknown
from robocal.front.measurements import Measurements, locate_array
from robocal.front.robots import Arm
from robocal.front.spelling import python_error, python_text
from robocal.front.studies import study_file
from robocal.front.verb_result import Found, Identified
from robocal.verbs.option import Arg, Option, OptionField, entries
from robocal.verbs.registry import GROUPS

__all__ = ["call", "docstring_of"]

SIZE = "WIDTHxHEIGHT"  # what options of two numbers of pixels are called
PLAIN = {  # what stands in place of a file
    "ROBOT": "; or rc.robot(...), rc.cable.robot(...)", "DATA": "; or rc.measurements(...)", "STUDY": "; or a mapping with these keys",
    "POSES": "; or rc.table(...)", "TARGETS": "; or rc.table(...)", "LENGTHS": "; or rc.table(...), rc.measurements(...)",
    "RUN": "; or what identify gave and wrote",
}  # fmt: skip
RAISES = "Raises InputError: it names the argument, what was found and what was expected."
WATCH = "watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call."


@cache
def call(path: str) -> Callable[..., Any]:
    """The function for the verb in robocal.verbs.PATH: arguments in their order, options by name, and `watch`."""
    module = import_module(f"robocal.verbs.{path}")
    told = {e.python: e for e in entries(module.Options)}
    made = Identified if path == "identify" else Found

    def verb(*words: Any, watch: Any = None, **options: Any) -> Found[Any]:
        values: dict[str, Any] = {}
        try:
            given = _links(_bind(signature, words, options, told), told)
            require_same_machine(given)
            values |= {name: _value(told[name], value) for name, value in given.items()}
            known = module.Options(**{told[name].name: value for name, value in values.items()})
            return made(path, module.run(known, watch, f"{verb.__module__}.{verb.__name__}(...)"))
        except InputError as error:
            python_error(
                locate_array(locate_argument(error, values), options.get("data", words[1] if len(words) > 1 else None)),
                path,
            )
            raise

    signature = inspect.Signature([_parameter(e) for e in told.values()])
    whole = [*signature.parameters.values(), inspect.Parameter("watch", inspect.Parameter.KEYWORD_ONLY, default=None)]
    verb.__name__ = verb.__qualname__ = path.rpartition(".")[2]
    verb.__module__ = f"robocal.{GROUPS[path.partition('.')[0]].python}" if "." in path else "robocal"
    verb.__signature__ = inspect.Signature(whole)  # type: ignore[attr-defined]
    verb.__doc__ = docstring_of(path)
    return verb


def docstring_of(path: str) -> str:
    """The docstring of a verb: what it does, what it takes with unit, range and default, what it returns and raises."""
    module = import_module(f"robocal.verbs.{path}")
    about = python_text(inspect.cleandoc(module.Options.__doc__ or "").split("\n\n\b")[0], path)
    lines = [f"{e.python}: {_help(e, path)}" for e in entries(module.Options)]
    return "\n".join([about, "", "Takes", *lines, WATCH, "", "Returns", *_returned(path), "", RAISES])


def _help(entry: OptionField, path: str) -> str:
    """What an argument is, in the words of Python."""
    facts = entry.facts
    if isinstance(facts, Arg):
        return python_text(facts.help.rstrip("."), path) + PLAIN.get(entry.word.rstrip("."), "") + "."
    text = python_text(facts.text, path)
    if entry.default not in (None, False, ()) and "[default:" not in text and not entry.required:
        text += f"  [default: {entry.default!r}]"
    return text


def _returned(path: str) -> list[str]:
    """What a verb gives back, in a few lines."""
    if path == "identify":
        return [
            "Identified: verdict and improved; parameters, residuals and covariance; values and pose(joints) of the corrected robot;",
            "plot(name), summary(), report(file) and save(folder); result, document, remarks and trusted.",
        ]
    module = import_module(f"robocal.verbs.{path}")
    kind = str(module.run.__annotations__["return"]).removeprefix("Outcome[").removesuffix("]")
    return [
        f"Found: result ({kind}, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);",
        "remarks, trusted and written.",
    ]


def _parameter(entry: OptionField) -> inspect.Parameter:
    plain = isinstance(entry.facts, Arg)
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD if plain else inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(entry.python, kind, default=inspect.Parameter.empty if entry.required else entry.default)


def _bind(
    signature: inspect.Signature, words: Sequence[Any], options: Mapping[str, Any], told: Mapping[str, OptionField]
) -> dict[str, Any]:
    """What was given, by the names of arguments. Raises ModelError for a name that is none, and for what is missing."""
    refuse_unknown(list(options), [*told, "watch"])
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


def require_same_machine(given: Mapping[str, Any]) -> None:
    """Raises FormatError for measurements of an arm beside a cable robot, or of another number of joints or cables."""
    coordinates, data = getattr(given.get("robot"), "coordinates", None), given.get("data")
    if coordinates is None:
        return
    needed, names = coordinates
    for one in data if isinstance(data, list | tuple) else (data,):
        if not isinstance(one, Measurements) or not one.of:
            continue
        if one.of != needed:
            expected = f"rc.measurements({'' if needed == 'joints' else 'lengths='}{needed}, ...)"
            raise FormatError(f"this robot has no {one.of}", argument="data", found=f"{one.of}=", expected=expected)
        if len(one.moved) != len(names):
            expected = f"(m, {len(names)}): {', '.join(names)}"
            raise FormatError("wrong number of columns", argument=needed, found=len(one.moved), expected=expected)
        if needed == "lengths" and set(one.moved) != set(names):
            message, found = "these are not the cables of the robot", ", ".join(one.moved)
            raise FormatError(message, argument="cables", found=found, expected=", ".join(names))


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
        table = hasattr(given, "__array__") or hasattr(given, "__dataframe__")
        alone = table or not isinstance(given, Iterable) or isinstance(given, str | os.PathLike | Found | Mapping)
        words = (given,) if alone else given
        # Of a cable robot lengths and poses are two tables.
        each = (f for v in words for f in (v.files if isinstance(v, Measurements) else (v,)))
        return tuple(_one(entry, v) for v in each)
    return None if given is None and not entry.required else _one(entry, given)


def _one(entry: OptionField, given: Any) -> Any:
    if getattr(entry.facts, "metavar", "") == SIZE and isinstance(given, tuple | list) and len(given) == 2:
        return "x".join(map(str, given))
    if isinstance(entry.facts, Option) and entry.kind is str and _is_row(given):
        return ",".join(v if isinstance(v, str) else repr(float(v)) for v in given)
    if isinstance(opened := getattr(given, "opened", None), str):
        return opened  # an arm or a cable robot
    if entry.word == "STUDY" and isinstance(given, Mapping):
        return study_file(given)
    if isinstance(given, Measurements):
        if given.lengths:
            expected = "lengths= alone, poses alone, or a table of rc.table(...)"
            raise ModelError(
                "one table is needed here, not lengths and poses",
                argument=entry.python,
                found=repr(given),
                expected=expected,
            )
        return given.file
    if isinstance(given, Found):
        if not given.written:
            expected = "output=FOLDER, or save(FOLDER) and the folder"
            raise ModelError("this was not written", argument=entry.python, expected=expected)
        given = given.written[0].parent
    if isinstance(entry.facts, Arg) and not isinstance(given, str | os.PathLike):
        raise ModelError(
            "not what this takes", argument=entry.python, found=type(given).__name__, expected=taken(entry)
        )
    if entry.kind is Path and not isinstance(given, MemoryFile):
        if not isinstance(given, str | os.PathLike):
            raise ModelError(
                "not what this takes", argument=entry.python, found=type(given).__name__, expected="a path"
            )
        return Path(given)
    return os.fspath(given) if isinstance(given, os.PathLike) and not isinstance(given, MemoryFile) else given


def _is_row(given: Any) -> bool:
    """Whether several numbers are given, with units or without, which the command line takes between commas."""
    flat = isinstance(given, tuple | list) or (getattr(given, "ndim", 0) == 1 and not hasattr(given, "__dataframe__"))
    return flat and len(given) > 1 and all(isinstance(v, str | Real) and not isinstance(v, bool) for v in given)


def taken(entry: OptionField) -> str:
    """What stands in place of a file, as an argument takes it."""
    word = entry.word.rstrip(".")
    if word == "ROBOT":
        return "a file, a name of the catalogue, rc.robot(...), rc.cable.robot(...), or what identify gave and wrote"
    if word == "RUN":
        return "a run folder, or what identify gave and wrote"
    if word == "DATA":
        return "rc.measurements(joints, position=...) or (..., pose=...), a file, or several of them"
    if word == "STUDY":
        return "a file, or a mapping with its keys"
    return "a file, rc.table(...), rc.measurements(...), a robot, or what identify gave and wrote"
