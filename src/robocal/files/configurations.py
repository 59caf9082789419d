"""The configurations of a table: joint values, what was recorded with them, and for kinds that compare two the other
one of each row."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robocal._types import Array, Ints
from robocal.errors import nearest, one_of
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, JointsModel, SecondModel, ValueModel
from robocal.files.headers import CONFIGURATION, PER_JOINT, joint_columns
from robocal.files.kinds.kind import column_units
from robocal.files.text import meant
from robocal.files.units import UNITS, Unit
from robocal.files.unread import near_miss
from robocal.files.yamlio import Path_, YamlDocument
from robocal.measure.data import Configurations
from robocal.measure.machine import Model, freedom_of, joints_of
from robocal.measure.reach import names_of
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark

__all__ = ["Places", "joint_values", "nowhere", "read_configurations", "read_recorded", "remarks_on_columns"]

# What holds for both configurations of a row; the rest was recorded at the first one.
SHARED = ("time", "temperature", "payload")


@dataclass(frozen=True)
class Places:
    """The configurations, the one of each row, the other one of each row where there are two, the joint values of the
    rows, and which rows measure something; `angle` is the unit of the joints."""

    configurations: Configurations
    first: Ints
    second: Ints | None
    joints: Array
    measuring: Ints
    angle: Unit


def read_configurations(model: DataModel, table: CsvTable, chain: Model, document: YamlDocument) -> Places:
    """Rows with the same id are the same configuration. Raises FormatError."""
    q, angle, digits = joint_values(model.joints, table, chain, document, ("joints",))
    columns, groups = read_recorded(model, table, chain, document)
    stated = "id" in model.configuration
    ids = _default_ids(table) if not stated else table.texts(model.configuration["id"].column)
    every = np.arange(len(table))
    second = getattr(model, "second", None)
    if second is None:
        made, index = _merge(Configurations(ids, q, columns, groups=groups, digits=digits), table, every)
        if freedom_of(chain) is not None and not joints_of(chain):
            made = replace(made, joints=None, digits=None)
        return Places(made, index, None, q, every, angle)
    if second.columns is None and second.id is not None:
        if not stated:
            document.fail("a key is missing", ("configuration", "id"), expected="the column with the id of each row")
        made, index = _merge(Configurations(ids, q, columns, groups=groups, digits=digits), table, every)
        other, measuring = _second_rows(second, table, made, index)
        return Places(made, index, other, q, measuring, angle)
    q2, _, digits2 = joint_values(
        _second_joints(second, model.joints, table, chain), table, chain, document, ("second",)
    )
    ids2 = tuple(f"{i}:second" for i in _default_ids(table))
    if second.id is not None:
        ids2 = table.texts(second.id.column)
    nothing = np.full(len(table), np.nan)
    both = Configurations(
        ids + ids2,
        np.vstack([q, q2]),
        {k: np.concatenate([v, v if k in SHARED else nothing]) for k, v in columns.items()},
        groups=None if groups is None else groups + groups,
        digits=np.vstack([digits, digits2]),
    )
    made, index = _merge(both, table, np.concatenate([every, every]))
    return Places(made, index[: len(q)], index[len(q) :], q, every, angle)


def nowhere(given: Configurations, names: tuple[str, ...], beside: Ints) -> Configurations:
    """The configurations with some more in which the machine stood nowhere: what was known without it. Each belongs to
    the group of the configuration that it is `beside`."""
    if not names or given.joints is None:
        return given
    nothing = np.full((len(names), given.joints.shape[1]), np.nan)
    return Configurations(
        (*given.ids, *names),
        np.vstack([given.joints, nothing]),
        {k: np.concatenate([v, nothing[:, 0]]) for k, v in given.columns.items()},
        groups=None if given.groups is None else (*given.groups, *(given.groups[i] for i in beside)),
        digits=None if given.digits is None else np.vstack([given.digits, np.zeros_like(nothing)]),
    )


def _default_ids(table: CsvTable) -> tuple[str, ...]:
    return tuple(f"{table.path.name}:{line}" for line in table.lines)


def _second_joints(second: SecondModel, first: JointsModel, table: CsvTable, chain: Model) -> JointsModel:
    """The other joints' columns, by default `second.` and the first ones' names; their unit is the first ones'."""
    columns = second.columns
    if columns is None:
        own = first.columns if first.columns is not None else joint_columns(table, chain)
        columns = [f"second.{name}" for name in own]
    # A header that speaks for itself needs no unit, and the first joints' would only contradict it.
    silent = second.unit is None and all(table.unit(c) is None for c in columns)
    return JointsModel(columns=columns, unit=first.unit if silent else second.unit)


def joint_values(
    model: JointsModel, table: CsvTable, chain: Model, document: YamlDocument, at: Path_
) -> tuple[Array, Unit, Array]:
    """Joint values (k, n) in rad or m, the unit of the angles, and what one unit in the last digit means (k, n)."""
    n = len(joints_of(chain))
    columns = model.columns
    if columns is None:
        columns = joint_columns(table, chain)
    if len(columns) != n:
        expected = f"{n} for {chain.name}: {', '.join(names_of(chain))}"
        document.fail("wrong number of joint columns", (*at, "columns"), found=len(columns), expected=expected)
    unit = model.unit
    if isinstance(unit, list) and len(unit) != n:
        document.fail("wrong number of units", (*at, "unit"), found=len(unit), expected=f"one unit, or {n}")
    si = ["m" if j.type == "prismatic" else "rad" for j in joints_of(chain)]
    units = column_units(table, columns, unit, si, document, at)
    angle = next((u for u in units if u.si == "rad"), UNITS["rad"])
    factors = np.array([u.factor for u in units])
    return table.numbers(columns) * factors, angle, table.digits(columns) * factors


def read_recorded(
    model: DataModel, table: CsvTable, chain: Model, document: YamlDocument
) -> tuple[dict[str, Array], tuple[str, ...] | None]:
    """What was recorded with each row, by name in SI, and the label of its group."""
    columns: dict[str, Array] = {}
    groups = None
    for name, given in model.configuration.items():
        at: Path_ = ("configuration", name)
        if name in ("id", "group"):
            if isinstance(given, ValueModel):
                document.fail("not one column", at, found=given.columns, expected="one column")
            if name == "group":
                groups = table.texts(given.column)
        elif isinstance(given, ValueModel):
            if name not in PER_JOINT or len(given.columns or ()) != len(joints_of(chain)):
                expected = f"one column, or for {' and '.join(PER_JOINT)} one per joint, {len(joints_of(chain))}"
                document.fail("wrong number of columns", (*at, "columns"), found=given.columns, expected=expected)
            for joint, column in zip(names_of(chain), given.columns, strict=True):
                key = f"{name}.{joint}"
                columns[key] = _column(key, column, given.unit, table, chain, document, at)
        else:
            columns[name] = _column(name, given.column, given.unit, table, chain, document, at)
    return columns, groups


def remarks_on_columns(model: DataModel, document: YamlDocument) -> tuple[Remark, ...]:
    """A remark on each name under which a column is only carried along, where it looks like one that has a meaning."""
    known = [n for n in (*CONFIGURATION, "group", *PER_JOINT) if n not in model.configuration]
    out = []
    for name in model.configuration:
        stem, _, joint = name.partition(".")
        if name in (*CONFIGURATION, "group") or stem in PER_JOINT:
            continue
        near = near_miss(stem if joint else name, known)
        if near is not None:
            near = f"{near}.{joint}" if joint else near
            where = {"file": str(document.path), "row": document.row(("configuration", name))}
            out.append(Remark.of(Code.COLUMN_CARRIED, **where, name=name, near=near))
    return tuple(out)


def _column(
    name: str, column: str | int, stated: str | None, table: CsvTable, chain: Model, document: YamlDocument, at: Path_
) -> Array:
    """One column of a configuration in SI. Raises FormatError for a name without a meaning or a unit."""
    stem, _, joint = name.partition(".")
    known = {*CONFIGURATION, "group"}
    if stem in PER_JOINT and joint:
        if joint not in names_of(chain):
            document.fail("no joint has this name", at, found=joint, **one_of(joint, names_of(chain)))
        prismatic = joints_of(chain)[names_of(chain).index(joint)].type == "prismatic"
        si = "1" if stem == "approach" else "N" if prismatic else "N m"
    elif name in CONFIGURATION:
        si = CONFIGURATION[name]
    else:
        word = stated or table.unit(column)
        if word is None:
            expected = f"{', '.join(known)}, or another with a unit"
            document.fail("unknown key", at, expected=expected, suggestion=nearest(name, known))
        si = document.unit(word, None, at, f"configuration.{name}").si
    unit = column_units(table, [column], stated, [si], document, at)[0]
    values = unit.to_si(table.numbers([column])[:, 0])
    if stem == "approach":
        sides = np.isin(values, (-1.0, 0.0, 1.0))
        table.insist(sides, [column], "not a side of approach", values, expected="-1, 0 or 1")
    return values


def _merge(given: Configurations, table: CsvTable, row: Ints) -> tuple[Configurations, Ints]:
    """Equal ids become one configuration; `row` is the row of the table that each came from. Returns the number of each.

    Raises FormatError when one id has two sets of joint values or belongs to two groups."""
    ids, joints = given.ids, given.joints
    assert joints is not None
    if len(set(ids)) == len(ids):
        return given, np.arange(len(ids))
    first: dict[str, int] = {}
    for i, name in enumerate(ids):
        first.setdefault(name, i)
    kept = np.array(list(first.values()))
    number = {name: i for i, name in enumerate(first)}
    index = np.array([number[name] for name in ids])
    for i in map(int, np.flatnonzero((np.abs(joints - joints[kept][index]) > 1e-9).any(axis=1))):
        original = int(table.lines[row[first[ids[i]]]])
        raise table.fail(
            f"this configuration has other joint values than in row {original}",
            int(row[i]),
            found=ids[i],
            expected="one id per configuration",
        )
    if given.groups is not None:
        for i, label in enumerate(given.groups):
            if label != given.groups[first[ids[i]]]:
                message = (
                    f"configuration {ids[i]!r} belongs to another group than in row {table.lines[row[first[ids[i]]]]}"
                )
                raise table.fail(message, int(row[i]), found=label, expected=given.groups[first[ids[i]]])
    # What the first row does not know, a later one of the same configuration may.
    made = given.take(kept)
    for name, column in given.columns.items():
        known = np.flatnonzero(np.isfinite(column))[::-1]
        filled = made.columns[name].copy()
        lacking = np.isnan(filled)
        later = np.full(len(kept), np.nan)
        later[index[known]] = column[known]
        filled[lacking] = later[lacking]
        made = replace(made, columns={**made.columns, name: filled})
    return made, index


def _second_rows(second: SecondModel, table: CsvTable, made: Configurations, own: Ints) -> tuple[Ints, Ints]:
    """The configuration that each row names as its other one, and the rows that name another than their own: a row that
    names itself, or none, only says where the machine stood."""
    at = table.find(second.id.column)
    number = {name: i for i, name in enumerate(made.ids)}
    other, measuring = np.zeros(len(table), dtype=np.int64), []
    for i, row in enumerate(table.cells):
        cell = meant(row[at].strip())
        if cell and cell in table.gone:
            raise table.fail(
                "this row compares with one that is left out", i, table.label(at), found=cell,
                expected="both left out, or none",
            )  # fmt: skip
        if cell and cell not in number:
            few = ", ".join(made.ids[:5]) + (", ..." if len(made.ids) > 5 else "")
            raise table.fail(
                "no row has this configuration", i, table.label(at), found=cell, expected=few,
                suggestion=nearest(cell, made.ids),
            )  # fmt: skip
        if cell:
            other[i] = number[cell]
            if other[i] != own[i]:
                measuring.append(i)
    if not measuring:
        raise table.fail("no row names another configuration than its own", column=table.label(at))
    return other, np.array(measuring, dtype=np.int64)
