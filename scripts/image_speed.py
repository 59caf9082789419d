"""How long images take, one thread, beside OpenCV: `python scripts/image_speed.py [marker] [image] [check] [--rounds N]`.

CPU times, the least of some rounds. On the same machine OpenCV's own search and its corner refinements are measured.
marker   a fit of a marker of 60 px with and without its lens; asked: 6 ms, aim 3 ms
image    `vision detect` of an image with 15 markers of 60 px, less one call of OpenCV's own search; asked: 120 ms
check    `robocal check` of an arm whose 40 poses show 10 000 corners, to a fixed camera and to one in the hand; asked: 5 s, 500 MB
"""

from __future__ import annotations

import argparse
import csv
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from corner_accuracy import LENS, SIZE, USUAL, Row, scenes

from robocal.files.image_files import GreyImage
from robocal.files.images import family_cells, opencv
from robocal.files.marker_search import find_markers
from robocal.files.robot import open_robot
from robocal.files.text import InputFile
from robocal.geometry import se3
from robocal.session.vision.target import Target
from robocal.session.vision.views import look_at
from robocal.vision.camera import image_of
from robocal.vision.sightings import fit_sighting

FAMILY, SIDE = "6x6_250", 60.0
POSES, GRID, PITCH = 40, (25, 10), 0.012  # 250 corners, m
START = np.radians([20.0, -70.0, 90.0, -60.0, -80.0, 30.0])
MEGABYTE = 1024.0  # of what the system counts


def least(job: Callable[[], Any], rounds: int) -> float:
    """The least CPU time (ms) of some rounds, after one that warms up."""
    job()
    taken = []
    for _ in range(rounds):
        start = time.process_time()
        job()
        taken.append(time.process_time() - start)
    return 1e3 * min(taken)


def marker(rounds: int) -> None:
    """Prints the time of one marker."""
    cv2 = opencv()
    (scene, *_) = scenes(Row((SIDE, SIDE), USUAL, 0.0, 0.0), FAMILY, 15, 1)
    levels, found = scene.grey.astype(float), find_markers(scene.grey, FAMILY)
    cells = [family_cells(FAMILY, [n])[0] for n in found.ids.tolist()]
    corners = found.corners.reshape(-1, 1, 2).astype(np.float32)

    def fit(lens: Any) -> None:
        for number, near, print_ in zip(found.ids.tolist(), found.corners, cells, strict=True):
            fit_sighting(levels, number, near, print_, lens)

    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 30, 0.01)
    rows = {
        "robocal, lens known": lambda: fit(LENS),
        "robocal, lens unknown": lambda: fit(None),
        "OpenCV cornerSubPix, 5 px": lambda: cv2.cornerSubPix(scene.grey, corners.copy(), (5, 5), (-1, -1), stop),
        "OpenCV search of the image": lambda: search(scene.grey),
    }
    print(f"marker: ms each of {len(found)} of {SIDE:g} px (asked 6, aim 3)")
    for name, job in rows.items():
        print(f"  {name:28} {least(job, rounds) / len(found):7.2f}", flush=True)


def search(grey: Any) -> Any:
    """OpenCV's own search, as it stands."""
    aruco = opencv().aruco
    dictionary = aruco.getPredefinedDictionary(aruco.DICT_6X6_250)
    return aruco.ArucoDetector(dictionary, aruco.DetectorParameters()).detectMarkers(grey)


def image(rounds: int) -> None:
    """Prints the time of an image with 15 markers."""
    (scene, *_) = scenes(Row((SIDE, SIDE), USUAL, 0.0, 0.0), FAMILY, 15, 1)
    corners = [scene.corners[k] for k in range(len(scene.numbers))]
    grey = scene.grey.copy()
    for place in corners[15:]:  # what is too many is covered
        low, high = place.min(axis=0).astype(int) - 12, place.max(axis=0).astype(int) + 12
        grey[max(low[1], 0) : high[1], max(low[0], 0) : high[0]] = 128
    one = GreyImage("one", InputFile(Path("one.png"), ""), grey, grey.astype(float))
    count = look_at(one, Target(FAMILY)).summary.markers
    own, ours = least(lambda: search(grey), rounds), least(lambda: find_markers(grey, FAMILY), rounds)
    whole = least(lambda: look_at(one, Target(FAMILY)), rounds)
    print(
        f"image: ms of {SIZE[0]} x {SIZE[1]} px with {count} markers of {SIDE:g} px (asked: 120 beyond OpenCV's search)"
    )
    for name, value in {"OpenCV search": own, "our two searches": ours, "detect": whole, "beyond": whole - own}.items():
        print(f"  {name:28} {value:7.1f}", flush=True)


def write_cell(folder: Path, inhand: bool, exchanged: bool) -> None:
    """Writes data of 40 poses of a UR10, 250 corners each, one camera; two views may have each other's corners."""
    rng = np.random.default_rng(1)
    chain = open_robot("ur10").chain
    truth = chain.with_values({n: chain.table[n].value + rng.normal(0, 3e-4) for n in chain.table.free})
    joints = START + rng.uniform(-0.1, 0.1, (POSES, 6)) * [1, 1, 1, 3, 3, 3]
    points = np.array([(k % GRID[0], k // GRID[0], 0.0) for k in range(GRID[0] * GRID[1])]) * PITCH
    middle = se3.from_vector([*points.mean(axis=0), 0.0, 0.0, 0.0])
    hand = truth.pose(joints)
    lens = np.array([900.0, 905.0, 640.0, 412.0, -0.1, 0.02, 0.0, 0.0, 0.0])
    beside = se3.from_vector([0.0, 0.0, 0.9, np.pi, 0.0, 0.0])
    on_tool = se3.from_vector([0.02, 0.01, 0.05, 0.0, 0.0, 0.1])
    start = chain.pose(START[None])[0]
    if inhand:
        eye, board = on_tool, start @ on_tool @ se3.inverse(middle @ beside)
        seen = se3.inverse(hand @ eye) @ board
    else:
        board, eye = on_tool, start @ on_tool @ middle @ beside
        seen = se3.inverse(eye) @ hand @ board
    with (folder / "data.csv").open("w", newline="") as stream:
        out = csv.writer(stream)
        out.writerow(["view", *(f"j{j + 1} [rad]" for j in range(6)), "u", "v", "x [m]", "y [m]", "z [m]"])
        for k in range(POSES):
            view = {5: 20, 20: 5}.get(k, k) if exchanged else k
            pixels = image_of(points @ seen[view, :3, :3].T + seen[view, :3, 3], lens) + rng.normal(
                0, 0.1, (len(points), 2)
            )
            for p, uv in zip(points, pixels, strict=True):
                out.writerow(
                    [f"v{k}", *(f"{v:.9f}" for v in joints[k]), *(f"{v:.5f}" for v in uv), *(f"{v:.6f}" for v in p)]
                )
    mounts = ("tool", "base") if inhand else ("base", "tool")
    (folder / "data.yaml").write_text(
        "robocal: 1\nkind: pixels\nfile: data.csv\nunits: {length: m, angle: rad}\n"
        "joints: {columns: [j1, j2, j3, j4, j5, j6]}\npixels: {columns: [u, v], sigma: 0.1}\n"
        "points: {columns: [x, y, z]}\nconfiguration: {id: view}\n"
        "camera: {name: lens, fx: 900, fy: 905, cx: 640, cy: 412, k1: -0.1, k2: 0.02}\n"
        f"frame: {{name: camera, mount: {mounts[0]}, free: true}}\ntargets: {{sheet: {{mount: {mounts[1]}, free: true}}}}\n"
    )


def check(rounds: int) -> None:
    """Prints CPU time and memory of `robocal check`, a process of its own."""
    print(f"check: {POSES * GRID[0] * GRID[1]} corners, {POSES} poses (asked: 5 s, 500 MB)")
    cases = {
        "fixed camera": (False, False),
        "camera in the hand": (True, False),
        "fixed, two views exchanged": (False, True),
    }
    for name, case in cases.items():
        with tempfile.TemporaryDirectory() as place:
            write_cell(Path(place), *case)
            command = [sys.executable, "-m", "robocal", "check", "ur10", str(Path(place) / "data.yaml")]
            runs = [run(command) for _ in range(max(2, rounds // 3))]
        seconds, memory, status = min(runs)
        print(f"  {name:28} {seconds:6.2f} s {memory:5.0f} MB, status {status}", flush=True)


def run(command: list[str]) -> tuple[float, float, int]:
    """CPU seconds, the largest memory (MB) and the status of a command."""
    one = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(one.pid, 0)
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / MEGABYTE, os.waitstatus_to_exitcode(status)


def main() -> None:
    """Prints what was asked for."""
    parts = {"marker": marker, "image": image, "check": check}
    words = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    words.add_argument("parts", nargs="*", help=f"of {' '.join(parts)}; all where none is named")
    words.add_argument("--rounds", type=int, default=7)
    told = words.parse_args()
    if "cv2" not in sys.modules:
        opencv().setNumThreads(1)
    for name in told.parts or parts:
        parts[name](told.rounds)


if __name__ == "__main__":
    main()
