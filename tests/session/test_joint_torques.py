"""Friction and gravity of an arm's joints from torques: what is found, how sure it is, and what is wrong with files."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cli.runs import robocal

from robocal.arms.joint_loads import gravity_columns, load_names, with_loads
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Observations
from robocal.prove.identify import identify
from robocal.session.inputs import open_machine

N, POSES, NOISE = 5, 60, 0.1


@pytest.fixture(scope="module")
def arm():
    made = with_loads(open_machine("rv-2aj").machine)
    return made.with_table(made.table.with_free(load_names(made)))


def recorded(arm, seed):
    rng = np.random.default_rng(seed)
    true = {
        n: abs(rng.normal()) * {"coulomb": 3.0, "viscous": 2.0, "mass": 5.0}.get(n.rpartition(".")[2], 0.5)
        for n in load_names(arm)
    }
    q, speed = (
        rng.uniform(-1.2, 1.2, (POSES, N)),
        rng.choice([-1.0, 1.0], (POSES, N)) * rng.uniform(0.05, 0.5, (POSES, N)),
    )
    extra = {"joint": np.tile(np.arange(float(N)), POSES), "speed": speed.ravel()}
    where, none = np.repeat(np.arange(POSES), N), np.zeros((POSES * N, 1))
    obs = Observations("joint_torque", where, none, none + NOISE, extra=extra, group="drives")
    data = synthesise(arm.with_values(true), DataSet(Configurations(tuple(map(str, range(POSES))), q), (obs,)), rng)
    return true, data


def test_gravity_is_the_slope_of_the_potential(arm):
    q = np.random.default_rng(0).uniform(-1, 1, (3, N))
    columns, g, mass, at = gravity_columns(arm, q), 9.80665, 2.0, np.array([0.1, -0.05, 0.2])

    def potential(joints):
        pose = arm.pose(joints)  # the tool is fixed to the last link
        link = pose @ np.linalg.inv(tool)
        return mass * g * (link[:, :3, :3] @ at + link[:, :3, 3])[:, 2]

    tool = se3.from_vector(np.array([[arm.table[f"tool.{s}"].value for s in ("x", "y", "z", "rx", "ry", "rz")]]))[0]
    for j in range(N):
        step = np.zeros(N)
        step[j] = 1e-6
        slope = (potential(q + step) - potential(q - step)) / 2e-6
        np.testing.assert_allclose(mass * (columns[:, j, -1] @ np.array([1.0, *at])), slope, atol=1e-6)


def test_friction_is_found_as_surely_as_it_says_and_gravity_where_the_data_tell_it(arm):
    inside = []
    for seed in range(8):
        true, data = recorded(arm, seed)
        found = identify(arm, data)
        assert found.verdict.status == "improved"
        by = {p.name: p for p in found.parameters}
        for j in arm.joint_names:
            for s in ("coulomb", "viscous"):
                p = by[f"{j}.{s}"]
                assert p.status == "identified"
                inside.append(p.interval[0] <= true[p.name] <= p.interval[1])
        assert by[f"{arm.joint_names[0]}.mass"].status == "dropped"  # the axis is upright: no mass shows in its torque
        assert found.stages[0].unit == "N m" and found.stages[0].held_out.rms < 1.5 * NOISE
    assert np.mean(inside) > 0.85


def write(folder, arm, columns=N, speed=True):
    true, data = recorded(arm, 1)
    obs, q = data.observations[0], np.degrees(data.configurations.joints)
    names = arm.joint_names
    parts = (("", q), ("speed.", np.degrees(obs.extra["speed"].reshape(-1, N))), ("torque.", obs.value.reshape(-1, N)))
    heads = [p + n for p, _ in parts for n in names]
    rows = np.column_stack([v for _, v in parts])
    (folder / "run.csv").write_text(
        ",".join(heads) + "\n" + "".join(",".join(f"{v:.6f}" for v in row) + "\n" for row in rows)
    )
    said = f"robocal: 1\nkind: joint_torque\nfile: run.csv\njoints: {{columns: [{', '.join(names)}], unit: deg}}\n"
    said += f"torque: {{columns: [{', '.join('torque.' + n for n in names[:columns])}], unit: Nm, sigma: {NOISE}}}\n"
    if speed:
        said += f"speed: {{columns: [{', '.join('speed.' + n for n in names[:columns])}], unit: deg/s}}\n"
    (folder / "torque.yaml").write_text(said)
    return true, str(folder / "torque.yaml")


def test_from_files_to_a_run_folder_and_back(tmp_path, arm):
    true, data = write(tmp_path, arm)
    ran = robocal("identify", "rv-2aj", data, "-o", str(tmp_path / "out"))
    assert ran.status == 0, ran.out + ran.err
    told = {p["name"]: p for p in json.loads((tmp_path / "out" / "result.json").read_text())["parameters"]}
    assert told["j2.coulomb"]["identified"] == pytest.approx(true["j2.coulomb"], abs=0.1)
    again = open_machine(str(tmp_path / "out")).machine
    assert again.table["j2.coulomb"].value == pytest.approx(told["j2.coulomb"]["identified"])
    assert not {n for n in again.table.free if n.endswith("coulomb")}


def test_without_speeds_friction_is_not_told(tmp_path, arm):
    _, data = write(tmp_path, arm, speed=False)
    ran = robocal("identify", "rv-2aj", data, "--json")
    told = {p["name"]: p["status"] for p in json.loads(ran.out)["parameters"]}
    assert told["j2.coulomb"] == "dropped" and "Traceback" not in ran.err
    assert "no speed is given" in ran.out and "leave out --free" not in ran.out


# obeys: friction-unseen
@pytest.mark.parametrize("joints", [range(N), [2]], ids=["every joint", "one joint"])
def test_one_direction_is_said_of_the_joints_that_have_one(tmp_path, arm, joints):
    _, data = write(tmp_path, arm)
    right = (tmp_path / "run.csv").read_text()
    heads = right.splitlines()[0].split(",")
    table = np.loadtxt(tmp_path / "run.csv", delimiter=",", skiprows=1)
    at = [heads.index(f"speed.{arm.joint_names[j]}") for j in joints]
    table[:, at] = np.abs(table[:, at])
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header=",".join(heads), comments="", fmt="%.6f")

    def unseen():
        remarks = json.loads(robocal("identify", "rv-2aj", data, "--json").out)["remarks"]
        return [r["numbers"]["joints"] for r in remarks if r["code"] == "friction-unseen"]

    assert unseen() == [[arm.joint_names[j] for j in joints]]
    (tmp_path / "run.csv").write_text(right)
    assert unseen() == []


def with_units(text):
    head, *rows = text.splitlines()
    unit = {"speed": "deg/s", "torque": "Nm"}
    return "\n".join([",".join(f"{n} [{unit.get(n.partition('.')[0], 'deg')}]" for n in head.split(",")), *rows]) + "\n"


def test_a_table_that_names_its_units_needs_no_data_file(tmp_path, arm):
    true, _ = write(tmp_path, arm)
    table = tmp_path / "run.csv"
    table.write_text(with_units(table.read_text()))
    ran = robocal("identify", "rv-2aj", table, "--json")
    told = {p["name"]: p["identified"] for p in json.loads(ran.out)["parameters"]}
    assert ran.status == 0 and told["j2.coulomb"] == pytest.approx(true["j2.coulomb"], abs=0.1)
    made = robocal("new", "rv-2aj", "--table", table, "-o", tmp_path / "cell")
    assert made.status == 0 and "kind: joint_torque" in (tmp_path / "cell" / "data.yaml").read_text()
    assert robocal("check", "rv-2aj", tmp_path / "cell" / "data.yaml").status == 0
    table.write_text(table.read_text().replace("torque.j3 [Nm]", "moment.j3 [Nm]"))
    ran = robocal("identify", "rv-2aj", table)
    assert ran.status == 2 and "a torque of every joint is needed" in ran.err and "torque.j3" in ran.err


def test_from_new_to_a_fit(tmp_path):
    assert robocal("new", "rv-2aj", "--kind", "joint_torque", "-o", tmp_path).status == 0
    ran = robocal("identify", tmp_path / "robot.yaml", tmp_path / "data.yaml", "--json")
    told = {p["name"]: p["identified"] for p in json.loads(ran.out)["parameters"]}
    assert told["j1.coulomb"] == pytest.approx(1.0, abs=0.2)  # what the example rows are made of


def test_torques_of_other_joints_are_refused(tmp_path, arm):
    _, data = write(tmp_path, arm, columns=4)
    ran = robocal("identify", "rv-2aj", data)
    assert ran.status == 2 and "torque.columns" in ran.err and "5: j1" in ran.err


def turned(table, heads):
    return table * np.array([-1.0 if h.startswith("torque.") else 1.0 for h in heads])


def exchanged(table, heads):
    one, other = heads.index("torque.j2"), heads.index("torque.j5")
    table[:, [one, other]] = table[:, [other, one]]
    return table


def constant(table, heads):
    table[:, heads.index("torque.j2")] = 3.0
    return table


# obeys: negative-number
# obeys: torques-left
@pytest.mark.parametrize(
    ("mistake", "code"),
    [(turned, "negative-number"), (exchanged, "torques-left"), (constant, "torques-left")],
    ids=["signs", "columns", "constant"],
)
def test_torques_that_no_joint_has_are_refused(tmp_path, arm, mistake, code):
    _, data = write(tmp_path, arm)
    right = (tmp_path / "run.csv").read_text()
    heads = right.splitlines()[0].split(",")
    table = mistake(np.loadtxt(tmp_path / "run.csv", delimiter=",", skiprows=1), heads)
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header=",".join(heads), comments="", fmt="%.6f")
    ran = robocal("identify", "rv-2aj", data, "--json")
    told = json.loads(ran.out)["verdict"]
    assert ran.status == 3 and told["status"] == "refused" and code in {r["code"] for r in told["remarks"]}, told
    (tmp_path / "run.csv").write_text(right)  # as the advice says
    told = json.loads(robocal("identify", "rv-2aj", data, "--json").out)["verdict"]
    assert told["status"] == "improved" and code not in {r["code"] for r in told["remarks"]}


def test_a_gross_torque_costs_its_row_alone(tmp_path, arm):
    _, data = write(tmp_path, arm)
    lines = (tmp_path / "run.csv").read_text().splitlines()
    at = lines[0].split(",").index("torque.j2")
    cells = lines[7].split(",")
    lines[7] = ",".join([*cells[:at], str(1000 + float(cells[at])), *cells[at + 1 :]])
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    assert robocal("identify", "rv-2aj", data).status == 0


def test_of_positions_that_nothing_moves_nothing_is_said(tmp_path, arm):
    _, data = write(tmp_path, arm)
    ran = robocal("identify", "rv-2aj", data, "-o", str(tmp_path / "out"))
    assert ran.status == 0 and " mm" not in ran.out and "compensate" not in ran.out and "robocal validate" in ran.out


def test_a_run_is_validated_in_torques(tmp_path, arm):
    _, data = write(tmp_path, arm)
    rows = (tmp_path / "run.csv").read_text().splitlines()
    (tmp_path / "run.csv").write_text("\n".join(rows[:41]) + "\n")
    (tmp_path / "fresh.csv").write_text("\n".join([rows[0], *rows[41:]]) + "\n")
    fresh = tmp_path / "fresh.yaml"
    fresh.write_text((tmp_path / "torque.yaml").read_text().replace("run.csv", "fresh.csv"))
    assert robocal("identify", "rv-2aj", data, "-o", str(tmp_path / "out")).status == 0
    ran = robocal("validate", str(tmp_path / "out"), str(fresh), "--against", "rv-2aj", "--json")
    told = json.loads(ran.out)["torque"]
    assert ran.status == 0 and told["unit"] == "N m" and told["this"]["mean"] < 1.5 * NOISE < told["against"]["mean"]
    assert "100 torques of joints" in robocal("validate", str(tmp_path / "out"), str(fresh)).out
    ran = robocal("validate", "rv-2aj", str(fresh))  # nothing is known of its masses
    assert ran.status == 3 and "predicting the mean" in ran.out and "N m" in ran.out
