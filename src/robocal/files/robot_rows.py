"""Rows of a robot file, in its units, to rows of a convention in SI, and the numbers that a calibration changed back
to where they stand.

What a key is (a length, an angle, a point, ...) is declared by the convention; nothing here knows a convention by name.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from robocal.arms.conventions import QUANTITIES, Convention
from robocal.errors import one_of
from robocal.files.units import UNITS, Unit, Units, number, same
from robocal.files.yamlio import Path_, YamlDocument, quote

__all__ = ["changes", "read_row", "row_numbers", "show_row"]

ONE = UNITS["1"]


def _unit(quantity: str, kind: str, units: Units) -> Unit:
    """The unit of a quantity in a row of this joint type."""
    own = units.length if kind == "prismatic" else units.angle
    return {
        "length": units.length,
        "angle": units.angle,
        "drive": own,
        "limits": own,
        "point": units.length,
        "angles": units.angle,
        "moment": ONE if kind == "prismatic" else units.length,
    }.get(quantity, ONE)


SIZES = {"direction": 3, "point": 3, "angles": 3, "moment": 3, "limits": 2}


def read_row(row: Any, at: Path_, rule: Convention, units: Units, document: YamlDocument) -> dict[str, object]:
    """One joint in SI. Raises FormatError with the line and key path of whatever is not as the convention declares."""
    if not isinstance(row, dict):
        document.fail("not a mapping", at, found=row, expected="{name: ..., type: ..., ...}")
    kind = str(row.get("type") or "revolute")
    out: dict[str, object] = {}
    for name, value in row.items():
        if name not in rule.key:
            document.fail("unknown key", (*at, name), **one_of(name, rule.key))
        if value is None:
            continue
        quantity = rule.key[name].quantity
        where = (*at, name)
        if quantity == "text":
            if not isinstance(value, str):
                document.fail("not a text", where, found=value, expected="a word (in quotes when it is a number)")
            out[name] = value
        elif quantity == "steps":
            out[name] = _steps(value, where, units, document)
        elif quantity in SIZES:
            unit = _unit(quantity, kind, units)
            size = SIZES[quantity]
            if not isinstance(value, list) or len(value) != size:
                document.fail("wrong shape", where, found=value, expected=f"a list of {size} numbers")
            limits = quantity == "limits"
            out[name] = numbers = [
                _number(v, (*where, i), unit, document, infinite=limits) for i, v in enumerate(value)
            ]
            if limits and numbers[0] > numbers[1]:
                document.fail("limits in the wrong order", where, found=value, expected="lower, upper")
        else:
            out[name] = _number(value, where, _unit(quantity, kind, units), document)
    for key in rule.keys:
        if key.required and key.name not in out:
            document.fail("a key is missing", (*at, key.name), expected=QUANTITIES.get(key.quantity, key.quantity))
    return out


def _number(value: Any, at: Path_, unit: Unit, document: YamlDocument, *, infinite: bool = False) -> float:
    expected = "a finite number" + ("" if unit is ONE else f" in {unit.name}")
    bad = isinstance(value, bool) or not isinstance(value, int | float)
    if bad or math.isnan(value) or (math.isinf(value) and not infinite):
        document.fail("not a finite number", at, found=value, expected=expected)
    return unit.to_si(float(value))


def _steps(value: Any, at: Path_, units: Units, document: YamlDocument) -> list[dict[str, object]]:
    """A list of elementary transforms; `driven` may be true."""
    if not isinstance(value, list):
        document.fail("not a list", at, found=value, expected="a list of {axis, value, symbol, driven}")
    out: list[dict[str, object]] = []
    for i, entry in enumerate(value):
        if not isinstance(entry, dict):
            document.fail("not a mapping", (*at, i), found=entry, expected="{axis, value, symbol, driven}")
        made = {k: v for k, v in entry.items() if v is not None}
        if "value" in made:
            made["value"] = _number(made["value"], (*at, i, "value"), _step_unit(entry, units), document)
        if isinstance(made.get("driven"), bool):
            made["driven"] = int(made["driven"])
        out.append(made)
    return out


def _step_unit(entry: Mapping[str, object], units: Units) -> Unit:
    return units.length if str(entry.get("axis", "")).startswith("t") else units.angle


def row_numbers(row: Mapping[str, object], rule: Convention, units: Units) -> Iterator[tuple[Path_, float, Unit]]:
    """Every number of a row in SI: its path in the row, its value, and its unit in the file."""
    kind = str(row.get("type", "revolute"))
    for name, value in row.items():
        quantity = rule.key[name].quantity if name in rule.key else "text"
        if quantity == "steps" and isinstance(value, Sequence):
            for i, entry in enumerate(value):
                yield (name, i, "value"), float(entry.get("value", 0.0)), _step_unit(entry, units)
        elif quantity in SIZES and isinstance(value, Sequence):
            for i, part in enumerate(value):
                yield (name, i), float(part), _unit(quantity, kind, units)
        elif quantity != "text" and isinstance(value, int | float):
            yield (name,), float(value), _unit(quantity, kind, units)


def changes(
    old: Mapping[str, object], new: Mapping[str, object], given: Mapping[str, Any], rule: Convention, units: Units
) -> dict[Path_, float | str]:
    """What to write into a row of the file (`given`) so that it says `new` (SI) instead of `old` (SI): only numbers
    that differ."""
    before = {path: value for path, value, _ in row_numbers(old, rule, units)}
    out: dict[Path_, float | str] = {}
    for path, value, unit in row_numbers(new, rule, units):
        name = str(path[0])
        default = rule.key[name].default
        base = before.get(path, default[path[1]] if isinstance(default, tuple) and len(path) == 2 else default)  # type: ignore[index]
        if not isinstance(base, int | float) or same(float(base), value):
            continue
        if len(path) == 2 and given.get(name) is None:
            out[(name,)] = (
                f"[{', '.join(number(u.from_si(v)) for p, v, u in row_numbers(new, rule, units) if p[0] == name)}]"
            )
        else:
            out[path] = unit.from_si(value)
    return out


def show_row(row: Mapping[str, object], rule: Convention, units: Units) -> str:
    """A row in SI as one line of YAML in the file's units; zeros that are the default are left out unless they are all
    there is."""
    shown = {path: number(unit.from_si(value)) for path, value, unit in row_numbers(row, rule, units)}
    words = []
    for name, value in row.items():
        default = rule.key[name].default if name in rule.key else None
        if name == "limits" and isinstance(value, Sequence) and all(math.isinf(v) for v in value):
            continue
        if (name,) in shown:
            if name in ("offset", "gain") and value == default:
                continue
            words.append(f"{name}: {shown[(name,)]}")
        elif isinstance(value, str):
            words.append(f"{name}: {quote(value)}")
        elif (name, 0) in shown and isinstance(value, Sequence):
            words.append(f"{name}: [{', '.join(shown[(name, i)] for i in range(len(value)))}]")
        elif isinstance(value, Sequence):
            words.append(
                f"{name}: [{', '.join(_show_step(e, shown[(name, i, 'value')]) for i, e in enumerate(value))}]"
            )
    return "{" + ", ".join(words) + "}"


def _show_step(entry: Mapping[str, object], value: str) -> str:
    words = [f"axis: {entry.get('axis')}", f"value: {value}"]
    if entry.get("symbol"):
        words.append(f"symbol: {quote(str(entry['symbol']))}")
    if entry.get("driven"):
        words.append(f"driven: {entry['driven']}")
    return "{" + ", ".join(words) + "}"
