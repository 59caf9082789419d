"""What an identification says: the verdict first, then errors, parameters, what is not observable, remarks, and how it was done.

`result` is the document of result.json as an object; numbers stand in the units that it names. Terminal, report.html and notebook
draw the same sections.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

from robocal.remarks.remark import percent
from robocal.report.compared import comparison, groups, layer, linear
from robocal.report.error_tables import errors, outlier_blocks, tiles
from robocal.report.fitted import fit_sections, recipe
from robocal.report.frames import frames
from robocal.report.heat import heat
from robocal.report.page import page
from robocal.report.parameter_tables import hidden, parameters
from robocal.report.proof import verdict
from robocal.report.sections import Block, Detail, Figure, Section, Text, Written, ends, quiet

__all__ = ["closing_section", "identification_sections", "report"]

Columns = Mapping[str, Sequence[object]]
HEAT = (
    "Two slices through the workspace, in base coordinates, on one scale of colours. Left: how far the nominal model is off, with "
    "base and tool placed as well as they can be. Right: the radius that holds the error of the corrected model with 95 %; what "
    "was not seen counts as uncertain as expected. Each cell is a mean over random configurations that reach it; empty cells were "
    "not reached. Numbers: accuracy_map.csv."
)


class Sentence(NamedTuple):
    """A remark of which only the sentence is known."""

    sentence: str
    advice: str = ""


def report(result: Any, rows: Columns | None, cells: Columns | None) -> str:
    """The text of report.html of a result, with the columns of its residuals.csv and accuracy_map.csv."""
    facts = (
        ("Convention", result.robot.convention),
        ("Joints", str(result.robot.joints) if result.robot.joints else ""),
        ("Nominal values from", result.robot.source),
        ("Method", result.method),
        ("Computed", _moment(result.provenance.started)),
        ("robocal", result.provenance.version),
    )
    name, version = result.robot.name or "Unnamed robot", result.provenance.version
    sections = identification_sections(result, rows, lambda: cells)
    return page(name, sections, kind="Calibration report", facts=facts, made=version)


def _moment(value: str) -> str:
    """A time stamp without its seconds, or as it was given."""
    try:
        return datetime.fromisoformat(value).strftime("%Y-%m-%d %H:%M %Z").strip()
    except ValueError:
        return value


def identification_sections(
    result: Any, rows: Columns | None = None, cells: Callable[[], Columns | None] = lambda: None
) -> Iterator[Section]:
    """The whole story of one identification; `rows` are the columns of residuals.csv, `cells` makes those of accuracy_map.csv."""
    split = result.split
    facts = f"{len(split.fit)} configurations"
    if split.held_out:
        facts += f" fitted, {len(split.held_out)} held out"
    if split.embargoed:
        facts += f", {len(split.embargoed)} left out because they share a place with those"
    head = Text.of((result.robot.name, "strong"), f"   {result.method}; {facts}; {result.fit.reason}")
    yield Section.of("", head, verdict(result), tiles(result.pose_from_lengths or result.residuals))
    yield errors(result, rows)
    shares = result.prediction.coverage if result.prediction else []
    told = [
        f"of {c.n} held-out measurements ({c.quantity}), {percent(c.whole)} lie in their {percent(c.level)} region as fitted"
        for c in shares
        if math.isfinite(c.whole)
    ]
    told += [p.text for p in (result.working_range, result.scale) if p is not None and p.text]
    trusted = Detail(lambda: _map(cells()))
    yield Section.of("", *quiet(*told), trusted, title="Where it can be trusted", key="workspace")
    if (located := frames(result)) is not None:
        yield located
    yield parameters(result)
    yield hidden(result)
    if result.offsets is not None:
        yield Section.of("", *quiet(result.offsets.reason.sentence), title="Joint offsets alone", key="offsets")
    for part, title, key in (
        (groups(result.groups_tried), "Beyond geometry", "beyond"),
        (layer(result.layer), "Residual layer", "layer"),
        (linear(result.linearity), "How linear it was", "linearity"),
        (comparison(result.comparison), "Other estimators on the same measurements", "comparison"),
    ):
        if part:
            yield Section.of("", *part, title=title, key=key)
    if result.outliers:
        yield outlier_blocks(result.outliers)
    yield from fit_sections(result)
    # Results of earlier versions have sentences alone.
    known = result.remarks or [Sentence(w) for w in dict.fromkeys(result.warnings)]
    yield from ends(known, key="warnings")
    yield recipe(result)


def _map(cells: Columns | None) -> Iterator[Block]:
    if cells and (svg := heat(cells)):
        yield Figure(svg, HEAT)


def closing_section(result: Any, written: Sequence[Path], left_out: Sequence[str]) -> Section:
    """The verdict once more, where the files are and what one of them cannot hold, what to do next, and the page as the last
    line: what stands at the end of a long output is what people see."""
    head = verdict(result, brief=True)
    if not written:
        nothing = quiet("Nothing was written; -o DIR keeps the result, the calibrated robot and a report.")
        return Section.of("", head, *nothing)
    folder, lost = written[0].parent, None
    if left_out and result.robot.joints:  # of cable robots the remark says it, and which verb takes the folder
        text = (
            f"calibrated.urdf does not hold {', '.join(left_out)}; the folder {folder} does: "
            "give the folder, not the file, to validate, export and simulate."
        )
        lost = Text.of((text, "doubtful"))
    shown = (Text.of(str(p)) for p in written if p.name == "report.html")
    return Section.of("", head, Written(tuple(written)), lost, *quiet(*_next(result, folder)), *shown)


def _next(result: Any, folder: Path) -> list[str]:
    """The command that comes next, by the verdict and the kind of machine."""
    if result.verdict.status == "improved":
        place = quote(str(folder))
        if result.robot.convention.startswith("cable "):
            return [f"next: robocal cable forward {place} LENGTHS; robocal cable drift {place} LATER_RUN"]
        more = f"; robocal compensate {place} TARGETS" if result.robot.joints else ""
        return [f"next: robocal validate {place} OTHER_DATA{more}"]
    if result.verdict.status == "located":
        return ["next: copy the frames above; identify without --free finds what the robot itself is off by"]
    read = [str(i.file).removeprefix("catalogue:") for i in result.provenance.inputs[:2]]
    files = " ".join(map(quote, read)) or "ROBOT DATA"
    return [f"next: do what the reasons above say; robocal check {files} says what the files can tell"]
