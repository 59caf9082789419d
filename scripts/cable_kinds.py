"""Kinds of cable by simulation: prints what was asked for and what is measured.

python scripts/cable_kinds.py [--kind NAME] [--seeds A-B] [--shard i/n] [--out FILE] [--pool FOLDER]

Lengths of every kind beside a geometry that is written here, of 200 poses; then calibrations from 40 poses, from files, whose errors are
divided by the sigmas that were foretold. --out appends one line of JSON for each seed, --pool judges what such files in a folder say.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot
from robocal.files.cable.cable_robot import read_cable
from robocal.geometry import se3
from robocal.prove.identify import identify
from robocal.session.inputs import read_inputs

POSES, OFF, LENGTH, PLACE, TURN = 40, 0.01, 2e-4, 1e-4, 1e-4  # m, and rad; OFF is what a nominal number is off by
ASKED_LENGTH, ASKED_RATIO, SEEDS = 1e-12, (0.9, 1.1), (0, 19)
FRAME = {
    "A1": (-2.0, -1.5, 3.0), "A2": (2.1, -1.5, 3.0), "A3": (2.0, 1.6, 3.1), "A4": (-2.0, 1.5, 2.9),
    "A5": (-2.0, -1.4, 0.0), "A6": (2.0, -1.5, 0.1), "A7": (2.1, 1.5, 0.0), "A8": (-1.9, 1.5, 0.0),
}  # fmt: skip
PLATFORM = {
    "B1": (-0.2, -0.15, 0.2), "B2": (0.2, -0.15, 0.2), "B3": (0.2, 0.15, 0.2), "B4": (-0.2, 0.15, 0.2),
    "B5": (0.1, -0.3, -0.2), "B6": (0.3, -0.1, -0.2), "B7": (-0.1, 0.3, -0.2), "B8": (-0.3, 0.1, -0.2),
}  # fmt: skip
FLAT = {"A1": (-2.0, 0.0, 3.0), "A2": (2.1, 0.0, 3.1), "A3": (-2.1, 0.0, 0.0), "A4": (2.0, 0.0, 0.1)}

# What a cable runs along: times, an end on the frame, and an end on the platform; two names of one body where it stands still.
Legs = Sequence[tuple[int, str, str]]
Points = dict[str, tuple[float, ...]]


class Case:
    """A kind: what cables run along, what is free, and what its file says besides."""

    def __init__(
        self,
        legs: dict[str, Legs],
        free: str,
        *,
        frame: Points = FRAME,
        platform: Points = PLATFORM,
        degrees: str = "3R3T",
        wheel: float = 0.0,
        rails: Sequence[str] = (),
        columns: bool = False,
        drum: bool = False,
        only: Sequence[str] = (),
    ) -> None:
        self.legs, self.free, self.frame, self.platform, self.degrees = legs, free, frame, platform, degrees
        self.wheel, self.rails, self.columns, self.drum, self.only = wheel, tuple(rails), columns, drum, tuple(only)

    @property
    def yaml(self) -> str:
        """The robot's file."""
        points = [f"{k}: [{', '.join(map(repr, v))}]" for k, v in (*self.frame.items(), *self.platform.items())]
        many, named = len(self.frame), any(len(v) > 1 or v[0][0] != 1 for v in self.legs.values())
        pulley = f", pulley: {{radius: {self.wheel}, axis: [0, 0, 1]}}" if self.wheel else ""
        rail = ", rail: {direction: [0.1, 0, -1], carriage: 0.2, gain: 1}"
        runs: dict[str, str] = {}
        cables = []
        for cable, legs in self.legs.items():
            if not named:
                (_, one, two), slides = legs[0], rail if cable in self.rails else ""
                cables.append(f"  - {{name: {cable}, frame: {one}, platform: {two}, zero: 0{slides}}}")
                continue
            for _, one, two in legs:
                sides = [one in self.frame, two in self.frame]
                ends = (
                    f"frame: {one}, platform: {two}"
                    if sides == [True, False]
                    else f"{'frame' if all(sides) else 'platform'}: [{one}, {two}]"
                )
                runs[f"{one}{two}"] = f"  {one}{two}: {{{ends}{pulley if sides == [True, False] else ''}}}"
            words = ", ".join(f"{one}{two}: {n}" for n, one, two in legs)
            cables.append(f"  - {{name: {cable}, zero: 0, segments: {{{words}}}}}")
        drum = ["every_cable: {build_up: 0.02}"] if self.drum else []
        gains = [c.replace("zero: 0", "zero: 0, gain: 1") for c in cables] if self.drum else cables
        head = [
            "robocal: 1",
            "name: kinds",
            "kind: cable",
            "units: {length: m}",
            f"degrees: {self.degrees}",
            "plane: xz",
        ]
        both = [f"frame_anchors: {{{', '.join(points[:many])}}}", f"platform_anchors: {{{', '.join(points[many:])}}}"]
        segments = ["segments:", *runs.values()] if named else []
        return "\n".join([*head, *both, *segments, "cables:", *gains, *drum, f"calibrate: {{free: [{self.free}]}}", ""])


def up(i: int) -> Legs:
    """A cable from one upper corner over a pulley of the platform to the next."""
    return ((1, f"A{i}", f"B{i}"), (1, f"A{i % 4 + 1}", f"B{i}"))


STRAIGHT = {f"c{i}": ((1, f"A{i}", f"B{i}"),) for i in range(1, 9)}
PLANAR = {
    "M1": ((1, "A1", "P"), (1, "A2", "P")),
    "M2": ((1, "A1", "P"), (2, "A3", "P")),
    "M3": ((1, "A2", "P"), (2, "A4", "P")),
}
MOVING = {
    **{f"c{i}": up(i) for i in range(1, 5)},
    **{f"c{i}": ((2, f"A{i}", f"B{i}"),) for i in range(5, 8)},
    "c8": ((1, "A8", "B8"),),
}
STILL = {
    **MOVING, "c8": ((1, "A7", "A8"), (3, "A8", "B8"), (1, "B8", "B7"), (2, "A5", "B7")), "c7": ((2, "A7", "B7"), (-1, "A6", "B6")),
}  # fmt: skip
CASES = {
    "straight": Case(STRAIGHT, "ax, ay, az, l0"),
    "planar m+n m+2k n+2h": Case(PLANAR, "ax, az, l0", frame=FLAT, platform={"P": (0.0, 0.0, 0.0)}, degrees="2T"),
    "moving pulleys": Case(MOVING, "ax, ay, az, l0"),
    "still segments, differences": Case(STILL, "ax, ay, az, l0"),
    "wheels on the frame": Case(MOVING, "ax, ay, az, l0, radius", wheel=0.05),
    "rails with carriages read": Case(
        STRAIGHT, "ax, ay, az, l0, rail, rx, ry", rails=("c1", "c2", "c3", "c4"), columns=True
    ),
    "rails, only carriages moved": Case(
        STRAIGHT, "c1.carriage, c3.carriage", rails=("c1", "c2", "c3", "c4"), only=("c1", "c3")
    ),
    "drums that build up": Case(STRAIGHT, "ax, ay, az, l0, gain, build_up", drum=True),
}


def own_length(case: Case, numbers: dict[str, float], cable: str, pose: np.ndarray, carriage: float | None) -> float:
    """What the sensor of a cable shows at a pose, from the numbers of a robot, by sums of distances, tangents and a root."""
    total = []
    for times, one, two in case.legs[cable]:
        alone = not any(len(v) > 1 or v[0][0] != 1 for v in case.legs.values())
        name = cable if alone else f"{one}{two}"
        ends = []
        for letter, point in (("a", one), ("b", two)):
            xyz = [numbers.get(f"{name}.{letter}{s}", math.nan) for s in "xyz"]
            if math.isnan(xyz[0]):  # another segment has that anchor first
                xyz = [numbers[f"{owner_of(case, point)}{s}"] for s in "xyz"]
            if letter == "a" and f"{name}.rail" in numbers:
                d = [numbers[f"{name}.r{s}"] for s in "xyz"]
                s = numbers[f"{name}.carriage"] if carriage is None else carriage
                xyz = [p + numbers[f"{name}.rail"] * s * v / math.hypot(*d) for p, v in zip(xyz, d, strict=True)]
            if point in case.platform and not (one in case.platform and two in case.platform):
                xyz = [math.fsum([pose[r, 3], *(pose[r, c] * xyz[c] for c in range(3))]) for r in range(3)]
            ends.append(xyz)
        radius = numbers.get(f"{name}.radius", 0.0)
        total.append(times * (over_wheel(*ends, radius) if radius else math.dist(*ends)))
    full = math.fsum([*total, -numbers[f"{cable}.l0"]])
    g, q = numbers.get(f"{cable}.gain", 1.0), numbers.get(f"{cable}.build_up", numbers.get("cables.build_up", 0.0))
    if not q:
        return full / g
    y = full / g
    for _ in range(60):  # Newton's
        y -= (q * y * y + g * y - full) / (2 * q * y + g)
    return y


def owner_of(case: Case, point: str) -> str:
    """The segment that has an anchor first, in the order of the file, and the letter under which it stands: that of its first cable before
    what cables run along besides."""
    first = [legs[0] for legs in case.legs.values()]
    for _, one, two in (*first, *(leg for legs in case.legs.values() for leg in legs[1:])):
        for letter, name in (("a", one), ("b", two)):
            if name == point:
                return f"{one}{two}.{letter}"
    raise KeyError(point)


def over_wheel(start: Sequence[float], end: Sequence[float], radius: float) -> float:
    """From a point up along z, around a wheel, and on its tangent to the end."""
    across, up = math.hypot(end[0] - start[0], end[1] - start[1]), end[2] - start[2]
    far = math.hypot(across - radius, up)
    touches = math.atan2(up, across - radius) + math.acos(radius / far)
    return radius * ((math.pi - touches) % (2 * math.pi)) + math.sqrt(far * far - radius * radius)


def drawn(case: Case, rng: np.random.Generator) -> tuple[CableRobot, CableRobot]:
    """The nominal robot of a case, and a true one that differs by what is free."""
    with tempfile.TemporaryDirectory() as place:
        (path := Path(place) / "robot.yaml").write_text(case.yaml)
        nominal = read_cable(path).robot
    size = {"rail": 0.01, "rx": 0.02, "ry": 0.02, "gain": 0.01, "build_up": 0.005, "radius": 0.003, "carriage": 0.3}
    free = nominal.table.free
    values = {n: nominal.table[n].value + size.get(n.rpartition(".")[2], OFF) * rng.uniform(-1, 1) for n in free}
    return nominal, nominal.with_values(values)


def places(robot: CableRobot, count: int, rng: np.random.Generator) -> np.ndarray:
    """Poses within the frame."""
    vector = np.tile(se3.to_vector(robot.home[None])[0], (count, 1))
    for i in robot.axes:
        vector[:, i] = (
            (0.0, 0.0, 1.4)[i] + (1.2, 0.8, 0.8)[i] * rng.uniform(-1, 1, count)
            if i < 3
            else rng.uniform(-0.35, 0.35, count)
        )
    return se3.from_vector(vector)


def show(case: Case, robot: CableRobot, t: np.ndarray, read: np.ndarray | None) -> np.ndarray:
    """What sensors show, by the geometry of this file."""
    numbers = {p.name: p.value for p in robot.table.rows}
    out = np.empty((len(t), len(robot.cables)))
    for k, pose in enumerate(t):
        for i, cable in enumerate(robot.cables):
            stood = None if read is None or cable not in case.rails else float(read[k, case.rails.index(cable)])
            out[k, i] = own_length(case, numbers, cable, pose, stood)
    return out


def lengths(case: Case) -> float:
    """The greatest difference of 200 lengths of every cable from this file's geometry, m."""
    rng = np.random.default_rng(7)
    _, truth = drawn(case, rng)
    t, most = places(truth, 200, rng), 0.0
    read = rng.uniform(0.0, 0.8, (200, len(case.rails))) if case.columns else None
    if read is None:
        return float(np.abs(inverse(truth, t)[0] - show(case, truth, t, None)).max())
    for k in range(len(t)):
        stood = truth.with_values({f"{c}.carriage": float(read[k, i]) for i, c in enumerate(case.rails)})
        most = max(
            most, float(np.abs(inverse(stood, t[k])[0] - show(case, truth, t[k : k + 1], read[k : k + 1])).max())
        )
    return most


def calibrate(case: Case, seed: int) -> list[float]:
    """Errors over sigmas of what was identified from 40 poses, from files."""
    rng = np.random.default_rng(100 + seed)
    nominal, truth = drawn(case, rng)
    t = places(nominal, POSES, rng)
    read = rng.uniform(0.0, 0.8, (POSES, len(case.rails))) if case.columns else None
    shown = show(case, truth, t, read) + LENGTH * rng.normal(size=(POSES, len(truth.cables)))
    seen = se3.to_vector(t) + np.repeat([PLACE, TURN], 3) * rng.normal(size=(POSES, 6))
    turned = max(truth.axes) > 2
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "robot.yaml").write_text(case.yaml)
        slides = [] if read is None else [f"s{i}" for i in range(len(case.rails))]
        columns = ["id", *truth.cables, *slides, "x", "y", "z", "rx", "ry", "rz"]
        rows = np.column_stack([shown, *([] if read is None else [read]), seen])
        text = [",".join(columns), *(f"p{i}," + ",".join(repr(float(v)) for v in row) for i, row in enumerate(rows))]
        (folder / "run.csv").write_text("\n".join(text) + "\n")
        head, told = "robocal: 1\nfile: run.csv\nconfiguration: {id: id}\n", ", ".join(truth.cables)
        carriage = (
            f"carriage: {{columns: [{', '.join(slides)}], cables: [{', '.join(case.rails)}], unit: m}}\n"
            if slides
            else ""
        )
        (folder / "lengths.yaml").write_text(
            f"{head}kind: lengths\nlengths: {{columns: [{told}], unit: m, sigma: {LENGTH}}}\n{carriage}"
        )
        place_ = f"position: {{columns: [x, y, z], unit: m, sigma: {PLACE}}}\nframe: {{name: world, free: false}}\n"
        turn = (
            f"orientation: {{columns: [rx, ry, rz], unit: rad, form: rotation_vector, sigma: {TURN}}}\n"
            if turned
            else ""
        )
        (folder / "pose.yaml").write_text(f"{head}kind: {'pose' if turned else 'position'}\n{place_}{turn}")
        data = read_inputs(folder / "robot.yaml", [folder / "lengths.yaml", folder / "pose.yaml"])
        found = identify(data.opened.file.machine, data.data)
    kept = found.identifiability.basis
    sigma = np.sqrt(np.diag(found.covariance))
    seen_by = {n: float(s) for n, s in zip(kept, sigma, strict=True)}
    off = {
        p.name: p.identified - truth.table[p.name].value
        for p in found.parameters
        if p.name in truth.table and p.name in seen_by
    }
    lost = [n for n in nominal.table.free if n not in off and not n.endswith((".rx", ".ry"))]
    print(
        f"  seed {seed}: {found.verdict.status}, {len(off)} numbers"
        + (f", not seen: {', '.join(lost)}" if lost else ""),
        flush=True,
    )
    return [off[n] / seen_by[n] for n in off]


def judge(worth: dict[str, list[float]]) -> bool:
    """Prints the ratio of every kind; whether all are as asked."""
    met = True
    for kind, z in worth.items():
        ratio, (low, high) = float(np.sqrt(np.mean(np.square(z)))), ASKED_RATIO
        good = low <= ratio <= high
        met &= good
        print(
            f"{kind}: rms over sigma {ratio:.3f} of {len(z)} numbers, asked {low} to {high}: {'met' if good else 'NOT MET'}"
        )
    return met


def pooled(folder: Path) -> dict[str, list[float]]:
    """What runs with --out wrote."""
    out: dict[str, list[float]] = {}
    for path in sorted(folder.glob("*.json*")):
        for line in path.read_text().splitlines():
            said = json.loads(line)
            out.setdefault(said["kind"], []).extend(said["z"])
    return out


def option(words: list[str], name: str) -> str | None:
    """The word behind an option."""
    return words[words.index(name) + 1] if name in words else None


def asked_seeds(words: list[str]) -> Iterator[int]:
    """Seeds of this call."""
    first, last = (int(v) for v in (option(words, "--seeds") or "-".join(map(str, SEEDS))).split("-"))
    part, of = (int(v) for v in (option(words, "--shard") or "0/1").split("/"))
    return (s for s in range(first, last + 1) if s % of == part % of)


def main(words: list[str]) -> int:
    """All kinds; 0 where everything is met."""
    if folder := option(words, "--pool"):
        return 0 if judge(pooled(Path(folder))) else 1
    kinds = [k for k in CASES if (option(words, "--kind") or k) in k]
    met = True
    for kind in kinds:
        most = lengths(CASES[kind])
        met &= most <= ASKED_LENGTH
        print(
            f"{kind}: lengths differ by {most:.1e} m, asked {ASKED_LENGTH:g}: {'met' if most <= ASKED_LENGTH else 'NOT MET'}"
        )
    worth: dict[str, list[float]] = {}
    for kind in kinds:
        print(kind)
        for seed in asked_seeds(words):
            z = calibrate(CASES[kind], seed)
            worth.setdefault(kind, []).extend(z)
            if file := option(words, "--out"):
                with Path(file).open("a") as out:
                    out.write(json.dumps({"kind": kind, "seed": seed, "z": z}) + "\n")
    return 0 if judge(worth) and met else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
