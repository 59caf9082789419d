"""Data files of a cable robot to fill in: what the sensors of its lengths show, and what an instrument reads of its platform.

lengths.yaml, lengths.csv     a column for each cable, a row for each pose; the sensors count from nobody knows where
poses.yaml, measured.csv      a tracker that stands anywhere, a target that is anywhere on the platform
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.errors import look_up
from robocal.files.cable.cable_model import CableUnits
from robocal.files.cable.pose_lists import length_columns, pose_columns
from robocal.files.display import listing_text
from robocal.files.units import Unit, number
from robocal.quantities import Column, Listing

__all__ = ["DATA_FILES", "data_templates"]

DATA_FILES = ("lengths.yaml", "lengths.csv", "poses.yaml", "measured.csv")
LENGTHS = """# What the sensors of the cable lengths show: a row for each pose of the platform, with its id.
robocal: 1
kind: lengths
file: lengths.csv
lengths: {{columns: [{cables}]{sigma}}}
{zeros}# tension: computed    # where the robot's file states elasticity: removes the stretch; or columns, as load cells read
configuration: {{id: id}}
"""
ZEROS = "zeros: first    # where they count from since power-up: found, and written into calibrated.yaml. Another power-up: another name\n"
STATED = "# zeros: second    # where the sensors were set anew: zeros of their own, found anew\n"
POSES = """# What a tracker or a camera reads of a target on the platform: a row for each pose, with the id that it has in lengths.csv.
robocal: 1
kind: {kind}
file: measured.csv
position: {{columns: [x, y, z]{place}}}
{turn}frame: {{name: tracker, free: true}}    # it stands anywhere
{target}configuration: {{id: id}}
"""
TURN = "orientation: {{columns: [rx, ry, rz], form: rotation_vector{turn}}}    # or [qx, qy, qz, qw], form: quaternion_xyzw\n"
TARGET = "targets: {reflector: {xyz: [0, 0, 0], free: true}}    # it is anywhere on the platform\n"
FILL_IN = "# Fill in: {what}, at each pose. Units are those in the headers.\n"
EXAMPLE = (
    "# Example rows, computed from the nominal robot: put your measurements here. Units are those in the headers.\n"
)


def data_templates(
    robot: CableRobot,
    units: CableUnits,
    ids: Sequence[str],
    rows: tuple[Array, Array] | None = None,
    *,
    sigma: float | None = None,
    noise: Sequence[float | None] = (None, None),
    kind: str | None = None,
) -> dict[str, str]:
    """The texts of DATA_FILES for poses with these ids: with `rows` of lengths (k, m) in m and poses (k, 4, 4) as examples, else empty.

    `sigma` is the noise of a length in m, `noise` that of a measured position in m and of a turn in rad; `kind` chooses lengths, pose or
    position alone. Raises ModelError for another kind.
    """
    turns = max(robot.axes) > 2
    measured = "pose" if turns else "position"
    files = {"lengths": DATA_FILES[:2], "pose": DATA_FILES[2:], "position": DATA_FILES[2:]}
    wanted = DATA_FILES if kind is None else look_up(files, kind, "unknown kind of a cable robot's data", "--kind")
    measured = kind if kind in ("pose", "position") else measured
    k, m = len(ids), len(robot.cables)
    lengths, poses = rows or (np.full((k, m), np.nan), np.full((k, 4, 4), np.nan))
    read = pose_columns(ids, poses)[: 7 if measured == "pose" else 4]
    own = any(n.endswith(".l0") for n in robot.table.free)
    place, angle = noise
    described = {
        "lengths.yaml": LENGTHS.format(
            cables=", ".join(robot.cables), sigma=_sigma(sigma, units.length), zeros=STATED if own else ZEROS
        ),
        "lengths.csv": _head(rows, "what the sensor of every cable shows")
        + listing_text(Listing((Column("id", "", tuple(ids)), *length_columns(robot, lengths))), units),
        "poses.yaml": POSES.format(
            kind=measured, place=_sigma(place, units.length), target=TARGET if turns else "",
            turn=TURN.format(turn=_sigma(angle, units.angle)) if measured == "pose" else "",
        ),
        "measured.csv": _head(rows, "what the instrument reads") + listing_text(Listing(read), units),
    }  # fmt: skip
    return {name: described[name] for name in wanted}


def _head(rows: object, what: str) -> str:
    return FILL_IN.format(what=what) if rows is None else EXAMPLE


def _sigma(sigma: float | None, unit: Unit) -> str:
    """The key of a standard deviation, where one is known."""
    return f", sigma: {number(unit.from_si(sigma))}" if sigma else ""
