"""What is remarked on a rig at power-up and on its way through a list, in English."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["RigRemarks"]


class RigRemarks:
    """What is remarked on a rig at power-up and on its way through a list."""

    RIG_DRIVES = Phrase(
        "{drives} drives answer, and the robot has {cables} cables: nothing was switched on",
        "Connect a drive for each cable, or correct the cables in the robot's file.",
    )
    RIG_SLACK = Phrase(
        "nothing pulled at the winch of {cable} when its brake was released: the cable is slack; all brakes are on",
        "Wind the cable up by hand until it is taut, and switch on again.",
    )
    RIG_REVERSED = Phrase(
        "the winch of {cable} counted in what its cable pulled out: it turns the other way; all brakes are on",
        "Exchange the direction of this drive, or wind the cable on its drum the other way.",
    )
    RIG_EXCHANGED = Phrase(
        "everything fits together as if the drives of {cables} were exchanged[, or those of {also}]; the rig stopped",
        "Exchange the connections of these two drives.",
    )
    RIG_ENCODER = Phrase(
        "the lengths fit together as if the encoder of {cable} counted {gain:.3g} times what it should[, or that of {also} {times:.3g} "
        "times]; the rig stopped",
        "Correct the counts per turn of this encoder.",
    )
    RIG_LENGTHS_DISAGREE = Phrase(
        "after small motions the lengths do not fit together (chance {chance:.1g}), nor with one encoder or two drives put right; the rig "
        "stopped",
        "Measure the anchors again, and look at every encoder and cable.",
    )
    RIG_WEIGHT = Phrase(
        "the cables carry {found:.3g} ± {sigma:.2g} N, and the platform was said to weigh {said:.3g} N; the rig stopped",
        "Weigh the platform, and write its weight into the rig's file.",
    )
    RIG_INFEASIBLE = Phrase(
        "at {pose} no tensions between {low:.3g} and {high:.3g} N hold the platform; the rig stopped before it moved there",
        "Choose poses nearer to the middle of the frame, or wider limits.",
    )
    RIG_STOPPED = Phrase(
        "on the way to {pose} the controller stopped: {why}[ ({cable})]",
        "Look at this cable and its drive; choose poses nearer to the middle of the frame.",
    )
    RIG_LIMITS_LEFT = Phrase(
        "the plant's tensions were {least:.3g} to {most:.3g} N, and the controller was to stay between {low:.3g} and {high:.3g} N",
        "Measure the anchors better, or keep more distance from the limits.",
    )
    RIG_NOT_IMPROVED = Phrase(
        "the calibration of list {name} is not trusted: it is {verdict}; report.html of its run has the reasons"
    )
