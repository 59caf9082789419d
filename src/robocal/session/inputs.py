"""From names on a command line to a robot and data that belong together: opened, joined, their units doubted."""

from __future__ import annotations

import os
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from robocal.arms.chain import Chain
from robocal.errors import FileError, FormatError, InputError, ModelError, nearest
from robocal.files.causes.refusals import data_remarks
from robocal.files.dataset import Reading, read_datasets
from robocal.files.kinds.registry import READERS, reader_of
from robocal.files.opened import Speaks
from robocal.files.robot import Robot, open_robot, render_robot
from robocal.files.runfolder import RESULT, ROBOTS, Run, find_run
from robocal.files.text import InputFile, read_text
from robocal.files.units import parse_unit
from robocal.files.yamlio import load
from robocal.measure.base import kind_of
from robocal.measure.data import DataSet, Frame, Observations
from robocal.measure.machine import Machine
from robocal.parameters import Table
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.watching import Watch, computable

__all__ = ["Inputs", "choose", "open_arm", "read_inputs", "robot_files"]


@dataclass(frozen=True)
class Inputs:
    """A robot and what was measured on it; `files` are all that were read, with their hashes."""

    robot: Robot
    reading: Reading
    files: tuple[InputFile, ...]
    warnings: tuple[Remark, ...]

    @property
    def data(self) -> DataSet:
        """The data set."""
        return self.reading.dataset


def open_arm(name: str | os.PathLike[str], *, base: str | None = None, tip: str | None = None) -> Robot:
    """A robot from a file, a run folder (its calibrated robot), or the catalogue; an existing file or folder wins."""
    place = Path(name)
    run = find_run(place)
    if place.is_dir():
        return _opened(place, run, base, tip)
    arm = _doubted(open_robot(name, base=base, tip=tip), run)
    if place.name == "calibrated.urdf" and run is not None:
        lost = _with_result(arm, run).left_out
        if lost:
            more = Remark.of(Code.RUN_HOLDS_MORE, file=str(place), names=lost, folder=str(place.parent))
            return replace(arm, warnings=(*arm.warnings, more))
    return arm


def _opened(folder: Path, run: Run | None, base: str | None, tip: str | None) -> Robot:
    """The calibrated robot of a folder."""
    calibrated = next((folder / f for f in ROBOTS if (folder / f).is_file()), None)
    if calibrated is None:
        raise FileError("there is no calibrated robot in this folder", file=folder, expected=" or ".join(ROBOTS))
    said = {} if run is None else run.result.provenance.options
    base, tip = (given or (word if isinstance(word := said.get(key), str) else None)
                 for given, key in ((base, "base"), (tip, "tip")))  # fmt: skip
    arm = _doubted(open_robot(calibrated, base=base, tip=tip), run)
    if arm.format != "urdf":
        return arm  # a robot.yaml holds everything that was fitted; a URDF does not
    if run is None:
        return replace(arm, warnings=(*arm.warnings, Remark.of(Code.RESULT_MISSING, folder=str(folder))))
    return _with_result(arm, run)


def _doubted(arm: Robot, run: Run | None) -> Robot:
    return arm if run is None else replace(arm, warnings=(*arm.warnings, *run.doubts))


def _with_result(arm: Robot, run: Run) -> Robot:
    """The robot with every parameter that its run identified: a URDF has no place for a tool or a gain."""
    found, place = run.result, run.folder / RESULT
    # What lies beyond geometry has no place in a URDF at all.
    grown = arm.chain
    if found.beyond:
        from robocal.files.groups import added

        grown = added(grown, [(g.name, g.options) for g in found.beyond])
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
    return (
        (first, InputFile(numbers, read_text(numbers).sha256))
        if robot.format == "urdf" and numbers.is_file()
        else (first,)
    )


def read_inputs(
    robot: str | os.PathLike[str],
    data: Sequence[str | os.PathLike[str]],
    *,
    base: str | None = None,
    tip: str | None = None,
    group: str | None = None,
    exclude: Sequence[str] = (),
    watch: Watch | None = None,
) -> Inputs:
    """Opens a robot and its data files as one data set, without the rows that `exclude` names.

    Raises InputError for whatever is wrong with them, units that
    are mixed up too."""
    if watch:
        watch({"stage": "read"})
    try:
        arm = open_arm(robot, base=base, tip=tip)
    except FormatError:
        _refuse_other_kind(robot, READERS, "this is a data file, not a robot")
        raise

    def reading_for(chain: Chain) -> Reading:
        return read_datasets(data, chain, group=group, exclude=exclude)

    try:
        reading = reading_for(arm.chain)
    except FormatError:
        for name in data:
            _refuse_other_kind(name, ("arm", "cable"), "this is a robot file, not a data file")
        raise
    _one_frame_per_name(reading)
    with computable(robot, *data):
        doubts = data_remarks(arm, reading, lambda chain: reading_for(chain).dataset, watch)
    return Inputs(arm, reading, (*robot_files(arm, robot), *reading.files), (*arm.warnings, *reading.warnings, *doubts))


def _refuse_other_kind(name: str | os.PathLike[str], kinds: Container[object], message: str) -> None:
    """Raises FormatError when a YAML file is one of the other sort: the arguments were mixed up."""
    place = Path(name)
    if place.suffix.lower() not in (".yaml", ".yml") or not place.is_file():
        return
    try:
        kind = load(place).data.get("kind")
    except InputError:
        return
    if isinstance(kind, str) and kind in kinds:
        raise FormatError(message, file=place, key="kind", found=kind, expected="the robot first, then data files")


def _one_frame_per_name(reading: Reading) -> None:
    """Frames named alike in several files are one; files that say different things of it contradict each other."""
    known: dict[str, tuple[object, str]] = {}
    for obs in reading.dataset.observations:
        for frame in every_frame(obs):
            said = (frame.value, frame.free, frame.mount)
            first = known.setdefault(frame.name, (said, obs.source))
            if first[0] != said:
                raise FormatError(
                    "a frame of this name is described differently in another file", file=obs.source, key=frame.name,
                    expected=f"what the data file of {first[1]} says, or another name",
                )  # fmt: skip


# --- what a person chooses for one run ------------------------------------------------------------------------------


def split_words(words: Sequence[str]) -> tuple[str, ...]:
    """Names given one by one or separated by commas."""
    return tuple(w for word in words for part in word.split(",") if (w := part.strip()))


def choose(
    robot: Robot, data: DataSet, *, free: Sequence[str] = (), fix: Sequence[str] = (), prior: Sequence[str] = ()
) -> tuple[Robot, DataSet]:
    """The robot and data with other free parameters and priors than their files say. Raises ModelError naming the
    nearest name."""
    table, data = chosen(robot.chain, robot.units, data, free=free, fix=fix, prior=prior)
    return replace(robot, chain=replace(robot.chain, table=table)), data


def chosen(
    machine: Machine, units: Speaks, data: DataSet, *, free: Sequence[str], fix: Sequence[str], prior: Sequence[str]
) -> tuple[Table, DataSet]:
    """The same of any machine: its table and the data."""
    table = machine.table
    frames = {f.name: f for o in data.observations for f in every_frame(o)}
    for option, words in (("--free", free), ("--fix", fix)):
        if any(not part.strip() for word in words for part in word.split(",")):
            raise ModelError("a name is missing", key=option, found=",".join(words), expected=_names(table))
    free, fix = split_words(free), split_words(fix)
    if free:
        table = table.with_free(
            {n for word in free if word not in frames for n in _select(word, machine, frames, "--free")}
        )
    held = {n for word in fix if word not in frames for n in _select(word, machine, frames, "--fix")}
    table = table.with_free(set(table.free) - held)
    priors: dict[str, float | None] = {}
    for text in prior:
        word, _, number = text.partition("=")
        try:
            sigma = float(number)
        except ValueError:
            sigma = float("nan")
        if not 0 < sigma < float("inf"):
            raise ModelError(
                "a prior is a standard deviation",
                key="--prior",
                found=text,
                expected="NAME=SIGMA, above 0, such as length=1.0",
            )
        unit = {"length": "m", "angle": "rad"}.get(word.strip())
        names = (
            tuple(n for n in machine.geometric if n in set(table.free) and table[n].unit == unit)
            if unit
            else _select(word.strip(), machine, frames, "--prior")
        )
        priors.update({n: units.of(table[n].unit).to_si(sigma) for n in names})
    fixed, loose = set(fix) & set(frames), set(free) & set(frames)
    return table.with_priors(priors), _frames(data, fixed, loose) if fixed or loose else data


def _select(word: str, chain: Machine, frames: Mapping[str, object], option: str) -> tuple[str, ...]:
    """Parameters of the robot that a word selects; a bare symbol speaks of joints only, as in the robot file."""
    names = chain.table.names
    owners = {n.rpartition(".")[0] for n in names}
    if word.rpartition(".")[0] in frames:
        raise ModelError(
            "frames of data files are freed and held as a whole",
            key=option,
            found=word,
            expected=word.rpartition(".")[0],
        )
    try:
        hits = chain.table.match([word])
    except ModelError as error:
        known = {*names, *owners, *(n.rpartition(".")[2] for n in names), *frames}
        near = nearest(word, known)
        expected = None if near else _names(chain.table, *frames)
        raise ModelError(error.message, key=option, found=word, expected=expected, suggestion=near) from None
    if word in owners or word in chain.table:
        return hits
    return tuple(n for n in hits if n.rpartition(".")[0] not in ("base", "home", "tool")) or hits


def _names(table: Table, *frames: str) -> str:
    """What can be selected, in a few words."""
    symbols = dict.fromkeys(n.rpartition(".")[2] for n in table.names if n.partition(".")[0] not in ("base", "tool"))
    owners = dict.fromkeys(n.rpartition(".")[0] for n in table.names)
    example = next((n for n in table.free), table.names[0])
    return f"a parameter ({example}), a symbol ({', '.join(symbols)}), or all of {', '.join((*owners, *frames))}"


def every_frame(obs: Observations) -> tuple[Frame, ...]:
    """The instrument's frame, the targets, and the places and ends of the kind."""
    return (*((obs.frame,) if obs.frame else ()), *obs.targets, *kind_of(obs).frames(obs))


def _frames(data: DataSet, fixed: set[str], loose: set[str]) -> DataSet:
    """The data with some frames held or freed; of a place, what its kind can see is freed."""
    out = []
    for obs in data.observations:
        sees = reader_of(obs.kind).free

        def renewed(frame: Frame, flags: tuple[bool, ...] = (True,) * 6) -> Frame:
            if frame.name in loose:
                return replace(frame, free=flags)
            return replace(frame, free=(False,) * 6) if frame.name in fixed else frame

        options = dict(obs.options)
        for key, value in obs.options.items():
            if isinstance(value, Frame):
                options[key] = renewed(value, sees)
            elif isinstance(value, tuple) and all(isinstance(v, Frame) for v in value):
                options[key] = tuple(renewed(v, sees) for v in value)
        frame = None if obs.frame is None else renewed(obs.frame)
        out.append(replace(obs, frame=frame, targets=tuple(map(renewed, obs.targets)), options=options))
    return DataSet(data.configurations, tuple(out))
