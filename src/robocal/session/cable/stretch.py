"""Stretch and sag of cables whose lengths were read: by tensions that were read too, or by those that hold the platform's weight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.cables.geometry import CableRobot
from robocal.cables.hanging import hang
from robocal.cables.pulley import Pulleys, run
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.diagnose.cables.stretch import stretch
from robocal.diagnose.context import Context
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.kinds.lengths import COMPUTED
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3
from robocal.measure.data import DataSet, Observations
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["add_tensions"]

TAUT = "mid"  # tensions nearest to the middle of their limits


def add_tensions(file: CableFile, data: DataSet) -> tuple[DataSet, tuple[Remark, ...]]:
    """The data with a tension beside every length where it is to be computed, and what is said of stretch and sag.

    Raises ModelError where the robot does not know what is needed, or no tensions within the limits hold the platform.
    """
    said: list[Remark] = []
    out = list(data.observations)
    for i, obs in enumerate(out):
        if obs.kind != "lengths":
            continue
        if obs.options.get("tension") == COMPUTED:
            out[i] = obs = _compute_tensions(file.robot, data, obs)
        context: Context[CableRobot] = Context(file.robot, replace(data, observations=(obs,)))
        said += [f.remark for f in stretch.run(context)]
        if "tension" in obs.extra and file.robot.density is not None:
            out[i], sag = _hanging(file.robot, data, obs)
            said.append(sag)
    return replace(data, observations=tuple(out)), tuple(said)


def _compute_tensions(robot: CableRobot, data: DataSet, obs: Observations) -> Observations:
    """Tensions at the poses from which a fit starts: what it moves them by changes a tension by little, and its stretch by less."""
    mass, limits = float(robot.need("mass")), robot.need("limits")
    if robot.density is None:
        robot.need("elasticity")
    start = place_configurations(robot, data).configurations.start
    assert start is not None
    at = np.unique(obs.configuration)
    pose = se3.from_vector(start[at])
    weight = gravity_wrench(pose, mass, robot.com)[:, list(robot.axes)]
    found = distribute(structure_of(robot, pose), weight, limits, TAUT)
    if not found.has_solution.all():
        lost = [data.configurations.ids[at[k]] for k in np.flatnonzero(~found.has_solution)]
        raise ModelError(
            "no tensions within the limits hold the platform", key="tension", found=f"{len(lost)} poses, such as {lost[0]}",
            expected="columns of measured tensions, other limits, or no `tension`",
        )  # fmt: skip
    of = np.searchsorted(at, obs.configuration), obs.extra["cable"].astype(np.int64)
    return replace(obs, extra={**obs.extra, "tension": found.tension[of]})


def _hanging(robot: CableRobot, data: DataSet, obs: Observations) -> tuple[Observations, Remark]:
    """What sag makes of every length at the poses from which a fit starts: of some hundredths of a millimetre to a millimetre, what
    the fit moves them by changes the ten thousandth part."""
    start = place_configurations(robot, data).configurations.start
    assert start is not None
    cable = obs.extra["cable"].astype(np.int64)
    t = se3.from_vector(start[obs.configuration])
    d = t[:, :3, 3] + np.einsum("kij,kj->ki", t[:, :3, :3], robot.b[cable]) - robot.a[cable]
    wheels = None if robot.pulleys is None else Pulleys(robot.pulleys.radius[cable], robot.pulleys.axis[cable])
    strain = np.zeros(len(cable)) if robot.elasticity is None else robot.elasticity[cable]
    taut = run(d, wheels)[0] / (1.0 + strain * obs.extra["tension"])
    hung = hang(d, obs.extra["tension"], robot.need("density")[cable], strain, wheels).length
    lost = ~np.isfinite(hung) & np.isfinite(taut)
    if lost.any():
        at = int(np.flatnonzero(lost)[0])
        raise ModelError(
            f"the tension of {robot.cables[cable[at]]} does not carry its weight", key="tension",
            found=f"{obs.extra['tension'][at]:.4g} N, configuration {data.configurations.ids[obs.configuration[at]]}",
            expected="a greater tension, or another density in the robot's file",
        )  # fmt: skip
    share = np.where(np.isfinite(hung), hung / taut, 1.0)
    most = float(np.nanmax(np.abs(hung - taut), initial=0.0))
    return replace(obs, extra={**obs.extra, "hanging": share}), Remark.of(Code.SAG_TAKEN, most=Quantity(most))
