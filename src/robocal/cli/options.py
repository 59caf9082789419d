"""Arguments and options of the verbs, as typer reads them from annotations."""

from __future__ import annotations

from typing import Annotated

import typer

ROBOT = "robot.yaml, a URDF, a run folder, or a name from the catalogue (robocal new --list)"
DATA = "data.yaml, or a CSV whose headers carry units; several are fitted together"


def _argument(name: str, text: str) -> object:
    return typer.Argument(metavar=name, help=text, show_default=False)


def option(*names: str, metavar: str | None = None, text: str) -> object:
    """An option without a default worth showing."""
    return typer.Option(*names, metavar=metavar, help=text, show_default=False)


Robot = Annotated[str, _argument("ROBOT", ROBOT)]
Data = Annotated[list[str], _argument("DATA...", DATA)]
MaybeData = Annotated[list[str] | None, _argument("DATA...", DATA)]
DemoName = Annotated[str | None, _argument("NAME", "rv-2aj, camera or tracker; all of them by default.")]
Template = Annotated[str | None, _argument("ROBOT", "A catalogue name, a convention, or cable.")]
AnyRobot = Annotated[str, _argument("ROBOT", "A robot file, a catalogue name, or a run folder.")]
Run = Annotated[str, _argument("RUN", "A run folder with result.json and residuals.csv.")]

Json = Annotated[bool, typer.Option("--json", help="One JSON document on stdout, messages on stderr.")]
Seed = Annotated[int, typer.Option("--seed", metavar="N", min=0, help="For whatever is drawn at random.")]
Base = Annotated[str | None, option("--base", metavar="LINK", text="First link of the chain in a URDF.")]
Tip = Annotated[str | None, option("--tip", metavar="LINK", text="Last link of the chain in a URDF.")]
Force = Annotated[bool, typer.Option("--force", help="Replace files that exist.")]

ForceRun = Annotated[
    bool, option("--force", text="Write the run into a folder that holds something else; files of other names stay.")
]
RunFolder = Annotated[str | None, option("-o", "--output", metavar="DIR", text="Write a run folder here.")]
ValidationFolder = Annotated[
    str | None, option("-o", "--output", metavar="DIR", text="Write validation.json and validation.html here.")
]
OutputFile = Annotated[str | None, option("-o", "--output", metavar="FILE", text="Write here, not to the terminal.")]
PageFile = Annotated[str | None, option("-o", "--output", metavar="FILE", text="The page  [default: RUN/report.html]")]
DemoFolder = Annotated[str, typer.Option("-o", "--output", metavar="DIR", help="Where files and reports go.")]
NewFolder = Annotated[str, typer.Option("-o", "--output", metavar="DIR", help="Folder for the files.")]
SimulationFolder = Annotated[str, option("-o", "--output", metavar="DIR", text="Folder for robot, data and truth.")]

# new
JointCount = Annotated[
    int, typer.Option("--joints", metavar="N", min=1, max=30, help="How many, when ROBOT is a convention.")
]
Kind = Annotated[
    str,
    typer.Option(
        "--kind",
        metavar="KIND",
        help="What is measured: position, pose, spherical, bearing, range, distance, displacement, relative_pose, point, "
        "plane, sphere, pixels.",
    ),
]
List = Annotated[bool, typer.Option("--list", help="List the catalogue and the conventions.")]

# identify
Free = Annotated[
    list[str],
    option(
        "--free",
        metavar="NAME",
        text="Free exactly these, not what the robot file says: j2.alpha, alpha, j2, tool. Repeat, or separate by commas.",
    ),
]
Fix = Annotated[list[str], option("--fix", metavar="NAME", text="Hold these; also frames of data files.")]
Prior = Annotated[
    list[str],
    option(
        "--prior",
        metavar="NAME=SIGMA",
        text="Standard deviation expected beforehand, in the robot file's units; length=... and angle=... for all.",
    ),
]
Method = Annotated[
    str,
    typer.Option(
        "--method",
        metavar="METHOD",
        help="lm, gauss-newton, ekf, particle; to compare with: pinv (iterated pseudo-inverse), lse (one step), ekf-100.",
    ),
]
Compare = Annotated[
    str | None,
    option(
        "--compare",
        metavar="[METHODS]",
        text="Try several estimators on the same split, side by side: say lm,ekf,lse; alone: all that are worth it.",
    ),
]
Loss = Annotated[
    str, typer.Option("--loss", metavar="LOSS", help="none, huber, cauchy, tukey: what outliers may weigh.")
]
HoldOut = Annotated[
    str | None,
    option(
        "--hold-out",
        metavar="SHARE",
        text="Share of configurations kept for judging, 0 to 0.5; blocks of rows in time order; or group, whole groups  "
        "[default: 0.2 from 25 configurations on]",
    ),
]
Folds = Annotated[
    int | None,
    option("--folds", metavar="K", text="Hold out everything once, in K rounds, and fit the model to everything."),
]
GroupColumn = Annotated[
    str | None, option("--group", metavar="COLUMN", text="The column that says what is held out together.")
]
Exclude = Annotated[
    list[str],
    option(
        "--exclude", metavar="ROWS", text="Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW."
    ),
]
Blocks = Annotated[int, typer.Option("--blocks", metavar="N", min=2, help="How many, with --hold-out blocks.")]
Reselect = Annotated[
    bool, typer.Option("--reselect", help="With --folds: find noise and what is seen anew in every round.")
]
LeaveOneOut = Annotated[
    bool | None,
    option(
        "--leave-one-out/--no-leave-one-out",
        text="Predict every configuration from all the others  [default: up to 400 configurations]",
    ),
]
KeepAll = Annotated[bool, typer.Option("--keep-all", help="Fit also what the data cannot tell apart.")]
Particles = Annotated[int, typer.Option("--particles", metavar="N", min=50, max=100_000, help="For --method particle.")]
Bootstrap = Annotated[
    int | None,
    option(
        "--bootstrap",
        metavar="N",
        text="Draw the configurations N times again: intervals that trust no model of the noise.",
    ),
]
Iterations = Annotated[int, typer.Option("--iterations", metavar="N", min=1, help="At most this many.")]

Groups = Annotated[
    list[str],
    option(
        "--groups",
        metavar="NAMES",
        text="Try these beyond geometry; each enters only if unseen blocks of rows get better: gain, eccentricity, "
        "ripple, backlash, compliance, sag, bending, expansion.",
    ),
]
LayerOption = Annotated[
    bool, typer.Option("--layer", help="Try a residual layer on top; used only if unseen blocks of rows get better.")
]

WorkingRange = Annotated[
    str | None,
    option(
        "--region",
        metavar="FILE",
        text="Where the robot works: a list of poses, or ranges of joints; measured: where it was measured will do  "
        "[default: joint limits that you wrote (a catalogue's are the maker's), else where it was measured]",
    ),
]

# validate, export
Against = Annotated[str | None, option("--against", metavar="ROBOT", text="Compare with this robot, say the nominal.")]
OffsetsFile = Annotated[
    str | None,
    option("--offsets", metavar="FILE", text="Judge these joint offsets (CSV, ROS, xacro) on the nominal robot."),
]
Distances = Annotated[
    str,
    typer.Option(
        "--distances",
        metavar="PAIRS",
        help="Between which places: consecutive, all, group, or a column of the configurations.",
    ),
]
Form = Annotated[
    str,
    typer.Option(
        "--format",
        metavar="FORMAT",
        help="yaml, urdf, dh (a table with Hayati's beta), csv or markdown (the parameters), offsets of the joints: "
        "offsets (CSV), ros (parameters), xacro (properties).",
    ),
]
Into = Annotated[
    str | None,
    option("--into", metavar="URDF", text="With --format urdf: this URDF with calibrated origins, else byte for byte."),
]
Nominal = Annotated[
    str | None,
    option("--nominal", metavar="ROBOT", text="What offsets are counted from; a run folder knows it."),
]

# compensate
Targets = Annotated[
    str, _argument("TARGETS", "A CSV whose headers carry units (poses, positions, joints), or a YAML beside it.")
]
Controller = Annotated[
    str | None,
    option("--nominal", metavar="ROBOT", text="The model that the controller keeps; a run folder knows it."),
]
Tool = Annotated[
    str,
    typer.Option(
        "--tool",
        metavar="TOOL",
        help="What both models carry: calibrated, nominal, x,y,z,rx,ry,rz in the robot's units; or own, each its own.",
    ),
]
CompensationFolder = Annotated[
    str | None, option("-o", "--output", metavar="DIR", text="Write compensated.csv and compensation.json here.")
]

# simulate
Poses = Annotated[
    int,
    typer.Option(
        "-n", "--poses", metavar="N", min=1, max=1_000_000, help="Configurations drawn within the joint limits."
    ),
]
At = Annotated[
    str | None,
    option(
        "--at", metavar="FILE", text="Take the joint values of this data file or list of poses instead of drawing them."
    ),
]
Noise = Annotated[
    float | None,
    option(
        "--noise",
        metavar="SIGMA",
        text="Standard deviation per axis, in the robot file's length unit  [default: 0.05 mm, converted]",
    ),
]
AngleNoise = Annotated[
    float | None,
    option("--angle-noise", metavar="SIGMA", text="The same for orientations  [default: 0.1 mrad, converted]"),
]
LengthError = Annotated[
    float | None,
    option(
        "--length-error",
        metavar="SIGMA",
        text="Standard deviation of true lengths around nominal ones, in the same unit  [default: 0.3 mm, converted]",
    ),
]
AngleError = Annotated[
    float | None,
    option(
        "--angle-error",
        metavar="SIGMA",
        text="The same for angles, in the robot file's angle unit  [default: 1 mrad, converted]",
    ),
]
Setting = Annotated[
    list[str], option("--set", metavar="NAME=VALUE", text="A true value, in the robot file's units; may be repeated.")
]
Where = Annotated[
    str,
    typer.Option(
        "--frame",
        metavar="FRAME",
        help="The base seen from the instrument: x,y,z,rx,ry,rz; auto: somewhere; none: base coordinates.",
    ),
]

# predict, drift
KnowingRun = Annotated[str, _argument("RUN", "A run folder, as identify -o writes it.")]
JointTable = Annotated[str, _argument("POSES", "A CSV of joint values with units in its headers: q1 [deg], ...")]
Absolute = Annotated[bool, typer.Option("--absolute", help="Include what is not known of where the base stands.")]
FirstRun = Annotated[str, _argument("RUN1", "The earlier run folder.")]
SecondRun = Annotated[str, _argument("RUN2", "The later run folder, identified from the same robot file.")]
NewTool = Annotated[bool, typer.Option("--new-tool", help="The tool was mounted anew and may differ.")]
Matters = Annotated[
    str,
    option(
        "--matters", metavar="LENGTH", text="The change worth an alarm, with its unit: mean over the poses measured."
    ),
]
DriftFolder = Annotated[str | None, option("-o", "--output", metavar="DIR", text="Write drift.json here.")]

# cable
CableRobot = Annotated[str, _argument("ROBOT", "robot.yaml with kind: cable, or CASPR's X_cables.xml.")]
PlatformPoses = Annotated[str, _argument("POSES", "CSV: x [m], y, z, rx [deg], ry, rz (rotation vector).")]
CableLengths = Annotated[str, _argument("LENGTHS", "CSV: one column per cable, such as c1 [mm].")]
Tension = Annotated[
    float | None,
    option("--tension", metavar="T", text="Tension of every cable, in the robot file's unit: cables stretch."),
]
Sag = Annotated[bool, typer.Option("--sag", help="Cables also hang by their weight.")]
LengthNoise = Annotated[
    float | None,
    option("--sigma", metavar="SIGMA", text="Standard deviation of a length, in the robot file's unit."),
]
Starts = Annotated[int, typer.Option("--starts", metavar="N", min=0, help="Further starts that look for other poses.")]

# cable tension
TensionFolder = Annotated[
    str | None,
    option("-o", "--output", metavar="DIR", text="Write tensions.csv, tension.json and report.html here."),
]
TensionMethod = Annotated[
    str, typer.Option("--method", metavar="METHOD", help="norm (least), mid, closed, barycentre (continuous), p-norm.")
]
Power = Annotated[float | None, option("--power", metavar="P", text="Of --method p-norm, from 2 on  [default: 4]")]
Mass = Annotated[
    float | None,
    option("--mass", metavar="MASS", text="Of the platform, in the robot file's unit, instead of the file's."),
]
Payload = Annotated[
    float, typer.Option("--payload", metavar="MASS", help="Hung at the centre of mass, in the robot file's unit.")
]
Wrench = Annotated[
    str | None,
    option(
        "--wrench",
        metavar="FX,FY,FZ,MX,MY,MZ",
        text="Acts on the platform at its origin, base axes: the robot file's unit of force, and Nm.",
    ),
]
TensionLimits = Annotated[
    str | None,
    option("--limits", metavar="LEAST,GREATEST", text="Tension limits of every cable, not those of the robot file."),
]
MomentLength = Annotated[
    float | None,
    option(
        "--length",
        metavar="LENGTH",
        text="Divides moments to compare them with forces, in the robot file's unit  [default: 1 m]",
    ),
]
