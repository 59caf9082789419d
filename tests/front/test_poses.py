"""Full poses in every form are one measurement; robots from mappings, tables and arrays are those of the same file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import robocal as rc
from robocal.errors import FileError
from robocal.files.dataset import read_datasets
from robocal.geometry import so3

EXAMPLES = Path(__file__).parents[2] / "examples"
RNG = np.random.default_rng(3)
Q = RNG.uniform(-1, 1, (12, 6))
W = RNG.normal(0, 1, (12, 3))
P = RNG.uniform(-1, 1, (12, 3))
HALF = np.linalg.norm(W, axis=1, keepdims=True) / 2
XYZW = np.column_stack([np.sin(HALF) * W / (2 * HALF), np.cos(HALF)])


class Rotation:
    """What scipy's Rotation offers."""

    def as_matrix(self) -> np.ndarray:
        return so3.exp(W)


def pose() -> np.ndarray:
    out = np.tile(np.eye(4), (12, 1, 1))
    out[:, :3, :3], out[:, :3, 3] = so3.exp(W), P
    return out


def read(data: rc.Measurements) -> np.ndarray:
    """Positions and rotations as a file of the same text is read, (m, 12)."""
    obs = read_datasets(data.files, rc.robot("irb-120").model.chain).dataset.observations[0]
    assert obs.kind == "pose"
    return np.column_stack([obs.value[:, :3], so3.exp(obs.value[:, 3:6]).reshape(-1, 9)])


FORMS = {
    "pose": lambda: rc.measurements(Q, pose=pose()),
    "rotation": lambda: rc.measurements(Q, position=P, rotation=so3.exp(W)),
    "scipy": lambda: rc.measurements(Q, position=P, rotation=Rotation()),
    "xyzw": lambda: rc.measurements(Q, position=P, quaternion=XYZW, quaternion_order="xyzw"),
    "wxyz": lambda: rc.measurements(Q, position=P, quaternion=-XYZW[:, [3, 0, 1, 2]], quaternion_order="wxyz"),
    "rotation_vector": lambda: rc.measurements(Q, position=P, rotation_vector=W),
    "degrees and mm": lambda: rc.measurements(
        np.degrees(Q), position=P * 1e3, rotation_vector=np.degrees(W), units=("deg", "mm", "deg")
    ),
    "lists": lambda: rc.measurements(Q.tolist(), pose=pose().tolist(), turn_sigma=1e-3, sigma=[1e-4, 1e-4, 2e-4]),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_the_same_pose(form: str) -> None:
    assert np.allclose(read(FORMS[form]()), np.column_stack([P, so3.exp(W).reshape(-1, 9)]), atol=1e-12)


def test_a_table_of_parameters_is_the_same_robot_as_its_file() -> None:
    table = np.array([[0.1, 0.3, 0.2, -1.5], [-0.2, 0.0, 0.25, 0.1], [0.0, 0.05, 0.0, 1.5]])
    rows = [dict(zip(("theta", "d", "a", "alpha"), map(float, row), strict=True)) for row in table]
    kept = {"units": {"length": "m", "angle": "rad"}, "convention": "dh", "joints": rows, "name": "three"}
    at = RNG.uniform(-1, 1, (5, 3))
    wanted = rc.robot(kept).pose(at)
    for same in (
        rc.robot(table, convention="dh", columns=("theta", "d", "a", "alpha")),
        rc.robot(table[:, [2, 3, 1, 0]].tolist(), convention="dh", columns=("a", "alpha", "d", "theta")),
        rc.robot({"theta": table[:, 0], "d": table[:, 1], "a": table[:, 2], "alpha": table[:, 3]}, convention="dh"),
        rc.robot(
            table * [180 / np.pi, 1e3, 1e3, 180 / np.pi],
            convention="dh",
            columns=("theta", "d", "a", "alpha"),
            units=("deg", "mm"),
        ),
    ):
        assert np.allclose(same.pose(at), wanted, atol=1e-12)
    slide = rc.robot(table, convention="dh", columns=("theta", "d", "a", "alpha"), types="RPR", name="slider")
    assert slide.model.chain.joints[1].type == "prismatic" and "slider" in repr(slide)
    assert Path(rc.robot(kept).opened) == Path(rc.robot(kept).opened)


def test_a_robot_from_arrays_goes_wherever_a_file_does(tmp_path: Path) -> None:
    arm = rc.robot(
        [[0, 0.3, 0, 1.57], [0, 0, 0.4, 0], [0, 0, 0.3, 0]],
        convention="dh-hayati",
        columns=("theta", "d", "a", "alpha"),
    )
    assert rc.check(arm).trusted and "convention" in rc.export(arm, form="yaml").text
    rc.simulate(arm, output=tmp_path / "sim", poses=20)
    assert (tmp_path / "sim" / "data.yaml").exists()


def test_a_cable_robot_from_arrays_is_that_of_its_file() -> None:
    file = rc.cable.robot(EXAMPLES / "cable-calibration" / "eight" / "robot.yaml")
    known = file.model.robot
    made = rc.cable.robot(
        frame_anchors=known.a,
        platform_anchors=known.b,
        zeros=known.zeros,
        every_cable={"tension": np.array([10, 500])},
        platform={"mass": 25},
    )
    home = known.home
    assert np.allclose(made.inverse(home), file.inverse(home), atol=1e-12)
    assert made.tension(home).tension.shape == (1, 8)
    assert set(made.model.robot.table.free) == {f"c{i}.{s}" for i in range(1, 9) for s in ("ax", "ay", "az", "l0")}
    again = rc.cable.robot(
        {"name": "eight", "units": {"length": "m"}, "frame_anchors": known.a, "platform_anchors": known.b}
    )
    assert np.allclose(again.inverse(home), file.inverse(home) + known.zeros, atol=1e-12)
    lengths = rc.measurements(lengths=file.inverse(home), cables=file.cables)
    assert rc.cable.forward(made, lengths).result.solution.converged.all()


def test_lengths_and_poses_are_two_tables_of_the_same_rows(tmp_path: Path) -> None:
    data = rc.measurements(
        lengths=np.ones((12, 4)), pose=pose(), length_sigma=[1, 2, 3, 4], columns={"group": ["a", "b"] * 6}
    )
    heads = [text.splitlines()[0] for text in (data.lengths, data.text)]
    assert heads[0].split(",") == ["id", *(f"c{i} [m]" for i in range(1, 5)), *(f"s_c{i} [m]" for i in range(1, 5))]
    assert heads[1] == "id,x [m],y [m],z [m],rx [rad],ry [rad],rz [rad],group" and "12 rows" in repr(data)
    assert data.moved == ("c1", "c2", "c3", "c4")
    data.save(tmp_path / "poses.csv")
    assert (tmp_path / "poses-lengths.csv").read_text() == data.lengths
    with pytest.raises(FileError):
        data.save(tmp_path / "poses.csv")


def test_a_study_from_a_mapping() -> None:
    robot = rc.cable.robot(EXAMPLES / "cable-laval" / "robot.yaml")
    study = {
        "of": "cable-calibration", "robot": robot, "trials": 10, "poses": {"count": 20, "shift": "0.3 m", "turn": "5 deg"},
        "noise": {"length": "1 mm", "position": "1 mm", "orientation": "0.1 deg"}, "sweep": {"noise.length": ["1 mm", "2 mm"]},
    }  # fmt: skip
    first, second = rc.study(study, workers=1), rc.study(study, workers=1)
    assert first.written[0] != second.written[0] and first.written[0].exists()
    assert first.summary().splitlines()[:9] == second.summary().splitlines()[:9] and first.plots
