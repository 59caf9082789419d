"""`compensate`: corrected joint values and Cartesian commands for a controller that keeps its nominal model."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.remarks.remark import full_text
from robocal.report.sections import SPREAD, Detail, Facts, Section, Text, ends, figure, quiet, spread, table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.verbs.compensate.result import Compensated

__all__ = ["Options", "run", "sections"]

MOST = 10

FILES = ("compensated.csv", "compensation.json", "compensation.html")


@record
class Options(BaseOptions):
    """Correct targets for a controller that keeps its nominal model: joint values and Cartesian poses.

    Every correction is checked with the calibrated model. Targets that cannot be reached are listed, not
    dropped.

    \b
    robocal compensate run program.csv -o program
    robocal compensate calibrated.yaml poses.csv --nominal robot.yaml
    """

    robot: w.AnyRobot
    targets: str = arg(
        ..., "TARGETS", "A CSV whose headers carry units (poses, positions, joints), or a YAML beside it."
    )
    nominal: str | None = option(None, "The model of the controller; a run folder contains it", "ROBOT")
    tool: str = option(
        "calibrated",
        "Tool of both models: calibrated, nominal, x,y,z,rx,ry,rz in the robot's units; own: each model has its own",
        "TOOL",
    )
    output: Path | None = option(None, f"Write {FILES[0]}, {FILES[1]} and {FILES[2]} here", "DIR", short="-o")
    force: w.Force = False
    base: w.Base = None
    tip: w.Tip = None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Compensated]:
    """Compensates targets; a folder gets FILES. Raises InputError."""
    from robocal.verbs.compensate.result import compensate_targets

    return run_verb(o, FILES, lambda: compensate_targets(o, command, watch), sections)


def sections(made: Outcome[Compensated]) -> Iterator[Section]:
    """Errors before and after, targets by status, and those that need a look."""
    found = made.result
    counts = ", ".join(f"{n} {word}" for word, n in found.counts.items() if n)
    first = Text.of((found.robot.name, "strong"), f"   {len(found.file.ids)} targets: {counts}")
    yield Section.of("", first, Detail(lambda: [_answer(found)]))
    labels = {
        "before": "not compensated",
        "after": "corrected joint values",
        "after_by_tcp": "corrected Cartesian targets",
    }
    stages = ((label, getattr(found.errors, name)) for name, label in labels.items())
    rows = [(label, *spread(s)) for label, s in stages if s is not None]
    errors = table("simulated error [mm]", *SPREAD, right=(1, 2, 3, 4, 5), rows=rows) if rows else None
    real, told = found.expected, None
    if real is not None:
        mean, worst = figure(real.mean, 3), figure(real.max, 3)
        told = Text.of(f"the real robot is expected within {mean} mm (95 %, mean of the targets; worst {worst} mm)")
    if errors is not None:
        yield Section.of("", errors, *quiet("if the calibrated model is the truth"), told)
    # What has no correction comes first.
    order = sorted((i for i, note in enumerate(found.notes) if note), key=lambda i: -int(found.compensation.status[i]))
    words, status = list(found.counts), found.compensation.status
    if order:
        named = [(found.file.ids[i], words[int(status[i])], str(found.notes[i])) for i in order[:MOST]]
        more = [f"and {len(order) - MOST} others in compensated.csv"] if len(order) > MOST else []
        yield Section.of("", table("target", "status", "", rows=named), *quiet(*more))
    yield from ends(written=made.written)


def _answer(found: Compensated) -> Facts:
    """What a page says first."""
    count, good = len(found.file.ids), int(found.compensation.reachable.sum())
    real, errors = found.expected, found.errors
    asked = f"what to command so that the robot meets {count} targets, while its controller keeps the nominal model"
    within = ""
    if errors.before is not None:
        within = f"uncorrected, the calibrated model misses them by {figure(errors.before.mean, 3)} mm in the mean"
    if real is not None:
        within += (
            f"{'; ' if within else ''}corrected, the real robot is expected within {figure(real.mean, 3)} mm (95 %)"
        )
    lost = "" if good == count else f"{count - good}, listed below; nothing is commanded there"
    after = "drive by the joint values of compensated.csv, or by its Cartesian targets where the controller takes nothing else"
    if not found.trusted:
        after = "do not drive by these values: see above"
    pairs = (
        ("Asked", asked), ("Found", f"a correction for {good} of {count}"), ("Errors", within), ("No correction", lost),
        ("Worth knowing", " ".join(map(full_text, found.remarks))), ("Next", after),
    )  # fmt: skip
    return Facts(tuple((name, words) for name, words in pairs if words))
