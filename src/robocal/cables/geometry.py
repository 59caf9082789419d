"""A cable robot: a platform hung from frame anchors, and the lengths of its straight cables.

    l_i = |p + R b_i - a_i| - l0_i,    y_i = l_i / g_i

Cable i runs from frame anchor a_i (base coordinates) to platform anchor b_i (platform coordinates); l0_i is the zero
of its length sensor, which shows y_i: its drum winds up a length g_i times as long (1 where nothing is stated). With a pulley
the cable enters at a_i, wraps and leaves towards the platform (`cables/pulley.py`).
The base's z points up. Twists are (v, w) in base axes about the platform's origin.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from types import EllipsisType
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import field, record, replace
from robocal._types import Array
from robocal.cables.material import GAIN, STRETCH, WHEEL, material_rows
from robocal.cables.pulley import Pulleys, run
from robocal.errors import require
from robocal.geometry import se3
from robocal.geometry.path.unjointed import Unjointed
from robocal.parameters import Parameter, ParameterTable

__all__ = [
    "COMMON",
    "DEGREES",
    "EXPECTED",
    "GAIN",
    "STRETCH",
    "SYMBOLS",
    "WHEEL",
    "CableRobot",
    "cable_robot",
    "cable_table",
    "home",
    "lengths",
    "straight",
]

SYMBOLS = ("ax", "ay", "az", "bx", "by", "bz", "l0")
PLATFORM = "platform"  # whose mass and centre of mass are, where load cells tell them
COMMON = "cables"  # whose a number is that all cables have together
SPATIAL = (0, 1, 2, 3, 4, 5)
# What a tape measure or radio beacons leave, by the thesis; four poses and more improve it a hundredfold.
EXPECTED = 0.1  # tolerance: m

# What a robot can do, by plane (`plane` is that of a planar robot): the components of the twist (v, w) that it has.
DEGREES: Mapping[str, Mapping[str, tuple[int, ...]]] = {
    "3R3T": {"xy": SPATIAL, "xz": SPATIAL, "yz": SPATIAL},
    "3T": {"xy": SPATIAL[:3], "xz": SPATIAL[:3], "yz": SPATIAL[:3]},
    "1R2T": {"xy": (0, 1, 5), "xz": (0, 2, 4), "yz": (1, 2, 3)},
    "2T": {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)},
}


@record(eq=False)
class CableRobot(Unjointed):
    """Anchors and sensor zeros of m cables, as a parameter table `c1.ax` ... `c1.bz`, `c1.l0` in m, and what else is
    known of them.

    The table also has what is known of pulleys, `c1.radius` in m and the swivel axis `c1.nx` ... `c1.nz` of any length,
    of stretch, `c1.elasticity` in 1/N: strain per tension, and of drums, `c1.gain`. mass in kg, com (3,) in m and inertia (3, 3) in kg m2
    about com, all in platform axes; limits (m, 2): least and greatest tension in N; density (m,): weight per unstretched
    length in N/m; diameter (m,) in m. None: not known. `degrees` is a key of DEGREES; a planar robot moves in `plane` of the
    base (xz and yz stand upright). `sources` says where values come from, `assumed` names those that were chosen:
    c1.a, c1.b, c1.zero, c1.tension, c1.pulley, ..., mass, com, inertia; the source of them all is under "". Cables that share an
    anchor share its parameters: `shared` says whose they are ("c2.ax": "c1.ax"), and the table has them once.
    """

    # None: anchors are coordinates, and their scale is that of the winches that are read.
    lengths: ClassVar[tuple[str, ...]] = ()

    name: str
    cables: tuple[str, ...]
    table: ParameterTable
    mass: float | None = None
    com: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array | None = None
    limits: Array | None = None
    density: Array | None = None
    diameter: Array | None = None
    degrees: str = "3R3T"
    plane: str = "xz"
    shared: Mapping[str, str] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()

    @cached_property
    def numbers(self) -> Array:
        """The seven numbers of every cable in the order of SYMBOLS, (m, 7)."""
        return np.array([[self.table[self.row(f"{c}.{s}")].value for s in SYMBOLS] for c in self.cables])

    @property
    def parts(self) -> Mapping[str, tuple[str, ...]]:
        """The names of its cables."""
        return {"cable": self.cables}

    def row(self, name: str, /) -> str:
        """The parameter that stands for a name: its own, or that of the cable whose anchor it shares."""
        return self.shared.get(name, name)

    @cached_property
    def pulleys(self) -> Pulleys | None:
        """The pulleys, radii (m,) and axes (m, 3) of length 1; radius 0 where a cable has none. None: no cable has one."""
        found = self._table_values(WHEEL)
        bare = np.isnan(found[:, 0])
        if bare.all():
            return None
        found[bare] = 0.0, 0.0, 0.0, 1.0
        return Pulleys(found[:, 0], found[:, 1:] / np.linalg.norm(found[:, 1:], axis=1, keepdims=True))

    @cached_property
    def elasticity(self) -> Array | None:
        """Strain per tension (m,) in 1/N. None: not known."""
        found = self._table_values((STRETCH,))[:, 0]
        return None if np.isnan(found).any() else found

    @property
    def gain(self) -> Array:
        """Length that each drum winds up over the length that its sensor shows, (m,); 1 where nobody states one."""
        found = self._table_values((GAIN,))[:, 0]
        return np.where(np.isnan(found), 1.0, found)

    @property
    def states_gains(self) -> bool:
        """Whether the gains of its drums are parameters of it."""
        return any(self.row(f"{c}.{GAIN}") in self.table for c in self.cables)

    def readings(self, lengths: Array) -> Array:
        """What the sensors show of lengths (k, m) less their zeros."""
        return lengths / self.gain

    def _table_values(self, symbols: Sequence[str]) -> Array:
        """Numbers (m, k) of the table by symbol, not a number where a cable has none."""
        names = [[self.row(f"{c}.{s}") for s in symbols] for c in self.cables]
        return np.array([[self.table[n].value if n in self.table else np.nan for n in own] for own in names])

    def having(
        self,
        *,
        pulleys: Pulleys | EllipsisType | None = ...,
        elasticity: ArrayLike | EllipsisType | None = ...,
        gain: ArrayLike | EllipsisType | None = ...,
        **known: object,
    ) -> Self:
        """The same robot with other pulleys, or with none, with cables that stretch otherwise, other drums, and other fields."""
        wheels = self.pulleys if isinstance(pulleys, EllipsisType) else pulleys
        strain = self.elasticity if isinstance(elasticity, EllipsisType) else elasticity
        given = ((pulleys, WHEEL), (elasticity, (STRETCH,)), (gain, (GAIN,)))
        gone = [s for value, symbols in given if not isinstance(value, EllipsisType) for s in symbols]
        drums = None if isinstance(gain, EllipsisType) else gain
        left = {k: v for k, v in self.shared.items() if k.rpartition(".")[2] not in gone}
        kept = [p for p in self.table.rows if p.name.rpartition(".")[2] not in gone]
        names = {p.name for p in kept}
        more = [p for p in material_rows(self.cables, wheels, strain, drums, left) if p.name not in names]
        return replace(self, table=ParameterTable((*kept, *more), self.table.together), shared=left, **known)  # type: ignore[arg-type]

    @property
    def a(self) -> Array:
        """Frame anchors in base coordinates, (m, 3)."""
        return np.asarray(self.numbers[:, :3])

    @property
    def frame_points(self) -> Array:
        """Its frame anchors: between them the platform moves."""
        return self.a

    def lines(self, joints: Array | None, poses: Array, extra: object = None, /) -> Mapping[str, Array]:
        """Each cable from its platform anchor to its frame anchor."""
        ends = poses[:, None, :3, 3] + self.b @ poses[:, :3, :3].swapaxes(1, 2)
        return {c: np.stack([ends[:, i], 0 * ends[:, i] + self.a[i]], axis=1) for i, c in enumerate(self.cables)}

    @property
    def b(self) -> Array:
        """Platform anchors in platform coordinates, (m, 3)."""
        return np.asarray(self.numbers[:, 3:6])

    @property
    def zeros(self) -> Array:
        """Zeros of the length sensors, (m,)."""
        return np.asarray(self.numbers[:, 6])

    def pulley(self, cable: int) -> Pulleys | None:
        """The pulley of one cable by its number, radius () and axis (3,)."""
        return None if self.pulleys is None else Pulleys(self.pulleys.radius[cable], self.pulleys.axis[cable])

    @property
    def axes(self) -> tuple[int, ...]:
        """Which components of the twist (v, w) the platform has: rows of W, columns of L."""
        for what, found, known in (("degrees", self.degrees, DEGREES), ("plane", self.plane, DEGREES["3R3T"])):
            require(found in known, "no such robot", key=what, found=found, expected=" or ".join(known))
        return DEGREES[self.degrees][self.plane]

    @property
    def planar(self) -> bool:
        """Whether it moves in `plane`, and not in space."""
        return not {0, 1, 2} <= set(self.axes)

    def lengths_of_rows(self, length: float) -> Array:
        """By what the rows of W are divided where moments are compared with forces, (d,): 1, or `length` m."""
        return np.where(np.array(self.axes) < 3, 1.0, length)

    def with_values(self, values: Mapping[str, float]) -> Self:
        """The same robot with other anchors and zeros."""
        return self.with_table(self.table.with_values(values))

    def with_table(self, table: ParameterTable) -> Self:
        """The same robot with another table."""
        return replace(self, table=table)

    @property
    def geometric(self) -> tuple[str, ...]:
        """What its making leaves: anchors, radii and gains of drums. Where a length sensor counts from may be anything."""
        return tuple(n for n in self.table.names if n.rpartition(".")[2] in (*SYMBOLS[:6], "radius", GAIN))

    @property
    def anywhere(self) -> frozenset[str]:
        """What nobody has said: an anchor or a zero that is nought in all its numbers, or that somebody assumed."""
        out = set()
        for cable, numbers in zip(self.cables, self.numbers, strict=True):
            for what, some in (("a", slice(0, 3)), ("b", slice(3, 6)), ("zero", slice(6, 7))):
                if f"{cable}.{what}" in self.assumed or not numbers[some].any():
                    out |= {self.row(f"{cable}.{s}") for s in SYMBOLS[some]}
        return frozenset(out)

    @property
    def motions(self) -> Mapping[str, Mapping[str, float]]:
        """Small motions of the base, of the platform's coordinates, and of both together where the robot lacks a direction: rates of
        its anchors. Which of them lengths cannot tell is for the data to say."""
        out: dict[str, Mapping[str, float]] = {}
        of_base, of_platform = self._rates("a", self.a), self._rates("b", self.b)
        of_both = [{**p, **b} for b, p in zip(of_base, of_platform, strict=True)]
        for whose, rates in (("the base", of_base), ("the platform", of_platform), ("base and platform", of_both)):
            for i, rate in enumerate(rates):
                # A motion of both that the robot can follow is a motion of each.
                if rate and not (rates is of_both and i in self.axes):
                    out[f"{whose} {'along' if i < 3 else 'about'} {'xyz'[i % 3]}"] = rate
        return out

    def _rates(self, symbol: str, points: Array) -> list[dict[str, float]]:
        """What the six small motions of one end's coordinates do to its anchors (m, 3)."""
        names = [self.row(f"{c}.{symbol}{s}") for c in self.cables for s in "xyz"]
        motions = [*np.eye(3)[:, None] + np.zeros_like(points), *(np.cross(e, points) for e in np.eye(3))]
        return [{n: float(v) for n, v in zip(names, m.ravel(), strict=True) if v != 0.0} for m in motions]

    @property
    def freedom(self) -> tuple[int, ...]:
        """The platform has a pose of its own: its axes are what a fit may move of it."""
        return self.axes

    @property
    def home(self) -> Array:
        """X_0, (4, 4): where a pose is looked for when nothing is known."""
        return home(self.a)

    def need(self, what: str) -> Array:
        """A property that may be unknown, as an array. Raises ModelError naming it when it is."""
        value, expected = getattr(self, what), f"{what} in the robot file"
        require(value is not None, f"the {what} of {self.name} is not known", key=what, expected=expected)
        return np.asarray(value, float)


def home(a: ArrayLike) -> Array:
    """X_0 = (mean of the frame anchors a (m, 3), identity), (4, 4): section 3.4.5 of the thesis behind `examples/cable-laval`."""
    return se3.compose(np.eye(3), np.asarray(a, float).mean(axis=0))


def cable_robot(
    name: str,
    frame_anchors: ArrayLike,
    platform_anchors: ArrayLike,
    zeros: ArrayLike | None = None,
    free: Sequence[str] = (),
    *,
    names: Sequence[str] | None = None,
    shared: Mapping[str, str] | None = None,
    pulleys: Pulleys | None = None,
    elasticity: ArrayLike | None = None,
    gain: ArrayLike | None = None,
    **known: object,
) -> CableRobot:
    """A robot from anchors (m, 3) and (m, 3); `free` lists the symbols that are to be identified, `shared` the numbers that are another
    cable's or of all, `known` the other fields of CableRobot.

    Raises ModelError when there are not as many of one as of the other.
    """
    a, b, whose = np.asarray(frame_anchors, float), np.asarray(platform_anchors, float), dict(shared or {})
    require(
        a.shape == b.shape and a.ndim == 2 and a.shape[1] == 3, "every cable needs one frame anchor and one platform anchor",
        found=f"{len(a)} frame anchors, {len(b)} platform anchors", expected="as many of one as of the other, three coordinates each",
    )  # fmt: skip
    l0 = np.zeros(len(a)) if zeros is None else np.asarray(zeros, float)
    cables = tuple(f"c{i}" for i in range(1, len(a) + 1)) if names is None else tuple(names)
    rows = [
        Parameter(f"{cable}.{s}", float(v), "m", s in free, expected=EXPECTED)
        for cable, numbers in zip(cables, np.column_stack([a, b, l0]), strict=True)
        for s, v in zip(SYMBOLS, numbers, strict=True)
        if f"{cable}.{s}" not in whose
    ]
    material = material_rows(cables, pulleys, elasticity, gain, whose)
    rows += [replace(p, free=p.name.rpartition(".")[2] in free) for p in material]
    return CableRobot(name, cables, ParameterTable(tuple(rows)), shared=whose, **known)  # type: ignore[arg-type]


def lengths(pose: Array, cable: Array, pulley: Pulleys | None = None) -> tuple[Array, Array, Array]:
    """Length (B, m) of one cable, its gradient with respect to the platform's (v, w), (B, m, 6), and to the cable's
    seven numbers, (B, m, 7).

    pose (B, m, 4, 4), cable (B, 7) or of every row (B, m, 7) in the order of SYMBOLS, its pulley, radius () and axis (3,), or
    (m,) and (m, 3).
    """
    each = cable if cable.ndim == 3 else cable[:, None]
    a, b, l0 = each[..., :3], each[..., 3:6], each[..., 6]
    r = pose[..., :3, :3]
    lever = np.einsum("bmij,bmj->bmi", r, np.broadcast_to(b, (*pose.shape[:2], 3)))
    full, u = run(pose[..., :3, 3] + lever - a, pulley)
    by_pose = np.concatenate([u, np.cross(lever, u)], axis=-1)
    by_cable = np.concatenate([-u, np.einsum("bmij,bmi->bmj", r, u), -np.ones((*full.shape, 1))], axis=-1)
    return full - l0, by_pose, by_cable


def straight(robot: CableRobot, pose: ArrayLike) -> tuple[Array, Array, Array]:
    """Geometric lengths (k, m) from frame anchor to platform anchor, over pulleys where there are any, their gradient
    L (k, m, 6) and the levers R b_i (k, m, 3).

    L = [u_i, R b_i x u_i] with u_i the direction in which cable i arrives at the platform (3.5 and 3.7 with Q b_i);
    W = -L^T. pose (k, 4, 4). A cable without length has no direction: its row of L is zero.
    """
    t = np.asarray(pose, float).reshape(-1, 4, 4)
    lever = robot.b @ t[:, :3, :3].swapaxes(-1, -2)
    full, u = run(t[:, None, :3, 3] + lever - robot.a, robot.pulleys)
    return full, np.concatenate([u, np.cross(lever, u)], axis=-1), lever


def cable_table(robot: CableRobot) -> Array:
    """The cables as kernels read them, (m, 11): a, b, l0, the radius of the pulley and its axis."""
    wheel = robot.pulleys or Pulleys(np.zeros(len(robot.b)), np.tile([0.0, 0.0, 1.0], (len(robot.b), 1)))
    return np.column_stack([robot.a, robot.b, robot.zeros, wheel.radius, wheel.axis])
