"""Draws what a camera would see of a printed sheet: python examples/camera/make.py FOLDER.

FOLDER/sheet.yaml is from `robocal vision sheet`; the images go to FOLDER/images. Nothing here was measured.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from robocal.files.images import opencv
from robocal.files.sheet import read_sheet
from robocal.geometry import so3
from robocal.simulation.images import Photograph, render, texture

SIZE = 800, 600  # px
LENS = np.array([700.0, 700.0, 405.0, 296.0, -0.2, 0.05, 0.0, 0.0, 0.0])  # fx fy cx cy k1 k2 p1 p2 k3, px
VIEWS, SEED = 12, 1
TILT, NEAR, FAR = 0.5, 0.32, 0.55  # rad, m


def poses() -> np.ndarray:
    """T_camera_sheet (views, 4, 4), m: the sheet in all parts of the image, tilted to all sides."""
    rng = np.random.default_rng(SEED)
    out = np.tile(np.eye(4), (VIEWS, 1, 1))
    for k, pose in enumerate(out):
        way = 2 * np.pi * k / VIEWS
        depth = rng.uniform(NEAR, FAR)
        tilt = so3.exp(TILT * rng.uniform(0.4, 1.0) * np.array([np.cos(2.4 * way), np.sin(2.4 * way), 0.0]))
        pose[:3, :3] = tilt @ so3.exp(np.array([0.0, 0.0, rng.uniform(-0.5, 0.5)])) @ np.diag([1.0, -1.0, -1.0])
        pose[:3, 3] = depth * np.array([0.25 * np.cos(way), 0.2 * np.sin(way), 1.0])
    return out


def draw(folder: Path) -> None:
    """Writes the images."""
    sheet = read_sheet(folder / "sheet.yaml")
    (folder / "images").mkdir(exist_ok=True)
    how = Photograph(blur=0.8, noise=2.0, vignette=0.2)
    for k, pose in enumerate(poses()):
        image = render([(sheet, pose)], LENS, SIZE, how, texture(SIZE, k), np.random.default_rng(k))
        opencv().imwrite(str(folder / "images" / f"view{k + 1}.png"), image)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
