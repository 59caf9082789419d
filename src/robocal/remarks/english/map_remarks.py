"""Sentences of maps of markers, and of cameras on robots."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["MapRemarks"]


class MapRemarks:
    """Of markers and their maps, of where a camera is among them, and on a robot."""

    MAP_LOCATED = Phrase(
        "corners of views that were left out are met within {unseen:.3g} rms; their noise is {noise:.3g}, both axes together"
    )
    MAP_UNPROVEN = Phrase(
        "no view could be left out: without it some of its markers are nowhere",
        "Take more views, each with several markers.",
    )
    MARKER_MOVED = Phrase(
        "marker {marker} is at two places, {apart:.3g} and {turned:.2g} apart:[ it moved before view {first}][ views {views} see another "
        "one], {count} views in all",
        "Leave the marker out (--without), or the views in which it stood elsewhere (--exclude). Of two markers with one number cover "
        "one.",
    )
    MARKER_SIZE_CONTRADICTED = Phrase(
        "marker {marker} is {told:.4g} large by --size, and looks about {found:.4g} large beside the others[; so do others, by number in "
        "mm: {others}]",
        "Measure the edges of the markers that are named, and give each its size (--size {marker}=MM), or leave them out (--without).",
    )
    MAP_PRIOR_SCALED = Phrase(
        "beside the distances that are known beforehand the markers look {share:.2g} % {word} than --size says",
        "Measure the markers, and one distance between two of them: --size or the file of --prior is wrong, or in another unit.",
    )
    MARKER_SIZES_SCATTER = Phrase(
        "the edges of the markers scatter by {found:.2g} %, more than they were said to",
        "Look at the prints, and at the numbers of the lens that have no sigma. Where edges are that unequal, say so: --size-scatter "
        "{found:.2g}.",
    )
    MAP_MISSES = Phrase(
        "the map leaves {left:.3g} per axis, {times:.2g} times what corners are known to",
        "Check that markers are flat, did not move and have the sizes that are told, and that the lens is of this camera. [Let {exact} of "
        "the lens have sigma: none of them is exact.]",
    )
    VIEWS_FROM_ONE_PLACE = Phrase(
        "all views are from one place", "Move the camera: take images from places as far apart as the markers."
    )
    MARKERS_NEVER_WHOLE = Phrase(
        "no view shows these markers whole, and they are not in the map ({count}): {names}",
        "Take images that show them whole, each with neighbours.",
    )
    MARKERS_OPEN = Phrase(
        "too few corners fit to say where these markers are ({count}): {names}",
        "Take more images of these markers, each with neighbours, or leave them out (--without).",
    )
    MAP_OVERFITTED = Phrase(
        "views that were left out are missed by {unseen:.3g} px, {times:.2g} times the noise that the fit tells, {seen:.3g} px",
        "Take more views, each with several markers.",
    )
    MAP_ASIDE = Phrase(
        "{share:.0%} of the corners do not fit the map, and are not counted",
        "Look at the views and markers that are worst, and leave them out (--exclude, --without): blurred images, markers that move.",
    )
    MAP_COVARIANCE_MISSING = Phrase(
        "{file} names {table}, which is not beside it: its markers are taken as known independently of one another",
        "Put {table} beside it: without it sigmas of distances between markers are too large or too small.",
    )
    MAP_MARKER_MOVED = Phrase(
        "marker {name} is not where the map has it, but about {distance} away: {aside} of its {total} corners are excluded[; it may "
        "be marker {other} instead]",
        "Put marker {name} back, or make the map again with images of today.",
    )
    VIEW_HAS_TWO_POSES = Phrase(
        "{count} of {total} images have two poses that fit alike, and are not in the list: {views}",
        "Bring more markers into the image, best of several walls, or take it from 30 deg or more beside their normal.",
    )
    VIEW_WITHOUT_MAP = Phrase(
        "{count} of {total} images show no whole marker of the map: {views}", "Point the camera at markers of the map."
    )
    MARKERS_NOT_IN_MAP = Phrase(
        "{count} markers are not in the map, and do not help: {names}", "Make the map again with images that show them."
    )
    PLAN_UNSEEN = Phrase("no pose shows {count} of the {total} markers of the first plan: they are not counted")
    PLAN_BLIND = Phrase("{count} of the {total} poses show no marker of the first plan: they are not counted")
    PLAN_TOO_COARSE = Phrase(
        "no plan has the camera's place within {asked} rms along every axis: the best has {best}",
        "Compare plans with larger or raised markers (--size, --height), more poses, or markers that are surveyed (--survey).",
    )
    MAP_WITHOUT_SIGMA = Phrase(
        "{file} states no sigma: the poses count its markers as known exactly",
        "Give map.yaml of robocal vision map, which has sigma and covariance.",
    )
    LENS_WITHOUT_SIGMA = Phrase(
        "{file} states no sigma: the poses count its lens as known exactly",
        "Give lens.yaml of robocal vision intrinsics, which has sigma and covariance.",
    )
    MAP_UNLIKE_VIEWS = Phrase(
        "the map and the lens miss the corners by {left} in the images, {times:.2g} times what the corners are known to",
        "Check that map and lens belong to these images, and the size of the markers.",
    )
    MAP_SIZES_UNLIKE = Phrase(
        "the map has markers of {edge:.4g}, and beside its distances they look {seen:.4g} large",
        "Make the map again with the size of its markers, or write the true sizes into it: one of both scales every pose.",
    )
    MAP_OF_OTHER_SIZE = Phrase(
        "the map has markers of {edge:.4g}, and the corners say that they are {told:.4g} large",
        "Measure the markers. Make the map again with that size, or detect the corners with the size of the map.",
    )
    MAP_CORNERS_EXCLUDED = Phrase(
        "{share} of the corners do not fit the map, and are excluded",
        "Make the map again: more than single markers differ from it.",
    )
    MAPS_APART = Phrase(
        "the maps differ {times:.2g} times as much as their sigma predicts",
        "Take the scatter of the maps for their error, and give every map the same lens and the same size of markers.",
    )
    FORMAT_LACKS = Phrase("the format {form} cannot hold the {what}, and the file has none")
    MARKER_MOVED_SINCE = Phrase(
        "{file}: marker {name} stands {distance} elsewhere now[; it may be marker {other} instead]",
        "Leave marker {name} out of the map that is given beforehand, or put it back.",
    )
    MARKER_MOVED_BETWEEN = Phrase(
        "{file}: marker {name} stands {distance} elsewhere than in the first map[; it may be marker {other} instead]",
        "Leave marker {name} out of the maps, or put it back.",
    )
    MAPS_OF_OTHER_MARKERS = Phrase(
        "{count} markers are not in all maps, and are not compared: {names}",
        "Take images of all markers for every map.",
    )
    MAPS_SCALED = Phrase(
        "{file} is {share} {word} than the mean of the maps",
        "Measure the markers, and give every map the same size and the same lens.",
    )
    POSES_READ_OTHERWISE = Phrase(
        "the robot's poses, as stated, miss what most views see by {before:.3g} and {before_turn:.2g}; read as {reading}, by "
        "{after:.2g} and {after_turn:.2g}",
        "Say so: {option}.",
    )
    VIEWS_OUT_OF_STEP = Phrase(
        "from view {first} on every view belongs to the pose one {word}: {count} views miss their own by {before:.3g} and "
        "{before_turn:.2g}, that one by {after:.2g} and {after_turn:.2g}",
        "Take out the image or the pose that has no partner, or name the images in a column `image` beside the poses.",
    )
    MARKERS_EXCHANGED = Phrase(
        "in {count} of {total} views the numbers of {one} and {other} are exchanged ({views})",
        "Exchange the two numbers there, or leave those views out (--exclude).",
    )
    MARKER_TWICE = Phrase(
        "{marker} is at two places, {apart:.3g} and {turned:.2g} apart: {count} of {total} views show the other one ({views})",
        "Of two markers with one number cover one, or leave those views out (--exclude).",
    )
    LABELS_TURNED = Phrase(
        "in {count} of {total} views the board is labelled from its other end ({views}): with half a turn there, the error of most points "
        "falls from {stated:.3g} to {left:.3g}",
        "Undo it: --undo-half-turns. A board whose number of corners is odd one way and even the other does not look the same.",
    )
    PAIRED_IN_ORDER = Phrase(
        "views and poses are paired in the order of their files: {first} with the first pose, {last} with the last",
        "Look at the list of pairs. Names say it better: a column `image` beside the poses, with the names of the views.",
    )
    VIEWS_WITHOUT_POSE = Phrase(
        "{count} views have no pose of the robot, and are left out: {views}",
        "Add their poses to the file of the robot, or leave the images out.",
    )
    POSES_WITHOUT_VIEW = Phrase("{count} poses of the robot have the name of no view: {poses}")
    CLOCKS_APART = Phrase(
        "images are paired with poses by two clocks, and the camera's is about {delay:.2g} behind that of the robot",
        "Find the delay as well: --free-delay. Or let the hand stand still while images are taken.",
    )
    ONE_STANDS_STILL = Phrase(
        "{still} turns by {turn:.2g} while {moving} turns by {other:.3g}: images and poses are not of the same moments",
        "Save a new image and read a new pose at each stop. The target must not move with the camera.",
    )
    VIEWS_FLIPPED = Phrase(
        "{count} of {total} views have the other pose of a flat target, which looks almost the same, and are left out: {views}",
        "Give its corners in place of its poses, or look at the target from 30 deg or more beside its normal, and from nearer.",
    )
    LENS_CONTRADICTED = Phrase(
        "these views contradict the lens that was given: {names} ({z:.0f} sigma)",
        "Find it too (--free-lens), or calibrate it again with images of the same focus: robocal vision intrinsics. Where it was "
        "found here already, give lens.yaml of the result as --lens.",
    )
    RIG_CONTRADICTED = Phrase(
        "{count} views of one moment have {camera} elsewhere on the rig than its file: a target is {shift:.2g} and {turn:.2g} off",
        "Check direction (T_first_camera) and units of its place in the file of --rig, and which corners and lens are whose. Or write "
        "free: true beside it.",
    )
    TARGET_SIZE_CONTRADICTED = Phrase(
        "by the robot's poses the target is {factor:.4f} times as large as stated ({z:.0f} sigma), which puts it elsewhere by {shift:.2g}",
        "Measure the target again and state its size (--size, --square, scale in sheet.yaml), or find it with --free-size. Check the "
        "focal length of the lens, and the unit of the robot's poses.",
    )
    HAND_EYE_FEW_VIEWS = Phrase(
        "{count} views prove nothing of where the camera is: views at 6 poses are the fewest that can",
        "Add the three poses that are listed; 15 to 30 views are usual.",
    )
    HAND_EYE_LOST = Phrase(
        "views that were left out are missed by more than the distance of the target: camera and target are nowhere"
    )
    HAND_EYE_NOT_CONVERGED = Phrase(
        "the search for camera and target did not come to rest: where they are is not told",
        "Give every image the pose of its own moment, and leave out what is wrong (--exclude). What is looked for beside the frames "
        "(--free-lens, --free-delay, --free-size) makes it harder.",
    )
    HAND_EYE_NOT_EXPLAINED = Phrase(
        "views that were left out are missed by {left:.3g} rms ({how}), {times:.1f} times what noise and the making of a robot allow "
        "({allowed:.3g})",
        "Look at the views with the largest errors, and leave out those beside poses of another moment (--exclude). Check the form of the "
        "poses. Errors of the robot itself need robocal identify.",
    )
    HAND_EYE_FAR = Phrase(
        "views that were left out are missed by {left:.2g} at the target (rms), {times:.2g} times what is normal for an arm that nobody "
        "calibrated",
        "Look at the views with the largest errors. Check the lens, the size of the target, and that target, camera and robot stand still "
        "while an image is taken.",
    )
    VIEW_MOVED = Phrase(
        "from view {first} to view {last} the camera or the target stands elsewhere[, by {shift:.3g}] ({count} views)",
        "Leave these views out (--exclude), or calibrate both parts by themselves. Then see what is loose.",
    )
    CAMERA_DRIFT = Phrase(
        "{group}: the camera seems to move steadily while its views are taken, by {shift:.2g} and {turn:.2g} from the first to the last: "
        "that explains {share:.0%} of the squared residuals",
        "Fasten the camera, and what carries its target, and take the views again.",
    )
