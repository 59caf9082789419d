"""What a calibrated cable robot predicts: lengths at poses, or poses at lengths, and how far that may be off.

    dl = (dl / dx) dx,    dT = -L^+ (dl / dx) dx,    x the numbers that were identified, L the slopes by the twist

to first order. Unless the base itself was measured, a shift of the whole robot is no error: of dl or dT is taken what one motion of
the base makes of it, the one that undoes most over all rows. Lengths are what stiff, straight cables show.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.errors import FileError
from robocal.estimate.uncertainty import Total, radius
from robocal.files.cable.pose_lists import CableList, read_cable_lengths, read_platform_poses
from robocal.files.covariance import COVARIANCE
from robocal.files.csvtable import read_csv
from robocal.files.text import InputFile
from robocal.geometry import se3
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.place_bands import motion_field
from robocal.prove.shape import shapes_of_rows
from robocal.quantities import Column, Listing
from robocal.remarks.remark import Remark
from robocal.report.sections import figure
from robocal.session.cable.calibrated import Calibrated, open_calibrated
from robocal.session.cable.carried import moved_by_numbers, place_best, slopes_of, variance_of
from robocal.session.cable.pose_remarks import pose_remarks
from robocal.session.cable.statics_options import name_row, robot_inputs
from robocal.session.prediction import Prediction

__all__ = ["predict"]


def predict(folder: str, rows: Path, absolute: bool) -> Prediction:
    """Lengths at the poses of a CSV, or poses at its lengths, of the robot of a run folder. Raises InputError."""
    run = open_calibrated(folder)
    if run.knowledge is None:
        expected = f"a run folder with {COVARIANCE}"
        raise FileError("this run does not say how far its parameters may be off", file=folder, expected=expected)
    # What was held since the data cannot tell it from a motion of the base may be off too: together they are that motion.
    ask = _Asked(run, run.knowledge.total, rows, absolute or run.base_is_known)
    return _poses(ask) if any(c in read_csv(rows).names for c in run.robot.cables) else _lengths(ask)


@record
class _Asked:
    """A run with what its numbers may be off by, the file of rows, and whether the place of the base is part of the bands."""

    run: Calibrated
    total: Total
    path: Path
    whole: bool


def _lengths(ask: _Asked) -> Prediction:
    """What the sensors show at poses, and the 95 % band of each."""
    run, robot = ask.run, ask.run.robot
    rows = read_platform_poses(ask.path, robot)
    with name_row(ask.path, rows):
        shown = inverse(robot, rows.values)[0]
    slope, left = slopes_of(run, ask.total, rows.values, shown)
    if not ask.whole:
        left = place_best(left, slope @ motion_field(rows.values[:, :3, 3])[:, list(robot.axes)])
    left = left / robot.winding(shown)[..., None]
    band = 1e3 * radius(variance_of(ask.total, left[:, :, None]), ask.total.dof)
    names, own = Column("configuration", "", rows.names), list(zip(robot.cables, (1e3 * shown).T, band.T, strict=True))
    listing = Listing((
        names,
        *(Column(c, "mm", v, spec=".3f") for c, v, _ in own),
        *(Column(f"{c}_band", "mm", w, figures=2) for c, _, w in own),
    ))  # fmt: skip
    table = (Column(c, "mm", [f"{v:.3f} ± {figure(w, 2)}" for v, w in zip(*both, strict=True)]) for c, *both in own)
    what = f"{len(listing)} poses of the platform: what the sensors of its cables show"
    return _prediction(ask, listing, rows, rows.values, what=what, table=Listing((names, *table)))


def _poses(ask: _Asked) -> Prediction:
    """Where the platform is by its lengths, and the 95 % radii of its place and turn."""
    run, robot = ask.run, ask.run.robot
    rows = read_cable_lengths(ask.path, robot)
    with name_row(ask.path, rows):
        found = forward(robot, rows.values)
    pose, doubts = found.pose, tuple(pose_remarks(rows.names, found, None))
    axes = list(robot.axes)
    left = moved_by_numbers(run, ask.total, pose, rows.values, ask.whole)
    good = np.asarray(np.isfinite(left).all(axis=(1, 2)))
    spread = variance_of(ask.total, left)
    place, turn = [i for i, a in enumerate(axes) if a < 3], [i for i, a in enumerate(axes) if a >= 3]
    band = 1e3 * radius(spread[:, place][:, :, place], ask.total.dof)
    spin = np.degrees(radius(spread[:, turn][:, :, turn], ask.total.dof)) if turn else np.zeros(len(pose))
    vector = se3.to_vector(np.where(good[:, None, None], pose, np.eye(4))) * np.repeat([1e3, 180 / np.pi], 3)
    vector[~good] = np.nan
    listing = Listing((
        Column("configuration", "", rows.names),
        *(Column(s, "mm" if s in "xyz" else "deg", v, spec=".3f") for s, v in zip(FRAME_SYMBOLS, vector.T, strict=True)),
        Column("band", "mm", band, label="± place [mm]", figures=2),
        Column("turn_band", "deg", spin, label="± turn [deg]", figures=2),
    ))  # fmt: skip
    what = f"{len(listing)} poses of the platform, in base coordinates"
    return _prediction(ask, listing, rows, pose, what=what, table=listing, doubts=doubts)


def _prediction(
    ask: _Asked,
    listing: Listing,
    rows: CableList,
    poses: Array,
    *,
    what: str,
    table: Listing,
    doubts: tuple[Remark, ...] = (),
) -> Prediction:
    run, whole = ask.run, ask.whole
    inputs = (*robot_inputs(run.file, run.place), InputFile(ask.path, rows.sha256))
    shape = "where the base stands included" if whole else "of the robot's shape: the base placed best over these rows"
    return Prediction(
        run.robot.name, listing, "base" if whole else "the best place of the base over these rows",
        notes=f"± are 95 %, of what the calibration does not know; {shape}", inputs=inputs,
        warnings=(*run.file.warnings, *rows.warnings, *run.remarks, *doubts), what=what, table=table, trusted=not doubts,
        shapes=partial(shapes_of_rows, run.robot, rows.names, poses),
    )  # fmt: skip
