"""Two configurations compared: relative poses, and displacements.

relative_pose   T_first_second of the tool, as an inertial unit or visual odometry reports it
displacement    p(second) - p(first) in the axes of an instrument
"""

from __future__ import annotations

from robocal.files.csvtable import CsvTable
from robocal.files.datamodel import DataModel, FramedModel, OrientationModel, PlaceValuesModel, SecondModel, ValueModel
from robocal.files.kinds.kind import KindFile, KindOutput, Values, columns, quantity, section
from robocal.files.kinds.pose import read_pose, write_pose
from robocal.files.units import Units
from robocal.files.yamlio import YamlDocument
from robocal.measure.data import Observations

__all__ = ["DISPLACEMENT", "RELATIVE_POSE"]

STEP = ("dx", "dy", "dz")
STEP_SIGMA = ("sdx", "sdy", "sdz")


class RelativePoseModel(DataModel):
    """Poses of the second configuration seen from the first: T_first_second."""

    position: PlaceValuesModel | None = None
    orientation: OrientationModel
    second: SecondModel = SecondModel()


class DisplacementModel(FramedModel):
    """How far the target moved, from the first configuration to the second."""

    displacement: ValueModel = ValueModel()
    second: SecondModel = SecondModel()


def read_displacement(model: DisplacementModel, table: CsvTable, document: YamlDocument) -> Values:
    """Displacements (k, 3) in m."""
    value, sigma, units = quantity(model.displacement, table, document, ("displacement",), ("m",) * 3, STEP)
    return Values(value, sigma, units[0])


def write_displacement(obs: Observations, units: Units) -> KindOutput:
    """Three columns and their sigmas."""
    made = columns(STEP, STEP_SIGMA, [units.length] * 3, obs)
    return KindOutput(made, (section("displacement", STEP, STEP_SIGMA, obs),))


RELATIVE_POSE_KEYS = """second: {{columns: [{second}], unit: {joint_unit}}}    # the joints of the other configuration of a row
position: {{columns: [x, y, z], unit: {length}, sigma: 0.05}}    # where it came to, seen from the first
orientation: {{columns: [rx, ry, rz], form: rotation_vector, unit: {angle}, sigma: 0.005}}
# targets: {{imu: {{xyz: [0, 0, 50], free: true}}}}    # the measured thing on the tool; default the tool frame
"""
RELATIVE_POSE = KindFile(
    "relative_pose", RelativePoseModel, read_pose, write_pose, RELATIVE_POSE_KEYS, lengths="position"
)
DISPLACEMENT_KEYS = """second: {{columns: [{second}], unit: {joint_unit}}}    # the joints of the other configuration of a row
displacement: {{columns: [dx, dy, dz], unit: {length}, sigma: 0.05}}    # second minus first
frame: {{name: camera, free: [rx, ry, rz]}}    # only how the instrument is turned is seen
"""
DISPLACEMENT = KindFile(
    "displacement",
    DisplacementModel,
    read_displacement,
    write_displacement,
    DISPLACEMENT_KEYS,
    (True, True, True, False, False, False),
    lengths="displacement",
)
