"""What stands around a simulated arm for each kind of measurement, and what it would read.

A rig takes the true arm and joint values and returns a data set without values: configurations, observations with true
frames, places and sigmas. For contacts the arm is brought to touch: joint values are moved until the kind's own
residual is what the contact leaves.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Ints
from robocal.arms.chain import Chain
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.measure.base import synthesise
from robocal.measure.data import Configurations, DataSet, Frame, Observations

__all__ = ["CONTACTS", "FINE", "RIGS", "STANDS", "Instrument", "hidden", "measure"]

ROUNDS, STEPS = 30, 40


def span(truth: Chain, near: Array) -> tuple[Array, Array]:
    """Lower and upper joint values (n,): the limits, or the range of `near` (m, n) where there are none."""
    low, high = truth.limits.T
    return np.where(np.isfinite(low), low, near.min(axis=0)), np.where(np.isfinite(high), high, near.max(axis=0))


def touch(truth: Chain, blank: Observations, near: Array, rng: np.random.Generator) -> Array:
    """Joint values at which the contact leaves noise of its sigma, (k, n): Gauss-Newton from random starts within the
    joint limits, or the range of `near` where there are none. Raises ModelError when the arm hardly reaches."""
    assert blank.sigma is not None
    k, n = len(blank), near.shape[1]
    low, high = span(truth, near)
    wanted = blank.sigma * rng.standard_normal(blank.value.shape)
    out, left = np.empty((k, n)), np.arange(k)
    for _ in range(ROUNDS):
        q = rng.uniform(low, high, (len(left), n))
        for _ in range(STEPS):
            r, jac = _slope(truth, blank.take(left), q)
            gap = wanted[left] - r
            step = np.einsum("mji,mj->mi", jac, np.linalg.solve(
                jac @ np.swapaxes(jac, 1, 2) + 1e-6 * np.eye(r.shape[1]), gap[..., None])[..., 0])  # fmt: skip
            size = np.abs(step).max(axis=1, keepdims=True)
            q = np.clip(q + step * np.minimum(1.0, 0.3 / np.maximum(size, 1e-12)), low, high)
        done = np.abs(_values(truth, blank.take(left), q) - wanted[left]).max(axis=1) < 1e-9
        out[left[done]] = q[done]
        left = left[~done]
        if not len(left):
            return out
    message, found = "the simulated arm hardly reaches what it should touch", f"{len(left)} of {k} contacts failed"
    raise ModelError(message, found=found, expected="wider joint limits")


def _values(truth: Chain, blank: Observations, q: Array) -> Array:
    """What the kind would read at joint values (k, n), (k, d)."""
    bare = replace(blank, configuration=np.arange(len(q)), sigma=None)
    made = synthesise(truth, DataSet(Configurations(tuple(map(str, range(len(q)))), q), (bare,)))
    return made.observations[0].value


def _slope(truth: Chain, blank: Observations, q: Array) -> tuple[Array, Array]:
    """The reading (k, d) and its derivative by the joints (k, d, n), by differences of 1 um or urad."""
    k, n = q.shape
    h = 1e-6
    many = np.concatenate([q[None], q[None] + h * np.eye(n)[:, None]]).reshape(-1, n)
    value = _values(truth, blank.take(np.tile(np.arange(k), n + 1)), many).reshape(n + 1, k, -1)
    return value[0], np.moveaxis((value[1:] - value[0]) / h, 0, -1)


# Where a tracker typically stands: two metres away, turned and tilted (m, rad).
STANDS = (1.6, -1.1, 0.4, 0.02, -0.03, 2.1)
POINT = (True, True, True, False, False, False)
ACROSS = (False, False, True, True, True, False)
SAMPLE = 300  # places that are looked at to find some that are reached easily
CAMERA = (1400.0, 1400.0, 640.0, 480.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@record
class Instrument:
    """What measures: its kind, its noise per axis (m, rad), and its frame (m, rotation vector), None for base
    coordinates."""

    kind: str = "position"
    noise: float = 5e-5
    angle_noise: float = 1e-4
    frame: tuple[float, ...] | None = STANDS
    name: str = ""


@record
class Scene:
    """The true arm, the joint values (m, n), the instrument, and random numbers for where things stand."""

    truth: Chain
    q: Array
    instrument: Instrument
    rng: np.random.Generator

    @property
    def places(self) -> Array:
        """Where the tool comes, (m, 3)."""
        return np.asarray(self.truth.pose(self.q)[:, :3, 3])

    def blank(self, *unit: str, rows: Ints | None = None) -> Observations:
        """What the instrument reads in columns of m, rad or px at these rows, by default once at each configuration; nothing is read
        yet."""
        size = {"m": self.instrument.noise, "rad": self.instrument.angle_noise, "px": 0.2}
        at = np.arange(len(self.q)) if rows is None else rows
        value, sigma = np.zeros((len(at), len(unit))), np.tile([size[u] for u in unit], (len(at), 1))
        return Observations(self.instrument.kind, at, value, sigma)

    def frame(self, name: str, free: tuple[bool, ...] = (True,) * 6, *, away: float = 0.0) -> Frame | None:
        """The instrument's frame, at least `away` times the arm's reach from it."""
        given = self.instrument.frame
        if given is None:
            return None
        if given == STANDS and away:
            reach = float(np.linalg.norm(self.places, axis=1).max())
            scale = max(1.0, away * reach / float(np.linalg.norm(given[:3])))
            given = (*(float(v) * scale for v in given[:3]), *given[3:])
        return Frame(self.instrument.name or name, given, free, expected=(10.0, 3.0))


Rig = Callable[[Scene], tuple[Configurations, tuple[Observations, ...]]]


def _where(q: Array, prefix: str = "p") -> Configurations:
    digits = len(str(len(q)))
    return Configurations(tuple(f"{prefix}{i + 1:0{digits}d}" for i in range(len(q))), q)


def _rig_with_frame(*unit: str, name: str, away: float = 0.0) -> Rig:
    """One row per configuration by an instrument with a frame."""

    def rig(s: Scene) -> tuple[Configurations, tuple[Observations, ...]]:
        return _where(s.q), (replace(s.blank(*unit), frame=s.frame(name, away=away)),)

    return rig


def _pairs(*unit: str, framed: bool) -> Rig:
    """Every row compares a configuration with one of its own."""

    def rig(s: Scene) -> tuple[Configurations, tuple[Observations, ...]]:
        m = len(s.q)
        low, high = span(s.truth, s.q)
        both = np.vstack([s.q, s.rng.uniform(low, high, s.q.shape)])
        one, two = _where(s.q), _where(s.q, "to")
        frame = s.frame("camera", (False, False, False, True, True, True)) if framed else None
        if frame is not None:
            frame = replace(frame, value=(0.0, 0.0, 0.0, *frame.value[3:]))
        group = "" if framed else "odometry"
        obs = replace(s.blank(*unit), frame=frame, second=np.arange(m, 2 * m), group=group)
        return Configurations(one.ids + two.ids, both), (obs,)

    return rig


def _spot(name: str, at: Array) -> Frame:
    """A point (3,) on the base."""
    return Frame(name, (*map(float, at), 0.0, 0.0, 0.0), POINT)


def _ranges(s: Scene) -> tuple[Configurations, tuple[Observations, ...]]:
    """Four receivers around the arm, not in one plane, in air of a speed that is not quite nominal."""
    centre, size = s.places.mean(axis=0), 1.3 * float(np.linalg.norm(s.places - s.places.mean(axis=0), axis=1).max())
    corners = np.array([(1, 1, -0.6), (-1, 1, 0.9), (-1, -1, -0.4), (1, -1, 1.1)]) * size / 1.5
    out = []
    for i, corner in enumerate(corners + centre):
        place, values = _spot(f"r{i + 1}", corner), {"speed": 343.0, "delay": 0.0}
        options = {"place": place, "medium": "air", "speed": 343.0, "values": values, "free": ()}
        out.append(replace(s.blank("m"), options=options, group=place.name))
    return _where(s.q), tuple(out)


def _bar(s: Scene) -> tuple[Configurations, tuple[Observations, ...]]:
    """A draw-wire or telescopic bar from a socket in front of the arm to its tool."""
    middle = s.places.mean(axis=0)
    out = s.places - middle
    socket = _spot("socket", middle + 1.1 * out[np.argmax(np.linalg.norm(out, axis=1))])
    ball = Frame("ball", (0.0,) * 6, (False,) * 6, "tool")
    return _where(s.q), (replace(s.blank("m"), options={"ends": (socket, ball)}, group="bar"),)


def _reachable_places(s: Scene, count: int, apart: float) -> list[Array]:
    """Places that the arm reaches easily, on a grid of millimetres: above its foot, where it comes, neither near nor far
    from the middle, about `apart` (m) from each other."""
    low, high = span(s.truth, s.q)
    p = s.truth.pose(s.rng.uniform(low, high, (SAMPLE, len(low))))[:, :3, 3]
    p = p[p[:, 2] > 0] if (p[:, 2] > 0).sum() > SAMPLE // 4 else p
    far = np.linalg.norm(p - np.median(p, axis=0), axis=1)
    ordered = p[np.argsort(np.abs(far - np.median(far)))][: SAMPLE // 6]
    out = [ordered[0]]
    while len(out) < count:
        off = [np.abs(np.linalg.norm(ordered - o, axis=1) - apart) for o in out]
        out.append(ordered[int(np.argmin(np.max(off, axis=0)))])
    return [np.round(o, 3) for o in out]


def _contacts(frames: Callable[[Scene], list[Frame]], width: int, options: dict[str, object] | None = None) -> Rig:
    """The arm touches one place after the other, each from many configurations."""

    def rig(s: Scene) -> tuple[Configurations, tuple[Observations, ...]]:
        places = frames(s)
        share = np.array_split(np.arange(len(s.q)), len(places))
        parts, q = [], np.empty_like(s.q)
        for place, rows in zip(places, share, strict=True):
            if not len(rows):
                continue
            mine = {**(options or {}), "place": place}
            blank = replace(s.blank(*["m"] * width, rows=rows), options=mine, group=place.name)
            q[rows] = touch(s.truth, replace(blank, configuration=np.arange(len(rows))), s.q, s.rng)
            parts.append(blank)
        return _where(q), tuple(parts)

    return rig


def _spots(*names: str) -> Callable[[Scene], list[Frame]]:
    """Sockets or spheres of these names."""
    return lambda s: [_spot(n, p) for n, p in zip(names, _reachable_places(s, len(names), 0.3), strict=True)]


def _plates(s: Scene) -> list[Frame]:
    """Three plates that are not parallel."""
    turns = ((0.05, -0.04, 0.0), (1.1, 0.1, 0.0), (0.1, -1.2, 0.0))
    places = _reachable_places(s, 3, 0.4)
    return [
        Frame(f"plate{i + 1}", (*map(float, p), *turn), ACROSS)
        for i, (p, turn) in enumerate(zip(places, turns, strict=True))
    ]


def _apart(rig: Rig) -> Rig:
    """Two places whose distance is known from their drawing: without it nothing says how long a metre is."""

    def rig_with_distance(s: Scene) -> tuple[Configurations, tuple[Observations, ...]]:
        where, parts = rig(s)
        ends = tuple(o.options["place"] for o in parts)
        if len(ends) != 2 or where.joints is None:
            return where, parts
        a, b = ends
        assert isinstance(a, Frame) and isinstance(b, Frame)
        far = float(np.linalg.norm(np.subtract(a.value[:3], b.value[:3])))
        label = f"{a.name}-{b.name}"
        one = replace(s.blank("m", rows=np.array([len(where)])), kind="distance", options={"ends": ends}, group=label)
        distance = replace(one, value=np.array([[far]]))
        nothing = np.full(where.joints.shape[1], np.nan)
        return Configurations((*where.ids, label), np.vstack([where.joints, nothing])), (*parts, distance)

    return rig_with_distance


def _camera(s: Scene) -> tuple[Configurations, tuple[Observations, ...]]:
    """A fixed camera in front of the arm that sees the four corners of a marker on the tool, where they face it."""
    p = s.places
    centre, size = p.mean(axis=0), float(np.linalg.norm(p - p.mean(axis=0), axis=1).max())
    eye = centre + 3.2 * size * np.array([0.85, -0.45, 0.28])
    forward = (centre - eye) / np.linalg.norm(centre - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    looks = se3.compose(np.stack([right, np.cross(forward, right), forward], axis=1), eye)
    frame = Frame("camera", tuple(float(v) for v in se3.to_vector(se3.inverse(looks))), (True,) * 6)
    corner = 0.06 * np.array([(-1.0, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)])
    m, options = len(s.q), {"camera": "lens", "intrinsics": CAMERA, "free": ()}
    obs = s.blank("px", "px", rows=np.repeat(np.arange(m), 4))
    return _where(s.q), (replace(obs, frame=frame, extra={"point": np.tile(corner, (m, 1))}, options=options),)


RUBY: dict[str, object] = {"radius": "ruby", "values": {"radius": 0.015}, "free": ()}
RIGS: dict[str, Rig] = {
    "position": _rig_with_frame("m", "m", "m", name="tracker"),
    "pose": _rig_with_frame("m", "m", "m", "rad", "rad", "rad", name="tracker"),
    "spherical": _rig_with_frame("m", "rad", "rad", name="tracker", away=2.0),
    "bearing": _rig_with_frame("rad", "rad", name="theodolite", away=2.0),
    "range": _ranges,
    "distance": _bar,
    "displacement": _pairs("m", "m", "m", framed=True),
    "relative_pose": _pairs("m", "m", "m", "rad", "rad", "rad", framed=False),
    "point": _apart(_contacts(_spots("a", "b"), 3)),
    "plane": _contacts(_plates, 1),
    "sphere": _apart(_contacts(_spots("sphere1", "sphere2"), 1, RUBY)),
    "pixels": _camera,
}
CONTACTS = ("point", "plane", "sphere")
# Circles are read to a few seconds of arc (rad); what else reports angles does so to 0.1 mrad.
FINE = {"bearing": 2e-5, "spherical": 2e-5}


def measure(
    truth: Chain, q: Array, instrument: Instrument, rng: np.random.Generator | None, *, scene: int = 7
) -> DataSet:
    """What an instrument would read at joint values (m, n), or near them where the tool must touch something; without rng
    there is no noise and no sigma is stated. `scene` seeds where things stand."""
    exact = rng is None or not (instrument.noise > 0 and instrument.angle_noise > 0)
    quiet = replace(instrument, noise=0.0, angle_noise=0.0) if exact else instrument
    where, blank = RIGS[instrument.kind](Scene(truth, q, quiet, np.random.default_rng(scene)))
    data = DataSet(where, tuple(replace(o, sigma=None) for o in blank) if exact else blank)
    return data if instrument.kind in CONTACTS else synthesise(truth, data, None if exact else rng)


# --- as a user hands it in ---------------------------------------------------------------------------------------------

NOWHERE = (0.0,) * 6
# Kinds whose instrument has a frame; without one it stands in base coordinates, which is a frame that is known.
FRAMED = ("position", "pose", "spherical", "bearing", "displacement", "pixels")


def hidden(data: DataSet) -> DataSet:
    """A simulated data set as a user would hand it in: the place of every frame that is to be found is at zero."""
    out = []
    for obs in data.observations:
        options = dict(obs.options)
        if isinstance(place := options.get("place"), Frame):
            options["place"] = _unknown(place)
        if isinstance(ends := options.get("ends"), tuple):
            options["ends"] = tuple(map(_unknown, ends))
        frame = None if obs.frame is None else _unknown(obs.frame)
        if frame is None and obs.kind in FRAMED:
            frame = Frame("world", free=(False,) * 6)
        out.append(replace(obs, frame=frame, options=options))
    return DataSet(data.configurations, tuple(out))


def _unknown(frame: Frame) -> Frame:
    return replace(frame, value=NOWHERE) if frame.mount == "base" and any(frame.free) else frame
