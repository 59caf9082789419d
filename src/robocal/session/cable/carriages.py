"""Where the carriages of anchors on rails stood, as a file of lengths says it by the names of cables, for every length."""

from __future__ import annotations

import numpy as np

from robocal._record import replace
from robocal.cables.geometry import CableRobot
from robocal.errors import FormatError
from robocal.files.kinds.lengths import CARRIAGE
from robocal.measure.data import Observations

__all__ = ["carried"]


def carried(robot: CableRobot, obs: Observations) -> Observations:
    """Lengths with extra["carriage"] (k,) in m, not a number where the carriage stood as the robot says. Raises FormatError for a cable
    that there is not, for one without a rail, and beside tensions: what pulls at an anchor that moves is not computed."""
    told = {key.removeprefix(CARRIAGE): column for key, column in obs.extra.items() if key.startswith(CARRIAGE)}
    if not told:
        return obs
    railed = () if robot.rails is None else tuple(
        robot.cables[c] for c in dict.fromkeys(robot.segments.cable[robot.rails[:, 2:].any(axis=1)].tolist())
    )  # fmt: skip
    for name in told:
        if name not in railed:
            expected = (
                f"one of {', '.join(railed)}"
                if railed
                else "rail: {direction: [x, y, z], carriage: 0} in the robot's file"
            )
            raise FormatError(
                "no anchor of this cable is on a rail",
                file=obs.source,
                key="carriage.cables",
                found=name,
                expected=expected,
            )
    if "tension" in obs.extra or obs.options.get("tension"):
        expected = "lengths without a tension"
        raise FormatError(
            "tensions beside anchors that move on rails", file=obs.source, key="tension", expected=expected
        )
    cable, read = obs.extra["cable"].astype(np.int64), np.full(len(obs), np.nan)
    for name, column in told.items():
        mine = cable == robot.cables.index(name)
        read[mine] = column[mine]
    extra = {key: v for key, v in obs.extra.items() if not key.startswith(CARRIAGE)}
    return replace(obs, extra={**extra, "carriage": read})
