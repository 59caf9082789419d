"""Studies that are small enough to be run in a test."""

from __future__ import annotations

from pathlib import Path

from cli.runs import robocal

EXAMPLES = Path(__file__).parents[2] / "examples"
TEXT = """robocal: 1
kind: study
of: cable-calibration
robot: robot.yaml
trials: 60
seed: 3
chunk: 10
poses: {count: 40, shift: 0.7 m, turn: 15 deg}
noise: {length: 3 mm, position: 2 mm, orientation: 1 deg}
sweep: {residual: [length, squared]}
"""
ARM = """robocal: 1
kind: study
of: identification
robot: rv-2aj
trials: 4
chunk: 2
seed: 5
poses: {count: 25}
noise: {position: 0.1 mm}
outputs: [improved, elsewhere]
"""


def conducted(study, name, **how):
    result = study.parent / name
    ran = robocal("study", study, "-o", result, *(w for k, v in how.items() for w in (f"--{k}", v)))
    assert ran.status == 0, ran.said
    return result.read_bytes()


def of(study, old, new):
    assert old in ARM
    study.write_text(ARM.replace(old, new))
    return study
