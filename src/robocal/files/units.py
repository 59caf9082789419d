"""Units by name, to SI and back; inside robocal everything is in m, rad, s, kg, N, K.

A compound such as `mm/K` or `deg/(N m)` is a product of known units: words before the first slash multiply, every
word after one divides. And numbers as people write them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from decimal import Decimal
from typing import Any, Self, TypeVar

import numpy as np

from robocal._record import record
from robocal._types import Array, Bools, Ints
from robocal.errors import FormatError, ModelError, nearest

__all__ = [
    "UNITS", "TypedNumber", "Unit", "Units", "finite", "in_si", "is_unit", "last_digits", "number", "numbers_of", "parse_quantity",
    "parse_unit", "same", "typed_number",
]  # fmt: skip

Value = TypeVar("Value", float, Array)


@record
class Unit:
    """A unit: SI value = factor * value + offset; `si` is the SI unit that it measures in (m, rad, 1, ...)."""

    name: str
    si: str
    factor: float = 1.0
    offset: float = 0.0

    @property
    def parts(self) -> float:
        """How many of it make one SI unit, when that is a whole number, else 0: dividing by 1000 rounds once, 1e-3 is
        rounded already."""
        whole = round(1 / self.factor)
        return float(whole) if whole > 1 and abs(whole * self.factor - 1) < 1e-15 else 0.0

    def to_si(self, value: Value) -> Value:
        """A number in this unit, in SI."""
        return (value / self.parts if self.parts else value * self.factor) + self.offset

    def from_si(self, value: Value) -> Value:
        """A number in SI, in this unit."""
        return (value - self.offset) * self.parts if self.parts else (value - self.offset) / self.factor


DEG = math.pi / 180
NUMBER = r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
WHAT = {
    "m": "a length", "rad": "an angle", "s": "a time", "kg": "a mass", "N": "a force", "K": "a temperature", "1": "no unit",
}  # fmt: skip
EXAMPLES = {"m": "0.1mm", "rad": "0.1deg"}
# SI unit of a quantity -> its units, and how much of the SI unit each is.
FACTORS = {
    "m": {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "km": 1e3, "inch": 0.0254, "ft": 0.3048},
    "rad": {
        "rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": DEG, "arcmin": DEG / 60, "arcsec": DEG / 3600, "turn": 2 * math.pi,
    },
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "kg": {"kg": 1.0, "g": 1e-3, "t": 1e3, "lb": 0.45359237},
    "N": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605},
    "N m": {"Nm": 1.0, "Nmm": 1e-3},
    "K": {"K": 1.0, "degC": 1.0},
    "A": {"A": 1.0, "mA": 1e-3},
    "V": {"V": 1.0},
    "px": {"px": 1.0},
    "1": {"1": 1.0, "%": 0.01},
}  # fmt: skip
OFFSETS = {"degC": 273.15}  # what zero on a scale is in SI
UNITS = {
    name: Unit(name, si, factor, OFFSETS.get(name, 0.0))
    for si, factors in FACTORS.items()
    for name, factor in factors.items()
}
# Unit -> other ways to write it.
SPELLINGS = {
    "m": ("meter", "metre", "meters", "metres"),
    "mm": ("millimeter", "millimetre", "millimeters", "millimetres"),
    "um": ("µm", "μm", "micron"),
    "inch": ("in", "inches", '"'),
    "deg": ("degree", "degrees", "°"),
    "rad": ("radian", "radians"),
    "arcsec": ("arcseconds",),
    "urad": ("µrad", "μrad"),
    "s": ("sec",),
    "Nm": ("N*m", "N m"),
    "degC": ("°C", "C", "celsius"),
    "K": ("kelvin",),
    "1": ("-",),
    "px": ("pixel", "pixels"),
}
OTHER_NAMES = {other: name for name, others in SPELLINGS.items() for other in others}


def parse_unit(
    name: object,
    si: str | None = None,
    *,
    file: object = None,
    row: int | None = None,
    column: str | int | None = None,
    key: str | None = None,
) -> Unit:
    """The unit of this name, of quantity `si` when given. Raises FormatError naming the nearest, or the units that
    fit."""
    where: dict[str, Any] = {"file": file, "row": row, "column": column, "key": key}
    fitting = [u.name for u in UNITS.values() if si is None or u.si == si]
    if not isinstance(name, str) or not name.strip():
        raise FormatError("the unit is missing", expected=", ".join(fitting), found=name, **where)
    unit = _lookup(name.strip())
    if unit is None:
        guess = nearest(name, [*fitting, *(k for k, v in OTHER_NAMES.items() if v in fitting)])
        raise FormatError("unknown unit", found=name, expected=", ".join(fitting), suggestion=guess, **where)
    if si is not None and unit.si != si:
        message = f"the unit is of another quantity, {WHAT.get(si, si)} is needed"
        raise FormatError(message, found=name, expected=", ".join(fitting) or si, **where)
    return unit


def parse_quantity(text: str, si: str, *, key: str) -> float:
    """A number with its unit ("0.1mm", "0.1 mm"), above zero, in SI. Raises FormatError saying what was expected."""
    found = re.fullmatch(NUMBER + r"\s*(.*?)\s*", text)
    example = f"{WHAT.get(si, si)} with its unit, such as {EXAMPLES.get(si, '1 ' + si)}"
    if found is None or not found[2]:
        raise FormatError("not a quantity", key=key, found=text, expected=example)
    value = parse_unit(found[2], si, key=key).to_si(float(found[1]))
    if not 0 < value < math.inf:
        raise FormatError("not a quantity above zero", key=key, found=text, expected=example)
    return value


class TypedNumber(float):
    """A number that names its unit: its value in SI, and the words that were typed."""

    typed: str

    def __new__(cls, value: float, typed: str) -> Self:
        made = super().__new__(cls, value)
        made.typed = typed
        return made

    def __str__(self) -> str:
        return self.typed

    __repr__ = __str__


def typed_number(text: str, unit: Unit, *, key: str) -> TypedNumber | None:
    """A number that names a unit of the same quantity as `unit`; None where it is no number with a unit. Raises FormatError."""
    found = re.fullmatch(NUMBER + r"\s*([^\W\d].*?|[\"°%].*?)\s*", text)
    if found is None:
        return None
    return TypedNumber(parse_unit(found[2], unit.si, key=key).to_si(float(found[1])), text.strip())


def in_si(text: str, names: str, units: Sequence[Unit], *, key: str) -> Array:
    """As many finite numbers as `names` and `units` have, between commas, in SI: each in its own unit, or in that of `units`. Raises
    ModelError."""
    words, values = text.split(","), []
    for word, unit in zip(words, units, strict=False):
        plain = finite(word)
        value = typed_number(word, unit, key=key) if plain is None else unit.to_si(plain)
        if value is not None and math.isfinite(value):
            values.append(float(value))
    if len(values) != len(units) or len(words) != len(units):
        raise ModelError("not a value of this option", key=key, found=text, expected=names)
    return np.array(values)


def is_unit(name: str) -> bool:
    """Whether a unit has this name."""
    return _lookup(name) is not None


def _lookup(name: str) -> Unit | None:
    known = UNITS.get(OTHER_NAMES.get(name, name))
    if known is not None:
        return known
    words = name.replace("(", " ").replace(")", " ").replace("*", " ").split("/")
    if len(words) < 2 or not words[0].split():
        return None
    factor, parts = 1.0, []
    for i, word in enumerate(words):
        for atom in word.split():
            unit = UNITS.get(OTHER_NAMES.get(atom, atom))
            if unit is None:
                return None
            # A temperature inside a compound is a difference: its offset has no meaning there.
            factor = factor / unit.factor if i else factor * unit.factor
            parts.append(("/" if i else " ") + unit.si.replace(" ", "/" if i else " "))
    return Unit(name, "".join(parts).strip(), factor)


@record
class Units:
    """The units in which a file and its reports speak of lengths and angles."""

    length: Unit = UNITS["mm"]
    angle: Unit = UNITS["deg"]

    def of(self, si: str) -> Unit:
        """The unit in which to show a quantity whose SI unit is `si`: every m and rad in it is replaced."""
        swap = {"m": self.length, "rad": self.angle}
        if si in swap:
            return swap[si]
        if si in UNITS and UNITS[si].si == si:
            return UNITS[si]
        # Only the leading word speaks of the parameter itself (m/K, rad/(N m)); what follows stays SI.
        head = si[: len(si) - len(si.lstrip("mrad"))]
        if head in swap and si[len(head) :].lstrip()[:1] == "/":
            return Unit(swap[head].name + si[len(head) :], si, swap[head].factor)
        return Unit(si, si)


def number(value: float) -> str:
    """A number as people write it: at most 15 digits, read as a number by every YAML version."""
    if not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    text = f"{value:.15g}"
    if "e" in text:
        digits, _, power = text.partition("e")
        return f"{digits if '.' in digits else digits + '.0'}e{power}"
    return "0" if text == "-0" else text


def finite(text: str) -> float | None:
    """A finite number from its text; None where it is none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def numbers_of(text: str, names: str, *, key: str) -> list[float]:
    """As many finite numbers as `names` has, between commas as they are. Raises ModelError."""
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != names.count(",") + 1 or not all(math.isfinite(v) for v in values):
        raise ModelError("not a value of this option", key=key, found=text, expected=names)
    return values


def same(a: float, b: float) -> bool:
    """Equal but for the rounding of a conversion there and back."""
    return abs(a - b) <= 2e-15 * max(1.0, abs(a))


def last_digits(columns: Sequence[Sequence[str]]) -> Array:
    """One unit in the last digit of each number, (rows, columns), from columns of numbers as they are written.

    Programs write so many decimals, or so many significant digits, and some drop zeros at the end: with D the most
    decimals and S the most significant digits in these columns, 10^max(-D, e - S + 1) of a number between 10^e and
    10^(e + 1).
    """
    decimals, significant, zero = (np.column_stack(part) for part in zip(*map(_written, columns), strict=True))
    d, s = int(decimals.max()), int(significant.max())
    size = np.where(zero, -d, significant - 1 - decimals)
    return np.asarray(10.0 ** np.maximum(-d, size - s + 1).astype(float))


def _written(cells: Sequence[str]) -> tuple[Ints, Ints, Bools]:
    """Decimals and significant digits of each cell (n,), and whether it is zero."""
    # Numbers with exponents, few in most files, are read one by one.
    every = "".join(cells)
    odd = []
    if "e" in every or "E" in every or not every.isascii():
        odd = [k for k, cell in enumerate(cells) if "e" in cell or "E" in cell or not cell.isascii()]
    plain = list(cells)
    for k in odd:
        plain[k] = "0"
    text: Any = np.strings.strip(np.array(plain, dtype=np.bytes_))  # typed as of str
    point, size = np.strings.find(text, b"."), np.strings.str_len(text)
    decimals = np.where(point < 0, 0, size - 1 - point)
    some = np.strings.lstrip(text, b"+-0.")
    significant = np.asarray(np.strings.str_len(some) - np.strings.count(some, b"."))
    zero = significant == 0
    significant = np.maximum(significant, 1)
    for k in odd:
        part = Decimal(cells[k].strip()).as_tuple()
        decimals[k], significant[k], zero[k] = -int(part.exponent), len(part.digits), part.digits == (0,)
    return decimals, significant, zero
