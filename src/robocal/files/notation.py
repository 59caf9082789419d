"""How a data file speaks: what it calls its columns and units, and what its orientations would be in other forms; for whoever
must tell a person which line to change."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array
from robocal.files import orientation
from robocal.files.configurations import RowReader
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import OrientationModel
from robocal.files.headers import joint_columns
from robocal.files.kinds.pose import PositionModel, matrix_columns, place_columns
from robocal.files.units import UNITS, Unit
from robocal.geometry import so3

__all__ = ["Form", "TableNotation", "table_notation"]

LETTERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "XYX", "XZX", "YXY", "YZY", "ZXZ", "ZYZ")


@record
class Form:
    """Another form in which numbers of an orientation may be read: the keys that say so, the unit where the headers must
    say it, and the rotations (k, 3, 3) of every row."""

    keys: Mapping[str, Any]
    unit: str
    turns: Array


@record
class TableNotation:
    """Of one table `source`: the data file (the table itself where there is none), the joints' columns and units, the
    coordinates' columns, unit and signs, the orientation's columns and model, its other forms; and what the headers say
    where there is no data file."""

    source: str
    file: Path
    joints: tuple[str, ...]
    joint_units: tuple[str, ...]
    headed: bool  # whether the header states the units of the joints
    place: tuple[str, ...] = ()
    length: Unit | None = None
    lengths: tuple[str, ...] = ()  # the unit of each coordinate
    place_headed: bool = False  # whether the header states the unit of the coordinates
    signs: tuple[int, ...] = (1, 1, 1)
    orientation: OrientationModel | None = None
    turned: tuple[str, ...] = ()
    read_otherwise: Callable[[], Iterable[Form]] = tuple  # asked only where something does not fit
    described: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def forms(self) -> tuple[Form, ...]:
        """The other forms in which the numbers of the orientation may be read."""
        return tuple(self.read_otherwise())


def table_notation(reader: RowReader, angle: Unit, length: Unit | None) -> TableNotation:
    """How a table speaks that was read already."""
    model, table, document = reader.model, reader.table, reader.document
    columns = model.joints.columns if model.joints.columns is not None else joint_columns(table, reader.machine)
    headers = [table.unit(c) for c in columns]
    stated = model.joints.unit
    units = [h or (stated[i] if isinstance(stated, list) else stated) or angle.name for i, h in enumerate(headers)]
    file, described = (document.path, {}) if document.text else (table.path, document.data)
    joints = _names(columns, table)
    made = TableNotation(str(table.path), file, joints, tuple(units), any(headers), length=length, described=described)
    if not isinstance(model, PositionModel):
        return made
    given = place_columns(model, table)
    if model.position is not None and model.position.sign is not None:
        made = replace(made, signs=tuple(model.position.sign))
    if (turn := model.orientation) is not None and model.kind == "pose":
        turned = _names(matrix_columns(turn, table), table)
        columns = matrix_columns(turn, table)
        headers = [table.unit(c) for c in columns]
        others = partial(_others, turn, table.numbers(columns), headers)
        made = replace(made, orientation=turn, turned=turned, read_otherwise=others)
    headed = any(table.unit(c) for c in given)
    return replace(made, place=_names(given, table), lengths=_lengths(model, table, length), place_headed=headed)


def _names(columns: Iterable[str | int], table: CsvTable) -> tuple[str, ...]:
    """What columns are called."""
    return tuple(str(table.label(table.find(c))) for c in columns)


def _lengths(model: PositionModel, table: CsvTable, first: Unit | None) -> tuple[str, ...]:
    """The unit of each coordinate, from its header or as stated."""
    unit = first.name if first is not None else ""
    stated = model.position.unit if model.position is not None else None
    each = stated if isinstance(stated, list) else [stated] * 3
    return tuple(table.unit(c) or s or unit for c, s in zip(place_columns(model, table), each, strict=True))


def _others(model: OrientationModel, numbers: Array, headers: Sequence[str | None]) -> Iterator[Form]:
    """The rotations that the same numbers (k, w) would be in other forms; `headers` are the units that their columns state."""
    if model.form in ("quaternion_xyzw", "quaternion_wxyz"):
        other = "quaternion_wxyz" if model.form == "quaternion_xyzw" else "quaternion_xyzw"
        q = numbers if other == "quaternion_xyzw" else numbers[:, [1, 2, 3, 0]]
        size = np.linalg.norm(q, axis=1)
        if (size > 0).all():
            yield Form({"form": other}, "", orientation.quaternion(q / size[:, None]))
            # Titles that begin with the second number, for the scalar was taken to be the first: the form is right, the titles are not.
            if model.form == "quaternion_xyzw" and isinstance(model.columns, list):
                q, names = numbers[:, [3, 0, 1, 2]], [model.columns[i] for i in (3, 0, 1, 2)]
                yield Form({"columns": names, "form": model.form}, "", orientation.quaternion(q / size[:, None]))
    if model.form not in ("euler", "rotation_vector"):
        return
    units = {h or model.unit for h in headers}
    if len(units) != 1 or None in units:
        return
    unit = str(units.pop())
    for name in dict.fromkeys((unit, "deg", "rad")):
        if name not in UNITS or (name != unit and unit not in ("deg", "rad")):
            continue
        angles = numbers * UNITS[name].factor
        swapped = name != unit
        # A data file that contradicts a header is refused.
        more = {"unit": name} if swapped and not any(headers) else {}
        header = name if swapped and any(headers) else ""
        if model.form != "rotation_vector" or swapped:
            yield Form({"form": "rotation_vector"} | more, header, so3.exp(angles))
        for order, frame in product(LETTERS, ("intrinsic", "extrinsic")):
            if not swapped and (model.form, model.order, model.frame) == ("euler", order, frame):
                continue
            turned = orientation.euler(angles, order, intrinsic=frame == "intrinsic")
            yield Form({"form": "euler", "order": order, "frame": frame} | more, header, turned)
