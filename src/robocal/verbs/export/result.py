"""A robot model in the form that the next program wants; of joint offsets, and of any file that cannot hold all that was identified, what
it is worth alone.

Joint offsets are for controllers that take nothing else: the fit of the offsets alone, where its gain is proven; of a robot without a
run folder, the difference of its zeros from the nominal ones. The worth of a file is the mean error of the nominal robot, of the robot
that the file describes, and of the whole model, on the data of the run.

Of each model nothing is fitted but the instruments' frames and what is free of the tool. These are data that the model was
fitted to; where a figure of unseen data is at hand (the joint offsets, which the run proves by themselves) that is told.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record
from robocal.arms.chain import Chain, joint_offsets, with_offsets
from robocal.arms.conventions import convention_of, rows
from robocal.arms.denavit import to_denavit
from robocal.errors import FileError, InputError, ModelError
from robocal.files.csvtext import csv_text
from robocal.files.dataset import read_datasets
from robocal.files.evidence_parts import OffsetsAlone
from robocal.files.offset_file import OFFSETS, Offset
from robocal.files.result import Result
from robocal.files.robot import Robot, describe
from robocal.files.robot_rows import row_numbers
from robocal.files.units import UNITS, number, parse_unit, same
from robocal.files.urdf_into import urdf_into, urdf_text
from robocal.measure.data import DataSet
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.model_errors import Errors, model_errors
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.arm import OpenedArm
from robocal.session.inputs import choose, open_machine
from robocal.session.opened import Opened
from robocal.session.reference import nominal_chain, run_cautions, run_result

__all__ = ["Exported", "export_robot", "parameter_table"]

# What a model lacks that was not read from its run folder, and what nobody can tell of that folder.
LACKING = (Code.RUN_HOLDS_MORE, Code.RESULT_MISSING, Code.RUN_UNRECORDED)
# The parts of a key with several numbers, where they are not x, y and z.
PARTS = {"limits": ("lower", "upper"), "rpy": ("roll", "pitch", "yaw")}


@record
class Exported:
    """The text, and what a person should know of it; `worth` is what the file alone is worth where it cannot hold the whole
    model."""

    text: str
    notes: tuple[Remark, ...] = ()
    worth: Remark | None = None


def export_robot(o: Any) -> Exported:
    """The robot (a file, a catalogue name or a run folder) in another form, by the options of the verb; `into` is a URDF whose origins
    are to say it. Raises InputError, also for a form that cannot hold it."""
    robot, form, into = o.robot, o.form, o.into
    links = {"base": o.base, "tip": o.tip}  # of that URDF, where there is one
    opened = open_machine(robot, **(links if into is None else {}))
    if opened.arm is None:
        return _of_another(opened, o)
    arm = opened.arm
    if form == "mjcf":
        raise ModelError("this form is for cable robots", key="--format", found=form, expected="yaml or urdf")
    notes: tuple[Remark, ...] = ()
    held: Chain | None = None  # the robot that the file describes, where that is not the whole model
    worth: Remark | None = None
    told = tuple(w for w in arm.warnings if w.code in LACKING)
    if form == "yaml":
        text = opened.yaml
    elif form == "urdf":
        if into is not None:
            text, notes = urdf_into(arm.chain, into, **links)
        else:
            text, notes = (arm.text, ()) if arm.format == "urdf" else urdf_text(arm.chain)
        if into is None and arm.format == "urdf" and arm.left_out:
            notes = (Remark.of(Code.URDF_CANNOT_HOLD, names=arm.left_out),)
            before = nominal_chain(robot, arm, o.nominal).table if run_result(robot) else None
            held = arm.chain if before is None else arm.chain.with_values({n: before[n].value for n in arm.left_out})
    elif form == "dh":
        text = describe(to_denavit(arm.chain), arm.units, calibrate=False)
    elif form in OFFSETS:
        text, worth = offset_text(robot, arm, o.nominal, form)
    else:
        text = _table_text(parameter_table(arm), form)
    if form in (*OFFSETS, "csv", "markdown"):
        notes = (*notes, *_beyond(arm.chain))
        if form not in OFFSETS and _beyond(arm.chain):
            names = [p for g in arm.chain.groups for p in g.parameters if not p.endswith(".gain")]
            held = arm.chain.with_values(dict.fromkeys(names, 0.0))  # the same arm without what lies beyond geometry
    if held is not None:
        worth = worth_of(robot, arm, held)
    return Exported(text, (*run_cautions(robot), *told, *notes), worth)


def _of_another(opened: Opened[Any], o: Any) -> Exported:
    """A machine that is no arm in another form. Raises ModelError for a form and for options that are for arms."""
    given = next((n for n in ("into", "nominal", "base", "tip") if getattr(o, n) is not None), None)
    if given is not None:
        found, expected = opened.name, f"nothing, for a {opened.noun}"
        raise ModelError("this option is for arms", key=f"--{given}", found=found, expected=expected)
    made, notes = opened.export(o.form)
    return Exported(made if isinstance(made, str) else _table_text(made, o.form), (*run_cautions(o.robot), *notes))


def _beyond(chain: Chain) -> tuple[Remark, ...]:
    """What a table or offsets leave out of a model with groups beyond geometry; gains stand in the table."""
    left = [g.name for g in chain.groups if any(chain.table[p].value and not p.endswith(".gain") for p in g.parameters)]
    return (Remark.of(Code.BEYOND_LEFT_OUT, groups=tuple(left)),) if left else ()


# --- the parameter table --------------------------------------------------------------------------------------------


def parameter_table(robot: Robot) -> list[list[str]]:
    """Header and rows in the robot's units: one row per joint, then its base and tool; columns are the convention's
    keys."""
    chain, units = robot.chain, robot.units
    rule = convention_of(chain.convention)
    if any(key.quantity == "steps" for key in rule.keys):
        return _parameter_list(robot)
    header: dict[str, str] = {}
    body: list[tuple[str, str, dict[str, str]]] = []
    for i, row in enumerate(rows(chain), start=1):
        cells = {}
        for path, value, unit in row_numbers(row, rule, units):
            parts = PARTS.get(str(path[0]), "xyz")
            name = "_".join((str(path[0]), *(parts[i] if isinstance(i, int) else i for i in path[1:])))
            header.setdefault(name, name if unit.si == "1" else f"{name} [{unit.name}]")
            cells[name] = number(unit.from_si(value))
        body.append((str(row.get("name", f"j{i}")), str(row.get("type", "revolute")), cells))
    for owner in ("base", "home", "tool"):
        if f"{owner}.x" in chain.table:
            cells = {}
            for s in FRAME_SYMBOLS:
                unit = units.of(chain.table[f"{owner}.{s}"].unit)
                header.setdefault(f"frame_{s}", f"frame_{s} [{unit.name}]")
                cells[f"frame_{s}"] = number(unit.from_si(chain.table[f"{owner}.{s}"].value))
            body.append((owner, "frame", cells))
    return [
        ["name", "type", *header.values()],
        *([name, kind, *(cells.get(h, "") for h in header)] for name, kind, cells in body),
    ]


def _parameter_list(robot: Robot) -> list[list[str]]:
    """Every parameter on a row of its own, where rows of joints have no common columns."""
    table = robot.chain.table
    return [
        ["parameter", "value", "unit"],
        *([p.name, number(robot.units.of(p.unit).from_si(p.value)), robot.units.of(p.unit).name] for p in table.rows),
    ]


def _table_text(table: list[list[str]], form: str) -> str:
    """A table as CSV or for people."""
    return csv_text(table[0], table[1:]) if form == "csv" else _markdown(table)


def _markdown(table: list[list[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in table]
    lines.insert(1, "|" + "---|" * len(table[0]))
    return "\n".join(lines) + "\n"


# --- joint offsets, and what a file is worth alone -------------------------------------------------------------------

INSTEAD = "--format yaml or urdf, or robocal compensate"


def offset_text(name: str, robot: Robot, nominal: str | None, form: str) -> tuple[str, Remark]:
    """The offsets of a robot's joints from its nominal model, with their sigma where a run knows it, in a form of
    `OFFSETS`; and what such a file is worth.

    Raises ModelError where a run could not prove that offsets alone gain anything, or where they would say nothing.
    """
    known = run_result(name)
    reference = nominal_chain(name, robot, nominal, whole=True)
    if known is not None and known.verdict.status == "refused":
        why = "; ".join(known.verdict.reasons)
        raise ModelError("the run was refused, so its joint offsets mean nothing", found=why)
    if known is not None and known.offsets is not None and _own(name, robot, reference):
        lines = _proven(known.offsets, robot)
        worth = worth_unseen(known.offsets)
    else:
        lines = _differences(robot, reference)
        held = with_offsets(reference, {o.joint: o.value for o in lines})
        worth = worth_of(name, robot, held, OFFSETS_ONLY, reference)
        nominal_error, alone = worth.numbers.get("nominal"), worth.numbers.get("alone")
        if isinstance(nominal_error, Quantity) and isinstance(alone, Quantity) and alone.value >= nominal_error.value:
            raise ModelError("joint offsets alone would make this robot worse", found=worth.sentence, expected=INSTEAD)
    return OFFSETS[form](lines, robot.name, (worth.sentence,)), worth


def _own(name: str, robot: Robot, reference: Chain) -> bool:
    """Whether offsets are to be counted from the nominal robot of the run itself."""
    first = nominal_chain(name, robot, None).table
    return all(same(first[n].value, reference.table[n].value) for n in robot.chain.geometric)


def _proven(alone: OffsetsAlone, robot: Robot) -> list[Offset]:
    """The offsets that a run fitted alone. Raises ModelError where it did not prove their gain."""
    if alone.status != "improved":
        raise ModelError(alone.reason.sentence, key="--format", expected=INSTEAD)
    units = [(p, parse_unit(p.unit)) for p in alone.parameters]
    return [Offset(p.joint, (p.offset or 0.0) * u.factor, p.sigma and p.sigma * u.factor, u) for p, u in units]


def _differences(robot: Robot, reference: Chain) -> list[Offset]:
    """How far the zeros of a model lie from the nominal ones. Raises ModelError where that would say nothing."""
    chain, table = robot.chain, robot.chain.table
    found = joint_offsets(reference, {p.name: p.value for p in table.rows})
    own = {z.parameter for z in chain.zeros}
    shifted = any(not same(table[n].value, reference.table[n].value) for n in own)
    # Where a convention frees other parameters by itself (a URDF's rz, cpc's beta), zero errors of joints are in these.
    if not found or not (shifted or own & {*chain.usual}):
        expected = "a run folder, which has fitted the offsets by themselves; or --format yaml or urdf"
        raise ModelError(
            "this convention keeps joint offsets inside its frames", found=chain.convention, expected=expected
        )
    moved = [n for n in chain.geometric if not same(table[n].value, reference.table[n].value)]
    if moved and not shifted:
        rest = "but other parameters do: offsets alone would correct nothing"
        message = f"no joint offset differs from the nominal robot, {rest}"
        raise ModelError(message, found=", ".join(moved), expected=INSTEAD)
    types = {j.name: "m" if j.type == "prismatic" else "rad" for j in chain.joints}
    return [Offset(joint, value, None, robot.units.of(types[joint])) for joint, value in found]


OFFSETS_ONLY, THIS_FILE = "offsets only", "this file alone"


OWN, UNSEEN = "the run's own data", "unseen data"


def worth_unseen(alone: OffsetsAlone) -> Remark:
    """Of joint offsets that their run fitted alone and proved."""
    if alone.before is None or alone.after is None or alone.whole is None:
        return Remark.of(Code.WORTH_UNKNOWN, what=OFFSETS_ONLY, why=alone.reason.sentence)
    unit = UNITS[alone.unit]
    nominal, mine, whole = (Quantity(v * unit.factor, unit.si) for v in (alone.before, alone.after, alone.whole))
    return Remark.of(Code.WORTH_ALONE, what=OFFSETS_ONLY, nominal=nominal, alone=mine, whole=whole, data=UNSEEN)


def worth_of(name: str, arm: Robot, held: Chain, what: str = THIS_FILE, nominal: Chain | None = None) -> Remark:
    """Of a robot `held` by a file, where `arm` was opened from the run folder `name`; against the run's own nominal robot, or
    another."""
    known = run_result(name)
    if known is None:
        return Remark.of(Code.WORTH_UNKNOWN, what=what, why="it takes the run folder, which knows the data")
    try:
        arm, data = _run_data(Path(name), known, arm)
        models = (nominal or nominal_chain(name, arm, None), held, arm.chain)
        found = [model_errors(m, data, tool=True) for m in models]
    except (InputError, np.linalg.LinAlgError) as error:
        return Remark.of(Code.WORTH_UNKNOWN, what=what, why=str(error).splitlines()[0])
    unit = "m" if len(found[0].position) else "rad"
    means = [_mean(e) for e in found]
    if not np.isfinite(means).all():
        return Remark.of(Code.WORTH_UNKNOWN, what=what, why="the run measured too little")
    first, mine, whole = (Quantity(v, unit) for v in means)
    return Remark.of(Code.WORTH_ALONE, what=what, nominal=first, alone=mine, whole=whole, data=OWN)


def _run_data(folder: Path, known: Result, arm: Robot) -> tuple[Robot, DataSet]:
    """The robot and the data of a run with what was freed and held in it. Raises InputError where a file has gone or changed."""
    said = known.provenance.options
    given = [_still_there(folder, i.file, i.sha256) for i in known.provenance.inputs[1:]]
    readings: list[Path] = []
    while given:
        # The robot came from a run folder itself, whose numbers were an input too.
        if given[0].name == "result.json":
            given.pop(0)
            continue
        reading = read_datasets([given[0]], arm.chain)
        used = {i.file.resolve() for i in reading.files}
        readings.append(given[0])
        given = [g for g in given[1:] if g.resolve() not in used]
    data = read_datasets(readings, arm.chain, group=said.get("group")).dataset
    picked = choose(OpenedArm(arm), data, **{k: tuple(said.get(k) or ()) for k in ("free", "fix", "prior")})
    return picked[0].file, picked[1]


def _still_there(folder: Path, file: str, sha256: str) -> Path:
    """Where an input of a run lies: as it was named, from here or from beside the run folder. Raises FileError."""
    for place in (Path(file), folder.parent / file, folder / file):
        if place.is_file() and hashlib.sha256(place.read_bytes()).hexdigest() == sha256:
            return place
    raise FileError("an input of the run is missing, or has changed", file=file)


def _mean(errors: Errors) -> float:
    values = errors.position if len(errors.position) else errors.angle
    return float(values.mean()) * errors.factor if len(values) else float("nan")
