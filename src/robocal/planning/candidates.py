"""Poses that may be measured: drawn within the joint limits, kept where the robot may go and the instrument can see.

A region is a list of rules. Each says how far a configuration is on the right side of it (m or rad, negative is
outside), so that an empty region can say which rule empties it. Collisions of the arm with itself or with the cell are
not known here: floor, pedestal and box concern the flange and the measured point alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.arms.chain import Chain
from robocal.errors import ModelError
from robocal.geometry.path.program import Element
from robocal.measure.base import Builder
from robocal.measure.base import problem as build
from robocal.measure.data import Configurations, DataSet, Observations

__all__ = ["Region", "Template", "draw", "joint_range", "margins", "observe"]

# Everything that is observed at one configuration: one or more instruments, one or more rows each.
Template = tuple[Observations, ...]
# Where nobody bounds a joint: a quarter turn, or a quarter of a metre, to either side.
WIDE = {"revolute": math.pi / 2, "prismatic": 0.25}
BATCH = 4096
PATIENCE = 100  # batches without enough poses
FEWEST = 20


@record
class Region:
    """Where poses may be (m and rad in base coordinates); None says nothing.

    box ((x, y, z), (x, y, z)) holds the measured point; floor is the least height of point and flange; pedestal
    (radius, height) is a cylinder on the base's z axis that both stay out of; distance (least, most) from the
    instrument to the target; cone, the largest angle between the instrument's z axis and the target; facing, the
    largest angle between the target's z axis and the direction to the instrument.
    """

    box: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    floor: float | None = None
    pedestal: tuple[float, float] | None = None
    distance: tuple[float, float] | None = None
    cone: float | None = None
    facing: float | None = None

    @property
    def needs_instrument(self) -> bool:
        """Whether it matters where the instrument stands."""
        return self.distance is not None or self.cone is not None or self.facing is not None


def joint_range(chain: Chain) -> Array:
    """Lower and upper joint values (n, 2): the limits, or a usual range where there are none."""
    wide = np.array([WIDE[j.type] for j in chain.joints])
    low, high = chain.limits.T
    low = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - 2 * wide, -wide))
    high = np.where(np.isfinite(high), high, low + 2 * wide)
    return np.stack([low, high], axis=1)


def observe(template: Template, q: Array, ids: tuple[str, ...], columns: Mapping[str, Array]) -> DataSet:
    """What the template's instruments would observe at joint values (m, n): its rows at each of them, nothing measured
    yet. Columns of the configurations hold their median."""
    m = len(q)
    out = []
    for obs in template:
        k = len(obs)
        made, at = obs.take(np.tile(np.arange(k), m)), np.repeat(np.arange(m), k)
        out.append(replace(made, configuration=at, value=np.zeros_like(made.value), rows=None, used=None))
    held = {k: np.full(m, float(np.nanmedian(v))) for k, v in columns.items() if np.isfinite(v).any()}
    return DataSet(Configurations(ids, q, held), tuple(out))


def draw(
    chain: Chain,
    template: Template,
    region: Region,
    count: int,
    rng: np.random.Generator,
    *,
    columns: Mapping[str, Array] | None = None,
    edges: bool = False,
) -> Array:
    """Joint values (count, n) inside the region: a shifted Sobol sequence within the joint range, less what is
    outside. With `edges`, half of them have about half of their joints at a limit, where much is learnt and where a
    uniform sample of many joints hardly ever gets.

    Fewer are returned when the region is small. Raises ModelError when it is all but empty, naming the rule that is
    hardest to meet.
    """
    from scipy.stats import qmc  # a second to load; a study that draws its own poses has no use for it

    low, high = joint_range(chain).T
    # Shifted around the torus by one random vector (Cranley and Patterson, 1976).
    sequence, shift = qmc.Sobol(len(low), scramble=False), rng.random(len(low))
    found: list[Array] = []
    total, tried = 0, 0
    refused: dict[str, int] = {}
    for _ in range(PATIENCE):
        share = (sequence.random(BATCH) + shift) % 1.0
        if edges:
            share[1::2] = np.clip(2.0 * share[1::2] - 0.5, 0.0, 1.0)
        # Rounding must not carry a joint past its limit.
        q = np.clip(low + (high - low) * share, low, high)
        inside = np.ones(len(q), dtype=bool)
        for name, margin in margins(chain, template, region, q, columns).items():
            refused[name] = refused.get(name, 0) + int((margin < 0).sum())
            inside &= margin >= 0
        found.append(q[inside])
        total, tried = total + int(inside.sum()), tried + len(q)
        if total >= count:
            break
    if total < min(count, FEWEST):
        hardest = max(refused, key=lambda name: refused[name])
        refusals = f"{total} of {tried} drawn; {hardest} refuses {100 * refused[hardest] / tried:.3g} %"
        expected = f"at least {min(count, FEWEST)}: a wider region, or a list of poses"
        message = "hardly any configuration is inside the region"
        raise ModelError(message, key=hardest, found=refusals, expected=expected)
    return np.concatenate(found)[:count]


def margins(
    chain: Chain, template: Template, region: Region, q: Array, columns: Mapping[str, Array] | None = None
) -> dict[str, Array]:
    """How far inside each rule of the region joint values (m, n) are, by the rule's name, each (m,)."""
    ids = tuple(str(i) for i in range(len(q)))
    data = observe(template, q, ids, columns or {})
    out: dict[str, Array] = {}
    c, table = data.configurations, build(chain, data).table
    builder, x = Builder(chain, table, c), table.values[None]
    if region.box is not None or region.floor is not None or region.pedestal is not None:
        tip = chain.pose(q, c.columns)[:, :3, 3]
        points = np.stack([tip, _flange(chain, builder, len(q), x)])
        if region.box is not None:
            inside = np.minimum(tip - region.box[0], np.asarray(region.box[1]) - tip)
            out["box"] = inside.min(axis=1)
        if region.floor is not None:
            out["floor"] = (points[..., 2] - region.floor).min(axis=0)
        if region.pedestal is not None:
            radius, height = region.pedestal
            away = np.linalg.norm(points[..., :2], axis=-1) - radius
            out["pedestal"] = np.maximum(away, points[..., 2] - height).min(axis=0)
    if region.needs_instrument:
        framed = [o for o in data.observations if o.frame is not None]
        if not framed:
            raise ModelError("without an instrument's frame nothing can be said of what it sees", key="frame")
        for obs in framed:
            for target, index in builder.split(obs):
                seen = builder.view(obs, target, index).pose(x, 0, len(index))[0][0]
                for name, margin in _sight(region, seen).items():
                    # The worst row of a configuration decides.
                    np.minimum.at(out.setdefault(name, np.full(len(q), np.inf)), obs.configuration[index], margin)
    return out


def _flange(chain: Chain, builder: Builder, count: int, x: Array) -> Array:
    """The origin of the last joint's frame, (count, 3): of the elements up to the last one that a joint drives."""
    names = set(chain.joint_names)
    driven = [i for i, e in enumerate(chain.elements) if any(t.column in names for t in e.terms)]
    elements: tuple[Element, ...] = chain.elements[: driven[-1] + 1]
    return np.asarray(builder.path(elements, np.arange(count)).pose(x, 0, count)[0][0, :, :3, 3])


def _sight(region: Region, pose: Array) -> dict[str, Array]:
    """Of T_instrument_target (k, 4, 4): how far inside each rule it is, (k,)."""
    p = pose[:, :3, 3]
    away = np.maximum(np.linalg.norm(p, axis=-1), 1e-12)
    out = {}
    if region.distance is not None:
        out["range"] = np.minimum(away - region.distance[0], region.distance[1] - away)
    if region.cone is not None:
        out["cone"] = region.cone - np.arccos(np.clip(p[:, 2] / away, -1, 1))
    if region.facing is not None:
        toward = -np.sum(pose[:, :3, 2] * p, axis=-1) / away
        out["facing"] = region.facing - np.arccos(np.clip(toward, -1, 1))
    return out
