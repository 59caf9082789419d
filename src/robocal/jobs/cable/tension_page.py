"""report.html of the verb `cable tension`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robocal.cables.geometry import CableRobot
from robocal.cables.tension import Distribution
from robocal.report.cable.page import Block, page
from robocal.report.cable.scene import scene
from robocal.report.cable.series import tensions
from robocal.report.numbers import significant

__all__ = ["tension_page"]

Array = NDArray[np.float64]
MOST = 500  # rows of the table
METHODS = {
    "norm": "the least sum of squares",
    "mid": "those nearest to the middle of the limits",
    "closed": "the closed form about the middle of the limits",
    "barycentre": "the centre of all that hold the platform, continuous along paths",
    "p-norm": "the least sum of powers",
}


def tension_page(
    robot: CableRobot,
    poses: Array,
    spread: Distribution,
    margin: Array,
    found: Mapping[str, Any],
    warnings: Sequence[str] = (),
) -> str:
    """The page, from poses (k, 4, 4), tensions, margins (k,) N and the document `found`."""
    names = [row["name"] for row in found["poses"]]
    return page(
        f"{robot.name}: tensions",
        [
            Block(
                "What the cables bear", _summary(found), tensions(names, spread.tension, spread.limits, robot.cables)
            ),
            *_places(robot, poses, spread, margin, names),
            Block("Pose by pose", _said(found), table=_table(robot, found)),
            Block("How it was worked out", _how(robot, found, warnings)),
        ],
    )


def _places(
    robot: CableRobot, poses: Array, spread: Distribution, margin: Array, names: Sequence[str]
) -> Iterator[Block]:
    """The pose with the least to spare, and the one at which most is missing."""
    for chosen, heading, words in (
        (
            spread.found,
            "Where the least is left",
            "The margin is the size of the smallest disturbance that the cables could not balance.",
        ),
        (
            ~spread.feasible,
            "Where most is missing",
            "No tensions within the limits hold the platform here. The size of a negative margin is at most what is missing.",
        ),
    ):
        if chosen.any():
            worst = int(np.argmin(np.where(chosen, margin, np.inf)))
            caption = f"{names[worst]}: margin {significant(float(margin[worst]))} N"
            drawn = scene(robot, poses[worst], tension=spread.tension[worst], poses=poses, caption=caption)
            yield Block(heading, f"{caption}. {words}", drawn)


def _summary(found: Mapping[str, Any]) -> str:
    rows = found["poses"]
    held = found["feasible"]
    text = f"{held} of {len(rows)} poses are held within the limits."
    if held < len(rows):
        text += " At the others no tensions within the limits balance the load."
    without = sum(row["tension_N"] is None and row["feasible"] for row in rows)
    if without:
        text += f" At {without} of those that are held this method leaves the limits, where others do not."
    return f"{text}\n\nOf all tensions that hold the platform these are {METHODS[found['method']]}."


def _said(found: Mapping[str, Any]) -> str:
    more = len(found["poses"]) - MOST
    words = "Tensions and margin in N; missing: what would have to be added to what acts on the platform, in N and Nm."
    return words + (f" The first {MOST} poses; {more} more are in tensions.csv." if more > 0 else "")


def _table(robot: CableRobot, found: Mapping[str, Any]) -> list[list[str]]:
    axes = found["wrenches"]["axes"]
    lacking = any(row["missing"] for row in found["poses"])
    head = ["pose", *robot.cables, "margin", *(f"missing {a}" for a in axes if lacking)]
    out = [head]
    for row in found["poses"][:MOST]:
        pulls = ["\u2013"] * len(robot.cables) if row["tension_N"] is None else map(significant, row["tension_N"])
        short = [""] * len(axes) if row["missing"] is None else [significant(v) for v in row["missing"]]
        out.append([row["name"], *pulls, significant(row["margin_N"]), *(short if lacking else [])])
    return out


def _how(robot: CableRobot, found: Mapping[str, Any], warnings: Sequence[str]) -> str:
    method = found["method"] + (f", power {found['power']:g}" if found["power"] else "")
    limits = sorted({f"{low:g} to {high:g} N" for low, high in found["limits_N"]})
    parts = [
        f"Straight cables{'' if robot.pulleys is None else ' over pulleys'}; method {method}; limits {', '.join(limits)}; "
        f"{significant(found['mass_kg'])} kg. Of margins, moments are divided by {found['length_m']:g} m.",
    ]
    if robot.assumed:
        parts.append(f"Assumed, not measured: {', '.join(robot.assumed)}.")
    parts += [f"{i['file']}: SHA-256 {i['sha256']}" for i in found["provenance"]["inputs"]]
    parts.append(f"robocal {found['provenance']['version']}: {found['provenance']['command']}")
    return "\n\n".join([*parts, *warnings])
