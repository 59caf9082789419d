"""What `drive compensate` finds: the table of a motor in the form that a controller takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robocal._record import record
from robocal.errors import ModelError
from robocal.files.drive_tables import CompensationTable, compensation_table, table_text
from robocal.files.motor_file import MotorFile, read_motor
from robocal.files.parts import Document, Origin
from robocal.quantities import Listing, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.verb_base import VerbResult

__all__ = ["DriveTable", "DriveTableDocument", "doubt_motor", "find_compensation"]


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
    table = compensation_table(motor, o.format, o.cells, o.unit, o.friction, o.torque_constant)
    inputs = () if motor.file is None else (motor.file,)
    unproven = doubt_motor(motor)
    return DriveTable(
        motor=motor, table=table, form=o.format, text=table_text(table, o.format), inputs=inputs, command=command,
        reasons=() if unproven is None else (unproven,),
    )  # fmt: skip


def doubt_motor(motor: MotorFile) -> Remark | None:
    """Why nobody should use the table of a motor: its identification did not prove it. None of one that was proven, or that is no run's."""
    if motor.verdict in ("", "improved"):
        return None
    return Remark.of(Code.DRIVE_UNPROVEN, motor=motor.name, verdict=motor.verdict.replace("_", " "))
