"""Tensions that were read, beside the platform that they hold: refused where no platform at rest hangs so."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal.diagnose.cables.balance import Balance, balance
from robocal.diagnose.limits import CELL_UNIT_NEAR, TENSION_FARTHER, TENSION_MASS, TENSION_POSES
from robocal.errors import FormatError, ToWrite
from robocal.files.cable.cablefile import CableFile
from robocal.fit.starts.own import placed
from robocal.geometry import se3
from robocal.measure.data import DataSet, Observations
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["at_rest"]

Array = NDArray[np.float64]
KNOWN = {9.80665: "kgf for N", 4.4482216152605: "lbf for N", 1000.0: "kN for N", 0.001: "mN for N"}


def at_rest(file: CableFile, data: DataSet) -> tuple[Remark, ...]:
    """What is said of the tensions of all observations. Raises FormatError for those that hold no platform at rest."""
    said: list[Remark] = []
    start: Array | None = None
    for obs in data.observations:
        if "tension" not in obs.extra or obs.options.get("tension") is not None:
            continue
        if start is None:
            start = placed(file.robot, data).configurations.start
        assert start is not None
        at, pull = _every(file, obs)
        if len(at) < TENSION_POSES or len(file.robot.cables) < len(file.robot.axes):
            continue
        said += _judged(file, obs, balance(file.robot, se3.from_vector(start[at]), pull))
    return tuple(said)


def _every(file: CableFile, obs: Observations) -> tuple[NDArray[np.int64], Array]:
    """Configurations (k,) and their tensions (k, m), of which none is missing."""
    at, where = np.unique(obs.configuration, return_inverse=True)
    if obs.extra["tension"].ndim == 2:
        _, first = np.unique(obs.configuration, return_index=True)
        return at, obs.extra["tension"][first]
    out = np.full((len(at), len(file.robot.cables)), np.nan)
    out[where.ravel(), obs.extra["cable"].astype(np.int64)] = obs.extra["tension"]
    whole = np.isfinite(out).all(axis=1)
    return at[whole], out[whole]


def _judged(file: CableFile, obs: Observations, found: Balance) -> list[Remark]:
    load = obs.kind == "load"
    key = "load" if load else "tension"
    names = file.robot.cables
    left = f"they leave {found.left:.3g} N of force, geometry would {found.allowed:.3g} N"
    if found.exchanged is not None:
        i, j = found.exchanged
        raise FormatError(
            f"the tensions of {names[i]} and {names[j]} are exchanged: {left}", file=obs.source, key=f"{key}.columns",
            expected=ToWrite(f"their columns in the order of {names[i]}, {names[j]}"),
        )  # fmt: skip
    if found.shifted is not None:
        raise FormatError(
            f"the tensions stand {abs(found.shifted)} rows too {'low' if found.shifted > 0 else 'high'}: {left}", file=obs.source, key=key,
            expected="each beside the id of its pose",
        )  # fmt: skip
    if found.left > found.allowed * (1.0 if load else TENSION_FARTHER):
        raise FormatError(
            "these tensions cannot hold a platform at rest", file=obs.source, key=key, found=left,
            expected="the order of the columns as that of the cables, one unit, the platform at rest",
        )  # fmt: skip
    mass = file.robot.mass
    if mass is None or mass / TENSION_MASS < found.mass < mass * TENSION_MASS:
        return []
    if load:
        factor = mass / found.mass if found.mass > 0 else np.inf
        unit = next((w for f, w in KNOWN.items() if abs(factor / f - 1) < CELL_UNIT_NEAR), "another unit, or no tare")
        raise FormatError(
            "the load cells measure another mass than that of the platform", file=obs.source, key="load.unit",
            found=f"{found.mass:.3g} kg where the robot's file states {mass:.3g} kg ({unit}?)",
            expected="the unit of the cells, or the platform's mass in the robot's file",
        )  # fmt: skip
    return [Remark.of(Code.TENSIONS_WEIGH, mass=Quantity(found.mass, "kg"), stated=Quantity(mass, "kg"))]
