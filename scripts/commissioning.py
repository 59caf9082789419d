"""A cable robot commissioned from a rough geometry, many times: `python scripts/commissioning.py RIG.yaml FOLDER --seeds 0-19`.

RIG.yaml is `thesis-rig.yaml`, or another rig of `robocal cable rig`. Each seed is a rig of its own: the plant moves under a controller that
believes the rough geometry, `identify` makes a calibration of what is recorded, the controller gets it, and ten poses verify it. The lens
is calibrated with k1 wrong by 0.015. --case says how anchors are known and corners are made:
tape       by a tape measure, 30 mm a coordinate (52 mm in space); corners are projected
beacons    by ranges between beacons, 0.1 m each
images     by tape; corners are found in drawn images
Relative to the first pose is T1^-1 Ti, the pose in the frame of the first one, as table 3.3 of the thesis has it. The same is told of
    calibration alone   the identified robot, with lengths and tensions of the verification that have no noise
    a known robot       the true robot, with the same noise; `commissioning_bound.py` has this of thousands of rigs
    camera              one image in the identified map
    two stages          as the thesis writes it, from the same records: a map and camera poses first, then the robot
                        (`thesis_rig.two_stages`), with hand-eye as stated (`staged`) or found there (`staged free`)

A seed is one JSON file in FOLDER/rows; what stands there is not computed again, so a campaign may end at any time, and go on. `--shard i/n`
does every n-th seed. A seed that fails is told and tried again the next time. `--pool FOLDER` computes nothing and prints of every case
what was asked and measured; `--table FILE` writes the rows beside it as CSV.
"""

from __future__ import annotations

import argparse
import csv
import json
import shutil
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from ruamel.yaml import YAML

import robocal as rc
from robocal.apply.verification import PoseErrors, errors, relative
from robocal.cables.cable_lengths import inverse
from robocal.cables.forward import forward
from robocal.files.cable.rig_spec import read_cable_rig

sys.path.insert(0, str(Path(__file__).parent))
import thesis_rig

CASES = {"tape": {}, "beacons": {"anchors": "beacons"}, "images": {"images": True}}
WRONG = 0.015  # of k1
THESIS = "25.8 to 30.5"
ASKED = (
    # what, key, how it is pooled, least, most
    ("error / what the run states, rms", "normalised", "rms", 0.85, 1.15),
    ("relative to the first pose, T1^-1 Ti [mm]", "first mm", "median", 0.0, 5.0),
    ("relative to the first pose, T1^-1 Ti [deg]", "first deg", "median", 0.0, 0.75),
    ("moves from the first pose, pi - p1 [mm]", "move mm", "median", 0.0, 5.0),
    ("moves from the first pose, Ri R1^T [deg]", "move deg", "median", 0.0, 0.75),
    ("calibration alone, T1^-1 Ti [mm]", "alone first mm", "median", 0.0, 5.0),
    ("calibration alone, T1^-1 Ti [deg]", "alone first deg", "median", 0.0, 0.75),
    ("least tension of the plant [N]", "least N", "min", None, None),
    ("greatest tension of the plant [N]", "greatest N", "max", None, None),
)


FLOORS = (
    ("a known robot, T1^-1 Ti [mm]", "floor first mm"),
    ("a known robot, T1^-1 Ti [deg]", "floor first deg"),
    ("a known robot, in its own frame [mm]", "floor mm"),
    ("camera, T1^-1 Ti [mm]", "camera first mm"),
    ("camera, T1^-1 Ti [deg]", "camera first deg"),
    ("CPU of a seed [s]", "cpu s"),
)


def one(given, case: str, seed: int) -> dict:
    """A seed: commissioned, and what came of it."""
    folder = given.folder / case / str(seed)
    folder.mkdir(parents=True, exist_ok=True)
    said = YAML(typ="safe").load(given.rig.read_text(encoding="utf-8"))
    said["camera"]["k1_wrong_by"] = WRONG
    rig = folder / "rig.yaml"
    with rig.open("w", encoding="utf-8") as file:
        YAML(typ="safe").dump(said, file)
    began = time.process_time()
    made = rc.cable.rig(rig, output=folder, seed=seed, force=True, lists=1, poses=given.poses, **CASES[case]).result
    row: dict = {
        "case": case,
        "seed": seed,
        "said": [str(r) for r in made.remarks],
        "cpu s": time.process_time() - began,
    }
    if not made.done:
        return row | {"failed": "; ".join(row["said"])}
    done, spec = made.done[0], read_cable_rig(rig)
    columns = {c.name: c.values[0] for c in made.listing.columns}
    row |= {
        "verdict": columns["verdict"], "normalised": columns["normalised"], "first mm": columns["true_position_first"],
        "first deg": columns["true_orientation_first"], "move mm": columns["true_position_move"],
        "move deg": columns["true_orientation_move"], "least N": done.tension[0], "greatest N": done.tension[1],
        "limits N": list(spec.model.tensions.allowed_N), "motions": made.motions,
        "start mm": 1e3 * float(np.linalg.norm(made.world.belief.anchors - made.world.true.a, axis=1).mean()),
    }  # fmt: skip
    row |= without_noise(made, done)
    good = np.isfinite(done.verified.camera).all(axis=(1, 2))
    if good[0] and good.sum() > 1:
        row |= two("camera first", relative(done.verified.camera[good], done.verified.recording.true[good]))
    # the floor: the same noise, of a robot that is known exactly
    true, rng = done.verified.recording.true, np.random.default_rng([seed, 39])
    read = inverse(made.world.true, true)[0] + rng.normal(scale=spec.model.cable.length_noise, size=(len(true), 8))
    known = forward(made.world.true, read, true).pose
    row |= two("floor first", relative(known, true)) | two("floor", errors(known, true))
    if not given.no_two_stages and case != "beacons":
        row |= two_stages(made, done, said, folder / "two")
    if case == "images":
        shutil.rmtree(folder / "A" / "images", ignore_errors=True)
    return row


def two(what: str, found: PoseErrors) -> dict:
    """Means of errors, mm and deg."""
    return {
        f"{what} mm": 1e3 * float(found.position.mean()),
        f"{what} deg": float(np.degrees(found.orientation.mean())),
    }


def without_noise(made, done) -> dict:
    """What calibration alone is off by: poses by lengths and tensions of the plant, without noise.

    Where encoders begin to count is not recorded: it is the mean of all recorded lengths beside the true ones, to 0.2 mm.
    """
    true, robot = made.world.true, done.calibration.robot
    parts = (done.calibration.recording, done.verified.recording)
    exact = [inverse(true, r.true, r.tension)[0] for r in parts]
    begin = np.concatenate([e - r.readings for e, r in zip(exact, parts, strict=True)]).mean(axis=0)
    poses = forward(robot, exact[1] - begin, parts[1].asked, tension=parts[1].tension).pose
    return two("alone first", relative(poses, parts[1].true)) | two("alone", errors(poses, parts[1].true))


def two_stages(made, done, said: dict, folder: Path) -> dict:
    """The way in two stages on the same records, relative to the first verification pose."""
    folder.mkdir(parents=True, exist_ok=True)
    world, recording, verified = made.world, done.calibration.recording, done.verified.recording
    count = len(recording.ids)
    said = said | {"poses": said["poses"] | {"calibration": count}}
    names = [f"c{i + 1}" for i in range(8)]
    pulls = [f"t{i + 1} [N]" for i in range(8)]
    rows = [[f"p{i}", *(f"{v:.6f}" for v in (*recording.readings[i], *recording.stated[i]))] for i in range(count)]
    write(folder / "lengths.csv", ["id", *(f"{n} [m]" for n in names), *pulls], rows)
    rows = [
        [f"v{i}", *(f"{v:.6f}" for v in (*verified.readings[i], *verified.stated[i]))] for i in range(len(verified.ids))
    ]
    write(folder / "verify.csv", ["id", *(f"{n} [m]" for n in names), *(f"{n}.tension [N]" for n in names)], rows)
    rows = [
        [f"p{p}", f"m{m}", k, f"{u:.4f}", f"{v:.4f}"]
        for p, m, uv in recording.corners
        for k, (u, v) in enumerate(uv.tolist())
    ]
    write(folder / "pixels.csv", ["id", "marker", "corner", "u", "v"], rows)
    for name in ("robot.yaml", "lengths.yaml"):
        shutil.copy(folder.parent / "A" / name, folder / name)
    rig = SimpleNamespace(
        markers=world.markers, printed=said["markers"]["size"], edge=world.edge, anchors=world.true.a, platform=world.true.b,
        poses=np.concatenate([recording.true, verified.true]), given_eye=world.spec.eye, given_lens=world.stated_lens, eye=world.eye,
    )  # fmt: skip
    camera = {"resolution": said["camera"]["resolution"], "corner_noise_px": said["camera"]["corner_noise_px"]}
    try:
        found = thesis_rig.two_stages(said, rig, folder, camera, mildly=False)
    except Exception as failure:
        return {"two stages failed": f"{type(failure).__name__}: {failure}"[:200]}
    return {
        f"two stages {word} {key}": found[word][key]
        for word in ("staged", "staged free")
        for key in ("first mean mm", "marker 0 mm")
    }


def write(path: Path, head: list, rows: list) -> None:
    """A CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(head)
        out.writerows(rows)


def table(place: Path, rows: list[dict]) -> None:
    """The rows as CSV, a line for each seed of each case."""
    keys = list(dict.fromkeys(k for r in rows for k, v in r.items() if k != "said" and not isinstance(v, list)))
    shown = ([f"{r[k]:.4g}" if isinstance(r.get(k), float) else r.get(k, "") for k in keys] for r in rows)
    write(place, keys, list(shown))


def pool(folder: Path, place: Path | None = None) -> None:
    """Tells, of every case in a folder of results, what was asked and measured."""
    rows = [json.loads(p.read_text(encoding="utf-8")) for p in folder.rglob("rows/*.json")]
    rows.sort(key=lambda r: (r["case"], r["seed"]))
    if place is not None:
        table(place, rows)
    for case in dict.fromkeys(r["case"] for r in rows):
        every = [r for r in rows if r["case"] == case]
        some = [r for r in every if "failed" not in r]
        for r in every:
            if "failed" in r:
                print(f"{case} {r['seed']} STOPPED: {r['failed']}")
        if not some:
            continue
        start = np.median([r["start mm"] for r in some])
        print(
            f"{case}: {len(some)} of {len(every)} seeds, anchors wrong by {start:.0f} mm (median), the thesis {THESIS} mm"
        )
        for what, key, how, least, most in ASKED:
            values = np.array([r[key] for r in some])
            got = {"rms": lambda v: np.sqrt((v**2).mean()), "median": np.median, "min": np.min, "max": np.max}[how](
                values
            )
            if most is None:
                low, high = some[0]["limits N"]
                good, asked = low <= got <= high, f"{low:g} to {high:g}"
            else:
                good, asked = least <= got <= most, f"{least:g} to {most:g}" if least else f"<= {most:g}"
            print(f"  {what:44} asked {asked:14} measured {got:7.3f}  {'met' if good else 'NOT MET'}")
        for key in ("two stages staged first mean mm", "two stages staged free first mean mm"):
            values = [r[key] for r in some if key in r]
            if values:
                good = "met" if np.median(values) >= 25 else "NOT MET"
                print(f"  {key:44} asked {'>= 25':14} measured {np.median(values):7.3f}  {good}")
        for what, key in FLOORS:
            values = [r[key] for r in some if key in r]
            if values:
                print(f"  {what:44} {'':20} measured {np.median(values):7.3f}")


def shard_of(word: str) -> tuple[int, int]:
    """`0/4`."""
    part, parts = (int(v) for v in word.split("/"))
    if not 0 <= part < parts:
        raise ValueError(word)
    return part, parts


def main() -> None:
    """Commissions and prints."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("rig", type=Path, nargs="?")
    words.add_argument("folder", type=Path, nargs="?")
    words.add_argument("--case", default="tape", choices=CASES)
    words.add_argument(
        "--seeds", type=thesis_rig.seeds_of, default=thesis_rig.seeds_of("0-19"), help="0-19, or 0,3,5-8"
    )
    words.add_argument("--poses", type=int, help="calibration poses, in place of those of the file")
    words.add_argument(
        "--shard", type=shard_of, default=(0, 1), metavar="i/n", help="of n equal parts of the seeds the i-th, from 0"
    )
    words.add_argument("--table", type=Path, help="write the rows of all seeds as CSV")
    words.add_argument("--no-two-stages", action="store_true", help="leave out the way of the thesis")
    words.add_argument("--pool", type=Path, help="compute nothing: tell what was asked and measured")
    given = words.parse_args()
    if given.pool:
        pool(given.pool, given.table)
        return
    if given.folder is None:
        words.error("RIG.yaml and FOLDER are needed, or --pool")
    records = given.folder / "rows"
    records.mkdir(parents=True, exist_ok=True)
    part, parts = given.shard
    for seed in given.seeds[part::parts]:
        place = records / f"{given.case}-{seed}.json"
        if place.is_file():
            continue
        try:
            row = one(given, given.case, seed)
        except Exception as failure:
            print(f"{given.case} {seed} FAILED, and is tried again: {type(failure).__name__}: {failure}", flush=True)
            continue
        whole = place.with_suffix(".part")
        whole.write_text(json.dumps(row) + "\n", encoding="utf-8")
        whole.replace(place)
        print(json.dumps(row), flush=True)
    pool(given.folder, given.table)


if __name__ == "__main__":
    main()
