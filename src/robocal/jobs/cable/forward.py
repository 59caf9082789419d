"""The verb `cable forward`: poses of the platform from measured lengths of its cables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robocal.cables.forward import Forward, forward
from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.files.cable.lists import platform_text, read_cable_lengths
from robocal.files.cable.robot import read_cable
from robocal.files.units import number
from robocal.jobs.cable.inverse import fitting, located, tensions_of, written

__all__ = ["Poses", "cable_forward"]

Array = NDArray[np.float64]
UNSTATED = 0.01  # m; more than a length is off by in any robot whose noise nobody stated
UNLIKELY = 1e-6  # of the chi-squared of what is left: once in a million poses


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses with their evidence: `found` as `cables.forward` gives it, root mean squares of the residuals (k,) in m,
    one sigma of position (k,) in m and orientation (k,) in rad (not a number where unknown), the CSV, where it was
    written, what is odd about the robot, and `doubts`: why a pose must not be trusted."""

    robot: CableRobot
    names: tuple[str, ...]
    found: Forward
    rms: Array
    sigma: Array
    text: str
    written: Path | None
    warnings: tuple[str, ...]
    doubts: tuple[str, ...]


def cable_forward(
    robot: str,
    lengths: str,
    *,
    sigma: float | None = None,
    starts: int = 24,
    tension: float | None = None,
    sag: bool = False,
    seed: int = 0,
    output: Path | None = None,
    force: bool = False,
) -> Poses:
    """Poses from lengths; `sigma` is the noise of a length in the robot file's unit, `tension` that of every cable in
    its unit of force, `starts` how many further starts look for other solutions. Raises InputError."""
    file = read_cable(robot)
    rows = read_cable_lengths(lengths, file.robot)
    if sigma is not None and not sigma > 0:
        raise ModelError("a noise is a standard deviation", key="--sigma", found=sigma, expected="above 0")
    noise = None if sigma is None else file.units.length.to_si(sigma)
    (pull, said), rng = tensions_of(rows, tension, file, sag), np.random.default_rng(seed)
    fitting(file, pull, sag)
    try:
        found = forward(file.robot, rows.values, tension=pull, sag=sag, sigma=noise, starts=starts, rng=rng)
    except ModelError as error:
        raise located(error, lengths, rows) from None
    rms = np.sqrt((found.residual**2).mean(axis=1))
    spread = _spread(found, file.robot)
    length, angle = file.units.length, file.units.angle
    more = {
        f"residual [{length.name}]": [_shown(length.from_si(float(v)), number) for v in rms],
        f"sigma_position [{length.name}]": [_shown(length.from_si(float(v))) for v in spread[:, 0]],
        f"sigma_orientation [{angle.name}]": [_shown(angle.from_si(float(v))) for v in spread[:, 1]],
        "solutions": [str(int(n)) for n in found.solutions],
    }
    text = platform_text(rows.names, found.pose, file.units, more)
    doubts = _doubts(rows.names, found, noise)
    place = written(output, text, force)
    return Poses(file.robot, rows.names, found, rms, spread, text, place, (*file.warnings, *said), doubts)


def _spread(found: Forward, robot: CableRobot) -> Array:
    """One sigma of the position and of the orientation, (k, 2): roots of the traces."""
    variances = np.einsum("kii->ki", found.covariance)
    moves = [i for i, axis in enumerate(robot.axes) if axis < 3]
    turns = [i for i, axis in enumerate(robot.axes) if axis >= 3]
    return np.asarray(np.sqrt(np.stack([variances[:, moves].sum(axis=1), variances[:, turns].sum(axis=1)], axis=1)))


def _shown(value: float, text: Callable[[float], str] = "{:.4g}".format) -> str:
    """Nothing where nothing is known."""
    return "" if np.isnan(value) else text(value)


def _doubts(names: tuple[str, ...], found: Forward, sigma: float | None) -> tuple[str, ...]:
    """Poses that were not found, are not the only ones, or do not fit their lengths."""
    from scipy.stats import chi2

    out = []
    spare = found.residual.shape[1] - found.covariance.shape[1]
    for i, name in enumerate(names):
        r = found.residual[i]
        if not np.isfinite(r).all():
            out.append(f"{name}: no pose was found at which cables can hang so")
            continue
        if not found.converged[i]:
            out.append(f"{name}: the search did not end at a minimum")
        if np.isnan(found.covariance[i]).any() and (sigma is not None or spare > 0):
            out.append(f"{name}: near this pose the lengths do not say where the platform is: a singular pose")
        if found.solutions[i] > 1:
            out.append(f"{name}: {found.solutions[i]} poses explain these lengths equally well")
        if sigma is not None and spare > 0 and chi2.sf((r @ r) / sigma**2, spare) < UNLIKELY:
            rms = np.sqrt((r @ r) / spare) * 1e3
            out.append(f"{name}: no pose explains these lengths: {rms:.3g} mm are left, {sigma * 1e3:.3g} mm expected")
        if sigma is None and (left := np.sqrt((r @ r) / len(r))) > UNSTATED:
            out.append(f"{name}: {left * 1e3:.3g} mm are left of its lengths; --sigma says what may be")
    return tuple(out)
