"""Poses of a robot as files have them: every form is the same rotation, and what is wrong is named with file, row and column."""

from __future__ import annotations

import numpy as np
import pytest
from hand_eye_world import FORMS, poses, rigid
from scipy.spatial.transform import Rotation

from robocal.errors import InputError
from robocal.files.robot_poses import read_robot_poses

RNG = np.random.default_rng(7)
TRUE = np.array([rigid(RNG.uniform(-1.5, 1.5, 3), RNG.uniform(-0.8, 0.8, 3)) for _ in range(9)])
NAMES = [f"{i}.png" for i in range(9)]


@pytest.mark.parametrize("form", list(FORMS))
@pytest.mark.parametrize("units", [True, False])
def test_every_form_is_the_same_pose(tmp_path, form, units):
    length = 1.0 if form in ("ur", "quaternion") and not units else 1e3
    place = poses(tmp_path, TRUE, form, NAMES, units=units, length=length)
    found = read_robot_poses(tmp_path / "poses.csv", maker=None if form == "quaternion" else form)
    assert np.allclose(found.pose, TRUE, atol=1e-7) and found.names == tuple(NAMES)
    assert ("mm" in found.notation) == (length == 1e3), (place, found.notation)


@pytest.mark.parametrize("order", ["ZYX", "xyz", "ZYZ", "XZY", "zxy"])
def test_angles_in_any_order(tmp_path, order):
    angles = Rotation.from_matrix(TRUE[:, :3, :3]).as_euler(order, degrees=True)
    rows = [",".join(f"{v:.12g}" for v in (*t[:3, 3], *a)) for t, a in zip(TRUE, angles, strict=True)]
    (tmp_path / "a.csv").write_text("x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]\n" + "\n".join(rows) + "\n")
    assert np.allclose(read_robot_poses(tmp_path / "a.csv", euler=order).pose, TRUE, atol=1e-9)


def test_matrices_and_folders(tmp_path):
    head = ",".join(f"T_{i}{j}" for i in range(4) for j in range(4))
    rows = [",".join(f"{v:.12g}" for v in t.ravel()) for t in TRUE]
    (tmp_path / "m.csv").write_text(head + "\n" + "\n".join(rows) + "\n")
    assert np.allclose(read_robot_poses(tmp_path / "m.csv").pose, TRUE, atol=1e-9)
    folder = tmp_path / "poses"
    folder.mkdir()
    for name, t in zip(NAMES, TRUE, strict=True):
        x, y, z, w = Rotation.from_matrix(t[:3, :3]).as_quat()
        place = dict(zip("xyz", t[:3, 3].tolist(), strict=True))
        words = f"position: {place}\norientation: {{x: {x}, y: {y}, z: {z}, w: {w}}}\n".replace("'", "")
        (folder / name.replace("png", "yaml")).write_text(words)
    found = read_robot_poses(folder)
    assert np.allclose(found.pose, TRUE, atol=1e-9) and found.names == tuple(str(i) for i in range(9))
    (folder / "3.yaml").write_text("position: {x: 1, y: 2}\n")
    with pytest.raises(InputError, match=r"3\.yaml.*not a number"):
        read_robot_poses(folder)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: "", "empty"),
        (lambda t: t.splitlines()[0] + "\n", "no rows"),
        (lambda t: t.replace("qw", "qv"), "orientation"),
        (lambda t: t.replace("x [mm]", "x [kg]"), "another quantity"),
        (lambda t: t.replace("x [mm]", "u [mm]"), "position"),
        (lambda t: t.replace(t.splitlines()[3].split(",")[1], "abc"), "row 4, column x"),
        (lambda t: t.replace(t.splitlines()[3].split(",")[4], "9.5"), "row 4.*unit quaternion"),
        (lambda t: t.replace("qx,qy,qz,qw", "q1,q2,q3,q4"), "several meanings.*--maker"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, change, said):
    poses(tmp_path, TRUE, names=NAMES)
    place = tmp_path / "poses.csv"
    place.write_text(change(place.read_text()))
    with pytest.raises(InputError, match=said):
        read_robot_poses(place)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"euler": "ZYQ"}, "three axes"),
        ({"euler": "Zyx"}, "three axes"),
        ({"maker": "ur", "euler": "ZYX"}, "--maker or --euler"),
        ({"units": "mm,kg"}, "units of a pose"),
        ({"units": "mm,m"}, "units of a pose"),
        ({"units": "ell"}, "unknown unit"),
    ],
)
def test_options_that_mean_nothing(tmp_path, how, said):
    poses(tmp_path, TRUE)
    with pytest.raises(InputError, match=said):
        read_robot_poses(tmp_path / "poses.csv", **how)
