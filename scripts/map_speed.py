"""How long a folder of images takes to a map and its verdict: `python scripts/map_speed.py [--count 100] [--cores 2]`.

Images of 1280 x 960 px of the room of `map_coverage.py`, 13 markers of 60 mm on a table and two walls, are drawn; drawing is not counted.
`robocal vision map FOLDER` then finds the markers, fits their corners again with the lens of the map, and judges the map, in a process of
its own on so many cores; the second row places the same images in that map (`--held`). Asked: 60 s for 100 images on two cores.
wall      seconds by the clock
user      seconds of processors, by all threads and their children
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from map_coverage import EDGE, KNOWN, LENS, SIZE, SYMBOLS, cameras_of, room_of

from robocal.files.images import family_cells, opencv
from robocal.files.lens import lens_text
from robocal.simulation.images import Photograph, render, texture
from robocal.vision.lenses import Lens
from robocal.vision.sheets import Marker, Sheet

FAMILY = "6x6_250"


def draw_images(folder: Path, count: int) -> None:
    """So many photographs of the room."""
    rng = np.random.default_rng(35)
    room = room_of(rng)
    wide = 1.5 * EDGE
    cells = family_cells(FAMILY, range(len(room)))
    sheets = [Sheet(str(i), wide, wide, (Marker(FAMILY, i, c, 0.0, 0.0, EDGE),)) for i, c in enumerate(cells)]
    (folder / "images").mkdir()
    for k, view in enumerate(cameras_of(rng, count)):
        there = [(s, view @ t) for s, t in zip(sheets, room, strict=True)]
        image = render(there, LENS, SIZE, Photograph(blur=0.7, noise=2.0), texture(SIZE, k), rng)
        opencv().imwrite(str(folder / "images" / f"{k:03}.png"), image)


def main() -> None:
    """Draws images and times both verbs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--cores", type=int, default=2)
    o = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        draw_images(folder, o.count)
        (folder / "lens.yaml").write_text(lens_text(Lens.of("brown", LENS, SIZE, SYMBOLS, np.diag(KNOWN**2))))
        cores = sorted(os.sched_getaffinity(0))[: o.cores]
        usual = ["--dictionary", FAMILY, "--lens", str(folder / "lens.yaml")]
        rows = {
            "map": [*usual, "--size", f"{1e3 * EDGE:g}", "-o", str(folder / "map.yaml")],
            "held": [*usual, "--held", str(folder / "map.yaml"), "-o", str(folder / "poses.csv")],
        }
        print(f"{o.count} images, {len(cores)} of {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
        print(f"{'':>6} {'wall':>6} {'user':>6}  exit status and first lines")
        for what, words in rows.items():
            before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
            done = subprocess.run(
                [sys.executable, "-m", "robocal", "vision", "map", str(folder / "images"), *words],
                capture_output=True, text=True, preexec_fn=lambda: os.sched_setaffinity(0, cores),
            )  # fmt: skip
            wall, after = time.monotonic() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
            user = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            said = " ".join((done.stdout or done.stderr).split())[:140]
            print(f"{what:>6} {wall:6.1f} {user:6.1f}  {done.returncode}: {said}")


if __name__ == "__main__":
    main()
