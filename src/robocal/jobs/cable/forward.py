"""The verb `cable forward`: poses of the platform from measured lengths of its cables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.cables.forward import Forward, forward
from robocal.cables.geometry import CableRobot
from robocal.errors import ModelError
from robocal.files.cable.lists import platform_text, read_cable_lengths
from robocal.files.cable.robot import read_cable
from robocal.files.dataset import InputFile
from robocal.files.units import number
from robocal.files.writing import write_text
from robocal.jobs.cable.document import framed
from robocal.jobs.cable.lists import fitting, located, tensions_of
from robocal.jobs.cable.load import robot_input
from robocal.jobs.simulate import refuse_existing
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["Poses", "cable_forward"]

Array = NDArray[np.float64]
UNSTATED = 0.01  # m; more than a length is off by in any robot whose noise nobody stated
UNLIKELY = 1e-6  # of the chi-squared of what is left: once in a million poses


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses with their evidence: `found` as `cables.forward` gives it, root mean squares of the residuals (k,) in m,
    one sigma of position in m and orientation in rad, (k, 2) (not a number where unknown), the CSV, what is odd about the
    robot, `doubts`: why a pose must not be trusted, and where the CSV was written."""

    robot: CableRobot
    names: tuple[str, ...]
    found: Forward
    rms: Array
    sigma: Array
    text: str
    warnings: tuple[Remark, ...]
    doubts: tuple[Remark, ...]
    inputs: tuple[InputFile, ...]
    command: str = ""
    written: Path | None = None

    @property
    def document(self) -> dict[str, Any]:
        """What --json prints."""
        found = self.found
        poses = [
            {
                "name": name,
                "T_base_platform": found.pose[i],
                "residual_m": self.rms[i],
                "sigma_position_m": self.sigma[i, 0],
                "sigma_orientation_rad": self.sigma[i, 1],
                "covariance": found.covariance[i],
                "converged": bool(found.converged[i]),
                "solutions": int(found.solutions[i]),
            }
            for i, name in enumerate(self.names)
        ]
        said = (*self.warnings, *self.doubts)
        return framed(self.robot, {"poses": poses}, warnings=said, inputs=self.inputs, command=self.command)


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
    command: str = "",
) -> Poses:
    """Poses from lengths; `sigma` is the noise of a length in the robot file's unit, `tension` that of every cable in
    its unit of force, `starts` how many further starts look for other solutions. Raises InputError."""
    if output is not None:
        refuse_existing(output.parent, (output.name,), force)
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
    return Poses(
        file.robot, rows.names, found, rms, spread, text, (*file.warnings, *rows.warnings, *said), doubts,
        (robot_input(file, robot), InputFile(Path(lengths), rows.sha256)), command,
        None if output is None else write_text(output, text),
    )  # fmt: skip


def _spread(found: Forward, robot: CableRobot) -> Array:
    """One sigma of the position and of the orientation, (k, 2): roots of the traces."""
    variances = np.einsum("kii->ki", found.covariance)
    moves = [i for i, axis in enumerate(robot.axes) if axis < 3]
    turns = [i for i, axis in enumerate(robot.axes) if axis >= 3]
    return np.asarray(np.sqrt(np.stack([variances[:, moves].sum(axis=1), variances[:, turns].sum(axis=1)], axis=1)))


def _shown(value: float, text: Callable[[float], str] = "{:.4g}".format) -> str:
    """Nothing where nothing is known."""
    return "" if np.isnan(value) else text(value)


def _doubts(names: tuple[str, ...], found: Forward, sigma: float | None) -> tuple[Remark, ...]:
    """Poses that were not found, are not the only ones, or do not fit their lengths."""
    from scipy.stats import chi2

    out = []
    spare = found.residual.shape[1] - found.covariance.shape[1]
    for i, name in enumerate(names):
        r = found.residual[i]
        if not np.isfinite(r).all():
            out.append(Remark.of(Code.NO_POSE, pose=name))
            continue
        if not found.converged[i]:
            out.append(Remark.of(Code.SEARCH_UNENDED, pose=name))
        if np.isnan(found.covariance[i]).any() and (sigma is not None or spare > 0):
            out.append(Remark.of(Code.SINGULAR_POSE, pose=name))
        if found.solutions[i] > 1:
            out.append(Remark.of(Code.SEVERAL_POSES, pose=name, count=int(found.solutions[i])))
        if sigma is not None and spare > 0 and chi2.sf((r @ r) / sigma**2, spare) < UNLIKELY:
            rms = Quantity(float(np.sqrt((r @ r) / spare)))
            out.append(Remark.of(Code.LENGTHS_UNEXPLAINED, pose=name, left=rms, expected=Quantity(sigma)))
        if sigma is None and (left := np.sqrt((r @ r) / len(r))) > UNSTATED:
            out.append(Remark.of(Code.LENGTHS_LEFT, pose=name, left=Quantity(float(left))))
    return tuple(out)
