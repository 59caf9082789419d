"""Wrong robots and data of known truth, one cause each: the files, the words that name it, and its line obeyed."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from cli.runs import robocal
from worlds import Cables

from robocal.arms import catalog
from robocal.arms.chain import Chain
from robocal.arms.conventions import chain, rows
from robocal.arms.denavit import to_denavit
from robocal.files.robot import describe, open_robot
from robocal.files.units import UNITS, Units
from robocal.geometry import se3, so3

ARMS = ("rv-2aj", "ur10", "irb-120", "panda")
TOOL = tuple(f"tool.{s}" for s in ("x", "y", "z", "rx", "ry", "rz"))
TRACKER = se3.from_vector(np.array([1.5, -0.8, 0.4, 0.1, 0.2, 1.0]))


@dataclass
class Case:
    """A robot and a table on disk, and what a message has to say."""

    robot: Path
    data: Path
    words: str


@dataclass(frozen=True)
class Setting:
    """What an instrument reads (poses, or places), its noise (m), errors of the arm against the usual, and whether frame and tool are
    unknown."""

    pose: bool = False
    noise: float = 5e-5
    errors: float = 1.0
    frame: bool = True
    tool: bool = True

    @classmethod
    def draw(cls, rng, pose: bool) -> Setting:
        """Any that a user may have: 0.02 to 1 mm of noise, errors from a third to twice the usual."""
        free = rng.random(2) < (0.8, 0.8)
        return cls(pose, 2e-5 * 50 ** rng.random(), 0.33 * 6 ** rng.random(), *map(bool, free))


class World:
    """An arm in a folder, and what a tracker sees of the true one."""

    def __init__(self, folder: Path, name: str, rng, setting: Setting, form: str = "yaml") -> None:
        self.folder, self.rng, self.setting = folder, rng, setting
        arm = EXTRA[name]() if name in EXTRA else catalog.get(name)
        self.arm = arm if form == "own" or name in EXTRA else to_denavit(arm)
        if not setting.tool:
            at = dict(zip(("tool.x", "tool.y", "tool.z"), rng.uniform(-0.1, 0.1, 3) + [0, 0, 0.1], strict=True))
            self.arm = self.arm.with_values({k: v + self.arm.table[k].value for k, v in at.items()})
            self.arm = self.arm.with_table(self.arm.table.with_free(set(self.arm.table.free) - set(TOOL)))
        self.robot = (
            self.put("r.urdf", urdf(self.arm))
            if form == "urdf" and name != "scara"
            else self.put("r.yaml", describe(self.arm))
        )
        self.chain = open_robot(self.robot).chain
        self.names = list(self.chain.joint_names)
        low, high = np.clip(self.arm.limits, -2.5, 2.5).T
        self.q = rng.uniform(low, high, (int(rng.integers(30, 151)), len(low)))
        self.wide = np.array([j.type == "prismatic" for j in self.chain.joints])

    def put(self, name: str, text: str) -> Path:
        (self.folder / name).write_text(text, encoding="utf-8")
        return self.folder / name

    def like(self, arm: Chain) -> Chain:
        """Another arm with the tool of this one, known or not."""
        arm = arm.with_values({n: self.arm.table[n].value for n in TOOL})
        return arm.with_table(
            arm.table.with_free((set(arm.table.free) - set(TOOL)) | (set(self.arm.table.free) & set(TOOL)))
        )

    def truth(self, arm=None):
        """Lengths off by 0.3 to 1 mm, angles by 1 to 5 mrad, a target somewhere on the tool."""
        arm, rng = arm or self.chain, self.rng
        moved = {}
        for name in arm.geometric:
            low, high = (3e-4, 1e-3) if arm.table[name].unit == "m" else (1e-3, 5e-3)
            moved[name] = arm.table[name].value + self.setting.errors * rng.choice([-1, 1]) * rng.uniform(low, high)
        for name, at in zip("xyz", rng.uniform(-0.1, 0.1, 3) + [0, 0, 0.05], strict=True):
            moved[f"tool.{name}"] = arm.table[f"tool.{name}"].value + (at if self.setting.tool else 0.0)
        return arm.with_values(moved)

    def measure(self, q=None, arm=None, frame=None):
        """Poses with noise of 0.05 mm and 0.1 mrad, unless stated otherwise."""
        q, noise = self.q if q is None else q, self.setting.noise
        frame = (TRACKER if self.setting.frame else np.eye(4)) if frame is None else frame
        pose = frame @ (arm or self.truth()).pose(q)
        pose[:, :3, :3] = so3.exp(self.rng.normal(0, 2 * noise, (len(q), 3))) @ pose[:, :3, :3]
        pose[:, :3, 3] += self.rng.normal(0, noise, (len(q), 3))
        return pose

    def table(self, q, pose, length="mm", stated=None, angle="deg"):
        """Joint values and readings as a table with units in its headers; beside it a data.yaml where the frame is known."""
        of_joints = np.where(self.wide, UNITS["mm"].factor, UNITS[angle].factor)
        head = [f"{j} [{'mm' if w else 'deg'}]" for j, w in zip(self.names, self.wide, strict=True)]
        head += [f"{c} [{stated or length}]" for c in "xyz"]
        value = [q / of_joints, pose[:, :3, 3] / UNITS[length].factor]
        if self.setting.pose:
            head += [f"{c} [rad]" for c in ("rx", "ry", "rz")]
            value.append(so3.log(pose[:, :3, :3]))
        return self.beside(write(self.folder / "d.csv", head, np.hstack(value)))

    def beside(self, table: Path, **more: object) -> Path:
        """The table, or the data.yaml that says that its frame is the arm's base."""
        if self.setting.frame:
            return table
        keys: dict[str, object] = {
            "robocal": 1,
            "kind": "pose" if self.setting.pose else "position",
            "file": table.name,
        }
        keys |= {"joints": {"columns": self.names}, "position": {"columns": list("xyz")}}
        if self.setting.pose:
            keys["orientation"] = {"columns": ["rx", "ry", "rz"], "form": "rotation_vector"}
        keys |= {"frame": {"name": "table", "free": False}, **more}
        return self.put(f"{table.stem}.yaml", yaml.safe_dump(keys))


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


def scara() -> Chain:
    """Four joints, the third one slides: a table of the convention mdh."""
    rows_ = [
        {"name": "j1", "a": 0.0, "alpha": 0.0, "d": 0.22, "theta": 0.0, "limits": (-2.2, 2.2)},
        {"name": "j2", "a": 0.325, "alpha": 0.0, "d": 0.0, "theta": 0.0, "limits": (-2.4, 2.4)},
        {
            "name": "j3",
            "type": "prismatic",
            "a": 0.225,
            "alpha": 3.141592653589793,
            "d": 0.0,
            "theta": 0.0,
            "limits": (0.0, 0.21),
        },
        {"name": "j4", "a": 0.0, "alpha": 0.0, "d": 0.05, "theta": 0.0, "limits": (-3.1, 3.1)},
    ]
    return chain("scara", "mdh", rows_)


def on_a_rail() -> Chain:
    """Six turning joints on a rail of two metres."""
    arm = to_denavit(catalog.get("irb-120"))
    rail = {
        "name": "rail",
        "type": "prismatic",
        "theta": 1.5707963267948966,
        "d": 0.3,
        "a": 0.1,
        "alpha": -1.5707963267948966,
        "beta": 0.0,
        "limits": (-1.0, 1.0),
    }
    return chain("on a rail", "dh-hayati", [rail, *({"name": f"j{i + 1}", **r} for i, r in enumerate(rows(arm)))])


EXTRA: dict[str, Callable[[], Chain]] = {"scara": scara, "rail": on_a_rail}
CAUSES: dict[str, Callable[..., Case]] = {}


def cause(make: Callable[..., Case]) -> Callable[..., Case]:
    CAUSES[make.__name__] = make
    return make


def either(rng) -> str:
    return str(rng.choice(["yaml", "urdf", "own"]))


@cause
def signs(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    some = sorted(rng.choice(len(world.names), int(rng.integers(3, len(world.names))), replace=False))
    q = world.q.copy()
    q[:, some] *= -1
    return Case(world.robot, world.table(q, world.measure()), "count the other way")


@cause
def shared(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    q, share = world.q.copy(), rng.choice([1, -1])
    q[:, 2] -= share * q[:, 1]
    joint, other = world.names[2], world.names[1]
    return Case(world.robot, world.table(q, world.measure()), rf"with: {{{other}: {share}}} for {joint}")


@cause
def shared_and_zero(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    q, share = world.q.copy(), rng.choice([1, -1])
    q[:, 2] += np.pi / 2 * rng.choice([1, -1]) - share * q[:, 1]
    words = (
        rf"the zero of {world.names[2]} is off.*with: {{{world.names[1]}: {share}}} for {world.names[2]} and theta: "
    )
    return Case(world.robot, world.table(q, world.measure()), words)


@cause
def shared_and_sign(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    q, share = world.q.copy(), rng.choice([1, -1])
    q[:, 2] = -q[:, 2] - share * q[:, 1]
    words = rf"with: {{{world.names[1]}: {share}}} for {world.names[2]} and gain: -1 for {world.names[2]}"
    return Case(world.robot, world.table(q, world.measure()), words)


@cause
def dh_as_mdh(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    robot = world.put("r.yaml", re.sub(r"convention: \S+.*", "convention: mdh-hayati", describe(world.arm)))
    return Case(robot, world.table(world.q, world.measure()), "convention: dh-hayati")


@cause
def mdh_as_dh(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    arm = world.like(chain("arm", "mdh-hayati", rows(world.arm)))
    return Case(world.robot, world.table(world.q, world.measure(arm=world.truth(arm))), "convention: mdh-hayati")


@cause
def late_alpha(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    given = rows(world.arm)
    late = [0.0, *(row["alpha"] for row in given[:-1])]
    wrong = chain("arm", "dh-hayati", [{**row, "alpha": v} for row, v in zip(given, late, strict=True)])
    robot = world.put("r.yaml", describe(world.like(wrong)))
    return Case(robot, world.table(world.q, world.measure()), "alpha stands one row too late")


@cause
def lengths(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    stated, true = [("mm", "cm"), ("mm", "m"), ("m", "mm"), ("mm", "inch"), ("cm", "mm")][int(rng.integers(5))]
    text = describe(world.arm, Units(UNITS[true], UNITS["deg"])).replace(f"length: {true}", f"length: {stated}")
    words = rf"lengths of the robot are (probably )?in {true}"
    return Case(world.put("r.yaml", text), world.table(world.q, world.measure()), words)


@cause
def readings(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    true, stated = [("cm", "mm"), ("m", "mm"), ("mm", "m"), ("mm", "cm"), ("inch", "mm")][int(rng.integers(5))]
    return Case(world.robot, world.table(world.q, world.measure(), true, stated), rf"(in|expected) {true}\b|\[{true}\]")


@cause
def urdf_lengths(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, "urdf")
    times, unit = [(1000.0, "mm"), (100.0, "cm")][int(rng.integers(2))]
    robot = world.put("r.urdf", urdf(world.arm, times))
    return Case(robot, world.table(world.q, world.measure()), rf"lengths of the robot are (probably )?in {unit}")


@cause
def urdf_angles(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, "urdf")
    robot = world.put("r.urdf", urdf(world.arm, 1.0, 180 / np.pi))
    return Case(robot, world.table(world.q, world.measure()), "rpy of the robot are in deg")


@cause
def radians(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    which = ["theta|alpha", "alpha"][int(rng.integers(2))]
    text = re.sub(
        rf"({which}): ([-\d.e]+)", lambda m: f"{m[1]}: {round(np.radians(float(m[2])), 7)}", describe(world.arm)
    )
    return Case(world.put("r.yaml", text), world.table(world.q, world.measure()), "in rad")


@cause
def by_columns(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, replace(setting, pose=True, frame=True), either(rng))
    matrix = np.swapaxes(world.measure(), 1, 2).reshape(-1, 16)
    head = [f"{j} [deg]" for j in world.names]
    head += [f"T_{i}{k}" + (" [m]" if k == 3 and i < 3 else "") for i in range(4) for k in range(4)]
    data = write(folder / "d.csv", head, np.hstack([np.degrees(world.q), matrix]))
    return Case(world.robot, data, "column by column")


@cause
def rows_off(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    m = len(world.q)
    lost, at = int(rng.integers(1, 4)), int(rng.integers(m // 3, 2 * m // 3))
    pose_, rest = world.measure(), np.r_[0:at, at + lost : m]
    readings_lost = rng.random() < 0.5
    q, seen = (world.q[: m - lost], pose_[rest]) if readings_lost else (world.q[rest], pose_[: m - lost])
    return Case(
        world.robot, world.table(q, seen), f"{lost} rows? {'above' if readings_lost else 'below'} its joint values"
    )


@cause
def own_units(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, "urdf")
    low, high = np.clip(world.chain.limits, -6.3, 6.3).T
    return Case(
        world.robot,
        world.table(np.radians(100 * (2 * (world.q - low) / (high - low) - 1)), world.measure()),
        "a unit of its own, such as from -100 to 100",
    )


@cause
def other_robot(folder, name, rng, setting) -> Case:
    names = {"ur10": "irb-120", "irb-120": "ur10", "panda": "iiwa-14", "rv-2aj": "rx-90"}
    world = World(folder, name, rng, setting, either(rng))
    other = to_denavit(catalog.get(names[name]))
    at = int(rng.integers(len(world.q) // 3, 2 * len(world.q) // 3))
    q = world.q[at:]
    mine = other.pose(np.pad(q, ((0, 0), (0, len(other.joints) - q.shape[1]))))
    moved = TRACKER @ se3.from_vector(np.array([2.0, 1.0, 0.3, 0, 0, 0.7])) @ mine
    return Case(
        world.robot, world.table(world.q, np.concatenate([world.measure(world.q[:at]), moved])), "not of this robot"
    )


@cause
def in_turn(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    seen, frame = world.measure(), TRACKER @ se3.from_vector(np.array([2.0, 1.0, 0.3, 0.2, 0, 0.7]))
    seen[1::2] = world.measure(frame=frame)[1::2]
    return Case(world.robot, world.table(world.q, seen), "two robots, or of two instruments, in turn")


@cause
def angles(folder, name, rng, setting) -> Case:
    """Joint values in radians under headers that say deg."""
    world = World(folder, name, rng, setting, either(rng))
    return Case(world.robot, world.table(np.radians(world.q), world.measure()), r"in rad\b|\[rad\]")


@cause
def bearings(folder, name, rng, setting) -> Case:
    """An azimuth that counts clockwise, or an angle from the zenith."""
    world = World(folder, name, rng, replace(setting, pose=False, frame=True), either(rng))
    x, y, z = world.measure()[:, :3, 3].T
    level, clockwise = np.hypot(x, y), rng.random() < 0.5
    azimuth, elevation = np.arctan2(y, x), np.arctan2(z, level)
    bearing = (-azimuth, elevation) if clockwise else (azimuth, np.pi / 2 - elevation)
    head = [f"{j} [deg]" for j in world.names] + ["range [mm]", "azimuth [deg]", "elevation [deg]"]
    value = [np.degrees(world.q), 1e3 * np.hypot(level, z), *np.degrees(bearing)]
    words = (
        "azimuth counts clockwise"
        if clockwise
        else "elevation counts from the zenith|a zenith distance is to be converted"
    )
    return Case(world.robot, write(folder / "d.csv", head, np.column_stack(value)), words)


# --- two at once ------------------------------------------------------------------------------------------------------

PAIRS: dict[str, Callable[..., Case]] = {}
OTHER_LENGTHS = (("m", "mm"), ("cm", "mm"), ("mm", "m"), ("inch", "mm"))


def pair(make: Callable[..., Case]) -> Callable[..., Case]:
    PAIRS[make.__name__] = make
    return make


def both(*words: str) -> str:
    return "".join(f"(?=.*{w})" for w in words)


def inner(rng, names, least: int = 1, most: int = 2):
    """Some joints between the first and the last: whose sign no frame takes up."""
    return sorted(rng.choice(np.arange(1, len(names) - 1), int(rng.integers(least, most + 1)), replace=False))


def most_signs(world) -> int:
    """Three; of five joints two where the frame is free: all three that lift are the arm's plane turned by 180 deg."""
    return 2 if len(world.names) < 6 and world.setting.frame else 3


def flipped(q, some):
    q = q.copy()
    q[:, some] *= -1
    return q


def lengths_of(rng):
    return OTHER_LENGTHS[int(rng.integers(len(OTHER_LENGTHS)))]


@pair
def unit_and_signs(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    some, (true, stated) = inner(rng, world.names, 1, most_signs(world)), lengths_of(rng)
    return Case(
        world.robot,
        world.table(flipped(world.q, some), world.measure(), true, stated),
        both("the other way", rf"in {true}\b"),
    )


@pair
def angles_and_signs(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    q = flipped(world.q, inner(rng, world.names, 1, most_signs(world)))
    return Case(world.robot, world.table(np.radians(q), world.measure()), both("the other way", r"in rad\b"))


@pair
def shared_and_other_sign(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    q, share = world.q.copy(), rng.choice([1, -1])
    q[:, 2] -= share * q[:, 1]
    q[:, 3] *= -1
    words = both(f"{world.names[2]} counts with {world.names[1]}", f"{world.names[3]} counts the other way")
    return Case(world.robot, world.table(q, world.measure()), words)


@pair
def shared_and_unit(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    q, share, (true, stated) = world.q.copy(), rng.choice([1, -1]), lengths_of(rng)
    q[:, 2] -= share * q[:, 1]
    words = both(f"{world.names[2]} counts with {world.names[1]}", rf"in {true}\b")
    return Case(world.robot, world.table(q, world.measure(), true, stated), words)


@pair
def convention_and_lengths(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    true, stated = lengths_of(rng)
    text = describe(world.arm, Units(UNITS[true], UNITS["deg"])).replace(f"length: {true}", f"length: {stated}")
    robot = world.put("r.yaml", re.sub(r"convention: \S+.*", "convention: mdh-hayati", text))
    return Case(robot, world.table(world.q, world.measure()), both("dh-hayati", rf"in {true}\b"))


@pair
def convention_and_unit(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting)
    true, stated = lengths_of(rng)
    robot = world.put("r.yaml", re.sub(r"convention: \S+.*", "convention: mdh-hayati", describe(world.arm)))
    # Lengths of the robot and readings in other units are one mistake: which of the two is in the file, nobody can tell.
    words = both("dh-hayati", rf"in ({true}|cm|m|mm|inch)\b")
    return Case(robot, world.table(world.q, world.measure(), true, stated), words)


@pair
def late_and_unit(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    step, (true, stated), pose = int(rng.integers(1, 3)), lengths_of(rng), world.measure()
    q, seen = (world.q[step:], pose[:-step]) if rng.random() < 0.5 else (world.q[:-step], pose[step:])
    return Case(world.robot, world.table(q, seen, true, stated), both(f"{step} rows? (above|below)", rf"in {true}\b"))


@pair
def axes_and_unit(folder, name, rng, setting) -> Case:
    """Axes exchanged: two of them, so mirrored."""
    world = World(folder, name, rng, setting, either(rng))
    pose, (true, stated) = world.measure(), lengths_of(rng)
    a, b = rng.choice(3, 2, replace=False)
    pose[:, [a, b], 3] = pose[:, [b, a], 3]
    return Case(world.robot, world.table(world.q, pose, true, stated), both("axes are", rf"in {true}\b"))


@pair
def zero_and_sign(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    i, j = rng.choice(np.arange(1, len(world.names) - 1), 2, replace=False)
    q = flipped(world.q, [j])
    q[:, i] -= rng.choice([1, -1]) * np.pi / 2
    # The middle joint of a spherical wrist the other way is half a turn of both others: where the tool is free, one zero says both.
    one = name == "irb-120" and (i, j) == (3, 4) and setting.tool
    words = "zero of" if one else both("zero of", "the other way")
    return Case(world.robot, world.table(q, world.measure()), words)


@pair
def two_zeros(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    q = world.q.copy()
    for i in rng.choice(np.arange(1, len(world.names) - 1), 2, replace=False):
        q[:, i] -= rng.choice([1, -1, 2]) * np.pi / 2
    return Case(world.robot, world.table(q, world.measure()), "zero of .* and the zero of ")


@pair
def columns_and_late(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    order = np.arange(len(world.names))
    order[[1, 2]] = 2, 1
    words = both("columns of .* are exchanged", "1 row (above|below)")
    return Case(world.robot, world.table(world.q[1:, order], world.measure()[:-1]), words)


@pair
def mirror_and_zero(folder, name, rng, setting) -> Case:
    world = World(folder, name, rng, setting, either(rng))
    q, pose = world.q.copy(), world.measure()
    q[:, 2] += np.pi
    pose[:, 1, 3] *= -1
    return Case(world.robot, world.table(q, pose), "mirrored|the other way")


# --- nothing wrong ----------------------------------------------------------------------------------------------------

GOOD = ("plain", "lost", "bad", "warm", "gross", "one way", "few", "in hand", "cables")


def undamaged(folder, name, rng, pose, kind) -> tuple[Path, list[Path]]:
    """A robot and data in which nothing is wrong that could be named: lost zeros, errors of 5 mm and 1 deg, a column of temperatures,
    gross rows, joints that hardly turn the tool, few rows, a camera in hand, or a cable robot."""
    if kind == "cables":
        robot = Cables.nominal(str(rng.choice(["eight", "planar"])), rng)
        true = robot.true(rng, size=1e-3 * 30 ** rng.random())
        p, w = true.draw(rng, int(rng.integers(12, 100)))
        sigma = 2e-5 * 50 ** rng.random()
        y = true.lengths(p, w) + sigma * rng.normal(size=(len(p), len(true.l0)))
        robot_, *data = robot.write(
            folder, y, p + sigma * rng.normal(size=p.shape), w + sigma * rng.normal(size=w.shape), sigma
        )
        return folder / robot_, [folder / d for d in data]
    setting = Setting.draw(rng, pose or kind == "in hand")
    if kind == "bad":
        setting = replace(setting, errors=5.0)
    if kind == "in hand":
        setting = replace(setting, frame=True)
    world = World(folder, name, rng, setting, either(rng))
    q = world.q[: int(rng.integers(8, 26))] if kind == "few" else world.q.copy()
    if kind == "one way":
        q[:, 3:] = q[:1, 3:]
    n, shown = q.shape[1], q
    if kind == "lost":
        q = q + np.radians(rng.uniform(5, 40, n)) * rng.choice([-1, 1], n) * (rng.random(n) < rng.uniform(0.2, 1))
    seen = world.measure(q)
    if kind == "gross":
        some = rng.choice(len(q), int(rng.uniform(0.02, 0.15) * len(q)), replace=False)
        seen[some, :3, 3] += rng.normal(size=(len(some), 3)) * rng.choice([0.01, 0.1, 1.0])
    if kind == "in hand":
        seen = se3.inverse(seen)
    data = world.table(shown, seen)
    if kind == "in hand":
        keys = {
            "frame": {"name": "camera", "mount": "tool", "free": True},
            "targets": {"board": {"mount": "base", "free": True}},
        }
        world.setting = replace(setting, frame=False)
        data = world.beside(data, **keys)
    if kind == "warm":
        table = folder / "d.csv"
        head, value = read(table)
        write(table, [*head, "temperature [degC]"], np.column_stack([value, np.linspace(20, 28, len(value))]))
    return world.robot, [data]


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
        unit, those = line.split(",")[0], "deg" if "joints values" in message else r"(?<=^[xyz] \[)\w+"
        return robot, write(folder / "o.csv", [re.sub(those, unit, h) for h in head], value), []
    if "azimuth" in line or "elevation" in line:
        head, value = read(case.data)
        at = [h.split()[0] for h in head].index("azimuth" if "azimuth" in line else "elevation")
        value[:, at] = (0.0 if "azimuth" in line else 90.0) - value[:, at]
        return robot, write(folder / "o.csv", head, value), []
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


def obey_both(case: Case, message: str) -> tuple[Path, Path, list[str]]:
    """The same for two lines, each with its file where these differ."""
    line, robot, data = message.rpartition("; expected ")[2].partition(" or ")[0], case.robot, case.data
    parts = re.findall(r"(?:^|(?<=\) and ))(.*?) \(in (\S+)\)", line) or [
        (line, message.partition(", key ")[0].rpartition(" ")[2])
    ]
    for k, (told, place) in enumerate(parts):
        if place.endswith(".csv"):
            head, value = read(data)
            for name, unit in re.findall(r"(\w+) \[(\w+)\]", told):
                head = [re.sub(r"(?<=\[)\w+", unit, h) if h.startswith(f"{name} [") else h for h in head]
            if found := re.search(r"moved (up|down) by (\d)", told):
                n, step = len([h for h in head if "[deg]" in h]), int(found[2])
                joints, seen = (value[step:], value[:-step]) if found[1] == "up" else (value[:-step], value[step:])
                value = np.hstack([joints[:, :n], seen[:, n:]])
            data = write(data.with_name(f"o{k}.csv"), head, value)
        else:
            robot, _, _ = obey(replace(case, robot=robot), f"; expected {told}")
    return robot, data, []


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
