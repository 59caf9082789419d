"""Rows through which a slider leads in the picture of a cable robot: what moves, and what is said there.

Each cable has knots (k, 3): platform anchor, where it leaves a pulley, round it to the frame anchor; straight ones have two. turn.js
parts the first stretch into as many pieces as `solids.courses`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.report.cable.drawing import clean
from robocal.report.cable.solids import PIECES, courses, wheels
from robocal.report.cable.tension_colours import colour_tensions
from robocal.report.view import View

__all__ = ["SceneRows", "row_data", "some_rows"]

MOST = 60  # rows of a slider


@record(eq=False)
class SceneRows:
    """Rows with captions: poses (n, 4, 4) and tensions (n, m) N, NaN for none; None where none are known. The picture shows `first`."""

    captions: Sequence[str]
    poses: Array
    tension: Array | None = None
    first: int = 0


def some_rows(rows: SceneRows) -> SceneRows:
    """Of many rows some, as evenly as can be, the first shown among them; those whose pose is not known are left out."""
    known = np.flatnonzero(np.isfinite(rows.poses).all(axis=(1, 2)))
    kept = np.unique([*known[:: max(1, -(-len(known) // MOST))], rows.first])
    pull = None if rows.tension is None else rows.tension[kept]
    return SceneRows([rows.captions[i] for i in kept], rows.poses[kept], pull, int(np.searchsorted(kept, rows.first)))


def row_data(robot: CableRobot, rows: SceneRows, view: View, notch: Any) -> str:
    """The attribute of a picture that turn.js reads: per row its caption, knots, origin, rims of pulleys (px about the middle), and
    the state, colour, words and notch (`notch(tension)`, px) of every cable."""
    told = [_one(robot, rows, i, view, notch) for i in range(len(rows.poses))]
    text = json.dumps({"first": rows.first, "pieces": PIECES, "rows": told}, separators=(",", ":"), allow_nan=False)
    return f' data-rows="{escape(clean(text))}"'


def _one(robot: CableRobot, rows: SceneRows, i: int, view: View, notch: Any) -> dict[str, Any]:
    at = rows.poses[i]
    ends = at[:3, 3] + robot.b @ at[:3, :3].T
    knots = [np.concatenate([c[:1], c[PIECES:]]) for c in courses(robot, ends)]
    out: dict[str, Any] = {
        "name": rows.captions[i],
        "knots": [_px(view, k) for k in knots],
        "origin": _px(view, at[None, :3, 3]),
    }
    if rims := wheels(robot, ends):
        out["rims"] = [_px(view, rim) for rim in rims]
    if rows.tension is not None:
        held = colour_tensions(robot, rows.tension[i])
        each = range(len(robot.cables))
        out |= {"states": held.states, "colours": [held.colour(c) for c in each]}
        out |= {"words": [held.describe(c) for c in each], "notches": [notch(float(v)) for v in held.values]}
    return out


def _px(view: View, points: Array) -> list[float]:
    return [round(v, 1) for v in view.local(points).ravel().tolist()]
