# Made by scripts/front_stub.py from the options of the verbs.
import os
from collections.abc import Callable, Sequence

from robocal._version import __version__ as __version__
from robocal.errors import Cancelled as Cancelled
from robocal.errors import InputError as InputError
from robocal.front import cable as cable
from robocal.front.arrays import Arm as Arm
from robocal.front.arrays import Measurements as Measurements
from robocal.front.arrays import measurements as measurements
from robocal.front.arrays import robot as robot
from robocal.front.arrays import table as table
from robocal.front.found import Found as Found
from robocal.front.found import Identified as Identified

_Path = str | os.PathLike[str]
_Given = _Path | Arm | Measurements | Found
_Watch = Callable[[dict[str, object]], None]

ARRAYS: tuple[str, ...]
FOUND: tuple[str, ...]
ERRORS: tuple[str, ...]
CALLS: tuple[str, ...]
__all__ = [
    "Arm",
    "Cancelled",
    "Found",
    "Identified",
    "InputError",
    "Measurements",
    "__version__",
    "cable",
    "check",
    "compensate",
    "drift",
    "export",
    "identify",
    "import_model",
    "measurements",
    "new",
    "plan",
    "predict",
    "robot",
    "simulate",
    "study",
    "table",
    "validate",
    "verify",
]

def check(
    robot: _Given,
    data: _Given | Sequence[_Given] = (),
    *,
    exclude: str | Sequence[str] = (),
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found:
    """Say what robot and data files contain and what they can tell, without fitting.

    Joints, rows, where sigma comes from, what is free, and what will not be told apart and why; of a cable robot what is known of its
    cables, of CASPR's models too.

    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (robocal new --list).
    data: data.yaml, or a CSV whose headers carry units; several are fitted together.
    exclude: Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def compensate(
    robot: _Given,
    targets: _Given,
    *,
    nominal: str | None = None,
    tool: str = 'calibrated',
    output: _Path | None = None,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found:
    """Correct targets for a controller that keeps its nominal model: joint angles, and Cartesian poses.

    Every correction is checked by driving the calibrated model with it. Targets that cannot be reached are listed, not
    dropped.

    robot: A robot file, a catalogue name, or a run folder.
    targets: A CSV whose headers carry units (poses, positions, joints), or a YAML beside it.
    nominal: The model that the controller keeps; a run folder knows it.
    tool: What both models carry: calibrated, nominal, x,y,z,rx,ry,rz in the robot's units; or own, each its own.
    output: Write compensated.csv and compensation.json here.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def drift(
    first: _Given,
    second: _Given,
    *,
    new_tool: bool = False,
    matters: str = '0.1mm',
    history: _Path | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found:
    """Compare two calibrations of one robot: has it changed, by how many millimetres, and where does it show?

    Both runs must start from the same robot file. The instrument may stand elsewhere; with --new-tool the tool too.

    first: The earlier run folder.
    second: The later run folder, identified from the same robot file.
    new_tool: The tool was mounted anew and may differ.
    matters: The change worth an alarm, with its unit: mean over the poses measured.
    history: Add the runs to this CSV, a row for each number; they are not added twice.
    output: Write drift.json here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def export(
    robot: _Given,
    *,
    output: _Path | None = None,
    form: str = 'yaml',
    nominal: str | None = None,
    into: str | None = None,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found:
    """Hand a robot model on: robot.yaml, URDF, a table of its parameters, or joint offsets for a controller.

    robot: A robot file, a catalogue name, or a run folder.
    output: Write here, not to the terminal.
    form: yaml, urdf, dh (a table with Hayati's beta), csv or markdown (the parameters), offsets of the joints: offsets (CSV), ros (parameters), xacro (properties).
    nominal: What offsets are counted from; a run folder knows it.
    into: With --format urdf: this URDF with calibrated origins, else byte for byte.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def identify(
    robot: _Given,
    data: _Given | Sequence[_Given],
    *,
    output: _Path | None = None,
    force: bool = False,
    free: str | Sequence[str] = (),
    fix: str | Sequence[str] = (),
    prior: str | Sequence[str] = (),
    exclude: str | Sequence[str] = (),
    groups: str | Sequence[str] = (),
    layer: bool = False,
    region: str | None = None,
    method: str = 'lm',
    compare: str | None = None,
    loss: str = 'none',
    hold_out: str | float | None = None,
    group_by: str | None = None,
    folds: int | None = None,
    blocks: int = 10,
    reselect: bool = False,
    leave_one_out: bool | None = None,
    keep_all: bool = False,
    iterations: int = 100,
    particles: int = 1000,
    bootstrap: int | None = None,
    seed: int = 0,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Identified:
    """Identify a robot's true parameters from measurements, and prove the gain on configurations that were not used.

    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (robocal new --list).
    data: data.yaml, or a CSV whose headers carry units; several are fitted together.
    output: Write a run folder here.
    force: Write the run into a folder that holds something else; files of other names stay.
    free: Free exactly these, not what the robot file says: j2.alpha, alpha, j2, tool. Repeat, or separate by commas.
    fix: Hold these; also frames of data files.
    prior: Standard deviation expected beforehand, in the robot file's units; length=... and angle=... for all.
    exclude: Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW.
    groups: Try these beyond geometry; each enters only if unseen blocks of rows get better: gain, eccentricity, ripple, backlash, compliance, sag, bending, expansion.
    layer: Try a residual layer on top; used only if unseen blocks of rows get better.
    region: Where the robot works: a list of poses, or ranges of joints; measured: where it was measured will do.  [default: joint limits that you wrote (a catalogue's are the maker's), else where it was measured]
    method: lm, gauss-newton, ekf, particle; to compare with: pinv (iterated pseudo-inverse), lse (one step), ekf-100.
    compare: Try several estimators on the same split, side by side: say lm,ekf,lse; alone: all that are worth it.
    loss: none, huber, cauchy, tukey: what outliers may weigh.
    hold_out: Share of configurations kept for judging, 0 to 0.5; blocks of rows in time order; or group, whole groups.  [default: 0.2 from 25 configurations on]
    group_by: The column that says what is held out together.
    folds: Hold out everything once, in K rounds, and fit the model to everything.
    blocks: How many, with --hold-out blocks, 2 or more.
    reselect: With --folds: find noise and what is seen anew in every round.
    leave_one_out: Predict every configuration from all the others.  [default: up to 400 configurations]
    keep_all: Fit also what the data cannot tell apart.
    iterations: At most this many, 1 or more.
    particles: For --method particle, 50 to 100000.
    bootstrap: Draw the configurations N times again: intervals that trust no model of the noise.
    seed: For whatever is drawn at random, 0 or more.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def import_model(
    model: _Given,
    *,
    cables: str | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found:
    """Write a model of CASPR as robot.yaml: the robot that every verb reads from the model itself, with one of its cable sets.

    What robot.yaml cannot hold is named.

    model: CASPR's X_cables.xml, with X_bodies.xml beside it.
    cables: The cable set to take, by its id.  [default: the model's default set, or its only one]
    output: Write here, not to the terminal.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def new(
    robot: _Given | None = None,
    *,
    output: _Path = ...,
    joints: int = 6,
    kind: str = 'position',
    listing: bool = False,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found:
    """Write a robot file, a data file and a table to fill in; of a cable robot its file and a list of poses.

    A robot that has a file, such as a URDF, keeps it: its data file and table are written.

    robot: A catalogue name, a convention, cable, or the file of a robot.
    output: Folder for the files.
    joints: How many, when ROBOT is a convention, 1 to 30.
    kind: What is measured: position, pose, spherical, bearing, range, distance, displacement, relative_pose, point, plane, sphere, pixels.
    listing: List the catalogue and the conventions.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def plan(
    robot: _Given,
    data: _Given | None = None,
    *,
    output: _Path | None = None,
    poses: int | None = None,
    criterion: str = 'I',
    accuracy: float | None = None,
    after: str | Sequence[str] = (),
    kind: str = 'position',
    noise: float | None = None,
    frame: str = 'auto',
    draw: int = 5000,
    candidates: str | None = None,
    tests: str | None = None,
    task: str | None = None,
    box: str | None = None,
    floor: float | None = None,
    pedestal: str | None = None,
    distance: str | None = None,
    cone: float | None = None,
    facing: float | None = None,
    seed: int = 0,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found:
    """Choose which poses to measure, and say how many are enough.

    Writes a joint program in an order that is short to travel, and the data file to be filled in.

    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (robocal new --list).
    data: A data file that says which instrument will measure; its measurements do not count (see --after).
    output: Write poses.csv, data.yaml, plan.json and plan.html here.
    poses: How many poses, 1 to 500.  [default: enough]
    criterion: I: mean error at test poses; G: the largest; D, A, E, O1 to O5.
    accuracy: Mean error at test poses that is enough, in the robot file's unit of length, above 0.
    after: Continue from these measurements: what they know counts.
    kind: What is measured: position, pose, spherical, bearing, range, distance, displacement, relative_pose, point, plane, sphere, pixels.
    noise: Standard deviation per axis, in the robot file's unit of length, 0 or more.  [default: 0.05 mm, converted]
    frame: The base seen from the instrument: x,y,z,rx,ry,rz; auto: somewhere; none: base coordinates.
    draw: How many candidates to draw in the region, 20 to 100000.
    candidates: Choose from this list of poses (CSV with joint columns, data.yaml).
    tests: Predict at these poses, not at a sample.
    task: Predict inside x0,y0,z0,x1,y1,z1 of the tool point, while measuring anywhere allowed, in the robot file's unit of length.
    box: Measure only with the tool point inside x0,y0,z0,x1,y1,z1, in the robot file's unit of length.
    floor: Keep tool point and flange above this height over the base, in the robot file's unit of length.
    pedestal: Keep both out of a cylinder of radius R up to height H around the base, in the robot file's unit of length.
    distance: Keep the target this far from the instrument, in the robot file's unit of length.
    cone: Keep it within this angle of the instrument's z axis, in the robot file's unit of angle, above 0.
    facing: Let its z axis point at the instrument within this angle, in the robot file's unit of angle, above 0.
    seed: For whatever is drawn at random, 0 or more.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def predict(
    folder: _Given,
    poses: _Given,
    *,
    absolute: bool = False,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found:
    """Predict where the tool is at given joint values, with 95 % bands; of a cable robot its lengths at poses, or its poses at lengths.

    Two bands: of the model's prediction, and of a new measurement there (as fitted: it adds the noise and what the
    model leaves). Bands are those of the arm's shape; --absolute adds what is not known of the base's place.

    folder: A run folder, as identify -o writes it.
    poses: A CSV with units in its headers: q1 [deg], ...; of a cable robot x [m], ..., or c1 [m], .
    absolute: Include what is not known of where the base stands.
    output: Write here, not to the terminal.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def simulate(
    robot: _Given,
    *,
    output: _Path,
    poses: int = 80,
    at: str | None = None,
    kind: str | None = None,
    noise: float | None = None,
    angle_noise: float | None = None,
    cable_noise: float | None = None,
    length_error: float | None = None,
    angle_error: float | None = None,
    settings: str | Sequence[str] = (),
    frame: str = 'auto',
    fresh: int = 0,
    seed: int = 0,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found:
    """Simulate measurements of a robot that is not quite its model: data, and the truth to compare with.

    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (robocal new --list).
    output: Folder for robot, data and truth.
    poses: Configurations drawn within the joint limits, or within the frame, 1 to 1000000.
    at: Take the joint values of this data file or list of poses, or the platform's poses.
    kind: What is measured: position, pose, spherical, bearing, range, distance, displacement, relative_pose, point, plane, sphere, pixels; of a cable robot position or pose, beside its lengths.  [default: position; pose of a platform that turns]
    noise: Standard deviation per axis, in the robot file's unit of length, 0 or more.  [default: 0.05 mm, converted]
    angle_noise: The same for orientations, in the robot file's unit of angle, 0 or more.  [default: 0.1 mrad, converted]
    cable_noise: Of the lengths of cables, in the robot file's unit of length, 0 or more.  [default: 0.5 mm, converted]
    length_error: Standard deviation of true lengths around nominal ones, in the robot file's unit of length, 0 or more.  [default: 0.3 mm, converted; 10 mm of a cable robot's anchors and zeros]
    angle_error: The same for angles, in the robot file's unit of angle, 0 or more.  [default: 1 mrad, converted]
    settings: A true value, in the robot file's units; may be repeated.
    frame: The base seen from the instrument: x,y,z,rx,ry,rz; auto: somewhere; none: base coordinates.
    fresh: As many more configurations of the same robot, to validate with, 0 to 1000000.
    seed: For whatever is drawn at random, 0 or more.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def study(
    study: _Given,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    tls_ca: _Path | None = None,
    tls_cert: _Path | None = None,
    tls_key: _Path | None = None,
    resume: bool = False,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found:
    """Simulate a study: so many trials of a calibration at every point of a sweep, over all cores.

    The same numbers for the same seed, however many workers there are; a page with pictures of the sweep is written beside them. What
    is done is kept beside the result until all is: after any interruption --resume goes on.

    study: study.yaml: robot, poses, noise, trials and what is varied.
    workers: Processes on this machine, 1 to 1024.  [default: as many as cores]
    cluster: A Dask scheduler, tcp://HOST:PORT or tls://HOST:PORT: workers read the robot where it is here.
    tls_ca: For --cluster: certificate of the authority.
    tls_cert: For --cluster: our certificate.
    tls_key: For --cluster: its key.
    resume: Go on with a study that was interrupted.
    output: Every trial as .npz, or as .csv.  [default: beside the study, as .npz]
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def validate(
    robot: _Given,
    data: _Given | Sequence[_Given],
    *,
    against: str | None = None,
    offsets: str | None = None,
    distances: str = 'consecutive',
    exclude: str | Sequence[str] = (),
    output: _Path | None = None,
    force: bool = False,
    seed: int = 0,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found:
    """Measure the error of a robot model on data that it was not fitted to.

    With repeated visits also pose accuracy and repeatability, and distance accuracy, as ISO 9283 defines them.

    The robot stays as it is. Frames of instruments that the data leave free are fitted again; the figures are then
    labelled profiled.

    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (robocal new --list).
    data: data.yaml, or a CSV whose headers carry units; several are fitted together.
    against: Compare with this robot, say the nominal.
    offsets: Judge these joint offsets (CSV, ROS, xacro) on the nominal robot.
    distances: Between which places: consecutive, all, group, or a column of the configurations.
    exclude: Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW.
    output: Write validation.json and validation.html here.
    force: Replace files that exist.
    seed: For whatever is drawn at random, 0 or more.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """

def verify(
    reference: _Given,
    sources: _Given | Sequence[_Given] = (),
    *,
    summary: bool = False,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found:
    """Compare poses with those that an external instrument saw: as measured, relative to the first one, and after the best alignment.

    Files of poses are CSV whose headers carry units (id, x [mm], ..., rx [deg], ...) or data.yaml with kind: pose, whatever the form of
    their orientations. Of two sources and a reference it is said who agrees with whom, and whether means of errors differ (one-way
    analysis of variance).

    reference: What the external instrument saw; with --summary a table of groups.
    sources: The poses that are judged: of the robot, of its camera, ...; the same ids.
    summary: Analysis of variance from means and standard deviations.
    output: Write verify.json and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Raises InputError.
    """
