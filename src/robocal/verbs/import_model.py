"""`import`: a model of CASPR as robot.yaml. Python keeps the word for itself: there it is `import_model`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.files.parts import CableDocument
from robocal.report.sections import Section, Text, Written
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.files.cable.caspr import Caspr

__all__ = ["Options", "run", "sections"]


@record(kw_only=True)
class ModelDocument(CableDocument):
    """What --json prints: the cable set that was read, the others of the file, and what the file calls every cable."""

    cable_set: str | None
    other_sets: Sequence[str]
    names: dict[str, str]
    text: str | None


@record
class Options(BaseOptions):
    """Write a model of CASPR as robot.yaml, with one of its cable sets.

    It is the same robot that every verb reads from the model itself.

    A remark names each value that robot.yaml cannot contain.

    \b
    robocal import CoGiRo_cables.xml -o robot.yaml
    robocal import CoGiRo_cables.xml --cables original -o robot.yaml
    """

    model: str = arg(..., "MODEL", "CASPR's X_cables.xml, with X_bodies.xml beside it.")
    cables: str | None = option(
        None, "The cable set to read, by its id", "SET", otherwise="the model's default set, or its only one"
    )
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Caspr]:
    """The robot of a cable set as the text of a robot.yaml, lengths in m. Raises InputError for whatever the model is that no
    robot.yaml can be, and writes nothing then."""
    from robocal.errors import ModelError
    from robocal.files.cable.caspr import open_caspr
    from robocal.files.cable.write import describe_cable
    from robocal.files.text import ROBOT_LIMIT, read_text
    from robocal.files.writing import refuse_existing
    from robocal.session.cable.statics_options import cable_document, robot_inputs

    refuse_existing(o.output, (), o.force)
    made = open_caspr(read_text(o.model, limit=ROBOT_LIMIT), o.cables)
    file = made.file
    (bodies,) = (i.file for i in file.beside)
    if o.output is not None and o.output.exists() and o.output.samefile(bodies):
        found, expected = str(o.output), "another name"
        raise ModelError("the output is one of the inputs", key="--output", found=found, expected=expected)
    text = describe_cable(file.robot, file.units)
    remarks = (*file.warnings, *made.unheld)
    document = cable_document(
        ModelDocument, file.robot, remarks, robot_inputs(file, o.model), command, cable_set=made.cable_set or None,
        other_sets=made.others, names=dict(zip(file.robot.cables, made.names, strict=True)), text=text if o.output is None else None,
    )  # fmt: skip
    return Outcome(made, lambda: document, remarks=remarks, text=text).put(o.output)


def sections(made: Outcome[Caspr]) -> Iterator[Section]:
    """Robot and cable set, every cable as CASPR and as robot.yaml call it, and where the file is."""
    from robocal.session.cable.summary import summary

    found: Caspr = made.result
    robot = found.file.robot
    cables = (f"{c} ({n})" if n not in ("", c) else c for c, n in zip(robot.cables, found.names, strict=True))
    which = f"cable set {found.cable_set}" if found.cable_set else "its cable set"
    words = f"   CASPR, {which}; {len(robot.cables)} cables: {', '.join(cables)}"
    yield Section.of("", Text.of((robot.name, "strong"), words))
    yield from summary(found.file)
    if made.written:
        yield Section.of("", Written(made.written))
