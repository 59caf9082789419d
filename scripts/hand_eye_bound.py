"""What anybody can reach on KinHEC's `robot_error`: `python scripts/hand_eye_bound.py FOLDER [--tier smoke|small] [--solvers]`.

The track's robots err in each DH length and angle (a Gaussian for each sequence), and in their joint readings (a Gaussian for each pose).
Poses are reported by the nominal model; the camera has noise of 2 mrad and 1, 1, 3 mm. All of these are in the sequence's own settings.

    x = argmin |V^-1/2 (r + J x)|^2 + |g / s|^2,    V = C + q^2 J_q J_q^T        of frames and DH errors g

With the true noise C, the true spread q of the joints and s of the DH numbers, started at the truth, this is the best linear estimate that
there is; nobody knows these. Its expected error of X is drawn from its covariance. A row tells, of the track's sequences, the medians (mm,
deg):
ours       by `locate_camera`, which frees the arm where residuals show its errors, and knows none of these numbers
oracle     of that estimate, on the same sequences
expected   of that estimate, over drawn noise: median, and the 5 and 95 % of medians of as many sequences
below      the chance that such a median is below --asked
best       of KinHEC's eleven solvers, with --solvers, and the median ratios of both errors, sequence by sequence: ours and the oracle's
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from hand_eye_tracks import arm_of, benchmark, io, make, metrics, others, pairs_of, shards_of

from robocal.geometry import se3, so3
from robocal.measure.base import problem
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.parameters import FRAME_SYMBOLS
from robocal.session.vision.pose_pairs import locate_camera

CAMERA = (0.001, 0.001, 0.003, 0.002, 0.002, 0.002)  # m, rad: level c2
DRAWS, STEPS, SMALL = 20_000, 4, 1e-6


def spread(manifest):
    """Standard deviations of joints (rad), DH lengths (m) and DH angles (rad)."""
    told = dict(part.split("=") for part in manifest["level"].split("|"))
    angle = float(np.radians(float(told.get("dh_ang_deg", 0))))
    return float(told.get("joint_std", 1e-4)), 1e-3 * float(told.get("dh_len_mm", 0)), angle


def best_linear(seq):
    """The errors of X (mm, deg) of the best linear estimate, and its covariance (6, 6) (m, rad, turns about its own axes)."""
    joint, length, angle = spread(seq.manifest)
    jointed = arm_of(seq, seq.robot.T_base_ee_meas[seq.camera.has_measurement])
    machine = jointed.machine
    machine = machine.with_table(machine.table.with_free(machine.geometric))
    seen = seq.camera.T_cam_target_meas[seq.camera.has_measurement]
    count = len(seen)
    hand, base = ("tool", "base") if seq.eye_in_hand else ("base", "tool")
    rows = Observations(
        "pose", np.arange(count), se3.to_vector(seen), np.tile(CAMERA, (count, 1)),
        frame=Frame("camera", free=(True,) * 6, mount=hand), targets=(Frame("board", free=(True,) * 6, mount=base),),
        target=np.zeros(count, dtype=np.int64),
    )  # fmt: skip
    truth = (seq.X, seq.Y) if seq.eye_in_hand else (se3.inverse(seq.Y), seq.X)
    places = zip(("camera", "board"), map(se3.to_vector, truth), strict=True)
    start = {f"{name}.{s}": v for name, place in places for s, v in zip(FRAME_SYMBOLS, place.tolist(), strict=True)}
    made = problem(
        machine, DataSet(Configurations(tuple(map(str, range(count))), joints=jointed.joints), (rows,)), values=start
    )
    names = list(made.free)
    theta = [i for i, n in enumerate(names) if n.endswith(".theta")]
    known = np.array([length if made.table[n].unit == "m" else angle for n in names])
    arm = np.array([n in machine.table for n in names])
    scale = np.where(arm, np.maximum(known, 1e-9), 1.0)
    x = made.start.copy()
    moved = np.zeros(len(names))
    for _ in range(STEPS):
        lin = made.linearize(x)
        noise = np.eye(6 * count)
        for c in range(count):
            some = slice(6 * c, 6 * c + 6)
            noise[some, some] += joint**2 * lin.j[some][:, theta] @ lin.j[some][:, theta].T
        weighed = np.linalg.solve(noise, np.column_stack([lin.j * scale, lin.r]))
        normal = (lin.j * scale).T @ weighed[:, :-1] + np.diag(arm.astype(float))
        step = scale * np.linalg.solve(normal, -(lin.j * scale).T @ weighed[:, -1] - np.where(arm, moved / scale, 0.0))
        x, moved = made.retract(x, step[None]), moved + step
    covariance = np.linalg.inv(normal) * np.outer(scale, scale)
    found = dict(zip(made.table.names, x[0].tolist(), strict=True))
    vector = np.array([found[f"camera.{s}"] for s in FRAME_SYMBOLS])
    error = metrics.calibration_errors(se3.from_vector(vector), seq.X, seq.Y, seq.Y)
    at = [names.index(f"camera.{s}") for s in FRAME_SYMBOLS]
    turns = np.eye(6)
    own = so3.exp(vector[3:])
    for k in range(3):
        turns[3:, 3 + k] = so3.log(own.T @ so3.exp(vector[3:] + SMALL * np.eye(3)[k])) / SMALL
    return (error["X_trans_err_mm"], error["X_rot_err_deg"]), turns @ covariance[np.ix_(at, at)] @ turns.T


def main():
    """The table."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("folder", type=Path)
    words.add_argument("--tier", default="small")
    words.add_argument("--asked", type=float, default=0.49)
    words.add_argument("--solvers", action="store_true")
    given = words.parse_args()
    root = make(given.folder, given.tier)
    shards = shards_of(root, "robot_error")
    seqs = [io._load_from_row(root, row) for shard in shards for row in io.read_shard_manifest(shard)]
    ours, oracle, roots, solvers = [], [], [], []
    for k, seq in enumerate(seqs):
        found = locate_camera(pairs_of(seq))
        x = found.camera if seq.eye_in_hand else found.target
        error = metrics.calibration_errors(x, seq.X, seq.Y, seq.Y)
        ours.append((error["X_trans_err_mm"], error["X_rot_err_deg"]))
        error, covariance = best_linear(seq)
        oracle.append(error)
        roots.append(np.linalg.cholesky(covariance))
        solvers.append(others(seq, k) if given.solvers else {})
    ours, oracle, names = np.array(ours), np.array(oracle), ("mm", "deg")
    normal = np.random.default_rng(0).normal(size=(DRAWS, len(seqs), 6))
    drawn = np.einsum("sij,dsj->dsi", np.array(roots), normal)
    sizes = 1e3 * np.linalg.norm(drawn[..., :3], axis=2), np.degrees(np.linalg.norm(drawn[..., 3:], axis=2))
    for k, (unit, size) in enumerate(zip(names, sizes, strict=True)):
        medians = np.median(size, axis=1)
        low, middle, high = np.percentile(medians, [5, 50, 95])
        print(
            f"{len(seqs)} sequences: ours {np.median(ours[:, k]):.3f}, oracle {np.median(oracle[:, k]):.3f} {unit};",
            end=" ",
        )
        print(f"expected {middle:.3f} {unit}, 5 to 95 %: {low:.3f} to {high:.3f}")
        if unit == "mm":
            below = 100 * np.mean(medians <= given.asked)
            print(f"chance of a median below {given.asked:g} mm: {below:.2f} %")
        if given.solvers:
            errors = {s: np.array([one[s][k] if s in one else np.nan for one in solvers]) for s in benchmark.SOLVERS}
            best = min(errors, key=lambda s: np.nanmedian(errors[s]))
            paired = [np.nanmedian(some[:, k] / errors[best]) for some in (ours, oracle)]
            chance = np.mean(np.nanmedian(size / errors[best], axis=1) <= 1)
            print(
                f"best of KinHEC's solvers: {np.nanmedian(errors[best]):.3f} {unit} ({best}); paired: ours {paired[0]:.3f},",
                end=" ",
            )
            print(f"oracle {paired[1]:.3f}; of drawn oracles {100 * chance:.1f} % have at most 1.0")
    levels = dict.fromkeys(s.manifest["level"] for s in seqs)
    for level in levels:
        some = [i for i, s in enumerate(seqs) if s.manifest["level"] == level]
        print(f"  {level}: expected {np.median(sizes[0][:, some]):.2f} mm, ours {np.median(ours[some, 0]):.2f}")


if __name__ == "__main__":
    main()
