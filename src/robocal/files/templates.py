"""Commented files to start from: a robot (of the catalogue, or of a convention with empty rows), its data file and a
table."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from robocal.arms.chain import Chain
from robocal.arms.conventions import CONVENTIONS, chain, convention_of
from robocal.files.datawrite import table_text
from robocal.files.kinds.registry import readers_of
from robocal.files.robot import describe
from robocal.files.units import Units
from robocal.files.yamlio import quote
from robocal.measure.data import Configurations, DataSet, Observations

__all__ = ["TORQUES", "convention_chain", "templates", "torque_table"]

# What a required key says in an empty row, by what it is.
EXAMPLES: Mapping[str, object] = {
    "direction": [0.0, 0.0, 1.0],
    "point": [0.0, 0.0, 0.0],
    "moment": [0.0, 0.0, 0.0],
    "angles": [0.0, 0.0, 0.0],
    "steps": [
        {"axis": "rz", "value": 0.0, "symbol": "theta", "driven": 1},
        {"axis": "tz", "value": 0.1, "symbol": "d"},
    ],
}
ROBOT = """The nominal robot: what its data sheet says. Lengths in {length}, angles in {angle}.
Convention {convention}: {formula}
{keys}
Every joint may also have type (revolute, prismatic, fixed), limits [lower, upper] and gain.
Check it with: robocal check robot.yaml data.yaml"""
TORQUES = "joint_torque"  # a kind of which a table has a row for each configuration, not for each reading
DATA = """# The measurements. The table may be written in any way: say how, and which columns mean what.
robocal: 1
kind: {kind}                 # what every kind is for: docs/kinds
file: {file}
csv: {{separator: ",", decimal: ".", header: true}}    # columns by name, or by zero-based number without a header
units: {{length: {length}, angle: {angle}}}    # of the frames, places and targets in this file
joints: {{columns: [{joints}], unit: {joint_unit}}}
{own}# targets: {{smr1: {{xyz: [0, 0, 100], free: true}}}}    # where the measured point sits on the tool
# target: {{column: target}}                           # which target a row sees, when there are several
configuration: {{id: configuration}}    # also: time, temperature, payload, approach.j1, torque.j1, group
"""
TABLE = "# Example rows, computed from the nominal robot: put your measurements here.\n"


def convention_chain(convention: str, joints: int, name: str = "my robot") -> Chain:
    """An arm of revolute joints whose rows name every key of a convention. Raises ModelError for an unknown
    convention."""
    rule = convention_of(convention)
    row = {
        key.name: EXAMPLES.get(key.quantity, 0.0) if key.required or key.quantity == "direction" else key.default
        for key in rule.keys
    }
    return chain(name, convention, [{"name": f"j{i + 1}", "type": "revolute", **row} for i in range(joints)])


def templates(
    arm: Chain, *, kind: str = "position", units: Units | None = None, rows: int = 5, example: DataSet | None = None
) -> dict[str, str]:
    """The texts of robot.yaml, data.yaml and measurements.csv for an arm; the three are valid together.

    `example` are the rows of the table; positions and poses make their own."""
    units = units or Units()
    length, angle = units.length.name, units.angle.name
    rule = CONVENTIONS[arm.convention]
    keys = "\n".join(f"  {key.name} ({key.quantity}): {key.meaning}".rstrip(": ") for key in rule.keys)
    comment = ROBOT.format(length=length, angle=angle, convention=rule.name, formula=rule.formula, keys=keys)
    own = [length if j.type == "prismatic" else angle for j in arm.joints]
    shared = {"length": length, "angle": angle, "joint_unit": own[0] if len(set(own)) == 1 else f"[{', '.join(own)}]"}
    near, ball = (units.length.from_si(v) for v in (0.5, 0.015))
    joints, second = (", ".join(quote(f"{of}{name}") for name in arm.joint_names) for of in ("", "second."))
    near_place = ", ".join([f"{near:g}"] * 3)
    own_names, torques = _per_joint(arm, units), kind == TORQUES
    keys_of_kind = readers_of(arm)[kind].template.format(
        **shared, near=near_place, ball=f"{ball:g}", second=second, **own_names
    )
    return {
        "robot.yaml": describe(arm, units, comment=comment),
        "data.yaml": DATA.format(**shared, kind=kind, file="measurements.csv", joints=joints, own=keys_of_kind),
        "measurements.csv": torque_table(arm, units, rows)
        if torques
        else TABLE + _table(example, arm, kind, rows, units),
    }


def _table(example: DataSet | None, arm: Chain, kind: str, rows: int, units: Units) -> str:
    return table_text(_example(arm, kind, rows, units) if example is None else example, arm, units, digits=False)


def _per_joint(arm: Chain, units: Units) -> dict[str, str]:
    """The columns of torques and speeds with their units, as a template names them."""
    slides = [j.type == "prismatic" for j in arm.joints]
    told = {
        "torque_unit": ["N" if s else "Nm" for s in slides],
        "speed_unit": [f"{(units.length if s else units.angle).name}/s" for s in slides],
    }
    columns = {f"{key}s": ", ".join(quote(f"{key}.{n}") for n in arm.joint_names) for key in ("torque", "speed")}
    return {**columns, **{k: v[0] if len(set(v)) == 1 else f"[{', '.join(v)}]" for k, v in told.items()}}


def torque_table(arm: Chain, units: Units, rows: int) -> str:
    """Rows of a slow motion there and back with a friction of 1 N m (or N) in every joint of an arm without weight."""
    rng, slides = np.random.default_rng(1), [j.type == "prismatic" for j in arm.joints]
    low, high = (np.clip(arm.limits[:, i], -1.0, 1.0) for i in (0, 1))
    unit = [units.length if s else units.angle for s in slides]
    heads = [f"{n} [{u.name}]" for n, u in zip(arm.joint_names, unit, strict=True)]
    heads += [f"torque.{n} [{'N' if s else 'Nm'}]" for n, s in zip(arm.joint_names, slides, strict=True)]
    heads += [f"speed.{n} [{u.name}/s]" for n, u in zip(arm.joint_names, unit, strict=True)]
    lines = [",".join(["configuration", *heads])]
    for k in range(2 * rows):
        way = 1.0 if k % 2 else -1.0
        q = [round(float(u.from_si(v)), 1) for u, v in zip(unit, rng.uniform(low, high), strict=True)]
        lines.append(",".join(map(str, [f"p{k + 1}", *q, *[way] * len(q), *[5 * way] * len(q)])))
    return "# Example rows of an arm without weight: put your measurements here.\n" + "\n".join(lines) + "\n"


def _example(arm: Chain, kind: str, rows: int, units: Units) -> DataSet:
    """What a perfect instrument at the base would read of the nominal robot."""
    from robocal.geometry import se3

    rng = np.random.default_rng(1)
    low, high = (np.clip(arm.limits[:, i], -1.0, 1.0) for i in (0, 1))
    # Joint values that are short to read.
    per_joint = np.array([(units.length if j.type == "prismatic" else units.angle).factor for j in arm.joints])
    q = np.round(rng.uniform(low, high, (rows, len(arm.joints))) / per_joint, 1) * per_joint
    pose = se3.to_vector(arm.pose(q))
    value = np.empty((rows, 6 if kind == "pose" else 3))
    for i in range(value.shape[1]):
        unit = units.angle if i >= 3 else units.length
        digits = max(0, math.ceil(math.log10(unit.factor / 1e-6)))  # micrometres and microradians
        value[:, i] = unit.to_si(np.round(unit.from_si(pose[:, i]), digits))
    ids = tuple(f"p{i + 1}" for i in range(rows))
    return DataSet(Configurations(ids, q), (Observations(kind, np.arange(rows), value),))
