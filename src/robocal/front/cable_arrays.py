"""A cable robot in a program: arrays in SI in, arrays in SI out, without files."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
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
from robocal.errors import FormatError, InputError, ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.front import shapes
from robocal.front.arguments import named_arguments
from robocal.front.calls import call
from robocal.front.robots import path_text, robot_file, without_file
from robocal.session.cable.calibrated import open_robot
from robocal.session.cable.statics_options import mass_of, robot_with_limits

__all__ = ["CableArm", "robot"]

EXAMPLES = {
    "units": '{"length": "mm"}', "every_cable": '{"tension": [10, 500]}', "platform": '{"mass": 25}',
    "calibrate": '{"free": ["ax", "ay", "az"]}',
}  # fmt: skip
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

    @property
    def coordinates(self) -> tuple[str, tuple[str, ...]]:
        """What measurements of it are made at, an argument of `rc.measurements`, and the names of its columns."""
        return "lengths", self.cables

    @named_arguments
    def inverse(self, poses: ArrayLike, *, tension: ArrayLike | None = None, sag: bool = False) -> Array:
        """Lengths (k, m) in m at poses; with tensions (k, m) or (m,) in N cables stretch, with `sag` they also hang.

        Raises ModelError for poses at which a cable has no length, and for what the robot's file does not know.
        """
        held = None if tension is None else self._each(tension, "tension")
        return inverse(self.model.robot, _poses(poses), held, sag=sag)[0]

    @named_arguments
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
        noise = None if sigma is None else self._each(sigma, "sigma", many=False)
        if noise is not None and not (noise > 0).all():
            raise FormatError("a noise is a standard deviation", argument="sigma", found=sigma, expected="above 0")
        held = None if tension is None else self._each(tension, "tension")
        given: dict[str, Any] = {"sag": sag, "starts": starts, "rng": np.random.default_rng(seed)}
        return forward(self.model.robot, self._each(lengths, "lengths"), tension=held, sigma=noise, **given)

    @named_arguments
    def tension(self, poses: ArrayLike, *, wrench: ArrayLike = (0.0,) * 6, method: str = METHOD) -> Distribution:
        """Tensions (k, m) in N that hold the platform's weight and a wrench (6,) or (k, 6) in N and N m at its origin, base
        axes: `tension`, `feasible` (k,), `found` (k,).

        Raises InputError where the file knows no limits or no mass.
        """
        able, at = robot_with_limits(self.model), _poses(poses)
        push = shapes.numbers(wrench, "wrench", "(6,) or (k, 6)")
        if push.shape not in ((6,), (len(at), 6)):
            raise FormatError(
                "wrong shape", argument="wrench", found=push.shape, expected=f"(6,) or ({len(at)}, 6), in N and N m"
            )
        load = gravity_wrench(at, mass_of(self.model), able.com) + push
        return distribute(structure_of(able, at), load[:, list(able.axes)], able.need("limits"), method)

    @named_arguments
    def dexterity(self, poses: ArrayLike, *, length: float = 1.0) -> Dexterity:
        """How evenly the cables can pull at poses: `tension_factor` (k,) from 0 to 1, `closed` (k,) where any wrench can be balanced,
        `condition` (k,), the condition number with moments divided by `length` in m.

        Neither weight nor tension limits take part. Raises ModelError for poses at which a cable has no length.
        """
        held = self.model.robot
        return dexterity(structure_of(held, _poses(poses)), held.lengths_of_rows(length))

    @named_arguments
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

    def _each(self, given: ArrayLike, argument: str, many: bool = True) -> Array:
        """A number for each cable, (m,), or of many poses (k, m). Raises FormatError."""
        n = len(self.cables)
        expected = f"{f'(k, {n}) or ' if many else 'a number or '}({n},), one for each cable"
        out = shapes.numbers(given, argument, expected)
        if out.shape == () and not many:
            return out
        if out.ndim not in ((1, 2) if many else (1,)) or out.shape[-1] != n:
            raise FormatError("wrong shape", argument=argument, found=out.shape, expected=expected)
        return out

    def __repr__(self) -> str:
        r = self.model.robot
        return f"{r.name}: {len(r.cables)} cables, {len(r.axes)} degrees of freedom ({r.degrees})"


@named_arguments
def robot(
    source: str | os.PathLike[str] | Mapping[str, Any] | None = None,
    *,
    frame_anchors: ArrayLike | None = None,
    platform_anchors: ArrayLike | None = None,
    zeros: ArrayLike | None = None,
    cables: Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
    degrees: str = "3R3T",
    plane: str | None = None,
    every_cable: Mapping[str, Any] | None = None,
    platform: Mapping[str, Any] | None = None,
    calibrate: Mapping[str, Any] | None = None,
    name: str = "cable robot",
) -> CableArm:
    """A cable robot: from its file, from a mapping with the keys of that file, or from arrays of its anchors.

    source: robot.yaml, CASPR's X_cables.xml, or a mapping. In place of it: frame_anchors (n, 3) in base coordinates and platform_anchors
    (n, 3) in platform coordinates, a row for each cable; zeros (n,), the geometric length less what the sensor shows, 0 unless given.
    cables: their names, c1, c2, ... unless given. units: {"length": "m", "angle": "deg", "force": "N", "mass": "kg"} unless given.
    degrees: 3R3T, 3T, 1R2T or 2T; plane: of a planar robot. every_cable, platform, calibrate: as in the file, such as
    {"tension": [10, 500]}, {"mass": 25}, {"free": ["ax", "ay", "az", "l0"]}, which is what is free unless given.

    Returns a CableArm, which `rc.identify` and the verbs of `rc.cable` take. Raises InputError.
    """
    parts = {"units": units, "every_cable": every_cable, "platform": platform, "calibrate": calibrate}
    for key, part in parts.items():
        if part is not None and not isinstance(part, Mapping):
            raise FormatError("not a mapping", argument=key, found=part, expected=EXAMPLES[key])
    arrays = {"frame_anchors": frame_anchors, "platform_anchors": platform_anchors, "zeros": zeros, "cables": cables}
    there = [key for key, value in arrays.items() if value is not None]
    if source is not None:
        if there:
            raise ModelError(
                "this stands in place of a file", argument=there[0], expected="source alone, or arrays alone"
            )
        if not isinstance(source, Mapping):
            opened = path_text(source)
            return CableArm(opened, open_robot(opened))
        made: Mapping[str, Any] = {"kind": "cable"} | dict(source)
        argument = "source"
    else:
        further = {"every_cable": every_cable, "platform": platform}
        free = calibrate or {"free": ["ax", "ay", "az", "l0"]}
        made = {
            "kind": "cable", "name": name, "units": {"length": "m", **(units or {})}, "degrees": degrees,
            **({} if plane is None else {"plane": plane}), **_anchors(frame_anchors, platform_anchors, zeros, cables),
            **{k: v for k, v in further.items() if v is not None}, "calibrate": free,
        }  # fmt: skip
        argument = "frame_anchors"
    opened = robot_file(made, argument)
    try:
        return CableArm(opened, open_robot(opened))
    except InputError as error:
        key = (error.key or "").partition(".")[0].partition("[")[0]
        own = ("every_cable", "platform", "calibrate", "units", "degrees", "plane", "platform_anchors", "name")
        raise without_file(error, key if source is None and key in own else argument) from None


def _anchors(frame: Any, platform: Any, zeros: Any, cables: Sequence[str] | None) -> dict[str, Any]:
    """The keys of anchors and cables, from arrays. Raises FormatError."""
    for argument, value in (("frame_anchors", frame), ("platform_anchors", platform)):
        if value is None:
            raise FormatError(
                "this robot has no anchors", argument=argument, expected="(n, 3), a row for each cable; or source="
            )
    a = shapes.table(frame, "frame_anchors", 3, each="cable")
    b = shapes.table(platform, "platform_anchors", 3, len(a), "cable")
    n = len(a)
    offsets = np.zeros(n) if zeros is None else shapes.numbers(zeros, "zeros", f"({n},)")
    if offsets.shape != (n,):
        raise FormatError("wrong shape", argument="zeros", found=offsets.shape, expected=f"({n},), one for each cable")
    names = [f"c{i + 1}" for i in range(n)] if cables is None else list(cables)
    if len(names) != n or len(set(names)) < n:
        raise FormatError(
            "wrong names of cables", argument="cables", found=", ".join(names), expected=f"{n} names, each once"
        )
    rows = [
        {"name": c, "frame": f"A{i + 1}", "platform": f"B{i + 1}", "zero": z}
        for i, (c, z) in enumerate(zip(names, offsets.tolist(), strict=True))
    ]
    points = {"frame_anchors": ("A", a), "platform_anchors": ("B", b)}
    return {k: {f"{w}{i + 1}": p for i, p in enumerate(v.tolist())} for k, (w, v) in points.items()} | {"cables": rows}


def _poses(given: ArrayLike) -> Array:
    """Poses (k, 4, 4). Raises FormatError for another shape or numbers that are none."""
    out = shapes.numbers(given, "poses", "(k, 4, 4) or (4, 4)")
    if out.shape[-2:] != (4, 4) or out.ndim > 3:
        raise FormatError("these are no poses", argument="poses", found=out.shape, expected="(k, 4, 4) or (4, 4)")
    out = out.reshape(-1, 4, 4)
    turn = out[:, :3, :3]
    off = np.abs(turn @ turn.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
    last = np.abs(out[:, 3] - [0, 0, 0, 1]).max(axis=1, initial=0.0)
    bad = (off > RIGID) | (np.linalg.det(turn) < 0) | (last > RIGID)
    if bad.any():
        expected = "rigid motions: orthonormal axes, determinant 1, last row 0 0 0 1"
        raise FormatError("this is no pose", argument="poses", found=f"[{int(bad.argmax())}]", expected=expected)
    return out
