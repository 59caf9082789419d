"""`verify`: poses of a robot, or of several ways to measure it, against an external instrument."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.remarks.remark import percent
from robocal.report.sections import Block, Cell, Section, Table, Text, ends, figure, quiet, table
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.apply.verification import Anova
    from robocal.verbs.verify.result import Agreed, AnovaResult, ErrorSpread, PosePair, Verified

__all__ = ["Options", "run", "sections"]

FILES = ("verify.json", "report.html")
SOURCES = Arg("SOURCES...", "The poses to compare: of the robot, of its camera, ...; the same ids.")
LEVEL = 0.05


@record
class Options(BaseOptions):
    """Compare poses with those of an external instrument: as measured, relative to the first one, and
    after the best alignment.

    Files of poses are CSV whose headers carry units (id, x [mm], ..., rx [deg], ...), or data.yaml with kind: pose and any
    form of orientation. For two sources and a reference, the report shows which of them agree. It also tests whether
    means of errors differ (one-way analysis of variance).

    \b
    robocal verify tracker.csv robot.csv
    robocal verify tracker.csv robot.csv camera.csv -o verified
    robocal verify groups.csv --summary

    With --summary the one file holds means and standard deviations: group, n, NAME_mean, NAME_sd.

    Exit status 3 when a source cannot have the poses of the reference: another unit, mirrored, other rows.
    """

    reference: str = arg(..., "REFERENCE", "The poses of the external instrument; with --summary a table of groups.")
    sources: Annotated[tuple[str, ...], SOURCES] = ()
    summary: bool = option(False, "Analysis of variance from means and standard deviations")
    output: Path | None = option(None, f"Write {FILES[0]} and {FILES[1]} here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Verified | AnovaResult]:
    """Compares poses, or means. Raises InputError."""
    from robocal.errors import ModelError
    from robocal.verbs.verify.result import summarise_groups, verify_sources

    def find() -> Verified | AnovaResult:
        if not o.summary:
            return verify_sources(o.reference, o.sources, command)
        if o.sources:
            sources, expected = ", ".join(o.sources), "nothing beside it"
            raise ModelError("a summary is one file", key="--summary", found=sources, expected=expected)
        return summarise_groups(o.reference, command)

    return run_verb(o, FILES, find, sections)


def sections(made: Outcome[Verified | AnovaResult]) -> Iterator[Section]:
    """Errors by view, the analysis of variance, and who agrees with whom."""
    from robocal.verbs.verify.result import AnovaResult

    found = made.result
    if isinstance(found, AnovaResult):
        yield Section.of("", Text.of(f"{len(found.groups)} groups: {', '.join(found.groups)}"))
        yield Section.of("", _anova(found.anova), title="One-way analysis of variance", key="anova")
        yield from ends(written=made.written)
        return
    yield Section.of("", Text.of((found.reference.name, "strong"), f"   {len(found.reference.ids)} poses in all files"))
    rows: list[tuple[Cell, ...]] = []
    for source, views in found.spreads.items():
        rows += [(source, view, *_cells(e.position), *_cells(e.orientation)) for view, e in views.items()]
    columns = ("source", "errors", "position [mm]", "± sd", "largest", "orientation [deg]", "± sd", "largest")
    yield Section.of(
        "", table(*columns, right=(2, 3, 4, 5, 6, 7), rows=rows),
        *quiet("aligned: the source in the reference's frame; another point: it may watch another frame on the platform as well"),
        title="Errors", key="errors",
    )  # fmt: skip
    if found.anova:
        both = {f"{v}, {what}": a for v, pair in found.anova.items() for what, a in vars(pair).items()}
        yield Section.of("", _anova(both), title="Do the means of the sources differ?", key="anova")
    if found.agreement is not None:
        yield Section.of("", *_agreement_table(found.agreement), title="Who agrees with whom", key="agreement")
    yield from ends(made.remarks, made.written)


def _cells(e: ErrorSpread) -> tuple[str, ...]:
    return figure(e.mean, 3), "" if e.sd is None else figure(e.sd, 3), figure(e.max, 3)


def _anova(found: Mapping[str, Anova]) -> Table:
    rows = []
    for name, a in found.items():
        shown = "differ" if a.chance < LEVEL else "not shown to differ"
        rows.append((name, figure(a.f, 3), f"{a.between}, {a.within}", f"{a.chance:.2g}", shown))
    return table("means of", "F", "degrees of freedom", "chance", f"at {percent(1 - LEVEL)}", right=(1, 3), rows=rows)


def _agreement_table(found: PosePair[Agreed]) -> Iterator[Block]:
    position, turned = found.position, found.orientation
    rows = [(pair, figure(v, 3), figure(turned.apart[pair], 3)) for pair, v in position.apart.items()]
    for name in position.own:
        moved, turn = (figure(v, 3) if v == v else "none left" for v in (position.own[name], turned.own[name]))
        rows.append((f"{name} by itself", moved, turn))
    yield table("rms, aligned to the reference", "position [mm]", "orientation [deg]", right=(1, 2), rows=rows)
    yield from quiet("by itself: if the errors of the three have nothing in common (Grubbs)")
    for what, one in (("positions", position), ("orientations", turned)):
        if one.shared is not None:
            a, b = one.shared
            third = next(name for name in one.own if name not in one.shared)
            why = f"they share an error, or {third} errs"
            yield Text.of(f"{what}: {a} and {b} agree better than errors of their own allow: {why}")
