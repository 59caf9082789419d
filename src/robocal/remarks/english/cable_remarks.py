"""What is remarked on cable robots and their lists, in English."""

from __future__ import annotations

from robocal.remarks.phrase import Phrase

__all__ = ["CableRemarks"]


class CableRemarks:
    """What is remarked on cable robots and their lists."""

    SAME_FRAME_POINT = Phrase(
        "[{file}: ]cables {one} and {other} leave the frame at the same point",
        "Check their frame anchors, unless they truly share one.",
    )
    POSE_UNDETERMINED = Phrase(
        "[{file}: ]{cables} cables do not determine {degrees} degrees of freedom: the pose does not follow from the "
        "lengths",
        "Check the number of cables and the degrees of freedom.",
    )
    SEGMENT_OF_ZEROS = Phrase(
        "{file}: from row {first} to row {last} the zeros of several cables are off[ by {shift:.3g}]; the sensors seem to have been "
        "reset ({count} rows, {strength:.1f} times the residual elsewhere)",
        "Put these rows into a separate file with `zeros: NAME`, whose zeros are found by themselves. Or do without them "
        "(--exclude {first}-{last}).",
    )
    SAID_OF_SOME = Phrase("{file}: {what} is stated for some cables only, and ignored", "State it for every cable.")
    INERTIA_OF_NO_BODY = Phrase(
        "{file}: the inertia (row {row} of {bodies}) is impossible for a rigid body, and ignored",
        "Correct the moments of inertia in that file where they matter.",
    )
    CABLE_SETS_ASIDE = Phrase(
        "{file}: of its cable sets only {chosen} is read, not {others}",
        "--cables SET reads another one, into a separate robot.yaml.",
    )
    COUNTED_FROM_ELSEWHERE = Phrase(
        "{file}: CASPR counts the platform's position from {x:.6g}, {y:.6g}, {z:.6g} m, robot.yaml from the base",
        "Add these to the positions of CASPR's trajectories; lengths at a pose are the same.",
    )
    NO_KEY_FOR = Phrase("{file}: robot.yaml has no key for {names}; no length or tension depends on it")
    ANCHORS_UNUSED = Phrase(
        "{file}: no cable uses {side} anchor {anchors}", "Spare anchors do no harm; check that no cable is missing."
    )
    TENSIONS_ASIDE = Phrase(
        "the tensions of the list are ignored: the elasticity of {robot} is not known",
        "State the elasticity of the cables in the robot file.",
    )
    ANCHOR_MOVED = Phrase(
        "{run}: the frame anchor of {cable} moved: {across:.3g} across its line of sight, {along:.3g~} ± {off:.2g} along "
        "it ({x:+.3g~}, {y:+.3g~}, {z:+.3g} in x, y, z)",
        "Look at its pulley and the mounting of the pulley. Use the later calibration.",
    )
    ANCHOR_OR_ZERO = Phrase(
        "{run}: anchor or zero of {cable} changed along its line of sight; the data do not show which (zero {zero:+.3g}, "
        "anchor {along:+.3g})",
        "If the sensors counted on between the runs, `cable drift --zeros-unchanged` separates the two.",
    )
    ZEROS_CHANGED = Phrase(
        "{run}: the zeros of {cables} changed, as they do at a power-up; an anchor that moved along its line of sight "
        "looks the same",
        "To detect such a drift, compare runs of one power-up with `cable drift --zeros-unchanged`.",
    )
    SIZE_CHANGED = Phrase(
        "{run}: all frame anchors changed as one: the size by {size:+.4g} ± {off:.2g} ppm (95 %)",
        "Check the scale of the instrument, such as the size of a marker. A steel frame would be {kelvin:.0f} K warmer or colder.",
    )
    NOTHING_MOVED = Phrase("{run}: no frame anchor moved by more than these calibrations would show by chance")
    SMALLEST_DRIFT = Phrase(
        "a drift of one anchor would be detected with 95 % certainty from {along:.2g} along its line of sight and "
        "{across:.2g} across it"
    )
    SMALLEST_DRIFT_FREE = Phrase(
        "zeros may have changed: a drift of one anchor would be detected with 95 % certainty from {across:.2g} across its "
        "line of sight; along it from {along:.2g}, where anchor and zero look alike",
        "If the sensors counted on between the runs, `cable drift --zeros-unchanged` detects much smaller drifts along it.",
    )
    NOTHING_KNOWN_OF_ERRORS = Phrase(
        "{run}: the uncertainty of its parameters is not known; the report shows how the calibrations scatter, not what "
        "moved",
        "Compare run folders of `identify` (-o).",
    )
    CALIBRATION_CARRIED = Phrase(
        "standard deviations include the uncertainty of the calibration of {run}, beside the noise of these lengths"
    )
    SHAPE_CARRIED = Phrase(
        "standard deviations include the uncertainty of the calibration of {run}, but not where its base stands, which nothing measured: "
        "the base is taken as placed best over these rows"
    )
    STRETCH_TAKEN = Phrase("stretch is removed from the lengths, up to {most}, by {how} tensions")
    BASE_NOT_MEASURED = Phrase(
        "{runs}: no instrument stood on the base, so only the shape is known: the base may differ by a motion",
        "To detect anchors that move together, measure poses by a camera or a tracker on the base in both runs.",
    )
    MEASUREMENTS_SHARED = Phrase(
        "{run}: identified from {files}, as the first run was: both runs share these errors, and the comparison cannot "
        "show them",
        "Compare runs that have no measurement in common.",
    )
    CABLE_FILE_LACKS = Phrase(
        "calibrated.yaml cannot hold the fitted {names}: they differ between files of lengths, and a robot has one of each",
        "Of several power-ups, `robocal cable rezero` writes the zeros of the one that is on. Of several drums, name one `gain` in all "
        "files.",
    )
    BEYOND_TAKEN = Phrase("lengths are read with {names}, as {run} identified them")
    ZEROS_LEFT_ASIDE = Phrase(
        "lengths are read with the zeros of the robot file, not with {names}, which {run} identified as well"
    )
    TENSIONS_WEIGH = Phrase(
        "the tensions carry a mass of {mass}, the robot file states {stated}",
        "Check the unit of the tensions. They carry the payload too: state it with the mass of the platform.",
    )
    MIRROR_IMAGE = Phrase(
        "the platform anchors of {cables} stay in {shape}: a frame anchor and its mirror image fit equally well, and the "
        "predicted errors hold only where the start is nearer to the right one",
        "Poses that turn the platform, or leave the plane, need no start.",
    )
    POSES_AWAY = Phrase(
        "the poses are {away} from the middle of the frame anchors, which scatter by {size}",
        "Check the unit of the list, and that the list belongs to this robot.",
    )
    POSES_TAKEN_EXACT = Phrase(
        "poses are chosen as if an instrument measured them exactly",
        "--pose-noise states the noise of the instrument; --encoders-only states that there is no instrument.",
    )
    TENSIONS_NOT_ASKED = Phrase(
        "only contacts were checked: tension limits or mass of {robot} are not known",
        "State them in the robot file, or by --limits and --mass.",
    )
    SAG_TAKEN = Phrase("sag is removed from the lengths, up to {most}, by the density that the robot file states")
    STRETCH_LEFT = Phrase(
        "stretch is not removed from the lengths: no tensions are stated, and within its limits a cable's length changes "
        "by up to {most}",
        "`tension: {{columns: [...], unit: N}}` in the data file removes it. So does `tension: computed`, with tensions in "
        "the middle of the limits.",
    )
    LENGTHS_GEOMETRIC = Phrase(
        "the cables of {robot} stretch and no tension is given: these lengths are geometric, not what the sensors show",
        "Give --tension, or columns of tensions (c1.tension).",
    )
    LENGTHS_TAKEN_GEOMETRIC = Phrase(
        "the cables of {robot} stretch and no tension is given: the lengths are taken as geometric, and the poses err by "
        "the stretch",
        "Give --tension, or columns of tensions (c1.tension). Lengths without stretch belong in columns called "
        "c1.geometric.",
    )
    UNLIKE_UNKNOWN = Phrase(
        "{source}: these are not the poses of {reference}: after the best alignment they differ by {left}, and the poses "
        "scatter by {spread}",
        "Check units, the order of the rows, axes and the convention of the orientations.",
    )
    UNLIKE_STILL = Phrase(
        "{source}: its positions scatter by {left}, those of {reference} by {spread}",
        "Check the columns of its positions.",
    )
    UNLIKE_SCALED = Phrase(
        "{source}: its positions scatter {factor:.4g} times as far as those of {reference}",
        "Check the unit of its positions.",
    )
    UNLIKE_MIRRORED = Phrase(
        "{source}: its positions are a mirror image of those of {reference}: mirrored, they fit; as they stand, {left} "
        "remain",
        "Two axes are exchanged, one has the wrong sign, or its frame is left-handed.",
    )
    UNLIKE_SHIFTED = Phrase(
        "{source}: its rows are those of {reference} shifted by {factor:.0f}: shifted back, they fit; as they stand, "
        "{left} remain",
        "Check its ids.",
    )
    UNLIKE_TURN_UNIT = Phrase(
        "{source}: its orientations are those of {reference} in degrees that were read as radians, or the other way round",
        "Check the unit of its orientations.",
    )
    UNLIKE_TURN_INVERTED = Phrase(
        "{source}: its orientations are the inverse of those of {reference}",
        "Check the convention of its orientations: rows and columns, order and frame of angles, sign of the quaternion's vector.",
    )
    NO_DIAMETER = Phrase(
        "no cable diameter is known: contacts are those of lines without thickness", "--diameter states it."
    )
    POSE_OUT_OF_REACH = Phrase(
        "{pose}: a platform with {degrees} cannot be there: it is {off:.3g} away from {first} in {column}",
        "Check the columns of the list, and the degrees of the robot. The result is for the pose as stated.",
    )
    WRENCH_UNBALANCED = Phrase(
        "left out of the wrench: {components}; a platform with {degrees} does not balance them",
        "Another support has to carry them. Or state other degrees in the robot file.",
    )
    MOTIONS_OPEN = Phrase("{count} motions end where the search for contacts stopped: free up to there, unknown beyond")
    LENGTH_NOISE_ASSUMED = Phrase("no noise of a length is stated: 1 mm is assumed", "--sigma states it.")
    NOISE_TEACHES_NOTHING = Phrase(
        "--sigma {sigma:g} {unit} is larger than the residual without any measurement ({expected:g}): the measurement "
        "would add nothing",
        "Check the unit of --sigma, or measure lengths better.",
    )
    NO_POSE = Phrase(
        "{pose}: no pose was found at which the cables can hang with these lengths",
        "Check the tensions and the density of the cables: a tension that is too small does not carry their weight.",
    )
    SEARCH_UNENDED = Phrase(
        "{pose}: the search did not converge to a minimum",
        "Check the lengths of this row, their unit and the order of the cables.",
    )
    SINGULAR_POSE = Phrase(
        "{pose}: near this pose the lengths do not determine where the platform is: a singular pose",
        "Measure another pose, or hold the platform with more cables.",
    )
    SEVERAL_POSES = Phrase(
        "{pose}: {count} poses explain these lengths equally well",
        "More cables leave fewer such poses. Compare the pose that is told with what you know of the position.",
    )
    LENGTHS_UNEXPLAINED = Phrase(
        "{pose}: no pose explains these lengths: the residual is {left:.3g}, {expected:.3g} is expected",
        "Check the lengths of this row, the model of the cables (tension, sag) and --sigma.",
    )
    LENGTHS_LEFT = Phrase(
        "{pose}: the residual of its lengths is {left:.3g}",
        "Check the unit of the lengths and the order of the cables. --sigma of robocal cable forward states what residual is expected.",
    )
    NOT_HELD = Phrase(
        "{pose}: no tensions within the limits hold it; {missing} is missing", "Choose another pose, load or limits."
    )
    CLOSED_FORM_LEAVES = Phrase(
        "{pose}: the closed form violates the limits where other tensions do not", "--method mid finds them."
    )
    AND_MORE = Phrase("... and {count} more")
    NO_MARGIN = Phrase(
        "held, but with no margin: at a singular pose, or at a limit, some disturbance moves the platform: {poses}[ and "
        "{more} more]",
        "Keep away from these poses, or widen the limits.",
    )
    LEANING = Phrase(
        "{pose}: cable {cable} leaves the plane {plane} by {angle:.3g}; nothing balances its force across the plane",
        "Check the anchors, or model the robot in space (3R3T).",
    )
    PARTS_APART = Phrase(
        "{count} parts that do not touch ({sizes} {unit}): rays reach only the part around their start",
        "--start chooses another part.",
    )
    HOLES = Phrase("{count} holes ({size:.3g} {unit}) inside: rays end at the first they meet")
    START_SEES_PART = Phrase(
        "rays from the start do not reach {share:.2g} % of the feasible cells: the {edge} leaves them out",
        "--start X,Y,Z chooses another.",
    )
    RAYS_DIFFER = Phrase(
        "rays and grid differ by {percent:+.1f} %",
        "[More --cells or --rays reduce the difference (rays from the start reach {seen:.0%} of the feasible cells).]",
    )
    ONLY_SINGULAR = Phrase(
        "every feasible cell is a singular pose: there the cables balance the demanded wrench and no other disturbance; "
        "the volume by the grid means nothing",
        "Demand a reserve or an acceleration, or give the robot other anchors or limits.",
    )
    NOTHING_HELD = Phrase(
        "no cell of the grid can be held: the nearest to it, at {at} {length}, lacks {lack:.3g} {force} or more",
        "Demand less, or widen the limits.",
    )
    NOTHING_CLOSED = Phrase(
        "no cell of the grid is wrench-closed: cables only pull, and at no cell do they balance every wrench, however "
        "strong they are",
        "A platform that hangs from above needs its weight: leave --closure out.",
    )
    ONLY_START_CLOSED = Phrase(
        "no cell of the grid is wrench-closed, but the start of the rays is", "Choose a smaller --box, or more --cells."
    )
    ONLY_START_HELD = Phrase(
        "no cell of the grid can be held: the nearest to it, at {at} {length}, lacks {lack:.3g} {force} or more; but the "
        "start of the rays can be held",
        "Choose a smaller --box, or more --cells.",
    )
    ZEROS_OF_ONE_POSE = Phrase("the zeros come from one pose: what it is off by stands in every length")
    ZEROS_DISAGREE = Phrase(
        "the zeros of single poses differ by up to {most} ({cable}), more than {sigma} of noise makes them",
        "Check the poses and the rows of the lengths, or calibrate anew. Where poses are known worse than that, --sigma states it.",
    )
    LOAD_NOT_ABOVE = Phrase(
        "the loads leave the {what} of the cable between {low:.3g} and {high:.3g} (95 %), and every cable has one above zero",
        "Check units and columns of the loads, and that larger elongations count up. Else measure more loads, farther apart.",
    )
    TENSIONS_FROM_CURRENTS = Phrase(
        "tensions follow from the currents, {low:.4g~} to {high:.4g}, by winches that the run has identified: friction is up to "
        "{friction:.3g} of them"
    )
    LOADS_UNLIKE = Phrase(
        "the loads say {found:.4g} of the {what} of the cable, the robot's file {stated:.4g}: {times:.4g} times as much",
        "Check units and columns of the loads (tension, {reading}, {length}), and the {what} in the robot's file.",
    )
    LOADS_OTHER = Phrase(
        "the loads say {low:.4g~} to {high:.4g} (95 %) of the {what} of the cable, the robot's file {stated:.4g}",
        "Write {found:.4g} into the robot's file, as {key}.",
    )
    LOADS_ROW = Phrase(
        "{file}, row {row}: the {reading} of {found:.4g} is far from all other loads, which say {told:.4g}[; it was not counted{aside}]",
        "Correct this row, or remove it.",
    )
    LOADS_COPIED = Phrase(
        "{file}: {count} of {of} loads repeat others to the last digit, such as row {row}",
        "Give every measurement once: what is given twice counts twice.",
    )
    LOADS_UNEXPLAINED = Phrase(
        "with the tension the loads vary by {share:.0%} of what those of such a cable would (the fit of the {what})",
        "Check units and columns of the loads, and that each row is of one load.",
    )
    LOADS_SCATTER = Phrase(
        "the sags scatter by {share:.0%} around those that one weight makes at these tensions and spans",
        "Check that each row is of one load: its sag, its tension and its span.",
    )
    CABLE_HANGS_SLACK = Phrase(
        "{pose}: the tension of {cable}, {tension:.3g}, does not carry its weight[; so at {more} more poses]",
        "Choose a greater tension there.",
    )
    STRETCH_BEYOND = Phrase(
        "{cable} is {share:.0%} longer under {tension:.3g}: a rope breaks before",
        "Check the elasticity in the robot's file and its unit, and that of the tensions.",
    )
    CABLE_TOO_LIGHT = Phrase(
        "by weight and elasticity sound runs at {speed:.3g} in {cable}, faster than in any material",
        "Check density and elasticity of the cables, and their units.",
    )
    SPAN_UNLIKE = Phrase(
        "the level cable of the table is {span:.4g} long, the longest cable at the poses {longest:.4g}",
        "Give --span in {unit}, the unit of the robot's file.",
    )
    TENSIONS_BEYOND = Phrase(
        "the tensions are {low:.4g~} to {high:.4g}, the robot's file allows {least:.4g~} to {most:.4g}",
        "Check the unit of the tensions, and the tension limits in the robot's file.",
    )
