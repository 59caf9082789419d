# Made by scripts/front_stub.py from the options of the verbs.
import os
from collections.abc import Callable, Sequence
from typing import Any

from robocal._types import Array as _inverse_Array
from robocal.front.cable_arrays import CableArm as CableArm
from robocal.front.cable_arrays import robot as robot
from robocal.front.measurements import Measurements
from robocal.front.verb_result import Found
from robocal.session.cable.drift import Drifts as _drift_Drifts
from robocal.session.cable.pose_list_result import Listed as _poses_Listed
from robocal.session.cable.power_up_zeros import Rezeroed as _rezero_Rezeroed
from robocal.session.cable.straightness_result import Straightness as _straightness_Straightness
from robocal.session.cable.workspace_result import Workspace as _workspace_Workspace
from robocal.session.commissioning.rig_commission import Commissioned as _rig_Commissioned
from robocal.verbs.cable.contact.result import Motions as _contact_Motions
from robocal.verbs.cable.forward.result import Poses as _forward_Poses
from robocal.verbs.cable.require.result import Required as _require_Required
from robocal.verbs.cable.tension.result import Tensions as _tension_Tensions

_Path = str | os.PathLike[str]
_Given = _Path | CableArm | Measurements | Found[Any]
_Watch = Callable[[dict[str, object]], None]

def inverse(
    robot: _Given,
    poses: _Given,
    *,
    tension: float | str | None = None,
    sag: bool = False,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_inverse_Array]:
    """Sensor readings of the cable lengths at poses of the platform.

    If the cables of the robot file stretch and no tension is given, the columns are called c1.geometric: lengths without
    stretch.

    Takes
    robot: robot.yaml with kind: cable, or CASPR's X_cables.xml; or rc.robot(...), rc.cable.robot(...).
    poses: CSV: x [m], y, z, rx [deg], ry, rz (rotation vector), or qx, qy, qz, qw; or rc.table(...).
    tension: Tension of every cable: cables stretch, in the robot file's unit of force or its own, 0 or more.
    sag: Include the sag of the cables by their weight.
    output: Write here, not to the terminal.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Array, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def forward(
    robot: _Given,
    lengths: _Given,
    *,
    sigma: float | str | None = None,
    starts: int = 24,
    tension: float | str | None = None,
    sag: bool = False,
    seed: int = 0,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_forward_Poses]:
    """Poses of the platform from lengths of its cables, with their uncertainty and the number of other solutions.

    With a run folder as ROBOT, the standard deviations include the uncertainty of its calibration.

    Exit status 3 when a pose was not found, is not the only one, or does not fit its lengths.

    Takes
    robot: robot.yaml with kind: cable, or CASPR's X_cables.xml; or rc.robot(...), rc.cable.robot(...).
    lengths: CSV: one column per cable, such as c1 [mm]; c1.geometric [mm] for lengths without stretch; or rc.table(...), rc.measurements(...).
    sigma: Standard deviation of a length, in the robot file's unit of length or its own, above 0.
    starts: Number of further starts, to find other poses, 0 or more.  [default: 24]
    tension: Tension of every cable: cables stretch, in the robot file's unit of force or its own, 0 or more.
    sag: Include the sag of the cables by their weight.
    seed: Seed of all random draws, 0 or more.
    output: Write here, not to the terminal.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Poses, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def tension(
    robot: _Given,
    poses: _Given,
    *,
    method: str = 'norm',
    power: float | None = None,
    mass: float | str | None = None,
    payload: float | str = 0.0,
    wrench: str | None = None,
    limits: str | Sequence[float | str] | None = None,
    length: float | str | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_tension_Tensions]:
    """Tensions that hold the platform at poses, their margins, and the missing wrench where no tensions hold it.

    Exit status 3 when no tensions hold a pose. cable inverse and cable forward read the written list.

    Takes
    robot: robot.yaml with kind: cable, or CASPR's X_cables.xml; or rc.robot(...), rc.cable.robot(...).
    poses: CSV: x [m], y, z, rx [deg], ry, rz (rotation vector), or qx, qy, qz, qw; or rc.table(...).
    method: norm (least), mid, closed, barycentre (continuous), p-norm.  [default: 'norm']
    power: Exponent of method='p-norm', from 2 on.  [default: 4]
    mass: Mass of the platform, in place of that in the robot file, in the robot file's unit of mass or its own, 0 or more.
    payload: Payload at the centre of mass, in the robot file's unit of mass or its own, 0 or more.
    wrench: Acts on the platform at its origin, base axes: the robot file's unit of force, and Nm.
    limits: Tension limits of every cable, not those of the robot file, in the robot file's unit of force or its own.
    length: Divides moments to compare them with forces, in the robot file's unit of length or its own, above 0.  [default: 1 m]
    output: Write tensions.csv, tension.json and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Tensions, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def workspace(
    robot: _Given,
    *,
    orientation: str | Sequence[float | str] | Sequence[str | Sequence[float | str]] = (),
    tilt: float | str | None = None,
    payload: str | None = None,
    mass: str | None = None,
    wrench: str | Sequence[str] = (),
    acceleration: float | str = 0.0,
    reserve: float | str = 0.0,
    closure: bool = False,
    limits: str | Sequence[float | str] | None = None,
    length: float | str | None = None,
    box: str | Sequence[float | str] | None = None,
    cells: int = 41,
    rays: int = 4000,
    start: str | Sequence[float | str] | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_workspace_Workspace]:
    """The workspace of the platform: volume by a grid and by rays to the exact boundary, margins, dexterity, sections, a mesh.

    Exit status 3 when it can be held nowhere.

    Takes
    robot: robot.yaml with kind: cable, or CASPR's X_cables.xml; or rc.robot(...), rc.cable.robot(...).
    orientation: A rotation vector; repeat for several, all of which must be held, in the robot file's unit of angle or its own.  [default: upright]
    tilt: Hold tilts too: half the angle and all of it, about 8 horizontal axes, in the robot file's unit of angle or its own.
    payload: Payload at the centre of mass, one number or a range, for example 0,20, in the robot file's unit of mass or its own.
    mass: Of the platform, one number or a range, instead of the file's, in the robot file's unit of mass or its own.
    wrench: Acts beside the weight at the platform's origin, base axes: the robot file's unit of force, and Nm; repeat for several, all of which are to be held, with 0,0,0,0,0,0 for none.
    acceleration: Of the centre of mass, in any direction [m/s2], 0 or more.
    reserve: A disturbance in any direction that is held on top, in the robot file's unit of force or its own, 0 or more.
    closure: Any wrench, by tensions of any size (wrench closure): no mass, no limits, no weight.
    limits: Tension limits of every cable, not those of the robot file, in the robot file's unit of force or its own.
    length: Divides moments to compare them with forces, in the robot file's unit of length or its own, above 0.  [default: 1 m]
    box: Search box, in the robot file's unit of length or its own.  [default: the reach of the frame]
    cells: Cells of the grid along each axis, 2 to 300.  [default: 41]
    rays: Number of rays to the exact boundary, 20 to 200000.  [default: 4000]
    start: Start of the rays, in the robot file's unit of length or its own.  [default: the mean of the frame anchors, or the middle of the workspace]
    output: Write workspace.json, workspace.csv, outlines.csv, surface.ply, surface.stl and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Workspace, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def poses(
    robot: _Given,
    *,
    poses: int = 200,
    mu: float = 0.95,
    start: str | Sequence[float | str] = 'mean',
    box: str | Sequence[float | str] | None = None,
    scale: float = 1.1,
    turn: float | str | None = None,
    diameter: float | str | None = None,
    body: str = 'hull',
    relief: float | str | None = None,
    payload: float | str = 0.0,
    mass: float | str | None = None,
    limits: str | Sequence[float | str] | None = None,
    method: str = 'norm',
    steps: int = 10,
    choose: int | None = None,
    criterion: str = 'A',
    sigma: float | str | None = None,
    pose_noise: str | Sequence[float | str] | None = None,
    encoders_only: bool = False,
    seed: int = 0,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_poses_Listed]:
    """Poses that the platform can reach and leave again: with feasible tensions on the whole path, and without contact of a cable.

    With choose= the folder also gets lengths.yaml and poses.yaml with their tables, to fill in what is measured at the chosen poses.

    Takes
    robot: robot.yaml with kind: cable, or CASPR's X_cables.xml; or rc.robot(...), rc.cable.robot(...).
    poses: Poses to list, 1 to 10000.  [default: 200]
    mu: Used fraction of each free path, above 0 and at most 1.  [default: 0.95]
    start: X_0: mean of the frame anchors, best of a grid, or X,Y,Z[,RX,RY,RZ] in the robot file's units.  [default: 'mean']
    box: The box Z of random poses, in place of the box in which the frame can hold the platform, in the robot file's unit of length or its own.
    scale: Z, as a multiple of the machine, 0 to 1000.  [default: 1.1]
    turn: Turns in Z, about each axis, in the robot file's unit of angle or its own.  [default: 30 deg]
    diameter: Diameter of every cable, in place of that in the robot file, in the robot file's unit of length or its own, 0 or more.
    body: The platform: hull or box of its anchors, none, or LX,LY,LZ.  [default: 'hull']
    relief: Distance from an anchor within which a cable may touch its own eyelet, in the robot file's unit of length or its own, above 0.  [default: 10 diameters]
    payload: Payload at the centre of mass, in the robot file's unit of mass or its own, 0 or more.
    mass: Mass of the platform, in place of that in the robot file, in the robot file's unit of mass or its own, 0 or more.
    limits: Tension limits of every cable, not those of the robot file, in the robot file's unit of force or its own.
    method: norm (least), mid, closed, barycentre (continuous), p-norm.  [default: 'norm']
    steps: Waypoints on each path, 1 to 1000.  [default: 10]
    choose: Choose the N poses that are best for calibration.
    criterion: For choose=: A (least rms), D, I, G, E, O1 to O5.  [default: 'A']
    sigma: For choose=: standard deviation of a length, in the robot file's unit of length or its own, above 0.  [default: 1 mm, converted]
    pose_noise: For choose=: standard deviation per axis of a measured pose, in the robot file's units or their own.
    encoders_only: For choose=: no instrument measures poses.
    seed: Seed of all random draws, 0 or more.
    output: Write poses.csv, program.csv, list.json and report.html here; with choose= chosen.csv, and data files to fill in.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Listed, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def contact(
    robot: _Given,
    poses: _Given,
    *,
    from_first: bool = False,
    diameter: float | str | None = None,
    body: str = 'hull',
    relief: float | str | None = None,
    payload: float | str = 0.0,
    mass: float | str | None = None,
    limits: str | Sequence[float | str] | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_contact_Motions]:
    """Check a path for contacts of cables and platform and for tensions: straight motions from each pose of a list to the next.

    Contacts are certified between the poses too. Exit status 3 where a motion is not possible to its end; its share, 0 to 1, is the
    possible part.

    Takes
    robot: robot.yaml with kind: cable, or CASPR's X_cables.xml; or rc.robot(...), rc.cable.robot(...).
    poses: CSV: x [m], y, z, rx [deg], ry, rz (rotation vector), or qx, qy, qz, qw; or rc.table(...).
    from_first: Move to every pose from the first one, not from the one before: a list of targets.
    diameter: Diameter of every cable, in place of that in the robot file, in the robot file's unit of length or its own, 0 or more.
    body: The platform: hull or box of its anchors, none, or LX,LY,LZ.  [default: 'hull']
    relief: Distance from an anchor within which a cable may touch its own eyelet, in the robot file's unit of length or its own, above 0.  [default: 10 diameters]
    payload: Payload at the centre of mass, in the robot file's unit of mass or its own, 0 or more.
    mass: Mass of the platform, in place of that in the robot file, in the robot file's unit of mass or its own, 0 or more.
    limits: Tension limits of every cable, not those of the robot file, in the robot file's unit of force or its own.
    output: Write legs.csv, contact.json and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Motions, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def rezero(
    robot: _Given,
    lengths: _Given,
    *,
    at: str | Sequence[float | str] | None = None,
    poses: str | None = None,
    sigma: float | str | None = None,
    tension: float | str | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_rezero_Rezeroed]:
    """Zeros of the length sensors after power-up, from what they show at known poses; everything else stays as it was identified.

    The result is the robot's file with these zeros, which every verb reads. Several poses show whether they agree.

    Exit status 3 where the zeros of single poses differ by more than sigma= allows.

    Takes
    robot: robot.yaml with kind: cable, or CASPR's X_cables.xml; or rc.robot(...), rc.cable.robot(...).
    lengths: CSV: what the sensors show, one column per cable, such as c1 [mm]; or rc.table(...), rc.measurements(...).
    at: Where the platform stood: X,Y,Z or X,Y,Z,RX,RY,RZ in the robot file's units.
    poses: CSV of poses in which the ids of LENGTHS stand.
    sigma: Standard deviation of a length, in the robot file's unit of length or its own, above 0.
    tension: Tension of every cable: cables stretch, in the robot file's unit of force or its own, 0 or more.
    output: Write here, not to the terminal.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Rezeroed, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def require(
    robot: _Given,
    poses: _Given,
    *,
    sigma: str = '1mm',
    sigma_position: str | None = None,
    sigma_orientation: str | None = None,
    accuracy: str | None = None,
    of: str = 'anchors',
    estimator: str = 'maximum-likelihood',
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_require_Required]:
    """Predict the accuracy of a calibration of frame anchors and zeros, before anything is measured. With accuracy=, compute which
    sensors and how many poses it needs.

    Exit status 3 when the accuracy is not reached with these noises and poses.

    Takes
    robot: robot.yaml with kind: cable, or CASPR's X_cables.xml; or rc.robot(...), rc.cable.robot(...).
    poses: CSV: x [m], y, z, rx [deg], ry, rz (rotation vector), or qx, qy, qz, qw; or rc.table(...).
    sigma: Standard deviation of a length.  [default: '1mm']
    sigma_position: The same of a component of the measured position.  [default: known exactly]
    sigma_orientation: The same of a component of the measured rotation vector.  [default: known exactly]
    accuracy: The required error, root mean square.
    of: Quantity of accuracy=: frame anchors (components), zeros, or the platform's position or orientation.  [default: 'anchors']
    estimator: Maximum likelihood with free poses, as identify does it, or every cable by itself: maximum-likelihood, per-cable.  [default: 'maximum-likelihood']
    output: Write require.json, contours.csv and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Required, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def drift(
    runs: _Given | Sequence[_Given],
    *,
    zeros_unchanged: bool = False,
    base_moves: bool = False,
    history: _Path | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_drift_Drifts]:
    """Find which frame anchor of a cable robot moved between calibrations, and how calibrations scatter.

    It also reports changes of zeros, scale and base.

    Every later run is compared with the first. Towards the platform, an anchor and the zero of its cable have the same effect. So
    that direction has the largest uncertainty, unless zeros_unchanged=True states that the sensors counted on.

    Takes
    runs: Run folders of one robot, the earliest first; robot files give only the scatter.
    zeros_unchanged: The sensors counted on between the runs: their zeros are the same.
    base_moves: The coordinates may differ by a motion: another instrument, or another place of it.
    history: Add the runs to this CSV, a row for each number; they are not added twice.
    output: Write drift.json and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Drifts, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def straightness(
    robot: _Given,
    *,
    poses: str | None = None,
    wanted: str = '1mm',
    loads: str | Sequence[str] = (),
    tension: float | str | None = None,
    span: float | str | None = None,
    at: str | Sequence[str] = (),
    mass: float | str | None = None,
    payload: float | str = 0.0,
    limits: str | Sequence[float | str] | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_straightness_Straightness]:
    """Sag, excess length and stretch of cables, in millimetres of length and of pose, and the least tension for a wanted error.

    Loads that were measured on a cable give its weight and its elasticity, as a constant and as a curve, with 95 % intervals. The
    folder then gets the robot's file with weight and constant elasticity.
    Without tension=, tensions are those of the list of poses, else the least ones that hold the platform.

    Takes
    robot: robot.yaml with kind: cable, or CASPR's X_cables.xml; or rc.robot(...), rc.cable.robot(...).
    poses: CSV of poses: x [m], y, z, rx [deg], ry, rz, or a quaternion.  [default: the middle of the frame]
    wanted: The error that is allowed, of a length and of a position.  [default: '1mm']
    loads: Measured loads of a cable: data.yaml, or a CSV whose headers carry units.
    tension: Tension of every cable: cables stretch, in the robot file's unit of force or its own, 0 or more.
    span: Span of the level cable in the table, in the robot file's unit of length or its own, above 0.  [default: the longest cable]
    at: Tensions in that table, in the robot file's unit of force.  [default: within the tension limits]
    mass: Mass of the platform, in place of that in the robot file, in the robot file's unit of mass or its own, 0 or more.
    payload: Payload at the centre of mass, in the robot file's unit of mass or its own, 0 or more.
    limits: Tension limits of every cable, not those of the robot file, in the robot file's unit of force or its own.
    output: Write straightness.csv, straightness.json and report.html here; with loads= also robot.yaml, with what they tell.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Straightness, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def rig(
    spec: _Given,
    *,
    output: _Path,
    poses: int | None = None,
    lists: int | None = None,
    anchors: str | None = None,
    images: bool = False,
    seed: int = 0,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_rig_Commissioned]:
    """Simulate the commissioning of a cable robot: from a rough geometry through a list of poses to a verified calibration.

    A controller that believes the rough geometry moves the platform from X_0 to each pose and back. Lengths, tensions, corners of markers
    and poses of an instrument are recorded, and `identify` makes a calibration of them. The controller gets it, and ten
    further poses verify it. Each list has a folder with files that `identify`, `cable forward` and `verify` read.

    Exit status 3 where the rig stopped, or a calibration is not trusted.

    Takes
    spec: rig.yaml: what the robot truly is, what its builder believes, camera, markers, instruments, poses.
    output: Folder for the files of the rig, a folder for each list, and a page.
    poses: Calibration poses of a list, 4 to 10000.  [default: as the file says]
    lists: Lists of poses, each calibrated by itself, 1 to 26.  [default: as the file says]
    anchors: How the builder knows the anchors: tape or beacons.  [default: as the file says]
    images: Draw the images of the camera, and look for corners in them; otherwise corners are projected.
    seed: Seed of all random draws, 0 or more.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Commissioned, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """
