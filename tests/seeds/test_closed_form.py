"""What the thesis writes out in closed form, against the generic code: the Jacobian of the RX-90 of section 3.3.4, entry by
entry, and the rotation matrix of a rotation vector, equation 5.30.

D3 = RL4 = 1 cm. Every entry of the Jacobian is right but J_6^1, where theta4 stands for its cosine and a bracket closes too
late. 5.30 prints x y (1 - c) for x x (1 - c) in its first entry.
"""

from __future__ import annotations

import numpy as np
from seeds.test_arm_tables import jacobian

from robocal.geometry import se3, so3

NAMES = [f"{s}{i}" for s in ("a", "theta", "d") for i in range(1, 7)]


def printed(q, misprint=False):
    """J as the section writes it, (3, 18), for one configuration (6,)."""
    s1, s2, s3, s4, s5 = np.sin(q[:5])
    c1, c2, c3, c4, c5 = np.cos(q[:5])
    # The brackets that come again and again.
    x, y, z = c1 * s2 * s3 - c1 * c2 * c3, s1 * s2 * s3 - c2 * c3 * s1, c2 * s3 + c3 * s2
    down_x, down_y, up = c1 * c2 * s3 + c1 * c3 * s2, c2 * s1 * s3 + c3 * s1 * s2, c2 * c3 - s2 * s3
    a6 = -c5 * (s1 * s4 + c4 * x) - s5 * down_x
    if misprint:
        a6 = -c5 * (s1 * s4 + q[3] * x - s5 * down_x)
    a = [
        [1, c1, c1 * c2, c1 * c2 * c3 - c1 * s2 * s3, -s1 * s4 - c4 * x, a6],
        [0, s1, c2 * s1, c2 * c3 * s1 - s1 * s2 * s3, c1 * s4 - c4 * y, c5 * (c1 * s4 - c4 * y) - s5 * down_y],
        [0, 0, s2, z, c4 * z, s5 * up + c4 * c5 * z],
    ]
    theta = [
        [s1 * (c2 * s3 - c2 + c3 * s2), c1 * s2 * (s3 - 1) - c1 * c2 * c3, x, 0, 0, 0],
        [-c1 * (c2 * s3 - c2 + c3 * s2), s1 * s2 * (s3 - 1) - c2 * c3 * s1, y, 0, 0, 0],
        [0, -c3 * s2 - c2 * (s3 - 1), -z, 0, 0, 0],
    ]
    d = [
        [0, s1, s1, -down_x, c4 * s1 - s4 * x, s5 * (s1 * s4 + c4 * x) - c5 * down_x],
        [0, -c1, -c1, -down_y, -c1 * c4 - s4 * y, -s5 * (c1 * s4 - c4 * y) - c5 * down_y],
        [1, 0, 0, up, s4 * z, c5 * up - c4 * s5 * z],
    ]
    return np.hstack([a, theta, d])


def test_every_entry_but_one(rng):
    for q in rng.uniform(-3, 3, (20, 6)):
        error = np.abs(jacobian("rx-90", q[None]) - printed(q))
        row, column = np.unravel_index(error.argmax(), error.shape)
        assert error.max() < 1e-12, f"J of {NAMES[column]}, row {row + 1}, at {q}"


def test_the_misprint_is_where_we_say(rng):
    q = rng.uniform(-3, 3, 6)
    error = np.abs(jacobian("rx-90", q[None]) - printed(q, misprint=True))
    assert [(r + 1, NAMES[c]) for r, c in np.argwhere(error > 1e-9)] == [(1, "a6")]


def test_three_columns_vanish_because_the_wrist_is_a_point(rng):
    """What the section concludes: theta4 to theta6 move nothing, so the determinant is zero."""
    j = np.vstack([jacobian("rx-90", q[None]) for q in rng.uniform(-3, 3, (6, 6))])
    assert np.abs(j[:, 9:12]).max() < 1e-12 and np.linalg.matrix_rank(j) == 13


def rotation(vector, misprint=False):
    """Equation 5.30."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    s, c = np.sin(angle), np.cos(angle)
    mc = 1 - c
    return np.array(
        [
            [c + x * (y if misprint else x) * mc, x * y * mc - z * s, x * z * mc + y * s],
            [x * y * mc + z * s, c + y * y * mc, y * z * mc - x * s],
            [x * z * mc - y * s, y * z * mc + x * s, c + z * z * mc],
        ]
    )


def test_rotation_vector_of_5_30(rng):
    for vector in rng.normal(size=(20, 3)):
        np.testing.assert_allclose(so3.exp(vector), rotation(vector), atol=1e-14)
    wrong = np.abs(so3.exp(vector) - rotation(vector, misprint=True)) > 1e-9
    assert [tuple(at) for at in np.argwhere(wrong)] == [(0, 0)]


def test_the_camera_seen_from_the_pattern(rng):
    """Y' = -R' P of section 5.3.2: where the camera is, from a marker's pose in the camera as a rotation vector and a
    position."""
    pose = np.concatenate([rng.normal(size=3), rng.normal(size=3)])
    seen = -rotation(pose[3:]).T @ pose[:3]
    np.testing.assert_allclose(se3.inverse(se3.from_vector(pose))[:3, 3], seen, atol=1e-14)
