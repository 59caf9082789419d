"""Numbers of instruments that were stated and held: a ball's radius, a delay, the zero of a range, a lens.

A held number is a column c of its own. With Q an orthonormal basis of the columns that were fitted, and r the whitened
residuals,

    c_ = c - Q Q^T c,   change = -c_^T r / c_^T c_,   share = (c_^T r)^2 / (c_^T c_ r^T r),   t^2 = (N - n - 1) share / (1 - share)

where freeing it would lower r^T r by that share. Instruments of one kind may share what is wrong: the sum of their columns is
one more. A number that is off by more than the readings allow, and whose change explains a good part of what is left, is wrong,
and the model with it: a gain says nothing then. Source: Rao, Large sample tests of statistical hypotheses (1948).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robocal._record import field, record, replace
from robocal._types import Array
from robocal.diagnose.check_registry import Context, Finding, check_fit_twice, doubt, once, refuse
from robocal.diagnose.limits import LENS_FACTOR, NUMBER_SHARE, NUMBER_SIGMA
from robocal.estimate.elimination import triangle
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.measure.base import kind_of
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Observations
from robocal.measure.machine import Model
from robocal.parameters import Parameter
from robocal.remarks.code import Code
from robocal.remarks.english import declare
from robocal.remarks.remark import Quantity

__all__ = ["Score", "find_stated_number", "reads", "score"]


FACTOR_WRONG = declare(
    "lens-factor",
    "{number} is fixed at {stated:.4g}, but these data give {there:.4g} ({z:.0f} sigma), {name} a factor of {factor:.3f}[: the images "
    "may be scaled by {ratio}]; the difference explains {share:.0%} of the squared residuals",
    "Use the lens of images of this size: all four numbers change with it.[ Of images that were scaled, write `scale: {scale:.5g}` beside "
    "the `file` of the lens.] Or identify it ({line}).",
)
FACTOR_DOUBTED = declare(
    "lens-factor-doubted",
    "{number} is fixed at {stated:.4g}, but these data give {there:.4g} ({z:.0f} sigma), {name} a factor of {factor:.3f}[: the images "
    "may be scaled by {ratio}]; the difference explains {share:.1%} of the squared residuals",
    "Check the focal length and the size of the images, or identify it ({line}).",
)
FACTOR_NEAR = 0.03  # tolerance: of a ratio of two sizes of images: a focal length is known so well
HOLD = 10.0  # expected errors
HIDDEN = 1e-6  # tolerance: of a column that the fitted ones leave over: rounding


@check_fit_twice(doubt=("stated-number", 220), refuse=("wrong-number", 150))
@once
def find_stated_number(context: Context[Model]) -> list[Finding]:
    """The held number of an instrument that the data contradict most. It is refused where it explains a good part of what is left: the
    model is wrong with it. `line` lets it be identified."""
    fit = context.need_fit
    data = replace(fit.data, observations=tuple(map(_name_zero, fit.data.observations)))
    own = _own(data)
    held = [n for n in own if n not in fit.problem.free]
    if not held:
        return []
    made = build(context.model, data, values=context.values).with_weights(fit.problem.weights)
    made = made.with_free([*fit.problem.free, *held])
    seen = made.linearize(_at(made, fit.problem, fit.solution.x))
    asked = np.isin(made.free, held)
    plain = [*((n,) for n in held), *_shared(own, held)]
    factors = _factors(own, held)
    some = [*plain, *factors]
    # What a factor changes together changes in proportion to what is stated.
    weights = [*(np.ones(len(n)) for n in plain), *(np.array([own[n][1].value for n in names]) for names in factors)]
    mix = np.zeros((len(held), len(some)))
    for k, (names, w) in enumerate(zip(some, weights, strict=True)):
        mix[[held.index(n) for n in names], k] = w
    c = seen.j[:, [made.free.index(n) for n in held]]
    parts = seen.j[:, ~asked], seen.r, made.scales[~asked], c
    found = score(*parts, made.repeated, mix)
    if found is not None and found.t >= NUMBER_SIGMA and found.column >= len(plain):
        wrong = some[found.column]
        factor = _refit(made.with_free([*fit.problem.free, *wrong]), [own[n][1] for n in wrong])
        if abs(factor - 1) > LENS_FACTOR:
            return [_of_factor(own, wrong, factor, found)]
        found = score(*parts, made.repeated, mix[:, : len(plain)])
    if found is None or found.t < NUMBER_SIGMA:
        return []
    wrong = some[found.column]
    obs, p = own[wrong[0]]
    stated, there = (Quantity(v, p.unit) for v in (p.value, p.value + found.change))
    level, code = (refuse, Code.NUMBER_WRONG) if found.share > NUMBER_SHARE else (doubt, Code.NUMBER_DOUBTED)
    name, line = ", ".join(wrong), _line(obs, p)
    return [level(code, name=name, stated=stated, there=there, z=found.t, share=found.share, line=line)]


def _at(made: Problem, fitted: Problem, x: Array) -> Array:
    """The start of a problem of the same rows, with every block where the fit has left it."""
    out = np.array(made.start)
    for there, here in zip(made.places, fitted.places, strict=True):
        out[:, there] = x[:, here]
    return out


def _of_factor(
    own: Mapping[str, tuple[Observations, Parameter]], wrong: Sequence[str], factor: float, found: Score
) -> Finding:
    """Numbers that are a factor off, together."""
    obs, p = own[wrong[0]]
    level, code = (refuse, FACTOR_WRONG) if found.share > NUMBER_SHARE else (doubt, FACTOR_DOUBTED)
    stated, there = (Quantity(v, p.unit) for v in (p.value, p.value * factor))
    line = _line(obs, *(own[n][1] for n in wrong))
    names = {"number": p.name, "name": ", ".join(wrong), "ratio": _ratio(factor), "scale": _scale(factor), "line": line}
    return level(code, **names, stated=stated, there=there, factor=factor, z=found.t, share=found.share)


@record
class Score:
    """Of several numbers that were held, each with its column: the one that lowers the squares most, by how much it changes, how
    many sigma that is, and which share of the squares it explains; `addends` (N,) are the terms, one a row, of the sum
    whose scatter that sigma tells, `squares` (2, N) what every row leaves before and after."""

    column: int
    change: float
    t: float
    share: float
    addends: Array = field(compare=False, repr=False)
    squares: Array = field(compare=False, repr=False)


def score(j: Array, r: Array, scales: Array, c: Array, taken: float = 0, mix: Array | None = None) -> Score | None:
    """What residuals r (N,) say of further columns c (N, k) beside those that were fitted, j (N, n), of numbers of these `scales`
    (n,), where local blocks, and visits that tell nothing new, have `taken` so many; `mix` (k, m) makes the
    candidates of these columns, where they are not each one; None where nothing is left, or can be told."""
    # The fitted ones are held softly: otherwise all could shrink to a point with the number, and nothing would be left.
    soft = np.diag(1 / (HOLD * scales))
    n, k = j.shape[1], c.shape[1]
    mix = np.eye(k) if mix is None else mix
    root = triangle(np.vstack([np.column_stack([j, c, r]), np.pad(soft, ((0, 0), (0, k + 1)))]))
    # Of the further columns and of the residuals, what the fitted ones leave.
    over, rest_over, c = root[n:, n : n + k] @ mix, root[n:, n + k], c @ mix
    size, whole = (np.linalg.norm(a, axis=0) for a in (over, c))
    size = np.where(size > HIDDEN * whole, size, np.inf)
    along = np.where(np.isfinite(size), -(over.T @ rest_over) / size, 0.0)
    left, dof = float(r @ r), len(j) - n - taken - 1
    if not left > 0 or dof < 1:
        return None
    share = along**2 / left
    t = np.sqrt(dof * share / np.maximum(1 - share, 1e-12))
    i = int(np.argmax(t))
    change = float(along[i] / size[i])
    beside = np.column_stack([root[:n, n : n + k] @ mix[:, i], root[:n, n + k]])
    column, rest = (np.column_stack([c[:, i], r]) - j @ np.linalg.solve(root[:n, :n], beside)).T
    after = rest + column * change
    return Score(i, change, float(t[i]), float(share[i]), column * after, np.stack([rest**2, after**2]))


def _shared(own: Mapping[str, tuple[Observations, Parameter]], held: Sequence[str]) -> list[tuple[str, ...]]:
    """Like numbers of several instruments of one kind that were held at one value."""
    by: dict[tuple[str, str, float], list[str]] = {}
    for name in held:
        obs, p = own[name]
        by.setdefault((obs.kind, name.rpartition(".")[2], p.value), []).append(name)
    return [tuple(some) for some in by.values() if len(some) > 1]


def _factors(own: Mapping[str, tuple[Observations, Parameter]], held: Sequence[str]) -> list[tuple[str, ...]]:
    """Numbers that one factor changes together, of each instrument and of all that were stated alike; where all of them were held."""
    asked, by = set(held), dict[tuple[str, ...], list[tuple[str, ...]]]()
    for obs in {o.options.get(kind_of(o).owner): o for o, _ in own.values()}.values():
        for symbols in kind_of(obs).factors:
            names = tuple(f"{obs.options[kind_of(obs).owner]}.{s}" for s in symbols)
            if asked.issuperset(names):
                by.setdefault(symbols, []).append(names)
    several = [tuple(n for names in each for n in names) for each in by.values() if len(each) > 1]
    return [*(names for each in by.values() for names in each), *several]


def _refit(problem: Problem, wrong: Sequence[Parameter]) -> float:
    """The factor of some numbers, once they are free: half of a lens is far for one linear step."""
    x = least_squares(problem.with_loss("huber"), problem.start).x[0]
    return float(np.median([x[problem.table.index[p.name]] / p.value for p in wrong]))


def _scale(factor: float) -> float | None:
    """The same as a number."""
    ratio = _ratio(factor)
    return None if ratio is None else int(ratio[0]) / int(ratio[2])


def _ratio(factor: float) -> str | None:
    """A ratio of small whole numbers that a factor is near, as sizes of images have."""
    near = [(a, b) for b in (1, 2, 3, 4) for a in (1, 2, 3, 4) if a != b and abs(factor * b / a - 1) < FACTOR_NEAR]
    return f"{near[0][0]}/{near[0][1]}" if near else None


def _name_zero(obs: Observations) -> Observations:
    """The same rows; a number that is zero because nobody speaks of it gets a name, and can be asked."""
    owner = kind_of(obs).owner
    if not owner or obs.options.get(owner):
        return obs
    return replace(obs, options={**obs.options, owner: obs.label, "free": ()})


def _own(data: DataSet) -> Mapping[str, tuple[Observations, Parameter]]:
    """The numbers of all instruments that read the machine."""
    return {p.name: (o, p) for o in data.observations if reads(o) for p in kind_of(o).parameters(o)}


def reads(obs: Observations) -> bool:
    """Whether something is read of the machine: a distance between two things that both stand still gives the scale, and nothing can
    question it."""
    ends = obs.options.get("ends", ())
    return not (isinstance(ends, tuple) and ends and all(e.mount == "base" for e in ends))


def _line(obs: Observations, *numbers: Parameter) -> str:
    """What to write in the data file."""
    owner = kind_of(obs).owner
    several = len(kind_of(obs).parameters(obs)) > 1
    symbols = ", ".join(dict.fromkeys(n.name.rpartition(".")[2] for n in numbers))
    return f"{owner}: {{free: [{symbols}]}}" if several else f"{owner}: {{free: true}}"
