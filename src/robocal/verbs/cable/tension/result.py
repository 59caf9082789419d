"""What `cable tension` finds, lists, remarks on and doubts, and its page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.cables.geometry import CableRobot
from robocal.cables.statics import gravity_wrench, structure_of
from robocal.cables.tension import Distribution, capacity_margin, distribute
from robocal.cables.tension_choice import POWER
from robocal.errors import FormatError, ModelError
from robocal.files.cable.pose_lists import WRENCH, CableList, pose_columns, read_platform_poses, tension_columns
from robocal.files.display import in_units, listing_text
from robocal.files.parts import CableDocument
from robocal.files.plain import json_text
from robocal.files.text import InputFile
from robocal.quantities import Column, Listing, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.report.cable.part import part
from robocal.report.cable.scene import scene
from robocal.report.cable.scene_rows import SceneRows
from robocal.report.cable.tension_series import tensions
from robocal.report.numbers import significant
from robocal.report.sections import Detail, Section
from robocal.session.cable import statics_options as statics
from robocal.session.cable.cable_result import CableResult
from robocal.session.cable.calibrated import open_robot

__all__ = ["Tensions", "compute_tensions"]

MOMENT = "Nm"
LEANING = np.sin(np.radians(5.0))  # of a cable that leaves a planar robot's plane further than it should
NOTHING = 1e-9  # of the greatest limit: rounding
MOST = 5


def compute_tensions(o: Any, command: str = "") -> Tensions:
    """Tensions with what they hold, margins and missing wrenches, by the options of the verb. Raises InputError."""
    file = open_robot(o.robot)
    si, power = o.si(file.units), POWER if o.power is None else o.power
    able, lever = statics.robot_with_limits(file, si.limits), si.length or 1.0
    weight = statics.mass_of(file, si.payload, si.mass)
    rows = read_platform_poses(o.poses, able)
    structure = _structures(able, rows, o.poses)
    extra = statics.wrench_of(file, o.wrench) + (0.0 if rows.wrench is None else rows.wrench)
    load = (gravity_wrench(rows.values, weight, able.com) + extra)[:, able.axes]
    with statics.name_option({"method": "--method", "power": "--power"}):
        spread = distribute(structure, load, able.need("limits"), o.method, power)
        if o.power is not None and o.method != "p-norm":
            raise ModelError("a power is only for the p-norm", key="power", found=o.power, expected="--method p-norm")
    margin = capacity_margin(structure, load, able.need("limits"), able.lengths_of_rows(lever))
    missing = spread.missing(able.lengths_of_rows(lever))
    said = (*statics.balance_remarks(able, extra), *_leaning(able, rows), *_bare(able, rows.names, spread, margin))
    return Tensions(
        file=file.with_machine(able), names=rows.names, poses=rows.values, spread=spread, margin=margin, missing=missing, power=power,
        length=lever, mass=weight, warnings=(*file.warnings, *rows.warnings, *said),
        reasons=_doubts(able, rows.names, spread, missing),
        inputs=(*statics.robot_inputs(file, o.robot), InputFile(Path(o.poses), rows.sha256)), command=command,
    )  # fmt: skip


def _structures(robot: CableRobot, rows: CableList, poses: str) -> Array:
    """Structure matrices at all poses. Raises FormatError naming the row where a cable has no direction."""
    out = structure_of(robot, rows.values, strict=False)
    bad = ~np.isfinite(out).all(axis=1)
    if bad.any():
        row, cable = (int(v) for v in np.argwhere(bad)[0])
        message = statics.no_direction(robot.cables[cable], rows.names[row])
        raise FormatError(message, file=poses, row=rows.lines[row], key=robot.cables[cable])
    return out


def _doubts(robot: CableRobot, names: tuple[str, ...], spread: Distribution, missing: Array) -> tuple[Remark, ...]:
    """Poses that no tensions hold, and those that this method has none for."""
    lost, left_out = np.flatnonzero(~spread.feasible), np.flatnonzero(spread.feasible & ~spread.has_solution)
    out = [Remark.of(Code.NOT_HELD, pose=names[i], missing=statics.missing_text(robot, missing[i])) for i in lost]
    out += [Remark.of(Code.CLOSED_FORM_LEAVES, pose=names[i]) for i in left_out]
    left = len(out) - MOST
    return (*out[:MOST], Remark.of(Code.AND_MORE, count=left)) if left > 0 else tuple(out)


def _bare(robot: CableRobot, names: tuple[str, ...], spread: Distribution, margin: Array) -> Iterator[Remark]:
    """Poses that are held as they are and in no other way: singular ones, mostly."""
    bare = [names[i] for i in np.flatnonzero(spread.feasible & (margin <= NOTHING * robot.need("limits").max()))]
    if bare:
        more = len(bare) - MOST
        yield Remark.of(Code.NO_MARGIN, poses=tuple(bare[:MOST]), more=more if more > 0 else None)


def _leaning(robot: CableRobot, rows: CableList) -> Iterator[Remark]:
    """Cables that leave the plane of a planar robot: what they pull across it is held by nothing."""
    if not robot.planar:
        return
    across, whole = 2 if robot.plane == "xy" else 1, replace(robot, degrees="3R3T")
    lean = np.abs(structure_of(whole, rows.values, strict=False)[:, across])
    if lean.max(initial=0.0) > LEANING:
        row, cable = (int(v) for v in np.unravel_index(int(np.argmax(lean)), lean.shape))
        angle = Quantity(float(np.arcsin(min(float(lean[row, cable]), 1.0))), "rad")
        where = {"pose": rows.names[row], "cable": robot.cables[cable], "plane": robot.plane}
        yield Remark.of(Code.LEANING, **where, angle=angle)


@record(kw_only=True)
class TensionDocument(CableDocument):
    """tension.json: `length` divides moments in margins; `feasible` poses are held."""

    method: str
    power: float | None
    mass: UnitValue
    length: UnitValue
    feasible: int
    tensions: Listing
    poses: Listing


@record(kw_only=True, eq=False)
class Tensions(CableResult):
    """Tensions of k poses with what they hold: `spread` as `tension.distribute` gives it, in N and N m; capacity
    margins (k,) in N; missing wrenches (k, d) along `robot.axes`; and the poses that are not held as reasons."""

    names: tuple[str, ...]
    poses: Array
    spread: Distribution
    margin: Array
    missing: Array
    power: float
    length: float
    mass: float

    title: ClassVar[str] = "tensions"

    @property
    def axes(self) -> tuple[str, ...]:
        """The components of wrenches, by name."""
        return tuple(WRENCH[i] for i in self.robot.axes)

    @property
    def power_of_sum(self) -> float | None:
        """The power of the sum, of a method that has one."""
        return self.power if self.spread.method == "p-norm" else None

    @property
    def tension_range(self) -> dict[str, Array]:
        """Least, mean and greatest tension of each cable over the poses that have tensions, N, (cables,) each; nothing where none has."""
        t = self.spread.tension[self.spread.has_solution]
        return {"least": t.min(axis=0), "mean": t.mean(axis=0), "greatest": t.max(axis=0)} if len(t) else {}

    @property
    def listing(self) -> Listing:
        """One row per pose: tensions under the names that `cable inverse` and `forward` read, and what is missing; the wrench is for the
        document alone."""
        spread, units = self.spread, ["N" if axis < 3 else MOMENT for axis in self.robot.axes]
        tension = np.where(spread.has_solution[:, None], spread.tension, np.nan)
        missing = np.where(spread.feasible[:, None], np.nan, self.missing)
        wrench = zip(self.axes, units, spread.wrench.T, strict=True)
        return Listing((
            *pose_columns(self.names, self.poses),
            *tension_columns(self.robot, tension),
            Column("feasible", "", spread.feasible),
            Column("margin", "N", self.margin, digits=6),
            *(Column(f"missing.{a}", u, v, digits=6) for a, u, v in zip(self.axes, units, missing.T, strict=True)),
            *(Column(f"wrench.{a}", u, v) for a, u, v in wrench),
        ))  # fmt: skip

    @property
    def printed(self) -> tuple[str, Listing]:
        """The list in the robot file's units, as tensions.csv holds it."""
        shown = in_units(self.listing.without(*(f"wrench.{a}" for a in self.axes)), self.file.units)
        return listing_text(shown), shown

    @property
    def tensions_by_cable(self) -> Listing:
        """One row per cable: its limits, and the tensions that it bears; none where no pose has any."""
        cables, limits, borne = self.robot.cables, self.spread.limits, self.tension_range
        parts = (Column(k, "N", borne.get(k, [None] * len(cables)), label=k) for k in ("least", "mean", "greatest"))
        heads = Column("cable", "", cables, label="tension [N]")
        return Listing((heads, *parts, Column("limits", "N", limits, label="limits", spec="to")))

    @property
    def document(self) -> TensionDocument:
        """What tension.json holds."""
        return self.document_of(
            TensionDocument, method=self.spread.method, power=self.power_of_sum, mass=UnitValue(self.mass, "kg"),
            length=UnitValue(self.length, "m"), feasible=int(self.spread.feasible.sum()), tensions=self.tensions_by_cable,
            poses=self.listing,
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The list, and the document."""
        return {"tensions.csv": self.printed[0], "tension.json": json_text(self.document)}

    @property
    def first_answer(self) -> Detail:
        """What a page says first."""
        held, count, how = self.spread.feasible, len(self.names), METHODS[self.spread.method]
        asked = f"tensions that hold the platform at {count} poses, {significant(self.mass)} kg; of all that do, {how}"
        found = f"{int(held.sum())} of {count} poses are held"
        borne, least = self.tension_range, ""
        if borne:
            low, high = significant(float(borne["least"].min())), significant(float(borne["greatest"].max()))
            found += f", by {low} to {high} N; the limits are {statics.limits_text(self.spread.limits)}"
            floor = borne["greatest"] <= self.spread.limits[:, 0] * (1 + NOTHING)
            idle = [c for c, at in zip(self.robot.cables, floor.tolist(), strict=True) if at]
            if idle and self.spread.method == "norm":
                least = f"{', '.join(idle)} at every pose: no failure, the method pulls no more than it takes"
        lost = (
            ""
            if held.all()
            else f"{int((~held).sum())} poses: within the limits the cables cannot balance the load there"
        )
        after = "less payload, other limits (--limits) or other poses, then this once more" if lost else ""
        after = after or f"robocal cable inverse {self.place} tensions.csv (the lengths of these cables, stretched)"
        worst = int(self.margin.argmin()) if count else 0
        spare = (
            f"{significant(float(self.margin[worst]))} N at {self.names[worst]}. {LEAST}" if count and not lost else ""
        )
        told = (
            ("Asked", asked),
            ("Found", found),
            ("Not held", lost),
            ("At the least limit", least),
            ("Least margin", spare),
        )
        return self.answer(*told, ("Next", after), remarks=self.warnings)

    def details(self) -> Iterator[Section]:
        """What a page has room for: pictures, every pose, how it was worked out."""
        shown = tensions(self.names, self.spread.tension, self.spread.limits, self.robot.cables)
        yield part("What the cables bear", _summary(self.spread), shown)
        yield from _places(self)
        yield part("Pose by pose", _caption(len(self.names)), table=_table(self), folded=True)
        yield self.method_part(_how(self), self.warnings)


ROWS = 500  # rows of the table
METHODS = {
    "norm": "the least sum of squares",
    "mid": "those nearest to the middle of the limits",
    "closed": "the closed form about the middle of the limits",
    "barycentre": "the centre of all that hold the platform, continuous along paths",
    "p-norm": "the least sum of powers",
}
LEAST = "The margin is the size of the smallest disturbance that the cables could not balance."
LACKING = "No tensions within the limits hold the platform here."
MISSING = f"{LACKING} The size of a negative margin is at most what is missing."


def _places(made: Tensions) -> Iterator[Section]:
    """The pose with the least to spare, and the one at which most is missing."""
    spread, margin = made.spread, made.margin
    for chosen, heading, words in (
        (spread.has_solution, "Where the least is left", LEAST),
        (~spread.feasible, "Where most is missing", MISSING),
    ):
        if chosen.any():
            worst = int(np.argmin(np.where(chosen, margin, np.inf)))
            captions = [f"{n}: margin {significant(m)} N" for n, m in zip(made.names, margin.tolist(), strict=True)]
            caption, rows = captions[worst], SceneRows(captions, made.poses, spread.tension, worst)
            pose, pull, ruler = made.poses[worst], spread.tension[worst], made.length_unit
            drawn = scene(made.robot, pose, tension=pull, poses=made.poses, rows=rows, caption=caption, ruler=ruler)
            yield part(heading, f"{caption}. {words}", drawn)


def _summary(spread: Distribution) -> str:
    held, count = int(spread.feasible.sum()), len(spread.feasible)
    text = f"{held} of {count} poses are held within the limits."
    if held < count:
        text += " At the others no tensions within the limits balance the load."
    without = int((spread.feasible & ~spread.has_solution).sum())
    if without:
        text += f" At {without} of those that are held this method leaves the limits, where others do not."
    return f"{text}\n\nOf all tensions that hold the platform these are {METHODS[spread.method]}."


def _caption(count: int) -> str:
    words = "Tensions and margin in N; missing: what would have to be added to what acts on the platform, in N and Nm."
    return words + (f" The first {ROWS} poses; {count - ROWS} more are in tensions.csv." if count > ROWS else "")


def _table(made: Tensions) -> list[list[str]]:
    axes, cables, spread = made.axes, made.robot.cables, made.spread
    lacking = not spread.feasible.all()
    out = [["pose", *cables, "margin", *(f"missing {a}" for a in axes if lacking)]]
    for i, name in enumerate(made.names[:ROWS]):
        pulls = map(significant, spread.tension[i].tolist()) if spread.has_solution[i] else ["\u2013"] * len(cables)
        short = [""] * len(axes) if spread.feasible[i] else map(significant, made.missing[i].tolist())
        out.append([name, *pulls, significant(float(made.margin[i])), *(short if lacking else [])])
    return out


def _how(made: Tensions) -> str:
    method = made.spread.method + (f", power {made.power_of_sum:g}" if made.power_of_sum else "")
    model = "Straight cables" + ("" if made.robot.wheels is None else " over pulleys")
    return (
        f"{model}; method {method}; limits {statics.limits_text(made.spread.limits)}; {significant(made.mass)} kg. "
        f"Of margins, moments are divided by {made.length_unit.short(made.length)}."
    )
