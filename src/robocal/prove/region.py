"""Where a correction holds: what the model may be off by over the working range, against what the correction moves there.

    band^2 = mean over q of tr(J(q) C J(q)^T),    moved^2 = mean over q of |d(q)|^2,    d(q) = p(q) - p_0(q)

p is the tool in base coordinates as the identified model predicts it, p_0 as the baseline does, each with its own tool; J
the Jacobian of p, C all that the parameters may be off by. Frames belong to the measurement: d and J are taken up to a
motion of the base and a shift of the tool, and up to a scale that the data do not see (projected out by least squares over
q): a tool that cannot be told from an instrument's frame, as on a grid measured with the tool upright, would drown the arm.
With e = J dx the error of the model, that of the baseline is e - d, and the baseline is the better one where
mean |e - d|^2 < mean |e|^2:

    P(2 g^T dx > moved^2),    g = mean over q of J(q)^T d(q),    var(g^T dx) = g^T C g

A machine that stands where its own lengths say has its poses from lengths in place of J (`frame_range`).

Where band exceeds moved, the correction is proven near the measurements alone; in a range that somebody named it must also be
the better one with as much confidence as the gain itself. Where nobody named one, it is what the measured joints span, and
held-out measurements have told already; not of a scale of their instrument that is not known, for they share it (`scale_chance`);
and unless each stood beside one that was fitted, as where all poses lie in a few clusters: then they told nothing of the way
between these. The middle of a frame is named by the frame, not by what was measured.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from robocal import _scipy as scipy
from robocal._record import dataclass
from robocal._types import Array
from robocal.diagnose.check_registry import Finding, Given, When, check, once, qualify
from robocal.diagnose.limits import BESIDE_NEAR, BESIDE_SHARE, SCALE_WORSE_CHANCE, WORSE_CHANCE
from robocal.diagnose.scale import common_scale
from robocal.estimate.uncertainty import band
from robocal.fit.options import JointRegion
from robocal.fit.scale import without_scales
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, joints_of
from robocal.measure.reach import reach
from robocal.prove.bands import mean_conditions, range_of_joints
from robocal.prove.decision import REGION, Decision
from robocal.prove.frame_range import FRAME, shape_of_lengths
from robocal.prove.place_bands import motion_field, parameters_of, sample_joints
from robocal.prove.scale_chance import chance_by_scale
from robocal.prove.split import Split
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["Holds", "beside", "range_of", "region_between_poses", "region_of_limits"]

SAMPLES = 500  # grid: configurations of a range
SPAN = "range that the measured joints span"


@dataclass(frozen=True)
class Holds:
    """Rms over n configurations of the working range (m): what the model may be off by, and what the correction moves; and
    the chance that the nominal model is the better one there. `asked` says that this chance decides too, `sized` that the data
    see how long the arm is; else all are up to one factor on its lengths; `alone` is the band beside scales of instruments that are not
    known (m; None: there are none)."""

    name: str
    band: float
    moved: float
    chance: float
    n: int
    asked: bool = True
    sized: bool = True
    alone: float | None = None

    @property
    def region(self) -> str:
        """`working` where the correction holds in the whole range, else `measured`."""
        band, most = (self.band, 1.0) if self.alone is None else (self.alone, SCALE_WORSE_CHANCE)
        sure = self.chance <= (WORSE_CHANCE if self.asked else most)
        return "working" if band <= self.moved and sure else "measured"


def region_of_limits(chain: Model, data: DataSet) -> JointRegion:
    """The joint limits of a chain; the measured range where a limit is infinite."""
    return JointRegion(*sample_joints(chain, range_of_joints(data.configurations), SAMPLES))


def region_between_poses(chain: Model, data: DataSet) -> JointRegion:
    """Configurations on the way from one measured one to another.

    A box of the measured joints would hold what nobody measured or meant: where a grid was measured with the tool held
    upright, it holds every attitude.
    """
    q = data.configurations.joints
    if q is None or not len(q := q[np.isfinite(q).all(axis=1)]):
        return region_of_limits(chain, data)
    rng = np.random.default_rng(0)
    one, other = q[rng.integers(0, len(q), (2, SAMPLES))]
    share = rng.uniform(size=(SAMPLES, 1))
    return JointRegion(one + share * (other - one), SPAN)


@once
def range_of(context: Decision[Model]) -> Holds | None:
    """Where the correction of the fit to everything holds: over the range that was asked for, by default what the measured joints span.
    None where nothing was fitted or no joints were recorded."""
    data, off, known, scale = context.need_data, context.need_fit.total, context.chosen.region, common_scale(context)
    if not context.need_fit.identifiability.names:
        return None
    joints, scaled = data.configurations.joints, scale is None or scale.observable or not scale.stated
    bare = without_scales(off)
    if joints is None:
        framed = shape_of_lengths(context, SAMPLES)
        if framed is None:
            return None
        place, jac, moved, anew = framed
        jac, moved = _without(np.concatenate([motion_field(place)[:, :3], anew], axis=2), jac, moved)
        at = [i for i, n in enumerate(off.names) if n in bare.names]  # no pose hangs on an instrument's scale
        jac, name = jac[..., at], FRAME
    else:
        region = known or region_between_poses(context.model, data)
        jac, at, moved = _shape(context, region.joints, scaled)
        name = region.name
    covariance = off.covariance[np.ix_(at, at)]
    far, square = _rms(jac, covariance), float(np.mean(np.sum(moved**2, axis=1)))
    scales = context.need_fit.scales
    own = [bare.names.index(off.names[i]) for i in at]
    alone = None if scales is None else _rms(jac, bare.covariance[np.ix_(own, own)])
    chance = _chance(context, jac, at, moved)
    found = far, float(np.sqrt(square)), chance
    if not np.isfinite(found).all():
        return None
    proof = context.proof
    # What was held out tells of the measured range, unless it stood beside what was fitted; of a frame it tells nothing.
    other = joints is None or known is not None
    near = (
        chance > WORSE_CHANCE and not other and joints is not None and proof is not None and beside(joints, proof.split)
    )
    return Holds(name, *found, len(moved), other or near, scaled, alone)


def _rms(jac: Array, covariance: Array) -> float:
    return float(np.sqrt(np.mean(band(jac, covariance) ** 2)))


def _chance(context: Decision[Model], jac: Array, at: list[int], moved: Array) -> float:
    """That the nominal model is the better one."""
    off, scales = context.need_fit.total, context.need_fit.scales
    along, square = np.einsum("mai,ma->i", jac, moved) / len(moved), float(np.mean(np.sum(moved**2, axis=1)))
    if scales is not None:
        return chance_by_scale(context.model, context.need_fit, scales, [off.names[i] for i in at], along, square)
    covariance = off.covariance[np.ix_(at, at)]
    spread = 2 * float(np.sqrt(max(along @ covariance @ along, 0.0)))
    return float(scipy.special.stdtr(min(off.dof, 1e9), -square / spread)) if spread > 0 else 0.0


def _shape(context: Decision[Model], joints: Array, scaled: bool) -> tuple[Array, list[int], Array]:
    """At joint values (m, n): the Jacobian of the tool (m, 3, k), where its columns stand among all names, and what the correction
    moves (m, 3), up to the frames, and up to one factor on all lengths unless the data are `scaled`."""
    model, off, base = context.model, context.need_fit.total, context.proven.base
    conditions, names = mean_conditions(context.need_data.configurations), parameters_of(model, off)
    nominal = model.with_values({n: float(base.x[0, base.problem.table.index[n]]) for n in model.table.names})
    pose, jac = reach(context.corrected, joints, names, conditions)
    here, jac = pose[:, :3, 3], jac[:, :3]
    gap = here - reach(nominal, joints, (), conditions)[0][:, :3, 3]
    moved = [motion_field(here)[:, :3], pose[:, :3, :3], *(() if scaled else (here[:, :, None],))]
    jac, gap = _without(np.concatenate(moved, axis=2), jac, gap)
    return jac, [off.names.index(n) for n in names], gap


def _without(field: Array, jac: Array, gap: Array) -> tuple[Array, Array]:
    """Columns (m, 3, k) and gap (m, 3) less what a field (m, 3, f) of the measurement explains of them."""
    flat = field.reshape(3 * len(gap), -1)
    both = np.column_stack([gap.reshape(-1, 1), jac.reshape(len(flat), -1)])
    both -= flat @ np.linalg.lstsq(flat, both, rcond=None)[0]
    return both[:, 1:].reshape(jac.shape), both[:, 0].reshape(gap.shape)


def beside(joints: Array, split: Split) -> bool:
    """Whether most configurations that were held out stood beside a fitted one: nearer than BESIDE_NEAR of the distance of any two."""
    place = np.nan_to_num(joints / np.where((spread := np.nanstd(joints, axis=0)) > 0, spread, 1.0))
    near = BESIDE_NEAR * float(np.sqrt(2 * (spread > 0).sum()))
    found = []
    for held, fit in zip(split.held_out, split.fit, strict=True):
        if fit.any():
            found.append(scipy.spatial.cKDTree(place[fit]).query(place[held])[0] < near)
    return bool(found) and float(np.mean(np.concatenate(found))) > BESIDE_SHARE


@check(REGION, When.PROOF, order=170, given=Given.GAIN, needs=("proven",))
def outside_measured(context: Decision[Model]) -> Iterator[Finding]:
    """An improvement that holds near the measurements alone."""
    holds = range_of(context)
    if holds is not None and holds.region != "working":
        amounts = {"band": Quantity(holds.band), "moved": Quantity(holds.moved)}
        names = "limits in the robot file, --region FILE" if joints_of(context.model) else None
        yield qualify(Code.HOLDS_WHERE_MEASURED, region=holds.name, **amounts, chance=holds.chance, names=names)
