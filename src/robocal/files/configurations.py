"""The configurations of a table: joint values, what was recorded with them, and for kinds that compare two the other
one of each row."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.errors import nearest
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, JointsModel, PosedModel, SecondModel, ValueModel
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

__all__ = ["Places", "RowReader", "nowhere", "read_configurations", "remarks_on_columns"]

# What holds for both configurations of a row; the rest was recorded at the first one.
SHARED = ("time", "temperature", "payload")


@record
class Places:
    """The configurations, the one of each row, the other one of each row where there are two, the joint values of the
    rows, and which rows measure something; `angle` is the unit of the joints."""

    configurations: Configurations
    first: Ints
    second: Ints | None
    joints: Array
    measuring: Ints
    angle: Unit


@record
class JointColumns:
    """The columns of a table that hold joint values, and what takes their units to rad and m (n,); `angle` is the unit of angles."""

    table: CsvTable
    columns: Sequence[str | int]
    factors: Array
    angle: Unit

    def values(self) -> Array:
        """Joint values (k, n) in rad or m."""
        return self.table.numbers(self.columns) * self.factors

    def digits(self) -> Array:
        """What one unit in the last digit means, (k, n)."""
        return self.table.digits(self.columns) * self.factors


@record
class RowReader:
    """Reads the rows of a table for a machine, as its data file describes them. Raises FormatError."""

    model: DataModel
    table: CsvTable
    machine: Model
    document: YamlDocument

    def joints(self, given: JointsModel, key: str) -> JointColumns:
        """Where the joint values stand, and in which units."""
        table, document, joints = self.table, self.document, joints_of(self.machine)
        n, unit = len(joints), given.unit
        columns = joint_columns(table, self.machine) if given.columns is None else given.columns
        if len(columns) != n:
            expected = f"{n} for {self.machine.name}: {', '.join(names_of(self.machine))}"
            document.fail("wrong number of joint columns", (key, "columns"), found=len(columns), expected=expected)
        fits = not isinstance(unit, list) or len(unit) == n
        document.insist(fits, "wrong number of units", (key, "unit"), found=unit, expected=f"one unit, or {n}")
        si = ["m" if j.type == "prismatic" else "rad" for j in joints]
        units = column_units(table, columns, unit, si, document, (key,))
        angle = next((u for u in units if u.si == "rad"), UNITS["rad"])
        factors = np.array([u.factor for u in units])
        return JointColumns(table, columns, factors, angle)

    def row_names(self) -> tuple[str, ...]:
        """What rows are called that have no id, by the lines on which they stand."""
        name = self.table.path.name
        return tuple([f"{name}:{line}" for line in self.table.lines.tolist()])

    def recorded(self) -> tuple[dict[str, Array], tuple[str, ...] | None]:
        """What was recorded with each row, by name in SI, and the label of its group."""
        columns: dict[str, Array] = {}
        groups, joints = None, names_of(self.machine)
        for name, given in self.model.configuration.items():
            at: Path_ = ("configuration", name)
            several = isinstance(given, ValueModel)
            if name in ("id", "group"):
                if several:
                    self.document.fail("not one column", at, found=given.columns, expected="one column")
                groups = self.table.texts(given.column) if name == "group" else groups
                continue
            if several and (name not in PER_JOINT or len(given.columns or ()) != len(joints)):
                expected = f"one column, or for {' and '.join(PER_JOINT)} one per joint, {len(joints)}"
                self.document.fail("wrong number of columns", (*at, "columns"), found=given.columns, expected=expected)
            named = [f"{name}.{joint}" for joint in joints] if several else [name]
            for key, column in zip(named, given.columns if several else [given.column], strict=True):
                columns[key] = self._column(key, column, given.unit, at)
        return columns, groups

    def _column(self, name: str, column: str | int, stated: str | None, at: Path_) -> Array:
        """One column of a configuration in SI. Raises FormatError for a name without a meaning or a unit."""
        table, document, joints = self.table, self.document, names_of(self.machine)
        stem, _, joint = name.partition(".")
        known = {*CONFIGURATION, "group"}
        if stem in PER_JOINT and joint:
            document.insist_known(joint, joints, "no joint has this name", at)
            prismatic = joints_of(self.machine)[joints.index(joint)].type == "prismatic"
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


def read_configurations(reader: RowReader) -> Places:
    """Rows with the same id are the same configuration. Raises FormatError."""
    model, table = reader.model, reader.table
    joints = reader.joints(model.joints, "joints")
    q, angle = joints.values(), joints.angle
    columns, groups = reader.recorded()
    stated = model.configuration.get("id")
    ids = reader.row_names() if stated is None else table.texts(stated.column)
    start = _known_poses(reader)
    given, every = Configurations(ids, q, columns, start, groups, joints.digits()), np.arange(len(table))
    second = getattr(model, "second", None)
    if second is None:
        made, index = _merge(given, table, every)
        if not joints_of(reader.machine):
            made = replace(made, joints=None, digits=None)
        return Places(made, index, None, q, every, angle)
    if second.columns is None and second.id is not None:
        if stated is None:
            at, expected = ("configuration", "id"), "the column with the id of each row"
            reader.document.fail("a key is missing", at, expected=expected)
        made, index = _merge(given, table, every)
        other, measuring = _second_rows(second, table, made, index)
        return Places(made, index, other, q, measuring, angle)
    joints = reader.joints(_second_joints(second, reader), "second")
    q2 = joints.values()
    ids2 = tuple(f"{i}:second" for i in reader.row_names()) if second.id is None else table.texts(second.id.column)
    shared = {k: v for k, v in columns.items() if k in SHARED}
    both = given + Configurations(ids2, q2, shared, groups=groups, digits=joints.digits())
    made, index = _merge(both, table, np.concatenate([every, every]))
    return Places(made, index[: len(q)], index[len(q) :], q, every, angle)


def _known_poses(reader: RowReader) -> Array | None:
    """Where a rig whose poses are known stands in each row, frame vectors (k, 6); None for another machine. Raises FormatError."""
    from robocal.files.kinds.pose import read_pose

    model, known = reader.model, freedom_of(reader.machine) == ()
    stated = isinstance(model, PosedModel) and model.orientation is not None
    if not known:
        reader.document.insist(
            not stated, "this says where a rig is, and the poses of the machine are not stated so", ("orientation",),
            found=reader.machine.name, expected="a robot.yaml with kind: rig and poses: known",
        )  # fmt: skip
        return None
    expected = "position: {columns: [...], unit: mm} and orientation: {columns: [...], form: ...}"
    reader.document.insist(
        stated, "this rig's poses are known, and the file does not state them", ("orientation",), expected=expected
    )
    return read_pose(model, reader.table, reader.document).value


def nowhere(given: Configurations, names: tuple[str, ...], beside: Ints) -> Configurations:
    """The configurations with some more in which the machine stood nowhere: what was known without it. Each belongs to
    the group of the configuration that it is `beside`."""
    if not names or given.joints is None:
        return given
    groups = None if given.groups is None else tuple(given.groups[i] for i in beside)
    return given + Configurations(names, np.full((len(names), given.joints.shape[1]), np.nan), groups=groups)


def _second_joints(second: SecondModel, reader: RowReader) -> JointsModel:
    """The other joints' columns, by default `second.` and the first ones' names; their unit is the first ones'."""
    table, first, columns = reader.table, reader.model.joints, second.columns
    if columns is None:
        own = first.columns if first.columns is not None else joint_columns(table, reader.machine)
        columns = [f"second.{name}" for name in own]
    # A header that speaks for itself needs no unit, and the first joints' would only contradict it.
    silent = second.unit is None and all(table.unit(c) is None for c in columns)
    return JointsModel(columns=columns, unit=first.unit if silent else second.unit)


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


def _merge(given: Configurations, table: CsvTable, row: Ints) -> tuple[Configurations, Ints]:
    """Equal ids become one configuration; `row` is the row of the table that each came from. Returns the number of each.

    Raises FormatError when one id has two sets of joint values or belongs to two groups."""
    ids, joints, groups = given.ids, given.joints, given.groups
    assert joints is not None
    if len(set(ids)) == len(ids):
        return given, np.arange(len(ids))
    number = {name: i for i, name in enumerate(dict.fromkeys(ids))}
    index = np.array([number[name] for name in ids])
    kept = np.unique(index, return_index=True)[1]
    first = kept[index]  # the configuration of the same id that comes first
    for i in map(int, np.flatnonzero((np.abs(joints - joints[first]) > 1e-9).any(axis=1))):
        message = f"this configuration has other joint values than in row {table.lines[row[first[i]]]}"
        raise table.fail(message, int(row[i]), found=ids[i], expected="one id per configuration")
    for i, label in enumerate(groups or ()):
        if groups is not None and label != groups[first[i]]:
            message = f"configuration {ids[i]!r} belongs to another group than in row {table.lines[row[first[i]]]}"
            raise table.fail(message, int(row[i]), found=label, expected=groups[first[i]])
    if given.start is not None:
        for i in map(int, np.flatnonzero((np.abs(given.start - given.start[first]) > 1e-9).any(axis=1))):
            message = f"this configuration has another pose than in row {table.lines[row[first[i]]]}"
            raise table.fail(message, int(row[i]), found=ids[i], expected="one id per configuration")
    # What the first row does not know, a later one of the same configuration may.
    made = given.take(kept)
    columns = dict(made.columns)
    for name, column in given.columns.items():
        known = np.flatnonzero(np.isfinite(column))[::-1]
        later = np.full(len(kept), np.nan)
        later[index[known]] = column[known]
        columns[name] = np.where(np.isnan(columns[name]), later, columns[name])
    return replace(made, columns=columns), index


def _second_rows(second: SecondModel, table: CsvTable, made: Configurations, own: Ints) -> tuple[Ints, Ints]:
    """The configuration that each row names as its other one, and the rows that name another than their own: a row that
    names itself, or none, only says where the machine stood."""
    at = table.find(second.id.column)
    number = {name: i for i, name in enumerate(made.ids)}
    other, measuring = np.zeros(len(table), dtype=np.int64), []
    label = table.label(at)
    for i, cell in enumerate(map(meant, table.strip(at))):
        if cell and cell in table.gone:
            message = "this row compares with one that is left out"
            raise table.fail(message, i, label, found=cell, expected="both left out, or none")
        if cell and cell not in number:
            facts = {"expected": ", ".join(made.ids[:5]) + (", ..." if len(made.ids) > 5 else "")}
            near = nearest(cell, made.ids)
            raise table.fail("no row has this configuration", i, label, found=cell, **facts, suggestion=near)
        if cell:
            other[i] = number[cell]
            if other[i] != own[i]:
                measuring.append(i)
    if not measuring:
        raise table.fail("no row names another configuration than its own", column=label)
    return other, np.array(measuring, dtype=np.int64)
