"""A cable robot in a program: arrays in SI in, arrays in SI out, without files."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array
from robocal.cables.cable_lengths import inverse
from robocal.cables.closure import Dexterity, dexterity
from robocal.cables.forward import Forward, forward
from robocal.cables.prepared import Prepared
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import Distribution, distribute
from robocal.cables.tension_choice import METHOD
from robocal.errors import FormatError
from robocal.files.cable.cablefile import CableFile
from robocal.front.arrays import path as text_of
from robocal.front.calls import call
from robocal.session.cable.calibrated import open_robot
from robocal.session.cable.statics_options import mass_of, robot_with_limits

__all__ = ["CableArm", "robot"]

RIGID = 1e-6  # how far axes may be from orthonormal: what is left of poses that were printed with seven digits


@record
class CableArm:
    """A cable robot as it was opened: its file, and the model in SI (`model.robot`). Poses are T_base_platform, (k, 4, 4), m."""

    opened: str
    model: CableFile

    @property
    def cables(self) -> tuple[str, ...]:
        """Names of the cables."""
        return self.model.robot.cables

    def inverse(self, poses: ArrayLike, *, tension: ArrayLike | None = None, sag: bool = False) -> Array:
        """Lengths (k, m) in m at poses; with tensions (k, m) or (m,) in N cables stretch, with `sag` they also hang.

        Raises ModelError for poses at which a cable has no length, and for what the robot's file does not know.
        """
        held = None if tension is None else _numbers(tension, "tension")
        return inverse(self.model.robot, _poses(poses), held, sag=sag)[0]

    def forward(
        self,
        lengths: ArrayLike,
        *,
        sigma: ArrayLike | None = None,
        tension: ArrayLike | None = None,
        sag: bool = False,
        starts: int = 0,
        seed: int = 0,
    ) -> Forward:
        """Poses from lengths (k, m) in m: `pose` (k, 4, 4), `residual` (k, m) in m, `covariance`, `converged`, `solutions`.

        sigma () or (m,) in m is the noise of a length; `starts` further starts look for other poses. Raises ModelError.
        """
        noise = None if sigma is None else _numbers(sigma, "sigma")
        if noise is not None and not (noise > 0).all():
            raise FormatError("a noise is a standard deviation", column="sigma", found=sigma, expected="above 0")
        held = None if tension is None else _numbers(tension, "tension")
        given: dict[str, Any] = {"sag": sag, "starts": starts, "rng": np.random.default_rng(seed)}
        return forward(self.model.robot, _numbers(lengths, "lengths"), tension=held, sigma=noise, **given)

    def tension(self, poses: ArrayLike, *, wrench: ArrayLike = (0.0,) * 6, method: str = METHOD) -> Distribution:
        """Tensions (k, m) in N that hold the platform's weight and a wrench (6,) or (k, 6) in N and N m at its origin, base
        axes: `tension`, `feasible` (k,), `found` (k,).

        Raises InputError where the file knows no limits or no mass.
        """
        able, at = robot_with_limits(self.model), _poses(poses)
        load = gravity_wrench(at, mass_of(self.model), able.com) + _numbers(wrench, "wrench")
        return distribute(structure_of(able, at), load[:, list(able.axes)], able.need("limits"), method)

    def dexterity(self, poses: ArrayLike, *, length: float = 1.0) -> Dexterity:
        """How evenly the cables can pull at poses: `tension_factor` (k,) from 0 to 1, `closed` (k,) where any wrench can be balanced,
        `condition` (k,), the condition number with moments divided by `length` in m.

        Neither weight nor tension limits take part. Raises ModelError for poses at which a cable has no length.
        """
        held = self.model.robot
        return dexterity(structure_of(held, _poses(poses)), held.lengths_of_rows(length))

    def prepare(self, *, method: str = METHOD, sigma: float | None = None) -> Prepared:
        """The robot entered into kernels once, for a controller that asks one pose a thousand times a second: `tension(pose)`,
        `forward(lengths, start)`, `twist(pose, rates)`; nothing that they are asked raises. sigma is the noise of a length in m.

        Raises InputError where the file knows no limits or no mass.
        """
        able = robot_with_limits(self.model)
        return Prepared(able, mass=mass_of(self.model), method=method, sigma=sigma)

    def workspace(self, **options: Any) -> Any:
        """Where the platform can be held: options as of `rc.cable.workspace`."""
        return call("cable.workspace")(self.opened, **options)

    def poses(self, **options: Any) -> Any:
        """Poses that can be reached and left again: options as of `rc.cable.poses`."""
        return call("cable.poses")(self.opened, **options)

    def __repr__(self) -> str:
        r = self.model.robot
        return f"{r.name}: {len(r.cables)} cables, {len(r.axes)} degrees of freedom ({r.degrees})"


def robot(path: str | os.PathLike[str]) -> CableArm:
    """A cable robot from its robot.yaml, or from CASPR's X_cables.xml. Raises InputError."""
    name = text_of(path)
    return CableArm(name, open_robot(name))


def _numbers(given: ArrayLike, name: str) -> Array:
    """An array. Raises FormatError where these are no numbers."""
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise FormatError("these are no numbers", column=name, expected="an array") from None


def _poses(given: ArrayLike) -> Array:
    """Poses (k, 4, 4). Raises FormatError for another shape or numbers that are none."""
    out = _numbers(given, "poses")
    if out.shape[-2:] != (4, 4) or out.ndim > 3 or not np.isfinite(out).all():
        raise FormatError("these are no poses", column="poses", found=out.shape, expected="(k, 4, 4) or (4, 4), finite")
    out = out.reshape(-1, 4, 4)
    turn = out[:, :3, :3]
    off = np.abs(turn @ turn.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
    last = np.abs(out[:, 3] - [0, 0, 0, 1]).max(axis=1, initial=0.0)
    bad = (off > RIGID) | (np.linalg.det(turn) < 0) | (last > RIGID)
    if bad.any():
        expected = "rigid motions: orthonormal axes, determinant 1, last row 0 0 0 1"
        raise FormatError("this is no pose", column="poses", row=int(bad.argmax()), expected=expected)
    return out
