"""Rows of every file in their order, with what a moved target or instrument would have done to each.

    r + J dx + E c = noise        E = D on the rows of a segment, 0 elsewhere

J are the columns of everything that is free, D those of a frame at which the rows look: a target that moved on the tool
is constant in the tool's axes, an instrument that moved is constant in its own. Where nothing was said of a target, the
tool itself is what would have moved. All whitened with the noise as fitted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.diagnose.limits import SEGMENT_VIEWS, VIEW_FAR
from robocal.diagnose.segments.posed import runs_of_poses
from robocal.diagnose.segments.row_sequence import Candidate, RowSequence, whiten_terms
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.uncertainty import effective_columns
from robocal.fit.noise import apply_noise, assess, tau_of, under
from robocal.fit.place_noise import visit_again, weigh_visits
from robocal.fit.repeats import places
from robocal.measure.base import kind_of
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Model, freedom_of
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["runs"]

HOLD = 3.0  # expected errors: how softly the model is held, so that few rows cannot bend it to anything
FELT = 1e-6  # tolerance: of the largest column: what is less is rounding
UNSAID = "moved"  # owner of the target that nobody named


def runs(
    model: Model, data: DataSet, start: Mapping[str, float], weights: Array | None = None
) -> tuple[list[RowSequence], Array]:
    """Every file as a run, at a robust fit of everything free from `start`, and the information (n,) that holds it."""
    own = bool(freedom_of(model))
    seen = _count_all if own else _with_target
    asked = DataSet(data.configurations, tuple(seen(o, i) for i, o in enumerate(data.observations)))
    made = build(model, asked).with_weights(weights).with_loss("huber")
    if not made.free or len(made.families) > int(own):
        return [], np.zeros(0)
    first = made
    made = made.with_table(made.table.with_values({n: v for n, v in start.items() if n in made.table.index}))
    x = made.start
    if own:  # where the poses are by these numbers
        x = least_squares(made.with_free(()), x, max_iterations=20, cost_tolerance=1e-4).x
    configurations = np.flatnonzero(made.in_use)
    for moved in (0, made.n):
        tau = tau_of(assess(asked, made, x, configurations, moved))
        noisy = apply_noise(asked, tau)
        made = under(first, asked, tau)
        if not moved:
            x = least_squares(made.soften(x, HOLD), x, max_iterations=20, cost_tolerance=1e-4).x
    info = 1 / (HOLD * made.scales) ** 2
    found = runs_of_poses(model, made, noisy, x) if own else _collect(made, noisy, x)
    if found and visit_again(data, configurations):
        # What a model leaves at a place is the same at every visit: by itself it looks like a step wherever the next place begins.
        soft = made.soften(x, HOLD)
        share = weigh_visits(asked, made, x, configurations, effective_columns(soft, x))
        label = places(data.configurations)
        at = (np.arange(len(share)) if own else r.obs.configuration for r in found)
        found = [replace(r, share=share[u], label=label[u]) for r, u in zip(found, at, strict=True)]
    return found, info


def _count_all(obs: Observations, _: int) -> Observations:
    """The same, where rows that were set aside as gross count again: there may be a reason for all of them."""
    return replace(obs, used=_without_lone_views(obs))


def _without_lone_views(obs: Observations) -> Bools | None:
    """Which rows (k,) count again; None for all. A view that was set aside stays so where those beside it in the file were not: it has
    enough rows for a step of its own, but what moved is seen by several views, one after another."""
    if obs.used is None or not kind_of(obs).views:
        return None
    out = ~obs.used
    alone = np.zeros(len(obs), dtype=bool)
    target = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
    for t in np.unique(target):
        rows = np.flatnonzero(target == t)
        _, first, view = np.unique(obs.configuration[rows], return_index=True, return_inverse=True)
        view = np.argsort(np.argsort(first))[view]  # in the order of the file
        off = np.bincount(view, out[rows]) > VIEW_FAR * np.bincount(view)
        ends = np.flatnonzero(np.diff(off, prepend=False, append=False)).reshape(-1, 2)
        few = np.zeros(len(off), dtype=bool)
        for a, b in ends:
            few[a:b] = b - a < SEGMENT_VIEWS
        alone[rows] = few[view] & out[rows]
    return ~alone if alone.any() else None


def _with_target(obs: Observations, number: int) -> Observations:
    """The same with a target, where none was named: at the tool's origin, and held there."""
    obs = _count_all(obs, number)
    if obs.targets:
        return obs
    mount = "base" if obs.frame is not None and obs.frame.mount == "tool" else "tool"
    said = Frame(f"{UNSAID}{number}", mount=mount)
    return replace(obs, targets=(said,), target=np.zeros(len(obs), dtype=np.int64))


def _collect(problem: Problem, data: DataSet, x: Array) -> list[RowSequence]:
    frames = {f.name for o in data.observations for f in (*o.targets, *((o.frame,) if o.frame else ()))}
    wide = problem.with_free([*problem.free, *(f"{f}.{s}" for f in frames for s in FRAME_SYMBOLS)])
    own = wide.column_of[problem.index]
    parts: dict[int, list[tuple[Ints, Array, Array, Array]]] = {}
    for number, term, r, j, _ in whiten_terms(data, wide, x):
        used = term.scale > 0  # a row that stays set aside moves nothing
        sigma = np.divide(1.0, term.scale, out=np.zeros_like(term.scale), where=used)
        parts.setdefault(number, []).append((term.index, r, j, sigma))
    out = []
    for number, some in parts.items():
        obs, (index, r, j, sigma) = data.observations[number], some[0]
        if len(some) > 1:  # the rows of one term are in order
            index, r, j, sigma = (np.concatenate(p) for p in zip(*some, strict=True))
            order = np.argsort(index, kind="stable")
            r, j, sigma = (v[order] for v in (r, j, sigma))
        alone = np.ones(len(r)), np.arange(len(r))
        out.append(RowSequence(obs, sigma, r, j[..., own], _candidates(obs, wide, j), kind_of(obs).parts, *alone))
    return out


def _candidates(obs: Observations, wide: Problem, j: Array) -> tuple[Candidate, ...]:
    """Every target alone, all of them together, and the instrument."""

    def of(name: str) -> Array:
        return j[..., wide.column_of[[wide.table.index[f"{name}.{s}"] for s in FRAME_SYMBOLS]]]

    seen = range(len(obs.targets)) if obs.target is None else np.unique(obs.target)
    names = [obs.targets[int(t)].name for t in seen]
    found = [("target", n if len(names) > 1 else "", of(n)) for n in names]
    if len(names) > 1:
        # Targets on one tool shift together; how they would turn together is not asked.
        found.append(("target", ", ".join(names), np.sum([of(n)[..., :3] for n in names], axis=0)))
    if obs.frame is not None:
        found.append(("instrument", "", of(obs.frame.name)))
    size = [np.sqrt(np.sum(column**2, axis=(0, 1))) for *_, column in found]
    felt = [s > FELT * s.max(initial=0.0) for s in size]
    return tuple(Candidate(cause, name, v[..., f]) for (cause, name, v), f in zip(found, felt, strict=True) if f.any())
