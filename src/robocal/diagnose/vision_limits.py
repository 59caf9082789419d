"""The limits of vision: images, lenses, maps of markers, hands and phantoms; `diagnose.limits` has the others, and lists all."""

from __future__ import annotations

import math

from robocal.fit.limits import limit, topic

# fmt: off

topic("Lenses, hands and phantoms")
LENS_CENTRE_PRIOR = limit(10.0, "px (standard deviation)",
    "So far the focal length and centre of a lens that is stated without a spread may be off.", "tests/real/test_charuco_arm.py")
LENS_FACTORY_PRIOR = limit(5.0, "px (standard deviation)",
    "So far the focal length and centre of a depth camera are off from what its maker stored.", "tests/files/test_factory_lens.py")
LENS_DISTORTION_PRIOR = limit(0.1, "(standard deviation)", "So far its distortion may be off.", "tests/real/test_charuco_arm.py")
LENS_CONTRADICTED = limit(4.0, "sigma", "Chance alone puts a number there once in ten thousand.")
LENS_MATERIAL = limit(0.5, "of what is normal", "A lens that puts the target elsewhere by less is no reason to take no result.")
RIG_CHANCE = limit(1e-3, "chance", "A rig that holds is named once in a thousand calibrations at most: a shift must be material too.")
LENS_PULL = limit(2.0, "sigma of a frame", "A prior that is right pulls a frame by half a sigma: four times that is no chance.")
TARGET_SIZE_SIGMA = limit(5.0, "sigma", "The errors of a robot are not those of chance, and look like a size up to here.")
TARGET_SIZE_MATERIAL = limit(1.0, "of what is normal", "A size that puts the target elsewhere by less is within the errors of the robot.")
CLOCK_LATE = limit(0.01, "s", "Turns tell a delay to some milliseconds; at 0.2 m/s it is 2 mm, as much as is normal.")
TARGET_SIZE_LEFT = limit(1.5, "times the error that is told, or what is normal",
    "A size that puts the target elsewhere by more makes the told error untrue.", "tests/cli/test_hand_eye_advice.py")
HAND_STILL = limit(0.005, "rad (median)", "A hand that turns by less between views did not move; noise of poses is smaller.")
ROBOT_PLACE = limit(1e-3, "m (standard deviation)",
    "So far a flange stands from the pose that its controller tells, of arms that nobody calibrated.", "ISO 9283 data sheets")
ROBOT_TURN = limit(2e-3, "rad (standard deviation)",
    "A millimetre at the ends of a wrist that is half a metre long.", "ISO 9283 data sheets")
HAND_EYE_ASK = limit(0.02, "of the distance of the target, and rad",
    "No robot that is read rightly puts most views of a target so far off.", "tests/session/test_hand_eye.py")
HAND_EYE_LEFT = limit(3.0, "times what is normal", "An arm that nobody calibrated leaves no more; something else moves or is wrong.")
HAND_TURNS = limit(math.radians(5.0), "rad (standard deviation)",
    "About a second axis: with less, a robot's millimetre puts a frame a centimetre off.", "tests/prove/test_frames_alone.py")
FRAME_PLACE = limit(0.03, "m (standard deviation)",
    "A camera that may be off by 6 cm guides no hand.", "tests/session/test_pose_pairs.py")
KNOWN_PLACE = limit(2e-3, "m (standard deviation)",
    "A tracked stylus finds a phantom within 1 mm; under a wider prior the poses have to place it.",
    "tests/real/test_nwire.py")
PHANTOM_TIMES = limit(3.0, "times",
    "Noise of a thousand points never falls so far by exchanging two wires.", "tests/diagnose/test_phantom.py")
PIXEL_FACTOR = limit(0.1, "of the size",
    "Settings of depth differ by more, and calibrations of one depth by 2 %.", "tests/real/test_nwire.py")
FRAME_TURN = limit(math.radians(3.0), "rad (standard deviation)",
    "At half a metre these are 3 cm as well.", "tests/session/test_pose_pairs.py")
ARM_EXPLAINS = limit(4.8, "of the log likelihood",
    "By chance errors of a robot explain noise so well once in a thousand.", "chi2, one degree of freedom")

topic("Images of a target")
IMAGE_SMEAR = limit(2.7, "px", "Motions of 3 px are measured as 2.95 to 3.05, none as 0.6 to 2.3: a box law is no normal law.",
    "scripts/corner_accuracy.py")
IMAGE_BLUR = limit(2.0, "px", "From here on corners are worse than the noise of a good detector (0.02 px).")
IMAGE_WHITE = limit(0.5, "of the bright pixels", "Half of what is white around the markers is as bright as the camera can say.")
IMAGE_COVERAGE = limit(0.4, "of 8 x 6 parts", "A lens is known where corners were, and here most of it is not.")
VIDEO_FRAMES = limit(0.95, "of the frames that a video states", "Some files state their frames from length and rate, a little wrong.")
IMAGE_VIEWS = limit(5, "images", "Of fewer, nobody expects that they cover the image.")
BOARD_MISFIT = limit(0.15, "of a square", "Lenses and paper move markers by hundredths of a square; another board has them farther away.",
    "tests/cli/test_detect_sheets.py")
CORNER_AT_REST = limit(0.005, "px", "A third of what corners of a good image are off by; the next round moves them a tenth of it.")
MARKER_MOVED_CHANCE = limit(1e-3, "chance", "A marker that stands where it stood is named once in a thousand maps.")
MAPS_CHANCE = limit(1e-3, "chance", "Maps whose sigma holds are said to differ by more once in a thousand comparisons.")
MAPS_SCALE = limit(2e-3, "of the size", "Printers scale by some thousandths; maps of the same markers differ by less.")
POSE_RIVAL = limit(0.01, "of the likelihood", "A pose that is a hundred times less likely than the other is no doubt any more.")
LENS_VIEWS = limit(3, "views", "Two views of a flat target leave no number to check four of a lens with.", "Zhang (2000)")
CORNERS_OUTSIDE = limit(0.01, "of the corners", "Decoders guess corners beyond the rim now and then; another size of images has far more.",
    "tests/real/test_tag_map.py")
MAP_VIEWS = limit(3, "views", "Of two views each is predicted by markers that it alone shows.")
MARKER_MOVED = limit(30.0, "standard deviations", "What a lens leaves looks like a small motion too, and grows with the views.",
    "tests/session/test_map_fit.py")
MARKER_MOVED_VIEWS = limit(3, "views", "One or two views that disagree are gross, and set aside.")
MARKER_SIZE = limit(5e-3, "of the edge", "Printers scale by some thousandths, and a lens that is nearly right looks like as much.")
MARKER_SIZE_CHANCE = limit(1e-3, "chance", "A map whose edges scatter as told names one of them once in a thousand maps.")
MAP_MISSES = limit(3.0, "times what corners are known to", "Flat markers and a lens of the right model leave no more.")
MAP_UNSEEN = limit(2.0, "times", "A map that misses other views by so much has learnt the views that it was fitted to.")
MAP_ASIDE = limit(0.05, "of the corners", "Of good images one corner in a hundred is gross; more have a cause.")
MAP_WEAK = limit(3, "views", "Of two views one is left out, and nothing checks what the other says of a marker.")
LENS_VIEW_LEFT = limit(0.3, "of the size of a view",
    "A fisheye bends a plane by a tenth; corners of wrong numbers leave two thirds.", "tests/cli/test_vision_intrinsics.py")
TARGET_LEAST = limit(0.005, "m", "Nobody prints a target of several corners so small; metres that were taken for millimetres are.")
MARKER_LEAST = limit(1e-3, "m", "Nobody prints a marker so small; metres that were taken for millimetres are.", "tests/files/test_kinds.py")
TARGET_MOST = limit(20.0, "m", "No target is so large; millimetres that were taken for metres are.")
LENS_FOCAL = limit(0.05, "of the focal length", "Distances that are measured with it are off by as much.")
LENS_LEFT = limit(0.5, "px", "Corners of sharp images are found to 0.1 px or better; published calibrations leave 0.1 to 0.3 px.")
LENS_MISSES = limit(5e-4, "of the width of the image", "Published calibrations leave 0.1 to 0.2 of it; a board bent by 3 mm leaves more.")
LENS_MISSES_TIMES = limit(3.0, "times what corners are known to", "Corners that are known less well leave as much by themselves.")
LENS_TILT = limit(45.0, "deg", "Views so far from the front tell focal length and distance apart, where corners fit their places.")
LENS_CENTRE = limit(0.1, "of the width", "Lenses are mounted to some hundredths; exchanged coordinates and crops are off by more.")
LENS_UNSEEN = limit(2.0, "times", "A lens that misses other views by so much has learnt the views that it was fitted to.")
CAMERA_DRIFT = limit(0.9, "of the squared residuals of a camera",
    "Errors of uncalibrated arms exceed it in 0.4 % of cells with views in order along one joint, in none of 4800 others.",
    "tests/prove/test_camera_drift.py")
CAMERA_DRIFT_VIEWS = limit(12, "views", "Fewer views have hardly more poses than a motion has numbers.")
FRONTAL = limit(20.0, "deg", "Nearer to frontal, both poses of a square leave about the same of corners known to 0.3 px.",
    "tests/real/test_marker_poses.py")
SMEAR_CELL = limit(3.0, "px", "Cells of a marker that are smaller do not tell a smear from a blur.")
DICTIONARY_AHEAD = limit(2.0, "times", "As many markers as the next family has: others' markers agree with a dictionary by chance.")
