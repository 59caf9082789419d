"""No identified number is lost: what `inverse` of the calibrated file shows is what the fitted model shows, to 1e-12.

Every group of parameters is freed in some run, and where a file has no place for a number, one is made.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from cables.cable_robots import box

from robocal._record import replace
from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot
from robocal.cables.pulley import Pulleys
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import distribute
from robocal.files.cable.cable_robot import parse_cable
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.write import describe_cable, render_material
from robocal.files.text import Source
from robocal.geometry import se3
from robocal.measure.base import problem, synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.prove.decision import Options
from robocal.prove.identify import identify
from robocal.session.cable.cable_opened import OpenedCable
from robocal.session.cable.payload import payload_rows

SAME = 1e-12
M, N = 8, 24
EACH = "c{}"
CABLES = tuple(f"c{i}" for i in range(1, M + 1))
LIMITS = np.tile([20.0, 600.0], (M, 1))
COM = np.array([0.02, -0.03, 0.01])


@dataclass
class Case:
    """A robot's text, what is free of it, what a file of lengths has of its own, and what is off in the built machine."""

    text: str
    free: tuple[str, ...]
    options: dict
    off: dict
    load: bool = False


def nominal(**known) -> CableRobot:
    robot = box()
    return replace(robot, mass=8.0, limits=LIMITS).having(**known)


def wheels(axis=(0.05, -0.05, 1.0)):
    return Pulleys(np.full(M, 0.05), np.tile(axis, (M, 1)))


def common(text: str, keys: str) -> str:
    """The same with a line for every cable."""
    return text + f"every_cable: {{{keys}}}\n"


def bare() -> str:
    """A robot.yaml without a list of its cables."""
    lines = describe_cable(replace(box(), mass=8.0)).splitlines()
    start = lines.index("cables:")
    end = next(i for i in range(start + 1, len(lines)) if not lines[i].startswith(" "))
    return "\n".join(lines[:start] + lines[end:]) + "\n"


def _tense(text):
    return text.replace("cables:\n", "every_cable: {tension: [20, 600], KEYS}\ncables:\n", 1)


PLAIN = describe_cable(replace(box(), mass=8.0))
ALL = ("ax", "ay", "az", "l0")
CASES = {
    "anchors and zeros": Case(PLAIN, ALL, {}, {"ax": 0.01, "ay": 0.01, "az": 0.01, "l0": 0.02}),
    "platform points": Case(PLAIN, ("bx", "by", "bz"), {}, {"bx": 0.003, "by": 0.003, "bz": 0.003}),
    "gain of each drum": Case(describe_cable(nominal(gain=np.ones(M))), (*ALL, "gain"), {}, {"gain": 0.01, "l0": 0.02}),
    "gain of all drums": Case(_tense(PLAIN).replace("KEYS", "gain: 1"), (*ALL, "gain"), {}, {"gain": 0.01, "l0": 0.02}),
    "drums of a file": Case(PLAIN, ("ax", "ay"), {"gain": "drums", "zeros": "first"}, {"drums": 0.01}),
    "each drum of a file": Case(PLAIN, ("ax",), {"gain": "drums", "each": True, "zeros": "first"}, {"each": 0.01, "ax": 0.01}),
    "no list of cables": Case(bare(), ("ax",), {"gain": "drums", "each": True, "zeros": "first"}, {"each": 0.01, "ax": 0.01}),
    "zeros without a list": Case(bare(), ALL, {}, {"l0": 0.02}),
    "pulleys of each": Case(describe_cable(nominal(pulleys=wheels())), ("radius", "nx"), {}, {"radius": 0.003, "nx": 0.05}),
    "pulleys of all": Case(
        _tense(PLAIN).replace("KEYS", "pulley: {radius: {value: 50, unit: mm}, axis: [0, 0, 1]}"), (*ALL, "radius", "nx", "ny"), {},
        {"radius": 0.003},
    ),
    "elasticity of each": Case(
        describe_cable(nominal(elasticity=np.full(M, 2e-5))), ("elasticity", "l0"), {"tension": True}, {"elasticity": 1e-5}
    ),
    "elasticity of all": Case(_tense(PLAIN).replace("KEYS", "elasticity: 2.0e-5"), ("elasticity", "l0"), {"tension": True}, {"elasticity": 1e-5}),
    "mass and centre": Case(PLAIN, ("l0",), {}, {"l0": 0.01}, load=True),
}  # fmt: skip


def poses(rng, count):
    low, high = box().a.min(axis=0), box().a.max(axis=0)
    place = (low + high) / 2 + 0.25 * rng.uniform(-1, 1, (count, 3)) * (high - low)
    return np.concatenate([place, rng.normal(0, 0.15, (count, 3))], axis=1)


def held(rng):
    """Those of many poses at which cables hold the platform."""
    every = poses(rng, 400)
    t = se3.from_vector(every)
    found = distribute(structure_of(box(), t), gravity_wrench(t, 8.4, COM), LIMITS)
    return every[found.feasible][:N]


def opened(case: Case) -> CableFile:
    text = case.text + f"calibrate: {{free: [{', '.join(case.free)}]}}\n"
    return parse_cable(Source(Path("robot.yaml"), text, ""))


def observed(case: Case, robot: CableRobot, where, rng) -> DataSet:
    """Lengths of a machine that is off, poses of a tracker, and cells, read with a little noise."""
    k = len(where)
    named = {n: v for n, v in case.options.items() if n != "tension"}
    extra = {"cable": np.tile(np.arange(M, dtype=float), k)}
    held = np.full((k * M, 1), 2e-4)
    if case.options.get("tension"):
        extra["tension"] = rng.uniform(30, 500, k * M)
    options = {"cables": CABLES, **named}
    lengths = Observations(
        "lengths", np.repeat(np.arange(k), M), np.zeros((k * M, 1)), held, extra=extra, options=options
    )
    still = Frame("tracker", (0.0,) * 6, (False,) * 6)
    seen = Observations("pose", np.arange(k), np.zeros((k, 6)), np.full((k, 6), 1e-4), still)
    data = DataSet(Configurations(tuple(f"p{i}" for i in range(k)), start=where), (lengths, seen))
    truth = robot.with_values(
        {
            n: robot.table[n].value + d * rng.uniform(-1, 1)
            for s, d in case.off.items()
            for n in robot.table.names
            if n.endswith(f".{s}")
        }
    )
    made = synthesise(truth, data, rng)
    drums = 1 + case.off.get("drums", 0.0) + case.off.get("each", 0.0) * rng.uniform(-1, 1, M)
    own = rng.uniform(-0.5, 0.5, M) if named.get("zeros") else np.zeros(M)
    raw = made.observations[0]
    value = (raw.value.reshape(-1, M) - own) / drums if named else raw.value.reshape(-1, M)
    made = replace(made, observations=(replace(raw, value=value.reshape(-1, 1)), *made.observations[1:]))
    if not case.load:
        return made
    heavy, t = replace(truth, mass=8.4, com=COM), se3.from_vector(where)
    load = gravity_wrench(t, 8.4, COM)
    pull = distribute(structure_of(heavy, t), load, LIMITS).tension + rng.normal(0, 0.05, (k, M))
    cells = Observations(
        "load", np.repeat(np.arange(k), M), pull.reshape(-1, 1), np.full((k * M, 1), 0.05),
        extra={"cable": np.tile(np.arange(M, dtype=float), k)}, options={"cables": CABLES, "free": ("mass", "cx", "cy", "cz")},
    )  # fmt: skip
    return replace(made, observations=(*made.observations, payload_rows(SimpleNamespace(robot=robot), cells)))


@pytest.mark.parametrize("name", CASES)
def test_the_calibrated_file_is_the_fitted_model(name):
    case, rng = CASES[name], np.random.default_rng(3)
    file = opened(case)
    data = observed(case, file.robot, held(rng) if case.load else poses(rng, N), rng)
    found = identify(file.robot, data, Options())
    seen = {p.name: p.identified for p in found.parameters if p.status in ("identified", "prior")}
    assert any(abs(v) > 0 for v in seen.values())
    made = OpenedCable(file).render(found)
    assert not made.left_out
    after = parse_cable(Source(Path("calibrated.yaml"), made.text, "")).robot
    # What sensors would show elsewhere, by the fitted model itself.
    where = poses(rng, 10)
    lengths = replace(
        data.observations[0], configuration=np.repeat(np.arange(10), M), value=np.zeros((10 * M, 1)), sigma=np.ones((10 * M, 1)),
        extra={k: v[: 10 * M] for k, v in data.observations[0].extra.items()}, used=None, digits=None, rows=None,
    )  # fmt: skip
    asked = DataSet(Configurations(tuple(f"q{i}" for i in range(10)), start=where), (lengths,))
    known = problem(found.corrected, asked).table
    ask = problem(found.corrected, asked, values={p.name: p.identified for p in found.parameters if p.name in known})
    shown = ask.residuals(ask.start)[0].value.reshape(M, 10).T  # rows go cable by cable
    pull = lengths.extra["tension"].reshape(10, M) if "tension" in lengths.extra else None
    assert np.abs(inverse(file.robot, se3.from_vector(where), pull)[0] - shown).max() > 1e-5
    assert np.abs(inverse(after, se3.from_vector(where), pull)[0] - shown).max() < SAME
    if case.load:
        body = [after.mass, *after.com]
        assert np.abs(np.array(body) - [seen[f"platform.{s}"] for s in ("mass", "cx", "cy", "cz")]).max() < SAME
        assert abs(after.mass - 8.4) < 0.1


BASES = {
    "of all": _tense(PLAIN).replace("KEYS", "density: {value: 0.1, unit: N/m}, elasticity: 1.0e-5"),
    "of all, in a block": PLAIN + "every_cable:\n  tension: [20, 600]\n",
    "of each": describe_cable(nominal(density=np.linspace(0.1, 0.2, M), elasticity=np.linspace(1e-5, 2e-5, M))),
    "of nobody": PLAIN,
    "in millimetres": PLAIN.replace("units: {length: m,", "units: {length: mm,"),
}


@pytest.mark.parametrize("name", [*BASES, "of another format"])
def test_weight_and_elasticity_of_loads_stand_in_the_robots_file(name):
    """What `cable straightness --loads` found, wherever a file has it."""
    found = {"density": 0.1227123456789, "elasticity": 2.5123456789e-5}
    if name in BASES:
        file = parse_cable(Source(Path("robot.yaml"), BASES[name], ""))
    else:
        file = replace(parse_cable(Source(Path("robot.yaml"), PLAIN, "")), places=None)
    after = parse_cable(Source(Path("after.yaml"), render_material(file, found), "")).robot
    assert np.abs(after.density / found["density"] - 1).max() < SAME
    assert np.abs(after.elasticity / found["elasticity"] - 1).max() < SAME
    assert after.cables == file.robot.cables and np.array_equal(after.a, file.robot.a)
