"""What is wrong with all views of a camera, or with many of them: no row is gross then, for the fit is wrong everywhere.

The baseline asks for it: a quarter of the points of a camera are off by more than no nominal machine leaves, or they lie behind the camera.
Then every change of `camera_changes` is made in the rows of that camera, or of all cameras, and the frames are fitted again to a part
of the rows. A change is named where it leaves a fifth, and little enough; changes that leave alike are told together.

A camera behind what it sees is a mirrored image: p and -p have one projection.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import product

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array, Bools
from robocal.diagnose.camera_changes import (
    exchange_axes,
    flip,
    half_turn,
    knows_turn,
    mirror,
    shift_views,
    turn_views,
    turned_views,
    view_poses,
)  # fmt: skip
from robocal.diagnose.check_registry import Context, Finding, When, check, once, refuse
from robocal.diagnose.finding_merge import merge_findings
from robocal.diagnose.limits import EXPLAINED_CLEARLY, EXPLANATIONS_ALIKE, VIEWS_ASK, VIEWS_BEHIND, VIEWS_RIGHT
from robocal.diagnose.target_changes import as_printed, seem_of_other_unit, target_changes
from robocal.diagnose.view_blocks import subsample_views
from robocal.estimate.problem import Problem
from robocal.fit.baseline import Baseline, fit_baseline
from robocal.fit.noise import owners, quantile
from robocal.fit.starts.camera_targets import place_camera_targets
from robocal.fit.starts.own import place_configurations
from robocal.geometry import se3
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model, freedom_of, joints_of
from robocal.measure.pixels import PixelRows, intrinsics_of
from robocal.measure.reach import reach
from robocal.remarks.english import declare
from robocal.remarks.remark import Number, Quantity

__all__ = ["AXES_EXCHANGED", "IMAGE_MIRRORED", "TARGET_TURNED", "VIEWS_SHIFTED", "V_UPWARD", "carriers", "wrong_views"]

AXES_EXCHANGED = declare(
    "axes-exchanged",
    "u and v of {instruments} are exchanged: with that, the error of most points falls from {stated:.3g} to {left:.3g}[, and the target "
    "stands before the camera: {behind:.0%} of the views had it behind]",
    "Name the columns the other way round in {files}: {line}.",
)
IMAGE_MIRRORED = declare(
    "image-mirrored",
    "the images of {instruments} are mirrored, or show the target from behind[: {behind:.0%} of the views have it behind the camera]; with "
    "u counted from the other side, the error of most points is {left:.3g}[, and as they are {stated:.3g}]",
    "Undo the mirror: write width - 1 - u in place of u in {files}, or turn mirroring off in the camera's driver. If the target was seen "
    "from behind, give its points the x that they have from there.",
)
V_UPWARD = declare(
    "v-upward",
    "v of {instruments} is counted from below: counted from above, the error of most points falls from {stated:.3g} to {left:.3g}",
    "Write height - 1 - v in place of v in {files}.",
)
VIEWS_SHIFTED = declare(
    "views-shifted",
    "the views of {instruments} stand {shift} {where} their configurations: with that, the error of most points falls from {stated:.3g} to "
    "{left:.3g}",
    "Move the images (u, v) of {files} {way} by {shift} against the joint values or lengths, and leave out views without a partner.",
)
TARGET_TURNED = declare(
    "target-turned",
    "in {count} of {total} views of {instruments} the target is labelled from its other end ({views}): with half a turn there, the "
    "error of most points falls from {stated:.3g} to {left:.3g}",
    "Write `half_turns: undo` into the data file of each of these instruments: half a turn is then undone in every view that asks for it. "
    "Or number the points of these views in {files} from the other end: the first takes the place of the last[, (x, y) becomes "
    "({x:.6g} - x, {y:.6g} - y)]. A board whose number of corners is odd one way and even the other does not look the same.",
)
VIEWS = 24  # grid: configurations of a trial
POINTS = 9  # grid: rows of a view, or of another instrument at a configuration
ROUGH = (12, 6)  # grid: the same where poses are found by the fit, and nothing is decided yet
BEST = 2  # grid: of the changes, how many are fitted robustly
TURNED = 4  # grid: cameras of which each may be turned as a whole
SHIFTS = (1, -1, 2, -2)  # grid: places by which lists are out of step
NAMED = 8  # grid: views that are named
FLAT = 0.999  # tolerance: a cosine: points that lie across z
FINE = 1e-4  # tolerance: of a focal length: noise of corners
LEAST = 1e-3  # tolerance: of a focal length: nobody asks whether less is left
Reread = Callable[[Observations], Observations]


@record
class _ViewTrial:
    """What frames leave of half and of three quarters of the rows of every instrument, as a share of its focal length or of what it
    reads, (2, O); and of a camera the share of the sights that have their target behind it, (O,)."""

    left: Array
    behind: Array

    @property
    def asks(self) -> bool:
        """Whether that is more than a nominal machine leaves."""
        return bool((self.left > VIEWS_ASK).any() or (self.behind > VIEWS_BEHIND).any())


@record
class _ViewChange:
    """One way to read the rows of some cameras: the code of its finding, the rows of each camera, its numbers, and the views that
    are turned with the turn."""

    code: str
    cameras_read: Mapping[int, Reread]
    numbers: Mapping[str, Number] = field(default_factory=dict)
    turned: Mapping[int, tuple[Array, Bools]] = field(default_factory=dict)


@check("views-as-stated", When.PROOF, order=190, needs=("data", "base"))
@once
def wrong_views(context: Context[Model]) -> list[Finding]:
    """What is wrong with all views of a camera."""
    data, base = context.need_data, context.need_baseline
    if not _cameras(data):
        return []
    # What everything free explains, the machine was off by. Readings of another kind beside the images give way first: not asked here.
    free = context.soft if context.fit is None else Baseline(context.fit.problem, context.fit.solution.x)
    ends = (base,) if free is None or len(_cameras(data)) < len(data.observations) else (base, free)
    asks = (_measure(data, e.problem, e.x).asks or seem_of_other_unit(data, e.problem, e.x) for e in ends)
    return explain_views(context) if all(asks) else []


def explain_views(context: Context[Model]) -> list[Finding]:
    """The changes that explain what is left of views, where any do."""
    data = context.need_data
    whole = DataSet(data.configurations, tuple(replace(o, used=None) for o in data.observations))
    return _ViewSearch(context.model, whole, _cameras(data)).explain()


def _cameras(data: DataSet) -> tuple[int, ...]:
    return tuple(i for i, o in enumerate(data.observations) if o.kind == "pixels" and o.value.ndim == 2)


def _measure(data: DataSet, problem: Problem, x: Array) -> _ViewTrial:
    """What is left at a solution of a problem of the data."""
    errors: list[list[Array]] = [[] for _ in data.observations]
    behind = np.zeros(len(errors))
    for (own, term), r in zip(owners(data, problem), problem.residuals(x), strict=True):
        start, stop, _ = term.parts[0]
        errors[own].append(np.linalg.norm(r.value.reshape(len(r.configuration), -1)[:, start:stop], axis=1))
        if isinstance(term, PixelRows):
            behind[own] += term.behind(x) * len(term.index) / len(data.observations[own])
    pairs = [(np.concatenate(e), _size(o)) for e, o in zip(errors, data.observations, strict=True)]
    return _ViewTrial(
        np.array([[quantile(e, level) / size for e, size in pairs] for level in (0.5, VIEWS_RIGHT)]), behind
    )


def _size_of(trial: _ViewTrial) -> float:
    """What is left of all instruments, each by its own size."""
    return float(np.log(np.maximum(trial.left, FINE)).sum())


def _size(obs: Observations) -> float:
    """What an error of an instrument is a share of: of a camera its focal length, else what it reads."""
    if obs.kind == "pixels":
        return float(intrinsics_of(obs)[0])
    return max(float(np.median(np.linalg.norm(obs.value, axis=-1))), 1.0)


@record
class _ViewSearch:
    """A machine, its data with every row, and which of the observations are of cameras."""

    model: Model
    data: DataSet
    cameras: tuple[int, ...]

    def explain(self) -> list[Finding]:
        """What explains the views. Joints say where each camera's target is; where poses are found by the fit, all instruments share
        them, and the worst camera draws the others along."""
        if not freedom_of(self.model):
            alone = [replace(self, data=self._only((i,)), cameras=(0,)) for i in self.cameras]
            found = [f for one in alone for f in one._of_group((0,))]
            # Half of the views of a camera may be turned, and nothing but the other cameras says which half.
            if len(alone) > 1 and all(f.code == TARGET_TURNED for f in found):
                found = list(self._of_turned(self.cameras)) or found
            return merge_findings(found)
        stated = self._fit({}, robust=True)
        order = sorted(self.cameras, key=lambda i: -float(stated.left[1, i] + stated.behind[i]))
        groups = [(order[0],), *([self.cameras] if len(order) > 1 else []), *((i,) for i in order[1:])]
        for group in groups:
            if found := self._of_group(group, stated):
                return found
        return []

    def _only(self, some: tuple[int, ...]) -> DataSet:
        return DataSet(self.data.configurations, tuple(self.data.observations[i] for i in some))

    def _of_group(self, group: tuple[int, ...], stated: _ViewTrial | None = None) -> list[Finding]:
        """The changes of some cameras that explain them, alike."""
        stated = stated or self._fit({}, robust=True)
        if not stated.asks:
            return []
        return list(self._best(list(self._changes(group)), stated))

    def _of_turned(self, group: tuple[int, ...]) -> Iterator[Finding]:
        """Cameras each of which alone is explained, but not all together: one may have its target the other way round."""
        stated = self._fit({}, robust=True)
        if (stated.left > VIEWS_ASK).any():
            yield from list(self._best(list(self._turns(group)), stated))[:1]

    def _best(self, changes: list[_ViewChange], stated: _ViewTrial) -> Iterator[Finding]:
        """Findings of the changes that leave least, where they explain what was left."""
        rough = [_size_of(self._fit(c.cameras_read)) for c in changes]
        few = [changes[i] for i in np.argsort(rough, kind="stable")[:BEST]]
        trials = [(c, self._fit(c.cameras_read, robust=True, against=stated)) for c in few]
        good = [(c, t) for c, t in trials if any(self._explains(stated, t, k) for k in range(2))]
        if not good:
            return
        least = EXPLANATIONS_ALIKE * np.maximum(min((t for _, t in good), key=_size_of).left, FINE)
        for change, trial in good:
            if (trial.left <= least).all():
                yield self._finding(change, stated, trial)

    def _fit(
        self, changed: Mapping[int, Reread], *, robust: bool = False, against: _ViewTrial | None = None
    ) -> _ViewTrial:
        """What frames leave of a part of the data, where the rows of some instruments are read in another way. A fit that finds
        no end and explains nothing of what was left before, `against`, is given up: of a right change it ends in few steps."""
        read = [changed[i](o) if i in changed else o for i, o in enumerate(self.data.observations)]
        seen = np.unique(np.concatenate([self.data.observations[i].configuration for i in self.cameras]))
        views, points = (VIEWS, POINTS) if robust or not freedom_of(self.model) else ROUGH
        where = seen[np.unique(np.linspace(0, len(seen) - 1, views).astype(np.int64))]
        begun = DataSet(self.data.configurations, tuple(map(as_printed, read)))
        if changed and any(o.kind == "lengths" for o in read):
            # Poses and targets may have started from the images as they are: those of other images start from the lengths.
            begun = place_configurations(
                self.model, replace(begun, configurations=replace(begun.configurations, start=None))
            )
            for i in changed:
                begun = place_camera_targets(begun, i, where)
        kept = tuple(subsample_views(o, where, points) for o in begun.observations)
        part = DataSet(begun.configurations, kept).take(where)
        if len(part.observations) != len(read):
            return _ViewTrial(np.full((2, len(read)), np.inf), np.ones(len(read)))
        with np.errstate(all="ignore"):
            everyone = np.arange(len(part.configurations))

            def hopeless(problem: Problem, x: Array) -> bool:
                trial = _measure(part, problem, x)
                return against is not None and not any(self._explains(against, trial, k) for k in range(2))

            found = fit_baseline(self.model, part, everyone, "tukey" if robust else "none", hopeless=hopeless)
            return _measure(part, found.problem, found.x)

    def _changes(self, group: tuple[int, ...]) -> Iterator[_ViewChange]:
        """Every change worth a trial in some cameras."""
        yield _ViewChange(AXES_EXCHANGED, dict.fromkeys(group, exchange_axes))
        yield _ViewChange(IMAGE_MIRRORED, dict.fromkeys(group, mirror))
        # Where the camera may be turned at will, this and a mirror are one.
        if any(knows_turn(self.data.observations[i]) for i in group):
            yield _ViewChange(V_UPWARD, dict.fromkeys(group, flip))
        for shift in SHIFTS:
            where, way = ("below", "up") if shift < 0 else ("above", "down")
            words = {"shift": f"{abs(shift)} view{'s' if abs(shift) > 1 else ''}", "where": where, "way": way}
            yield _ViewChange(VIEWS_SHIFTED, dict.fromkeys(group, partial(shift_views, shift=shift)), words)
        for code, read, numbers in target_changes([self.data.observations[i] for i in group]):
            yield _ViewChange(code, dict.fromkeys(group, read), numbers)
        yield from self._turns(group)

    def _explains(self, stated: _ViewTrial, trial: _ViewTrial, level: int) -> bool:
        """Whether a change explains what was left of half or of three quarters of the rows: every target stands before its camera, and
        all instruments are explained. A machine leaves as much as its making does."""
        own = (self.model.table[n] for n in self.model.geometric)
        most = max([VIEWS_ASK, *(p.scale for p in own if p.unit == "m" and p.free)])
        return _explains(stated, trial, level, most)

    def _turns(self, group: tuple[int, ...]) -> Iterator[_ViewChange]:
        """Half a turn of the target in the views that ask for it, and in some cameras in the others."""
        marked = []
        for i in group:
            obs = self.data.observations[i]
            turn, carrier = half_turn(obs), carriers(self.model, self.data)
            if turn is None or carrier is None:
                return
            views, mine = view_poses(obs), np.zeros(len(self.data.configurations), dtype=bool)
            if len(views.configuration) > 2:
                some = turned_views(views, turn, carrier[views.configuration])
                mine[views.configuration[some]] = True
            marked.append((turn, mine))
        # Of one camera most views are right; beside others that see the same target, all of them may be turned.
        several = (
            product(*[(False, True)] * (len(group) - 1)) if len(group) <= TURNED else [(False,) * (len(group) - 1)]
        )
        for others in several:
            views_of = {i: (t, m ^ all_of) for i, (t, m), all_of in zip(group, marked, (False, *others), strict=True)}
            if any(m.any() for _, m in views_of.values()):
                read = {i: partial(turn_views, turn=t, views=m) for i, (t, m) in views_of.items()}
                yield _ViewChange(TARGET_TURNED, read, turned=views_of)

    def _finding(self, change: _ViewChange, stated: _ViewTrial, trial: _ViewTrial) -> Finding:
        group = [i for i in change.cameras_read if i not in change.turned or change.turned[i][1].any()]
        some = [self.data.observations[i] for i in group]
        # Told in the numbers of the instrument that was worst; where poses follow the cameras, it may be another one.
        level = int(self._explains(stated, trial, 1))
        worst = int(np.argmax(stated.left[level]))
        size, unit = _size(self.data.observations[worst]), kind_of(self.data.observations[worst]).parts[0][2]
        numbers: dict[str, Number] = {
            "instruments": tuple(o.label for o in some),
            "files": tuple(dict.fromkeys(o.source.replace("\\", "/").rpartition("/")[2] for o in some)),
            "stated": Quantity(float(stated.left[level, worst]) * size, unit),
            "left": Quantity(float(trial.left[level, worst]) * size, unit),
        }
        if change.code in (AXES_EXCHANGED, IMAGE_MIRRORED):
            numbers |= {"behind": float(stated.behind[group].max()) or None, "line": "pixels: {columns: [v, u]}"}
            if change.code == IMAGE_MIRRORED and numbers["behind"]:
                numbers["stated"] = None  # from behind a mirrored image fits as well
        if change.code == TARGET_TURNED:
            numbers |= self._turned_numbers(change)
        return refuse(change.code, **numbers, **change.numbers)

    def _turned_numbers(self, change: _ViewChange) -> dict[str, Number]:
        """Which views are turned, and what to subtract points from."""
        names, total = [], 0
        for i, (_, marked) in change.turned.items():
            obs = self.data.observations[i]
            seen = np.unique(obs.configuration)
            total += len(seen)
            names += [f"{self.data.configurations.ids[c]} of {obs.label}" for c in seen[marked[seen]]]
        more = (f"{len(names) - NAMED} more",) if len(names) > NAMED else ()
        turn = next(iter(change.turned.values()))[0]
        ends = [Quantity(float(turn[k, 3])) if turn[2, 2] > FLAT else None for k in range(2)]
        return {"count": len(names), "total": total, "views": (*names[:NAMED], *more), "x": ends[0], "y": ends[1]}


def _explains(stated: _ViewTrial, trial: _ViewTrial, level: int, most: float) -> bool:
    """Whether what is left falls clearly, to `most` at most."""
    before, after = float(stated.left[level].max()), float(trial.left[level].max())
    if (trial.behind > VIEWS_BEHIND).any() or after > most:
        return False
    # What is explained from behind is a mirrored image: the right one leaves no less.
    if (stated.behind > VIEWS_BEHIND).any():
        return after <= max(EXPLANATIONS_ALIKE * before, LEAST)
    return before > VIEWS_ASK and after <= before / EXPLAINED_CLEARLY


def carriers(model: Model, data: DataSet) -> Array | None:
    """Where what moves is at every configuration, (U, 4, 4), as the nominal machine has it; None where nothing says it."""
    where = data.configurations
    if joints_of(model) and where.joints is not None:
        return reach(model.mechanism, where.joints, (), where.columns)[0] if model.mechanism is not None else None
    return None if where.start is None else se3.from_vector(where.start)
