"""The files of a list of poses: what the builder has of it, what verified it, and the truth apart."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._types import Array, Bools
from robocal.files.display import listing_text
from robocal.quantities import Column, Listing
from robocal.session.commissioning.rig_calibration import Verification
from robocal.session.commissioning.rig_files import LABEL, Recording, lengths_files, pixels_files, poses_file
from robocal.session.commissioning.rig_images import THROUGH
from robocal.session.commissioning.rig_world import RigWorld, robot_text

__all__ = ["list_files", "verification_files", "whole_poses"]


def whole_poses(poses: Array) -> Bools:
    """Which poses (k, 4, 4) are numbers."""
    return np.asarray(np.isfinite(poses).all(axis=(1, 2)))


def list_files(world: RigWorld, zeros: Array, made: Recording) -> Mapping[str, str]:
    """What the builder has of a list, and the truth apart from it."""
    out = {"robot.yaml": robot_text(world, zeros), **lengths_files(world, made)}
    out |= pixels_files(world, made, THROUGH if made.images else world.spec.model.camera.corner_noise_px)
    out["poses.csv"] = poses_file(made.ids, made.asked)
    out["truth-poses.csv"] = poses_file(made.ids, made.true)
    names = world.spec.cables
    pulls = (Column(n, "N", v, decimals=3) for n, v in zip(names, made.tension.T, strict=True))
    out["truth-tensions.csv"] = LABEL + listing_text(Listing((Column("id", "", made.ids), *pulls)))
    if world.belief.ranges is not None:
        out["ranges.csv"] = LABEL + listing_text(_ranges(world))
    return out


def _ranges(world: RigWorld) -> Listing:
    """The ranges between beacons, pair by pair."""
    ranges = world.belief.ranges
    assert ranges is not None
    one, other = np.triu_indices(len(ranges), 1)
    names = [f"A{i + 1}" for i in range(len(ranges))]
    return Listing((
        Column("from", "", [names[i] for i in one]), Column("to", "", [names[i] for i in other]),
        Column("range", "m", ranges[one, other], decimals=4),
    ))  # fmt: skip


def verification_files(world: RigWorld, made: Recording, verified: Verification) -> Mapping[str, str]:
    """The verification poses: lengths as recorded, and poses of robot, camera and instrument as `verify` reads them."""
    ids, good = made.ids, whole_poses(verified.camera)
    seen = tuple(n for n, g in zip(ids, good.tolist(), strict=True) if g)
    lengths = {k: v for k, v in lengths_files(world, made, "verify-lengths").items() if k.endswith(".csv")}
    return {
        **lengths, "reference.csv": poses_file(ids, made.reference, made.clock), "robot.csv": poses_file(ids, verified.robot),
        "camera.csv": poses_file(seen, verified.camera[good]), "truth-verification.csv": poses_file(ids, made.true),
    }  # fmt: skip
