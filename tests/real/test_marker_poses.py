"""Poses of one marker: real images of a tag that was turned by known angles, and drawn ones."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.diagnose.vision_limits import FRONTAL
from robocal.files.image_files import find_images, read_images
from robocal.geometry import se3, so3
from robocal.session.vision.target import Target
from robocal.vision.camera import image_of
from robocal.vision.sheets import SQUARE
from robocal.vision.square import poses_of_square

LENS = np.array([329.8729619, 332.9461130, 528.0, 396.0, 0, 0, 0, 0, 0])  # of the images' own list
ANGLES = range(-70, 71, 10)


def test_a_tag_on_a_turntable_has_the_angles_that_were_set(shared_data):
    pytest.importorskip("cv2")
    poses = {}
    for angle in ANGLES:
        files = [str(shared_data / "apriltags" / f"test_image_rotation_{angle}.png")]
        (image,) = read_images(find_images(files), 1)
        (seen,) = Target("36h11").search(image)[0]
        poses[angle] = poses_of_square(seen.place, seen.covariance, 0.065, LENS)
        assert len(poses[angle]) == 2
        assert abs(angle) >= FRONTAL or min(np.degrees(p.tilt) for p in poses[angle]) < FRONTAL
    turned = {a: p[0].pose[:3, :3] for a, p in poses.items()}
    back = [r @ so3.exp([0, np.radians(a), 0]) for a, r in turned.items()]  # about the tag's own upright axis
    u, _, v = np.linalg.svd(np.mean(back, axis=0))
    off = [np.degrees(np.linalg.norm(so3.log((u @ v).T @ b))) for b in back]
    print(f"\n2.5 deg asked, rotation {np.sqrt(np.mean(np.square(off))):.3f} rms")
    assert np.sqrt(np.mean(np.square(off))) < 2.5
    plain = [np.degrees(np.arctan2(r[0, 2], -r[2, 2])) - a for a, r in turned.items()]
    assert np.sqrt(np.mean(np.square(plain))) < 2.5


@pytest.mark.parametrize("far", [0.3, 3.0])
@pytest.mark.parametrize("tilt", [0.0, 5.0, 15.0, 40.0, 65.0])
def test_one_of_the_two_poses_is_the_true_one(far, tilt):
    """From far they differ by the sign of the tilt and fit alike."""
    lens = np.array([900.0, 910.0, 480.0, 350.0, -0.2, 0.05, 1e-3, 0, 0])
    facing = se3.compose(np.diag([1.0, -1, -1]), [0.1 * far, -0.05 * far, far])
    rng, second = np.random.default_rng(3), []
    for _ in range(5):
        about, spin = rng.uniform(0, 2 * np.pi, 2)
        turn = np.radians(tilt) * np.array([np.cos(about), np.sin(about), 0])
        true = facing @ se3.from_vector([0, 0, 0, *turn]) @ se3.from_vector([0, 0, 0, 0, 0, spin])
        points = SQUARE * 0.05
        corners = image_of(points @ true[:3, :3].T + true[:3, 3], lens)
        found = poses_of_square(corners, 1e-4 * np.eye(8), 0.1, lens)
        assert np.allclose(found[0].pose, true, atol=1e-6) and found[0].rms < 1e-6
        assert len(found) == 2 and found[0].chi2 <= found[1].chi2
        second.append(found[1])
    if far == 3.0 and tilt < 50:
        assert max(p.rms for p in second) < 0.5
