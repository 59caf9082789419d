# Made by scripts/front_stub.py from the options of the verbs.
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from robocal._version import __version__ as __version__
from robocal.errors import Cancelled as Cancelled
from robocal.errors import InputError as InputError
from robocal.files.cable.caspr import Caspr as _import_model_Caspr
from robocal.front import cable as cable
from robocal.front import drive as drive
from robocal.front import vision as camera
from robocal.front.cable_arrays import CableArm
from robocal.front.measurements import Measurements as Measurements
from robocal.front.measurements import measurements as measurements
from robocal.front.measurements import table as table
from robocal.front.plots import Plot as Plot
from robocal.front.robots import Arm as Arm
from robocal.front.robots import robot as robot
from robocal.front.verb_result import Found as Found
from robocal.front.verb_result import Identified as Identified
from robocal.session.pose_groups import AnovaResult as _verify_AnovaResult
from robocal.session.prediction import Prediction as _predict_Prediction
from robocal.session.verified_poses import Verified as _verify_Verified
from robocal.studies.run import StudyOutputs as _study_StudyOutputs
from robocal.verbs.check.result import Checked as _check_Checked
from robocal.verbs.compensate.result import Compensated as _compensate_Compensated
from robocal.verbs.export.result import Exported as _export_Exported
from robocal.verbs.new.result import Catalogue as _new_Catalogue
from robocal.verbs.new.result import New as _new_New
from robocal.verbs.plan.result import Planned as _plan_Planned
from robocal.verbs.simulate import Simulated as _simulate_Simulated
from robocal.verbs.validate.result import Validation as _validate_Validation
from robocal.verbs.warm_up import WarmUp as _warm_up_WarmUp

_Path = str | os.PathLike[str]
_Given = _Path | Arm | CableArm | Measurements | Found[Any]
_Watch = Callable[[dict[str, object]], None]

ERRORS: tuple[str, ...]
CALLS: tuple[str, ...]
ARRAYS: dict[str, str]
FOUND: dict[str, str]
GROUPS: dict[str, str]
__all__ = [
    "Arm",
    "Cancelled",
    "Found",
    "Identified",
    "InputError",
    "Measurements",
    "Plot",
    "__version__",
    "cable",
    "camera",
    "check",
    "compensate",
    "drift",
    "drive",
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
    "warm_up",
]

def check(
    robot: _Given,
    data: _Given | Sequence[_Given] = (),
    *,
    exclude: str | Sequence[str] = (),
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found[_check_Checked]:
    """Report what robot and data files contain and which parameters are observable, without fitting.

    The report has joints, rows, the source of sigma, free parameters, and parameters that cannot be
    separated, with the reason. For a cable robot, also a model of CASPR, it has the data of the cables.

    Takes
    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (rc.new(listing=True)); or rc.robot(...), rc.cable.robot(...).
    data: data.yaml, or a CSV whose headers carry units; several are fitted together; or rc.measurements(...).
    exclude: Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Checked, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
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
) -> Found[_compensate_Compensated]:
    """Correct targets for a controller that keeps its nominal model: joint values and Cartesian poses.

    Every correction is checked with the calibrated model. Targets that cannot be reached are listed, not
    dropped.

    Takes
    robot: A robot file, a catalogue name, or a run folder; or rc.robot(...), rc.cable.robot(...).
    targets: A CSV whose headers carry units (poses, positions, joints), or a YAML beside it; or rc.table(...).
    nominal: The model of the controller; a run folder contains it.
    tool: Tool of both models: calibrated, nominal, x,y,z,rx,ry,rz in the robot's units; own: each model has its own.  [default: 'calibrated']
    output: Write compensated.csv, compensation.json and compensation.html here.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Compensated, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
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
) -> Found[Any]:
    """Compare two calibrations of one robot: has it changed, by how many millimetres, and in which parameters?

    Both runs must start from the same robot file. The instrument may stand elsewhere; with new_tool=True, the tool may differ too.

    Takes
    first: The earlier run folder.
    second: The later run folder, identified from the same robot file; or truth.yaml of a simulation.
    new_tool: The tool was mounted again and may differ.
    matters: The change that matters, with its unit: mean over the measured poses.  [default: '0.1mm']
    history: Add the runs to this CSV, a row for each number; they are not added twice.
    output: Write drift.json here; of a cable robot or beside a truth, a page too.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Any, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
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
) -> Found[_export_Exported]:
    """Write a robot model as robot.yaml, URDF, a table of its parameters, joint offsets for a controller, or
    a model for MuJoCo.

    Takes
    robot: A robot file, a catalogue name, or a run folder; or rc.robot(...), rc.cable.robot(...).
    output: Write here, not to the terminal.
    form: yaml, urdf, dh (a table with Hayati's beta), csv or markdown (the parameters), offsets of the joints: offsets (CSV), ros (parameters), xacro (properties); of cable robots mjcf (MuJoCo's model).  [default: 'yaml']
    nominal: The robot to which offsets are added; a run folder contains it.
    into: With form='urdf': this URDF with calibrated origins; every other byte stays.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Exported, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
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
    two_stages: bool = False,
    loss: str = 'none',
    hold_out: str | float | None = None,
    group_by: str | None = None,
    folds: int | None = None,
    blocks: int = 10,
    reselect: bool = False,
    leave_one_out: bool | None = None,
    keep_all: bool = False,
    iterations: int = 100,
    tolerance: float | str | None = None,
    particles: int = 1000,
    bootstrap: int | None = None,
    seed: int = 0,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Identified:
    """Identify a robot's true parameters from measurements, and prove the gain on configurations that were not used.

    Takes
    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (rc.new(listing=True)); or rc.robot(...), rc.cable.robot(...).
    data: data.yaml, or a CSV whose headers carry units; several are fitted together; or rc.measurements(...).
    output: Write a run folder here.
    force: Write the run into a folder with other content; files of other names stay.
    free: Free exactly these parameters, in place of those of the robot file: j2.alpha, alpha, j2, tool. Repeat, or separate by commas.
    fix: Fix these parameters; also frames of data files.
    prior: Standard deviation before the measurements, in the robot file's units or in its own (2mm); length=... and angle=... for all.
    exclude: Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW.
    groups: Try these beyond geometry; each enters only if unseen blocks of rows get better: gain, eccentricity, ripple, backlash, compliance, sag, bending, expansion.
    layer: Try a residual layer on top; used only if unseen blocks of rows get better.
    region: Where the robot works: a list of poses, or ranges of joints; measured: the measured range is enough.  [default: joint limits that you wrote (not those of a catalogue robot), else where it was measured]
    method: lm, gauss-newton, ekf, particle; to compare with: pinv (iterated pseudo-inverse), lse (one step), ekf-100.  [default: 'lm']
    compare: Try several estimators on the same split, side by side: say lm,ekf,lse; alone: all that are worth it.
    two_stages: Also identify in two stages, on the same split: a map of the markers from images alone, then the robot with that map.
    loss: none, huber, cauchy, tukey: reduces the weight of outliers.  [default: 'none']
    hold_out: Share of configurations held out, 0 to 0.5; blocks: rows in time order; group: whole groups.  [default: stated groups; else 0.2 from 25 places on, or 5 folds where that is likely to prove too little]
    group_by: The column whose groups are held out together.
    folds: Hold out everything once, in K rounds, and fit the model to everything.
    blocks: Number of blocks, with hold_out='blocks', 2 or more.  [default: 10]
    reselect: With folds=: estimate noise and select observable parameters again in every round.
    leave_one_out: Predict every configuration from all the others.  [default: up to 400 configurations]
    keep_all: Fit also parameters that the data cannot separate.
    iterations: Maximum number of iterations, 1 or more.  [default: 100]
    tolerance: Stop where the greatest error of any measurement is no larger, in the robot file's unit of length or its own, above 0.  [default: go to the minimum]
    particles: Number of particles, for method='particle', 50 to 100000.  [default: 1000]
    bootstrap: Draw the configurations N times again: intervals without a model of the noise.
    seed: Seed of all random draws, 0 or more.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Identified: verdict and improved; parameters, residuals and covariance; values and pose(joints) of the corrected robot;
    plot(name), summary(), report(file) and save(folder); result, document, remarks and trusted.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def import_model(
    model: _Given,
    *,
    cables: str | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_import_model_Caspr]:
    """Write a model of CASPR as robot.yaml, with one of its cable sets.

    It is the same robot that every verb reads from the model itself.

    A remark names each value that robot.yaml cannot contain.

    Takes
    model: CASPR's X_cables.xml, with X_bodies.xml beside it.
    cables: The cable set to read, by its id.  [default: the model's default set, or its only one]
    output: Write here, not to the terminal.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Caspr, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def new(
    robot: _Given | None = None,
    *,
    output: _Path = ...,
    joints: int = 6,
    kind: str | None = None,
    table: _Path | None = None,
    listing: bool = False,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found[_new_New | _new_Catalogue]:
    """Write a robot file, a data file and a table to fill in; for a cable robot, its file, a list of poses and the data of a calibration.

    For a robot that has a file, such as a URDF, only data files and tables are written. With table= the data file describes a
    table that you have: separator, decimal comma, columns and units, as its headers say.

    Takes
    robot: A catalogue name, a convention, cable, or the file of a robot; or rc.robot(...), rc.cable.robot(...).
    output: Folder for the files.  [default: PosixPath('.')]
    joints: How many, when ROBOT is a convention, 1 to 30.  [default: 6]
    kind: What is measured: position, pose, spherical, bearing, range, distance, displacement, relative_pose, point, plane, sphere, pixels, joint_torque; of a cable robot lengths, pose, position.  [default: position; of a cable robot lengths and pose]
    table: Describe this table of measurements; its headers say the kind.
    listing: List the catalogue and the conventions.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (New | Catalogue, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def plan(
    robot: _Given,
    data: _Given | None = None,
    *,
    output: _Path | None = None,
    poses: int | None = None,
    criterion: str = 'I',
    accuracy: float | str | None = None,
    after: str | Sequence[str] = (),
    kind: str = 'position',
    noise: float | str | None = None,
    frame: str = 'auto',
    draw: int = 5000,
    candidates: str | None = None,
    tests: str | None = None,
    task: str | Sequence[float | str] | None = None,
    box: str | Sequence[float | str] | None = None,
    floor: float | str | None = None,
    pedestal: str | Sequence[float | str] | None = None,
    distance: str | Sequence[float | str] | None = None,
    cone: float | str | None = None,
    facing: float | str | None = None,
    seed: int = 0,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found[_plan_Planned]:
    """Choose which poses to measure, and how many are enough.

    Writes a joint program with short motions between poses, and the data file to fill in.

    Takes
    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (rc.new(listing=True)); or rc.robot(...), rc.cable.robot(...).
    data: A data file that describes the instrument; its measurements do not count (see after=); or rc.measurements(...).
    output: Write poses.csv, data.yaml, plan.json and plan.html here.
    poses: How many poses, 1 to 500.  [default: enough]
    criterion: I: mean error at test poses; G: the largest; D, A, E, O1 to O5.  [default: 'I']
    accuracy: Required mean error at test poses, in the robot file's unit of length or its own, above 0.
    after: Continue from these measurements: their information counts.
    kind: What is measured: position, pose, spherical, bearing, range, distance, displacement, relative_pose, point, plane, sphere, pixels.  [default: 'position']
    noise: Standard deviation per axis, in the robot file's unit of length or its own, 0 or more.  [default: 0.05 mm, converted]
    frame: Pose of the base in the instrument frame: x,y,z,rx,ry,rz; auto: chosen; none: base coordinates.  [default: 'auto']
    draw: How many candidates to draw in the region, 20 to 100000.  [default: 5000]
    candidates: Choose from this list of poses (CSV with joint columns, data.yaml).
    tests: Predict at these poses, not at a sample.
    task: Predict for the tool point inside x0,y0,z0,x1,y1,z1; measure at any allowed pose, in the robot file's unit of length or its own.
    box: Measure only with the tool point inside x0,y0,z0,x1,y1,z1, in the robot file's unit of length or its own.
    floor: Keep tool point and flange above this height over the base, in the robot file's unit of length or its own.
    pedestal: Keep both outside a cylinder of radius R up to height H around the base, in the robot file's unit of length or its own.
    distance: Keep the target this far from the instrument, in the robot file's unit of length or its own.
    cone: Keep the target within this angle of the instrument's z axis, in the robot file's unit of angle or its own, above 0.
    facing: Let the target's z axis point at the instrument within this angle, in the robot file's unit of angle or its own, above 0.
    seed: Seed of all random draws, 0 or more.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Planned, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def predict(
    folder: _Given,
    poses: _Given,
    *,
    absolute: bool = False,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_predict_Prediction]:
    """Predict the pose of the tool at given joint values, with 95 % bands; of a cable robot its lengths at poses, or its poses at lengths.

    There are two bands: of the model's prediction, and of a new measurement there. The second adds the noise and the
    residual of the fit. Bands are those of the arm's shape; absolute=True adds the uncertainty of the base's place.

    Takes
    folder: A run folder, as rc.identify(output=...) writes it; or what identify gave and wrote.
    poses: A CSV with units in its headers: q1 [deg], ...; of a cable robot x [m], ..., or c1 [m], ; or rc.table(...).
    absolute: Include the uncertainty of the base's place.
    output: Write here, not to the terminal.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Prediction, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def simulate(
    robot: _Given,
    *,
    output: _Path,
    poses: int = 80,
    at: str | None = None,
    kind: str | None = None,
    noise: float | str | None = None,
    angle_noise: float | str | None = None,
    cable_noise: float | str | None = None,
    length_error: float | str | None = None,
    angle_error: float | str | None = None,
    settings: str | Sequence[str] = (),
    frame: str = 'auto',
    fresh: int = 0,
    seed: int = 0,
    force: bool = False,
    base: str | None = None,
    tip: str | None = None,
    watch: _Watch | None = None,
) -> Found[_simulate_Simulated]:
    """Simulate measurements of a robot that differs from its model: data, and the true robot to compare with.

    Takes
    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (rc.new(listing=True)); or rc.robot(...), rc.cable.robot(...).
    output: Folder for robot, data and truth.
    poses: Configurations drawn within the joint limits, or within the frame, 1 to 1000000.  [default: 80]
    at: Take the joint values of this data file or list of poses, or the platform's poses.
    kind: What is measured: position, pose, spherical, bearing, range, distance, displacement, relative_pose, point, plane, sphere, pixels; of a cable robot position or pose, beside its lengths.  [default: position; pose of a platform that turns]
    noise: Standard deviation per axis, in the robot file's unit of length or its own, 0 or more.  [default: 0.05 mm, converted]
    angle_noise: The same for orientations, in the robot file's unit of angle or its own, 0 or more.  [default: 0.1 mrad, converted]
    cable_noise: Of the lengths of cables, in the robot file's unit of length or its own, 0 or more.  [default: 0.5 mm, converted]
    length_error: Standard deviation of true lengths around nominal ones, in the robot file's unit of length or its own, 0 or more.  [default: 0.3 mm, converted; 10 mm of a cable robot's anchors and zeros]
    angle_error: The same for angles, in the robot file's unit of angle or its own, 0 or more.  [default: 1 mrad, converted]
    settings: A true value, in the robot file's units; may be repeated.
    frame: Pose of the base in the instrument frame: x,y,z,rx,ry,rz; auto: chosen; none: base coordinates.  [default: 'auto']
    fresh: As many more configurations of the same robot, to validate with, 0 to 1000000.
    seed: Seed of all random draws, 0 or more.
    force: Replace files that exist.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Simulated, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def study(
    study: _Given | Mapping[str, Any],
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
) -> Found[_study_StudyOutputs]:
    """Simulate a study: many trials of a calibration at every point of a sweep, on all cores.

    The same seed gives the same numbers with any number of workers. A page with pictures of the sweep is written beside
    them. Finished parts are stored beside the result until all are there: after an interruption, resume=True continues.

    Takes
    study: study.yaml: robot, poses, noise, trials and the varied keys; or a mapping with these keys.
    workers: Processes on this machine, 1 to 1024.  [default: as many as cores]
    cluster: A Dask scheduler, tcp://HOST:PORT or tls://HOST:PORT; workers read the robot file under the same path.
    tls_ca: For cluster=: certificate of the authority.
    tls_cert: For cluster=: certificate of this machine.
    tls_key: For cluster=: key of that certificate.
    resume: Continue a study that was interrupted.
    output: File for every trial, .npz or .csv.  [default: beside the study, as .npz]
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (StudyOutputs, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
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
) -> Found[_validate_Validation]:
    """Measure the error of a robot model on data that it was not fitted to.

    With repeated visits, the result also has pose accuracy and repeatability, and distance accuracy, as defined in ISO 9283.

    The robot is not changed. Free frames of instruments are fitted again; the errors are then labelled 'own frames fitted'.

    Takes
    robot: robot.yaml, a URDF, a run folder, or a name from the catalogue (rc.new(listing=True)); or rc.robot(...), rc.cable.robot(...).
    data: data.yaml, or a CSV whose headers carry units; several are fitted together; or rc.measurements(...).
    against: Compare with this robot, for example the nominal one.
    offsets: Validate these joint offsets (CSV, ROS, xacro) on the nominal robot.
    distances: Pairs of places: consecutive, all, group, or a column of the configurations.  [default: 'consecutive']
    exclude: Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW.
    output: Write validation.json and validation.html here.
    force: Replace files that exist.
    seed: Seed of all random draws, 0 or more.
    base: First link of the chain in a URDF.
    tip: Last link of the chain in a URDF.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Validation, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def verify(
    reference: _Given,
    sources: _Given | Sequence[_Given] = (),
    *,
    summary: bool = False,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_verify_Verified | _verify_AnovaResult]:
    """Compare poses with those of an external instrument: as measured, relative to the first one, and
    after the best alignment.

    Files of poses are CSV whose headers carry units (id, x [mm], ..., rx [deg], ...), or data.yaml with kind: pose and any
    form of orientation, or with kind: position and three targets or more on the platform. For two sources and a
    reference, the report shows which of them agree. It also tests whether means of errors differ (one-way analysis of
    variance).

    Takes
    reference: The poses of the external instrument; with summary=True a table of groups.
    sources: The poses to compare: of the robot, of its camera, ...; the same ids.
    summary: Analysis of variance from means and standard deviations.
    output: Write verify.json and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Verified | AnovaResult, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def warm_up(
    packages: _Given | Sequence[_Given] = (),
    *,
    watch: _Watch | None = None,
) -> Found[_warm_up_WarmUp]:
    """Compile all kernels now, into the cache, so that no later command waits: for containers, CI and whoever installs for others.

    Takes
    packages: Kernels of these packages only.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (WarmUp, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """
