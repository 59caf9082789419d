"""The page of a study: its numbers, and a picture of every output against what was varied."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from robocal._types import Array
from robocal.files.studyfile import QUANTITIES
from robocal.files.units import UNITS
from robocal.report.sections import Figure, Section, Text
from robocal.report.sweep import Axis, Curve, curves, levels
from robocal.studies.run import StudyOutputs

__all__ = ["pictures"]

SHOWN = {"m": UNITS["mm"], "rad": UNITS["deg"]}
DIGITS = 1e-9  # of the unit that is shown
FEW = 3  # values along an axis; lines of equal error take as many of both


@dataclass(frozen=True)
class _Key:
    """What was varied: its name, its values as they were written, in order, and as numbers of the unit that is shown."""

    name: str
    words: tuple[str, ...]
    numbers: tuple[float, ...] | None

    @property
    def axis(self) -> Axis:
        si = QUANTITIES.get(self.name)
        title = f"{self.name} [{SHOWN[si].name}]" if si else self.name
        if self.numbers is None:
            return Axis(title, np.arange(len(self.words), dtype=float), self.words)
        return Axis(title, np.array(self.numbers))

    @property
    def phrases(self) -> tuple[str, ...]:
        """The values in words: a number says of what it is."""
        return self.words if self.numbers is None else tuple(f"{self.name} {word}" for word in self.words)


def _keys(found: StudyOutputs) -> list[_Key]:
    points = found.study.points
    out = []
    for i, (name, _) in enumerate(points[0].varied):
        seen = {p.varied[i][1]: p for p in points}
        si, at = QUANTITIES.get(name), [dict(p.settings).get(name) for p in seen.values()]
        numbers = [float(v) for v in at if isinstance(v, int | float) and not isinstance(v, bool)]
        shown = tuple(SHOWN[si].from_si(v) if si else v for v in numbers)
        out.append(_Key(name, tuple(seen), shown if len(shown) == len(seen) else None))
    return out


def pictures(found: StudyOutputs) -> Iterator[Section]:
    """A picture of every output: against the number that was varied most, a curve for each combination of the rest; where two numbers
    were varied, lines of equal error."""
    keys = _keys(found)
    order = sorted(range(len(keys)), key=lambda i: (keys[i].numbers is None, -len(keys[i].words)))
    many = [i for i in order if keys[i].numbers is not None and len(keys[i].words) >= FEW]
    axes = many[:2] if len(many) > 1 else order[:1]
    axes.sort()
    rest = [i for i in range(len(keys)) if i not in axes]
    sizes = [len(k.words) for k in keys]
    points = np.arange(np.prod(sizes)).reshape(sizes).transpose(*rest, *axes)  # by what is no axis, then along the axes
    points = points.reshape(-1, *(sizes[i] for i in axes))
    others = list(itertools.product(*(keys[i].phrases for i in rest)))
    x = keys[axes[0]].axis
    for name, si in found.units.items():
        values, told, of = _values(found, name)
        unit = SHOWN[si].name if si in SHOWN else ""
        theories = [t if np.isfinite(t).any() else None for t in told[points]]
        drawn: list[tuple[str, str]] = []
        if len(axes) == 2:
            y = keys[axes[1]].axis
            for k, (more, at, theory) in enumerate(zip(others, points, theories, strict=True)):
                where = f", {', '.join(more)}" if more else ""
                said = f"Lines of equal {name} ({of}) over {x.title} and {y.title}{where}; dotted: as foretold."
                drawn.append((said, levels(x, y, values[at], theory, unit, said, f"{name}-{k}")))
        elif unit and np.nanmax(values, initial=0.0) < DIGITS:
            drawn.append((f"{name} ({of}): below {DIGITS:g} {unit} everywhere, what digits leave.", ""))
        else:
            lines = [Curve(", ".join(m), values[at], t) for m, at, t in zip(others, points, theories, strict=True)]
            said = f"{name} ({of}) against {x.title}."
            if any(t is not None for t in theories):
                said += " Dotted: as linear theory foretells; below: by how much what was found is more."
            drawn.append((said, curves(x, lines, f"{name}: {of}" + (f" [{unit}]" if unit else ""), said, name)))
        blocks = (block for said, svg in drawn for block in (Text.of(said), Figure(svg) if svg else None))
        yield Section.of("", *blocks, title=f"{name}, drawn", key=f"{name}-drawn")


def _values(found: StudyOutputs, name: str) -> tuple[Array, Array, str]:
    """What is drawn of an output at every point, as shown, what is foretold of it, and what it is: theory speaks of the root mean
    square."""
    every, si = found.summary(name), found.units[name]
    factor = 1.0 / SHOWN[si].factor if si in SHOWN else 1.0
    told = np.array([np.nan if s.theory is None else s.theory for s in every])
    foretold = bool(np.isfinite(told).any())
    shown = np.array([s.rms if foretold else s.mean for s in every])
    return factor * shown, factor * told, "rms" if foretold else "mean"
