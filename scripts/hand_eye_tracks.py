"""How well hand-eye calibration does on KinHEC: `python scripts/hand_eye_tracks.py FOLDER [--tier smoke|small] [--shard i/n]`.

KinHEC (PyPI, extra `oracles`) draws robots, cameras and their noise, and has eleven solvers and a scorer. Its sequences are made in
FOLDER, and every one is answered once: FOLDER/TIER-answers has a line for each, so a run that was stopped goes on where it was, on any
number of processes. Without its `answers*.jsonl` the solvers are not asked again. For many cores:
    --make            makes the sequences alone
    --shard i/n       answers every n-th sequence from the i-th on, i from 0, and prints no table
    --track NAME      one track alone
    --pool            the table of what was answered, and how many are left
`--limit SECONDS` stops before a further sequence.
A row tells, per track and on the sequences that are answered:
answered   of all, those with the verdict `located`; what the others lack
ours       median error of X, mm and deg
best       the solver with the least median error of all, and that error; in `temporal` it is told the true delay
paired     median of the ratios of both errors, sequence by sequence
delay      the largest error of the delay (ms)
sigma      share of the sequences whose error of place is below two standard deviations of its length, as told
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from robocal._types import Array
from robocal.arms.conventions import chain
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.geometry.pose_path import PosePath
from robocal.measure.reach import reach
from robocal.prove.verdict import verdict_of
from robocal.session.vision.arm_errors import JointedArm
from robocal.session.vision.pose_pairs import CAMERA, TARGET, PosePairs, locate_camera

try:
    from kinhec import benchmark, io, metrics, pipeline
    from kinhec.robots import ROBOTS
except ImportError:
    sys.exit("hand_eye_tracks needs KinHEC, which is not installed: pip install 'robocal[oracles]'")

Answer = dict[str, Any]
SAME = 1e-6  # tolerance: of poses that are computed twice


def arm_of(seq: io.Sequence, machine: Array) -> JointedArm | None:
    """The robot by the rows of its maker, with the joint values that were measured; None where the poses are not computed from these, for
    then they are two measurements of one thing."""
    robot = ROBOTS[seq.manifest["robot"]]
    if seq.robot.q_meas is None or robot.dof == 0:
        return None
    lines = zip(robot.theta_offset, robot.d, robot.a, robot.alpha, robot.sign.tolist(), strict=True)
    rows = [
        {"name": f"j{i + 1}", "theta": a, "d": b, "a": c, "alpha": d, "gain": g, "limits": (-2 * np.pi, 2 * np.pi)}
        for i, (a, b, c, d, g) in enumerate(lines)
    ]
    convention = {"standard": "dh", "modified": "mdh"}[robot.convention]
    made = chain(robot.name, convention, rows, tool=se3.to_vector(robot.tool_matrix).tolist())
    joints = seq.robot.q_meas[seq.camera.has_measurement]
    same = np.abs(reach(made, joints, (), {})[0] - machine).max() < SAME
    return JointedArm(made, joints) if same else None


def pairs_of(seq: io.Sequence) -> PosePairs:
    """What a user has of a sequence: measured poses, the robot's own, and their times; nothing of the truth."""
    told = seq.camera.has_measurement
    metric = seq.manifest["world_frame"] == "target"  # else the camera saw no target of known size
    seen, machine = seq.camera.T_cam_target_meas[told], seq.robot.T_base_ee_meas
    if seq.synchronous:
        return PosePairs(seen, seq.eye_in_hand, machine[told], metric=metric, arm=arm_of(seq, machine[told]))
    return PosePairs(seen, seq.eye_in_hand, PosePath(seq.robot.t, machine), seq.camera.t[told], metric=metric)


def answer(seq: io.Sequence, seed: int) -> Answer:
    """What is found of a sequence, and what KinHEC's scorer says of it."""
    facts = {n: seq.manifest[n] for n in ("sequence_id", "track", "level", "outlier_fraction")}
    began = time.process_time()
    try:
        found = locate_camera(pairs_of(seq))
        verdict = verdict_of(found.decision)
    except ModelError as error:
        return {**facts, "status": "refused", "why": [str(error)], "cpu": time.process_time() - began}
    spent = time.process_time() - began
    x, y = (found.camera, found.target) if seq.eye_in_hand else (found.target, found.camera)
    errors = metrics.calibration_errors(x, seq.X, y, seq.Y)
    names, covariance = (found.arm or found.decision).spread
    own = CAMERA if seq.eye_in_hand else TARGET
    sigma = np.sqrt(sum(covariance[i, i] for i in (names.index(f"{own}.{s}") for s in "xyz")))
    late = None if found.delay is None else 1e3 * abs(found.delay[0] - seq.time_offset)
    told = {"mm": errors["X_trans_err_mm"], "deg": errors["X_rot_err_deg"], "delay": late, "sigma": 1e3 * float(sigma)}
    return {**facts, "status": verdict.status, "why": [r.code for r in verdict.reasons], "cpu": spent, **told}


def others(seq: io.Sequence, seed: int) -> Answer:
    """Errors (mm, deg) of the eleven solvers, with the true delay."""
    rows = benchmark.evaluate_sequence(seq, list(benchmark.SOLVERS), rng=np.random.default_rng(seed))
    return {r["solver"]: (r["X_trans_err_mm"], r["X_rot_err_deg"]) for r in rows if r["ok"]}


def make(folder: Path, tier: str) -> Path:
    """The sequences, made where they are not there."""
    root = folder / tier
    if not (root / "sequences.parquet").exists():
        pipeline.generate_dataset(tier, root, work_dir=folder / "work", write_card=False)
    return root


def shards_of(root: Path, track: str | None) -> list[Path]:
    """The files of sequences, of all tracks or one."""
    return sorted((root / "robot").glob(f"{track or '*'}-*.parquet"))


def known(kept: Path, what: str) -> dict[str, Answer]:
    """What was answered, by sequence; the last line of a run that was stopped may be half a line."""
    out = {}
    for place in sorted(kept.glob(f"{what}*.jsonl")):
        for line in place.read_text().splitlines():
            if line.endswith("}"):
                out |= json.loads(line)
    return out


def summary(track: str, answers: list[Answer]) -> str:
    """A row of the table."""
    good = [a for a in answers if a["status"] == "located"]
    lacks = Counter(a["why"][0] for a in answers if a["status"] != "located")
    why = ", ".join(f"{n} {code}" for code, n in lacks.most_common())
    words = f"| {track} | {len(good)} of {len(answers)}{f' ({why})' if why else ''} "
    if not good:
        return f"{words}|{' |' * 8}"
    ours = np.array([(a["mm"], a["deg"]) for a in good])
    told = {s for a in good for s in a["solvers"]}
    nan = (np.nan, np.nan)
    errors = {s: np.array([a["solvers"].get(s, nan) for a in good]) for s in told}
    cells = []
    for k, unit in enumerate(("mm", "deg")):
        best = min(errors, key=lambda s: float(np.nanmedian(errors[s][:, k])))
        paired = float(np.nanmedian(ours[:, k] / errors[best][:, k]))
        cells.append(
            f"{np.median(ours[:, k]):.3g} {unit} | {np.nanmedian(errors[best][:, k]):.3g} {unit} ({best}) | {paired:.2f}"
        )
    delays = [a["delay"] for a in good if a["delay"] is not None]
    held = np.mean([a["mm"] < 2 * a["sigma"] for a in good if "sigma" in a] or [np.nan])
    late = f"{max(delays):.2f} ms" if delays else ""
    return f"{words}| {' | '.join(cells)} | {late} | {100 * held:.0f} % |"


def main() -> None:
    """Makes, answers and tells."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("folder", type=Path)
    words.add_argument("--tier", default="smoke")
    words.add_argument("--track")
    words.add_argument("--shard", default="0/1")
    words.add_argument("--make", action="store_true")
    words.add_argument("--pool", action="store_true")
    words.add_argument("--limit", type=float, default=np.inf)
    given = words.parse_args()
    began, kept = time.monotonic(), given.folder / f"{given.tier}-answers"
    if given.shard != "0/1" and not (given.folder / given.tier / "sequences.parquet").exists():
        sys.exit("many processes would make the sequences at once: run --make first")
    root = make(given.folder, given.tier)
    if given.make:
        return
    kept.mkdir(parents=True, exist_ok=True)
    part, parts = map(int, given.shard.split("/"))
    rows = [(k, row) for shard in shards_of(root, given.track) for k, row in enumerate(io.read_shard_manifest(shard))]
    asks = {"solvers": others, "answers": answer}
    done = {what: known(kept, what) for what in asks}
    for k, row in [] if given.pool else rows[part::parts]:
        lacking = [what for what in asks if row["sequence_id"] not in done[what]]
        if not lacking:
            continue
        if time.monotonic() - began > given.limit:
            break
        seq = io._load_from_row(root, row)
        for what in lacking:
            line = {row["sequence_id"]: asks[what](seq, k)}
            done[what] |= line
            with (kept / f"{what}-{part}-of-{parts}.jsonl").open("a") as file:
                file.write(f"{json.dumps(line)}\n")
    if parts > 1 and not given.pool:
        return
    tracks: dict[str, list[Answer]] = {}
    names = [row["sequence_id"] for _, row in rows]
    for name in (n for n in names if all(n in some for some in done.values())):
        one = done["answers"][name]
        tracks.setdefault(one["track"], []).append({**one, "solvers": done["solvers"][name]})
    tell(tracks)
    if left := len(names) - sum(map(len, tracks.values())):
        print(f"{left} of {len(names)} sequences are left: run it again")


def tell(tracks: Mapping[str, list[Answer]]) -> None:
    """The table."""
    print(f"| track | answered | ours | best | paired | ours | best | paired | delay | sigma |\n|---|{'---|' * 9}")
    for track, answers in sorted(tracks.items()):
        print(summary(track, answers))
    flips = [a for a in tracks.get("outliers", ()) if "planar_flip" in a["level"] and a["outlier_fraction"] == 0.2]
    if flips:
        print(f"outliers, a fifth flipped: at most {max(a['mm'] for a in flips):.2f} mm")
    every = [a["cpu"] for answers in tracks.values() for a in answers]
    print(f"CPU time of an answer: {np.median(every):.2f} s median, {max(every):.2f} s at most")


if __name__ == "__main__":
    main()
