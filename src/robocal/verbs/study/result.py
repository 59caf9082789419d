"""What a study says: its trials as a file, every point in a few numbers, and a picture of every output against what was varied."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from robocal._record import record
from robocal._types import Array
from robocal.errors import FormatError
from robocal.files.csvtext import csv_text
from robocal.files.parts import Document, Origin, provenance_of
from robocal.files.studyfile import QUANTITIES
from robocal.files.text import InputFile
from robocal.files.units import UNITS
from robocal.quantities import Column, Listing
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark, remark_fields
from robocal.report.sections import Figure, Section, Text
from robocal.report.sweep import Axis, Curve, curves, levels
from robocal.studies.run import StudyOutputs
from robocal.studies.work import pack

__all__ = ["document", "missing_trials", "pictures", "table_of", "written"]


def missing_trials(found: StudyOutputs) -> tuple[tuple[Remark, ...], bool]:
    """What is to be said of trials without a number, and whether every output has one at every point."""
    remarks, whole = [], True
    for name in found.outputs:
        every = found.summary(name)
        gone = [s.lost for s in every]
        none = sum(n == found.study.trials for n in gone)
        if none:
            remarks.append(Remark.of(Code.NO_TRIAL_ENDED, output=name, points=none, total=len(every)))
        if some := [n for n in gone if 0 < n < found.study.trials]:
            most, trials = max(some), found.study.trials
            counts = {"points": len(some), "total": len(every), "most": most, "trials": trials}
            remarks.append(Remark.of(Code.TRIALS_LOST, output=name, **counts))
        whole &= not none
    return tuple(remarks), whole


@record(kw_only=True)
class StudyDocument(Document):
    """What --json says, SI: of every output one row for each point."""

    of: str
    trials: int
    seed: int
    outputs: dict[str, Listing]
    provenance: Origin


def table_of(found: StudyOutputs, name: str) -> Listing:
    """One output at every point, with what was varied."""
    unit, every, points = found.units[name], found.summary(name), found.study.points
    unit = "" if unit == "1" else unit
    parts = {"rms": "rms", "mean": "mean", "scatter": "scatter", "foretold": "theory"}  # columns and fields
    numbers = (Column(k, unit, [getattr(s, f) for s in every], label="" if k == "rms" else k) for k, f in parts.items())
    varied = (Column(n, "", [dict(p.varied)[n] for p in points]) for n, _ in points[0].varied)
    return Listing((*varied, *numbers, Column("lost", "", [s.lost for s in every])))


def document(found: StudyOutputs, command: str) -> StudyDocument:
    """What --json says."""
    study = found.study
    inputs = (InputFile(study.path, study.sha256), *(InputFile(Path(name), digest) for name, digest in study.read))
    return StudyDocument(
        of=study.of, trials=study.trials, seed=study.seed, outputs={name: table_of(found, name) for name in found.outputs},
        **remark_fields(missing_trials(found)[0]), provenance=provenance_of(command, inputs),
    )  # fmt: skip


def written(result: Path) -> Callable[[StudyOutputs], bytes]:
    """How every trial is written into a file of this name. Raises FormatError for another than .npz and .csv."""
    known = {".npz": _npz, ".csv": _csv}
    if result.suffix.lower() not in known:
        raise FormatError(
            "trials are written as .npz or .csv", file=result, key="--output", found=result.suffix or "no suffix", expected=".npz or .csv"
        )  # fmt: skip
    return known[result.suffix.lower()]


def _npz(found: StudyOutputs) -> bytes:
    """`point` (P, T), every output (P, T) in SI, and what was varied (P,) as text."""
    points = found.study.points
    names = [name for name, _ in points[0].varied]
    return pack({f"varied.{n}": np.array([dict(p.varied)[n] for p in points]) for n in names} | found.outputs)


def _csv(found: StudyOutputs) -> bytes:
    names = [name for name, _ in found.study.points[0].varied]
    head = [*names, "trial", *(f"{n} [{u}]" for n, u in found.units.items())]
    rows = (
        [*(v for _, v in p.varied), i, *("" if np.isnan(x) else f"{x:.9g}" for x in row)]
        for k, p in enumerate(found.study.points)
        for i, row in enumerate(np.stack([found.outputs[n][k] for n in found.units], axis=1))
    )
    return csv_text(head, rows).encode("utf-8")


# --- pictures ---------------------------------------------------------------------------------------------------------

SHOWN = {"m": UNITS["mm"], "rad": UNITS["deg"]}
DIGITS = 1e-9  # of the unit that is shown
WANTED = {"coverage": (0.95, "95 %")}  # outputs of which something is wanted, and its name
CROWD = 3  # curves: of more, bars would be one grid
FEW = 3  # values along an axis; lines of equal error take as many of both


@record
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
        scatter = _scatter(found, name) if len(others) <= CROWD else None
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
            each = zip(others, points, theories, strict=True)
            lines = [Curve(", ".join(m), values[at], t, None if scatter is None else scatter[at]) for m, at, t in each]
            said = f"{name} ({of}) against {x.title}." + (
                "" if scatter is None else " Bars: one standard deviation of a trial."
            )
            if any(t is not None for t in theories):
                said += " Dotted: as linear theory foretells; below: by how much what was found is more."
            drawn.append(
                (said, curves(x, lines, f"{name}: {of}" + (f" [{unit}]" if unit else ""), said, name, WANTED.get(name)))
            )
        blocks = (block for said, svg in drawn for block in (Text.of(said), Figure(svg) if svg else None))
        yield Section.of("", *blocks, title=name, key=f"{name}-drawn")


def _scatter(found: StudyOutputs, name: str) -> Array | None:
    """The standard deviation of one trial at every point, as shown; None for what is no amount, such as how many improved."""
    si = found.units[name]
    if si not in SHOWN and name not in WANTED:
        return None
    factor = 1.0 / SHOWN[si].factor if si in SHOWN else 1.0
    return factor * np.array([s.scatter for s in found.summary(name)])


def _values(found: StudyOutputs, name: str) -> tuple[Array, Array, str]:
    """What is drawn of an output at every point, as shown, what is foretold of it, and what it is: theory speaks of the root mean
    square."""
    every, si = found.summary(name), found.units[name]
    factor = 1.0 / SHOWN[si].factor if si in SHOWN else 1.0
    told = np.array([np.nan if s.theory is None else s.theory for s in every])
    foretold = bool(np.isfinite(told).any())
    shown = np.array([s.rms if foretold else s.mean for s in every])
    return factor * shown, factor * told, "rms" if foretold else "mean"
