"""Poses from points that were measured on a body: their covariance holds the truth, and points that tell no pose are named."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cli.runs import robocal

from robocal.errors import ModelError
from robocal.geometry import se3, so3
from robocal.geometry.point_poses import body_of, point_poses

PLACES = np.array([[0.1, 0, 0], [0, 0.12, 0.01], [-0.09, -0.05, 0.02]])
SIGMA = np.array([2e-4, 1e-4, 3e-4])
DRAWS = 500


def bodies(rng: np.random.Generator, count: int, turn: float = 1.0) -> np.ndarray:
    return se3.compose(so3.exp(rng.normal(0, turn, (count, 3))), rng.normal(0, 1, (count, 3)))


def points(poses: np.ndarray, places: np.ndarray = PLACES) -> np.ndarray:
    return places @ poses[:, :3, :3].swapaxes(1, 2) + poses[:, None, :3, 3]


def errors(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    return np.hstack(se3.displacement(found, true))


@pytest.mark.parametrize("more", [0, 2])
def test_intervals_hold_the_truth(more):
    rng = np.random.default_rng(7)
    places = np.vstack([PLACES, rng.normal(0, 0.1, (more, 3))])
    true = bodies(rng, DRAWS)
    found = point_poses(places, points(true, places) + SIGMA * rng.normal(size=(DRAWS, len(places), 3)), SIGMA)
    e, sd = errors(found.poses, true), np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
    held = (np.abs(e) < 1.96 * sd).mean()
    print(f"95 % intervals hold {100 * held:.1f} % of {6 * DRAWS} numbers; asked: 93 to 97")
    assert 0.93 < held < 0.97
    whole = np.einsum("ki,kij,kj->k", e, np.linalg.inv(found.covariance), e).mean() / 6
    assert 0.9 < whole < 1.1
    assert 0.9 < np.mean(found.chi2 / found.freedom) < 1.1


def test_without_noise_the_pose_is_exact():
    rng = np.random.default_rng(1)
    true = bodies(rng, 20)
    found = point_poses(PLACES, points(true), SIGMA)
    assert np.abs(errors(found.poses, true)).max() < 1e-13


def test_a_point_that_is_missing_weighs_nothing_and_two_tell_no_pose():
    rng = np.random.default_rng(2)
    places = np.vstack([PLACES, [[0.0, 0.0, 0.1]]])
    true = bodies(rng, 3)
    seen = points(true, places)
    seen[1, 2] = np.nan
    seen[2, 1:3] = np.nan
    found = point_poses(places, seen, SIGMA)
    assert found.known.tolist() == [True, True, False] and found.points.tolist() == [4, 3, 2]
    assert np.abs(errors(found.poses[:2], true[:2])).max() < 1e-13 and np.isnan(found.poses[2]).all()
    alone = point_poses(places[[0, 1, 3]], seen[1:2, [0, 1, 3]], SIGMA)
    assert np.allclose(found.covariance[1], alone.covariance[0], rtol=1e-9)


@pytest.mark.parametrize("beside", [0.0, 1e-5])
def test_points_on_a_line_tell_no_pose(beside):
    line = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.3, beside, 0]])
    found = point_poses(line, points(bodies(np.random.default_rng(3), 4), line), SIGMA)
    assert not found.known.any() and np.isnan(found.covariance).all()


def test_the_body_is_found_from_its_points():
    rng = np.random.default_rng(4)
    true = bodies(rng, 40)
    seen = points(true)
    seen[0, 1] = np.nan  # the first whole view is the second
    found = body_of(seen)
    assert np.abs(found - (PLACES - PLACES.mean(axis=0)) @ true[1, :3, :3].T).max() < 1e-12
    with pytest.raises(ModelError):
        body_of(seen[:1])


def write(folder, seen, *, places=PLACES, sigma=", sigma: 0.1", said=True, names="ABC", robot=None) -> None:
    """points.yaml with points.csv, and robot.csv."""
    rows = [
        f"p{i},{n}," + ",".join(f"{1e3 * v:.5f}" for v in seen[i, j])
        for i in range(len(seen))
        for j, n in enumerate(names)
        if np.isfinite(seen[i, j, 0])
    ]
    (folder / "points.csv").write_text("\n".join(["id,target,x [mm],y [mm],z [mm]", *rows]) + "\n")
    targets = ", ".join(
        f"{n}: {{{f'xyz: {(1e3 * p).round(6).tolist()}, free: false' if said else ''}}}"
        for n, p in zip("ABC", places, strict=True)
    )
    (folder / "points.yaml").write_text(
        f"robocal: 1\nkind: position\nfile: points.csv\nposition: {{columns: [x, y, z]{sigma}}}\ntarget: {{column: target}}\n"
        f"configuration: {{id: id}}\nunits: {{length: mm, angle: deg}}\ntargets: {{{targets}}}\n"
    )
    if robot is not None:
        v = se3.to_vector(robot)
        lines = [f"p{i}," + ",".join(f"{x:.9g}" for x in (*(1e3 * r[:3]), *np.degrees(r[3:]))) for i, r in enumerate(v)]
        (folder / "robot.csv").write_text(
            "\n".join(["id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]", *lines]) + "\n"
        )


@pytest.fixture
def rig(tmp_path):
    """Twelve poses, the points a tracker saw of them, and a robot that errs by 1 mm."""
    rng = np.random.default_rng(11)
    true = bodies(rng, 12, 0.3)
    seen = points(true) + 1e-4 * rng.normal(size=(12, 3, 3))
    robot = true.copy()
    robot[:, :3, 3] += 1e-3 * rng.normal(size=(12, 3))
    return tmp_path, true, seen, robot


def verified(folder):
    ran = robocal("verify", folder / "points.yaml", folder / "robot.csv", "--json")
    return ran, json.loads(ran.out) if ran.out else None


def codes(document) -> set[str]:
    return {r["code"] for r in document["remarks"]}


def test_rows_of_reflectors_are_verified_as_poses_are(rig):
    folder, true, seen, robot = rig
    write(folder, seen, robot=robot)
    ran, found = verified(folder)
    assert ran.status == 0 and len(found["poses"]) == 12 and codes(found) == {"poses-from-points"}
    poses = point_poses(PLACES, np.round(seen, 8), 1e-4).poses
    expected = np.linalg.norm(poses[:, :3, 3] - robot[:, :3, 3], axis=1).mean()
    assert found["sources"]["robot"]["as measured"]["position"]["mean"] == pytest.approx(1e3 * expected, rel=1e-6)


# obeys: points-too-few
# obeys: points-apart
def test_what_tells_no_pose_is_named_and_left_out_until_it_is_measured_again(rig):
    folder, true, seen, robot = rig
    spoilt = seen.copy()
    spoilt[3, 1] += 3e-3
    spoilt[5, 2] = np.nan
    write(folder, spoilt, robot=robot)
    ran, found = verified(folder)
    assert ran.status == 0 and len(found["poses"]) == 10
    said = {r["code"]: r["sentence"] for r in found["remarks"]}
    assert "p5" in said["points-too-few"] and "B of p3" in said["points-apart"]
    write(folder, spoilt, sigma="", robot=robot)  # the same where nobody states sigma
    assert codes(verified(folder)[1]) >= {"points-too-few", "points-apart"}
    write(folder, seen, robot=robot)
    assert not codes(verified(folder)[1]) & {"points-too-few", "points-apart"}


# obeys: points-without-places
def test_a_body_that_nobody_described_is_compared_by_its_middle(rig):
    folder, true, seen, robot = rig
    write(folder, seen, said=False, robot=robot)
    ran, found = verified(folder)
    assert "points-without-places" in codes(found)
    assert found["sources"]["robot"]["aligned, another point"]["position"]["mean"] < 2.0
    write(folder, seen, robot=robot)
    assert "points-without-places" not in codes(verified(folder)[1])


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (lambda seen: seen[:, [1, 0, 2]], "targets."),  # exchanged where distances differ
        (lambda seen: 1e-3 * seen, "as measured"),  # another unit
        (lambda seen: np.where(np.arange(3)[None, :, None] < 2, seen, np.nan), "too few points"),
    ],
)
def test_points_that_cannot_be_of_this_body_are_refused(rig, spoil, word):
    folder, true, seen, robot = rig
    places = PLACES * [[1, 1, 1], [1, 3, 1], [1, 1, 1]]
    write(folder, spoil(points(true, places)), places=places, robot=robot)
    ran, _ = verified(folder)
    assert ran.status == 2 and word in ran.err and "points.yaml" in ran.err


def test_a_point_that_is_there_twice_is_refused(rig):
    folder, true, seen, robot = rig
    write(folder, seen, robot=robot)
    with (folder / "points.csv").open("a") as file:
        file.write("p3,B,1,2,3\n")
    ran, _ = verified(folder)
    assert ran.status == 2 and "B twice" in ran.err


def test_one_target_is_no_pose(rig):
    folder, true, seen, robot = rig
    write(folder, seen, robot=robot)
    text = (folder / "points.yaml").read_text()
    one = text[: text.index("targets:")].replace("target: {column: target}\n", "")
    (folder / "points.yaml").write_text(one)
    ran, _ = verified(folder)
    assert ran.status == 2 and "three targets" in ran.err
