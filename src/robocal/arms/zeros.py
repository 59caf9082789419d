"""Where joints count from: the parameters that add to the joints' own values, and what to add to the values instead.

The element that a joint q drives has the value drive * gain * q + own * p. Moving p by c is the same as adding
own c / (drive gain) to q before the model: a joint offset, the one number that every controller takes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from robocal.arms.chain import Chain
from robocal.arms.conventions import default_free
from robocal.errors import ModelError, nearest

__all__ = ["Zero", "joint_offsets", "joint_zeros", "open_zeros", "with_offsets"]


@dataclass(frozen=True)
class Zero:
    """A joint, the parameter that shifts where it counts from, and the change of that parameter per offset of the joint."""

    joint: str
    parameter: str
    factor: float


def joint_zeros(chain: Chain) -> tuple[Zero, ...]:
    """The zeros of a chain's joints, from base to tool; a joint without one is left out."""
    out = []
    for joint in chain.joints:
        for element in chain.elements:
            drive = next((t for t in element.terms if t.column == joint.name), None)
            own = next((t for t in element.terms if t.column == "1"), None)
            gain = 0.0 if drive is None else drive.factor * chain.table[drive.parameter].value
            if own is not None and gain:
                out.append(Zero(joint.name, own.parameter, gain / own.factor))
                break
    return tuple(out)


def open_zeros(chain: Chain) -> tuple[Zero, ...]:
    """The zeros that an identification may move: those that are free, and where a convention holds them because its frames
    say the same (a URDF, cpc, poe), those of joints of which anything is free."""
    usual, free = set(default_free(chain)), set(chain.table.free)
    owners = {n.rpartition(".")[0] for n in free if n in chain.geometric}
    return tuple(
        z
        for z in joint_zeros(chain)
        if z.parameter in free or (z.parameter not in usual and z.parameter.rpartition(".")[0] in owners)
    )


def joint_offsets(nominal: Chain, corrected: Mapping[str, float]) -> list[tuple[str, float]]:
    """What to add to every joint value (rad or m) before the nominal model, from corrected parameter values in SI."""
    return [
        (z.joint, (corrected[z.parameter] - nominal.table[z.parameter].value) / z.factor) for z in joint_zeros(nominal)
    ]


def with_offsets(nominal: Chain, offsets: Mapping[str, float]) -> Chain:
    """The chain whose joints count from elsewhere: its pose at q is that of `nominal` at q + offset (rad or m, by joint).

    Raises ModelError for a joint that it does not have.
    """
    known = {z.joint: z for z in joint_zeros(nominal)}
    for name in offsets:
        if name not in known:
            raise ModelError(
                "the robot has no such joint",
                key=name,
                expected=", ".join(known) or None,
                suggestion=nearest(name, known),
            )
    table = nominal.table
    return nominal.with_values(
        {known[n].parameter: table[known[n].parameter].value + known[n].factor * float(v) for n, v in offsets.items()}
    )
