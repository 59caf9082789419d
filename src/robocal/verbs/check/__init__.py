"""`check`: what robot and data files say and what they can tell, before anything is fitted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.report.sections import Section, Table, Text, ends, figure, strong, table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.verbs.check.result import Checked

__all__ = ["Options", "run", "sections"]

NAMES = 30  # of free parameters, where there are no data; more of them are a number
LINES = 5  # of what cannot be separated


@record
class Options(BaseOptions):
    """Report what robot and data files contain and which parameters are observable, without fitting.

    The report has joints, rows, the source of sigma, free parameters, and parameters that cannot be
    separated, with the reason. For a cable robot, also a model of CASPR, it has the data of the cables.

    \b
    robocal check robot.yaml data.yaml
    robocal check CoGiRo_cables.xml
    """

    robot: w.Robot
    data: Annotated[tuple[str, ...], w.DATA] = ()
    exclude: w.Exclude = ()
    base: w.Base = None
    tip: w.Tip = None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Checked]:
    """Reads a robot, and data files when there are any. Raises InputError for whatever is wrong with them."""
    from robocal.verbs.check.result import check_inputs

    return Outcome.of(check_inputs(o, watch))


def sections(made: Outcome[Checked]) -> Iterator[Section]:
    """What files contain and what they can tell."""
    from robocal.files.display import outlier
    from robocal.measure.machine import joints_of
    from robocal.report.error_tables import outlier_blocks

    found: Checked = made.result
    machine = found.robot.machine
    prismatic = {j.name for j in joints_of(machine) if j.type == "prismatic"}
    words = f"   convention {found.robot.file.convention}"
    for noun, names in machine.parts.items():
        parts = [f"{n} (prismatic)" if n in prismatic else n for n in names]
        words += f"; {len(parts)} {noun}s: {', '.join(parts)}"
    yield Section.of("", Text.of((machine.name, "strong"), words))
    yield from found.robot.sections()
    if found.instruments:
        yield Section.of("", _instruments(found))
    yield _summary_section(found)
    if found.outliers:
        yield outlier_blocks([outlier(o) for o in found.outliers])
    yield from ends(made.remarks)
    if line := found.line_to_write:
        yield Section.of("", Text.of(f"To identify something, write into the robot's file: {line}"))


def _instruments(found: Checked) -> Table:
    """One row per instrument."""
    from robocal.files.display import display_unit

    rows = []
    for i in found.instruments:
        units = [(s.value, display_unit(s.unit)) for s in i.sigma]
        stated = ", ".join(f"{figure(unit.from_si(v), 2)} {unit.name}" for v, unit in units)
        targets = ", ".join(i.targets) or "the tool"
        counts = (str(i.rows), str(i.configurations))
        rows.append((i.name, i.kind, *counts, stated or i.sigma_source, i.frame, targets, i.source))
    columns = ("instrument", "kind", "rows", "configurations", "sigma", "frame", "targets", "file")
    return table(*columns, right=(2, 3), rows=rows)


def _summary_section(found: Checked) -> Section:
    """What is free, and what the data can tell of it."""
    if found.identifiability is None:
        names = ", ".join(found.free[:NAMES]) + (", ..." if len(found.free) > NAMES else "")
        free = f"{len(found.free)} parameters of the robot are free: {names}"
        return Section.of("", Text.of(free if found.free else "No parameter of the robot is free."))
    seen = found.identifiability
    words = f"{seen.rank} of {len(seen.names)} free parameters can be seen"
    if found.assumed:
        words += " (where no sigma is stated, 0.1 mm and 0.1 mrad were assumed)"
    own = found.robot.machine.table
    kept = [n for n in seen.basis if n in own or not own.rows]  # of a rig, frames are all there is
    fitted, separated = f"to be fitted: {', '.join(kept)}", [c.remark.sentence for c in seen.combinations]
    few = separated[:LINES] if found.motions is None else [found.motions.sentence]
    if more := len(separated) - len(few) if found.motions is None else 0:
        few.append(f"{more} more cannot be separated: --verbose")
    brief = [*([fitted] if len(kept) <= NAMES and found.motions is None else []), *few]
    misfit = None
    if found.misfit is not None:
        left = f"{figure(found.misfit * 1e3)} mm{_without(found)}"
        misfit = Text.of(f"Nominal model with frames and tool fitted: mean error {left}")
    whole, short = ([Text.of(line, indent=2) for line in lines] for lines in ([fitted, *separated], brief))
    return Section.of("", strong(words), *whole, misfit, brief=[strong(words), *short, misfit])


def _without(found: Checked) -> str:
    """Which rows a mean does not count."""
    aside = sum(o.rows for o in found.outliers if o.set_aside)
    if not aside or found.misfit_of_all is None:
        return ""
    return f", {figure(found.misfit_of_all * 1e3)} mm with the rows that are set aside ({aside})"
