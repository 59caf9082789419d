"""Identification of cable robots from starts that are 100 mm off: with a camera beside the encoders, and from encoders alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.cable_robots import published
from cables.test_calibration import read
from scipy.optimize import least_squares as solve
from sizes import size

from robocal.cables.geometry import cable_robot
from robocal.geometry import se3, so3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.identify import identify

LENGTH = 3e-3
POSE = np.array([2e-3] * 3 + [np.radians(1.0)] * 3)  # one sigma: with it, the noises of figure 3.8
OFF = 0.1  # m, of every anchor's component and every zero: what a tape measure leaves, and what is expected of them


def measured(rng, poses, camera, length=LENGTH):
    """Up to 0.8 m about the middle, turned by up to 20 degrees about each axis."""
    robot = published("laval")
    shift, turn = rng.uniform(-0.8, 0.8, (poses, 3)), np.radians(rng.uniform(-20, 20, (poses, 3)))
    t = se3.from_vector(np.concatenate([robot.a.mean(axis=0) + shift, turn], axis=1))
    y = read(robot, t) + length * rng.normal(size=(poses, 8))
    cables = {"cable": np.tile(np.arange(8), poses)}
    seen = [
        Observations(
            "lengths", np.repeat(np.arange(poses), 8), y.reshape(-1, 1), np.full((8 * poses, 1), length), extra=cables
        )
    ]
    if camera:
        e = POSE * rng.normal(size=(poses, 6))
        t[:, :3, 3] += e[:, :3]
        t[:, :3, :3] = so3.exp(e[:, 3:]) @ t[:, :3, :3]
        still = Frame("camera", (0.0,) * 6, (False,) * 6)
        seen.append(Observations("pose", np.arange(poses), se3.to_vector(t), np.tile(POSE, (poses, 1)), still))
    nominal = cable_robot(
        "laval", robot.a + OFF * rng.normal(size=robot.a.shape), robot.b, robot.zeros + OFF * rng.normal(size=8),
        free=("ax", "ay", "az", "l0"),
    )  # fmt: skip
    return robot, nominal, DataSet(Configurations(tuple(f"p{i}" for i in range(poses))), tuple(seen))


def errors(robot, nominal, found):
    """Of what was fitted: error squared and variance foretold, mean over the numbers. Numbers that the lengths cannot tell stay where
    they were: the truth is moved to where it has the same."""
    kept = found.identifiability.basis
    fitted = [n for n in kept if n in nominal.table]
    held = [n for n in nominal.table.free if n not in fitted]
    at = [(int(n[1]) - 1, "xyz".index(n[-1])) for n in held]

    def moved(x):
        return robot.a @ se3.from_vector(x)[:3, :3].T + x[:3]

    here = np.zeros(6)
    if held:
        assert len(held) == 6
        way = solve(
            lambda x: [moved(x)[i, j] - nominal.a[i, j] for i, j in at], here, xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        assert np.abs(way.fun).max() < 1e-9
        here = way.x
    truth = {f"c{i + 1}.a{s}": moved(here)[i, j] for i in range(8) for j, s in enumerate("xyz")}
    truth |= {f"c{i + 1}.l0": z for i, z in enumerate(robot.zeros)}
    by = {p.name: p.identified for p in found.parameters}
    off = np.array([by[n] - truth[n] for n in fitted])
    var = np.diag(found.covariance)[[kept.index(n) for n in fitted]]
    return fitted, (off**2).mean(), var.mean()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("camera", "numbers"), [(True, 32), (False, 26)], ids=["camera and encoders", "encoders alone"]
)
def test_anchors_and_zeros_are_as_sure_as_they_say(camera, numbers):
    worth = []
    for seed in range(size(20, 6)):
        robot, nominal, data = measured(np.random.default_rng(seed), 100, camera)
        found = identify(nominal, data)
        assert found.verdict.status == "improved", list(map(str, found.verdict.reasons))
        fitted, square, foretold = errors(robot, nominal, found)
        assert len(fitted) == numbers
        if camera:
            assert sum(p.status == "identified" for p in found.parameters) == 32
        worth.append((square, foretold))
    got, said = np.sqrt(np.mean(worth, axis=0))
    print(
        f"camera {camera}: rms {1e3 * got:.2f} mm, foretold {1e3 * said:.2f} mm, ratio {got / said:.3f} over {len(worth)} seeds"
    )
    assert got / said < size(1.1, 1.3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_as_few_poses_as_there_are_unknowns_prove_nothing(seed):
    """At 13 poses the encoders have as many numbers as unknowns: what comes out must not be called better than a tape measure."""
    robot, nominal, data = measured(np.random.default_rng(seed), 13, False)
    found = identify(nominal, data)
    told = [p for p in found.parameters if p.status == "identified"]
    if found.verdict.status == "improved":
        _, square, _ = errors(robot, nominal, found)
        assert told and np.sqrt(square) < OFF
    (worse,) = (r for r in found.warnings if r.code == "worse-than-unmeasured")
    # Six numbers held, the others are known to half a metre and more: worse than the 100 mm of a tape measure.
    low, high = (worse.numbers[k].value for k in ("low", "high"))
    print(f"seed {seed}: {low:.2f} to {high:.1f} m")
    assert OFF < low < high and high > 2.0 and "tape measure" in worse.sentence


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_after_six_numbers_are_fixed_all_others_are_told(seed):
    """Lengths tell 4 m - 6 numbers: none is missing once six are held, and which six the report chose, or somebody else."""
    robot, nominal, data = measured(np.random.default_rng(seed), 100, False)
    first = identify(nominal, data)
    assert first.identifiability.structural_rank == 4 * 8 - 6
    held = [n for n in nominal.table.free if n not in first.identifiability.basis]
    assert len(held) == 6
    for fixed in (held, ["c1.ax", "c1.ay", "c1.az", "c2.ax", "c2.az", "c3.az"]):
        free = [n for n in nominal.table.free if n not in fixed]
        found = identify(replace(nominal, table=nominal.table.with_free(free)), data)
        assert found.identifiability.structural_rank == 26 and len(found.identifiability.basis) == 26
        assert not [r for r in found.warnings if r.code == "motions-unseen"]
    by = {p.name: p.status for p in found.parameters}
    print(f"seed {seed}: {sum(by[n] == 'identified' for n in free)} of 26 identified by the numbers of somebody else")


@pytest.mark.parametrize(("poses", "enough"), [(10, False), (12, False), (13, True)])
def test_fewer_poses_than_unknowns_are_refused(poses, enough):
    """Eight cables leave two numbers of every pose: (4 m - 6) / (m - 6) = 13 poses tell the 26 unknowns, unless priors were stated."""
    _, nominal, data = measured(np.random.default_rng(1), poses, False)
    found = identify(nominal, data)
    said = [r for r in found.verdict.reasons if r.code == "too-few-poses"]
    assert bool(said) == (not enough) and found.verdict.status == ("not_improved" if enough else "refused")
    if said:
        assert (said[0].numbers["unknown"], said[0].numbers["needed"]) == (26, 13)
    priors = dict.fromkeys(nominal.table.free, OFF)
    held = replace(nominal, table=nominal.table.with_priors(priors))
    assert all(r.code != "too-few-poses" for r in identify(held, data).verdict.reasons)
