"""`cable drift`: calibrations of one cable robot side by side; which anchor moved, and what nobody could see."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal.remarks.remark import sentences
from robocal.report.sections import Cell, Section, Style, Text, ends, figure, quiet, table
from robocal.verbs import words as w
from robocal.verbs.option import Arg, Told, opt
from robocal.verbs.outcome import Outcome, Watch

if TYPE_CHECKING:
    from robocal.apply.anchors import AnchorDrift
    from robocal.verbs.cable.drift.result import Drifts

__all__ = ["Options", "run", "sections"]

FILE, PAGE = "drift.json", "report.html"
RUNS = Arg("RUNS...", "Run folders of one robot, the earliest first; robot files give only the scatter.")


@dataclass(frozen=True)
class Options(Told):
    """Find which frame anchor of a cable robot moved between calibrations, and how calibrations scatter.

    It also reports changes of zeros, scale and base.

    Every later run is compared with the first. Towards the platform, an anchor and the zero of its cable have the same effect. So
    that direction has the largest uncertainty, unless --zeros-unchanged states that the sensors counted on.

    \b
    robocal cable drift march/run june/run
    robocal cable drift march/run june/run --zeros-unchanged
    robocal cable drift march/run june/run september/run --history laval.csv -o compared

    Exit status 3 when nothing follows from these runs.
    """

    runs: Annotated[tuple[str, ...], RUNS]
    zeros_unchanged: bool = opt(False, "The sensors counted on between the runs: their zeros are the same")
    base_moves: bool = opt(False, "The coordinates may differ by a motion: another instrument, or another place of it")
    history: w.History = None
    output: Path | None = opt(None, f"Write {FILE} and {PAGE} here", short="-o", metavar="DIR")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Drifts]:
    """Compares calibrations; a folder gets drift.json and a page. Raises InputError."""
    from robocal.files.plain import json_text
    from robocal.files.writing import refuse_existing, write_text
    from robocal.session.history import with_history
    from robocal.verbs.cable.drift.result import drifts

    refuse_existing(o.output, (FILE, PAGE), o.force)
    made = drifts(o.runs, o.zeros_unchanged, o.base_moves, command)
    text = None if o.history is None else with_history(o.history, [c.run for c in made.all if c.run is not None])
    outcome = Outcome(made, lambda: made.document, made.trusted, made.remarks)
    outcome = outcome.paged(
        o.output, list(sections(outcome)), lambda: {FILE: json_text(made.document)}, PAGE,
        title=f"{made.robot.name}: calibrations compared", kind="Cable robot",
    )  # fmt: skip
    if o.history is not None and text is not None:
        outcome = outcome.kept((*outcome.written, write_text(o.history, text)))
    return outcome


def sections(made: Outcome[Drifts]) -> Iterator[Section]:
    """What moved, cable by cable, and how all of them scatter."""
    found = made.result
    yield Section.of(
        "", Text.of((found.robot.name, "strong"), f"   {len(found.all)} calibrations, the first: {found.all[0].place}")
    )
    if found.reasons:
        yield Section.of("", *(Text.of(reason) for reason in sentences(found.reasons)))
    for n, (place, one) in enumerate(found.compared, 1):
        yield _table(n, found.labels[place], one)
    s = found.scattered
    mm = [1e3 * v for v in (s.component, s.point, s.zero, s.moved, s.scaled, s.along, s.across)]
    rows: list[tuple[Cell, ...]] = [
        ("a component of an anchor (3.39)", figure(mm[0])),
        ("an anchor", figure(mm[1])),
        ("a zero", figure(mm[2])),
        ("a component, each frame brought onto the mean by a motion", figure(mm[3])),
        ("the same, by a motion and a size", figure(mm[4])),
        ("what is left by then along the lines of sight", figure(mm[5])),
        ("and of a component across them", figure(mm[6])),
    ]
    size = ", ".join(f"{1e2 * float(v):+.2g} %" for v in s.size)
    yield Section.of(
        "", table("scatter about the mean of all, rms", "mm", right=(1,), rows=rows), *quiet(f"size of each beside the mean: {size}"),
        title="How the calibrations scatter", key="scatter",
    )  # fmt: skip
    yield from ends(made.remarks, made.written)


def _table(n: int, place: str, one: AnchorDrift) -> Section:
    rows: list[tuple[Cell, ...]] = []
    styles: list[Style] = []
    for c in one.cables:
        state = "moved" if c.moved else "anchor or zero" if c.doubtful else ""
        shown = (figure(1e3 * v, 3) for v in (c.along, c.across, c.zero, *c.smallest))
        rows.append((c.cable, *shown, f"{c.of_all:.1g}", state))
        styles.append("bad" if c.moved else "doubtful" if c.doubtful else "quiet")
    columns = (
        place,
        "along [mm]",
        "across [mm]",
        "zero [mm]",
        "seen along from [mm]",
        "across from [mm]",
        "chance",
        "",
    )
    lines = [
        "along, across: change of the anchor along its line of sight to the platform and across it",
        "seen from: a drift of this size would be named with 95 % certainty; chance: of such a change by noise alone, of all cables",
    ]
    if one.base is not None and one.base_sigma is not None:
        v, s = 1e3 * one.base, 1e3 * one.base_sigma
        moved = ", ".join(f"{a:.3g} ± {1.96 * b:.2g}" for a, b in zip(v, s, strict=True))
        lines.append(f"the base differs by ({moved}) mm and mrad, ± 95 %")
    elif one.scale_sigma < 1:
        lines.append(
            f"size of the frame {1e6 * one.scale:+.3g} ± {1.96e6 * one.scale_sigma:.2g} ppm (95 %), if nothing else changed"
        )
    return Section.of(
        "", table(*columns, right=(1, 2, 3, 4, 5, 6), rows=rows, styles=styles), *quiet(*lines),
        title=f"{place} beside the first", key=f"beside-{n}",
    )  # fmt: skip
