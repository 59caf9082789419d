"""What an ultrasound probe would see of a phantom of wires: where each wire crosses the image plane.

E^T (R S (u, v) + t - a) = noise,    (R, t) = T_phantom_image        two linear equations for u and v
"""

from __future__ import annotations

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.geometry import se3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.plane_points import ACROSS, AT, IMAGE, NAMED, PIXEL_SIZES, across

__all__ = ["Probe", "look_at_wires", "probe_data"]


@record
class Probe:
    """T_probe_image (4, 4), the sizes of a pixel along u and v (m), and T_base_phantom (4, 4) with wires by two points each (w, 2, 3)."""

    image: Array
    pixel: tuple[float, float]
    phantom: Array
    wires: Array


def look_at_wires(probe: Probe, poses: Array, noise: Array | None = None) -> Array:
    """Pixels (m, w, 2) of every wire from T_base_probe (m, 4, 4); noise (m, w, 2) in m across the wires."""
    seen = se3.inverse(probe.phantom[None]) @ poses @ probe.image
    e = across(probe.wires[:, 1] - probe.wires[:, 0])
    slope = np.einsum("wdi,mis->mwds", e, seen[:, :3, :2] * np.array(probe.pixel))
    gap = np.einsum("wdi,mwi->mwd", e, probe.wires[None, :, 0] - seen[:, None, :3, 3])
    return np.asarray(np.linalg.solve(slope, (gap if noise is None else gap + noise)[..., None])[..., 0])


def probe_data(
    probe: Probe,
    poses: Array,
    uv: Array,
    names: tuple[str, ...],
    *,
    phantom: Frame,
    sigma: float | None = None,
    pixel: tuple[float, float] | None = None,
) -> DataSet:
    """The data of a rig at known poses, as a user would hand them in: `phantom` says where it is believed to be, `pixel` how large a
    pixel is believed to be."""
    m, w = uv.shape[:2]
    which: Ints = np.tile(np.arange(w), m)
    sizes = dict(zip(PIXEL_SIZES, pixel or probe.pixel, strict=True))
    obs = Observations(
        "plane_points", np.repeat(np.arange(m), w), np.zeros((m * w, 2)), None if sigma is None else np.full((m * w, 2), sigma),
        Frame("image", free=(True,) * 6, mount="tool", expected=(10.0, 3.0)), (phantom,), np.zeros(m * w, dtype=np.int64),
        {
            IMAGE: uv.reshape(-1, 2), NAMED: which.astype(float), AT: probe.wires[which, 0],
            ACROSS: across(probe.wires[:, 1] - probe.wires[:, 0])[which],
        },
        {IMAGE: "image", "names": names, "values": sizes, "free": PIXEL_SIZES},
    )  # fmt: skip
    where = Configurations(tuple(f"f{i}" for i in range(m)), start=se3.to_vector(poses))
    return DataSet(where, (obs,))
