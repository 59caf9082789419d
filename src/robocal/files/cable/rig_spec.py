"""A virtual rig, as a file describes it: what the builder believes, how the truth may differ, drives, camera, markers, instruments and
poses. Lengths in m, angles in deg, other units in the keys; noises are one standard deviation."""

from __future__ import annotations

import os
import re
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from robocal._record import record
from robocal._types import Array
from robocal.files.schema import FileModel, Version, validate
from robocal.files.text import InputFile, read_text
from robocal.files.yamlio import YamlDocument, parse

__all__ = ["WRONGS", "CableRigSpec", "read_cable_rig"]

Positive = Annotated[float, Field(gt=0, lt=1e9)]
NotNegative = Annotated[float, Field(ge=0, lt=1e9)]
Number = Annotated[float, Field(gt=-1e9, lt=1e9)]
Three = Annotated[list[Number], Field(min_length=3, max_length=3)]
Range = Annotated[list[Number], Field(min_length=2, max_length=2)]
Count = Annotated[int, Field(ge=1, le=10_000)]
DRAWN = re.compile(r"\s*([-+.\d eE]+?)\s*\+\s*N\(\s*0\s*,\s*([.\d]+)\s*\)\s*")
# What may be wrong with a rig, and what a builder says of it: a cable, two cables, or a number.
WRONGS = ("cables", "swapped", "reversed", "half_count", "slack", "mass_factor")


class AnchorModel(FileModel):
    """How the builder knows the frame anchors: by a tape, or by ranges between beacons on the winches."""

    known_by: Literal["tape", "beacons"] = "tape"
    sigma: Positive = 0.03
    range_sigma: Positive = 0.1


class TensionModel(FileModel):
    """Tensions of the controller, its limits, and those within which a pose is kept for the list."""

    preferred_N: Positive = 60.0
    limits_N: Range | None = None
    allowed_N: Range = Field(alias="pose_kept_if_within_N")


class CableMaterialModel(FileModel):
    """Stretch and damping of cables, noise of a length, and how well a tension is known, as a share."""

    elongation_per_N: Positive
    damping_N_s_m: NotNegative = 200.0
    length_noise: Positive
    tension_known_to: NotNegative = 0.1


class RigPosesModel(FileModel):
    """How many poses, and the box in which they are drawn; tilts up to tilt_max about any level axis."""

    calibration: Count
    verification: Annotated[int, Field(ge=2, le=10_000)] = 10
    x: Range
    y: Range
    z: Range
    tilt_max: NotNegative
    yaw: Range


class RigLensModel(FileModel):
    """The camera's true lens; a centre may be drawn."""

    resolution: Annotated[list[Annotated[int, Field(ge=16, le=20_000)]], Field(min_length=2, max_length=2)]
    fx: Positive
    fy: Positive
    cx: float | str | None = None
    cy: float | str | None = None
    k1: Number = 0.0
    k2: Number = 0.0
    p1: Number = 0.0
    p2: Number = 0.0
    corner_noise_px: Positive = 0.3
    k1_wrong_by: Number = 0.0


class MountModel(FileModel):
    """Where the camera should be on the platform, and how far it is off."""

    translation: Three
    rotation: Any = None
    translation_sigma: NotNegative = 0.002
    rotation_sigma: NotNegative = 0.3


class MarkersModel(FileModel):
    """Printed markers on the floor: a grid with jitter, how flat they lie, and how large they were printed."""

    size: Positive
    grid: Annotated[list[Count], Field(min_length=2, max_length=2)]
    area: Annotated[list[Positive], Field(min_length=2, max_length=2, alias="floor")]
    jitter: NotNegative = 0.0
    height_sd: NotNegative = 0.0
    tilt_sd: NotNegative = 0.0
    yaw: Any = "any"
    print_scale_error: NotNegative = 0.0


class SightingModel(FileModel):
    """When a marker is seen."""

    angle_from_axis_below: Annotated[float, Field(gt=0, lt=90)] = 45.0
    border_px: NotNegative = 8.0
    side_px_above: NotNegative = 20.0


class PriorModel(FileModel):
    """What is said beforehand of the lens."""

    focal_and_centre_px: Positive = 10.0
    distortion: Positive = 0.05


class ReferenceModel(FileModel):
    """The external instrument that measures the platform: its noise, and its clock beside the controller's."""

    position_sigma: Positive = 0.001
    angle_sigma: Positive = 0.02
    clock_offset_s: Number = 0.0
    clock_drift: Number = 0.0


class PictureModel(FileModel):
    """How images are drawn."""

    blur_px: NotNegative = 0.8
    grey_noise: NotNegative = 5.0


class DrivesModel(FileModel):
    """Winches: drum, gear, inertia at the motor, friction, and counts of the encoder per turn of the motor."""

    drum_radius: Positive = 0.04
    gear: Positive = 4.0
    inertia_kg_m2: Positive = 3e-4
    coulomb_N_m: NotNegative = 0.02
    viscous_N_m_s: NotNegative = 1e-3
    counts_per_turn: Annotated[int, Field(ge=0, le=1 << 30)] = 16384


class StartModel(FileModel):
    """How far the platform hangs from where the builder says it is at power-up."""

    position_sigma: NotNegative = 0.02
    angle_sigma: NotNegative = 1.0


class WrongModel(FileModel):
    """What is wrong with the rig, beyond what a calibration is for; cables count from 1."""

    cables: Count | None = None
    swapped: Annotated[list[Count], Field(min_length=2, max_length=2)] | None = None
    reversed: Count | None = None
    half_count: Count | None = None
    slack: Count | None = None
    slack_length: Positive = 0.08
    mass_factor: Positive | None = None


class CableRigModel(FileModel):
    """rig.yaml."""

    robocal: Version = 1
    kind: Literal["cable-rig"] = "cable-rig"
    name: str = "rig"
    frame_anchors_nominal: list[Three]
    platform_anchors: list[Three]
    weight_N: Positive
    anchors: AnchorModel = AnchorModel.model_construct()
    tensions: TensionModel
    cable: CableMaterialModel
    poses: RigPosesModel
    camera: RigLensModel
    camera_in_platform_nominal: MountModel
    markers: MarkersModel
    visible_if: SightingModel = Field(SightingModel.model_construct(), alias="marker_seen_if")
    prior_used: PriorModel = PriorModel.model_construct()
    reference: ReferenceModel = ReferenceModel.model_construct()
    images: PictureModel = PictureModel.model_construct()
    drives: DrivesModel = DrivesModel.model_construct()
    start: StartModel = StartModel.model_construct()
    lists: Annotated[int, Field(ge=1, le=26)] = 1
    wrong: WrongModel = WrongModel.model_construct()
    # What is said for readers of the file.
    intrinsics_given: Any = None
    error_frame: Any = None
    narrow_view_case: Any = None
    source: str = ""


@record(eq=False)
class CableRigSpec:
    """A rig: nominal anchors (m, 3) on the frame and the platform in m, weight in N, and the parts of its file as they stand there.

    `lens` (9,) is the true lens without what is drawn of its centre, `drawn` (2,) the standard deviations of that in px; `eye` (4, 4) is
    the camera in the platform as it should be.
    """

    model: CableRigModel
    file: InputFile
    frame: Array
    platform: Array
    lens: Array
    drawn: Array
    eye: Array

    @property
    def name(self) -> str:
        """As a file has it."""
        return self.model.name

    @property
    def cables(self) -> tuple[str, ...]:
        """Names of the cables."""
        return tuple(f"c{i + 1}" for i in range(len(self.frame)))

    @property
    def limits(self) -> Array:
        """Least and greatest tension (2,) in N that the controller keeps."""
        tensions = self.model.tensions
        return np.array(tensions.limits_N or tensions.allowed_N, float)


def read_cable_rig(path: str | os.PathLike[str]) -> CableRigSpec:
    """Reads the file. Raises FileError or FormatError naming the key."""
    source = read_text(path)
    document = parse(source)
    said = validate(CableRigModel, document)
    m = len(said.frame_anchors_nominal)
    document.insist(m >= 7, "too few cables", ("frame_anchors_nominal",), found=m, expected="7 or more: they also pull")
    found, expected = len(said.platform_anchors), f"{m}, one for each frame anchor"
    document.insist(found == m, "anchors without a cable", ("platform_anchors",), found=found, expected=expected)
    for key in ("x", "y", "z", "yaw"):
        low, high = getattr(said.poses, key)
        document.insist(low < high, "no range", ("poses", key), found=[low, high], expected="the lower number first")
    for key, pair in (("limits_N", said.tensions.limits_N), ("pose_kept_if_within_N", said.tensions.allowed_N)):
        good = pair is None or 0 <= pair[0] < pair[1]
        document.insist(good, "no range", ("tensions", key), found=pair, expected="two tensions, the lower first")
    (least, most), preferred = said.tensions.limits_N or said.tensions.allowed_N, said.tensions.preferred_N
    expected, at = f"between {least:g} and {most:g}", ("tensions", "preferred_N")
    document.insist(least <= preferred <= most, "beyond the limits", at, found=preferred, expected=expected)
    _wrongs(said, document, m)
    width, height = said.camera.resolution
    centre = [_drawn(said.camera.cx, width / 2, ("camera", "cx"), document),
              _drawn(said.camera.cy, height / 2, ("camera", "cy"), document)]  # fmt: skip
    c = said.camera
    return CableRigSpec(
        said,
        InputFile(source.path, source.sha256),
        np.array(said.frame_anchors_nominal, float),
        np.array(said.platform_anchors, float),
        np.array([c.fx, c.fy, centre[0][0], centre[1][0], c.k1, c.k2, c.p1, c.p2, 0.0]),
        np.array([centre[0][1], centre[1][1]]),
        _eye(said.camera_in_platform_nominal, document),
    )


def _wrongs(said: CableRigModel, document: YamlDocument, m: int) -> None:
    """Raises FormatError for a cable that is none."""
    for key in ("swapped", "reversed", "half_count", "slack"):
        given = getattr(said.wrong, key)
        for cable in given if isinstance(given, list) else [given]:
            good = cable is None or cable <= m
            document.insist(good, "no such cable", ("wrong", key), found=cable, expected=f"1 to {m}")
    pair = said.wrong.swapped
    document.insist(
        pair is None or pair[0] != pair[1], "one cable twice", ("wrong", "swapped"), found=pair, expected="two cables"
    )


def _drawn(
    given: float | str | None, middle: float, at: tuple[str, ...], document: YamlDocument
) -> tuple[float, float]:
    """A number and the standard deviation with which it is drawn. Raises FormatError."""
    if given is None:
        return middle, 8.0
    if isinstance(given, float):
        return given, 0.0
    match, expected = DRAWN.fullmatch(given), "a number, or such as 640 + N(0, 8)"
    document.insist(match is not None, "no such number", at, found=given, expected=expected)
    assert match is not None
    return float(match[1]), float(match[2])


def _eye(said: MountModel, document: YamlDocument) -> Array:
    """The camera in the platform (4, 4): it looks down unless a rotation says otherwise. Raises FormatError."""
    out = np.diag([1.0, -1.0, -1.0, 1.0])
    out[:3, 3] = said.translation
    given = said.rotation
    if isinstance(given, str):
        words = re.fullmatch(r"\s*diag\(([^)]*)\)\s*", given)
        given = [float(w) for w in words[1].split(",")] if words else given
    if given is not None:
        good = isinstance(given, list) and len(given) == 3 and all(isinstance(v, int | float) for v in given)
        at, expected = ("camera_in_platform_nominal", "rotation"), "diag(1, -1, -1), or its three numbers"
        good = good and all(abs(v) == 1 for v in given) and float(np.prod(given)) == 1.0
        document.insist(good, "no such rotation", at, found=said.rotation, expected=expected)
        out[:3, :3] = np.diag(given)
    return out
