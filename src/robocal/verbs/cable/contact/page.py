"""report.html of the verb `cable contact`."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.remarks.remark import full_text
from robocal.report.cable.part import part
from robocal.report.cable.scene import scene
from robocal.report.numbers import significant
from robocal.report.sections import Section
from robocal.session.cable.statics_options import assumption_text, length_unit_of
from robocal.verbs.cable.contact.result import Motions

__all__ = ["contact_details"]

DRAWN = 6  # motions
MOST = 500  # rows of the table


def contact_details(made: Motions) -> Iterator[Section]:
    """Pictures of the motions that cannot be gone to their end, or of the last one; every motion; how it was worked out."""
    stopped, count = np.flatnonzero(~made.legs.whole), len(made.legs.whole)
    shown = stopped[:DRAWN] if len(stopped) else np.array([count - 1])
    more = f" The first {DRAWN} of {len(stopped)} are drawn." if len(stopped) > DRAWN else ""
    for number, i in enumerate(shown.tolist()):
        yield _drawn(made, i, more if number == 0 else "")
    said = "The share of every motion that can be gone, 0 to 1, and what ends it."
    said += f" The first {MOST} motions; {count - MOST} more are in legs.csv." if count > MOST else ""
    rows = [[r["from"], r["to"], significant(r["free"]), r["ends by"] or "–"] for r in made.table_listing.rows][:MOST]
    yield part("Motion by motion", said, table=[["from", "to", "free share", "ends by"], *rows])
    robot = made.file.robot
    words = (
        "The platform's origin goes straight and it turns about one axis; contacts are certain between the poses too."
    )
    words += (
        ""
        if made.demand is None
        else f" {significant(float(made.demand.masses.max()))} kg is held, without acceleration."
    )
    yield part("How it was worked out", "\n\n".join([words, *assumption_text(robot), *map(full_text, made.remarks)]))


def _drawn(made: Motions, i: int, more: str) -> Section:
    """Where a motion ends, between where it starts and where it was to go."""
    robot, (first, last, free, why) = made.file.robot, next(made.table_listing.take([i]).rows).values()
    at = made.legs.end_poses[i]
    ends = f"ends at {significant(free)} of its way: {why}" if why else "can be gone to its end"
    caption = f"{first} to {last}: {ends}"
    shown = np.stack([made.legs.starts[i], made.legs.ends[i]])
    picture = scene(
        robot, at, tension=_tension(made, at), ghosts=shown, caption=caption, ruler=length_unit_of(made.file.units)
    )  # fmt: skip
    return part(
        f"From {first} to {last}",
        f"The motion {ends}. In outline: where it starts, and where it was to end.{more}",
        picture,
    )


def _tension(made: Motions, at: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Tensions that hold the platform there; none where nothing is known of them, or none do."""
    robot = made.file.robot
    if made.demand is None or robot.limits is None:
        return None
    load = gravity_wrench(at[None], float(made.demand.masses.max()), robot.com)[:, list(robot.axes)]
    return np.asarray(distribute(structure_of(robot, at[None]), load, robot.limits).tension[0])
