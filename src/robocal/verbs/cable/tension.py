"""`cable tension`: tensions that hold the platform at given poses, or the wrench that is missing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from robocal.cables.choice import METHOD, POWER
from robocal.report.sections import Section, Text, Written, figure, table
from robocal.verbs import words as w
from robocal.verbs.option import Told, opt
from robocal.verbs.outcome import Outcome, Watch

__all__ = ["Options", "details", "run", "sections"]

FILES = ("tensions.csv", "tension.json", "report.html")


@dataclass(frozen=True)
class Options(Told):
    """Tensions that hold the platform at poses, their margins, and the wrench that is missing where none do.

    Exit status 3 when a pose is not held. The list that it writes goes into cable inverse and cable forward as it is.

    \b
    robocal cable tension robot.yaml poses.csv -o held
    robocal cable tension robot.yaml poses.csv --method barycentre --payload 5
    """

    robot: w.CableRobot
    poses: w.PlatformPoses
    method: w.TensionMethod = METHOD
    power: float | None = opt(None, "Of --method p-norm, from 2 on", metavar="P", otherwise=f"{POWER:g}")
    mass: w.PlatformMass = None
    payload: w.Payload = 0.0
    wrench: str | None = opt(
        None,
        "Acts on the platform at its origin, base axes: the robot file's unit of force, and Nm",
        metavar="FX,FY,FZ,MX,MY,MZ",
    )
    limits: w.TensionLimits = None
    length: w.MomentLength = None
    output: Path | None = opt(None, f"Write {', '.join(FILES[:-1])} and {FILES[-1]} here", short="-o", metavar="DIR")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome:
    """Tensions with what they hold, margins and missing wrenches; a folder gets FILES. Raises InputError."""
    from robocal.cables.statics import gravity_wrench
    from robocal.cables.tension import capacity_margin, distribute
    from robocal.errors import ModelError
    from robocal.files.cable.lists import read_platform_poses
    from robocal.files.cable.robot import read_cable
    from robocal.files.plain import json_text
    from robocal.files.text import InputFile
    from robocal.files.writing import refuse_existing, write_files
    from robocal.jobs.cable.load import held_robot, mass_of, robot_input, said_of, wrench_of
    from robocal.jobs.cable.tension import Tensions, bare, doubts, leaning, listed, structures
    from robocal.report.page import page

    refuse_existing(o.output, FILES, o.force)
    file = read_cable(o.robot)
    si = o.si(file.units)
    able, weight, lever = held_robot(file, si.limits), mass_of(file, si.payload, si.mass), si.length or 1.0
    rows = read_platform_poses(o.poses, able)
    structure = structures(able, rows, o.poses)
    extra = wrench_of(file, o.wrench) + (0.0 if rows.wrench is None else rows.wrench)
    load = (gravity_wrench(rows.values, weight, able.com) + extra)[:, able.axes]
    exponent = POWER if o.power is None else o.power
    with said_of({"method": "--method", "power": "--power"}):
        spread = distribute(structure, load, able.need("limits"), o.method, exponent)
        if o.power is not None and o.method != "p-norm":
            raise ModelError("a power is of the p-norm alone", key="power", found=o.power, expected="--method p-norm")
    margin = capacity_margin(structure, load, able.need("limits"), lever)
    missing = spread.missing(lever)
    made = Tensions(
        able, rows.names, rows.values, spread, margin, missing, exponent, lever, weight,
        listed(able, rows, spread, margin, missing, file),
        (*file.warnings, *rows.warnings, *leaning(able, rows), *bare(able, rows.names, spread, margin)),
        doubts(able, rows.names, spread, missing),
        (robot_input(file, o.robot), InputFile(Path(o.poses), rows.sha256)), command,
    )  # fmt: skip
    outcome = Outcome(made, lambda: made.document, not made.doubts, (*made.warnings, *made.doubts), made.text)
    if o.output is None:
        return outcome.kept(())
    shown = page(f"{able.name}: tensions", (*sections(outcome), *details(outcome)), kind="Cable robot")
    texts = dict(zip(FILES, (made.text, json_text(made.document), shown), strict=True))
    return outcome.kept(write_files(o.output, texts))


def details(made: Outcome) -> Iterator[Section]:
    """Pictures, every pose, how it was worked out."""
    from robocal.jobs.cable.tension_page import tension_details

    yield from tension_details(made.result)


def sections(made: Outcome) -> Iterator[Section]:
    """How many poses are held, what each cable bears, and the pose with the least to spare."""
    found = made.result
    spread, names = found.spread, found.names
    head = f"   {int(spread.feasible.sum())} of {len(names)} poses are held, method {spread.method}, {figure(found.mass)} kg"
    yield Section.of("", Text.of((found.robot.name, "strong"), head))
    if spread.found.any():
        rows = (
            (cable, *(figure(float(v)) for v in (t.min(), t.mean(), t.max())), f"{low:g} to {high:g}")
            for cable, t, (low, high) in zip(
                found.robot.cables, spread.tension[spread.found].T, spread.limits, strict=True
            )
        )
        columns = ("tension [N]", "least", "mean", "greatest", "limits")
        yield Section.of("", table(*columns, right=(1, 2, 3, 4), rows=rows))
    if names:
        worst = int(found.margin.argmin())
        least = f"the least margin is {figure(float(found.margin[worst]))} N, at {names[worst]}"
        yield Section.of("", Text.of(least), Written(made.written))
