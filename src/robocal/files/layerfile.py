"""layer.json: a residual layer as plain numbers, in SI, angles in rad.

`points` are joint values, `weights` what each adds: correction = k(q, points) weights, in base axes; see
`calibrate.layer` for k. The first three columns are in m, the others, where there are any, a rotation vector in rad.
"""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from robocal.files.plain import plain
from robocal.files.schema import FileModel, validate
from robocal.files.text import FORBIDDEN, forbidden_part
from robocal.files.yamlio import read_json

if TYPE_CHECKING:
    from robocal.prove.nongeometric.layer import Layer

__all__ = ["LAYER", "layer_text", "read_layer"]

LAYER = "layer.json"


class LayerModel(FileModel):
    """layer.json as it is written."""

    robocal: Literal[1]
    frame: Literal["base"]
    joints: list[str]
    turning: list[bool]
    lengths: list[Annotated[FiniteFloat, Field(gt=0)]]
    size: list[Annotated[FiniteFloat, Field(gt=0)]]
    noise: FiniteFloat = Field(gt=0)
    points: list[list[FiniteFloat]]
    weights: list[list[FiniteFloat]]


def layer_text(layer: Layer) -> str:
    """The text of layer.json."""
    told = plain({name: getattr(layer, name) for name in LayerModel.model_fields if hasattr(layer, name)})
    return json.dumps({"robocal": 1, "frame": "base", **told}, allow_nan=False) + "\n"


def read_layer(path: str | os.PathLike[str]) -> Layer:
    """Reads a layer.json. Raises FileError or FormatError."""
    from robocal.prove.nongeometric.layer import Layer

    document = read_json(path, "this is not a residual layer", "an object with the key robocal")
    if (strange := forbidden_part(document.data)) is not None:
        document.fail(FORBIDDEN, (strange[0],), found=strange[1])
    model = validate(LayerModel, document)
    n, d = len(model.joints), len(model.size)
    shapes = {len(model.turning), len(model.lengths), *(len(p) for p in model.points)}
    document.insist(d in (3, 6), "a correction has 3 numbers or 6", ("size",), found=d)
    whole = shapes == {n} and {len(w) for w in model.weights} == {d} and len(model.points) == len(model.weights)
    document.insist(whole, "numbers are missing", expected=f"{n} per point and {d} per weight")
    return Layer(
        tuple(model.joints), tuple(model.turning), np.array(model.points), np.array(model.weights),
        np.array(model.size), np.array(model.lengths), model.noise,
    )  # fmt: skip
