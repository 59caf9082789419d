"""What `import robocal` gives: robots, measurements from arrays, and their identification.

The same calls as the command line's: arrays become the text of a table that describes itself, and are read, doubted and judged
as a file would be, so that both ways give the same numbers.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robocal.errors import FileError, FormatError, ModelError, nearest
from robocal.files.result import Result
from robocal.files.robot import Robot
from robocal.files.runfolder import obstacle
from robocal.files.text import Held
from robocal.files.units import UNITS
from robocal.jobs.inputs import Watch, open_arm
from robocal.jobs.outcome import Outcome, save
from robocal.verbs import identify as verb
from robocal.verbs.option import Opt, entries

__all__ = ["Arm", "Identified", "Measurements", "identify", "measurements", "robot"]

Array = NDArray[np.float64]
Data = str | os.PathLike[str]
NAME = "measurements"  # what messages call arrays; their rows are counted from 2, as in a table with a header
SHOWN = 12  # parameters in a summary


@dataclass(frozen=True, repr=False)
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

    def pose(self, joints: ArrayLike) -> Array:
        """Tool poses in base coordinates, (m, 4, 4) in m, at joint values (m, n) in rad or m."""
        return self.model.chain.pose(joints)

    def __repr__(self) -> str:
        free = len(self.model.chain.table.free)
        return f"{self.model.name}: {len(self.joints)} joints, {self.model.convention}, {free} parameters to identify"


def robot(name: Data, *, base: str | None = None, tip: str | None = None) -> Arm:
    """A robot from the catalogue ("ur10"), a robot.yaml, a URDF (from link `base` to `tip`) or a run folder.

    Raises InputError.
    """
    return Arm(os.fspath(name), base, tip, open_arm(name, base=base, tip=tip))


@dataclass(frozen=True, repr=False)
class Measurements:
    """Measurements that a program holds, as the text of a table whose headers say units."""

    text: str

    @property
    def file(self) -> Held:
        """The same as a file to read."""
        return Held.of(NAME, self.text)

    def save(self, path: Data) -> Path:
        """Writes the table as a CSV that `robocal identify` reads. Raises FileError where one exists."""
        place = Path(path)
        if place.exists():
            raise FileError("there is a file already", file=place, expected="a new name")
        from robocal.files.writing import write_text

        write_text(place, self.text)
        return place

    def __repr__(self) -> str:
        lines = self.text.splitlines()
        return f"Measurements: {len(lines) - 1} rows of {lines[0]}"


def measurements(
    joints: ArrayLike,
    *,
    position: ArrayLike,
    rotation_vector: ArrayLike | None = None,
    units: tuple[str, str] | tuple[str, str, str] = ("rad", "m"),
    sigma: ArrayLike | None = None,
    turn_sigma: ArrayLike | None = None,
    columns: Mapping[str, ArrayLike] | None = None,
) -> Measurements:
    """Measured positions or poses of the tool at joint values, from arrays or anything that numpy reads as one.

    joints (m, n) in the first of `units`; position (m, 3) in the second; rotation_vector (m, 3), for full poses, in the
    third (rad, unless it is given). sigma is the standard deviation of each coordinate in the unit of the position: a number,
    (3,) or (m, 3); turn_sigma the same of the rotations. `columns` are further ones (m,) by header: "temperature [degC]",
    "group". Raises FormatError for shapes, units or numbers that make no sense.
    """
    q, p = _numbers(joints, "joints"), _numbers(position, "position", 3)
    turn = units[2] if len(units) > 2 else "rad"
    table = {f"q{i + 1} [{_unit(units[0])}]": q[:, i] for i in range(q.shape[1])}
    table |= _three(("x", "y", "z"), p, _unit(units[1], "m"), len(q), "position")
    if sigma is not None:
        table |= _three(("sx", "sy", "sz"), _spread(sigma, len(q), "sigma"), units[1], len(q), "sigma")
    if rotation_vector is not None:
        r = _numbers(rotation_vector, "rotation_vector", 3)
        table |= _three(("rx", "ry", "rz"), r, _unit(turn, "rad"), len(q), "rotation_vector")
        if turn_sigma is not None:
            spread = _spread(turn_sigma, len(q), "turn_sigma")
            table |= _three(("srx", "sry", "srz"), spread, turn, len(q), "turn_sigma")
    elif turn_sigma is not None:
        raise FormatError(
            "rotations that were not given have no sigma", column="turn_sigma", expected="rotation_vector"
        )
    for name, values in (columns or {}).items():
        given = np.asarray(values)
        if given.shape != (len(q),):
            raise FormatError("wrong shape", column=name, found=given.shape, expected=f"({len(q)},)")
        table[name] = given
    return Measurements(_text(table))


def identify(
    robot: Data | Arm,
    data: Data | Measurements | Sequence[Data | Measurements],
    *,
    output: Data | None = None,
    force: bool = False,
    watch: Watch | None = None,
    **options: Any,
) -> Identified:
    """Identifies a robot and proves the gain on configurations that were not fitted, as `robocal identify` does.

    robot: a name of the catalogue, a file, a run folder, or what `robot` gave; data: files, or what `measurements` gave, one or
    several; `output` writes the run folder. `options` are those of the command line (`loss="huber"`, `hold_out=0.3`,
    `free=("theta", "d")`). `watch` is called with events and may raise `Cancelled`. Raises InputError for whatever is wrong.
    """
    told = {e.name: e for e in entries(verb.Options) if isinstance(e.told, Opt)}
    for name in options:
        if name not in told:
            raise ModelError("unknown option", key=name, expected=", ".join(told), suggestion=nearest(name, told))
    given: dict[str, Any] = {k: _several(v) if told[k].several else v for k, v in options.items()}
    if isinstance(robot, Arm):
        given = {"base": robot.base, "tip": robot.tip} | given
    name = robot.opened if isinstance(robot, Arm) else os.fspath(robot)
    several = [data] if isinstance(data, str | os.PathLike | Measurements) else list(data)
    files: Any = tuple(d.file if isinstance(d, Measurements) else d for d in several)
    place = None if output is None else Path(output)
    asked = verb.Options(name, files, output=place, force=force, **given)
    return Identified(verb.run(asked, watch, "robocal.identify(...)").result)


def _several(given: object) -> tuple[Any, ...]:
    """One word, or some."""
    return (given,) if isinstance(given, str) or not isinstance(given, Iterable) else tuple(given)


@dataclass(frozen=True, repr=False)
class Identified:
    """What an identification found, with its evidence; `result` is the document of result.json."""

    outcome: Outcome

    @property
    def result(self) -> Result:
        """The whole result, in mm and deg and the units of the robot file."""
        return self.outcome.result

    @property
    def verdict(self) -> str:
        """improved, not_improved or refused."""
        return str(self.result.verdict.status)

    @property
    def improved(self) -> bool:
        """Whether the corrected model is better in the whole working range: what status 0 of the command line says."""
        return self.outcome.improved

    @property
    def values(self) -> dict[str, float]:
        """The corrected model: every parameter of the robot by name, in m and rad."""
        return {p.name: p.value for p in self.outcome.identification.corrected.table.rows}

    def pose(self, joints: ArrayLike) -> Array:
        """Tool poses of the corrected arm in base coordinates, (m, 4, 4) in m, at joint values (m, n) in rad or m."""
        from robocal.measure.reach import reach

        found = self.outcome.identification
        return reach(found.corrected, np.atleast_2d(np.asarray(joints, float)), (), found.conditions)[0]

    def table(self) -> list[dict[str, Any]]:
        """One row per parameter: name, unit, nominal, identified, delta, sigma, interval, status and what is to be known."""
        shown = ("name", "unit", "nominal", "identified", "delta", "sigma", "interval", "status", "note")
        return [{k: getattr(p, k) for k in shown} for p in self.result.parameters]

    def summary(self) -> str:
        """Verdict, reasons, the errors and the parameters that changed the most against what is known of them."""
        said, errors = self.result.verdict, self.result.residuals
        lines = [
            f"{self.result.robot.name}: {said.status}{f', {said.region}' if said.region else ''}",
            *map(str, said.reasons),
        ]
        for label, part in (("held out, before", errors.held_out_before), ("held out, after", errors.held_out)):
            if part is not None and part.mean is not None:
                lines.append(f"{label}: mean {part.mean:.4g} {errors.unit}, n = {part.n}")
        known = [p for p in self.result.parameters if p.status == "identified" and p.sigma and p.delta is not None]
        known.sort(key=lambda p: -abs((p.delta or 0.0) / (p.sigma or 1.0)))
        lines += [
            f"  {p.name:12s} {p.nominal:.6g} -> {p.identified:.6g} ({p.delta:+.3g} +- {p.sigma:.2g}) {p.unit}"
            for p in known[:SHOWN]
        ]
        if len(known) > SHOWN:
            lines.append(f"  and {len(known) - SHOWN} more: table()")
        return "\n".join(lines)

    def save(self, folder: Data, *, force: bool = False) -> tuple[Path, ...]:
        """Writes the run folder that the other verbs read; one that holds anything but an untouched run only with `force`.
        Raises FileError."""
        place = Path(folder)
        if not force and (there := obstacle(place)):
            raise there
        return save(self.outcome, place).written

    def __repr__(self) -> str:
        return self.summary()


def _unit(name: str, dimension: str | None = None) -> str:
    """The name of a unit. Raises FormatError for none, or for one of another dimension."""
    if name not in UNITS or (dimension is not None and UNITS[name].si != dimension):
        raise FormatError("unknown unit", found=name, expected=", ".join(UNITS), suggestion=nearest(name, UNITS))
    return name


def _numbers(given: ArrayLike, name: str, width: int | None = None) -> Array:
    """Finite numbers (m, width). Raises FormatError."""
    try:
        out = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise FormatError("these are no numbers", column=name, expected="an array (m, n)") from None
    if out.ndim != 2 or (width is not None and out.shape[1] != width):
        raise FormatError("wrong shape", column=name, found=out.shape, expected=f"(m, {width or 'n'})")
    return out


def _spread(given: ArrayLike, rows: int, name: str) -> Array:
    """Standard deviations (m, 3) from a number, (3,) or (m, 3)."""
    try:
        return np.broadcast_to(np.asarray(given, dtype=float), (rows, 3))
    except (TypeError, ValueError):
        raise FormatError(
            "wrong shape", column=name, found=np.shape(given), expected=f"a number, (3,) or ({rows}, 3)"
        ) from None


def _three(names: tuple[str, str, str], values: Array, unit: str, rows: int, what: str) -> dict[str, Array]:
    if len(values) != rows:
        raise FormatError("wrong number of rows", column=what, found=len(values), expected=f"{rows}, as many as joints")
    return {f"{n} [{unit}]": values[:, i] for i, n in enumerate(names)}


def _text(table: Mapping[str, NDArray[Any]]) -> str:
    """The table as CSV, every number with all of its digits."""
    from robocal.files.csvtable import csv_text

    columns = [
        [repr(float(v)) if isinstance(v, float | np.floating) else v for v in c.tolist()] for c in table.values()
    ]
    return csv_text(tuple(table), zip(*columns, strict=True))
