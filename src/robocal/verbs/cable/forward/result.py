"""What `cable forward` found: poses with their residuals, how sure they are, and why one must not be trusted."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.cables.forward import Forward, forward
from robocal.cables.gradient import pose_covariance
from robocal.files.cable.pose_lists import pose_columns, read_cable_lengths
from robocal.files.display import in_units, listing_text
from robocal.files.parts import CableDocument
from robocal.files.text import InputFile
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.cable.cable_result import CableResult
from robocal.session.cable.calibrated import open_calibrated
from robocal.session.cable.pose_remarks import pose_remarks
from robocal.session.cable.statics_options import name_row, robot_inputs, tensions_of
from robocal.session.cable.winch_run import with_tensions

__all__ = ["Poses", "find_poses"]


@record(kw_only=True)
class PosesDocument(CableDocument):
    """What --json prints: poses with their residuals, one sigma, and the covariance of the twist in m and rad."""

    poses: Listing


@record(kw_only=True, eq=False)
class Poses(CableResult):
    """Poses by name with their evidence: `solution` as `cables.forward` gives it; `cautions` are of the run of a calibrated robot."""

    names: tuple[str, ...]
    solution: Forward
    cautions: tuple[Remark, ...]

    @cached_property
    def rms(self) -> Array:
        """Root mean squares of the residuals, (k,) m."""
        return np.asarray(np.sqrt((self.solution.residual**2).mean(axis=1)))

    @cached_property
    def sigma(self) -> Array:
        """One sigma of position (m) and orientation (rad), (k, 2); not a number where unknown."""
        axes, variances = self.file.robot.axes, np.einsum("kii->ki", self.solution.covariance)
        parts = ([i for i, axis in enumerate(axes) if (axis < 3) is moves] for moves in (True, False))
        return np.asarray(np.sqrt(np.stack([variances[:, part].sum(axis=1) for part in parts], axis=1)))

    @property
    def trusted(self) -> bool:
        """Whether every pose and the run may be trusted."""
        return not self.reasons and not self.cautions

    @property
    def listing(self) -> Listing:
        """One row per pose: the list of `text`, and what only a document has."""
        found = self.solution
        return Listing((
            *pose_columns(self.names, found.pose),
            Column("residual", "m", self.rms),
            Column("sigma_position", "m", self.sigma[:, 0], digits=4),
            Column("sigma_orientation", "rad", self.sigma[:, 1], digits=4),
            Column("solutions", "", found.solutions),
            Column("converged", "", found.converged),
            Column("covariance", "", found.covariance),
        ))  # fmt: skip

    @property
    def printed(self) -> tuple[str, Listing]:
        """The list, in the robot file's units."""
        shown = in_units(self.listing.without("converged", "covariance"), self.file.units)
        return listing_text(shown), shown

    @property
    def document(self) -> PosesDocument:
        """What --json says of them."""
        return self.document_of(PosesDocument, poses=self.listing)


def find_poses(o: Any, command: str = "") -> Poses:
    """Poses by the options of the verb. Raises InputError."""
    calibrated = open_calibrated(o.robot)
    file, gains, known = calibrated.file, calibrated.gains, calibrated.estimates
    rows, told = with_tensions(read_cable_lengths(o.lengths, file.robot), file.robot, calibrated.run, o.lengths)
    si, rng = o.si(file.units), np.random.default_rng(o.seed)
    pull, said = tensions_of(rows, si.tension, file, o.sag)
    said = (*told, *said)
    if file.robot.elasticity is not None and pull is None and not rows.geometric:
        said = (*said, Remark.of(Code.LENGTHS_TAKEN_GEOMETRIC, robot=file.robot.name))
    lengths = gains.lengths(file.robot, rows.values)
    with name_row(o.lengths, rows):
        found = forward(file.robot, lengths, tension=pull, sag=o.sag, sigma=si.sigma, starts=o.starts, rng=rng)
    if known is not None:
        carried = pose_covariance(file.robot, found.pose, known.names, known.whole, gains.columns(rows.values))
        found = replace(found, covariance=found.covariance + carried)
        said = (*said, Remark.of(Code.CALIBRATION_CARRIED, run=o.robot))
    return Poses(
        file=file, names=rows.names, solution=found, cautions=calibrated.cautions,
        warnings=(*file.warnings, *rows.warnings, *said, *calibrated.remarks), reasons=tuple(pose_remarks(rows.names, found, si.sigma)),
        inputs=(*robot_inputs(file, o.robot), InputFile(Path(o.lengths), rows.sha256)), command=command,
    )  # fmt: skip
