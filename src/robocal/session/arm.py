"""An arm that was opened: from a file, the catalogue, or a run folder, whose result knows what a URDF cannot hold."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Self

from robocal._record import record, replace
from robocal.arms.chain import Chain
from robocal.arms.joint_loads import LOAD_SYMBOLS, load_names, with_loads
from robocal.errors import FileError, FormatError
from robocal.files.causes import data_remarks
from robocal.files.dataset import Reading, read_datasets
from robocal.files.robot import Robot, describe, open_robot, render_robot
from robocal.files.runfolder import RESULT, ROBOTS, Run, find_run
from robocal.files.text import InputFile, read_text
from robocal.files.units import UNITS, Units, parse_unit
from robocal.prove.identify import Identification
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.opened import Data, Inputs, Opened, Rendered, one_frame_per_name, without_half_turns
from robocal.session.prediction import Prediction
from robocal.session.watching import Watch, computable

if TYPE_CHECKING:
    from robocal.session.simulator import Request, Simulator

__all__ = ["OpenedArm", "open_arm", "robot_files"]

LOADS = tuple(f".{s}" for s in LOAD_SYMBOLS)


@record
class OpenedArm(Opened[Chain]):
    """A serial arm."""

    file: Robot
    noun: ClassVar[str] = "arm"
    lacks: ClassVar[tuple[str, ...]] = ()

    @property
    def arm(self) -> Robot:
        """Its file."""
        return self.file

    @property
    def inputs(self) -> tuple[InputFile, ...]:
        """Its file, and of a run folder the numbers too."""
        return robot_files(self.file, self.given)

    def read(
        self, data: Data, *, group: str | None = None, exclude: Sequence[str] = (), watch: Watch | None = None
    ) -> Inputs:
        """Data files as one data set. Raises InputError for whatever is wrong with them, units that are mixed up too."""
        reading_for = partial(read_datasets, data, group=group, exclude=exclude)
        reading = reading_for(self.file.chain)
        one_frame_per_name(reading)
        reading, undone = without_half_turns(self.file.chain, reading)
        opened = self._with_loads(reading)
        with computable(self.given, *data):
            remarks = data_remarks(
                opened.file, reading, lambda chain: without_half_turns(chain, reading_for(chain))[0].dataset, watch
            )
        apart = () if opened is self else (Remark.of(Code.JOINT_LOADS_APART),)
        return opened.inputs_of(reading, *undone, *remarks, *apart)

    def _with_loads(self, reading: Reading) -> Self:
        """The arm with masses and friction to be found, where torques of its joints were read. Raises FormatError for other joints."""
        torques = [o for o in reading.dataset.observations if o.kind == "joint_torque"]
        n = len(self.file.chain.joints)
        for obs in torques:
            found = int(obs.extra["joint"].max()) + 1
            if found != n:
                expected = f"{n}: {', '.join(self.file.chain.joint_names)}"
                raise FormatError(
                    "wrong number of columns", file=obs.source, key="torque.columns", found=found, expected=expected
                )
        if not torques:
            return self
        arm = with_loads(self.file.chain)
        alone = len(torques) == len(reading.dataset.observations)  # of geometry they say nothing
        free = {*(() if alone else arm.table.free), *load_names(arm)}
        return self.with_machine(arm.with_table(arm.table.with_free(free)))

    def simulator(self, request: Request) -> Simulator[Chain]:
        """An arm before an instrument."""
        from robocal.session.simulated_robot import ArmSimulator

        return ArmSimulator(self.file, request)

    def predict(self, rows: Path, absolute: bool) -> Prediction:
        """The tool's poses at joint values."""
        from robocal.session.pose_prediction import predict_poses

        return predict_poses(Path(self.given), self.file, rows, absolute)

    @property
    def yaml(self) -> str:
        """The arm as a robot.yaml; of a URDF, in m and rad."""
        arm = self.file
        return arm.text if arm.format == "yaml" else describe(arm.chain, Units(UNITS["m"], UNITS["rad"]))

    def render(self, found: Identification[Chain]) -> Rendered:
        """Its file with what was identified."""
        return Rendered(*render_robot(self.file, {p.name: p.value for p in found.corrected.table.rows}))


def open_arm(name: str | os.PathLike[str], *, base: str | None = None, tip: str | None = None) -> Robot:
    """A robot from a file, a run folder (its calibrated robot), or the catalogue; an existing file or folder wins."""
    place = Path(name)
    run = find_run(place)
    if place.is_dir():
        return _open_calibrated(place, run, base, tip)
    arm = _add_warnings(open_robot(name, base=base, tip=tip), run)
    if place.name == "calibrated.urdf" and run is not None:
        lost = _with_result(arm, run).left_out
        if lost:
            more = Remark.of(Code.RUN_HOLDS_MORE, file=str(place), names=lost, folder=str(place.parent))
            return replace(arm, warnings=(*arm.warnings, more))
    return arm


def _open_calibrated(folder: Path, run: Run | None, base: str | None, tip: str | None) -> Robot:
    """The calibrated robot of a folder."""
    calibrated = next((folder / f for f in ROBOTS if (folder / f).is_file()), None)
    if calibrated is None:
        raise FileError("there is no calibrated robot in this folder", file=folder, expected=" or ".join(ROBOTS))
    said = {} if run is None else run.result.provenance.options
    base, tip = (given or (word if isinstance(word := said.get(key), str) else None)
                 for given, key in ((base, "base"), (tip, "tip")))  # fmt: skip
    arm = _add_warnings(open_robot(calibrated, base=base, tip=tip), run)
    if run is not None and (loads := _loads_of(run)):
        chain = with_loads(arm.chain)
        arm = replace(arm, chain=chain.with_table(chain.table.with_free(arm.chain.table.free)).with_values(loads))
    if arm.format != "urdf":
        return arm  # a robot.yaml holds all geometry that was fitted; a URDF does not
    if run is None:
        return replace(arm, warnings=(*arm.warnings, Remark.of(Code.RESULT_MISSING, folder=str(folder))))
    return _with_result(arm, run)


def _loads_of(run: Run) -> dict[str, float]:
    """What a run found of masses and friction at joints, SI."""
    return {p.name: p.identified for p in run.result.parameters if p.name.endswith(LOADS) and p.identified is not None}


def _add_warnings(arm: Robot, run: Run | None) -> Robot:
    return arm if run is None else replace(arm, warnings=(*arm.warnings, *run.remarks))


def _with_result(arm: Robot, run: Run) -> Robot:
    """The robot with every parameter that its run identified: a URDF has no place for a tool or a gain."""
    found, place = run.result, run.folder / RESULT
    # What lies beyond geometry has no place in a URDF at all.
    grown = arm.chain
    if found.beyond:
        from robocal.files.group_block import add_groups

        grown = add_groups(grown, [(g.name, g.options) for g in found.beyond])
    arm, table = replace(arm, chain=grown), grown.table
    values = {
        p.name: parse_unit(p.unit, file=place, key=p.name).to_si(p.identified)
        for p in found.parameters
        if p.name in table and p.identified is not None
    }
    _, left_out = render_robot(arm, values)
    return replace(arm, chain=arm.chain.with_values(values), left_out=left_out)


def robot_files(robot: Robot, name: str | os.PathLike[str]) -> tuple[InputFile, ...]:
    """The robot as an input of a run: its file, and of a run folder the numbers too."""
    first = InputFile(robot.path if robot.path is not None else Path(f"catalogue:{name}"), robot.sha256)
    numbers = Path(name) / RESULT
    known = robot.format == "urdf" and numbers.is_file()
    return (first, InputFile(numbers, read_text(numbers).sha256)) if known else (first,)
