"""A cable robot: a platform hung from frame anchors, and the lengths of its straight cables.

    l_i = |p + R b_i - a_i| - l0_i,    l_i = g_i y_i + q_i y_i^2

Cable i runs from frame anchor a_i (base coordinates) to platform anchor b_i (platform coordinates); l0_i is the zero
of its length sensor, which shows y_i: what its drum winds up of that, g_i and q_i say (`cables/drum.py`; 1 and 0 where nobody does).
With a pulley the cable enters at a_i, wraps and leaves towards the platform (`cables/pulley.py`). A cable may be a sum of such
segments (`cables/reeving.py`), and its anchor may be on a rail (`cables/rail.py`).
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
from robocal.cables.cable_parameters import COMMON, EXPECTED, PLATFORM, SYMBOLS, anchor_parameters
from robocal.cables.degrees import DEGREES
from robocal.cables.drum import DrumLaw
from robocal.cables.material import BUILD_UP, GAIN, STRETCH, WHEEL, material_rows
from robocal.cables.pulley import Pulleys, run
from robocal.cables.rail import RAIL, offset
from robocal.cables.reeving import Reeving
from robocal.cables.segment_ends import motions, points_of, segment_lines
from robocal.errors import require
from robocal.geometry import se3
from robocal.geometry.path.unjointed import Unjointed
from robocal.parameters import ParameterTable

__all__ = [
    "BUILD_UP", "COMMON", "DEGREES", "EXPECTED", "GAIN", "PLATFORM", "RAIL", "STRETCH", "SYMBOLS", "WHEEL", "CableRobot", "cable_robot",
    "home", "lengths", "straight",
]  # fmt: skip


@record(eq=False)
class CableRobot(DrumLaw, Unjointed):
    """Anchors and sensor zeros of m cables, as a parameter table `c1.ax` ... `c1.bz`, `c1.l0` in m, and what else is
    known of them.

    The table also has what is known of pulleys, `c1.radius` in m and the swivel axis `c1.nx` ... `c1.nz` of any length,
    of stretch, `c1.elasticity` in 1/N: strain per tension, and of drums, `c1.gain` and `c1.build_up` in 1/m. mass in kg, com (3,) in m and
    inertia (3, 3) in kg m2 about com, all in platform axes; limits (m, 2): least and greatest tension in N; density (m,): weight per
    unstretched length in N/m; diameter (m,) in m. None: not known. `degrees` is a key of DEGREES; a planar robot moves in `plane` of the
    base (xz and yz stand upright). `sources` says where values come from, `assumed` names those that were chosen:
    c1.a, c1.b, c1.zero, c1.tension, c1.pulley, ..., mass, com, inertia; the source of them all is under "". Cables that share an
    anchor share its parameters: `shared` says whose they are ("c2.ax": "c1.ax"), and the table has them once. `reeving` says along which
    segments cables run, whose ends are then what the table has (None: each along its own). A rail (`c1.carriage`, `c1.rail`, `c1.rx` ...)
    carries a frame anchor from where the table has it.
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
    reeving: Reeving | None = None
    degrees: str = "3R3T"
    plane: str = "xz"
    shared: Mapping[str, str] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()

    @cached_property
    def segments(self) -> Reeving:
        """What its cables run along."""
        return Reeving.plain(self.cables) if self.reeving is None else self.reeving

    @cached_property
    def ends(self) -> Array:
        """Both ends of every segment and the zero of its cable, (p, 7) in the order of SYMBOLS, 0 for what a cable runs along besides;
        on a rail the anchor is where the carriage stands."""
        names, m = self.segments.names, len(self.cables)
        out = np.zeros((len(names), len(SYMBOLS)))
        out[:, :6] = self.values_of(SYMBOLS[:6], names)
        out[:m, 6:] = self.values_of(SYMBOLS[6:], self.cables)
        if self.rails is not None:
            out[:, :3] += offset(self.rails)
        return out

    @property
    def numbers(self) -> Array:
        """The seven numbers of every cable in the order of SYMBOLS, (m, 7). Raises ModelError where a cable runs along several segments."""
        self.need_straight()
        return self.ends

    def need_straight(self, *, fixed: bool = False) -> None:
        """Raises ModelError naming a cable that is not straight from a frame anchor, that is `fixed`, to a platform anchor."""
        railed = None if self.rails is None or not fixed else np.asarray(self.rails[:, 2:].any(axis=1))
        self.segments.need_straight(self.cables, railed)

    @property
    def parts(self) -> Mapping[str, tuple[str, ...]]:
        """The names of its cables."""
        return {"cable": self.cables}

    def row(self, name: str, /) -> str:
        """The parameter that stands for a name: its own, or that of the cable whose anchor it shares."""
        return self.shared.get(name, name)

    @property
    def pulleys(self) -> Pulleys | None:
        """The pulleys, radii (m,) and axes (m, 3) of length 1; radius 0 where a cable has none. None: no cable has one. Raises as
        `numbers` does."""
        self.need_straight()
        return self.wheels

    @cached_property
    def wheels(self) -> Pulleys | None:
        """As `pulleys`, of every segment (p,)."""
        found = self.values_of(WHEEL, self.segments.names)
        bare = np.isnan(found[:, 0])
        if bare.all():
            return None
        found[bare] = 0.0, 0.0, 0.0, 1.0
        return Pulleys(found[:, 0], found[:, 1:] / np.linalg.norm(found[:, 1:], axis=1, keepdims=True))

    @cached_property
    def rails(self) -> Array | None:
        """The rails on which frame anchors stand, (p, 5) in the order of RAIL, zero where there is none. None: no anchor is on one."""
        found = self.values_of(RAIL, self.segments.names)
        return None if np.isnan(found[:, 0]).all() else np.nan_to_num(found)

    @cached_property
    def elasticity(self) -> Array | None:
        """Strain per tension (m,) in 1/N. None: not known."""
        found = self.values_of((STRETCH,), self.cables)[:, 0]
        return None if np.isnan(found).any() else found

    def values_of(self, symbols: Sequence[str], whose: Sequence[str]) -> Array:
        """Numbers (p, k) of the table by symbol, not a number where a cable or segment has none."""
        names = [[self.row(f"{c}.{s}") for s in symbols] for c in whose]
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
        given = ((pulleys, WHEEL), (elasticity, (STRETCH,)), (gain, (GAIN,)))
        gone = [s for value, symbols in given if not isinstance(value, EllipsisType) for s in symbols]
        left = {k: v for k, v in self.shared.items() if k.rpartition(".")[2] not in gone}
        kept = [p for p in self.table.rows if p.name.rpartition(".")[2] not in gone]
        wheels, strain, drums = (None if isinstance(v, EllipsisType) else v for v in (pulleys, elasticity, gain))
        more = material_rows(self.segments.names, self.cables, left, pulleys=wheels, elasticity=strain, gain=drums)  # type: ignore[arg-type]
        return replace(self, table=ParameterTable((*kept, *more), self.table.together), shared=left, **known)  # type: ignore[arg-type]

    @property
    def a(self) -> Array:
        """Frame anchors in base coordinates, (m, 3)."""
        return np.asarray(self.numbers[:, :3])

    @property
    def frame_points(self) -> Array:
        """Where segments end on the frame, its anchors: between them the platform moves."""
        return points_of(self.segments, self.ends, platform=False)

    @property
    def platform_points(self) -> Array:
        """Where segments end on the platform, in its coordinates."""
        return points_of(self.segments, self.ends, platform=True)

    def lines(self, joints: Array | None, poses: Array, extra: object = None, /) -> Mapping[str, Array]:
        """Each segment from its end on the platform to that on the frame."""
        return segment_lines(self.segments, self.ends, poses)

    @property
    def b(self) -> Array:
        """Platform anchors in platform coordinates, (m, 3)."""
        return np.asarray(self.numbers[:, 3:6])

    @property
    def zeros(self) -> Array:
        """Zeros of the length sensors, (m,)."""
        return np.asarray(self.ends[: len(self.cables), 6])

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
        """What its making leaves: anchors, radii and drums. Where a length sensor counts from may be anything."""
        return tuple(n for n in self.table.names if n.rpartition(".")[2] in (*SYMBOLS[:6], "radius", GAIN, BUILD_UP))

    @property
    def anywhere(self) -> frozenset[str]:
        """What nobody has said: an anchor or a zero that is nought in all its numbers, or that somebody assumed."""
        out = set()
        m = len(self.cables)
        for i, (cable, numbers) in enumerate(zip(self.segments.names, self.ends, strict=True)):
            for what, some in (("a", slice(0, 3)), ("b", slice(3, 6)), ("zero", slice(6, 7)))[: 3 if i < m else 2]:
                if f"{cable}.{what}" in self.assumed or not numbers[some].any():
                    out |= {self.row(f"{cable}.{s}") for s in SYMBOLS[some]}
        return frozenset(out)

    @property
    def motions(self) -> Mapping[str, Mapping[str, float]]:
        """Small motions of the base, of the platform's coordinates, and of both together where the robot lacks a direction: rates of
        its anchors. Which of them lengths cannot tell is for the data to say."""
        return motions(self.segments, self.ends, self.rails, self.axes, self.row)

    @property
    def freedom(self) -> tuple[int, ...]:
        """The platform has a pose of its own: its axes are what a fit may move of it."""
        return self.axes

    @property
    def home(self) -> Array:
        """X_0, (4, 4): where a pose is looked for when nothing is known."""
        return home(self.frame_points)

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
    rails: ArrayLike | None = None,
    elasticity: ArrayLike | None = None,
    gain: ArrayLike | None = None,
    build_up: ArrayLike | None = None,
    reeving: Reeving | None = None,
    **known: object,
) -> CableRobot:
    """A robot from anchors (m, 3) and (m, 3); `free` lists the symbols that are to be identified, `shared` the numbers that are another
    cable's or of all, `known` the other fields of CableRobot. Of a `reeving` with p segments anchors, pulleys and rails (p, 5) are those of
    segments.

    Raises ModelError when there are not as many of one as of the other.
    """
    a, b, whose = np.asarray(frame_anchors, float), np.asarray(platform_anchors, float), dict(shared or {})
    require(
        a.shape == b.shape and a.ndim == 2 and a.shape[1] == 3, "every cable needs one frame anchor and one platform anchor",
        found=f"{len(a)} frame anchors, {len(b)} platform anchors", expected="as many of one as of the other, three coordinates each",
    )  # fmt: skip
    many = len(a) if reeving is None else int(reeving.cable.max()) + 1
    l0 = np.zeros(many) if zeros is None else np.asarray(zeros, float)
    cables = tuple(f"c{i}" for i in range(1, many + 1)) if names is None else tuple(names)
    segments = cables if reeving is None else reeving.names
    slides = None if rails is None else np.asarray(rails, float)
    rows = anchor_parameters(segments, np.hstack([a, b]), l0, free, whose)
    material = material_rows(
        segments, cables, whose, pulleys=pulleys, rails=slides, elasticity=elasticity, gain=gain, build_up=build_up
    )
    rows += [replace(p, free=p.name.rpartition(".")[2] in free) for p in material]
    return CableRobot(name, cables, ParameterTable(tuple(rows)), shared=whose, reeving=reeving, **known)  # type: ignore[arg-type]


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


def straight(robot: CableRobot, pose: ArrayLike, carriage: Array | None = None) -> tuple[Array, Array, Array]:
    """Geometric lengths (k, m) of cables, straight or over pulleys where there are any, their gradient L (k, m, 6), and the levers R b
    (k, p, 3) of the segments that they run along, which are the cables where each is straight.

    L = [u_i, R b_i x u_i] with u_i the direction in which cable i arrives at the platform (3.5 and 3.7 with Q b_i), summed over
    segments; W = -L^T. pose (k, 4, 4); carriage (k,) in m is what was read of all carriages, where it is a number. A cable without
    length has no direction: its row of L is zero.
    """
    t, ends, segments = np.asarray(pose, float).reshape(-1, 4, 4), robot.ends, robot.segments
    lever = ends[:, 3:6] @ t[:, :3, :3].swapaxes(-1, -2)
    d = t[:, None, :3, 3] + lever - ends[:, :3]
    if carriage is not None and robot.rails is not None:
        read = np.where(np.isnan(carriage)[:, None], robot.rails[:, 0], carriage[:, None])
        d -= offset(np.broadcast_to(robot.rails, (len(t), *robot.rails.shape)), read) - offset(robot.rails)
    still = segments.still
    d[:, still] = (ends[:, 3:6] - ends[:, :3])[still]
    full, u = run(d, robot.wheels)
    u[:, still] = 0.0
    gradient = np.concatenate([u, np.cross(lever, u)], axis=-1)
    return (full, gradient, lever) if robot.reeving is None else (segments.sums(full), segments.sums(gradient), lever)
