"""report.html of the verb `cable poses`."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from robocal.cables.boundary import Outline, outline
from robocal.cables.workspace import Demand
from robocal.geometry import se3
from robocal.planning.cable_poses import PoseChoice
from robocal.report.cable.list_picture import draw_reach
from robocal.report.cable.part import part
from robocal.report.cable.scene import scene
from robocal.report.cable.scene_rows import SceneRows
from robocal.report.cable.tension_series import tensions
from robocal.report.numbers import significant
from robocal.report.sections import Detail, Section
from robocal.session.cable.pose_list_result import EXPECTED_OF, Listed
from robocal.session.cable.statics_options import limits_text

__all__ = ["poses_answer", "poses_details"]

MOST = 500  # rows of the table


def poses_answer(made: Listed) -> Detail:
    """What a page says first: what was asked, what the list is worth, what next."""
    count, choice = len(made.names), made.choice
    asked = f"{count} poses that the platform reaches from its start and leaves again, within tension limits and without a contact"
    much = f"{100 * made.margin:g} % of what is free"
    found = f"{count} poses; each is on a straight way from the start towards a target drawn at random, {much}"
    best, program = "", "program.csv drives to each pose and back"
    if choice is not None:
        asked += f", and the {len(choice.chosen)} best of them to measure"
        what = next(iter(choice.expected["chosen"]))
        rms = {who: significant(1e3 * choice.expected[who][what]) for who in ("chosen", "random", "all")}
        best = (
            f"after a calibration the {EXPECTED_OF[what]} are expected within {rms['chosen']} mm rms, {rms['random']} mm from as many "
            f"poses at random, {rms['all']} mm from all {count}"
        )
        program = "program.csv drives to the chosen poses and back"
    after = f"{program}; measure there, then robocal identify {made.place} LENGTHS POSES"
    return made.answer(
        ("Asked", asked), ("Found", found), (f"Best {len(choice.chosen)}" if choice else "", best),
        ("Next", after),
        remarks=made.warnings,
    )  # fmt: skip


def poses_details(made: Listed) -> Iterator[Section]:
    """What a page has room for: pictures, every pose, how it was worked out."""
    robot, start = made.robot, made.start
    shown = np.arange(len(made.names)) if made.choice is None else np.sort(made.choice.chosen)
    some = "the list" if made.choice is None else "the choice"
    moves = [i for i in robot.axes if i < 3]
    yield _picture(made, (moves[0], moves[1]) if len(moves) == 2 else (0, 1), _summary(made))
    if len(moves) == 3:
        yield _picture(made, (0, 2), folded=True)
    caption = f"The start and {len(shown)} poses of {some}: margin {significant(start.margin)} N at the start"
    poses, pull = made.listing.poses[shown], start.tensions.tension[0]
    bears = made.program.tension[shown, -1]
    rows = SceneRows(
        [caption, *(made.names[i] for i in shown)],
        np.concatenate([start.pose[None], poses]),
        np.concatenate([pull[None], bears]),
    )
    drawn = scene(robot, start.pose, tension=pull, poses=poses, rows=rows, caption=caption, ruler=made.length_unit)
    yield part("The robot at its start", _start(made), drawn)
    names = [made.names[i] for i in shown]
    text = f"Tensions at the poses of {some} ({made.method}); at every waypoint they are within the limits too."
    drawn = tensions(names, bears, robot.need("limits"), robot.cables)
    yield part("What the cables bear", text, drawn, folded=True)
    if made.choice is not None:
        yield part("Poses to measure", _choice(made, made.choice), folded=True)
    yield part("Pose by pose", _caption(made, shown), table=_table(made, shown), folded=True)
    yield made.method_part(_how(made), made.warnings)


def _summary(made: Listed) -> str:
    turning = ", turning steadily" if any(axis > 2 for axis in made.robot.axes) else ""
    return (
        f"{len(made.names)} targets were drawn at random in a box. From the start the platform moves straight towards "
        f"each{turning}, until the tension limits or a contact end the motion; the pose is {100 * made.margin:g} % of the way to there. "
        "The way back is the way there."
    )


def _picture(made: Listed, axes: tuple[int, int], before: str = "", folded: bool = False) -> Section:
    letters = "".join("xyz"[i] for i in axes)
    robot, turns = made.robot, max(made.robot.axes) > 2
    where = "" if robot.planar and not turns else " in this plane through the start"
    turned, others = (" at its orientation", " and are turned") if turns else ("", "")
    more = "" if robot.planar else f"; poses lie before and behind it{others}"
    text = f"{before} Plane {letters}: the outline is the workspace{where}{turned}{more}."
    drawn = draw_reach(_outline(made, axes), made.listing, axes, box=made.box, ruler=made.length_unit)
    return part(f"Targets and poses, {letters}", text, drawn, folded=folded)


def _outline(made: Listed, axes: tuple[int, int]) -> Outline:
    """The section of the workspace through X_0, within the machine and Z."""
    start = made.start.pose[:3, 3]
    centre = start + made.box.offset
    corners = np.vstack([made.robot.a, centre - made.box.translation, centre + made.box.translation, start])
    sides = np.stack([corners.min(axis=0), corners.max(axis=0)], axis=1)
    demand = Demand(np.array([made.robot.need("mass")]), rotations=made.start.pose[None, :3, :3])
    return outline(made.robot, demand, start, sides, axes, count=360)


def _start(made: Listed) -> str:
    (k, l), cables, ruler = made.start.nearest, made.robot.cables, made.length_unit
    text = f"The start (X_0) is at {ruler.point(made.start.pose[:3, 3])}. "
    gap = f"{cables[k]} and {cables[l]}, with {ruler.short(made.start.gap)} between them"
    return text + (f"The cables nearest to each other there are {gap}." if k >= 0 else "")


def _choice(made: Listed, choice: PoseChoice) -> str:
    noise, those = choice.noise, ", ".join(made.names[i] for i in choice.chosen)
    pose = "poses as if measured exactly"
    if not noise.measured:
        pose = "poses that no instrument measures"
    elif noise.position or noise.orientation:
        turn = significant(float(np.degrees(noise.orientation)))
        pose = f"poses measured to {significant(1e3 * noise.position)} mm and {turn} deg per axis"
    return (
        f"{len(choice.chosen)} poses chosen by criterion {choice.criterion}, the most telling first: {those}. Expected "
        f"errors after a calibration from {pose}, and lengths with "
        f"{significant(1e3 * noise.length)} mm. At random: the median of random choices of as many."
    )


def _caption(made: Listed, shown: NDArray[np.int64]) -> str:
    words = f"Positions in {made.length_unit.name}, rotation vectors in deg, tensions in N."
    return words + (f" The first {MOST}; the others are in poses.csv." if len(shown) > MOST else "")


def _table(made: Listed, shown: NDArray[np.int64]) -> list[list[str]]:
    vectors = se3.to_vector(made.program.pose[shown[:MOST], -1])
    vectors[:, 3:] = np.degrees(vectors[:, 3:])
    found, who = made.listing, made.listing.contacts.names(made.robot.cables)
    head = ["pose", "x", "y", "z", "rx", "ry", "rz", "share of the way", "ended by", "least", "greatest"]
    rows = []
    for i, vector in zip(shown[:MOST], vectors, strict=True):
        why = "tension limits" if found.limit[i] == 1 else who[i] if found.limit[i] > 1 else ""
        pull = made.program.tension[i, -1]
        cells = [*(made.length_unit.text(v) for v in vector[:3].tolist()), *(f"{v:.1f}" for v in vector[3:])]
        ends = [f"{found.fraction[i]:.3f}", why, significant(pull.min()), significant(pull.max())]
        rows.append([made.names[i], *cells, *ends])
    return [head, *rows]


def _how(made: Listed) -> str:
    robot, box, ruler = made.robot, made.box, made.length_unit
    z = ", ".join(significant(v / ruler.metres) for v in (2 * box.translation).tolist())
    turns = ", ".join(significant(v) for v in np.degrees(box.rotation).tolist())
    return (
        f"The box of targets (Z) is {z} {ruler.name} along the axes and turns by up to {turns} deg, seed {made.seed}; limits "
        f"{limits_text(robot.need('limits'))}; {significant(float(robot.need('mass')))} kg; lengths are {made.lengths}.\n\n"
        "Cables are straight rods, and no contact on a way is jumped over. Sag, the frame and the floor are left out."
    )
