"""The verb `identify` for a cable robot: anchors and sensor zeros from lengths and poses."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from robocal.cables.geometry import CableRobot
from robocal.calibrate.identification import Identification
from robocal.calibrate.identify import identify as solve
from robocal.calibrate.options import Options
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.jobs.cable.measured import Measured, read_measured
from robocal.jobs.inputs import chosen
from robocal.jobs.watching import Watch, computable

__all__ = ["Solved", "identify_cable"]

# What is said of arms alone.
ARMS = ("groups", "layer", "compare", "region", "base", "tip", "group")


@dataclass(frozen=True)
class Solved:
    """A cable robot as it was identified, the data, and what came of them."""

    robot: CableFile
    measured: Measured
    found: Identification[CableRobot]


def identify_cable(
    file: CableFile,
    robot: str,
    data: Sequence[str | os.PathLike[str]],
    options: Options,
    words: dict[str, Any],
    watch: Watch | None = None,
    exclude: Sequence[str] = (),
) -> Solved:
    """Identifies a cable robot from files; `words` are the choices of a person by name. Raises InputError for whatever is
    wrong with them, and for a choice that only arms have."""
    for name in ARMS:
        if words.get(name) and not (name == "region" and words[name] == "measured"):
            raise ModelError(
                "this is for arms", key=f"--{name}", found=str(words[name]), expected="nothing, for a cable robot"
            )
    measured = read_measured(file, robot, data, exclude, watch)
    picked = {key: words[key] for key in ("free", "fix", "prior")}
    table, seen = chosen(file.robot, file.units, measured.data, **picked)
    machine = replace(file.robot, table=table)
    with computable(*(i.file for i in measured.files)):
        found: Identification[CableRobot] = solve(machine, seen, options, watch)
    return Solved(replace(file, robot=machine), measured, found)
