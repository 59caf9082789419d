"""Options of the verb `cable poses`, as typer reads them from annotations."""

from __future__ import annotations

from typing import Annotated

import typer

from robocal.cli.options import option

Folder = Annotated[
    str | None,
    option("-o", "--output", metavar="DIR", text="Write poses.csv, program.csv, list.json and report.html here."),
]
Count = Annotated[int, typer.Option("-n", "--poses", metavar="N", min=1, max=10_000, help="Poses to list.")]
Margin = Annotated[float, typer.Option("--mu", metavar="MU", help="How much of each free way is gone, up to 1.")]
Start = Annotated[
    str,
    typer.Option(
        "--start",
        metavar="START",
        help="X_0: mean of the frame anchors, best of a grid, or X,Y,Z[,RX,RY,RZ] in the robot file's units.",
    ),
]
Box = Annotated[
    str | None,
    option(
        "--box", metavar="X0,Y0,Z0,X1,Y1,Z1", text="The box Z of random poses, in place of one as large as the machine."
    ),
]
Scale = Annotated[float, typer.Option("--scale", metavar="S", help="Z, as a multiple of the machine.")]
Turn = Annotated[
    float | None,
    option("--turn", metavar="ANGLE", text="Z, about each axis, in the robot file's unit  [default: 30 deg]"),
]
Diameter = Annotated[
    float | None, option("--diameter", metavar="D", text="Of every cable, not that of the robot file.")
]
Body = Annotated[
    str, typer.Option("--body", metavar="BODY", help="The platform: hull or box of its anchors, none, or LX,LY,LZ.")
]
Relief = Annotated[
    float | None,
    option("--relief", metavar="R", text="A cable may touch its own eyelet so far from it  [default: 10 diameters]"),
]
Waypoints = Annotated[int, typer.Option("--steps", metavar="K", min=1, max=1000, help="Waypoints on each way.")]
Choose = Annotated[
    int | None, option("--choose", metavar="N", text="Choose the N poses that are best for calibration.")
]
PoseNoise = Annotated[
    str | None,
    option(
        "--pose-noise",
        metavar="POSITION,ORIENTATION",
        text="For --choose: standard deviation per axis of a measured pose, in the robot file's units.",
    ),
]
Criterion = Annotated[
    str, typer.Option("--criterion", metavar="C", help="For --choose: A (least rms), D, I, G, E, O1 to O5.")
]
Sigma = Annotated[
    float | None,
    option("--sigma", metavar="SIGMA", text="For --choose: standard deviation of a length  [default: 1 mm, converted]"),
]
