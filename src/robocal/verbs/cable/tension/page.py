"""report.html of the verb `cable tension`."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal.cables.tension import Distribution
from robocal.remarks.remark import full_text
from robocal.report.cable.part import part
from robocal.report.cable.scene import scene
from robocal.report.cable.tension_series import tensions
from robocal.report.numbers import significant
from robocal.report.sections import Section
from robocal.session.cable.statics_options import assumption_text, length_unit_of, limits_text
from robocal.verbs.cable.tension.result import Tensions

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
    shown = tensions(made.names, made.spread.tension, made.spread.limits, made.robot.cables)
    return [
        part("What the cables bear", _summary(made.spread), shown),
        *_places(made),
        part("Pose by pose", _caption(len(made.names)), table=_table(made)),
        part("How it was worked out", _how(made)),
    ]


def _places(made: Tensions) -> Iterator[Section]:
    """The pose with the least to spare, and the one at which most is missing."""
    spread, margin = made.spread, made.margin
    for chosen, heading, words in (
        (
            spread.has_solution,
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
                made.robot,
                made.poses[worst],
                tension=spread.tension[worst],
                poses=made.poses,
                caption=caption,
                ruler=length_unit_of(made.units),
            )
            yield part(heading, f"{caption}. {words}", drawn)


def _summary(spread: Distribution) -> str:
    held, count = int(spread.feasible.sum()), len(spread.feasible)
    text = f"{held} of {count} poses are held within the limits."
    if held < count:
        text += " At the others no tensions within the limits balance the load."
    without = int((spread.feasible & ~spread.has_solution).sum())
    if without:
        text += f" At {without} of those that are held this method leaves the limits, where others do not."
    return f"{text}\n\nOf all tensions that hold the platform these are {METHODS[spread.method]}."


def _caption(count: int) -> str:
    words = "Tensions and margin in N; missing: what would have to be added to what acts on the platform, in N and Nm."
    return words + (f" The first {MOST} poses; {count - MOST} more are in tensions.csv." if count > MOST else "")


def _table(made: Tensions) -> list[list[str]]:
    axes, cables, spread = made.axes, made.robot.cables, made.spread
    lacking = not spread.feasible.all()
    out = [["pose", *cables, "margin", *(f"missing {a}" for a in axes if lacking)]]
    for i, name in enumerate(made.names[:MOST]):
        pulls = map(significant, spread.tension[i].tolist()) if spread.has_solution[i] else ["\u2013"] * len(cables)
        short = [""] * len(axes) if spread.feasible[i] else map(significant, made.missing[i].tolist())
        out.append([name, *pulls, significant(float(made.margin[i])), *(short if lacking else [])])
    return out


def _how(made: Tensions) -> str:
    method = made.spread.method + (f", power {made.power_of_sum:g}" if made.power_of_sum else "")
    model = "Straight cables" + ("" if made.robot.pulleys is None else " over pulleys")
    words = (
        f"{model}; method {method}; limits {limits_text(made.spread.limits)}; {significant(made.mass)} kg. "
        f"Of margins, moments are divided by {length_unit_of(made.units).short(made.length)}."
    )
    return "\n\n".join([words, *assumption_text(made.robot), *map(full_text, made.warnings)])
