"""Modelling conventions as functions that write elements; the rest of the package does not depend on DH or POE.

    T_base_tool(q) = frame(base) joint_1(q_1) ... joint_n(q_n) [frame(home)] frame(tool)

`CONVENTIONS` lists them with their keys; `recipes.py` holds those that are tables of elementary transforms,
`screws.py` those that place an axis in space. Every parameter is named `joint.symbol`; base and tool are frames
`base.x` ... `tool.rz`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from robocal.arms.chain import Chain
from robocal.arms.recipes import ELEMENTS, RECIPES
from robocal.arms.row_builder import QUANTITIES, TYPES, Convention, Row, RowBuilder, finite
from robocal.arms.screws import SCREW_CONVENTIONS
from robocal.errors import ModelError, look_up, one_of
from robocal.geometry.path.program import Element, Joint, frame_element
from robocal.parameters import Parameter, ParameterTable, frame_parameters

__all__ = ["CONVENTIONS", "QUANTITIES", "Convention", "chain", "convention_of", "rows"]

CONVENTIONS = {c.name: c for c in (*RECIPES, *SCREW_CONVENTIONS, ELEMENTS)}
RESERVED = ("base", "tool", "home", "1")


def convention_of(name: str) -> Convention:
    """The convention with this name. Raises ModelError with the nearest one."""
    return look_up(CONVENTIONS, name, "unknown convention")


MOST_ROWS = 200  # fixed ones included; what is made of them grows as their square


def chain(
    name: str,
    convention: str,
    rows: Sequence[Row],
    *,
    base: Sequence[float] = (0.0,) * 6,
    tool: Sequence[float] = (0.0,) * 6,
    home: Sequence[float] | None = None,
    source: str = "",
    meta: Mapping[str, object] | None = None,
) -> Chain:
    """An arm from its rows: base frame, joints, tool frame (frame vectors: x y z in m, rotation vector in rad);
    everything in SI and rad.

    A row gives `name`, `type` (revolute, prismatic, fixed), `limits` (lower, upper), `gain` and the convention's
    keys. `home` is the pose of the flange with the arm at zero, for conventions whose rows are in base coordinates;
    `tool` comes behind it. Raises ModelError, with the key, for anything unknown, missing, misshapen or not finite.
    """
    rule = convention_of(convention)
    if len(rows) > MOST_ROWS:
        expected = f"at most {MOST_ROWS}"
        raise ModelError("an arm has not so many joints", key="joints", found=len(rows), expected=expected)
    elements: list[Element] = [frame_element("base")]
    parameters: list[Parameter] = list(frame_parameters("base", _frame(base, "base")))
    geometric: list[str] = []
    joints: list[Joint] = []
    for i, row in enumerate(rows, start=1):
        pen = RowBuilder(_name(row, i), _type(row, i), row, rule.key)
        lower, upper = pen.vector("limits") if pen.kind != "fixed" else (-math.inf, math.inf)
        if not lower <= upper:
            message = "limits in the wrong order"
            raise ModelError(message, key=f"{pen.joint}.limits", found=[lower, upper], expected="lower, upper")
        if any(pen.joint == p.name.rpartition(".")[0] for p in parameters):
            raise ModelError("a joint name is used twice", key=pen.joint)
        rule.write(pen)
        pen.finish()
        if pen.kind != "fixed":
            joints.append(Joint(pen.joint, pen.kind, float(lower), float(upper)))
        elements += pen.elements
        parameters += pen.parameters
        geometric += pen.geometric
    _check_shares(rows, joints)
    if home is not None:
        if not rule.home:
            expected = "zero-reference, poe"
            raise ModelError("this convention has no home pose", key="home", found=convention, expected=expected)
        elements.append(frame_element("home"))
        parameters += frame_parameters("home", _frame(home, "home"))
    elements.append(frame_element("tool"))
    # A tool that is free is a tool whose place on the flange is only roughly known.
    parameters += frame_parameters("tool", _frame(tool, "tool"), expected=(0.1, 0.5))
    known = {**(meta or {}), "rows": tuple(dict(row) for row in rows)}
    better = f"{convention}-hayati" if f"{convention}-hayati" in CONVENTIONS else ""
    return Chain(
        name, tuple(elements), tuple(joints), ParameterTable(tuple(parameters)), convention, source, known, tuple(geometric),
        upright=not rule.complete, better=better,
    )  # fmt: skip


def _check_shares(rows: Sequence[Row], joints: Sequence[Joint]) -> None:
    """Raises ModelError where a joint counts with itself, or with something that is no joint of its type."""
    types = {j.name: j.type for j in joints}
    for i, row in enumerate(rows, start=1):
        own, given = _name(row, i), row.get("with")
        for other in given if isinstance(given, Mapping) else ():
            alike = [n for n, kind in types.items() if n != own and kind == types.get(own)]
            if other not in alike:
                message = "a joint counts with other joints of its type"
                raise ModelError(message, key=f"{own}.with", found=other, **one_of(str(other), alike))


def rows(chain: Chain) -> list[dict[str, object]]:
    """The rows of a chain with the values of its table, in SI and rad: what `chain` was given, corrected. The inverse
    of `chain`.

    Raises ModelError when the chain was not written by a convention.
    """
    given = chain.meta.get("rows")
    if not isinstance(given, tuple):
        raise ModelError("this arm was not written by a convention", found=chain.name)
    rule = convention_of(chain.convention)
    out: list[dict[str, object]] = []
    for i, row in enumerate(given, start=1):
        owner = _name(row, i)
        values = {p.name.rpartition(".")[2]: p.value for p in chain.table.rows if p.name.rpartition(".")[0] == owner}
        plain = {**row, **{k.name: values[k.name] for k in rule.keys if k.name in values}}
        made = plain if rule.read is None else rule.read(row, values)
        gain = values.get("gain", 1.0)
        if gain != 1.0 or "gain" in row:
            made["gain"] = gain
        out.append(made)
    return out


def _name(row: Row, i: int) -> str:
    name = row.get("name", f"j{i}")
    if not isinstance(name, str) or not name or name in RESERVED:
        expected = f"a word other than {', '.join(RESERVED)}"
        raise ModelError("not a joint name", key=f"joint {i}.name", found=name, expected=expected)
    return name


def _type(row: Row, i: int) -> str:
    kind = row.get("type", "revolute")
    if kind not in TYPES:
        key = f"{_name(row, i)}.type"
        raise ModelError("unknown joint type", key=key, found=kind, **one_of(kind, TYPES))
    return str(kind)


def _frame(value: Sequence[float], owner: str) -> list[float]:
    if len(value) != 6:
        expected = "x, y, z in m and a rotation vector in rad"
        raise ModelError("wrong shape", key=owner, found=list(value), expected=expected)
    return [finite(v, owner) for v in value]
