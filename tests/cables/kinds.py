"""Robots whose cables are sums of segments, whose anchors are on rails, and whose drums grow: texts of their files."""

from __future__ import annotations

from pathlib import Path

from robocal.cables.geometry import CableRobot
from robocal.files.cable.cable_robot import parse_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.text import Source

__all__ = ["DRUMS", "MOVING", "PLANAR", "RAILS", "opened", "robot_of"]

HEAD = "robocal: 1\nname: kinds\nkind: cable\nunits: {length: m}\n"
FLAT = "degrees: 2T\nplane: xz\nframe_anchors: {A1: [-2, 0, 3], A2: [2, 0, 3], A3: [-2, 0, 0], A4: [2, 0, 0.1]}\nplatform_anchors: {P: [0, 0, 0]}\n"
PLANAR = f"""{HEAD}{FLAT}segments:
  m: {{frame: A1, platform: P}}
  n: {{frame: A2, platform: P}}
  k: {{frame: A3, platform: P}}
  h: {{frame: A4, platform: P}}
cables:
  - {{name: M1, segments: {{m: 1, n: 1}}, zero: 0.1}}
  - {{name: M2, segments: {{m: 1, k: 2}}, zero: 0.2}}
  - {{name: M3, segments: {{n: 1, h: 2}}, zero: 0.3}}
every_cable: {{tension: [10, 500]}}
platform: {{mass: 5}}
calibrate: {{free: [ax, az, l0]}}
"""
SPACE = """frame_anchors:
  A1: [-2, -1.5, 3]
  A2: [2, -1.5, 3]
  A3: [2, 1.5, 3]
  A4: [-2, 1.5, 3]
  A5: [-2, -1.5, 0]
  A6: [2, -1.5, 0]
  A7: [2, 1.5, 0]
  A8: [-2, 1.5, 0]
platform_anchors:
  B1: [-0.2, -0.15, 0.2]
  B2: [0.2, -0.15, 0.2]
  B3: [0.2, 0.15, 0.2]
  B4: [-0.2, 0.15, 0.2]
  B5: [0.1, -0.3, -0.2]
  B6: [0.3, -0.1, -0.2]
  B7: [-0.1, 0.3, -0.2]
  B8: [-0.3, 0.1, -0.2]
"""
MOVING = f"""{HEAD}{SPACE}segments:
  s1: {{frame: A1, platform: B1, pulley: {{radius: 0.05, axis: [0, 0, 1]}}}}
  s2: {{frame: A2, platform: B1}}
  s3: {{frame: [A1, A4]}}
  s4: {{platform: [B7, B8]}}
  s5: {{frame: A5, platform: B5}}
cables:
  - {{name: c1, segments: {{s1: 1, s2: 1}}}}
  - {{name: c2, frame: A2, platform: B2}}
  - {{name: c3, frame: A3, platform: B3}}
  - {{name: c4, frame: A4, platform: B4}}
  - {{name: c5, segments: {{s5: 3, s3: 1, s4: 2, s2: -1}}, zero: 0.4}}
  - {{name: c6, frame: A6, platform: B6}}
  - {{name: c7, frame: A7, platform: B7}}
  - {{name: c8, frame: A8, platform: B8}}
calibrate: {{free: [ax, ay, az, l0]}}
"""
CABLES = "cables:\n" + "".join(f"  - {{name: c{i}, zero: 0.1}}\n" for i in range(1, 9))
RAIL = ", rail: {direction: [0, 0.3, -1], carriage: 0.4, gain: 1.1}}"
RAILS = (HEAD + SPACE + CABLES).replace(
    "c3, zero: 0.1}", "c3, zero: 0.1" + RAIL
) + "calibrate: {free: [ax, ay, az, l0, rail, rx, ry]}\n"
DRUMS = (
    HEAD
    + SPACE
    + CABLES.replace("zero: 0.1", "zero: 0.1, gain: 1.02")
    + "every_cable: {build_up: 0.03}\ncalibrate: {free: [l0, gain, build_up]}\n"
)


def opened(text: str) -> CableFile:
    """The robot with its file."""
    return parse_cable(Source(Path("robot.yaml"), text, ""))


def robot_of(text: str) -> CableRobot:
    """The robot."""
    return opened(text).robot
