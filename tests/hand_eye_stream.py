"""A camera that takes images while the hand moves, beside a log of the robot's poses on a clock of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hand_eye_world import HAND, HELD, IMAGE, STAND, TABLE, World, lens_file, poses, world
from lens_world import BOARD, LENS, SIZE, board_rows, see, write
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

EPOCH = 1.7e9  # s


def stream(folder, seed=3, *, delay=0.0, size=1.0, inhand=True, error=0.2, views=30):
    """A run's words and what is true: views that come `delay` s late, of a board `size` times as large as stated."""
    rng = np.random.default_rng(seed)
    stops = world(seed, count=14, inhand=inhand, error=0, tilt=0.5).told
    place = CubicSpline(0.8 * np.arange(14), stops[:, :3, 3])
    turn = RotationSpline(0.8 * np.arange(14), Rotation.from_matrix(stops[:, :3, :3]))

    def at(times):
        out = np.tile(np.eye(4), (len(times), 1, 1))
        out[:, :3, :3], out[:, :3, 3] = turn(times).as_matrix(), place(times)
        return out

    when, pixels, seen = [], [], []
    times = np.sort(rng.uniform(0.5, 9.9, 400))
    for t, flange in zip(times, at(times), strict=True):
        y = np.linalg.inv(HAND) @ np.linalg.inv(flange) @ TABLE if inhand else np.linalg.inv(STAND) @ flange @ HELD
        points = size * BOARD @ y[:3, :3].T + y[:3, 3]
        uv = see(points, LENS)
        if points[:, 2].min() > 0.1 and (uv > 5).all() and (uv < np.array(SIZE) - 6).all():
            when.append(t + delay)
            pixels.append(uv)
            seen.append(y)
    some = np.linspace(0, len(when) - 1, views).astype(int)
    clock = np.arange(0, 10.4, 0.02)
    log = at(clock)
    log[:, :3, 3] += 1e-3 * error * rng.normal(size=(len(clock), 3))
    rows = board_rows(np.array(pixels)[some], 0.1, rng)
    names = [f"{1e9 * (EPOCH + when[i]):.0f}" for i in some]
    views_file = write(folder / "stream.csv", [r | {"view": names[int(r["view"][1:]) - 1]} for r in rows])
    log_file = Path(poses(folder, log, name="log.csv"))
    head, *lines = log_file.read_text().splitlines()
    timed = [f"time [s],{head}", *(f"{EPOCH + t:.4f},{line}" for t, line in zip(clock, lines, strict=True))]
    log_file.write_text("\n".join(timed) + "\n")
    camera = "hand" if inhand else "fixed"
    words = [
        views_file,
        str(log_file),
        "--lens",
        lens_file(folder),
        "--image",
        IMAGE,
        "--pair",
        "time",
        "--camera",
        camera,
    ]
    return World(log, np.array(pixels)[some], np.array(seen)[some], inhand), words
