"""Arms that a program opens: by name, from a file, or from what it holds itself, a mapping or a table of Denavit-Hartenberg parameters."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robocal._record import record
from robocal._types import Array
from robocal.arms.conventions import CONVENTIONS
from robocal.errors import FormatError, InputError, ModelError, nearest, one_of
from robocal.files.robot import Robot
from robocal.files.scratch import is_scratch, keep_file
from robocal.files.yamlio import mapping_text
from robocal.front import shapes
from robocal.front.arguments import locate_argument, named_arguments
from robocal.remarks.remark import Remark
from robocal.session.inputs import open_arm

__all__ = ["Arm", "path_text", "robot", "robot_file"]

TYPES = {"R": "revolute", "P": "prismatic", "F": "fixed"}
SINGLE = ("angle", "length")  # quantities of a table: one number for each joint


@record
class Arm:
    """A robot as it was opened: its name or file, the links of a URDF, and the model in SI (`model.chain`)."""

    opened: str
    base: str | None
    tip: str | None
    model: Robot

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints from base to tool."""
        return self.model.chain.joint_names

    @property
    def coordinates(self) -> tuple[str, tuple[str, ...]]:
        """What measurements of it are made at, an argument of `rc.measurements`, and the names of its columns."""
        return "joints", self.joints

    def pose(self, joints: ArrayLike) -> Array:
        """Tool poses in base coordinates, (m, 4, 4) in m, at joint values (m, n) in rad or m."""
        n = len(self.joints)
        q = shapes.numbers(joints, "joints", f"(m, {n}) or ({n},)")
        if q.ndim not in (1, 2) or q.shape[-1] != n:
            raise FormatError("wrong shape", argument="joints", found=q.shape, expected=f"(m, {n}) or ({n},)")
        return self.model.chain.pose(q)

    def __repr__(self) -> str:
        free = len(self.model.chain.table.free)
        head = f"{self.model.name}: {len(self.joints)} joints, {self.model.convention}, {free} parameters to identify"
        return "\n".join(
            (head, *(f"  {doubt}" for doubt in warning_sentences(self.model.name, self.opened, self.model.warnings)))
        )


@named_arguments
def robot(
    source: str | os.PathLike[str] | Mapping[str, Any] | ArrayLike,
    *,
    base: str | None = None,
    tip: str | None = None,
    convention: str | None = None,
    columns: Sequence[str] | None = None,
    units: Sequence[str] | None = None,
    types: str | Sequence[str] | None = None,
    name: str | None = None,
) -> Arm:
    """An arm: from the catalogue ("ur10"), a file, a run folder, a mapping, or a table of Denavit-Hartenberg parameters.

    source: a name of the catalogue; a robot.yaml or a URDF (from link `base` to link `tip`); a run folder; a mapping with the keys of
    robot.yaml; or an array (n, 4), a row for each joint.
    The others go with an array. convention: "dh" (standard), "mdh" (modified, Craig), "dh-hayati" and "mdh-hayati", which also have beta
    for parallel axes. columns: what its columns are, such as ("theta", "d", "a", "alpha"). units: of its angles and lengths, ("rad", "m")
    unless given. types: a letter for each joint, R or P, such as "RRPR"; all revolute unless given. name: what reports call the robot.

    Returns an Arm, which `rc.identify` and every other verb take. Raises InputError.
    """
    table = {"convention": convention, "columns": columns, "units": units, "types": types}
    known = next((key for key, value in table.items() if value is not None), None)
    if isinstance(source, str | os.PathLike):
        if known is not None:
            raise ModelError(
                "this goes with an array",
                argument=known,
                found=table[known],
                expected="a table of parameters as source",
            )
        opened = os.fspath(source)
        try:
            return Arm(opened, base, tip, open_arm(opened, base=base, tip=tip))
        except InputError as error:
            locate_argument(error, {"source": opened, "base": base, "tip": tip})
            raise
    if links := next((k for k, v in (("base", base), ("tip", tip)) if v is not None), None):
        raise ModelError("links belong to a URDF", argument=links, expected="a file as source")
    if isinstance(source, Mapping) and "joints" not in source and set(source) <= _symbols():
        columns, source = (
            tuple(source),
            np.column_stack([shapes.numbers(v, f"source[{k!r}]") for k, v in source.items()]),
        )
    if isinstance(source, Mapping):
        if known is not None:
            raise ModelError(
                "this goes with an array",
                argument=known,
                found=table[known],
                expected=f"the key {known} in the mapping",
            )
        if source.get("kind") == "cable" or "frame_anchors" in source:
            raise ModelError(
                "this is a cable robot", argument="source", found="kind: cable", expected="rc.cable.robot(...)"
            )
        made: Mapping[str, Any] = ({"name": name} if name else {}) | dict(source)
    else:
        made = _of_table(source, convention, columns, units, types, name or "robot")
    opened = robot_file(made, "source")
    try:
        return Arm(opened, None, None, open_arm(opened))
    except InputError as error:
        raise without_file(error, "source") from None


def _symbols() -> set[str]:
    return {k.name for c in CONVENTIONS.values() for k in c.keys if k.quantity in SINGLE}


def _of_table(
    source: Any,
    convention: str | None,
    columns: Sequence[str] | None,
    units: Sequence[str] | None,
    types: str | Sequence[str] | None,
    name: str,
) -> dict[str, Any]:
    """The mapping that a table of parameters stands for. Raises InputError for what is missing or does not fit."""
    numbers = _numbers_of(source)
    rules = {n: c for n, c in CONVENTIONS.items() if all(k.quantity in SINGLE for k in c.keys)}
    if convention is None:
        expected = '"dh" (standard) or "mdh" (modified, Craig); "dh-hayati" and "mdh-hayati" for parallel axes'
        raise ModelError("the convention of this table is not stated", argument="convention", expected=expected)
    if convention not in rules:
        raise ModelError(
            "no convention of tables", argument="convention", found=convention, **one_of(convention, rules)
        )
    keys = tuple(k.name for k in rules[convention].keys)
    if columns is None:
        expected = f"the meaning of each column, such as ({', '.join(repr(k) for k in keys)})"
        raise ModelError(
            "the columns of this table are not stated",
            argument="columns",
            found=f"{numbers.shape[1]} columns",
            expected=expected,
        )
    named = (columns,) if isinstance(columns, str) else tuple(columns)
    for word in named:
        if word not in keys:
            raise ModelError(f"no parameter of {convention}", argument="columns", found=word, **one_of(word, keys))
    if len(set(named)) < len(named) or len(named) != numbers.shape[1]:
        found = f"{len(named)} names, {numbers.shape[1]} columns"
        raise ModelError(
            "a name for each column, each once",
            argument="columns",
            found=found,
            expected=f"{numbers.shape[1]} of {', '.join(keys)}",
        )
    angle, length = _two_units(units)
    kinds = _types(types, len(numbers))
    joints = [
        {"name": f"j{i + 1}", "type": kind} | dict(zip(named, row, strict=True))
        for i, (kind, row) in enumerate(zip(kinds, numbers.tolist(), strict=True))
    ]
    return {"name": name, "units": {"length": length, "angle": angle}, "convention": convention, "joints": joints}


def _numbers_of(source: Any) -> Array:
    if not hasattr(source, "__len__") and not hasattr(source, "__array__"):
        expected = "a name of the catalogue, a path, a mapping as robot.yaml, or an array (n, 4)"
        raise ModelError("this names no robot", argument="source", found=type(source).__name__, expected=expected)
    numbers = shapes.numbers(source, "source", "an array (n, 4), a row for each joint")
    if numbers.ndim != 2 or not numbers.size:
        raise FormatError(
            "wrong shape", argument="source", found=numbers.shape, expected="(n, 4), a row for each joint"
        )
    return numbers


def _two_units(units: Sequence[str] | None) -> tuple[str, str]:
    if units is None:
        return "rad", "m"
    if isinstance(units, str) or len(units) != 2:
        expected = '("deg", "mm"): of angles, of lengths'
        raise FormatError("units are said one by one", argument="units", found=units, expected=expected)
    return shapes.unit(units[0], "units[0]", "angles", "rad"), shapes.unit(units[1], "units[1]", "lengths", "m")


def _types(types: str | Sequence[str] | None, n: int) -> list[str]:
    letters = "R" * n if types is None else types
    given = [TYPES.get(str(t).upper(), str(t)) for t in letters]
    for word in given:
        if word not in TYPES.values():
            near = nearest(word, TYPES.values())
            raise ModelError(
                "unknown type of joint",
                argument="types",
                found=word,
                expected="R, P or F for each joint",
                suggestion=near,
            )
    if len(given) != n:
        raise ModelError("a type for each joint", argument="types", found=f"{len(given)} types", expected=f"{n}")
    return given


def warning_sentences(name: str, opened: str, warnings: Sequence[Remark]) -> list[str]:
    """What is odd about a robot, in sentences that name no file which only this program has."""
    if is_scratch(opened):
        warnings = [Remark(w.code, tuple((k, name if k == "file" else v) for k, v in w.items)) for w in warnings]
    return [w.sentence for w in warnings]


def robot_file(made: Mapping[str, Any], argument: str, name: str = "robot") -> str:
    """The path of a file with what a mapping says, as long as the program runs. Raises FormatError for values that no file can hold."""
    try:
        text = mapping_text({"robocal": 1} | dict(made))
    except TypeError as error:
        expected = "numbers, texts, lists, arrays and mappings"
        raise FormatError(
            "a value that no file can hold", argument=argument, found=str(error), expected=expected
        ) from None
    return str(keep_file(f"{name}.yaml", text))


def without_file(error: InputError, argument: str) -> InputError:
    """The same error of what an argument holds: it has keys, but neither file nor line."""
    facts = {k: getattr(error, k) for k in ("key", "found", "expected", "suggestion")}
    return type(error)(error.message, argument=argument, **facts)


def path_text(name: Any) -> str:
    """A path as text. Raises ModelError for anything else."""
    if not isinstance(name, str | os.PathLike):
        expected = "a path, a mapping, or frame_anchors= and platform_anchors="
        raise ModelError("this names no robot", argument="source", found=type(name).__name__, expected=expected)
    return os.fspath(name)
