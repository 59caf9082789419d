"""Calibration and verification of a virtual rig: what `identify` makes of its files, and how far poses are off afterwards.

The robot's pose comes from lengths and tensions by the calibrated robot, the camera's from one image in the identified map. Both are told
beside an external instrument's, and the robot's beside the truth, which a simulation knows: e = (p - p_0, log(R R_0^T)), and

    normalised = sqrt(mean of e^T C^-1 e / 6),    C from the run's covariance and the noise of lengths

is 1 where the run says honestly how far it may be off.
"""

from __future__ import annotations

import datetime
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.apply.verification import PoseErrors, errors, relative
from robocal.cables.forward import forward
from robocal.cables.geometry import CableRobot
from robocal.cables.gradient import pose_covariance
from robocal.files.display import to_display
from robocal.files.parts import provenance_of
from robocal.files.result import Provenance
from robocal.fit.options import Options
from robocal.fit.starts.cameras import resect
from robocal.geometry import se3, so3
from robocal.progress import Watch
from robocal.prove.identify import identify
from robocal.session.cable.calibrated import Calibrated, open_calibrated
from robocal.session.commissioning.rig_files import LENS, Recording
from robocal.session.commissioning.rig_world import RigWorld
from robocal.session.identify_outcome import IdentifyOutcome, residual_columns, save, to_result
from robocal.session.inputs import read_inputs
from robocal.simulation.cable_rig.marker_grid import corners_of
from robocal.vision.camera import unproject

__all__ = ["CalibratedList", "Verification", "calibrate", "verify_list"]

FOLDS, FOLDED = 5, 25  # grid: of a list everything is unseen once, where it has so many poses
FEWEST = 4  # grid: corners that tell a pose of the camera


@record(eq=False)
class CalibratedList:
    """A list of poses and what came of it: its name, what was recorded, the outcome of `identify` and the robot with what is known."""

    name: str
    recording: Recording
    outcome: IdentifyOutcome
    calibrated: Calibrated

    @property
    def robot(self) -> CableRobot:
        """As identified."""
        return self.calibrated.robot

    @property
    def values(self) -> Mapping[str, float]:
        """Everything that was fitted or stated, by name, in SI."""
        return {p.name: p.value for p in self.outcome.identification.table.rows}


@record(eq=False)
class Verification:
    """Verification poses of a list: what was recorded, the poses (k, 4, 4) of the robot by its lengths with the covariance (k, 6, 6) of
    each, those of the camera (not a number where it shows too little), and the rms (m) of what is left of the lengths."""

    recording: Recording
    robot: Array
    covariance: Array
    camera: Array
    residual: float

    @property
    def normalised(self) -> float:
        """Rms of the six numbers of the error against the truth, by their covariance."""
        true = self.recording.true
        turn = so3.log(self.robot[:, :3, :3] @ np.swapaxes(true[:, :3, :3], 1, 2))
        e = np.concatenate([self.robot[:, :3, 3] - true[:, :3, 3], turn], axis=1)
        whole = np.einsum("ki,kij,kj->k", e, np.linalg.inv(self.covariance), e)
        return float(np.sqrt(whole.mean() / 6))

    def against_truth(self) -> tuple[PoseErrors, PoseErrors, PoseErrors]:
        """Errors of the robot as it stands, relative to the first pose, and by how far it moved from there in base axes."""
        true = self.recording.true
        return errors(self.robot, true), relative(self.robot, true), errors(_moves(self.robot), _moves(true))


def _moves(poses: Array) -> Array:
    """Poses (k - 1, 4, 4) as motions from the first one: p_i - p_1 and R_i R_1^T, in base axes."""
    turn = poses[1:, :3, :3] @ poses[0, :3, :3].T
    return se3.compose(turn, poses[1:, :3, 3] - poses[0, :3, 3])


def calibrate(
    folder: Path, name: str, recording: Recording, command: str, seed: int, watch: Watch | None
) -> CalibratedList:
    """Identifies from the files of a folder, and writes the run into it. Raises InputError."""
    started, clock = datetime.datetime.now(datetime.UTC), time.perf_counter()
    inputs = read_inputs(folder / "robot.yaml", [folder / "lengths.yaml", folder / "pixels.yaml"], watch=watch)
    many = len(recording.ids) >= FOLDED
    options = Options(folds=FOLDS, leave_one_out=False, seed=seed) if many else Options(seed=seed)
    found = identify(inputs.opened.machine, inputs.data, options, watch)
    recipe = to_display(
        Provenance, provenance_of(command, inputs.files), seed=seed, started=started.isoformat(timespec="seconds"),
        seconds=round(time.perf_counter() - clock, 3), left_out=[],
        options={"folds": FOLDS, "leave_one_out": False} if many else {},
    )  # fmt: skip
    result = to_result(found, inputs.opened, recipe, inputs.warnings)
    made = save(IdentifyOutcome(result, residual_columns(found), found, inputs.opened), folder / "run")
    return CalibratedList(name, recording, made, open_calibrated(str(folder / "run")))


def verify_list(world: RigWorld, found: CalibratedList, made: Recording) -> Verification:
    """Where robot and camera say that the platform was at the poses of a recording."""
    robot = found.robot
    solved = forward(robot, made.readings, made.asked, tension=made.stated, sigma=world.spec.model.cable.length_noise)
    known = found.calibrated.estimates
    carried = np.zeros_like(solved.covariance)
    if known is not None:
        gains = found.calibrated.gains.columns(made.readings)
        carried = pose_covariance(robot, solved.pose, known.names, known.whole, gains)
    rms = float(np.sqrt((solved.residual**2).mean()))
    return Verification(made, solved.pose, solved.covariance + carried, camera_poses(world, found.values, made), rms)


def camera_poses(world: RigWorld, values: Mapping[str, float], made: Recording) -> Array:
    """The platform (k, 4, 4) by one image each, in the identified map through the identified lens."""
    lens = np.array([values.get(f"lens.{s}", v) for s, v in zip(LENS, world.stated_lens, strict=True)])
    found = _frame(values, "eye", None)
    eye = world.spec.eye if found is None else found
    own = corners_of(world.spec.model.markers.size * values.get("print.size", 1.0))
    out = np.full((len(made.ids), 4, 4), np.nan)
    for view in range(len(made.ids)):
        points, pixels = [], []
        for v, m, corners in made.corners:
            place = world.markers[0] if m == 0 and not world.beacons else _frame(values, f"m{m}", None)
            if v == view and place is not None:
                points.append(own @ place[:3, :3].T + place[:3, 3])
                pixels.append(corners)
        if len(points) * 4 < FEWEST:
            continue
        along = unproject(np.concatenate(pixels), lens)
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        (best,) = resect(np.concatenate(points), along, 1)
        out[view] = se3.inverse(best) @ se3.inverse(eye)
    return out


def _frame(values: Mapping[str, float], owner: str, otherwise: Array | None) -> Array | None:
    """A pose (4, 4) by the names of its six numbers."""
    names = [f"{owner}.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")]
    if not all(n in values for n in names):
        return otherwise
    return np.asarray(se3.from_vector(np.array([values[n] for n in names])))
