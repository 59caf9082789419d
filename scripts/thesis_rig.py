"""How well one estimate from images and encoders does on the thesis' rig: `python scripts/thesis_rig.py RIG.yaml FOLDER --seeds 0-39`.

RIG.yaml is `thesis-rig.yaml`. Each seed draws a rig: anchors, camera, lens, markers, poses, tensions and noise. Its files are written to
FOLDER as a user would have them: robot.yaml, lengths.yaml, pixels.yaml and their tables. `robocal identify` makes a run of them, and
`robocal cable forward` computes the 20 verification poses from noisy lengths alone. A row tells, of each seed and as median:
aligned    rms error of the verification poses after the best fit of the identified markers on the true ones, mm and deg
marker 0   the same in the frame of marker 0, mm
first      the same relative to the first verification pose, mm
a          rms error of a coordinate of the frame anchors in the frame of marker 0, mm
map Z      largest error of the height of a corner, aligned, mm; a marker that a single pose sees is left out by `identify`
predicted  sigma of the poses in the frame of marker 0, as `cable forward` has it, mm
chi2       of all errors of the robot's, camera's and markers' numbers, by the covariance that the run states, per number
--case chooses how the lens was calibrated: `real` (OpenCV, 20 views), `dome15` and `dome50` (k1 wrong by 0.015 and 0.05), `tight` (by 0.015
with a prior of 0.0005), `narrow` (fx 1500, 0.5 px). A seed takes some 15 s of CPU, with --images 200 s.
A result is FOLDER/rows/CASE-SEED.json; what stands there is not computed again. `--seeds 0-39 --jobs 16` uses many cores (set
OMP_NUM_THREADS=1). `--pool FOLDER` prints, of every case in a folder of results, what was asked and measured.
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import nullcontext
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import robocal as rc
from robocal.geometry import fits, se3, so3
from robocal.vision.camera import project

ZERO = 0.01  # m: zeros of the length sensors are off by that; the rig's file does not say
SYMBOLS = "fx fy cx cy k1 k2 p1 p2 k3".split()
BOARD = np.array([(x, y, 0.0) for y in range(7) for x in range(10)]) * 0.04
DOMES = {"dome15": 0.015, "dome50": 0.05, "tight": 0.015}
# px, stated of corners that were found through the calibrated lens. They are 0.008 px off, and say so, if the lens is right; one that is
# wrong by 0.05 in k1 moves them by 0.05. By 0.008 the fit creeps for hundreds of iterations: each view is held to 0.1 mm.
THROUGH = 0.1
FAMILY, BLUR, GREY = "36h11", 0.8, 5.0  # of drawn images: markers, px, grey levels
TIGHT = 0.0005  # of the distortion, and 1 px: as a calibration alone states it


@dataclass
class Rig:
    """Truth (SI), and what is stated beforehand."""

    anchors: np.ndarray
    platform: np.ndarray
    zeros: np.ndarray
    eye: np.ndarray
    lens: np.ndarray
    markers: np.ndarray  # T_base_marker (M, 4, 4), marker 0 first
    printed: float  # the edge of a marker as it should be
    edge: float
    poses: np.ndarray
    tension: np.ndarray
    seen: list[tuple[int, int, np.ndarray]]  # pose, marker, corners (4, 2) without noise
    given_eye: np.ndarray
    given_lens: np.ndarray


def lengths_of(rig: Rig, poses, tension, elongation):
    """What sensors show, (k, 8), without noise."""
    b = np.einsum("kij,cj->kci", poses[:, :3, :3], rig.platform) + poses[:, None, :3, 3]
    full = np.linalg.norm(b - rig.anchors, axis=2)
    return full / (1 + elongation * tension) - rig.zeros


def held(said, anchors, platform, poses):
    """Tensions nearest to the preferred ones that hold the weight, (k, 8), and which poses are kept."""
    b = np.einsum("kij,cj->kci", poses[:, :3, :3], platform)
    away = anchors - b - poses[:, None, :3, 3]
    unit = away / np.linalg.norm(away, axis=2, keepdims=True)
    w = np.swapaxes(np.concatenate([unit, np.cross(b, unit)], axis=2), 1, 2)
    load = np.array([0, 0, -float(said["weight_N"]), 0, 0, 0])
    t0 = np.full(8, float(said["tensions"]["preferred_N"]))
    t = t0 - np.einsum("kij,kj->ki", np.linalg.pinv(w), load + w @ t0)
    low, high = said["tensions"]["pose_kept_if_within_N"]
    return t, ((t >= low) & (t <= high)).all(axis=1)


def draw_poses(said, rng, count):
    """T_base_platform (count, 4, 4)."""
    p = said["poses"]
    tilt = np.deg2rad(p["tilt_max"]) * np.sqrt(rng.random(count))
    about = rng.uniform(-np.pi, np.pi, count)
    level = tilt[:, None] * np.column_stack([np.cos(about), np.sin(about), np.zeros(count)])
    yaw = np.column_stack([np.zeros((count, 2)), np.deg2rad(rng.uniform(*p["yaw"], count))])
    t = np.tile(np.eye(4), (count, 1, 1))
    t[:, :3, 3] = np.column_stack([rng.uniform(*p[s], count) for s in "xyz"])
    t[:, :3, :3] = so3.exp(level) @ so3.exp(yaw)
    return t


def draw_markers(said, rng):
    """T_base_marker (M, 4, 4); marker 0 is the one in the middle."""
    m = said["markers"]
    place = [(np.arange(k) + 0.5) / k * size - size / 2 for k, size in zip(m["grid"], m["floor"], strict=True)]
    xy = np.stack(np.meshgrid(*place, indexing="ij"), axis=-1).reshape(-1, 2)
    count = len(xy)
    tilt = np.column_stack([rng.normal(scale=np.deg2rad(m["tilt_sd"]), size=(count, 2)), np.zeros(count)])
    turn = np.column_stack([np.zeros((count, 2)), rng.uniform(-np.pi, np.pi, count)])
    t = np.tile(np.eye(4), (count, 1, 1))
    t[:, :3, :3] = so3.exp(tilt) @ so3.exp(turn)
    t[:, :2, 3] = xy + rng.uniform(-m["jitter"], m["jitter"], xy.shape)
    t[:, 2, 3] = rng.normal(scale=m["height_sd"], size=count)
    first = int(np.argmin(np.hypot(*xy.T)))
    return np.concatenate([t[[first]], np.delete(t, first, axis=0)])


def square(edge):
    """Corners of a marker, (4, 3)."""
    return edge / 2 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])


def sightings(said, camera, lens, markers, edge):
    """Which markers are seen whole from cameras T_base_camera, and where."""
    if_seen, size = said["marker_seen_if"], np.array(said["camera"]["resolution"])
    inside = np.einsum("pij,mjk->pmik", se3.inverse(camera), markers)
    points = np.einsum("pmij,cj->pmci", inside[..., :3, :3], square(edge)) + inside[..., None, :3, 3]
    z = np.maximum(points[..., 2], 1e-3)
    steep = np.hypot(points[..., 0], points[..., 1]) / z < np.tan(np.deg2rad(if_seen["angle_from_axis_below"]))
    uv = project(np.concatenate([points[..., :2], z[..., None]], axis=-1), lens)[0]
    room = if_seen["border_px"]
    whole = ((uv > room) & (uv < size - room)).all(axis=-1)
    side = np.linalg.norm(uv - np.roll(uv, 1, axis=2), axis=-1).min(axis=-1)
    ok = (steep & whole & (points[..., 2] > 0.1)).all(axis=-1) & (side > if_seen["side_px_above"])
    return [(int(p), int(m), uv[p, m]) for p, m in np.argwhere(ok)]


def calibrated_lens(said, rng, lens):
    """The lens as OpenCV finds it from 20 views of a board."""
    import cv2

    width, height = said["camera"]["resolution"]
    middle = BOARD.mean(axis=0)
    views = []
    while len(views) < 20:
        turn = so3.exp(np.append(rng.uniform(-0.6, 0.6, 2), rng.uniform(-0.3, 0.3)))
        far = rng.uniform(0.35, 0.9) * lens[0] / 900
        at = np.append(rng.uniform(-0.5, 0.5, 2) * far * [width / lens[0], height / lens[1]] * 0.8, far)
        uv = project((BOARD - middle) @ turn.T + at, lens)[0]
        if (uv > 5).all() and (uv < [width - 5, height - 5]).all():
            views.append((uv + rng.normal(scale=0.2, size=uv.shape)).astype(np.float32))
    points = [BOARD.astype(np.float32)] * len(views)
    _, k, d, _, _ = cv2.calibrateCamera(points, views, (width, height), None, None, flags=cv2.CALIB_FIX_K3)
    return np.array([k[0, 0], k[1, 1], k[0, 2], k[1, 2], *d.ravel()[:5]])


def draw(said, seed, case):
    """One rig."""
    rng = np.random.default_rng([seed, 36])
    nominal, platform = np.array(said["frame_anchors_nominal"]), np.array(said["platform_anchors"])
    anchors = nominal + rng.normal(scale=0.03, size=nominal.shape)
    c = dict(said["camera"])
    c |= said["narrow_view_case"] if case == "narrow" else {}
    width, height = c["resolution"]
    fy = c["fx"] * said["camera"]["fy"] / said["camera"]["fx"]
    centre = np.array([width, height]) / 2 + rng.normal(scale=8.0, size=2)
    lens = np.array([c["fx"], fy, *centre, c["k1"], c["k2"], c["p1"], c["p2"], 0.0])
    given_eye = np.diag([1.0, -1.0, -1.0, 1.0])
    given_eye[:3, 3] = said["camera_in_platform_nominal"]["translation"]
    eye = given_eye.copy()
    eye[:3, 3] += rng.normal(scale=0.002, size=3)
    eye[:3, :3] = so3.exp(rng.normal(scale=np.deg2rad(0.3), size=3)) @ given_eye[:3, :3]
    markers = draw_markers(said, rng)
    edge = said["markers"]["size"] * (1 + rng.choice([-1, 1]) * said["markers"]["print_scale_error"])
    want = said["poses"]["calibration"] + said["poses"]["verification"]
    poses, tension = np.empty((0, 4, 4)), np.empty((0, 8))
    while len(poses) < want:
        some = draw_poses(said, rng, want)
        t, kept = held(said, anchors, platform, some)
        poses, tension = np.concatenate([poses, some[kept]]), np.concatenate([tension, t[kept]])
    poses, tension = poses[:want], tension[:want]
    seen = sightings(said, poses[: said["poses"]["calibration"]] @ eye, lens, markers, edge)
    if case in DOMES:
        given = lens.copy()
        given[4] += DOMES[case]
    else:
        given = calibrated_lens(said, rng, lens)
    zeros = rng.normal(scale=ZERO, size=8)
    size = said["markers"]["size"]
    return Rig(anchors, platform, zeros, eye, lens, markers, size, edge, poses, tension, seen, given_eye, given), rng, c


def table(path, head, rows):
    """A CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(head)
        out.writerows(rows)


def numbers(values, digits=6):
    """A list in YAML."""
    return "[" + ", ".join(f"{v:.{digits}f}" for v in values) + "]"


def write(said, folder, rig, rng, camera, case, images=False, through=True):
    """The files that a user has."""
    folder.mkdir(parents=True, exist_ok=True)
    many = said["poses"]["calibration"]
    cable, known = said["cable"], said["cable"]["tension_known_to"]
    names = [f"c{i + 1}" for i in range(8)]
    read = lengths_of(rig, rig.poses, rig.tension, cable["elongation_per_N"])
    read = read + rng.normal(scale=cable["length_noise"], size=read.shape)
    told = np.abs(rig.tension * (1 + rng.normal(scale=known, size=read.shape)))
    anchors = "\n".join(f"  A{i + 1}: {numbers(v)}" for i, v in enumerate(said["frame_anchors_nominal"]))
    points = "\n".join(f"  B{i + 1}: {numbers(v)}" for i, v in enumerate(said["platform_anchors"]))
    cables = "\n".join(f"  - {{name: c{i + 1}, frame: A{i + 1}, platform: B{i + 1}, zero: 0}}" for i in range(8))
    (folder / "robot.yaml").write_text(
        f"robocal: 1\nname: thesis rig\nkind: cable\nunits: {{length: m, angle: deg, force: N, mass: kg}}\n"
        f"frame_anchors:\n{anchors}\nplatform_anchors:\n{points}\ncables:\n{cables}\n"
        f"every_cable: {{tension: [10, 140], elasticity: {cable['elongation_per_N']}}}\n"
        f"platform: {{mass: {said['weight_N'] / 9.81:.4f}, centre_of_mass: [0, 0, 0]}}\n"
        "calibrate: {free: [ax, ay, az, l0], prior: {ax: 0.03, ay: 0.03, az: 0.03}}\nsource: simulated\n",
        encoding="utf-8",
    )
    pulls = [f"t{i + 1} [N]" for i in range(8)]
    rows = [[f"p{i}", *(f"{v:.6f}" for v in (*read[i], *told[i]))] for i in range(many)]
    table(folder / "lengths.csv", ["id", *(f"{n} [m]" for n in names), *pulls], rows)
    (folder / "lengths.yaml").write_text(
        f"robocal: 1\nkind: lengths\nfile: lengths.csv\nlengths: {{columns: [{', '.join(names)}], sigma: {cable['length_noise']}}}\n"
        "tension: {columns: [t1, t2, t3, t4, t5, t6, t7, t8]}\nconfiguration: {id: id}\n",
        encoding="utf-8",
    )
    noise = camera["corner_noise_px"]
    rows = []
    for p, m, uv in rig.seen:
        uv = uv + rng.normal(scale=noise, size=uv.shape)
        rows += [[f"p{p}", f"m{m}", k, f"{u:.4f}", f"{v:.4f}"] for k, (u, v) in enumerate(uv.tolist())]
    table(folder / "pixels.csv", ["id", "marker", "corner", "u", "v"], rows)
    if images:
        photograph(rig, rng, folder, camera, through)
        noise = THROUGH if through else "{columns: [su, sv]}"
    wide = said["prior_used"]
    px, bend = (1.0, TIGHT) if case == "tight" else (wide["focal_and_centre_px"], wide["distortion"])
    words = ", ".join(f"{s}: {v:.8g}" for s, v in zip(SYMBOLS, rig.given_lens, strict=True))
    sigma = ", ".join(f"{s}: {px if i < 4 else bend}" for i, s in enumerate(SYMBOLS[:8]))
    seen = sorted({m for _, m, _ in rig.seen} - {0})
    frame, zero = told_pose(rig.given_eye), told_pose(rig.markers[0])
    others = "\n".join(f"  m{m}: {{mount: base, free: true}}" for m in seen)
    (folder / "pixels.yaml").write_text(
        f"robocal: 1\nkind: pixels\nfile: pixels.csv\nunits: {{length: m, angle: deg}}\npixels: {{columns: [u, v], sigma: {noise}}}\n"
        f"corners: {{column: corner, size: {said['markers']['size']}}}\nimage: {said['camera']['resolution']}\n"
        f"camera: {{name: lens, {words}, sigma: {{{sigma}}}}}\n"
        f"frame: {{name: eye, mount: tool, free: true, {frame}{EYE}}}\n{SIZE}"
        f"target: {{column: marker}}\ntargets:\n  m0: {{mount: base, free: false, {zero}}}\n{others}\nconfiguration: {{id: id}}\n",
        encoding="utf-8",
    )
    rows = [[f"v{i}", *(f"{v:.6f}" for v in (*read[i], *told[i]))] for i in range(many, len(read))]
    head = ["id", *(f"{n} [m]" for n in names), *(f"{n}.tension [N]" for n in names)]
    table(folder / "verify.csv", head, rows)


EYE = ", prior: {length: 0.002, angle: 0.3}"
SIZE = "scale: {sigma: 0.3 %, free: true}\n"


def identified(run):
    """Poses of the markers by number, T_base_marker, and frame anchors (8, 3)."""
    made = json.loads((run / "result.json").read_text(encoding="utf-8"))
    value = {p["name"]: p["identified"] for p in made["parameters"] if p["identified"] is not None}
    stated = {p["name"]: p["nominal"] for p in made["parameters"]}
    anchors = [[value.get(f"c{i}.a{s}", stated[f"c{i}.a{s}"]) for s in "xyz"] for i in range(1, 9)]
    markers = {}
    for f in made["frames"]:
        pose = f["pose"]
        if pose["child"].startswith("m"):
            t = np.eye(4)
            t[:3, :3] = Rotation.from_quat(pose["quaternion_xyzw"]).as_matrix()
            t[:3, 3] = pose["position"]["xyz"]
            markers[int(pose["child"][1:])] = t
    return markers, np.array(anchors)


def off(found, true):
    """Rms errors of poses, mm and deg."""
    turn = so3.log(found[:, :3, :3] @ np.swapaxes(true[:, :3, :3], 1, 2))
    place = found[:, :3, 3] - true[:, :3, 3]
    return 1e3 * float(np.sqrt((place**2).sum(axis=1).mean())), float(np.degrees(np.sqrt((turn**2).sum(axis=1).mean())))


def judge(rig, markers, anchors, poses, sigma, true):
    """What is found against the truth, by the names of the columns."""
    numbers_ = sorted(markers)
    own = square(rig.edge)
    found, real = (np.concatenate([own @ t[:3, :3].T + t[:3, 3] for t in some])
                   for some in ([markers[m] for m in numbers_], [rig.markers[m] for m in numbers_]))  # fmt: skip
    move = fits.rigid(found, real)
    aligned = off(move @ poses, true)
    beside = se3.inverse(poses[0]) @ poses, se3.inverse(true[0]) @ true
    first, way = off(*beside), np.linalg.norm(beside[0][1:, :3, 3] - beside[1][1:, :3, 3], axis=1)
    moved = found @ move[:3, :3].T + move[:3, 3]
    a = anchors - rig.anchors
    at = off(poses, true)
    return {
        "aligned mm": aligned[0], "aligned deg": aligned[1], "marker 0 mm": at[0], "first mm": first[0],
        "first mean mm": 1e3 * float(way.mean()),  # without the first pose itself, as tables of the thesis have it
        "a mm": 1e3 * float(np.sqrt((a**2).mean())), "map Z mm": 1e3 * float(np.abs(moved - real)[:, 2].max()),
        "predicted": 1e3 * float(np.sqrt(np.mean(np.square(sigma)))),
    }  # fmt: skip


def two_stages(said, rig, folder, camera, mildly=True):
    """The figures of the way in two stages, with the lens as calibrated: a map and camera poses from images alone, then the robot. As the
    thesis writes it camera poses are held in the second stage, and hand-eye is as stated (`staged`) or found there (`staged free`); more
    mildly, unless that is left out, the map alone is held, and poses may follow lengths (`held`)."""
    resolution = camera["resolution"]
    write_lens(rig, folder, resolution)
    with (folder / "pixels.csv").open(encoding="utf-8") as file:
        rows = [[r["id"], r["marker"][1:], r["corner"], r["u"], r["v"]] for r in csv.DictReader(file)]
    table(folder / "corners.csv", ["view", "marker", "corner", "u", "v"], rows)
    rc.camera.map(
        folder / "corners.csv", lens=folder / "lens.yaml", size=[f"{1e3 * rig.printed:g}"], origin="0", fix=list(SYMBOLS),
        output=folder / "map.yaml", force=True, size_sigma=0, size_scatter=0,
    )  # fmt: skip
    map_ = YAML(typ="safe").load((folder / "map.yaml").read_text(encoding="utf-8"))
    place = {
        m["id"]: rig.markers[0] @ se3.from_vector(np.append(np.array(m["xyz"]) / 1e3, np.radians(m["rotation_vector"])))
        for m in map_["markers"]
    }
    stated, free = (as_written(said, rig, folder, place, free) for free in (False, True))
    if not mildly:
        return {"staged": stated, "staged free": free}
    held = (f"  m{m}: {{mount: base, free: false, {told_pose(t)}}}" for m, t in place.items())
    (folder / "held.yaml").write_text(
        f"robocal: 1\nkind: pixels\nfile: pixels.csv\nunits: {{length: m, angle: deg}}\n"
        f"pixels: {{columns: [u, v], sigma: {camera['corner_noise_px']}}}\n"
        f"corners: {{column: corner, size: {rig.printed}}}\nimage: {resolution}\ncamera: {{file: lens.yaml}}\n"
        f"frame: {{name: eye, mount: tool, free: true, {told_pose(rig.given_eye)}{EYE}}}\n"
        f"target: {{column: marker}}\ntargets:\n" + "\n".join(held) + "\nconfiguration: {id: id}\n",
        encoding="utf-8",
    )
    data = [folder / "lengths.yaml", folder / "held.yaml"]
    rc.identify(folder / "robot.yaml", data, output=folder / "staged", force=True, leave_one_out=False)
    return {"staged": stated, "staged free": free, "held": verify(folder, rig, said, place, "staged")}


def as_written(said, rig, folder, place, free):
    """The second stage of the thesis, equations 3.16 to 3.26: camera poses of the first stage are exact, and anchors, initial lengths
    and, where it is `free`, hand-eye meet squares of lengths. Its own solver, none of robocal's."""
    views = {}
    with (folder / "pixels.csv").open(encoding="utf-8") as file:
        for r in csv.DictReader(file):
            marker = int(r["marker"][1:])
            if marker in place:
                corner = place[marker] @ np.append(square(rig.printed)[int(r["corner"])], 1.0)
                views.setdefault(int(r["id"][1:]), []).append((*corner[:3], float(r["u"]), float(r["v"])))
    seen, camera = sorted(views), []
    for view in seen:
        rows = np.array(views[view])
        start = rig.poses[view] @ rig.given_eye

        def miss(x, start=start, rows=rows):
            back = se3.inverse(se3.displace(start, x[:3], x[3:]))
            return (project(rows[:, :3] @ back[:3, :3].T + back[:3, 3], rig.given_lens)[0] - rows[:, 3:]).ravel()

        found = least_squares(miss, np.zeros(6), method="lm").x
        camera.append(se3.displace(start, found[:3], found[3:]))
    camera, stretch = np.array(camera), said["cable"]["elongation_per_N"]
    read, told = readings(folder / "lengths.csv", seen)
    nominal = np.array(said["frame_anchors_nominal"])

    def full(read, told, zeros):
        return (read + zeros) * (1 + stretch * told)

    def ends(poses):
        return np.einsum("kij,cj->kci", poses[:, :3, :3], rig.platform) + poses[:, None, :3, 3]

    def loops(x):
        eye = se3.displace(rig.given_eye, x[32:35], x[35:]) if free else rig.given_eye
        way = ends(camera @ se3.inverse(eye)) - (nominal + x[:24].reshape(8, 3))
        return ((way**2).sum(axis=2) - full(read, told, x[24:32]) ** 2).ravel()

    x = least_squares(loops, np.zeros(38 if free else 32), method="lm").x
    anchors, zeros = nominal + x[:24].reshape(8, 3), x[24:32]
    many = said["poses"]["calibration"]
    true = rig.poses[many:]
    read, told = readings(folder / "verify.csv", range(len(true)))
    poses = []
    for t, r, pull in zip(true, read, told, strict=True):

        def off(x, t=t, r=r, pull=pull):
            way = ends(se3.displace(t, x[:3], x[3:])[None])[0] - anchors
            return np.linalg.norm(way, axis=1) - full(r, pull, zeros)

        found = least_squares(off, np.zeros(6), method="lm").x
        poses.append(se3.displace(t, found[:3], found[3:]))
    return judge(rig, dict(place), anchors, np.array(poses), np.ones(len(true)), true)


def readings(path, rows):
    """Lengths and tensions (k, 8) of some rows."""
    with path.open(encoding="utf-8") as file:
        every = np.array([[float(v) for v in r[1:]] for r in list(csv.reader(file))[1:]])[list(rows)]
    return every[:, :8], every[:, 8:]


def write_lens(rig, folder, resolution):
    """The lens as calibrated, as a file; its place."""
    words = ", ".join(f"{s}: {v:.8g}" for s, v in zip(SYMBOLS, rig.given_lens, strict=True))
    (folder / "lens.yaml").write_text(
        f"robocal: 1\nkind: lens\nmodel: brown\nimage: {resolution}\nnumbers: {{{words}}}\n", encoding="utf-8"
    )
    return folder / "lens.yaml"


def photograph(rig, rng, folder, camera, through=True):
    """Draws the images, finds their corners, `through` the calibrated lens, and puts these in the place of pixels.csv."""
    import cv2

    from robocal.files.images import family_cells
    from robocal.simulation.images import Photograph, render, texture
    from robocal.vision.sheets import Marker, Sheet

    images, size = folder / "images", tuple(camera["resolution"])
    images.mkdir(exist_ok=True)
    cells = family_cells(FAMILY, range(len(rig.markers)))
    paper = rig.edge * (1 + 2 / cells.shape[1])
    sheets = [
        Sheet(f"m{i}", paper, paper, (Marker(FAMILY, i, cells[i], 0.0, 0.0, rig.edge),))
        for i in range(len(rig.markers))
    ]
    how = Photograph(blur=BLUR, noise=GREY)
    for p in sorted({p for p, _, _ in rig.seen}):
        if (images / f"p{p}.png").is_file():  # of a run before
            continue
        back = se3.inverse(rig.poses[p] @ rig.eye)
        near = [(s, back @ t) for s, t in zip(sheets, rig.markers, strict=True) if (back @ t)[2, 3] > 0.1]
        near = [(s, t) for s, t in near if np.hypot(*t[:2, 3]) < 1.5 * t[2, 3]]
        cv2.imwrite(
            str(images / f"p{p}.png"), render(near, rig.lens, size, how, texture(size, int(rng.integers(1 << 30))), rng)
        )
    lens = {"lens": write_lens(rig, folder, list(size))} if through else {}
    rc.camera.detect(images, dictionary=FAMILY, size=1e3 * rig.printed, output=folder / "found.csv", force=True, **lens)
    with (folder / "found.csv").open(encoding="utf-8") as file:
        head, *rows = list(csv.reader(file))
    view, marker = head.index("view"), head.index("marker")
    rig.seen = [(int(r[view][1:]), int(r[marker]), None) for r in rows[::4]]
    for r in rows:
        r[marker] = f"m{r[marker]}"
    head[view] = "id"
    table(folder / "pixels.csv", head, rows)


def told_pose(t):
    """A pose as a file has it, m and deg."""
    v = se3.to_vector(t)
    return f"xyz: {numbers(v[:3], 9)}, rotation_vector: {numbers(np.degrees(v[3:]), 9)}"


def agreement(rig, run):
    """Chi2 per number of what was identified, by the covariance that the run states: of all, robot, camera and map."""
    known = json.loads((run / "covariance.json").read_text(encoding="utf-8"))
    place = {n: i for i, n in enumerate(known["names"])}
    value = np.array(known["values"])
    error = np.full(len(value), np.nan)
    true = {f"c{i}.a{s}": a for i, row in enumerate(rig.anchors, start=1) for s, a in zip("xyz", row, strict=True)}
    true |= {f"c{i}.l0": z for i, z in enumerate(rig.zeros, start=1)}
    true |= {f"lens.{s}": v for s, v in zip(SYMBOLS, rig.lens, strict=True)} | {"print.size": rig.edge / rig.printed}
    for name, goal in true.items():
        if name in place:
            error[place[name]] = value[place[name]] - goal
    for name, t in {"eye": rig.eye, **{f"m{i}": t for i, t in enumerate(rig.markers)}}.items():
        six = [place.get(f"{name}.{s}") for s in ("x", "y", "z", "rx", "ry", "rz")]
        if None not in six:
            error[six[:3]] = value[six[:3]] - t[:3, 3]
            error[six[3:]] = so3.log(so3.exp(value[six[3:]]) @ t[:3, :3].T)
    covariance = np.array(known["covariance"])
    sigma = np.sqrt(np.diag(covariance))
    seen = np.isfinite(error) & (sigma > 0)
    kind = np.array(["map" if n[0] == "m" else "robot" if n[0] == "c" else "camera" for n in known["names"]])
    out = {}
    for word, part in {"all": seen, **{k: seen & (kind == k) for k in ("robot", "camera", "map")}}.items():
        e, c, s = error[part], covariance[np.ix_(part, part)], sigma[part]
        out[f"chi2 {word}"] = float((e / s) @ np.linalg.solve(c / np.outer(s, s), e / s) / part.sum())
    return out


def verify(folder, rig, said, known=None, run="run"):
    """The verification poses from lengths alone, by the identified robot; `known` are markers that were held."""
    markers, anchors = identified(folder / run)
    markers |= {0: rig.markers[0]} | (known or {})
    noise = said["cable"]["length_noise"]
    # Upright: lengths of crossed cables would allow a platform that is turned by half as well.
    made = rc.cable.forward(folder / run, folder / "verify.csv", sigma=noise, starts=0)
    columns = {c.name: np.asarray(c.values) for c in made.listing.columns if c.name != "id"}
    vector = np.column_stack([columns[n] for n in "xyz"] + [np.radians(columns[n]) for n in ("rx", "ry", "rz")])
    true = rig.poses[said["poses"]["calibration"] :]
    sigma = columns["sigma_position"].astype(float)
    return judge(rig, markers, anchors, se3.from_vector(vector.astype(float)), sigma, true)


def name_of(given):
    """Of what is run, as results are filed."""
    return given.case + "-images" * given.images + "-blind" * (given.images and given.without_lens)


def one(given, said, seed):
    """A seed: drawn, identified, verified."""
    case = name_of(given)
    folder = given.folder / (given.case + "-images" * given.images) / str(seed)
    rig, rng, camera = draw(said, seed, given.case)
    write(said, folder, rig, rng, camera, given.case, given.images, not given.without_lens)
    if given.draw:
        return None
    began = time.process_time()
    data = [folder / "lengths.yaml", folder / "pixels.yaml"]
    made = rc.identify(folder / "robot.yaml", data, output=folder / "run", force=True, leave_one_out=False)
    row = verify(folder, rig, said) | agreement(rig, folder / "run")
    row |= {"cpu s": time.process_time() - began}
    if given.two_stages:
        for word, found in two_stages(said, rig, folder, camera).items():
            row |= {f"{word} {k}": found[k] for k in ("aligned mm", "aligned deg", "marker 0 mm", "map Z mm")}
    remarks = made.result.remarks
    codes = list(dict.fromkeys(r.code for r in remarks if r.code in NAMED))
    against = [r.numbers for r in remarks if r.code == "prior-contradicted"]
    row |= {"lens sigma": float(max((n["z"] for n in against if n["owner"] == "lens"), default=0.0))}
    why = [r.code for r in made.result.verdict.remarks]
    return {"case": case, "seed": seed, "verdict": made.result.verdict.status, "named": codes, "why": why} | row


def attempt(given, said, seed):
    """A seed as it stands in its file: a failure is told, for others go on."""
    try:
        return one(given, said, seed)
    except Exception as failure:
        case = name_of(given)
        return {"case": case, "seed": seed, "failed": f"{type(failure).__name__}: {failure}"[:300]}


def seeds_of(word):
    """`0-39`, `7`, or `0,3,5-8`."""
    out = []
    for part in word.split(","):
        low, _, high = part.partition("-")
        out += range(int(low), int(high or low) + 1)
    return out


def main():
    """Draws, identifies, verifies and prints."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("rig", type=Path, nargs="?")
    words.add_argument("folder", type=Path, nargs="?")
    words.add_argument("--case", default="real", choices=["real", *DOMES, "narrow"])
    words.add_argument("--seeds", type=seeds_of, default=seeds_of("0-39"), help="0-39, or 0,3,5-8")
    words.add_argument("--jobs", type=int, default=1, help="seeds at the same time")
    words.add_argument("--rows", type=Path, help="folder of results, one file a seed; otherwise FOLDER/rows")
    words.add_argument(
        "--pool", type=Path, help="compute nothing: tell what was asked and measured, of a folder of results"
    )
    words.add_argument(
        "--two-stages", action="store_true", help="beside it the map first, then the robot by it, as the thesis has it"
    )
    words.add_argument("--images", action="store_true", help="corners from drawn images: texture, blur 0.8 px, noise 5")
    words.add_argument(
        "--without-lens", action="store_true", help="with --images: corners found without the calibrated lens"
    )
    words.add_argument("--draw", action="store_true", help="write the files alone")
    given = words.parse_args()
    if given.pool:
        pool(given.pool)
        return
    if given.folder is None:
        words.error("RIG.yaml and FOLDER are needed, or --pool")
    said = YAML(typ="safe").load(given.rig.read_text(encoding="utf-8"))
    records = given.rows or given.folder / "rows"
    records.mkdir(parents=True, exist_ok=True)
    case = name_of(given)
    known = {p: json.loads(p.read_text(encoding="utf-8")) for p in records.glob(f"{case}-*.json")}
    done = {r["seed"] for r in known.values() if r["case"] == case and "failed" not in r}
    wanted = [s for s in given.seeds if s not in done]
    with ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")) if given.jobs > 1 else nullcontext() as crew:
        each = (
            as_completed([crew.submit(attempt, given, said, s) for s in wanted])
            if crew
            else (attempt(given, said, s) for s in wanted)
        )
        for row in each:
            row = row.result() if crew else row
            if row is not None:
                (records / f"{case}-{row['seed']}.json").write_text(json.dumps(row) + "\n", encoding="utf-8")
                print(told(row), flush=True)
    if not given.draw:
        pool(records)


def pool(folder):
    """Tells, of every case in a folder of results, what was asked and measured."""
    rows = [json.loads(p.read_text(encoding="utf-8")) for p in sorted(folder.rglob("*.json"))]
    for case in sorted({r["case"] for r in rows}):
        some = sorted((r for r in rows if r["case"] == case), key=lambda r: r["seed"])
        for r in some:
            if "failed" in r:
                print(f"{case} {r['seed']} FAILED: {r['failed']}")
        some = [r for r in some if "failed" not in r]
        if not some:
            continue
        keys = [k for k, v in some[0].items() if isinstance(v, float)]
        keys = [k for k in keys if all(k in r for r in some)]
        middle = {k: float(np.median([r[k] for r in some])) for k in keys}
        rms = [np.sqrt(np.mean([r[k] ** 2 for r in some])) for k in ("marker 0 mm", "predicted")]
        verdicts = Counter(r["verdict"] for r in some)
        print(f"{case}: {len(some)} seeds, {', '.join(f'{k} {v}' for k, v in verdicts.items())}")
        said = Counter(c for r in some for c in (*r["named"], *r["why"]))
        print(f"  said: {', '.join(f'{k} {v}' for k, v in said.most_common()) or 'nothing'}")
        worst = {k: max(r[k] for r in some) for k in keys}
        print(f"  median {figures(middle)}\n  worst  {figures(worst)}")
        told_asked(case, middle | {"pooled": float(rms[0] / rms[1])}, worst, some)


ASKED = {"aligned mm": 3.0, "aligned deg": 0.6, "marker 0 mm": 3.7, "a mm": 6.7, "map Z mm": 3.3, "pooled": 1.1}
NARROW = {"aligned mm": 3.3, "marker 0 mm": 5.8, "a mm": 11.0}
STAGED = {"dome15": (25, 37), "dome50": (73, 114)}
FROM_IMAGES = 3.5, 6.0  # aligned, mm: median and worst
BEYOND = 5.0  # sigma at which the lens is named, where its prior is tight


def told_asked(case, middle, worst, rows):
    """Asked against measured, a line each."""
    if "-images" in case:
        half, all_ = FROM_IMAGES
        lines = [("aligned mm", middle["aligned mm"], f"<= {half}", middle["aligned mm"] <= half),
                 ("worst aligned mm", worst["aligned mm"], f"<= {all_}", worst["aligned mm"] <= all_)]  # fmt: skip
    else:
        lines = [(k, middle[k], f"<= {v}", middle[k] <= v) for k, v in (NARROW if case == "narrow" else ASKED).items()]
    if case == "tight":
        least = min(r["lens sigma"] for r in rows)
        lines = [("least sigma of the lens", least, f"> {BEYOND}", least > BEYOND)]
    if case in STAGED and "staged aligned mm" in middle:
        low, high = STAGED[case]
        lines += [(f"staged {k} mm", middle[f"staged {k} mm"], f"{low} to {high}", low <= middle[f"staged {k} mm"] <= high)
                  for k in ("aligned", "marker 0")]  # fmt: skip
    for name, value, bound, met in lines:
        print(f"  {name:24} asked {bound:10} measured {value:8.2f}  {'met' if met else 'NOT MET'}")


def figures(row):
    """Numbers in a line."""
    return "  ".join(f"{k} {v:.2f}" for k, v in row.items())


def told(row):
    """A seed in a line."""
    if "failed" in row:
        return f"{row['case']} {row['seed']}: FAILED {row['failed']}"
    numbers_ = {k: v for k, v in row.items() if isinstance(v, float)}
    return (
        f"{row['case']} {row['seed']}: {row['verdict']}  {figures(numbers_)}  {', '.join((*row['named'], *row['why']))}"
    )


NAMED = (
    "lens-contradicted",
    "scale-of-instrument",
    "scale-of-drums",
    "prior-contradicted",
    "above-stated-noise",
    "outliers",
)

if __name__ == "__main__":
    main()
