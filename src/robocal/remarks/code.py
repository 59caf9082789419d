"""Everything that robocal may remark on, by name; the names stand in result.json and do not change."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["Code"]


class Code(StrEnum):
    """What is said; see `robocal.remarks.english` for the sentence and the advice of each."""

    # --- the verdict ---
    GAIN_PROVEN = "gain-proven"
    GAIN_NOT_PROVEN = "gain-not-proven"
    NOT_CONVERGED = "not-converged"
    GAIN_ANYWAY = "gain-anyway"
    FEW_UNSEEN = "few-unseen"
    NOTHING_HELD_OUT = "nothing-held-out"
    NOTHING_MEASURED_THERE = "nothing-measured-there"
    ONE_PLACE = "one-place"
    RANK_ZERO = "rank-zero"
    NOT_FINITE = "not-finite"
    NO_BETTER_THAN_MEAN = "no-better-than-mean"
    UNEXPLAINED = "unexplained"
    NOTHING_OF_ROBOT = "nothing-of-robot"
    FEW_NUMBERS = "few-numbers"
    BENT = "bent"
    SHRUNK = "shrunk"
    ANGLES_UNEXPLAINED = "angles-unexplained"
    ENDED_ELSEWHERE = "ended-elsewhere"

    # --- what a careful colleague would say about data and fit ---
    PARALLEL_AXES = "parallel-axes"
    FEW_MEASUREMENTS = "few-measurements"
    JOINTS_STILL = "joints-still"
    ONE_PLANE = "one-plane"
    ABOVE_STATED_NOISE = "above-stated-noise"
    PRIORS_IGNORED = "priors-ignored"
    RESTARTED = "restarted"
    OUTLIERS = "outliers"
    IMPLAUSIBLE = "implausible"
    SCALED = "scaled"
    ERRORS_FOLLOW = "errors-follow"
    NOT_LINEAR = "not-linear"
    ONE_STEP_MISLEADS = "one-step-misleads"
    CURVED = "curved"
    BOOTSTRAP_SPREAD = "bootstrap-spread"
    PARTICLES_GAUSSIAN = "particles-gaussian"
    PARTICLES_STUCK = "particles-stuck"
    FILTER_UNSETTLED = "filter-unsettled"
    LEAVE_ONE_OUT_LEFT = "leave-one-out-left"
    BAND_TOO_NARROW = "band-too-narrow"
    ELSEWHERE = "elsewhere"

    # --- drift: two runs of one robot ---
    CHANGE_BELOW = "change-below"
    CHANGE_ABOVE = "change-above"
    CHANGE_OPEN = "change-open"
    CHANGE_SETTLED_BY = "change-settled-by"
    PREDICTIONS_APART = "predictions-apart"
    PARAMETERS_DIFFER = "parameters-differ"
    SHOWS_IN = "shows-in"
    SHOWS_IN_SUMS = "shows-in-sums"
    ONE_CAUSE = "one-cause"
    BELOW_SCATTER = "below-scatter"
    ERRORS_SHARED = "errors-shared"
    ERRORS_CANCEL = "errors-cancel"
    SAME_MEASUREMENTS = "same-measurements"
    RUN_REFUSED = "run-refused"
    RUN_NOT_IMPROVED = "run-not-improved"
    FREE_IN_ONE = "free-in-one"
    ROWS_NOT_KEPT = "rows-not-kept"

    # --- what was written ---
    URDF_LACKS = "urdf-lacks"
    REPORT_LEFT_OUT = "report-left-out"
