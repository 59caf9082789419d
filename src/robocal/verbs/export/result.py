"""A robot model in the form that the next program wants."""

from __future__ import annotations

from dataclasses import dataclass

from robocal.arms.chain import Chain
from robocal.arms.conventions import convention_of, rows
from robocal.arms.denavit import to_denavit
from robocal.files.csvtable import csv_text
from robocal.files.robot import Robot, describe
from robocal.files.robot_rows import row_numbers
from robocal.files.units import number
from robocal.files.urdf_into import urdf_into, urdf_text
from robocal.parameters import FRAME_SYMBOLS
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.controller_offsets import OFFSETS, offset_text, worth_of
from robocal.session.inputs import open_machine
from robocal.session.reference import nominal_chain, run_cautions, run_result

__all__ = ["Exported", "export_robot", "parameter_table"]

# What a model lacks that was not read from its run folder, and what nobody can tell of that folder.
LACKING = (Code.RUN_HOLDS_MORE, Code.RESULT_MISSING, Code.RUN_UNRECORDED)
# The parts of a key with several numbers, where they are not x, y and z.
PARTS = {"limits": ("lower", "upper"), "rpy": ("roll", "pitch", "yaw")}


@dataclass(frozen=True)
class Exported:
    """The text, and what a person should know of it; `worth` is what the file alone is worth where it cannot hold the whole
    model."""

    text: str
    notes: tuple[Remark, ...] = ()
    worth: Remark | None = None


def export_robot(
    robot: str, form: str, nominal: str | None, into: str | None, base: str | None, tip: str | None
) -> Exported:
    """The robot (a file, a catalogue name or a run folder) in another form; `into` is a URDF whose origins are to say
    it. Raises InputError, also for a form that cannot hold it."""
    ours = into is None
    opened = open_machine(robot, base=base if ours else None, tip=tip if ours else None)
    if opened.arm is None and form == "yaml":
        return Exported(opened.yaml, run_cautions(robot))
    arm = opened.need_arm("an arm, or --format yaml")
    notes: tuple[Remark, ...] = ()
    held: Chain | None = None  # the robot that the file describes, where that is not the whole model
    worth: Remark | None = None
    told = tuple(w for w in arm.warnings if w.code in LACKING)
    if form == "yaml":
        text = opened.yaml
    elif form == "urdf":
        if into is not None:
            text, notes = urdf_into(arm.chain, into, base=base, tip=tip)
        else:
            text, notes = (arm.text, ()) if arm.format == "urdf" else urdf_text(arm.chain)
        if into is None and arm.format == "urdf" and arm.left_out:
            notes = (Remark.of(Code.URDF_CANNOT_HOLD, names=arm.left_out),)
            before = nominal_chain(robot, arm, nominal).table if run_result(robot) else None
            held = arm.chain if before is None else arm.chain.with_values({n: before[n].value for n in arm.left_out})
    elif form == "dh":
        text = describe(to_denavit(arm.chain), arm.units, calibrate=False)
    elif form in OFFSETS:
        made = offset_text(robot, arm, nominal, form)
        text, worth = made.text, made.worth
    else:
        table = parameter_table(arm)
        text = csv_text(table[0], table[1:]) if form == "csv" else _markdown(table)
    if form in (*OFFSETS, "csv", "markdown"):
        notes = (*notes, *_beyond(arm.chain))
        if form not in OFFSETS and _beyond(arm.chain):
            names = [p for g in arm.chain.groups for p in g.parameters if not p.endswith(".gain")]
            held = arm.chain.with_values(dict.fromkeys(names, 0.0))  # the same arm without what lies beyond geometry
    if held is not None:
        worth = worth_of(robot, arm, held)
    return Exported(text, (*run_cautions(robot), *told, *notes), worth)


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
            name = "_".join((str(path[0]), *(parts[int(i)] for i in path[1:])))
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


def _markdown(table: list[list[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in table]
    lines.insert(1, "|" + "---|" * len(table[0]))
    return "\n".join(lines) + "\n"
