"""`drive simulate`: a simulated motor is swept, identified, compensated and tested on a ramp."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.session.drive.motor_trial import MotorTrial

__all__ = ["Options", "details", "run", "sections"]

FILES = ("simulate.json", "sweep.csv", "sweep.yaml", "truth.csv", "ramp.csv", "report.html")
SPEC = Arg("SPEC", "motor.yaml of a motor to be simulated: what it truly is, its sweep and its ramp.")


@record
class Options(BaseOptions):
    """Simulate the whole procedure on a motor: a slow sweep, identification of the cogging, compensation, and a test on a ramp.

    The sweep is driven by a proportional controller, in both directions. The ramp is followed by PID controllers, without compensation,
    with it, and with a table without its mean. The log is a file that `drive identify` reads.

    \b
    robocal drive simulate examples/cogging/motor.yaml -o run
    robocal drive simulate examples/cogging/motor.yaml --gain 0.4     a gain from which the rotor escapes

    Exit status 3 when the compensation makes the ramp worse, or the identification is not trusted.
    """

    spec: Annotated[Path, SPEC]
    gain: float | None = option(
        None, "Proportional gain of the sweep", "GAIN", unit="N m/rad", above=0, otherwise="the first of the file"
    )
    seed: int = option(0, "Seed of the noise", "N", least=0)
    output: Path | None = option(None, f"Write {', '.join(FILES[:-1])} and {FILES[-1]} here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[MotorTrial]:
    """Simulates the procedure; a folder gets the document, the log, the truth, the ramps and a page. Raises InputError."""
    from robocal.session.drive.motor_trial import simulate_procedure

    return run_verb(o, FILES, lambda: simulate_procedure(o, watch, command), sections, details)


def sections(made: Outcome[MotorTrial]) -> Iterator[Section]:
    """The error of the curve, and what the compensation divides errors and effort by."""
    from robocal.report.drive_trial import trial_summary

    yield from trial_summary(made.result, made.written)
