"""Where a correction holds: what the model may be off by over the working range, against what the correction moves there.

    band^2 = mean over q of tr(J(q) C J(q)^T),    moved^2 = mean over q of |d(q)|^2,    d(q) = p(q) - p_0(q)

p is the tool in base coordinates as the identified model predicts it, p_0 as the baseline does, each with its own tool; J
the Jacobian of p, C all that the parameters may be off by. Frames belong to the measurement: d and J are taken up to a
motion of the base and a shift of the tool, and up to a scale that the data do not see (projected out by least squares over
q): a tool that cannot be told from an instrument's frame, as on a grid measured with the tool upright, would drown the arm.
With e = J dx the error of the model, that of the baseline is e - d, and the baseline is the better one where
mean |e - d|^2 < mean |e|^2:

    P(2 g^T dx > moved^2),    g = mean over q of J(q)^T d(q),    var(g^T dx) = g^T C g

A machine that stands where its own lengths say has its poses from lengths in place of J (`frame_range`). Where the frame of what
measured it is known, motions are no freedom of the measurement: the correction must hold with them as well.

What drifts along a file (`growth`) is off by m = J dx at one end or the other: |m|^2 is in band^2, and moved^2 is less by 2 |m d|.

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
from robocal._record import record, replace
from robocal._types import Array
from robocal.diagnose.check_registry import Finding, Given, When, check, once, qualify
from robocal.diagnose.growth import move_at_end
from robocal.diagnose.instrument_scale import scale_errors
from robocal.diagnose.limits import BESIDE_NEAR, BESIDE_SHARE, SCALE_WORSE_CHANCE, WORSE_CHANCE
from robocal.diagnose.scale import common_scale
from robocal.estimate.uncertainty import band
from robocal.fit.fit import Fit
from robocal.fit.options import JointRegion
from robocal.fit.scale import is_scale, without_scales
from robocal.measure.data import DataSet
from robocal.measure.machine import Model, joints_of
from robocal.measure.reach import reach
from robocal.prove.bands import mean_conditions, range_of_joints
from robocal.prove.decision import REGION, Decision
from robocal.prove.frame_range import FRAME, frame_is_known, shape_of_lengths
from robocal.prove.place_bands import motion_field, parameters_of, sample_joints
from robocal.prove.scale_chance import chance_by_scale
from robocal.prove.split import Split
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity

__all__ = ["Holds", "beside", "range_of", "region_between_poses", "region_of_limits"]

SAMPLES = 500  # grid: configurations of a range
SPAN = "range that the measured joints span"


@record
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
    Of several ways to look at it the first in which it does not hold everywhere counts. None where nothing was fitted or no joints were
    recorded."""
    data, known, scale = context.need_data, context.chosen.region, common_scale(context)
    if not context.need_fit.identifiability.names:
        return None
    joints, scaled = data.configurations.joints, scale is None or scale.observable or not scale.stated
    if joints is None:
        found = [_holds(context, FRAME, *shape) for shape in _frame_shapes(context)]
        return next((h for h in found if h is None or h.region != "working"), found[0]) if found else None
    region = known or region_between_poses(context.model, data)
    return _holds(context, region.name, *_shape(context, region.joints, scaled), scaled)


@once
def fit_in_doubt(context: Decision[Model]) -> Fit:
    """The fit, where scales that were known and that its data contradict may be off by what they say."""
    wrong = scale_errors(context)
    return replace(context.need_fit, scale_errors=wrong) if wrong else context.need_fit


def _frame_shapes(context: Decision[Model]) -> list[tuple[Array, list[int], Array]]:
    """As `_shape`, of a machine that stands where its lengths say: up to a motion and, where the frame of what measured it is known, as
    it stands."""
    framed = shape_of_lengths(context, SAMPLES)
    if framed is None:
        return []
    place, jac, moved, anew = framed
    names = fit_in_doubt(context).total.names
    at = [i for i, n in enumerate(names) if not is_scale(n)]  # no pose hangs on an instrument's scale
    motions = motion_field(place)[:, :3]
    gauges = [motions[..., :0], motions] if frame_is_known(context) else [motions]
    both = [_without(np.concatenate([gauge, anew], axis=2), jac[..., at], moved) for gauge in gauges]
    return [(j, at, m) for j, m in both]


def _holds(
    context: Decision[Model], name: str, jac: Array, at: list[int], moved: Array, scaled: bool = True
) -> Holds | None:
    """Whether it holds by what parameters `at` among all names move, jac (m, 3, k), and the correction, (m, 3); None where that is not
    finite."""
    fit = fit_in_doubt(context)
    off = fit.total
    drift = jac @ move_at_end(context, [off.names[i] for i in at])
    far, square = _rms(jac, off.covariance[np.ix_(at, at)], drift), float(np.mean(np.sum(moved**2, axis=1)))
    bare = without_scales(off)
    own = [bare.names.index(off.names[i]) for i in at]
    alone = None if fit.scales is None else _rms(jac, bare.covariance[np.ix_(own, own)], drift)
    # A machine that drifted is as at the end of the file, one whose instrument drifted as at its beginning: the worse of the two counts.
    nearer = 2 * abs(float(np.mean(np.sum(moved * drift, axis=1))))
    chance = _chance(context, jac, at, moved, square - nearer)
    found = far, float(np.sqrt(square)), chance
    if not np.isfinite(found).all() or not any(found[:2]):  # masses and friction move no position
        return None
    proof, joints = context.proof, context.need_data.configurations.joints
    # What was held out tells of the measured range, unless it stood beside what was fitted; of a frame it tells nothing.
    other = joints is None or context.chosen.region is not None
    near = (
        chance > WORSE_CHANCE and not other and joints is not None and proof is not None and beside(joints, proof.split)
    )
    return Holds(name, *found, len(moved), other or near, scaled, alone)


def _rms(jac: Array, covariance: Array, drift: Array) -> float:
    return float(np.sqrt(np.mean(band(jac, covariance) ** 2 + np.sum(drift**2, axis=1))))


def _chance(context: Decision[Model], jac: Array, at: list[int], moved: Array, square: float) -> float:
    """That the nominal model is the better one."""
    fit = fit_in_doubt(context)
    off, scales = fit.total, fit.scales
    along = np.einsum("mai,ma->i", jac, moved) / len(moved)
    if scales is not None:
        return chance_by_scale(context.model, fit, scales, [off.names[i] for i in at], along, square)
    covariance = off.covariance[np.ix_(at, at)]
    spread = 2 * float(np.sqrt(max(along @ covariance @ along, 0.0)))
    if spread > 0:
        return float(scipy.special.stdtr(min(off.dof, 1e9), -square / spread))
    return float(square < 0)


def _shape(context: Decision[Model], joints: Array, scaled: bool) -> tuple[Array, list[int], Array]:
    """At joint values (m, n): the Jacobian of the tool (m, 3, k), where its columns stand among all names, and what the correction
    moves (m, 3), up to the frames, and up to one factor on all lengths unless the data are `scaled`."""
    model, off, base = context.model, fit_in_doubt(context).total, context.proven.base
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
    if holds is None or holds.region == "working":
        return
    amounts = {"band": Quantity(holds.band), "moved": Quantity(holds.moved)}
    scales = fit_in_doubt(context).scales
    by_scale = scales is not None and holds.alone is not None and holds.alone <= holds.moved
    scale = ", ".join(n.rpartition(".")[0] for n in scales.names) if scales is not None and by_scale else None
    near = None if by_scale else "--region measured"
    names = "limits in the robot file, --region FILE" if joints_of(context.model) and not by_scale else None
    # A small chance is no reason where the band alone is.
    chance = holds.chance if holds.chance > WORSE_CHANCE else None
    words = {"names": names, "scale": scale, "near": near}
    yield qualify(Code.HOLDS_WHERE_MEASURED, region=holds.name, **amounts, chance=chance, **words)
