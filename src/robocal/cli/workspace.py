"""Options of the verb `cable workspace`, as typer reads them from annotations."""

from __future__ import annotations

from typing import Annotated

import typer

from robocal.cli.options import option

UNIT = "in the robot file's unit"


Folder = Annotated[
    str | None,
    option(
        "-o", "--output", metavar="DIR",
        text="Write workspace.json, workspace.csv, outlines.csv, surface.ply, surface.stl and report.html here.",
    ),
]  # fmt: skip
Orientation = Annotated[
    list[str],
    option(
        "--orientation",
        metavar="RX,RY,RZ",
        text=f"A rotation vector, {UNIT} of angles; repeat for several, all of which are to be held  [default: upright]",
    ),
]
Tilt = Annotated[
    float | None,
    option("--tilt", metavar="ANGLE", text="Hold tilts too: half the angle and all of it, about 8 horizontal axes."),
]
Masses = Annotated[
    str | None, option("--mass", metavar="LO,HI", text="Of the platform, one number or a range, instead of the file's.")
]
Payloads = Annotated[
    str | None,
    option("--payload", metavar="LO,HI", text="More mass at the centre of mass, one number or a range: say 0,20."),
]
Wrenches = Annotated[
    list[str],
    option(
        "--wrench",
        metavar="FX,FY,FZ,MX,MY,MZ",
        text=f"Acts beside the weight at the platform's origin, base axes, {UNIT} of force, and Nm; repeat for several, all of "
        "which are to be held, with 0,0,0,0,0,0 for none.",
    ),
]
Acceleration = Annotated[
    float, typer.Option("--acceleration", metavar="A", help="Of the centre of mass, in any direction, m/s2.")
]
Reserve = Annotated[
    float,
    typer.Option(
        "--reserve", metavar="F", help=f"A disturbance in any direction that is held on top, {UNIT} of force."
    ),
]
Box = Annotated[
    str | None,
    option("--box", metavar="X0,Y0,Z0,X1,Y1,Z1", text=f"Where to look, {UNIT}  [default: what the frame can reach]"),
]
Cells = Annotated[int, typer.Option("--cells", metavar="N", min=2, max=300, help="Of the grid, along each axis.")]
Rays = Annotated[int, typer.Option("--rays", metavar="N", min=20, max=200_000, help="To the exact boundary.")]
RayStart = Annotated[
    str | None,
    option(
        "--start", metavar="X,Y,Z",
        text=f"Where rays start, {UNIT}  [default: the mean of the frame anchors, or the middle of what is held]",
    ),
]  # fmt: skip
