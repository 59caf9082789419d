"""What `vision intrinsics` finds: the lens, how surely it says where points are seen, and how well it meets views that were left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array, Bools
from robocal.diagnose.check_registry import DIAGNOSE, PROVE, Finding, When
from robocal.diagnose.check_registry import run as run_checks
from robocal.errors import ModelError
from robocal.files.display import to_display
from robocal.files.lens import lens_text, read_lens
from robocal.files.parts import Document, Origin
from robocal.files.plain import json_text
from robocal.files.result import Verdict as VerdictPart
from robocal.files.text import InputFile
from robocal.measure.machine import Rig
from robocal.progress import Watch
from robocal.prove.decision import Decision
from robocal.prove.pixel_bands import pixel_covariance
from robocal.prove.results import ParameterResult, parameter_results
from robocal.prove.statistics import Statistic
from robocal.prove.verdict import Verdict, fold, verdict_of
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, sentences
from robocal.report.sections import Section
from robocal.session.verb_base import VerdictResult
from robocal.session.vision.corner_errors import corner_errors
from robocal.session.vision.corner_refit import RefitCorners, refit_corners
from robocal.session.vision.corner_table import CAMERA, CornerTable, read_corners
from robocal.session.vision.further import further_views
from robocal.session.vision.lens_fit import (
    camera_points,
    fit_lens,
    lens_of,
    look_at_views,
    plain_lens,
    tilts,
    view_poses,
)
from robocal.session.vision.lens_judge import judge_lens, refuse_views
from robocal.session.watching import computable
from robocal.vision.camera import MODELS, project, unproject
from robocal.vision.lenses import Lens
from robocal.vision.sightings import coverage_of

__all__ = ["Intrinsics", "LensDocument", "find_lens"]

SILENT = ("place", "coverage")  # checks that ask where the base of a machine is: here nothing has one


@record(kw_only=True)
class LensErrors:
    """What corners are off by in px, as root mean square of both axes together: of all views as fitted; of views that were left out, by
    the nominal lens and by the one that was found, where each view's own pose was fitted; and how they were left out."""

    fitted: Statistic
    nominal: Statistic | None
    unseen: Statistic | None
    left_out: Statistic | None
    how: str


@record(kw_only=True)
class LensDocument(Document):
    """lens.json: model, size of the images, verdict, the numbers, errors in px, each view, how surely the lens says where a point is seen
    (one standard deviation along the worst direction: at the distance of the target, and far away), the views that would help most, the
    share of the image with corners, how many were set aside, and how far they moved when they were fitted again with the lens."""

    model: str
    image: tuple[int, int]
    nominal: str
    verdict: VerdictPart
    numbers: Listing
    correlation: list[list[float]]
    unit: str
    errors: LensErrors
    views: Listing
    sure: Listing
    further: Listing | None
    coverage: float
    aside: int
    again: RefitCorners | None
    provenance: Origin


@record(kw_only=True, eq=False)
class Intrinsics(VerdictResult):
    """A lens from corners, with everything that its page shows."""

    lens: Lens
    nominal: Lens
    named: str  # what the nominal lens is, in words
    table: CornerTable
    decision: Decision[Rig]
    verdict: Verdict
    parameters: tuple[ParameterResult, ...]
    errors: LensErrors
    points: Array  # (n, 3) corners in the camera's frame, m
    left: Array  # (n, 2) what the lens leaves of them, px
    missed: Array  # (n,) the error of each when its view was left out, px; NaN where it was not
    coverage: float
    again: RefitCorners | None = None
    files: tuple[str, ...] = ()

    @property
    def trusted(self) -> bool:
        """Whether it improved."""
        return self.verdict.status == "improved"

    @property
    def aside(self) -> Bools:
        """Which corners were set aside, (n,)."""
        used = self.decision.need_data.observations[0].used
        return np.zeros(len(self.left), dtype=np.bool_) if used is None else ~used

    @cached_property
    def distance(self) -> float:
        """The median distance of the corners, m."""
        return float(np.median(np.linalg.norm(self.points, axis=1)))

    def sure(self, pixels: Array, far: bool = False) -> Array:
        """One standard deviation (px), along the worst direction, of where it says that points are seen which it has at pixels (m, 2): at
        the distance of the target, or far away; NaN where it sees nothing."""
        ways = unproject(pixels, self.lens.intrinsics)
        seen = np.isfinite(ways).all(axis=1)
        out = np.full(len(pixels), np.nan)
        points = ways[seen] * self.distance
        _, to_point, to_lens = project(points, self.lens.intrinsics)
        names = [f"{CAMERA}.{s}" for s in self.lens.kind.symbols]
        covariance = pixel_covariance(self.decision, points, to_point, to_lens, names, far)
        out[seen] = np.sqrt(np.linalg.eigvalsh(covariance)[:, -1])
        return out

    @cached_property
    def numbers(self) -> Listing:
        """The numbers of the lens, a row for each."""
        of = self.parameters
        ends = np.array([p.interval or (np.nan, np.nan) for p in of])
        return Listing(
            (
                Column("name", "", [p.name.rpartition(".")[2] for p in of]),
                Column("nominal", "", np.array([p.nominal for p in of]), figures=6),
                Column("value", "", np.array([p.identified for p in of]), figures=7),
                Column("sigma", "", np.array([np.nan if p.sigma is None else p.sigma for p in of]), figures=2),
                Column("low", "", ends[:, 0], figures=7),
                Column("high", "", ends[:, 1], figures=7),
                Column("unit", "", ["" if p.unit == "1" else p.unit for p in of]),
                Column("status", "", [p.status for p in of]),
            )
        )

    @cached_property
    def views(self) -> Listing:
        """A row for each view: corners, rms as fitted and when it was left out (px), the largest error, distance and tilt of the target."""
        obs, ids = self.table.pixels, self.table.data.configurations.ids
        count = len(ids)
        size, used = np.linalg.norm(self.left, axis=1), ~self.aside

        def rms(values: Array, some: Bools) -> Array:
            many = np.bincount(obs.configuration[some], minlength=count)
            with np.errstate(invalid="ignore"):
                return np.sqrt(np.bincount(obs.configuration[some], values[some] ** 2, minlength=count) / many)

        worst = np.zeros(count)
        np.maximum.at(worst, obs.configuration, size)
        far = np.bincount(obs.configuration, np.linalg.norm(self.points, axis=1), minlength=count)
        many = np.bincount(obs.configuration, minlength=count)
        return Listing(
            (
                Column("view", "", list(ids)),
                Column("corners", "", many.tolist()),
                Column("rms", "px", rms(size, used), figures=3),
                Column(
                    "left_out",
                    "px",
                    rms(self.missed, used & np.isfinite(self.missed)),
                    figures=3,
                    label="left out [px]",
                ),
                Column("worst", "px", worst, figures=3),
                Column("distance", "mm", 1e3 * far / np.maximum(many, 1), figures=4),
                Column("tilt", "deg", tilts(self.decision), figures=2),
            )
        )

    @cached_property
    def surely(self) -> Listing:
        """How sure a pixel is in the middle and in the corners of the image."""
        width, height = self.table.size
        places = {
            "middle": ((width - 1) / 2, (height - 1) / 2), "top left": (0, 0), "top right": (width - 1, 0),
            "bottom left": (0, height - 1), "bottom right": (width - 1, height - 1),
        }  # fmt: skip
        at = np.array(list(places.values()), dtype=float)
        return Listing(
            (
                Column("place", "", list(places)),
                Column("u", "px", at[:, 0], figures=5),
                Column("v", "px", at[:, 1], figures=5),
                Column("near", "px", self.sure(at), figures=2, label=f"at {1e3 * self.distance:.0f} mm [px]"),
                Column("far", "px", self.sure(at, far=True), figures=2, label="far away [px]"),
            )
        )

    @cached_property
    def further(self) -> Listing | None:
        """The views that would help most; None where markers have places of their own, each by itself."""
        obs = self.table.pixels
        if len(obs.targets) > 1:
            return None
        points = np.unique(np.round(obs.extra["point"], 9), axis=0)  # tolerance: m, of places that are one
        sigma = self.errors.fitted.rms / np.sqrt(2.0)
        return further_views(points, view_poses(self.decision), self.lens, self.lens.known, sigma)

    @property
    def head(self) -> dict[str, Any]:
        """What stands at the head of its page."""
        width, height = self.table.size
        facts = (
            ("Lens", f"{self.lens.model}, {width} x {height} pixels"),
            ("Views", f"{len(self.table.data.configurations)} with {len(self.left)} corners"),
            ("Nominal", self.named),
        )
        return {"title": "A lens from corners", "kind": "Intrinsics", "facts": facts}

    @property
    def document(self) -> LensDocument:
        """What --json says."""
        said = to_display(VerdictPart, self.verdict, reasons=sentences(self.verdict.remarks))
        return self.document_of(
            LensDocument, model=self.lens.model, image=self.table.size, nominal=self.named, verdict=said, numbers=self.numbers,
            correlation=self.lens.correlation.tolist(), unit="px", errors=self.errors, views=self.views, sure=self.surely,
            further=self.further, coverage=self.coverage, aside=int(self.aside.sum()), again=self.again,
        )  # fmt: skip

    def texts(self) -> Mapping[str, str | bytes]:
        """The lens and the document."""
        return {self.files[0]: lens_text(self.lens), self.files[1]: json_text(self.document)}

    def details(self) -> Iterator[Section]:
        """Pictures: where residuals point, what they are along the radius, and how sure a pixel is."""
        from robocal.report.lens_page import lens_pictures

        yield from lens_pictures(self)


# What is said of a lens, where an identification would speak of robots and of its own options.
IN_WORDS = {Code.GAIN_PROVEN: Code.LENS_GAIN_PROVEN, Code.NOT_CONVERGED: Code.LENS_NOT_CONVERGED}


def find_lens(o: Any, watch: Watch | None = None, command: str = "", files: tuple[str, ...] = ()) -> Intrinsics:
    """Reads corners, finds the lens, and judges it. Raises InputError."""
    if len(set(files)) < len(files):
        raise ModelError("a lens is a YAML", key="--output", found=files[0], expected="a name that ends in .yaml")
    if watch:
        watch({"stage": "read"})
    table = read_corners(
        o.corners, size=o.size, square=o.square, checker=o.checker, sheet=o.sheet, image=o.image, exclude=o.exclude
    )
    nominal, named, inputs = _nominal(o, table)
    refuse_views(table, None if nominal.model == "fisheye" else look_at_views(table))
    source = f"{len(table.data.configurations)} views, {o.corners.name}"

    def fit(table: CornerTable) -> tuple[Decision[Rig], Lens]:
        made = fit_lens(table, nominal, o.fix, o.lens is not None, watch)
        return made, lens_of(made, nominal, table.size, source)

    again = None
    with computable(o.corners):
        made, lens = fit(table)
        if o.images:
            table, made, lens, again = refit_corners(table, lens, o.images, fit, watch)
        found = _judge(table, made, nominal, lens)
    return replace(found, named=named, again=again, inputs=(*table.files, *inputs), command=command, files=files)


def _nominal(o: Any, table: CornerTable) -> tuple[Lens, str, tuple[InputFile, ...]]:
    """The lens that is known so far, what it is in words, and its file."""
    if o.lens is None:
        words = f"the plain camera: f = {table.size[0]} px (the width), c in the middle, no distortion"
        return plain_lens(table.size, o.model or "brown"), words, ()
    read = read_lens(o.lens, size=table.size)
    lens, wanted = read.lens, o.model or read.lens.model
    if lens.size is not None and lens.size != table.size:
        found, expected = "{} x {}".format(*lens.size), "{} x {} px, as the corners".format(*table.size)
        raise ModelError("a lens of images of another size", key="--lens", found=found, expected=expected)
    if wanted != lens.model:
        if (lens.model, wanted) != ("brown", "rational"):
            raise ModelError("a lens of another model", key="--model", found=wanted, expected=lens.model)
        lens = Lens.of(wanted, [*lens.numbers, *[0.0] * (len(MODELS[wanted].symbols) - len(lens.numbers))], table.size)
    return replace(lens, size=table.size), f"{o.lens.name}, {lens.model}", (read.file,)


def _judge(table: CornerTable, made: Decision[Rig], nominal: Lens, lens: Lens) -> Intrinsics:
    """The verdict: that of every identification, and what a lens has to be besides."""
    obs, off = table.pixels, corner_errors(made)
    every, singly, noise = off.fitted, off.left_out, off.noise
    before, after = made.unseen("px") or (None, None)
    how = made.proven.best.split.how if made.proven.best else ""
    errors = LensErrors(fitted=every, nominal=before, unseen=after, left_out=singly, how=how)
    points = camera_points(table, made)
    coverage = coverage_of([obs.value], *table.size)
    own = judge_lens(lens, lens.sigma, float(tilts(made).max()), noise, singly, coverage, points, obs.sigma)
    judged = verdict_of(made)
    against = fold([f for f in own if f.level in ("refuse", "qualify")], None)
    if against.reasons:
        judged = judged.instead(against.status if judged.status != "refused" else "refused", *against.reasons)
    judged = replace(judged, reasons=tuple(replace(r, code=IN_WORDS.get(r.code, r.code)) for r in judged.reasons))
    beside: list[Finding] = [
        *(
            f
            for when in (When.DATA, When.FIT)
            for f in run_checks(when, made, DIAGNOSE, PROVE, skip=(*made.silent, *SILENT))
        ),
        *(f for f in own if f.level not in ("refuse", "qualify")),
    ]
    told = Code.ABOVE_STATED_NOISE if any(f.code == Code.LENS_MISSES for f in own) else ""
    said: tuple[Remark, ...] = (*table.remarks, *(_in_words(f) for f in beside if f.code != told))
    return Intrinsics(
        lens=lens, nominal=nominal, named="", table=table, decision=made, verdict=judged,
        parameters=tuple(p for p in parameter_results(made) if p.name.startswith(f"{CAMERA}.")), errors=errors,
        points=points, left=off.left, missed=off.missed, coverage=coverage, warnings=said, reasons=judged.reasons,
    )  # fmt: skip


def _in_words(found: Finding) -> Remark:
    """What a machine does not explain a lens does not, for other reasons."""
    if found.code != Code.ABOVE_STATED_NOISE:
        return found.remark
    return Remark.of(Code.LENS_LEAVES, left=found.numbers["left"], stated=found.numbers["stated"])
