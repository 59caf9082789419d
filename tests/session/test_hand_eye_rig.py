"""`vision hand-eye --rig`: cameras that are bolted to the one in the hand are one body, held where a file has them, within a prior, or free."""

# obeys: rig-contradicted

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal
from hand_eye_world import HAND, IMAGE, TABLE, codes, corners, hand_eye, lens_file, named, poses, rigid, world
from lens_world import BOARD, LENS, SIZE, board_rows, see, write
from scipy.spatial.transform import Rotation

BOLT = rigid([0.02, -0.05, 0.03], [0.06, 0.005, -0.01])  # the second camera in the first
OTHER = {**LENS, "fx": 990.0, "fy": 991.0, "cx": 630.0, "k1": -0.15}


def rig_file(folder, place="", *, name="rig.yaml", camera="right"):
    text = f"robocal: 1\nkind: camera-rig\nunits: {{length: mm, angle: deg}}\ncameras:\n  {camera}: {{corners: right.csv, lens: other.yaml{place}}}\n"
    (folder / name).write_text(text)
    return str(folder / name)


def stated(bolt, more=""):
    xyz, turn = (", ".join(f"{v:.9g}" for v in w) for w in (1e3 * bolt[:3, 3], np.degrees(Rotation.from_matrix(bolt[:3, :3]).as_rotvec())))
    return f", xyz: [{xyz}], rotation_vector: [{turn}]{more}"


def cell(folder, seed=1, error=0.3, bolt=BOLT, count=16):
    """Files of a cell with two cameras; the words of a command without its rig."""
    made = world(seed=seed, error=error, count=count)
    lens_file(folder, OTHER, "other.yaml")
    rows = []
    pixels = np.array([see(BOARD @ (w := np.linalg.inv(bolt) @ y)[:3, :3].T + w[:3, 3], OTHER) for y in made.seen])
    inside = ((pixels > 5) & (pixels < np.array(SIZE) - 6)).all(axis=(1, 2))
    names = [f"v{i + 1}" for i in np.flatnonzero(inside)]
    rows = [r for r in board_rows(pixels, 0.1, np.random.default_rng(seed + 50)) if r["view"] in names]
    write(folder / "right.csv", rows)
    words = [corners(folder, made, seed=seed + 90), poses(folder, made.told, names=named(made))]
    return made, [*words, "--lens", lens_file(folder), "--image", IMAGE], int(inside.sum())


def off(part, truth):
    """A frame off by, in sigma, (6,); NaN of what was held."""
    found, sigma = np.array(part["matrix"]), np.sqrt(np.diag(part["covariance"]))
    found[:3, 3] *= 1e-3
    sigma[:3] *= 1e-3
    turn = Rotation.from_matrix(found[:3, :3] @ truth[:3, :3].T).as_rotvec()
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(sigma > 0, np.concatenate([found[:3, 3] - truth[:3, 3], turn]) / sigma, np.nan)


def frames(told):
    return {f["child"]: f for f in told["frames"]}


@pytest.mark.parametrize("way", ["held", "prior", "free"])
def test_a_rig_is_one_body(tmp_path, way):
    """The camera is as well known as alone or better, and the rig is where it is."""
    made, words, many = cell(tmp_path)
    assert many > 8
    near = BOLT @ rigid([4e-4, -3e-4, 2e-4], [1e-4, -2e-4, 1e-4])
    place = {"held": stated(BOLT), "prior": stated(near, ", prior: {length: 0.2, angle: 0.05}"), "free": ""}[way]
    told, status = hand_eye(*words, "--rig", rig_file(tmp_path, place), "-o", tmp_path / "cell")
    assert status == 0 and "rig-contradicted" not in codes(told), told["verdict"]
    found = frames(told)
    assert found["right"]["parent"] == "camera"
    for name, truth in (("camera", HAND), ("board", TABLE)):
        assert np.abs(off(found[name], truth)).max() < 4
    if way == "held":
        assert not np.any(found["right"]["covariance"]) and np.allclose(found["right"]["matrix"][0][3], 1e3 * BOLT[0, 3])
    else:
        assert np.abs(off(found["right"], BOLT)).max() < 4
    alone, _ = hand_eye(*words)
    first, second = (np.trace(np.array(frames(t)["camera"]["covariance"])[:3, :3]) for t in (alone, told))
    assert second < 1.05 * first
