"""An arm that is not quite its model, measured by an instrument that is not quite exact.

Everything that it writes says simulated.
"""

from __future__ import annotations

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

import numpy as np

from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.errors import ModelError, look_up
from robocal.files.datawrite import data_text, table_text
from robocal.files.pose_table import read_poses
from robocal.files.robot import Robot, describe, parse_robot, render_robot
from robocal.files.text import Source
from robocal.measure.data import DataSet
from robocal.planning.candidates import joint_range
from robocal.session.simulator import Errors, Request, Simulator, parse_frame
from robocal.simulation.rigs import CONTACTS, FINE, RIGS, Instrument, hidden, measure

__all__ = ["ArmSimulator", "Errors", "Instrument", "measure", "sample_joints"]


def sample_joints(chain: Chain, count: int, rng: np.random.Generator) -> Array:
    """Joint values (count, n), uniform within the limits, or around zero where there are none."""
    low, high = joint_range(chain).T
    return np.asarray(rng.uniform(low, high, (count, len(low))))


class ArmSimulator(Simulator[Chain]):
    """An arm before an instrument that stands somewhere. Raises ModelError for an unknown kind, or a frame that is none."""

    def __init__(self, robot: Robot, request: Request) -> None:
        # Where its URDF cannot hold its own numbers, as of a run with a fitted tool, it is written as robot.yaml.
        self.robot = _whole(robot) if robot.left_out else robot
        super().__init__(self.robot.chain, self.robot.units, request)
        kind, usual = request.kind or "position", Instrument()
        look_up(RIGS, kind, "unknown kind", "--kind")
        if request.at is not None and kind in CONTACTS:
            touching = "where the tool touches, the joint values follow"
            raise ModelError(touching, key="--at", found=request.at, expected="--poses")
        fine = FINE.get(kind, usual.angle_noise) if request.angle_noise is None else request.angle_noise
        noise = usual.noise if request.noise is None else request.noise
        self.instrument = Instrument(kind, noise, fine, parse_frame(request.frame, self.units))
        self.kind, self.noise = kind, noise

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Joint values (m, n) within the limits."""
        if self.request.at is None:
            return sample_joints(self.machine, count, rng)
        return np.asarray(read_poses(self.request.at, self.machine)[1])

    def measure(self, truth: Chain, where: Array, rng: np.random.Generator) -> DataSet:
        """What the instrument reads at joint values (m, n)."""
        return measure(truth, where, self.instrument, rng)

    def largest_error(self, truth: Chain, where: Array) -> float:
        """How far the tool is off at joint values (m, n), in m."""
        off = truth.pose(where)[:, :3, 3] - self.machine.pose(where)[:, :3, 3]
        return float(np.linalg.norm(off, axis=1).max())

    def robot_files(self, truth: Chain, label: str) -> Mapping[str, str]:
        """The nominal and the true robot. Raises ModelError where the format cannot hold the truth."""
        robot = self.robot
        true_text, left_out = render_robot(robot, {p.name: p.value for p in truth.table.rows})
        if left_out:
            message = "this robot's format cannot hold these true values"
            raise ModelError(message, found=", ".join(left_out), expected="a robot.yaml")
        if robot.format == "urdf":
            return {"robot.urdf": robot.text, "truth.urdf": true_text}
        return {"robot.yaml": robot.text, "truth.yaml": label + true_text.partition("\n")[2]}

    def data_files(self, data: DataSet, label: str, stem: str = "") -> Mapping[str, str]:
        """The data with its frame unknown, a table and its description."""
        blind, name = hidden(data), stem or "data"
        return {
            f"{name}.csv": label + table_text(blind, self.machine, self.robot.units),
            f"{name}.yaml": label + data_text(blind, self.machine, f"{name}.csv", self.robot.units),
        }


def _whole(robot: Robot) -> Robot:
    """The same robot as robot.yaml."""
    text = describe(robot.chain, robot.units)
    name = "robot" if robot.path is None else robot.path.stem
    return parse_robot(Source(Path(f"{name}.yaml"), text, sha256(text.encode()).hexdigest()))
