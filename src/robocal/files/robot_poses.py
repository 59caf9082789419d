"""Poses of a robot's flange as its maker writes them: a CSV, or a folder with a YAML file for each pose.

    ur       x y z, rx ry rz       rotation vector                           m, rad
    kuka     X Y Z, A B C          R = Rz(A) Ry(B) Rx(C)                     mm, deg
    abb      x y z, q1 q2 q3 q4    quaternion, scalar first                  mm
    fanuc    X Y Z, W P R          R = Rz(R) Ry(P) Rx(W)                     mm, deg

Without a maker the headers say it: qx qy qz qw, a matrix T_00 to T_33, or what `euler` says: ZYX turns about the axes as turned so far,
zyx about the fixed ones. A unit in a header counts first. Sources: manuals of these makers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools
from robocal.errors import ModelError
from robocal.files import orientation
from robocal.files.csvtable import read_csv
from robocal.files.robot_pose_source import FolderSource, TableSource, read_times
from robocal.files.text import InputFile
from robocal.files.units import UNITS, Unit, parse_unit
from robocal.geometry import se3, so3

__all__ = ["MAKERS", "RobotPoses", "read_robot_poses", "stated_units"]

PLACES = (("x", "y", "z"), ("px", "py", "pz"), ("tx", "ty", "tz"))
ANGLES = (("rx", "ry", "rz"), ("roll", "pitch", "yaw"), ("a", "b", "c"), ("w", "p", "r"))
QUATERNION, WXYZ = ("qx", "qy", "qz", "qw"), ("q1", "q2", "q3", "q4")
UNIT_LENGTH = 2e-2  # tolerance: of a quaternion: three digits of each number
ROTATION = 2e-2  # tolerance: of the rows of a rotation matrix, the same


@record
class Maker:
    """How a maker writes an orientation, and the units of its pendant."""

    form: str
    columns: tuple[str, ...]
    length: str
    angle: str = "rad"
    order: str = ""
    intrinsic: bool = True


MAKERS: Mapping[str, Maker] = MappingProxyType({
    "ur": Maker("rotation_vector", ("rx", "ry", "rz"), "m", "rad"),
    "kuka": Maker("euler", ("a", "b", "c"), "mm", "deg", "ZYX"),
    "abb": Maker("quaternion_wxyz", WXYZ, "mm"),
    "fanuc": Maker("euler", ("w", "p", "r"), "mm", "deg", "XYZ", False),
})  # fmt: skip


@record(eq=False)
class RobotPoses:
    """Poses T_base_flange (m, 4, 4) in SI; name and time (s, or None) of each; `notation`: how the numbers were read; `numbers` (m, k),
    `columns` and `form` of their orientations as they stand in the file, angles in rad, with the `order` of these; `clock`: the unit of
    times that a header states; `length`: the unit of places."""

    names: tuple[str, ...] | None
    times: Array | None
    pose: Array
    notation: str
    form: str
    numbers: Array
    files: tuple[InputFile, ...]
    clock: str = ""
    columns: tuple[str, ...] = ()
    order: str = ""
    length: str = ""

    def __len__(self) -> int:
        return len(self.pose)

    def turns(self, numbers: Array) -> Array:
        """R (m, 3, 3) of other numbers (m, k) in these columns: angles in rad, quaternions of any length."""
        if self.form == "euler":
            return orientation.euler(numbers, self.order.upper(), intrinsic=self.order.isupper())
        if self.form == "rotation_vector":
            return so3.exp(numbers)
        q = numbers / np.linalg.norm(numbers, axis=1, keepdims=True)
        return orientation.quaternion(q[:, [1, 2, 3, 0]] if self.form.endswith("wxyz") else q)


def read_robot_poses(
    place: Path,
    *,
    maker: str | None = None,
    euler: str | None = None,
    units: str | None = None,
    quaternion: str | None = None,
    vector: bool = False,
    option: str = "--units",
) -> RobotPoses:
    """Reads poses; `maker` of MAKERS, `euler` an order of axes, `units` as "mm,deg" in place of what headers say, `quaternion`: xyzw or
    wxyz, in place of what they mean; `vector`: three angles are a rotation vector; `option`
    states units, if any does. Raises FileError, FormatError, ModelError."""
    if maker is not None and euler is not None:
        raise ModelError("the maker says how angles turn", key="--euler", found=euler, expected="--maker or --euler")
    if euler is not None and (
        len(euler) != 3 or set(euler.upper()) - set("XYZ") or euler not in (euler.upper(), euler.lower())
    ):
        expected = "three axes: ZYX about the axes as turned so far, zyx about the fixed ones"
        raise ModelError("no order of three axes", key="--euler", found=euler, expected=expected)
    source = FolderSource.read(place) if place.is_dir() else TableSource(replace(read_csv(place), alone=True))
    length, angle = stated_units(units)
    return _Reader(
        source, MAKERS.get(maker or ""), maker or "", euler, length, angle, quaternion, vector, option
    ).read()


def stated_units(units: str | None) -> tuple[Unit | None, Unit | None]:
    """The units of length and angle of an option such as mm,deg. Raises ModelError."""
    found: dict[str, Unit] = {}
    for word in (units or "").split(","):
        if word.strip():
            unit = parse_unit(word.strip(), key="--units")
            if unit.si not in ("m", "rad") or unit.si in found:
                raise ModelError("not the units of a pose", key="--units", found=units, expected="mm,deg or m,rad")
            found[unit.si] = unit
    return found.get("m"), found.get("rad")


Turns = tuple[Array, Array, str, str, Sequence[str], str]
"""R (m, 3, 3), the numbers as they stand, their form, how they were read, the columns, and the order of angles."""

# --- how they are read ------------------------------------------------------------------------------------------------


@record(eq=False)
class _Reader:
    source: TableSource | FolderSource
    maker: Maker | None
    name: str
    euler: str | None
    length: Unit | None
    angle: Unit | None
    order: str | None
    vector: bool
    option: str

    def read(self) -> RobotPoses:
        source = self.source
        prefixes = source.matrices if self.maker is None and self.euler is None else []
        whole = [p for p in prefixes if source.has(f"{p}_03")]
        if len(whole) > 1:
            raise source.fail("several columns could be the pose", found=", ".join(whole), expected="one matrix")
        if whole:
            place = tuple(f"{whole[0]}_{i}3" for i in range(3))
        else:
            place = self._columns(PLACES, "the position", "x [mm], y [mm], z [mm]")
        t, length = self._lengths(place)
        turn, numbers, form, said, names, order = self._matrix(whole[0]) if whole else self._turns()
        words = f"{', '.join(place)} in {length.name}; {said}"
        times, clock = read_times(source)
        pose = se3.compose(turn, t)
        files, columns = source.files, tuple(names)
        return RobotPoses(source.names, times, pose, words, form, numbers, files, clock, columns, order, length.name)

    def _columns(self, options: Sequence[Sequence[str]], what: str, expected: str) -> tuple[str, ...]:
        for names in options:
            if all(map(self.source.has, names)):
                return tuple(names)
        raise self.source.fail(
            f"there are no columns for {what}", found=", ".join(self.source.columns), expected=expected
        )

    def _lengths(self, names: Sequence[str]) -> tuple[Array, Unit]:
        return self._in_si(names, "m", self.length, self.maker.length if self.maker else "m")

    def _in_si(self, names: Sequence[str], si: str, given: Unit | None, usual: str) -> tuple[Array, Unit]:
        heads = [None if given is not None else self.source.unit(n) for n in names]
        units = [
            given or UNITS[usual] if h is None else parse_unit(h, si, file=self.source.path, column=n)
            for h, n in zip(heads, names, strict=True)
        ]
        return self.source.numbers(names) * np.array([u.factor for u in units]), units[0]

    def _turns(self) -> Turns:
        source, maker = self.source, self.maker
        if maker is None and self.euler is None:
            if all(map(source.has, QUATERNION)):
                return self._quaternion(QUATERNION, self.order or "xyzw")
            if self.order is not None and all(map(source.has, WXYZ)):
                return self._quaternion(WXYZ, self.order)
            known = next((n for n in ANGLES if all(map(source.has, n))), None)
            if known is not None and self.vector and known == ANGLES[0]:
                return self._angles(known, "rotation_vector", "", True, "rad")
            if known is not None or all(map(source.has, WXYZ)):
                found = ", ".join(known or WXYZ)
                expected = f"--maker {', '.join(MAKERS)}; or --euler ZYX of three angles"
                raise source.fail(
                    "these columns of an orientation have several meanings", found=found, expected=expected
                )
            expected = "qx, qy, qz, qw; T_00 to T_33; or columns of a maker with --maker"
            raise source.fail(
                "there are no columns for the orientation", found=", ".join(source.columns), expected=expected
            )
        if maker is None:
            names = self._columns(ANGLES, "the three angles", "rx, ry, rz")
            order = str(self.euler)
            return self._angles(names, "euler", order.upper(), order.isupper(), "rad")
        names = self._columns((maker.columns, *((QUATERNION,) if maker.form == "quaternion_wxyz" else ())), "the orientation",
                              f"{', '.join(maker.columns)}, as {self.name} writes them")  # fmt: skip
        if maker.form == "quaternion_wxyz":
            return self._quaternion(names, self.order or ("xyzw" if names == QUATERNION else "wxyz"))
        return self._angles(names, maker.form, maker.order, maker.intrinsic, maker.angle)

    def _angles(self, names: Sequence[str], form: str, order: str, intrinsic: bool, usual: str) -> Turns:
        angles, unit = self._in_si(names, "rad", self.angle, usual)
        most = float(np.median(np.abs(angles).max(axis=1)))
        if most > 2 * np.pi:
            large = [n for n, v in zip(names, np.median(np.abs(angles), axis=0), strict=True) if v > 2 * np.pi]
            header = f"{', '.join(f'{n} [deg]' for n in large or names)} in the header"
            mend = f"{self.option} mm,deg, or {header}" if self.option and not 0 < len(large) < 3 else header
            expected = mend if unit.name == "rad" else "angles of one turn at most"
            found = f"{np.degrees(most):.4g} deg in the median, read in {unit.name}"
            raise self.source.fail("orientations of more than a whole turn", found=found, expected=expected)
        if form == "rotation_vector":
            return so3.exp(angles), angles, form, f"rotation vector {', '.join(names)} in {unit.name}", names, ""
        turn = orientation.euler(angles, order, intrinsic=intrinsic)
        about = "the axes as turned so far" if intrinsic else "the fixed axes"
        words = f"angles {', '.join(names)} in {unit.name}, about {', '.join(order.lower())} in turn, {about}"
        return turn, angles, form, words, names, order if intrinsic else order.lower()

    def _quaternion(self, names: Sequence[str], order: str) -> Turns:
        numbers = self.source.numbers(names)
        size = np.linalg.norm(numbers, axis=1)
        self._insist(np.abs(size - 1) < UNIT_LENGTH, "not a unit quaternion", size, "a length of 1")
        q = (numbers if order == "xyzw" else numbers[:, [1, 2, 3, 0]]) / size[:, None]
        words = f"quaternion {', '.join(names)}, the scalar {'last' if order == 'xyzw' else 'first'}"
        return orientation.quaternion(q), numbers, f"quaternion_{order}", words, names, ""

    def _matrix(self, prefix: str) -> Turns:
        numbers = self.source.numbers([f"{prefix}_{i}{j}" for i in range(3) for j in range(3)])
        r = numbers.reshape(-1, 3, 3)
        off = np.abs(r @ np.swapaxes(r, 1, 2) - np.eye(3)).max(axis=(1, 2))
        self._insist(off < ROTATION, "not a rotation matrix", off, "orthogonal rows of length 1, written row by row")
        determinant = np.linalg.det(r)
        self._insist(determinant > 0, "a reflection, not a rotation", determinant, "a determinant of +1")
        return so3.project(r), numbers, "matrix", f"matrix {prefix}_00 to {prefix}_22, row by row", (), ""

    def _insist(self, good: Bools, message: str, found: Array, expected: str) -> None:
        bad = np.flatnonzero(~good)
        if len(bad):
            raise self.source.fail(message, int(bad[0]), found=float(f"{found[bad[0]]:.4g}"), expected=expected)
