"""Iterations that stop at a greatest error, as the algorithm of the RV-2AJ article does (equation 14)."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from called import identify, simulate
from trials import joints, observations, perturbed

from robocal.errors import ModelError
from robocal.estimate.choosing.choice import choose
from robocal.estimate.least_squares import least_squares
from robocal.estimate.problem import Problem
from robocal.estimate.solution import Reason
from robocal.files.robot import open_robot
from robocal.fit.estimators import ESTIMATORS, can_batch
from robocal.fit.options import Options
from robocal.measure.base import problem, synthesise
from robocal.measure.data import DataSet
from robocal.parameters import Parameter, ParameterTable


def posed(kind="position", noise=True):
    """An RV-2AJ off in what can be seen, in base coordinates, and its nominal model's problem."""
    model, rng = open_robot("rv-2aj").chain, np.random.default_rng(4)
    seen = replace(observations(kind, 40), frame=None)
    nominal = synthesise(model, DataSet(joints(model, rng, 40), (seen,)))
    kept = choose(made := problem(model, nominal), made.start).basis
    drawn = perturbed(model, rng)
    truth = model.with_values({n: drawn.table[n].value for n in kept})
    data = synthesise(truth, nominal, rng if noise else None)
    return problem(model, data).with_free(kept), data, model


@pytest.mark.parametrize("method", ["lm", "gauss-newton", "pinv"])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-7])
def test_it_stops_at_the_first_iteration_whose_greatest_error_is_within(method, tolerance):
    made = posed(noise=False)[0]
    ended = least_squares(made, method=method, tolerance=tolerance)
    assert ended.reasons == (Reason.TOLERANCE,) and ended.reasons[0].converged
    assert made.greatest_error(ended.x)[0] <= tolerance
    count = int(ended.iterations[0])
    before = least_squares(made, method=method, max_iterations=count - 1)
    assert count >= 1 and made.greatest_error(before.x)[0] > tolerance


def test_at_the_last_iteration_that_is_allowed_it_is_still_seen():
    made = posed(noise=False)[0]
    count = int(least_squares(made, tolerance=1e-4).iterations[0])
    assert least_squares(made, tolerance=1e-4, max_iterations=count).reasons == (Reason.TOLERANCE,)
    assert least_squares(made, tolerance=1e-4, max_iterations=count - 1).reasons == (Reason.ITERATIONS,)


def test_what_is_within_at_the_start_stays():
    made = posed()[0]
    for method in ("lm", "pinv"):
        ended = least_squares(made, method=method, tolerance=1.0)
        assert ended.reasons == (Reason.TOLERANCE,) and np.array_equal(ended.x, made.start)


def test_a_tolerance_below_the_noise_is_never_met():
    made = posed()[0]
    ended, free = least_squares(made, tolerance=1e-7), least_squares(made)
    assert ended.reasons == free.reasons != (Reason.TOLERANCE,) and np.array_equal(ended.x, free.x)


def test_the_greatest_error_is_that_of_whole_positions():
    made, data, model = posed()
    gap = model.pose(data.configurations.joints)[:, :3, 3] - data.observations[0].value
    both = np.repeat(made.start, 2, axis=0)
    np.testing.assert_allclose(made.greatest_error(both), np.linalg.norm(gap, axis=1).max(), rtol=1e-12)
    some = np.ones((1, 40))
    some[0, np.argmax(np.linalg.norm(gap, axis=1))] = 0.0
    assert made.with_weights(some).greatest_error(made.start)[0] < made.greatest_error(made.start)[0]


@pytest.mark.parametrize("method", [n for n, e in ESTIMATORS.items() if e.iterates])
def test_every_method_that_iterates_stops(method):
    made = posed()[0]
    found = ESTIMATORS[method].run(made, made.start, Options(method=method, tolerance=1e-3), None).solution
    assert found.reasons == (Reason.TOLERANCE,) and made.greatest_error(found.x)[0] <= 1e-3
    assert not can_batch(Options(method=method, tolerance=1e-3))


def test_data_without_a_length_have_no_greatest_error():
    class Angles:
        parts, used, configuration, reading = ((0, 1, "rad"),), np.ones(3, bool), np.arange(3), True

    class Posed:
        in_use, table = np.ones(3, bool), ParameterTable((Parameter("a"),))

        def residuals(self, x):
            return [Angles()]

    with pytest.raises(ModelError, match="length"):
        Problem.greatest_error(Posed(), np.zeros(1))


@pytest.fixture(scope="module")
def arm(tmp_path_factory) -> Path:
    """An arm, simulated."""
    folder = tmp_path_factory.mktemp("tolerance")
    simulate("rv-2aj", folder, poses=40, seed=2)
    return folder


def test_the_verb_takes_it_in_the_unit_of_the_robots_file_and_says_so(arm):
    options = {"leave_one_out": False}
    robot, data = str(arm / "robot.yaml"), [str(arm / "data.yaml")]
    ended = identify(robot, data, options, tolerance=0.4, output=arm / "run")
    document = json.loads((arm / "run" / "result.json").read_text())
    assert document["fit"]["reason"] == "stopped: the greatest error is within the tolerance" == Reason.TOLERANCE.text
    assert document["provenance"]["options"]["tolerance"] == 0.4
    left = np.array(
        [v for v, part in zip(ended.residuals["after_mm"], ended.residuals["set"], strict=True) if part == "fit"]
    )
    assert left.max() <= 0.4
    whole = identify(robot, data, options).result
    assert whole.fit.reason.startswith("converged") and whole.fit.iterations > document["fit"]["iterations"]
    assert "tolerance" not in whole.provenance.options


@pytest.mark.parametrize("method", ["lse", "particle"])
def test_a_method_that_does_not_iterate_refuses_it(arm, method):
    with pytest.raises(ModelError, match="does not iterate"):
        identify(str(arm / "robot.yaml"), [str(arm / "data.yaml")], method=method, tolerance=0.1)
