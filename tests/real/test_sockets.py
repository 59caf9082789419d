"""No instrument at all: a ball on the flange rests in two sockets 50 mm apart, at three placements; joints alone are read.

Each placement is held out in turn. The distance between its sockets is told to nobody in that round: it is predicted.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from cli.runs import robocal

from robocal.files.dataset import read_dataset
from robocal.files.robot import open_robot
from robocal.fit.options import Options
from robocal.prove.identify import baseline, identify

ARMS = {
    "panda": ("panda_1", ("front", "right", "back-high")),
    "iiwa-14": ("kuka_14", ("front", "left_back", "raised_left")),
}
DATA = """robocal: 1
kind: point
file: sockets.csv
joints: {{columns: [q1, q2, q3, q4, q5, q6, q7], unit: rad}}
place: socket                           # the column that names the socket of each row
configuration: {{group: placement}}       # what is held out together
between:
{between}
"""
BETWEEN = "  - {{places: [{name}0, {name}1], distance: 50, unit: mm, sigma: 0.1}}"


def write(folder, shared_data, arm):
    """sockets.csv and data.yaml of one arm: what anybody would write who had recorded these rows."""
    series, placements = ARMS[arm]
    rows = ["q1,q2,q3,q4,q5,q6,q7,socket,placement"]
    for placement in placements:
        for hole in (0, 1):
            q = np.loadtxt(shared_data / "sockets" / series / placement / f"hole_{hole}.csv", delimiter=",")
            name = placement.replace("-", "_")
            rows += [",".join([*map(repr, map(float, row)), f"{name}{hole}", placement]) for row in q]
    (folder / "sockets.csv").write_text("\n".join(rows) + "\n")
    between = "\n".join(BETWEEN.format(name=p.replace("-", "_")) for p in placements)
    (folder / "data.yaml").write_text(DATA.format(between=between))
    return folder / "data.yaml"


@pytest.fixture(params=list(ARMS))
def case(request, shared_data, tmp_path):
    robot = open_robot(request.param).chain
    data = read_dataset(write(tmp_path, shared_data, request.param), robot).dataset
    return request.param, robot, data


def to_own_socket(model, data, placement):
    """Mean distance (m) of the ball's centre to the mean of its own socket, and the distance (m) of the two sockets."""
    groups = np.array(data.configurations.groups)
    centres, missed = [], []
    for obs in data.observations:
        if obs.kind == "point" and groups[obs.configuration[0]] == placement:
            ball = model.pose(data.configurations.joints[obs.configuration])[:, :3, 3]
            centres.append(ball.mean(axis=0))
            missed.append(np.linalg.norm(ball - centres[-1], axis=1))
    assert len(centres) == 2
    return float(np.concatenate(missed).mean()), float(np.linalg.norm(centres[0] - centres[1]))


@pytest.mark.sampled(1)
def test_each_placement_held_out_in_turn(case):
    """A placement is not in the data at all when it is judged; nothing is shared with it but the arm."""
    arm, robot, data = case
    groups = np.array(data.configurations.groups)
    print(f"\n{arm}")
    for placement in dict.fromkeys(data.configurations.groups):
        others = np.flatnonzero(groups != placement)
        problem, x = baseline(robot, data, others)
        tool_only = robot.with_values(
            {n: x[0, problem.table.index[n]] for n in problem.table.names if n in robot.table}
        )
        found = identify(robot, data.take(others), Options(hold_out=0.0, leave_one_out=False))
        before, _ = to_own_socket(tool_only, data, placement)
        after, apart = to_own_socket(found.corrected, data, placement)
        print(
            f"{placement}: tool only {1e3 * before:.2f} mm, identified {1e3 * after:.3f} mm, sockets {1e3 * apart:.2f} mm"
        )
        assert after <= 1.0e-3 and abs(apart - 0.05) <= 1.2e-3
        assert after < before
        if arm == "panda":
            assert 7.2e-3 < before < 9.8e-3


@pytest.mark.sampled(1)
@pytest.mark.parametrize("reselect", [False, True])
def test_folds_say_the_same(case, reselect):
    """The product's own way: three rounds, the sockets of the held-out placement profiled, their distance a prediction."""
    arm, robot, data = case
    found = identify(robot, data, Options(hold_out="group", folds=3, reselect=reselect))
    (metres,) = found.stages
    assert found.verdict.status == "improved" and len(metres.folds) == 3
    print(f"\n{arm}, {'strict' if reselect else 'fast'}: {[(f.name, round(1e3 * f.after, 3)) for f in metres.folds]}")
    for fold in metres.folds:
        assert fold.profiled and fold.after <= 1.0e-3 and fold.after < fold.before
    apart = found.rows.unseen[np.array(found.rows.kind) == "distance"]
    assert len(apart) == 3 and (apart <= 1.2e-3).all()


def test_from_the_command_line(shared_data, tmp_path, monkeypatch):
    written = write(tmp_path, shared_data, "panda")
    written.write_text(written.read_text().replace("configuration: {group: placement}", ""))
    monkeypatch.chdir(tmp_path)
    words = ["--hold-out", "group", "--group-by", "placement", "--folds", "3"]
    ran = robocal("identify", "panda", "data.yaml", *words, "-o", "run")
    assert ran.status == 0 and "back-high" in ran.out and "own frames fitted" in ran.out, ran.err
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert all(f["after"] <= 1.0 and f["profiled"] for f in result["residuals"]["folds"])
    assert result["split"]["how"] == "3 folds of groups"


@pytest.mark.sampled(2)
@pytest.mark.parametrize("wrong", [0.0, 0.05, -0.05, 1, -1, 5, -5, 20, -20])
def test_a_wrong_bar_is_no_improvement(case, wrong):
    """The distance of the sockets is all that says how long the arm is: off by 2 % and more it is refused, before any gain."""
    arm, robot, data = case
    off = [replace(o, value=o.value + 1e-3 * wrong) if o.kind == "distance" else o for o in data.observations]
    found = identify(robot, replace(data, observations=tuple(off)), Options(hold_out="group", folds=3))
    print(f"\n{arm}, {wrong:+} mm: {found.verdict.status}, scale {found.scale.factor:+.2%} +- {found.scale.sigma:.2%}")
    if abs(wrong) < 1:
        assert (found.verdict.status, found.verdict.region) == ("improved", "working")
    else:
        assert found.verdict.status == "refused" and found.verdict.reasons[0].code == "scale-wrong"


@pytest.mark.sampled(1)
@pytest.mark.parametrize("loss", ["huber", "cauchy", "tukey"])
def test_no_loss_lets_an_arm_collapse_around_its_bars(case, loss):
    """The bars are three rows of hundreds: were they weighed down like readings, the arm would shrink to where its ball need
    not move, and the bars would be met as well as nobody asked for."""
    arm, robot, data = case
    found = identify(robot, data, Options(hold_out="group", folds=3, loss=loss))
    bars = np.array(found.rows.kind) == "distance"
    fitted, predicted = np.abs(found.rows.after[bars, 0]), found.rows.unseen[bars]
    said = ", ".join(f"{f.name} {1e3 * f.before:.2f} to {1e3 * f.after:.2f}" for f in found.stages[0].folds)
    print(
        f"\n{arm}, {loss}: {said} mm; bars off by {1e3 * fitted.max():.2f}, predicted to {1e3 * predicted.max():.2f} mm"
    )
    assert (found.verdict.status, found.verdict.region) == ("improved", "working")
    assert fitted.max() <= 0.3e-3 and predicted.max() <= 2e-3
    assert abs(found.scale.factor) <= 3 * found.scale.sigma and abs(found.scale.factor) < 0.01
    assert all(f.after < f.before for f in found.stages[0].folds)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("loss", ["huber", "tukey"])
def test_a_wrong_bar_is_no_improvement_by_any_loss(case, loss):
    """Refused for its scale, or, where a loss that forgets large residuals forgets whole sockets, not improved."""
    arm, robot, data = case
    off = [replace(o, value=o.value + 0.02) if o.kind == "distance" else o for o in data.observations]
    found = identify(robot, replace(data, observations=tuple(off)), Options(hold_out="group", folds=3, loss=loss))
    print(f"\n{arm}, {loss}: {found.verdict.status}, scale {found.scale.factor:+.2%} +- {found.scale.sigma:.2%}")
    assert found.verdict.status != "improved"
    if loss == "huber":
        assert found.verdict.status == "refused" and found.verdict.reasons[0].code == "scale-wrong"
