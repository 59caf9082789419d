"""What the noise of lengths leaves of a robot that is known exactly: `python scripts/commissioning_bound.py RIG.yaml`.

RIG.yaml is that of `commissioning.py`. No estimator of robocal is used: how lengths answer to a pose is written in `thesis_bound.py`, and
errors of verification poses are drawn from the inverse of what the lengths say of them (Cramer and Rao). Anchors, zeros, stretch and
all else are known exactly; only the lengths of the verification itself are noisy. What is told, of campaigns of 20 rigs:

T1^-1 Ti   the pose in the frame of the first one, as table 3.3 of the thesis has it ("relative a la premiere pose mesuree")
pi - p1    the same as moves in one frame, which a scanner without a common frame cannot tell
per rig    the mean over its verification poses but the first, as the thesis' tables; the median is over 20 rigs
per pose   the median over all poses of 20 rigs

--noise states another noise of lengths (m), --readings how many readings are averaged at each pose. --calibrations N adds beside it
what the best calibration of N rigs adds (`thesis_bound.py`, some 10 s each).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parent))
import thesis_bound
import thesis_rig

ASKED_MM, ASKED_DEG, CAMPAIGN, CAMPAIGNS = 5.0, 0.75, 20, 4000


def poses_of(said, rng):
    """The verification poses of one rig, and tensions that hold them."""
    count = said["poses"]["verification"]
    nominal = np.array(said["frame_anchors_nominal"])
    platform = np.array(said["platform_anchors"])
    anchors = nominal + rng.normal(scale=0.03, size=nominal.shape)
    out = np.zeros((0, 4, 4))
    while len(out) < count:
        some = thesis_rig.draw_poses(said, rng, 4 * count)
        _, kept = thesis_rig.held(said, anchors, platform, some)
        out = np.concatenate([out, some[kept]])[:count]
    rig = argparse.Namespace(anchors=anchors, platform=platform)
    return rig, out, thesis_rig.held(said, anchors, platform, out)[0]


def views(found, true):
    """Errors of poses beside the first: (mm, deg) of T1^-1 Ti, (mm, deg) of moves, each (k - 1,)."""
    out = []
    for one in (
        lambda t: thesis_bound.inverse(t[0]) @ t[1:],
        lambda t: np.concatenate(
            [
                np.concatenate([t[1:, :3, :3] @ t[0, :3, :3].T, (t[1:, :3, 3] - t[0, :3, 3])[:, :, None]], axis=2),
                np.tile([[[0.0, 0, 0, 1]]], (len(t) - 1, 1, 1)),
            ],
            axis=1,
        ),
    ):
        a, b = one(found), one(true)
        turn = Rotation.from_matrix(a[:, :3, :3] @ np.swapaxes(b[:, :3, :3], 1, 2)).magnitude()
        out += [1e3 * np.linalg.norm(a[:, :3, 3] - b[:, :3, 3], axis=1), np.degrees(turn)]
    return out


def known(said, rigs, readings):
    """Errors (rigs, 4, poses - 1) of robots that are known exactly."""
    out = []
    for seed in range(rigs):
        rng = np.random.default_rng([seed, 39])
        rig, true, tension = poses_of(said, rng)
        to_pose, _, _ = thesis_bound.by_lengths(said, rig, true, tension)
        sigma = said["cable"]["length_noise"] / np.sqrt(readings)
        found = []
        for t, j in zip(true, to_pose, strict=True):
            covariance = sigma**2 * np.linalg.inv(j.T @ j)
            found.append(thesis_bound.turned(t, rng.multivariate_normal(np.zeros(6), covariance)))
        out.append(views(np.array(found), true))
    return np.array(out)


def tell(what, each, asked, rng):
    """The median of campaigns of 20 rigs, and how often it is at most what is asked. `each` is (rigs, values of a rig)."""
    medians = np.array([np.median(each[rng.integers(len(each), size=CAMPAIGN)].ravel()) for _ in range(CAMPAIGNS)])
    low, mid, high = np.percentile(medians, [5, 50, 95])
    chance = 100 * np.mean(medians <= asked)
    print(
        f"  {what:34} {mid:6.2f}  90 % between {low:.2f} and {high:.2f}  asked <= {asked:g}: a chance of {chance:.1f} %"
    )


def main():
    """Draws and prints."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("rig", type=Path)
    words.add_argument("--rigs", type=int, default=1000)
    words.add_argument("--noise", type=float, help="of a length, m, in place of that of the file")
    words.add_argument("--readings", type=int, default=1, help="readings of independent noise, averaged at each pose")
    words.add_argument("--calibrations", type=int, default=0, help="rigs of which the best calibration is foretold")
    given = words.parse_args()
    said = YAML(typ="safe").load(given.rig.read_text(encoding="utf-8"))
    if given.noise is not None:
        said["cable"]["length_noise"] = given.noise
    rng = np.random.default_rng(0)
    made = known(said, given.rigs, given.readings)
    print(f"a robot that is known exactly, {1e3 * said['cable']['length_noise']:g} mm of noise in a length, "
          f"{given.readings} readings a pose, {given.rigs} rigs; medians of {CAMPAIGN} rigs:")  # fmt: skip
    for name, mm, deg in (("T1^-1 Ti", 0, 1), ("pi - p1", 2, 3)):
        for way, form in (("per rig", lambda v: v.mean(axis=1, keepdims=True)), ("per pose", lambda v: v)):
            tell(f"{name} [mm], {way}", form(made[:, mm]), ASKED_MM, rng)
            tell(f"{name} [deg], {way}", form(made[:, deg]), ASKED_DEG, rng)
    if given.calibrations:
        options = argparse.Namespace(case="dome15", floor=False, least=2, lens_known=False, joint=False)
        best = [thesis_bound.foretell(said, seed, options)["first mean mm"] for seed in range(given.calibrations)]
        print(f"the best calibration of {given.calibrations} rigs beside it:")
        tell("T1^-1 Ti [mm], per rig", np.concatenate(best)[:, None], ASKED_MM, rng)


if __name__ == "__main__":
    main()
