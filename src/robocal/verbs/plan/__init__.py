"""`plan`: which poses to measure, written as a joint program with the data file to be filled in."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from robocal._record import record, replace
from robocal.quantities import Listing
from robocal.report.sections import Detail, Section, Text, Written, ends, figure, listing_table, quiet, strong
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, arg, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.verbs.plan.result import PlanDocument, Planned

__all__ = ["Options", "run", "sections"]

FILES = ("poses.csv", "data.yaml", "data.csv", "plan.json", "plan.html")
BOX = "x0,y0,z0,x1,y1,z1"


@record
class Options(BaseOptions):
    """Choose which poses to measure, and how many are enough.

    Writes a joint program with short motions between poses, and the data file to fill in.

    \b
    robocal plan ur10 -n 25 -o plan
    robocal plan robot.yaml data.yaml --accuracy 0.2 --floor 0 -o plan
    robocal plan robot.yaml --after data.yaml -n 10 -o more
    """

    robot: w.Robot
    data: str | None = arg(
        None, "DATA", "A data file that describes the instrument; its measurements do not count (see --after)."
    )
    output: Path | None = option(None, "Write poses.csv, data.yaml, plan.json and plan.html here", "DIR", short="-o")
    count: int | None = option(
        None, "How many poses", "N", name="--poses", short="-n", least=1, most=500, otherwise="enough"
    )
    criterion: str = option("I", "I: mean error at test poses; G: the largest; D, A, E, O1 to O5", "NAME")
    accuracy: float | None = option(None, "Required mean error at test poses", "LENGTH", unit="length", above=0)
    after: tuple[str, ...] = option((), "Continue from these measurements: their information counts", "DATA")
    kind: w.Kind = "position"
    noise: w.Noise = None
    frame: w.Frame = "auto"
    candidates: int = option(
        5000, "How many candidates to draw in the region", "N", name="--draw", least=20, most=100_000
    )
    listed: str | None = option(
        None, "Choose from this list of poses (CSV with joint columns, data.yaml)", "FILE", name="--candidates"
    )
    tests: str | None = option(None, "Predict at these poses, not at a sample", "FILE")
    task: str | None = option(
        None, f"Predict for the tool point inside {BOX}; measure at any allowed pose", "BOX", unit="length", numbers=BOX
    )
    box: str | None = option(None, f"Measure only with the tool point inside {BOX}", "BOX", unit="length", numbers=BOX)
    floor: float | None = option(None, "Keep tool point and flange above this height over the base", "Z", unit="length")
    pedestal: str | None = option(
        None, "Keep both outside a cylinder of radius R up to height H around the base", numbers="R,H", unit="length"
    )
    distance: str | None = option(
        None, "Keep the target this far from the instrument", name="--range", numbers="MIN,MAX", unit="length"
    )
    cone: float | None = option(
        None, "Keep the target within this angle of the instrument's z axis", "ANGLE", unit="angle", above=0
    )
    facing: float | None = option(
        None, "Let the target's z axis point at the instrument within this angle", "ANGLE", unit="angle", above=0
    )
    seed: w.Seed = 0
    force: w.Force = False
    base: w.Base = None
    tip: w.Tip = None


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Planned]:
    """Plans and, given a folder, writes. Raises InputError."""
    from robocal.verbs.plan.result import make_plan

    return run_verb(o, FILES, lambda: make_plan(o, watch, command), sections)


def sections(made: Outcome[Planned]) -> Iterator[Section]:
    """Accuracy against the number of poses, and what to do next."""
    from robocal.report.plan import accuracy_forecast, places
    from robocal.verbs.plan.result import points

    found = made.result.document
    n = found.poses
    head = f"   {n} poses of {found.candidates} candidates, kind {found.kind}, criterion {found.criterion}"
    before = [f"{found.measured_before} poses were measured before and count"] if found.measured_before else []
    yield Section.of("", Text.of((found.robot, "strong"), head), *quiet(*before))
    counts = found.forecast["poses"].plain
    some = found.forecast.take([i for i, k in enumerate(counts) if k == n or (k and k % 5 == 0)])
    gain = ["" if v is None else f"-{figure(v, 2)}" for v in some["gain"].plain]
    forecast = replace(
        listing_table(
            Listing((*some.columns[:-1], replace(some["gain"], values=gain))), title="Foretold error [mm] at other poses",
            styles=["strong" if k == n else "" for k in some["poses"].plain],
        ),
        right=(0, 1, 2, 3, 4),
    )  # fmt: skip
    drawn = Detail(lambda: accuracy_forecast(found.forecast, n, found.accuracy.asked))
    yield Section.of(
        "", drawn, forecast, *quiet(*_near(found)), *map(strong, _enough(found)),
        title="How many poses", key="forecast",
    )  # fmt: skip
    yield Section.of("", Detail(lambda: places(points(made.result))), title="Where", key="places")
    yield from ends(made.remarks)
    if made.written:
        ready = next((p for p in made.written if p.name == "data.yaml"), None)
        words = (
            ready
            and f"next: measure, fill in {ready.with_suffix('.csv')}, then "
            f"robocal identify {quote(str(made.result.opened))} {quote(str(ready))}"
        )
        yield Section.of("", Written(made.written), Text.of(words) if words else None)


def _near(found: PlanDocument) -> Iterator[str]:
    """How far the forecast depends on the nominal model, and how far the choice is from the best."""
    low, high = min(found.perturbed_models.value), max(found.perturbed_models.value)
    yield f"at models that are off as far as expected: {figure(low)} to {figure(high)} mm"
    value, limit = found.selection.value, found.selection.limit
    if found.criterion == "I" and limit:
        more = 100 * ((value / limit) ** 0.5 - 1)
        # Fewer poses than unknowns leave the limit so far away that it says nothing.
        if more < 100:
            several = (
                f"no {found.poses} of these candidates are" if found.poses > 1 else "no other of these candidates is"
            )
            yield f"{several} better by more than {figure(more, 2)} %"


def _enough(found: PlanDocument) -> list[str]:
    """How many poses are enough, where that can be said."""
    enough, asked = found.enough, found.accuracy.asked
    if asked is not None:
        return [f"{enough} poses reach {figure(asked)} mm"] if enough else []
    return [f"{enough} poses are enough: five more gain less than 5 %" if enough else "more poses still help"]
