"""Every kind of measurement with every modelling convention, in one test.

Jacobian against central differences; then the whole way: a machine with realistic errors is measured with noise and
identified from a table of zeros, asked for readings that it has not seen, and measured again and again to see whether
chi2 is what it should be. Every kind with two conventions and two kinds with every convention are quick, the full
product is slow.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace

import numpy as np
import pytest
from arms.arm_samples import arm
from laws import check_jacobian
from measure.rigs import RIGS, recorded, stated

from robocal.arms.chain import Chain
from robocal.arms.conventions import CONVENTIONS
from robocal.estimate.least_squares import least_squares
from robocal.fit.baseline import baseline
from robocal.fit.options import Options
from robocal.measure.base import kind_of, problem, synthesise
from robocal.measure.data import DataSet
from robocal.prove.identify import identify
from robocal.remarks.code import Code

# Configurations; a kind with one number for each and many unknowns needs more.
POSES = {"plane": 200, "distance, ballbar": 200}
USUAL = 160
REPEATS = 40
# The mean of REPEATS values of chi2 / dof scatters by sqrt(2 / (dof REPEATS)); this is what the test allows that to be.
SCATTER = 0.03
# Errors as a workshop leaves them.
ERRORS = {"m": 1e-3, "rad": 2e-3}


def quick(kind, convention):
    return convention in ("dh", "poe") or kind in ("pose", "point")


PAIRS = [
    pytest.param(k, c, marks=() if quick(k, c) else pytest.mark.slow, id=f"{k}-{c}") for k in RIGS for c in CONVENTIONS
]


@dataclass(frozen=True)
class Case:
    """A nominal arm, the true one, and what was recorded there: to fit, and to be predicted. Frames are where they
    truly are."""

    nominal: Chain
    truth: Chain
    fit: DataSet
    unseen: DataSet


def case_of(kind, convention, again=""):
    rng = np.random.default_rng(zlib.crc32(f"{kind} {convention}{again}".encode()))
    made = arm(convention, "RRPRRR", rng)
    table = made.table.with_free([n for n in made.usual if not n.startswith("tool.")])
    nominal = replace(made, table=table)
    off = {n: table[n].value + ERRORS[table[n].unit] * rng.standard_normal() for n in table.free}
    truth = nominal.with_values(off)
    m = POSES.get(kind, USUAL)
    data = recorded(kind, truth, rng, 2 * m, contact=m)
    return Case(nominal, truth, data.take(np.arange(m)), synthesise(truth, data.take(np.arange(m, 2 * m))))


@pytest.mark.sampled(4)
@pytest.mark.parametrize(("kind", "convention"), PAIRS)
def test_every_kind_with_every_convention(kind, convention):
    c = case_of(kind, convention)
    jacobian(c)
    found = calibrated(c)
    if [r.code for r in found.verdict.reasons][:1] == [Code.SCALE_WRONG]:
        # Where scale comes from a stated length alone, one arm in 370 lies beyond three sigma of what making leaves, and
        # is refused by right: then the next one that is drawn, and no third.
        c = case_of(kind, convention, " again")
        found = calibrated(c)
    before, after = gain(c, found)
    ratio = chi2(c, found)
    # Shown with -s: the figures of the closing note.
    print(f"\n{kind} | {convention} | {before:.2f} | {after:.3f} | {ratio:.3f}")


def jacobian(c):
    """Central differences, everything free but the gains, residuals far from zero."""
    p = problem(c.nominal, c.fit.take(np.arange(9)))
    p = p.with_free([n for n in p.table.names if not n.endswith(".gain")])

    def at(step):
        return p.retract(p.start, step[None])

    check_jacobian(lambda s: p.linearize(at(s)).r, lambda s: p.linearize(at(s)).j, np.zeros(p.n), tolerance=1e-7)


def calibrated(c):
    """From a table of zeros, with what a user states of his rig."""
    return identify(c.nominal, stated(c.fit, np.random.default_rng(1)), Options(leave_one_out=False))


def gain(c, found):
    """A machine that predicts unseen readings below their noise, far better than the baseline does."""
    assert found.verdict.status == "improved", found.verdict.reasons
    data = stated(c.fit, np.random.default_rng(1))
    base, x = baseline(c.nominal, data, np.arange(len(data.configurations)))
    before, after = missed(c, base.table.with_values(x[0])), missed(c, found.table)
    assert after < 1.0, f"unseen readings are missed by {after:.2f} sigma"
    assert after < 0.1 * before, f"unseen readings are missed by {after:.2f} sigma, {before:.2f} before"
    return before, after


def missed(c, table):
    """rms error of predicted readings, in sigmas of one reading."""
    p = problem(c.nominal, c.unseen)
    p = p.with_table(p.table.with_values({n: table[n].value for n in p.table.names}))
    return float(np.sqrt(np.mean(np.concatenate([(r.value * r.scale).ravel() for r in p.residuals(p.start)]) ** 2)))


def chi2(c, found):
    """REPEATS recordings as one batch: the mean of chi2 / dof is one within what its own scatter allows."""
    # Where constraints are met exactly: a plate looked at from the wrong side is the same plate then.
    exact = c.unseen
    rng = np.random.default_rng(2)
    many = []
    for o in exact.observations:
        noise = o.sigma * rng.standard_normal((REPEATS, *o.value.shape))
        many.append(replace(o, value=kind_of(o).disturb(np.broadcast_to(o.value, noise.shape), noise)))
    p = problem(c.nominal, DataSet(exact.configurations, tuple(many)))
    p = p.with_table(p.table.with_values({n: found.table[n].value for n in p.table.names})).with_free(
        found.correlation_names
    )
    solution = least_squares(p, np.repeat(p.start, REPEATS, axis=0))
    assert all(r.converged for r in solution.reasons)
    dof = sum(t.scale.size for t in p.terms) - p.n
    assert np.sqrt(2 / (dof * REPEATS)) < SCATTER
    ratio = 2 * solution.cost / dof
    assert 0.9 < ratio.mean() < 1.1
    return ratio.mean()
