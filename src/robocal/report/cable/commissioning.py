"""The page of a commissioning: errors of the verification by list, beside those of the thesis, and the pictures of `verify`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from robocal.report.sections import Block, Detail, Figure, Pair, Section, Text, ends, figure, quiet, table
from robocal.report.verification import BARS, Spread, draw_spreads, verification_sections

__all__ = ["commissioning_details", "commissioning_sections", "thesis_figures"]

# Of lists A, B and C with a camera: r, then mean and deviation relative to the marker and to the first pose (mm), and the same in deg.
# Source: the thesis behind `examples/cable-laval`, tables 3.3, 3.4 and 3.5.
THESIS: Mapping[str, tuple[float, ...]] = {
    "A": (12.9, 60.9, 8.1, 25.8, 7.8, 2.1, 0.8, 1.3, 0.9),
    "B": (14.1, 64.5, 14.0, 27.4, 8.2, 2.3, 0.5, 1.3, 0.7),
    "C": (15.6, 59.5, 17.2, 30.5, 11.1, 2.9, 0.6, 1.6, 1.2),
}
THESIS_CAMERA: Mapping[str, tuple[float, ...]] = {
    "A": (59.2, 9.1, 1.8, 0.4),
    "B": (61.5, 12.4, 1.9, 0.4),
    "C": (30.8, 9.6, 1.5, 0.4),
}
THESIS_BETWEEN: Mapping[str, tuple[float, ...]] = {
    "A": (8.4, 4.2, 1.3, 0.4),
    "B": (8.2, 3.5, 1.2, 0.5),
    "C": (32.2, 10.3, 2.3, 0.5),
}
NINE = ("residual", "position_marker", "position_marker_sd", "position_first", "position_first_sd",
        "orientation_marker", "orientation_marker_sd", "orientation_first", "orientation_first_sd")  # fmt: skip
CAMERA = ("camera_position", "camera_position_sd", "camera_orientation", "camera_orientation_sd")
BETWEEN = ("between_position", "between_position_sd", "between_orientation", "between_orientation_sd")


def commissioning_sections(found: Any, written: Any) -> Iterator[Section]:
    """What was done, and the three tables."""
    n = found.spec.model.poses.calibration
    how = "ranges between beacons" if found.world.beacons else "a tape measure"
    lists = len(found.done)
    head = f"   simulated: anchors from {how}, {lists} list{'' if lists == 1 else 's'} of {n} poses, {found.motions} motions"
    yield Section.of("", Text.of((found.spec.name, "strong"), head), key="head")
    if found.done:
        yield from _tables(found.listing)
        low, high = found.spec.model.tensions.allowed_N
        rows = [(d.name, figure(d.tension[0], 3), figure(d.tension[1], 3)) for d in found.done]
        yield Section.of(
            "", table("list", "least [N]", "greatest [N]", right=(1, 2), rows=rows), *quiet(f"allowed: {low:g} to {high:g} N"),
            title="Tensions of the plant", key="tensions",
        )  # fmt: skip
    yield from ends(found.remarks, written)


def _tables(listing: Any) -> Iterator[Section]:
    columns = {c.name: list(c.values) for c in listing.columns}
    names = columns["list"]

    def rows(keys: tuple[str, ...], thesis: Mapping[str, tuple[float, ...]]) -> list[tuple[str, ...]]:
        mine = [(n, "this run", *(figure(columns[k][i], 3) for k in keys)) for i, n in enumerate(names)]
        return mine + [(n, "thesis", *(f"{v:.1f}" for v in values)) for n, values in thesis.items()]

    nine = (
        "list",
        "",
        "r [mm]",
        "marker [mm]",
        "± sd",
        "first pose [mm]",
        "± sd",
        "marker [deg]",
        "± sd",
        "first pose [deg]",
        "± sd",
    )
    four = ("list", "", "position [mm]", "± sd", "orientation [deg]", "± sd")
    right = tuple(range(2, 11))
    yield Section.of(
        "", table(*nine, right=right, rows=rows(NINE, THESIS)),
        *quiet("the robot's pose by its lengths against the instrument, relative to the markers' frame and to the first pose"),
        title="Robot (table 3.3)", key="robot",
    )  # fmt: skip
    yield Section.of(
        "",
        table(*four, right=right[:4], rows=rows(CAMERA, THESIS_CAMERA)),
        title="Camera and instrument (table 3.4)",
        key="camera",
    )
    yield Section.of(
        "",
        table(*four, right=right[:4], rows=rows(BETWEEN, THESIS_BETWEEN)),
        title="Camera and robot (table 3.5)",
        key="between",
    )
    yield Section.of(
        "",
        Text.of(
            "Against the truth: "
            + "; ".join(
                f"list {n}: {figure(columns['true_position_first'][i], 3)} mm and {figure(columns['true_orientation_first'][i], 3)} deg "
                f"relative to the first pose, {figure(columns['normalised'][i], 3)} of what the run states"
                for i, n in enumerate(names)
            )
        ),
        key="truth",
    )


def commissioning_details(found: Any) -> Iterator[Section]:
    """The pictures of `verify`: figures 3.22 to 3.25 beside the thesis' own, means by view and list, and figure 3.17."""
    if found.verified is None:
        return
    columns = {c.name: list(c.values) for c in found.listing.columns}
    title = "Means and deviations beside the thesis (figures 3.22 to 3.25)"
    drawn = Detail(lambda: thesis_figures(columns))
    yield Section.of("", drawn, title=title, key="beside", brief=(), folded=True)
    yield from (s for s in verification_sections(found.verified.document) if s.key in ("means", "lists", "places"))


def thesis_figures(columns: Mapping[str, list[Any]]) -> Iterator[Block]:
    """By list: the robot relative to the first pose, then camera and instrument, and camera and robot; this run and the thesis."""

    def rows(key: str, thesis: Mapping[str, tuple[float, ...]], at: int) -> list[Spread]:
        mine = zip(columns["list"], columns[key], columns[f"{key}_sd"], strict=True)
        # What no camera saw has no mean.
        out: list[Spread] = [(f"{n}, this run", m, None if s != s else s, None) for n, m, s in mine if m == m]
        return out + [(f"{n}, thesis", v[at], v[at + 1], None) for n, v in thesis.items()]

    for heads, parts in (
        (("3.22", "3.23"), (("relative to the first pose", "{}_first", THESIS, (3, 7)),)),
        (("3.24", "3.25"), (("camera and instrument", "camera_{}", THESIS_CAMERA, (0, 2)),
                            ("camera and robot", "between_{}", THESIS_BETWEEN, (0, 2)))),
    ):  # fmt: skip
        both = []
        for k, (what, unit) in enumerate((("position", "mm"), ("orientation", "deg"))):
            spreads = {view: rows(key.format(what), thesis, at[k]) for view, key, thesis, at in parts}
            svg = draw_spreads(spreads, unit, f"figure-{heads[k].replace('.', '-')}", f"Errors of the {what}, by list")
            both.append(Figure(svg, "", f"Figure {heads[k]}: {what} [{unit}]"))
        yield Pair(tuple(both))
    yield from quiet(BARS.partition(", the small mark")[0] + ".")
