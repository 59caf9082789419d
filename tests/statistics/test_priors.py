"""Priors in a joint estimate of cables, camera and markers, and what local blocks cost the groups that pay for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.thesis_rig import ANCHORS, TAPE, specification, thesis_rig, with_wider_priors, without_priors
from sizes import size

from robocal.estimate.identifiability import analyse
from robocal.estimate.least_squares import least_squares
from robocal.estimate.uncertainty import effective_columns, uncertainty
from robocal.fit.noise import apply_noise, assess
from robocal.fit.soft_fit import soften
from robocal.measure.base import problem

SEEDS = range(5)
ROUNDS = 5  # of fit and noise, until the noise is settled


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_the_selection_costs_the_joint_estimate_nothing(shared_data, seed):
    """What is kept by default finds the exit points as well as everything free; priors that say nothing change nothing."""
    rig = thesis_rig(specification(shared_data), seed)
    made = rig.problem
    everything = least_squares(made)
    assert everything.reasons[0].converged
    soft = least_squares(soften(made, made.start)).x
    selected = least_squares(made.with_free(analyse(made, soft).basis))
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


def small_rig(shared_data, repeat):
    """30 free poses and 29 free markers are 354 columns, which 240 lengths and some 1100 pixels pay for, each as it helps."""
    return thesis_rig(specification(shared_data), 100 + repeat, poses=30, grid=(6, 5))


def told(name, values):
    """The mean of the repeats, printed with its own Monte Carlo error."""
    mean = float(np.mean(values))
    print(f"{name}: {mean:.4f} +- {np.std(values) / np.sqrt(len(values)):.4f} over {len(values)} repeats")
    return mean


@pytest.mark.slow
def test_local_blocks_are_charged_to_those_who_pay(shared_data):
    """chi2 per degree of freedom of every group, and of all, is one."""
    ratio = {}
    for repeat in range(40):
        rig = small_rig(shared_data, repeat)
        made = rig.problem
        x = least_squares(made).x
        groups = assess(rig.data, made, x, np.arange(made.configurations), effective_columns(made, x))
        for group in groups:
            ratio.setdefault(group.name, []).append(group.chi2 / group.dof)
        u = uncertainty(made, x)
        ratio.setdefault("all", []).append(u.chi2 / u.dof)
        whole = sum(g.n - g.dof for g in groups)
        assert whole == pytest.approx(effective_columns(made, x) + 6 * made.blocks)
    for name, values in ratio.items():
        assert 0.95 < told(f"chi2/dof {name}", values) < 1.05


@pytest.mark.slow
@pytest.mark.parametrize("which", [0, 1], ids=["pixels", "lengths"])
def test_an_unstated_sigma_comes_out_beside_local_blocks(shared_data, which):
    """The noise of one group is not said; what comes out, fitted with what came out before, is the true one."""
    found = []
    for repeat in range(size(40, 16)):
        rig = small_rig(shared_data, repeat)
        known = rig.data.observations
        obs = tuple(replace(o, sigma=None) if i == which else o for i, o in enumerate(known))
        data = replace(rig.data, observations=obs)
        x, tau = least_squares(rig.problem).x, {}
        for _ in range(ROUNDS):
            made = problem(rig.robot, apply_noise(data, tau)).with_table(rig.problem.table)
            x = least_squares(made, x).x
            groups = assess(data, made, x, np.arange(made.configurations), effective_columns(made, x))
            before, tau = tau, {(g.name, g.unit): g.tau for g in groups if g.stated is None}
        (key,) = tau
        assert tau[key] == pytest.approx(before[key], rel=2e-3), "settled"
        found.append(tau[key] / known[which].sigma[0, 0])
    assert told(f"sigma of {key[0]} over the true one", found) == pytest.approx(1.0, abs=0.03)
