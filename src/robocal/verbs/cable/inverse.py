"""`cable inverse`: lengths of the cables at poses of the platform."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.files.parts import CableDocument
from robocal.quantities import Column, Listing
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions
from robocal.verbs.outcome import Outcome, Watch
from robocal.verbs.outcome import path_sections as sections

if TYPE_CHECKING:
    from robocal._types import Array

__all__ = ["Options", "run", "sections"]


@record(kw_only=True)
class LengthsDocument(CableDocument):
    """What --json prints; `lengths` says which ones: geometric, or as the sensors show them."""

    lengths: str
    poses: Listing


@record
class Options(BaseOptions):
    """Sensor readings of the cable lengths at poses of the platform.

    If the cables of the robot file stretch and no tension is given, the columns are called c1.geometric: lengths without
    stretch.

    \b
    robocal cable inverse robot.yaml poses.csv -o lengths.csv
    robocal cable inverse robot.yaml poses.csv --tension 60 --sag
    """

    robot: w.CableRobot
    poses: w.PlatformPoses
    tension: w.CableTension = None
    sag: w.Sag = False
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Array]:
    """Lengths in m, and the list as a CSV in the robot file's units. Raises InputError."""
    from robocal.cables.cable_lengths import inverse
    from robocal.files.cable.cable_robot import read_cable
    from robocal.files.cable.pose_lists import length_columns, read_platform_poses, tension_columns
    from robocal.files.display import in_units, listing_text
    from robocal.files.runfolder import find_run
    from robocal.files.text import InputFile
    from robocal.files.writing import refuse_existing
    from robocal.remarks.code import Code
    from robocal.remarks.remark import Remark
    from robocal.session.cable.statics_options import cable_document, name_row, robot_inputs, tensions_of
    from robocal.session.cable.winch_run import with_tensions

    refuse_existing(o.output, (), o.force)
    file = read_cable(o.robot)
    rows, told = with_tensions(read_platform_poses(o.poses, file.robot), file.robot, find_run(o.robot), o.poses)
    pull, said = tensions_of(rows, o.si(file.units).tension, file, o.sag)
    with name_row(o.poses, rows):
        lengths, _ = inverse(file.robot, rows.values, pull, sag=o.sag)
    geometric = file.robot.elasticity is not None and pull is None
    columns = (Column("id", "", rows.names), *length_columns(file.robot, lengths, geometric=geometric))
    listing = Listing(columns + (() if rows.tension is None else tension_columns(file.robot, rows.tension)))
    if geometric:
        said = (*said, Remark.of(Code.LENGTHS_GEOMETRIC, robot=file.robot.name))
    remarks = (*file.warnings, *rows.warnings, *told, *said)
    inputs = (*robot_inputs(file, o.robot), InputFile(Path(o.poses), rows.sha256))
    kind = "geometric" if geometric else "as the sensors show them"
    document = cable_document(LengthsDocument, file.robot, remarks, inputs, command, lengths=kind, poses=listing)
    text, shown = listing_text(listing, file.units), in_units(listing, file.units)
    return Outcome(lengths, lambda: document, remarks=remarks, text=text, listing=shown).put(o.output)
