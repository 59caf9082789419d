"""What is remarked on when a model is judged, used and handed on, in English."""

from __future__ import annotations

from robocal.remarks.code import Code
from robocal.remarks.words import Words

__all__ = ["TABLE"]

TABLE: dict[Code, Words] = {
    Code.FITTED_TO_THESE: Words(
        "the robot was fitted to {files}: that proves nothing",
        "Validate on measurements that the identification has not seen.",
    ),
    Code.SEEN_LEFT_OUT: Words(
        "the robot was fitted to {count} of the {total} measurements in {files}: it is judged on the other {left} configurations"
    ),
    Code.FEW_UNSEEN_HERE: Words(
        "only {left} configurations were not used to fit the robot, and it takes {fewest} to judge it",
        "Measure some more configurations for validation.",
    ),
    Code.FEW_AFTER_FRAMES: Words(
        "{numbers} measured numbers are too few to judge anything after {fitted} parameters of the instruments' frames "
        "were fitted",
        "Measure more configurations, or state where the instrument stands.",
    ),
    Code.POSES_NOT_IN_ALL: Words(
        "{count} poses are not in all files and are left out: {both} are compared",
        "Check the ids where that was not meant.",
    ),
    Code.NO_LENGTHS: Words(
        "no lengths were measured, and a model is validated in lengths",
        "Give measurements of positions, poses or distances.",
    ),
    Code.NO_POSITION: Words(
        "the model gives no finite position on these data",
        "Look for joint values or lengths that are far too large.",
    ),
    Code.MEAN_AS_GOOD: Words(
        "no better than predicting the mean of the measurements: {error:.4g} against {constant:.4g}",
        "Check that each row pairs a measurement with its own joint values, and that units and signs of the joints "
        "agree with the model.",
    ),
    Code.LAYER_ON_TOP: Words(
        "with the residual layer of the run folder on top, the mean error is {mean:.4g}; the figures above are without "
        "it"
    ),
    Code.LAYER_LEFT_OUT: Words(
        "the residual layer of the run folder is left out: {what} are those of the calibrated model alone"
    ),
    Code.OUTSIDE_MEASURED: Words(
        "{poses} of {total} poses lie outside the measured range of {joints}: there the bars rest on the model alone",
        "Measure there too before relying on it.",
    ),
    Code.CONDITIONS_ASSUMED: Words(
        "the poses do not say {columns}: what it was on average while measuring is taken",
        "Add these columns to the list of poses.",
    ),
    Code.ACCURACY_NOT_REACHED: Words(
        "the accuracy asked for is not reached: {best:.3g} after {poses} poses",
        "Plan more poses, or measure with less noise.",
    ),
    Code.SIGMA_ASSUMED: Words(
        "no sigma is stated: 0.1 mm and 0.1 mrad per axis were assumed",
        "State the sigma of the instrument: every bar scales with it.",
    ),
    Code.NO_DATA_FILE: Words(
        "no data file was written: {reason}",
        "Write the measurements into a data file of your own (robocal new shows one).",
    ),
    Code.CALIBRATION_UNPROVEN: Words(
        "the calibration's verdict is {verdict}: compensating with it is not known to help",
        "Identify with more or better measurements first.",
    ),
    Code.TARGETS_UNREACHED: Words(
        "{count} of {total} targets cannot be reached and have no correction: {targets}[ and {others} others]",
        "See the note of each target in the table.",
    ),
    Code.MODELS_APART: Words(
        "the two models stand {gap:.3g} apart at the targets",
        "Check that the nominal model is that of this robot.",
    ),
    Code.BRANCH_UNKNOWN: Words(
        "the targets do not say where the controller's joints would be: another branch (elbow, wrist) has other "
        "corrections",
        "Add joint columns to settle it.",
    ),
    Code.TOOL_CHANGED: Words(
        "the calibration changed the tool",
        "--tool says which tool both models carry (calibrated by default).",
    ),
    Code.NEEDS_JOINTS: Words("needs {joints}"),
    Code.BY_WAY_OF_LIMITS: Words("reached only by way of joints outside their limits"),
    Code.NEAREST_REACHED: Words("the nearest that the arm comes is {gap:.3g}[, {angle:.3g}]"),
    Code.CORRECTION_LEAPS: Words("the correction moves {joint}"),
    Code.LOW_DEXTERITY: Words("dexterity {dexterity:.2g}, below {least:g}"),
    Code.ORIENTATION_RELAXED: Words("position exact, orientation off by {angle:.3g}"),
    Code.URDF_CANNOT_HOLD: Words(
        "a URDF cannot hold the fitted {names}",
        "--format yaml holds them.",
    ),
    Code.BEYOND_LEFT_OUT: Words(
        "left out is what lies beyond geometry: {groups}",
        "--format yaml holds it.",
    ),
    Code.WORTH_ALONE: Words(
        "{what}: {nominal:.3g~} to {alone:.3g}, the whole model {whole:.3g} (mean error on {data} from the nominal robot, "
        "frames and tool fitted)"
    ),
    Code.WORTH_UNKNOWN: Words(
        "{what}: what that is worth could not be computed: {why}",
        "robocal validate judges it on data.",
    ),
    Code.OFFSETS_MISSING: Words(
        "{file} says nothing of {joints}: taken as 0",
        "Add a row for each, or make sure that 0 is meant.",
    ),
    Code.URDF_PLACEHOLDERS: Words(
        "effort and velocity limits are placeholders (0): a URDF must have them, a kinematic model has none",
        "Enter those of the robot where a program uses them.",
    ),
    Code.URDF_TOOL_OFF: Words(
        "{file}: behind the last axis there is no fixed joint that could hold the tool, which is off by {gap:.3g} and "
        "{angle:.3g}; all axes are right",
        "Add a fixed joint behind the last axis of that URDF.",
    ),
    Code.NO_TRIAL_ENDED: Words(
        "{output}: at {points} of {total} points no trial has a number",
        "Look at one of them: too few poses, too much noise, or nothing that was held out.",
    ),
    Code.TRIALS_LOST: Words(
        "{output}: at {points} of {total} points trials are lost, at most {most} of {trials}; rms, mean and scatter are of "
        "the others",
        "Take such a point for worse than it looks: what is lost is seldom the best.",
    ),
    Code.REPEATABILITY_UNCHANGED: Words(
        "repeatability (RP, RD, vAP) compares measurements with each other: no model enters, so calibration does not "
        "change it"
    ),
    Code.FEW_VISITS: Words(
        "the standard asks for {asked} visits; here some places have {visits}",
        "Visit every place that often.",
    ),
    Code.NO_STANDING_POSITIONS: Words("the data hold no positions of the tool by an instrument that stands still"),
    Code.VISITED_ONCE: Words("every place was visited once[; {what}]"),
    Code.NO_ORIENTATIONS: Words("no orientations were measured"),
    Code.ONE_DIRECTION: Words("no place was approached from several directions"),
    Code.DIRECTIONS_UNMARKED: Words("no column {column} marks them"),
    Code.FEW_PLACES: Words("fewer than two places were measured by one instrument"),
    Code.DISTANCES_ONCE: Words("no distance was run repeatedly"),
}
