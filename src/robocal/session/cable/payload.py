"""What load cells and winches read, as the rows that a fit takes: one for each freedom of the platform instead of one for each cable."""

from __future__ import annotations

import numpy as np

from robocal._record import replace
from robocal._types import Array
from robocal.cables.geometry import PLATFORM, CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.measure.cable.winch_tensions import ratio_of
from robocal.measure.data import DataSet, Observations
from robocal.measure.winches import fit_friction, number_of, numbers_of

__all__ = ["payload_rows", "tensions_of_winches"]


def payload_rows(file: CableFile, obs: Observations) -> Observations:
    """Rows of load cells or winches from one reading of every cable. Raises FormatError where the platform's mass is not known, or fewer
    cables than freedoms hold it."""
    robot = file.robot
    if robot.mass is None:
        expected = "mass, and centre_of_mass, in the robot file"
        raise FormatError(
            "load cells and winches need the platform's mass", file=file.path, key="mass", expected=expected
        )
    d, m = len(robot.axes), len(robot.cables)
    if m < d:
        raise FormatError(
            "fewer cables than degrees of freedom do not hold the platform, so load cells do not determine it", file=obs.source, key="kind",
            found=f"{m} cables for {d}", expected="lengths, swivel, inclination",
        )  # fmt: skip
    at, of = np.unique(obs.configuration, return_inverse=True)
    where, cable, rows = of.ravel(), obs.extra["cable"].astype(np.int64), np.zeros(len(at), dtype=np.int64)
    rows[where] = obs.rows if obs.rows is not None else 0

    def table(values: Array) -> Array:
        out = np.zeros((len(at), m))
        out[where, cable] = values
        return np.repeat(out, d, axis=0)

    options = dict(obs.options)
    body = dict(zip(("mass", "cx", "cy", "cz"), (float(robot.mass), *map(float, robot.com)), strict=True))
    if obs.kind == "load":
        read, to_tension = {"tension": table(obs.value[:, 0])}, 1.0
    else:
        read = {"current": table(obs.value[:, 0]), "speed": table(obs.extra["speed"])}
        to_tension = ratio_of(obs) * number_of(obs, "kt")
        body |= numbers_of(obs)
    sigma = None if obs.sigma is None else np.full((len(at) * d, 1), to_tension * obs.sigma[0, 0])
    return replace(
        obs, configuration=np.repeat(at, d), value=np.zeros((len(at) * d, 1)), sigma=sigma,
        extra={"axis": np.tile(np.arange(d, dtype=float), len(at)), **read}, options={**options, "platform": PLATFORM, "values": body},
        rows=np.repeat(rows, d), digits=None, used=None,
    )  # fmt: skip


def tensions_of_winches(robot: CableRobot, data: DataSet, obs: Observations, start: Array) -> Observations:
    """Lengths with the tensions that the currents beside them tell: friction and torque constant as they best hold the platform's weight
    at poses (U, 4, 4) from which a fit starts. Raises ModelError where a length has no current beside it."""
    winches = [o for o in data.observations if o.kind == "winches"]
    if not winches:
        raise ModelError(
            "no currents stand beside these lengths",
            key="tension",
            found="currents",
            expected="a file with kind: winches",
        )
    m = len(robot.cables)
    known, pair = (
        np.full((3, len(data.configurations), m), np.nan),
        (obs.configuration, obs.extra["cable"].astype(np.int64)),
    )
    for one in winches:
        at, first = np.unique(one.configuration, return_index=True)
        pose, current, speed = start[at], one.extra["current"][first], one.extra["speed"][first]
        load = gravity_wrench(pose, float(robot.need("mass")), robot.com)[:, list(robot.axes)]
        known[:, at] = np.stack([fit_friction(one, structure_of(robot, pose), load, current, speed), current, speed])
    tension, current, speed = known[:, pair[0], pair[1]]
    if np.isnan(tension).any():
        lost = data.configurations.ids[obs.configuration[np.flatnonzero(np.isnan(tension))[0]]]
        raise ModelError(
            "a length without a current beside it",
            key="tension",
            found=lost,
            expected="currents of every row of the lengths",
        )
    if len(winches) > 1:
        raise ModelError(
            "currents of several files beside one file of lengths",
            key="tension",
            found=len(winches),
            expected="one file",
        )
    extra = {**obs.extra, "tension": np.maximum(tension, 0.0), "current": current, "speed": speed}
    shared = {k: winches[0].options[k] for k in ("winches", "ratio")}
    return replace(obs, extra=extra, options={**obs.options, **shared})
