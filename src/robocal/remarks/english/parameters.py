"""What is remarked on single parameters and on what lies beyond geometry, in English."""

from __future__ import annotations

from robocal.remarks.code import Code
from robocal.remarks.words import Words

__all__ = ["TABLE"]

TABLE: dict[Code, Words] = {
    Code.ONLY_COMBINATION: Words(
        "only a combination with {partners} is observable",
        "Measure where these differ, or fix all but one of them (--fix).",
    ),
    Code.LITTLE_SAID: Words(
        "the data add little to the expected value",
        "Measure more, or measure where this parameter has an effect.",
    ),
    Code.HIDDEN_PARTNERS: Words(
        "cannot be separated from {partners}: the sigma shows how far",
        "Measure where these differ, or fix all but one of them (--fix).",
    ),
    Code.FOLLOWS_TURN: Words("the turn about this axis was fixed; the number follows the others of its rotation"),
    Code.BELOW_THE_REST: Words(
        "not significant above the residual of joint offsets alone",
        "Move the joint through more of its range, or measure more configurations.",
    ),
    Code.AT_BOUND: Words(
        "the value is at its bound",
        "Widen the bound, or look for what pushes the parameter against it.",
    ),
    Code.NO_EFFECT: Words("{parameter} has no effect on these measurements"),
    Code.CANNOT_BE_TOLD: Words("{parameter} cannot be separated from {partners}[ and {more} more]"),
    Code.NO_RIPPLE: Words("no order of ripple is significant above the noise"),
    Code.GROUP_UNSEEN: Words(
        "no effect of it is observable above the noise[: no column {column} was recorded, or it never changes]",
        "Record what it depends on, and let it vary.",
    ),
    Code.GROUP_FEW: Words(
        "fewer than {least} configurations prove nothing about it",
        "Measure more configurations.",
    ),
    Code.BLOCKS_FALL: Words("the mean error on unseen blocks of rows falls"),
    Code.BLOCKS_DO_NOT_FALL: Words("the mean error on unseen blocks of rows does not fall significantly"),
    Code.LAYER_NEEDS: Words(
        "a residual layer needs positions or poses of the tool, measured from the base",
        "Measure positions or poses with an instrument that stands still.",
    ),
}
