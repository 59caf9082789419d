"""A simulated probe over an N-wire phantom: 20 to 40 images, drawn from what is stated of them."""

from __future__ import annotations

import numpy as np

from robocal.geometry import se3, so3
from robocal.measure.data import Frame
from robocal.measure.machine import Rig
from robocal.parameters import ParameterTable
from robocal.simulation.probe import Probe, look_at_wires, probe_data

RIG = Rig("probe", ParameterTable(), ())
NAMES = ("G1", "L1", "M1", "G3", "H3", "M3", "H5", "L5", "M5")
WIRES = 1e-3 * np.array(
    [
        [[30, 0, 20], [30, 40, 20]], [[55, 0, 20], [35, 40, 20]], [[60, 0, 20], [60, 40, 20]],
        [[30, 0, 10], [30, 40, 10]], [[35, 0, 10], [55, 40, 10]], [[60, 0, 10], [60, 40, 10]],
        [[35, 0, 0], [35, 40, 0]], [[55, 0, 0], [40, 40, 0]], [[60, 0, 0], [60, 40, 0]],
    ], dtype=float,
)  # fmt: skip
PHANTOM = np.array([0.015, -0.025, -0.04, 1.2, -1.23, -1.2])
IMAGE = np.array([0.011, 0.048, -0.0004, 0.02, -0.02, -1.56])
PIXEL = (8.0e-5, 7.4e-5)
PRIOR = (3e-4, np.radians(0.2))  # m, rad
SIGMA = 2e-4  # m
# x along the wires' row, y down, so that the plane crosses the wires
LOOK = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def draw(seed=0, images=30, *, turn=0.25, sigma=SIGMA, prior=PRIOR, image=IMAGE, off=True):
    """Data, and the truth by the names of parameters; the phantom is off by a draw from its prior."""
    rng = np.random.default_rng(seed)
    believed = se3.from_vector(PHANTOM)
    true = se3.displace(believed, rng.normal(0, prior[0], 3) * off, rng.normal(0, prior[1], 3) * off)
    probe = Probe(se3.from_vector(image), PIXEL, true, WIRES)
    poses = []
    for _ in range(images):
        seen = se3.compose(so3.exp(rng.normal(0, turn, 3)) @ LOOK, [0.02, rng.uniform(0.012, 0.028), 0.035])
        poses.append(true @ seen @ se3.inverse(probe.image))
    poses = np.array(poses)
    uv = look_at_wires(probe, poses, rng.normal(0, sigma, (images, len(WIRES), 2)))
    frame = Frame("phantom", tuple(PHANTOM), (True,) * 6, "base", (0.01, 0.05), prior=(*[prior[0]] * 3, *[prior[1]] * 3))
    return probe_data(probe, poses, uv, NAMES, phantom=frame), probe
