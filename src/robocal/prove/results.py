"""From a fit to the tables that people read: parameters with their status, rows with their errors, the prediction
band."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.check_registry import Finding, When, check, note, once
from robocal.diagnose.growth import move_at_end
from robocal.diagnose.limits import PARTNERS_WIDER
from robocal.estimate.choosing.choice import together
from robocal.estimate.terms import Residuals
from robocal.estimate.uncertainty import band, quantile, uncertainty
from robocal.fit.estimators import estimator
from robocal.fit.noise import owners
from robocal.fit.scale import without_scales
from robocal.geometry import so3
from robocal.measure.base import KINDS, Rows
from robocal.measure.base import problem as build
from robocal.measure.builder import Builder
from robocal.measure.data import Configurations, DataSet, Observations, fingerprints
from robocal.measure.machine import Model
from robocal.parameters import ParameterTable
from robocal.prove.bands import find_identified, mean_conditions
from robocal.prove.decision import Decision
from robocal.prove.place_bands import base_motion, motion_field
from robocal.prove.region import range_of, region_of_limits
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark

__all__ = [
    "Band", "ParameterResult", "RowTable", "components", "nominal_values", "parameter_results", "prediction_of", "row_table",
]  # fmt: skip

# From here on the hidden partners, not the data, decide how well a parameter is known, and it is said.
ROUNDING = 1e-12  # tolerance: rad


@record
class ParameterResult:
    """One parameter before and after (SI).

    `sigma` is as fitted and includes what its hidden partners may be off by; `sigma_conditional` would hold if every
    dropped parameter were exactly at its nominal value, `sigma_instrument` if the stated noise were all there is as well.
    """

    name: str
    unit: str
    nominal: float
    identified: float
    delta: float  # identified minus nominal; sigma and interval are of the same number
    sigma: float | None
    sigma_instrument: float | None
    sigma_conditional: float | None
    status: str  # identified | prior | dropped | fixed
    data_share: float | None
    remarks: tuple[Remark, ...] = ()
    interval: tuple[float, float] | None = None  # 95 %, from `sigma`
    expected: float | None = None  # standard deviation of its error before anything was measured

    @property
    def note(self) -> str:
        """The remarks in one line."""
        return "; ".join(map(str, self.remarks))


@record
class Band:
    """Predicted error of the identified model away from the data: one standard deviation over sampled joint
    configurations (m), `left` (m) of it at every pose: what the model does not describe."""

    mean: float
    p95: float
    max: float
    n: int
    region: str
    left: float = 0.0


@record
class RowTable:
    """One row per observation, SI: what residuals.csv and the pictures are made of."""

    configuration: tuple[str, ...]
    held_out: NDArray[np.bool_]
    group: tuple[str, ...]
    kind: tuple[str, ...]
    target: tuple[str, ...]
    place: Array  # (N, 3) predicted position of the target, or of an instrument that the machine carries, in base coordinates, else NaN
    before: Array  # (N, d) residual of the baseline; a vector (m) in base axes
    after: Array  # (N, d) residual of the identified model, from the fit that had not seen it when held out
    parts: tuple[tuple[tuple[int, int, str], ...], ...]
    unseen: Array  # (N,) error when not used for fitting: held out or left one out, NaN otherwise
    unseen_turn: Array  # (N,) [rad] the same of its angle, NaN where it has none
    aside: NDArray[np.bool_]  # (N,) gross rows: neither fitted nor in the means of held-out ones
    mark: NDArray[np.uint64]  # (N,) which measurement it is, in whatever file


def parameter_results(context: Decision[Model]) -> tuple[ParameterResult, ...]:
    """Every parameter of the problem, in table order, with status and note."""
    model, data, fit, off, u = (
        context.model,
        context.need_data,
        context.need_fit,
        context.need_fit.total,
        context.uncertainty,
    )
    table, seen = fit.problem.table, fit.identifiability
    share = dict(zip(seen.names, seen.share.tolist(), strict=True))
    start = nominal_values(model, table)
    values = fit.solution.x[0, : len(start)]
    total = components(table, *context.spread, values)
    reach = quantile(off.dof)
    free = fit.problem.free
    sigma = components(table, free, u.covariance * u.factor**2, values)
    instrument: dict[str, float] = {}
    if all(obs.sigma is not None for obs in data.observations):
        # The instrument's own bars: the same columns, weighed with the stated noise alone.
        own = fit.uncertainty
        if fit.problem.loss != "none" or not fit.problem.priors or any(g.tau for g in fit.groups):
            own = uncertainty(build(model, data).with_weights(fit.problem.weights).with_free(free), fit.solution.x)
        instrument = components(table, free, own.covariance, values)
    hidden: dict[str, list[str]] = {}
    for combination in seen.combinations:
        for name, _ in combination.partners:
            hidden.setdefault(name, []).append(combination.name)
    by_name = {c.name: c for c in seen.combinations}
    told = find_identified(fit)
    delta = values - start
    out = []
    for i, row in enumerate(table.rows):
        notes: tuple[Remark, ...] = ()
        bar, ends = None, None
        if row.name in free:
            bar = max(total[row.name], sigma[row.name])
            # What was excluded beforehand is not offered as possible.
            ends = float(max(values[i] - reach * bar, row.lower)), float(min(values[i] + reach * bar, row.upper))
            status = "identified" if row.name in told else "prior"
            partners, _ = together([(name, 1.0) for name in hidden.get(row.name, [])])
            if status == "prior" and not partners:
                notes = (Remark.of(Code.LITTLE_SAID),)
            elif status == "prior":
                notes = (Remark.of(Code.ONLY_COMBINATION, partners=partners),)
            elif partners and total[row.name] > PARTNERS_WIDER * sigma[row.name]:
                notes = (Remark.of(Code.HIDDEN_PARTNERS, partners=partners),)
            if values[i] <= row.lower or values[i] >= row.upper:
                notes = (Remark.of(Code.AT_BOUND), *notes)
        elif row.name in seen.loose:
            bar, status, notes = total[row.name], "prior", (Remark.of(Code.LITTLE_SAID),)
            ends = float(values[i] - reach * bar), float(values[i] + reach * bar)
        elif row.name in by_name:
            status, notes = "dropped", (by_name[row.name].remark,)
        else:
            status = "fixed"
        if bar is None and row.turn and abs(delta[i]) > ROUNDING:
            # Held was the turn about this axis; the component is another number.
            notes = (Remark.of(Code.FOLLOWS_TURN), *notes)
        out.append(
            ParameterResult(
                row.name, row.unit, float(start[i]), float(values[i]), float(delta[i]), bar, instrument.get(row.name), sigma.get(row.name),
                status, share.get(row.name), remarks=notes, interval=ends, expected=None if status == "fixed" else float(row.scale),
            )
        )  # fmt: skip
    return tuple(out)


def nominal_values(model: Model, table: ParameterTable) -> Array:
    """What every parameter of a problem is nominally, (P,): as the robot's file says, or the data's."""
    return np.array([model.table[p.name].value if p.name in model.table else p.value for p in table.rows])


def components(table: ParameterTable, names: Sequence[str], covariance: Array, values: Array) -> dict[str, float]:
    """Standard deviation of every free parameter from a covariance in the tangent: of a rotation vector v, whose components
    are told, by dv = Jinv(v) w; the covariance speaks of turns w."""
    out = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    for t in table.turns:
        mine = table.names[t : t + 3]
        free = [i for i, n in enumerate(mine) if n in out]
        at = [names.index(mine[i]) for i in free]
        slope = so3.left_jacobian_inverse(values[None, t : t + 3])[0][:, free]
        spread = np.sqrt(np.diag(slope @ covariance[np.ix_(at, at)] @ slope.T))
        out.update({mine[i]: float(spread[i]) for i in free})
    return out


def row_table(context: Decision[Model]) -> RowTable:
    """One row per observation, in the order of the terms."""
    data, proven, best = context.need_data, context.proven, context.proof
    base, part, held = proven.base, proven.part, proven.held_out
    missed = best.after.value if best else {}  # in the order of `misfit.errors`
    before, after = base.problem.residuals(base.x), part.problem.residuals(part.solution.x)
    ids = np.array(data.configurations.ids, dtype=object)
    configuration = np.concatenate([r.configuration for r in before])
    count = [len(r.configuration) for r in before]
    outside = np.isin(configuration, held)
    place, unseen, turned = [], [], []
    builders = [Builder(context.model, p.table, data.configurations) for p in (base.problem, part.problem)]
    own = [i for i, _ in owners(data, part.problem)]
    marks = fingerprints(data)
    seen = dict.fromkeys(missed, 0)
    for k, (b, a, term, i) in enumerate(zip(before, after, part.problem.terms, own, strict=True)):
        assert isinstance(term, Rows)
        obs = data.observations[i]
        nothing = np.full((len(a.configuration), 3), np.nan)
        frames = [
            _frames(builder, obs, term, x) for builder, x in zip(builders, (base.x, part.solution.x), strict=True)
        ]
        # An instrument on the tool sees what stands still: where that seems too far, the machine is not far enough.
        sign = -1.0 if obs.frame is not None and obs.frame.mount == "tool" and KINDS[term.kind].positional else 1.0
        before[k], after[k] = (_in_base(r, sign, frame) for r, frame in zip((b, a), frames, strict=True))
        place.append(_place(term, part.solution.x, obs, frames[1]) if KINDS[term.kind].positional else nothing)
        left: dict[str, Array] = {}
        for _, _, u in a.parts:
            if u in missed:
                left.setdefault(u, missed[u][seen[u] : seen[u] + len(nothing)])
                seen[u] += len(nothing)
        unseen.append(left.get(a.parts[0][2], nothing[:, 0]))
        turned.append(left.get("rad", nothing[:, 0]))
    terms = [t for t in part.problem.terms if isinstance(t, Rows)]
    return RowTable(
        configuration=tuple(ids[configuration]), held_out=outside, group=_repeat([r.group for r in before], count),
        kind=_repeat([r.kind for r in before], count), target=_repeat([t.target for t in terms], count), place=np.concatenate(place),
        before=np.concatenate([_row_residuals(r) for r in before]), after=np.concatenate([_row_residuals(r) for r in after]),
        parts=tuple(p for r, n in zip(before, count, strict=True) for p in [r.parts] * n), unseen=np.concatenate(unseen),
        unseen_turn=np.concatenate(turned), aside=np.concatenate([~t.used for t in terms]),
        mark=np.concatenate([marks[i][t.index] for i, t in owners(data, part.problem)]),
    )  # fmt: skip


def _frames(builder: Builder, obs: Observations, term: Rows, x: Array) -> Array:
    """T_base_instrument (m, 4, 4) of rows, one for all of them where the instrument stands still."""
    still = obs.frame is None or obs.frame.mount == "base"
    carrier = builder.instrument(obs, term.configuration[:1] if still else term.configuration)
    if carrier is None or not len(term.configuration):
        return np.eye(4)[None]
    nothing, rows = np.full(x.shape[1], -1, dtype=np.int64), 1 if still else len(term.configuration)
    return np.asarray(carrier.bind(nothing).pose(x, 0, rows)[0][0])


def _in_base(r: Residuals, sign: float, frame: Array) -> Residuals:
    """The same residuals; one that is a vector (m), in base axes and times a sign."""
    at = next((slice(a, b) for a, b, unit in r.parts if unit == "m" and b - a == 3), None)
    if at is None:
        return r
    value = r.value.copy()
    value[:, at] = sign * np.einsum("mij,mj->mi", np.broadcast_to(frame[:, :3, :3], (len(value), 3, 3)), value[:, at])
    return replace(r, value=value)


def _place(term: Rows, x: Array, obs: Observations, frame: Array) -> Array:
    """Where the machine was, in base coordinates (m, 3): what the instrument saw of it, or the instrument that it carries."""
    if obs.frame is not None and obs.frame.mount == "tool":
        return frame[:, :3, 3]
    return (frame[:, :3, :3] @ term.predict(x)[:, :3, None])[..., 0] + frame[:, :3, 3]


def _repeat(words: list[str], count: list[int]) -> tuple[str, ...]:
    return tuple(w for w, n in zip(words, count, strict=True) for _ in range(n))


def _row_residuals(r: Residuals) -> Array:
    """The residual of every row, padded with NaN to six columns; the first is the whole error where a lever makes one."""
    out = np.full((len(r.value), 6), np.nan)
    out[:, : r.value.shape[1]] = r.value[:, :6]
    if r.lever is not None:
        out[:, 0] = r.length()
    return out


@once
def prediction_of(context: Decision[Model]) -> Band | None:
    """One standard deviation of the error of the position that the fit to everything predicts over joint space: of the model, with hidden
    parameters as uncertain as expected, and of what it leaves at every pose.

        sigma^2 = tr(J C J^T) + 3 tau^2

    tau is what the model left per axis beyond the stated noise (all that it left where none is stated). What a scale does to all
    readings alike by moving the frame of the instrument is no error of the machine; what drifts along the file is. Configurations are
    those of the region, else drawn within the joint limits (the measured range where a limit is infinite); positions are
    those of the first position or pose instrument.
    """
    model, data, fit, off = context.model, context.need_data, context.need_fit, context.need_fit.total
    found = [o for o in data.observations if o.kind in ("position", "pose")]
    if data.configurations.joints is None or not found or not fit.identifiability.names:
        return None
    region = context.chosen.region or region_of_limits(model, data)
    count = len(region.joints)
    first, each, nowhere = found[0], np.arange(count), np.zeros((count, 3))
    seen = first.frame, first.targets, None if first.target is None else 0 * each
    template = Observations("position", each, nowhere, np.ones((count, 3)), *seen, options=first.options)
    columns = {k: np.full(count, v) for k, v in mean_conditions(data.configurations).items()}
    away = DataSet(Configurations(tuple(map(str, range(count))), region.joints, columns), (template,))
    made = build(model, away)
    known = {n: fit.solution.x[0, fit.problem.table.index[n]] for n in made.table.names}
    made = build(model, away, values=known, free=[n for n in off.names if n in made.table])
    seen_there = made.linearize(made.start)
    jac, own = seen_there.j.reshape(count, 3, -1), without_scales(off)
    where = [own.names.index(n) for n in made.free]
    more = [jac @ move_at_end(context, made.free)]
    if fit.scales is not None:
        place = seen_there.r.reshape(count, 3)
        long = jac @ (fit.scales.response * fit.scales.sigma)[where]
        long = long - motion_field(place)[:, :3] @ base_motion(long, place)
        more += list(np.moveaxis(long, 2, 0))
    tau = next((g.tau for g in fit.groups if g.name == first.label and g.unit == "m"), 0.0)
    left = float(np.sqrt(3)) * tau
    plain = band(jac, own.covariance[np.ix_(where, where)])
    sigma = np.sqrt(plain**2 + left**2 + sum(np.sum(v**2, axis=1) for v in more))
    mean, p95, most = float(sigma.mean()), float(np.percentile(sigma, 95)), float(sigma.max())
    return Band(mean, p95, most, count, region.name, left)


@check("elsewhere", When.FIT, order=270, needs=("proven",))
def elsewhere(context: Decision[Model]) -> Iterator[Finding]:
    """The predicted error away from the data; a method that fits what cannot be seen has no honest one."""
    b = prediction_of(context)
    if b is not None and not estimator(context.chosen.method).blind:
        left = Quantity(b.left) if b.left > 0 else None
        holds = range_of(context)
        verdict = holds.name if holds is not None and holds.name != b.region else None
        yield note(
            Code.ELSEWHERE, region=b.region, mean=Quantity(b.mean), p95=Quantity(b.p95), left=left, verdict=verdict
        )
