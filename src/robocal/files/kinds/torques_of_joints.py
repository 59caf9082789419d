"""Torques at the joints of an arm, one column for each joint, one row for each configuration.

torque: {columns: [torque.j1, torque.j2, ...], unit: Nm, sigma: 0.2}     of the joint, behind its gear
speed: {columns: [speed.j1, ...], unit: deg/s}                           of the joint; without it friction has no direction
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._record import replace
from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, ValueModel
from robocal.files.kinds.kind import Around, KindFile, Part, QuantityColumns, Values
from robocal.files.kinds.lengths import write_each
from robocal.files.yamlio import YamlDocument

__all__ = ["JOINT_TORQUE"]


class JointTorqueModel(DataModel):
    """Torques and speeds of all joints, from base to tool."""

    torque: ValueModel = ValueModel.model_construct()
    speed: ValueModel | None = None


def _per_joint(key: str, si: str, given: ValueModel, table: CsvTable, document: YamlDocument) -> Values:
    if given.columns is None:
        document.fail(
            "a key is missing", (key, "columns"), expected=f"a column for each joint, such as [{key}.j1, {key}.j2]"
        )
    names = tuple(str(table.label(table.find(c))) for c in given.columns)
    again = sorted({n for n in names if names.count(n) > 1})
    if again:
        document.fail(
            "a column is named twice", (key, "columns"), found=", ".join(again), expected="one for each joint"
        )
    return QuantityColumns(key, names, (), si).values(given, table, document)


def read_torques(model: JointTorqueModel, table: CsvTable, document: YamlDocument) -> Values:
    """Torques (k, joints) in N m, with the speeds of the joints beside them."""
    values = _per_joint("torque", "N m", model.torque, table, document)
    speed = np.zeros_like(values.value)
    if model.speed is not None:
        speed = _per_joint("speed", "rad/s", model.speed, table, document).value
        if speed.shape != values.value.shape:
            expected = str(values.value.shape[1])
            document.fail("wrong number of columns", ("speed", "columns"), found=speed.shape[1], expected=expected)
    return replace(values, extra={"speed": speed})


def parts(model: JointTorqueModel, values: Values, around: Around) -> Sequence[Part]:
    """Every joint of every row is an observation."""
    rows, many = values.value.shape
    sigma = None if values.sigma is None else values.sigma.reshape(-1, 1)
    extra = {"joint": np.tile(np.arange(many, dtype=float), rows), "speed": values.extra["speed"].ravel()}
    each = replace(values, value=values.value.reshape(-1, 1), sigma=sigma, extra=extra)
    return [Part(np.repeat(np.arange(rows), many), each, targeted=False)]


TORQUE_KEYS = """torque: {{columns: [{torques}], unit: {torque_unit}, sigma: 0.2}}    # of every joint, behind its gear
speed: {{columns: [{speeds}], unit: {speed_unit}}}    # both directions; left out: friction is not identified
"""
JOINT_TORQUE = KindFile(JointTorqueModel, read_torques, write_each, TORQUE_KEYS, parts=parts)
