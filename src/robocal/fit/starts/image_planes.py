"""Starts of the image plane of a probe: linear in the 3 x 3 affine part of the image.

    E_i^T (R_i (h_u u_i + h_v v_i + t) + p_i - a_i) = 0,    (R_i, p_i) = T_phantom_probe

h_u and h_v are the axes of the image times the sizes of a pixel; the rotation is the one nearest to them.
"""

from __future__ import annotations

import numpy as np

from robocal._types import Array
from robocal.fit.starts.target_rows import TargetRows, frame_values, start
from robocal.geometry import se3, so3
from robocal.measure.plane_points import ACROSS, AT, IMAGE, PIXEL_SIZES

__all__ = ["affine_image"]

UNKNOWNS = 9
SEEN = 1e-9  # tolerance: singular values below this share of the largest are rounding


def affine_image(carried: Array, image: Array, at: Array, across: Array) -> Array | None:
    """H (3, 3) with columns h_u, h_v, t; carried (k, 4, 4) T_phantom_probe, image (k, 2) px, at (k, 3), across (k, d, 3). None where
    the rows do not determine it."""
    turned = across @ carried[:, :3, :3]
    factors = np.column_stack([image, np.ones(len(image))])
    # (k, d, 3, 3): by column of H, then by component
    design = turned[:, :, None, :] * factors[:, None, :, None]
    wanted = np.einsum("mdi,mi->md", across, at - carried[:, :3, 3])
    size = np.array([np.abs(image).max() or 1.0] * 2 + [1.0])
    flat = (design / size[:, None]).reshape(-1, UNKNOWNS)
    found, _, rank, _ = np.linalg.lstsq(flat, wanted.ravel(), rcond=SEEN)
    if rank < UNKNOWNS:
        return None
    return np.asarray((found.reshape(3, 3) / size[:, None]).T)


@start("plane_points", "plane_targets")
def _image_plane(seen: TargetRows) -> list[dict[str, float]]:
    obs, frame = seen.obs, seen.obs.frame
    if frame is None or seen.target is None or not any(frame.free):
        return []
    held = seen.machine if frame.mount == "tool" else np.broadcast_to(np.eye(4), seen.machine.shape)
    carried = se3.inverse(seen.at(seen.machine)) @ held
    across = obs.extra.get(ACROSS)
    e = np.broadcast_to(np.eye(3), (len(seen.index), 3, 3)) if across is None else across[seen.index]
    h = affine_image(carried, obs.extra[IMAGE][seen.index], obs.extra[AT][seen.index], e)
    if h is None:
        return []
    size = np.linalg.norm(h[:, :2], axis=0)
    x, y = (h[:, :2] / size).T
    pose = se3.compose(so3.project(np.column_stack([x, y, np.cross(x, y)])), h[:, 2])
    owner = obs.options[IMAGE]
    sizes = {f"{owner}.{s}": float(v) for s, v in zip(PIXEL_SIZES, size, strict=True)}
    return [{**frame_values(frame.name, pose if frame.mount == "tool" else se3.inverse(pose)), **sizes}]
