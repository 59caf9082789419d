"""The verdict of an identification, and why, in English."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["VerdictRemarks"]


class VerdictRemarks:
    """The verdict and its reasons."""

    GAIN_PROVEN = Phrase(
        "the mean error[ of {what}][ ({before:.4g~} to {after:.4g})] on unseen poses falls by {gain:.4g}, 95 % "
        "interval {low:.4g~} to {high:.4g} ({how})[; gross rows that are not counted: {aside}][; with them it is {otherwise:.4g}]",
        "Use the corrected model, or correct the targets of a controller that cannot (robocal compensate).",
    )
    FRAMES_LOCATED = Phrase(
        "{names}: unseen poses are met within {left:.3g} rms ({how}), and 95 % of all errors[ at the {place}] are expected "
        "below {told:.3g}",
        "Copy the poses of these frames, with their sigma, to whatever works with them.",
    )
    IMAGE_PLACES = Phrase(
        "the images of {instruments} together have the target {mean:.3g} from where the robot has it (mean of {poses} unseen poses, "
        "median {median:.3g}, largest {largest:.3g})"
    )
    FRAMES_NOT_EXPLAINED = Phrase(
        "{names}: unseen poses are missed by {left:.3g} rms ({how}), {times:.1f} times what the noise and the making of the robot allow "
        "({allowed:.3g})",
        "Look for readings beside the joint values of another moment, for the unit and the form of orientations, and for zeros of the "
        "joints. If the robot itself is off, identify it too: leave out --free.",
    )
    EXACT = Phrase(
        "exact to the digits given: unseen poses are missed by {left:.2g} rms; rounding to the digits of the data gives {digits:.2g}",
        "No instrument and no robot is that good: these measurements or joint values were computed. A simulation without noise "
        "proves the model and the poses. Only real measurements show what the real robot does.",
    )
    NOMINAL_EXACT = Phrase(
        "the nominal model is exact to the digits given: the residual on unseen poses is {left:.2g} rms; rounding to the digits of "
        "the data gives {digits:.2g}; there is nothing to improve",
        "These measurements or joint values were computed with the nominal model itself. Simulate a robot with errors (robocal "
        "simulate), or measure the real one.",
    )
    GAIN_NOT_PROVEN = Phrase(
        "the mean error[ of {what}][ ({before:.4g~} to {after:.4g})] on unseen poses does not fall significantly: "
        "{gain:.4g}, 95 % interval {low:.4g~} to {high:.4g} ({how})[; gross rows that are not counted: {aside}][; with them it is "
        "{otherwise:.4g}]",
        "If the residual is far above the stated noise, an input is wrong: correct it first. Otherwise the unseen configurations do "
        "not decide: measure more of them. Or accept that the nominal model is already as good as these measurements can show.",
    )
    NOT_CONVERGED = Phrase(
        "the iteration did not converge[ ({what})]",
        "Start nearer to the solution, state priors, or free fewer parameters. `identify --iterations` allows more steps.",
    )
    GAIN_ANYWAY = Phrase(
        "reduction of the mean error[ of {what}] {gain:.4g}[, 95 % interval {low:.4g~} to {high:.4g}] ({how})[; gross rows that are "
        "not counted: {aside}][; with them it is {otherwise:.4g}]"
    )
    FEW_UNSEEN = Phrase(
        "fewer than {least} unseen configurations prove nothing",
        "Measure more configurations, or hold out more of them.",
    )
    FEW_PLACES = Phrase(
        "fewer than {least} places were measured[ by {instrument}]",
        "Measure at other poses: visits of one place repeat each other, however many they are.",
    )
    NOTHING_HELD_OUT = Phrase(
        "nothing was held out, so nothing is proven",
        "Hold out a part of the configurations (`identify --hold-out 0.2`) or predict each from the others (`identify --leave-one-out`).",
    )
    NOTHING_MEASURED_THERE = Phrase(
        "no measurement was held out, so nothing is proven", "Hold out configurations at which something was measured."
    )
    ONE_PLACE = Phrase(
        "all configurations are equal: this shows repeatability, not geometry",
        "Let every joint move through most of its range.",
    )
    RANK_ZERO = Phrase(
        "the data determine no parameter at all",
        "These measurements do not depend on any free parameter: free others, or measure something else.",
    )
    NOT_FINITE = Phrase("the model cannot be evaluated on the unseen poses: its numbers overflow there")
    NO_BETTER_THAN_MEAN = Phrase(
        "no gain over predicting the mean: {after:.3g} on unseen poses, {constant:.3g} for the mean of the measurements",
        "The joint values explain nothing of the measurements. Check that each row pairs a measurement with the joint values of the "
        "same moment, in the right order. Check that units and signs of the joints agree with the model.",
    )
    UNEXPLAINED = Phrase(
        "the model cannot explain the data: {explained:.0%} of the variance on unseen poses, {rms:.3g} rms[, where {stated:.3g} of "
        "noise was stated]",
        "The model lacks an effect that is larger than the noise. Check convention, units, tool and the order of rotations. In the "
        "worst configurations, look for a slipped target or a moved instrument. Check also the stated sigma.",
    )
    NOTHING_OF_ROBOT = Phrase(
        "no parameter of the robot itself is observable in these data",
        "Only frames, targets and tool were fitted. If the residual is far above the stated noise, correct what is wrong first: names of "
        "targets, rows, units. Otherwise measure more or better, or free other parameters.",
    )
    NOTHING_IDENTIFIED = Phrase(
        "no parameter of the robot is identified: the data determine only combinations",
        "The fitted model explains measurements like these better, but the positions of the robot are known no better. Measure its "
        "poses with an external instrument, or free fewer parameters.",
    )
    FEW_NUMBERS = Phrase(
        "too few measurements: without one {noun} {left} numbers remain for {sought} parameters",
        "Measure more configurations: at least three times as many numbers as free parameters, and some more to hold out. Or free "
        "fewer parameters (calibrate: free in the robot file).",
    )
    BENT = Phrase(
        "the fit changes the model implausibly, and the residual is still {left:.3g} per axis",
        "Check the nominal model, and the order, signs and units of joints or cables.",
    )
    UNMADE = Phrase(
        "changes far outside manufacturing tolerances: {changes}",
        "If one number was mistyped, correct it to what the data show. If several parameters changed, look for a joint that counts "
        "the other way (gain: -1). Look also for a zero that is off by 90 or 180 deg, and for exchanged columns or cables. Each of "
        "these errors forces the fit to change the geometry. Encoders of cables that were set anew have zeros of their own (`zeros: NAME` "
        "in the file of lengths). If the robot truly differs so much from its drawing, state how far it may be off (calibrate: prior).",
    )
    SCALE_WRONG = Phrase(
        "the free lengths all change by {factor:+.2%} (sigma {sigma:.2%}): real errors differ from length to length, so the source "
        "of the scale, or the nominal lengths, must be wrong",
        "Check the distance, bar, radius, camera, speed or instrument that gives the scale, and its unit. If nothing gives the "
        "scale, state a length.",
    )
    NUMBER_WRONG = Phrase(
        "{name} is fixed at {stated:.4g}, but these data give {there:.4g} ({z:.0f} sigma): the difference explains {share:.0%} of the "
        "squared residuals",
        "Correct it in the data file, or identify it ({line}).",
    )
    LATE = Phrase(
        "{group}: the readings seem to be taken[ {before:.3g} before][ {after:.3g} after] {than} (sigma {sigma:.2g}, {z:.0f} sigma): "
        "this time offset explains {share:.0%} of the squared residuals",
        "Measure at rest, or synchronise both clocks: shift the readings, or their times, by this offset.[ Commanded joint "
        "values in place of actual ones look the same. So may backlash that every path takes up in one direction ({option}).]",
    )
    HOLDS_WHERE_MEASURED = Phrase(
        "the model holds where it was measured, not in the whole {region}: there it may be off by {band:.3g} rms; it differs from "
        "the nominal model by {moved:.3g}[, and is the worse of the two with a chance of {chance:.0%}]",
        "[The scale of {scale} decides: measure a calibrated length with it, and write into its data file how far its scale may be off "
        "(scale: {{sigma: 0.01 %}}).][Measure in the whole range in which the robot works, or state that it works only near the measured "
        "poses ({near}).][ Or name that range ({names}).]",
    )
    LEFT = Phrase(
        "{group}: the fit leaves {left:.3g} per axis, {share:.1%} of the size of the machine ({size:.3g})[; the stated noise is "
        "{stated:.3g}]: the model does not describe these data",
        "Look for wrong names of targets, for exchanged rows, columns or cables, and for numbers of the robot's file that are far "
        "off. If the instrument itself is so coarse, state its noise (sigma).",
    )
    ANGLES_UNEXPLAINED = Phrase(
        "the angles of {group} are not explained: the residual is {left:.3g} per axis",
        "Check their unit, order and signs in the data file.",
    )
    ENDED_ELSEWHERE = Phrase(
        "the fit to all data ended elsewhere: its mean error on the unseen poses is {left:.3g}, that of the fit without them "
        "{after:.3g}: these data support more than one solution"
    )
    TOO_MANY_ASIDE = Phrase(
        "{share:.0%} of the rows disagree with the others, more than {most:.0%}: these are no outliers, and the data do not show "
        "which rows are right",
        "Look at the named rows. Possible causes: several targets or instruments in one file, a wrong pairing of rows, a target that "
        "moved. Leave out the wrong rows, or measure again.",
    )
    SEGMENT = Phrase(
        "{file}: from row {first} to row {last} everything is off[ by {shift:.3g}][, turned by {turn:.3g}]; the {moved} "
        "seems to have moved ({count} rows, {strength:.1f} times the residual elsewhere)",
        "Leave these rows out of this data file (exclude: {first}-{last}). Read them by a second data file, which excludes "
        "the other rows and states {line}. Or do without them (--exclude {first}-{last}). If another robot gave these rows, "
        "calibrate it by a file of its own.",
    )
    SEGMENT_OF_TARGET = Phrase(
        "{file}: from row {first} to row {last} the readings of {target} are off[ by {shift:.3g}][, turned by {turn:.3g}]; "
        "it seems to have moved ({count} rows, {strength:.1f} times the residual elsewhere)",
        "Give the target another name from row {first} to row {last}, in the column of targets. Or do without these rows "
        "(--exclude {first}-{last}).",
    )
    SEGMENT_OF_ZERO = Phrase(
        "{file}: from row {first} to row {last} {zero} is off[ by {shift:.3g}]; the drum seems to have slipped, or the "
        "sensor to have been reset ({count} rows, {strength:.1f} times the residual elsewhere)",
        "Look at the drum and at the sensor. Do without these rows (--exclude {begin}-{end}). If the sensor was reset, put "
        "the rows into a separate file with `zeros: NAME`.",
    )
