"""The page of a workspace: the robot at the start of the rays, the boundary, sections with margins, numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal._types import Array
from robocal.cables.boundary import Outline, Surface
from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.cables.workspace import Demand, Grid, grid
from robocal.geometry import se3, so3
from robocal.report.cable.length_unit import LengthUnit
from robocal.report.cable.part import part
from robocal.report.cable.plane_sections import section
from robocal.report.cable.scene import scene
from robocal.report.numbers import significant
from robocal.report.sections import Section
from robocal.session.cable.statics_options import limits_text
from robocal.session.cable.workspace_result import Workspace

__all__ = ["workspace_details"]

MOST = 20  # orientations that are listed


def workspace_details(made: Workspace) -> Iterator[Section]:
    """What a page has room for: the robot, sections with margins, what was demanded, how it was worked out."""
    robot, demand, ruler = made.robot, made.demand, made.length_unit
    yield part("What belongs to it", _explanation(made))
    if made.boundary is not None:
        yield _picture(robot, demand, made.boundary, ruler)
    for name, line in made.sections.items():
        axes = ("xyz".index(name[0]), "xyz".index(name[1]))
        across = 3 - sum(axes)
        level = ruler.text(float(line.start[across]))
        where = f" at {'xyz'[across]} = {level} {ruler.name}" if len(made.sections) > 1 else ""
        text = (
            f"{'Tension factors' if demand.closure else 'Margins'} in the plane {name} through the start of the rays; the line is the "
            f"exact boundary seen from there. Area within it: {significant(line.area, 4)} m²{where}."
        )
        drawn = section(robot, [line], _sheet(made, line.start, axes), axes, ruler=ruler, closure=demand.closure)
        yield part(f"Section {name}", text, drawn)
    if not made.sections and not demand.closure:
        text = "Nothing is held: colours say by how much, at least, the cables fail. The middle layer of the grid."
        axes = (robot.axes[0], robot.axes[1])
        yield part("The grid", text, section(robot, [], made.grid, axes, ruler=ruler))
    yield part("What was demanded", _words(demand, ruler), table=_demand_rows(demand))
    model = "Straight cables" + ("" if robot.pulleys is None else " over pulleys")
    limits = "" if demand.closure else f"; limits {limits_text(robot.need('limits'))}"
    yield made.method_part(f"{model}, what they weigh left out{limits}.")


def _explanation(made: Workspace) -> str:
    text = (
        "A position of the platform's origin belongs to the workspace when cables that pull, as strongly as it takes, balance any wrench."
        if made.demand.closure
        else "A position of the platform's origin belongs to the workspace when tensions within the limits balance everything demanded."
    )
    where = [f"{side[0]} is {'least' if side[1] == '-' else 'greatest'}" for side in made.cut]
    return text + (f" It is cut off by the box where {', '.join(where)}." if where else "")


def _picture(robot: CableRobot, demand: Demand, boundary: Surface | Outline, ruler: LengthUnit) -> Section:
    """The robot where the rays start, with the least tensions for the first orientation and wrench and the greatest mass."""
    pose, heading = se3.compose(demand.rotations[0], boundary.start), "The robot and its workspace"
    place = f"The platform where the rays start, {ruler.point(boundary.start)}"
    turn = "" if isinstance(boundary, Outline) else " Drag to turn."
    if demand.closure:
        return part(heading, f"{place}.{turn}", scene(robot, pose, surface=boundary, ruler=ruler))
    mass = float(demand.masses.max())
    wrench = gravity_wrench(pose[None], mass, robot.com, demand.gravity) + demand.extra[:1]
    pull = distribute(structure_of(robot, pose[None]), wrench[:, list(robot.axes)], robot.need("limits")).tension[0]
    text = f"{place}, with {significant(mass, 4)} kg: the least tensions that hold it.{turn}"
    return part(heading, text, scene(robot, pose, tension=pull, surface=boundary, ruler=ruler))


def _words(demand: Demand, ruler: LengthUnit) -> str:
    if demand.closure:
        return "Any wrench at all, in each orientation: neither weight nor tension limits take part."
    text = (
        "Each orientation with each mass and each wrench beside the weight; for a range of masses its ends are enough."
    )
    if demand.acceleration > 0:
        much = significant(demand.acceleration, 4)
        text += f" The centre of mass may accelerate at {much} m/s² in any direction, without turning."
    if demand.reserve > 0:
        much, lever = significant(demand.reserve, 4), ruler.short(demand.length)
        text += f" A disturbance of {much} N in any direction (moments over {lever}) is held on top."
    return text


def _demand_rows(demand: Demand) -> list[list[str]]:
    turns = np.degrees(so3.log(demand.rotations))
    rows = [["Orientations", "; ".join(_angles(v) for v in turns[:MOST]) + ("; ..." if len(turns) > MOST else "")]]
    if not demand.closure:
        rows.insert(0, ["Masses", ", ".join(f"{significant(float(m), 4)} kg" for m in demand.masses)])
        wrenches = (", ".join(f"{v:g}" for v in row) for row in demand.extra)
        rows.append(["Wrenches", "; ".join(wrenches) + " (N, Nm)"])
    return [["", ""], *rows]


def _angles(vector: Array) -> str:
    return "upright" if not np.abs(vector).max() > 1e-9 else ", ".join(f"{v:.3g}" for v in vector) + " deg"


def _sheet(made: Workspace, start: Array, axes: tuple[int, int]) -> Grid:
    """Margins in a plane through the start, over the box without thickness."""
    sides, counts, across = made.box.copy(), [max(n, 61) for n in made.grid.inside.shape], 3 - sum(axes)
    sides[across], counts[across] = start[across], 1
    return grid(made.robot, made.demand, sides, (counts[0], counts[1], counts[2]), with_margins=True)
