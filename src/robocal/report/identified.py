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
from typing import Any

from robocal.remarks.code import Code
from robocal.remarks.remark import percent
from robocal.report.arrows import TITLES, arrows, have_places
from robocal.report.brief import changes, first_remarks, omissions, range_sentence
from robocal.report.compared import comparison, groups, layer, linear
from robocal.report.error_tables import errors, outlier_blocks, tiles
from robocal.report.fitted import fit_sections, recipe
from robocal.report.frame_table import frames, place_of
from robocal.report.heat import heat
from robocal.report.page import page
from robocal.report.parameter_tables import change_text, hidden, largest_changes, parameters
from robocal.report.proof import PRAISED, verdict
from robocal.report.sections import (
    Block,
    Detail,
    Facts,
    Figure,
    Remarks,
    Section,
    Sentence,
    Text,
    VerdictBlock,
    Written,
    quiet,
    strong,
)  # fmt: skip

__all__ = ["closing_section", "identification_sections", "report", "steps"]

Columns = Mapping[str, Sequence[object]]
MOVED, LARGEST = 12, 4  # parameters of the third screen of a page, and of its first
HEAT = (
    "Two slices through the workspace, in base coordinates, each quantity on its own scale of colours. Left: how far the nominal "
    "model is off, with base and tool placed as well as they can be. Right: the radius that holds the error of the corrected model "
    "with 95 %; what was not seen counts as uncertain as expected. Each cell is a mean over random configurations that reach it; "
    "empty cells were not reached. Numbers: accuracy_map.csv."
)


def report(
    result: Any,
    rows: Columns | None,
    cells: Columns | None,
    folder: Path | None = None,
    compared: Columns | None = None,
) -> str:
    """The text of report.html of a result, with the columns of its residuals.csv, accuracy_map.csv and comparison.csv; `folder`: where
    they are kept."""
    joints = str(result.robot.joints or "")
    facts = (
        ("Convention", result.robot.convention), ("Joints", joints), ("Computed", _moment(result.provenance.started)),
    )  # fmt: skip
    name, version = result.robot.name or "Unnamed robot", result.provenance.version
    sections = identification_sections(result, rows, lambda: cells, folder, compared)
    return page(name, sections, kind="Calibration report", facts=facts, made=version)


def _moment(value: str) -> str:
    """A time stamp without its seconds, or as it was given."""
    try:
        return datetime.fromisoformat(value).strftime("%Y-%m-%d %H:%M %Z").strip()
    except ValueError:
        return value


def identification_sections(
    result: Any,
    rows: Columns | None = None,
    cells: Callable[[], Columns | None] = lambda: None,
    folder: Path | None = None,
    compared: Columns | None = None,
) -> Iterator[Section]:
    """The whole story of one identification; `rows` are the columns of residuals.csv, `cells` makes those of accuracy_map.csv, `compared`
    are those of comparison.csv, and `folder` is where they are kept."""
    split, located = result.split, result.verdict.status == "located"
    facts = f"{len(split.fit)} configurations"
    if split.held_out:
        facts += f" fitted, {len(split.held_out)} held out"
    if split.embargoed:
        facts += f", {len(split.embargoed)} left out because they share a place with those"
    head = Text.of((result.robot.name, "strong"), f"   {result.method}; {facts}; {result.fit.reason}")
    # Results of earlier versions have sentences alone.
    known = result.remarks or [Sentence(w) for w in dict.fromkeys(result.warnings)]
    doubts = [r for r in known if getattr(r, "code", "") != Code.ELSEWHERE]
    said, judged = first_remarks(doubts), verdict(result)
    clear = not doubts and judged.style == "good"
    line = (Text.of((result.robot.name, "strong"), f"   {facts}"), _few(judged))
    yield Section.of("", head, judged, tiles(result), Detail(lambda: _summary(result, clear, said, folder)), brief=line)
    rows_known = rows is not None and any(len(c) for c in rows.values())
    drawn = Detail(lambda: [arrows(rows, result.robot.shape) if rows_known and rows is not None else None])
    point = rows_known and rows is not None and have_places(rows)
    yield Section.of("", drawn, title=TITLES[point], key="directions", brief=())
    moved = Detail(lambda: [] if located or result.verdict.status == "refused" else largest_changes(result, MOVED))
    yield Section.of("", moved, title="What changed", key="changed", brief=())
    shares = result.prediction.coverage if result.prediction else []
    told = [
        f"of {c.n} held-out measurements ({c.quantity}), {percent(c.whole)} lie in their {percent(c.level)} region as fitted"
        for c in shares
        if math.isfinite(c.whole)
    ]
    told += [p.text for p in (result.working_range, result.scale) if p is not None and p.text]
    yield errors(result, rows)
    trusted = Detail(lambda: _map(cells()))
    less = quiet(*filter(None, [range_sentence(result)]))
    yield Section.of(
        "", *quiet(*told), trusted, title="Where it can be trusted", key="workspace", brief=less, folded=True
    )
    if (placed := frames(result)) is not None:
        yield placed
    yield parameters(result)
    yield hidden(result)
    if result.offsets is not None:
        words = quiet(result.offsets.reason.sentence)
        yield Section.of("", *words, title="Joint offsets alone", key="offsets", brief=(), folded=True)
    for part, title, key, brief in (
        (groups(result.groups_tried), "Beyond geometry", "beyond", None),
        (layer(result.layer), "Residual layer", "layer", None),
        (linear(result.linearity), "How linear it was", "linearity", ()),
        (comparison(result.comparison, compared), "Other estimators on the same measurements", "comparison", None),
    ):
        if part:
            yield Section.of("", *part, title=title, key=key, brief=brief, folded=True)
    if result.outliers:
        yield outlier_blocks(result.outliers)
    yield from fit_sections(result)
    if known:
        shown = (strong("Worth knowing"), said) if said else ()
        yield Section.of("Worth knowing", Remarks(tuple(known)), key="warnings", brief=shown, folded=True)
    yield recipe(result)


def _few(judged: VerdictBlock) -> VerdictBlock:
    """A verdict with its first reason, how many more there are, and what to do about the first."""
    more = len(judged.reasons) - 1
    others = (f"{more} more reason{'' if more == 1 else 's'}: --verbose",) if more > 0 else ()
    return VerdictBlock(judged.word, judged.style, judged.reasons[:1], (*judged.advice[:1], *others))


def _summary(result: Any, clear: bool, said: Remarks | None, folder: Path | None) -> Iterator[Block]:
    """What else the first screen says: where the gain holds, what moved most, what was left out, the most serious remark or that all is
    `clear`, and what next."""
    status = result.verdict.status
    moved = (
        ""
        if status in ("refused", "located")
        else "; ".join(f"{p.name} {change_text(p)}" for p in changes(result, LARGEST))
    )
    first = said.messages[0] if said else None
    none = "no doubt was found" if clear else ""
    words = none if first is None else f"{first.sentence}. {first.advice}".strip()
    # Advice beside good news comes before what one does with it.
    before = "first what is worth knowing says; then " if first and first.advice and status in PRAISED else ""
    pairs = (
        ("Where", range_sentence(result)),
        ("Moved most, ± 95 %", moved),
        ("Found", "; ".join(place_of(f.pose) for f in result.frames) if status == "located" else ""),
        ("Left out", omissions(result)),
        ("Worth knowing", words),
        ("Next", before + "; ".join(steps(result, folder, explain=True))),
    )
    yield Facts(tuple((name, value) for name, value in pairs if value))


def _map(cells: Columns | None) -> Iterator[Block]:
    if cells and (svg := heat(cells)):
        yield Figure(svg, HEAT)


def closing_section(result: Any, written: Sequence[Path], left_out: Sequence[str]) -> Section:
    """The verdict once more, where the files are and what one of them cannot hold, what to do next, and the page as the last
    line: what stands at the end of a long output is what people see."""
    head = verdict(result, brief=True)
    if not written:
        nothing = quiet("Nothing was written; -o DIR keeps the result, the calibrated robot and a report.")
        return Section.of("", head, *nothing, brief=nothing)
    folder, lost = written[0].parent, None
    if left_out and result.robot.joints:  # of cable robots the remark says it, and which verb takes the folder
        text = (
            f"calibrated.urdf does not hold {', '.join(left_out)}; the folder {folder} does: "
            "give the folder, not the file, to validate, export and simulate."
        )
        lost = Text.of((text, "doubtful"))
    nexts = quiet(*(f"next: {step}" for step in steps(result, folder)))
    pages = tuple(Text.of(str(p)) for p in written if p.name == "report.html")
    return Section.of("", head, Written(tuple(written)), lost, *nexts, *pages, brief=(lost, *nexts, *pages))


def steps(result: Any, folder: Path | None, explain: bool = False) -> list[str]:
    """The commands that come next, by the verdict and the kind of machine; `explain` says what each does."""
    place = "RUN" if folder is None else quote(str(folder))
    if result.verdict.status == "improved":
        if result.robot.convention.startswith("cable "):
            commands = {
                f"cable forward {place} LENGTHS": "poses from lengths",
                f"cable drift {place} LATER_RUN": "what moved since",
            }
        else:
            commands = {f"validate {place} OTHER_DATA": "the errors on other data"}
            moves = (
                result.robot.joints and result.working_range is not None
            )  # what moves no position corrects no target
            commands |= {f"compensate {place} TARGETS": "corrected targets"} if moves else {}
        return ["; ".join(f"robocal {c}{f' ({why})' if explain else ''}" for c, why in commands.items())]
    if result.verdict.status == "located":
        copied = "copy the frames above to what works with them"
        robot = result.provenance.options.get("free") and result.robot.convention != "rig"
        alone = "identify without --free finds what the robot itself is off by"
        return ["; ".join((copied, alone) if robot else (copied,))]
    read = [str(i.file).removeprefix("catalogue:") for i in result.provenance.inputs[:2]]
    files = " ".join(map(quote, read)) or "ROBOT DATA"
    return [f"do what the reasons above say; robocal check {files} says what the files can tell"]
