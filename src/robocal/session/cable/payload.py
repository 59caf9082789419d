"""What load cells read, as the rows that a fit takes: one for each freedom of the platform instead of one for each cable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocal.cables.geometry import PLATFORM
from robocal.errors import FormatError
from robocal.files.cable.cablefile import CableFile
from robocal.measure.data import Observations

__all__ = ["payload_rows"]


def payload_rows(file: CableFile, obs: Observations) -> Observations:
    """Rows of the kind `load` from one reading of every cable. Raises FormatError where the platform's mass is not known, or there are
    fewer cables than freedoms."""
    robot = file.robot
    if robot.mass is None:
        raise FormatError(
            "load cells need the platform's mass",
            file=file.path,
            key="mass",
            expected="mass, and centre_of_mass, in the robot file",
        )
    d, m = len(robot.axes), len(robot.cables)
    if m < d:
        raise FormatError(
            "fewer cables than degrees of freedom do not hold the platform, so load cells do not determine it", file=obs.source, key="kind",
            found=f"{m} cables for {d}", expected="lengths, swivel, inclination",
        )  # fmt: skip
    at, where = np.unique(obs.configuration, return_inverse=True)
    tension = np.zeros((len(at), m))
    tension[where.ravel(), obs.extra["cable"].astype(np.int64)] = obs.value[:, 0]
    rows = np.zeros(len(at), dtype=np.int64)
    rows[where.ravel()] = obs.rows if obs.rows is not None else 0
    body = dict(zip(("mass", "cx", "cy", "cz"), (float(robot.mass), *map(float, robot.com)), strict=True))
    return replace(
        obs, configuration=np.repeat(at, d), value=np.zeros((len(at) * d, 1)),
        sigma=None if obs.sigma is None else np.full((len(at) * d, 1), obs.sigma[0, 0]),
        extra={"axis": np.tile(np.arange(d, dtype=float), len(at)), "tension": np.repeat(tension, d, axis=0)},
        options={**obs.options, "platform": PLATFORM, "values": body}, rows=np.repeat(rows, d), digits=None, used=None,
    )  # fmt: skip
