"""What `verify` finds: poses of one or several sources against those of an external instrument, and groups by their means."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from robocal._record import record, replace
from robocal._types import Array
from robocal.apply.verification import (
    Agreement,
    Anova,
    Cause,
    PoseErrors,
    agreement,
    align_poses,
    anova,
    errors,
    relative,
    unlike,
)
from robocal.errors import FormatError, ModelError
from robocal.files.dataset import read_datasets
from robocal.files.display import display_unit, to_display
from robocal.files.plain import json_text
from robocal.files.text import InputFile
from robocal.files.verification import Agreed, ErrorSpread, PosePair, VerifyDocument, Views
from robocal.geometry import se3
from robocal.measure.machine import Rig
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.measured_points import poses_of_points
from robocal.session.verb_base import VerbResult

__all__ = ["VIEWS", "PoseComparison", "PoseSource", "Verified", "spreads_of", "verify_sources", "views_of"]

VIEWS = ("as measured", "relative to the first", "aligned", "aligned, another point")
FARTHEST = 1e5  # tolerance: m, no machine reaches so far
ID = "configuration.id"
FEWEST = 2  # grid: poses that several files have in common
DRAWN = 24  # grid: poses that are drawn; of more an even selection


@record
class PoseSource:
    """Poses (k, 4, 4) by id, and the group of each where there are groups."""

    name: str
    ids: tuple[str, ...]
    poses: Array
    groups: tuple[str, ...] | None = None

    def take(self, ids: tuple[str, ...]) -> PoseSource:
        """Those of some ids, in their order."""
        if self.ids == ids:  # of the same words only one copy stays
            return replace(self, ids=ids)
        where = {name: row for row, name in enumerate(self.ids)}
        rows = [where[i] for i in ids]
        groups = None if self.groups is None else tuple([self.groups[r] for r in rows])
        return replace(self, ids=ids, poses=self.poses[rows], groups=groups)


@record(kw_only=True, eq=False)
class PoseComparison(VerbResult):
    """What has a page beside the document."""

    @property
    def head(self) -> dict[str, Any]:
        """The same of poses and of groups."""
        from robocal.report.verification import verification_head

        return verification_head()

    def texts(self) -> Mapping[str, str | bytes]:
        """The document."""
        return {"verify.json": json_text(self.document)}


@record(kw_only=True, eq=False)
class Verified(PoseComparison):
    """Sources against a reference, all at the same poses: what each errs in every view, groups compared, and where there are two
    sources, who agrees with whom once both are aligned."""

    reference: PoseSource
    sources: tuple[PoseSource, ...]
    errors: tuple[dict[str, PoseErrors], ...]
    motions: tuple[Array | None, ...]  # of every source, that align it best

    @cached_property
    def anova(self) -> dict[str, PosePair[Anova]]:
        """Of every view that all sources have, by position and orientation."""
        if len(self.sources) < 2:
            return {}
        views = [v for v in VIEWS if all(v in e and len(e[v].position) > 1 for e in self.errors)]
        both = ("position", "orientation")
        return {v: PosePair(*(_of([getattr(e[v], what) for e in self.errors]) for what in both)) for v in views}

    @cached_property
    def spreads(self) -> dict[str, Views]:
        """The errors of every source in every view, in mm and deg."""
        return {s.name: spreads_of(of) for s, of in zip(self.sources, self.errors, strict=True)}

    @cached_property
    def between(self) -> dict[str, Views]:
        """What every two sources differ by."""
        views = {VIEWS[0]: errors, VIEWS[1]: relative}
        return {
            f"{a.name} - {b.name}": spreads_of({v: way(a.poses, b.poses) for v, way in views.items()})
            for a, b in combinations(self.sources, 2)
        }

    @cached_property
    def lists(self) -> dict[str, dict[str, Views]]:
        """The errors of every source by the groups of the reference's poses, in every view; of more groups than are drawn, none."""
        names = list(dict.fromkeys(g for g in self.reference.groups or () if g))
        if not 1 < len(names) <= DRAWN:
            return {}
        label = np.array(self.reference.groups, dtype=object)
        out: dict[str, dict[str, Views]] = {}
        for name in names:
            for source, views in zip(self.sources, self.errors, strict=True):
                rows = {v: label[len(label) - len(e.position) :] == name for v, e in views.items()}
                some = {v: PoseErrors(e.position[rows[v]], e.orientation[rows[v]]) for v, e in views.items()}
                out.setdefault(name, {})[source.name] = spreads_of({v: e for v, e in some.items() if len(e.position)})
        return out

    @cached_property
    def places(self) -> Listing:
        """Some poses of the reference, and how far every source is from them as measured and aligned, in mm."""
        count = len(self.reference.ids)
        rows = np.unique(np.linspace(0, count - 1, min(count, DRAWN)).round().astype(int))
        at, parts = self.reference.poses[rows], []
        for source, motion in zip(self.sources, self.motions, strict=True):
            for view, a in ((VIEWS[0], np.eye(4)), (VIEWS[2], motion)):
                if a is not None:
                    apart = (a @ source.poses[rows])[:, :3, 3] - at[:, :3, 3]
                    parts.append((source.name, view, np.hstack([at[:, :3, 3], apart])))
        columns = [Column("source", "", [name for name, *_ in parts for _ in rows])]
        columns += [Column("view", "", [view for _, view, _ in parts for _ in rows])]
        columns += [Column("id", "", [self.reference.ids[i] for _ in parts for i in rows])]
        numbers = 1e3 * np.concatenate([p for *_, p in parts])
        columns += [Column(n, "mm", numbers[:, i]) for i, n in enumerate(("x", "y", "z", "dx", "dy", "dz"))]
        return Listing(tuple(columns))

    @cached_property
    def agreement(self) -> PosePair[Agreed] | None:
        """Of two sources and the reference, in mm and deg."""
        aligned = [a @ s.poses for a, s in zip(self.motions, self.sources, strict=True) if a is not None]
        if len(self.sources) != 2 or len(aligned) != 2:
            return None
        (one, two), between = self.sources, errors(*aligned)
        pairs = list(zip(between.rms, *(e[VIEWS[2]].rms for e in self.errors), strict=True))
        names = [one.name, two.name, self.reference.name]
        return PosePair(*(_agreement(agreement(p), names, unit) for p, unit in zip(pairs, ("m", "rad"), strict=True)))

    @property
    def document(self) -> VerifyDocument:
        """What --json says: mm and deg."""
        return self.document_of(
            VerifyDocument,
            reference=self.reference.name,
            poses=self.reference.ids,
            sources=self.spreads,
            between=self.between,
            lists=self.lists,
            places=self.places,
            anova=self.anova,
            agreement=self.agreement,
        )  # fmt: skip


def _spread(values: Array, unit: str) -> ErrorSpread:
    sd = float(values.std(ddof=1)) if len(values) > 1 else None
    return to_display(ErrorSpread, (unit, len(values), float(values.mean()), sd, float(values.max())))


def spreads_of(views: Mapping[str, PoseErrors]) -> Views:
    """Mean, deviation and largest error of every view, in mm and deg."""
    return {v: PosePair(_spread(e.position, "m"), _spread(e.orientation, "rad")) for v, e in views.items()}


def _agreement(found: Agreement, names: Sequence[str], si: str) -> Agreed:
    pairs, unit = [f"{a} - {b}" for a, b in combinations(names, 2)], display_unit(si)
    own = {n: unit.from_si(v) for n, v in zip(names, found.own, strict=True)}
    shared = None if found.shared is None else [names[i] for i in found.shared]
    return Agreed(unit.name, {p: unit.from_si(v) for p, v in zip(pairs, found.differences, strict=True)}, own, shared)


def _of(groups: Sequence[Array]) -> Anova:
    return anova([float(g.mean()) for g in groups], [float(g.std(ddof=1)) for g in groups], [len(g) for g in groups])


def _read(place: str) -> tuple[PoseSource, tuple[InputFile, ...], tuple[Remark, ...]]:
    reading = read_datasets([place], Rig())
    seen = reading.dataset.observations
    if len(seen) == 1 and seen[0].kind == "position" and seen[0].target is not None:
        made = poses_of_points(reading.dataset, place)
        source = PoseSource(Path(place).stem, made.ids, _near(made.poses, made.ids, place), made.groups)
        return source, reading.files, (*reading.warnings, *made.remarks)
    if len(seen) != 1 or seen[0].kind != "pose":
        kinds = ", ".join(dict.fromkeys(o.kind for o in seen))
        message = "only poses are compared, and this file has another kind"
        raise FormatError(
            message, file=place, key="kind", found=kinds, expected="pose, or position with three targets or more"
        )
    obs = seen[0]
    ids = tuple(reading.dataset.configurations.ids[c] for c in obs.configuration)
    if len(set(ids)) < len(ids):
        again, expected = Counter(ids).most_common(1)[0][0], "one row for each id"
        raise FormatError("two poses have the same id", file=place, key=ID, found=again, expected=expected)
    values, files, warnings = obs.value, reading.files, reading.warnings
    of = reading.dataset.configurations.groups
    groups = None if of is None else tuple([of[c] for c in obs.configuration])
    del reading, seen, obs  # what else was read of many rows goes before their poses come
    return PoseSource(Path(place).stem, ids, _near(se3.from_vector(values), ids, place), groups), files, warnings


def _near(poses: Array, ids: tuple[str, ...], place: str) -> Array:
    """The same poses. Raises FormatError for one that no machine reaches."""
    away = np.abs(poses[:, :3, 3]).max(axis=1)
    if (far := away > FARTHEST).any():
        at, expected = int(np.argmax(far)), f"below {FARTHEST:.0e} m"
        message = "a position too far away for any machine"
        raise FormatError(message, file=place, key=ids[at], found=f"{away[at]:.3g} m", expected=expected)
    return poses


def _common(every: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """The ids that all have, in the order of the first."""
    first, *others = every
    known = [set(ids) for ids in others if ids != first]
    return tuple([i for i in first if all(i in ids for ids in known)]) if known else first


def verify_sources(reference: str, places: Sequence[str], command: str = "") -> Verified:
    """Poses of sources against those of a reference, row by row of the same id. Raises InputError."""
    if not places:
        raise ModelError("there are no poses to compare with the reference", key="SOURCES", expected="files with poses")
    files = (reference, *places)
    read = [_read(p) for p in files]
    every = [r[0] for r in read]
    if len({s.name for s in every}) < len(every):
        every = [replace(s, name=str(p)) for s, p in zip(every, files, strict=True)]
    for (i, one), (j, other) in combinations(enumerate(every), 2):
        if one.ids == other.ids and np.array_equal(one.poses, other.poses):  # they agree with themselves
            found, expected = f"those of {files[i]}", "another source"
            raise FormatError("the same poses twice", file=files[j], found=found, expected=expected)
    both = _common([s.ids for s in every])
    if len(both) < FEWEST:
        found, expected = f"{len(both)} ids of {reference}", f"{FEWEST} or more, the same ids in all files"
        raise FormatError("too few poses in common", file=places[0], key=ID, found=found, expected=expected)
    left = max(len(s.ids) for s in every) - len(both)
    every = [s.take(both) for s in every]
    first, *sources = every
    said = [r for _, _, warnings in read for r in warnings]
    if left:
        said.append(Remark.of(Code.POSES_NOT_IN_ALL, count=left, both=len(both)))
    views, motions = zip(*(views_of(s.poses, first.poses) for s in sources), strict=True)
    doubts = [d for s, e in zip(sources, views, strict=True) if (d := _doubt(s, first, e)) is not None]
    inputs = tuple(i for _, inputs, _ in read for i in inputs)
    return Verified(
        reference=first,
        sources=tuple(sources),
        errors=views,
        motions=motions,
        warnings=tuple(said),
        reasons=tuple(doubts),
        inputs=inputs,
        command=command,
    )


CODES: dict[Cause, str] = {
    "still": Code.UNLIKE_STILL, "scaled": Code.UNLIKE_SCALED, "mirrored": Code.UNLIKE_MIRRORED, "shifted": Code.UNLIKE_SHIFTED,
    "turn-unit": Code.UNLIKE_TURN_UNIT, "turn-inverted": Code.UNLIKE_TURN_INVERTED, "unknown": Code.UNLIKE_UNKNOWN,
}  # fmt: skip


def _doubt(source: PoseSource, reference: PoseSource, views: Mapping[str, PoseErrors]) -> Remark | None:
    found = unlike(source.poses, reference.poses, views.get(VIEWS[2]))
    if found is None:
        return None
    unit, names = "rad" if found.turns else "m", {"source": source.name, "reference": reference.name}
    left, spread = Quantity(found.left, unit), Quantity(found.spread, unit)
    return Remark.of(CODES[found.cause], **names, left=left, spread=spread, factor=found.factor)


def views_of(found: Array, reference: Array) -> tuple[dict[str, PoseErrors], Array | None]:
    """Errors by view, and the motion that aligns best."""
    out, motion = {VIEWS[0]: errors(found, reference), VIEWS[1]: relative(found, reference)}, None
    if len(found) >= 3:
        out[VIEWS[2]], motion, _ = align_poses(found, reference)
    if len(found) >= 5:
        out[VIEWS[3]], *_ = align_poses(found, reference, point=True)
    return out, motion
