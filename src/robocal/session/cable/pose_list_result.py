"""The verb `cable poses`: a list of poses that can be reached and left again, the program for it, and the poses worth
measuring."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.cables.boundary import statics_along
from robocal.cables.geometry import EXPECTED, CableRobot
from robocal.cables.list_start import Clearance, Start
from robocal.cables.pose_list import (
    LIMITS,
    MotionProgram,
    PoseBox,
    PoseList,
    program,
    reachable_poses,
    restrict_to_feasible,
)
from robocal.cables.tension import check_method
from robocal.cables.workspace import Demand
from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.data_templates import data_templates
from robocal.files.cable.pose_lists import pose_listing, program_listing
from robocal.files.display import in_units, listing_text
from robocal.files.parts import CableDocument
from robocal.files.plain import json_text
from robocal.planning.cable_poses import MeasurementNoise, PoseChoice, choose
from robocal.quantities import Listing, UnitValue, unit_value
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.report.sections import figure
from robocal.session.cable.cable_result import CableResult
from robocal.session.cable.calibrated import open_robot
from robocal.session.cable.start import box_of, clearance_of, examine_start
from robocal.session.cable.statics_options import mass_of, name_option, robot_inputs, robot_with_limits
from robocal.session.watching import Watch, computable

__all__ = ["EXPECTED_OF", "STOPPED_BY", "Listed", "make_list"]

STEPS = 256  # in which a motion is asked whether the platform is held
MOST = 200_000  # grid: waypoints, which take half a minute and a gigabyte
UNSTATED = 1e-3  # m, noise of a length that nobody stated


def make_list(o: Any, tell: Watch, command: str = "") -> Listed:
    """A list of poses by the options of the verb, and those chosen from it. Raises InputError."""
    if o.count * o.steps > MOST:
        found, expected = f"{o.count} poses, {o.steps} steps", f"at most {MOST} in all"
        raise ModelError("too many waypoints", key="--steps", found=found, expected=expected)
    with name_option({"method": "--method"}):
        check_method(o.method)
    if o.wanted is None:
        only = ("sigma", "pose_noise", "encoders_only", "criterion")
        o.refuse(only, "this is for a choice, and nothing is chosen", "--choose N beside it")
    file = open_robot(o.robot)
    si = o.si(file.units)
    able = replace(robot_with_limits(file, si.limits), mass=mass_of(file, si.payload, si.mass))
    clearance, warnings = clearance_of(file, able, si.diameter, o.body, si.relief)
    noise = _noise(file, si.sigma, si.pose_noise, o.encoders_only)
    tell({"stage": "asking the start"})
    with computable(o.robot):
        begin = examine_start(file, able, clearance, o.start)
        z = box_of(able, begin.pose, o, si)
        tell({"stage": "moving towards random poses"})
        demand = Demand(np.array([able.mass]))
        reached = reachable_poses(
            able.a, able.b, o.count, np.random.default_rng(o.seed), feasible=statics_along(able, demand, STEPS),
            start=begin.pose, box=z, margin=o.margin, pulleys=able.pulleys, axes=able.axes, **vars(clearance),
        )  # fmt: skip
        listing = restrict_to_feasible(able, demand, reached, o.steps)
        tell({"stage": "distributing tensions"})
        with name_option({"method": "--method"}):
            made = program(able, listing, o.steps, o.method)
        choice = None
        if o.wanted is not None:
            rng = np.random.default_rng([o.seed, 1])
            with name_option({"criterion": "--criterion", "count": "--choose"}):
                choice = choose(
                    _with_zeros_free(able),
                    listing.poses,
                    o.wanted,
                    noise=noise,
                    criterion=o.criterion,
                    rng=rng,
                    watch=tell,
                )
    if o.output is not None:
        tell({"stage": "report"})
    return Listed(
        file=file.with_machine(able), names=tuple(f"p{i + 1:0{len(str(o.count))}d}" for i in range(o.count)), start=begin, box=z,
        clearance=clearance, listing=listing, program=made, method=o.method, margin=o.margin, seed=o.seed, choice=choice,
        noise_stated=o.sigma is not None,
        warnings=(*file.warnings, *warnings, *_doubts(listing, noise, o, file)), inputs=robot_inputs(file, o.robot), command=command,
    )  # fmt: skip


def _with_zeros_free(robot: CableRobot) -> CableRobot:
    """The robot as it will be identified: where its file frees none of its zeros, the data files to fill in have zeros of their own."""
    table, zeros = robot.table, [f"{c}.l0" for c in robot.cables]
    return (
        robot.with_table(table.with_free({*table.free, *zeros}))
        if table.free and not {*zeros} & {*table.free}
        else robot
    )


def _noise(file: CableFile, sigma: float | None, pose: Array | None, alone: bool) -> MeasurementNoise:
    """Of a length in m, and of a measured pose (2,) in m and rad, or of encoders alone. Raises ModelError."""
    length = UNSTATED if sigma is None else sigma
    if pose is None:
        return MeasurementNoise(length, measured=not alone)
    if alone:
        message, other = "no instrument measures poses", "--encoders-only"
        raise ModelError(message, key="--pose-noise", found=other, expected="one of them")
    if pose.min() < 0:
        found = f"{file.units.length.from_si(float(pose[0])):g},{file.units.angle.from_si(float(pose[1])):g}"
        raise ModelError("a noise is a standard deviation", key="--pose-noise", found=found, expected="0 or more")
    return MeasurementNoise(length, float(pose[0]), float(pose[1]))


def _doubts(listing: PoseList, noise: MeasurementNoise, o: Any, file: CableFile) -> Iterator[Remark]:
    if open_ := int((~listing.contacts.complete).sum()):
        yield Remark.of(Code.MOTIONS_OPEN, count=open_)
    if o.wanted is None:
        return
    if o.sigma is None:
        yield Remark.of(Code.LENGTH_NOISE_ASSUMED)
    if noise.measured and not (noise.position or noise.orientation):
        yield Remark.of(Code.POSES_TAKEN_EXACT)
    if noise.length > EXPECTED:
        unit = file.units.length
        sigma = unit.from_si(noise.length)
        yield Remark.of(Code.NOISE_TEACHES_NOTHING, sigma=sigma, unit=unit.name, expected=Quantity(EXPECTED))


# LIMITS, and the groups of `PoseChoice.expected`, in words.
STOPPED_BY: Mapping[str, str] = MappingProxyType({
    "box": "nothing: the target was reached",
    "statics": "the tension limits",
    "cable-cable": "two cables that would touch",
    "cable-platform": "a cable that would touch the platform",
    "cable-pulley": "an anchor that would reach its pulley",
})  # fmt: skip
WHY_SHORT = (
    "no failure: targets may lie beyond what the robot can do, so that motions end at its limits, where a calibration learns most; each "
    "pose of the list is reached and left again"
)
EXPECTED_OF: Mapping[str, str] = MappingProxyType({
    "a": "frame anchors", "b": "platform anchors", "l0": "zeros of lengths", "position": "platform's position",
})  # fmt: skip


@record(kw_only=True)
class ListStart:
    """X_0, what its cables bear, and the two that are nearest to each other there."""

    T_base_platform: Array
    tension: UnitValue
    margin: UnitValue
    nearest: tuple[str, str] | None
    gap: UnitValue


@record(kw_only=True)
class ListBox:
    """The box Z of random poses: half its sides, half its turns, and where it is centred, seen from X_0."""

    half: UnitValue
    half_turn: UnitValue
    offset: UnitValue


@record(kw_only=True)
class ListNoise:
    """One sigma of a length, and per axis of a measured pose."""

    length: UnitValue
    position: UnitValue
    orientation: UnitValue


@record(kw_only=True)
class ListChoice:
    """The poses worth measuring, and the errors that are expected after a calibration from them, from as many at random, from all."""

    criterion: str
    poses: list[str]
    value: float
    limit: float | None
    parameters: Sequence[str]
    sigma: ListNoise
    expected_rms: dict[str, Any]


@record(kw_only=True)
class ListDocument(CableDocument):
    """list.json."""

    start: ListStart
    box: ListBox
    mu: float
    seed: int
    method: str
    mass: UnitValue | None
    limits: UnitValue | None
    diameter: UnitValue | None
    reached: float
    stopped_by: dict[str, int]
    lengths: str
    steps: int
    poses: Listing
    choice: ListChoice | None


@record(kw_only=True, eq=False)
class Listed(CableResult):
    """A list of poses with its start, the box Z, waypoints, and what was chosen from it."""

    names: tuple[str, ...]
    start: Start
    box: PoseBox
    clearance: Clearance
    listing: PoseList
    program: MotionProgram
    method: str
    margin: float
    seed: int
    choice: PoseChoice | None
    noise_stated: bool

    title: ClassVar[str] = "poses that can be reached"

    @property
    def pose_rows(self) -> Listing:
        """One row per pose, in SI: poses.csv."""
        rank = None if self.choice is None else {int(i): k for k, i in enumerate(self.choice.chosen, start=1)}
        return pose_listing(self.robot, self.names, self.listing, self.program, rank)

    @property
    def limits(self) -> dict[str, int]:
        """How many motions each of LIMITS stopped; `box`: none of them did. Who has no pulleys meets none."""
        there = LIMITS if self.robot.pulleys is not None else LIMITS[:-1]
        return {name: int((self.listing.limit == i).sum()) for i, name in enumerate(there)}

    @property
    def lengths(self) -> str:
        """Which lengths the list holds."""
        return "stretched by the tensions" if self.program.stretched else "geometric"

    @property
    def printed(self) -> tuple[str, Listing]:
        """The list, in the robot file's units."""
        return listing_text(self.pose_rows, self.file.units), in_units(self.pose_rows, self.file.units)

    @property
    def note(self) -> str:
        """One line on the whole list."""
        stopped = ", ".join(f"{STOPPED_BY[name]} {count}" for name, count in self.limits.items() if count)
        return f"{len(self.names)} poses; {self.reached}; motions ended by: {stopped}"

    @property
    def reached(self) -> str:
        """How many targets were reached, in words."""
        return f"{figure(100 * self.listing.reach_share, 2)} % of the targets reached"

    @property
    def why_short(self) -> str:
        """Why motions that end before their targets are no failure; nothing where none does."""
        return WHY_SHORT if self.listing.reach_share < 1 else ""

    @property
    def document(self) -> ListDocument:
        """What list.json holds."""
        start, box, (k, l) = self.start, self.box, self.start.nearest
        begin = ListStart(
            T_base_platform=start.pose, tension=UnitValue(start.tensions.tension[0], "N"), margin=UnitValue(start.margin, "N"),
            nearest=None if k < 0 else (self.robot.cables[k], self.robot.cables[l]), gap=UnitValue(start.gap, "m"),
        )  # fmt: skip
        half, half_turn = UnitValue(box.translation, "m"), UnitValue(box.rotation, "rad")
        return self.document_of(
            ListDocument, start=begin, box=ListBox(half=half, half_turn=half_turn, offset=UnitValue(box.offset, "m")),
            mu=self.margin, seed=self.seed, method=self.method, mass=unit_value(self.robot.mass, "kg"),
            limits=unit_value(self.robot.limits, "N"), diameter=unit_value(self.clearance.diameter, "m"),
            reached=self.listing.reach_share, stopped_by=self.limits, lengths=self.lengths, steps=len(self.program.shares) - 1,
            poses=self.pose_rows, choice=None if self.choice is None else self._choice(self.choice),
        )  # fmt: skip

    def _choice(self, choice: PoseChoice) -> ListChoice:
        units = {"length": "m", "position": "m", "orientation": "rad"}
        return ListChoice(
            criterion=choice.criterion, poses=[self.names[i] for i in choice.chosen], value=choice.design.value, limit=choice.limit,
            parameters=choice.parameters, expected_rms={"unit": "m"} | dict(choice.expected),
            sigma=ListNoise(**{name: UnitValue(getattr(choice.noise, name), unit) for name, unit in units.items()}),
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The list, the program and the document; where poses were chosen, these, their program, and data files to fill in."""
        units, choice = self.file.units, self.choice
        order = np.arange(len(self.names)) if choice is None else choice.chosen
        out: dict[str, str | bytes] = {
            "poses.csv": listing_text(self.pose_rows, units),
            "program.csv": listing_text(program_listing(self.robot, self.names, self.program, order), units),
            "list.json": json_text(self.document),
        }
        if choice is not None:
            out["chosen.csv"] = listing_text(self.pose_rows.without("rank").take(order.tolist()), units)
            noise, ids = choice.noise, [self.names[i] for i in order]
            read = (noise.position or None, noise.orientation or None)
            out |= data_templates(
                self.robot,
                units,
                ids,
                sigma=noise.length if self.noise_stated else None,
                noise=read,
                kind=None if noise.measured else "lengths",
            )
        return out
