"""robocal cable tension: lists of poses in, tensions out, and what is refused or not trusted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from cables.cable_robots import box
from cli.runs import files, robocal
from listings import lengths_of, rows_of, units_of

from robocal.cables.elastic import hang_by_tension
from robocal.cables.geometry import cable_robot
from robocal.cables.pulley import Pulleys
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import capacity_margin, distribute, missing_wrench
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.pose_lists import WRENCH, read_platform_poses
from robocal.files.cable.write import describe_cable

POSES = """id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]
low,100,-200,900,0,0,0
high,300,200,1600,5,3,-10
out,2300,1900,2900,0,0,0
"""
HELD = POSES.replace("out,2300,1900,2900", "mid,0,0,1500")
PLATFORM = "platform: {mass: 12, centre_of_mass: [0.02, 0, -0.05]}\n"
CABLES = "every_cable: {tension: [10, 400], elasticity: 2.5e-5, density: 0.3}\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "robot.yaml").write_text(describe_cable(box()) + PLATFORM + CABLES)
    (tmp_path / "poses.csv").write_text(POSES)
    (tmp_path / "held.csv").write_text(HELD)
    return tmp_path


def truth(folder, poses="poses.csv"):
    robot = read_cable(folder / "robot.yaml").robot
    pose = read_platform_poses(folder / poses, robot).values
    return robot, structure_of(robot, pose), gravity_wrench(pose, robot.mass, robot.com)[:, robot.axes]


def run(folder, *more, poses="poses.csv"):
    return robocal("cable", "tension", folder / "robot.yaml", folder / poses, *more)


def test_what_it_says_is_what_the_model_says(folder):
    robot, w, load = truth(folder)
    ran = run(folder, "--json", "--length", 0.5)
    found = ran.document
    assert ran.status == 3 and "out: no tensions within the limits hold it" in ran.err
    assert [p["feasible"] for p in rows_of(found["poses"])] == [True, True, False]
    spread = distribute(w, load, robot.limits)
    np.testing.assert_allclose([p["tension"] for p in rows_of(found["poses"])[:2]], spread.tension[:2], rtol=1e-12)
    assert rows_of(found["poses"])[2]["tension"] is None
    margin = capacity_margin(w, load, robot.limits, 0.5)
    np.testing.assert_allclose([p["margin"] for p in rows_of(found["poses"])], margin, rtol=1e-9)
    lacking = missing_wrench(w, load, robot.limits, 0.5)
    np.testing.assert_allclose(rows_of(found["poses"])[2]["missing"], lacking[2], rtol=1e-9)
    assert (
        rows_of(found["poses"])[0]["missing"] is None
        and [u for k, u in units_of(found["poses"]).items() if k.startswith("wrench.")] == ["N"] * 3 + ["Nm"] * 3
    )


def test_the_missing_wrench_is_what_makes_it_held(folder):
    """Added by --wrench, or by columns of the list, the pose is held, and only just."""
    lacking = np.array(rows_of(run(folder, "--json").document["poses"])[2]["missing"])
    more = ",".join(f"{v:.12g}" for v in lacking * (1 + 1e-6) + np.sign(lacking) * 1e-6)
    found = rows_of(run(folder, "--json", "--wrench", more).document["poses"])
    assert found[2]["feasible"] and found[2]["margin"] < 0.01
    rows = [line.split(",") for line in POSES.splitlines()]
    head = rows[0] + [f"{n} [{u}]" for n, u in zip(WRENCH, ["N"] * 3 + ["Nm"] * 3, strict=True)]
    listed = [head, rows[1] + ["0"] * 6, rows[2] + ["0"] * 6, rows[3] + more.split(",")]
    (folder / "pulled.csv").write_text("\n".join(",".join(row) for row in listed))
    again = rows_of(run(folder, "--json", poses="pulled.csv").document["poses"])
    assert again[2]["feasible"]
    np.testing.assert_allclose(again[2]["tension"], found[2]["tension"], rtol=1e-9)
    np.testing.assert_allclose(again[0]["tension"], rows_of(run(folder, "--json").document["poses"])[0]["tension"])


@pytest.mark.sampled(1)
@pytest.mark.parametrize("method", ["norm", "mid", "closed", "barycentre", "p-norm"])
def test_methods_and_payload(folder, method):
    robot, w, load = truth(folder, "held.csv")
    payload = 3.0
    pose = read_platform_poses(folder / "held.csv", robot).values
    load = gravity_wrench(pose, robot.mass + payload, robot.com)
    power = ("--power", 6) if method == "p-norm" else ()
    ran = run(folder, "--json", "--method", method, "--payload", payload, *power, poses="held.csv")
    spread = distribute(w, load, robot.limits, method, 6.0)
    assert spread.has_solution.sum() == (2 if method == "closed" else 3) and spread.feasible.all()
    assert ran.status == (3 if method == "closed" else 0) and ("warning" in ran.err) == (method == "closed")
    t = np.array([p["tension"] or np.full(8, np.nan) for p in rows_of(ran.document["poses"])], float)
    np.testing.assert_allclose(t, spread.tension, rtol=1e-9)
    np.testing.assert_allclose((w @ t[..., None])[spread.has_solution, :, 0], -load[spread.has_solution], atol=1e-8)
    assert ran.document["mass"]["value"] == 15 and ran.document["power"] == (6 if method == "p-norm" else None)


def test_the_list_feeds_inverse_and_forward(folder):
    """Poses to tensions to sagging lengths to the same poses, file by file."""
    robot, out = folder / "robot.yaml", folder / "out"
    ran = run(folder, "-o", out, poses="held.csv")
    assert ran.status == 0 and "warning" not in ran.err and "3 of 3 poses are held" in ran.out
    assert files(out) == {"tensions.csv", "tension.json", "report.html"}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 2 and "Pose by pose" in page and "12" in page
    assert run(folder, poses="held.csv").out == (out / "tensions.csv").read_text()
    assert robocal("cable", "inverse", robot, out / "tensions.csv", "--sag", "-o", out / "lengths.csv").status == 0
    straight = lengths_of(robocal("cable", "inverse", robot, folder / "held.csv", "--json").document)
    first = (out / "lengths.csv").read_text().splitlines()[1].split(",")
    assert np.abs(np.array([float(v) for v in first[1:9]]) - straight["low"]).max() > 1e-3
    back = rows_of(robocal("cable", "forward", robot, out / "lengths.csv", "--sag", "--json").document["poses"])
    pose = read_platform_poses(folder / "held.csv", box()).values
    np.testing.assert_allclose([p["T_base_platform"] for p in back], pose, atol=1e-8)


def test_what_cables_weigh_is_left_out_and_half_of_it_as_payload_nearly_puts_it_right(folder):
    """The forces with which hanging cables pull at the platform with these tensions."""
    robot, _, _ = truth(folder)
    pose = read_platform_poses(folder / "held.csv", robot).values
    d = pose[:, None, :3, 3] + robot.b @ pose[:, :3, :3].swapaxes(1, 2) - robot.a
    across = np.hypot(d[..., 0], d[..., 1])
    weight = 0.3 * np.linalg.norm(d, axis=-1).sum(axis=1)

    def left(payload):
        """The share of the cables' weight that nothing holds, at every pose."""
        found = rows_of(run(folder, "--json", "--payload", payload, poses="held.csv").document["poses"])
        t = np.array([p["tension"] for p in found])
        up = -hang_by_tension(np.stack([across, d[..., 2]], axis=-1), t, robot.density, robot.elasticity).force[..., 1]
        return (robot.mass * 9.80665 - up.sum(axis=1)) / weight

    half = 0.5 * weight.mean() / 9.80665
    assert ((left(0) > 0.35) & (left(0) < 0.5)).all()
    assert (np.abs(left(half)) < 0.15).all()


def test_an_infeasible_pose_has_no_lengths(folder):
    """Its tensions are empty, and the next verb says so instead of making some up."""
    (folder / "t.csv").write_text(run(folder).out)
    refused = robocal("cable", "inverse", folder / "robot.yaml", folder / "t.csv", "--sag")
    refused.assert_refused("t.csv", "row 4", "column c1.tension", "empty")


def test_closed_form_that_leaves_the_limits_is_not_trusted(folder):
    ran = run(folder, "--method", "closed", "--limits", "5,60", "--json", poses="held.csv")
    found = [p["tension"] is None for p in rows_of(ran.document["poses"])]
    feasible = [p["feasible"] for p in rows_of(ran.document["poses"])]
    assert ran.status == 3 and any(n and ok for n, ok in zip(found, feasible, strict=True))
    assert "the closed form violates the limits where other tensions do not" in ran.err


def test_over_pulleys_the_cables_pull_where_they_arrive(folder):
    robot = read_cable(folder / "robot.yaml").robot.having(
        pulleys=Pulleys(np.full(8, 0.06), np.tile([0.0, 0.0, 1.0], (8, 1)))
    )
    (folder / "robot.yaml").write_text(describe_cable(robot))
    _, w, load = truth(folder, "held.csv")
    t = np.array([p["tension"] for p in rows_of(run(folder, "--json", poses="held.csv").document["poses"])])
    np.testing.assert_allclose((w @ t[..., None])[..., 0], -load, atol=1e-8)
    plain = structure_of(box(), read_platform_poses(folder / "held.csv", box()).values)
    assert np.abs((plain @ t[..., None])[..., 0] + load).max() > 0.1


def test_a_mass_for_the_files(folder):
    given = run(folder, "--json", poses="held.csv").document
    (folder / "robot.yaml").write_text(without("mass"))
    again = run(folder, "--json", "--mass", 9, "--payload", 3, poses="held.csv").document
    assert again["mass"]["value"] == 12
    for one, other in zip(rows_of(given["poses"]), rows_of(again["poses"]), strict=True):
        np.testing.assert_allclose(one["tension"], other["tension"], rtol=1e-12)


def test_cross_checks_of_ipanema_3(folder, shared_data):
    """The tensions that its file prints, to 0.1 N, through the verb; and to the digits printed, the first of them with
    9.81 m/s2: a little more mass."""
    place = shared_data / "cable-robots" / "ipanema_3.yaml"
    if not place.is_file():
        pytest.skip(f"needs {place.name}")
    (folder / "one.csv").write_text(POSES.splitlines()[0] + "\nhere,0,0,1000,0,0,0\n")
    printed = {
        "closed": [1433.1, 1514.7, 1532.3, 1533.7, 1447.6, 1561.3, 1673.4, 1637.7],
        "norm": [360.8, 381.4, 377.2, 380.5, 100.0, 100.0, 118.2, 108.6],
    }
    for (method, said), mass in zip(printed.items(), (30 * 9.81 / 9.80665, 30.0), strict=True):
        for more, within in (((), 0.1), (("--mass", mass), 0.0501)):
            ran = robocal("cable", "tension", place, folder / "one.csv", "--method", method, *more, "--json")
            assert ran.status == 0
            np.testing.assert_allclose(rows_of(ran.document["poses"])[0]["tension"], said, atol=within)


def test_a_power_without_its_method_is_refused(folder):
    ran = run(folder, "--power", 6, poses="held.csv")
    assert ran.status == 2 and "--power" in ran.err and "p-norm" in ran.err
    for more in ((), ("--power", 6)):
        assert run(folder, "--method", "p-norm", *more, poses="held.csv").status == 0


def planar(plane, degrees):
    """Four cables (three for 2T) in a frame of 4 x 3 m; `across` is the axis that is left out."""
    across = 2 if plane == "xy" else 1
    corners = np.array([[-2, -1.5], [2, -1.5], [2, 1.5], [-2, 1.5]], float)[: 4 if degrees == "1R2T" else 3]
    attach = corners * [0.05, 0.1]
    if degrees == "1R2T":
        attach[:, 1] *= -1  # crossed, so that it resists turning
    a, b = np.insert(corners, across, 0.0, axis=1), np.insert(attach, across, 0.0, axis=1)
    limits = np.tile([5.0, 300.0], (len(a), 1))
    return cable_robot("flat", a, b, degrees=degrees, plane=plane, limits=limits, mass=4.0)


@pytest.mark.parametrize("plane", ["xz", "xy"])
@pytest.mark.parametrize("degrees", ["2T", "1R2T"])
def test_planar_robots(folder, plane, degrees):
    """Equilibrium written out by hand; gravity works in xz and not in xy, where the mass need not be known."""
    robot = planar(plane, degrees)
    if plane == "xy":
        robot = replace(robot, mass=None)
    (folder / "robot.yaml").write_text(describe_cable(robot))
    u, v = (0, 1) if plane == "xy" else (0, 2)
    at = np.array([[0.3, -0.2], [0.6, -0.6]])
    angle = 0.1 if degrees == "1R2T" else 0.0
    head, rows = POSES.splitlines()[0], []
    for i, (p, q) in enumerate(at):
        six = np.zeros(6)
        six[u], six[v], six[3 + (2 if plane == "xy" else 1)] = 1e3 * p, 1e3 * q, np.degrees(angle)
        rows.append(",".join([f"p{i}", *map(str, six)]))
    (folder / "flat.csv").write_text("\n".join([head, *rows]))
    ran = run(folder, "--json", poses="flat.csv")
    assert ran.status == 0 and "warning" not in ran.err, ran.err
    # A positive turn about y carries z to x, one about z carries x to y.
    c, s = np.cos(angle), np.sin(angle) * (1 if plane == "xy" else -1)
    turn = np.array([[c, -s], [s, c]])
    for (p, q), found in zip(at, rows_of(ran.document["poses"]), strict=True):
        t = np.array(found["tension"])
        lever = robot.b[:, [u, v]] @ turn.T
        d = robot.a[:, [u, v]] - [p, q] - lever
        force = t[:, None] * d / np.linalg.norm(d, axis=1, keepdims=True)
        weight = [0.0, 0.0 if plane == "xy" else -4.0 * 9.80665]
        np.testing.assert_allclose(force.sum(axis=0) + weight, 0, atol=1e-8)
        moment = (lever[:, 0] * force[:, 1] - lever[:, 1] * force[:, 0]).sum()
        assert (abs(moment) < 1e-8) == (degrees == "1R2T")
        assert t.min() >= 5 - 1e-9 and t.max() <= 300 + 1e-9
    axes = ["fx", "fy" if plane == "xy" else "fz", *([] if degrees == "2T" else ["mz" if plane == "xy" else "my"])]
    assert [k for k in units_of(ran.document["poses"]) if k.startswith("wrench.")] == [f"wrench.{a}" for a in axes]


def test_a_planar_robot_out_of_its_plane_is_remarked_on(folder):
    (folder / "robot.yaml").write_text(describe_cable(planar("xz", "2T")))
    (folder / "flat.csv").write_text(POSES.splitlines()[0] + "\nhere,0,0,-300,0,0,0\nthere,0,400,-300,0,0,0\n")
    ran = run(folder, poses="flat.csv")
    assert ran.status == 0 and "there: cable c" in ran.err and "leaves the plane xz" in ran.err
    assert "there: a platform with 2T cannot be there: it is 400 mm away from here in y" in ran.err
    for verb in ("inverse", "contact"):
        assert "400 mm away from here in y" in robocal("cable", verb, folder / "robot.yaml", folder / "flat.csv").said
    (folder / "flat.csv").write_text(POSES.splitlines()[0] + "\nhere,0,0,-300,0,0,0\nthere,0,0,-300,0,0,20\n")
    assert "20 deg away from here in rz" in robocal("cable", "inverse", folder / "robot.yaml", folder / "flat.csv").said


def test_what_is_not_balanced_of_a_wrench_is_said(folder):
    (folder / "robot.yaml").write_text(describe_cable(planar("xz", "2T")))
    (folder / "flat.csv").write_text(POSES.splitlines()[0] + "\nhere,0,0,-300,0,0,0\n")
    said = "left out of the wrench: fy, my; a platform with 2T does not balance them"
    for verb, *rest in (("tension", folder / "flat.csv"), ("workspace", "--cells", 5, "--rays", 50)):
        found = robocal("cable", verb, folder / "robot.yaml", *rest, "--wrench", "1,5,0,0,1,0", "--json")
        assert said in found.err, found.err
        assert "left out" not in robocal("cable", verb, folder / "robot.yaml", *rest, "--wrench", "1,0,0,0,0,0").said


def test_barycentre_is_continuous_along_a_path(folder):
    """Halving the step halves the largest jump; `mid` and `norm` only have kinks, `barycentre` neither jumps."""
    jumps = []
    for count in (101, 201):
        rows = [
            f"p{i},{-1000 + 2000 * s:.9g},{600 * np.sin(3 * s):.9g},{800 + 1200 * s:.9g},0,{10 * s:.9g},0"
            for i, s in enumerate(np.linspace(0, 1, count))
        ]
        (folder / "path.csv").write_text("\n".join([POSES.splitlines()[0], *rows]))
        ran = run(folder, "--method", "barycentre", "--json", poses="path.csv")
        assert ran.status == 0, ran.err
        t = np.array([p["tension"] for p in rows_of(ran.document["poses"])])
        jumps.append(np.abs(np.diff(t, axis=0)).max())
    assert jumps[0] < 20 and 0.4 < jumps[1] / jumps[0] < 0.65


def without(key):
    lines = describe_cable(box()) + PLATFORM + CABLES
    return {"mass": lines.replace("mass: 12, ", ""), "tension": lines.replace("tension: [10, 400], ", "")}[key]


@pytest.mark.parametrize(
    ("robot", "poses", "more", "words"),
    [
        (without("mass"), "", (), ["robot.yaml", "platform.mass", "mass of box is not known"]),
        (without("tension"), "", (), ["robot.yaml", "every_cable.tension", "limits of box are not known", "--limits"]),
        ("", "", ("--limits", "50,20"), ["--limits", "crossed"]),
        ("", "", ("--limits", "50"), ["--limits", "LEAST,GREATEST"]),
        ("", "", ("--limits", "-5,20"), ["--limits", "negative"]),
        ("", "", ("--wrench", "1,2,3"), ["--wrench", "FX,FY,FZ,MX,MY,MZ"]),
        ("", "", ("--wrench", "1,2,3,0,0,nan"), ["--wrench"]),
        ("", "", ("--method", "barycenter"), ["--method", "did you mean 'barycentre'"]),
        ("", "", ("--method", "p-norm", "--power", "1"), ["--power", "at least 2"]),
        ("", "", ("--payload", "-1"), ["--payload"]),
        (without("mass"), "", ("--mass", "nan"), ["--mass", "0 or more"]),
        ("", "", ("--length", "0"), ["--length", "above 0"]),
        ("", POSES.replace("1600", "16OO"), (), ["poses.csv", "row 3", "column z"]),
        ("", POSES.replace("z [mm]", "z"), (), ["poses.csv", "column z", "unit is missing"]),
        ("", POSES.replace("rx [deg]", "rx [deg],fx [kg]").replace(",0,0,0", ",0,0,0,0").replace(",5,3", ",5,1,3"), (),
         ["poses.csv", "column fx", "a force is needed"]),
    ],
)  # fmt: skip
def test_bad_input_is_refused(folder, robot, poses, more, words):
    if robot:
        (folder / "robot.yaml").write_text(robot)
    if poses:
        (folder / "poses.csv").write_text(poses)
    before = files(folder)
    run(folder, "-o", folder / "out", *more).assert_refused(*words)
    assert files(folder) == before and not (folder / "out").exists()


def test_a_pose_on_an_anchor_is_named(folder):
    at = ",".join(f"{v:.9g}" for v in (box().a[2] - box().b[2]) * 1000)
    (folder / "poses.csv").write_text(POSES + f"touching,{at},0,0,0\n")
    run(folder).assert_refused("poses.csv", "row 5", "key c3", "touching")


def test_too_few_cables(folder):
    rig = box()
    few = cable_robot("few", rig.a[:5], rig.b[:5], mass=5.0, limits=np.tile([1.0, 90.0], (5, 1)))
    (folder / "robot.yaml").write_text(describe_cable(few))
    run(folder).assert_refused("robot.yaml", "cables", "5 cables for 6 degrees of freedom")


def test_barycentre_of_three_redundant_cables_is_refused(folder):
    rig = box()
    a = np.vstack([rig.a, [[0.0, 2.0, 3.0]]])
    b = np.vstack([rig.b, [[0.0, 0.1, 0.2]]])
    nine = cable_robot("nine", a, b, mass=5.0, limits=np.tile([5.0, 300.0], (9, 1)))
    (folder / "robot.yaml").write_text(describe_cable(nine))
    run(folder, "--method", "barycentre").assert_refused("--method", "at most two redundant", "p-norm")
    assert run(folder, "--method", "p-norm", poses="held.csv").status == 0


def test_nothing_is_overwritten(folder):
    out = folder / "out"
    out.mkdir()
    (out / "tension.json").write_text("mine")
    run(folder, "-o", out).assert_refused("tension.json", "--force")
    assert files(out) == {"tension.json"} and (out / "tension.json").read_text() == "mine"
    assert run(folder, "-o", out, "--force").status == 3 and len(files(out)) == 3
