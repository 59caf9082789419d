"""Targets for a robot as a CSV holds them, poses, positions or joint values with units in the headers, or a small YAML
beside any CSV; and the compensated targets on their way out.

Positions and poses are in base coordinates. Joint columns beside them say where the controller would go, which settles
the branch; joint columns alone are a joint program, whose targets are their nominal poses.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.apply.compensate import STATUS, Compensation, Targets
from robocal.arms.chain import Chain
from robocal.errors import FormatError
from robocal.files import orientation
from robocal.files.configurations import RowReader, remarks_on_columns
from robocal.files.csvtable import CsvTable, read_csv
from robocal.files.datamodel import OrientationModel
from robocal.files.headers import (
    CONFIGURATION,
    PER_JOINT,
    POSITIONS,
    TURNS,
    configuration_columns,
    joint_columns,
    matrices,
    matrix_header,
    vocabulary,
)
from robocal.files.kinds.pose import PositionModel, read_pose, read_position
from robocal.files.schema import validate
from robocal.files.text import InputFile, discreet
from robocal.files.units import UNITS, Unit, Units
from robocal.files.unread import left_over, unread_remarks
from robocal.files.yamlio import YamlDocument, load
from robocal.geometry import so3
from robocal.quantities import Column, Listing

__all__ = ["TargetFile", "compensation_listing", "read_targets"]

IDS = ("id", "configuration", "pose_id", "target", "name")
# What targets have a use for.
READ = {*IDS, *CONFIGURATION, *PER_JOINT, *(n for c in POSITIONS for n in c), *(n for c, _ in TURNS for n in c)}


class TargetsModel(PositionModel):
    """targets.yaml: positions with or without an orientation, joint values, or both."""

    kind: Literal["targets"]


@record
class TargetFile:
    """Targets in SI with their names; `units` are those in which the file speaks, `orientation` the form in which it
    writes orientations and `names` its columns."""

    targets: Targets
    ids: tuple[str, ...]
    units: Units
    orientation: OrientationModel | None
    names: tuple[str, ...]
    files: tuple[InputFile, ...] = ()


@discreet
def read_targets(path: str | os.PathLike[str], chain: Chain) -> TargetFile:
    """Reads targets for an arm. Raises FileError or FormatError naming file, row and column or key."""
    place = path if isinstance(path, Path) else Path(path)
    if place.suffix.lower() in (".yaml", ".yml"):
        document = load(place)
        kind = document.data.get("kind", "targets")
        document.insist(kind == "targets", "this is not a file of targets", ("kind",), found=kind, expected="targets")
        model = validate(TargetsModel, document)
        one = len(model.file) == 1
        document.insist(one, "one table holds the targets", ("file",), found=model.file, expected="one file name")
        table = read_csv(os.path.normpath(place.parent / model.file[0]), **model.csv.style)
        files = [InputFile(place, document.sha256)]
    else:
        table, files = read_csv(place), []
        document = YamlDocument(place, "", "", _self_description(table))
        model = validate(TargetsModel, document)
    made = _targets(model, RowReader(model, table, chain, document))
    known = vocabulary(chain)
    # Where a table of measurements serves as targets, what they say of noise and instruments belongs there.
    silent = [n for n in known if n.partition(".")[0] not in READ and n not in chain.joint_names]
    said = table.remarks + remarks_on_columns(model, document)
    said += unread_remarks([left_over(table, (*IDS, *known), (*silent, "rank"))])
    return replace(made, files=(*files, InputFile(table.path, table.sha256, said)))


def _self_description(table: CsvTable) -> dict[str, Any]:
    """What a targets.yaml for this table would say."""
    out: dict[str, Any] = {"robocal": 1, "kind": "targets", "file": table.path.name}
    position = next((list(c) for c in POSITIONS if all(map(table.has, c))), None)
    turn = next(((list(c), form) for c, form in TURNS if all(map(table.has, c))), None)
    prefixes = matrices(table)
    if position:
        out["position"] = {"columns": position}
    if turn and position:
        out["orientation"] = {"columns": turn[0], "form": turn[1]}
    elif prefixes and (position or f"{prefixes[0]}_03" in table.names):
        out["orientation"] = matrix_header(table, "the target", "a YAML file that names one")
    return out | {"configuration": configuration_columns(table, IDS)}


def _targets(model: TargetsModel, reader: RowReader) -> TargetFile:
    table, cartesian = reader.table, model.position is not None or model.orientation is not None
    q, angle = _joints(reader, needed=not cartesian)
    position = rotation = None
    length = UNITS["mm"]
    names: tuple[str, ...] = ("rx", "ry", "rz")
    if cartesian:
        read = read_position if model.orientation is None else read_pose
        values = read(model, table, reader.document)
        length, angle = values.length or length, values.angle or angle
        position = values.value[:, :3]
        if model.orientation is not None:
            rotation = so3.exp(values.value[:, 3:])
            names = _column_names(model.orientation, table)
    targets = Targets(position, rotation, q, reader.recorded()[0])
    named = "id" in model.configuration
    ids = table.texts(model.configuration["id"].column) if named else tuple(f"row {line}" for line in table.lines)
    return TargetFile(targets, ids, Units(length, angle or UNITS["deg"]), model.orientation, names)


def _column_names(model: OrientationModel, table: CsvTable) -> tuple[str, ...]:
    """What the file calls the parts of an orientation."""
    named = tuple(c for c in model.columns or () if isinstance(c, str))
    wanted = {"matrix": 9, "quaternion_xyzw": 4, "quaternion_wxyz": 4}.get(model.form, 3)
    if len(named) == wanted:
        return named
    if wanted == 9:
        return tuple(f"r{i}{j}" for i in range(3) for j in range(3))
    return tuple(f"r{i + 1}" for i in range(wanted))


def _joints(reader: RowReader, *, needed: bool) -> tuple[Array | None, Unit | None]:
    """Joint values (m, n), where there are any, and the unit of the angles."""
    given = reader.model.joints
    if given.columns is None:
        try:
            given = given.model_copy(update={"columns": joint_columns(reader.table, reader.machine)})
        except FormatError as error:
            if needed:
                expected = f"x [mm], y [mm], z [mm], or joint columns: {error.expected}"
                raise reader.table.fail("there are no targets", found=error.found, expected=expected) from None
            return None, None
    read = reader.joints(given, "joints")
    return read.values(), read.angle


def compensation_listing(
    made: Compensation, file: TargetFile, chain: Chain, notes: Sequence[str], within: Array | None = None
) -> Listing:
    """compensated.csv: one row per target, in order; nothing where there is nothing to command. Orientations in the form of the targets,
    or as a rotation vector. `within` (m,) is the radius in m in which the real robot is expected to arrive."""
    length, angle = file.units.length, file.units.angle
    columns = [Column("target", "", file.ids), Column("status", "", [STATUS[s] for s in made.status])]

    def add(name: str, unit: Unit | None, values: Array) -> None:
        columns.append(Column(name, unit.name if unit else "", _finite(unit.from_si(values) if unit else values)))

    for i, joint in enumerate(chain.joints):
        add(joint.name, length if joint.type == "prismatic" else angle, made.joints[:, i])
    for i, axis in enumerate("xyz"):
        add(f"tcp_{axis}", length, made.command[:, i, 3])
    form = file.orientation.form if file.orientation else "rotation_vector"
    order = (file.orientation.order or "XYZ") if file.orientation else "XYZ"
    intrinsic = file.orientation is None or file.orientation.frame != "extrinsic"
    turn = np.full((len(made.status), len(file.names)), np.nan)
    some = made.reachable
    if some.any():
        turn[some] = orientation.to_form(made.command[some, :3, :3], form, order, intrinsic=intrinsic)
    angular = form in ("euler", "rotation_vector")
    for i, name in enumerate(file.names):
        add(f"tcp_{name}", angle if angular else None, turn[:, i])
    mm, deg = UNITS["mm"], UNITS["deg"]
    add("before", mm, made.before)
    add("after", mm, made.after)
    add("after_by_tcp", mm, made.by_command)
    if within is not None:
        add("within_95", mm, within)
    if made.oriented:
        add("before_angle", deg, made.before_angle)
        add("after_angle", deg, made.after_angle)
    add("dexterity", None, np.round(made.dexterity, 4))
    return Listing((*columns, Column("note", "", notes)))


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)
