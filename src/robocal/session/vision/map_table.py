"""A table of corners as `vision map` takes it: markers of known size and unknown place, seen whole in views that join them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from robocal._record import replace
from robocal.diagnose.vision_limits import CORNERS_OUTSIDE, MAP_VIEWS
from robocal.errors import FormatError, ModelError
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.vision.corner_table import CornerTable, read_corners
from robocal.session.vision.lens_fit import look_at_views
from robocal.session.vision.lens_judge import check_inside, check_sights, names_of, outside_image
from robocal.vision.lenses import Lens

__all__ = ["read_map_table", "sizes_of"]

WHOLE = 4  # grid: corners of a marker that is seen whole
SHOWN = 8  # grid: markers that a sentence names


def sizes_of(words: Sequence[str], sheets: bool = False) -> tuple[float | None, Mapping[str, float]]:
    """The edge (mm) of markers, and of some by their numbers, from words as 60 and 7=120; none where `sheets` tell them. Raises
    ModelError."""
    usual: float | None = None
    own: dict[str, float] = {}
    expected = "an edge in mm, or MARKER=MM: --size 60 --size 7=120"
    for word in words:
        found = re.fullmatch(r"(?:(.+?)\s*=)?\s*([0-9.eE+-]+)", word.strip())
        try:
            edge = float(found[2]) if found else np.nan
        except ValueError:
            edge = np.nan
        if not (np.isfinite(edge) and edge > 0):
            raise ModelError("not an edge of a marker", key="--size", found=word, expected=expected)
        name = found[1] if found else None
        if (usual is not None) if name is None else name in own:
            raise ModelError("an edge is told twice", key="--size", found=word, expected=expected)
        if name is None:
            usual = edge
        else:
            own[name] = edge
    if usual is None and not own and not sheets:
        raise ModelError("the size of the markers is not stated", key="--size", expected=expected)
    return usual, own


def read_map_table(
    place: Path, lens: Lens, sizes: tuple[float | None, Mapping[str, float]], image: str | None,
    exclude: Sequence[str], without: Sequence[str], printed: Mapping[str, float] | None = None,
) -> CornerTable:  # fmt: skip
    """Corners of markers, each about its own middle; `printed` are edges (mm) of markers on sheets, seen or not. Raises FileError,
    FormatError, ModelError."""
    usual, own = sizes
    if image is None and lens.size is not None:
        image = "{}x{}".format(*lens.size)
    known = 1.0 if usual is None else usual
    table = read_corners(place, size=known, square=None, checker=None, sheet=None, image=image, exclude=exclude)
    if lens.size is not None and lens.size != table.size:
        found, expected = "{} x {}".format(*lens.size), "{} x {} px, as the corners".format(*table.size)
        raise ModelError("a lens of images of another size", key="--lens", found=found, expected=expected)
    table = _without(table, without)
    _refuse_unseen(table, own)
    seen_of = {n: e for n, e in (printed or {}).items() if n in table.marker}
    table = _sized(table, usual, {**seen_of, **own})
    _refuse_twice(table, place)
    table = _inside(table)
    seen = None if lens.model == "fisheye" else look_at_views(table)
    if seen is not None:
        check_sights(table, seen)
    return _joined(table)


def _without(table: CornerTable, names: Sequence[str]) -> CornerTable:
    strange = [n for n in names if n not in table.marker]
    if strange:
        raise ModelError(
            "no marker of this number is seen", key="--without", found=strange[0], expected=_some(table.marker)
        )
    return table.keep(~np.isin(table.marker, names)) if names else table


def _some(names: Sequence[str]) -> str:
    every = sorted(set(names), key=lambda n: (len(n), n))
    return ", ".join(every[:SHOWN]) + (", ..." if len(every) > SHOWN else "")


def _refuse_unseen(table: CornerTable, own: Mapping[str, float]) -> None:
    strange = [n for n in own if n not in set(table.marker)]
    if strange:
        raise ModelError(
            "a size of a marker that no view shows", key="--size", found=strange[0], expected=_some(table.marker)
        )


def _sized(table: CornerTable, usual: float | None, own: Mapping[str, float]) -> CornerTable:
    """Places on markers by the edges of each."""
    names = np.array(table.marker)
    lacking = sorted(set(table.marker) - set(own)) if usual is None else []
    if lacking:
        raise ModelError(
            "markers without a size", key="--size", found=_some(lacking), expected="--size MM of all others"
        )
    factor = np.ones(len(names))
    for name, edge in own.items():
        factor[names == name] = edge / (usual or 1.0)
    obs = table.pixels
    obs = replace(obs, extra={**obs.extra, "point": obs.extra["point"] * factor[:, None]})
    return replace(table, data=replace(table.data, observations=(obs,)))


def _refuse_twice(table: CornerTable, place: Path) -> None:
    """A marker of one number is one marker."""
    obs = table.pixels
    assert obs.target is not None
    key = np.stack([obs.configuration, obs.target, table.corner], axis=1)
    kinds, first, count = np.unique(key, axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        again = int(np.flatnonzero(count > 1)[0])
        rows = np.flatnonzero((key == kinds[again]).all(axis=1))
        view, marker = table.data.configurations.ids[kinds[again, 0]], obs.targets[kinds[again, 1]].name
        row = None if obs.rows is None else int(obs.rows[rows[1]])
        raise FormatError(
            "a view shows one marker twice", file=place, row=row, column="marker", found=f"marker {marker} in view {view}",
            expected="markers of different numbers; --without leaves all of one number out",
        )  # fmt: skip


def _inside(table: CornerTable) -> CornerTable:
    """Without the few corners outside the image that a decoder guessed."""
    obs, (width, height) = table.pixels, table.size
    outside = outside_image(obs.value, width, height)
    if not outside.any():
        return table
    if outside.mean() > CORNERS_OUTSIDE:
        check_inside(obs.value, width, height)
    views = names_of(table.data.configurations.ids, obs.configuration[outside])
    said = Remark.of(Code.CORNERS_OUTSIDE, count=int(outside.sum()), total=len(obs), views=views)
    return replace(table.keep(~outside), remarks=(*table.remarks, said))


def _joined(table: CornerTable) -> CornerTable:
    """What says something of a place: markers that are whole in some view, in views that show a whole marker."""
    obs = table.pixels
    assert obs.target is not None
    many = np.zeros((len(table.data.configurations), len(obs.targets)), dtype=np.int64)
    np.add.at(many, (obs.configuration, obs.target), 1)
    whole = many == WHOLE
    rows = whole.any(axis=1)[obs.configuration] & whole.any(axis=0)[obs.target]
    views = int((whole.sum(axis=1) > 1).sum())
    if len(obs.targets) < 2:
        raise ModelError(
            "one marker is no map", key="marker", found=_some(table.marker), expected="two or more of different numbers"
        )
    if (whole.sum(axis=0) < 2).all():
        raise ModelError(
            "no marker is seen in two views", key="view", found=f"{len(whole)} views, each with markers of its own",
            expected="views that overlap: every marker in three or more",
        )  # fmt: skip
    if views < MAP_VIEWS:
        raise ModelError(
            "too few views tell no map", key="view", found=f"{views} with two whole markers",
            expected=f"{MAP_VIEWS:g} at least, better 20 to 100, from different sides",
        )  # fmt: skip
    if rows.all():
        return table
    part = [t.name for t, one in zip(obs.targets, whole.any(axis=0), strict=True) if not one]
    said = [Remark.of(Code.MARKERS_NEVER_WHOLE, count=len(part), names=tuple(part[:SHOWN]))] if part else []
    return replace(table.keep(rows), remarks=(*table.remarks, *said))
