"""Trials of calibrations of cable robots, every cable by itself from poses as they were measured."""

from __future__ import annotations

import numpy as np

from robocal._jit import as_kernel_array
from robocal._types import Array
from robocal.cables.calibration.per_cable import per_cable
from robocal.cables.calibration.propagation import ErrorPropagation, Noise, rms
from robocal.cables.geometry import CableRobot
from robocal.cables.pulley import Pulleys
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.pose_lists import read_platform_poses
from robocal.files.studyfile import Point
from robocal.geometry import se3, so3

__all__ = ["CableTrials"]

OUTPUTS = {"anchors": "m", "zeros": "m"}
LISTS = 50  # random lists of which linear theory is asked


class CableTrials:
    """One point of a study: rms of the errors of the components of frame anchors, and of the zeros, of every trial, m.

    Poses are those of a file, or drawn again for every trial about the mean of the frame anchors. Lengths, positions and orientations
    (a small rotation in front) have normal noise, and constant errors on top.
    """

    def __init__(self, point: Point) -> None:
        self.point = point
        self.outputs = {name: OUTPUTS[name] for name in point["outputs"]}
        self.robot: CableRobot = read_cable(point["robot"]).robot
        m = len(self.robot.cables)
        wheel = self.robot.pulleys or Pulleys(np.zeros(m), np.tile([0.0, 0.0, 1.0], (m, 1)))
        rows = np.column_stack([self.robot.a, self.robot.b, self.robot.zeros, wheel.radius, wheel.axis])
        self.numbers = as_kernel_array(rows)
        noise = np.repeat([point["noise.position"], point["noise.orientation"], point["noise.length"]], [3, 3, 1])
        self.off = [i for i in range(6) if i not in self.robot.axes]
        along = np.array(point["bias.along"])
        place, turn = point["bias.position"] * along, point["bias.orientation"] * along
        bias = np.concatenate([place, turn, [point["bias.length"]]])
        noise[self.off] = bias[self.off] = 0.0
        self.sigma, self.bias = as_kernel_array(noise), as_kernel_array(bias)
        # The poses of a file, (1, n, 6). Read at once, so that a list that is not there is told before the first trial.
        listed = point["poses.file"]
        self._listed = None if listed is None else se3.to_vector(read_platform_poses(listed, self.robot).values)[None]

    def _poses(self, count: int, rng: np.random.Generator) -> Array:
        if self._listed is not None:
            return self._listed
        n, half = self.point["poses.count"], np.repeat([self.point["poses.shift"], self.point["poses.turn"]], 3)
        half[self.off] = 0.0
        middle = np.concatenate([self.robot.home[:3, 3], np.zeros(3)])
        return np.asarray(rng.uniform(middle - half, middle + half, (count, n, 6)))

    def run(self, count: int, rng: np.random.Generator) -> dict[str, Array]:
        """The outputs of so many trials, (count,)."""
        from robocal.studies._kernels import seen_lists

        pose = as_kernel_array(self._poses(count, rng))
        n, m = pose.shape[1], len(self.robot.cables)
        off, lengths = rng.standard_normal((count, n, 6)), rng.standard_normal((count, n, m))
        seen = np.empty((count, n, 4, 4))
        seen_lists(pose, off, lengths, self.bias, self.sigma, self.numbers, seen)
        found = per_cable(self.robot, seen, lengths, residual=self.point["residual"])
        a, z = found.anchors - self.robot.a, found.zeros - self.robot.zeros
        errors = {"anchors": np.sqrt((a**2).mean(axis=(1, 2))), "zeros": np.sqrt((z**2).mean(axis=1))}
        return {name: np.where(found.converged.all(axis=1), errors[name], np.nan) for name in self.outputs}

    def theory(self, rng: np.random.Generator) -> dict[str, float]:
        """The same by linear theory: root mean squares over trials."""
        noise = Noise(self.point["noise.length"], self.point["noise.position"], self.point["noise.orientation"])
        if not (self.sigma.any() or self.bias.any()):
            return {}
        squares = []
        for pose in self._poses(1 if self._listed is not None else LISTS, rng):
            t = se3.compose(so3.exp(pose[:, 3:]), pose[:, :3])
            design, squared = ErrorPropagation(self.robot, t), self.point["residual"] == "squared"
            of = np.square(design.rms_errors(design.covariance(noise, squared=squared)))
            a, z = design.propagate(lengths=self.bias[6], places=self.bias[:3], turns=self.bias[3:6], squared=squared)
            if squared:
                more = design.bias_of_squares(noise)
                a, z = a + more[0], z + more[1]
            squares.append(of + np.square(rms(a, z)))
        return dict(zip(OUTPUTS, map(float, np.sqrt(np.mean(squares, axis=0))), strict=True))
