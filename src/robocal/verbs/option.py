"""How the options of a verb are told, once: a frozen dataclass whose fields carry help, unit, range and choices.

    @record
    class Options(BaseOptions):
        robot: str = arg(..., "ROBOT", "robot.yaml, a URDF, ...")
        noise: float | None = option(None, "Standard deviation per axis", unit="length", otherwise="0.05 mm, converted")

First the default, ... where there is none. What several verbs share is a type that carries what is told of it (`shared_options.py`). The
command line, calls from Python and messages are made from it: no default and no range is written anywhere else. What follows the
field's name is the option: `angle_noise` is `--angle-noise`.
"""

from __future__ import annotations

import builtins
import math
import os
from collections.abc import Iterable, Iterator
from dataclasses import MISSING, Field, field, fields
from functools import cache
from types import NoneType, SimpleNamespace, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from robocal._record import record
from robocal.errors import ModelError, nearest

__all__ = ["Arg", "BaseOptions", "Option", "OptionField", "arg", "entries", "option"]

KINDS = {bool: "True or False", int: "a whole number", float: "a number", str: "a word"}
FILE_UNITS = {"length": "mm", "angle": "deg", "mass": "kg", "force": "N"}  # with a unit of each


@record
class Arg:
    """A word that has no name of its own on the command line."""

    metavar: str
    help: str


@record
class Option:
    """A named option. `name`: where it is not the field's; `short`: "-n"; `unit`: a dimension of the robot file ("length"), one of
    each of several numbers ("length,angle"), or a unit; `least` and `most`: the range, both ends included, `above` without its end;
    `wrong`: what is said outside; `numbers`: a word of so many numbers, named between commas; `otherwise`: in words, what happens
    without it; `negative`: the option that says no, of a flag; `listed`: words may also be separated by commas."""

    help: str
    metavar: str = ""
    name: str = ""
    short: str = ""
    unit: str = ""
    least: float | None = None
    most: float | None = None
    above: float | None = None
    wrong: str = "out of range"
    numbers: str = ""
    choices: tuple[str, ...] = ()
    otherwise: str = ""
    negative: str = ""
    listed: bool = False

    @property
    def range(self) -> str:
        """The range in words; nothing where there is none."""
        if self.least is not None and self.most is not None:
            return f"{self.least:.0f} to {self.most:.0f}"
        if self.above is not None:
            return f"above {self.above:.0f}" + ("" if self.most is None else f" and at most {self.most:.0f}")
        return f"{self.least:.0f} or more" if self.least is not None else ""

    def holds(self, value: float) -> bool:
        """Whether a number lies in the range; none that is not finite does."""
        low = (self.least is None or value >= self.least) and (self.above is None or value > self.above)
        return math.isfinite(value) and low and (self.most is None or value <= self.most)

    @property
    def text(self) -> str:
        """The help, with unit and what happens without it."""
        words = self.help.rstrip(".")
        if any(choice not in words for choice in self.choices):
            words += f": {', '.join(self.choices)}"
        if self.unit:
            several = "units or their own"
            own = f"unit of {self.unit} or its own" if self.unit in FILE_UNITS else several if "," in self.unit else ""
            words += f", in the robot file's {own}" if own else f" [{self.unit}]"
        if self.range:
            words += f", {self.range}"
        return f"{words}." + (f"  [default: {self.otherwise}]" if self.otherwise else "")


def arg(default: Any, metavar: str, help: str) -> Any:
    """The field of an argument; ... where it must be given."""
    return field(default=MISSING if default is ... else default, metadata={"told": Arg(metavar, help)})


def option(default: Any, help: str, metavar: str = "", **facts: Any) -> Any:
    """The field of an option, with the facts of `Option`; ... where it must be given."""
    return field(default=MISSING if default is ... else default, metadata={"told": Option(help, metavar, **facts)})


@record
class OptionField:
    """One field of an Options class: its name, kind of value (str, int, float, bool, Path), whether it may be left out (None),
    whether it may be repeated, its default, what is told of it, and whether a word may as well be a number."""

    name: str
    kind: type
    optional: bool
    several: bool
    default: Any
    facts: Arg | Option
    numeric: bool = False

    @property
    def word(self) -> str:
        """What people call it: --angle-noise, or ROBOT."""
        if isinstance(self.facts, Arg):
            return self.facts.metavar
        return self.facts.name or "--" + self.name.replace("_", "-")

    @property
    def python(self) -> str:
        """What calls from Python say: the command line's word, where Python has none of its own (--format, --list): angle_noise."""
        word = self.word.lstrip("-").replace("-", "_")
        return self.name if isinstance(self.facts, Arg) or hasattr(builtins, word) else word

    @property
    def required(self) -> bool:
        """Whether there is no default."""
        return self.default is MISSING


@record
class BaseOptions:
    """Options that check themselves: ranges and choices hold however they were given. Raises ModelError."""

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for entry in entries(kind):
            if isinstance(entry.facts, Option):
                if entry.facts.listed:
                    words = (w.strip() for given in getattr(self, entry.name) for w in str(given).split(","))
                    object.__setattr__(self, entry.name, tuple(w for w in words if w))
                given = getattr(self, entry.name)
                if getattr(given, "shape", None) == () and callable(scalar := getattr(given, "item", None)):
                    given = scalar()  # of numpy, as Python's
                    object.__setattr__(self, entry.name, given)
                if entry.kind is float and entry.facts.unit and isinstance(given, str):
                    given = _typed(entry, entry.facts, given)
                    object.__setattr__(self, entry.name, given)
                if given is None and not entry.optional:
                    expected = KINDS.get(entry.kind, "a path")
                    raise ModelError("this option needs a value", key=entry.word, expected=expected)
                for value in _values(given):
                    _check(entry, entry.facts, value)
        self._apart()

    def _apart(self) -> None:
        """No output is one of the inputs: not even --force may replace what is read."""
        output = getattr(self, "output", None)
        if output is None or not os.path.isfile(output):
            return
        inputs = (value for name, given in self.given.items() if name != "output" for value in _values(given))
        for value in inputs:
            if isinstance(value, str | os.PathLike) and os.path.isfile(value) and os.path.samefile(value, output):
                message, found = "the output is one of the inputs", str(output)
                raise ModelError(message, key="--output", found=found, expected="another name")

    @property
    def given(self) -> dict[str, Any]:
        """Every option by its name."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def departs(self, name: str) -> bool:
        """Whether an option is another than its default."""
        default = next(f.default for f in fields(self) if f.name == name)
        return bool(getattr(self, name) != default)

    def refuse(self, names: Iterable[str], message: str, expected: str) -> None:
        """Raises ModelError for an option that means nothing beside the others."""
        for name in names:
            if self.departs(name):
                key, told = "--" + name.replace("_", "-"), getattr(self, name)
                found = "given" if told is True else os.fspath(told) if isinstance(told, os.PathLike) else told
                raise ModelError(message, key=key, found=found, expected=expected)

    def si(self, units: Any) -> SimpleNamespace:
        """Every option by its name, with numbers in SI where they are told in a unit of the robot's file; numbers between commas
        as an array. Raises ModelError."""
        kind: Any = type(self)
        return SimpleNamespace(**{e.name: _in_si(e, getattr(self, e.name), units) for e in entries(kind)})


@cache
def entries(options: Any) -> tuple[OptionField, ...]:
    """What a class of options tells, in its order."""
    hints = get_type_hints(options, include_extras=True)
    return tuple(_entry(f, hints[f.name]) for f in fields(options))


def _entry(field: Field[Any], hint: Any) -> OptionField:
    told = field.metadata.get("told")
    kind, told = (hint, told) if told is not None else get_args(hint)
    optional, several, numeric = False, False, False
    if get_origin(kind) in (Union, UnionType):
        plain = [a for a in get_args(kind) if a is not NoneType]
        optional, numeric = NoneType in get_args(kind), float in plain and str in plain
        kind = str if numeric else plain[0]
    if get_origin(kind) is tuple:
        kind, several = get_args(kind)[0], True
    default = field.default if field.default_factory is MISSING else field.default_factory()
    return OptionField(field.name, kind, optional, several, default, told, numeric)


def _values(value: Any) -> Iterator[Any]:
    if isinstance(value, tuple):
        yield from value
    elif value is not None:
        yield value


def _check(entry: OptionField, told: Option, value: Any) -> None:
    flag, number = isinstance(value, bool), isinstance(value, int | float)
    right = {bool: flag, int: isinstance(value, int) and not flag, float: number and not flag}
    right[str] = isinstance(value, str | os.PathLike) or (entry.numeric and number and not flag)
    if not right.get(entry.kind, True):
        raise ModelError("not a value of this option", key=entry.word, found=value, expected=KINDS[entry.kind])
    if told.choices and value not in told.choices:
        near, expected = nearest(str(value), told.choices), ", ".join(told.choices)
        raise ModelError("unknown option", key=entry.word, found=value, expected=expected, suggestion=near)
    if entry.kind in (int, float) and number and not told.holds(value):
        words = ("" if math.isfinite(value) else "a finite number", told.range)
        raise ModelError(told.wrong, key=entry.word, found=value, expected=", ".join(w for w in words if w))


def _typed(entry: OptionField, told: Option, text: str) -> Any:
    """A number that was typed with a unit: as it is, with the unit of a file to come, or in the unit of the option; else the text."""
    from robocal.files.units import parse_unit, typed_number

    unit = parse_unit(FILE_UNITS.get(told.unit, told.unit), key=entry.word)
    found = typed_number(text, unit, key=entry.word)
    if found is None or told.unit in FILE_UNITS:
        return text if found is None else found
    return unit.from_si(float(found))


def _in_si(entry: OptionField, value: Any, units: Any) -> Any:
    if isinstance(entry.facts, Arg) or value is None:
        return value
    if isinstance(value, tuple):
        return tuple(_in_si(entry, v, units) for v in value)
    from robocal.files.units import TypedNumber, in_si, numbers_of

    if isinstance(value, TypedNumber):
        return float(value)
    if names := entry.facts.numbers:
        of_file = [getattr(units, what) for what in entry.facts.unit.split(",") if what in FILE_UNITS]
        if of_file:
            each = of_file if len(of_file) > 1 else of_file * (names.count(",") + 1)
            return in_si(value, names, each, key=entry.word)
        import numpy as np

        return np.array(numbers_of(value, names, key=entry.word))
    # What several numbers or words may stand for, whoever reads them converts.
    plain = isinstance(value, str) or entry.facts.unit not in FILE_UNITS
    return value if plain else getattr(units, entry.facts.unit).to_si(value)
