"""`vision hand-eye` on cells that the tests know: both mounts, every maker, coverage, and what other programs read."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal
from hand_eye_stream import stream
from hand_eye_world import FORMS, IMAGE, codes, corners, hand_eye, lens_file, named, off_by, poses, world
from lens_world import LENS, SQUARE, marker_rows, see, write
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

from robocal.files.lens import read_lens


@pytest.mark.parametrize("inhand", [True, False])
def test_camera_and_board_are_found_in_mm(tmp_path, inhand):
    made = world(inhand=inhand)
    words = (
        corners(tmp_path, made),
        poses(tmp_path, made.told, names=named(made)),
        "--lens",
        lens_file(tmp_path),
        "--image",
        IMAGE,
    )
    told, status = hand_eye(*words, "--camera", "hand" if inhand else "fixed", "-o", tmp_path / "cell")
    assert status == 0 and told["verdict"]["status"] == "located", told["verdict"]
    assert [f["child"] for f in told["frames"]] == ["camera", "board"]
    assert [f["parent"] for f in told["frames"]] == (["flange", "base"] if inhand else ["base", "flange"])
    assert np.abs(off_by(told, made)).max() < 4
    assert 0.2 < told["error"]["rms"] < 1.5 < told["normal"] * 1.5
    assert len(told["further"]["columns"][0]["values"]) == 3
    assert "paired-in-order" not in codes(told)
    camera = made.camera
    ros = YAML(typ="safe").load((tmp_path / "cell" / "hand_eye.yaml").read_text())
    assert ros["parameters"]["calibration_type"] == ("eye_in_hand" if inhand else "eye_on_base")
    place, turn = ros["transform"]["translation"], ros["transform"]["rotation"]
    assert np.allclose([place[a] for a in "xyz"], camera[:3, 3], atol=4e-3)
    near = Rotation.from_quat([turn[a] for a in "xyzw"]) * Rotation.from_matrix(camera[:3, :3]).inv()
    assert near.magnitude() < 0.01
    origin = ElementTree.fromstring((tmp_path / "cell" / "hand_eye.urdf").read_text()).find("joint/origin")
    rpy = Rotation.from_euler("xyz", [float(v) for v in origin.get("rpy").split()])
    assert np.allclose([float(v) for v in origin.get("xyz").split()], [place[a] for a in "xyz"])
    assert (rpy * Rotation.from_quat([turn[a] for a in "xyzw"]).inv()).magnitude() < 1e-9
    said = (tmp_path / "cell" / "static_transform.sh").read_text().splitlines()[-1].split()
    numbers = {k: float(said[said.index(f"--{k}") + 1]) for k in ("x", "y", "z", "qx", "qy", "qz", "qw")}
    assert numbers == pytest.approx({**{a: place[a] for a in "xyz"}, **{f"q{a}": turn[a] for a in "xyzw"}})
    page = (tmp_path / "cell" / "hand_eye.html").read_text()
    assert (
        page.index("error at the target") < page.index("Three poses to add") < page.index("Which view has which pose")
    )
    assert json.loads((tmp_path / "cell" / "hand_eye.json").read_text())["error"] == told["error"]


@pytest.mark.parametrize("form", list(FORMS))
def test_poses_as_makers_write_them(tmp_path, form):
    """Headers without units: those of the maker; lengths of UR in m."""
    made = world(count=8)
    length = 1.0 if form in ("ur", "quaternion") else 1e3
    place = poses(tmp_path, made.told, form, named(made), units=False, length=length)
    maker = () if form == "quaternion" else ("--maker", form)
    told, _ = hand_eye(corners(tmp_path, made), place, "--lens", lens_file(tmp_path), "--image", IMAGE, *maker)
    assert np.linalg.norm(np.array(told["frames"][0]["xyz"]) - 1e3 * made.camera[:3, 3]) < 6
    assert told["error"]["rms"] < 3


def test_measured_poses_of_a_target(tmp_path):
    made = world(3, count=20)
    rng = np.random.default_rng(1)
    seen = np.array(made.seen)
    seen[:, :3, 3] += 2e-4 * rng.normal(size=(20, 3))
    target, robot = (
        poses(tmp_path, seen, "ur", named(made), "target.csv"),
        poses(tmp_path, made.told, names=named(made)),
    )
    told, status = hand_eye(target, robot)
    assert status == 0, told["verdict"]
    assert np.abs(off_by(told, made)).max() < 4
    assert robocal("vision", "hand-eye", target, robot, "--lens", lens_file(tmp_path)).status == 2


@pytest.mark.slow
def test_the_truth_lies_within_what_sigma_says(tmp_path):
    """Of 24 cells: 1.96 sigma holds for 95 % of the numbers of both frames, robots that stand off by 0.5 mm and mrad at every pose."""
    inside = []
    for seed in range(24):
        made = world(100 + seed, count=18, inhand=bool(seed % 2), error=0.5)
        mount = "hand" if made.inhand else "fixed"
        words = (corners(tmp_path, made, seed=seed), poses(tmp_path, made.told, names=named(made)))
        told, _ = hand_eye(*words, "--lens", lens_file(tmp_path), "--image", IMAGE, "--camera", mount)
        inside.append(np.abs(off_by(told, made)) < 1.96)
    assert 0.88 < np.mean(inside) < 0.995


def test_a_lens_that_is_found_beside_the_camera(tmp_path):
    made = world(5, count=20)
    wrong = lens_file(
        tmp_path, {"fx": 1056.0, "fy": 1050.0, "cx": 640.0, "cy": 478.0, "k1": -0.2, "k2": 0, "p1": 0, "p2": 0, "k3": 0}
    )
    words = (corners(tmp_path, made), poses(tmp_path, made.told, names=named(made)), "--lens", wrong, "--image", IMAGE)
    told, status = hand_eye(*words, "--free-lens", "-o", tmp_path / "cell")
    assert status == 0, told["verdict"]
    assert "lens-contradicted" in codes(told)
    found = read_lens(tmp_path / "cell" / "lens.yaml").lens
    assert abs(found.numbers[0] - 1050) < 3 * found.sigma["fx"] < 20
    assert np.abs(off_by(told, made)).max() < 4


@pytest.mark.parametrize("words", [("--free-lens",), ("--lens", "lens.yaml")])
def test_poses_of_a_target_have_no_lens(tmp_path, words):
    """An option that would change nothing is refused, and its value is told as it was typed."""
    made = world()
    target = poses(tmp_path, made.seen, name="target.csv")
    ran = robocal("vision", "hand-eye", target, poses(tmp_path, made.told), *words)
    assert ran.status == 2 and "measured poses need no lens" in ran.err and words[0] in ran.err
    assert "Posix" not in ran.err and "True" not in ran.err


@pytest.mark.parametrize("inhand", [True, False])
def test_clocks_that_are_far_apart(tmp_path, inhand):
    """Seconds are no likeness of near delays by chance: the clear one is found, and told where nobody asked for it."""
    made, words = stream(tmp_path, delay=1.5, inhand=inhand)
    told, status = hand_eye(*words, "--free-delay")
    assert status == 0 and np.abs(off_by(told, made)).max() < 4
    told, status = hand_eye(*words)
    (said,) = [r for r in (*told["remarks"], *told["verdict"]["remarks"]) if r["code"] == "clocks-apart"]
    assert status == 3 and said["numbers"]["delay"]["value"] == pytest.approx(1.5, abs=0.03)


def test_a_right_lens_is_not_contradicted_by_the_arms_errors(tmp_path):
    """They move all corners of a view alike: corners one by one would be 12 sigma sure of a wrong focal length."""
    made = world(seed=4)
    words = (corners(tmp_path, made), poses(tmp_path, made.told), "--lens", lens_file(tmp_path), "--image", IMAGE)
    told, _ = hand_eye(*words, "--free-lens")
    assert "lens-contradicted" not in codes(told)


def test_a_lens_that_nobody_gives(tmp_path):
    """--free-lens alone begins with the lens that the views tell; views that are not tilted tell none."""
    made = world(5, count=20)
    words = (corners(tmp_path, made), poses(tmp_path, made.told, names=named(made)), "--image", IMAGE)
    told, status = hand_eye(*words, "--free-lens", "-o", tmp_path / "cell")
    assert status == 0, told["verdict"]
    found = read_lens(tmp_path / "cell" / "lens.yaml").lens
    assert abs(found.numbers[0] - 1050) < 4 * found.sigma["fx"] < 20
    assert np.abs(off_by(told, made)).max() < 4
    assert robocal("vision", "hand-eye", *words).status == 2
    flat = world(6, count=12, axis=(0, 0, 1))
    words = (corners(tmp_path, flat), poses(tmp_path, flat.told, names=named(flat)), "--image", IMAGE)
    ran = robocal("vision", "hand-eye", *words, "--free-lens")
    assert ran.status == 2 and "these views do not tell a lens" in ran.err, ran.err


def test_pairs_by_time(tmp_path):
    """Names of images are their times in ns; the robot's poses come every 0.1 s, and views without one nearby are left out."""
    made = world(6, count=10)
    times = 1700000000 + np.arange(10) * 2.0
    made_poses = Path(poses(tmp_path, made.told))
    lines = made_poses.read_text().splitlines()
    made_poses.write_text(
        "\n".join(["time [s]," + lines[0], *(f"{t + 0.1:.3f},{r}" for t, r in zip(times, lines[1:], strict=True))])
        + "\n"
    )
    views = Path(corners(tmp_path, made))
    text = views.read_text()
    for i, t in reversed(list(enumerate(times))):
        text = text.replace(f"v{i + 1},board", f"{int(t * 1e9)},board")
    views.write_text(text)
    told, status = hand_eye(views, made_poses, "--lens", lens_file(tmp_path), "--image", IMAGE, "--pair", "time")
    assert status == 0 and np.abs(off_by(told, made)).max() < 4
    ran = robocal(
        "vision",
        "hand-eye",
        str(views),
        str(made_poses),
        "--lens",
        lens_file(tmp_path),
        "--image",
        IMAGE,
        "--pair",
        "time",
    )
    assert "read in ns" in ran.out
    late = tmp_path / "late.csv"
    late.write_text(made_poses.read_text().replace("17000000", "17900000"))
    ran = robocal(
        "vision", "hand-eye", str(views), str(late), "--lens", lens_file(tmp_path), "--image", IMAGE, "--pair", "time"
    )
    assert ran.status == 2 and "different times" in ran.err


def test_markers_whose_places_are_unknown(tmp_path):
    """Two markers on the table, each with a place of its own: both are found."""
    made = world(7, count=14)
    edge = 0.02 * SQUARE
    points = np.concatenate([edge + [-0.05, 0.02, 0], edge + [0.05, -0.03, 0]])
    uv = np.array([see(points @ y[:3, :3].T + y[:3, 3], LENS) for y in made.seen])
    views = write(tmp_path / "markers.csv", marker_rows(uv, 0.1, np.random.default_rng(3), ("7", "9")))
    words = (
        views,
        poses(tmp_path, made.told, names=named(made)),
        "--lens",
        lens_file(tmp_path),
        "--image",
        IMAGE,
        "--size",
        "40",
    )
    told, status = hand_eye(*words)
    assert status == 0, told["verdict"]
    assert [f["child"] for f in told["frames"]] == ["camera", "7", "9"]
    apart = np.linalg.norm(np.array(told["frames"][1]["xyz"]) - told["frames"][2]["xyz"])
    assert apart == pytest.approx(1e3 * np.hypot(0.1, 0.05), abs=1.5)


def test_joints_of_a_known_robot(tmp_path):
    """The frames and their sigma are those of `identify --free camera,board`; the camera on the wrong side is told."""
    folder = Path(__file__).parents[2] / "examples" / "hand-eye"
    rows = [line.split(",") for line in (folder / "data.csv").read_text().splitlines()]
    head = ["image", *rows[0][:6]]
    text = "\n".join(",".join(r) for r in [head, *([f"{i + 1:02d}", *r[:6]] for i, r in enumerate(rows[1:]))])
    (tmp_path / "joints.csv").write_text(text + "\n")
    words = (folder / "marker.csv", tmp_path / "joints.csv", "--arm", folder / "robot.yaml")
    told, status = hand_eye(*words)
    ran = robocal("identify", str(folder / "robot.yaml"), str(folder / "data.yaml"), "--free", "camera,board", "--json")
    other = json.loads(ran.out)["frames"]
    assert status == 0 and told["frames"][0]["parent"] == "tool"
    for mine, theirs in zip(told["frames"], other, strict=True):
        place = theirs["pose"]["position"]
        # Identify was given the noise of the camera, which is estimated here.
        assert np.allclose(mine["xyz"], place["xyz"], atol=0.02)
        assert np.allclose(np.sqrt(np.diag(mine["covariance"]))[:3], place["sigma"], rtol=0.1)
    told, status = hand_eye(*words, "--camera", "fixed")
    assert status == 3
    assert {"--camera hand"} == {
        r["numbers"]["option"] for r in told["verdict"]["remarks"] if r["code"] == "poses-read-otherwise"
    }
    assert robocal("vision", "hand-eye", *map(str, words), "--maker", "ur").status == 2
