"""The verb `cable poses`: a list of poses that can be reached and left again, the program for it, and the poses worth
measuring."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robocal.cables.boundary import statics_along
from robocal.cables.geometry import EXPECTED, CableRobot
from robocal.cables.poses import PoseBox, PoseList, reachable_poses
from robocal.cables.program import kept_to_what_is_held
from robocal.cables.start import Clearance, Start
from robocal.cables.tension import check_method
from robocal.cables.workspace import Demand
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.program import list_text, program_text
from robocal.files.plain import json_text
from robocal.jobs.cable.load import numbers_of, said_of
from robocal.jobs.cable.poses_result import Listed
from robocal.planning.cable import Noise
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = ["doubts", "listing_of", "noise_of", "sane", "texts"]

Array = NDArray[np.float64]
STEPS = 256  # in which a motion is asked whether the platform is held
MOST = 200_000  # waypoints, which take half a minute and a gigabyte
UNSTATED = 1e-3  # m, noise of a length that nobody stated


def listing_of(
    robot: CableRobot,
    start: Start,
    box: PoseBox,
    clearance: Clearance,
    count: int,
    margin: float,
    seed: int,
    steps: int,
) -> PoseList:
    """Poses at the ends of free motions, each held at all of its waypoints too."""
    demand = Demand(np.array([robot.mass]))
    listing = reachable_poses(
        robot.a, robot.b, count, np.random.default_rng(seed), feasible=statics_along(robot, demand, STEPS),
        start=start.pose, box=box, margin=margin, diameter=clearance.diameter, body=clearance.body,
        relief=clearance.relief, axes=robot.axes,
    )  # fmt: skip
    return kept_to_what_is_held(robot, demand, listing, steps)


def sane(count: int, steps: int, margin: float, method: str) -> None:
    if count * steps > MOST:
        raise ModelError(
            "too many waypoints",
            key="--steps",
            found=f"{count} poses, {steps} steps",
            expected=f"at most {MOST} in all",
        )
    if not 0 < margin <= 1:
        raise ModelError("out of range", key="--mu", found=margin, expected="above 0 and at most 1")
    with said_of({"method": "--method"}):
        check_method(method)


def noise_of(file: CableFile, sigma: float | None, pose_noise: str | None) -> Noise:
    length = UNSTATED if sigma is None else float(file.units.length.to_si(sigma))
    if not length > 0:
        raise ModelError("a noise is a standard deviation", key="--sigma", found=sigma, expected="above 0")
    if pose_noise is None:
        return Noise(length)
    position, orientation = numbers_of(pose_noise, "--pose-noise", ("POSITION", "ORIENTATION"))
    if min(position, orientation) < 0:
        raise ModelError("a noise is a standard deviation", key="--pose-noise", found=pose_noise, expected="0 or more")
    return Noise(length, file.units.length.to_si(position), file.units.angle.to_si(orientation))


def doubts(
    listing: PoseList, noise: Noise, sigma: float | None, wanted: int | None, file: CableFile
) -> tuple[Remark, ...]:
    out = []
    open_ = int((~listing.contacts.resolved).sum())
    if open_:
        out.append(Remark.of(Code.MOTIONS_OPEN, count=open_))
    if wanted is not None and sigma is None:
        out.append(Remark.of(Code.LENGTH_NOISE_ASSUMED))
    if wanted is not None and noise.length > EXPECTED:
        unit = file.units.length.name
        out.append(Remark.of(Code.NOISE_TEACHES_NOTHING, sigma=sigma, unit=unit, expected=Quantity(EXPECTED)))
    return tuple(out)


def texts(made: Listed) -> dict[str, str | bytes]:
    """The list, the program (of the chosen poses where some were chosen), and the document."""
    units, choice = made.units, made.choice
    order = np.arange(len(made.names)) if choice is None else choice.chosen
    out: dict[str, str | bytes] = {
        "poses.csv": made.text,
        "program.csv": program_text(made.robot, made.names, made.program, order, units),
        "list.json": json_text(made.document),
    }
    if choice is not None:
        out["chosen.csv"] = list_text(made.robot, made.names, made.listing, made.program, units, only=order)
    return out
