"""Files of joint offsets, written and read: a CSV in the robot's units, a ROS 2 parameter file, xacro properties (both in rad
and m). The model is fed with joint value + offset.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

from robocal._record import record
from robocal.arms.chain import Chain
from robocal.errors import FormatError, one_of
from robocal.files.csvtable import read_csv
from robocal.files.csvtext import csv_text
from robocal.files.text import Source, read_text
from robocal.files.units import Unit, number, parse_unit
from robocal.files.unread import left_over, unread_remarks
from robocal.files.urdftree import Node
from robocal.files.yamlio import parse, quote
from robocal.geometry.path.program import Joint
from robocal.remarks.remark import Remark

__all__ = ["OFFSETS", "Offset", "OffsetFile", "read_offsets"]

FED = "feed the nominal model with joint value + offset"
SUFFIX = "_offset"
EXPECTED = "what robocal export --format offsets, ros or xacro writes"


@record
class Offset:
    """What to add to a joint's value before the nominal model, and its standard deviation, in SI; `unit` is the robot
    file's."""

    joint: str
    value: float
    sigma: float | None
    unit: Unit


@record
class OffsetFile:
    """The offsets of a file by joint (rad or m), with the joints of the robot that it does not name."""

    path: Path
    sha256: str
    values: dict[str, float]
    missing: tuple[str, ...]
    remarks: tuple[Remark, ...] = ()


# --- writing --------------------------------------------------------------------------------------------------------


def _table(offsets: Sequence[Offset], robot: str, notes: Sequence[str]) -> str:
    """A CSV in the robot file's units."""
    rows = []
    for o in offsets:
        sigma = "" if o.sigma is None else f"{o.sigma / o.unit.factor:.3g}"
        rows.append([o.joint, number(o.value / o.unit.factor), sigma, o.unit.name])
    head = "".join(f"# {line}\n" for line in (f"{FED[0].upper()}{FED[1:]}.", *notes))
    return head + csv_text(["joint", "offset", "sigma", "unit"], rows)


def _ros(offsets: Sequence[Offset], robot: str, notes: Sequence[str]) -> str:
    """A parameter file of ROS 2, for whichever node reads the joints; rad and m, as REP 103 has it."""
    lines = [f"# {line}" for line in (f"Joint offsets of {robot}, in rad and m: {FED}.", *notes)]
    lines += ["/**:", "  ros__parameters:", "    joint_offsets:"]
    return "\n".join([*lines, *(f"      {quote(o.joint)}: {_real(o.value)}" for o in offsets)]) + "\n"


def _xacro(offsets: Sequence[Offset], robot: str, notes: Sequence[str]) -> str:
    """Properties to be included by a xacro, which adds them to the joints' zero positions; rad and m."""
    said = (f"Joint offsets of {robot}, in rad and m: model position = joint value + offset.", *notes)
    lines = ['<?xml version="1.0"?>', *(f"<!-- {line.replace('--', '- -')} -->" for line in said)]
    lines.append('<robot xmlns:xacro="http://www.ros.org/wiki/xacro">')
    for o in offsets:
        lines.append(f"  <xacro:property name={quoteattr(f'{o.joint}{SUFFIX}')} value={quoteattr(_real(o.value))}/>")
    return "\n".join([*lines, "</robot>"]) + "\n"


def _real(value: float) -> str:
    """A number that no parser takes for a whole one."""
    text = number(value)
    return text if any(c in text for c in ".e") else f"{text}.0"


Write = Callable[[Sequence[Offset], str, Sequence[str]], str]
OFFSETS: dict[str, Write] = {"offsets": _table, "ros": _ros, "xacro": _xacro}


# --- reading --------------------------------------------------------------------------------------------------------


def read_offsets(path: str | os.PathLike[str], chain: Chain) -> OffsetFile:
    """Reads a file of any of these forms for a robot. Raises FileError, or FormatError naming row, column or key; joints that
    the robot lacks are refused."""
    source = read_text(path)
    said: tuple[Remark, ...] = ()
    if source.text.lstrip().startswith("<"):
        values = _from_xacro(source, chain)
    elif source.path.suffix.lower() in (".yaml", ".yml") or "ros__parameters" in source.text:
        values = _from_ros(source, chain)
    else:
        values, said = _from_table(source, chain)
    if not values:
        raise FormatError("there are no joint offsets in this file", file=source.path, expected=EXPECTED)
    missing = tuple(n for n in chain.joint_names if n not in values)
    return OffsetFile(source.path, source.sha256, values, missing, said)


def _joint(chain: Chain, name: str, file: Path, row: int | None) -> Joint:
    """The robot's joint of this name. Raises FormatError."""
    if name not in chain.joint_names:
        known = one_of(name, chain.joint_names)
        raise FormatError("the robot has no such joint", file=file, row=row, found=name, **known)
    return chain.joints[chain.joint_names.index(name)]


def _from_table(source: Source, chain: Chain) -> tuple[dict[str, float], tuple[Remark, ...]]:
    table = read_csv(source.path)
    names = table.texts("joint")
    offsets = table.numbers(["offset"])[:, 0]
    inside = table.unit("offset")
    units = (inside,) * len(table) if inside is not None else table.texts("unit")
    out: dict[str, float] = {}
    for i, name in enumerate(names):
        row = int(table.lines[i])
        joint = _joint(chain, name, source.path, row)
        if name in out:
            raise FormatError("this joint is given twice", file=source.path, row=row, column="joint", found=name)
        si = "m" if joint.type == "prismatic" else "rad"
        out[name] = float(parse_unit(units[i], si, file=source.path, row=row, column="unit").to_si(float(offsets[i])))
    return out, table.remarks + unread_remarks([left_over(table, ("unit", "sigma"), ("sigma",))])


def _from_ros(source: Source, chain: Chain) -> dict[str, float]:
    document = parse(source)
    found = [
        (node, inner["ros__parameters"].get("joint_offsets"))
        for node, inner in document.data.items()
        if isinstance(inner, dict) and isinstance(inner.get("ros__parameters"), dict)
    ]
    given = [(node, table) for node, table in found if isinstance(table, dict)]
    if len(given) != 1:
        document.fail("there are no joint offsets in this file", found=f"{len(given)} tables", expected=EXPECTED)
    node, table = given[0]
    out = {}
    for name, value in table.items():
        path = (node, "ros__parameters", "joint_offsets", name)
        _joint(chain, str(name), source.path, document.row(path))
        finite = not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
        document.insist(finite, "not a finite number", path, found=value, expected="an offset in rad or m")
        out[str(name)] = float(value)
    return out


def _from_xacro(source: Source, chain: Chain) -> dict[str, float]:
    out: dict[str, float] = {}
    for node in Node.parse(source.text, source.path).children:
        name = node.attributes.get("name", "")
        if node.tag != "xacro:property" or not name.endswith(SUFFIX):
            continue
        joint = _joint(chain, name.removesuffix(SUFFIX), source.path, node.row)
        text = node.attributes.get("value", "")
        try:
            value = math.nan if "_" in text else float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise FormatError("not a finite number", file=source.path, row=node.row, key=name, found=text)
        if joint.name in out:
            raise FormatError("this joint is given twice", file=source.path, row=node.row, key=name)
        out[joint.name] = value
    return out
