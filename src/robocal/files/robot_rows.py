"""Rows of a robot file, in its units, to rows of a convention in SI, and the numbers that a calibration changed back
to where they stand.

What a key is (a length, an angle, a point, ...) is declared by the convention; nothing here knows a convention by name.

What a row leaves out counts as zero, and may have been forgotten. Tables with the zeros left out are a habit, and right; so a row is
compared with the others of its own robot, and nothing is said where any of them leaves the same key out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from robocal.arms.conventions import QUANTITIES, Convention
from robocal.errors import one_of
from robocal.files.units import UNITS, Unit, Units, number, same
from robocal.files.yamlio import Path_, YamlDocument, quote
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = [
    "MOST_REACH",
    "MOST_TURN",
    "MOST_TURNS",
    "NO_LIMIT",
    "changes",
    "complete_rows",
    "missing_key_remarks",
    "read_row",
    "row_numbers",
    "show_row",
]

ONE = UNITS["1"]
MOST_REACH = 50.0  # m: no arm's lengths add up to more
MOST_TURN = 2.01 * math.pi  # rad: more than a whole turn, and what rounding adds
MOST_TURNS = 30.0  # rad between the limits of a joint: five turns, more than the cables in a wrist bear
NO_LIMIT = 1000.0  # rad: exporters write this and more where a joint has no limits


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
    document.insist(isinstance(row, dict), "not a mapping", at, found=row, expected="{name: ..., type: ..., ...}")
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
            expected = "a word (in quotes when it is a number)"
            document.insist(isinstance(value, str), "not a text", where, found=value, expected=expected)
            out[name] = value
        elif quantity == "steps":
            out[name] = _steps(value, where, units, document)
        elif quantity == "shares":
            document.insist(isinstance(value, dict), "not a mapping", where, found=value, expected="such as {j2: 1}")
            out[name] = {str(n): _number(v, (*where, n), ONE, document) for n, v in value.items()}
        elif quantity in SIZES:
            unit, size, limits = _unit(quantity, kind, units), SIZES[quantity], quantity == "limits"
            whole = isinstance(value, list) and len(value) == size
            document.insist(whole, "wrong shape", where, found=value, expected=f"a list of {size} numbers")
            numbers = [_number(v, (*where, i), unit, document, infinite=limits) for i, v in enumerate(value)]
            ordered = not limits or numbers[0] <= numbers[1]
            document.insist(ordered, "limits in the wrong order", where, found=value, expected="lower, upper")
            out[name] = numbers
        else:
            out[name] = _number(value, where, _unit(quantity, kind, units), document)
    for key in rule.keys:
        there = key.name in out or not key.required
        document.insist(there, "a key is missing", (*at, key.name), expected=QUANTITIES.get(key.quantity, key.quantity))
    return out


def _number(value: Any, at: Path_, unit: Unit, document: YamlDocument, *, infinite: bool = False) -> float:
    expected = "a finite number" + ("" if unit is ONE else f" in {unit.name}")
    bad = isinstance(value, bool) or not isinstance(value, int | float)
    bad = bad or math.isnan(value) or (math.isinf(value) and not infinite)
    document.insist(not bad, "not a finite number", at, found=value, expected=expected)
    return unit.to_si(float(value))


def _steps(value: Any, at: Path_, units: Units, document: YamlDocument) -> list[dict[str, object]]:
    """A list of elementary transforms; `driven` may be true."""
    keys = "{axis, value, symbol, driven}"
    document.insist(isinstance(value, list), "not a list", at, found=value, expected=f"a list of {keys}")
    out: list[dict[str, object]] = []
    for i, entry in enumerate(value):
        document.insist(isinstance(entry, dict), "not a mapping", (*at, i), found=entry, expected=keys)
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
        elif isinstance(value, Mapping):
            for other, share in value.items():
                yield (name, other), float(share), ONE
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
            parts = (number(u.from_si(v)) for p, v, u in row_numbers(new, rule, units) if p[0] == name)
            out[(name,)] = f"[{', '.join(parts)}]"
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
        elif isinstance(value, Mapping):
            words.append(f"{name}: {{{', '.join(f'{quote(n)}: {shown[name, n]}' for n in value)}}}")
        elif (name, 0) in shown and isinstance(value, Sequence):
            words.append(f"{name}: [{', '.join(shown[(name, i)] for i in range(len(value)))}]")
        elif isinstance(value, Sequence):
            steps = (_show_step(e, shown[(name, i, "value")]) for i, e in enumerate(value))
            words.append(f"{name}: [{', '.join(steps)}]")
    return "{" + ", ".join(words) + "}"


def _show_step(entry: Mapping[str, object], value: str) -> str:
    words = [f"axis: {entry.get('axis')}", f"value: {value}"]
    if entry.get("symbol"):
        words.append(f"symbol: {quote(str(entry['symbol']))}")
    if entry.get("driven"):
        words.append(f"driven: {entry['driven']}")
    return "{" + ", ".join(words) + "}"


# --- keys that one row leaves out where all others state them ----------------------------------------------------------------


Row = Mapping[str, Any]
STILL = ("gain", "offset", "limits")  # of joints that move; a fixed row has none of them


def find_missing_keys(rows: Sequence[Row], rule: Convention) -> Iterator[tuple[int, tuple[str, ...]]]:
    """The rows, by number, that leave out keys which all others state; `rows` are those of a file.

    A fixed row is no measure for joints that move; and the number to which the joint's own value is added is compared
    among joints of one type. Few rows, or rows of which each states other keys, tell no habit.
    """
    kinds = [str(row.get("type") or "revolute") for row in rows]
    own = [k.name for k in rule.keys]
    sets = [{key for key in own if row.get(key) is not None} for row in rows]
    plain = any(row.get(key) == 0 and not isinstance(row.get(key), bool) for row in rows for key in own)
    for i, row in enumerate(rows):
        moving = [j for j in range(len(rows)) if j != i and (kinds[i] == "fixed" or kinds[j] != "fixed")]
        lacking = []
        for key in rule.key:
            if row.get(key) is not None or (kinds[i] == "fixed" and key in STILL):
                continue
            alike = [j for j in moving if kinds[j] == kinds[i]] if key in (rule.revolute, rule.prismatic) else moving
            if alike and all(rows[j].get(key) is not None for j in alike):
                lacking.append(key)
        regular = len({frozenset(sets[j] - {rule.revolute, rule.prismatic}) for j in moving}) == 1
        regular = regular and len([key for key in lacking if key in own]) == 1
        telling = (regular and (plain or len(moving) > 1)) or (plain and len(moving) > 2)
        said = tuple(key for key in lacking if (telling if key in own else len(moving) > 1))
        if said:
            yield i, said


def _default(rule: Convention, key: str, i: int) -> str:
    """The value that row i has where it does not state a key, as a file would state it."""
    default = f"j{i + 1}" if key == "name" else rule.key[key].default
    if isinstance(default, tuple):
        return f"[{', '.join(number(float(v)) for v in default)}]"
    return number(float(default)) if isinstance(default, int | float) else str(default)


def missing_key_remarks(rows: Sequence[Row], rule: Convention, document: YamlDocument) -> tuple[Remark, ...]:
    """One remark for each joint that leaves out what all others state."""
    out = []
    for i, keys in find_missing_keys(rows, rule):
        values = tuple(f"{key}: {_default(rule, key, i)}" for key in keys)
        name = str(rows[i].get("name") or f"j{i + 1}")
        out.append(_remark(document, ("joints", i), f"joint {name}", keys, values))
    return (*out, *_unstated_steps(rows, document))


def _unstated_steps(rows: Sequence[Row], document: YamlDocument) -> Iterator[Remark]:
    """The same for the transforms of rows that list them: one without a value is none, but for the joint's own."""
    listed = [
        (("joints", i, "elements", k), step)
        for i, row in enumerate(rows)
        for k, step in enumerate(row.get("elements") or ())
        if not step.get("driven")
    ]
    for key, value in (("value", "value: 0"), ("symbol", "no symbol: a constant")):
        lacking = [n for n, (_, step) in enumerate(listed) if step.get(key) is None]
        if len(lacking) == 1 and len(listed) > 2:
            at = listed[lacking[0]][0]
            yield _remark(document, at, f"element {at[3]} of joint {at[1]}, counted from 0,", (key,), (value,))


def _remark(document: YamlDocument, at: Path_, joint: str, keys: tuple[str, ...], values: tuple[str, ...]) -> Remark:
    file, row = str(document.path), document.row(at)
    return Remark.of(Code.KEYS_UNSTATED, file=file, row=row, joint=joint, keys=keys, others="all others", values=values)


def complete_rows(given: Sequence[Row], made: Mapping[Path_, float | str], rule: Convention) -> dict[Path_, str]:
    """The zeros of rows that would be the only ones without a key which a calibration gives to all others."""
    forgotten = {(i, key) for i, keys in find_missing_keys(given, rule) for key in keys}
    after = [dict(row) for row in given]
    for _, i, key, *_rest in (path for path in made if len(path) >= 3):
        if after[int(i)].get(str(key)) is None:
            after[int(i)][str(key)] = 1.0
    late = [(i, key) for i, keys in find_missing_keys(after, rule) for key in keys]
    return {("joints", i, key): _default(rule, key, i) for i, key in late if (i, key) not in forgotten}
