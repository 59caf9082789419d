"""What `cable straightness` finds: sag, excess length and stretch at poses, the tensions for a wanted error, and its document."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np

from robocal._record import record
from robocal._types import Array, Ints
from robocal.cables.geometry import straight
from robocal.cables.rope import Rope
from robocal.cables.straightness import (
    excess_of,
    greatest_tension,
    least_tension,
    level_excess,
    level_sag,
    pose_change,
    position_gain,
    sag_of,
    where_it_decides,
    worst_position,
)
from robocal.files.cable.pose_lists import pose_columns, tension_columns
from robocal.files.display import in_units, listing_text
from robocal.files.parts import CableDocument
from robocal.files.plain import json_text
from robocal.quantities import Column, Listing, UnitValue, unit_value
from robocal.session.cable.cable_result import CableResult
from robocal.session.cable.load_fits import Loads

__all__ = ["Straightness"]

STEPS = 6  # grid: tensions of the table of the level cable


@record(kw_only=True)
class StraightnessDocument(CableDocument):
    """straightness.json. `errors` has a row for sag and one for stretch; `needed` the least tension by what sag may do, and the greatest
    by what stretch may; `loads` the numbers that were found, with 95 % intervals."""

    wanted: UnitValue
    weight: UnitValue
    elasticity: UnitValue
    errors: Listing
    needed: dict[str, UnitValue | None]
    level: Listing
    loads: Listing | None
    measured: Listing | None


@record(kw_only=True, eq=False)
class Straightness(CableResult):
    """Poses (k, 4, 4) with tensions (k, m) in N, the weight of the cables (m,) in N/m, the ropes of the cables by the law of each, and
    the error in m that is wanted. `span` in m and `at` (n,) in N are of the level cable; `loads` what was measured."""

    names: tuple[str, ...]
    poses: Array
    tension: Array
    weight: Array
    ropes: tuple[Rope, ...]
    wanted: float
    span: float | None
    at: Array | None
    loads: Loads | None

    title: ClassVar[str] = "how straight cables are"

    @cached_property
    def full(self) -> Array:
        """Straight lengths (k, m) in m."""
        return straight(self.robot, self.poses)[0]

    @cached_property
    def sagging(self) -> tuple[Array, Array]:
        """Sag and excess length (k, m) in m."""
        return sag_of(self.robot, self.poses, self.tension, self.weight)

    def strain(self, tension: Array) -> Array:
        """Strain (..., m) of the cables under tensions (..., m)."""
        return np.stack([r.strain(tension[..., i]) for i, r in enumerate(self.ropes)], axis=-1)

    @cached_property
    def stretch(self) -> Array:
        """By how much cables are longer than without tension (k, m) in m."""
        strain = self.strain(self.tension)
        return self.full * strain / (1 + strain)

    @cached_property
    def changes(self) -> Mapping[str, tuple[Array, Array]]:
        """By what is left aside: what it does to lengths (k, m) in m and to poses, twists (k, 6)."""
        some = {"sag": self.sagging[1], "stretch": -self.stretch}
        return {name: (change, pose_change(self.robot, self.poses, change)) for name, change in some.items()}

    @cached_property
    def errors(self) -> Listing:
        """A row for sag and one for stretch: the greatest change of a length, of a position, of an orientation, and where."""
        rows = []
        for name, (change, twist) in self.changes.items():
            size = np.nan_to_num(np.abs(change), nan=-1.0)
            row, cable = (int(v) for v in np.unravel_index(int(size.argmax()), size.shape))
            moved, turned = (np.linalg.norm(twist[:, part], axis=1) for part in (slice(0, 3), slice(3, 6)))
            at = int(np.nan_to_num(moved, nan=-1.0).argmax())
            place, turn = float(moved[at]), float(np.nanmax(turned))
            hang = float(np.nanmax(self.sagging[0])) if name == "sag" else None
            rows.append(
                (
                    name,
                    hang,
                    float(np.abs(change[row, cable])),
                    f"{self.robot.cables[cable]} at {self.names[row]}",
                    place,
                    turn,
                    self.names[at],
                )
            )
        heads = (
            ("left aside", ""), ("sag", "m"), ("length", "m"), ("of cable", ""), ("position", "m"), ("orientation", "rad"), ("at", ""),
        )  # fmt: skip
        return Listing(tuple(Column(n, u, v) for (n, u), v in zip(heads, zip(*rows, strict=True), strict=True)))

    @cached_property
    def needed(self) -> Mapping[str, float | None]:
        """Tensions in N: where every cable bears so much or more, sag takes at most what is wanted of every length and every position;
        where every cable bears so much or less, stretch does. None: it always does."""
        longest = float(np.nanmax(self.full))
        guess = float(self.weight.max()) * longest * np.sqrt(longest / (24 * self.wanted))
        gain = position_gain(self.robot, self.poses)

        def told(change: Array, at: Ints, place: bool) -> Array:
            return worst_position(gain[at], change) if place else change.max(axis=1)

        def of_sag(tension: float, at: Ints, place: bool) -> Array:
            return told(
                excess_of(self.robot, self.poses[at], np.full_like(self.full[at], tension), self.weight), at, place
            )

        def of_stretch(tension: float, at: Ints, place: bool) -> Array:
            strain = self.strain(np.full((1, self.full.shape[1]), tension))
            return told(self.full[at] * strain / (1 + strain), at, place)

        def least(error: Callable[[float], float]) -> float:
            return least_tension(error, self.wanted, guess)

        def greatest(error: Callable[[float], float]) -> float | None:
            return greatest_tension(error, self.wanted)

        out: dict[str, float | None] = {}
        for name, place in (("length", False), ("position", True)):
            heavy, n = self.weight.any(), len(self.poses)
            out[f"sag.{name}"] = (
                where_it_decides(partial(of_sag, place=place), n, least, self.wanted) if heavy else None
            )
            out[f"stretch.{name}"] = where_it_decides(partial(of_stretch, place=place), n, greatest, self.wanted)
        return out

    @property
    def levels(self) -> Array:
        """The tensions (n,) in N of the level cable."""
        if self.at is not None:
            return self.at
        limits = self.robot.limits
        low, high = (
            (np.nanmin(self.tension), np.nanmax(self.tension))
            if limits is None
            else (limits[:, 0].min(), limits[:, 1].max())
        )
        low = max(float(low), float(high) / 100)
        return np.geomspace(low, max(float(high), 1.001 * low), STEPS)

    @cached_property
    def length(self) -> float:
        """The span of the level cable, m."""
        return float(np.nanmax(self.full)) if self.span is None else self.span

    @property
    def laws(self) -> Mapping[str, Rope]:
        """Cables by what their stretch is called: by both laws where loads tell them."""
        if self.loads is None or self.loads.constant is None:
            return {"stretch": self.ropes[0]}
        both = (self.loads.constant, self.loads.curve)
        return {f"stretch, {f.what}": f.rope for f in both if f is not None}

    @cached_property
    def level(self) -> Listing:
        """A level cable as long as the longest one, or as was asked for, under several tensions: sag, excess length, and the stretch of so
        much cable by each law."""
        t, w = self.levels, float(self.weight.max())
        return Listing((
            Column("tension", "N", t),
            Column("sag", "m", level_sag(self.length, t, w)),
            Column("excess", "m", level_excess(self.length, t, w)),
            *(Column(name, "m", self.length * law.strain(t)) for name, law in self.laws.items()),
        ))  # fmt: skip

    @cached_property
    def numbers(self) -> Listing | None:
        """The numbers that loads tell, a row for each, with 95 % intervals and errors on loads that the fit had not seen."""
        if self.loads is None:
            return None
        rows = [
            (f.what, p.name, p.identified, *(p.interval or (None, None)), p.unit, f.missed, len(f.measured))
            for f in self.loads.fits
            for p in f.parameters
        ]  # fmt: skip
        heads = (
            *(("fit", ""), ("number", ""), ("value", "SI"), ("low", "SI"), ("high", "SI"), ("unit", "")),
            *(("left out, rms", "m"), ("loads", "")),
        )
        return Listing(tuple(Column(n, u, v) for (n, u), v in zip(heads, zip(*rows, strict=True), strict=True)))

    @cached_property
    def measured(self) -> Listing | None:
        """Every load: what was read, and what each fit says; of sags the excess length too."""
        if self.loads is None:
            return None
        told: list[tuple[Any, ...]] = []
        one, other = self.loads.constant, self.loads.curve
        if (w := self.loads.weight) is not None:
            spans = np.concatenate([o.extra["span"] for o in w.decision.need_data.observations])
            longer = level_excess(spans, w.tension, float(self.weight.max()))
            told += [
                ("sag", t, y, p, None, e, 1e2 * e / l)
                for t, y, p, e, l in zip(w.tension, w.measured, w.predicted, longer, spans, strict=True)
            ]
        if one is not None:
            curved = [None] * len(one.measured) if other is None else other.predicted
            told += [
                ("elongation", t, y, p, c, None, None)
                for t, y, p, c in zip(one.tension, one.measured, one.predicted, curved, strict=True)
            ]
        heads = (
            *(("load", ""), ("tension", "N"), ("measured", "m"), ("fitted", "m"), ("curve", "m"), ("excess", "m")),
            ("of the span", "%"),
        )
        return Listing(tuple(Column(n, u, v) for (n, u), v in zip(heads, zip(*told, strict=True), strict=True)))

    @cached_property
    def listing(self) -> Listing:
        """Every pose: tensions, and per cable excess length and stretch; what each does to the pose."""
        cables = self.robot.cables
        moved = {n: np.linalg.norm(t[:, :3], axis=1) for n, (_, t) in self.changes.items()}
        parts = (("sag", self.sagging[0]), ("excess", self.sagging[1]), ("stretch", self.stretch))
        return Listing((
            *pose_columns(self.names, self.poses),
            *tension_columns(self.robot, self.tension),
            *(Column(f"{c}.{n}", "m", v[:, i], digits=6) for n, v in parts for i, c in enumerate(cables)),
            *(Column(f"position.{n}", "m", v, digits=6) for n, v in moved.items()),
        ))  # fmt: skip

    @property
    def document(self) -> StraightnessDocument:
        """What straightness.json holds."""
        return self.document_of(
            StraightnessDocument, wanted=UnitValue(self.wanted, "m"), weight=UnitValue(float(self.weight.max()), "N/m"),
            elasticity=UnitValue(float(self.ropes[0].strain(self.middle)) / self.middle, "1/N"), errors=self.errors,
            needed={k: unit_value(v, "N") for k, v in self.needed.items()}, level=self.level, loads=self.numbers, measured=self.measured,
        )  # fmt: skip

    @property
    def middle(self) -> float:
        """The tension at which one elasticity is told, N: the mean of those at the poses."""
        return float(np.nanmean(self.tension)) or 1.0

    def texts(self) -> Mapping[str, str | bytes]:
        """The list in the robot file's units, and the document."""
        shown = in_units(self.listing, self.file.units)
        return {"straightness.csv": listing_text(shown), "straightness.json": json_text(self.document)}
