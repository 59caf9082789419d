"""Load cells in the cables: mass and centre of mass of the platform, as sure as they say, and chi-squared of what is left."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from cables.cable_robots import published
from cables.precise import measured
from cli.runs import robocal
from cli.test_cable_identify import LENGTHS, POSES, table
from scipy import stats
from sizes import size

from robocal.cables.geometry import cable_robot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.files.cable.write import describe_cable
from robocal.geometry import se3
from robocal.measure.data import Observations
from robocal.prove.identify import identify
from robocal.session.cable.payload import payload_rows

CELL = 0.5  # N
COM = np.array([0.01, -0.02, 0.03])


def held(robot, rng, poses):
    """Poses of the platform where the cables hold it, and what cells and instruments read there."""
    while True:
        data = measured(robot, rng, 4 * poses)
        t = se3.from_vector(data.observations[1].value)
        # Tensions at the measured poses: 0.2 mm and 0.02 degrees change them by less than a cell reads.
        found = distribute(structure_of(robot, t), gravity_wrench(t, robot.mass, COM), robot.limits, "mid")
        some = np.flatnonzero(found.has_solution)[:poses]
        if len(some) == poses:
            break
    return data.take(some), found.tension[some] + CELL * rng.normal(size=(poses, 8))


@pytest.mark.slow
def test_mass_and_centre_are_as_sure_as_they_say():
    truth = replace(published("laval"), mass=5.0, com=COM)
    off, chi2 = [], []
    for seed in range(size(20, 3)):
        rng = np.random.default_rng(seed)
        data, tension = held(truth, rng, 60)
        nominal = cable_robot(
            "laval", truth.a + 0.01 * rng.normal(size=(8, 3)), truth.b, truth.zeros, free=("ax", "ay", "az", "l0"), mass=4.8, com=np.zeros(3),
        )  # fmt: skip
        raw = Observations(
            "load", np.repeat(np.arange(60), 8), tension.reshape(-1, 1), np.full((480, 1), CELL),
            extra={"cable": np.tile(np.arange(8.0), 60)}, options={"free": ("mass", "cx", "cy", "cz"), "cables": nominal.cables},
        )  # fmt: skip
        found = identify(
            nominal, replace(data, observations=(*data.observations, payload_rows(SimpleNamespace(robot=nominal), raw)))
        )
        by = {p.name: p for p in found.parameters}
        body = [by[f"platform.{s}"] for s in ("mass", "cx", "cy", "cz")]
        assert all(p.status == "identified" for p in body), [(p.name, p.status, p.note) for p in body]
        off += [(p.identified - v) / p.sigma for p, v in zip(body, (5.0, *COM), strict=True)]
        chi2.append(next(g.chi2 / g.dof for g in found.groups if g.name == "load"))
    print(
        f"{len(chi2)} seeds: rms of (error over sigma) {np.sqrt(np.mean(np.square(off))):.3f}, chi2/dof of the cells {np.mean(chi2):.3f}"
    )
    low, high = np.sqrt(stats.chi2.ppf([0.001, 0.999], len(off)) / len(off))
    assert low < np.sqrt(np.mean(np.square(off))) < high
    assert abs(np.mean(chi2) - 1) < size(0.05, 0.12)


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """Files of a robot whose platform weighs 5 kg and is said to weigh 4.8."""
    folder = tmp_path_factory.mktemp("load")
    truth = replace(published("laval"), mass=5.0, com=COM)
    data, tension = held(truth, np.random.default_rng(0), 40)
    (folder / "robot.yaml").write_text(
        describe_cable(replace(truth, mass=4.8, com=np.zeros(3))) + "calibrate: {free: [ax, ay, az, l0]}\n"
    )
    (folder / "light.yaml").write_text(
        describe_cable(replace(truth, mass=None)) + "calibrate: {free: [ax, ay, az, l0]}\n"
    )
    length, pose = data.observations
    ids = data.configurations.ids
    (folder / "lengths.csv").write_text(
        table([f"{c} [mm]" for c in truth.cables], ids, 1e3 * length.value.reshape(-1, 8))
    )
    names = ["x [mm]", "y [mm]", "z [mm]", "rx [rad]", "ry [rad]", "rz [rad]"]
    (folder / "poses.csv").write_text(table(names, ids, pose.value * np.repeat([1e3, 1.0], 3)))
    (folder / "load.csv").write_text(table([f"t{i}" for i in range(1, 9)], ids, tension))
    (folder / "lengths.yaml").write_text(
        LENGTHS.replace("COLUMNS", ", ".join(truth.cables)).replace("sigma: 1", "sigma: 0.5")
    )
    (folder / "poses.yaml").write_text(
        POSES.replace("sigma: 0.0002", "sigma: 0.00035").replace("free: true", "free: false")
    )
    cells = ", ".join(f"t{i}" for i in range(1, 9))
    (folder / "load.yaml").write_text(
        f"robocal: 1\nkind: load\nfile: load.csv\nload: {{columns: [{cells}], unit: N, sigma: {CELL}}}\nfree: [mass, cx, cy, cz]\nconfiguration: {{id: id}}\n"
    )
    return folder


def called(folder, load="load.yaml", robot="robot.yaml"):
    return robocal("identify", folder / robot, folder / "lengths.yaml", folder / "poses.yaml", folder / load, "--json")


def test_files_of_load_cells(cell):
    ran = called(cell)
    assert ran.status in (0, 3), ran.remarks
    found = {p["name"]: p for p in json.loads(ran.out)["parameters"]}
    mass = found["platform.mass"]
    assert mass["unit"] == "kg" and abs(mass["identified"] - 5.0) < 4.5 * mass["sigma"] < 0.2


@pytest.mark.parametrize(
    ("change", "robot", "words"),
    [
        (("free: [mass", "free: [weight"), "robot.yaml", "free"),
        (("t8]", "t7]"), "robot.yaml", "named twice"),
        (("unit: N", "unit: kg"), "robot.yaml", "another quantity"),
        (("", ""), "light.yaml", "mass"),
    ],
)
def test_what_cannot_be_meant_is_refused(cell, change, robot, words):
    (cell / "wrong.yaml").write_text((cell / "load.yaml").read_text().replace(*change))
    ran = called(cell, "wrong.yaml", robot)
    assert ran.status == 2 and words in ran.remarks, ran.remarks
