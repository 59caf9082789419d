"""Joint offsets: what to add to the joints' own values instead of correcting the model (`Chain.zeros`)."""

from __future__ import annotations

from collections.abc import Mapping

from robocal.arms.chain import Chain
from robocal.errors import ModelError, one_of

__all__ = ["joint_offsets", "with_offsets"]


def joint_offsets(nominal: Chain, corrected: Mapping[str, float]) -> list[tuple[str, float]]:
    """What to add to every joint value (rad or m) before the nominal model, from corrected parameter values in SI."""
    return [(z.joint, (corrected[z.parameter] - nominal.table[z.parameter].value) / z.factor) for z in nominal.zeros]


def with_offsets(nominal: Chain, offsets: Mapping[str, float]) -> Chain:
    """The chain whose joints count from elsewhere: its pose at q is that of `nominal` at q + offset (rad or m, by joint).

    Raises ModelError for a joint that it does not have.
    """
    known = {z.joint: z for z in nominal.zeros}
    for name in offsets:
        if name not in known:
            facts = one_of(name, known) if known else {}
            raise ModelError("the robot has no such joint", key=name, **facts)
    table = nominal.table
    return nominal.with_values(
        {known[n].parameter: table[known[n].parameter].value + known[n].factor * float(v) for n, v in offsets.items()}
    )
