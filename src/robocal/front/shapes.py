"""Arrays as callers give them, checked one by one: each error says the argument, what was found and what was expected."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal._types import Array
from robocal.errors import FormatError, nearest
from robocal.files.units import UNITS
from robocal.geometry import so3

__all__ = ["numbers", "quaternions", "rotations", "spread", "table", "transforms", "unit", "unmasked"]

PRINTED = (
    2e-3  # tolerance: off from a rotation by what three printed digits leave; a turn in another unit is off by more
)
ORDERS = {"xyzw": (0, 1, 2, 3), "wxyz": (1, 2, 3, 0)}  # where x, y, z, w stand


def unmasked(given: ArrayLike, argument: str) -> NDArray[Any]:
    """An array. Raises FormatError where values are masked: what nobody read is no measurement."""
    if np.ma.is_masked(given):
        raise FormatError("some values are masked", argument=argument, expected="the rows that were measured")
    try:
        return np.asarray(given)
    except (TypeError, ValueError):
        raise FormatError("rows of different lengths", argument=argument, expected="an array") from None


def numbers(given: ArrayLike, argument: str, expected: str = "an array of numbers") -> Array:
    """Finite numbers of any shape. Raises FormatError."""
    raw = unmasked(given, argument)
    try:
        out = raw.astype(float, casting="same_kind" if np.iscomplexobj(raw) else "unsafe")
    except (TypeError, ValueError):
        word = "a single object" if raw.shape == () and raw.dtype == object else f"{raw.dtype} of shape {raw.shape}"
        raise FormatError("these are no numbers", argument=argument, found=word, expected=expected) from None
    if not np.isfinite(out).all():
        at = np.unravel_index(int(np.argmax(~np.isfinite(out))), out.shape)
        place = ", ".join(map(str, at))
        found = f"{out[at]} at [{place}], the first of {int((~np.isfinite(out)).sum())}"
        raise FormatError(
            "not a finite number",
            argument=argument,
            found=found,
            expected="finite numbers; leave out rows that lack one",
        )
    return out


def table(
    given: ArrayLike, argument: str, width: int | None = None, rows: int | None = None, each: str = "measurement"
) -> Array:
    """Finite numbers (m, width), one row for `each`; `rows` are those of the joints or lengths. Raises FormatError."""
    shape = f"({'m' if rows is None else rows}, {width or 'n'})"
    out = numbers(given, argument, f"an array {shape}")
    if out.ndim != 2 or (width is not None and out.shape[1] != width):
        turned = out.ndim == 2 and out.shape[0] == width
        hint = f": one row for each {each}, {argument}.T" if turned else f", one row for each {each}"
        raise FormatError("wrong shape", argument=argument, found=out.shape, expected=f"{shape}{hint}")
    if not len(out):
        raise FormatError("no rows", argument=argument, found=out.shape, expected=f"{shape}, at least one row")
    return matching(out, argument, rows)


def matching(out: Array, argument: str, rows: int | None) -> Array:
    """The same array where it has so many rows. Raises FormatError."""
    if rows is not None and len(out) != rows:
        raise FormatError(
            "wrong number of rows", argument=argument, found=len(out), expected=f"{rows}, as many as the other arrays"
        )
    return out


def spread(given: ArrayLike, argument: str, rows: int, width: int) -> Array:
    """Standard deviations (m, width) from a number, (width,) or (m, width); above 0. Raises FormatError."""
    expected = f"a number, ({width},) or ({rows}, {width})"
    value = numbers(given, argument, expected)
    try:
        out = np.broadcast_to(value, (rows, width))
    except ValueError:
        raise FormatError("wrong shape", argument=argument, found=value.shape, expected=expected) from None
    if not (out > 0).all():
        raise FormatError(
            "a noise is a standard deviation", argument=argument, found=float(out.min()), expected="above 0"
        )
    return out


def rotations(given: Any, argument: str, rows: int | None = None) -> Array:
    """Rotation matrices (m, 3, 3), from such an array or whatever has `as_matrix()` (scipy's Rotation). Raises FormatError."""
    given = given.as_matrix() if hasattr(given, "as_matrix") else given
    expected = "(m, 3, 3), orthonormal with determinant 1"
    out = numbers(given, argument, expected)
    if out.ndim != 3 or out.shape[1:] != (3, 3):
        other = ", or a quaternion= (m, 4)" if out.ndim == 2 and out.shape[1] == 4 else ""
        raise FormatError("wrong shape", argument=argument, found=out.shape, expected=expected + other)
    if not len(out):
        raise FormatError("no rows", argument=argument, found=out.shape, expected=expected)
    off = np.abs(out @ out.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    if (off > PRINTED).any():
        at = int(off.argmax())
        found = f"[{at}], off from orthonormal by {off[at]:.2g}"
        raise FormatError("this is no rotation", argument=argument, found=found, expected=expected)
    if (left := np.linalg.det(out) < 0).any():
        found = f"[{int(left.argmax())}], determinant -1"
        raise FormatError("these axes are left-handed", argument=argument, found=found, expected=expected)
    return so3.project(matching(out, argument, rows))


def quaternions(given: ArrayLike, order: str | None, rows: int | None = None) -> Array:
    """Unit quaternions (m, 4), scalar last, of such in an order that is stated. Raises FormatError."""
    known = " or ".join(f'"{o}"' for o in ORDERS)
    if order is None:
        expected = f"{known}: where the scalar w stands (last in scipy and ROS, first in ABB and Eigen's constructor)"
        raise FormatError("the order of quaternions is not stated", argument="quaternion_order", expected=expected)
    if order not in ORDERS:
        raise FormatError(
            "unknown order",
            argument="quaternion_order",
            found=order,
            expected=known,
            suggestion=nearest(str(order), ORDERS),
        )
    q = table(given, "quaternion", 4, rows)
    size = np.linalg.norm(q, axis=1)
    if (off := np.abs(size - 1) > PRINTED).any():
        at = int(off.argmax())
        found, expected = f"norm {size[at]:.4g} at [{at}]", "unit quaternions: divide each by its norm"
        raise FormatError("this is no unit quaternion", argument="quaternion", found=found, expected=expected)
    return np.asarray(q[:, ORDERS[order]] / size[:, None])


def transforms(given: ArrayLike, argument: str, rows: int | None = None) -> tuple[Array, Array]:
    """Positions (m, 3) and rotations (m, 3, 3) of poses (m, 4, 4). Raises FormatError."""
    expected = "(m, 4, 4): rotation and position, last row 0 0 0 1"
    out = numbers(given, argument, expected)
    if out.ndim != 3 or out.shape[1:] != (4, 4):
        other = (
            "; or position= with quaternion= or rotation_vector=" if out.ndim == 2 and out.shape[1] in (6, 7) else ""
        )
        raise FormatError("wrong shape", argument=argument, found=out.shape, expected=expected + other)
    if not len(out):
        raise FormatError("no rows", argument=argument, found=out.shape, expected=expected)
    off = np.abs(out[:, 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=1)
    if (off > 1e-6).any():  # tolerance: what seven printed digits leave
        turned = not np.abs(out[:, :3, 3]).max() > 0
        hint = f": {argument}.transpose(0, 2, 1)" if turned else ""
        found = f"last row {out[int(off.argmax()), 3].tolist()} at [{int(off.argmax())}]"
        raise FormatError("this is no pose", argument=argument, found=found, expected=expected + hint)
    return matching(out, argument, rows)[:, :3, 3], rotations(out[:, :3, :3], argument)


def unit(name: object, argument: str, what: str, *dimensions: str) -> str:
    """The name of a unit. Raises FormatError for none, or for one of another dimension."""
    good = [n for n, u in UNITS.items() if u.si in dimensions]
    if not isinstance(name, str) or name not in good:
        word = f"not a unit of {what}" if name in UNITS else f"unknown unit of {what}"
        near = nearest(name, good) if isinstance(name, str) and name not in UNITS else None
        raise FormatError(word, argument=argument, found=name, expected=", ".join(good), suggestion=near)
    return name
