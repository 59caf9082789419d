"""Arguments and options that several verbs share, told once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from robocal.verbs.option import Arg, Option

__all__ = [
    "KINDS",
    "AnyRobot",
    "Base",
    "CableRobot",
    "CableTension",
    "Data",
    "Diameter",
    "Exclude",
    "Force",
    "Frame",
    "History",
    "Kind",
    "MomentLength",
    "Noise",
    "OutputFile",
    "Payload",
    "PlatformBody",
    "PlatformMass",
    "PlatformPoses",
    "Relief",
    "Robot",
    "Sag",
    "Seed",
    "TensionLimits",
    "TensionMethod",
    "Tip",
]  # fmt: skip

Robot = Annotated[
    str, Arg("ROBOT", "robot.yaml, a URDF, a run folder, or a name from the catalogue (robocal new --list)")
]
AnyRobot = Annotated[str, Arg("ROBOT", "A robot file, a catalogue name, or a run folder.")]
DATA = Arg("DATA...", "data.yaml, or a CSV whose headers carry units; several are fitted together")
Data = Annotated[tuple[str, ...], DATA]
Exclude = Annotated[
    tuple[str, ...],
    Option("Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW", "ROWS", listed=True),
]
Base = Annotated[str | None, Option("First link of the chain in a URDF", "LINK")]
Tip = Annotated[str | None, Option("Last link of the chain in a URDF", "LINK")]
Seed = Annotated[int, Option("Seed of all random draws", "N", least=0)]
Force = Annotated[bool, Option("Replace files that exist")]
OutputFile = Annotated[Path | None, Option("Write here, not to the terminal", "FILE", short="-o")]
History = Annotated[
    Path | None, Option("Add the runs to this CSV, a row for each number; they are not added twice", "FILE")
]
# What `measure.kinds` knows and a rig shows; a test holds them equal, for help imports neither.
KINDS = "position, pose, spherical, bearing, range, distance, displacement, relative_pose, point, plane, sphere, pixels"
Kind = Annotated[str, Option(f"What is measured: {KINDS}", "KIND")]
Noise = Annotated[
    float | None, Option("Standard deviation per axis", "SIGMA", unit="length", least=0, otherwise="0.05 mm, converted")
]
Frame = Annotated[
    str,
    Option("Pose of the base in the instrument frame: x,y,z,rx,ry,rz; auto: chosen; none: base coordinates", "FRAME"),
]

# cable robots
NOISE = "a noise is a standard deviation"
CableRobot = Annotated[str, Arg("ROBOT", "robot.yaml with kind: cable, or CASPR's X_cables.xml.")]
PlatformPoses = Annotated[str, Arg("POSES", "CSV: x [m], y, z, rx [deg], ry, rz (rotation vector), or qx, qy, qz, qw.")]
CableTension = Annotated[
    float | None,
    Option("Tension of every cable: cables stretch", "T", unit="force", least=0, wrong="a cable cannot push"),
]
Diameter = Annotated[
    float | None,
    Option(
        "Diameter of every cable, in place of that in the robot file", "D", unit="length", least=0, wrong="not a length"
    ),
]
PlatformBody = Annotated[str, Option("The platform: hull or box of its anchors, none, or LX,LY,LZ", "BODY")]
Relief = Annotated[
    float | None,
    Option("Distance from an anchor within which a cable may touch its own eyelet", "R", unit="length", above=0, wrong="not a length",
    otherwise="10 diameters"),
]  # fmt: skip
Sag = Annotated[bool, Option("Include the sag of the cables by their weight")]
TensionMethod = Annotated[str, Option("norm (least), mid, closed, barycentre (continuous), p-norm", "METHOD")]
PlatformMass = Annotated[
    float | None, Option("Mass of the platform, in place of that in the robot file", "MASS", unit="mass", least=0)
]
Payload = Annotated[float, Option("Payload at the centre of mass", "MASS", unit="mass", least=0)]
TensionLimits = Annotated[
    str | None,
    Option("Tension limits of every cable, not those of the robot file", numbers="LEAST,GREATEST", unit="force"),
]
MomentLength = Annotated[
    float | None,
    Option("Divides moments to compare them with forces", "LENGTH", unit="length", above=0, otherwise="1 m"),
]
