"""Errors of maps and of cameras in them over what `vision require` predicts: `python scripts/map_requirement.py [--rigs 1000] [--jobs 16]`.

Rigs are drawn: a lens from what is known of it, corners with 0.2 px, a map from 12 images, and 12 images in that map. Layouts:
flat       20 markers of 6 cm on 1.0 x 0.7 m, cameras 0.6 to 1.1 m above
raised     the same, half of them 15 cm higher
high       the same, half of them 30 cm higher
edge 15    20 markers of 15 cm on 2.5 x 1.75 m, cameras 1.5 to 2.75 m above
edge 30    6 markers of 30 cm on the same
A number is the rms error of all rigs over the predicted one; asked: 0.9 to 1.1. A lens moves all cameras of a rig together, so that the
chance of N rigs is about 1 / sqrt(2 N): 5 % of 200, 2 % of 1000. `--seeds` begins elsewhere.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parent.parent / "tests")]

from session.test_map_requirement import NOISE, SIZE, cameras, lens, rig_errors  # noqa: E402

from robocal.session.vision.map_requirement import predict_map  # noqa: E402
from robocal.vision.map_views import lay_out  # noqa: E402

WIDE = 2.5  # times the field, and the distance of the cameras
LAYOUTS = {
    "flat": (5, 4, 1.0, 0.06, 0.0),
    "raised": (5, 4, 1.0, 0.06, 0.15),
    "high": (5, 4, 1.0, 0.06, 0.30),
    "edge 15": (5, 4, WIDE, 0.15, 0.0),
    "edge 30": (3, 2, WIDE, 0.30, 0.0),
}


def made(name):
    """Markers, cameras and the prediction of a layout."""
    columns, rows, wide, size, height = LAYOUTS[name]
    views = cameras(12)
    views[:, :3, 3] *= wide
    there = lay_out(columns, rows, (1.0 * wide, 0.7 * wide), size, height, 0.0)
    return there, views, predict_map(there, views, lens(), NOISE, SIZE)


def some(name, seeds):
    """Squares of what rigs are off by: map along x, y and z, cameras along x, y and z, per rig."""
    there, views, told = made(name)
    out = []
    for seed in seeds:
        off, camera, *_ = rig_errors(there, views, told, None, seed)
        out.append([np.mean(np.square(a)) for a in (off[:, :2], off[:, 2], camera[:, :2], camera[:, 2])])
    return np.array(out)


def main():
    """Draws and prints."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--rigs", type=int, default=1000)
    words.add_argument("--first", type=int, default=0)
    words.add_argument("--jobs", type=int, default=1)
    words.add_argument("--layout", choices=LAYOUTS, action="append", help="repeatable; otherwise all")
    given = words.parse_args()
    seeds = np.array_split(np.arange(given.first, given.first + given.rigs), max(1, given.rigs // 25))
    print("rms over predicted: map x y, map z, camera x y, camera z; asked 0.9 to 1.1")
    with ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")) as crew:
        for name in given.layout or LAYOUTS:
            squares = np.concatenate(list(crew.map(partial(some, name), seeds)))
            e = made(name)[2].errors
            predicted = np.array([e.map_xy, e.map_z, e.camera_xy, e.camera_z])
            ratio = np.sqrt(squares.mean(axis=0)) / predicted
            chance = squares.std(axis=0, ddof=1) / squares.mean(axis=0) / np.sqrt(len(squares)) / 2
            parts = "  ".join(f"{r:.3f} +- {c:.3f}" for r, c in zip(ratio, chance, strict=True))
            met = "met" if np.abs(ratio - 1).max() <= 0.1 else "NOT MET"
            print(
                f"{name:8} {parts}  predicted {np.round(predicted * 1e3, 3)} mm, {len(squares)} rigs: {met}", flush=True
            )


if __name__ == "__main__":
    main()
