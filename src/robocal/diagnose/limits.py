"""Every number on which a verdict, a remark or an exit status hangs: what it is, in which unit, why so much, and where from.

    LATE_SHARE = limit(0.5, "of the squares left", "why this number", "source")

A limit is a plain number where it is used. `LIMITS` lists all of them by name; docs/verdicts.md prints that table. Tolerances of
arithmetic and sizes of grids are no limits: they stay beside their formula, with `# tolerance: why` or `# grid: why`.
"""

from __future__ import annotations

import math

from robocal.diagnose import drive_limits as of_drives
from robocal.diagnose import vision_limits as of_vision
from robocal.fit import limits as of_fit
from robocal.fit.limits import (
    BASELINE_LESS,
    DECLARED,
    FRAME_NEVER_TURNED,
    FRAME_TURNED,
    PLACE_DIAMETER,
    PLACE_GAP,
    PLACE_SHARE,
    START_ASKS,
    START_CLEARLY,
    START_LOST,
    START_POSES,
    Limit,
    limit,
    topic,
)

# fmt: off
__all__ = [
    "BASELINE_LESS", "FRAME_NEVER_TURNED", "FRAME_TURNED", "LIMITS", "PLACE_DIAMETER", "PLACE_GAP", "PLACE_SHARE", "START_ASKS",
    "START_CLEARLY", "START_LOST", "START_POSES", "Limit", "limit", "topics",
]

topic("Gross rows")
GROSS_DISTANCE = limit(6.0, "robust sigma", "Six sigma happen once in 10^9 honest rows, so no honest row is lost.")
GROSS_TAILS = limit(2.0, "times that",
    "Where the scale is what a model leaves, tails are longer than those of noise.", "tests/statistics/test_gross_rows.py")
GROSS_SHARE = limit(0.2, "of the rows", "A larger share of excluded rows are no outliers any more.")
VIEW_FAR = limit(0.5, "of the rows of a view", "More than half fail together; one corner fails alone.", "tests/diagnose/test_views.py")
VIEW_FITS = limit(5.0, "times the median error", "A view that is where it belongs misses by no more.", "tests/diagnose/test_views.py")
VIEWS_ASK = limit(5e-3, "of the focal length, or of the reading",
    "No nominal machine misses a quarter of the points by more than 5 mm at 1 m.", "tests/diagnose/test_camera_views.py")
VIEWS_RIGHT = limit(0.75, "of the rows",
    "A quarter may be gross; more are looked for in what is wrong with all.", "tests/diagnose/test_camera_views.py")
VIEWS_BEHIND = limit(0.5, "of the views", "A camera sees what is before it.", "tests/diagnose/test_camera_views.py")
ZERO_ROWS_SHARE = limit(0.5, "of the rows", "Zeros in more rows are what an instrument reads (a ball in a socket), no dropped beam.")
MATCH_CHANCE = limit(1e-3, "chance", "A row that fits another place is taken for one that does not, once in a thousand.")
MATCH_LUCK = limit(0.05, "rows", "So many other rows may fit by luck where one does.")
SHIFTED_ROWS = limit(2, "rows", "One row with a shifted column may be chance, two are not.")
FINEST_ERROR = limit(1e-5, "m",
    "No arm repeats better: what is left below is rounding, or numbers that were computed.", "repeatability in data sheets (ISO 9283)")
ROUNDING_MARGIN = limit(3.0, "times", "So many times what the digits carry are still nothing but rounding.")

CABLE_RIG_CHANCE = limit(1e-6, "chance",
    "A rig is stopped for nothing once in a million; what stops it is many sigma off.", "tests/cli/test_wrong_rigs.py")
CABLE_RIG_STOP = limit(0.01, "chance",
    "Where a motion failed something is wrong; one in a hundred is enough to say what.", "tests/cli/test_wrong_rigs.py")
SLACK_LEAST = limit(4, "gross lengths", "Fewer of one cable are chance.", "tests/prove/test_slack.py")
SLACK_SHARE = limit(0.9, "of the gross lengths", "So many are of the cable that hangs, and too long.", "tests/prove/test_slack.py")
SLACK_SPAN = limit(0.6, "of the rows", "Gross rows of a drum that slipped are those of one end.", "tests/prove/test_segments_of_cables.py")
SLACK_PARTS = limit(0.34, "runs for each gross length", "Rows that lie together are a drum that slipped.", "tests/prove/test_slack.py")

topic("Something moved for a part of a file")
SEGMENT_CHANCE = limit(1e-6, "chance",
    "Of naming anything in a file where nothing moved, after all that was tried.", "tests/prove/test_segments.py")
SEGMENT_SIZE = limit(3.0, "sigma per axis", "A step must stand out of what model and noise leave.")
SEGMENT_ZERO_SIZE = limit(1.5, "sigma",
    "One sensor's zero is contradicted by all other sensors, so less is enough.", "tests/prove/test_segments_of_cables.py")
SEGMENT_SEEN = limit(1.5, "sigma", "The same after the model's own answer.")
SEGMENT_SHARE = limit(0.15, "of the squares left",
    "Of a machine with poses of its own a step that explains more is large: a fit that follows it leaves few sigma.",
    "tests/prove/test_moved_cables.py")
SEGMENT_MAJORITY = limit(0.8, "of the rows", "So many rows of a segment must have moved alike: gross rows do not.")
SEGMENT_SMALL = limit({"m": 1e-5, "rad": 1e-5, "px": 0.05}, "m, rad, px",
    "What moved by less matters to no one, however exact the numbers are.")
SEGMENT_COUNT = limit(6, "segments", "A file with more of them is no longer one measurement.")
SEGMENT_RIVAL = limit(0.5, "of the best gain", "Causes that gain as much are compared.")
SEGMENT_ALIKE = limit(20.0, "of -2 log likelihood",
    "A cause that leaves no more than this beside the best one is named with it.", "tests/prove/test_moved_cables.py")
SEGMENT_ROWS = limit(5, "rows", "Fewer rows on either side are met by any step.")
SEGMENT_VIEWS = limit(3, "views", "Two that were exchanged lie beside each other, and nothing moved.", "tests/diagnose/test_views.py")
SEGMENT_NUMBERS = limit(4, "numbers", "For each of what a step may have moved: fewer are met by any step.")
FRAME_CHANCE = limit(1e-3, "chance",
    "A frame that stays where it was is named once in a thousand files.", "tests/diagnose/test_frame_steps.py")
FRAME_FITTED = limit(0.5, "of the rows of a place",
    "A frame of which the rows of one place were set aside is right where the others have it.", "tests/diagnose/test_frame_steps.py")
FRAME_SCATTER = limit(2.0, "times the noise", "Views of a machine that does not err exceed it once in a thousand files of nine views.",
    "chi2, six degrees of freedom")
FRAME_SHARE = limit(0.75, "of the squares", "The best step explains so much of a ramp: what explains more does not change slowly.",
    "variance of a ramp and of its halves")
FRAME_OTHERWISE = limit(1.0, "rad", "Nobody sets a target up so wrong: corners are counted from elsewhere, at least a quarter of a turn.",
    "tests/prove/test_cable_camera_mistakes.py")
FRAME_BIAS = limit(3.0, "sigma", "A number that another place of a frame moves by more is wrong by what is claimed of it.",
    "tests/diagnose/test_frame_steps.py")
REGION_SHARE = limit(0.95, "of the rows", "So many lie on a joint's own side: where its load is small, nothing bends.",
    "tests/prove/test_regions_of_joints.py")
SEGMENT_COMPLETE = limit(0.9, "of the numbers", "With fewer numbers in a row of poses the rows are not alike.")

topic("Stated numbers, time and scale")
NUMBER_SIGMA = limit(5.0, "sigma", "Beyond, a stated number of an instrument is contradicted beyond chance.", "tests/prove/test_numbers.py")
LENS_FACTOR = limit(0.02, "of the numbers", "A lens that is nearer is a calibration of another day, no other lens.",
    "tests/diagnose/test_camera_views.py")
NUMBER_SHARE = limit(0.3, "of the squares left",
    "A stated number that explains more is wrong, and a gain says nothing; less is a remark.", "tests/prove/test_numbers.py")
LATE_SHARE = limit(0.5, "of the squares left beyond stated noise",
    "Play that a path takes up one way explains up to a third.", "tests/prove/test_late.py")
LATE_WHOLE = limit(0.9, "of the squares left beyond stated noise",
    "A time offset that explains all that is no noise is beyond doubt from a smaller share on.", "tests/prove/test_late_cables.py")
LATE_WHOLE_SHARE = limit(0.15, "of the squares left",
    "One late cable of eight explained 0.2, and its robot stood up to 15 mm off; honest ways stay below 0.1.",
    "tests/prove/test_late_cables.py")
LATE_DOUBT_SHARE = limit(0.1, "of the squares left", "A time offset that explains less is of no consequence.")
PATH_STEP = limit(0.25, "of the distance of two places", "A longer step between neighbours in time is no path.")
PATH_SHARE = limit(0.5, "of the configurations", "With fewer near neighbours the configurations were taken one by one.")
PATH_CONFIGURATIONS = limit(20, "configurations", "Fewer say nothing of a speed.")
GROWTH_CHANCE = limit(1e-6, "chance", "Of taking noise for a drift along the file.", "tests/prove/test_growth.py")
GROWTH_SHARE = limit(0.1, "of the squares left", "A drift that explains less is of no consequence.")
GROWTH_CLEARLY = limit(3.0, "times", "A drift explains more than any other slow change along the file does.", "tests/prove/test_growth.py")
GROWTH_SEEN = limit(0.3, "of the squares of a drift",
    "What a fit takes up by more goes with the poses: errors of a joint that moved slowly look the same.", "tests/prove/test_growth.py")
GROWTH_CONFIGURATIONS = limit(20, "configurations", "Fewer say nothing of a drift.")
NEGATIVE_SIGMA = limit(5.0, "sigma", "Friction or a torque constant farther below zero is none by chance.",
    "tests/session/test_joint_torques.py")
PRIOR_SIGMA = limit(5.0, "sigma", "Beyond, a stated prior is contradicted beyond chance.", "tests/prove/test_cable_camera.py")
SCALE_SIGMA = limit(3.0, "sigma", "A scale that making does not leave is that of the stated length.", "tests/statistics/test_scale.py")
SCALE_DOUBT_SIGMA = limit(2.0, "sigma", "One in twenty honest scales is as far off: worth a remark.")
SCALE_READ_SIGMA = limit(5.0, "sigma",
    "Where readings are lengths themselves: trackers have a calibrated scale.", "tests/statistics/test_scale.py")
SCALE_SHARE = limit(0.05, "of the squares left",
    "A scale between instrument and cables that explains less is of no consequence.", "tests/prove/test_scale_of_instruments.py")
SCALE_CHANCE = limit(1e-3, "chance", "Of changes that are larger than expected and mean nothing.")
SCALE_LEAST = limit(1e-6, "of a length", "A micron in a metre is no mistake but rounding.")
SCALE_WIDEST = limit(2e-3, "of a length", "No more is taken for errors of an arm's lengths.")
SCALE_OPEN = limit(0.1, "of a length", "A scale that is known no better is that of the nominal model.")
MOTION_UNSEEN = limit(1e-5, "of the residuals that a motion makes", "Roots of normal equations have half the digits.", "double precision")
SAME_PLACES_SHARE = limit(0.5, "of the places", "Two runs measured the same places where most of them are common.")

topic("One change that explains the data")
HYPOTHESIS_PLACES = limit(8, "places", "Fewer configurations are met by any change.", "tests/statistics/test_hypotheses.py")
MISFIT_ASKS = limit(1e-3, "of the reach", "A smaller misfit is no sign of anything wrong.", "tests/statistics/test_hypotheses.py")
REACH_OF_SPREAD = limit(20.0, "times the spread", "An arm that reaches so much farther than it moved has another unit.")
GAIN_WRONG = limit(0.02, "of the gain", "Joints whose gains are nearer to the stated ones count in the stated unit.")
ARM_SHORTEST = limit(0.1, "m", "Lengths of an arm that add up to less are in another unit.")
ARM_LONGEST = limit(20.0, "m", "Lengths of an arm that add up to more are in another unit.")
ARM_DENSITY = limit({"light": 0.3, "heavy": 1000.0}, "kg at the reach for its cubic metre",
    "Masses and reach in data sheets make 2 to 100; a thousandth or a thousandfold lies outside.", "tests/session/test_torque_units.py")
ARM_SPEED = limit(4 * math.pi, "rad/s", "Two turns a second are no slow motion; degrees that are read as radians make such speeds.")
SIGN_JOINTS = limit(8, "joints", "Of more joints all sets of signs would be too many: one to three at a time.")
MAKING_LEAVES = limit(0.01, "of the reach", "No arm's making leaves more.", "tests/real/test_hypotheses.py")
LEFT_OF_SPREAD = limit(0.02, "of the spread read", "What leaves more is explained only by readings or an arm made small.",
    "tests/statistics/test_causes.py")
EXPLAINED_CLEARLY = limit(5.0, "times less",
    "A change explains the data where it leaves so much less.", "tests/statistics/test_hypotheses.py")
EXPLANATIONS_ALIKE = limit(1.5, "times the best", "Changes that leave no more are not told apart.", "tests/statistics/test_hypotheses.py")
QUARTER_TURN_NEAR = limit(math.radians(4.0), "rad", "A zero so near to a right angle is no lost mastering but a convention.")
HYPOTHESIS_BENT = limit(5.0, "times the soft hold", "An arm that was bent so far is another arm, and explains nothing.")
PAIR_ROWS = limit(20, "rows", "The linear form has 13 numbers: fewer rows are met by any two changes.", "tests/statistics/test_causes.py")
PAIR_LEAVES = limit(0.05, "of the squares", "What the linear form leaves of right rows is 2e-4, and of wrong ones most often 0.1.",
    "tests/statistics/test_causes.py")
PART_ROWS = limit(26, "rows", "Both ends of a shorter file tell nothing.")
PART_LEAST = limit(10, "rows", "So few gross rows fit any frame: they are no part of another robot.",
    "tests/session/test_naming_causes.py")
PART_NEAR = limit(5.0, "times what making leaves", "What frames that fit a quarter of the rows leave of the others.")
PART_OFF = limit(10.0, "times what making leaves", "Rows that are so far off are off, however far.")
PART_SHARE = limit(0.15, "of the rows", "Fewer rows that are off are outliers.")
REMOUNT_WORTH = limit(1.5, "times", "What one place for all files leaves against one for each.")
REMOUNT_LEAST = limit(2e-4, "m", "A smaller difference between two mountings shows nowhere.")
REMOUNT_FILES = limit(8, "files", "Of more files each has too few rows for a place of its own.")

topic("Lists of cable robots")
COLUMN_POSES = limit(10, "poses", "Fewer are met by any anchor.", "tests/cli/test_cable_wrong.py")
COLUMN_CLEARLY = limit(3.0, "times less", "Other columns or axes must leave so much less than as stated.")
COLUMN_LEAVES = limit(0.03, "of the spread of the poses", "What other columns or axes may leave.")
AXES_SIMPLER = limit(1.5, "times", "Wrong axes are one mistake, exchanged cables several: they may leave more.")
FACTOR_LEAVES = limit(0.2, "of the scatter of the lengths",
    "What the right unit and sign leave, with anchors a few centimetres off.", "tests/statistics/test_causes.py")
SIZE_CONFIGURATIONS = limit(5, "configurations", "Fewer tell no size.")
SIZES_APART = limit(4.0, "times", "An inch is 25 mm, and no robot is four times as large as it was built.")
TENSION_DIRECTIONS = limit(0.1, "of the tensions", "Directions that are a tenth off leave no more force.")
TENSION_CLEARLY = limit(0.4, "of the force left", "A cause of wrong tensions leaves less.")
TENSION_FARTHER = limit(2.0, "times what geometry leaves", "Beside lengths a platform may move a little.")
TENSION_POSES = limit(3, "poses", "Fewer are balanced by any mass.")
TENSION_MASS = limit(2.0, "times", "A mass so far from the stated one is another platform, or another unit.")
CELL_UNIT_NEAR = limit(0.2, "of a factor", "So near to the factor of a unit it is that unit.")
WINCH_GAIN = limit(1.4, "times what an ampere pulls",
    "Halfway to the least mistake, a diameter for a radius; anchors a centimetre off make a tenth.",
    "tests/cli/test_cable_winch_columns.py")
SAGS_SCATTER = limit(0.3, "of the sags", "A sag is the weight by the tension: what is off by a third is of another tension or span.")
SOUND_MOST = limit(18000.0, "m/s", "Sound in diamond; in steel and aramid it runs at a third of it, in polyethylene at two thirds.")
STRETCH_MOST = limit(0.3, "of the length", "Steel breaks at 2 %, polyethylene at 4 %, aramid below 5 %, nylon at 20 to 30 %.")
LOADS_UNLIKE = limit(31.6, "times what is stated",
    "Halfway to a slip of a unit, a thousand; the catalogue of annex A, at large loads, is 17 times stiffer.",
    "tests/cli/test_cable_loads_wrong.py")
LOADS_CHANCE = limit(0.01, "chance", "One right table in a hundred has a load that is named as far from the others.",
    "tests/cli/test_cable_loads_wrong.py")
BOX_LARGEST = limit(1000.0, "times the machine", "A box of poses that is larger is a slip of the unit.")

topic("Files and units")
UNIT_GAIN = limit(10.0, "times", "By luck a wrong unit lowers the misfit less.", "tests/files/test_silent_readings.py")
UNIT_MISFIT = limit(0.05, "of the spread measured", "From here on every other unit is tried; what leaves more is no explanation.")
UNIT_SPARE = limit(3, "numbers", "Beyond what frames can meet: by luck each falls tenfold once in ten times.")
UNIT_BETTER = limit(0.9, "times", "Of two equally good explanations the one with fewer changes stands.")
STILL_PLACES = limit(4, "places", "From here on equal readings of a moving arm are no chance.")
STILL_MOVED = limit(0.02, "rad or m", "So far the joints must have moved.")
COPY_CHANCE = limit(1e-3, "chance", "Of taking honest repeats for copies.")
COPIES = limit(0.1, "of the rows", "Every sigma is then 5 % too small, and so many are no slip.", "tests/files/test_copies.py")
QUIETEST = limit({"m": 5e-6, "rad": 5e-6, "px": 0.02}, "m, rad, px",
    "No robot and instrument repeat themselves better.", "repeatability in data sheets (ISO 9283)")
REPEAT_SIGMA = limit(10.0, "sigma of a difference", "Repeats that differ by more are no repeats.")
SPREAD_ROWS = limit(4, "rows", "Fewer positions have no spread.")
SPREAD_LARGE = limit(10.0, "times the arm", "No arm reaches positions that spread so far.")
SPREAD_SMALL = limit(100.0, "times less than the arm", "An arm that moves its joints hardly stays in so little.")
SPREAD_MOVED = limit(0.2, "rad or m", "So far a joint must have moved before positions have to spread.")
RADIANS_TURNS = limit(2.5, "turns", "Radians beyond are degrees.")
RADIANS_OUTSIDE = limit(0.5, "of the rows", "Angles of which more lie outside the limits are in the other unit.")
DEGREES_RANGE = limit(math.radians(7.0), "rad", "Degrees that never leave it are radians: a measured robot moves further.")
DEGREES_MOVED = limit(0.3, "rad", "So far they must move when read as radians.")

topic("Places that are visited again")
PLACES_LEAST = limit(6, "places", "Five gains of one sign happen once in 32, and fewer places than numbers fit anything.")

topic("Proof and verdict")
PROOF_PLACES = limit(5, "places", "A bootstrap of n gains of one sign never doubts them; by chance that happens once in 2^n.")
HOLD_OUT_SHARE = limit(0.2, "of the places", "What is held out where nothing else is asked for.")
GROUP_FOLDS = limit(5, "rounds", "Of fewer than 25 groups a fifth would prove little: each is held out once.")
HOLD_OUT_PLACES = limit(25, "places", "Of fewer a held-out fifth proves little, and leave-one-out is cheap.")
LEAVE_ONE_OUT_PLACES = limit(400, "places", "Of more leave-one-out takes long and adds nothing to a hold-out.")
MEAN_RIVAL = limit(0.9, "of the error of the mean", "A model that is hardly better than predicting the mean explains nothing.")
UNEXPLAINED_MOST = limit(0.5, "of the variance", "A model that leaves more does not describe this robot, whatever it gains.")
TORQUE_ROWS = limit(0.9, "of the rows", "A tenth of gross rows says nothing of the other torques of a joint.",
    "tests/session/test_joint_torques.py")
UNEXPLAINED_SHARE = limit(0.01, "of the variance", "No arm's making leaves a tenth of what the positions scatter by.")
UNEXPLAINED_SIGMA = limit(3.0, "stated sigma", "Less may be the stated noise.")
ANGLES_LEFT = limit(0.05, "rad per axis", "Measured angles that are left over are not explained.")
ANGLES_SIGMA = limit(3.0, "stated sigma", "Less may be the stated noise.")
LEFT_SIGMA = limit(5.0, "stated sigma per axis",
    "Less may be the stated noise, and what a model always leaves.", "tests/prove/test_left.py")
LEFT_SHARE = limit(5e-3, "of the size of the machine",
    "Good models leave up to a quarter of it per axis, wrong labels ten times as much.", "tests/prove/test_left.py")
BENT_LEAVES = limit(3e-3, "m per axis", "What implausible changes may leave; an arm that is merely bad is explained better.")
KEPT_GAIN = limit(0.5, "of the gain", "The fit to everything must keep it where it has seen what the other predicted.")
IMPLAUSIBLE_CHANGE = limit(20.0, "times what is expected", "20 mm or 6 deg: no arm is made so far from its drawing.")
UNMADE_SIGMA = limit(5.0, "sigma", "A change that is none of the fit's own uncertainty.")
UNMADE_FAR = limit(0.5, "m",
    "Anchors that a tape measure tells to 0.1 m are not off by more; a wider stated error allows five times itself.",
    "tests/prove/test_unmade_anchors.py")
ZERO_CHANGE = limit(10.0, "times what is expected", "10 mm or 3 deg: from here on a joint's zero is tried instead.")
ZERO_SIGMA = limit(5.0, "sigma", "A change that is none of the fit's own uncertainty.")
ZERO_LOST = limit({"rad": 0.5, "m": 0.1}, "rad, m", "So far a zero may be off that was lost.")
WORSE_CHANCE = limit(0.025, "chance",
    "That the nominal model is better in the working range: more is no proof, as for the gain.", "tests/statistics/test_region.py")
FRAME_RANGE = limit(0.7, "of the box of the frame anchors",
    "Where a platform works, unless somebody says otherwise: beyond, cables pull to one side.", "tests/prove/test_region_of_cables.py")
FRAME_FLAT = limit(0.1, "of its largest extent", "A frame that is thinner says nothing of how far its platform moves across it.")
SCALE_WORSE_CHANCE = limit(0.25, "chance",
    "That the nominal model is better, where no reading tells the scale: of all that stay below it is in one of 40.",
    "tests/statistics/test_wrong_markers.py")
BASELINES_APART = limit(1.5, "times",
    "Unseen rows are missed alike to a tenth, together or one by one, unless few are left to fit.", "tests/prove/test_baselines.py")
MADE_BETTER = limit(1 / 16, "times what is expected", "No arm is made better: 0.06 mm and 0.02 deg.")
MADE_WORSE = limit(4.0, "times what is expected", "An arm that is made worse has lost a zero, or has another drawing: 4 mm and 1.2 deg.")
FOLDS = limit(5, "folds", "As many rounds as a hold-out has fifths.")
FOLDS_PLACES = limit(400, "places", "Of more a held-out fifth is not few.")
FOLDS_SIGMA = limit(3.0, "sigma",
    "A gain that a held-out fifth shows so clearly is lost in one case of six.", "tests/prove/test_default_folds.py")
BESIDE_NEAR = limit(0.02, "of the distance of two places", "A fiftieth of the way to another place is no other place.")
BESIDE_SHARE = limit(0.5, "of what was held out", "Held-out places beside fitted ones tell nothing of the way between them.")
FRAMES_LEFT = limit(3.0, "times what noise and making allow",
    "A robot that errs by more is no robot of that drawing, or its readings belong to other poses.", "tests/prove/test_frames_alone.py")
FRAME_SEEN = limit(10.0, "times what is expected", "A direction of a frame that all rows see is seen beyond doubt.")
FRAME_MOVES = limit(0.1, "of what is expected", "A reading that moves by more with an unseen direction proves nothing.")

topic("Remarks on data and fit")
NUMBERS_PER_PARAMETER = limit(2, "numbers", "Fewer measured numbers for a parameter are few.")
PLANE_POINTS = limit(4, "points", "Three points always lie in a plane.")
PLANE_THICKNESS = limit(0.02, "of the extent", "Thinner points lie in one plane.")
NOISE_ABOVE = limit(3.0, "times the stated sigma", "The model leaves more than was stated.")
NOISE_BELOW = limit(3.0, "times less than stated", "A stated sigma that is so far too large.")
NOISE_CHANCE = limit(1e-3, "chance", "That it is not too large.")
COMPUTED_ERROR = limit(1e-6, "m", "No arm repeats and no instrument reads so well: the data were computed.")
COMPUTED_FREEDOM = limit(0.5, "degrees of freedom", "Of fewer rows the fit leaves nothing anyhow.")
FOLLOW_SIGMA = limit(4.0, "sigma", "Errors that follow those before by more are no chance.", "tests/prove/test_follow.py")
FOLLOW_SHARE = limit(0.2, "of the squares", "Less is of no consequence.")
FOLLOW_PAIRS = limit(20, "pairs", "Fewer tell nothing.")
FOLLOW_ALIKE = limit(1.25, "times as far", "So much farther in joint space the pair may be that is compared with.")
STEP_MISLEADS = limit(1.5, "times what is promised, or the noise", "From here on one linear step would mislead.")
CURVATURE = limit(1.0, "of a sigma", "Half of it is what a sigma is wrong by, one sigma away.")
BOOTSTRAP_DRAWS = limit(100, "draws", "Of fewer a percentile at 2.5 % is a guess.")
BOOTSTRAP_PLACES = limit(25, "places", "Fewer repeat themselves in every draw, and the scatter is too small.")
BAND_CHANCE = limit(1e-3, "chance", "Fewer than one honest band in a thousand would miss so many.")
PARTNERS_WIDER = limit(1.5, "times", "Hidden partners that widen a sigma by more are named.")
PRIORS_NUMBERS = limit(6, "numbers", "More for each unknown tell it so well that no prior helps.", "tests/prove/test_quick_looks.py")
PRIORS_LEFT = limit(1e-3, "m per axis", "Where no noise is stated: a fit that leaves less has followed little that is not its own.")
LOOK_LESS = limit(0.15, "of the mean unseen error",
    "A look that promises less is not worth another run.", "tests/prove/test_quick_looks.py")
GROUP_PLACES = limit(25, "places", "Of fewer, blocks prove nothing about what lies beyond geometry.")
LAYER_PLACES = limit(50, "places", "Fewer teach no layer.")
RIPPLE_CHANCE = limit(1e-3, "chance", "Of an order of ripple that is none, over all that were tried.")

REMOUNT_SHARE = limit(0.75, "of the squares", "Errors halve where the target is put elsewhere: it explains more than all the rest.",
    "tests/session/test_judged_alike.py")

topic("Two runs of one robot")
DRIFT_MATTERS = limit(1e-4, "m", "Below, no change is worth an alarm, unless the user says otherwise.")
DRIFT_CHANCE = limit(1e-3, "chance",
    "A level of 1e-2 accuses one in ten of the worst halves of a real series.", "tests/statistics/test_drift_and_prediction.py")
DRIFT_PART_CHANCE = limit(0.01, "chance",
    "Of naming any part that did not move, of all parts together.", "tests/statistics/test_cable_drift.py")
DRIFT_OBSERVABLE = limit(0.25, "of the expected variance", "Known to half of what was expected.")
topic("Poses beside poses, and corrections")
LIKE_POSITIONS = limit(0.1, "of their spread", "Farther apart after the best alignment, poses are not of the same places.")
LIKE_TURNS = limit(0.5, "of their spread", "The same of orientations.")
LIKE_TURNS_LEAST = limit(math.radians(3.0), "rad", "The same of orientations that hardly differ.")
POINTS_ELSEWHERE = limit(0.2, "of the farthest distance of two points",
    "Places on a body are known better; another unit or two exchanged points are farther off.")
POINTS_DISAGREE = limit(1e-3, "chance", "Of leaving any honest pose out, of all poses of a file.")
LIKE_EXPLAINS = limit(0.3, "of what is left", "A cause leaves less.")
SINGULAR_BELOW = limit(0.01, "ratio of singular values", "About 1.5 deg from a stretched wrist: small errors ask for large turns.")
LENGTHS_UNLIKELY = limit(1e-6, "chance",
    "Of what a pose leaves of its lengths, by the stated noise: once in a million poses.", "tests/cables/test_forward.py")
LENGTHS_UNSTATED = limit(0.01, "m",
    "What a pose may leave of its lengths (rms) where no noise is stated: no robot's are off by more.", "tests/cli/test_cable_ladder.py")
LEAP = limit(0.2, "rad or m", "A larger correction of a joint is another branch, or stands near a singular pose.")

# fmt: on


def topics() -> dict[str, dict[str, Limit]]:
    """Every limit by name, under its topic; a name stands where its limit was declared."""
    out: dict[str, dict[str, Limit]] = {}
    names = [
        n
        for n in {**vars(of_fit), **vars(of_drives), **vars(of_vision), **globals()}
        if n.isupper() and n not in ("T", "CHOICE", "DECLARED", "_TOPIC", "LIMITS")
    ]
    for name, (title, entry) in zip(names, DECLARED, strict=True):
        out.setdefault(title, {})[name] = entry
    return out


LIMITS = {name: entry for entries in topics().values() for name, entry in entries.items()}
