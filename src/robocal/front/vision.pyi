# Made by scripts/front_stub.py from the options of the verbs.
import os
from collections.abc import Callable, Sequence
from typing import Any

from robocal.files.plus import ProbeFiles as _probe_ProbeFiles
from robocal.front.measurements import Measurements
from robocal.front.verb_result import Found
from robocal.session.vision.detection import Detected as _detect_Detected
from robocal.session.vision.hand_eye_result import HandEyeCalibration as _hand_eye_HandEyeCalibration
from robocal.session.vision.lens_result import Intrinsics as _intrinsics_Intrinsics
from robocal.session.vision.map_places import MapPlaces as _map_MapPlaces
from robocal.session.vision.map_plans import MapPlans as _require_MapPlans
from robocal.session.vision.map_repeats import ComparedMaps as _compare_ComparedMaps
from robocal.session.vision.map_result import MarkerMapResult as _map_MarkerMapResult
from robocal.session.vision.other_formats import ExportedText as _export_ExportedText
from robocal.verbs.vision.sheet.result import Printed as _sheet_Printed

_Path = str | os.PathLike[str]
_Given = _Path | Measurements | Found[Any]
_Watch = Callable[[dict[str, object]], None]

def sheet(
    *,
    pattern: str = 'grid',
    paper: str = 'A4',
    dictionary: str | None = None,
    first: int = 0,
    ids: str | Sequence[str] = (),
    columns: int | None = None,
    rows: int | None = None,
    size: float | str | None = None,
    square: float | str | None = None,
    pitch: float | str | None = None,
    border: int | None = None,
    output: _Path = ...,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_sheet_Printed]:
    """Print markers or a board: a PDF at true scale, and a YAML beside it that says what stands where.

    A bar of 100 mm at its foot shows the scale of the printer. Everything is as large as the paper permits unless you say
    how large. Markers keep two cells of white around themselves.

    Takes
    pattern: What to print: marker, grid, checkerboard, charuco, aprilgrid.  [default: 'grid']
    paper: A4, A3, letter, or WIDTHxHEIGHT in mm.  [default: 'A4']
    dictionary: Dictionary of the markers, such as 6x6_250 or 36h11.  [default: 6x6_250; 36h11 for an aprilgrid]
    first: Number of the first marker, 0 or more.
    ids: Numbers of the markers, in place of one after the other.
    columns: Markers or squares side by side, 1 to 100.
    rows: Markers or squares one below the other, 1 to 100.
    size: Edge of a marker's black square [mm], 1 or more.
    square: Edge of a square of a board [mm], 1 or more.
    pitch: From marker to marker of a grid [mm], above 0.  [default: two cells of white]
    border: Cells of black around a marker's code, 1 to 2.  [default: 1; 2 for an aprilgrid, as Kalibr has it]
    output: The PDF; the YAML gets its name.  [default: PosixPath('sheet.pdf')]
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Printed, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def detect(
    images: _Given | Sequence[_Given],
    *,
    sheet: _Path | None = None,
    dictionary: str | None = None,
    checker: str | None = None,
    charuco: str | None = None,
    size: float | str | None = None,
    square: float | str | None = None,
    lens: _Path | None = None,
    search: str = 'opencv',
    every: int = 10,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_detect_Detected]:
    """Find printed targets in the images of one camera, and list their corners for kind: pixels.

    Targets are markers (ArUco, AprilTag; several on a sheet are a grid), a checkerboard, or a ChArUco board. A sheet
    of rc.camera.sheet says all of it: sheet=. Without sheet=, dictionary= and checker= all are tried on three images.

    Takes
    images: Images of one camera: files, folders, patterns, lists (.txt), videos.
    sheet: The YAML of a printed sheet, or of a target of Kalibr; it says dictionary, board and sizes.
    dictionary: Dictionary of the markers: 4x4_50 to 7x7_1000, 16h5, 25h9, 36h10, 36h11, mip_36h12, original.
    checker: A checkerboard of so many squares.
    charuco: A ChArUco board of so many squares.
    size: Edge of a marker's black square, as measured on the print [mm], above 0.
    square: Edge of a square of a board, as measured on the print [mm], above 0.
    lens: The lens, where it is known: corners are searched through it, with smaller standard deviations.
    search: What looks for markers; the AprilTag library needs pip install 'robocal[apriltag]': opencv, apriltag.  [default: 'opencv']
    every: Of a video, take one frame in so many, 1 or more.  [default: 10]
    output: Write the list here, and a document and a page beside it.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Detected, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def intrinsics(
    corners: _Given,
    *,
    model: str | None = None,
    lens: _Path | None = None,
    fix: str | Sequence[str] = (),
    size: float | str | None = None,
    square: float | str | None = None,
    checker: str | None = None,
    sheet: _Path | None = None,
    image: str | tuple[int, int] | None = None,
    images: str | Sequence[str] = (),
    exclude: str | Sequence[str] = (),
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_intrinsics_Intrinsics]:
    """Find a camera's lens from the corners of a board or of sheets of markers, with what it may be off by.

    No robot is needed: in every view the target may be anywhere. Take 15 to 40 views, tilted by 20 to 45 deg in different
    directions, near and far, and bring the target into all corners of the image.

    Takes
    corners: corners.csv of rc.camera.detect, or a table with its columns.
    model: Model of the lens: brown, rational, fisheye.  [default: that of lens=; brown]
    lens: The lens that is known so far: lens.yaml, or a file of OpenCV, ROS or Kalibr.
    fix: Numbers of the lens that stay as they are: k3, p1,p2.
    size: Edge of a marker's black square, as measured on the print [mm], above 0.
    square: Edge of a square of a board, as measured on the print [mm], above 0.
    checker: Squares of a checkerboard whose corners have numbers, but no places.
    sheet: sheet.yaml of rc.camera.sheet: where its markers are.
    image: Size of the images in pixels.  [default: that in the JSON beside the corners]
    images: Images of the corners, as for detect: corners are fitted again in them, with the lens.
    exclude: Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW.
    output: Write the lens here, and a document and a page beside it.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (Intrinsics, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def map(
    corners: _Given,
    *,
    lens: _Path,
    held: _Path | None = None,
    size: str | Sequence[str] = (),
    size_sigma: float = 0.2,
    size_scatter: float = 0.3,
    prior: _Path | None = None,
    sheet: _Path | Sequence[_Path] = ...,
    images: str | Sequence[str] = (),
    dictionary: str | None = None,
    origin: str | None = None,
    without: str | Sequence[str] = (),
    fix: str | Sequence[str] = (),
    loss: str = 'huber',
    image: str | tuple[int, int] | None = None,
    exclude: str | Sequence[str] = (),
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_map_MarkerMapResult | _map_MapPlaces]:
    """Find where markers are to one another from images of them, with what the map may be off by. No robot is needed.

    Put markers of different numbers anywhere, and take 20 to 100 images from different sides. Every image should show
    several markers, and every marker should be in three images or more.

    Takes
    corners: corners.csv of rc.camera.detect, a table with view, marker, corner, u, v, or a folder of images.
    lens: The lens of the camera: lens.yaml, or a file of OpenCV, ROS or Kalibr.
    held: Find the camera in this map: map.yaml, or a file of TagSLAM, MarkerMapper or PLY.
    size: Edge of the markers' black squares in mm, as measured; of some alone as 7=120.
    size_sigma: What all edges in size= together may be off by, in mm: ink, paper, gauge; 0: nothing, 0 or more.  [default: 0.2]
    size_scatter: By how much edges differ from marker to marker, in percent; 0: not at all, 0 or more.  [default: 0.3]
    prior: What is known of the markers beforehand: surveyed tags, boards, the map of last month.
    sheet: sheet.yaml of rc.camera.sheet, or a target of Kalibr; one for each sheet.
    images: Images of a list of corners: corners are fitted again in them, with the lens of the map.
    dictionary: Dictionary of the markers in images: 4x4_50 to 7x7_1000, 16h5, 25h9, 36h10, 36h11, mip_36h12, original.
    origin: Marker in which the coordinates begin, with its axes.  [default: the one that most views show]
    without: Markers that are left out.
    fix: Numbers of the lens that stay as they are: k3, p1,p2.
    loss: Loss of the fit: huber counts what is far off less: huber, none, cauchy, tukey.  [default: 'huber']
    image: Size of the images in pixels.  [default: that of the lens, or in the JSON beside the corners]
    exclude: Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW.
    output: Write the map here, and its covariance, a document and a page beside it.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (MarkerMapResult | MapPlaces, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def hand_eye(
    corners: _Given,
    robot: _Given,
    *,
    camera: str = 'hand',
    lens: _Path | None = None,
    rig: _Path | None = None,
    free_lens: bool = False,
    free_delay: bool = False,
    free_size: bool = False,
    maker: str | None = None,
    euler: str | None = None,
    units: str | None = None,
    quaternion: str | None = None,
    arm: str | None = None,
    inverse: bool = False,
    pair: str | None = None,
    undo_half_turns: bool = False,
    target_units: str | None = None,
    target_quaternion: str | None = None,
    target_inverse: bool = False,
    dictionary: str | None = None,
    charuco: str | None = None,
    size: float | str | None = None,
    square: float | str | None = None,
    checker: str | None = None,
    sheet: _Path | None = None,
    image: str | tuple[int, int] | None = None,
    exclude: str | Sequence[str] = (),
    folds: int | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_hand_eye_HandEyeCalibration]:
    """Find where a camera is, on the flange or beside the robot, with what it may be off by in mm.

    A target stands on the table before a camera in the hand, or hangs on the flange before a camera that stands. Take 15 to 30
    views; turn the hand by 30 deg or more between them, about two axes.

    Takes
    corners: A folder of images, corners.csv of rc.camera.detect, or a CSV of poses of a target: x, y, z, qx, qy, qz, qw.
    robot: The robot's poses, flange in base: a CSV, or a folder with a YAML file for each; or rc.table(...).
    camera: Where the camera is: in the hand, or fixed beside the robot.  [default: 'hand']
    lens: The lens of the images: lens.yaml, or a file of OpenCV, ROS, Kalibr or a depth camera.
    rig: Cameras that are bolted to the one in the hand: a YAML file with the corners, lens and place of each.
    free_lens: Find the lens too: known as lens.yaml says, else to 10 px (focal length, centre) and 0.1 (distortion), or by these views.
    free_delay: Find how far the camera's clock is behind that of the robot too: poses with times, of a hand that moves.
    free_size: Find the size of the target too: the robot's poses say how long a metre is.
    maker: Whose poses these are: columns, units and turns as on the pendant: ur, kuka, abb, fanuc.
    euler: Three angles: ZYX about the axes as turned so far, zyx about the fixed ones.
    units: Units of the robot's poses, as mm,deg; they count before those of headers.  [default: those of headers or maker; m,rad]
    quaternion: The order in which quaternions stand: xyzw, wxyz.  [default: as their columns are named]
    arm: POSES are joint values of this arm: robot.yaml, a URDF, or a name from the catalogue.
    inverse: The poses are of the base in the flange, not of the flange in the base.
    pair: How views and poses belong together: name, order, time.  [default: time with free_delay=True, else name, else order]
    undo_half_turns: A board that looks the same after half a turn: label its corners from one end in all views.
    target_units: Units of poses of a target, as mm,deg; they count before those of headers.  [default: those of headers; m,rad]
    target_quaternion: The order in which quaternions of a target stand: xyzw, wxyz.  [default: as their columns are named]
    target_inverse: Poses of a target are of the camera in the target, not of the target in the camera.
    dictionary: Dictionary of the markers in images, as for detect.
    charuco: A ChArUco board of so many squares in images.
    size: Edge of a marker's black square, as measured on the print [mm], above 0.
    square: Edge of a square of a board, as measured on the print [mm], above 0.
    checker: A checkerboard of so many squares: in images, or of corners that have no places.
    sheet: sheet.yaml of rc.camera.sheet: where its markers are.
    image: Size of the images in pixels.  [default: that in the JSON beside the corners]
    exclude: Leave rows out: ids of configurations, rows such as 7 or 10-20, FILE:ROW.
    folds: Leave views out in so many rounds, not one by one, 2 or more.  [default: one by one, up to 400 views]
    output: Write the result, a page and forms of other programs here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (HandEyeCalibration, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def probe(
    results: _Given,
    configuration: _Given,
    *,
    output: _Path = ...,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_probe_ProbeFiles]:
    """Read points of an N-wire phantom in ultrasound images, with tracked poses of the probe, as PLUS (fCal) writes them.

    The folder gets a rig whose poses are known, and a data file with its table for calibration and validation. `identify` finds the image
    plane with the sizes of a pixel.

    Takes
    results: The result of fCal: <ProbeCalibrationResult>.
    configuration: Its configuration, with the wires and the place of the phantom: <PlusConfiguration>.
    output: Folder for the files.  [default: PosixPath('.')]
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (ProbeFiles, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def compare(
    maps: _Given | Sequence[_Given],
    *,
    reference: str | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_compare_ComparedMaps]:
    """Compare maps of the same markers: how repeatable they are, and whether their sigma predicted as much.

    The maps are aligned on all markers that all of them have. The scatter of each marker is listed along the axes of the reference
    marker, beside its distance from it and the predicted scatter. A marker that moved between two maps is named with its distance.

    Takes
    maps: Maps of the same markers: map.yaml, or files of TagSLAM, MarkerMapper, PLY; two or more.
    reference: The marker whose axes are taken, and from which distances count.  [default: the first of the first map]
    output: Write maps.json, markers.csv, distance.svg, axes.svg and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (ComparedMaps, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def require(
    poses: _Given,
    *,
    lens: _Path,
    map: _Path | None = None,
    grid: str | None = None,
    field: str | None = None,
    size: str | Sequence[str] = (),
    height: str | Sequence[str] = (),
    tilt: str | Sequence[str] = (),
    survey: float | str | None = None,
    sigma: float | str = 0.3,
    accuracy: float | str | None = None,
    image: str | tuple[int, int] | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_require_MapPlans]:
    """Predict the errors of a map of markers, and of a camera in it, before anything is printed: along x and y, and along z.

    Markers are those of map=, or a grid over field=. With several size=, height= or tilt= every combination is a row.
    Every second marker is raised by height=. survey= says to what each marker's place is measured by other means.

    Takes
    poses: CSV of places of the camera in the frame of the map: x, y, z and rx, ry, rz, or qx to qw; z looks ahead; or rc.table(...).
    lens: The lens of the camera: lens.yaml, or a file of OpenCV, ROS or Kalibr.
    map: Where the markers will be: map.yaml, or a file of TagSLAM, MarkerMapper or PLY.
    grid: Number of markers along x and y, in place of map=.
    field: Width and depth of the grid in mm, between middles of markers.
    size: Edge of the markers' black squares in mm.  [default: that of map=]
    height: By how much every second marker is raised, in mm.  [default: 0]
    tilt: By how much each marker is tilted, in deg.  [default: 0]
    survey: Standard deviation to which each marker's place is measured by other means [mm], above 0.  [default: not measured]
    sigma: Standard deviation of a corner in an image [px], above 0.  [default: 0.3]
    accuracy: The required error of the camera's place, rms of one axis [mm], above 0.
    image: Size of the images in pixels.  [default: that of the lens]
    output: Write require.json, markers.csv and report.html here.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (MapPlans, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """

def export(
    file: _Given,
    *,
    form: str | None = None,
    camera: str | None = None,
    output: _Path | None = None,
    force: bool = False,
    watch: _Watch | None = None,
) -> Found[_export_ExportedText]:
    """Write a map of markers, or a lens, in the format of another program; or read one of theirs.

    Formats of maps: robocal, json, tagslam, markermapper (ArUco), ply. Formats of lenses: robocal, opencv, ros, kalibr.

    Takes
    file: A map or a lens in any of these formats.
    form: The format to write.  [default: by the suffix: .yaml, .json, .ply]
    camera: Of a file with several cameras the one to read, and its name in the output.
    output: Write here, not to the terminal.
    force: Replace files that exist.
    watch: called with an event of every step; one that raises robocal.errors.Cancelled stops the call.

    Returns
    Found: result (ExportedText, in SI) and document; listing and text where there is a list; plot(name), summary() and report(file);
    remarks, trusted and written.

    Raises InputError: it names the argument, what was found and what was expected.
    """
