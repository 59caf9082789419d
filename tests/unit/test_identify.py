"""Identification from end to end: what improves, what is refused, and that the evidence adds up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sizes import size
from unit.arm_data import SIX, TOOL, TRACKER, arm, away, measured, true_arm

from robocal.arms.conventions import chain
from robocal.errors import ModelError
from robocal.estimate.least_squares import METHODS
from robocal.estimate.solution import Reason
from robocal.fit.estimators import estimator
from robocal.fit.fit import _restart
from robocal.fit.options import Options
from robocal.geometry import se3, so3
from robocal.measure.base import problem as build
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.identify import identify
from robocal.remarks.code import Code


def frame_of(table, name):
    return se3.from_vector(np.array([[table[f"{name}.{s}"].value for s in SIX]]))[0]


@pytest.mark.parametrize("kind", ["position", "pose"])
@pytest.mark.parametrize("stated", [True, False])
def test_a_simulated_arm_improves_where_nothing_was_measured(kind, stated):
    found = identify(arm(), measured(60, kind=kind, stated=stated))
    assert found.verdict.status == "improved", found.verdict
    assert away(found) < 1e-4 < away(replace(found, corrected=arm()))
    metres = found.stages[0]
    assert metres.unit == "m" and metres.after.mean < 1e-4 < metres.before.mean and metres.held_out.mean < 1e-4
    assert metres.held_out.n == 12 and metres.after.n == 48 and metres.leave_one_out.n == 60
    assert [s.unit for s in found.stages] == (["m", "rad"] if kind == "pose" else ["m"])
    assert sorted((*found.fit_ids, *found.held_out_ids)) == sorted(f"p{i}" for i in range(60))
    assert 0.6 < found.chi2 / found.dof < 1.4 and found.history[-1] <= found.history[0]
    assert found.options.hold_out == 0.2 and found.groups[0].sigma_source == ("stated" if stated else "estimated")


def test_the_same_seed_gives_the_same_result():
    a, b = identify(arm(), measured(40)), identify(arm(), measured(40))
    np.testing.assert_array_equal(a.table.values, b.table.values)
    assert (
        a.verdict == b.verdict
        and a.parameters == b.parameters
        and a.held_out_ids == b.held_out_ids
        and a.band == b.band
    )
    other = identify(arm(), measured(40), Options(seed=1))
    assert other.held_out_ids != a.held_out_ids
    np.testing.assert_array_equal(other.table.values, a.table.values)


def test_every_parameter_has_a_status_that_its_numbers_bear_out():
    robot = arm(free=(*arm().usual, "j4.d"))
    found = identify(robot, measured(60))
    by = {p.name: p for p in found.parameters}
    assert list(by) == list(found.table.names) and {p.status for p in found.parameters} >= {
        "identified",
        "prior",
        "dropped",
        "fixed",
    } - {"prior"}
    for p in found.parameters:
        if p.status in ("identified", "prior"):
            assert p.sigma > 0 and p.sigma >= p.sigma_instrument * (1 - 1e-9) and 0 <= p.data_share <= 1
            assert (p.data_share >= 0.75) is (p.status == "identified")
        elif p.status == "dropped":
            assert p.identified == p.nominal and p.sigma is None and p.note
        else:
            assert p.identified == p.nominal and p.sigma is None and p.data_share is None
    assert by["tool.rx"].status == "dropped" and "no effect" in by["tool.rx"].note, (
        "points do not see how the tool is turned"
    )
    assert by["base.x"].status == "fixed" and by["tracker.x"].status == "identified"
    assert set(found.correlation_names) == {p.name for p in found.parameters if p.sigma_conditional is not None}
    # Of rotations the covariance speaks of turns, the table of components.
    plain = [i for i, n in enumerate(found.correlation_names) if not found.table[n].turn]
    np.testing.assert_allclose(
        np.sqrt(np.diag(found.covariance))[plain],
        [by[found.correlation_names[i]].sigma_conditional for i in plain],
        rtol=1e-9,
    )
    np.testing.assert_allclose(np.diag(found.correlation), 1)


def test_rows_tell_what_happened_to_every_measurement():
    found = identify(arm(), measured(40))
    rows = found.rows
    assert rows.before.shape == rows.after.shape == (40, 6) and np.isnan(rows.after[:, 3:]).all()
    assert (
        rows.configuration == tuple(f"p{i}" for i in range(40))
        and set(rows.group) == {"tracker"}
        and set(rows.kind) == {"position"}
    )
    held = {c for c, h in zip(rows.configuration, rows.held_out, strict=True) if h}
    assert held == set(found.held_out_ids)
    np.testing.assert_allclose(rows.unseen[rows.held_out], np.linalg.norm(rows.after[rows.held_out, :3], axis=1))
    assert np.isnan(rows.unseen[~rows.held_out]).all()
    small = identify(arm(), measured(20))
    assert not small.rows.held_out.any() and np.isfinite(small.rows.unseen).all()
    assert small.rows.unseen.mean() == pytest.approx(small.stages[0].leave_one_out.mean)
    # In base coordinates, the frame of the instrument as each fit had it: that of the fit, where nothing was held out.
    seen, base = measured(20).observations[0].value, se3.inverse(frame_of(small.table, "tracker"))
    there = small.rows.place - small.rows.after[:, :3]
    np.testing.assert_allclose(there, seen @ base[:3, :3].T + base[:3, 3], atol=1e-9)


def test_two_instruments_tell_of_one_place_and_one_error():
    """Whatever frame an instrument tells its readings in, a row says in base coordinates where the arm was and what was wrong."""
    other = replace(TRACKER, name="camera", value=(-0.4, 0.3, 1.2, -0.6, 0.9, 2.0))
    one, two = measured(30, sigma=1e-6), measured(30, sigma=1e-6, frame=other)
    both = DataSet(one.configurations, (*one.observations, *two.observations))
    rows = identify(arm(), both, Options(hold_out=0.0)).rows
    for table in (rows.place, rows.before[:, :3]):
        np.testing.assert_allclose(table[:30], table[30:], atol=1e-5)
    assert np.linalg.norm(rows.before[:30, :3], axis=1).mean() > 4e-4


def test_a_camera_on_the_tool_tells_the_error_of_the_tool_and_not_of_what_it_sees():
    """Its readings say where a board stands in it; the arrow is the camera's own: where the model has it less where it was."""
    board = Frame("board", (0.2, 0.1, 0.6, 0.3, -0.2, 0.5))
    eye = Frame("eye", (0.02, 0.01, 0.05, 0.1, 0.2, -0.3), mount="tool")
    truth = true_arm(names=("j2.d", "j3.d"))  # lengths alone: the camera is turned as the model says
    on_board = np.zeros(40, dtype=int)
    data = measured(40, truth=truth, kind="pose", sigma=1e-7, frame=eye, targets=(board,), target=on_board, known=True)
    found = identify(arm(), data, Options(hold_out=0.0))
    rows, mount = found.rows, se3.from_vector(np.array([eye.value]))[0]
    begun = arm().with_values({n: found.baseline[n].value for n in arm().table.names})  # the tool is fitted beforehand
    true, nominal = (robot.pose(data.configurations.joints) @ mount for robot in (truth, begun))
    np.testing.assert_allclose(rows.before[:, :3], (nominal - true)[:, :3, 3], atol=1e-6)
    np.testing.assert_allclose(rows.place, true[:, :3, 3], atol=1e-5)
    assert np.linalg.norm(rows.before[:, :3], axis=1).mean() > 2e-4


def test_an_arm_is_drawn_as_it_was_found():
    found = identify(arm(), measured(30))
    shape = found.shape
    at = measured(30).configurations.ids.index(shape.configuration)
    tool = found.corrected.pose(measured(30).configurations.joints[at : at + 1])[0, :3, 3]
    np.testing.assert_allclose(shape.tool, tool, atol=1e-12)
    (line,) = shape.lines
    np.testing.assert_allclose([line.points[0], line.points[-1]], [np.zeros(3), tool], atol=1e-12)
    base = se3.inverse(frame_of(found.table, "tracker"))[:3, 3]
    assert [s.name for s in shape.instruments] == ["tracker"]
    np.testing.assert_allclose(shape.instruments[0].points, [base], atol=1e-12)


# --- verdicts ---------------------------------------------------------------------------------------------------------------


def test_equal_configurations_are_refused():
    q = np.repeat([[0.1, 0.2, 0.3, 0.4, 0.5]], 30, axis=0)
    found = identify(arm(), measured(30, q=q))
    assert found.verdict.status == "refused" and any(w.code is Code.ONE_PLACE for w in found.warnings)
    known = identify(
        arm(free=("j5.theta",)), measured(30, q=q, frame=replace(TRACKER, free=(False,) * 6), truth=arm(), sigma=1.0)
    )
    assert (
        known.identifiability.rank == 0
        and known.verdict.status == "refused"
        and known.verdict.reasons[0].code is Code.ONE_PLACE
    )


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize("m", [1, 2, 3, 4])
def test_fewer_numbers_than_parameters_is_no_crash(m, stated):
    found = identify(arm(), measured(m, stated=stated))
    assert found.verdict.status in ("not_improved", "refused") or m == 4
    assert any(w.code is Code.FEW_MEASUREMENTS for w in found.warnings) and np.isfinite(found.table.values).all()
    assert all(p.sigma is None or p.sigma > 1e-9 for p in found.parameters)


@pytest.mark.parametrize("stated", [True, False])
def test_pure_noise_is_refused(stated):
    data = measured(60, stated=stated)
    nonsense = np.array([0.3, 0.2, 0.1]) + np.random.default_rng(0).normal(0, 0.01, (60, 3))
    found = identify(arm(), DataSet(data.configurations, (replace(data.observations[0], value=nonsense),)))
    assert found.verdict.status == "refused" and found.verdict.reasons[0].code is Code.NO_BETTER_THAN_MEAN


def test_shuffled_measurements_are_refused():
    data = measured(60)
    obs = data.observations[0]
    mixed = DataSet(data.configurations, (replace(obs, value=np.random.default_rng(0).permutation(obs.value)),))
    assert identify(arm(), mixed).verdict.status == "refused"


@pytest.mark.parametrize("seed", range(4))
def test_a_perfect_robot_is_not_improved(seed):
    found = identify(arm(), measured(60, truth=arm(), seed=seed))
    assert found.verdict.status == "not_improved" and found.verdict.reasons[0].code is Code.GAIN_NOT_PROVEN


@pytest.mark.slow
def test_a_perfect_robot_is_seldom_improved_by_chance():
    """The interval is two-sided 95 %, and a fit of noise loses on unseen poses: fewer than 2.5 % may pass."""
    many = size(200, 60)
    count = sum(
        identify(arm(), measured(50, truth=arm(), seed=s), Options(leave_one_out=False)).verdict.status == "improved"
        for s in range(many)
    )
    print(f"{count} of {many}, Monte Carlo error {np.sqrt(many * 0.025):.1f}")
    assert count <= many * 0.025 + 3 * np.sqrt(many * 0.025)


# --- options ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS)
def test_every_method_improves_and_hands_back_finite_numbers(method):
    """With parameters in it that nobody can see: turns of the tool, a base that is the tracker's frame."""
    robot = arm(free=arm().usual)
    found = identify(robot, measured(60), Options(method=method))
    assert found.verdict.status == "improved", (method, found.verdict, found.reason)
    assert np.isfinite(found.covariance).all() and np.isfinite(found.correlation).all()
    assert away(found) < 1.5e-4
    by = {p.name: p for p in found.parameters}
    if method in ("pinv", "lse"):
        assert by["tool.rx"].status == "prior" and by["tool.rx"].sigma > 1e-4, "kept, but not claimed"


def test_keep_all_claims_nothing_that_is_not_seen():
    found = identify(arm(free=arm().usual), measured(60), Options(keep_all=True))
    by = {p.name: p for p in found.parameters}
    assert not any(p.status == "dropped" for p in found.parameters)
    assert (
        by["tool.rx"].status == "prior" and by["tool.rx"].sigma > 1e-4 and by["j3.d"].status in ("identified", "prior")
    )
    assert found.verdict.status == "improved" and away(found) < 1e-4


def test_without_evidence_nothing_is_claimed():
    unproven = identify(arm(), measured(15), Options(leave_one_out=False)).verdict
    assert unproven.reasons[0].code is Code.NOTHING_HELD_OUT
    assert identify(arm(), measured(40), Options(hold_out=0.0)).verdict.status == "improved"
    proof = identify(arm(), measured(40), Options(hold_out=0.0))
    assert (
        "leave-one-out" in proof.verdict.reasons[0].sentence
        and proof.stages[0].held_out is None
        and proof.held_out_ids == ()
    )
    with pytest.raises(ModelError, match="held-out share"):
        identify(arm(), measured(40), Options(hold_out=0.7))


def test_priors_hold_what_the_data_do_not_see():
    robot = arm(free=arm().usual)
    stated = replace(robot, table=robot.table.with_priors({"tool.rx": 0.01, "j3.d": 1e-7}))
    found = identify(stated, measured(60))
    by = {p.name: p for p in found.parameters}
    assert by["tool.rx"].status == "prior" and by["tool.rx"].sigma == pytest.approx(0.01, rel=0.1)
    assert abs(by["j3.d"].identified - by["j3.d"].nominal) < 1e-6, "a prior of a tenth of a micron is obeyed"
    free = identify(stated, measured(60), Options(priors=False))
    assert abs({p.name: p for p in free.parameters}["j3.d"].identified - by["j3.d"].nominal) > 1e-5


def test_robust_identification_is_not_moved_by_gross_errors():
    data = measured(80)
    obs = data.observations[0]
    value = obs.value.copy()
    value[::16] += np.array([5e-3, -4e-3, 6e-3])
    dirty = DataSet(data.configurations, (replace(obs, value=value),))
    plain, tukey = identify(arm(), dirty), identify(arm(), dirty, Options(loss="tukey"))
    assert away(tukey) < 1e-4 and away(plain) < 1e-4
    assert len([o for o in plain.outliers if o.set_aside]) == 5
    clean = {p.name: p.sigma for p in identify(arm(), data).parameters if p.sigma}
    bars = {p.name: p.sigma for p in tukey.parameters if p.sigma}
    assert all(0.7 < bars[n] / clean[n] < 2 for n in bars if n in clean), "bars are those of the good measurements"
    assert any(w.code is Code.OUTLIERS for w in plain.warnings)


def test_restarts_are_tried_when_the_first_fit_does_not_converge():
    found = identify(arm(), measured(30), Options(max_iterations=1))
    assert any(w.code is Code.RESTARTED for w in found.warnings)


def test_a_restart_that_ended_where_the_first_was_about_to_end_is_taken():
    """A hundred steps are not enough now and then; the same place, reached by another way, is an end."""
    data = measured(30)
    problem = build(arm(), data)
    whole = estimator("lm").run(problem, problem.start, Options(), None)
    assert whole.solution.reasons[0].converged
    still = replace(whole.solution, reason=np.array([int(Reason.ITERATIONS)]), cost=whole.solution.cost * (1 - 1e-9))
    first = replace(whole, solution=still)
    found = _restart(problem, whole.solution.x, first, Options())
    assert found is not first and found.solution.reasons[0].converged
    far = replace(whole, solution=replace(still, cost=whole.solution.cost * 0.9))
    assert _restart(problem, whole.solution.x, far, Options()) is far


def test_an_improvement_that_is_none_of_the_robots():
    """Only the tool and the tracker are free: what they gain is not the arm's."""
    crooked = arm(free=TOOL)
    data = measured(30, truth=true_arm(names=TOOL, size=0.01, robot=crooked))
    found = identify(crooked, data).verdict
    assert found.status == "located" and found.region is None


@pytest.mark.parametrize("m", [5, 6])
def test_leaving_one_out_must_leave_enough(m):
    found = identify(arm(), measured(m))
    assert found.verdict.status != "improved", "one configuration less, and there are fewer numbers than parameters"


# obeys: nothing-measured-there
def test_held_out_configurations_without_a_measurement_prove_nothing():
    data = measured(30)
    where = data.configurations
    held = identify(arm(), data).held_out_ids
    seen = np.flatnonzero(~np.isin(where.ids, held))
    found = identify(arm(), DataSet(where, (data.observations[0].take(seen),)), Options(leave_one_out=False))
    assert (
        found.held_out_ids == held
        and found.verdict.status == "not_improved"
        and found.verdict.reasons[0].code is Code.NOTHING_MEASURED_THERE
    )
    assert identify(arm(), data, Options(leave_one_out=False)).verdict.status == "improved"


def test_a_dropped_turn_does_not_turn():
    """Components of a rotation vector mix, but no turn happens about an axis that was dropped (second order aside)."""
    rows = [
        {"xyz": (0, 0, 0.3), "rpy": (0.2, -0.4, 0.3), "axis": (0, 0, 1)},
        {"xyz": (0.05, 0, 0.1), "rpy": (1.2, 0.1, 0.7), "axis": (0, 0, 1)},
        {"xyz": (0.25, 0.02, 0), "rpy": (0.3, 0.6, -0.2), "axis": (0, 1, 0)},
        {"xyz": (0.16, 0, 0.03), "rpy": (-0.4, 0.2, 1.4), "axis": (0, 0, 1)},
    ]
    robot = chain("turned", "urdf", rows)
    robot = replace(robot, table=robot.table.with_free(robot.usual))
    rng = np.random.default_rng(5)
    truth = robot.with_values({n: robot.table[n].value + rng.normal(0, 2e-3) for n in robot.geometric})
    q = rng.uniform(-1.5, 1.5, (80, 4))
    seen = Observations("position", np.arange(80), np.zeros((80, 3)), np.full((80, 3), 2e-5), TRACKER)
    found = identify(robot, synthesise(truth, DataSet(Configurations(tuple(map(str, range(80))), q), (seen,)), rng))
    by = {p.name: p for p in found.parameters}
    turns: dict[str, list[float]] = {"dropped": [], "identified": []}
    for t in found.table.turns:
        names = found.table.names[t : t + 3]
        nominal, after = (np.array([getattr(by[n], word) for n in names]) for word in ("nominal", "identified"))
        turn = so3.log(so3.exp(after) @ so3.exp(nominal).T)
        for n, v in zip(names, turn, strict=True):
            if n in robot.table and by[n].status in turns:
                turns[by[n].status].append(abs(float(v)))
    assert len(turns["dropped"]) >= 3 and max(turns["dropped"]) < 2e-5 < max(turns["identified"])


@pytest.mark.slow
def test_change_sigma_and_interval_belong_to_the_number_that_is_shown():
    """Over draws of noise the components of a joint frame's rotation scatter as their sigmas say, however it is turned."""
    rows = [
        {"xyz": (0, 0, 0.3), "rpy": (0.2, -0.4, 0.3), "axis": (0, 0, 1)},
        {"xyz": (0.05, 0, 0.1), "rpy": (1.2, 0.1, 0.7), "axis": (0, 0, 1)},
        {"xyz": (0.25, 0.02, 0), "rpy": (2.3, 1.1, -1.2), "axis": (0, 1, 0)},
    ]
    robot = chain("turned", "urdf", rows)
    robot = replace(robot, table=robot.table.with_free([f"j3.{s}" for s in ("rx", "ry", "rz")]))
    rng = np.random.default_rng(5)
    truth = robot.with_values({n: robot.table[n].value + rng.normal(0, 2e-3) for n in robot.table.free})
    q = rng.uniform(-1.5, 1.5, (40, 3))
    sigma = np.tile((1e-4,) * 3 + (2e-4, 1e-3, 5e-3), (40, 1))
    seen = Observations("pose", np.arange(40), np.zeros((40, 6)), sigma)
    clean = DataSet(Configurations(tuple(map(str, range(40))), q), (seen,))
    scores = []
    for _ in range(60):
        found = identify(robot, synthesise(truth, clean, rng), Options(leave_one_out=False))
        by = {p.name: p for p in found.parameters}
        for n in robot.table.free:
            p = by[n]
            assert p.delta == pytest.approx(p.identified - p.nominal, abs=1e-12)
            assert sum(p.interval) / 2 == pytest.approx(p.identified, abs=1e-12)
            scores.append((p.identified - truth.table[n].value) / p.sigma)
    spread = np.sqrt(np.mean(np.reshape(scores, (60, 3)) ** 2, axis=0))
    print(f"components off by {spread} sigma, Monte Carlo error {1 / np.sqrt(120):.2f}")
    assert (abs(spread - 1) < 0.3).all()


def test_a_length_wrong_by_a_decimal_is_refused_with_the_one_to_write():
    """25 instead of 160 mm: no arm's making leaves that, and the data say what it is."""
    truth = true_arm()
    wrong = arm().with_values({"j3.d": 0.025})
    found = identify(wrong, measured(80, truth=truth))
    assert found.verdict.status == "refused" and found.verdict.reasons[0].code == Code.UNMADE
    (told,) = found.verdict.reasons[0].numbers["changes"]
    assert told.startswith("j3.d: you wrote 25 mm, the data say ")
    assert float(told.split()[-2]) == pytest.approx(1e3 * truth.table["j3.d"].value, abs=0.1)
    assert away(found, truth) < 1e-4


@pytest.mark.parametrize("joint", ["j2.theta", "j4.theta"])
def test_a_joint_whose_mastering_is_lost_is_fitted(joint):
    lost = arm().with_values({joint: arm().table[joint].value + 0.4})
    assert identify(lost, measured(80)).verdict.status == "improved"


def test_joints_in_the_wrong_order_are_refused():
    data = measured(80)
    q = data.configurations.joints[:, [0, 1, 2, 4, 3]]
    found = identify(arm(), DataSet(replace(data.configurations, joints=q), data.observations))
    assert found.verdict.status != "improved"


def test_a_slipped_target_is_noticed():
    data = measured(80)
    value = data.observations[0].value.copy()
    value[40:] += [0.002, 0, 0]
    found = identify(arm(), DataSet(data.configurations, (replace(data.observations[0], value=value),)))
    assert any(w.code is Code.ERRORS_FOLLOW for w in found.warnings)
    assert all(w.code is not Code.ERRORS_FOLLOW for w in identify(arm(), data).warnings)


@pytest.mark.parametrize(
    ("value", "sigma", "words"), [(np.nan, 2e-5, "finite"), (np.inf, 2e-5, "finite"), (0.0, 0.0, "sigma")]
)
def test_what_is_no_number_is_refused_by_name(value, sigma, words):
    data = measured(12)
    obs = data.observations[0]
    values, sigmas = np.array(obs.value), np.array(obs.sigma)
    values[3, 1], sigmas[3, 1] = value, sigma
    with pytest.raises(ModelError, match=f"{words}.*configuration p3"):
        identify(arm(), replace(data, observations=(replace(obs, value=values, sigma=sigmas),)))
