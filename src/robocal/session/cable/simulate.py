"""A cable robot whose anchors and zeros are not quite where its file says: its sensors, and an instrument that sees the platform.

Cables are taken as straight and stiff. Poses lie in the middle of the frame; where the file knows the mass and the tension limits, only
those at which the cables hold the platform. Everything that it writes says simulated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.grid_regions import frame_box
from robocal.cables.tension import hold
from robocal.errors import ModelError, look_up
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.pose_lists import length_columns, read_platform_poses
from robocal.files.cable.write import describe_cable, render_cable
from robocal.files.display import listing_text
from robocal.files.units import number
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.parameters import FRAME_SYMBOLS
from robocal.quantities import Column, Listing
from robocal.session.simulator import Errors, Request, Simulator, parse_frame

__all__ = ["CableSimulator"]

MIDDLE = 0.6  # of the frame's box, along each axis
TURNED = 0.1  # rad, standard deviation about each axis
TRIES = 50  # times as many poses as are wanted, before it is said that the cables hold too few
LENGTH, PLACE, TURN = 5e-4, 5e-5, 1e-4  # noise where nobody states one: m of a length, m and rad of a pose
USUAL = ("ax", "ay", "az", "l0")  # what is off where the file frees nothing
KINDS = {"position": 3, "pose": 6}


class CableSimulator(Simulator[CableRobot]):
    """A cable robot with the sensors of its cables, before an instrument that stands somewhere. Raises ModelError for a kind that no
    platform is measured by, or a frame that is none."""

    usual: ClassVar[Errors] = Errors(length=0.01)

    def __init__(self, file: CableFile, request: Request) -> None:
        super().__init__(file.robot, file.units, request)
        self.file = file
        self.kind = request.kind or ("pose" if max(file.robot.axes) > 2 else "position")
        parts = look_up(KINDS, self.kind, "unknown kind", "--kind")
        given = ((request.noise, PLACE), (request.angle_noise, TURN), (request.length_noise, LENGTH))
        place, turn, self.noise = (usual if noise is None else noise for noise, usual in given)
        self.spread = np.repeat([place, turn], 3)[:parts]  # of what an instrument reads

    @property
    def imperfect(self) -> Sequence[str]:
        """What the file frees; where it frees nothing, frame anchors and zeros."""
        names = self.machine.table
        return names.free or tuple(n for n in names.names if n.rpartition(".")[2] in USUAL)

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Poses (k, 4, 4) of the platform. Raises ModelError where the cables hold it at too few."""
        if self.request.at is not None:
            return read_platform_poses(self.request.at, self.machine).values
        held = np.empty((0, 4, 4))
        for _ in range(TRIES):
            poses = self._anywhere(count, rng)
            held = np.concatenate([held, poses[_held(self.machine, poses)]])[:count]
            if len(held) == count:
                return held
        raise ModelError(
            "the cables hold the platform at few poses in the middle of the frame", found=f"{len(held)} of {count}",
            expected="--at FILE with poses of your own, or other tension limits in the robot's file",
        )  # fmt: skip

    def _anywhere(self, count: int, rng: np.random.Generator) -> Array:
        """Poses in the middle of the frame, turned a little."""
        robot = self.machine
        box, free = frame_box(robot)[0], list(robot.axes)
        vector = np.tile(se3.to_vector(robot.home[None])[0], (count, 1))
        place = box.mean(axis=1) + MIDDLE * (rng.uniform(size=(count, 3)) - 0.5) * np.ptp(box, axis=1)
        drawn = np.concatenate([place, rng.normal(0.0, TURNED, (count, 3))], axis=1)
        vector[:, free] = drawn[:, free]
        return se3.from_vector(vector)

    def measure(self, truth: CableRobot, where: Array, rng: np.random.Generator) -> DataSet:
        """Lengths, and what the instrument reads, at poses (k, 4, 4)."""
        k, m = len(where), len(truth.cables)
        ids = tuple(f"p{i + 1:0{len(str(k))}d}" for i in range(k))
        spread, frame = self.spread, parse_frame(self.request.frame, self.units)
        exact = not (self.noise > 0 and (spread > 0).all())
        lengths = Observations(
            "lengths", np.repeat(np.arange(k), m), np.zeros((k * m, 1)), None if exact else np.full((k * m, 1), self.noise),
            extra={"cable": np.tile(np.arange(m, dtype=float), k)}, options={"cables": truth.cables},
        )  # fmt: skip
        # Without a frame the instrument reads in base coordinates.
        seen = Observations(
            self.kind, np.arange(k), np.zeros((k, len(spread))), None if exact else np.tile(spread, (k, 1)),
            None if frame is None else Frame("tracker", frame, (True,) * 6, expected=(10.0, 3.0)),
        )  # fmt: skip
        blank = DataSet(Configurations(ids, start=se3.to_vector(where)), (lengths, seen))
        return synthesise(truth, blank, None if exact else rng)

    def largest_error(self, truth: CableRobot, where: Array) -> float:
        """How far a length of the model is off, in m."""
        from robocal.cables.cable_lengths import inverse

        return float(np.abs(inverse(truth, where, None)[0] - inverse(self.machine, where, None)[0]).max())

    def robot_files(self, truth: CableRobot, label: str) -> Mapping[str, str]:
        """The nominal and the true robot. Raises ModelError where the file cannot hold the truth."""
        true_text, left_out = render_cable(self.file, {p.name: p.value for p in truth.table.rows})
        if left_out:
            message = "this file cannot hold these true values"
            raise ModelError(message, found=", ".join(left_out), expected="zeros in it")
        native = self.file.format == "yaml"
        return {
            "robot.yaml": self.file.text if native else describe_cable(self.machine, self.file.units),
            "truth.yaml": label + (true_text.partition("\n")[2] if native else true_text),
        }

    def data_files(self, data: DataSet, label: str, stem: str = "") -> Mapping[str, str]:
        """The lengths, and what the instrument read from a place that is to be found."""
        before, units = f"{stem}-" if stem else "", self.file.units
        lengths, seen = data.observations
        ids = Column("id", "", data.configurations.ids)
        table = Listing((ids, *length_columns(self.machine, lengths.value.reshape(len(ids.values), -1))))
        read = zip(FRAME_SYMBOLS[: KINDS[seen.kind]], seen.value.T, strict=True)
        poses = Listing((ids, *(Column(s, "m" if s in "xyz" else "rad", v) for s, v in read)))
        what = [f"lengths: {{columns: [{', '.join(self.machine.cables)}]{_sigma(lengths, 0, units.length.factor)}}}"]
        place = [f"position: {{columns: [x, y, z]{_sigma(seen, 0, units.length.factor)}}}"]
        if seen.kind == "pose":
            turn = _sigma(seen, 3, units.angle.factor)
            place.append(f"orientation: {{columns: [rx, ry, rz], form: rotation_vector{turn}}}")
        place.append(f"frame: {{name: {'world, free: false' if seen.frame is None else 'tracker, free: true'}}}")
        return {
            f"{before}lengths.csv": label + listing_text(table, units),
            f"{before}lengths.yaml": label + _described("lengths", f"{before}lengths.csv", what),
            f"{before}{seen.kind}.csv": label + listing_text(poses, units),
            f"{before}{seen.kind}.yaml": label + _described(seen.kind, f"{before}{seen.kind}.csv", place),
        }


def _sigma(obs: Observations, column: int, factor: float) -> str:
    """The key of a standard deviation, in the unit of the columns."""
    return "" if obs.sigma is None else f", sigma: {number(float(obs.sigma[0, column]) / factor)}"


def _described(kind: str, file: str, lines: Sequence[str]) -> str:
    return "\n".join(["robocal: 1", f"kind: {kind}", f"file: {file}", *lines, "configuration: {id: id}"]) + "\n"


def _held(robot: CableRobot, poses: Array) -> NDArray[np.bool_]:
    """At which poses (k, 4, 4) the cables hold the platform's weight; everywhere, where that is not known."""
    if robot.mass is None or robot.limits is None or len(robot.cables) < len(robot.axes):
        return np.ones(len(poses), dtype=bool)
    return np.asarray(hold(robot, poses).feasible)
