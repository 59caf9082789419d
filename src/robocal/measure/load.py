"""Load cells in the cables of a platform at rest: r = C^-1 (W t + w), C C^T = W W^T, one row per component of the twist and
configuration.

W (d, m) is the structure matrix, w the wrench of the platform's weight, t (m,) what the cells read, extra["tension"] (k, m) in N beside
each of d rows; extra["axis"] (k,) numbers the component from 0; value (k, 1) is 0. C makes of independent errors s of the
cells independent errors s of the rows, whatever the pose: sigma (k, 1) is that of a cell, in N. options["platform"] names the owner of
`mass` (kg) and of the centre of mass `cx`, `cy`, `cz` (m, platform axes). Cables are straight and light, sigma the same for all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from robocal._types import Array, Bools, Ints
from robocal.errors import ModelError
from robocal.geometry import so3
from robocal.measure.builder import Builder
from robocal.measure.cable.platform_rows import ENDS, PlatformRows, cable_robot_of
from robocal.measure.data import Observations
from robocal.measure.rows import Kind, Number, Rows, number_names, register

__all__ = ["BODY", "LOAD", "LoadRows", "of_platform"]

FLAT = 1e-13  # tolerance: of W W^T, least eigenvalue by greatest, where rounding decides whether it has a root
GRAVITY = 9.80665  # m/s^2, along -z of the base
WHAT = "load cells"
# Mass and centre of mass of the platform: held at what is stated unless they are free.
BODY = (
    Number("platform", "mass", "kg", 0.0, 1.0),
    *(Number("platform", s, "m", 0.0, 0.02) for s in ("cx", "cy", "cz")),
)


class LoadRows(PlatformRows):
    """The rows of all configurations; columns are the carrier's, then the cables' ends and the platform's mass and centre."""

    def __init__(self, builder: Builder, obs: Observations) -> None:
        robot = cable_robot_of(builder.machine, WHAT)
        self.axes = np.array(robot.axes, dtype=np.int64)
        own = builder.rows([*(f"{c}.{s}" for c in robot.cables for s in ENDS), *number_names(obs), *self.more(obs)])
        super().__init__(builder, obs, np.arange(len(obs)), own)
        self.axis = obs.extra["axis"].astype(np.int64)
        self.tension = self.of_places(obs, "tension")

    def more(self, obs: Observations) -> Sequence[str]:
        """The names of numbers behind those of the platform."""
        return ()

    def of_places(self, obs: Observations, what: str) -> Array:
        """What was read of all cables, (configurations, m)."""
        read = obs.extra[what]
        out = np.zeros((int(self.sight.max(initial=-1)) + 1, read.shape[1]))
        out[self.sight] = read
        return out

    def evaluate(self, x: Array, which: Ints, first: int, rows: int) -> tuple[Array, Array, Array]:
        axis = self.axis[first : first + rows]
        (t, j, jl), at, lo = self.look(x, first, rows)
        tension, slopes = self.pulls(x, slice(lo, lo + t.shape[1]))
        r, by_pose, by_number, by_tension = self._balance(x, t, tension)
        more = np.einsum("bkmd,bkmp->bkdp", by_tension, slopes)
        jac = np.concatenate([by_pose @ j, np.concatenate([by_number, more], axis=3)[..., self.own]], axis=3)
        value, jac, local = (np.ascontiguousarray(v[:, at, axis][:, :, None]) for v in (r, jac, by_pose @ jl))
        return value - self.values_at(which, first, rows), jac, local

    def pulls(self, x: Array, part: slice) -> tuple[Array, Array]:
        """Tensions of some configurations (B or 1, k, m) in N, and their derivatives (B or 1, k, m, p) by the numbers behind the body's."""
        read = self.tension[None, part]
        return read, np.empty((*read.shape, 0))

    def _balance(self, x: Array, t: Array, tension: Array) -> tuple[Array, Array, Array, Array]:
        """r (B, k, d), and its derivatives by the twist of the pose (B, k, d, 6), by ends and body (B, k, d, 6 m + 4), and by the
        tensions (B, k, m, d)."""
        m = tension.shape[2]
        number = x[:, self.numbers[: 6 * m + len(BODY)]]
        ends, body = number[:, : 6 * m].reshape(len(x), 1, m, 6), number[:, 6 * m :]
        turn = t[:, :, None, :3, :3]
        lever = (turn @ ends[..., 3:, None])[..., 0]
        d = ends[..., :3] - t[:, :, None, :3, 3] - lever  # from the platform to the frame, as the cable pulls
        far = np.linalg.norm(d, axis=-1, keepdims=True)
        u = d / far
        w = np.concatenate([u, np.cross(lever, u)], axis=-1)[..., self.axes]  # (B, k, m, d)
        centre = (t[:, :, :3, :3] @ body[:, None, 1:, None])[..., 0]
        weight = np.zeros((*centre.shape[:2], 3))
        weight[..., 2] = -GRAVITY * body[:, :1]
        load = np.concatenate([weight, np.cross(centre, weight)], axis=-1)[..., self.axes]
        root, held = root_of(np.einsum("bkmi,bkmj->bkij", w, w))
        r = np.linalg.solve(
            root, (np.einsum("bkmi,bkm->bki", w, np.broadcast_to(tension, w.shape[:3])) + load)[..., None]
        )[..., 0]
        r[~held] = np.inf
        # A change of d_i and of the lever moves column i: du = (I - u u^T) dd / |d|.
        flat = (np.eye(3) - u[..., :, None] * u[..., None, :]) / far[..., None]
        change = np.zeros((*u.shape[:3], 6, 6))
        change[..., :3, :3] = flat
        change[..., 3:, :3] = so3.skew(lever) @ flat
        change[..., 3:, 3:] = -so3.skew(u)
        inner = np.linalg.solve(root[:, :, None], change[..., self.axes, :])  # C^-1 dw, (B, k, m, d, 6)
        own = np.linalg.solve(root, w.swapaxes(-1, -2)).swapaxes(-1, -2)  # C^-1 w, (B, k, m, d)
        slope = tension[..., None, None] * inner - _root_moved(inner, own, r)
        by_end = np.empty((*slope.shape[:4], 6))
        by_end[..., :3] = slope[..., :3]
        by_end[..., 3:] = (slope[..., 3:] - slope[..., :3]) @ turn
        arm = so3.skew(lever)  # d(lever) = w x lever = -[lever] w, d(d) = -v - w x lever
        by_pose = np.concatenate([-slope[..., :3], slope[..., :3] @ arm - slope[..., 3:] @ arm], axis=-1).sum(axis=2)
        body_slope = np.zeros((*centre.shape[:2], 6, 10))  # by w (3), mass, centre in platform axes (3)
        push = -so3.skew(weight)  # d(centre x F) = -F x d(centre)
        body_slope[..., 3:, 3:6] = push @ -so3.skew(centre)
        body_slope[..., 2, 6] = -GRAVITY
        body_slope[..., 3:, 6] = np.cross(centre, [0.0, 0.0, -GRAVITY])
        body_slope[..., 3:, 7:] = push @ t[:, :, :3, :3]
        by_body = np.linalg.solve(root, body_slope[..., self.axes, :])
        by_pose += by_body[..., :6]
        ends_slope = by_end.transpose(0, 1, 3, 2, 4).reshape(*by_pose.shape[:3], 6 * m)
        return r, by_pose, np.concatenate([ends_slope, by_body[..., 6:]], axis=-1), own


def root_of(square: Array) -> tuple[Array, Bools]:
    """C (..., d, d) with C C^T = W W^T, and where there is one (...): cables that all pull alike carry no wrench, and a search that
    tries such poses has to turn back."""
    try:
        return np.asarray(np.linalg.cholesky(square)), np.ones(square.shape[:-2], bool)
    except np.linalg.LinAlgError:
        known = np.asarray(np.isfinite(square).all(axis=(-2, -1)))
        some = np.where(known[..., None, None], square, np.eye(square.shape[-1]))
        spread = np.linalg.eigvalsh(some)
        held = np.asarray(known & (spread[..., 0] > FLAT * spread[..., -1]))
        return np.asarray(np.linalg.cholesky(np.where(held[..., None, None], some, np.eye(square.shape[-1])))), held


def _root_moved(inner: Array, own: Array, r: Array) -> Array:
    """phi(C^-1 dA C^-T) r with dA = dw w^T + w dw^T: what the change of the root takes, (B, k, m, d, 6); phi is the lower triangle
    with half the diagonal."""
    before = _before(own * r[:, :, None])
    behind = _before(inner * r[:, :, None, :, None], axis=3)
    return np.asarray(inner * before[..., None] + own[..., None] * behind + inner * (own * r[:, :, None])[..., None])


def _before(a: Array, axis: int = -1) -> Array:
    """Sums of what stands before each."""
    return np.asarray(np.cumsum(a, axis=axis) - a)


def of_platform(builder: Builder, obs: Observations, rows: Callable[[Builder, Observations], Rows]) -> list[Rows]:
    """One term for all configurations. Raises ModelError where pulleys turn the cables, or nobody knows the platform."""
    if cable_robot_of(builder.machine, WHAT).pulleys is not None:
        raise ModelError("load cells of cables over pulleys are not modelled", key="pulley", expected="straight cables")
    if not obs.options.get("platform"):
        raise ModelError("load cells need the platform's mass", key=obs.label, expected="options['platform']")
    return [rows(builder, obs)] if len(obs) else []


def terms(builder: Builder, obs: Observations) -> list[Rows]:
    """One term for all configurations."""
    return of_platform(builder, obs, LoadRows)


LOAD = register(Kind("load", 1, terms, parts=((0, 1, "N"),), numbers=BODY, unstated=1.0))
