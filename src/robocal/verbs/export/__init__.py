"""`export`: a robot model in the form that the next program wants."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocal._record import record
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch
from robocal.verbs.outcome import path_sections as sections

if TYPE_CHECKING:
    from robocal.verbs.export.result import Exported

__all__ = ["FORMATS", "Options", "run", "sections"]

FORMATS = ("yaml", "urdf", "dh", "csv", "markdown", "offsets", "ros", "xacro", "mjcf")


@record
class Options(BaseOptions):
    """Write a robot model as robot.yaml, URDF, a table of its parameters, joint offsets for a controller, or
    a model for MuJoCo.

    \b
    robocal export run --format offsets
    robocal export run --format urdf -o calibrated.urdf
    robocal export run --format urdf --into robot.urdf -o calibrated.urdf
    robocal export ur10 --format markdown
    robocal export cable_robot.yaml --format mjcf -o robot.xml
    """

    robot: w.AnyRobot
    output: w.OutputFile = None
    form: str = option(
        "yaml",
        "yaml, urdf, dh (a table with Hayati's beta), csv or markdown (the parameters), offsets of the joints: "
        "offsets (CSV), ros (parameters), xacro (properties); of cable robots mjcf (MuJoCo's model)",
        "FORMAT",
        name="--format",
        choices=FORMATS,
    )
    nominal: str | None = option(None, "The robot to which offsets are added; a run folder contains it", "ROBOT")
    into: str | None = option(
        None, "With --format urdf: this URDF with calibrated origins; every other byte stays", "URDF"
    )
    force: w.Force = False
    base: w.Base = None
    tip: w.Tip = None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Exported]:
    """The robot (a file, a catalogue name or a run folder) in another form. Raises InputError, also for a form that cannot
    hold it."""
    from robocal.errors import ModelError
    from robocal.files.writing import refuse_existing
    from robocal.remarks.remark import full_text, remark_fields
    from robocal.verbs.export.result import export_robot

    if o.into is not None and o.form != "urdf":
        raise ModelError("only a URDF can be written into", key="--into", found=o.form, expected="--format urdf")
    refuse_existing(o.output, (), o.force)
    made = export_robot(o)
    document = {
        "format": o.form,
        "text": made.text if o.output is None else None,
        **remark_fields(made.notes),
        "worth": None if made.worth is None else made.worth.document,
    }
    note = "" if made.worth is None else full_text(made.worth)
    return Outcome(made, lambda: document, remarks=made.notes, text=made.text, note=note).put(o.output)
