"""A small arm, a camera and printed markers, from images to a verdict: `python scripts/small_arm.py {hand,tripod} FOLDER`.

The arm is the one of Attia and Ammari (2019). `hand` is their chapter 5: the camera is in the hand, and the pattern lies on the table.
`tripod` is chapter 6: the camera stands on a tripod and sees a pattern on the probe. They print no images, so the images are drawn:
nothing here was measured. Drawn are an arm whose lengths and angles are off, a lens and a print that are off, and markers that nobody
surveyed. FOLDER gets the images, corners.csv of `vision detect`, pixels.csv with the joint values beside them, pixels.yaml, robot.yaml,
and two runs of `identify`: `hand-eye` with the arm as its file has it, `run` with the arm freed. The table tells, of both:
held out   mean error of corners in views that were not fitted, px
tool       rms error at 20 new poses after a best rigid fit, by the truth, mm: of the camera in the hand, or of the pattern on the probe
and the rank of positions of the tool in the parameters of the arm, which is what the thesis has.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import robocal as rc
from robocal.files.images import family_cells, opencv
from robocal.files.robot import read_robot
from robocal.geometry import fits, se3, so3
from robocal.measure.reach import reach
from robocal.simulation.images import Photograph, render, texture
from robocal.vision.camera import image_of
from robocal.vision.sheets import Marker, Sheet

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
LENGTH, ANGLE = 2e-3, np.radians(1.0)  # m, rad: standard deviations of the arm, as such servos are
# What the servos show at position zero, and in the ten configurations of each chapter (tables 5.2 to 6.2), deg.
ZERO = np.array([95.0, 75.0, 87.0, 78.0, 65.0, 85.0])
FAMILY, PAPER = "4x4_50", 1.5  # and edges of paper for one of marker
SIZE = (800, 600)  # px
SYMBOLS = "fx fy cx cy k1 k2 p1 p2".split()
OFF = np.array([3.0, 3.0, -2.0, -4.0, 0.02, -0.02, -0.0006, 0.0004, 0.0])  # by which the stated lens is off
SIGMA = (5.0, 5.0, 5.0, 5.0, 0.03, 0.03, 0.001, 0.001)
PRINT = 1.004  # by which the printer was too large
HOW = Photograph(blur=0.8, noise=3.0, vignette=0.2)
FRESH = 20  # poses of which no image is taken


@dataclass
class Case:
    """A rig: its example, numbers of the marker's rows and columns, edge and pitch (m), the lens, ranges of joints about position
    zero (deg), images, and where camera and first marker are believed to be: on `hand` or base (m, rad)."""

    example: str
    grid: tuple[int, int]
    edge: float
    pitch: tuple[float, float]
    lens: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    views: int
    in_hand: bool
    camera: np.ndarray
    marker: np.ndarray


def pose(x=(0.0, 0.0, 0.0), turn=None):
    """A rigid motion (4, 4)."""
    out = np.eye(4)
    out[:3, 3] = x
    out[:3, :3] = np.eye(3) if turn is None else turn
    return out


ALONG_X = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # the camera looks along the x axis of the hand
CASES = {
    "hand": Case(
        "arm-eye-in-hand", (5, 4), 0.024, (0.045, 0.05), (620.0, 620.6, 401.2, 303.9, -0.12, 0.05, 0.0006, -0.0004, 0.0),
        (-45, -5, -15, -25, 20, -30), (15, 30, 25, 30, 55, 30), 30, True, pose(turn=ALONG_X), pose(),
    ),
    "tripod": Case(
        "arm-fixed-camera", (2, 2), 0.028, (0.036, 0.036), (1400.0, 1401.0, 402.0, 297.0, -0.1, 0.1, 0.0004, 0.0003, 0.0),
        (-40, -25, -37, -28, -15, -35), (25, 30, 25, 25, 40, 30), 30, False, pose(turn=so3.exp(np.array([0.71, 0.0, 0.0]))), pose(),
    ),
}  # fmt: skip


@dataclass
class Rig:
    """The truth: numbers of the arm by name, joint values of views and of new poses (rad), T_base_tool of both, T_hand_camera or
    T_base_camera, poses of the markers (M, 4, 4) on the other side, and the lens."""

    arm: dict[str, float]
    joints: np.ndarray
    tool: np.ndarray
    camera: np.ndarray
    markers: np.ndarray
    lens: np.ndarray


def disturb(given, rng, length, angle):
    """A pose that is off by standard deviations, m and rad."""
    return se3.displace(given, rng.normal(scale=length, size=3), rng.normal(scale=angle, size=3))


def lay_out(case, rng):
    """Poses of the markers (M, 4, 4): one by one, none straight, marker 0 in the middle."""
    rows, columns = case.grid
    at = np.stack(
        np.meshgrid(np.arange(rows) - rows // 2, np.arange(columns) - columns // 2, indexing="ij"), -1
    ).reshape(-1, 2)
    at = at[np.argsort(np.abs(at).sum(axis=1), kind="stable")]
    out = []
    for k, place in enumerate(at * case.pitch):
        tilt, spin = rng.normal(scale=np.radians(0.5), size=2), 0.0 if k == 0 else rng.uniform(-0.15, 0.15)
        out.append(case.marker @ pose([*place, 0.3e-3 * rng.normal()], so3.exp(np.array([*tilt, spin]))))
    return np.array(out)


def seen(case, rig_camera, markers, tool, lens):
    """T_camera_marker (views, M, 4, 4), and which are whole in the image and not too steep (views, M)."""
    eye = tool @ rig_camera if case.in_hand else np.broadcast_to(rig_camera, tool.shape)
    there = markers if case.in_hand else np.einsum("vij,mjk->vmik", tool, markers)
    inside = (
        np.einsum("vij,mjk->vmik", se3.inverse(eye), there)
        if case.in_hand
        else np.einsum("vij,vmjk->vmik", se3.inverse(eye), there)
    )
    half = case.edge * PAPER / 2 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
    points = np.einsum("vmij,cj->vmci", inside[..., :3, :3], half) + inside[..., None, :3, 3]
    front = (points[..., 2] > 0.05).all(axis=-1)
    points[~front] = [0.0, 0.0, 1.0]
    uv = image_of(points.reshape(-1, 3), lens).reshape(*points.shape[:3], 2)
    whole = ((uv > 4) & (uv < np.array(SIZE) - 5)).all(axis=(-1, -2))
    normal, ray = inside[..., :3, 2], inside[..., :3, 3]
    steep = -np.einsum("vmi,vmi->vm", normal, ray) / np.linalg.norm(ray, axis=-1)
    return inside, front & whole & (steep > 0.5)


def draw(case, seed):
    """The truth."""
    rng = np.random.default_rng(seed)
    arm = read_robot(EXAMPLES / case.example / "robot.yaml").chain
    table = arm.table
    off = {n: table[n].value + rng.normal(scale=LENGTH if table[n].unit == "m" else ANGLE) for n in table.free}
    true = type(arm).with_table(arm, table.with_values(off))
    lens = np.array(case.lens)
    camera = disturb(case.camera, rng, 2e-3, np.radians(1.0))
    markers = lay_out(case, rng)
    joints = np.empty((0, 6))
    want = case.views + FRESH
    for _ in range(200):
        some = np.radians(np.round(ZERO + rng.uniform(case.low, case.high, (400, 6)), 2))
        _, whole = seen(case, camera, markers, reach(true, some)[0], lens)
        joints = np.concatenate([joints, some[whole.sum(axis=1) >= min(3, len(markers))]])
        if len(joints) >= want:
            break
    else:
        sys.exit("too few poses at which the camera sees markers")
    joints = joints[:want]
    return Rig(off, joints, reach(true, joints)[0], camera, markers, lens)


def photograph(case, rig, folder, watch):
    """Writes the images of all views."""
    folder.mkdir(parents=True, exist_ok=True)
    inside, _ = seen(case, rig.camera, rig.markers, rig.tool[: case.views], rig.lens)
    edge = case.edge * PRINT
    papers = [
        Sheet("one", edge * PAPER, edge * PAPER, (Marker(FAMILY, k, cells, 0.0, 0.0, edge),))
        for k, cells in enumerate(family_cells(FAMILY, range(len(rig.markers))))
    ]
    for v in range(case.views):
        there = [(s, t) for s, t in zip(papers, inside[v], strict=True) if t[2, 3] > 0.05]
        image = render(there, rig.lens, SIZE, HOW, texture(SIZE, v), np.random.default_rng(v))
        opencv().imwrite(str(folder / f"view{v:02d}.png"), image)
        watch({"stage": "render", "done": v + 1, "total": case.views})


def numbers(values, digits=5):
    """A list in YAML."""
    return "[" + ", ".join(f"{v:.{digits}f}" for v in values) + "]"


def write(case, rig, folder):
    """Pixels with the joint values beside them, as a user joins the two tables; and what is stated beforehand. Returns the names of
    the markers that were seen."""
    with (folder / "corners.csv").open(encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    plain = [n.partition(" ")[0] for n in head]
    view, marker = plain.index("view"), plain.index("marker")
    views: dict[str, set[str]] = {}
    for row in rows:
        views.setdefault(row[marker], set()).add(row[view])
    rows = [
        row for row in rows if len(views[row[marker]]) > 1
    ]  # one view alone says nothing of a marker that nobody placed
    keep = [i for i, n in enumerate(plain) if n in KEEP or n.startswith(("cu_", "cv_"))]
    shown = np.degrees(rig.joints)
    with (folder / "pixels.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow([*(head[i] for i in keep), *(f"j{i} [deg]" for i in range(1, 7))])
        for row in rows:
            row[marker] = f"m{row[marker]}"
            out.writerow([*(row[i] for i in keep), *(f"{q:.2f}" for q in shown[int(row[view].removeprefix("view"))])])
    lens = np.array(case.lens) + OFF
    words = ", ".join(f"{s}: {v:.6g}" for s, v in zip(SYMBOLS, lens, strict=False))
    sigma = ", ".join(f"{s}: {v}" for s, v in zip(SYMBOLS, SIGMA, strict=True))
    at, turn = (numbers(v) for v in (1e3 * case.camera[:3, 3], np.degrees(so3.log(case.camera[:3, :3]))))
    names = sorted({row[marker] for row in rows}, key=lambda n: int(n[1:]))
    hand, other = ("tool", "base") if case.in_hand else ("base", "tool")
    first = f"m0: {{mount: {other}, xyz: [0, 0, 0], rotation_vector: [0, 0, 0], free: true}}"
    others = "".join(f"  {n}: {{mount: {other}, free: true}}\n" for n in names if n != "m0")
    (folder / "pixels.yaml").write_text(
        "# SIMULATED, not measured\nrobocal: 1\nkind: pixels\nfile: pixels.csv\nunits: {length: mm, angle: deg}\n"
        "joints: {columns: [j1, j2, j3, j4, j5, j6]}\n"
        "pixels: {columns: [u, v], sigma: {columns: [su, sv]}}\n"
        f"corners: {{column: corner, size: {1e3 * case.edge:g}}}\nscale: {{sigma: 0.3 %, free: true}}\nimage: [{SIZE[0]}, {SIZE[1]}]\n"
        f"camera: {{name: lens, {words}, sigma: {{{sigma}}}}}\n"
        f"frame: {{name: camera, mount: {hand}, free: true, xyz: {at}, rotation_vector: {turn}}}\n"
        f"target: {{column: marker}}\ntargets:\n  {first}\n{others}configuration: {{id: view}}\n",
        encoding="utf-8",
    )
    (folder / "robot.yaml").write_text(
        (EXAMPLES / case.example / "robot.yaml").read_text(encoding="utf-8"), encoding="utf-8"
    )
    return names


KEEP = {"view", "marker", "corner", "u", "v", "su", "sv", "suv"}


def found_places(case, found, robot, joints):
    """Where the tool is by what was found, (k, 3) m: the camera's centre in the base, or that of marker 0 in the camera's frame."""
    tool = reach(robot, joints)[0]
    at = {f.pose.child: frame(f.pose) for f in found.result.frames}
    camera = at["camera"]
    if case.in_hand:
        return (tool @ camera)[:, :3, 3]
    return (se3.inverse(camera) @ tool @ at["m0"])[:, :3, 3]


def frame(told):
    """A pose (4, 4) of a result, m."""
    x = np.array(told.position.xyz) * {"m": 1.0, "cm": 1e-2, "mm": 1e-3}[told.position.unit]
    return pose(x, Rotation.from_quat(told.quaternion_xyzw).as_matrix())


def true_places(case, rig):
    """The same by the truth, at the new poses."""
    tool = rig.tool[case.views :]
    if case.in_hand:
        return (tool @ rig.camera)[:, :3, 3]
    return (se3.inverse(rig.camera) @ tool @ rig.markers[0])[:, :3, 3]


def miss(found, true):
    """The rms distance after a best rigid fit, mm."""
    move = fits.rigid(found, true)
    left = found @ move[:3, :3].T + move[:3, 3] - true
    return 1e3 * float(np.sqrt((left**2).sum(axis=1).mean()))


def rank_of_positions(arm, joints):
    """How many free parameters of the arm positions of its tool determine, without noise and priors, and of how many."""
    names = arm.table.free
    jacobian = reach(arm, joints, names, turn=False)[1].reshape(-1, len(names))
    values = np.linalg.svd(jacobian, compute_uv=False)
    return int((values > 1e-9 * values[0]).sum()), len(names)


def tell(event, said={}):  # noqa: B006  # what was told last is all the state there is
    """Progress, on stderr: every stage, and every tenth of its steps."""
    done, total = event.get("done"), event.get("total")
    step = None if not isinstance(done, int) or not total else 10 * done // int(total)
    if said.get("last") != (event["stage"], step):
        said["last"] = event["stage"], step
        print(event["stage"] + (f" {done} of {total}" if step is not None else ""), file=sys.stderr, flush=True)


def run(name, folder, seed=1):
    """All of it: draws, photographs, detects, identifies, and prints the table. Returns its numbers."""
    case, began = CASES[name], os.times()
    folder = Path(folder)
    rig = draw(case, seed)
    photograph(case, rig, folder / "images", tell)
    size = 1e3 * case.edge
    rc.camera.detect(
        str(folder / "images"), dictionary=FAMILY, size=size, output=folder / "corners.csv", force=True, watch=tell
    )
    frames = ["camera", *write(case, rig, folder)]
    files = folder / "robot.yaml", folder / "pixels.yaml"
    rows = {}
    for key, free in (("hand-eye", frames), ("run", ())):
        found = rc.identify(*files, free=free, output=folder / key, force=True, leave_one_out=False, watch=tell)
        arm = read_robot(
            folder / (key if key == "run" else "") / ("calibrated.yaml" if key == "run" else "robot.yaml")
        ).chain
        left = found.result.residuals
        held = left.held_out or left.k_fold
        places = found_places(case, found, arm, rig.joints[case.views :])
        rows[key] = {"verdict": found.verdict, "px": held.mean, "mm": miss(places, true_places(case, rig))}
    nominal = read_robot(files[0]).chain
    positions, many = rank_of_positions(nominal, rig.joints[: case.views])
    names = set(nominal.table.free)
    images = sum(p.name in names and p.status == "identified" for p in found.result.parameters)
    ended = os.times()
    spent = sum(ended[:4]) - sum(began[:4])
    print("| | verdict | held out, px | tool, mm |\n|---|---|---|---|")
    for key, words in (("hand-eye", "camera, markers and lens, the arm as it is"), ("run", "and the arm")):
        row = rows[key]
        print(f"| {words} | {row['verdict']} | {row['px']:.3g} | {row['mm']:.3g} |")
    print(
        f"positions of the tool have rank {positions} in the {many} parameters of the arm; the images identify {images} of them"
    )
    print(f"{ended.elapsed - began.elapsed:.0f} s, CPU {spent:.0f} s")
    return {**rows, "positions": (positions, many), "images": images}


def main():
    """The command."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("case", choices=CASES)
    words.add_argument("folder", type=Path)
    words.add_argument("--seed", type=int, default=1)
    given = words.parse_args()
    run(given.case, given.folder, given.seed)


if __name__ == "__main__":
    main()
