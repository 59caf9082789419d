"""Frames in files: xyz with a rotation vector or roll-pitch-yaw, to frame vectors in SI and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.files import orientation
from robocal.files.schema import FrameModel
from robocal.files.units import Units, number
from robocal.files.yamlio import Path_
from robocal.geometry import so3

__all__ = ["frame_changes", "frame_vector"]


def frame_vector(model: FrameModel | None, units: Units) -> tuple[float, ...]:
    """x, y, z in m and a rotation vector in rad; zeros for what is not stated."""
    if model is None:
        return (0.0,) * 6
    xyz = units.length.to_si(np.array(model.xyz or (0.0,) * 3))
    turn = units.angle.to_si(np.array(model.rotation_vector or (0.0,) * 3))
    if model.rpy is not None:
        turn = so3.log(orientation.rpy(units.angle.to_si(np.array(model.rpy))))
    return tuple(float(v) for v in (*xyz, *turn))


def frame_changes(data: Mapping[str, Any], owner: str, vector: Array, units: Units) -> dict[Path_, float | str]:
    """What to write so that frame `owner` of a document says `vector` (6,) in SI, in the words in which it is
    written."""
    given = data.get(owner)
    word = "rpy" if isinstance(given, dict) and given.get("rpy") is not None else "rotation_vector"
    turn = orientation.to_rpy(so3.exp(vector[3:])) if word == "rpy" else vector[3:]
    parts = {"xyz": units.length.from_si(vector[:3]), word: units.angle.from_si(turn)}
    shown = {name: f"[{', '.join(number(float(v)) for v in values)}]" for name, values in parts.items()}
    if not isinstance(given, dict):
        return {(owner,): "{" + ", ".join(f"{k}: {v}" for k, v in shown.items()) + "}"}
    out: dict[Path_, float | str] = {}
    for name, values in parts.items():
        if given.get(name) is None:
            out[(owner, name)] = shown[name]
        else:
            out.update({(owner, name, i): float(v) for i, v in enumerate(values) if given[name][i] != v})
    return out
