"""report.html of the verb `cable tension`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from robocal.files.plain import plain
from robocal.jobs.cable.document import how_made, limits_text
from robocal.jobs.cable.tension_result import Tensions
from robocal.remarks.remark import spoken
from robocal.report.cable.part import part
from robocal.report.cable.scene import scene
from robocal.report.cable.series import tensions
from robocal.report.numbers import significant
from robocal.report.sections import Section

__all__ = ["tension_details"]

MOST = 500  # rows of the table
METHODS = {
    "norm": "the least sum of squares",
    "mid": "those nearest to the middle of the limits",
    "closed": "the closed form about the middle of the limits",
    "barycentre": "the centre of all that hold the platform, continuous along paths",
    "p-norm": "the least sum of powers",
}


def tension_details(made: Tensions) -> list[Section]:
    """What a page has room for: pictures, every pose, how it was worked out."""
    found = plain(made.document)
    shown = tensions(made.names, made.spread.tension, made.spread.limits, made.robot.cables)
    return [
        part("What the cables bear", _summary(found), shown),
        *_places(made),
        part("Pose by pose", _said(found), table=_table(found)),
        part("How it was worked out", _how(made, found)),
    ]


def _places(made: Tensions) -> Iterator[Section]:
    """The pose with the least to spare, and the one at which most is missing."""
    spread, margin = made.spread, made.margin
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
            caption = f"{made.names[worst]}: margin {significant(float(margin[worst]))} N"
            drawn = scene(
                made.robot, made.poses[worst], tension=spread.tension[worst], poses=made.poses, caption=caption
            )
            yield part(heading, f"{caption}. {words}", drawn)


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


def _table(found: Mapping[str, Any]) -> list[list[str]]:
    axes, cables = found["wrenches"]["axes"], found["cables"]
    lacking = any(row["missing"] for row in found["poses"])
    head = ["pose", *cables, "margin", *(f"missing {a}" for a in axes if lacking)]
    out = [head]
    for row in found["poses"][:MOST]:
        pulls = ["\u2013"] * len(cables) if row["tension_N"] is None else map(significant, row["tension_N"])
        short = [""] * len(axes) if row["missing"] is None else [significant(v) for v in row["missing"]]
        out.append([row["name"], *pulls, significant(row["margin_N"]), *(short if lacking else [])])
    return out


def _how(made: Tensions, found: Mapping[str, Any]) -> str:
    method = found["method"] + (f", power {found['power']:g}" if found["power"] else "")
    model = "Straight cables" + ("" if made.robot.pulleys is None else " over pulleys")
    words = (
        f"{model}; method {method}; limits {limits_text(found['limits_N'])}; {significant(found['mass_kg'])} kg. "
        f"Of margins, moments are divided by {found['length_m']:g} m."
    )
    return "\n\n".join([words, *how_made(found), *map(spoken, made.warnings)])
