"""From names on a command line to a machine and data that belong together, or to a calibration: opened, and chosen from for one run."""

from __future__ import annotations

import os
from collections.abc import Callable, Container, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from robocal._record import record, replace
from robocal.errors import FormatError, InputError, ModelError, nearest
from robocal.files.covariance import COVARIANCE, Knowledge
from robocal.files.kinds.registry import READERS, reader_of
from robocal.files.opened_file import machine_kind
from robocal.files.runfolder import ROBOTS, Run, open_run
from robocal.files.text import InputFile, read_text
from robocal.files.units import UNITS, finite
from robocal.files.yamlio import load
from robocal.measure.data import DataSet, Frame
from robocal.measure.machine import Model
from robocal.parameters import ParameterTable
from robocal.progress import Watch, tell
from robocal.session.arm import OpenedArm, open_arm, robot_files
from robocal.session.opened import Inputs, Opened, every_frame
from robocal.session.runs import knowledge_of

__all__ = [
    "Calibration", "Inputs", "choose", "open_arm", "open_calibration", "open_machine", "read_inputs",
    "register_machine", "robot_files",
]  # fmt: skip

IDENTIFIED = ("identified", "prior")
O = TypeVar("O", bound=Opened[Any])
Name = str | os.PathLike[str]
Opener = Callable[[Name, str | None, str | None], Opened[Any]]  # from a name and, for a URDF, two links


def _arm(name: Name, base: str | None, tip: str | None) -> Opened[Any]:
    return OpenedArm(open_arm(name, base=base, tip=tip), os.fspath(name))


def _cable(name: Name, base: str | None, tip: str | None) -> Opened[Any]:
    from robocal.session.cable.cable_opened import open_cable

    return open_cable(name)


def _rig(name: Name, base: str | None, tip: str | None) -> Opened[Any]:
    from robocal.session.opened_rig import open_rig

    return open_rig(name)


# How machines are opened, by the `kind` of their files.
OPENERS: dict[str, Opener] = {"arm": _arm, "cable": _cable, "rig": _rig}


def register_machine(kind: str, opener: Opener) -> None:
    """Machines whose file says this `kind` are opened so from now on, by every verb. Raises ModelError for a kind that is there."""
    if OPENERS.setdefault(kind, opener) is not opener:
        raise ModelError("this kind of machine is registered already", key="kind", found=kind, expected="another name")


def open_machine(name: Name, *, base: str | None = None, tip: str | None = None) -> Opened[Any]:
    """A machine from its file, a run folder (the corrected one), or the catalogue of arms. Raises InputError."""
    place = Path(name)
    file = place / ROBOTS[0] if place.is_dir() else place
    return OPENERS.get(machine_kind(file), _arm)(name, base, tip)


def read_inputs(
    robot: Name, data: Sequence[Name], *, base: str | None = None, tip: str | None = None, group: str | None = None,
    exclude: Sequence[str] = (), watch: Watch | None = None, choices: Mapping[str, Any] | None = None,
) -> Inputs:  # fmt: skip
    """Opens a machine and its data files as one data set, without the rows that `exclude` names.

    Raises InputError for whatever is wrong with them, and for `choices` of one run that this machine lacks."""
    tell(watch, "read")
    try:
        opened = open_machine(robot, base=base, tip=tip)
    except FormatError:
        _refuse_other_kind(robot, READERS, "this is a data file, not a robot")
        raise
    opened.refuse(choices or {})
    try:
        return opened.read(data, group=group, exclude=exclude, watch=watch)
    except FormatError:
        for name in data:
            _refuse_other_kind(name, OPENERS, "this is a robot file, not a data file")
        raise


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


# --- what a run folder knows -----------------------------------------------------------------------------------------


@record
class Calibration:
    """A run folder, its machine as identified, what is known of its parameters, and the files that were read."""

    run: Run
    opened: Opened[Any]
    known: Knowledge
    files: tuple[InputFile, ...]

    @property
    def identified(self) -> tuple[str, ...]:
        """The parameters of the machine that the run identified."""
        table = self.opened.machine.table
        return tuple(p.name for p in self.run.result.parameters if p.status in IDENTIFIED and p.name in table)


def open_calibration(place: Path) -> Calibration:
    """Opens a run folder of any machine. Raises InputError where it is none, or does not say how far its parameters may be off."""
    run = open_run(place)
    opened = open_machine(place)
    known = knowledge_of(place, None if opened.arm is None else opened.machine.table)
    own = InputFile(place / COVARIANCE, read_text(place / COVARIANCE).sha256)
    found = Calibration(run, opened, known, (*opened.inputs, own))
    if opened.arm is not None:
        return found
    # The file of another machine may round what was identified, or lack a place for it.
    values = {n: known.values[n] for n in found.identified if n in known.values}
    return replace(found, opened=opened.with_machine(opened.machine.with_values(values)))


# --- what a person chooses for one run ------------------------------------------------------------------------------


def split_names(words: Sequence[str]) -> tuple[str, ...]:
    """Names given one by one or separated by commas."""
    return tuple(w for word in words for part in word.split(",") if (w := part.strip()))


def choose(
    opened: O, data: DataSet, *, free: Sequence[str] = (), fix: Sequence[str] = (), prior: Sequence[str] = ()
) -> tuple[O, DataSet]:
    """The machine and data with other free parameters and priors than their files say. Raises ModelError naming the
    nearest name."""
    if not (free or fix or prior):
        return opened, data  # the same object: what reading has found of this machine stands
    machine, units = opened.machine, opened.units
    table = machine.table
    frames = {f.name: f for o in data.observations for f in every_frame(o)}
    for option, words in (("--free", free), ("--fix", fix)):
        if any(not part.strip() for word in words for part in word.split(",")):
            raise ModelError("a name is missing", key=option, found=",".join(words), expected=_names(table))
    free, fix = split_names(free), split_names(fix)

    def select(words: Sequence[str], option: str) -> set[str]:
        return {n for word in words if word not in frames for n in _select(word, machine, frames, option)}

    if free:
        table = table.with_free(select(free, "--free"))
    table = table.with_free(set(table.free) - select(fix, "--fix"))
    priors: dict[str, float | None] = {}
    for text in prior:
        word, _, number = text.partition("=")
        number = number.strip()
        name = number.lstrip("+-.0123456789eE ")
        sigma, stated = finite(number.removesuffix(name)), UNITS.get(name)
        if sigma is None or sigma <= 0 or (name and stated is None):
            expected = "NAME=SIGMA, above 0, such as length=1.0 or length=2mm"
            raise ModelError("a prior is a standard deviation", key="--prior", found=text, expected=expected)
        if unit := {"length": "m", "angle": "rad"}.get(word.strip()):
            names = tuple(n for n in machine.geometric if n in set(table.free) and table[n].unit == unit)
        else:
            names = _select(word.strip(), machine, frames, "--prior")
        for n in names:
            if stated is not None and stated.si != table[n].unit:
                raise ModelError(
                    "a unit of another kind", key="--prior", found=text, expected=f"a unit of {n} ({table[n].unit})"
                )
            priors[n] = (stated or units.of(table[n].unit)).to_si(sigma)
    fixed, loose = set(fix) & set(frames), set(free) & set(frames)
    data = _frames(data, fixed, loose) if fixed or loose else data
    return opened.with_machine(machine.with_table(table.with_priors(priors))), data


def _select(word: str, chain: Model, frames: Mapping[str, object], option: str) -> tuple[str, ...]:
    """Parameters of the robot that a word selects; a bare symbol speaks of joints only, as in the robot file."""
    names = chain.table.names
    owners, frame = {n.rpartition(".")[0] for n in names}, word.rpartition(".")[0]
    if frame in frames:
        raise ModelError("frames of data files are free or fixed as a whole", key=option, found=word, expected=frame)
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


def _names(table: ParameterTable, *frames: str) -> str:
    """What can be selected, in a few words."""
    symbols = dict.fromkeys(n.rpartition(".")[2] for n in table.names if n.partition(".")[0] not in ("base", "tool"))
    owners = dict.fromkeys(n.rpartition(".")[0] for n in table.names)
    example = next((n for n in table.free), table.names[0])
    return f"a parameter ({example}), a symbol ({', '.join(symbols)}), or all of {', '.join((*owners, *frames))}"


def _frames(data: DataSet, fixed: set[str], loose: set[str]) -> DataSet:
    """The data with some frames held or freed; of a place, what its kind can see is freed."""
    out = []
    for obs in data.observations:
        sees = reader_of(obs.kind).free

        def set_free(frame: Frame, flags: tuple[bool, ...] = (True,) * 6) -> Frame:
            if frame.name in loose:
                return replace(frame, free=flags)
            return replace(frame, free=(False,) * 6) if frame.name in fixed else frame

        options = dict(obs.options)
        for key, value in obs.options.items():
            if isinstance(value, Frame):
                options[key] = set_free(value, sees)
            elif isinstance(value, tuple) and all(isinstance(v, Frame) for v in value):
                options[key] = tuple(set_free(v, sees) for v in value)
        frame = None if obs.frame is None else set_free(obs.frame)
        out.append(replace(obs, frame=frame, targets=tuple(map(set_free, obs.targets)), options=options))
    return DataSet(data.configurations, tuple(out))
