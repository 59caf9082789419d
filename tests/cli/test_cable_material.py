"""Pulleys and stretch as parameters: common to all cables where the file says so once, of each where it says so of each."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from cables.cable_robots import published
from cli.runs import robocal
from cli.test_cable_identify import LENGTHS, POSES, table

from robocal.cables.cable_lengths import inverse
from robocal.cables.pulley import Pulleys
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.write import describe_cable
from robocal.geometry import se3

NOISE, PLACE, TURN = 3e-4, 2e-4, 2e-4
EVERY = "every_cable: {pulley: {radius: 0.045, axis: [0, 0, 2]}, "
TENSION = "tension: {columns: [t1, t2, t3, t4, t5, t6, t7, t8], unit: N}\n"
TRUE = {"radius": 0.05, "nx": 0.06, "ny": -0.04, "elasticity": 4e-5}  # the axis beside the file's 2 along z


def made(folder, seed=1, free="ax, ay, az, l0, radius, nx, ny, elasticity", every=EVERY, sag=False, tension=TENSION):
    """A robot over pulleys 5 mm smaller, upright and half as soft as they are, and 100 poses that a tracker measured."""
    rng, n = np.random.default_rng(seed), 100
    base = published("laval")
    axis = np.tile([TRUE["nx"], TRUE["ny"], 2.0], (8, 1))
    truth = base.having(pulleys=Pulleys(np.full(8, TRUE["radius"]), axis), elasticity=np.full(8, TRUE["elasticity"]))
    moved = {f"{c}.{s}": rng.normal(0, 0.01) for c in truth.cables for s in ("ax", "ay", "az", "l0")}
    truth = truth.with_values({k: truth.table[k].value + v for k, v in moved.items()})
    nominal = base.having(elasticity=np.full(8, 2e-5))
    if sag:
        truth, nominal = (r.having(density=np.full(8, 1.0)) for r in (truth, nominal))
    drawn = np.concatenate([rng.uniform(-1.2, 1.2, (40 * n, 3)), rng.uniform(-0.3, 0.3, (40 * n, 3))], axis=1)
    pose = se3.from_vector(drawn + np.r_[base.a.mean(axis=0), 0, 0, 0])
    # Tensions of all sizes that hold the platform: limits drawn anew for every part of the poses.
    parts = []
    for some in np.array_split(pose, 8):
        low = rng.uniform(30, 90, 8)
        load = gravity_wrench(some, base.mass, base.com)
        held = distribute(
            structure_of(truth, some), load, np.stack([low, low + rng.uniform(60, 300, 8)], axis=1), "mid"
        )
        parts.append((some[held.has_solution], held.tension[held.has_solution]))
    pose, pull = (np.concatenate(p) for p in zip(*parts, strict=True))
    chosen = rng.permutation(len(pose))[:n]
    pose, pull = pose[chosen], pull[chosen]
    assert len(pose) == n
    y = inverse(truth, pose, pull, sag=sag)[0] + NOISE * rng.normal(size=(n, 8))
    text = describe_cable(nominal).replace("every_cable: {", every) + f"calibrate: {{free: [{free}]}}\n"
    (folder / "robot.yaml").write_text(text)
    ids, names = [f"p{i}" for i in range(n)], [*(f"{c} [mm]" for c in base.cables), *(f"t{i + 1}" for i in range(8))]
    (folder / "lengths.csv").write_text(table(names, ids, np.hstack([1e3 * y, pull])))
    seen = se3.to_vector(pose) + rng.normal(size=(n, 6)) * np.repeat([PLACE, TURN], 3)
    columns = ["x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]"]
    (folder / "poses.csv").write_text(table(columns, ids, seen * np.repeat([1e3, 1.0], 3)))
    (folder / "poses.yaml").write_text(POSES.replace("free: true", "free: false"))
    lengths = LENGTHS.replace("COLUMNS", ", ".join(base.cables)).replace("sigma: 1", f"sigma: {1e3 * NOISE}")
    (folder / "lengths.yaml").write_text(lengths + tension)
    return truth


def identified(folder, *words):
    ran = robocal("identify", *(folder / f for f in ("robot.yaml", "lengths.yaml", "poses.yaml")), *words, "--json")
    assert ran.status in (0, 3), ran.remarks
    found = json.loads(ran.out)
    return {p["name"]: p for p in found["parameters"]}, found, ran.remarks


def worst(p, truth):
    """Greatest error of a frame anchor's component in its standard deviations."""
    return max(abs(p[n]["identified"] - truth.table[n].value) / p[n]["sigma"] for n in p if re.search(r"\.a[xyz]$", n))


@pytest.mark.parametrize("seed", [10, 11])
def test_what_all_cables_have_in_common_is_found(tmp_path, seed):
    truth = made(tmp_path, seed)
    p, found, _ = identified(tmp_path, "-o", tmp_path / "run")
    assert found["verdict"]["status"] == "improved"
    for symbol, true in TRUE.items():
        one = p[f"cables.{symbol}"]
        assert one["status"] == "identified" or (symbol in ("nx", "ny") and one["status"] == "prior"), one
        assert abs(one["identified"] - true) < 4.5 * one["sigma"]
    assert (
        p["cables.radius"]["unit"] == "m"
        and p["cables.radius"]["sigma"] < 2e-3
        and p["cables.elasticity"]["sigma"] < 2e-7
    )
    assert worst(p, truth) < 4.5
    again = read_cable(tmp_path / "run" / "calibrated.yaml").robot
    for symbol in TRUE:
        name, value = f"cables.{symbol}", p[f"cables.{symbol}"]
        assert np.isclose(again.table[name].value, value["identified"], rtol=1e-9)
    assert again.row("c7.radius") == "cables.radius" and np.allclose(again.pulleys.radius, again.pulleys.radius[0])


def test_a_prior_is_that_of_all(tmp_path):
    made(tmp_path)
    p, _, _ = identified(tmp_path, "--prior", "cables.radius=0.0001")
    assert p["cables.radius"]["sigma"] < 1.05e-4 and abs(p["cables.radius"]["delta"]) < 1e-3


def test_of_each_cable_by_itself_the_radius_is_not_seen(tmp_path):
    """And said so: an anchor that is higher looks the same."""
    made(tmp_path, free="ax, ay, az, l0, radius")
    text = (tmp_path / "robot.yaml").read_text().replace("pulley: {radius: 0.045, axis: [0, 0, 2]}, ", "")
    text = re.sub(r"(- \{name: c\d.*)\}", r"\1, pulley: {radius: 0.045, axis: [0, 0, 1]}}", text)
    (tmp_path / "robot.yaml").write_text(text)
    p, _, _ = identified(tmp_path)
    mine = [p[f"c{i}.radius"] for i in range(1, 9)]
    assert "cables.radius" not in p and all(m["status"] in ("dropped", "identified") for m in mine)
    assert all("cannot be separated from" in m["note"] for m in mine if m["status"] == "dropped")


def test_without_tensions_nothing_is_said_of_elasticity(tmp_path):
    made(tmp_path, free="ax, ay, az, l0, elasticity", tension="")
    p, _, _ = identified(tmp_path)
    assert p["cables.elasticity"]["status"] == "dropped" and p["cables.elasticity"]["delta"] == 0


def test_sag_is_taken_off_where_the_density_is_stated(tmp_path):
    truth = made(tmp_path, sag=True)
    p, found, remarks = identified(tmp_path)
    assert "sag is removed from the lengths" in remarks and found["verdict"]["status"] == "improved"
    assert worst(p, truth) < 4.5


def test_a_tension_that_cannot_carry_the_cable_is_refused(tmp_path):
    made(tmp_path, sag=True)
    robot = (tmp_path / "robot.yaml").read_text()
    (tmp_path / "robot.yaml").write_text(re.sub(r"density: [\d.e-]+", "density: 500", robot))
    ran = robocal("identify", tmp_path / "robot.yaml", tmp_path / "lengths.yaml", tmp_path / "poses.yaml")
    assert ran.status == 2 and "does not carry its weight" in ran.remarks


@pytest.mark.parametrize(("word", "hint"), [("radii", "radius"), ("elastcity", "elasticity")])
def test_a_misspelt_word_gets_the_nearest(tmp_path, word, hint):
    made(tmp_path, free=f"ax, {word}")
    ran = robocal("identify", tmp_path / "robot.yaml", tmp_path / "lengths.yaml", tmp_path / "poses.yaml")
    assert ran.status == 2 and hint in ran.remarks
