"""The residual layer of a run folder, on data that it was not learned from."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from robocal.errors import FormatError
from robocal.files.layerfile import LAYER, read_layer
from robocal.measure.base import problem
from robocal.prove.nongeometric.layered import layer_errors, layer_rows
from robocal.prove.statistics import Statistic
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.inputs import Inputs

__all__ = ["layer_beside", "layer_remarks"]


def layer_beside(
    robot: str | os.PathLike[str], inputs: Inputs, values: Mapping[str, float], factor: float
) -> Statistic | None:
    """Errors in mm of a run folder's robot with its layer on top; None without a layer, or where it says nothing.

    `values` are the frames as they were fitted to the robot alone, `factor` what that fit took away from the errors.
    Raises FormatError for a broken layer.json, or one of another robot.
    """
    place = Path(robot) / LAYER
    if inputs.opened.arm is None or not Path(robot).is_dir() or not place.is_file():
        return None
    layer = read_layer(place)
    if layer.joints != inputs.robot.chain.joint_names:
        raise FormatError(
            "this residual layer is of another robot", file=place, key="joints", found=", ".join(layer.joints),
            expected=", ".join(inputs.robot.chain.joint_names),
        )  # fmt: skip
    q = inputs.data.configurations.joints
    made = problem(inputs.robot.chain, inputs.data, values=dict(values))
    rows = layer_rows(inputs.data, made, made.start)
    if rows is None or q is None or not np.isfinite(q).all():
        return None
    left = layer_errors(layer, rows, q) * (factor if np.isfinite(factor) else 1.0)
    return Statistic.of(left * 1e3, profiled=factor != 1.0)


def layer_remarks(found: Statistic | None) -> tuple[Remark, ...]:
    """What is said of it."""
    if found is None:
        return ()
    return (Remark.of(Code.LAYER_ON_TOP, mean=Quantity(found.mean * 1e-3)),)
