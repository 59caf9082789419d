"""What calibrations of one cable robot say side by side: which anchor moved, and how all of them scatter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from robocal.remarks.remark import sentences
from robocal.report.sections import Cell, Detail, Facts, Section, Style, Text, ends, figure, quiet, table

__all__ = ["drift_sections"]


def drift_sections(found: Any, written: Sequence[Path] = ()) -> Iterator[Section]:
    """What moved, cable by cable, and how all of them scatter; `found` are the calibrations side by side."""
    words = f"   {len(found.all)} calibrations, the first: {found.all[0].place}"
    yield Section.of("", Text.of((found.robot.name, "strong"), words), Detail(lambda: [_answer(found)]))
    if found.reasons:
        yield Section.of("", *(Text.of(reason) for reason in sentences(found.reasons)))
    for n, (place, one) in enumerate(found.compared, 1):
        yield _table(n, found.labels[place], one)
    s = found.scattered
    scatters = {
        "a component of an anchor": s.component,
        "an anchor": s.point,
        "a zero": s.zero,
        "a component, each frame brought onto the mean by a motion": s.moved,
        "the same, by a motion and a size": s.scaled,
        "what is left by then along the lines of sight": s.along,
        "and of a component across them": s.across,
    }
    rows = [(name, figure(1e3 * value)) for name, value in scatters.items()]
    size = ", ".join(f"{1e2 * float(v):+.2g} %" for v in s.size)
    yield Section.of(
        "", table("scatter about the mean of all, rms", "mm", right=(1,), rows=rows), *quiet(f"size of each beside the mean: {size}"),
        title="How the calibrations scatter", key="scatter", folded=True,
    )  # fmt: skip
    yield from ends(found.remarks, written)


def _answer(found: Any) -> Facts:
    """What a page says first."""
    names = [found.labels[c.place] for c in found.all]
    moved = [
        f"{found.labels[place]}: {', '.join(one.cables_moved) or 'none, as far as these runs can tell'}"
        for place, one in found.compared
    ]
    told = "; ".join(moved) or "nothing: there are no two runs to compare"
    again = any(one.cables_moved for _, one in found.compared)
    later = (
        "calibrate again after what moved is fixed; until then use the latest run"
        if again
        else "keep the calibration that is in use"
    )
    after = (
        later if found.compared else "robocal identify ROBOT LENGTHS POSES -o RUN makes the runs that can be compared"
    )
    asked = f"which frame anchors moved between {names[0]} and {', '.join(names[1:])}"
    return Facts((("Asked", asked), ("Moved", told), ("Next", after)))


def _table(n: int, place: str, one: Any) -> Section:
    rows: list[tuple[Cell, ...]] = []
    styles: list[Style] = []
    for c in one.cables:
        state = "moved" if c.moved else "anchor or zero" if c.doubtful else ""
        shown = (figure(1e3 * v, 3) for v in (c.along, c.across, c.zero, *c.smallest))
        rows.append((c.cable, *shown, f"{c.of_all:.1g}", state))
        styles.append("bad" if c.moved else "doubtful" if c.doubtful else "quiet")
    columns = ("along [mm]", "across [mm]", "zero [mm]", "seen along from [mm]", "across from [mm]", "chance", "")
    lines = [
        "along, across: change of the anchor along its line of sight to the platform and across it",
        "seen from: a drift of this size would be named with 95 % certainty; chance: of such a change by noise alone, of all cables",
    ]
    if one.base is not None and one.base_sigma is not None:
        v, s = 1e3 * one.base, 1e3 * one.base_sigma
        moved = ", ".join(f"{a:.3g} ± {1.96 * b:.2g}" for a, b in zip(v, s, strict=True))
        lines.append(f"the base differs by ({moved}) mm and mrad, ± 95 %")
    elif one.scale_sigma < 1:
        size = f"{1e6 * one.scale:+.3g} ± {1.96e6 * one.scale_sigma:.2g} ppm (95 %)"
        lines.append(
            f"size of the frame {size}, {'beside what else changed' if one.grown else 'if nothing else changed'}"
        )
    return Section.of(
        "", table(place, *columns, right=(1, 2, 3, 4, 5, 6), rows=rows, styles=styles), *quiet(*lines),
        title=f"{place} beside the first", key=f"beside-{n}",
    )  # fmt: skip
