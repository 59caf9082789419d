"""Accuracy and repeatability of poses and distances, as ISO 9283:1998 defines them, from visits to places.

Of one place, visited n times, with attained positions p_j, their barycentre m, and the command c:

    AP = |m - c|,   AP_x = m_x - c_x, ...                       pose accuracy
    l_j = |p_j - m|,   RP = mean(l) + 3 S_l                     repeatability, S_l with n - 1
    AP_a = mean(a) - a_c,   RP_a = 3 S_a, and so b, c           of the angles about x, y, z
    vAP = max |m_h - m_k|                                       over the directions h, k of approach

Of two places, visited in turn, with D_j = |p_1j - p_2j|:

    AD = mean(D) - |c_1 - c_2|,   RD = 3 S_D                    distance accuracy and repeatability

The command is what the model says for the joint values: with the nominal model, what the controller believes. Angles are
the components of a rotation vector in base axes, which for such small turns are the standard's a, b, c.
Repeatability compares measurements with each other: no model enters, so calibration does not change it. What needs
repeated visits is NaN where there are none.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.arms.chain import Chain
from robocal.fit.repeats import joined
from robocal.geometry import se3, so3
from robocal.measure.data import DataSet, Observations
from robocal.parameters import FRAME_SYMBOLS

__all__ = ["CYCLES", "DIRECTION", "DistanceFigures", "PoseFigures", "Visits", "visits"]

CYCLES = 30  # what the standard asks for
MOST = 100_000  # pairs of places; more say nothing new
# Commanded joint values that differ by less (rad, m) are one command: 0.02 mm at a metre, less than any arm repeats.
SAME = 2e-5
PLACE = "place"  # the column of a configuration that numbers places where joint values jitter more
DIRECTION = "direction"  # the column of a configuration that marks from where a place was approached


@record
class Visits:
    """Measured positions of the tool or of a target on it, in base coordinates, with the place that each one visits.

    `attained`, `command` (k, 3) in m; `turn`, `command_turn` (k, 3, 3) or None; `place` (k,) counts places in the order
    of their first visit; `sensor` (g,) tells which instrument and target a place was measured by, `configuration` (k,)
    the data set's; `direction` (k,) and `group` (k,) are labels or None.
    """

    attained: Array
    command: Array
    turn: Array | None
    command_turn: Array | None
    place: Ints
    sensor: Ints
    configuration: Ints
    direction: Ints | None = None
    group: Ints | None = None

    @property
    def count(self) -> Ints:
        """Visits of every place, (g,)."""
        return np.bincount(self.place, minlength=len(self.sensor))

    @property
    def first(self) -> Ints:
        """The row of the first visit of every place, (g,)."""
        return np.unique(self.place, return_index=True)[1]

    def pose_figures(self) -> PoseFigures:
        """Accuracy and repeatability at every place."""
        n, place = self.count, self.place
        repeated = n >= 2
        centre = _mean(self.attained, place, n)
        gap = np.where(repeated[:, None], centre - _mean(self.command, place, n), np.nan)
        distance = np.linalg.norm(self.attained - centre[place], axis=1)
        mean = _mean(distance, place, n)
        rp = mean + 3 * _deviation(distance, mean, place, n)
        ap_abc = rp_abc = None
        if self.turn is not None and self.command_turn is not None:
            middle = so3.project(_mean(self.turn, place, n))
            asked = so3.project(_mean(self.command_turn, place, n))
            ap_abc = np.where(repeated[:, None], so3.log(middle @ np.swapaxes(asked, 1, 2)), np.nan)
            a = so3.log(self.turn @ np.swapaxes(middle[place], 1, 2))
            rp_abc = 3 * _deviation(a, _mean(a, place, n), place, n)
        vap, directions = self._directions()
        return PoseFigures(n, np.linalg.norm(gap, axis=1), gap, rp, ap_abc, rp_abc, vap, directions)

    def _directions(self) -> tuple[Array, Ints]:
        """vAP of every place and the number of its directions: the largest distance between the barycentres of visits from
        different directions."""
        g = len(self.sensor)
        if self.direction is None:
            return np.full(g, np.nan), np.zeros(g, dtype=np.int64)
        both, label = np.unique(np.stack([self.place, self.direction], axis=1), axis=0, return_inverse=True)
        label = label.ravel()
        centre = _mean(self.attained, label, np.bincount(label))
        count = np.bincount(both[:, 0], minlength=g)
        padded = np.full((g, int(count.max(initial=1)), 3), np.nan)
        padded[both[:, 0], _nth(both[:, 0])] = centre
        apart = np.linalg.norm(padded[:, :, None] - padded[:, None], axis=-1)
        widest = np.nan_to_num(apart, nan=0.0).max(axis=(1, 2))
        return np.where(count > 1, widest, np.nan), count

    def next_pairs(self) -> Ints:
        """Every place with the one that was visited next for the first time, by the same instrument on the same target:
        (p, 2)."""
        g = len(self.sensor)
        order = np.argsort(self.sensor, kind="stable")
        pair = np.stack([order[:-1], order[1:]], axis=1) if g > 1 else np.zeros((0, 2), dtype=np.int64)
        return np.asarray(pair[self.sensor[pair[:, 0]] == self.sensor[pair[:, 1]]])

    def every_pair(self, group: Ints | None = None) -> Ints:
        """All pairs of places of one instrument and target, within one group (g,) if groups are given: (p, 2); of more than
        MOST an even selection."""
        first, second = np.triu_indices(len(self.sensor), 1)
        same = self.sensor[first] == self.sensor[second]
        if group is not None:
            same &= group[first] == group[second]
        pair = np.stack([first[same], second[same]], axis=1)
        return pair if len(pair) <= MOST else pair[np.linspace(0, len(pair) - 1, MOST).astype(np.int64)]

    def distance_figures(self, pair: Ints) -> DistanceFigures:
        """Accuracy and repeatability of the distances between pairs of places (p, 2); the j-th visit of one place goes with
        the j-th of the other."""
        n = self.count
        padded = np.full((len(n), int(n.max(initial=1)), 3), np.nan)
        padded[self.place, _nth(self.place)] = self.attained
        centre = _mean(self.command, self.place, n)
        run = np.linalg.norm(padded[pair[:, 0]] - padded[pair[:, 1]], axis=2)
        known = np.isfinite(run)
        times = known.sum(axis=1)
        mean = np.where(known, run, 0.0).sum(axis=1) / np.maximum(times, 1)
        spread = np.where(known, run - mean[:, None], 0.0)
        squares = (spread**2).sum(axis=1)
        rd = 3 * np.sqrt(np.where(times > 1, squares / np.maximum(times - 1, 1), np.nan))
        asked = np.linalg.norm(centre[pair[:, 0]] - centre[pair[:, 1]], axis=1)
        return DistanceFigures(pair, times, asked, mean - asked, rd)


@record
class PoseFigures:
    """Per place (g,): visits n, AP and RP in m with AP_x, y, z (g, 3), the same of angles (g, 3) in rad or None, and
    vAP with the number of directions; NaN where n is below 2 (directions for vAP)."""

    n: Ints
    ap: Array
    ap_xyz: Array
    rp: Array
    ap_abc: Array | None
    rp_abc: Array | None
    vap: Array
    directions: Ints


@record
class DistanceFigures:
    """Per pair of places (p,): the places (p, 2), how often the distance was run, the commanded distance, AD and RD in
    m; RD is NaN below two."""

    pair: Ints
    n: Ints
    command: Array
    ad: Array
    rd: Array


def visits(model: Chain, data: DataSet, values: Mapping[str, float]) -> Visits | None:
    """The visits of a data set by a model whose parameters, and those of the instruments' frames, have these values.

    A place is one set of commanded joint values, or one number in the column `place`. Only positions and poses by an
    instrument that stands still, of things on the tool, can be told in base
    coordinates; None when there are none.
    """
    arm = model.with_values({n: v for n, v in values.items() if n in model.table})
    c = data.configurations
    label = joined(c, SAME) if PLACE not in c.columns else np.unique(c.columns[PLACE], return_inverse=True)[1].ravel()
    parts, keys = [], []
    fit = [o for o in data.observations if _absolute(o)]
    whole = all(o.kind == "pose" for o in fit)
    for number, obs in enumerate(fit):
        q = np.asarray(c.joints)[obs.configuration]
        columns = {k: v[obs.configuration] for k, v in c.columns.items()}
        target = np.zeros(len(obs), dtype=np.int64) if obs.target is None else obs.target
        mounts = [np.eye(4), *(_frame(t.name, values) for t in obs.targets)]
        command = arm.pose(q, columns) @ np.stack(mounts)[target + (1 if obs.targets else 0)]
        base = np.eye(4) if obs.frame is None else np.linalg.inv(_frame(obs.frame.name, values))
        seen = se3.compose(so3.exp(obs.value[:, 3:]) if whole else np.eye(3), obs.value[:, :3])
        parts.append((base @ seen, command, obs.configuration))
        keys.append(np.stack([np.full(len(obs), number), target, label[obs.configuration]], axis=1))
    if not parts:
        return None
    attained, command, configuration = (np.concatenate(p) for p in zip(*parts, strict=True))
    found, first, place = np.unique(np.concatenate(keys), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    sensor = np.unique(found[order, :2], axis=0, return_inverse=True)[1].ravel()
    direction = None
    if DIRECTION in c.columns:
        direction = np.unique(c.columns[DIRECTION], return_inverse=True)[1].ravel()[configuration]
    group = None if c.groups is None else np.unique(c.groups, return_inverse=True)[1].ravel()[configuration]
    turn, asked = (attained[:, :3, :3], command[:, :3, :3]) if whole else (None, None)
    where = np.argsort(order)[place.ravel()]
    return Visits(attained[:, :3, 3], command[:, :3, 3], turn, asked, where, sensor, configuration, direction, group)


def _absolute(obs: Observations) -> bool:
    """Whether an observation says where the tool is in base coordinates, once its frame is known."""
    still = obs.frame is None or obs.frame.mount == "base"
    return obs.kind in ("position", "pose") and still and all(t.mount == "tool" for t in obs.targets)


def _frame(name: str, values: Mapping[str, float]) -> Array:
    return se3.from_vector(np.array([values[f"{name}.{s}"] for s in FRAME_SYMBOLS]))


def _mean(values: Array, label: Ints, count: Ints) -> Array:
    """The mean of rows (k, ...) by label, (g, ...)."""
    out = np.zeros((len(count), *values.shape[1:]))
    np.add.at(out, label, values)
    return np.asarray(out / np.maximum(count, 1).reshape(-1, *[1] * (values.ndim - 1)))


def _deviation(values: Array, mean: Array, label: Ints, count: Ints) -> Array:
    """The sample standard deviation by label, (g, ...), NaN below two."""
    squares = _mean((values - mean[label]) ** 2, label, count)
    n = count.reshape(-1, *[1] * (values.ndim - 1))
    return np.sqrt(np.where(n > 1, squares * n / np.maximum(n - 1, 1), np.nan))


def _nth(label: Ints) -> Ints:
    """For every row, how many rows with its label come before it."""
    order = np.argsort(label, kind="stable")
    out = np.empty_like(label)
    out[order] = np.arange(len(label)) - np.searchsorted(label[order], label[order])
    return out
