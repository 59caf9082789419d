"""What `cable require` finds and says: the errors of a calibration that nobody has made yet, and what a smaller error takes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.cables.calibration.per_cable import flat
from robocal.cables.calibration.propagation import ESTIMATORS, WHAT, ErrorPropagation, Expected, Noise, Requirement
from robocal.cables.geometry import CableRobot
from robocal.errors import FormatError, ModelError
from robocal.files.cable.pose_lists import read_platform_poses
from robocal.files.display import in_units, listing_text
from robocal.files.parts import CableDocument
from robocal.files.plain import json_text
from robocal.files.text import InputFile
from robocal.files.units import UNITS, Units, parse_quantity
from robocal.quantities import Column, Listing, UnitValue, unit_value
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.report.cable.part import part
from robocal.report.sections import Detail, Section, Text, ends, figure, listing_table, table
from robocal.report.sweep import contours
from robocal.session.cable.cable_result import CableResult
from robocal.session.cable.calibrated import open_robot
from robocal.session.cable.statics_options import robot_inputs

__all__ = ["PAIRS", "Required", "compute_requirement", "require_summary"]

PAIRS = (("length", "position"), ("position", "orientation"), ("length", "orientation"))
AWAY = 5.0  # times what the frame anchors scatter by
SI = {"length": "m", "anchors": "m", "zeros": "m", "position": "m", "orientation": "rad"}
LEVELS = (0.5, 1.0, 2.0)  # of the error that is asked for: lines of equal error


@record(kw_only=True)
class Accuracy:
    """An accuracy that is asked for, whether it is reached, and what takes it there: all noises times `scale`, one of them alone, or so
    many poses."""

    of: str
    value: float | None
    unit: str
    reached: bool
    scale: float
    alone: dict[str, UnitValue | None]
    poses: Any


@record(kw_only=True)
class RequireDocument(CableDocument):
    """require.json."""

    poses: int
    noise: dict[str, UnitValue]
    estimator: str
    expected: dict[str, dict[str, UnitValue]]
    sigma: Listing
    accuracy: Accuracy | None


@record(kw_only=True, eq=False)
class Required(CableResult):
    """A requirement with the accuracy (m or rad) of `of` that is asked for."""

    requirement: Requirement
    of: str
    accuracy: float | None

    title: ClassVar[str] = "what a calibration needs"

    @cached_property
    def trusted(self) -> bool:
        """Whether the accuracy is reached as things are."""
        return self.accuracy is None or self.requirement.scale(self.of, self.accuracy) >= 1.0

    @cached_property
    def errors(self) -> dict[str, Expected]:
        """The errors to be expected of each estimator."""
        return {name: replace(self.requirement, estimator=name).rms_errors for name in ESTIMATORS}

    @cached_property
    def sigma(self) -> Array:
        """One standard deviation of what is sought of every cable, its zero last, (m, k) in m."""
        m = len(self.robot.cables)
        return np.sqrt(np.diag(self.requirement.covariance)).reshape(m, -1)

    @cached_property
    def needs(self) -> dict[str, Any] | None:
        """What the accuracy takes: all noises times `scale`, one of them alone, or so many poses."""
        if self.accuracy is None:
            return None
        r = self.requirement
        return {
            "scale": r.scale(self.of, self.accuracy),
            "alone": r.alone(self.of, self.accuracy),
            "poses": r.poses(self.of, self.accuracy),
        }

    @cached_property
    def curves(self) -> dict[tuple[str, str], list[tuple[float, Array]]]:
        """Lines of equal error, every cable by itself, for the pairs of noises of which both are there: errors and (n, 2)."""
        r = self.requirement
        middle = self.accuracy or float(getattr(self.errors["per-cable"], self.of))
        there = [p for p in PAIRS if all(getattr(r.noise, name) for name in p)]
        return {p: [(f * middle, r.contour(self.of, f * middle, p)) for f in LEVELS] for p in there}

    @property
    def lines(self) -> Listing:
        """The same as rows, in SI."""
        rows = [
            (level, one, a, two, b)
            for (one, two), curves in self.curves.items()
            for level, curve in curves
            for a, b in curve.tolist()
        ]
        heads = (("error", SI[self.of]), ("first noise", ""), ("first", "SI"), ("second noise", ""), ("second", "SI"))
        values = list(zip(*rows, strict=True)) or [()] * len(heads)
        return Listing(tuple(Column(n, u, v, digits=9) for (n, u), v in zip(heads, values, strict=True)))

    @property
    def sigmas(self) -> Listing:
        """One row per cable: one standard deviation of what is sought of it."""
        names = [*(f"a{'xyz'[i]}" for i in self.requirement.design.axes), "l0"]
        columns = (Column(n, "m", v) for n, v in zip(names, self.sigma.T, strict=True))
        return Listing((Column("cable", "", self.robot.cables), *columns))

    @property
    def document(self) -> RequireDocument:
        """What --json says."""
        r = self.requirement
        expected = {name: _in_units(errors, WHAT) for name, errors in self.errors.items()}
        noise = _in_units(r.noise, NOISES)
        accuracy = None if self.needs is None else self._accuracy(self.needs)
        return self.document_of(
            RequireDocument, poses=len(r.design.poses), noise=noise, estimator=r.estimator, expected=expected,
            sigma=self.sigmas, accuracy=accuracy,
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The document, and lines of equal error."""
        return {"require.json": json_text(self.document), "contours.csv": listing_text(self.lines)}

    def _accuracy(self, needed: dict[str, Any]) -> Accuracy:
        """A noise that hardly counts is left out of `alone`; null there is one that alone cannot do it."""
        alone = {k: unit_value(v, SI[k]) for k, v in needed["alone"].items() if v is None or np.isfinite(v)}
        return Accuracy(
            of=self.of, value=self.accuracy, unit=SI[self.of], reached=self.trusted, **(needed | {"alone": alone})
        )

    def details(self) -> Iterator[Section]:
        """Cable by cable, lines of equal error, and how it was worked out."""
        said = (
            f"One standard deviation of what {self.requirement.estimator} finds, in mm: the components of the frame anchor (ax, ay, az), "
            "and the zero of the length (l0)."
        )
        listed = listing_table(in_units(self.sigmas, Units()))
        yield Section.of("Cable by cable", Text.of(said), listed, folded=True)
        for k, ((one, two), curves) in enumerate(self.curves.items()):
            drawn = [(_with_unit(v, self.of), c * [1 / SHOWN[one].factor, 1 / SHOWN[two].factor]) for v, c in curves]
            axes = (f"{NOISES[one]} [{SHOWN[one].name}]", f"{NOISES[two]} [{SHOWN[two].name}]")
            text = (
                "With noises on a line, every cable fitted by itself and nothing else in error, the rms error of "
                f"{SENTENCE[self.of]} is what stands on it."
            )
            heading = f"Noise of {NOISES[one]} and of {NOISES[two]}"
            yield part(heading, text, contours(drawn, axes, text, f"{one}-{two}"), folded=k > 0)
        yield self.method_part(
            "To first order in the noise, around the robot as its file has it; straight cables. It holds while the noise is small against "
            "the spread of the poses."
        )


def _in_units(numbers: object, names: Iterable[str]) -> dict[str, UnitValue]:
    return {name: UnitValue(getattr(numbers, name), SI[name]) for name in names}


def compute_requirement(o: Any, command: str = "") -> Required:
    """The requirement by the options of the verb. Raises InputError."""
    file = open_robot(o.robot)
    rows = read_platform_poses(o.poses, file.robot)

    def in_si(option: str, what: str) -> float | None:
        text = getattr(o, option)
        return None if text is None else parse_quantity(text, SI[what], key="--" + option.replace("_", "-"))

    named = {"length": "sigma", "position": "sigma_position", "orientation": "sigma_orientation"}
    noise = Noise(**{what: in_si(option, what) or 0.0 for what, option in named.items()})
    if noise.orientation and max(file.robot.axes) < 3:
        found, expected = o.sigma_orientation, f"none: it is {file.robot.degrees}"
        raise ModelError("this platform does not turn", key="--sigma-orientation", found=found, expected=expected)
    accuracy = in_si("accuracy", o.of)
    least = sum(i < 3 for i in file.robot.axes) + 1
    if len(rows.values) < least:
        few = "too few poses for the anchor and the zero of a cable"
        raise FormatError(few, file=o.poses, found=len(rows.values), expected=f"{least} or more")
    requirement = Requirement(ErrorPropagation(file.robot, rows.values), noise, o.estimator)
    try:
        error = getattr(requirement.rms_errors, o.of)
    except ModelError as bad:
        raise bad.of_file(o.poses, row=None) from None
    if not np.isfinite(error):
        raise FormatError(
            f"no {o.of} follows from the lengths of this robot: fewer cables than degrees of freedom", file=file.path, key="cables",
            found=f"{len(file.robot.cables)} cables for {len(file.robot.axes)} degrees of freedom", expected="--of anchors or --of zeros",
        )  # fmt: skip
    return Required(
        file=file, requirement=requirement, of=o.of, accuracy=accuracy,
        warnings=(*file.warnings, *rows.warnings, *_spread(file.robot, rows.values)),
        inputs=(*robot_inputs(file, o.robot), InputFile(Path(o.poses), rows.sha256)), command=command,
    )  # fmt: skip


def _spread(robot: CableRobot, poses: Array) -> Iterator[Remark]:
    """What is to be said of a list that tells no anchor from its mirror image, and of one that is not about this robot."""
    axes = [i for i in robot.axes if i < 3]
    shapes = [flat(poses[:, :3, 3] + poses[:, :3, :3] @ b, axes) for b in robot.b]
    mirrored = tuple(c for c, s in zip(robot.cables, shapes, strict=True) if s is not None)
    if mirrored:
        shape = next(s for s in shapes if s is not None)
        yield Remark.of(Code.MIRROR_IMAGE, cables=mirrored, shape=shape)
    size = float(np.linalg.norm(robot.a.std(axis=0)))
    away = float(np.median(np.linalg.norm(poses[:, :3, 3] - robot.home[:3, 3], axis=1)))
    if away > AWAY * size:
        yield Remark.of(Code.POSES_AWAY, away=Quantity(away), size=Quantity(size))


NOISES = {"length": "lengths", "position": "positions", "orientation": "orientations"}
SHOWN = {what: UNITS["deg" if si == "rad" else "mm"] for what, si in SI.items()}
SENTENCE = {
    "anchors": "a component of a frame anchor",
    "zeros": "a zero",
    "position": "the platform's position afterwards",
    "orientation": "the platform's orientation afterwards",
}


def _with_unit(value: float, what: str) -> str:
    return f"{figure(SHOWN[what].from_si(value))} {SHOWN[what].name}"


def require_summary(made: Required, written: tuple[Path, ...]) -> Iterator[Section]:
    """The errors of both estimators, and what the accuracy takes."""
    r = made.requirement
    noises = ((name, getattr(r.noise, name)) for name in NOISES)
    noise = ", ".join(f"{NOISES[name]} {_with_unit(value, name)}" for name, value in noises if value)
    head = f"   {len(r.design.poses)} poses; standard deviations: {noise}"
    yield Section.of("", Text.of((made.robot.name, "strong"), head), Detail(lambda: [_answer(made)]))
    rows = [(name, *(figure(SHOWN[w].from_si(getattr(e, w))) for w in WHAT)) for name, e in made.errors.items()]
    columns = ("expected error, rms", "anchors [mm]", "zeros [mm]", "position [mm]", "orientation [deg]")
    yield Section.of("", table(*columns, right=(1, 2, 3, 4), rows=rows))
    if made.needs is not None and made.accuracy is not None:
        yield Section.of("", *map(Text.of, _requirement_lines(made, made.accuracy, made.needs)))
    yield from ends(made.remarks, written)


def _answer(made: Required) -> Detail:
    """What a page says first."""
    r, error = made.requirement, getattr(made.errors[made.requirement.estimator], made.of)
    wanted = "how well" if made.accuracy is None else f"whether within {_with_unit(made.accuracy, made.of)} rms"
    asked = f"{wanted} {SENTENCE[made.of]} is known after a calibration from {len(r.design.poses)} poses"
    found = f"{_with_unit(error, made.of)} rms is expected"
    after = f"measure these poses, then robocal identify {made.place} LENGTHS POSES"
    if made.needs is not None:
        found += f": {'enough' if made.trusted else 'too much'}. {made.needs['poses']} poses like these would do"
        after = after if made.trusted else "one of the ways below"
    return made.answer(("Asked", asked), ("Found", found), ("Next", after))


def _requirement_lines(made: Required, accuracy: float, needs: dict[str, Any]) -> Iterator[str]:
    wanted, state = _with_unit(accuracy, made.of), "is reached" if made.trusted else "is not reached"
    yield f"{wanted} rms of {SENTENCE[made.of]} ({made.requirement.estimator}) {state}. Any one of these meets it exactly:"
    yield f"  all noises times {figure(needs['scale'])}"
    for name, value in needs["alone"].items():
        if value is None:
            yield f"  better {NOISES[name]} alone cannot: the other noises are too large"
        elif value == float("inf"):
            yield f"  {NOISES[name]} hardly count"
        else:
            yield f"  {NOISES[name]} to {_with_unit(value, name)}"
    yield f"  {needs['poses']} poses like these"
