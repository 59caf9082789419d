"""Cable lengths: r = l_i(T_base_platform) - y, one row per cable and configuration.

value (k, 1) in m; extra["cable"] (k,) is the cable's number from 0; the cable's anchors and sensor zero are the
machine's parameters, as are those of its pulley and its elasticity e. With extra["tension"] (k,) in N the sensor shows what stretch
leaves, l_i / (1 + e t), or with options["winches"] what a tension from a current does (`measure/cable/winch_tensions.py`);
extra["hanging"] (k,) is what sag makes of that. options["zeros"] names whoever's zeros these are, where they
are not the robot's: those of one power-up; they are the parameters `owner.cable`, and options["cables"] names the cables.
A drum winds up a length g times as long as what its sensor shows: y = l / g, with g the robot's, where it has one, or that of the drums
that options["gain"] names: the parameter `drums.gain`, or, with options["each"], `drums.cable.gain` of every cable.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from robocal._jit import as_kernel_array
from robocal._types import Array, Bools, Ints
from robocal.cables.drum import reading, slope
from robocal.cables.geometry import BUILD_UP, GAIN, SYMBOLS, CableRobot, straight
from robocal.cables.material import DRUM
from robocal.errors import ModelError
from robocal.estimate.losses import Loss
from robocal.estimate.terms import Normal
from robocal.measure.builder import Builder
from robocal.measure.cable.cable_names import cable_names
from robocal.measure.cable.platform_rows import ENDS, Material, PlatformRows, cable_robot_of
from robocal.measure.cable.winch_tensions import WinchTensions
from robocal.measure.data import Observations
from robocal.measure.machine import Model
from robocal.measure.rows import METRES, Kind, Rows, register
from robocal.parameters import Parameter

__all__ = ["LENGTHS", "gains_at", "locate_platform", "owner", "read_everywhere", "readings", "zeros_at"]

CHUNK = 1 << 17  # numbers of poses and their Jacobians at once
ZERO = "l0"
WHAT, NUMBERS = "cable lengths", "numbers of every cable"
ANYWHERE = 10.0  # m, of a zero that nobody has said


class LengthRows(PlatformRows):
    """The rows of all cables; columns are the carrier's, then the free numbers of the segments that cables run along. Of a row i of a cable
    the segments are those from `begin[i]` to `begin[i + 1]`."""

    def __init__(self, builder: Builder, obs: Observations, cables: Sequence[str], index: Ints) -> None:
        own, robot = owner(obs), cable_robot_of(builder.machine, WHAT)
        self.ways, cable = robot.segments, obs.extra["cable"][index].astype(np.int64)
        zeros = [f"{own}.{c}" if own else f"{c}.{ZERO}" for c in cables]
        ends = ((*(f"{n}.{s}" for s in ENDS), zeros[c]) for n, c in zip(self.ways.names, self.ways.cable, strict=True))
        numbers = builder.rows(n for seven in ends for n in seven)
        each = gain_names(obs, robot)
        gains = list(dict.fromkeys(each))
        # Of every cable, where its gain is behind the seven numbers of all; nowhere where lengths are as their sensors show.
        self.gains = np.array([gains.index(n) for n in each]) + len(numbers) if each else None
        growth = [robot.row(f"{c}.{BUILD_UP}") for c in cables] if robot.states_build_up else []
        if own and growth:
            raise ModelError(
                "zeros of a power-up beside drums that grow with every turn: their gain depends on where a sensor counts from",
                key=f"{obs.label}.zeros", found=own, expected="no zeros here, so that these lengths count from those of the robot",
            )  # fmt: skip
        gains += list(dict.fromkeys(growth))
        self.growth = np.array([gains.index(n) for n in growth]) + len(numbers) if growth else None
        self.cable = cable
        self.row, self.segment = self.ways.rows(cable)
        self.begin = np.searchsorted(self.row, np.arange(len(cable) + 1))
        tension, carriage = (obs.extra[key][index] if key in obs.extra else None for key in ("tension", "carriage"))
        self.winches = WinchTensions.of(builder, obs, index, cable)
        read = (None if v is None else v[self.row] for v in (tension, carriage))
        self.material = Material(robot, next(read), self.segment, next(read))
        self.behind = len(numbers) + len(gains)  # where the numbers of pulleys, rails and elasticities begin
        numbers = np.concatenate([numbers, builder.rows([*gains, *self.material.names, *self.winches.names])])
        super().__init__(builder, obs, index, numbers)
        self.walk = np.argsort(self.sight, kind="stable")
        self.hanging = (obs.extra["hanging"][index] if "hanging" in obs.extra else np.ones(len(index)))[self.row]
        radius, axis, share = self.material.at(self.material.stated, tension=self.material.tension)
        self.radius, self.axis = as_kernel_array(radius, axis)
        self.share = self.hanging * share

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        from robocal.measure.cable._kernels import evaluate_lengths

        value = as_kernel_array(self.values_at(which, first, rows))
        (t, j, jl), own, _ = self.look(x, first, rows)
        k = j.shape[3]
        part = slice(int(self.begin[first]), int(self.begin[first + rows]))
        row, segment = self.row[part] - first, self.segment[part]
        sight, (t, j, jl) = self._stand(own[row], segment, t, j, jl)
        r, jac = np.empty((len(x), rows, 1)), np.zeros((len(x), rows, 1, k + len(self.own)))
        jloc = np.zeros((len(x), rows, 1, jl.shape[3]))
        numbers, edges = self._numbers(x), self._free
        if self._as_stated(x):
            evaluate_lengths(
                t, j, jl, numbers, self.radius, self.axis, self.share[part], sight, segment, segment, row, *edges, value, r, jac, jloc
            )  # fmt: skip
        else:
            pull_of = self.row[part]
            for b in range(len(x)):
                one, known = slice(b, b + 1), value if len(value) == 1 else value[b : b + 1]
                stated = x[b, self.numbers[self.behind :]]
                stated, winch = stated[: len(self.material.names)], stated[len(self.material.names) :]
                pull = self.winches.at(winch)[pull_of] if len(winch) else self.material.tension[part]
                radius, axis, share = self.material.at(stated, part, pull)
                radius, axis = as_kernel_array(radius, axis)
                share = share * self.hanging[part]
                ends, place = numbers[b], segment
                if self.material.railed:
                    ends, place = ends[segment], np.arange(len(segment))
                    ends[:, :3] += self.material.carry(stated, part)
                evaluate_lengths(
                    t[one], j[one], jl[one], ends[None], radius, axis, share, sight, place, segment, row, *edges,
                    known, r[one], jac[one], jloc[one],
                )  # fmt: skip
                free = np.flatnonzero(self.own >= self.behind)
                if len(free) and len(row):
                    slopes, by_pull = self.material.slopes(stated, t[b, sight], ends[place], part, pull)
                    slopes = np.hstack([slopes, by_pull[:, None] * self.winches.columns[pull_of]]) * share[:, None]
                    each = np.add.reduceat(slopes, self.begin[first : first + rows] - part.start)
                    jac[b, :, 0, k + free] = each[:, self.own[free] - self.behind].T
        if self.gains is None and self.growth is None:
            return r, jac, jloc
        cable, length = self.cable[first : first + rows], r + value
        g, q = (None if w is None else x[:, self.numbers[w[cable]], None] for w in (self.gains, self.growth))
        g = np.ones_like(length) if g is None else g
        read, per = (length / g, g) if q is None else (reading(length, g, q), slope(length, g, q))
        r, jac, jloc = read - value, jac / per[..., None], jloc / per[..., None]
        for c in np.flatnonzero((self.own >= len(SYMBOLS) * len(self.radius)) & (self.own < self.behind)):
            for where, power in ((self.gains, 1), (self.growth, 2)):
                if where is not None and (mine := where[cable] == self.own[c]).any():
                    jac[..., 0, k + c] = np.where(mine, -(read**power / per)[..., 0], 0.0)
        return r, jac, jloc

    def _stand(self, sight: Ints, segment: Ints, *seen: Array) -> tuple[Ints, Sequence[Array]]:
        """Which pose each segment looks at, and the poses with their Jacobians; behind them one that never moves, for segments of which
        both ends are on one body."""
        if not self.ways.still.any():
            return sight, seen
        t, *slopes = seen
        behind = np.concatenate([t, np.tile(np.eye(4), (len(t), 1, 1, 1))], axis=1)
        return np.where(self.ways.still[segment], t.shape[1], sight), [
            behind,
            *(np.pad(j, ((0, 0), (0, 1), (0, 0), (0, 0))) for j in slopes),
        ]

    def _as_stated(self, x: Array) -> bool:
        """Whether pulleys, rails and elasticities are those of the machine, and stay so, under tensions that are known, and no anchor is
        on a rail."""
        free = len(self.winches.names) > 0 or (len(self.own) > 0 and bool(self.own[-1] >= self.behind))
        return (
            not free
            and not self.material.railed
            and bool((x[:, self.numbers[self.behind :]] == self.material.stated).all())
        )

    def _numbers(self, x: Array) -> Array:
        """The numbers of every segment, (B, C, 7); the zero of a cable is that of its first one."""
        seven = self.numbers[: len(SYMBOLS) * len(self.radius)]
        out = np.ascontiguousarray(x[:, seven].reshape(len(x), -1, len(SYMBOLS)))
        out[:, int(self.ways.cable.max()) + 1 :, 6] = 0.0
        return out

    @property
    def _free(self) -> tuple[Ints, Ints]:
        """Where the free numbers of each segment begin (C + 1,), and which of the seven each is (c,); those of an end that counts for
        nothing are its eighth."""
        owner, symbol = np.divmod(self.own[self.own < len(SYMBOLS) * len(self.radius)], len(SYMBOLS))
        symbol = np.where((symbol == 6) & (owner > self.ways.cable.max()), len(SYMBOLS), symbol)
        return np.searchsorted(owner, np.arange(len(self.radius) + 1)), symbol

    def accumulate(self, x: Array, which: Ints, weight: Array, loss: Loss, pair: int, out: Normal) -> bool:
        from robocal.measure.cable._kernels import accumulate_lengths

        if (
            self.touches[1]
            or self.gains is not None
            or self.growth is not None
            or not self.ways.is_plain
            or not self._as_stated(x)
        ):
            return False
        poses = int(self.sight.max(initial=-1)) + 1
        many = max(1, CHUNK // (64 * max(poses, 1)))
        for lo in range(0, len(x), many):
            part = slice(lo, lo + many)
            t, j, jl = self.carrier.pose(x[part], 0, poses)
            accumulate_lengths(
                t, j, jl, self._numbers(x[part]), self.radius, self.axis, self.share, self.sight, self.walk, self.cable, *self._free,
                self.value if len(self.value) == 1 else self.value[which[part]], self.scale,
                weight if len(weight) == 1 else weight[part], self.configuration, self.columns, self.local[0], loss.kind, loss.tuning,
                loss.curved[part], out.cost[part], out.g[part], out.a[part], out.gl[part], out.al[part], out.asl[part],
            )  # fmt: skip
        return True


def owner(obs: Observations) -> str:
    """Whose zeros these lengths count from, where they have some of their own."""
    return str(obs.options.get("zeros") or "")


def own_gains(obs: Observations) -> list[str]:
    """The parameters of the gains, where these lengths have drums of their own: one of all cables, or one of each."""
    drums = obs.options.get("gain")
    if not drums:
        return []
    if not obs.options.get("each"):
        return [f"{drums}.{GAIN}"]
    return [f"{drums}.{c}.{GAIN}" for c in cable_names(obs, NUMBERS)]


def gain_names(obs: Observations, robot: CableRobot) -> list[str]:
    """The parameter of the gain of each cable, where these lengths have none the robot's; none where nobody states any."""
    if own := own_gains(obs):
        return own if obs.options.get("each") else own * len(robot.cables)
    rows = [robot.row(f"{c}.{GAIN}") for c in robot.cables]
    return rows if all(n in robot.table for n in rows) else []


def _gain(obs: Observations) -> float:
    """The gain that is stated of drums of their own."""
    values = obs.options.get("values")
    return float(values["gain"]) if isinstance(values, Mapping) and "gain" in values else 1.0


def gains_at(robot: CableRobot, obs: Observations) -> Array:
    """The gains (m,) that are stated: of drums of their own, or the robot's."""
    return np.full(len(robot.cables), _gain(obs)) if obs.options.get("gain") else robot.gain


def parameters(obs: Observations) -> list[Parameter]:
    """The zeros of lengths that have some of their own, free from anywhere, and the gains of the drums, free unless stated."""
    own, free = owner(obs), obs.options.get("free")
    names = cable_names(obs, NUMBERS) if own else ()
    zeros = [Parameter(f"{own}.{c}", 0.0, "m", True, expected=ANYWHERE) for c in names]
    loose = "gain" in free if isinstance(free, tuple) else "values" not in obs.options
    drums = own_gains(obs)
    return [*zeros, *(Parameter(n, _gain(obs), "1", loose, expected=DRUM) for n in drums)]


def zeros_at(machine: Model, obs: Observations, index: Ints, pose: Array, own: bool = False) -> dict[str, float]:
    """The zeros of such lengths by name, or the robot's `own`, where the platform stood at poses (k, 4, 4) when rows `index` (k,) were
    read: the median of what the robot's lengths are beyond them."""
    robot, cable = cable_robot_of(machine, WHAT), obs.extra["cable"][index].astype(np.int64)
    out, gain = {}, gains_at(robot, obs)
    for i, name in enumerate(robot.cables):
        mine = np.flatnonzero(cable == i)
        if len(mine):
            read = obs.extra["carriage"][index[mine]] if "carriage" in obs.extra else None
            full = straight(robot, pose[mine], read)[0][:, i]
            shown = obs.value[index[mine], 0]
            called = robot.row(f"{name}.{ZERO}") if own else f"{owner(obs)}.{name}"
            out[called] = float(np.median(full - (gain[i] + robot.build_up[i] * shown) * shown))
    return out


def readings(robot: CableRobot, obs: Observations, count: int) -> Array:
    """What the drum of every cable had wound up at each of so many configurations (U, m) in m, beyond its zero; NaN where nothing was
    read."""
    table, cable = np.full((count, len(robot.cables)), np.nan), obs.extra["cable"].astype(np.int64)
    table[obs.configuration, cable] = (
        obs.value[:, 0] * (gains_at(robot, obs) + robot.build_up * obs.value)[np.arange(len(obs)), cable]
    )
    return table


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term for all cables, their rows one cable after the other."""
    cables = cable_robot_of(builder.machine, WHAT).cables
    number = obs.extra["cable"].astype(np.int64)
    if len(number) and not 0 <= number.min() <= number.max() < len(cables):
        expected = f"0 to {len(cables) - 1}"
        raise ModelError("no such cable", key="cable", found=[int(number.min()), int(number.max())], expected=expected)
    return [LengthRows(builder, obs, cables, np.argsort(number, kind="stable"))] if len(number) else []


def read_everywhere(obs: Observations, count: int, cables: int) -> Observations:
    """The same sensors at so many configurations, of every cable; they read nothing yet."""
    each, cable = np.divmod(np.arange(count * cables), cables)
    plain = {"extra": {"cable": cable}, "options": obs.options, "group": obs.group}
    return Observations("lengths", each, np.zeros((len(each), 1)), np.ones((len(each), 1)), **plain)  # type: ignore[arg-type]


def locate_platform(machine: Model, obs: Observations, wanted: Bools) -> Array:
    """T_base_platform (U, 4, 4) of the wanted configurations (U,) by forward kinematics, NaN where a length is missing or
    the lengths do not tell. Of fewer cables than the platform has freedoms it is where the platform would be without turning."""
    from robocal.cables.forward import forward

    out = np.full((len(wanted), 4, 4), np.nan)
    if owner(obs):
        return out  # nobody knows what they count from
    robot = cable_robot_of(machine, WHAT)
    table = readings(robot, obs, len(wanted))
    some = np.flatnonzero(wanted & np.isfinite(table).all(axis=1))
    turned = len(robot.cables) >= len(robot.axes)
    axes = tuple(i for i in robot.axes if turned or i < 3)
    if len(some) and len(robot.cables) >= len(axes):
        pull = None
        if "tension" in obs.extra and robot.elasticity is not None:
            pull = np.zeros_like(table)
            pull[obs.configuration, obs.extra["cable"].astype(np.int64)] = obs.extra["tension"]
        for there, rows in _by_carriages(robot, obs, some):
            found = forward(there, there.readings(table[rows]), tension=None if pull is None else pull[rows], axes=axes)
            good = found.converged & np.isfinite(found.pose).all(axis=(1, 2))
            out[rows[good]] = found.pose[good]
    return out


def _by_carriages(robot: CableRobot, obs: Observations, some: Ints) -> Iterator[tuple[CableRobot, Ints]]:
    """The robot with its anchors where the carriages were read, and of some configurations those that it stood so for."""
    if "carriage" not in obs.extra:
        yield robot, some
        return
    rails = [
        (n, int(c))
        for n, c in zip(robot.segments.names, robot.segments.cable, strict=True)
        if robot.row(f"{n}.carriage") in robot.table
    ]
    read = np.full((int(obs.configuration.max()) + 1, len(robot.cables)), np.nan)
    read[obs.configuration, obs.extra["cable"].astype(np.int64)] = obs.extra["carriage"]
    stated = np.array([robot.table[robot.row(f"{n}.carriage")].value for n, _ in rails])
    stood = np.where(np.isnan(read[some][:, [c for _, c in rails]]), stated, read[some][:, [c for _, c in rails]])
    places, of = np.unique(stood, axis=0, return_inverse=True)
    for i, place in enumerate(places):
        values = {robot.row(f"{n}.carriage"): float(v) for (n, _), v in zip(rails, place, strict=True)}
        yield robot.with_values(values), some[of.ravel() == i]


LENGTHS = register(Kind("lengths", 1, terms, parameters, METRES, metric=True, manufactured=("gain",), unstated=1e-3))
