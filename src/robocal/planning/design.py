"""What every pose would tell, and what is to be predicted: candidates and test poses as blocks of one linear model.

    y = y0 + A_i (theta - theta0) + noise         A_i whitened, every column in units of its expected error
    e_t = T_t (theta - theta0)                    the error of the measured point at test pose t, in m

The point is given in the instrument's frame. What no measurement can see of that frame (all of it where an instrument
has none on the base: a ballbar, a camera in hand) is aligned to the test points, as a person does who tells a robot
where his table stands: its columns are projected out of T. Frames and targets count as known to DECIMETRE beforehand,
which any measurement improves a thousandfold; a wider prior would only cost digits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from robocal._record import record, replace
from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.errors import ModelError
from robocal.estimate.criteria import Criterion, criterion_of, information
from robocal.estimate.selection import Design, Pool
from robocal.measure.base import problem as build
from robocal.measure.data import DataSet, Frame, Observations
from robocal.parameters import FRAME_SYMBOLS
from robocal.planning.candidates import Template, observe
from robocal.progress import Watch

__all__ = ["Blocks", "blocks", "choose_best", "criterion_and_blocks", "predict_sigma", "sum_information"]

DECIMETRE = 0.1
ALIGNED = "aligned to"  # no parameter of a file can have this name
UNSEEN = 1e-12


@record
class Blocks:
    """Candidates (m, d, n), tests (t, 3, n) in m, and what is known before (n, n), in units of the expected errors;
    names of the columns."""

    names: tuple[str, ...]
    candidates: Array
    tests: Array
    known: Array


def blocks(
    model: Chain,
    template: Template,
    q: Array,
    tests: Array,
    *,
    measured: DataSet | None = None,
    values: Mapping[str, float] | None = None,
    columns: Mapping[str, Array] | None = None,
) -> Blocks:
    """Linearises what the template's instrument would measure at joint values q (m, n), and where its point would be at
    tests (t, n).

    `measured` are data whose information is there already; `values` are parameters to linearise at. Raises ModelError
    when nothing is free.
    """
    columns = columns or {}
    done = 0 if measured is None else len(measured.configurations)
    new = observe(template, q, tuple(f"candidate {i}" for i in range(len(q))), columns)
    point = _point(template)
    there = observe((point,), tests, tuple(f"test {i}" for i in range(len(tests))), columns)
    data = new + there if measured is None else measured + new + there
    # What was fitted beside it, as places that are not planned for, says nothing of these poses.
    told = build(model, data).table.index
    made = build(model, data, values={n: v for n, v in (values or {}).items() if n in told})
    if not made.n:
        raise ModelError("nothing is free to be identified", key="calibrate.free", expected="at least one parameter")
    assert point.frame is not None
    loose = {f"{point.frame.name}.{s}" for s in FRAME_SYMBOLS}
    scale = np.where([n in loose for n in made.free], DECIMETRE, np.minimum(made.scales, DECIMETRE))
    lin = made.linearize(made.start)
    # Terms come one after the other; stable sorting gathers the rows of each configuration.
    order = np.argsort(lin.configuration, kind="stable")
    configuration, j = lin.configuration[order], lin.j[order] * scale
    ends = np.searchsorted(configuration, [done, done + len(q)])
    before, now, later = np.split(j, ends)
    width = j.shape[1]
    candidates = now.reshape(len(q), -1, width)
    known = before.T @ before
    seen = np.sum(now * now, axis=0) + np.diag(known) > UNSEEN
    gauge = np.array([n in loose for n in made.free]) & ~seen
    keep = ~gauge
    target = _without(later, gauge)
    # All targets of a pose, averaged.
    target = target.reshape(len(tests), -1, width)[..., keep] / np.sqrt(max(1, len(point.targets)))
    names = tuple(n for n, k in zip(made.free, keep, strict=True) if k)
    known = known[np.ix_(keep, keep)] + np.eye(len(names))
    # The tests are in metres: their rows were divided by a sigma of 1 m.
    return Blocks(names, np.ascontiguousarray(candidates[..., keep]), np.ascontiguousarray(target), known)


def _point(template: Template) -> Observations:
    """The measured points as a perfect tracker would see them, in the frame of the first instrument that stands on the
    base."""
    first = next((o for o in template if o.frame is not None and o.frame.mount == "base"), template[0])
    own = first.frame if first.frame is not None and first.frame.mount == "base" else None
    frame = own or Frame(ALIGNED, free=(True,) * 6)
    held = tuple(t for t in first.targets if t.mount == "tool")
    k = max(1, len(held))
    each = np.arange(k) if held else None
    zero = np.zeros(k, dtype=np.int64)
    return Observations("position", zero, np.zeros((k, 3)), np.ones((k, 3)), frame, held, each)


def _without(rows: Array, gauge: NDArray[np.bool_]) -> Array:
    """Rows (k, n) with the span of some columns projected out."""
    if not gauge.any():
        return rows
    q, _ = np.linalg.qr(rows[:, gauge])
    return np.asarray(rows - q @ (q.T @ rows))


def predict_sigma(tests: Array, m: Array) -> Array:
    """Standard deviation (m, three axes together) of the predicted point at every test, sqrt(trace T M^-1 T^T), (t,)."""
    c = np.linalg.inv(m)
    return np.asarray(np.sqrt(np.einsum("tdi,ij,tdj->t", tests, c, tests, optimize=True)))


def criterion_and_blocks(b: Blocks, name: str, count: int) -> tuple[Criterion, Blocks]:
    """The criterion and the blocks that it looks at: where the weakest direction decides, only those that can be
    seen. Raises ModelError for an unknown one, and where nothing can be seen."""
    criterion = criterion_of(name, len(b.names), b.tests)
    if not criterion.weakest:
        return criterion, b
    # Directions (n, r) that so many poses of average worth would know better than what is expected beforehand.
    average = information(b.candidates).mean(axis=0) * count + b.known - np.eye(len(b.names))
    values, vectors = np.linalg.eigh(average)
    directions = vectors[:, values > 1.0]
    if not directions.shape[1]:
        message, found = "so few poses show nothing above the noise", f"{count} poses"
        raise ModelError(message, key="count", found=found, expected="more poses")
    names = tuple(f"direction {i}" for i in range(directions.shape[1]))
    candidates, tests = (np.ascontiguousarray(each @ directions) for each in (b.candidates, b.tests))
    return criterion_of(name, len(names), tests), Blocks(names, candidates, tests, directions.T @ b.known @ directions)


def choose_best(b: Blocks, name: str, count: int, watch: Watch | None) -> tuple[Design, Criterion, Blocks]:
    """The best `count` candidates by a criterion, the most telling first; with the criterion, and the blocks that it looks at."""
    criterion, seen = criterion_and_blocks(b, name, count)
    design = Pool(seen.candidates, criterion, seen.known, watch=watch).select(count)
    order = Pool(seen.candidates[design.chosen], criterion, seen.known).greedy(count)
    return replace(design, chosen=design.chosen[order]), criterion, seen


def sum_information(b: Blocks, chosen: Sequence[int]) -> Array:
    """The information matrix with some candidates measured."""
    rows = b.candidates[np.asarray(chosen, dtype=np.int64)].reshape(-1, len(b.names))
    return np.asarray(b.known + rows.T @ rows)
