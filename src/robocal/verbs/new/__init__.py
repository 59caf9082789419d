"""`new`: files to start from, or the list of what there is."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.report.sections import Section, Text, quiet, table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.verbs.new.result import Catalogue, New

__all__ = ["Options", "run", "sections"]


@record
class Options(BaseOptions):
    """Write a robot file, a data file and a table to fill in; for a cable robot, its file, a list of poses and the data of a calibration.

    For a robot that has a file, such as a URDF, only data files and tables are written. With --table the data file describes a
    table that you have: separator, decimal comma, columns and units, as its headers say.

    \b
    robocal new --list
    robocal new ur10 -o cell
    robocal new robot.urdf -o cell
    robocal new robot.urdf --table export.csv -o cell
    robocal new mdh-hayati --joints 5 -o cell
    robocal new cable -o cell
    robocal new cell/robot.yaml --kind lengths -o monday
    """

    robot: str | None = arg(None, "ROBOT", "A catalogue name, a convention, cable, or the file of a robot.")
    output: Path = option(Path("."), "Folder for the files", "DIR", short="-o")
    joints: int = option(6, "How many, when ROBOT is a convention", "N", least=1, most=30)
    kind: w.KindToFillIn = None
    table: Path | None = option(None, "Describe this table of measurements; its headers say the kind", "FILE")
    listing: bool = option(False, "List the catalogue and the conventions", name="--list")
    force: w.Force = False
    base: w.Base = None
    tip: w.Tip = None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[New | Catalogue]:
    """Writes robot.yaml, data.yaml and measurements.csv; of a cable robot robot.yaml, poses.csv and the data of a calibration.
    Raises ModelError for an unknown name, FileError for a file that exists."""
    from robocal.errors import ModelError
    from robocal.verbs.new.result import listing, new

    if o.listing:
        catalogue = listing()
        return Outcome(catalogue, lambda: catalogue)
    if o.robot is None:
        message = "which robot? give a name of the catalogue, a convention, cable, or the file of a robot"
        raise ModelError(message, expected="robocal new --list shows them")
    made = new(o)
    document = {"name": made.name, "convention": made.convention, "written": [str(p) for p in made.written]}
    return Outcome(made, lambda: document, written=made.written)


def sections(made: Outcome[New | Catalogue]) -> Iterator[Section]:
    """What was written and what to do with it; or the catalogue and the conventions."""
    from robocal.verbs.new.result import Catalogue

    found = made.result
    if isinstance(found, Catalogue):
        title = "Catalogue: these names are accepted wherever a robot is"
        rows = [(r.name, r.robot, str(r.joints), r.convention) for r in found.robots]
        yield Section.of("", table("robot", "", "joints", "convention", right=(2,), title=title, rows=rows))
        title = "Conventions: for a robot of your own"
        rules = [(c.name, c.formula, "yes" if c.complete else "no") for c in found.conventions]
        complete = "complete: every small geometric error can be written, parallel axes included"
        words = quiet(complete, "cable: a robot on cables")
        yield Section.of("", table("convention", "each joint is", "complete", title=title, rows=rules), *words)
        return
    head = f"{found.name}, convention {found.convention}:" if found.convention else f"{found.name}:"
    todo = "Fill them in, then" if found.table is None else f"{found.table} is described; next"
    if found.unstated:
        todo = f"{found.table} does not state every unit: write it where data.yaml says {found.unstated}, then"
    data = [quote(str(p)) for p in found.written if p != found.robot and p.suffix == ".yaml"]
    robot = quote(str(found.robot))
    where = f"Where to measure: robocal cable poses {robot} --choose 20 -o list" if found.chooses else None
    yield Section.of(
        "",
        Text.of(head),
        *(Text.of(str(path), indent=2) for path in made.written),
        None if where is None else Text.of(where),
        Text.of(f"{todo}: robocal {found.command} {robot} {' '.join(data)}"),
    )
