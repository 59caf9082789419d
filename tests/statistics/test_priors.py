"""Priors in a joint estimate of cables, camera and markers, and what local blocks cost the groups that pay for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.thesis_rig import ANCHORS, TAPE, specification, thesis_rig, with_wider_priors, without_priors

from robocal.calibrate.fit import softly
from robocal.calibrate.noise import apply_noise, assess
from robocal.estimate.identifiability import analyse
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import effective_columns, uncertainty
from robocal.measure.base import problem

SEEDS = range(5)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_the_selection_costs_the_joint_estimate_nothing(shared_data, seed):
    """What is kept by default finds the exit points as well as everything free; priors that say nothing change nothing."""
    rig = thesis_rig(specification(shared_data), seed)
    made = rig.problem
    everything = least_squares(made)
    assert everything.reasons[0].converged
    soft = least_squares(softly(made, made.start)).x
    selected = least_squares(made.with_free(analyse(made, soft).kept))
    free, kept = rig.exit_points(everything.x), rig.exit_points(selected.x)
    print(f"seed {seed}: everything free {1e3 * free:.2f} mm, selected {1e3 * kept:.2f} mm")
    assert kept <= 1.02 * free
    nothing, wide = (analyse(p, soft).dropped for p in (without_priors(made), with_wider_priors(made, 1000.0)))
    assert wide == nothing


@pytest.mark.parametrize("seed", [0, 1])
def test_priors_a_thousand_times_too_wide_are_none(shared_data, seed):
    """On few poses of few markers much is dropped: the same, whether nobody says anything of anchors, camera and hand-eye or
    somebody says that they may be anywhere."""
    rig = thesis_rig(specification(shared_data), seed, poses=12, grid=(5, 4))
    made = rig.problem
    tight = replace(
        made.table, rows=tuple(replace(p, expected=0.01) if p.name in ANCHORS else p for p in made.table.rows)
    )
    made = made.with_table(tight.with_priors(dict.fromkeys(ANCHORS, TAPE)))
    x = least_squares(made).x
    nothing, wide = (analyse(p, x).dropped for p in (without_priors(made), with_wider_priors(made, 1000.0)))
    assert wide == nothing and set(nothing) & set(ANCHORS)
    # As they are, they hold what the data do not see.
    assert not set(analyse(made, x).dropped) & set(ANCHORS)


def small_rig(shared_data, seed):
    return thesis_rig(specification(shared_data), seed, poses=30, grid=(6, 5))


@pytest.mark.slow
def test_local_blocks_are_charged_to_those_who_pay(shared_data):
    """chi2 per degree of freedom of every group is one, and an unstated sigma comes out, over 40 repeats: 30 free poses are 180
    columns, which 240 lengths and some 1800 pixels share as unevenly as they determine them."""
    ratio, sigma, whole = {}, {}, []
    for seed in range(40):
        rig = small_rig(shared_data, 100 + seed)
        made = rig.problem
        x = least_squares(made).x
        every = np.arange(made.units)
        columns = effective_columns(made, x)
        for group in assess(rig.data, made, x, every, columns):
            ratio.setdefault(group.name, []).append(group.chi2 / group.dof)
        u = uncertainty(made, x)
        whole.append(u.chi2 / u.dof)
        for which, obs in enumerate(rig.data.observations):
            sigma.setdefault(obs.label, []).append(_unstated(rig, which, x) / obs.sigma[0, 0])
    for name, values in (*ratio.items(), ("all", whole)):
        mean, error = np.mean(values), np.std(values) / np.sqrt(len(values))
        print(f"chi2/dof {name}: {mean:.4f} +- {error:.4f}")
        assert 0.95 < mean < 1.05
    for name, values in sigma.items():
        mean, error = np.mean(values), np.std(values) / np.sqrt(len(values))
        print(f"sigma {name}, unstated: {mean:.4f} +- {error:.4f} of the true one")
        assert mean == pytest.approx(1.0, abs=0.03)


def _unstated(rig, which, x):
    """The sigma that comes out for one group that states none, fitted with what came out before until it settles."""
    obs = tuple(replace(o, sigma=None) if i == which else o for i, o in enumerate(rig.data.observations))
    data, tau, prior = replace(rig.data, observations=obs), {}, rig.problem.table
    for _ in range(20):
        made = problem(rig.robot, apply_noise(data, tau)).with_table(prior)
        x = least_squares(made, x).x
        groups = assess(data, made, x, np.arange(made.units), effective_columns(made, x))
        before, tau = tau, {(g.name, g.unit): g.tau for g in groups if g.stated is None}
        if before and all(abs(before[k] - t) < 1e-3 * t for k, t in tau.items()):
            break
    return next(iter(tau.values()))
