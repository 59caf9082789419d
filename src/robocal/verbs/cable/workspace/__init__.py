"""`cable workspace`: where a cable robot can hold everything that is demanded, by a grid and by rays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocal._record import record
from robocal.report.sections import Detail, Facts, Section, Text, ends, figure, table
from robocal.verbs import shared_options as w
from robocal.verbs.option import BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, details, run_verb

if TYPE_CHECKING:
    from robocal.cables.workspace import Demand
    from robocal.files.units import Unit
    from robocal.session.cable.workspace_result import Shape, Spot, Workspace, WorkspaceDocument

__all__ = ["Options", "details", "run", "sections"]

FILES = ("workspace.json", "workspace.csv", "outlines.csv", "report.html")
SQUARED = {"m3": "m³", "m2": "m²"}
MESHES = ("surface.ply", "surface.stl")  # of a spatial robot


@record
class Options(BaseOptions):
    """The workspace of the platform: volume by a grid and by rays to the exact boundary, margins, dexterity, sections, a mesh.

    Exit status 3 when it can be held nowhere.

    \b
    robocal cable workspace robot.yaml -o workspace
    robocal cable workspace robot.yaml --payload 0,20 --tilt 10 --acceleration 2
    """

    robot: w.CableRobot
    orientation: tuple[str, ...] = option(
        (), "A rotation vector; repeat for several, all of which must be held", numbers="RX,RY,RZ", unit="angle", otherwise="upright",
    )  # fmt: skip
    tilt: float | None = option(
        None, "Hold tilts too: half the angle and all of it, about 8 horizontal axes", "ANGLE", unit="angle"
    )
    payload: str | None = option(
        None, "Payload at the centre of mass, one number or a range, for example 0,20", "LO,HI", unit="mass"
    )
    mass: str | None = option(
        None, "Of the platform, one number or a range, instead of the file's", "LO,HI", unit="mass"
    )
    wrench: tuple[str, ...] = option(
        (),
        "Acts beside the weight at the platform's origin, base axes: the robot file's unit of force, and Nm; repeat for "
        "several, all of which are to be held, with 0,0,0,0,0,0 for none",
        "FX,FY,FZ,MX,MY,MZ",
    )
    acceleration: float = option(0.0, "Of the centre of mass, in any direction", "A", unit="m/s2", least=0)
    reserve: float = option(0.0, "A disturbance in any direction that is held on top", "F", unit="force", least=0)
    closure: bool = option(False, "Any wrench, by tensions of any size (wrench closure): no mass, no limits, no weight")
    limits: w.TensionLimits = None
    length: w.MomentLength = None
    box: str | None = option(
        None, "Search box", numbers="X0,Y0,Z0,X1,Y1,Z1", unit="length", otherwise="the reach of the frame"
    )
    cells: int = option(41, "Cells of the grid along each axis", "N", least=2, most=300)
    rays: int = option(4000, "Number of rays to the exact boundary", "N", least=20, most=200_000)
    start: str | None = option(
        None, "Start of the rays", numbers="X,Y,Z", unit="length",
        otherwise="the mean of the frame anchors, or the middle of the workspace",
    )  # fmt: skip
    output: Path | None = option(
        None, f"Write {', '.join((*FILES[:-1], *MESHES))} and {FILES[-1]} here", "DIR", short="-o"
    )
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[Workspace]:
    """The workspace for what is demanded; a folder gets FILES, and MESHES of a spatial robot. Raises InputError."""
    from robocal.verbs.cable.workspace.compute import workspace

    return run_verb(o, (*FILES[:-1], *MESHES, FILES[-1]), lambda: workspace(o, command, watch), sections, details)


def sections(made: Outcome[Workspace]) -> Iterator[Section]:
    """How large it is by either way, where, and what is to spare there, in the robot file's units."""
    result, found = made.result, made.result.document
    length, force = result.file.units.length, result.file.units.force
    grid, rays, home = found.grid, found.rays, found.home
    unit = result.unit

    def at(point: Sequence[float]) -> str:
        return ", ".join(f"{round(length.from_si(float(v)), 9) + 0.0:.4g}" for v in point)

    def span(sides: Any) -> str:
        return "   ".join(f"{a} {at([low])} to {at([high])}" for a, (low, high) in zip("xyz", sides, strict=True))

    first = Text.of((result.robot.name, "strong"), f"   {_demand_text(result.demand)}")
    yield Section.of("", first, Detail(lambda: [_answer(made)]))
    counts = " x ".join(str(n) for n in grid.cells if n > 1)
    rows = [("grid", figure(grid.size.value), f"{counts} cells, {100 * grid.share_of_box:.1f} % of the box")]
    if rays is not None:
        start = f"{rays.count} rays from {at(rays.start.value)} {length.name} ({rays.why})"
        if rays.difference is not None:
            start += f", {100 * rays.difference:+.2f} %"
        rows.append(("rays", figure(rays.size.value), start))
    yield Section.of("", table("volume" if unit == "m3" else "area", SQUARED[unit], "", right=(1,), rows=rows))
    pairs = [("box", f"{span(result.box)} {length.name}  ({result.how})")]
    if found.extent is not None and found.centre is not None and found.best is not None:
        cut = f"; cut off by the box where {result.cut_text}" if result.cut else ""
        name, value = _best(found.best, force)
        pairs += [
            ("held", f"{span(found.extent.value)} {length.name}, centre {at(found.centre.value)}{cut}"),
            *_spares(found, force),
            *_even(found, length, max(result.robot.axes) > 2),
            (name, f"{value} at {at(found.best.position.value)} {length.name}"),
        ]
    held = "held" if home.held else "not held"
    pairs.append((f"the mean of the frame anchors (X_0), {at(home.position.value)} {length.name}", held))
    yield Section.of("", Facts(tuple(pairs)))
    yield from ends(made.remarks, made.written)


def _answer(made: Outcome[Workspace]) -> Detail:
    """What a page says first."""
    result, found = made.result, made.result.document
    length, force, unit = result.file.units.length, result.file.units.force, result.unit
    asked = f"where the platform can be held: {_demand_text(result.demand)}"
    what = "nowhere in the box"
    if (extent := found.extent) is not None:
        ends = zip("xyz", extent.value, strict=True)
        span = ", ".join(f"{a} {length.from_si(lo):.4g} to {length.from_si(hi):.4g}" for a, (lo, hi) in ends if hi > lo)
        size = found.grid.size.value if found.rays is None else found.rays.size.value
        what = f"{figure(size)} {SQUARED[unit]}: {span} {length.name}"
    cut = f"where {result.cut_text} the search ended, not the strength of the cables" if result.cut else ""
    spare = (
        ""
        if found.best is None
        else " ".join(_best(found.best, force)) + "; at the border 0, which is what a border is"
    )
    after = f"robocal cable poses {result.place} -n 500 --choose 20 -o list (poses to calibrate with)"
    told = (("Asked", asked), ("Found", what), ("Cut off", cut), ("To spare", spare), ("Next", after))
    return result.answer(*told)


def _spares(found: Shape, force: Unit) -> Iterator[tuple[str, str]]:
    """Margins and possible accelerations of the held cells."""
    for spread, title, unit in ((found.margin, "margin", force), (found.acceleration, "possible acceleration", None)):
        if spread is not None and spread.greatest < float("inf"):
            values = (spread.least, spread.greatest, spread.median)
            least, greatest, median = (figure(v if unit is None else unit.from_si(v), 3) for v in values)
            yield title, f"{least} to {greatest} {'m/s2' if unit is None else unit.name}, median {median}"


def _even(found: WorkspaceDocument, length: Unit, turns: bool) -> Iterator[tuple[str, str]]:
    """Tension factors and condition numbers of the held cells."""
    factor, condition, closed = found.tension_factor, found.condition, found.closed_share
    if factor is None or condition is None or closed is None:
        return
    if closed > 0:
        spread = f"{figure(factor.least, 3)} to {figure(factor.greatest, 3)}, median {figure(factor.median, 3)}"
        some = "" if closed == 1 else f"; {100 * closed:.3g} % of the held cells are wrench-closed"
        yield "tension factor", f"{spread}{some}"
    else:
        yield "tension factor", "0, no held cell is wrench-closed: weight keeps the cables taut"
    if condition.least < float("inf"):
        most = figure(condition.greatest, 3) if condition.greatest < float("inf") else "infinite"
        over = f" (moments over {length.from_si(found.demand['length'].value):.4g} {length.name})" if turns else ""
        yield "condition number", f"{figure(condition.least, 3)} to {most}, median {figure(condition.median, 3)}{over}"


def _best(best: Spot, force: Unit) -> tuple[str, str]:
    if best.margin is None:
        return "greatest tension factor", figure(best.tension_factor, 3)
    return "greatest margin", f"{figure(force.from_si(best.margin.value))} {force.name}"


def _demand_text(demand: Demand) -> str:
    turns, many = len(demand.rotations), len(demand.extra)
    turned = "one orientation" if turns == 1 else f"{turns} orientations"
    if demand.closure:
        return f"any wrench (closure), {turned}"
    words = [" and ".join(f"{m:.4g}" for m in demand.masses) + " kg", turned]
    if many > 1 or demand.extra.any():
        words.append(f"{many} wrench{'es' if many > 1 else ''}")
    if demand.acceleration > 0:
        words.append(f"{demand.acceleration:.3g} m/s2")
    if demand.reserve > 0:
        words.append(f"{demand.reserve:.3g} N in reserve")
    return ", ".join(words)
