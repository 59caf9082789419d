"""How a convention writes one joint: the keys that a row may give, and the pen that turns them into elements and
parameters.

A row is a mapping in SI and rad: `name`, `type` (revolute, prismatic, fixed), `limits` (lower, upper), `gain`, and
the convention's own keys. Every element that a row writes is named `joint.symbol`; a fixed row moves with no joint
and drives nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TypeGuard

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import ModelError, one_of
from robocal.geometry.path.program import AXES, Element, Term, frame_element
from robocal.parameters import Parameter, frame_parameters
from robocal.quantities import LARGEST

__all__ = ["COMMON_KEYS", "QUANTITIES", "TYPES", "Convention", "Key", "Row", "RowBuilder"]

Row = Mapping[str, object]
TYPES = ("revolute", "prismatic", "fixed")
UNIT = {"t": "m", "r": "rad"}

# What a key's value is, so that a file reader knows its shape and which unit to convert from.
QUANTITIES = {
    "length": "a number in m",
    "angle": "a number in rad",
    "drive": "a number in the joint's own unit: rad for a revolute joint, m for a prismatic one",
    "number": "a number without unit",
    "direction": "three numbers without unit",
    "point": "three numbers in m",
    "angles": "three numbers in rad",
    "moment": "three numbers, m for a revolute joint (or fixed row), without unit for a prismatic one",
    "limits": "two numbers in the joint's own unit, lower and upper",
    "steps": "a list of {axis, value, symbol, driven}; value in m for axis tx ty tz, in rad for rx ry rz",
    "shares": "a mapping from names of other joints to numbers without unit",
    "text": "a word",
}
VECTORS = {"direction": 3, "point": 3, "angles": 3, "moment": 3, "limits": 2}


@record
class Key:
    """One key of a row: its quantity (see `QUANTITIES`), its default (None: the key is required) and its meaning."""

    name: str
    quantity: str
    default: object = 0.0
    meaning: str = ""

    @property
    def required(self) -> bool:
        """Whether a row must give it."""
        return self.default is None


COMMON_KEYS = (
    Key("name", "text", "j1, j2, ...", "the joint's name: owner of its parameters, and its column in the data"),
    Key("type", "text", "revolute", "revolute, prismatic or fixed"),
    Key("limits", "limits", (-math.inf, math.inf), "lower and upper bound of the joint value"),
    Key("gain", "number", 1.0, "what the joint value is multiplied with before it moves the joint"),
    Key(
        "with",
        "shares",
        {},
        "values of other joints that this joint counts with, such as {j2: 1}: added before the gain",
    ),
)


@record
class Convention:
    """A way to describe a joint.

    `revolute` and `prismatic` name the key that the joint value is added to; `complete` says that every small
    geometric error of a joint can be written, whatever the nominal geometry (parallel axes too); `home` says that
    rows are given in the base frame with the arm at zero, so that the tool's pose there may be stated as a frame of
    its own. `read` gives a row back with the values of a table.
    """

    name: str
    keys: tuple[Key, ...]
    write: Callable[[RowBuilder], None]
    revolute: str
    prismatic: str
    complete: bool
    formula: str
    source: str
    home: bool = False
    read: Callable[[Row, Mapping[str, float]], dict[str, object]] | None = None

    @property
    def key(self) -> dict[str, Key]:
        """The convention's own keys and the common ones, by name."""
        return {k.name: k for k in (*COMMON_KEYS, *self.keys)}


class RowBuilder:
    """Reads one row and writes its elements and parameters in order; every complaint names the joint and the key."""

    def __init__(self, joint: str, kind: str, row: Row, keys: Mapping[str, Key]) -> None:
        self.joint, self.kind, self.row, self.keys = joint, kind, row, keys
        self.elements: list[Element] = []
        self.parameters: list[Parameter] = []
        self.geometric: list[str] = []
        self.asked: set[str] = set()
        for name in row:
            if name not in keys:
                raise ModelError("unknown key", key=f"{joint}.{name}", **one_of(name, keys))

    # --- reading ------------------------------------------------------------------------------------------------------------

    def raw(self, name: str) -> object:
        """The value as given, or the default. Raises ModelError when it is required and absent."""
        key = self.keys[name]
        self.asked.add(name)
        if self.row.get(name) is None:
            if key.required:
                raise ModelError("a key is missing", key=f"{self.joint}.{name}", expected=QUANTITIES[key.quantity])
            return key.default
        return self.row[name]

    def number(self, name: str) -> float:
        """A finite number."""
        return finite(self.raw(name), f"{self.joint}.{name}", QUANTITIES[self.keys[name].quantity])

    def vector(self, name: str) -> Array:
        """Two or three finite numbers (limits may be infinite)."""
        value, quantity = self.raw(name), self.keys[name].quantity
        where, size = f"{self.joint}.{name}", VECTORS[quantity]
        if isinstance(value, str | bytes) or not isinstance(value, Sequence | np.ndarray) or len(value) != size:
            raise ModelError("wrong shape", key=where, found=value, expected=QUANTITIES[quantity])
        if quantity == "limits":
            return np.array([bound(v, where) for v in value])
        return np.array([finite(v, where, QUANTITIES[quantity]) for v in value])

    def unit(self, name: str) -> Array:
        """A direction, made one long. Raises ModelError when its length is zero."""
        v = self.vector(name)
        length = math.hypot(*v)
        if not length > 0.0:
            raise ModelError("a direction needs a length", key=f"{self.joint}.{name}", found=list(v))
        return v / length

    def shares(self) -> dict[str, float]:
        """What other joints add to the value of this one, by their names."""
        value, where = self.raw("with"), f"{self.joint}.with"
        if not isinstance(value, Mapping):
            raise ModelError("wrong shape", key=where, found=value, expected="such as {j2: 1}")
        return {str(n): finite(v, f"{where}.{n}", QUANTITIES["number"]) for n, v in value.items()}

    def finish(self) -> None:
        """Raises ModelError for a value that the row states and nothing of it is made of: how much a fixed row is geared, how
        far a prismatic axis is shifted."""
        for name, value in self.row.items():
            default = self.keys[name].default
            usual = list(default) if isinstance(default, tuple) else default
            given = list(value) if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str) else value
            if name in ("name", "type") or name in self.asked or value is None or given == usual:
                continue
            message = f"this key means nothing in a row of type {self.kind}"
            raise ModelError(message, key=f"{self.joint}.{name}", found=value, expected="a row without it")

    # --- writing ------------------------------------------------------------------------------------------------------------

    def constant(self, axis: str, value: float = 1.0, screw: Sequence[float] | Array = (0.0,) * 6) -> None:
        """An element that no parameter moves; nothing is written for an exact zero."""
        if value != 0.0:
            self.elements.append(Element(axis, (), float(value), tuple(float(s) for s in screw)))

    def step(
        self,
        axis: str,
        symbol: str,
        value: float,
        screw: Sequence[float] | Array = (0.0,) * 6,
        *,
        unit: str | None = None,
        driven: float = 0.0,
        held: bool = False,
        preference: int = 0,
    ) -> None:
        """An element with a parameter of its own; `driven` is the sign with which the joint moves it too (0: not),
        `held` keeps it out of the default free set, `preference` is the parameter's.
        """
        name = f"{self.joint}.{symbol}"
        self.parameters.append(Parameter(name, value, UNIT[axis[0]] if unit is None else unit, preference=preference))
        if not held:
            self.geometric.append(name)
        terms = [Term(name)]
        if driven:
            gain = f"{self.joint}.gain"
            if self.number("gain") == 0.0:
                expected = "a gain other than 0"
                raise ModelError("a joint with this gain never moves", key=gain, found=0, expected=expected)
            self.parameters.append(Parameter(gain, self.number("gain"), "1"))
            terms.append(Term(gain, self.joint, driven))
            terms += [Term(gain, other, driven * share) for other, share in self.shares().items()]
        self.elements.append(Element(axis, tuple(terms), 0.0, tuple(float(s) for s in screw)))

    def undo(self, symbol: str, screw: Array) -> None:
        """A screw moved back by the parameter that moves it in an earlier element."""
        self.elements.append(Element("screw", (Term(f"{self.joint}.{symbol}", "1", -1.0),), 0.0, tuple(screw.tolist())))

    def drive(self, axis: str, screw: Sequence[float] | Array = (0.0,) * 6, sign: float = 1.0) -> None:
        """The joint's own motion, with its zero error `offset` (held: it repeats what the geometry can say); nothing
        for a fixed row."""
        if self.kind != "fixed":
            unit = "m" if self.kind == "prismatic" else "rad"
            self.step(axis, "offset", self.number("offset"), screw, unit=unit, driven=sign, held=True)

    def frame(self, vector: Sequence[float] | Array) -> None:
        """A whole frame with six parameters `joint.x` ... `joint.rz`."""
        rows = frame_parameters(self.joint, [float(v) for v in vector])
        self.parameters += rows
        self.geometric += [p.name for p in rows]
        self.elements.append(frame_element(self.joint))


def finite(value: object, key: str, expected: str = "a number") -> float:
    """A finite float whose square is one too. Raises ModelError for anything else, truth values included."""
    if not _is_number(value) or not math.isfinite(value):
        raise ModelError("not a finite number", key=key, found=value, expected=expected)
    if abs(value) >= LARGEST:
        raise ModelError("no robot has so large a number", key=key, found=value, expected=f"below {LARGEST:g}")
    return float(value)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def bound(value: object, key: str) -> float:
    """A float that may be infinite."""
    if not _is_number(value) or math.isnan(value):
        raise ModelError("not a number", key=key, found=value, expected="a number, or an infinite one for no limit")
    return float(value)


def check_axis(axis: object, key: str) -> str:
    """One of tx ty tz rx ry rz. Raises ModelError otherwise."""
    if axis not in AXES[:6]:
        raise ModelError("unknown axis", key=key, found=axis, **one_of(axis, AXES[:6]))
    return str(axis)
