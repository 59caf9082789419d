"""What an identification remarks on, in English: its verdict, the data and the fit, and what was written."""

from __future__ import annotations

from robocal.remarks.code import Code
from robocal.remarks.words import Words

__all__ = ["TABLE"]

TABLE: dict[Code, Words] = {
    # --- the verdict ---
    Code.GAIN_PROVEN: Words(
        "the mean error on unseen poses falls by {gain:.4g}, 95 % interval {low:.4g~} to {high:.4g} ({how})"
        "[; gross rows among these that are not counted: {aside}][, with them it is {otherwise:.4g}]",
        "Use the corrected model, or correct the targets of a controller that cannot (robocal compensate).",
    ),
    Code.EXACT: Words(
        "exact to the digits given: {left:.2g} rms is left on unseen poses, and rounding to the digits of the data leaves "
        "{digits:.2g}",
        "No instrument and no arm is that good: these measurements or joint values were computed. What was simulated without noise "
        "proves the model and the poses; what the real robot does shows in real measurements.",
    ),
    Code.NOMINAL_EXACT: Words(
        "the nominal model is exact to the digits given: {left:.2g} rms is left on unseen poses, and rounding to the digits of the "
        "data leaves {digits:.2g}; there is nothing to improve",
        "These measurements or joint values were computed with the nominal model itself: simulate a robot with errors "
        "(robocal simulate), or measure the real one.",
    ),
    Code.GAIN_NOT_PROVEN: Words(
        "the mean error on unseen poses does not fall significantly: {gain:.4g}, 95 % interval {low:.4g~} to {high:.4g} ({how})"
        "[; gross rows among these that are not counted: {aside}][, with them it is {otherwise:.4g}]",
        "Where far more is left than the stated noise, something in the inputs is wrong: mend that first. Else the unseen "
        "configurations do not settle it: measure more of them, or accept that the nominal model is already as good as these "
        "measurements can tell.",
    ),
    Code.NOT_CONVERGED: Words(
        "the iteration did not converge[ ({what})]",
        "Start nearer to the truth, state priors, or free fewer parameters; --iterations allows more steps.",
    ),
    Code.GAIN_ANYWAY: Words(
        "reduction of the mean error {gain:.4g}[, 95 % interval {low:.4g~} to {high:.4g}] ({how})"
        "[; gross rows among these that are not counted: {aside}][, with them it is {otherwise:.4g}]"
    ),
    Code.FEW_UNSEEN: Words(
        "fewer than {least} unseen configurations prove nothing",
        "Measure more configurations, or hold out more of them.",
    ),
    Code.NOTHING_HELD_OUT: Words(
        "nothing was held out, so nothing is proven",
        "Hold out a part of the configurations (--hold-out 0.2) or predict each from the others (--leave-one-out).",
    ),
    Code.NOTHING_MEASURED_THERE: Words(
        "no measurement was held out, so nothing is proven",
        "Hold out configurations at which something was measured.",
    ),
    Code.ONE_PLACE: Words(
        "all configurations are equal: this shows repeatability, not geometry",
        "Let every joint move through most of its range.",
    ),
    Code.RANK_ZERO: Words(
        "the data determine no parameter at all",
        "These measurements do not depend on any free parameter: free others, or measure something else.",
    ),
    Code.NOT_FINITE: Words(
        "the model cannot be evaluated on the unseen poses",
        "Look for joint values or lengths that are far too large, and state bounds or priors.",
    ),
    Code.NO_BETTER_THAN_MEAN: Words(
        "no gain over predicting the mean: {after:.3g} on unseen poses, {constant:.3g} for the mean of the measurements",
        "The joint values explain nothing of what was measured. Check that each row pairs a measurement with its own joint values, "
        "in the right order, and that units and signs of the joints agree with the model.",
    ),
    Code.UNEXPLAINED: Words(
        "the model cannot explain the data: {explained:.0%} of the variance on unseen poses, {rms:.3g} rms"
        "[, where {stated:.3g} of noise was stated]",
        "Something that the model lacks is larger than the noise. Check convention, units, tool and the order of rotations; look for "
        "a slipped target or a moved instrument in the worst configurations; and check that the stated sigma is true.",
    ),
    Code.NOTHING_OF_ROBOT: Words(
        "nothing of the robot itself is seen in these data",
        "Measure more or better, or free other parameters; only frames, targets and tool were fitted.",
    ),
    Code.NOTHING_IDENTIFIED: Words(
        "no parameter of the robot is identified: what was fitted is known in combinations alone",
        "Measurements like these are explained better, but where the robot goes is not known any better. Measure its poses with an "
        "instrument of their own, or free fewer parameters.",
    ),
    Code.FEW_NUMBERS: Words(
        "too few measurements: without one {noun} {left} numbers are left for {sought} parameters",
        "Measure more configurations: at least three times as many numbers as free parameters, and some more to hold out. Or free "
        "fewer parameters (calibrate: free in the robot file).",
    ),
    Code.BENT: Words(
        "the model had to be bent and still leaves {left:.3g} per axis",
        "Check the nominal model, and the order, signs and units of the joints.",
    ),
    Code.UNMADE: Words(
        "no robot is made so far from its drawing: {changes}",
        "If it is a number that was mistyped, write what the data say. If it is several, look for a joint that counts the other way "
        "(gain: -1), a zero that is off by 90 or 180 deg, or exchanged columns or cables: geometry was bent to meet them. If the "
        "robot truly differs so much from its drawing, state how far it may be off (calibrate: prior).",
    ),
    Code.SCALE_WRONG: Words(
        "the free lengths all change by {factor:+.2%} (sigma {sigma:.2%}): an arm errs in each on its own, so what gives "
        "the scale, or the nominal lengths, must be wrong",
        "Check the distance, bar, radius, camera, speed or instrument that gives the scale, and its unit; or state a length, "
        "where nothing does.",
    ),
    Code.NUMBER_WRONG: Words(
        "held at {stated:.4g}, {name} should by these data be {there:.4g} ({z:.0f} sigma): that explains {share:.0%} of what is left",
        "Put it right in the data file, or let it be identified ({line}).",
    ),
    Code.LATE: Words(
        "{group}: the readings look as if taken[ {before:.3g} before][ {after:.3g} after] their joint values ({z:.0f} sigma): that "
        "explains {share:.0%} of what is left",
        "Measure at rest, or bring both clocks together: the readings, or their times, moved by that. Joint values that were "
        "commanded and not read look like this too, and so may play that every path takes up one way (--groups backlash).",
    ),
    Code.HOLDS_WHERE_MEASURED: Words(
        "it holds where it was measured, not in the whole {region}: there the model may be off by {band:.3g} rms where it differs "
        "from the nominal one by {moved:.3g}, and is the worse of the two with a chance of {chance:.0%}",
        "Measure in the whole range in which the robot works; name that range (limits in the robot file, --region FILE); or, where "
        "it works only near what was measured, say so (--region measured).",
    ),
    Code.ANGLES_UNEXPLAINED: Words(
        "the angles of {group} are not explained: {left:.3g} per axis are left",
        "Check their unit, order and signs in the data file.",
    ),
    Code.ENDED_ELSEWHERE: Words(
        "the fit to everything ended elsewhere: it leaves {left:.3g} on average where the fit without the unseen ones left {after:.3g}",
        "The data support more than one answer. Measure more configurations, or state priors.",
    ),
    Code.TOO_MANY_ASIDE: Words(
        "{share:.0%} of the rows are far from what the others say, more than {most:.0%}: these are no outliers, and what is right "
        "cannot be told",
        "Look at the rows that are named: several targets or instruments in one file, a wrong pairing of rows, a target that moved. "
        "Leave out what is wrong, or measure again.",
    ),
    Code.SEGMENT: Words(
        "{file}: from row {first} to row {last} everything is off[ by {shift:.3g}][, turned by {turn:.3g}], as if the {moved} had "
        "moved ({count} rows, {strength:.1f} times what is left elsewhere)",
        "Leave these rows out of this data file (exclude: {first}-{last}) and read them by another one, which excludes the others "
        "and says {line}; or do without them (--exclude {first}-{last}).",
    ),
    Code.SEGMENT_OF_TARGET: Words(
        "{file}: from row {first} to row {last} what was measured of {target} is off[ by {shift:.3g}][, turned by {turn:.3g}], as if "
        "it had moved ({count} rows, {strength:.1f} times what is left elsewhere)",
        "Give it another name from row {first} to row {last} in the column of targets, or do without these rows "
        "(--exclude {first}-{last}).",
    ),
    Code.SEGMENT_OF_ZERO: Words(
        "{file}: from row {first} to row {last} {zero} is off[ by {shift:.3g}], as if what it belongs to had slipped or its sensor "
        "been set anew ({count} rows, {strength:.1f} times what is left elsewhere)",
        "Look at the drum and at the sensor; do without these rows (--exclude {begin}-{end}), or, where it was set anew, put them into a "
        "file of their own with `zeros: NAME`.",
    ),
    # --- what a careful colleague would say about data and fit ---
    Code.PARALLEL_AXES: Words(
        "parallel axes ({pairs}): {convention} cannot write a small tilt between them",
        "Use a convention with Hayati's beta[ ({better})].",
    ),
    Code.FEW_MEASUREMENTS: Words(
        "few measurements: {numbers} numbers for {parameters} parameters",
        "Measure more configurations: they narrow the result.",
    ),
    Code.JOINTS_STILL: Words(
        "these joints never move: {joints}",
        "Let every joint move through most of its range, so that each parameter shows.",
    ),
    Code.ONE_PLANE: Words(
        "all points of {group} lie in one plane (within {off:.3g}): parameters across it are poorly seen",
        "Measure elsewhere too: spread the configurations over the whole space that the robot can reach.",
    ),
    Code.ABOVE_STATED_NOISE: Words(
        "{group}: the model leaves {left:.3g} per axis where {stated:.3g} of noise was stated; uncertainties are those of the fit",
        "What geometry does not explain may be found beyond it (identify --groups), or the stated sigma is too small.",
    ),
    Code.BELOW_STATED_NOISE: Words(
        "{group}: the model leaves {left:.3g} per axis where {stated:.3g} of noise was stated: so much noise is not in these data",
        "Check the stated sigma and its unit, or leave it out: what lies below it was neither sought nor found.",
    ),
    Code.PRIORS_IGNORED: Words("{method} takes no notice of priors and bounds", "Use lm where priors are stated."),
    Code.RESTARTED: Words("the first fit was not acceptable; {starts} further starts were tried"),
    Code.OUTLIERS: Words(
        "{group}: {count} of {total} rows are gross and were set aside (the farthest at configuration {configuration}[, {distance:.3g} "
        "robust standard deviations])[; held out, {counted} of them are counted in the mean that decides]",
        "Look at these rows, and mend or remove them. They were not fitted.",
    ),
    Code.STRANGE: Words(
        "{group}: {count} of {total} rows are far from what the others say but were used (the farthest at configuration "
        "{configuration})",
        "Look at these rows.",
    ),
    Code.CAUSE_ZEROS: Words("exact zeros: a dropped beam, or an empty value", "Remove the row."),
    Code.CAUSE_ALONE: Words(
        "one row on its own: a wrong target, a slip, or a mistyped number", "Measure it again, or remove the row."
    ),
    Code.IMPLAUSIBLE: Words(
        "implausible changes ({changes}): a model that is bent to wrong data can fit well and still be wrong elsewhere",
        "Check the nominal model, and the order, signs and units of the joints.",
    ),
    Code.COMPUTED: Words(
        "{group}: the model leaves {left:.2g} per axis, less than any arm repeats: joint values or readings were computed, not measured",
        "Of a simulation this is as it should be. Of a real arm, give the joint values that were recorded, not those that follow "
        "from the readings by inverse kinematics.",
    ),
    Code.REMOUNTED: Words(
        "{target} sits otherwise on the tool in each of {files}: with a target of its own for every file the nominal model leaves "
        "{apart:.3g} instead of {together:.3g}",
        "Give each file a target of its own: another name under targets.",
    ),
    Code.SCALED: Words(
        "the free lengths all change by {factor:+.2%} (sigma {sigma:.2%}): an arm errs in each on its own",
        "Check the scale of the instrument, its unit and its temperature.",
    ),
    Code.NUMBER_DOUBTED: Words(
        "held at {stated:.4g}, {name} should by these data be {there:.4g} ({z:.0f} sigma): that explains {share:.1%} of what is left",
        "Check it, or let it be identified ({line} in the data file).",
    ),
    Code.LATE_DOUBTED: Words(
        "{group}: the readings look as if taken[ {before:.3g} before][ {after:.3g} after] their joint values ({z:.0f} sigma): that "
        "explains {share:.0%} of what is left",
        "Check the clocks, whether joint values were read or commanded, and filters of the instrument; or measure at rest.",
    ),
    Code.SCALE_DOUBTED: Words(
        "the free lengths all change by {factor:+.2%} (sigma {sigma:.2%}), more than making mostly leaves",
        "Check the distance, bar, radius, camera or speed that gives the scale, and its unit.",
    ),
    Code.SCALE_OPEN: Words(
        "these data hardly say how long the arm is (sigma of the scale {sigma:.2%}): the nominal lengths do",
        "State a length that gives the scale: a distance, a bar, the radius of a ball.",
    ),
    Code.MOTIONS_UNSEEN: Words(
        "nothing that was measured shows {motions}: the data cannot tell these {count}, and {held} stay where they were",
        "State other numbers by --fix, or move the result by points that are known, where absolute coordinates matter.",
    ),
    Code.WORSE_THAN_UNMEASURED: Words(
        "with {count} numbers held, these measurements alone know the others to {low:.0f~} to {high:.0f} (one standard deviation): "
        "worse than a tape measure, which leaves {expected:.0f}",
        "Measure more poses, spread wider, or some of them with an instrument.",
    ),
    Code.TOO_FEW_POSES: Words(
        "{poses} poses leave {left} numbers, beyond what it takes to place them, for {unknown} unknowns[: it takes {needed} poses]",
        "Measure more poses, measure some of them with an instrument as well, or state what is known by --prior.",
    ),
    Code.PLACE_OPEN: Words(
        "only the shape is better known: nothing was measured that says where the coordinates of base and platform lie, so absolute poses "
        "may be further off than before",
        "Measure some poses with an instrument as well, or place the corrected robot by known points before you trust absolute poses.",
    ),
    Code.ERRORS_FOLLOW: Words(
        "{group}: errors follow those measured just before, beyond what like poses share ({share:.0%} of their squares, z = {z:.0f}): "
        "a target that slipped, or an instrument or arm that warmed up; held-out errors may then flatter",
        "Hold out blocks of time (--hold-out blocks), and measure in random order.",
    ),
    Code.NOT_LINEAR: Words(
        "far from linear: one linear step in the fitted parameters promises {promised:.3g} per axis and leaves {left:.3g}",
        "The iteration that was done is needed; other starts may end elsewhere.",
    ),
    Code.ONE_STEP_MISLEADS: Words(
        "one linear least-squares step in everything that is free would mislead: it promises {promised:.3g} per axis and leaves "
        "{left:.3g}, where {before:.3g} were before",
        "Do not use the one-step estimate (--method lse) on these data.",
    ),
    Code.CURVED: Words(
        "the model bends within its own uncertainty (curvature {curvature:.2g} along {parameter}): sigmas are those of a linear "
        "model and may be far off",
        "Measure more, or look at the bootstrap (--bootstrap 1000).",
    ),
    Code.BOOTSTRAP_SPREAD: Words(
        "bootstrap, {draws} draws: the fitted parameters scatter {median:.2g} times as far as the linear bars of the fit say "
        "(median), {parameter} {worst:.2g} times; intervals in result.json"
        "[; {places} places are few for a bootstrap, its intervals are rather too narrow][; {lost} draws could not be fitted]"
    ),
    Code.PARTICLES_GAUSSIAN: Words(
        "particles under Gaussian noise repeat the filter", "--loss cauchy lets the noise have heavy tails."
    ),
    Code.PARTICLES_STUCK: Words(
        "only {share:.0%} of the particles' moves were accepted", "Take more particles (--particles), or lm."
    ),
    Code.LEAVE_ONE_OUT_LEFT: Words(
        "leave-one-out was left out: this method takes a refit for every configuration", "--leave-one-out does it."
    ),
    Code.FILTER_UNSETTLED: Words(
        "the filter's further passes did not settle; its first pass is returned", "Use lm, or state priors."
    ),
    Code.BAND_TOO_NARROW: Words(
        "only {whole:.0%} of {n} held-out {quantity} lie in their 95 % region",
        "Trust the held-out errors, not the bars.",
    ),
    Code.BAND_UNCHECKED: Words(
        "the bands were not checked: no set was held out as a whole",
        "Hold out a part of the configurations (--hold-out 0.2).",
    ),
    Code.BAND_PROFILED: Words(
        "the bands were not checked: the pose of each held-out configuration is found from the very rows that are to be predicted",
        "What a held-out configuration leaves, enlarged for its pose, is the error that counts.",
    ),
    Code.BAND_BLIND: Words(
        "the bands were not checked: all that was held out depends on {names}, which nothing that was fitted has seen",
        "Hold out configurations whose places and targets are also met by others.",
    ),
    Code.ELSEWHERE: Words(
        "elsewhere in the {region}, the predicted error is {mean:.3g} on average and {p95:.3g} at the 95th percentile (one standard "
        "deviation; what was not seen is as uncertain as expected[, and {left:.3g} is left at every pose])"
    ),
    Code.OVER_THE_RANGE: Words(
        "over the {region}, the model may be off by {band:.3g} rms and differs from the nominal one by {moved:.3g}; the nominal "
        "one is the better of the two there with a chance of {chance:.2%}[ (all of this apart from the {scale}, which these data do "
        "not see)]"
    ),
    Code.SCALE_SEEN: Words(
        "against the stated length, the free lengths all together change by {factor:+.3%} (sigma {sigma:.3%})"
    ),
    # --- the joint offsets alone ---
    Code.OFFSETS_PROVEN: Words(
        "joint offsets only: mean error on unseen poses {before:.3g~} to {after:.3g}, whole model {whole:.3g} (gain {low:.3g~} to "
        "{high:.3g} with 95 %, {how})",
        "robocal export --format offsets writes them for a controller that takes nothing else.",
    ),
    Code.OFFSETS_NOT_PROVEN: Words(
        "joint offsets only would gain nothing for certain: mean error on unseen poses {before:.3g~} to {after:.3g}, whole model "
        "{whole:.3g} (gain {low:.3g~} to {high:.3g} with 95 %, {how})",
        "What this robot needs is no joint offset. Use the whole model (export --format yaml or urdf), or correct the targets of a "
        "controller that cannot (robocal compensate).",
    ),
    Code.OFFSETS_UNSEEN: Words(
        "no joint offset is seen in these measurements beside frames and tool",
        "Move every joint through most of its range, or hold the tool or the instrument's frame where you know them.",
    ),
    # --- what was written ---
    Code.URDF_LACKS: Words(
        "calibrated.urdf cannot hold the fitted {names}, so by itself it is not the identified robot; the run folder is",
        "Give the folder to validate, export or simulate.",
    ),
}
