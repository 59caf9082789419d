"""`vision hand-eye`: where a camera is, on the flange or beside the robot, from views of a target and the robot's poses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robocal._record import record
from robocal.report.sections import Section
from robocal.verbs import shared_options as w
from robocal.verbs.option import Arg, BaseOptions, option
from robocal.verbs.outcome import Outcome, Watch, run_verb

if TYPE_CHECKING:
    from robocal.session.vision.hand_eye_result import HandEyeCalibration

__all__ = ["Options", "run", "sections"]

VIEWS = Arg(
    "VIEWS",
    "A folder of images, corners.csv of robocal vision detect, or a CSV of poses of a target: x, y, z, qx, qy, qz, qw.",
)
ROBOT = Arg("POSES", "The robot's poses, flange in base: a CSV, or a folder with a YAML file for each.")


@record
class Options(BaseOptions):
    """Find where a camera is, on the flange or beside the robot, with what it may be off by in mm.

    A target stands on the table before a camera in the hand, or hangs on the flange before a camera that stands. Take 15 to 30
    views; turn the hand by 30 deg or more between them, about two axes.

    \b
    robocal vision hand-eye images poses.csv --sheet sheet.yaml --lens lens.yaml -o cell
    robocal vision hand-eye images poses.csv --sheet sheet.yaml --free-lens
    robocal vision hand-eye corners.csv poses.csv --lens lens.yaml
    robocal vision hand-eye corners.csv poses.csv --lens lens.yaml --camera fixed --maker ur
    robocal vision hand-eye marker_poses.csv poses.csv --units mm,deg --euler ZYX

    Views and poses are paired by a column `image` with the names of the images, else in order; the pairs are listed.

    Exit status 3 when the camera is not located.
    """

    corners: Annotated[Path, VIEWS]
    robot: Annotated[Path, ROBOT]
    camera: str = option(
        "hand", "Where the camera is: in the hand, or fixed beside the robot", "WHERE", choices=("hand", "fixed")
    )
    lens: Path | None = option(
        None, "The lens of the images: lens.yaml, or a file of OpenCV, ROS, Kalibr or a depth camera", "FILE"
    )
    rig: Path | None = option(
        None,
        "Cameras that are bolted to the one in the hand: a YAML file with the corners, lens and place of each",
        "FILE",
    )
    free_lens: bool = option(
        False,
        "Find the lens too: known as lens.yaml says, else to 10 px (focal length, centre) and 0.1 (distortion), or by these views",
    )
    free_delay: bool = option(
        False, "Find how far the camera's clock is behind that of the robot too: poses with times, of a hand that moves"
    )
    free_size: bool = option(False, "Find the size of the target too: the robot's poses say how long a metre is")
    maker: str | None = option(
        None,
        "Whose poses these are: columns, units and turns as on the pendant",
        "MAKER",
        choices=("ur", "kuka", "abb", "fanuc"),
    )
    euler: str | None = option(
        None, "Three angles: ZYX about the axes as turned so far, zyx about the fixed ones", "ORDER"
    )
    units: str | None = option(
        None,
        "Units of the robot's poses, as mm,deg; they count before those of headers",
        "UNITS",
        otherwise="those of headers or maker; m,rad",
    )
    quaternion: str | None = option(
        None,
        "The order in which quaternions stand",
        "ORDER",
        choices=("xyzw", "wxyz"),
        otherwise="as their columns are named",
    )
    arm: str | None = option(
        None, "POSES are joint values of this arm: robot.yaml, a URDF, or a name from the catalogue", "ROBOT"
    )
    inverse: bool = option(False, "The poses are of the base in the flange, not of the flange in the base")
    pair: str | None = option(
        None,
        "How views and poses belong together",
        "HOW",
        choices=("name", "order", "time"),
        otherwise="time with --free-delay, else name, else order",
    )
    undo_half_turns: bool = option(
        False, "A board that looks the same after half a turn: label its corners from one end in all views"
    )
    target_units: str | None = option(
        None,
        "Units of poses of a target, as mm,deg; they count before those of headers",
        "UNITS",
        otherwise="those of headers; m,rad",
    )
    target_quaternion: str | None = option(
        None,
        "The order in which quaternions of a target stand",
        "ORDER",
        choices=("xyzw", "wxyz"),
        otherwise="as their columns are named",
    )
    target_inverse: bool = option(
        False, "Poses of a target are of the camera in the target, not of the target in the camera"
    )
    dictionary: str | None = option(None, "Dictionary of the markers in images, as for detect", "NAME")
    charuco: str | None = option(None, "A ChArUco board of so many squares in images", "COLUMNSxROWS")
    size: float | None = option(
        None, "Edge of a marker's black square, as measured on the print", "MM", unit="mm", above=0
    )
    square: float | None = option(
        None, "Edge of a square of a board, as measured on the print", "MM", unit="mm", above=0
    )
    checker: str | None = option(
        None, "A checkerboard of so many squares: in images, or of corners that have no places", "COLUMNSxROWS"
    )
    sheet: Path | None = option(None, "sheet.yaml of robocal vision sheet: where its markers are", "FILE")
    image: str | None = option(
        None, "Size of the images in pixels", "WIDTHxHEIGHT", otherwise="that in the JSON beside the corners"
    )
    exclude: w.Exclude = ()
    folds: int | None = option(
        None, "Leave views out in so many rounds, not one by one", "K", least=2, otherwise="one by one, up to 400 views"
    )
    output: Path | None = option(None, "Write the result, a page and forms of other programs here", "DIR", short="-o")
    force: w.Force = False


def run(o: Options, watch: Watch | None = None, command: str = "") -> Outcome[HandEyeCalibration]:
    """Finds camera and target; a folder gets hand_eye.json, .yaml, .urdf, .html and static_transform.sh. Raises InputError."""
    from robocal.session.vision.hand_eye_images import is_table
    from robocal.session.vision.hand_eye_result import CORNERS, FILES, find_hand_eye

    files: tuple[str, ...] = ()
    if o.output is not None:
        files = tuple(f for f in FILES if f != "lens.yaml" or o.free_lens)
        files = files if is_table(o.corners) else (*CORNERS, *files)
    return run_verb(o, files, lambda: find_hand_eye(o, watch, command, files), sections)


def sections(made: Outcome[HandEyeCalibration]) -> Iterator[Section]:
    """The error, the verdict, the poses to add, where camera and target are, and the pairs."""
    from robocal.report.hand_eye_page import hand_eye_sections

    yield from hand_eye_sections(made.result, made.written)
