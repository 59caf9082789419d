"""What a run folder predicts of rows that nobody measured: a listing for machines and a table for readers, of any machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from robocal._record import record
from robocal.estimate.uncertainty import LEVEL
from robocal.files.parts import Document, InputHash, hashes
from robocal.files.text import InputFile
from robocal.prove.shape import RobotShape
from robocal.quantities import Listing
from robocal.remarks.remark import Remark, remark_fields

__all__ = ["Prediction", "PredictionDocument"]


@record(kw_only=True)
class PredictionDocument(Document):
    """What `predict --json` prints; bands are radii that hold the truth with the probability `level`."""

    robot: str
    level: float
    relative_to: str
    poses: Listing
    inputs: list[InputHash]
    written: list[str]


@record
class Prediction:
    """Predicted `poses` with 95 % bands (mm, deg), in the order of the file; `relative_to` says what the bands leave out, `what` what the
    rows are, `table` what readers see of them, and `notes` how; `shapes` draws the machine there."""

    name: str
    poses: Listing
    relative_to: str
    what: str
    table: Listing
    notes: str
    inputs: tuple[InputFile, ...]
    warnings: tuple[Remark, ...]
    shapes: Callable[[], Sequence[RobotShape]]
    trusted: bool = True
    written: tuple[Path, ...] = ()

    @property
    def document(self) -> PredictionDocument:
        """What --json prints."""
        return PredictionDocument(
            robot=self.name, level=LEVEL, relative_to=self.relative_to, poses=self.poses, inputs=hashes(self.inputs),
            **remark_fields(self.warnings), written=[str(p) for p in self.written],
        )  # fmt: skip
