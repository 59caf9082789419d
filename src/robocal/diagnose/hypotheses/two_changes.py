"""Two changes that are wrong at once: which of all pairs are worth a fit.

Whatever unit, sign or axes the places were read in, the right joint values meet them linearly:

    y = A p(q) + B vec R(q) + c        p, R: the nominal flange; A, B, c free for each coordinate

    1 joints    every change of joint values, alone and two and two, with every order of the rows: what this form leaves of y
    2 readings  the best of one change, each with the unit that the size of A says, the few best with every change of the readings
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, islice, product

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.diagnose import limits
from robocal.diagnose.hypotheses.changes import OF_JOINTS, ORDERS, Change, Trial, What, apply_all
from robocal.diagnose.hypotheses.sights import Sights, sights, taken
from robocal.geometry.path.program import compile_path
from robocal.measure.data import Configurations, DataSet
from robocal.measure.machine import Mechanism

__all__ = ["one_change_linear", "two_changes"]

FITTED, WITH_READINGS = 60, 6  # grid: pairs that are fitted, and single changes that meet every change of the readings
SIGNS = 2  # grid: of joints that count the other way beside another change of joint values
AT_ONCE = 512  # grid: trials for which memory is taken at a time


@record
class _Linear:
    """What the form leaves of the readings with every change of joint values and every order of the rows, as a share of their
    spread, (J, O), and by how much they grow with p, (J, O)."""

    moved: list[Trial]
    orders: list[Trial]
    readings: list[Change]
    left: Array
    size: Array

    def begun(self, many: int) -> Iterator[tuple[int, int]]:
        """The places of trials of so many changes, the best first."""
        count = np.array([len(t) for t in self.moved])[:, None] + np.array([len(o) for o in self.orders])
        best = np.argsort(self.left, axis=None, kind="stable")
        return (
            (int(j), int(o)) for j, o in (np.unravel_index(i, self.left.shape) for i in best) if count[j, o] == many
        )

    @property
    def as_read(self) -> bool:
        """Whether joint values and rows as they are may be right."""
        return float(self.left[0, 0]) <= limits.PAIR_LEAVES

    def trial(self, j: int, o: int) -> Trial:
        return (*self.orders[o], *self.moved[j])


def one_change_linear(
    chain: Mechanism, data: DataSet, rows: list[Ints], single: Sequence[Change]
) -> tuple[list[Trial], float]:
    """The single changes, and none, that are worth a fit, and the least that the form leaves; none, inf where the rows are too few."""
    made = _look(chain, data, rows, single, pairs=False)
    if made is None:
        return [], math.inf
    out = [made.trial(j, o) for j, o in islice(made.begun(1), FITTED)]
    if made.as_read:
        units, others = _of_size(made.readings, float(made.size[0, 0]))
        out += [(c,) for c in (*units, *others)]
    return out, float(np.min(made.left))


def two_changes(chain: Mechanism, data: DataSet, rows: list[Ints], single: Sequence[Change]) -> list[Trial]:
    """The pairs of `single` changes that are worth a fit; none where the rows are too few to tell."""
    made = _look(chain, data, rows, single, pairs=True)
    if made is None:
        return []
    out = [made.trial(j, o) for j, o in islice(made.begun(2), FITTED)]
    for nth, (j, o) in enumerate(islice(made.begun(1), FITTED)):
        if nth >= WITH_READINGS and made.left[j, o] > limits.PAIR_LEAVES:
            break
        units, others = _of_size(made.readings, float(made.size[j, o]))
        # Signs that an affine form takes up are many: each meets the one unit that sizes say.
        out += [(*made.trial(j, o), c) for c in (*units, *(others if nth < WITH_READINGS else ()))]
    return [*out, *(product(*_of_size(made.readings, float(made.size[0, 0]))) if made.as_read else ())]


def _look(
    chain: Mechanism, data: DataSet, rows: list[Ints], single: Sequence[Change], *, pairs: bool
) -> _Linear | None:
    """None where the rows of one frame and thing are too few."""
    every = [c for c in single if not c.sources]
    first = sights(chain, [taken(data, rows)])
    mine = np.zeros(0, dtype=np.int64) if first is None else _same_ends(first)
    if first is None or len(mine) < limits.PAIR_ROWS:
        return None
    joints = [c for c in every if c.what in OF_JOINTS]
    orders: list[Trial] = [(), *((c,) for c in every if c.what in ORDERS)]
    moved: list[Trial] = [(), *((c,) for c in joints), *(_pairs_of_joints(joints) if pairs else ())]
    read = [sights(chain, [taken(_in_order(data, o), rows)]) for o in orders]
    places = np.stack([r.place[0, mine] for r in read if r is not None])
    readings = [c for c in every if c.what not in (*OF_JOINTS, *ORDERS)]
    return _Linear(moved, orders, readings, *_linear(chain, first, mine, moved, places))


def _in_order(data: DataSet, order: Trial) -> DataSet:
    """The readings that the joint values of each row have in another order of the rows."""
    if not order:
        return data
    step = -int(order[0].amount)
    turned = order[0].what is What.REVERSED
    read = (replace(o, value=o.value[::-1] if turned else np.roll(o.value, step, axis=0)) for o in data.observations)
    return DataSet(data.configurations, tuple(read))


def _same_ends(seen: Sights) -> Ints:
    """The readings of the frame and the thing that most are of."""
    both = seen.frame * (1 + int(seen.thing.max())) + seen.thing[0]
    return np.flatnonzero(both == np.bincount(both).argmax())


def _pairs_of_joints(joints: Sequence[Change]) -> Iterator[Trial]:
    """Two changes of joint values, first those of the file, then those of the robot's description as it is read."""
    rank = (What.JOINT_UNIT, What.SWAP, What.WITH, What.SIGN, What.ZERO)
    few = [c for c in joints if c.what != What.SIGN or len(c.at) <= SIGNS]
    for a, b in combinations(sorted(few, key=lambda c: rank.index(c.what)), 2):
        if a.what != b.what or (a.what in (What.ZERO, What.WITH) and a.at[0] != b.at[0]):
            yield a, b
    units = [c for c in joints if c.what == What.JOINT_UNIT]
    if units:  # of all joints
        yield from ((units[0], c) for c in joints if c.what == What.SIGN and len(c.at) > SIGNS)


def _linear(chain: Mechanism, seen: Sights, mine: Ints, trials: Sequence[Trial], places: Array) -> tuple[Array, Array]:
    """What the form leaves of places (O, k, 3) with the joint values of each trial, as a share of their spread, (J, O); and by how much
    places grow with p, (J, O)."""
    columns = {name: v[mine] for name, v in seen.columns.items()}
    q = seen.joints[0, mine]
    as_read = DataSet(Configurations(tuple(map(str, mine)), q), ())
    made = [apply_all(t, as_read).configurations.joints for t in trials]
    program = compile_path(chain.elements, chain.table)
    k, y = len(mine), places - places.mean(axis=1, keepdims=True)
    flat = np.swapaxes(y, 0, 1).reshape(k, -1)
    total = np.sum(flat.reshape(k, -1, 3) ** 2, axis=(0, 2))
    left, size = np.empty((len(made), len(places))), np.empty((len(made), len(places)))
    for start in range(0, len(made), AT_ONCE):
        some = np.stack([q if m is None else m for m in made[start : start + AT_ONCE]])
        b = len(some)
        extra = {name: np.tile(v, b) for name, v in columns.items()}
        phi = chain.phi(some.reshape(b * k, -1), extra, program).reshape(b, k, -1)
        t = program.run(np.repeat(chain.table.values[None], b, axis=0), phi)[0]
        p = t[..., :3, 3] - t[..., :3, 3].mean(axis=1, keepdims=True)
        r = t[..., :3, :3].reshape(b, k, 9)
        form = np.concatenate([r - r.mean(axis=1, keepdims=True), p], axis=2)
        # R last of what is left out of p: of arms whose p follows from R, either may stand for the other.
        basis = np.linalg.qr(form)[0]
        rest = flat - basis @ (np.swapaxes(basis, 1, 2) @ flat)
        left[start : start + b] = np.sum(rest.reshape(b, k, -1, 3) ** 2, axis=(1, 3)) / total
        size[start : start + b] = np.sqrt(total / np.sum(p**2, axis=(1, 2))[:, None])
    return left, size


def _of_size(readings: Sequence[Change], size: float) -> tuple[list[Change], list[Change]]:
    """Of the other units of all coordinates the one with which places are as large as the arm's; and every other change."""
    units = [c for c in readings if c.what == What.LENGTH_UNIT]
    whole = [c for c in units if len(c.at) == 3 and len(set(c.factors)) == 1]
    near = min(whole, key=lambda c: abs(math.log(c.factors[0] * size)), default=None)
    others = [c for c in readings if c.what != What.LENGTH_UNIT]
    better = near is not None and abs(math.log(near.factors[0] * size)) < abs(math.log(size))
    return ([near] if near is not None and better else []), others
