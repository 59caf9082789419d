"""What anybody can say of a delay on KinHEC: `python scripts/hand_eye_delay_bound.py FOLDER [--tier small] [--track mixed] [--asked 2]`.

A camera with a clock of its own tells the delay by motion alone, and its noise limits how well. The bound is taken at the truth:

    I = J^T V^-1 J,    J = d T_camera_target(t_k) / d (X, Y, delay, scale),    V = C / c + s_t^2 W W^T + s_q^2 Q Q^T
    sigma(delay)^2 = (I^-1)_delay,    c = (n + 6) / (n + 8) for noise of Student's t with n degrees of freedom, else 1

C is the true noise of the camera: as drawn, that of the best pose from pixels, or that of a walk from view to view, whose changes are
then the rows. s_t is the true jitter of the clock, W the velocities in the camera; s_q is by how much the scale walks from view to view,
Q what that moves. Known exactly are the robot's path, its geometry and joints, and which views are wrong. That only adds information: no
unbiased estimate has a smaller sigma (Cramer, Rao).
`read` adds the noise of the robot's poses, as a pose between two of its log has it: an estimate that smooths the path lies between both.
A row tells, per sequence: our error and our stated sigma, the two bounds (ms), and the chance that an estimate at the lower bound is off
by less than --asked. Then: the chance that all located sequences are, and the largest error that such estimates have over them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from math import erf, sqrt
from pathlib import Path

import numpy as np
from hand_eye_tracks import io, make, pairs_of, shards_of
from kinhec.camera import CAMERAS, TARGETS, project_points

from robocal._types import Array
from robocal.errors import ModelError
from robocal.geometry import se3, so3
from robocal.prove.verdict import verdict_of
from robocal.session.vision.pose_pairs import locate_camera

STEP = 1e-6  # rad, m, s: of differences
DRAWS, DELAY = 100_000, 12


def apart(a: Array, b: Array) -> Array:
    """From poses a to b (m, 4, 4): places along the axes of what a is in, and turns about its own axes, (m, 6)."""
    turn = so3.log(np.swapaxes(a[:, :3, :3], 1, 2) @ b[:, :3, :3])
    return np.concatenate([b[:, :3, 3] - a[:, :3, 3], turn], axis=1)


def step(k: int) -> Array:
    """A small motion (4, 4) along one of six axes."""
    return np.asarray(se3.from_vector(STEP * np.eye(6)[k]))


def camera_noise(seq: io.Sequence, rows: Array) -> Array:
    """The true covariance (m, 6, 6) of what the camera measures."""
    facts = seq.manifest
    if facts["camera_noise_model"] == "pnp":
        return np.stack([_pixel_noise(seq, pose) for pose in seq.camera.T_cam_target_gt[rows]])
    place, depth, turn = (float(facts[f"camera_{n}"]) for n in ("trans_std_m", "trans_std_z_m", "rot_std_rad"))
    return np.tile(np.diag([place**2, place**2, depth**2, *3 * [turn**2]]), (len(rows), 1, 1))


def _pixel_noise(seq: io.Sequence, pose: Array) -> Array:
    camera, points = CAMERAS[seq.manifest["camera"]], TARGETS[seq.manifest["target"]].points
    here, lines = project_points(camera, pose, points)[0], []
    for k in range(6):
        there = pose @ step(k)
        if k < 3:
            there = pose.copy()
            there[k, 3] += STEP
        lines.append((project_points(camera, there, points)[0] - here).ravel() / STEP)
    j = np.array(lines)
    return np.asarray(float(seq.manifest["pixel_std"]) ** 2 * np.linalg.inv(j @ j.T))


def bounds(seq: io.Sequence) -> tuple[float, float]:
    """The least standard deviation of the delay (s), and that where poses of the robot are read from its log."""
    facts = seq.manifest
    walk, stretched = facts["camera_noise_model"] == "vo_drift", facts["world_frame"] == "vo_origin"
    rows = np.flatnonzero(seq.camera.has_measurement & ~seq.camera.outlier)
    own, when, path = seq.robot.t, seq.camera.t_gt[rows], seq.robot.T_base_ee_gt
    after = np.clip(np.searchsorted(own, when), 1, len(own) - 1)
    way = se3.to_vector(se3.inverse(path[after - 1]) @ path[after]) / (own[after] - own[after - 1])[:, None]
    flange = seq.camera.T_base_ee_gt[rows]

    def seen(x: Array = seq.X, y: Array = seq.Y, at: Array = flange, scale: float = 1.0) -> Array:
        pose = se3.inverse(at @ x) @ y if seq.eye_in_hand else se3.inverse(y) @ at @ x
        pose = se3.inverse(pose)
        pose[:, :3, 3] *= scale
        return np.asarray(se3.inverse(pose[:-1]) @ pose[1:] if walk else se3.inverse(pose))

    here = seen()
    columns = [apart(here, seen(x=seq.X @ step(k))) for k in range(6)]
    columns += [apart(here, seen(y=seq.Y @ step(k))) for k in range(6)]
    columns.append(apart(here, seen(at=flange @ se3.from_vector(-STEP * way))))
    if stretched:
        columns.append(apart(here, seen(scale=1 + STEP)))
    j = np.stack(columns, axis=2) / STEP
    dof = float(facts["student_t_dof"])
    tail = (dof + 6) / (dof + 8) if np.isfinite(dof) else 1.0
    noise = camera_noise(seq, rows)[: len(here)] / tail
    if walk:
        there = se3.inverse(seq.camera.T_cam_target_gt[rows])
        out = np.einsum("kji,kj->ki", there[:-1, :3, :3], there[1:, :3, 3]) * float(facts["scale_drift_std"])
        noise[:, :3, :3] += out[:, :, None] * out[:, None, :]
    ends = (slice(None, -1), slice(1, None)) if walk else (slice(None),)
    jitter = [float(facts["time_jitter_std_s"]) * _alone(seen, flange, here, way, end)[:, :, None] for end in ends]
    part = (when - own[after - 1]) / (own[after] - own[after - 1])
    share = np.sqrt(part**2 + (1 - part) ** 2)
    robot = np.repeat([float(facts["robot_trans_std_m"]), float(facts["robot_rot_std_rad"])], 3)
    read = []
    for late, end in zip(jitter, ends, strict=True):
        some = (_alone(seen, flange, here, np.tile(axis, (len(flange), 1)), end) for axis in np.eye(6))
        moved = [size * share[end, None] * one for size, one in zip(robot, some, strict=True)]
        read.append(np.concatenate([late, np.stack(moved, axis=2)], axis=2))
    return _least(j, noise, jitter), _least(j, noise, read)


def _alone(seen: Callable[..., Array], flange: Array, here: Array, way: Array, end: slice) -> Array:
    """What rows change by where the flange of the view at one of their ends moves along `way` (m, 6)."""
    if len(here) == len(flange):
        return apart(here, seen(at=flange @ se3.from_vector(STEP * way))) / STEP
    out = np.zeros((len(here), 6))
    for odd in (0, 1):  # a row has one odd and one even view
        some = np.arange(len(flange)) % 2 == odd
        moved = apart(here, seen(at=flange @ se3.from_vector(STEP * way * some[:, None]))) / STEP
        out[some[end]] = moved[some[end]]
    return out


def _least(j: Array, noise: Array, drawn: list[Array]) -> float:
    """The sigma of the delay from rows j (m, 6, p) of own noise (m, 6, 6), and what each view at their ends is drawn by, (m, 6, q)."""
    whole = noise + sum(d @ np.swapaxes(d, 1, 2) for d in drawn)
    white = np.zeros_like(j)
    factor = np.linalg.cholesky(whole[0])
    white[0] = np.linalg.solve(factor, j[0])
    for k in range(1, len(j)):
        beside = np.linalg.solve(factor, drawn[1][k - 1] @ drawn[0][k].T) if len(drawn) > 1 else np.zeros((6, 6))
        factor = np.linalg.cholesky(whole[k] - beside.T @ beside)
        white[k] = np.linalg.solve(factor, j[k] - beside.T @ white[k - 1])
    information = np.einsum("kia,kib->ab", white, white)
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    keep = values > 1e-12 * values.max()  # a walk does not tell where it began
    return float(np.sqrt(np.sum(vectors[DELAY, keep] ** 2 / values[keep])) / scale[DELAY])


def ours(seq: io.Sequence) -> tuple[str, float, float]:
    """Verdict, error and sigma of the delay, s."""
    try:
        found = locate_camera(pairs_of(seq))
    except ModelError:
        return "refused", np.nan, np.nan
    late, sigma = found.delay or (np.nan, np.nan)
    return verdict_of(found.decision).status, abs(late - seq.time_offset), sigma


def chance(sigma: float, asked: float) -> float:
    """That a Gaussian error is below."""
    return erf(asked / sigma / sqrt(2))


def main() -> None:
    """The table."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("folder", type=Path)
    words.add_argument("--tier", default="small")
    words.add_argument("--track", default="mixed")
    words.add_argument("--asked", type=float, default=2.0, help="ms")
    words.add_argument(
        "--least", type=float, default=0.3, help="ms: sequences with a lower bound than this are left out of the rows"
    )
    given = words.parse_args()
    root = make(given.folder, given.tier)
    print("| sequence | verdict | error | stated sigma | least | read | chance below |\n|---|---|---|---|---|---|---|")
    kept = []
    for shard in shards_of(root, given.track):
        for row in io.read_shard_manifest(shard):
            seq = io._load_from_row(root, row)
            if seq.synchronous or np.count_nonzero(seq.camera.has_measurement) < 3:
                continue
            least, read = (1e3 * s for s in bounds(seq))
            status, error, sigma = ours(seq)
            if status == "located":
                kept.append((1e3 * error, least, read))
            if max(least, read) >= given.least or status != "located":
                told = f"{seq.id} | {status} | {1e3 * error:.2f} | {1e3 * sigma:.2f} | {least:.2f} | {read:.2f}"
                print(f"| {told} | {100 * chance(least, given.asked):.1f} % |", flush=True)
    error, least, read = np.array(kept).T
    for name, sigma in (("least", least), ("read", read)):
        every = float(np.prod([chance(s, given.asked) for s in sigma]))
        worst = np.abs(np.random.default_rng(0).normal(size=(DRAWS, len(sigma))) * sigma).max(axis=1)
        low, middle, high = np.percentile(worst, [5, 50, 95])
        print(f"{name}: all {len(sigma)} located below {given.asked:g} ms: {100 * every:.2f} %;", end=" ")
        print(f"largest error {middle:.2f} ms, 5 to 95 % {low:.2f} to {high:.2f}")
    print(
        f"asked {given.asked:g} ms; ours: {np.sum(error < given.asked)} of {len(error)} below, largest {error.max():.2f} ms"
    )


if __name__ == "__main__":
    main()
