"""`cable poses`: a list of poses that can be reached and left again, the program for it, and the poses worth measuring."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from robocal._record import record
from robocal.cables.tension_choice import METHOD
from robocal.report.sections import Block, Detail, Section, Text, ends, figure, quiet, table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.session.cable.pose_list_result import Listed

__all__ = ["Options", "details", "run", "sections"]

DATA = ("lengths.yaml", "lengths.csv", "poses.yaml", "measured.csv")  # as `files.cable.data_templates` calls them
FILES = ("poses.csv", "program.csv", "chosen.csv", *DATA, "list.json", "report.html")


@record
class Options(BaseOptions):
    """Poses that the platform can reach and leave again: with feasible tensions on the whole path, and without contact of a cable.

    With --choose the folder also gets lengths.yaml and poses.yaml with their tables, to fill in what is measured at the chosen poses.

    \b
    robocal cable poses robot.yaml -n 500 --choose 20 -o list
    robocal cable poses robot.yaml --start best --mu 0.8
    """

    robot: w.CableRobot
    count: int = option(200, "Poses to list", "N", name="--poses", short="-n", least=1, most=10_000)
    margin: float = option(0.95, "Used fraction of each free path", "MU", name="--mu", above=0, most=1)
    start: str = option(
        "mean", "X_0: mean of the frame anchors, best of a grid, or X,Y,Z[,RX,RY,RZ] in the robot file's units", "START"
    )
    box: str | None = option(
        None, "The box Z of random poses, in place of the box in which the frame can hold the platform",
        numbers="X0,Y0,Z0,X1,Y1,Z1", unit="length",
    )  # fmt: skip
    scale: float = option(1.1, "Z, as a multiple of the machine", "S", least=0, most=1000)
    turn: float | None = option(None, "Turns in Z, about each axis", "ANGLE", unit="angle", otherwise="30 deg")
    diameter: w.Diameter = None
    body: w.PlatformBody = "hull"
    relief: w.Relief = None
    payload: w.Payload = 0.0
    mass: w.PlatformMass = None
    limits: w.TensionLimits = None
    method: w.TensionMethod = METHOD
    steps: int = option(10, "Waypoints on each path", "K", least=1, most=1000)
    wanted: int | None = option(None, "Choose the N poses that are best for calibration", "N", name="--choose")
    criterion: str = option("A", "For --choose: A (least rms), D, I, G, E, O1 to O5", "C")
    sigma: float | None = option(
        None, "For --choose: standard deviation of a length", "SIGMA", unit="length", above=0, wrong=w.NOISE,
        otherwise="1 mm, converted",
    )  # fmt: skip
    pose_noise: str | None = option(
        None, "For --choose: standard deviation per axis of a measured pose",
        numbers="POSITION,ORIENTATION", unit="length,angle",
    )  # fmt: skip
    encoders_only: bool = option(False, "For --choose: no instrument measures poses")
    seed: w.Seed = 0
    output: Path | None = option(
        None,
        "Write poses.csv, program.csv, list.json and report.html here; with --choose chosen.csv, and data files to fill in",
        "DIR",
        short="-o",
    )
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Listed]:
    """Lists poses and chooses some of them; a folder gets FILES. Raises InputError."""
    from robocal.session.cable.pose_list_result import make_list

    return run_verb(o, FILES, lambda: make_list(o, watch or (lambda event: None), command), sections, details)


def details(made: Outcome[Listed]) -> Iterator[Section]:
    """Pictures, every pose, how it was worked out."""
    from robocal.verbs.cable.poses.page import poses_details

    yield from poses_details(made.result)


def sections(made: Outcome[Listed]) -> Iterator[Section]:
    """What stopped the motions, where they start, and what the choice is worth."""
    from robocal.session.cable.pose_list_result import STOPPED_BY

    found = made.result
    n, robot, (k, l) = len(found.names), found.robot, found.start.nearest
    head = f"   {n} poses, {found.reached}, each motion used to {100 * found.margin:g} % (mu)"
    near: tuple[Text, ...] = ()
    if k >= 0:
        gap, names = found.length_unit.short(found.start.gap), f"{robot.cables[k]} and {robot.cables[l]}"
        near = quiet(
            f"at the start (X_0) {names} pass with {gap} between them; capacity margin {figure(found.start.margin)} N"
        )
    why = quiet(found.why_short) if found.why_short else ()
    yield Section.of("", Text.of((robot.name, "strong"), head), *why, *near, Detail(lambda: _answer(made)))
    rows = ((STOPPED_BY[name], str(count), figure(100 * count / n, 3)) for name, count in found.limits.items())
    yield Section.of("", table("motions ended by", "motions", "share [%]", right=(1, 2), rows=rows))
    if found.choice is not None:
        yield _chosen(found.choice, n)
    yield from ends(written=made.written)
    if made.written and found.choice is not None:
        folder, file = made.written[0].parent, quote(str(found.file.path))
        data = [quote(str(p)) for p in sorted(made.written) if p.name in DATA and p.suffix == ".yaml"]
        tables = " and ".join(p.name for p in sorted(made.written) if p.name in DATA and p.suffix == ".csv")
        step = f"next: measure at {folder / 'chosen.csv'}, fill in {tables}, then robocal check {file} {' '.join(data)}"
        yield Section.of("", Text.of(step))


def _answer(made: Outcome[Listed]) -> Iterator[Block]:
    """What a page says first."""
    from robocal.verbs.cable.poses.page import poses_answer

    yield poses_answer(made.result)


def _noise_text(noise: Any) -> str:
    """How the poses are known."""
    if not noise.measured:
        return ", no instrument measures poses: what they leave open is held"
    if not (noise.position or noise.orientation):
        return ", poses as if measured exactly"
    return f", poses measured to {figure(1e3 * noise.position)} mm and {figure(57.29577951308232 * noise.orientation)} deg per axis"


def _chosen(choice: Any, n: int) -> Section:
    """What the chosen poses are expected to tell, beside as many at random and all."""
    from robocal.session.cable.pose_list_result import EXPECTED_OF

    count = len(choice.chosen)
    rows = (
        (EXPECTED_OF[what], *(figure(1e3 * choice.expected[who][what]) for who in ("chosen", "random", "all")))
        for what in choice.expected["chosen"]
    )
    columns = ("expected rms [mm]", f"{count} chosen", f"{count} at random", f"all {n}")
    lines = []
    if choice.criterion == "A" and choice.limit:
        more = 100 * ((choice.design.value / choice.limit) ** 0.5 - 1)
        several = f"no {count} of these poses are" if count > 1 else "no other of these poses is"
        lines.append(f"{several} better by more than {figure(more, 2)} %")
    lines.append(f"from lengths with {figure(1e3 * choice.noise.length)} mm of noise{_noise_text(choice.noise)}")
    return Section.of("", table(*columns, right=(1, 2, 3), rows=rows), *quiet(*lines))
