"""Simulates the measurements of this folder: python make_data.py [FOLDER]; with --verification FOLDER its 3600 verification points.

The robot is the nominal one with the errors of Table 1 of Flitti and Segai. What the paper leaves open is chosen
here: a grid of 7 by 8 points in x and y, the elbow up, and the hand swinging from 20 degrees behind the vertical to
20 degrees before it from the first pose to the last. With that the error before calibration is 2.11 to 4.19 mm; the
paper says 2 to 4 mm.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from robocal.arms import catalog
from robocal.arms.chain import Chain
from robocal.files.datawrite import table_text
from robocal.files.units import UNITS, Units
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations

# Table 1: real minus nominal, rad and mm.
ANGLES = {
    "j1.beta": 0.009,
    "j3.beta": -0.0001,
    "j4.beta": 0.004,
    "j1.alpha": 0.005,
    "j2.alpha": 0.0001,
    "j3.alpha": 0.0009,
}
LENGTHS = {"j2.d": -0.1, "j3.d": -1.0, "j4.d": 0.1, "j1.r": 0.1, "j2.r": 1.0, "j3.r": -0.1, "j4.r": 0.1, "j5.r": 0.1}
ERRORS = ANGLES | {name: 1e-3 * value for name, value in LENGTHS.items()}
NOISE = 0.02e-3  # m, the repeatability that the maker states
HEIGHT = 0.215  # m, the plane in which every point lies
UPPER, FORE, SHOULDER = 0.25, 0.16, 0.3  # m
DEG = np.pi / 180


def real_robot() -> Chain:
    """The nominal robot with the errors of Table 1."""
    nominal = catalog.get("rv-2aj")
    return nominal.with_values({name: nominal.table[name].value + error for name, error in ERRORS.items()})


def reach(x: np.ndarray, y: np.ndarray, z: float, tilt: np.ndarray) -> np.ndarray:
    """Joint values (m, 5) that bring the wrist centre to (x, y, z); `tilt` (m,) is how far the hand leans from the
    vertical."""
    out, up = np.hypot(x, y), z - SHOULDER
    elbow = np.arccos((out**2 + up**2 - UPPER**2 - FORE**2) / (2 * UPPER * FORE))
    shoulder = np.arctan2(out, up) - np.arctan2(FORE * np.sin(elbow), UPPER + FORE * np.cos(elbow))
    wrist = np.pi - shoulder - elbow + tilt
    return np.stack([np.arctan2(y, x), shoulder, elbow, wrist, np.zeros_like(wrist)], axis=1)


def plane(columns: int, rows: int) -> np.ndarray:
    """A grid in the measuring plane, row after row."""
    y, x = np.meshgrid(np.linspace(-0.18, 0.18, rows), np.linspace(0.22, 0.33, columns), indexing="ij")
    tilt = np.linspace(-20 * DEG, 20 * DEG, x.size)
    return reach(x.ravel(), y.ravel(), HEIGHT, tilt)


def fine_plane(columns: int, rows: int) -> np.ndarray:
    """The middles of so many cells of the measuring plane, row after row: none of them is a point of the coarse grid."""
    x, y = ((np.arange(n) + 0.5) / n for n in (columns, rows))
    y, x = np.meshgrid(-0.18 + 0.36 * y, 0.22 + 0.11 * x, indexing="ij")
    return reach(x.ravel(), y.ravel(), HEIGHT, np.linspace(-20 * DEG, 20 * DEG, x.size))


def volume(count: int) -> np.ndarray:
    """Poses anywhere within the joint limits."""
    low, high = catalog.get("rv-2aj").limits.T
    return np.random.default_rng(2).uniform(low, high, (count, 5))


def measured(joints: np.ndarray, seed: int | None) -> DataSet:
    """What an instrument in the robot's base frame reads at these joint values, with noise for a seed."""
    if seed is not None:
        joints = np.round(joints / DEG, 4) * DEG  # as a controller shows them; without noise every digit counts
    count = len(joints)
    where = Frame("cell")  # fixed: the measurements are in base coordinates
    blank = Observations("position", np.arange(count), np.zeros((count, 3)), np.full((count, 3), NOISE), where)
    ids = tuple(f"p{i + 1}" for i in range(count))
    rng = None if seed is None else np.random.default_rng(seed)
    made = synthesise(real_robot(), DataSet(Configurations(ids, joints), (blank,)), rng)
    obs = made.observations[0]
    value = obs.value if seed is None else np.round(obs.value, 7)
    plain = Observations("position", obs.configuration, value)
    return DataSet(made.configurations, (plain,))


def tables() -> dict[str, str]:
    """The files of this folder, by name."""
    robot, units = catalog.get("rv-2aj"), Units(UNITS["mm"], UNITS["deg"])
    sets = {
        "measurements.csv": measured(plane(7, 8), seed=1),
        "exact.csv": measured(plane(7, 8), seed=None),
        "elsewhere.csv": measured(volume(200), seed=3),
    }
    return {name: table_text(data, robot, units) for name, data in sets.items()}


def verification() -> dict[str, str]:
    """3600 points of the plane, as many as the paper's, where the robot really is: 36 along x, 100 along y, without noise."""
    units = Units(UNITS["mm"], UNITS["deg"])
    return {"verification.csv": table_text(measured(fine_plane(36, 100), seed=None), catalog.get("rv-2aj"), units)}


if __name__ == "__main__":
    more = "--verification" in sys.argv
    places = [a for a in sys.argv[1:] if a != "--verification"]
    folder = Path(places[0]) if places else Path(__file__).parent
    for name, text in (verification() if more else tables()).items():
        (folder / name).write_text(text, encoding="utf-8")
        print(folder / name)
