"""The page of a verification, from its document: errors by source and view, who agrees with whom, and where the poses are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from robocal.remarks.remark import percent
from robocal.report.numbers import significant, with_unit
from robocal.report.sections import (
    Block,
    Cell,
    Detail,
    Figure,
    Pair,
    Section,
    Table,
    Text,
    ends,
    figure,
    messages,
    quiet,
    table,
)  # fmt: skip
from robocal.report.space import Panel, draw_space
from robocal.report.svg import AxisScale, bottom_axis, circles, drawing, label, line, num, path, span

__all__ = ["BARS", "Spread", "draw_spreads", "verification_head", "verification_sections"]

LEVEL = 0.05
BARS = (
    "A dot is the mean of the errors, its bar one standard deviation to each side, the small mark the largest error. A name with a dash "
    "is what two sources differ by."
)
ARROWS = (
    "Each arrow starts where {reference} has the position and points to where the source has it, enlarged as written below it: as "
    "measured, and once the source is aligned."
)
MANY = 20.0  # grid: times the smallest mean that the largest is, from where an axis is logarithmic
WIDTH, LEFT, RIGHT, ROW = 460.0, 16.0, 446.0, 36.0  # px
Spread = tuple[str, float, float | None, float | None]  # a name, mean, standard deviation and largest


def verification_head() -> dict[str, Any]:
    """The same of poses and of groups, as `report.page.page` takes it."""
    return {"title": "Poses against an external instrument", "kind": "Verification"}


def verification_sections(found: Any) -> Iterator[Section]:
    """Errors by view, the analysis of variance, and who agrees with whom, from a `VerifyDocument` or a `SummaryDocument`."""
    if not hasattr(found, "sources"):
        yield Section.of("", Text.of(f"{len(found.groups)} groups: {', '.join(found.groups)}"))
        yield Section.of("", _anova(found.anova), title="One-way analysis of variance", key="anova")
        drawn = Detail(lambda: _group_figures(found))
        yield Section.of("", drawn, title="Means and deviations", key="means", brief=(), folded=True)
        return
    yield Section.of("", Text.of((found.reference, "strong"), f"   {len(found.poses)} poses in all files"))
    rows: list[tuple[Cell, ...]] = []
    for source, views in found.sources.items():
        rows += [(source, view, *_cells(e.position), *_cells(e.orientation)) for view, e in views.items()]
    columns = ("source", "errors", "position [mm]", "± sd", "largest", "orientation [deg]", "± sd", "largest")
    yield Section.of(
        "", table(*columns, right=(2, 3, 4, 5, 6, 7), rows=rows),
        *quiet("aligned: the source in the reference's frame; another point: it may watch another frame on the platform as well"),
        title="Errors", key="errors",
    )  # fmt: skip
    if found.anova:
        both = {f"{v}, {what}": a for v, pair in found.anova.items() for what, a in vars(pair).items()}
        yield Section.of("", _anova(both), title="Do the means of the sources differ?", key="anova")
    if found.agreement is not None:
        yield Section.of("", *_agreement_table(found.agreement), title="Who agrees with whom", key="agreement")
    yield from ends(messages(found, found.warnings))
    drawn = Detail(lambda: _figures({**found.sources, **found.between}, "views"))
    yield Section.of("", drawn, title="Means and deviations", key="means", brief=(), folded=True)
    if found.lists:
        drawn = Detail(lambda: _lists(found.lists))
        yield Section.of("", drawn, title="Means and deviations by list", key="lists", brief=(), folded=True)
    if found.places is not None:
        drawn = Detail(lambda: _places(found))
        yield Section.of("", drawn, title="Where the poses are", key="places", brief=(), folded=True)


def _figures(sources: Mapping[str, Mapping[str, Any]], key: str, title: str = "") -> Iterator[Block]:
    """Positions beside orientations: for every view the errors of all that have it."""
    views = dict.fromkeys(v for of in sources.values() for v in of)
    both = []
    for what in ("position", "orientation"):
        rows, unit = {}, ""
        for view in views:
            of = {name: getattr(e[view], what) for name, e in sources.items() if view in e}
            rows[view] = [(name, s.mean, s.sd, s.max) for name, s in of.items()]
            unit = next(iter(of.values())).unit
        name = f"{title}{': ' if title else ''}{what} [{unit}]"
        both.append(Figure(draw_spreads(rows, unit, f"{key}-{what}", f"Errors of the {what}"), "", name))
    yield Pair(tuple(both))
    if not title:
        yield from quiet(BARS)


def _lists(lists: Mapping[str, Mapping[str, Any]]) -> Iterator[Block]:
    """For every source, its errors by list."""
    for k, source in enumerate(dict.fromkeys(s for of in lists.values() for s in of)):
        yield from _figures({name: of[source] for name, of in lists.items() if source in of}, f"list-{k}", source)


def _group_figures(found: Any) -> Iterator[Block]:
    """For every quantity the means of the groups."""
    if found.means is None:
        return
    columns = {c.name: c for c in found.means.columns}
    drawn = []
    for k, name in enumerate(found.anova):
        mean, sd = (columns[f"{name}_{part}"] for part in ("mean", "sd"))
        rows = [(g, m, s, None) for g, m, s in zip(found.groups, mean.plain, sd.plain, strict=True)]
        title = f"{name} [{mean.unit}]" if mean.unit else name
        drawn.append(Figure(draw_spreads({"": rows}, mean.unit, f"group-{k}", f"Means of {name}"), "", title))
    yield Pair(tuple(drawn))
    yield from quiet("A dot is the mean of a group, its bar one standard deviation to each side.")


def draw_spreads(parts: Mapping[str, Sequence[Spread]], unit: str, key: str, title: str) -> str:
    """Under each heading a row for each name: mean, deviation and the largest, on one axis for all."""
    every = [row for rows in parts.values() for row in rows]
    means = [m for _, m, *_ in every if m > 0]
    log = bool(means) and max(means) > MANY * min(means)
    ends = [v for _, m, sd, most in every for v in (m, m + (sd or 0.0), most or 0.0)]
    wide = span(means + ends) if log else (0.0, 1.05 * max(max(ends, default=0.0), 1e-12))
    x = AxisScale(*(wide or (0.0, 1.0)), LEFT, RIGHT, log)
    below, drawn, dots = 8.0, [], []
    for heading, rows in parts.items():
        if heading:
            below += 22
            drawn.append(label(LEFT, below, heading, "strong"))
        for name, mean, sd, most in rows:
            below += ROW
            at, low, high = x(mean), x(max(mean - (sd or 0.0), x.low)), x(mean + (sd or 0.0))
            told = f"{significant(mean)}" + ("" if sd is None else f" ± {significant(sd, 2)}")
            drawn += [label(LEFT, below - 14, name, "name"), label(RIGHT, below - 14, told, "tick", "end")]
            ends_at = "".join(f"M{num(end)} {num(below - 4)}v8" for end in (low, high))
            drawn.append(path(f"M{num(low)} {num(below)}H{num(high)}{ends_at}", "scatter"))
            if most is not None:
                drawn.append(line(x(most), below - 3, x(most), below + 3, "mean before"))
            dots.append((at, below))
        below += 14
    foot = below + 4
    axis = bottom_axis(x, foot, 4, f"error, {unit}{', logarithmic' if log else ''}" if unit else "")
    said = "; ".join(
        f"{heading}{', ' if heading else ''}{name}: {with_unit(significant(mean), unit)}"
        for heading, rows in parts.items()
        for name, mean, *_ in rows
    )
    return drawing(
        WIDTH, foot + 40, [axis, *drawn, path(circles(dots, 3.6), "mark after")], title=title, text=f"{said}.", key=key
    )


def _places(found: Any) -> Iterator[Block]:
    """The drawn poses as arrows from the reference to every source, as measured and aligned."""
    columns = {c.name: c.plain for c in found.places.columns}
    which = list(zip(columns["source"], columns["view"], strict=True))
    numbers = np.array([columns[n] for n in ("x", "y", "z", "dx", "dy", "dz")], float).T
    panels = []
    for k, (source, view) in enumerate(dict.fromkeys(which)):
        mine = np.array([w == (source, view) for w in which])
        mark = "before" if view == "as measured" else "after"
        title, name = f"Errors of {source}, {view}", f"{source}, {view}"
        panels.append(Panel(f"source-{k}", title, numbers[mine, 3:], (mark, mark), name))
        at, names = numbers[mine, :3], [i for i, m in zip(columns["id"], mine.tolist(), strict=True) if m]
    some = "" if len(at) == len(found.poses) else f" {len(at)} of {len(found.poses)} poses are drawn."
    yield Figure(draw_space(panels, at, names), ARROWS.format(reference=found.reference) + some)


def _cells(e: Any) -> tuple[str, ...]:
    return figure(e.mean, 3), "" if e.sd is None else figure(e.sd, 3), figure(e.max, 3)


def _anova(found: Mapping[str, Any]) -> Table:
    rows = []
    for name, a in found.items():
        shown = "differ" if a.chance < LEVEL else "not shown to differ"
        rows.append((name, figure(a.f, 3), f"{a.between}, {a.within}", f"{a.chance:.2g}", shown))
    return table("means of", "F", "degrees of freedom", "chance", f"at {percent(1 - LEVEL)}", right=(1, 3), rows=rows)


def _agreement_table(found: Any) -> Iterator[Block]:
    position, turned = found.position, found.orientation
    rows = [(pair, figure(v, 3), figure(turned.apart[pair], 3)) for pair, v in position.apart.items()]
    for name in position.own:
        moved, turn = (figure(v, 3) if v == v else "none left" for v in (position.own[name], turned.own[name]))
        rows.append((f"{name} by itself", moved, turn))
    yield table("rms, aligned to the reference", "position [mm]", "orientation [deg]", right=(1, 2), rows=rows)
    yield from quiet("by itself: if the errors of the three have nothing in common (Grubbs)")
    for what, one in (("positions", position), ("orientations", turned)):
        if one.shared is not None:
            a, b = one.shared
            third = next(name for name in one.own if name not in one.shared)
            why = f"they share an error, or {third} errs"
            yield Text.of(f"{what}: {a} and {b} agree better than errors of their own allow: {why}")
