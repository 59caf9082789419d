"""Joint offsets for controllers that take nothing else: the fit of the offsets alone, where its gain is proven; of a robot
without a run folder, the difference of its zeros from the nominal ones."""

from __future__ import annotations

from dataclasses import dataclass

from robocal.arms.chain import Chain
from robocal.arms.zeros import joint_offsets, with_offsets
from robocal.errors import ModelError
from robocal.files.evidence import OffsetsAlone
from robocal.files.offsets import OFFSETS, Offset
from robocal.files.robot import Robot
from robocal.files.units import parse_unit, same
from robocal.jobs.reference import nominal_chain, run_result
from robocal.jobs.worth import OFFSETS_ONLY, worth_of, worth_unseen
from robocal.remarks.remark import Quantity, Remark

__all__ = ["OFFSETS", "OffsetText", "offset_text"]

INSTEAD = "--format yaml or urdf, or robocal compensate"


@dataclass(frozen=True)
class OffsetText:
    """A file of joint offsets as text, and what it is worth."""

    text: str
    worth: Remark


def offset_text(name: str, robot: Robot, nominal: str | None, form: str) -> OffsetText:
    """The offsets of a robot's joints from its nominal model, with their sigma where a run knows it, in a form of
    `OFFSETS`.

    Raises ModelError where a run could not prove that offsets alone gain anything, or where they would say nothing.
    """
    known = run_result(name)
    reference = nominal_chain(name, robot, nominal)
    if reference.table.names != robot.chain.table.names:
        raise ModelError(
            "the nominal robot has other joints or parameters",
            key="--nominal",
            found=nominal,
            expected=", ".join(robot.chain.joint_names),
        )
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
    return OffsetText(OFFSETS[form](lines, robot.name, (worth.sentence,)), worth)


def _own(name: str, robot: Robot, reference: Chain) -> bool:
    """Whether offsets are to be counted from the nominal robot of the run itself."""
    first = nominal_chain(name, robot, None).table
    return all(same(first[n].value, reference.table[n].value) for n in robot.chain.geometric)


def _proven(alone: OffsetsAlone, robot: Robot) -> list[Offset]:
    """The offsets that a run fitted alone. Raises ModelError where it did not prove their gain."""
    if alone.status != "improved":
        raise ModelError(alone.reason.sentence, key="--format", expected=INSTEAD)
    out = []
    for p in alone.parameters:
        unit = parse_unit(p.unit)
        sigma = None if p.sigma is None else p.sigma * unit.factor
        out.append(Offset(p.joint, (p.offset or 0.0) * unit.factor, sigma, unit))
    return out


def _differences(robot: Robot, reference: Chain) -> list[Offset]:
    """How far the zeros of a model lie from the nominal ones. Raises ModelError where that would say nothing."""
    chain, table = robot.chain, robot.chain.table
    found = joint_offsets(reference, {p.name: p.value for p in table.rows})
    own = {z.parameter for z in chain.zeros}
    shifted = any(not same(table[n].value, reference.table[n].value) for n in own)
    # Where a convention frees other parameters by itself (a URDF's rz, cpc's beta), zero errors of joints are in these.
    if not found or not (shifted or own & {*chain.usual}):
        raise ModelError(
            "this convention keeps joint offsets inside its frames",
            found=chain.convention,
            expected="a run folder, which has fitted the offsets by themselves; or --format yaml or urdf",
        )
    moved = [n for n in chain.geometric if not same(table[n].value, reference.table[n].value)]
    if moved and not shifted:
        raise ModelError(
            "no joint offset differs from the nominal robot, but other parameters do: offsets alone would correct nothing",
            found=", ".join(moved),
            expected=INSTEAD,
        )
    types = {j.name: "m" if j.type == "prismatic" else "rad" for j in chain.joints}
    return [Offset(joint, value, None, robot.units.of(types[joint])) for joint, value in found]
