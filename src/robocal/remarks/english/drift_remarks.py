"""What is remarked on two runs of one robot, in English."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["DriftRemarks"]


class DriftRemarks:
    """What is remarked on two runs of one robot."""

    CHANGE_BELOW = Phrase(
        "change of the robot {change:.2g}, 95 % interval {low:.2g~} to {high:.2g} (mean over the {region}): less than the "
        "{matters:.3g} that matter"
    )
    CHANGE_ABOVE = Phrase(
        "change of the robot {change:.2g}, 95 % interval {low:.2g~} to {high:.2g} (mean over the {region}): more than the "
        "{matters:.3g} that matter",
        "Use the later run, and look for what happened between the two.",
    )
    CHANGE_OPEN = Phrase(
        "change of the robot {change:.2g}, 95 % interval {low:.2g~} to {high:.2g} (mean over the {region}): these runs do "
        "not decide whether it is above or below the {matters:.3g} that matter",
        "Measure the same poses again: errors that the model cannot describe then cancel in the difference. Or measure "
        "more.",
    )
    CHANGE_SETTLED_BY = Phrase(
        "if the change is as large as it seems, about {poses} poses in each run would decide; {first} and {second} were "
        "measured"
    )
    PREDICTIONS_APART = Phrase(
        "the predictions of the two models differ by {rms:.3g} rms, at most {largest:.3g}; without a change they would "
        "differ by {expected:.3g}, rarely by more than {limit:.3g} (chance {chance:.2g})"
    )
    PARAMETERS_DIFFER = Phrase(
        "without a change, parameters would differ as much with a chance of {chance:.2g} ({rank} combinations are "
        "observable in both runs)"
    )
    NO_CHANGE_FOUND = Phrase(
        "nothing changed by more than chance explains; a smaller change is possible",
        "Measure more, to find smaller changes.",
    )
    SHOWS_IN = Phrase("the change shows in {names}")
    SHOWS_IN_SUMS = Phrase("no parameter by itself changed significantly, only combinations of them")
    ONE_CAUSE = Phrase("a change of one parameter alone would explain it: {causes}")
    BELOW_SCATTER = Phrase("that is less than the {left:.3g} per axis by which single measurements scatter")
    ERRORS_SHARED = Phrase(
        "errors that repeat with {by} are no noise: the variance used is {factor:.2g} times as large as fitted",
        "Measure the same poses in both runs: such errors then cancel in the difference.",
    )
    ERRORS_CANCEL = Phrase(
        "{same:.0%} of the poses were measured in both runs, so errors of the model cancel in the difference; the variance "
        "is {factor:.2g} of that of independent runs"
    )
    SAME_MEASUREMENTS = Phrase(
        "both runs were fitted to the same measurements ({files}): that shows no change, whatever happened",
        "Identify the second run from new measurements.",
    )
    RUN_REFUSED = Phrase(
        "{run}: the verdict of this run was refused, so its parameters mean nothing", "Correct that run first."
    )
    RUN_NOT_IMPROVED = Phrase(
        "{run}: the verdict of this run was not improved",
        "Identify it from more or better measurements: its parameters may not describe the robot.",
    )
    FREE_IN_ONE = Phrase("free in one run only: {names}; fixed at the nominal value in the other")
    ROWS_NOT_KEPT = Phrase(
        "{run} does not contain the rows of its fit, so errors that repeat with a place count as noise",
        "Identify it once more with this version, from positions or poses at known joint values.",
    )
    TRUTH_MET = Phrase(
        "errors are as large as their standard deviations say: {within} of {n} lie within two of them, chi2 {chi2:.3g} of {rank} "
        "degrees of freedom (chance {chance:.2g})"
    )
    TRUTH_MISSED = Phrase(
        "errors are larger than their standard deviations say: {within} of {n} lie within two of them, chi2 {chi2:.3g} of {rank} "
        "degrees of freedom (chance {chance:.2g})",
        "Compare robot file and truth: what differs between them and was not free in the run is in these errors.",
    )
    TRUTH_MISSED_BY = Phrase(
        "farther from the truth than chance explains: {names}",
        "Check these numbers in the truth file, and whether anything else that the run held fixed was true.",
    )
    TRUTH_HELD = Phrase(
        "the run held {names}, of which the truth differs: what was identified carries these errors, and no standard deviation does",
        "Free them in the run, or simulate with them at their nominal values.",
    )
    NOT_COMPARED = Phrase("identified, but not compared, because the truth does not hold them: {names}")
