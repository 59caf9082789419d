"""The verbs in the order of the help, each with what its list says of it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

__all__ = ["CABLE", "COMMAND_NAMES", "DRIVE", "GROUPS", "PATHS", "VERBS", "VISION", "VerbGroup"]


class VerbGroup(NamedTuple):
    """Verbs under one word: their line in the list, their help, the verbs, and the word in Python, `rc.cable`."""

    line: str
    help: str
    verbs: Mapping[str, str]
    python: str


VERBS: Mapping[str, str] = MappingProxyType({
    "demo": "Calibrate three example arms.",
    "new": "Write files to start from.",
    "import_model": "Write a model of CASPR as robot.yaml.",
    "plan": "Choose which poses to measure, and how many.",
    "check": "Report what files contain and what is observable.",
    "identify": "Identify true parameters, and prove the gain.",
    "predict": "Predict the tool pose, with 95 % bands.",
    "validate": "Measure a model's error on other data.",
    "verify": "Compare poses with those of an external instrument.",
    "drift": "Has a robot changed between two calibrations?",
    "compensate": "Correct targets for a controller that keeps its model.",
    "export": "Write a model as YAML, URDF, table or offsets.",
    "simulate": "Simulate measurements of an imperfect robot.",
    "study": "Simulate a procedure a thousand times.",
    "report": "Write report.html again.",
    "warm_up": "Compile everything now, for containers and CI.",
})  # fmt: skip
CABLE: Mapping[str, str] = MappingProxyType({
    "inverse": "Lengths from poses.",
    "forward": "Poses from lengths.",
    "tension": "Tensions that hold poses.",
    "workspace": "Where the platform can be held.",
    "poses": "Poses that can be reached.",
    "contact": "Check a given path for contacts and tensions.",
    "rezero": "Zeros of the length sensors after power-up.",
    "require": "Sensors and poses that a calibration needs.",
    "drift": "Which anchor moved between calibrations?",
    "straightness": "Sag and stretch, and the tension that keeps them small.",
    "rig": "A virtual rig: from a tape measure to a verified calibration.",
})  # fmt: skip
VISION: Mapping[str, str] = MappingProxyType({
    "sheet": "Markers and boards to print, at true scale.",
    "detect": "Corners of printed targets in images.",
    "intrinsics": "A lens from corners, with its uncertainty.",
    "map": "Where markers are to one another; or a camera among them.",
    "hand_eye": "Where a camera is on a robot, or beside it.",
    "probe": "Points in ultrasound images, from PLUS.",
    "compare": "How maps of the same markers scatter.",
    "require": "What a map of markers will be off by.",
    "export": "A map or a lens for other programs, or from them.",
})  # fmt: skip
DRIVE: Mapping[str, str] = MappingProxyType({
    "identify": "Cogging and friction of a motor, from logs of its drive.",
    "validate": "What a motor's table explains of another log.",
    "compensate": "The table of a motor for a controller.",
    "simulate": "A simulated motor: sweep, compensation, test.",
})  # fmt: skip
GROUPS: Mapping[str, VerbGroup] = MappingProxyType({
    "cable": VerbGroup(
        "Cable-driven parallel robots.",
        "Cable-driven parallel robots: lengths, poses, tensions, workspaces, lists of poses.\n\n"
        "robocal new cable writes a file to start from.",
        CABLE,
        "cable",
    ),
    "drive": VerbGroup(
        "Motors and their drives.", "Motors: cogging and friction from logs of their drives, and tables for controllers.", DRIVE, "drive"
    ),
    # In Python robocal.vision is the package of what these verbs compute with.
    "vision": VerbGroup(
        "Cameras and printed sheets.", "Cameras: sheets to print, images to corners, lenses, maps of markers.", VISION, "camera"
    ),
})  # fmt: skip
# Where every verb is in `robocal.verbs`.
PATHS = (*VERBS, *(f"{word}.{name}" for word, group in GROUPS.items() for name in group.verbs))
# What the command line calls a verb whose word is no name in Python: module and function have another.
COMMAND_NAMES: Mapping[str, str] = MappingProxyType(
    {"import_model": "import", "warm_up": "warm-up", "hand_eye": "hand-eye"}
)
