"""A board that was knocked after half of few poses, in hand-eye calibration alone: named however few the rows are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from worlds import Arm, frame

import robocal as rc

CAMERA = frame(Rotation.from_rotvec([0.02, -0.03, 1.4]).as_matrix(), np.array([0.03, 0.05, 0.04]))
BOARD = frame(Rotation.from_rotvec([3.0, 0.1, 0.2]).as_matrix(), np.array([0.45, 0.1, 0.02]))


def files(folder, count, knock, seed):
    """Poses of a board in a camera on the flange of a perfect arm; after half of them the board stands elsewhere (m)."""
    rng, arm = np.random.default_rng(seed), Arm.nominal("six")
    q = np.radians([10, 20, 10, 5, 50, 0.0] + rng.uniform(-25, 25, (count, 6)))
    board = np.tile(BOARD, (count, 1, 1))
    board[count // 2 :, :3, 3] += knock
    noise = frame(
        Rotation.from_rotvec(4e-4 * rng.normal(size=(count, 3))).as_matrix(), 1.5e-4 * rng.normal(size=(count, 3))
    )
    seen = np.linalg.inv(arm.flange(q) @ CAMERA) @ board @ noise
    arm.write(folder, q, seen[:, :3, 3], 1.5e-4)
    v = np.column_stack(
        [np.degrees(q), seen[:, :3, 3] * 1e3, np.degrees(Rotation.from_matrix(seen[:, :3, :3]).as_rotvec())]
    )
    head = ",".join(
        [*(f"j{i + 1} [deg]" for i in range(6)), "x [mm]", "y [mm]", "z [mm]", "rx [deg]", "ry [deg]", "rz [deg]"]
    )
    (folder / "data.csv").write_text("\n".join([head, *(",".join(f"{x:.8f}" for x in r) for r in v)]) + "\n")
    (folder / "data.yaml").write_text(
        "robocal: 1\nkind: pose\nfile: data.csv\nunits: {length: mm, angle: deg}\n"
        "joints: {columns: [j1, j2, j3, j4, j5, j6]}\nposition: {columns: [x, y, z], sigma: 0.15}\n"
        "orientation: {columns: [rx, ry, rz], form: rotation_vector, sigma: 0.023, unit: deg}\n"
        "frame: {name: camera, mount: tool}\ntargets: {board: {mount: base, free: true}}\n"
    )
    robot = (folder / "robot.yaml").read_text()
    (folder / "robot.yaml").write_text(robot.replace("xyz: [30, -20, 110]", "xyz: [0, 0, 0]"))
    return folder / "robot.yaml", [folder / "data.yaml"]


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("count", "knock"), [(16, 0.002), (24, 0.008), (40, 0.004)])
def test_a_board_that_was_knocked_is_named_with_its_rows(tmp_path, count, knock):
    robot, data = files(tmp_path, count, np.array([knock, 0, 0]), count)
    verdict = rc.identify(robot, data, free="camera,board").result.verdict
    assert verdict.status == "refused"
    (told,) = (r for r in verdict.remarks if r.code == "segment")
    assert told.numbers["first"] == count // 2 + 2 and told.numbers["shift"]["value"] == pytest.approx(
        knock * 1e3, rel=0.2
    )


@pytest.mark.parametrize("count", [12, 24])
def test_a_board_that_stood_still_is_located(tmp_path, count):
    robot, data = files(tmp_path, count, np.zeros(3), 60 + count)
    assert rc.identify(robot, data, free="camera,board").result.verdict.status == "located"
