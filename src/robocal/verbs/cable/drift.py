"""`cable drift`: calibrations of one cable robot side by side; which anchor moved, and what nobody could see."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.session.cable.drift import Drifts

__all__ = ["Options", "run", "sections"]

FILES = ("drift.json", "report.html")
RUNS = Arg("RUNS...", "Run folders of one robot, the earliest first; robot files give only the scatter.")


@record
class Options(BaseOptions):
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
    zeros_unchanged: bool = option(False, "The sensors counted on between the runs: their zeros are the same")
    base_moves: bool = option(
        False, "The coordinates may differ by a motion: another instrument, or another place of it"
    )
    history: w.History = None
    output: Path | None = option(None, f"Write {FILES[0]} and {FILES[1]} here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Drifts]:
    """Compares calibrations; a folder gets drift.json and a page. Raises InputError."""
    from robocal.session.cable.drift import drifts

    return run_verb(o, FILES, lambda: drifts(o.runs, o.zeros_unchanged, o.base_moves, command), sections)


def sections(made: Outcome[Drifts]) -> Iterator[Section]:
    """What moved, cable by cable, and how all of them scatter."""
    from robocal.report.cable.drift import drift_sections

    yield from drift_sections(made.result, made.written)
