"""Machines of every kind with data that they would record: the spine must not know which of them it serves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from robocal.arms.conventions import chain
from robocal.cables.geometry import cable_robot
from robocal.geometry import se3
from robocal.geometry.path.program import Element, Joint, Term, compile_path, frame_element
from robocal.measure.base import Rig, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.parameters import FRAME_SYMBOLS, Parameter, ParameterTable, frame_parameters
from robocal.vision.camera import SYMBOLS

DEG = np.pi / 180
CAMERA = (900.0, 905.0, 640.0, 512.0, -0.18, 0.09, 0.0, 0.0, 0.0)
LENS = ("fx", "fy", "cx", "cy", "k1", "k2")


def where(start=None, joints=None, count=0):
    count = count or len(joints if start is None else start)
    return Configurations(tuple(map(str, range(count))), joints, start=start)


def arm(rng, m):
    """A small arm before a tracker: nominal, truth, data without values."""
    rows = [
        {"r": 0.3},
        {"alpha": -90 * DEG, "theta": -90 * DEG},
        {"d": 0.25},
        {"d": 0.16, "theta": 90 * DEG},
        {"alpha": 90 * DEG, "r": 0.07},
    ]
    robot = chain("small", "khalil-hayati", rows, tool=(0.02, 0.01, 0.1, 0, 0, 0))
    robot = replace(robot, table=robot.table.with_free([n for n in robot.usual if not n.startswith("tool.")]))
    truth = robot.with_values({n: robot.table[n].value + rng.normal(0, 2e-3) for n in robot.table.free})
    tracker = Frame("tracker", (1, 2, 0.3, 0.1, 0.2, 1.0), (True,) * 6, expected=(10.0, 3.0))
    seen = Observations("position", np.arange(m), np.zeros((m, 3)), np.full((m, 3), 5e-5), tracker)
    return robot, truth, DataSet(where(joints=rng.uniform(-1, 1, (m, 5))), (seen,))


def lengths(robot, m, sigma=1e-3):
    n = len(robot.cables)
    extra = {"cable": np.tile(np.arange(n), m)}
    return Observations(
        "lengths", np.repeat(np.arange(m), n), np.zeros((m * n, 1)), np.full((m * n, 1), sigma), extra=extra
    )


def hung(degrees="3R3T"):
    """A cable robot with free frame anchors and zeros: eight cables in space, seven that hold a point, four in a plane."""
    if degrees == "3R3T":
        a = np.array([(x, y, z) for z in (0.0, 3.0) for x in (-2.0, 2.0) for y in (-2.0, 2.0)])
        b = (
            0.15
            * np.array([(x, y, -z) for z in (-1, 1) for x in (-1.0, 1) for y in (-1.0, 1)])[[3, 2, 1, 0, 5, 4, 7, 6]]
        )
        return cable_robot("eight", a, b, np.full(8, 0.5), free=("l0", "ax", "ay", "az"))
    if degrees == "3T":
        a = np.array([(-2.0, -2, 0), (2, -2, 0), (0, 2, 0), (2, 2, 3), (2, -2, 3), (-2, -2, 3), (-2, 2, 3)])
        return cable_robot("point", a, np.zeros((7, 3)), free=("l0", "ax", "ay", "az"), degrees=degrees)
    a = np.array([(-1.0, 0, 0), (1, 0, 0), (1, 0, 1), (-1, 0, 1)])
    b = np.zeros((4, 3)) if degrees == "2T" else 0.1 * np.array([(-1.0, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)])
    return cable_robot(degrees, a, b, free=("l0", "ax", "az"), degrees=degrees, plane="xz")


def cables(degrees, rng, m, *, encoders_alone=False):
    """A cable robot whose platform an instrument with a place of its own sees as well, unless encoders are alone."""
    robot = hung(degrees)
    truth = robot.with_values({n: robot.table[n].value + rng.normal(0, 0.01) for n in robot.table.free})
    low, high = robot.a.min(axis=0), robot.a.max(axis=0)
    start = np.zeros((m, 6))
    start[:, :3] = (low + high) / 2 + 0.3 * rng.uniform(-1, 1, (m, 3)) * (high - low)
    start[:, 3:] = rng.normal(0, 0.1, (m, 3))
    start[:, [i for i in range(6) if i not in robot.freedom]] = 0.0
    seen = [lengths(robot, m)]
    if not encoders_alone:
        kind, d = ("position", 3) if degrees in ("2T", "3T") else ("pose", 6)
        seen.append(Observations(kind, np.arange(m), np.zeros((m, d)), np.full((m, d), 2e-4)))
    return robot, truth, DataSet(where(start), tuple(seen))


def board(rng, m):
    """A camera that somebody holds before a board: nothing is known but the points; its lens is to be found."""
    grid = np.array([(x, y, 0.0) for x in np.linspace(-0.2, 0.2, 7) for y in np.linspace(-0.15, 0.15, 5)])
    k = len(grid)
    start = np.zeros((m, 6))
    look = rng.uniform(-0.6, 0.6, (m, 3)) * (1, 1, 3)
    for i in range(m):
        t = se3.from_vector([*rng.uniform(-0.12, 0.12, 2), rng.uniform(0.35, 0.8), *look[i]])
        start[i] = se3.to_vector(se3.inverse(t))
    known = {"camera": "lens", "intrinsics": CAMERA, "free": LENS}
    seen = Observations(
        "pixels", np.repeat(np.arange(m), k), np.zeros((m * k, 2)), np.full((m * k, 2), 0.2),
        Frame("eye", mount="tool"), (Frame("board", mount="base"),), np.zeros(m * k, dtype=np.int64),
        {"point": np.tile(grid, (m, 1))}, known,
    )  # fmt: skip
    return lens(CAMERA), DataSet(where(start), (seen,))


def lens(values):
    """The rig whose only parameters are those of its camera."""
    sizes = (10.0,) * 4 + (0.1,) * 2
    rows = [
        Parameter(f"lens.{s}", v, "px" if i < 4 else "1", s in LENS, expected=sizes[i] if i < 6 else 0.01)
        for i, (s, v) in enumerate(zip(SYMBOLS, values, strict=True))
    ]
    return Rig("camera", ParameterTable(tuple(rows)))


@dataclass(frozen=True)
class Turntable:
    """A machine that robocal has never heard of: one axis with a gain, a plate that sits off it."""

    table: ParameterTable
    name: str = "turntable"
    elements: tuple[Element, ...] = (Element("rz", (Term("axis.gain", "turn"),)), frame_element("plate"))
    joints: tuple[Joint, ...] = (Joint("turn"),)
    freedom: None = None
    geometric: tuple[str, ...] = ("axis.gain",)
    lengths: tuple[str, ...] = ()
    anywhere: frozenset[str] = frozenset()
    open_zeros: tuple[object, ...] = ()
    motions: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    frame_points: tuple[object, ...] = ()

    parts: Mapping[str, tuple[str, ...]] = field(default_factory=lambda: {"joint": ("turn",)})

    @property
    def mechanism(self):
        return self

    def part(self, kind):
        return self if isinstance(self, kind) else None

    def row(self, name):
        return name

    def with_values(self, values: Mapping[str, float]):
        return self.with_table(self.table.with_values(values))

    def with_table(self, table: ParameterTable):
        return replace(self, table=table)

    def phi(self, joints, extra=None, program=None):
        program = program or compile_path(self.elements, self.table)
        return np.ascontiguousarray(np.asarray(joints, float)[:, :1] if program.columns else np.empty((len(joints), 0)))

    def lines(self, joints, poses, extra=None):
        return {"spoke": np.stack([np.zeros((len(poses), 3)), poses[:, :3, 3]], axis=1)}

    def remarks(self):
        return ()


def turntable(rng, m):
    """The turntable under a camera that stands still; its gain, and where the plate sits across the axis, are to be found."""
    rows = (Parameter("axis.gain", 1.0, "1", True, expected=0.01), *frame_parameters("plate", expected=(0.01, 0.05)))
    free = ("axis.gain", "plate.x", "plate.y")
    robot = Turntable(ParameterTable(rows).with_free(free))
    truth = robot.with_values({"axis.gain": 1.004, "plate.x": 3e-3, "plate.y": -2e-3})
    looks = se3.inverse(se3.from_vector([0.1, -0.05, 0.9, np.pi - 0.2, 0.1, 0.0]))
    eye = Frame("eye", tuple(se3.to_vector(looks)), (True,) * 6, expected=(10.0, 3.0))
    grid = np.array([(x, y, 0.0) for x in (-0.1, 0, 0.1) for y in (-0.1, 0, 0.1)])
    k = len(grid)
    known = {"camera": "lens", "intrinsics": CAMERA, "free": ()}
    seen = Observations(
        "pixels", np.repeat(np.arange(m), k), np.zeros((m * k, 2)), np.full((m * k, 2), 0.2), eye,
        extra={"point": np.tile(grid, (m, 1))}, options=known,
    )  # fmt: skip
    return robot, truth, DataSet(where(joints=rng.uniform(-3, 3, (m, 1))), (seen,))


def recorded(truth, data, rng, forget=True):
    """What the instruments would read; nobody says beforehand where a configuration's own pose is."""
    made = synthesise(truth, data, rng)
    return replace(made, configurations=replace(made.configurations, start=None)) if forget else made


def told(data, table):
    """The same instruments where an identification has found them."""

    def there(frame):
        names = [f"{frame.name}.{s}" for s in FRAME_SYMBOLS]
        return replace(frame, value=tuple(table[n].value for n in names)) if names[0] in table else frame

    seen = [
        replace(o, frame=o.frame and there(o.frame), targets=tuple(map(there, o.targets))) for o in data.observations
    ]
    return DataSet(data.configurations, tuple(seen))
