"""Robots, true robots and what instruments read of them, by formulas of their own: nothing of robocal is imported here.

An arm is a table of rows (theta, d, a, alpha, beta), T = prod Rz(theta + q) Tz(d) Tx(a) Rx(alpha) Ry(beta). A cable robot shows
|p + R b - a| - l0. Files are written as their users write them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

MM, DEG = 1e-3, np.pi / 180
SYMBOLS = ("theta", "d", "a", "alpha", "beta")
# theta, d, a, alpha in deg and mm, and the limits of the joints in deg.
TABLES = {
    "six": (
        [[0, 290, 0, -90], [-90, 0, 270, 0], [0, 0, 70, -90], [0, 302, 0, 90], [0, 0, 0, -90], [180, 72, 0, 0]],
        [(-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-180, 180)],
    ),
    "long": (
        [[0, 450, 150, -90], [-90, 0, 790, 0], [0, 0, 250, -90], [0, 835, 0, 90], [0, 0, 0, -90], [0, 100, 0, 0]],
        [(-170, 170), (-60, 120), (-120, 90), (-180, 180), (-120, 120), (-180, 180)],
    ),
    "seven": (
        [
            [0, 360, 0, -90],
            [0, 0, 0, 90],
            [0, 420, 0, 90],
            [0, 0, 0, -90],
            [0, 400, 0, -90],
            [0, 0, 0, 90],
            [0, 126, 0, 0],
        ],
        [(-160, 160), (-110, 110), (-160, 160), (-110, 110), (-160, 160), (-110, 110), (-170, 170)],
    ),
}


def rotation(axis, angle):
    """Turns (m, 3, 3) about one axis."""
    return Rotation.from_rotvec(np.multiply.outer(np.asarray(angle, float), np.eye(3)[axis])).as_matrix()


def frame(r, p):
    """Frames (m, 4, 4)."""
    out = np.zeros((*np.shape(r)[:-2], 4, 4))
    out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = r, p, 1.0
    return out


def left_after_registration(p, q):
    """How far points q (m, 3) stay from p when a rigid motion puts them there as well as it can, (m,)."""
    one, other = p - p.mean(axis=0), q - q.mean(axis=0)
    u, _, v = np.linalg.svd(other.T @ one)
    turn = (u * [1, 1, np.sign(np.linalg.det(u @ v))]) @ v
    return np.linalg.norm(one - other @ turn, axis=1)


@dataclass(frozen=True)
class Arm:
    """Rows (n, 5) in rad and m, or of every configuration (m, n, 5); the tool's point (3,); limits (n, 2)."""

    rows: np.ndarray
    tool: np.ndarray
    limits: np.ndarray

    @classmethod
    def nominal(cls, name):
        table, limits = TABLES[name]
        t = np.array(table, float)
        rows = np.column_stack([t[:, 0] * DEG, t[:, 1] * MM, t[:, 2] * MM, t[:, 3] * DEG, np.zeros(len(t))])
        return cls(rows, np.array([0.03, -0.02, 0.11]), np.array(limits) * DEG)

    def true(self, rng, size=1.0):
        """As it was made."""
        wrong = rng.normal(size=self.rows.shape) * np.array([2e-3, 6e-4, 6e-4, 2e-3, 1e-3]) * size
        return replace(self, rows=self.rows + wrong, tool=self.tool + 1e-3 * rng.normal(size=3))

    def flange(self, q):
        t, none = np.broadcast_to(np.eye(4), (len(q), 4, 4)), np.zeros(len(q))
        for i in range(self.rows.shape[-2]):
            theta, d, a, alpha, beta = (np.broadcast_to(v, len(q)) for v in np.moveaxis(self.rows[..., i, :], -1, 0))
            t = t @ frame(rotation(2, theta + q[:, i]), np.stack([none, none, d], axis=1))
            t = t @ frame(rotation(0, alpha) @ rotation(1, beta), np.stack([a, none, none], axis=1))
        return t

    def point(self, q, tool=None):
        t = self.flange(q)
        return (
            np.einsum("mij,mj->mi", t[:, :3, :3], np.broadcast_to(self.tool if tool is None else tool, (len(q), 3)))
            + t[:, :3, 3]
        )

    def draw(self, rng, m, share=0.8):
        low, high = self.limits.T
        return (low + high) / 2 + (high - low) / 2 * share * rng.uniform(-1, 1, (m, len(low)))

    def way(self, rng, m, step, share=0.7):
        """A smooth way, (m, n): sums of sines."""
        low, high = self.limits.T
        n = len(low)
        t = 2 * step * np.arange(m)[:, None] * rng.uniform(0.6, 1.6, n)
        sines = 0.7 * np.sin(t + rng.uniform(0, 6, n)) + 0.3 * np.sin(2.3 * t + rng.uniform(0, 6, n))
        return (low + high) / 2 + (high - low) / 2 * share * sines

    def write(self, folder, q, seen, sigma, more=""):
        """robot.yaml of this arm; data.yaml and data.csv of joint values q (m, n) and positions (m, 3)."""
        rows = [
            f"  - {{name: j{i + 1}, theta: {r[0] / DEG:.12g}, d: {r[1] / MM:.12g}, a: {r[2] / MM:.12g}, alpha: {r[3] / DEG:.12g}, "
            f"beta: {r[4] / DEG:.12g}, limits: [{low:.6g}, {high:.6g}]}}"
            for i, (r, (low, high)) in enumerate(zip(self.rows, self.limits / DEG, strict=True))
        ]
        tool = ", ".join(f"{v / MM:.12g}" for v in self.tool)
        joints = [f"j{i + 1}" for i in range(q.shape[1])]
        (folder / "robot.yaml").write_text(
            "\n".join(
                [
                    "robocal: 1",
                    "name: arm",
                    "kind: arm",
                    "units: {length: mm, angle: deg}",
                    "convention: dh-hayati",
                    "joints:",
                    *rows,
                ]
            )
            + f"\ntool: {{xyz: [{tool}], rotation_vector: [0, 0, 0], free: true}}\ncalibrate: {{free: [theta, d, a, alpha, beta]}}\n"
        )
        lines = [",".join(f"{v:.10g}" for v in (*a / DEG, *b / MM)) for a, b in zip(q, seen, strict=True)]
        head = ",".join([*(f"{j} [deg]" for j in joints), "x [mm]", "y [mm]", "z [mm]"])
        (folder / "data.csv").write_text("\n".join([head, *lines]) + "\n")
        (folder / "data.yaml").write_text(
            "robocal: 1\nkind: position\nfile: data.csv\nunits: {length: mm, angle: deg}\n"
            f"joints: {{columns: [{', '.join(joints)}]}}\nposition: {{columns: [x, y, z], sigma: {sigma / MM:.6g}}}\n"
            "frame: {name: tracker, free: true}\n" + more
        )
        return ("robot.yaml", "data.yaml")

    def named(self, values):
        """The same arm with identified numbers, SI by name."""
        rows = [
            [values.get(f"j{i + 1}.{s}", v) for s, v in zip(SYMBOLS, r, strict=True)] for i, r in enumerate(self.rows)
        ]
        return replace(
            self,
            rows=np.array(rows),
            tool=np.array([values.get(f"tool.{s}", v) for s, v in zip("xyz", self.tool, strict=True)]),
        )

    def with_tool_fitted(self, p, q):
        """The same with the tool that suits points p (m, 3) at q best, as a baseline has it."""
        t = self.flange(q)

        def left(tool):
            return left_after_registration(p, t[:, :3, :3] @ tool + t[:, :3, 3])

        return replace(self, tool=least_squares(left, self.tool, x_scale=1e-2).x)


@dataclass(frozen=True)
class Cables:
    """Frame anchors (m, 3), platform anchors (m, 3), zeros (m,)."""

    a: np.ndarray
    b: np.ndarray
    l0: np.ndarray
    degrees: str = "3R3T"

    @classmethod
    def nominal(cls, name, rng):
        if name == "eight":
            corners = [[x, y, z] for z in (3.0, 0.1) for x, y in ((2, 1.5), (-2, 1.5), (-2, -1.5), (2, -1.5))]
            b = [
                [0.15, 0.05],
                [-0.15, 0.05],
                [-0.15, -0.05],
                [0.15, -0.05],
                [0.05, 0.15],
                [-0.05, 0.15],
                [-0.05, -0.15],
                [0.05, -0.15],
            ]
            a = np.array(corners, float) + 0.05 * rng.normal(size=(8, 3))
            return cls(a, np.column_stack([b, [-0.1] * 4 + [0.1] * 4]), np.zeros(8))
        a = np.array([[-2, 0, 3], [2, 0, 3], [2, 0, 0], [-2, 0, 0]]) + rng.normal(size=(4, 3)) * [0.05, 0, 0.05]
        return cls(
            a, np.array([[-0.12, 0, 0.08], [0.12, 0, 0.08], [0.12, 0, -0.08], [-0.12, 0, -0.08]]), np.zeros(4), "1R2T"
        )

    @property
    def planar(self):
        return self.degrees == "1R2T"

    def true(self, rng, size=8e-3, zero=5e-3):
        """As it was built."""
        wrong = rng.normal(size=self.a.shape) * size * (np.array([1, 0, 1]) if self.planar else 1)
        return replace(self, a=self.a + wrong, l0=self.l0 + zero * rng.normal(size=len(self.a)))

    def lengths(self, p, w):
        r = Rotation.from_rotvec(w).as_matrix()
        return np.linalg.norm(p[:, None] + np.einsum("kij,mj->kmi", r, self.b) - self.a, axis=2) - self.l0

    def _flat(self, p, w):
        if self.planar:
            p[:, 1], w[:, [0, 2]] = 0.0, 0.0
        return p, w

    def draw(self, rng, m, half=None, middle=None, turn=0.25):
        """Positions and rotation vectors (m, 3) within 0.6 of the frame, or within `half` (3,) of `middle`."""
        low, high = self.a.min(axis=0), self.a.max(axis=0)
        centre, half = (low + high) / 2 if middle is None else middle, 0.3 * (high - low) if half is None else half
        return self._flat(centre + half * rng.uniform(-1, 1, (m, 3)), turn * rng.uniform(-1, 1, (m, 3)))

    def way(self, rng, m, step):
        """A smooth way through the same room."""
        low, high = self.a.min(axis=0), self.a.max(axis=0)
        t = 2 * step * np.arange(m)[:, None] * rng.uniform(0.7, 1.5, 6)
        s = 0.7 * np.sin(t + rng.uniform(0, 6, 6)) + 0.3 * np.sin(2.1 * t + rng.uniform(0, 6, 6))
        return self._flat((low + high) / 2 + 0.3 * (high - low) * s[:, :3], 0.25 * s[:, 3:])

    def pose_from_lengths(self, y, p, w):
        """Positions (m, 3) by least squares from poses nearby."""
        free = [0, 2, 4] if self.planar else list(range(6))
        out = []
        for k in range(len(y)):

            def left(x, k=k):
                v = np.zeros(6)
                v[free] = x
                return self.lengths(p[k : k + 1] + v[:3], w[k : k + 1] + v[3:])[0] - y[k]

            v = np.zeros(6)
            v[free] = least_squares(left, np.zeros(len(free)), x_scale=0.1, method="lm").x
            out.append(p[k] + v[:3])
        return np.array(out)

    def write(self, folder, y, p, w, sigma, free=False):
        """robot.yaml of this robot, lengths (m, cables) and an instrument's poses beside them."""

        def told(name, points):
            return "".join(f"  {name}{i + 1}: [{', '.join(f'{v:.10g}' for v in r)}]\n" for i, r in enumerate(points))

        cables = "".join(
            f"  - {{name: c{i + 1}, frame: A{i + 1}, platform: B{i + 1}, zero: {v:.10g}}}\n"
            for i, v in enumerate(self.l0)
        )
        (folder / "robot.yaml").write_text(
            f"robocal: 1\nname: cables\nkind: cable\nunits: {{length: m, angle: deg}}\ndegrees: {self.degrees}\n"
            + ("plane: xz\n" if self.planar else "")
            + f"frame_anchors:\n{told('A', self.a)}platform_anchors:\n{told('B', self.b)}cables:\n{cables}"
            + f"calibrate: {{free: {'[ax, az, l0]' if self.planar else '[ax, ay, az, l0]'}}}\n"
        )
        names = [f"c{i + 1}" for i in range(len(self.l0))]
        rows = [f"p{k:04d}," + ",".join(f"{v / MM:.6f}" for v in row) for k, row in enumerate(y)]
        (folder / "lengths.csv").write_text("\n".join([",".join(["id", *(f"{n} [mm]" for n in names)]), *rows]) + "\n")
        (folder / "lengths.yaml").write_text(
            f"robocal: 1\nkind: lengths\nfile: lengths.csv\nlengths: {{columns: [{', '.join(names)}], sigma: {sigma / MM:.6g}, unit: mm}}\n"
            "configuration: {id: id}\n"
        )
        rows = [
            f"p{k:04d}," + ",".join(f"{v:.6f}" for v in (*a / MM, *b / DEG))
            for k, (a, b) in enumerate(zip(p, w, strict=True))
        ]
        (folder / "poses.csv").write_text(
            "\n".join(["id,x [mm],y [mm],z [mm],rx [deg],ry [deg],rz [deg]", *rows]) + "\n"
        )
        (folder / "poses.yaml").write_text(
            f"robocal: 1\nkind: pose\nfile: poses.csv\nposition: {{columns: [x, y, z], sigma: {sigma / MM:.6g}, unit: mm}}\n"
            f"orientation: {{columns: [rx, ry, rz], form: rotation_vector, sigma: {sigma / DEG:.6g}, unit: deg}}\n"
            f"frame: {{name: tracker, free: {str(free).lower()}}}\nconfiguration: {{id: id}}\n"
        )
        return ("robot.yaml", "lengths.yaml", "poses.yaml")

    def named(self, values):
        """The same robot with identified numbers, SI by name."""
        a = [[values.get(f"c{i + 1}.a{s}", v) for s, v in zip("xyz", r, strict=True)] for i, r in enumerate(self.a)]
        return replace(self, a=np.array(a), l0=np.array([values.get(f"c{i + 1}.l0", v) for i, v in enumerate(self.l0)]))
