"""The page of a workspace: the robot at the start of the rays, the boundary, sections with margins, numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.cables.boundary import Outline, Surface
from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.cables.workspace import Demand, Grid
from robocal.geometry import se3, so3
from robocal.jobs.cable.document import how_made, limits_text
from robocal.jobs.cable.workspace_result import Workspace
from robocal.jobs.plain import plain
from robocal.report.cable.page import Block, page
from robocal.report.cable.scene import scene
from robocal.report.cable.sections import section
from robocal.report.numbers import fixed, significant

__all__ = ["workspace_page"]

Array = NDArray[np.float64]
MOST = 20  # orientations that are listed


def workspace_page(made: Workspace, sheets: Mapping[str, Grid]) -> str:
    """The page of a workspace; `sheets` are grids with margins in the planes of its sections, by their names."""
    robot, demand, document = made.robot, made.demand, plain(made.document)
    blocks = [Block("What was found", _found(document), table=_numbers(document))]
    if made.boundary is not None:
        blocks.append(_picture(robot, demand, made.boundary))
    for name, line in made.sections.items():
        axes = ("xyz".index(name[0]), "xyz".index(name[1]))
        across = 3 - sum(axes)
        where = f" at {'xyz'[across]} = {fixed(float(line.start[across]), 3)} m" if len(made.sections) > 1 else ""
        text = (
            f"Margins in the plane {name} through the start of the rays; the line is the exact boundary seen from there. "
            f"Area within it: {significant(line.area, 4)} m²{where}."
        )
        blocks.append(Block(f"Section {name}", text, section(robot, [line], sheets[name], axes)))
    if not made.sections:
        text = "Nothing is held: colours say by how much, at least, the cables fail. The middle layer of the grid."
        axes = (robot.axes[0], robot.axes[1])
        blocks.append(Block("The grid", text, section(robot, [], made.grid, axes)))
    blocks.append(Block("What was demanded", _words(demand), table=_demanded(demand)))
    blocks.append(Block("How it was worked out", _how(made, document)))
    return page(f"{robot.name}: workspace", blocks)


def _found(document: Mapping[str, Any]) -> str:
    reasons = document["verdict"]["reasons"]
    if reasons:
        return "\n\n".join(_told(document["verdict"]["remarks"]))
    text = "A position of the platform's origin belongs to the workspace when tensions within the limits balance everything demanded."
    where = [f"{side[0]} is {'least' if side[1] == '-' else 'greatest'}" for side in document["reaches_box"]]
    if where:
        text += f" It is cut off by the box where {', '.join(where)}."
    return "\n\n".join([text, *_told(document["remarks"])])


def _told(remarks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Remarks as paragraphs: the sentence, and what to do about it."""
    return [f"{r['sentence'][0].upper()}{r['sentence'][1:]}. {r['advice']}".strip() for r in remarks]


def _numbers(document: Mapping[str, Any]) -> list[list[str]]:
    grid, rays = document["grid"], document["rays"]
    what, name, unit = ("volume_m3", "Volume", "m³") if "volume_m3" in grid else ("area_m2", "Area", "m²")
    counts = " x ".join(str(n) for n in grid["cells"] if n > 1)
    rows = [["", "", ""], [f"{name} by the grid", f"{significant(grid[what], 4)} {unit}", f"{counts} cells"]]
    if rays is None:
        return rows
    said = f"{rays['count']} rays from {_point(rays['start_m'])}: {rays['start']}"
    if rays["difference"] is not None:
        said += f"; {100 * rays['difference']:+.2f} %"
    rows.append([f"{name} by rays", f"{significant(rays[what], 4)} {unit}", said])
    if document["extent_m"] is None:
        return rows
    rows.append(["Share of the box", f"{100 * grid['share_of_box']:.1f} %", f"box: {document['box']['chosen']}"])
    for axis, (low, high), (b0, b1) in zip("xyz", document["extent_m"], document["box"]["m"], strict=True):
        rows.append(
            [f"Extent in {axis}", f"{fixed(low, 3)} to {fixed(high, 3)} m", f"box {fixed(b0, 3)} to {fixed(b1, 3)} m"]
        )
    rows.append(["Centre", _point(document["centre_m"]), ""])
    for key, title, si in (("margin_N", "Margin", "N"), ("acceleration_m_s2", "Possible acceleration", "m/s²")):
        least, middle, most = (significant(document[key][k], 4) for k in ("least", "median", "greatest"))
        if document[key]["greatest"] is not None:
            rows.append([title, f"{middle} {si}", f"median; {least} to {most} {si}"])
    best, home = document["best"], document["home"]
    rows.append(["Greatest margin at", _point(best["position_m"]), f"{significant(best['margin_N'], 4)} N"])
    rows.append(
        ["X_0, the mean of the frame anchors", _point(home["position_m"]), "held" if home["held"] else "not held"]
    )
    return rows


def _picture(robot: CableRobot, demand: Demand, boundary: Surface | Outline) -> Block:
    """The robot where the rays start, with the least tensions for the first orientation and wrench and the greatest mass."""
    pose = se3.compose(demand.rotations[0], boundary.start)
    mass = float(demand.masses.max())
    wrench = gravity_wrench(pose[None], mass, robot.com, demand.gravity) + demand.extra[:1]
    held = distribute(structure_of(robot, pose[None]), wrench[:, list(robot.axes)], robot.need("limits"))
    text = (
        f"The platform where the rays start, {_point(boundary.start)}, with {significant(mass, 4)} kg: the least tensions "
        "that hold it. Drag to turn."
    )
    if isinstance(boundary, Outline):
        text = text.removesuffix(" Drag to turn.")
    return Block("The robot and its workspace", text, scene(robot, pose, tension=held.tension[0], surface=boundary))


def _words(demand: Demand) -> str:
    text = (
        "Each orientation with each mass and each wrench beside the weight; for a range of masses its ends are enough."
    )
    if demand.acceleration > 0:
        much = significant(demand.acceleration, 4)
        text += f" The centre of mass may accelerate at {much} m/s² in any direction, without turning."
    if demand.reserve > 0:
        much, lever = significant(demand.reserve, 4), significant(demand.length, 4)
        text += f" A disturbance of {much} N in any direction (moments over {lever} m) is held on top."
    return text


def _demanded(demand: Demand) -> list[list[str]]:
    turns = np.degrees(so3.log(demand.rotations))
    return [
        ["", ""],
        ["Masses", ", ".join(f"{significant(float(m), 4)} kg" for m in demand.masses)],
        ["Orientations", "; ".join(_angles(v) for v in turns[:MOST]) + ("; ..." if len(turns) > MOST else "")],
        ["Wrenches", "; ".join(", ".join(f"{v:g}" for v in row) for row in demand.extra) + " (N, Nm)"],
    ]


def _how(made: Workspace, document: Mapping[str, Any]) -> str:
    model = "Straight cables" + ("" if made.robot.pulleys is None else " over pulleys")
    limits = limits_text(document["demand"]["limits_N"])
    return "\n\n".join([f"{model}, what they weigh left out; limits {limits}.", *how_made(document)])


def _angles(vector: Array) -> str:
    return "upright" if not np.abs(vector).max() > 1e-9 else ", ".join(f"{v:.3g}" for v in vector) + " deg"


def _point(at: Any) -> str:
    return ", ".join(fixed(float(v), 3) for v in at) + " m"
