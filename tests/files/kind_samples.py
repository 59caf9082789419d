"""Files of every kind for a small arm, as `robocal simulate` would write them."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
from cli.runs import ROBOT

from robocal.files.datawrite import data_text, table_text
from robocal.files.kinds.registry import READERS
from robocal.files.robot import parse_robot
from robocal.files.text import Source
from robocal.measure.data import DataSet
from robocal.simulation.rigs import FINE, Instrument, measure

ARM = parse_robot(Source(Path("robot.yaml"), ROBOT, "0" * 64)).chain
KINDS = tuple(READERS)


@functools.cache
def simulated(kind: str, poses: int = 9) -> DataSet:
    """What an instrument of this kind would read of the small arm."""
    rng = np.random.default_rng(4)
    low, high = 0.5 * ARM.limits.T
    q = rng.uniform(low, high, (poses, len(ARM.joints)))
    return measure(ARM, q, Instrument(kind, angle_noise=FINE.get(kind, 1e-4)), rng)


@functools.cache
def texts(kind: str) -> tuple[str, str]:
    """data.yaml and its table."""
    data = simulated(kind)
    return data_text(data, ARM, "table.csv"), table_text(data, ARM)


def put(folder: Path, described: str, table: str) -> Path:
    """Writes both; returns the data file."""
    (folder / "table.csv").write_text(table, encoding="utf-8")
    (folder / "data.yaml").write_text(described, encoding="utf-8")
    return folder / "data.yaml"
