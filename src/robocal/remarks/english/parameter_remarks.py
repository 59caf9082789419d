"""What is remarked on single parameters and on what lies beyond geometry, in English."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["ParameterRemarks"]


class ParameterRemarks:
    """What is remarked on single parameters and on what lies beyond geometry."""

    ONLY_COMBINATION = Phrase(
        "only a combination with {partners} is observable",
        "Measure where these differ, or fix all but one of them (--fix).",
    )
    LITTLE_SAID = Phrase(
        "the data add little to the expected value", "Measure more, or measure where this parameter has an effect."
    )
    HIDDEN_PARTNERS = Phrase(
        "cannot be separated from {partners}: the sigma shows how far",
        "Measure where these differ, or fix all but one of them (--fix).",
    )
    FOLLOWS_TURN = Phrase("the turn about this axis was fixed; the number follows the others of its rotation")
    BELOW_THE_REST = Phrase(
        "not significant above the residual of joint offsets alone",
        "Put the target farther from the axis of the joint, move it through more of its range, or measure more configurations.",
    )
    AT_BOUND = Phrase("the value is at its bound", "Widen the bound, or look for what pushes the parameter against it.")
    NO_EFFECT = Phrase("{parameter} has no effect on these measurements")
    CANNOT_BE_TOLD = Phrase("{parameter} cannot be separated from {partners}[ and {more} more]")
    NO_RIPPLE = Phrase("no order of ripple is significant above the noise")
    GROUP_UNSEEN = Phrase(
        "no effect of it is observable above the noise[: no column {column} was recorded, or it never changes]",
        "Record what it depends on, and let it vary.",
    )
    GROUP_FEW = Phrase("fewer than {least} configurations prove nothing about it", "Measure more configurations.")
    BLOCKS_FALL = Phrase("the mean error on unseen blocks of rows falls")
    BLOCKS_DO_NOT_FALL = Phrase("the mean error on unseen blocks of rows does not fall significantly")
    LAYER_NEEDS = Phrase(
        "a residual layer needs positions or poses of the tool, measured from the base",
        "Measure positions or poses with an instrument that stands still.",
    )
    OFFSETS_PROVEN = Phrase(
        "joint offsets only: mean error on unseen poses {before:.3g~} to {after:.3g}, whole model {whole:.3g} (gain {low:.3g~} to "
        "{high:.3g} with 95 %, {how})",
        "robocal export --format offsets writes them for a controller that takes nothing else.",
    )
    OFFSETS_NOT_PROVEN = Phrase(
        "joint offsets only: no proven gain: mean error on unseen poses {before:.3g~} to {after:.3g}, whole model {whole:.3g} (gain "
        "{low:.3g~} to {high:.3g} with 95 %, {how})",
        "Joint offsets are not what this robot needs. Use the whole model (export --format yaml or urdf), or correct the targets of "
        "a controller that cannot (robocal compensate).",
    )
    OFFSETS_UNSEEN = Phrase(
        "no joint offset is observable in these measurements beside frames and tool",
        "Move every joint through most of its range. Or fix the tool or the instrument's frame, if you know them.",
    )
    # --- what was written ---
    JOINT_LOADS_APART = Phrase(
        "masses and friction of joints are in result.json alone: files of robots have no place for them; the run folder is read with them"
    )
    URDF_LACKS = Phrase(
        "calibrated.urdf cannot hold the fitted {names}: by itself it is not the identified robot; the run folder is",
        "Give the folder to validate, export or simulate.",
    )
