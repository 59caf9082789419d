"""Stretch of cables whose lengths were read: by tensions that were read too, or by those that hold the platform's weight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.calibrate.starts.own import placed
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.kinds.lengths import COMPUTED
from robocal.geometry import se3
from robocal.measure.data import DataSet, Observations
from robocal.measure.lengths import owner
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["stretched"]

Array = NDArray[np.float64]
TAUT = "mid"  # tensions nearest to the middle of their limits


def stretched(file: CableFile, data: DataSet) -> tuple[DataSet, tuple[Remark, ...]]:
    """The data with a tension beside every length where it is to be computed, and what is said of stretch.

    Raises ModelError where the robot does not know what is needed, or no tensions within the limits hold the platform.
    """
    said: list[Remark] = []
    out = list(data.observations)
    for i, obs in enumerate(out):
        if obs.kind != "lengths":
            continue
        if obs.options.get("tension") == COMPUTED:
            out[i] = obs = _computed(file.robot, data, obs)
        said += _said(file, obs)
    return replace(data, observations=tuple(out)), tuple(said)


def _computed(robot: CableRobot, data: DataSet, obs: Observations) -> Observations:
    """Tensions at the poses from which a fit starts: what it moves them by changes a tension by little, and its stretch by less."""
    mass, limits = float(robot.need("mass")), robot.need("limits")
    robot.need("elasticity")
    start = placed(robot, data).configurations.start
    assert start is not None
    at = np.unique(obs.configuration)
    pose = se3.from_vector(start[at])
    weight = gravity_wrench(pose, mass, robot.com)[:, list(robot.axes)]
    found = distribute(structure_of(robot, pose), weight, limits, TAUT)
    if not found.found.all():
        lost = [data.configurations.ids[at[k]] for k in np.flatnonzero(~found.found)]
        raise ModelError(
            "no tensions within the limits hold the platform", key="tension", found=f"{len(lost)} poses, such as {lost[0]}",
            expected="columns of measured tensions, other limits, or no `tension`",
        )  # fmt: skip
    of = np.searchsorted(at, obs.configuration), obs.extra["cable"].astype(np.int64)
    return replace(obs, extra={**obs.extra, "tension": found.tension[of]})


def _said(file: CableFile, obs: Observations) -> list[Remark]:
    """What stretch does to these lengths, or would."""
    robot = file.robot
    if robot.elasticity is None:
        return [Remark.of(Code.TENSIONS_ASIDE, robot=robot.name)] if "tension" in obs.extra else []
    cable = obs.extra["cable"].astype(np.int64)
    full = obs.value[:, 0] + robot.zeros[cable]
    if owner(obs):  # what they count from is not known yet
        full = np.linalg.norm(robot.home[:3, 3] - robot.a, axis=1)[cable]
    if "tension" in obs.extra:
        most = float(np.max(robot.elasticity[cable] * obs.extra["tension"] * full, initial=0.0))
        how = "computed" if obs.options.get("tension") == COMPUTED else "measured"
        return [Remark.of(Code.STRETCH_TAKEN, most=Quantity(most), how=how)]
    if robot.limits is None:
        return []
    most = float(np.max(robot.elasticity[cable] * np.ptp(robot.limits, axis=1)[cable] * full, initial=0.0))
    return [Remark.of(Code.STRETCH_LEFT, most=Quantity(most))]
