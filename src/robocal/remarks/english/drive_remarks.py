"""Sentences of motors and their logs."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["DriveRemarks"]


class DriveRemarks:
    """Of sweeps, of orders, and of what a log cannot tell."""

    DRIVE_GAIN_PROVEN = Phrase(
        "the mean error of the effort on unseen arcs falls by {gain:.4g}, 95 % interval {low:.4g~} to {high:.4g}"
    )
    DRIVE_GAIN_NOT_PROVEN = Phrase(
        "the mean error of the effort on unseen arcs does not fall significantly: {gain:.4g}, 95 % interval {low:.4g~} to {high:.4g}"
    )
    DRIVE_ONE_DIRECTION = Phrase(
        "the log of {log} moves in one direction only: nothing tells lag and friction apart from the torque",
        "Sweep back over the same angles, and log both.",
    )
    DRIVE_UNDER_TURN = Phrase(
        "{missing} of the 12 arcs of a turn were not read: the table says nothing there",
        "Sweep two turns in both directions.",
    )
    DRIVE_ORDERS_UNSEEN = Phrase(
        "{places:.0f} angles per turn were read: orders above {highest} cannot be told, and appear as lower ones",
        "Sweep slower, or log more often.",
    )
    DRIVE_PACE = Phrase(
        "the log of {log} moves at {speed:.3g} deg/s: no sweep is led so {word}",
        "Correct the unit of the time; if it is right, sweep at about 3 deg/s.",
    )
    DRIVE_EFFORT_SIZE = Phrase(
        "the effort of {log} reaches {value:.3g} {unit}: no motor without a load asks for so {word}",
        "Correct the unit of the effort[; if something hangs on the shaft, say so ({option})].",
    )
    DRIVE_PART_COMPARED = Phrase("{missing} of the 12 arcs of a turn are not in {log}: nothing is compared there")
    DRIVE_AT_LIMIT = Phrase(
        "{share:.0%} of the rows of {log} stand at one effort, {value:.4g} {unit}: a limit of the drive cuts the curve off",
        "Raise the limit of the current, and sweep again.",
    )
    DRIVE_OTHER_GAIN = Phrase(
        "the log of {log} shows {gain:.3g} times the curve of this table",
        "Correct the unit of the effort, or its torque constant.",
    )
    DRIVE_SPEED_HIDES = Phrase(
        "a table of positions explains {share:.0%} of the effort on unseen arcs: at {speed:.3g} {unit} the speed hides the torque",
        "Sweep slowly, at about 3 deg/s, led by a proportional position loop.",
    )
    DRIVE_EXPLAINS_LITTLE = Phrase(
        "a table of positions explains {share:.0%} of the effort on unseen arcs: it does not come again from turn to turn",
        "Look at the columns and their units; detach the load, and sweep at about 3 deg/s.",
    )
    DRIVE_OTHER_READING = Phrase(
        "read with {change}, orders explain {other:.0%} of the effort, and {share:.0%} as it is written",
        "Correct the columns or units: {change}.",
    )
    DRIVE_FLAG = Phrase(
        "the column of the compensation says {said} for {rows} rows where the effort says {found}",
        "Believe the effort; look at when the drive writes that column.",
    )
    DRIVE_GEAR = Phrase(
        "the orders are {times} times those of a motor with {slots} slots and {poles} poles: the angle may be that of a gear's output",
        "Log the angle of the motor's own shaft, or divide by the gear's ratio.",
    )
    DRIVE_ELECTRICAL = Phrase(
        "the effort comes again after {pairs} turns of the logged angle, not after one: it may be an electrical angle, or that of a gear's "
        "input",
        "Log the angle of the motor's own shaft.",
    )
    DRIVE_WEIGHT = Phrase(
        "{share:.0%} of the variance of the curve comes once per turn, as the weight of a load does: the table has it as cogging",
        "If a load hangs on the shaft, detach it, or say so (--loaded): its weight is then a number of the log.",
    )
    DRIVE_SLOTS_UNLIKE = Phrase(
        "{slots} slots and {poles} poles name {share:.0%} of the variance of the orders",
        "Count the slots and poles again[: {others} would name the strongest orders].",
    )
    DRIVE_ONE_UNLIKE = Phrase(
        "no winding with {said} has these orders; one of {slots} slots and {poles} poles has",
        "Count the slots and poles again.",
    )
    DRIVE_WINDING = Phrase("a motor with {slots} slots and {poles} poles has these orders")
    DRIVE_SENSOR_ORDERS = Phrase(
        "the orders {orders} come once and twice per pole pair: what current sensors make, beside what slots make"
    )
    DRIVE_IDEAL = Phrase(
        "an ideal motor of {slots} slots and {poles} poles cogs {order} times a turn; a skew of {skew:.3g} deg removes that order"
        "[; with {ratio} slots for each pole all poles meet slots at once]"
    )
    DRIVE_ESCAPED = Phrase(
        "the rotor escaped over {width:.3g} deg in {count} places[, {repaired:.3g} deg of which the other direction has][, {lost:.3g} deg "
        "of which neither has]",
        "Raise the gain of the position loop, and sweep again.",
    )
    DRIVE_LONE_ROWS = Phrase("{count} rows of {log} stand alone, far from the rows around them, and are left out")
    DRIVE_OUTLIER = Phrase(
        "{motor} is unlike the other motors: its {what} is {value:.3g} {unit}, theirs {low:.3g} to {high:.3g} {unit}",
        "Look at its bearings, its load and its wiring, and sweep it again.",
    )
    DRIVE_REPEATED_ROWS = Phrase(
        "{count} rows of {log} repeat the row before, as a logger faster than its drive writes them: left out"
    )
    DRIVE_TIME_ANEW = Phrase("time starts anew in line {lines} of {log}: read as {count} sweeps, one after the other")
    DRIVE_LAG_FAR = Phrase(
        "harmonics of one direction explain {other:.0%} of the other in the log of {log}[, {apart:.3g} {unit} apart]: effort and angle may "
        "be logged at different moments[, by {delay:.2g} s], or there is play between motor and encoder",
        "Log both at one moment; without a delay, a sweep at half the speed shows the same.",
    )
    DRIVE_ARC_UNREAD = Phrase(
        "{width:.3g} deg[ in each {period:.3g} deg of the turn] were read in neither direction, more than a quarter period of order "
        "{order}: the table says nothing there",
        "Sweep there as well; a rotor that escapes needs a stiffer position loop.",
    )
    DRIVE_TABLE_LOST = Phrase(
        "{lost:.3g} deg of the tables have no reading near, in neither direction",
        "Log more often, or take a wider --window.",
    )
    DRIVE_WINDOW_FLATTENS = Phrase(
        "tables of a window of {window:.3g} deg explain {table:.1%} of their own rows, harmonics {harmonics:.1%}: the window flattens "
        "quick orders",
        "Take a narrower --window, or --method harmonics.",
    )
    DRIVE_HELD_BACK = Phrase(
        "the log of {log}, at {speed:.3g} {unit}, is held back: the table alone explains {alone:.0%} of its effort"
    )
    DRIVE_UNPROVEN = Phrase(
        "the table of {motor} is not proven: `robocal drive identify` called it {verdict}",
        "Do as that run advises, and identify the motor again.",
    )
    DRIVE_OTHER_MOTOR = Phrase(
        "the log of {log} shows {gain:.2g} times the curve of this table, and harmonics of the same orders explain {best:.0%} of it: it is "
        "of another motor",
        "Identify that motor by itself.",
    )
    DRIVE_OTHER_ZERO = Phrase(
        "the table explains {share:.0%} of the log of {log} once its angle is[ {reversed} and] moved by {shift:.4g} {unit}[, and its "
        "effort {negative}], and {alone:.0%} as it is",
        "Let the encoder count from its index, in the direction of the sweep.",
    )
    DRIVE_OTHER_SIGN = Phrase(
        "the table explains {share:.0%} of the log of {log} once its effort has the other sign[, and its angle is moved by {shift:.4g} "
        "{unit}], and {alone:.0%} as it is",
        "Give the effort the sign that it had in the sweep.",
    )
    DRIVE_NO_POSITION_TABLE = Phrase(
        "where the motor runs rough, no table of positions explains more than {best:.0%}: inertia carries the rotor through its cogging"
    )
