"""What is remarked on images and what they show, in English."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["VisionRemarks"]


class VisionRemarks:
    """What is remarked on images and what they show."""

    IMAGE_TURNED = Phrase(
        "{count} of {total} images are to be turned by what is stored with them (EXIF), and were read as the sensor stored them: {views}",
        "Switch this off in the camera. A lens that another program found in turned images does not fit these corners.",
    )
    VIDEO_ENDS_EARLY = Phrase(
        "{file} ends after {count} of {stated} frames", "Copy the video again: a part of the file is missing."
    )
    IMAGE_SIZES_DIFFER = Phrase(
        "the images have {count} sizes: {views} has {width} x {height} pixels, most have {usual}",
        "Give the images of one camera at one resolution: another crop or scale has another lens.",
    )
    NO_TARGET_FOUND = Phrase(
        "no image shows a target: {tried}",
        "Check that the target with its white rim is whole and sharp, and name it: --sheet, --dictionary, --checker or "
        "--charuco. Where none of these is given, all are tried.",
    )
    NO_MARKER_IN_VIEW = Phrase(
        "{count} of {total} images show no target: {views}",
        "Look at their pictures (-o corners.csv writes a page): the target may be outside, too small, blurred or covered.",
    )
    ONE_MARKER_IN_VIEW = Phrase(
        "{count} of {total} images show one marker alone: {views}",
        "One small marker says little of where it is: bring several of one sheet into the image.",
    )
    MARKER_HAS_TWO_POSES = Phrase(
        "in {count} of {total} images one marker alone faces the camera within {most:g} deg, where two poses of it fit, "
        "tilted by {tilts}: {views}",
        "Turn it by more, or bring several markers of one sheet into the image.",
    )
    OTHER_DICTIONARY = Phrase(
        "of {given} {count} markers were found, of {better} {found}", "--dictionary {better} is probably right."
    )
    DICTIONARY_FOUND = Phrase(
        "the markers are of {family}: the smallest dictionary that holds their numbers; larger ones of its family look the same",
        "Name the one that was printed: --dictionary.",
    )
    DICTIONARY_UNSURE = Phrase(
        "no dictionary has {ahead:g} times as many markers as the next: {count} of {first}, {next} of {second}",
        "Name the one that was printed: --dictionary.",
    )
    BOARD_FOUND = Phrase(
        "a checkerboard of {columns} x {rows} squares was found", "Name it, if this is not the whole board: --checker."
    )
    BOARD_TURNS = Phrase(
        "a board of {columns} x {rows} squares looks the same turned by half: views may number its corners from either end",
        "Where the board's direction matters, on a robot, print one with an odd and an even number of squares, as 6 x 9.",
    )
    BOARD_OTHER = Phrase(
        "the markers are not where a board of {columns} x {rows} squares has them[, but where one of {wide} x {high} has them]",
        "Count the squares of the board, columns first: --charuco. A board with other numbers needs its sheet: --sheet.",
    )
    SIZE_NOT_STATED = Phrase(
        "the size of the {what} is not stated: without it corners have no places on the target",
        "Measure the print and give {option}.",
    )
    TWO_OF_ONE_NUMBER = Phrase(
        "{view} shows these numbers more than once, and none of their markers is used: {numbers}",
        "Cover one of them, or print sheets with other numbers.",
    )
    MIRRORED_IMAGE = Phrase(
        "{count} of {total} images show markers only when they are mirrored: {views}",
        "Switch mirroring off in the camera or its driver, or take the images without the mirror.",
    )
    MARKERS_OFF_SHEET = Phrase(
        "markers were found that are not on the sheet, and left out: {numbers}",
        "If the images show another sheet, give its own file: --sheet.",
    )
    MARKERS_APART = Phrase(
        "the markers fall into {count} groups that no image joins: {groups}",
        "Take images that show markers of both groups, or calibrate the groups as separate targets.",
    )
    MARKERS_AT_BORDER = Phrase(
        "{count} of {total} markers lie at the border of their image: {views}",
        "Their corners are less sure, and say so: keep one cell of white inside the image.",
    )
    IMAGE_OVEREXPOSED = Phrase(
        "white is cut off in {count} of {total} images: {views}",
        "Expose less: cut-off white says little of the edges beside it.",
    )
    MOTION_BLUR = Phrase(
        "{count} of {total} images are smeared along one direction, most {view} by about {length:.2g} px at {angle:.0f} deg",
        "Stand still while the image is taken, or expose for a shorter time.",
    )
    IMAGE_BLURRED = Phrase(
        "{count} of {total} images are blurred by more than {most:g} px: {views}", "Focus on the target."
    )
    EDGES_ALONE = Phrase(
        "{count} of {total} markers were fitted by their four edges, for their pixels do not agree with their cells: {views}",
        "Give more light, and keep fingers, shadows, glare and dirt off the markers: these corners are less exact.",
    )
    LENS_BENDS = Phrase(
        "edges of {count} of {total} markers are straighter without the lens that was given: it bends them more than the camera does",
        "Give the lens of this camera at this focus (--lens), or none: robocal vision intrinsics finds it.",
    )
    MARKER_DROPPED = Phrase(
        "{count} markers were found and left out, for neither pixels nor edges agree with them: {views}",
        "Look at their pictures (-o corners.csv writes a page): a marker should be free, clean and flat.",
    )
    IMAGE_HARDLY_COVERED = Phrase(
        "corners lie in {share:.0%} of the image",
        "A lens is known only where corners were: bring the target to the empty parts.",
    )
    LENS_FOCAL_OPEN = Phrase(
        "{names} are known to {share:.0%} only[: views that are tilted by {tilt:.0f} deg at most do not tell them from the distance]",
        "Tilt the target by 30 to 45 deg, to the left, to the right, up and down, and take it near and far. If it was, corners "
        "do not fit their places: look at sizes, numbers and the flatness of the target.",
    )
    TARGET_SIZE_ODD = Phrase(
        "the places on the target are {size:.3g} apart at most: is their unit right?",
        "State lengths in mm: --square, --size, or the unit in the heads of the columns, as point_x [mm]. The lens is the same; "
        "distances are not.",
    )
    LENS_OFF_CENTRE = Phrase(
        "the middle of the lens lies {share:.0%} of the width from the middle of the image",
        "Look whether images were cropped, whether --image is their size, and whether u and v are exchanged.",
    )
    LENS_LEAVES = Phrase(
        "the lens leaves {left:.3g} per axis of corners[ that are stated to {stated:.3g}][ that searches find to {usual:.1g}]; "
        "uncertainties are those of the fit",
        "Look at the pictures of residuals (-o lens.yaml writes a page): a pattern along the radius wants another --model, one that "
        "moves with the target a flat target. Images of two cameras leave as much.",
    )
    LENS_MISSES = Phrase(
        "the lens leaves {left:.3g} per axis, {times:.2g} times what corners are known to: more than such a lens leaves of a flat target",
        "Check that the target is flat and its squares are equal, and that all images are of one camera; free numbers that are fixed, "
        "or take another --model. The pictures of residuals (-o lens.yaml writes a page) show which.",
    )
    LENS_FOUND_FOLDS = Phrase(
        "{count} of {total} corners lie where the lens that was found folds back: beyond that radius it images nothing",
        "Choose another model of lenses, --model rational or fisheye, or look for wrong corners near the rim.",
    )
    LENS_FOLDS_OUTSIDE = Phrase(
        "the lens that was found folds back before {count} of the 4 corners of the image",
        "Bring the target into the corners of the image, or choose another model of lenses: --model.",
    )
    LENS_OVERFITTED = Phrase(
        "views that were left out are missed by {unseen:.3g} px, {times:.2g} times the noise that the fit tells, {seen:.3g} px",
        "Take more views, or keep numbers of the lens that few views tell: --fix k3.",
    )
    CORNERS_OUTSIDE = Phrase(
        "{count} of {total} corners lie outside the image, and are left out: {views}",
        "Detect markers again with robocal vision detect, which lists whole ones alone, or delete these rows.",
    )
    LENS_PRIOR_CONTRADICTED = Phrase(
        "the lens that was given is contradicted: {name} is {found:.6g}, given is {given:.6g}, {times:.2g} standard deviations away",
        "Calibrate the lens again (robocal vision intrinsics), or give that of this camera, focus and resolution.",
    )
    MARKERS_IN_FEW_VIEWS = Phrase(
        "fewer than {least} views show these markers ({count}): {markers}",
        "Take more images that show them, each with neighbours, from different sides.",
    )
    LENS_GAIN_PROVEN = Phrase(
        "the mean error of corners in views that were left out falls by {gain:.4g}[ ({before:.4g~} to {after:.4g})], 95 % interval "
        "{low:.4g~} to {high:.4g} ({how})"
    )
    LENS_NOT_CONVERGED = Phrase(
        "the search for the lens did not come to rest[ ({what})]: its numbers are not its best ones"
    )
