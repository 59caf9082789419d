"""The working range of a run: the joint limits that its user wrote, or a file. Limits that a catalogue or a URDF brings are
the maker's: what the arm can reach, mostly full turns, and not where it works."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from robocal.arms import catalog
from robocal.arms.chain import Chain
from robocal.calibrate.bands import measured_range
from robocal.calibrate.region import SAMPLES, limited
from robocal.calibrate.workspace import TURN, Region, between
from robocal.files.robot import Robot
from robocal.files.text import InputFile
from robocal.measure.data import DataSet

__all__ = ["MEASURED", "working_range"]

MEASURED = "measured"  # the word for: where it was measured will do


def working_range(robot: Robot, data: DataSet, given: str | None) -> tuple[Region | None, tuple[InputFile, ...]]:
    """The working range, None where nobody named one, and the files read. Raises FileError or FormatError."""
    own = _written(robot)
    if given is None or given == MEASURED:
        return (limited(robot.chain, data) if own else None), ()
    from robocal.files.region import read_region

    found = read_region(Path(given), robot.chain)
    name = f"region of {Path(given).name}"
    if found.joints is not None:
        return Region(found.joints, name), found.files
    assert found.ranges is not None
    measured = measured_range(data.configurations)
    rest = np.tile([-TURN, TURN], (len(found.ranges), 1)) if measured is None else measured
    if own:
        rest = np.where(np.isfinite(robot.chain.limits), robot.chain.limits, rest)
    return Region(between(np.where(np.isnan(found.ranges), rest, found.ranges), SAMPLES), name), found.files


def _written(robot: Robot) -> bool:
    """Whether somebody wrote the joint limits into the robot file, and not the maker's out of the catalogue."""
    if robot.format != "yaml" or robot.path is None or not np.isfinite(robot.chain.limits).any():
        return False
    return not any(_same(robot.chain, catalog.get(name)) for name in catalog.names())


def _same(one: Chain, other: Chain) -> bool:
    return one.limits.shape == other.limits.shape and np.allclose(one.limits, other.limits, rtol=0.0, atol=1e-4)
