"""Forty URDFs, each with a feature that files of the field have and some more by chance: the chain is the product that formulas written
out here say, an unchanged model is exported byte for byte, and nothing of a file is left out without a remark."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from cli.runs import robocal

from robocal.errors import FormatError
from robocal.files.robot import read_robot, render_robot

FEATURES = (
    "quaternions", "half turns", "poles", "fixed between", "no limits", "half a limit", "leaves", "mimic beside", "fingers",
    "floating root", "planar root", "comment first", "latin-1", "calibration", "prismatic", "continuous", "long axes", "exponents",
    "xacro leftovers", "materials", "mimic in the chain", "mimic at the end", "defaults", "late lines", "own words",
)  # fmt: skip
SPECIAL = {
    "floating root", "planar root", "mimic in the chain", "mimic at the end", "fingers", "leaves", "mimic beside", "own words",
    "no limits", "half a limit", "comment first", "latin-1",
}  # fmt: skip
COUNT = 40
POLES = (
    np.pi / 2,
    -np.pi / 2,
    1.5707963,
    -1.5707963,
    1.570796,
    1.5708,
    np.pi / 2 - 3e-10,
    np.pi / 2 - 1e-9,
    -np.pi / 2 + 1e-7,
)
TURNS = (np.pi, -np.pi, 3.14159, -3.1415926, 3.141593, np.pi / 2, -1.5708)
AXES = ("0 0 1", "0 0 -1", "1 0 0", "0 1 0", "0 -1 0")
LONG_AXES = ("0 0 2", "1 1 0", "0.0 0.7071 0.7071", "0 -0.001 0", "3e2 0 4e2", "1 2 -3")
SHORT = '<limit effort="10" velocity="2"/>'


def turn_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """R (3, 3) of a turn about a unit vector, by its formula."""
    x, y, z = axis
    c, s, v = np.cos(angle), np.sin(angle), 2 * np.sin(angle / 2) ** 2
    return np.array(
        [
            [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
            [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
            [z * x * v - y * s, z * y * v + x * s, c + z * z * v],
        ]
    )


def from_rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    x, y, z = np.eye(3)
    return turn_about(z, yaw) @ turn_about(y, pitch) @ turn_about(x, roll)


def from_quaternion(words: str) -> np.ndarray:
    q = np.array([float(w) for w in words.split()])
    x, y, z, w = q / np.sqrt((q * q).sum())
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def words_of(roll: float, pitch: float, yaw: float, digits: int) -> str:
    """The quaternion of three angles, x y z w: the product of three half turns."""
    (cr, cp, cy), (sr, sp, sy) = (f(np.array([roll, pitch, yaw]) / 2) for f in (np.cos, np.sin))
    parts = (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
    return " ".join(f"{v:.{digits}g}" for v in parts)


@dataclass
class Sample:
    """A file that is being written, and what is true of it: `way` are origin, type and unit axis of every joint of the arm."""

    rng: np.random.Generator
    features: set[str]
    lines: list[str] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    way: list[tuple[np.ndarray, str, np.ndarray]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    options: dict[str, str] = field(default_factory=dict)  # without which it is refused
    codes: set[str] = field(default_factory=set)
    refusal: str = ""

    def has(self, feature: str, chance: float = 1.0) -> bool:
        return feature in self.features and self.rng.random() < chance

    def joint(
        self,
        name: str,
        parent: str,
        child: str,
        kind: str = "revolute",
        *,
        arm: bool = True,
        more: str = "",
        limit: str | None = None,
    ) -> None:
        self.links.append(child)
        origin, at = self.origin()
        words, axis = self.axis()
        if limit is None:
            limit = '<limit lower="-2.9" upper="2.9" effort="1" velocity="1"/>'
        parts = [origin, f'<parent link="{parent}"/>', f'<child link="{child}"/>']
        if kind != "fixed":
            parts += [words, limit if kind != "continuous" else ""]
        if self.has("calibration", 0.5):
            parts.append(
                '<calibration rising="0.3" falling="-1e-2"/><safety_controller k_velocity="3"/><dynamics damping="1"/>'
            )
        self.rng.shuffle(parts)
        self.lines.append(
            f'  <joint type="{kind}" name="{name}">' + "\n    ".join(["", *filter(None, parts), more]) + "\n  </joint>"
        )
        if arm:
            self.way.append((at, kind, axis))
            if kind != "fixed":
                self.names.append(name)

    def origin(self) -> tuple[str, np.ndarray]:
        rng, at = self.rng, np.eye(4)
        if self.has("defaults", 0.3):
            return "", at
        xyz = [f"{v:.4f}" for v in rng.normal(0, 0.2, 3)]
        if self.has("exponents"):
            xyz = [f"{v:.3e}" for v in rng.normal(0, 0.2, 3)]
            xyz[rng.integers(3)] = str(rng.choice(["1e-3", "-2.5E-1", "+.5", "5.", "1e-320"]))
        turn = [0.0 if rng.random() < 0.3 else float(rng.normal()) for _ in range(3)]
        if self.has("half turns", 0.7):
            turn[rng.integers(3)] = float(rng.choice(TURNS))
        if self.has("poles", 0.8):
            turn[1] = float(rng.choice(POLES))
        at[:3, 3] = [float(v) for v in xyz]
        if self.has("quaternions", 0.7):
            quat = words_of(*turn, digits=int(rng.choice([6, 9, 17])))
            at[:3, :3] = from_quaternion(quat)
            return f"<origin xyz='{' '.join(xyz)}' quat_xyzw=\"{quat}\"/>", at
        if self.has("defaults", 0.4):
            return f'<origin xyz="{" ".join(xyz)}"/>', at
        at[:3, :3] = from_rpy(*turn)
        return f'<origin rpy="{" ".join(map(repr, turn))}" xyz="{"  ".join(xyz)}" />', at

    def axis(self) -> tuple[str, np.ndarray]:
        if self.has("defaults", 0.3):
            return "", np.eye(3)[0]
        words = str(self.rng.choice(LONG_AXES if self.has("long axes", 0.8) else AXES))
        axis = np.array([float(w) for w in words.split()])
        return f'<axis xyz="{words}"/>', axis / np.sqrt((axis * axis).sum())

    def fk(self, q: np.ndarray) -> np.ndarray:
        """The tip's pose (4, 4) for values of the joints that move."""
        out, values = np.eye(4), iter(q)
        for at, kind, axis in self.way:
            move = np.eye(4)
            if kind == "prismatic":
                move[:3, 3] = next(values) * axis
            elif kind != "fixed":
                move[:3, :3] = turn_about(axis, next(values))
            out = out @ at @ move
        return out

    @property
    def data(self) -> bytes:
        head = '<?xml version="1.0"?>\n'
        if self.has("comment first"):
            head = "<!-- by hand -->\n<?xml version='1.0' encoding='utf-8'?>\n"
        if self.has("latin-1"):
            head = '<?xml version="1.0" encoding="ISO-8859-1"?>\n<!-- modèle étalonné -->\n'
        space = ' xmlns:xacro="http://www.ros.org/wiki/xacro"' if "xacro leftovers" in self.features else ""
        body = ["<!-- made by xacro: do not edit; ${arg} -->"] if space else []
        links = [f'  <link name="{n}"/>' for n in self.links]
        if "materials" in self.features:
            inside = '<visual><origin xyz="9 9 9" rpy="1 1 1"/><geometry><mesh filename="package://a/b.stl" scale="1e-3 1e-3 1e-3"/></geometry></visual>'
            links[-1] = f'  <link name="{self.links[-1]}"><inertial><mass value="2"/></inertial>{inside}</link>'
            body.append('  <material name="red"><color rgba="1 0 0 1"/></material>')
            body.append(
                '  <transmission name="t1"><type>x</type><joint name="j1"><hardwareInterface>p</hardwareInterface></joint></transmission>'
            )
            body.append('  <gazebo reference="l1"><joint name="none" type="unknown"/></gazebo>')
        text = "\n".join([f'{head}<robot name="arm"{space}>', *body, *links, *self.lines, "</robot>"]) + "\n"
        if "late lines" in self.features:
            text = text.replace("\n", "\r\n") + "<!-- end -->"
        return text.encode(self.encoding)

    @property
    def encoding(self) -> str:
        return "latin-1" if "latin-1" in self.features else "utf-8"


def sample(k: int) -> Sample:
    """File k of the forty: its own feature, and each other one of the harmless with a chance."""
    rng = np.random.default_rng([31, k])
    own = FEATURES[k % len(FEATURES)]
    s = Sample(rng, {own} | {f for f in FEATURES if f not in SPECIAL and rng.random() < 0.25})
    if own in ("no limits", "half a limit"):
        s.features -= {"defaults", "continuous"}
    at = "base"
    s.links.append(at)
    for kind in ("floating", "planar"):
        if f"{kind} root" in s.features:
            s.joint("loose", "base", "l0", kind, arm=False)
            at = s.options["base"] = "l0"
            s.refusal = "--base l0"
    count = int(rng.integers(3, 8))
    for i in range(1, count + 1):
        kind, limit, more = "revolute", None, ""
        if s.has("prismatic", 0.4):
            kind = "prismatic"
        elif s.has("continuous", 0.4):
            kind = "continuous"
        if i == 2 and own in ("no limits", "half a limit"):
            kind, limit = "revolute", "" if own == "no limits" else SHORT
            s.codes.add("keys-unstated")
        if i == 2 and own == "own words":
            more = '<limits lower="1"/><colour of="it"/>'
            s.codes.add("elements-unread")
        s.joint(f"j{i}", at, f"l{i}", kind, limit=limit, more=more)
        at = f"l{i}"
        for n in range(int(rng.integers(0, 4)) if "fixed between" in s.features else 0):
            s.joint(f"f{i}_{n}", at, f"m{i}_{n}", "fixed")
            at = f"m{i}_{n}"
        if i == 2 and own == "leaves":
            s.joint("camera", at, "camera", "fixed", arm=False)
            s.codes.add("tip-chosen")
        if i == 2 and own == "mimic beside":
            s.joint("rod", at, "rod", arm=False, more='<mimic joint="j1" multiplier="-1" offset="0.1"/>')
            s.codes.add("tip-chosen")
    if own == "fingers":
        s.joint("hand", at, "hand", "fixed")
        s.joint("left", "hand", "finger1", "prismatic")
        s.joint("right", "hand", "finger2", "prismatic", arm=False, more='<mimic joint="left"/>')
        s.codes.add("tip-chosen")
    if own in ("mimic in the chain", "mimic at the end"):
        s.joint("m", at, "level", arm=False, more='<mimic joint="j2" multiplier="-1"/>')
        s.joint("end", "level", "flange", "fixed" if own == "mimic at the end" else "revolute", arm=False)
        s.options["tip"], s.refusal = at, f"--tip {at}"
    return s


@pytest.mark.parametrize("k", range(COUNT))
def test_a_file_is_what_it_says(tmp_path, k):
    s = sample(k)
    place = tmp_path / "arm.urdf"
    place.write_bytes(s.data)
    if s.refusal:
        with pytest.raises(FormatError, match=f"row .*{s.refusal}"):
            read_robot(place)
    robot = read_robot(place, **s.options)
    assert list(robot.chain.joint_names) == s.names, sorted(s.features)
    q = s.rng.uniform(-2, 2, (6, len(s.names)))
    expected = np.array([s.fk(row) for row in q])
    np.testing.assert_allclose(robot.chain.pose(q), expected, rtol=0, atol=1e-12, err_msg=str(sorted(s.features)))
    # An origin that one joint alone leaves out is a doubt; where files leave out many of them, it is their way.
    may = {"keys-unstated"} if "defaults" in s.features else set()
    assert {w.code for w in robot.warnings} - may == s.codes, sorted(s.features)
    # Out again, as it was, and with one origin changed.
    words = [w for key, value in s.options.items() for w in (f"--{key}", value)]
    ran = robocal("export", place, "--format", "urdf", *words)
    assert ran.status == 0 and ran.out.encode(s.encoding) == s.data, ran.said
    name = f"{s.names[1]}.ry"
    values = {name: robot.chain.table[name].value + 0.02}
    (tmp_path / "two.urdf").write_bytes(render_robot(robot, values)[0].encode(s.encoding))
    again = read_robot(tmp_path / "two.urdf", **s.options)
    np.testing.assert_allclose(again.chain.pose(q), robot.chain.with_values(values).pose(q), rtol=0, atol=1e-12)


def test_every_feature_is_seen():
    seen = [sample(k).features for k in range(COUNT)]
    assert set.union(*seen) == set(FEATURES) and len(FEATURES) <= COUNT
