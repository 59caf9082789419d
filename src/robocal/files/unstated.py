"""Keys that one row of a robot leaves out where all others state them: what is absent then counts as zero, and may have been
forgotten.

Tables with the zeros left out are a habit, and right; so a row is compared with the others of its own robot, and nothing
is said where any of them leaves the same key out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from robocal.arms.conventions import Convention
from robocal.files.units import number
from robocal.files.yamlio import Path_, YamlDocument
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["complete_rows", "find_missing_keys", "missing_key_remarks"]

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
    return (*out, *_steps(rows, document))


def _steps(rows: Sequence[Row], document: YamlDocument) -> Iterator[Remark]:
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
