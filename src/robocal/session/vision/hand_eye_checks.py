"""What views say of a lens that was given, without the robot; and whether camera or target moved while views were taken.

Y_i free, lens free:    z = |number - given| / sigma of both,    material where |change| d / f exceeds half of what is normal
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from robocal._record import replace
from robocal._types import Array, Bools
from robocal.diagnose.camera_changes import half_turn
from robocal.diagnose.camera_views import AXES_EXCHANGED, IMAGE_MIRRORED, TARGET_TURNED, VIEWS_SHIFTED
from robocal.diagnose.half_turns import undo_half_turns
from robocal.diagnose.segments.find import find_segments
from robocal.diagnose.vision_limits import HAND_STILL, HAND_TURNS, LENS_CONTRADICTED, LENS_MATERIAL, LENS_PULL
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import uncertainty
from robocal.fit.baseline import fit_baseline
from robocal.geometry import se3, so3
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Rig
from robocal.measure.pixels import HALF_TURNS
from robocal.prove.decision import Decision
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.corner_table import CAMERA
from robocal.session.vision.hand_eye_data import HandEyeData

__all__ = ["OF_VIEWS", "contradict_lens", "find_mirrored", "find_moves", "find_turned", "stands_still"]

PIXELS = ("fx", "fy", "cx", "cy")
FEWEST = 5  # grid: views that tell a lens
TURNED_CLEARLY = 3.0  # tolerance: times, by which half a turn leaves less
OF_VIEWS = (AXES_EXCHANGED, IMAGE_MIRRORED, TARGET_TURNED, VIEWS_SHIFTED)  # what explains all views
EVEN = ("k3", "k4", "k5", "k6")  # powers that stay as they are: few views tell them


def contradict_lens(opened: HandEyeData, made: Decision[Rig], normal: float) -> tuple[Remark | None, bool]:
    """A lens that leaves what was given for it, and whether that is enough to put a camera elsewhere: as the views alone say, each
    with a pose of its own: errors of the robot move all corners of a view, and bend a lens that is found beside it."""
    if opened.lens is None:
        return None, False
    given = dict(zip(opened.lens.kind.symbols, opened.lens.numbers, strict=True))
    names, covariance = made.spread
    sigma = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    beside = {s: (made.values[f"{CAMERA}.{s}"], sigma[f"{CAMERA}.{s}"]) for s in given if f"{CAMERA}.{s}" in sigma}
    alone = not beside
    found = _by_views(opened, made) or beside
    # A lens whose file states sigma may be off by it.
    found = {s: (v, float(np.hypot(e, opened.lens.sigma.get(s, 0.0)))) for s, (v, e) in found.items()}
    off = {
        s: abs(v - given[s]) / e for s, (v, e) in found.items() if e > 0 and abs(v - given[s]) >= LENS_CONTRADICTED * e
    }
    if not off:
        return None, False
    changes = tuple(f"{s} {given[s]:.5g} given, {found[s][0]:.5g} found" for s in off)
    distance = float(np.median(np.linalg.norm(opened.target_views()[1][:, :3, 3], axis=1)))
    most = max((abs(found[s][0] - given[s]) * distance / given["fx"] for s in off if s in PIXELS), default=0.0)
    material = most > LENS_MATERIAL * normal if alone else _pull(opened, made) > LENS_PULL
    return Remark.of(Code.LENS_CONTRADICTED, names=changes, z=max(off.values())), material


def _pull(opened: HandEyeData, made: Decision[Rig]) -> float:
    """How far a prior of the lens that views contradict pulls frames, in their sigma: C P^-1 (found - given)."""
    before, (names, covariance) = opened.source.prior, made.spread
    if before is None:
        return 0.0
    given = dict(zip(before.kind.symbols, before.numbers, strict=True))
    known = [s for s in before.known if f"{CAMERA}.{s}" in names]
    if not known:
        return 0.0
    kept = [before.known.index(s) for s in known]
    prior = np.array(before.covariance, dtype=float)[np.ix_(kept, kept)]
    at = [names.index(f"{CAMERA}.{s}") for s in known]
    placed = [i for i, n in enumerate(names) if i not in at]
    change = np.array([made.values[f"{CAMERA}.{s}"] - given[s] for s in known])
    pull = covariance[np.ix_(placed, at)] @ np.linalg.solve(prior, change)
    sigma = np.sqrt(np.diag(covariance)[placed])
    return float(np.max(np.abs(pull)[sigma > 0] / sigma[sigma > 0], initial=0.0))


def _by_views(opened: HandEyeData, made: Decision[Rig]) -> dict[str, tuple[float, float]]:
    """Numbers of the lens with one standard deviation, from views whose poses are free."""
    obs = made.need_data.observations[0]
    where, seen = opened.target_views()
    if len(where) < FEWEST or len(obs.targets) > 1 or opened.lens is None:
        return {}
    free = tuple(s for s in opened.lens.kind.symbols if s not in EVEN)
    obs = replace(
        obs, frame=None, targets=(), target=None, options={**obs.options, "free": free, "known": (), "covariance": ()}
    )
    start = np.array(opened.data.configurations.starts)
    start[where] = se3.to_vector(seen)
    whole = DataSet(replace(opened.data.configurations, start=start), (obs,)).take(where)
    made_problem = build(Rig(), whole)
    with np.errstate(all="ignore"):
        solved = least_squares(made_problem, made_problem.start)
        known = uncertainty(made_problem, solved.x)
    sigma = known.sigma_instrument * known.factor
    values = dict(zip(made_problem.table.names, solved.x[0].tolist(), strict=False))
    named = dict(zip(made_problem.free, sigma.tolist(), strict=True))
    return {s: (values[f"{CAMERA}.{s}"], named[f"{CAMERA}.{s}"]) for s in free}


def find_moves(opened: HandEyeData, made: Decision[Rig]) -> list[Remark]:
    """Views from which on camera or target stood elsewhere, by the pose of the target in each."""
    obs = made.need_data.observations[0]
    if obs.kind != "pixels":
        return []  # asked of poses by the verdict itself
    where, seen = opened.target_views()
    target = obs.targets[0 if obs.target is None else int(np.bincount(obs.target).argmax())]
    rows = Observations(
        "pose",
        np.arange(len(where)),
        se3.to_vector(seen),
        None,
        obs.frame,
        (target,),
        np.zeros(len(where), dtype=np.int64),
    )
    data = DataSet(opened.data.configurations.take(where), (rows,))
    names = [opened.views[i] for i in where.tolist()]
    return [
        Remark.of(
            Code.VIEW_MOVED,
            first=names[s.first],
            last=names[s.last],
            count=s.count,
            shift=None if s.shift is None else Quantity(s.shift),
        )
        for s in find_segments(Rig("robot", freedom=()), data, made.values)
    ]


def find_turned(opened: HandEyeData, made: Decision[Rig]) -> Remark | None:
    """A few views that are labelled from the other end of the board: gross as they are, they fit with half a turn."""
    obs = made.need_data.observations[0]
    if obs.kind != "pixels" or half_turn(obs) is None:
        return None
    asked = replace(obs, options={**obs.options, HALF_TURNS: True})
    done, found = undo_half_turns(made.model, replace(made.need_data, observations=(asked,)))
    turned = found.get(0, np.zeros(0, dtype=np.bool_))
    if not turned.any():
        return None
    rows = turned[obs.configuration]
    undone = replace(done, observations=(replace(done.observations[0], options=obs.options),))
    stated, left = _left_of(made, (made.need_data, undone), made.values, rows)
    if left * TURNED_CLEARLY > stated:
        # Views that are turned may pull a fit so far that nothing fits any more: frames as the others have them.
        with np.errstate(all="ignore"):
            base = fit_baseline(made.model, undone, np.arange(len(undone.configurations)), "tukey")
        values = {**made.values, **dict(zip(base.problem.table.names, base.x[0].tolist(), strict=False))}
        stated, left = _left_of(made, (made.need_data, undone), values, rows)
    if left * TURNED_CLEARLY > stated:
        return None
    names = tuple(opened.views[i] for i in np.flatnonzero(turned).tolist())
    pixels = {"stated": Quantity(stated, "px"), "left": Quantity(left, "px")}
    return Remark.of(Code.LABELS_TURNED, count=len(names), total=len(opened.views), views=names, **pixels)


def _left_of(made: Decision[Rig], some: Sequence[DataSet], values: Mapping[str, float], rows: Bools) -> list[float]:
    """The median error of some rows in each of these data."""
    out = []
    for data in some:
        problem = build(made.model, data, values=values)
        off = problem.residuals(problem.start)[0].value[rows]
        out.append(float(np.median(np.linalg.norm(off, axis=-1))))
    return out


def stands_still(opened: HandEyeData) -> Remark | None:
    """One of robot and target that turns in all views together by less than the noise, while the other does turn."""
    where, seen = opened.target_views()
    if len(where) < FEWEST:
        return None
    hand, target = (_turn(p) for p in (opened.flange[where], seen))
    if min(hand, target) > HAND_STILL or max(hand, target) < HAND_TURNS:
        return None
    words = ("the target in the images", "the robot's flange")
    return Remark.of(
        Code.ONE_STANDS_STILL,
        still=words[int(hand < target)],
        moving=words[int(hand >= target)],
        turn=Quantity(min(hand, target), "rad"),
        other=Quantity(max(hand, target), "rad"),
    )


def _turn(poses: Array) -> float:
    """The median angle from the first of poses (m, 4, 4) to the others, rad."""
    away = np.swapaxes(poses[:1, :3, :3], 1, 2) @ poses[1:, :3, :3]
    return float(np.median(np.linalg.norm(so3.log(away), axis=1)))


def find_mirrored(opened: HandEyeData, made: Decision[Rig]) -> Iterator[Remark]:
    """A lens that is found beside the robot meets mirrored images with a focal length below 0."""
    if opened.lens is None or made.values.get(f"{CAMERA}.fx", 1.0) * made.values.get(f"{CAMERA}.fy", 1.0) > 0:
        return
    obs = made.need_data.observations[0]
    problem = build(made.model, made.need_data, values=made.values)
    off = problem.residuals(problem.start)[0].value
    left = Quantity(float(np.median(np.linalg.norm(off, axis=-1))), "px")
    file = obs.source.replace("\\", "/").rpartition("/")[2]
    yield Remark.of(IMAGE_MIRRORED, instruments=(obs.label,), files=(file,), left=left, stated=None, behind=None)
