"""Whether poses of images in a map scatter as their sigma says, map and lens from one run: `python scripts/held_map_sigma.py [--rigs 50]`.

A rig is drawn as in `map_requirement.py`: a lens from what is known of it, a map from images through it, and as many new images, which
`vision map --held` places. `given` is the lens that the map began with, `found` the one that it ended with: errors of both have a part in
common with those of the map. `apart` takes them as independent, as for a map of which nobody says with which lens it was made.

    rms of e / sigma along x, y, z and about x, y, z;   rms of sqrt(e^T C^-1 e / 6);   median sigma along z, mm

asked: 0.9 to 1.1. Behind each number of all stands its standard error, by rigs: one lens moves all images of a rig.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "tests"), str(HERE.parent / "tests" / "session")]

from map_requirement import LAYOUTS, made  # noqa: E402
from map_rigs import error_of  # noqa: E402

from robocal.geometry import se3  # noqa: E402
from robocal.session.vision.map_fit import fit_map  # noqa: E402
from robocal.session.vision.place_views import locate_views  # noqa: E402

WAYS = ("given", "found", "given, apart", "found, apart")


def draw(plan, seed):
    """Errors (V, 6) of the images of a rig and their covariances (V, 6, 6), by the lens and by what is known of it and the map."""
    first, second, *_ = plan.tables(seed)
    found = fit_map(first, plan.lens, "none")
    moved = error_of(found.map, plan.there)[1]
    out = {}
    for way in WAYS:
        lens = plan.lens if "given" in way else found.lens
        known = replace(moved, lens=None) if "apart" in way else moved
        held = locate_views(second, known, lens)
        v, w = se3.displacement(held.poses, plan.views[[int(i) - 1 for i in held.ids]])
        out[way] = np.concatenate([v, w], axis=1), held.covariance
    return out


def tell(name, drawn):
    """A line for each lens."""
    for way in WAYS:
        e, c = (np.array([d[way][i] for d in drawn]) for i in (0, 1))
        each = e**2 / np.einsum("ruii->rui", c)
        whole = np.einsum("rui,rui->ru", e, np.linalg.solve(c, e[..., None])[..., 0]) / 6
        parts = [
            (np.sqrt(x.mean()), x.mean(axis=1).std(ddof=1) / np.sqrt(len(x)) / (2 * np.sqrt(x.mean())))
            for x in (*np.moveaxis(each, 2, 0), whole)
        ]
        words = " ".join(f"{a:.3f}+-{b:.3f}" for a, b in parts)
        print(f"{name} {way:13} {words}  sigma z {1e3 * np.median(np.sqrt(c[..., 2, 2])):.3f} mm", flush=True)


def main():
    """Draws and prints."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--rigs", type=int, default=50)
    words.add_argument("--first", type=int, default=0)
    words.add_argument("--layout", choices=LAYOUTS, default="flat")
    given = words.parse_args()
    plan = made(given.layout, None)
    tell(given.layout, [draw(plan, [53, n]) for n in range(given.first, given.first + given.rigs)])


if __name__ == "__main__":
    main()
