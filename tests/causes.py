"""Wrong robots and data of known truth, one cause each: the files, the words that name it, and its line obeyed."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from cli.runs import robocal

from robocal.arms import catalog
from robocal.arms.conventions import chain, rows
from robocal.arms.denavit import to_denavit
from robocal.files.robot import describe, open_robot
from robocal.files.units import UNITS, Units
from robocal.geometry import se3, so3

ARMS = ("rv-2aj", "ur10", "irb-120", "panda")
TRACKER = se3.from_vector(np.array([1.5, -0.8, 0.4, 0.1, 0.2, 1.0]))


@dataclass
class Case:
    """A robot and a table on disk, and what a message has to say."""

    robot: Path
    data: Path
    words: str


class World:
    """An arm in a folder, and what a tracker sees of the true one."""

    def __init__(self, folder: Path, name: str, rng, pose: bool, form: str = "yaml") -> None:
        self.folder, self.rng, self.pose = folder, rng, pose
        self.arm = to_denavit(catalog.get(name))
        self.robot = self.put("r.yaml", describe(self.arm)) if form == "yaml" else self.put("r.urdf", urdf(self.arm))
        self.chain = open_robot(self.robot).chain
        self.names = list(self.arm.joint_names)
        low, high = np.clip(self.arm.limits, -2.5, 2.5).T
        self.q = rng.uniform(low, high, (int(rng.integers(30, 151)), len(low)))

    def put(self, name: str, text: str) -> Path:
        (self.folder / name).write_text(text, encoding="utf-8")
        return self.folder / name

    def truth(self, arm=None):
        """Lengths off by 0.3 to 1 mm, angles by 1 to 5 mrad, a target somewhere on the tool."""
        arm, rng = arm or self.chain, self.rng
        moved = {}
        for name in arm.geometric:
            low, high = (3e-4, 1e-3) if arm.table[name].unit == "m" else (1e-3, 5e-3)
            moved[name] = arm.table[name].value + rng.choice([-1, 1]) * rng.uniform(low, high)
        for name, at in zip("xyz", rng.uniform(-0.1, 0.1, 3) + [0, 0, 0.05], strict=True):
            moved[f"tool.{name}"] = arm.table[f"tool.{name}"].value + at
        return arm.with_values(moved)

    def measure(self, q=None, arm=None, frame=TRACKER):
        """Poses with noise of 0.05 mm and 0.1 mrad."""
        q = self.q if q is None else q
        pose = frame @ (arm or self.truth()).pose(q)
        pose[:, :3, :3] = so3.exp(self.rng.normal(0, 1e-4, (len(q), 3))) @ pose[:, :3, :3]
        pose[:, :3, 3] += self.rng.normal(0, 5e-5, (len(q), 3))
        return pose

    def table(self, q, pose, length="mm", stated=None, name="d.csv"):
        """Joint values and readings as a table with units in its headers."""
        head = [f"{j} [deg]" for j in self.names] + [f"{c} [{stated or length}]" for c in "xyz"]
        value = [np.degrees(q), pose[:, :3, 3] / UNITS[length].factor]
        if self.pose:
            head += [f"{c} [rad]" for c in ("rx", "ry", "rz")]
            value.append(so3.log(pose[:, :3, :3]))
        return write(self.folder / name, head, np.hstack(value))


def write(place: Path, head, value) -> Path:
    text = "\n".join([",".join(head), *(",".join(f"{x:.9g}" for x in row) for row in value)])
    place.write_text(text + "\n", encoding="utf-8")
    return place


def read(place: Path):
    head = place.read_text(encoding="utf-8").splitlines()[0].split(",")
    return head, np.loadtxt(place, delimiter=",", skiprows=1)


def urdf(arm, length: float = 1.0, angle: float = 1.0) -> str:
    """A URDF with a link at each frame of a Denavit-Hartenberg table, in m and rad times `length` and `angle`."""

    def origin(t) -> str:
        xyz, rpy = t[:3, 3] * length, so3.roll_pitch_yaw(t[:3, :3]) * angle
        return f'<origin xyz="{" ".join(f"{v:.9g}" for v in xyz)}" rpy="{" ".join(f"{v:.9g}" for v in rpy)}"/>'

    lines = ['<?xml version="1.0"?>', '<robot name="arm">', '<link name="l0"/>']
    at = se3.from_vector(np.array([arm.table[f"base.{s}"].value for s in ("x", "y", "z", "rx", "ry", "rz")]))
    for i, (row, joint) in enumerate(zip(rows(arm), arm.joints, strict=True)):
        low, high = max(joint.lower, -6.3), min(joint.upper, 6.3)
        lines += [
            f'<link name="l{i + 1}"/>',
            f'<joint name="{joint.name}" type="{joint.type}"><parent link="l{i}"/><child link="l{i + 1}"/>{origin(at)}'
            f'<axis xyz="0 0 1"/><limit lower="{low:.6g}" upper="{high:.6g}" effort="1" velocity="1"/></joint>',
        ]
        at = np.eye(4)
        for step in (
            (0, 0, row["d"], 0, 0, row["theta"]),
            (row["a"], 0, 0, row["alpha"], 0, 0),
            (0, 0, 0, 0, row["beta"], 0),
        ):
            at = at @ se3.from_vector(np.array(step, float))
    n = len(arm.joints)
    lines += [
        f'<link name="f"/><joint name="fl" type="fixed"><parent link="l{n}"/><child link="f"/>{origin(at)}</joint>'
    ]
    return "\n".join([*lines, "</robot>\n"])


CAUSES: dict[str, Callable[..., Case]] = {}


def cause(make: Callable[..., Case]) -> Callable[..., Case]:
    CAUSES[make.__name__] = make
    return make


def either(rng) -> str:
    return str(rng.choice(["yaml", "urdf"]))


@cause
def signs(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose, either(rng))
    some = sorted(rng.choice(len(world.names), int(rng.integers(3, len(world.names))), replace=False))
    q = world.q.copy()
    q[:, some] *= -1
    return Case(world.robot, world.table(q, world.measure()), "count the other way")


@cause
def shared(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose, either(rng))
    q, share = world.q.copy(), rng.choice([1, -1])
    q[:, 2] -= share * q[:, 1]
    joint, other = world.names[2], world.names[1]
    return Case(world.robot, world.table(q, world.measure()), rf"with: {{{other}: {share}}} for {joint}")


@cause
def shared_and_zero(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose)
    q, share = world.q.copy(), rng.choice([1, -1])
    q[:, 2] += np.pi / 2 * rng.choice([1, -1]) - share * q[:, 1]
    words = (
        rf"the zero of {world.names[2]} is off.*with: {{{world.names[1]}: {share}}} for {world.names[2]} and theta: "
    )
    return Case(world.robot, world.table(q, world.measure()), words)


@cause
def shared_and_sign(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose)
    q, share = world.q.copy(), rng.choice([1, -1])
    q[:, 2] = -q[:, 2] - share * q[:, 1]
    words = rf"with: {{{world.names[1]}: {share}}} for {world.names[2]} and gain: -1 for {world.names[2]}"
    return Case(world.robot, world.table(q, world.measure()), words)


@cause
def dh_as_mdh(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose)
    robot = world.put("r.yaml", re.sub(r"convention: \S+.*", "convention: mdh-hayati", describe(world.arm)))
    return Case(robot, world.table(world.q, world.measure()), "convention: dh-hayati")


@cause
def mdh_as_dh(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose)
    arm = chain("arm", "mdh-hayati", rows(world.arm))
    return Case(world.robot, world.table(world.q, world.measure(arm=world.truth(arm))), "convention: mdh-hayati")


@cause
def late_alpha(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose)
    given = rows(world.arm)
    late = [0.0, *(row["alpha"] for row in given[:-1])]
    wrong = chain("arm", "dh-hayati", [{**row, "alpha": v} for row, v in zip(given, late, strict=True)])
    robot = world.put("r.yaml", describe(wrong))
    return Case(robot, world.table(world.q, world.measure()), "alpha stands one row too late")


@cause
def lengths(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose)
    stated, true = [("mm", "cm"), ("mm", "m"), ("m", "mm"), ("mm", "inch"), ("cm", "mm")][int(rng.integers(5))]
    text = describe(world.arm, Units(UNITS[true], UNITS["deg"])).replace(f"length: {true}", f"length: {stated}")
    words = rf"lengths of the robot are (probably )?in {true}"
    return Case(world.put("r.yaml", text), world.table(world.q, world.measure()), words)


@cause
def readings(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose, either(rng))
    true, stated = [("cm", "mm"), ("m", "mm"), ("mm", "m"), ("mm", "cm"), ("inch", "mm")][int(rng.integers(5))]
    return Case(world.robot, world.table(world.q, world.measure(), true, stated), rf"(in|expected) {true}\b|\[{true}\]")


@cause
def urdf_lengths(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose, "urdf")
    times, unit = [(1000.0, "mm"), (100.0, "cm")][int(rng.integers(2))]
    robot = world.put("r.urdf", urdf(world.arm, times))
    return Case(robot, world.table(world.q, world.measure()), rf"lengths of the robot are (probably )?in {unit}")


@cause
def urdf_angles(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose, "urdf")
    robot = world.put("r.urdf", urdf(world.arm, 1.0, 180 / np.pi))
    return Case(robot, world.table(world.q, world.measure()), "rpy of the robot are in deg")


@cause
def radians(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose)
    which = ["theta|alpha", "alpha"][int(rng.integers(2))]
    text = re.sub(
        rf"({which}): ([-\d.e]+)", lambda m: f"{m[1]}: {round(np.radians(float(m[2])), 7)}", describe(world.arm)
    )
    return Case(world.put("r.yaml", text), world.table(world.q, world.measure()), "in rad")


@cause
def by_columns(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, True, either(rng))
    matrix = np.swapaxes(world.measure(), 1, 2).reshape(-1, 16)
    head = [f"{j} [deg]" for j in world.names]
    head += [f"T_{i}{k}" + (" [m]" if k == 3 and i < 3 else "") for i in range(4) for k in range(4)]
    data = write(folder / "d.csv", head, np.hstack([np.degrees(world.q), matrix]))
    return Case(world.robot, data, "column by column")


@cause
def rows_off(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose, either(rng))
    m = len(world.q)
    lost, at = int(rng.integers(1, 4)), int(rng.integers(m // 3, 2 * m // 3))
    pose_, rest = world.measure(), np.r_[0:at, at + lost : m]
    readings_lost = rng.random() < 0.5
    q, seen = (world.q[: m - lost], pose_[rest]) if readings_lost else (world.q[rest], pose_[: m - lost])
    return Case(
        world.robot, world.table(q, seen), f"{lost} rows? {'above' if readings_lost else 'below'} its joint values"
    )


@cause
def own_units(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose, "urdf")
    low, high = np.clip(world.chain.limits, -6.3, 6.3).T
    return Case(
        world.robot,
        world.table(np.radians(100 * (2 * (world.q - low) / (high - low) - 1)), world.measure()),
        "a unit of its own, such as from -100 to 100",
    )


@cause
def other_robot(folder, name, rng, pose) -> Case:
    names = {"ur10": "irb-120", "irb-120": "ur10", "panda": "iiwa-14", "rv-2aj": "rx-90"}
    world = World(folder, name, rng, pose, either(rng))
    other = to_denavit(catalog.get(names[name]))
    at = int(rng.integers(len(world.q) // 3, 2 * len(world.q) // 3))
    q = world.q[at:]
    mine = other.pose(np.pad(q, ((0, 0), (0, len(other.joints) - q.shape[1]))))
    moved = TRACKER @ se3.from_vector(np.array([2.0, 1.0, 0.3, 0, 0, 0.7])) @ mine
    return Case(
        world.robot, world.table(world.q, np.concatenate([world.measure(world.q[:at]), moved])), "not of this robot"
    )


@cause
def in_turn(folder, name, rng, pose) -> Case:
    world = World(folder, name, rng, pose, either(rng))
    seen, frame = world.measure(), TRACKER @ se3.from_vector(np.array([2.0, 1.0, 0.3, 0.2, 0, 0.7]))
    seen[1::2] = world.measure(frame=frame)[1::2]
    return Case(world.robot, world.table(world.q, seen), "two robots, or of two instruments, in turn")


# --- its line obeyed --------------------------------------------------------------------------------------------------


def obey(case: Case, message: str) -> tuple[Path, Path, list[str]]:
    """Robot, data and further options after the line of a message was written."""
    folder, line, robot = case.robot.parent, message.rpartition("; expected ")[2], case.robot
    if case.words == "column by column":
        (folder / "d.yaml").write_text(line.partition("with the line ")[2], encoding="utf-8")
        return robot, folder / "d.yaml", []
    if "every other row" in line:
        head, value = read(case.data)
        return robot, write(folder / "o.csv", head, value[::2]), []
    if found := re.search(r"exclude: ([\d-]+)", line):
        return robot, case.data, ["--exclude", found[1]]
    if found := re.search(r"from row (\d+) to row (\d+) each reading stands (\d) rows? (above|below)", message):
        return robot, _move_rows(case.data, *map(int, found.groups()[:3]), found[4]), []
    if "values are probably in" in message:
        head, value = read(case.data)
        unit = line.split(",")[0]
        return robot, write(folder / "o.csv", [re.sub(r"(?<=^[xyz] \[)\w+", unit, h) for h in head], value), []
    if " --format yaml " in line:
        ran = robocal("export", robot, "--format", "yaml", "-o", folder / "robot.yaml", "--force")
        assert ran.status == 0, ran.err
        robot = folder / "robot.yaml"
    text = robot.read_text(encoding="utf-8")
    if robot.suffix == ".urdf":
        robot = folder / "o.urdf"
        robot.write_text(_obey_urdf(text, line), encoding="utf-8")
    else:
        robot = folder / "o.yaml"
        robot.write_text(_obey_yaml(text, line), encoding="utf-8")
    return robot, case.data, []


def _move_rows(data: Path, first: int, last: int, step: int, where: str) -> Path:
    head, value = read(data)
    joints = len([h for h in head if h.endswith("[deg]")])
    step = step if where == "below" else -step
    inside = np.arange(first - 2, last - 1)
    kept = inside[(inside - step >= inside[0]) & (inside - step <= inside[-1])]
    moved = np.hstack([value[kept - step, :joints], value[kept, joints:]])
    return write(data.with_name("o.csv"), head, np.vstack([value[: first - 2], moved, value[last - 1 :]]))


def _obey_urdf(text: str, line: str) -> str:
    if found := re.search(r"every (xyz|rpy) (divided by|times) ([\d.e+-]+)", line):
        factor = float(found[3]) if found[2] == "times" else 1 / float(found[3])
        origin = rf'(<origin[^>]*{found[1]}=")([^"]*)'
        return re.sub(origin, lambda m: m[1] + " ".join(repr(float(v) * factor) for v in m[2].split()), text)
    found = re.search(r"the axis of (.*) with the other sign", line)
    assert found, line
    for joint in re.split(r", | and ", found[1]):
        text = re.sub(rf'(name="{joint}" type=.*?<axis xyz=")0 0 1', r"\g<1>0 0 -1", text)
    return text


def _obey_yaml(text: str, line: str) -> str:
    robot = yaml.safe_load(text)
    line = line.partition(" or ")[0].partition(" (in ")[0]
    of = {row["name"]: row for row in robot["joints"]}
    if found := re.match(r"(\w+): (.*), joint by joint", line):
        for row, value in zip(robot["joints"], found[2].split(", "), strict=True):
            row[found[1]] = float(value)
    elif " for " in line:
        for part in re.split(r"(?<= for )", line.partition(" in the robot.yaml")[0])[:-1]:
            rest = line[line.index(part) + len(part) :] if part in line else line
            joint = re.match(r"\w+", rest)[0]
            keys = re.sub(r"^\w+(, | and )", "", part) if part.startswith(tuple(of)) else part
            of[joint].update(yaml.safe_load("{" + keys.removesuffix(" for ") + "}"))
    elif line in UNITS:
        robot["units"]["length"] = line
    else:
        robot.update(yaml.safe_load(line))
    return yaml.safe_dump(robot)
