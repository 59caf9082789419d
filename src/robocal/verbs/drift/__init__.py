"""`drift`: two calibrations of one machine, some time apart; has it changed, and by how much? Or one beside the truth."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocal._record import record
from robocal.errors import ModelError
from robocal.remarks.remark import sentences
from robocal.report.sections import Cell, Section, Style, Text, ends, figure, quiet, table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.verbs.drift.result import DriftResult

__all__ = ["Options", "run", "sections"]

FILES = ("drift.json", "report.html")
Page = Callable[[Any, Sequence[Path]], Iterator[Section]]
TEN = 10
STYLES: dict[str, Style] = {"unchanged": "good", "possible": "doubtful", "drifted": "bad"}


@record
class Options(BaseOptions):
    """Compare two calibrations of one robot: has it changed, by how many millimetres, and in which parameters?

    Both runs must start from the same robot file. The instrument may stand elsewhere; with --new-tool, the tool may differ too.

    \b
    robocal drift march/run june/run
    robocal drift march/run june/run --matters 0.2mm
    robocal drift march/run june/run --new-tool --json
    robocal drift run sim/truth.yaml

    unchanged: the 95 % interval of the change lies below what matters; drifted: it lies above; possible: the runs do not decide.
    Runs of a cable robot are compared as `robocal cable drift` does, those of a machine without joints by their parameters.
    Beside the truth of a simulation, the errors of the identified parameters are listed by group, in mm, deg and their standard deviations.
    Exit status 0 when the runs could be compared, with any result; 3 when nothing follows from these runs.
    """

    first: Path = arg(..., "RUN1", "The earlier run folder.")
    second: Path = arg(
        ..., "RUN2", "The later run folder, identified from the same robot file; or truth.yaml of a simulation."
    )
    new_tool: bool = option(False, "The tool was mounted again and may differ")
    matters: str = option("0.1mm", "The change that matters, with its unit: mean over the measured poses", "LENGTH")
    history: w.History = None
    output: Path | None = option(
        None, "Write drift.json here; of a cable robot or beside a truth, a page too", "DIR", short="-o"
    )
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Any]:
    """Compares two run folders of one robot, or one with the truth; a folder gets drift.json, and of a truth or of cables a page.
    Raises InputError when they cannot be compared."""
    from robocal.files.opened_file import machine_kind
    from robocal.files.runfolder import ROBOTS

    if o.second.is_file():
        from robocal.verbs.drift.truth_errors import compare_with_truth

        _refuse(o, ("new_tool", "matters", "history"), "this is for two runs", "nothing, beside a truth")
        return run_verb(o, FILES, lambda: compare_with_truth(o.first, o.second, command), sections)
    if machine_kind(o.first / ROBOTS[0]) == "cable":  # as `cable drift` of two runs
        from robocal.session.cable.drift import drifts

        _refuse(o, ("new_tool", "matters"), "this option is for arms", "nothing, for a cable robot")
        return run_verb(o, FILES, lambda: drifts((str(o.first), str(o.second)), False, False, command), sections)
    return run_verb(o, FILES[:1], lambda: _machines(o, watch, command))


def _machines(o: Options, watch: Watch | None, command: str) -> DriftResult:
    from robocal.files.units import parse_quantity
    from robocal.session.inputs import open_calibration
    from robocal.verbs.drift.result import compare_runs, has_places

    matters = parse_quantity(o.matters, "m", key="--matters")
    if watch:
        watch({"stage": "read"})
    pair = (open_calibration(o.first), open_calibration(o.second))
    opened = pair[0].opened
    if opened.arm is None:
        _refuse(o, ("new_tool",), "this option is for arms", f"nothing, for a {opened.noun}")
    if not has_places(opened.machine):
        _refuse(o, ("matters",), "this option is for machines with joints", f"nothing, for a {opened.noun}")
    return compare_runs(pair, o.new_tool, matters, command)


def _refuse(o: Options, names: tuple[str, ...], message: str, expected: str) -> None:
    """Raises ModelError for options that mean nothing here."""
    for name in names:
        if o.departs(name):
            key = "--" + name.replace("_", "-")
            raise ModelError(message, key=key, found=str(getattr(o, name)), expected=expected)


def sections(made: Outcome[Any]) -> Iterator[Section]:
    """What two runs, or a run and the truth, come to."""
    from robocal.report.cable.drift import drift_sections
    from robocal.session.cable.drift import Drifts
    from robocal.verbs.drift.truth_errors import TruthComparison, truth_sections

    pages: dict[type, Page] = {Drifts: drift_sections, TruthComparison: truth_sections}
    yield from pages.get(type(made.result), _run_sections)(made.result, made.written)


def _run_sections(found: DriftResult, written: Sequence[Path]) -> Iterator[Section]:
    """The verdict, how far predictions are apart, and the parameters that changed most."""
    apart = found.difference
    words: list[Cell] = [(found.status.upper(), STYLES[found.status])]
    if apart is not None and not found.void:
        size = f"change {figure(apart.change, 2)} mm, 95 %: {figure(apart.low, 2)} to {figure(apart.high, 2)} mm"
        words += ["   ", (size, "strong")]
    yield Section.of(
        "",
        Text.of((found.robot.name, "strong"), f"   {found.runs[0].folder} and {found.runs[1].folder}"),
        Text.of(*words),
        *(Text.of(reason, indent=2) for reason in sentences(found.why)),
    )
    changes = sorted(found.changes, key=lambda c: c.p_value)
    rows: list[tuple[Cell, ...]] = []
    for c in changes[:TEN]:
        numbers = (figure(c.first, 6), figure(c.second, 6), f"{c.change:+.4g}", figure(1.96 * c.sigma, 2))
        rows.append((c.name, *numbers, c.unit, f"{c.p_value:.1g}", f"{c.p_of_all:.1g}"))
    styles: list[Style] = ["" if c.p_of_all < 0.05 else "quiet" for c in changes[:TEN]]
    columns = ("parameter", "first", "second", "change", "± 95 %", "unit", "chance", "of all")
    lines = [f"... and {len(changes) - TEN} more in --json"] if len(changes) > TEN else []
    lines.append("chance: of such a change by noise alone; of all: after looking at every parameter")
    yield Section.of("", table(*columns, right=(1, 2, 3, 4, 6, 7), rows=rows, styles=styles), *quiet(*lines))
    yield from ends(found.remarks, written)
