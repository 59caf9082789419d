"""What is remarked on when a model is judged, used and handed on, in English."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["UseRemarks"]


class UseRemarks:
    """What is remarked on when a model is judged, used and handed on."""

    FITTED_TO_THESE = Phrase(
        "the robot was fitted to {files}: that proves nothing",
        "Validate on measurements that the identification did not use.",
    )
    SEEN_LEFT_OUT = Phrase(
        "the robot was fitted to {count} of the {total} measurements in {files}: it is judged on the other {left} configurations"
    )
    FEW_UNSEEN_HERE = Phrase(
        "only {left} configurations were not used to fit the robot, and {fewest} are needed to judge it",
        "Measure some more configurations for validation.",
    )
    FRAMES_NOT_CONVERGED = Phrase(
        "the fit of the instruments' frames to these data did not converge: the errors say nothing of the robot"
    )
    TARGET_REMOUNTED = Phrase(
        "a target that sits ({x}, {y}, {z}) from where this robot has it on the tool explains most of these errors: mean {mean} with the "
        "tool of the robot's file, {after} with the tool fitted to these data",
        "If the target was mounted anew or the file says nothing of it, write its place into tool: of the robot's file.",
    )
    TOOL_NOT_STATED = Phrase(
        "{names} of this robot are 0 and were not fitted: a target that sits elsewhere on the tool is part of these errors",
        "Write where the target sits into tool: of the robot's file.",
    )
    FEW_AFTER_FRAMES = Phrase(
        "{numbers} measured numbers are too few to judge anything after {fitted} parameters of the instruments' frames "
        "were fitted",
        "Measure more configurations, or state where the instrument stands.",
    )
    POSES_NOT_IN_ALL = Phrase(
        "{count} poses are not in all files and are left out: {both} are compared",
        "Check the ids if this was not intended.",
    )
    POSES_FROM_POINTS = Phrase(
        "{file}: {count} poses from points; their median standard deviation is {position:.2g} and {orientation:.2g}"
    )
    POINTS_TOO_FEW = Phrase(
        "{file}: {count} poses are left out, such as {one}: it has {found} points, or they are on one line",
        "Measure {least} points of each, not on one line.",
    )
    POINTS_APART = Phrase(
        "{file}: {count} poses are left out, whose points lie to each other otherwise than those of the other poses: {point} of {one} is "
        "{far:.2g} from where the others put it",
        "Measure them again, or leave such points out (exclude).",
    )
    POINTS_WITHOUT_PLACES = Phrase(
        "{file}: nothing says where the points are on the body: the poses are those of their middle, in the axes of the first row",
        "State xyz of every target. Or look at the view that aligns another point.",
    )
    NO_LENGTHS = Phrase(
        "no lengths were measured, and a model is validated in lengths",
        "Give measurements of positions, poses or distances.",
    )
    MEAN_AS_GOOD = Phrase(
        "no better than predicting the mean of the measurements: {error:.4g} against {constant:.4g}",
        "Check that each row pairs a measurement with its own joint values, and that units and signs of the joints "
        "agree with the model.",
    )
    LAYER_ON_TOP = Phrase(
        "with the residual layer of the run folder on top, the mean error is {mean:.4g}; the figures above are without "
        "it"
    )
    LAYER_LEFT_OUT = Phrase(
        "the residual layer of the run folder is left out: {what} are those of the calibrated model alone"
    )
    OUTSIDE_MEASURED = Phrase(
        "{poses} of {total} poses lie outside the measured range of {joints}: there the error bars follow from the model "
        "alone",
        "Measure there too before relying on it.",
    )
    CONDITIONS_ASSUMED = Phrase(
        "the poses do not state {columns}: the mean during the measurements is assumed",
        "Add these columns to the list of poses.",
    )
    ACCURACY_NOT_REACHED = Phrase(
        "the required accuracy is not reached: {best:.3g} after {poses} poses",
        "Plan more poses, or measure with less noise.",
    )
    ONE_PLACE_PLANNED = Phrase(
        "planned for {place} alone: every candidate counts as a pose that touches it, also one that touches {others}"
    )
    SIGMA_ASSUMED = Phrase(
        "no sigma is stated: 0.1 mm and 0.1 mrad per axis are assumed",
        "State the sigma of the instrument: every error bar scales with it.",
    )
    CALIBRATION_UNPROVEN = Phrase(
        "the calibration's verdict is {verdict}: compensating with it is not known to help",
        "Identify with more or better measurements first.",
    )
    TARGETS_UNREACHED = Phrase(
        "{count} of {total} targets cannot be reached and have no correction: {targets}[ and {others} others]",
        "Move each target, or widen the limits of the joints, by what its note in the table says.",
    )
    MODELS_APART = Phrase(
        "the two models differ by {gap:.3g} at the targets", "Check that the nominal model is that of this robot."
    )
    BRANCH_UNKNOWN = Phrase(
        "the targets do not show where the controller's joints would be: another branch (elbow, wrist) has other "
        "corrections",
        "Add joint columns to decide.",
    )
    TOOL_CHANGED = Phrase(
        "the calibration changed the tool: both models carry the calibrated one, unless --tool states another"
    )
    NEEDS_JOINTS = Phrase("needs {joints}")
    BY_WAY_OF_LIMITS = Phrase("reached only with joints outside their limits on the way")
    NEAREST_REACHED = Phrase("the nearest pose that the arm reaches is {gap:.3g}[, {angle:.3g}] away")
    CORRECTION_LEAPS = Phrase("the correction moves {joint}")
    LOW_DEXTERITY = Phrase("dexterity {dexterity:.2g}, below {least:g}")
    ORIENTATION_RELAXED = Phrase("position exact, orientation off by {angle:.3g}")
    URDF_CANNOT_HOLD = Phrase("a URDF cannot hold the fitted {names}", "--format yaml holds them.")
    INERTIA_ASSUMED = Phrase(
        "the inertia of the platform is not known: that of a box around its anchors is written",
        "State inertia in the robot's file, under platform.",
    )
    BEYOND_LEFT_OUT = Phrase("non-geometric effects are left out: {groups}", "--format yaml holds them.")
    WORTH_ALONE = Phrase(
        "{what}: {nominal:.3g~} to {alone:.3g}, the whole model {whole:.3g} (mean error on {data} from the nominal robot, "
        "frames and tool fitted)"
    )
    WORTH_UNKNOWN = Phrase("{what}: its gain could not be computed: {why}", "robocal validate judges it on data.")
    OFFSETS_MISSING = Phrase(
        "{file} has no row for {joints}: 0 is assumed", "Add a row for each, or make sure that 0 is right."
    )
    URDF_PLACEHOLDERS = Phrase(
        "effort and velocity limits are placeholders (0): a URDF must have them, a kinematic model has none",
        "Enter those of the robot where a program uses them.",
    )
    URDF_TOOL_OFF = Phrase(
        "{file}: behind the last axis there is no fixed joint that could hold the tool, which is off by {gap:.3g} and "
        "{angle:.3g}; all axes are right",
        "Add a fixed joint behind the last axis of that URDF.",
    )
    NO_TRIAL_ENDED = Phrase(
        "{output}: at {points} of {total} points no trial has a number",
        "Look at one of these points: too few poses, too much noise, or nothing was held out.",
    )
    TRIALS_LOST = Phrase(
        "{output}: at {points} of {total} points trials are lost, at most {most} of {trials}; rms, mean and scatter are "
        "those of the other trials. Such a point is worse than it looks: the lost trials are seldom the best ones"
    )
    REPEATABILITY_UNCHANGED = Phrase(
        "repeatability (RP, RD, vAP) compares measurements with each other: it needs no model, so calibration does not "
        "change it"
    )
    FEW_VISITS = Phrase(
        "the standard asks for {asked} visits; here some places have {visits}",
        "Visit every place as often as the standard asks.",
    )
    NO_STANDING_POSITIONS = Phrase("the data contain no positions of the tool by an instrument that stands still")
    VISITED_ONCE = Phrase("every place was visited once[; {what}]")
    NO_ORIENTATIONS = Phrase("no orientations were measured")
    ONE_DIRECTION = Phrase("no place was approached from several directions")
    DIRECTIONS_UNMARKED = Phrase("no column {column} marks them")
    DISTANCES_ONCE = Phrase("no distance was run repeatedly")
