"""What is remarked on files of arms and their data, in English."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["FileRemarks"]


class FileRemarks:
    """What is remarked on files of arms and their data."""

    ROBOT_SIZE = Phrase("{file}: the lengths add up to {reach:.3g} m", "Check units.length: {unit}.")
    OVER_A_TURN = Phrase(
        "{file}: {parameter} is {value:.6g} {unit}, more than a whole turn", "Check units.angle: {unit}."
    )
    URDF_SIZE = Phrase(
        "{file}: the lengths add up to {reach:.3g} m",
        "A URDF is in metres: divide every xyz by 1000 where they are millimetres.",
    )
    URDF_TURN = Phrase(
        "{file}: joint {joint}: an angle of rpy is {value:.6g} rad, more than a whole turn",
        "A URDF is in radians: 90 degrees are 1.5708.",
    )
    URDF_LIMITS = Phrase(
        "{file}: joint {joint}: its limits are {low:.6g} to {high:.6g} rad, more than five turns",
        "A URDF is in radians: write limits of 170 degrees as 2.9671.",
    )
    TIP_CHOSEN = Phrase("{file}: the arm is taken to end at link {tip}", "Choose another with --tip.")
    RUN_HOLDS_MORE = Phrase(
        "{file} does not hold the fitted {names}; the run folder {folder} does",
        "Give the run folder instead of the file.",
    )
    RUN_UNRECORDED = Phrase(
        "{run}: this run was written by an earlier version, so it cannot be checked whether its files belong together",
        "Identify once more, and robocal can check it.",
    )
    RESULT_MISSING = Phrase(
        "{folder}: there is no result.json, so what a URDF cannot hold (tool, gains, offsets) is unknown",
        "Give the whole run folder, as robocal identify -o wrote it.",
    )
    HALF_TURNS_UNDONE = Phrase(
        "in {count} of {total} views of {instruments} the target was labelled from its other end: half a turn was undone there"
    )
    TARGETS_SEEN_ONCE = Phrase(
        "a single view shows {targets}, of unknown place: these say nothing of anything else, and are left out"
    )
    NOTHING_FREE = Phrase(
        "nothing of the robot is free: there is nothing to identify",
        "Name the parameters to identify: calibrate: free in the robot file, or --free.",
    )
    OUTSIDE_LIMITS = Phrase(
        "{file}: {rows} rows have a joint outside its limits ({joints}), first row {row}",
        "Check unit, order and signs of the joint columns, or the limits in the robot file.",
    )
    REPEATS_DIFFER = Phrase(
        "{file}: {count} repeated measurements differ by more than 10 sigma, first rows {first} and {second}",
        "Look at these rows: a target may have moved, or the stated sigma is too small.",
    )
    COPIED = Phrase(
        "{file}: {count} measurements equal another to the last digit: copies count twice or more often, first rows "
        "{first} and {second}",
        "Look at these rows, and leave copies out.",
    )
    OTHER_UNIT = Phrase(
        "{file}: the {part} values are read in {stated} but look like {alternative}: {why}",
        "Check {part}.unit in the data file.",
    )
    LARGEST_ANGLE = Phrase("the largest is {largest:.4g} {unit}")
    SPREAD_UNLIKE = Phrase("they spread over {spread:.3g} m, the arm measures {reach:.3g} m")
    AS_STATED_UNFIT = Phrase("the model does not fit the values as they are stated")
    ROW_COPY = Phrase(
        "row {row} equals row {partner} to the last digit, as if the instrument got stuck", "Leave it out (--exclude)."
    )
    ROW_TARGET = Phrase(
        "row {row} is where target {target} should be: two labels are swapped",
        "Correct the names in the column of targets.",
    )
    ROW_SWAPPED = Phrase("rows {row} and {partner} fit each other's joint values: swapped", "Swap their readings back.")
    ROW_ELSEWHERE = Phrase(
        "row {row} fits the joint values of row {partner}: moved there",
        "Check how joint values and readings were paired.",
    )
    ROW_SHIFTED = Phrase(
        "row {row}: number {column} of the reading is that of row {partner}: a column is shifted against the others",
        "Check how the columns were put together.",
    )
    ROW_SIGN = Phrase("row {row}: number {column} of the reading fits with the other sign", "Check the sign there.")
    ROW_COLUMN = Phrase("row {row}: only number {column} of the reading is off", "Check how it was written down.")
    ROWS_EXCLUDED = Phrase(
        "{file}: {count} rows were left out by the user ({rows})", "The results are those of the other rows."
    )
    ROWS_MISSING = Phrase(
        "{file}: {count} rows were left out because a value is missing ({rows})",
        "The results are those of the other rows.",
    )
    COLUMNS_UNREAD = Phrase(
        "{file}: columns that are not read: {names}[ and {more} more][; did you mean {near} by {misspelt}?]",
        "Correct the header, or name the column in the data file, where it is to be read.",
    )
    CSV_TITLE = Phrase(
        "{file}: the header is read in row {head}, after a title of {count} rows",
        "Put a # before them where they are none.",
    )
    CSV_COMMENTED = Phrase(
        "{file}: the header is read in row {head}, behind a comment sign",
        "Remove the sign; or say header: false in a data file.",
    )
    CSV_WESTERN = Phrase("{file}: no UTF-8, read as Windows-1252", "Save it as UTF-8 where names look wrong.")
    COLUMN_CARRIED = Phrase(
        "{file}, row {row}: configuration.{name} has no meaning and is only copied; did you mean {near}?",
        "Correct the name where it is misspelt.",
    )
    KEYS_UNSTATED = Phrase(
        "{file}[, row {row}]: {joint} does not state {keys}[, as {others} do]: it is taken with {values}",
        "State {keys} there, even if these values are right.",
    )
    PLACES_UNTOUCHED = Phrase(
        "{file}: described, but never measured: {names}",
        "Check the names in the column of places. A distance to such a place is left out while the place is free.",
    )
    ELEMENTS_UNREAD = Phrase(
        "{file}: elements that are not read: {names}[ and {more} more][; did you mean {near} by {misspelt}?]",
        "Correct the name where it is misspelt.",
    )
