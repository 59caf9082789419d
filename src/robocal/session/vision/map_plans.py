"""What `vision require` finds: the errors of maps of markers that nobody has made yet, plan by plan."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.errors import ModelError
from robocal.files.display import listing_text
from robocal.files.lens import read_lens
from robocal.files.map import read_map
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.robot_poses import read_robot_poses
from robocal.files.text import InputFile
from robocal.progress import Watch, tell
from robocal.quantities import Column, Listing, UnitValue
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.report.sections import Section
from robocal.session.verb_base import VerbResult
from robocal.session.vision.corner_table import image_size
from robocal.session.vision.lens_prior import lens_with_prior
from robocal.session.vision.map_requirement import PredictedMap, predict_map
from robocal.vision.lenses import Lens
from robocal.vision.map_views import lay_out
from robocal.vision.maps import MarkerMap

__all__ = ["MapPlans", "RequireMapDocument", "predict_plans"]


@record
class MarkerPlan:
    """Markers as they may be printed and hung: edge, height of every second one (m), tilt (rad), and what is predicted of them."""

    size: float
    height: float
    tilt: float
    predicted: PredictedMap


@record(kw_only=True)
class RequireMapDocument(Document):
    """require.json: the number of poses, the noise of corners, the survey and the accuracy that is asked for; a row for each plan with the
    rms errors of the map, in the frame of its reference marker, and of the camera; and whether a plan reaches the accuracy."""

    poses: int
    sigma: UnitValue
    survey: UnitValue | None
    accuracy: UnitValue | None
    reached: bool
    reference: str
    plans: Listing
    provenance: Origin


@record(kw_only=True, eq=False)
class MapPlans(VerbResult):
    """Plans with what is predicted of each; sigma of a corner (px), of a survey (m), and the accuracy that is asked for (m)."""

    plans: tuple[MarkerPlan, ...]
    lens: Lens
    cameras: Array
    sigma: float
    survey: float | None
    accuracy: float | None

    @cached_property
    def reached(self) -> tuple[bool, ...]:
        """Whether each plan has the camera's place as accurately as is asked for, along every axis."""
        wanted = np.inf if self.accuracy is None else self.accuracy
        return tuple(max(p.predicted.errors.camera_xy, p.predicted.errors.camera_z) <= wanted for p in self.plans)

    @property
    def trusted(self) -> bool:
        """Whether a plan reaches the accuracy."""
        return any(self.reached)

    @cached_property
    def listing(self) -> Listing:
        """A row for each plan."""
        errors = [p.predicted.errors for p in self.plans]
        named = {
            "map_xy": "map x, y [mm]", "map_z": "map z [mm]", "worst_z": "worst z [mm]", "camera_xy": "camera x, y [mm]",
            "camera_z": "camera z [mm]",
        }  # fmt: skip
        return Listing((
            Column("size", "mm", np.array([1e3 * p.size for p in self.plans]), figures=4),
            Column("height", "mm", np.array([1e3 * p.height for p in self.plans]), figures=4),
            Column("tilt", "deg", np.degrees([p.tilt for p in self.plans]), figures=4),
            *(
                Column(key, "mm", np.array([1e3 * getattr(e, key) for e in errors]), digits=4, figures=3, label=label)
                for key, label in named.items()
            ),
            Column("camera_turn", "deg", np.degrees([e.camera_turn for e in errors]), digits=4, figures=2, label="turn [deg]"),
            Column("reference_xy", "mm", np.array([1e3 * e.reference_xy for e in errors]), digits=4, figures=3),
            Column("reference_z", "mm", np.array([1e3 * e.reference_z for e in errors]), digits=4, figures=3),
            Column("markers", "", [float((p.predicted.markers).mean()) for p in self.plans], digits=4, figures=3, label="per view"),
            Column("unseen", "", [int((p.predicted.views == 0).sum()) for p in self.plans]),
        ))  # fmt: skip

    @cached_property
    def markers(self) -> Listing:
        """A row for each marker of the first plan, the least sure first."""
        found = self.plans[0].predicted
        assert found.map.covariance is not None
        own = 1e3 * np.sqrt(np.diag(found.map.covariance).reshape(-1, 6)[:, :3])
        at = np.argsort(-own[:, 2], kind="stable")
        many = found.views[found.views > 0]
        place = 1e3 * found.map.vector[at, :3]
        return Listing((
            Column("marker", "", [found.map.names[i] for i in at.tolist()]),
            Column("views", "", many[at].tolist()),
            *(Column(a, "mm", place[:, k], spec=".1f") for k, a in enumerate("xyz")),
            *(Column(f"s{a}", "mm", own[at, k], digits=4, figures=2) for k, a in enumerate("xyz")),
        ))  # fmt: skip

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        first = self.plans[0]
        facts = (
            ("Markers", f"{len(first.predicted.views)}"),
            ("Poses", f"{len(self.cameras)}"),
            ("Corners", f"{self.sigma:g} px"),
            ("Lens", self.lens.model),
        )
        return {"title": "What a map of markers will be off by", "kind": "Requirement", "facts": facts}

    @property
    def document(self) -> RequireMapDocument:
        """What --json says."""
        survey, accuracy = (None if v is None else UnitValue(v, "m") for v in (self.survey, self.accuracy))
        return self.document_of(
            RequireMapDocument, poses=len(self.cameras), sigma=UnitValue(self.sigma, "px"), survey=survey, accuracy=accuracy,
            reached=self.trusted, reference=self.plans[0].predicted.reference, plans=self.listing,
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The document, and the markers of the first plan."""
        return {"require.json": json_text(self.document), "markers.csv": listing_text(self.markers)}

    def details(self) -> Iterator[Section]:
        """The map of the first plan with its ellipses."""
        from robocal.report.plans_page import plans_pictures

        yield from plans_pictures(self)


def predict_plans(o: Any, watch: Watch | None = None, command: str = "") -> MapPlans:
    """Reads lens, poses and maybe a map, and predicts every plan. Raises InputError."""
    tell(watch, "read")
    read = read_lens(o.lens)
    poses = read_robot_poses(o.poses, vector=True, option="")
    known, files, said = _known(o)
    size = image_size(o.image, read.lens.size, "--image 1920x1080, or image: [1920, 1080] in the lens' file")
    if read.lens.size not in (None, size):
        raise ModelError(
            "the lens is of images of another size",
            key="--image",
            found=o.image,
            expected="{} x {}".format(*read.lens.size),
        )
    lens = lens_with_prior(replace(read.lens, size=size))
    survey = None if o.survey is None else 1e-3 * o.survey
    plans = []
    for made, (edge, height, tilt) in known:
        try:
            plans.append(MarkerPlan(edge, height, tilt, predict_map(made, poses.pose, lens, o.sigma, size, survey)))
        except ModelError as bad:
            raise _of_plan(bad, (edge, height, tilt), len(known)).of_file(o.poses, row=None) from None
    accuracy = None if o.accuracy is None else 1e-3 * o.accuracy
    result = MapPlans(
        plans=tuple(plans), lens=lens, cameras=poses.pose, sigma=o.sigma, survey=survey, accuracy=accuracy,
        inputs=(*poses.files, read.file, *files), command=command,
    )  # fmt: skip
    return replace(result, warnings=(*said, *read.file.remarks, *_remarks(result)), reasons=tuple(_reasons(result)))


def _of_plan(bad: ModelError, plan: tuple[float, float, float], count: int) -> ModelError:
    """The error with the plan that it is of, where there are several."""
    if count == 1:
        return bad
    edge, height, tilt = plan
    which = f"markers of {1e3 * edge:g} mm, every second {1e3 * height:g} mm higher, tilted by {np.degrees(tilt):g} deg"
    return ModelError(bad.message, key=bad.key, found=f"{which}: {bad.found}", expected=bad.expected)


Plans = list[tuple[MarkerMap, tuple[float, float, float]]]


def _known(o: Any) -> tuple[Plans, tuple[InputFile, ...], tuple[Remark, ...]]:
    """The markers of every plan, with edge, height and tilt."""
    sizes = [1e-3 * v for v in _numbers(o.size, "--size", above=0.0)]
    heights = [1e-3 * v for v in _numbers(o.height, "--height")] or [0.0]
    tilts = np.radians(_numbers(o.tilt, "--tilt", most=60.0) or [0.0]).tolist()
    if o.map is not None:
        for key in ("grid", "field", "height", "tilt"):
            if getattr(o, key):
                raise ModelError(
                    "the map says where markers are", key=f"--{key}", found="--map", expected="one of the two"
                )
        read = read_map(o.map)
        own = read.map
        edges = sizes or [float(np.median(own.size))]
        made: Plans = [
            (replace(own, size=np.full(len(own.names), e), covariance=None) if sizes else own, (e, 0.0, 0.0))
            for e in edges
        ]
        return made, (read.file,), tuple(read.file.remarks)
    if o.grid is None or o.field is None or not sizes:
        expected = "--map FILE; or --grid 12x9 --field 4200x3400 --size 150"
        raise ModelError("nobody says where the markers will be", key="--map", expected=expected)
    columns, rows = (int(v) for v in _pair(o.grid, "--grid", r"\d+", "columns x rows, as 12x9"))
    width, depth = (1e-3 * float(v) for v in _pair(o.field, "--field", r"[\d.]+", "width x depth in mm, as 4200x3400"))
    if columns * rows < 2:
        raise ModelError("one marker is no map", key="--grid", found=o.grid, expected="two markers or more")
    out: Plans = []
    for edge, height, tilt in product(sizes, heights, tilts):
        pitch = min((w / (n - 1) for w, n in ((width, columns), (depth, rows)) if n > 1), default=np.inf)
        if height == 0 and tilt == 0 and edge >= pitch:
            expected = f"less than the {1e3 * pitch:.4g} mm between middles of neighbours"
            raise ModelError("markers would overlap", key="--size", found=f"{1e3 * edge:g} mm", expected=expected)
        out.append((lay_out(columns, rows, (width, depth), edge, height, tilt), (edge, height, tilt)))
    return out, (), ()


def _numbers(words: tuple[str, ...], key: str, above: float = -np.inf, most: float = np.inf) -> list[float]:
    out = []
    for word in words:
        try:
            value = float(word)
        except ValueError:
            value = np.nan
        if not (above < value and abs(value) <= most and np.isfinite(value)):
            expected = "a number" + (
                " above 0" if above == 0 else f" from {-most:g} to {most:g}" if np.isfinite(most) else ""
            )
            raise ModelError("not a number that this can be", key=key, found=word, expected=expected)
        out.append(value)
    return out


def _pair(word: str, key: str, number: str, expected: str) -> tuple[str, str]:
    found = re.fullmatch(rf"\s*({number})\s*[xX×]\s*({number})\s*", word)
    if found is None or not all(float(v) > 0 for v in found.groups()):
        raise ModelError("not two numbers", key=key, found=word, expected=expected)
    return found[1], found[2]


def _remarks(made: MapPlans) -> Iterator[Remark]:
    first = made.plans[0].predicted
    if unseen := int((first.views == 0).sum()):
        yield Remark.of(Code.PLAN_UNSEEN, count=unseen, total=len(first.views))
    if blind := int((first.markers == 0).sum()):
        yield Remark.of(Code.PLAN_BLIND, count=blind, total=len(first.markers))


def _reasons(made: MapPlans) -> Iterator[Remark]:
    if made.accuracy is not None and not made.trusted:
        best = min(max(p.predicted.errors.camera_xy, p.predicted.errors.camera_z) for p in made.plans)
        yield Remark.of(Code.PLAN_TOO_COARSE, asked=Quantity(made.accuracy, "m"), best=Quantity(best, "m"))
