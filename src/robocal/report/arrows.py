"""Error arrows where the machine was, before and after, with the machine itself; where no errors have a direction, the machine alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.report.numbers import with_decimals
from robocal.report.robot_lines import box_of, place_robots, space_around
from robocal.report.sections import Figure, Mark
from robocal.report.series import column, is_aside, is_held_out, numbers
from robocal.report.space import Panel, draw_space

__all__ = ["TITLES", "arrows", "have_places", "machine_rows"]

FAR = 1e9  # mm; beyond this it is no position
MOST = 2000  # arrows of a picture
TITLES = ("The machine as found", "Where the errors point")
ROWS = "The machine at every row"
PLACE = tuple(f"{axis}_mm" for axis in "xyz")
CAPTION = (
    "Left: before; right: after. Each arrow starts where the machine was and shows its error, scaled as written below it{frame}. "
    "{fitted}The panels may differ in magnification: compare the scale bars. Errors with a pattern can be corrected by a "
    "model; what remains should look random. The box holds all positions: {box}. {robot}{share}"
)


FITTED = (
    "The pose of the platform was fitted to the same row: arrows show what that leaves, less than errors from lengths. "
)


def have_places(residuals: Mapping[str, Sequence[object]]) -> bool:
    """Whether any row says where the machine was."""
    return not np.isnan(numbers(residuals, PLACE[0])).all()


def arrows(residuals: Mapping[str, Sequence[object]], shape: Any = None) -> Figure | None:
    """Two pictures. Draws all rows that have a position and an error before and after, but those set aside, whose arrows would leave the
    others no length. `shape`: that of result.json, the machine itself, drawn alone where there are none; None when there is neither."""
    if shape is not None and not (shape.lines and all(line.points for line in shape.lines)):
        shape = None  # somebody's own result.json
    names = [*PLACE, *(f"d{axis}_{k}_mm" for k in ("before", "after") for axis in "xyz")]
    table = np.stack([numbers(residuals, name) for name in names], axis=1)
    table[~(np.abs(table) < FAR)] = np.nan
    used = ~np.isnan(table).any(axis=1) & ~is_aside(residuals)
    if not used.any():
        return None if shape is None else machine_rows((shape,), (shape.configuration,))
    table, held = table[used], is_held_out(residuals)[used]
    box = np.stack([table[:, :3].min(axis=0), table[:, :3].max(axis=0)])
    every, step = len(table), -(-len(table) // MOST)
    drawn = np.arange(every) % step == 0  # more would be one black cloud
    for k in (3, 6):  # but the largest error before and after is to be seen
        drawn[np.linalg.norm(table[:, k : k + 3], axis=1).argmax()] = True
    rows, space = table[drawn], space_around(box, () if shape is None else (shape,))
    told = [str(name) for name in np.array(column(residuals, "configuration"), dtype=object)[used][drawn]]
    titles = "Error arrows of the nominal model", "Error arrows that remain after calibration"
    panels = (
        Panel("before", titles[0], rows[:, 3:6], ("before", "before")),
        Panel("after", titles[1], rows[:, 6:], ("after", "held")),
    )
    robots = () if shape is None else place_robots((shape,), space)
    svg = draw_space(panels, rows[:, :3], told, held[drawn], box, space, robots)
    share = f"Of {every} rows one in {step} is drawn, and those with the largest errors. " if step > 1 else ""
    legend: tuple[tuple[Mark, str], ...] = (("after", "fit"), ("held", "held out (bold)")) if held[drawn].any() else ()
    words = {"box": _say(box), "share": share, "robot": "", "frame": "", "fitted": ""}
    if robots:  # results of earlier versions have no machine, and tell errors as each instrument does
        words |= {"robot": f"{robots[0].caption} ", "frame": ", in base coordinates"}
        words |= {"fitted": FITTED} if any(line.name for line in shape.lines) else {}
    return Figure(svg, CAPTION.format(**words).strip(), TITLES[1], legend)


def machine_rows(shapes: Sequence[Any], names: Sequence[str], said: str = "") -> Figure:
    """The machine at rows, one of them shown: a slider, or pointing at where the tool was, shows another."""
    at = np.array([shape.tool for shape in shapes], dtype=float).reshape(-1, 3)
    box = box_of(shapes)
    space = space_around(box, ())
    robots = place_robots(shapes, space)
    held = np.zeros(len(at), dtype=bool)
    many = len(shapes) > 1
    title = ROWS if many else TITLES[0]
    more = "The slider, or pointing at a position, shows it at another row. " if many else ""
    words = f"{robots[0].caption} {more}The box holds it: {_say(box)}. {said}"
    panel = Panel("machine", title, None, ("spots", "spots"))
    return Figure(draw_space((panel,), at, names, held, box, space, robots), words.strip(), title)


def _say(box: Array) -> str:
    """The ends of a box (2, 3) mm."""
    ends = zip("xyz", *box.tolist(), strict=True)
    return ", ".join(f"{a} from {with_decimals(u, 0)} to {with_decimals(v, 0)}" for a, u, v in ends) + " mm"
