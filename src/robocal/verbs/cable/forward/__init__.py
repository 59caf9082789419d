"""`cable forward`: poses of the platform from lengths of its cables."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from robocal.verbs import shared_options as w
from robocal.verbs.cable.inverse import sections
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.verbs.cable.forward.result import Poses

__all__ = ["Options", "run", "sections"]


@dataclass(frozen=True)
class Options(BaseOptions):
    """Poses of the platform from lengths of its cables, with their uncertainty and the number of other solutions.

    With a run folder as ROBOT, the standard deviations include the uncertainty of its calibration.

    Exit status 3 when a pose was not found, is not the only one, or does not fit its lengths.

    \b
    robocal cable forward robot.yaml lengths.csv --sigma 0.5 -o poses.csv
    """

    robot: w.CableRobot
    lengths: str = arg(
        ..., "LENGTHS", "CSV: one column per cable, such as c1 [mm]; c1.geometric [mm] for lengths without stretch."
    )
    sigma: float | None = option(None, "Standard deviation of a length", "SIGMA", unit="length", above=0, wrong=w.NOISE)
    starts: int = option(24, "Number of further starts, to find other poses", "N", least=0)
    tension: w.CableTension = None
    sag: w.Sag = False
    seed: w.Seed = 0
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Poses]:
    """Poses with their residuals, covariance and number of solutions. Raises InputError."""
    import numpy as np

    from robocal.cables.calibration.carried import pose_covariance
    from robocal.cables.forward import forward
    from robocal.errors import ModelError
    from robocal.files.cable.pose_lists import read_cable_lengths
    from robocal.files.listing import listing_text
    from robocal.files.text import InputFile
    from robocal.files.writing import refuse_existing
    from robocal.remarks.code import Code
    from robocal.remarks.remark import Remark
    from robocal.session.cable.calibrated import open_calibrated
    from robocal.session.cable.statics_options import locate_row, robot_inputs, tensions_of
    from robocal.verbs.cable.forward.result import Poses

    refuse_existing(o.output, (), o.force)
    made_of = open_calibrated(o.robot)
    file = made_of.file
    rows = read_cable_lengths(o.lengths, file.robot)
    si, rng = o.si(file.units), np.random.default_rng(o.seed)
    pull, said = tensions_of(rows, si.tension, file, o.sag)
    if file.robot.elasticity is not None and pull is None and not rows.geometric:
        said = (*said, Remark.of(Code.LENGTHS_TAKEN_GEOMETRIC, robot=file.robot.name))
    more = made_of.gains
    lengths = more.lengths(file.robot, rows.values)
    try:
        found = forward(file.robot, lengths, tension=pull, sag=o.sag, sigma=si.sigma, starts=o.starts, rng=rng)
    except ModelError as error:
        raise locate_row(error, o.lengths, rows) from None
    if made_of.estimates is not None:
        names, spread, columns = made_of.estimates.names, made_of.estimates.whole, more.columns(rows.values)
        carried = pose_covariance(file.robot, found.pose, names, spread, columns)
        found = replace(found, covariance=found.covariance + carried)
        said = (*said, Remark.of(Code.CALIBRATION_CARRIED, run=o.robot))
    made = Poses(file, rows.names, found, si.sigma)
    remarks = (*file.warnings, *rows.warnings, *said, *made_of.remarks, *made.reasons)
    inputs = (*robot_inputs(file, o.robot), InputFile(Path(o.lengths), rows.sha256))
    text, trusted = listing_text(made.table_listing), not made.reasons and not made_of.cautions
    document = made.document(remarks, inputs, command)
    return Outcome(made, lambda: document, trusted, remarks, text, listing=made.table_listing).put(o.output)
