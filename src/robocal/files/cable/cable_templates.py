"""Commented files of a cable robot to start from: robot.yaml with every key, a list of poses, and the data of a calibration."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from robocal.cables.cable_lengths import inverse
from robocal.files.cable.cable_robot import parse_cable
from robocal.files.cable.data_templates import data_templates
from robocal.files.text import Source
from robocal.geometry import se3

__all__ = ["cable_templates"]

ROBOT = """# A cable robot to start from: it works as it stands, but no machine has these numbers. Put yours in their place.
# Every key: docs/cable-robots.md. Leave out what you do not know; whatever needs it will say so.
# Any value may be {value: 30, unit: mm, source: data sheet, assumed: true}: with a unit of its own, and where it is from.
robocal: 1
name: my cable robot
kind: cable
units: {length: mm, angle: deg, force: N, mass: kg}    # of every number in this file that names none
degrees: 3R3T    # 3T where nothing controls the orientation; in a plane 1R2T or 2T, then also plane: xz, yz or xy
frame_anchors:    # where the cables leave the frame; base axes, z up
  A1: [2000, 1500, 3000]
  A2: [-2000, 1500, 3000]
  A3: [-2000, -1500, 3000]
  A4: [2000, -1500, 3000]
  A5: [2000, 1500, 0]
  A6: [-2000, 1500, 0]
  A7: [-2000, -1500, 0]
  A8: [2000, -1500, 0]
platform_anchors:    # where they are attached; axes of the platform
  B1: [150, 50, -100]
  B2: [-150, 50, -100]
  B3: [-150, -50, -100]
  B4: [150, -50, -100]
  B5: [50, 150, 100]
  B6: [-50, 150, 100]
  B7: [-50, -150, 100]
  B8: [50, -150, 100]
cables:    # which anchor joins which; three to twelve. length of a cable = gain x what its sensor shows + zero
  - {name: c1, frame: A1, platform: B1, zero: 0, gain: 1}
  - {name: c2, frame: A2, platform: B2, zero: 0, gain: 1}
  - {name: c3, frame: A3, platform: B3, zero: 0, gain: 1}
  - {name: c4, frame: A4, platform: B4, zero: 0, gain: 1}
  - {name: c5, frame: A5, platform: B5, zero: 0, gain: 1}
  - {name: c6, frame: A6, platform: B6, zero: 0, gain: 1}
  - {name: c7, frame: A7, platform: B7, zero: 0, gain: 1}
  - {name: c8, frame: A8, platform: B8, zero: 0, gain: 1}
every_cable:    # a cable may say its own instead
  tension: [20, 600]    # least and greatest
  diameter: 4
  # elasticity: 2.0e-5    # strain per tension, 1 / EA
  density: {value: 0.1, unit: N/m}    # weight per length
  # pulley: {radius: 50, axis: [0, 0, 1]}
platform:
  mass: 8
  centre_of_mass: [0, 0, 0]
calibrate: {free: [ax, ay, az, gain]}    # what is to be found: also bx, by, bz, l0, a cable, or single names such as c1.ax
# source: where these numbers come from
"""
POSES = """# Example poses of the platform: put yours here. Units are those in the headers; rx, ry, rz is a rotation vector.
id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]
home,0,0,1500,0,0,0
left,-800,0,1200,0,0,0
right,800,0,1200,0,0,0
up,0,300,2200,0,0,10
tilted,400,-300,1000,5,-5,0
"""


def cable_templates(kind: str | None = None) -> dict[str, str]:
    """The texts of robot.yaml, poses.csv and data files (of a `kind`, else all); they are valid together, and every pose is held."""
    texts = {"robot.yaml": ROBOT, "poses.csv": POSES}
    file = parse_cable(Source(Path("robot.yaml"), ROBOT, ""))
    vectors = np.array([[float(v) for v in line.split(",")[1:]] for line in POSES.splitlines()[2:]])
    poses = se3.from_vector(vectors * np.repeat([1e-3, np.pi / 180], 3))
    ids = [line.split(",")[0] for line in POSES.splitlines()[2:]]
    rows = np.round(inverse(file.robot, poses)[0], 6), poses
    return texts | data_templates(file.robot, file.units, ids, rows, kind=kind)
