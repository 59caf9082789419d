"""What the documents of all cable verbs say alike, and how a page says it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.files.parts import made_by
from robocal.files.text import InputFile
from robocal.remarks.remark import Remark, told

__all__ = ["framed", "how_made", "limits_text"]


def framed(
    robot: CableRobot,
    found: Mapping[str, Any],
    warnings: Sequence[Remark],
    inputs: Sequence[InputFile],
    command: str,
) -> dict[str, Any]:
    """The document of a verb: what it `found`, about which robot, with what was assumed, remarked on and read."""
    return {
        "robocal": 1,
        "robot": robot.name,
        "cables": list(robot.cables),
        **found,
        "assumed": list(robot.assumed),
        **told(warnings),
        "provenance": made_by(command, inputs),
    }


def how_made(robot: CableRobot, command: str, inputs: Sequence[InputFile]) -> list[str]:
    """Paragraphs for a page: what was assumed, which files were read, by which command."""
    recipe, assumed = made_by(command, inputs), robot.assumed
    out = [f"Assumed, not measured: {', '.join(assumed)}. The result depends on it."] if assumed else []
    out += [f"{i.file}: SHA-256 {i.sha256}" for i in recipe.inputs]
    return [*out, f"robocal {recipe.version}: {recipe.command}"]


def limits_text(limits: NDArray[np.float64]) -> str:
    """Tension limits (m, 2) N in words, each pair once."""
    return ", ".join(sorted({f"{low:g} to {high:g} N" for low, high in limits.tolist()}))
