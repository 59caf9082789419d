"""Whether 95 % intervals of maps hold: `python scripts/map_coverage.py [--count 200] [--shift MM] [--scatter PERCENT]`.

Each rig is drawn from the priors that its map is told: the lens from lens.yaml, the edges from --size-sigma and --size-scatter, where
markers stand and cameras look anew, and the noise of corners as stated. The shift of all edges, which all numbers of a rig share, is drawn
in strata: each part of its distribution once. `vision map` is run on its corners, with its defaults. A row tells:
held      share of the numbers that are within 1.96 sigma of the truth, percent; asked: 93 to 97
+-        standard error of that share over rigs: the numbers of one rig share its scale and its lens
bias      mean of what numbers are off by, in sigma, and its standard error
chi2      mean of the squares of what numbers are off by, in sigma; 1 is asked
of places and turns of markers, numbers of the lens, edges, the scale of the map, and places beside that scale.
A rig takes 0.6 s of a processor.
"""

from __future__ import annotations

import argparse
import csv
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.special import ndtri

import robocal as rc
from robocal._types import Array
from robocal.files.lens import lens_text
from robocal.geometry import se3, so3
from robocal.vision.camera import image_of
from robocal.vision.lenses import Lens
from robocal.vision.map_gauge import rigid_projector
from robocal.vision.maps import MarkerMap

SIZE, EDGE, NOISE, VIEWS = (1280, 960), 0.06, 0.1, 15  # px, m, px of a coordinate
SYMBOLS = "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"
LENS = np.array([1050.0, 1055.0, 652.0, 470.0, -0.22, 0.07, 8e-4, -6e-4, 0.0])
KNOWN = np.array([3.0, 3.0, 4.0, 4.0, 0.01, 0.01, 5e-4, 5e-4, 0.003])
SQUARE = np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) / 2
FLOOR = np.eye(3)
BACK = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
SIDE = np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]])
PLACES = [
    *((x, y, 0.0, FLOOR) for x in (-0.3, -0.1, 0.1, 0.3) for y in (-0.15, 0.1)),
    *((x, 0.35, 0.2, BACK) for x in (-0.25, 0.0, 0.25)),
    *((0.45, y, 0.2, SIDE) for y in (-0.1, 0.15)),
]


def room_of(rng: np.random.Generator) -> Array:
    """T_room_marker (M, 4, 4) on a table and two walls, each tilted by a little."""
    turn = [
        so3.exp(rng.normal(0, 0.05, 3)) @ wall @ so3.exp(np.array([0, 0, rng.uniform(-3, 3)])) for *_, wall in PLACES
    ]
    return se3.compose(np.array(turn), np.array([p[:3] for p in PLACES]))


def cameras_of(rng: np.random.Generator, count: int) -> Array:
    """T_camera_room (count, 4, 4) of cameras that look at the room."""
    out = []
    for _ in range(count):
        at = np.array([rng.uniform(-0.5, 0.2), rng.uniform(-0.7, -0.2), rng.uniform(0.4, 0.8)])
        z = np.array([rng.uniform(-0.1, 0.2), rng.uniform(0.0, 0.2), rng.uniform(0.0, 0.15)]) - at
        z /= np.linalg.norm(z)
        x = np.cross(z, [0, 0, 1.0])
        x /= np.linalg.norm(x)
        r = so3.exp(z * rng.uniform(-1, 1)) @ np.stack([x, np.cross(z, x), z], axis=1)
        out.append(se3.inverse(se3.compose(r, at)))
    return np.array(out)


def write_corners(place: Path, room: Array, edges: Array, lens: Array, rng: np.random.Generator) -> None:
    """Every marker that a view shows whole from its printed side, as `vision detect` lists them."""
    with place.open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["view", "marker", "corner", "u [px]", "v [px]", "su [px]", "sv [px]"])
        corners = np.einsum("mij,mkj->mki", room[:, :3, :3], SQUARE * edges[:, None, None]) + room[:, None, :3, 3]
        for v, t in enumerate(cameras_of(rng, VIEWS)):
            for m, c in enumerate(corners):
                seen = c @ t[:3, :3].T + t[:3, 3]
                middle = seen.mean(axis=0)
                tilted = (t[:3, :3] @ room[m, :3, 2]) @ middle > -0.25 * np.linalg.norm(middle)
                if seen[:, 2].min() < 0.1 or tilted or np.abs(seen[:, :2] / seen[:, 2:]).max() > 0.75:
                    continue
                uv = image_of(seen, lens)
                if (uv > 2).all() and (uv < np.array(SIZE) - 3).all():
                    for k, (a, b) in enumerate(uv + rng.normal(0, NOISE, uv.shape)):
                        out.writerow([f"v{v}", m, k, f"{a:.6f}", f"{b:.6f}", NOISE, NOISE])


def off_of(known: MarkerMap, room: Array) -> Array:
    """What a map is off by (6M,), laid on the truth as well as it goes."""
    true = room[[int(n) for n in known.names]]
    first = int(np.abs(known.vector).sum(axis=1).argmin())
    steps = np.concatenate(se3.displacement(known.poses, se3.inverse(true[first]) @ true), axis=1).ravel()
    return np.asarray(rigid_projector(known) @ steps)


def scale_of(known: MarkerMap, off: Array) -> tuple[Array, Array, Array]:
    """By how much a map is larger than the truth, in sigma (1,), and what places are off by beside that (3M,), with sigma."""
    assert known.covariance is not None
    rows = (6 * np.arange(len(known.names))[:, None] + np.arange(3)).ravel()
    c = known.covariance[np.ix_(rows, rows)]
    p = (known.vector[:, :3] - known.vector[:, :3].mean(axis=0)).ravel()
    along = p / (p @ p)
    rest = np.eye(len(p)) - np.outer(p, along)
    return (
        np.array([along @ off[rows] / np.sqrt(along @ c @ along)]),
        rest @ off[rows],
        np.sqrt(np.diag(rest @ c @ rest.T)),
    )


def rig_of(folder: Path, seed: int, z: float, shift: float, scatter: float) -> tuple[str, dict[str, Array]]:
    """The verdict with its reasons, and what numbers are off by in sigma; z is the shift of all edges, in its sigma."""
    rng = np.random.default_rng([35, seed])
    lens = LENS + KNOWN * rng.normal(size=9)
    room = room_of(rng)
    edges = EDGE * (1 + scatter * rng.normal(size=len(room))) + shift * z
    place = folder / f"{seed}.csv"
    write_corners(place, room, edges, lens, rng)
    made = rc.camera.map(
        place, lens=folder / "lens.yaml", size="60", size_sigma=1e3 * shift, size_scatter=100 * scatter
    )
    known, found = made.result.map, made.result.fit.lens
    off = off_of(known, room)
    in_sigma = (off / np.sqrt(np.diag(known.covariance))).reshape(-1, 6)
    scale, rest, spread = scale_of(known, off)
    total = made.result.fit.decision.need_fit.total
    grown = [total.names.index(f"{n}.edge") for n in known.names]
    wrong = (known.size - edges[[int(n) for n in known.names]]) / np.sqrt(np.diag(total.covariance)[grown])
    numbers = (np.array(found.numbers) - lens) / np.array([found.sigma[s] for s in SYMBOLS])
    return " ".join([made.result.verdict.status, *(r.code for r in made.result.reasons)]), {
        "places": in_sigma[:, :3].ravel(), "turns": in_sigma[:, 3:].ravel(), "lens": numbers, "edges": wrong, "scale": scale,
        "beside scale": rest / spread,
    }  # fmt: skip


def main() -> None:
    """Draws rigs and prints what their intervals hold."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="seed of the first rig")
    parser.add_argument("--shift", type=float, default=0.2, metavar="MM", help="of all edges, as --size-sigma")
    parser.add_argument("--scatter", type=float, default=0.3, metavar="PERCENT", help="of each, as --size-scatter")
    o = parser.parse_args()
    rigs: list[dict[str, Array]] = []
    said: dict[str, int] = {}
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "lens.yaml").write_text(lens_text(Lens.of("brown", LENS, SIZE, SYMBOLS, np.diag(KNOWN**2))))
        rng = np.random.default_rng([36, o.first])
        strata = ndtri((rng.permutation(o.count) + rng.uniform(size=o.count)) / o.count)
        for seed, z in enumerate(strata.tolist(), o.first):
            status, rig = rig_of(folder, seed, z, 1e-3 * o.shift, 1e-2 * o.scatter)
            said[status] = said.get(status, 0) + 1
            rigs.append(rig)
    print(
        f"{o.count} rigs, shift {o.shift} mm, scatter {o.scatter} %: {said}, {time.process_time() - begun:.0f} s of a processor"
    )
    print(f"{'':>14} {'held':>6} {'+-':>5} {'bias':>6} {'+-':>5} {'chi2':>6}")
    for what in rigs[0]:
        parts = [r[what] for r in rigs]
        held, bias = np.array([100 * np.mean(np.abs(p) < 1.96) for p in parts]), np.array([p.mean() for p in parts])
        chi2 = np.mean([np.mean(p**2) for p in parts])
        ends = [v.std(ddof=1) / np.sqrt(len(v)) for v in (held, bias)]
        print(f"{what:>14} {held.mean():6.1f} {ends[0]:5.1f} {bias.mean():6.2f} {ends[1]:5.2f} {chi2:6.2f}")


if __name__ == "__main__":
    main()
