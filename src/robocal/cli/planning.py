"""Options of the verb `plan`, as typer reads them from annotations."""

from __future__ import annotations

from typing import Annotated

import typer

from robocal.cli.options import option

UNIT = "in the robot file's units"


Instrument = Annotated[
    str | None,
    typer.Argument(
        metavar="DATA",
        help="A data file that says which instrument will measure; its measurements do not count (see --after).",
        show_default=False,
    ),
]
PlanFolder = Annotated[
    str | None,
    option("-o", "--output", metavar="DIR", text="Write poses.csv, data.yaml, plan.json and plan.html here."),
]
Count = Annotated[
    int | None,
    typer.Option(
        "-n", "--poses", metavar="N", min=1, max=500, help="How many poses  [default: enough]", show_default=False
    ),
]
Criterion = Annotated[
    str,
    typer.Option("--criterion", metavar="NAME", help="I: mean error at test poses; G: the largest; D, A, E, O1 to O5."),
]
Accuracy = Annotated[
    float | None, option("--accuracy", metavar="LENGTH", text=f"Mean error at test poses that is enough, {UNIT}.")
]
After = Annotated[
    list[str], option("--after", metavar="DATA", text="Continue from these measurements: what they know counts.")
]
Candidates = Annotated[
    int, typer.Option("--draw", metavar="N", min=20, max=100_000, help="How many candidates to draw in the region.")
]
Listed = Annotated[
    str | None,
    option("--candidates", metavar="FILE", text="Choose from this list of poses (CSV with joint columns, data.yaml)."),
]
Tests = Annotated[str | None, option("--tests", metavar="FILE", text="Predict at these poses, not at a sample.")]
TaskBox = Annotated[
    str | None,
    option(
        "--task",
        metavar="BOX",
        text="Predict inside x0,y0,z0,x1,y1,z1 of the tool point, while measuring anywhere allowed.",
    ),
]
Box = Annotated[
    str | None,
    option("--box", metavar="BOX", text=f"Measure only with the tool point inside x0,y0,z0,x1,y1,z1, {UNIT}."),
]
Floor = Annotated[
    float | None, option("--floor", metavar="Z", text="Keep tool point and flange above this height over the base.")
]
Pedestal = Annotated[
    str | None,
    option("--pedestal", metavar="R,H", text="Keep both out of a cylinder of radius R up to height H around the base."),
]
Distance = Annotated[
    str | None, option("--range", metavar="MIN,MAX", text="Keep the target this far from the instrument.")
]
Cone = Annotated[
    float | None, option("--cone", metavar="ANGLE", text="Keep it within this angle of the instrument's z axis.")
]
Facing = Annotated[
    float | None, option("--facing", metavar="ANGLE", text="Let its z axis point at the instrument within this angle.")
]
