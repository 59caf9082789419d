"""`cable rezero`: zeros of the length sensors after power-up, at known poses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from robocal._record import record
from robocal.report.sections import Section, Text, ends, listing_table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.session.cable.power_up_zeros import Rezeroed

__all__ = ["Options", "run", "sections"]


@record
class Options(BaseOptions):
    """Zeros of the length sensors after power-up, from what they show at known poses; everything else stays as it was identified.

    The result is the robot's file with these zeros, which every verb reads. Several poses show whether they agree.

    Exit status 3 where the zeros of single poses differ by more than --sigma allows.

    \b
    robocal cable rezero run lengths.csv --at 0,0,1500 -o today.yaml
    robocal cable rezero run lengths.csv --poses chosen.csv --sigma 0.5 -o today.yaml
    """

    robot: w.CableRobot
    lengths: str = arg(..., "LENGTHS", "CSV: what the sensors show, one column per cable, such as c1 [mm].")
    at: str | None = option(None, "Where the platform stood: X,Y,Z or X,Y,Z,RX,RY,RZ in the robot file's units", "POSE")
    poses: str | None = option(None, "CSV of poses in which the ids of LENGTHS stand", "FILE")
    sigma: float | None = option(None, "Standard deviation of a length", "SIGMA", unit="length", above=0, wrong=w.NOISE)
    tension: w.CableTension = None
    output: w.OutputFile = None
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Rezeroed]:
    """The robot's file with other zeros. Raises InputError."""
    from robocal.session.cable.power_up_zeros import find_zeros

    return run_verb(o, (), lambda: find_zeros(o, command))


def sections(made: Outcome[Rezeroed]) -> Iterator[Section]:
    """The zeros, cable by cable, and where the file is."""
    from robocal.files.display import in_units

    found = made.result
    count = len(found.each)
    head = f"   zeros from {count} pose{'' if count == 1 else 's'}"
    yield Section.of(
        "", Text.of((found.robot.name, "strong"), head), listing_table(in_units(found.zeros, found.file.units))
    )
    yield from ends(made.remarks, made.written)
