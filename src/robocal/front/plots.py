"""Figures of a result, alone: a notebook shows one, and any other program opens the SVG."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from robocal._record import record, replace
from robocal.errors import ModelError, one_of
from robocal.files.writing import write_text
from robocal.report.page import pictures, standalone
from robocal.report.sections import Block, Detail, Figure, Folded, Pair, Section

__all__ = ["Plot", "choose_plot", "figures"]


@record(eq=False)
class Plot:
    """A figure of the page as SVG: `name`, `title`, `caption`; the last line of a notebook cell shows it, `save` writes it."""

    name: str
    title: str
    caption: str
    svg: str

    def save(self, file: str | os.PathLike[str]) -> Path:
        """Writes the figure as an SVG file. Raises FileError."""
        place = Path(file)
        if place.suffix.lower() != ".svg":
            raise ModelError(
                "figures are written as SVG", argument="file", found=str(place), expected="a name that ends in .svg"
            )
        return write_text(place, self.svg)

    def _repr_svg_(self) -> str:
        return self.svg

    def __repr__(self) -> str:
        return f"Plot {self.name}: {self.title or self.caption[:60]}; save('{self.name}.svg') writes it"


def figures(told: Iterable[Section]) -> Iterator[tuple[str, Figure]]:
    """Every figure of a page with its name: that of its section, from the second one on with a number."""
    seen: dict[str, int] = {}
    for section in told:
        for figure in (replace(f, svg=svg) for f in _inside(section.blocks) for svg in pictures(f.svg)):
            stem = (section.key or "figure").replace("-", "_")
            seen[stem] = seen.get(stem, 0) + 1
            yield stem if seen[stem] == 1 else f"{stem}_{seen[stem]}", figure


def _inside(blocks: Iterable[Block | None]) -> Iterator[Figure]:
    for block in blocks:
        if isinstance(block, Figure):
            yield block
        elif isinstance(block, Pair | Folded):
            yield from _inside(block.blocks)
        elif isinstance(block, Detail):
            yield from _inside(block.make())


def choose_plot(told: Iterable[Section], name: str | None, first: tuple[str, ...] = ()) -> Plot:
    """The figure with this name; without one that which the page shows first. Raises ModelError where there is none."""
    known = dict(figures(told))
    if not known:
        raise ModelError(
            "this result has no figure", argument="name", found=name, expected="a result whose page has figures"
        )
    if name is None:
        name = next((n for n in first if n in known), next(iter(known)))
    if name not in known:
        raise ModelError("there is no such figure", argument="name", found=name, **one_of(name, known))
    figure = known[name]
    return Plot(name, figure.title, figure.caption, standalone(figure.svg))
