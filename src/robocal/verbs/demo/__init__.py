"""`demo`: arms that a stranger can watch being calibrated; a story that is told while it happens."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from robocal._record import record
from robocal.report.sections import Block, Cell, Section, Text, quiet
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch

__all__ = ["Options", "run", "sections"]


@record
class Options(BaseOptions):
    """Calibrate three arms, two simulated and one measured, and write their reports.

    \b
    rv-2aj   the Mitsubishi RV-2AJ of a published calibration (simulated)
    camera   ten real camera readings that support no calibration: refused
    tracker  a six-axis arm with typical factory errors (simulated)

    Exit status 0 when every case has the expected result.
    """

    name: str | None = arg(None, "NAME", "rv-2aj, camera or tracker; all of them by default.")
    output: Path = option(Path("robocal-demo"), "Where files and reports go", "DIR", short="-o")
    seed: w.Seed = 0


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[dict[str, Any]]:
    """Runs the cases one after the other; each finding is told to `watch` as sections as soon as it is there."""
    from robocal.verbs.demo.cases import demo

    begun, told, good, last = time.monotonic(), [], True, None
    for case, finding in demo(o.name, o.output, o.seed, watch):
        label = "simulated" if case.simulated else "real measurements"
        story = [] if case is last else [Section.of(f"{case.title}  ({label})", Text.of(case.story))]
        last, result = case, finding.outcome.result
        good &= finding.ok
        folder = finding.outcome.written[0].parent
        told.append(
            {
                "case": case.name, "simulated": case.simulated, "title": finding.title, "expected": finding.expected, "ok": finding.ok,
                "verdict": result.verdict, "residuals": result.residuals, "facts": list(finding.facts),
                "folder": str(folder), "command": finding.repeat,
            }
        )  # fmt: skip
        if watch:
            watch({"stage": "read", "sections": [*story, _finding_section(finding, folder)]})
    seconds = time.monotonic() - begun
    document = {"ok": good, "seconds": round(seconds, 2), "folder": str(o.output), "cases": told}
    return Outcome(document, lambda: document, good)


def _finding_section(finding: Any, folder: Path) -> Section:
    """One step of a case: verdict, errors, facts, whether it is as expected, and how to do it again."""
    from robocal.report.error_tables import errors_table
    from robocal.report.proof import verdict

    result = finding.outcome.result
    blocks: list[Block | None] = [Text.of((finding.title, "title"))]
    if finding.expected in ("improved", "refused"):
        blocks.append(verdict(result))
    blocks.append(errors_table(result.residuals, "error"))
    blocks += [Text.of(fact, indent=2) for fact in finding.facts]
    mark: Cell = ("as it should be", "good") if finding.ok else (f"NOT as it should be: {finding.expected}", "bad")
    page = folder / "report.html"
    files = f"report: {page}" if page.exists() else f"files: {folder}"
    blocks += [Text.of(mark, indent=2), *quiet(files, f"again:  {finding.repeat}", indent=2)]
    return Section.of("", *blocks)


def sections(made: Outcome[dict[str, Any]]) -> Iterator[Section]:
    """How it ended, and how to go on."""
    found = made.result
    words = "Every case came out as it should" if made.trusted else "NOT every case came out as it should"
    ended = f"{words}, in {found['seconds']:.1f} s. Robots, data and reports are in {found['folder']}/"
    yield Section.of(
        "",
        Text.of((ended, "good" if made.trusted else "bad")),
        Text.of("Your own robot: robocal new ROBOT -o FOLDER; robocal check ...; robocal identify ... -o run"),
    )
