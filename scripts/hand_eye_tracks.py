"""How well hand-eye calibration does on KinHEC: `python scripts/hand_eye_tracks.py FOLDER [--tier smoke|small] [--limit SECONDS]`.

KinHEC (PyPI, extra `oracles`) draws robots, cameras and their noise, and has eleven solvers and a scorer. Its sequences are made in
FOLDER, and every shard of them is answered once: a run that was stopped goes on where it was. `--limit` stops before a further shard.
FOLDER/TIER-answers keeps what was found of each: without its `*.answers.json` the solvers are not asked again.
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
from collections.abc import Callable, Mapping
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


def of_shard(root: Path, shard: Path, kept: Path, ask: Callable[[io.Sequence, int], Answer]) -> list[Answer]:
    """What is said of the sequences of a shard, from the file where it is kept, else anew."""
    if kept.exists():
        return list(json.loads(kept.read_text()))
    out = [ask(io._load_from_row(root, row), k) for k, row in enumerate(io.read_shard_manifest(shard))]
    whole = kept.with_suffix(".part")
    whole.write_text(json.dumps(out))
    whole.replace(kept)  # a run that is stopped leaves whole shards alone
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
    words.add_argument("--limit", type=float, default=np.inf)
    given = words.parse_args()
    began, root, kept = time.monotonic(), given.folder / given.tier, given.folder / f"{given.tier}-answers"
    kept.mkdir(parents=True, exist_ok=True)
    if not (root / "sequences.parquet").exists():
        pipeline.generate_dataset(given.tier, root, work_dir=given.folder / "work", write_card=False)
    tracks: dict[str, list[Answer]] = {}
    left = 0
    for shard in sorted((root / "robot").glob("*.parquet")):
        places = [kept / f"{shard.stem}.{what}.json" for what in ("solvers", "answers")]
        if not all(p.exists() for p in places) and time.monotonic() - began > given.limit:
            left += 1
            continue
        known, found = (of_shard(root, shard, p, ask) for p, ask in zip(places, (others, answer), strict=True))
        for one, solvers in zip(found, known, strict=True):
            tracks.setdefault(one["track"], []).append({**one, "solvers": solvers})
    tell(tracks)
    if left:
        print(f"{left} shards are left: run it again")


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
