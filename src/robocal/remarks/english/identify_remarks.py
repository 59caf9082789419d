"""What an identification remarks on, in English: what a careful colleague would say about data and fit."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["IdentificationRemarks"]


class IdentificationRemarks:
    """What an identification remarks on, beside its verdict."""

    PARALLEL_AXES = Phrase(
        "parallel axes ({pairs}): {convention} cannot describe a small tilt between them",
        "Use a convention with Hayati's beta[ ({better})].",
    )
    FEW_MEASUREMENTS = Phrase(
        "few measurements: {numbers} numbers for {parameters} parameters",
        "Measure more configurations: the uncertainties become smaller.",
    )
    JOINTS_STILL = Phrase(
        "these joints never move: {joints}",
        "Let every joint move through most of its range, so that each parameter is observable.",
    )
    ONE_PLANE = Phrase(
        "all points of {group} lie in one plane (within {off:.3g}): parameters across it are poorly observable",
        "Measure elsewhere too: spread the configurations over the whole space that the robot can reach.",
    )
    ABOVE_STATED_NOISE = Phrase(
        "{group}: the residual is {left:.3g} per axis, the stated noise {stated:.3g}; uncertainties are those of the fit",
        "[{option}, or the stated sigma is too small.][Numbers that are fixed "
        "explain much of the rest: free them too (--free {free}).][What is left out (pulleys, elasticity, {beyond}, the gain of drums) "
        "may explain the rest, or the stated sigma is too small.][The lenses, the print of the {target} or images of different moments may "
        "explain the rest, or the stated sigma is too small.][The robot itself may explain the rest: identify it too (leave out "
        "{choice}).][No machine errs by so much: look for wrong names of {wrong}, exchanged rows or columns, and numbers of the robot's "
        "file that are far off.]",
    )
    BELOW_STATED_NOISE = Phrase(
        "{group}: the residual is {left:.3g} per axis, the stated noise {stated:.3g}: so much noise is not in these data",
        "Check the stated sigma and its unit, or do not state it. Effects below the stated sigma were neither looked for nor found.",
    )
    PRIORS_IGNORED = Phrase("{method} ignores priors and bounds", "Use lm where priors are stated.")
    RESTARTED = Phrase("the first fit was not acceptable; {starts} further starts were tried")
    OUTLIERS = Phrase(
        "{group}: {count} of {total} rows are gross and were excluded[, whole views among them: {views}, {names}] (the farthest at "
        "configuration {configuration}[, {distance:.3g} robust standard deviations])[; {counted} of them are held out and count in the "
        "mean that decides]",
        "Look at these rows, and correct or remove them. They were not fitted.",
    )
    STRANGE = Phrase(
        "{group}: {count} of {total} rows are suspect but were used[, whole views among them: {views}, {names}] (the farthest at "
        "configuration {configuration})",
        "Look at these rows.",
    )
    CAUSE_ZEROS = Phrase("exact zeros: a lost beam, or an empty value", "Remove the row.")
    CAUSE_ALONE = Phrase(
        "one row on its own: a wrong target, a slip, or a mistyped number", "Measure it again, or remove the row."
    )
    IMPLAUSIBLE = Phrase(
        "implausible changes ({changes}): a model that was fitted to wrong data can fit well and still be wrong elsewhere",
        "Check the nominal model, and the order, signs and units of joints or cables.",
    )
    COMPUTED = Phrase(
        "{group}: the residual is {left:.2g} per axis, less than any arm repeats: joint values or readings were computed, not "
        "measured",
        "For a simulation this is correct. For a real arm, give the recorded joint values, not those computed from the readings by "
        "inverse kinematics.",
    )
    REMOUNTED = Phrase(
        "{target} seems to be mounted differently on the tool in each of {files}: with a separate target for every file, the nominal "
        "model leaves {apart:.3g} instead of {together:.3g}",
        "Give each file a separate target: another name under targets.",
    )
    SCALED = Phrase(
        "the free lengths all change by {factor:+.2%} (sigma {sigma:.2%}): real errors differ from length to length, so the instrument may "
        "read so much too long; whether the correction holds elsewhere counts that, intervals do not",
        "Check the scale of the instrument, its unit and its temperature. Where a calibrated length tells it, write how far it may be "
        "off into the data file (scale: {{sigma: 0.01 %}}).",
    )
    NUMBER_DOUBTED = Phrase(
        "{name} is fixed at {stated:.4g}, but these data give {there:.4g} ({z:.0f} sigma): the difference explains {share:.1%} of the "
        "squared residuals",
        "Check it, or identify it ({line} in the data file).",
    )
    LATE_DOUBTED = Phrase(
        "{group}: the readings seem to be taken[ {before:.3g} before][ {after:.3g} after] {than} (sigma {sigma:.2g}, {z:.0f} sigma): "
        "this time offset explains {share:.0%} of the squared residuals",
        "Check the clocks, the filters of the instrument, and whether values were read or commanded. Or measure at rest.",
    )
    SCALE_DOUBTED = Phrase(
        "the free lengths all change by {factor:+.2%} (sigma {sigma:.2%}), more than manufacturing usually leaves",
        "Check the distance, bar, radius, camera or speed that gives the scale, and its unit.",
    )
    SCALE_OPEN = Phrase(
        "these data hardly determine the scale of the arm (sigma {sigma:.2%}): the nominal lengths do",
        "State a length that gives the scale: a distance, a bar, the radius of a ball.",
    )
    MOTIONS_UNSEEN = Phrase(
        "no measurement shows {motions}: these {count} are not observable, and {held} keep their values",
        "Choose other parameters by --fix. Where absolute coordinates matter, move the result by known points.",
    )
    WORSE_THAN_UNMEASURED = Phrase(
        "with {count} numbers fixed, these measurements alone determine the others to {low:.0f~} to {high:.0f} (one standard "
        "deviation): worse than a tape measure, which leaves {expected:.0f}",
        "Measure more poses, spread wider, or some of them with an instrument.",
    )
    TOO_FEW_POSES = Phrase(
        "{poses} poses leave {left} numbers, beyond those that determine the poses, for {unknown} unknowns[: {needed} poses are "
        "needed]",
        "Measure more poses, measure some of them with an instrument as well, or state known values by --prior.",
    )
    PLACE_OPEN = Phrase(
        "only the shape is better known: no measurement shows where the coordinates of base and platform lie; absolute poses may be "
        "further off than before",
        "Measure some poses with an instrument too. Or place the robot by known points before you trust absolute poses.",
    )
    ERRORS_FOLLOW = Phrase(
        "{group}: errors follow those measured just before, more than similar poses explain ({share:.0%} of their squares, z = "
        "{z:.0f}): a target slipped, or an instrument or arm warmed up; held-out errors may then be too small",
        "Hold out blocks of time (--hold-out blocks), and measure in random order.",
    )
    NOT_LINEAR = Phrase(
        "far from linear: after one linear step in the fitted parameters the predicted residual is {promised:.3g} per axis, the "
        "actual one {left:.3g}: the iteration is needed"
    )
    ONE_STEP_MISLEADS = Phrase(
        "one linear least-squares step in all free parameters would mislead: its predicted residual is {promised:.3g} per axis, the "
        "actual one {left:.3g}; before the step it was {before:.3g}",
        "Do not use the one-step estimate (--method lse) on these data.",
    )
    CURVED = Phrase(
        "the model is curved within its own uncertainty (curvature {curvature:.2g} along {parameter}): sigmas are those of a linear "
        "model and may be far off",
        "Measure more, or look at the bootstrap (robocal identify --bootstrap 1000).",
    )
    BOOTSTRAP_SPREAD = Phrase(
        "bootstrap, {draws} draws: the fitted parameters scatter {median:.2g} times as far as the linear sigmas of the fit (median), "
        "{parameter} {worst:.2g} times; intervals in result.json[; {places} places are few for a bootstrap, its intervals are rather "
        "too narrow][; {lost} draws could not be fitted]"
    )
    PARTICLES_GAUSSIAN = Phrase(
        "under Gaussian noise, particles repeat the result of the filter",
        "--loss cauchy allows noise with heavy tails.",
    )
    PARTICLES_STUCK = Phrase(
        "only {share:.0%} of the particles' moves were accepted: they are no sample of what the data leave open"
    )
    LEAVE_ONE_OUT_LEFT = Phrase(
        "leave-one-out was not run: with this method it needs a refit for every configuration",
        "--leave-one-out runs it.",
    )
    FILTER_UNSETTLED = Phrase(
        "the further passes of the filter did not converge; the result of its first pass is returned",
        "Use lm, or state priors.",
    )
    BAND_TOO_NARROW = Phrase(
        "only {whole:.0%} of {n} held-out {quantity} lie in their 95 % region",
        "Trust the held-out errors, not the error bars.",
    )
    BAND_UNCHECKED = Phrase(
        "the prediction bands (95 %) were not checked: no set was held out as a whole",
        "Hold out a part of the configurations (--hold-out 0.2).",
    )
    BAND_PROFILED = Phrase(
        "the prediction bands (95 %) were not checked: each held-out pose comes from the rows to be predicted; the residual there "
        "counts, enlarged for the pose"
    )
    BAND_BLIND = Phrase(
        "the prediction bands (95 %) were not checked: all held-out rows depend on {names}, and no fitted row does",
        "Hold out configurations whose places and targets appear in other configurations too.",
    )
    ELSEWHERE = Phrase(
        "elsewhere in the {region}, a reading is predicted with an error of {mean:.3g} on average and {p95:.3g} at the 95th percentile, "
        "frame and tool included (one standard deviation; what is not observable is as uncertain as expected[; the residual at every "
        "pose is {left:.3g}])[; the verdict is of the {verdict} alone]"
    )
    OVER_THE_RANGE = Phrase(
        "over the {region}, wherever the robot stands, the model may be off by {band:.3g} rms[, beside the {left:.3g} that it leaves at "
        "every pose,] and differs from the nominal one by {moved:.3g}[; the nominal one is the better of the two there with a chance of "
        "{chance:.2%}][; all of this without the {scale}, which is not observable in these data]"
    )
    SCALE_SEEN = Phrase(
        "against the stated length, the free lengths all together change by {factor:+.3%} (sigma {sigma:.3%})"
    )
