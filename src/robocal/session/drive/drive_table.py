"""What `drive compensate` finds: the table of a motor in the form that a controller takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocal._record import record
from robocal.errors import ModelError
from robocal.files.drive_tables import ODRIVE_CELLS, CompensationTable, compensation_table, table_text
from robocal.files.motor_file import MotorFile, read_motor
from robocal.files.parts import Document, Origin
from robocal.quantities import Listing, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.verb_base import VerbResult

__all__ = ["DriveTable", "DriveTableDocument", "find_compensation", "unproven"]


@record(kw_only=True)
class DriveTableDocument(Document):
    """What --json prints: motor, form, cells, the largest value, and the text of the file."""

    motor: str
    form: str
    cells: int
    largest: UnitValue
    friction: bool
    text: str
    provenance: Origin


@record(kw_only=True, eq=False)
class DriveTable(VerbResult):
    """The table of a motor, and its text."""

    motor: MotorFile
    table: CompensationTable
    form: str
    text: str

    @property
    def printed(self) -> tuple[str | None, Listing | None]:
        """The text."""
        return self.text, None

    @property
    def note(self) -> str:
        """One line on the whole."""
        largest, unit = abs(self.table.values).max(), self.table.unit
        rows = "one curve" if len(self.table.values) == 1 else "forward and reverse"
        return f"{self.table.values.shape[1]} cells, {rows}, at most {largest:.4g} {unit}; read back bit for bit"

    @property
    def document(self) -> DriveTableDocument:
        """What --json says."""
        largest = UnitValue(float(abs(self.table.values).max()), self.table.unit)
        return self.document_of(
            DriveTableDocument, motor=self.motor.name, form=self.form, cells=self.table.values.shape[1], largest=largest,
            friction=self.table.friction, text=self.text,
        )  # fmt: skip


def find_compensation(o: Any, command: str) -> DriveTable:
    """The table of a run. Raises InputError."""
    motor = read_motor(Path(o.motor))
    if motor.table is None and not motor.cogging.orders:
        found = None if motor.file is None else str(motor.file.file)
        raise ModelError("no cogging was found: there is nothing to compensate", key="orders", found=found)
    _insist_odrive(o)
    table = compensation_table(motor, o.format, o.cells, o.unit, o.friction, o.torque_constant)
    inputs = () if motor.file is None else (motor.file,)
    return DriveTable(
        motor=motor, table=table, form=o.format, text=table_text(table, o.format), reasons=unproven(motor), inputs=inputs, command=command
    )  # fmt: skip


def unproven(motor: MotorFile) -> tuple[Remark, ...]:
    """That the run of a motor did not prove its table, where its file says so."""
    if motor.verdict in (None, "improved"):
        return ()
    return (Remark.of(Code.DRIVE_RUN_UNPROVEN, motor=motor.name, verdict=motor.verdict.replace("_", " ")),)


def _insist_odrive(o: Any) -> None:
    """Raises ModelError for options that a map of ODrive cannot heed."""
    if o.format != "odrive":
        return
    for key, told, own in (("--cells", o.cells, ODRIVE_CELLS), ("--friction", o.friction, False)):
        if told != own:
            expected = f"{own} cells" if key == "--cells" else "a map without friction: it has one curve for both directions"
            raise ModelError("a map of ODrive cannot have this", key=key, found=told, expected=expected)
    if o.unit == "A":
        raise ModelError("a map of ODrive cannot have this", key="--unit", found=o.unit, expected="Nm")
