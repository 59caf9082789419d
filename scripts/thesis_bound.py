"""What the thesis' rig allows at best: `python scripts/thesis_bound.py RIG.yaml --seeds 10`, the figures of `thesis_rig.py` foretold.

Independent of robocal's estimators: the information of all corners, lengths and stated priors at the truth, from differences of a camera
and of cable lengths that are written here. Errors are drawn from its inverse (Cramer and Rao) and judged as `thesis_rig.py` judges a run;
verification poses are solved from lengths with new noise. Of the median over seeds it tells the range that chance leaves, and how
often a best estimate would be at most what was asked. --slip tells the least slip of a cable that these data can show: a step of one
cable's readings from a pose on is one more unknown. --lens-known leaves nothing of the lens unknown, and --joint estimates the
verification poses together with all else, from their lengths too: neither is anybody's to have, and both bound what a cleverer estimate
could gain. --floor states beside it that markers lie on a flat floor: heights within
1.5 mm and tilts within 0.3 deg, as the rig's file draws them.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import scipy.linalg
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation
from scipy.stats import norm

sys.path.insert(0, str(Path(__file__).parent))
import thesis_rig

STEP = 1e-6  # of differences, m and rad
LENS, EYE, SIZE, ANCHORS, ZEROS, MARKERS = 0, 8, 14, 15, 39, 47  # where unknowns begin; poses stand behind the markers
DRAWS = 100
EDGE = 5  # poses on either side of a slip
Z_TOLD, Z_SURE = (
    4.9,
    1.645,
)  # sigma: chance puts 1e-6 beyond, as `SEGMENT_CHANCE` asks; of a slip that is told 19 times of 20


def turned(t, step):
    """Poses (..., 4, 4) moved by (6,): along, and about the axes in which they stand."""
    out = t.copy()
    out[..., :3, 3] += step[:3]
    out[..., :3, :3] = Rotation.from_rotvec(step[3:]).as_matrix() @ t[..., :3, :3]
    return out


def inverse(t):
    """Of poses (..., 4, 4)."""
    out = np.zeros_like(t)
    out[..., :3, :3] = np.swapaxes(t[..., :3, :3], -1, -2)
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", out[..., :3, :3], t[..., :3, 3])
    out[..., 3, 3] = 1
    return out


def image(pose, marker, eye, lens, edge):
    """Corners (n, 4, 2) in pixels."""
    t = inverse(pose @ eye) @ marker
    p = np.einsum("nij,cj->nci", t[:, :3, :3], thesis_rig.square(edge)) + t[:, None, :3, 3]
    x, y = p[..., 0] / p[..., 2], p[..., 1] / p[..., 2]
    r2, p1, p2 = x * x + y * y, lens[6], lens[7]
    d = 1 + lens[4] * r2 + lens[5] * r2**2
    u = lens[0] * (x * d + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + lens[2]
    v = lens[1] * (y * d + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + lens[3]
    return np.stack([u, v], axis=-1)


def slopes(known):
    """How corners answer (n, 8, k) to pose, marker, eye (6 each), lens (8) and edge."""
    out = []
    for which, count in enumerate((6, 6, 6, 8, 1)):
        for i in range(count):
            step = STEP if which != 3 or i > 3 else 1e3 * STEP
            ends = []
            for sign in (1, -1):
                some, move = list(known), np.zeros(9 if which == 3 else 6)
                move[i] = sign * step
                some[which] = (
                    turned(known[which], move) if which < 3 else known[which] + (move if which == 3 else move[0])
                )
                ends.append(image(*some))
            out.append(((ends[0] - ends[1]) / (2 * step)).reshape(len(known[0]), 8))
    return np.split(np.stack(out, axis=-1), [6, 12, 18, 26], axis=-1)


def by_lengths(said, rig, poses, tension):
    """How lengths answer to poses (k, 8, 6) and anchors (k, 8, 3), and their sigma (k, 8): noise, and tensions known to a share."""
    b = np.einsum("kij,cj->kci", poses[:, :3, :3], rig.platform)
    way = b + poses[:, None, :3, 3] - rig.anchors
    full = np.linalg.norm(way, axis=2, keepdims=True)
    stretch = said["cable"]["elongation_per_N"] * tension
    along = way / full / (1 + stretch)[..., None]
    sigma = np.hypot(said["cable"]["length_noise"], full[..., 0] * stretch * said["cable"]["tension_known_to"])
    return np.concatenate([along, np.cross(b, along)], axis=-1), -along, sigma


def inform(said, seed, case, floor, least):
    """What all corners, lengths and priors say at the truth, I (n, n); the columns of lengths (k, 8, n) over their sigma (k, 8), that; and
    the rig, which markers are seen, and their seats."""
    rig, _, camera = thesis_rig.draw(said, seed, case)
    many = np.bincount([m for _, m, _ in rig.seen], minlength=len(rig.markers))
    rig.seen = [s for s in rig.seen if many[s[1]] >= least]
    view, marker = (np.array([s[k] for s in rig.seen]) for k in (0, 1))
    many, used = said["poses"]["calibration"], np.unique(np.append(marker, 0))
    seat = np.full(len(rig.markers), -1)
    seat[used] = np.arange(len(used)) - 1
    poses, last = MARKERS + 6 * (len(used) - 1), MARKERS + 6 * (len(used) - 1) + 6 * many
    by_pose, by_marker, by_eye, by_lens, by_edge = slopes(
        (rig.poses[view], rig.markers[marker], rig.eye, rig.lens, rig.edge)
    )
    a, row = np.zeros((len(view), 8, last)), np.arange(len(view))
    a[:, :, LENS:EYE], a[:, :, EYE:SIZE], a[:, :, SIZE:ANCHORS] = by_lens, by_eye, by_edge
    free = seat[marker] >= 0
    for j in range(6):
        a[row, :, poses + 6 * view + j] = by_pose[:, :, j]
        a[row[free], :, MARKERS + 6 * seat[marker[free]] + j] = by_marker[free, :, j]
    a = a.reshape(-1, last) / camera["corner_noise_px"]
    to_pose, to_anchor, sigma = by_lengths(said, rig, rig.poses[:many], rig.tension[:many])
    b = np.zeros((many, 8, last))
    for c in range(8):
        b[:, c, ANCHORS + 3 * c : ANCHORS + 3 * c + 3], b[:, c, ZEROS + c] = to_anchor[:, c], -1
    for k in range(many):
        b[k, :, poses + 6 * k : poses + 6 * k + 6] = to_pose[k]
    by_cable = b / sigma[..., None]
    b = by_cable.reshape(-1, last)
    prior, wide = np.full(last, np.inf), said["prior_used"]
    prior[LENS:EYE] = [wide["focal_and_centre_px"]] * 4 + [wide["distortion"]] * 4
    if case == "tight":
        prior[LENS:EYE] = [1.0] * 4 + [thesis_rig.TIGHT] * 4
    prior[EYE:SIZE] = [0.002] * 3 + [np.deg2rad(0.3)] * 3
    prior[SIZE], prior[ANCHORS:ZEROS] = 0.003 * rig.printed, 0.03
    if floor:
        for at in range(MARKERS, poses, 6):
            prior[at + 2], prior[at + 3 : at + 5] = said["markers"]["height_sd"], np.deg2rad(said["markers"]["tilt_sd"])
    return a.T @ a + b.T @ b + np.diag(1 / prior**2), by_cable, sigma, rig, used, seat


def foretell(said, seed, given):
    """Every figure in draws, by name (DRAWS,)."""
    information, _, _, rig, used, seat = inform(said, seed, given.case, given.floor, given.least)
    many, last = said["poses"]["calibration"], len(information)
    if given.lens_known:
        information[range(LENS, EYE), range(LENS, EYE)] += np.repeat([1e-3, 1e-7], 4) ** -2.0
    if given.joint:
        information = with_verification(information, *by_lengths(said, rig, rig.poses[many:], rig.tension[many:]))
    scale = 1 / np.sqrt(np.diag(information))
    root = np.linalg.cholesky(information * np.outer(scale, scale))
    rng = np.random.default_rng(seed)
    errors = scipy.linalg.solve_triangular(root.T, rng.normal(size=(len(root), DRAWS)), lower=False) * scale[:, None]
    true = rig.poses[many:]
    to_pose, to_anchor, sigma = by_lengths(said, rig, true, rig.tension[many:])
    rows = []
    for e in errors.T:
        anchors, zeros = e[ANCHORS:ZEROS].reshape(8, 3), e[ZEROS:MARKERS]
        off = zeros - np.einsum("kci,ci->kc", to_anchor, anchors) + rng.normal(size=sigma.shape) * sigma
        step = [np.linalg.lstsq(j, r, rcond=None)[0] for j, r in zip(to_pose, off, strict=True)]
        step = e[last:].reshape(-1, 6) if given.joint else step
        found = np.stack([turned(t, s) for t, s in zip(true, step, strict=True)])
        place = {
            int(m): turned(rig.markers[m], e[MARKERS + 6 * seat[m] :][:6]) if seat[m] >= 0 else rig.markers[m]
            for m in used
        }
        rows.append(thesis_rig.judge(rig, place, rig.anchors + anchors, found, np.ones(len(true)), true))
    return {k: np.array([r[k] for r in rows]) for k in rows[0] if k != "predicted"}


def with_verification(information, to_pose, to_anchor, sigma):
    """The same with verification poses as unknowns, six each, and what their lengths say."""
    last, count = len(information), len(to_pose)
    out = np.zeros((last + 6 * count,) * 2)
    out[:last, :last] = information
    for k in range(count):
        b = np.zeros((8, len(out)))
        for c in range(8):
            b[c, ANCHORS + 3 * c : ANCHORS + 3 * c + 3], b[c, ZEROS + c] = to_anchor[k, c], -1
        b[:, last + 6 * k : last + 6 * k + 6] = to_pose[k]
        b /= sigma[k, :, None]
        out += b.T @ b
    return out


def slips(said, seed, case, floor, least):
    """The sigma (8, k), m, of what a cable shows more from a pose on, beside all other unknowns: 1 / sigma^2 = s's - s'B I^-1 B's."""
    information, by_cable, noise, *_ = inform(said, seed, case, floor, least)
    many = len(by_cable)
    out = np.full((8, many), np.inf)
    starts = range(EDGE, many - EDGE + 1)
    columns, own = [], []
    for c in range(8):
        for k in starts:
            columns.append((by_cable[k:, c] / noise[k:, c, None]).sum(axis=0))
            own.append(np.sum(noise[k:, c] ** -2.0))
    columns = np.array(columns).T
    scale = 1 / np.sqrt(np.diag(information))
    root = scipy.linalg.cho_factor(information * np.outer(scale, scale))
    taken = np.sum(columns * scale[:, None] * scipy.linalg.cho_solve(root, columns * scale[:, None]), axis=0)
    out[:, EDGE : many - EDGE + 1] = (1 / np.sqrt(np.maximum(np.array(own) - taken, 1e-12))).reshape(8, -1)
    return out


def tell_slips(said, given):
    """The least slip that can be told, of every cable, from half way and at the best pose."""
    every = np.stack([slips(said, seed, given.case, given.floor, given.least) for seed in range(given.seeds)])
    half = every[:, :, every.shape[2] // 2]
    told = 1e3 * (Z_TOLD + Z_SURE)
    print(
        f"{given.case}, {given.seeds} seeds: sigma of a slip, mm, and the least that is told 19 times of 20 ({Z_TOLD} sigma)"
    )
    for c in range(8):
        best = every[:, c].min(axis=1)
        print(
            f"  c{c + 1}: half way {1e3 * np.median(half[:, c]):5.2f} ({told * np.median(half[:, c]):5.1f}), ", end=""
        )
        print(f"range of seeds {1e3 * half[:, c].min():.2f} to {1e3 * half[:, c].max():.2f}, ", end="")
        print(f"best pose {1e3 * np.median(best):5.2f} ({told * np.median(best):5.1f})")
    chance = norm.sf(Z_TOLD - 0.02 / half)
    print(f"20 mm half way: told {100 * chance.mean():.0f} % of the time; by cable", end=" ")
    print(", ".join(f"{100 * v:.0f} %" for v in chance.mean(axis=0)))


def main():
    """Prints every seed, and the median."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("rig", type=Path)
    words.add_argument("--case", default="real", choices=["real", *thesis_rig.DOMES, "narrow"])
    words.add_argument("--seeds", type=int, default=10)
    words.add_argument("--floor", action="store_true", help="state that the floor is flat")
    words.add_argument(
        "--least", type=int, default=2, help="poses that see a marker, else it is left out, as `identify` does"
    )
    words.add_argument(
        "--slip", action="store_true", help="the least slip of a cable that can be told, and nothing else"
    )
    words.add_argument("--lens-known", action="store_true", help="know the lens")
    words.add_argument("--joint", action="store_true", help="estimate verification poses together with all else")
    given = words.parse_args()
    said = YAML(typ="safe").load(given.rig.read_text(encoding="utf-8"))
    if given.slip:
        tell_slips(said, given)
        return
    draws = []
    for seed in range(given.seeds):
        draws.append(foretell(said, seed, given))
        middle = {k: float(np.median(v)) for k, v in draws[-1].items()}
        rms = np.sqrt(np.mean(draws[-1]["marker 0 mm"] ** 2))
        print(f"{seed}: {thesis_rig.figures(middle)}  marker 0 rms {rms:.2f}", flush=True)
    asked = thesis_rig.NARROW if given.case == "narrow" else thesis_rig.ASKED
    rng = np.random.default_rng(0)
    print(f"{given.case}, the median of {given.seeds} seeds at best:")
    for k in draws[0]:
        every = np.stack([d[k] for d in draws])
        medians = np.median(rng.permuted(np.tile(every, (1, 20)), axis=1), axis=0)
        low, mid, high = np.percentile(medians, [5, 50, 95])
        chance = f"  asked {asked[k]}: a chance of {100 * np.mean(medians <= asked[k]):.0f} %" if k in asked else ""
        print(f"  {k:12} {mid:6.2f}  90 % between {low:.2f} and {high:.2f}{chance}")


if __name__ == "__main__":
    main()
