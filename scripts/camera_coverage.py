"""Whether 95 % intervals of one estimate from images and encoders hold: `python scripts/camera_coverage.py RIG.yaml FOLDER --seeds 0-199`.

Rigs are drawn from the priors that their files state, and robocal is run on these files, with its defaults. Cases:
cables     `thesis-rig.yaml` with 20 markers and 30 poses: anchors, zeros, lens, hand-eye, markers, size of the print (`identify`)
arm        the small arm of `small_arm.py`, camera in the hand, 20 markers, 30 views: the same of an arm (`identify`)
clock      a camera that takes images while a hand moves: delay of its clock, size of the board, hand-eye, board (`vision hand-eye`)
A number is held where the truth lies within 1.96 of its sigma. A row tells, of a group of numbers:
held       share of the numbers that are held, percent; asked: 93 to 97
+-         standard error of that share over rigs, for the numbers of one rig share its errors
chi2       mean of the squares of what numbers are off by, in sigma; 1 is asked
`delay` and `size` are one number a rig: of 200, chance alone leaves one of these in five outside 93 to 97.
A result is FOLDER/CASE-SEED.json; what stands there is not computed again. `--jobs 16` uses many cores (set OMP_NUM_THREADS=1), and
`--pool FOLDER` only tells the table. A rig takes some 2 to 4 s of CPU.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "tests")]

import small_arm  # noqa: E402
import thesis_rig  # noqa: E402

import robocal as rc  # noqa: E402
from robocal.geometry import so3  # noqa: E402
from robocal.vision.camera import image_of  # noqa: E402

CASES = "cables", "arm", "clock"
GROUPS = "robot", "lens", "hand-eye", "map", "size", "delay"
HELD = 1.96  # sigma
ASKED = 93.0, 97.0  # percent
LENS = np.array([10.0, 10, 10, 10, 0.03, 0.03, 0.001, 0.001])  # sigma of the lens beside cables: px, and of distortion
PRINT = 0.003  # sigma of the size, of a part
CORNER = 0.1  # px, of corners beside the arm
CAMERA = 2e-3, np.radians(1.0)  # sigma of the place of the camera on the arm
DELAY, BOARD = 0.03, 0.01  # s and a part: how far clocks and boards are off that nothing is stated of


def covered(folder, true, frames):
    """What each identified number is off by, in its sigma: by name, of what a run says of numbers and of poses (4, 4)."""
    known = json.loads((folder / "covariance.json").read_text(encoding="utf-8"))
    value = dict(zip(known["names"], known["values"], strict=True))
    sigma = dict(zip(known["names"], np.sqrt(np.diag(known["covariance"])).tolist(), strict=True))
    off = {n: value[n] - v for n, v in true.items() if n in value}
    for name, t in frames.items():
        six = [f"{name}.{s}" for s in ("x", "y", "z", "rx", "ry", "rz")]
        if set(six) <= set(value):
            turn = so3.log(so3.exp(np.array([value[n] for n in six[3:]])) @ t[:3, :3].T)
            off |= dict(zip(six, [*(value[n] - v for n, v in zip(six[:3], t[:3, 3], strict=True)), *turn], strict=True))
    return {n: float(v / sigma[n]) for n, v in off.items() if sigma[n] > 0}


def group_of(name):
    """Of a number, by its name."""
    owner = name.partition(".")[0]
    special = {
        "lens": "lens",
        "eye": "hand-eye",
        "camera": "hand-eye",
        "print": "size",
        "delay": "delay",
        "size": "size",
    }
    if owner in special:
        return special[owner]
    return "map" if owner == "board" or (owner[0] == "m" and owner[1:].isdigit()) else "robot"


def by_cables(said, seed, folder):
    """A rig on cables, smaller than its file says, and told what it is drawn from."""
    rng = np.random.default_rng([seed, 3636])
    said = json.loads(json.dumps(said))
    said["markers"] |= {"grid": [5, 4], "print_scale_error": float(rng.normal(scale=PRINT))}
    said["poses"] |= {"calibration": 30, "verification": 1}
    said["cable"]["tension_known_to"] = 0.0  # robocal is told no sigma of it
    said["prior_used"] = {"focal_and_centre_px": LENS[0], "distortion": LENS[4]}
    rig, noise, camera = thesis_rig.draw(said, 1000 + seed, "dome15")
    rig.given_lens = np.append(rig.lens[:8] + LENS * rng.normal(size=8), 0.0)
    thesis_rig.write(said, folder, rig, noise, camera, "real")
    told = (folder / "pixels.yaml").read_text(encoding="utf-8")
    for s in ("p1", "p2"):
        told = told.replace(f"{s}: {LENS[4]}", f"{s}: {LENS[6]}")
    (folder / "pixels.yaml").write_text(told, encoding="utf-8")
    made = rc.identify(
        folder / "robot.yaml",
        [folder / "lengths.yaml", folder / "pixels.yaml"],
        output=folder / "run",
        leave_one_out=False,
    )
    true = {f"c{i}.a{s}": v for i, row in enumerate(rig.anchors, start=1) for s, v in zip("xyz", row, strict=True)}
    true |= {f"c{i}.l0": z for i, z in enumerate(rig.zeros, start=1)}
    true |= {f"lens.{s}": v for s, v in zip(thesis_rig.SYMBOLS, rig.lens, strict=True)}
    true |= {"print.size": rig.edge / rig.printed}
    frames = {"eye": rig.eye, **{f"m{i}": t for i, t in enumerate(rig.markers)}}
    return made.result.verdict.status, covered(folder / "run", true, frames)


def by_arm(said, seed, folder):
    """The small arm, told what it is drawn from."""
    case, rng = small_arm.CASES["hand"], np.random.default_rng([seed, 63])
    folder.mkdir(parents=True, exist_ok=True)
    rig = small_arm.draw(case, 1000 + seed)
    edge = case.edge * (1 + PRINT * rng.normal())
    inside, whole = small_arm.seen(case, rig.camera, rig.markers, rig.tool[: case.views], rig.lens)
    whole &= whole.sum(axis=0) > 1
    points = np.einsum("vmij,cj->vmci", inside[..., :3, :3], thesis_rig.square(edge)) + inside[..., None, :3, 3]
    uv = image_of(points.reshape(-1, 3), rig.lens).reshape(*points.shape[:3], 2)
    uv += rng.normal(scale=CORNER, size=uv.shape)
    shown, rows = np.degrees(rig.joints), []
    for v, m in np.argwhere(whole).tolist():
        joints = [f"{q:.2f}" for q in shown[v]]
        rows += [[f"v{v}", f"m{m}", k, *(f"{x:.4f}" for x in uv[v, m, k]), *joints] for k in range(4)]
    columns = [f"j{i}" for i in range(1, 7)]
    thesis_rig.table(
        folder / "pixels.csv", ["view", "marker", "corner", "u", "v", *(f"{c} [deg]" for c in columns)], rows
    )
    words = (EXAMPLES / case.example / "robot.yaml").read_text(encoding="utf-8")
    prior = f"prior: {{length: {1e2 * small_arm.LENGTH:g}, angle: {np.degrees(small_arm.ANGLE):g}}}"
    (folder / "robot.yaml").write_text(words.replace("calibrate:\n", f"calibrate:\n  {prior}\n"), encoding="utf-8")
    symbols, sigma = small_arm.SYMBOLS, np.array(small_arm.SIGMA)
    lens = np.array(case.lens[:8]) + sigma * rng.normal(size=8)
    stated = small_arm.disturb(rig.camera, rng, *CAMERA)
    numbers = ", ".join(f"{s}: {v:.9g}" for s, v in zip(symbols, lens, strict=True))
    sigmas = ", ".join(f"{s}: {v:g}" for s, v in zip(symbols, sigma, strict=True))
    others = "".join(f"  m{m}: {{mount: base, free: true}}\n" for m in np.flatnonzero(whole.any(axis=0)) if m)
    (folder / "pixels.yaml").write_text(
        "robocal: 1\nkind: pixels\nfile: pixels.csv\nunits: {length: m, angle: deg}\njoints: {columns: ["
        + ", ".join(columns)
        + "]}\n"
        f"pixels: {{columns: [u, v], sigma: {CORNER}}}\ncorners: {{column: corner, size: {case.edge}}}\n"
        f"scale: {{sigma: {100 * PRINT:g} %, free: true}}\nimage: [{small_arm.SIZE[0]}, {small_arm.SIZE[1]}]\n"
        f"camera: {{name: lens, {numbers}, sigma: {{{sigmas}}}}}\n"
        f"frame: {{name: camera, mount: tool, free: true, {thesis_rig.told_pose(stated)}, "
        f"prior: {{length: {CAMERA[0]}, angle: {np.degrees(CAMERA[1]):g}}}}}\n"
        f"target: {{column: marker}}\ntargets:\n  m0: {{mount: base, free: false, {thesis_rig.told_pose(rig.markers[0])}}}\n{others}"
        "configuration: {id: view}\n",
        encoding="utf-8",
    )
    made = rc.identify(folder / "robot.yaml", folder / "pixels.yaml", output=folder / "run", leave_one_out=False)
    true = (
        dict(rig.arm)
        | {f"lens.{s}": v for s, v in zip(symbols, case.lens, strict=False)}
        | {"print.size": edge / case.edge}
    )
    frames = {"camera": rig.camera, **{f"m{i}": t for i, t in enumerate(rig.markers)}}
    return made.result.verdict.status, covered(folder / "run", true, frames)


def by_clock(said, seed, folder):
    """A camera beside a log, both on clocks of their own, and a board of a size that nobody measured."""
    from hand_eye_stream import stream
    from hand_eye_world import off_by

    rng = np.random.default_rng([seed, 3])
    delay, size = DELAY * rng.normal(), 1 + BOARD * rng.normal()
    folder.mkdir(parents=True, exist_ok=True)
    world, words = stream(folder, 1000 + seed, delay=delay, size=size, inhand=bool(seed % 2), error=0.4, views=20)
    given = dict(zip([w.lstrip("-") for w in words[2::2]], words[3::2], strict=True))
    rc.camera.hand_eye(words[0], words[1], **given, free_delay=True, free_size=True, output=folder / "cell", folds=5)
    told = json.loads((folder / "cell" / "hand_eye.json").read_text(encoding="utf-8"))
    columns = {c["name"]: c["values"] for c in told["unknowns"]["columns"]}
    (late, late_sigma), (large, large_sigma) = zip(columns["found"], columns["sigma"], strict=True)
    z = {"delay.clock": (late - 1e3 * delay) / late_sigma, "size.board": (large - size) / large_sigma}
    for owner, row in zip(("camera", "board"), off_by(told, world), strict=True):
        z |= {f"{owner}.{s}": float(v) for s, v in zip(("x", "y", "z", "rx", "ry", "rz"), row, strict=True)}
    return told["verdict"]["status"], z


EXAMPLES = small_arm.EXAMPLES
DRAW = {"cables": by_cables, "arm": by_arm, "clock": by_clock}


def attempt(said, case, seed):
    """A rig as it stands in its file: a failure is told, for others go on."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            status, z = DRAW[case](said, seed, Path(folder) / "rig")
            return {"case": case, "seed": seed, "verdict": status, "z": z}
        except Exception as failure:
            return {"case": case, "seed": seed, "failed": f"{type(failure).__name__}: {failure}"[:300]}


def pool(folder):
    """The table of a folder of results."""
    rows = [json.loads(p.read_text(encoding="utf-8")) for p in sorted(Path(folder).rglob("*-*.json"))]
    for case in CASES:
        some = [r for r in rows if r["case"] == case]
        for r in some:
            if "failed" in r:
                print(f"{case} {r['seed']} FAILED: {r['failed']}")
        some = [r for r in some if "failed" not in r]
        if not some:
            continue
        verdicts = Counter(r["verdict"] for r in some)
        print(f"{case}: {len(some)} rigs, {', '.join(f'{k} {v}' for k, v in verdicts.items())}")
        print(f"  {'group':10} {'numbers':>8} {'held %':>7} {'+-':>5} {'chi2':>6}   asked {ASKED[0]:g} to {ASKED[1]:g}")
        for group in (*GROUPS, "all"):
            each = [[v for n, v in r["z"].items() if group in ("all", group_of(n))] for r in some]
            each = [np.array(v) for v in each if v]
            if not each:
                continue
            many = np.array([len(v) for v in each])
            held = np.array([(np.abs(v) <= HELD).sum() for v in each])
            share = held.sum() / many.sum()
            error = np.sqrt(np.square(held - share * many).sum()) / many.sum()
            chi2 = float(np.square(np.concatenate(each)).mean())
            met = ASKED[0] <= 100 * share <= ASKED[1]
            print(
                f"  {group:10} {many.sum():8} {100 * share:7.1f} {100 * error:5.1f} {chi2:6.2f}   {'met' if met else 'NOT MET'}"
            )


def main():
    """Draws, identifies, and prints the table."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("rig", type=Path, nargs="?")
    words.add_argument("folder", type=Path, nargs="?")
    words.add_argument("--case", choices=CASES, action="append", help="repeatable; otherwise all")
    words.add_argument(
        "--seeds", type=thesis_rig.seeds_of, default=thesis_rig.seeds_of("0-199"), help="0-199, or 0,3,5-8"
    )
    words.add_argument("--jobs", type=int, default=1, help="rigs at the same time")
    words.add_argument("--pool", type=Path, help="compute nothing: the table of a folder of results")
    given = words.parse_args()
    if given.pool:
        pool(given.pool)
        return
    if given.folder is None:
        words.error("RIG.yaml and FOLDER are needed, or --pool")
    said = YAML(typ="safe").load(given.rig.read_text(encoding="utf-8"))
    given.folder.mkdir(parents=True, exist_ok=True)
    known = [json.loads(p.read_text(encoding="utf-8")) for p in given.folder.glob("*.json")]
    done = {(r["case"], r["seed"]) for r in known if "failed" not in r}
    wanted = [(c, s) for c in given.case or CASES for s in given.seeds if (c, s) not in done]
    with ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")) as crew:
        for made in as_completed([crew.submit(attempt, said, c, s) for c, s in wanted]):
            row = made.result()
            path = given.folder / f"{row['case']}-{row['seed']}.json"
            path.write_text(json.dumps(row) + "\n", encoding="utf-8")
            z = np.array(list(row.get("z", {}).values()))
            print(
                f"{row['case']} {row['seed']}: "
                + (row.get("failed") or f"{row['verdict']}, {(np.abs(z) <= HELD).sum()} of {len(z)} held"),
                flush=True,
            )
    pool(given.folder)


if __name__ == "__main__":
    main()
