"""What a call of a verb gives back in Python: the result, with the same sections that the terminal shows."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from itertools import count
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array
from robocal.errors import ModelError
from robocal.files.plain import plain
from robocal.files.result import Result
from robocal.files.runfolder import obstacle
from robocal.files.writing import write_text
from robocal.fit.estimators import estimator
from robocal.front.cell import cell
from robocal.front.plots import Plot, choose_plot, figures
from robocal.front.result_columns import (
    Covariance,
    ParameterColumns,
    ResidualColumns,
    parameter_columns,
    residual_columns,
)
from robocal.front.spelling import PythonRemark, python_message, python_sections
from robocal.measure.reach import reach
from robocal.quantities import Listing
from robocal.report.page import page
from robocal.report.plain_text import text
from robocal.report.sections import Section, Text, ends
from robocal.report.sections import listing_table as rows_of
from robocal.session.identify_outcome import map_columns, save
from robocal.verbs.outcome import Outcome

__all__ = ["Found", "Identified"]

T = TypeVar("T")

SHOWN = count(1)  # pages that this process drew: each has identifiers of its own
SHORT = 18  # lines of a repr
FIRST = ("errors", "workspace", "directions")  # figures that a cell shows before others


class Found(Generic[T]):
    """What a verb found: `result` in SI, `document` as --json prints it, `trusted` (status 0 of the command line), `remarks`
    (each with `sentence` and `advice`), `text` (the list or file that it makes) and `written` (files)."""

    def __init__(self, path: str, outcome: Outcome[Any]) -> None:
        self._path, self._outcome = path, outcome

    @property
    def _verb(self) -> ModuleType:
        return import_module(f"robocal.verbs.{self._path}")

    @property
    def result(self) -> T:
        """What was found, in SI."""
        found: T = self._outcome.result
        return found

    @property
    def listing(self) -> Listing | None:
        """The list as columns, each with its name, its unit and a value for each row, if the verb makes one."""
        return self._outcome.listing

    @property
    def document(self) -> Mapping[str, Any]:
        """The same for machines, as --json prints it."""
        found: Mapping[str, Any] = plain(self._outcome.document())
        return found

    @property
    def trusted(self) -> bool:
        """Whether the command line would end with status 0 rather than 3."""
        return self._outcome.trusted

    @property
    def remarks(self) -> tuple[PythonRemark, ...]:
        """What is worth knowing, each with `sentence` and `advice`, in the words of Python."""
        return tuple(python_message(said, self._path) for said in self._outcome.remarks)

    @property
    def text(self) -> str | None:
        """The list or file that the verb makes, if it makes one."""
        return self._outcome.text

    @property
    def written(self) -> tuple[Path, ...]:
        """Files that were written."""
        return self._outcome.written

    @property
    def sections(self) -> tuple[Section, ...]:
        """What is to be said: headings, text, tables, remarks."""
        told = tuple(self._verb.sections(self._outcome)) if self.text is None or self.written else ()
        if self.text is not None:
            # What goes beside a list on the terminal has no other place here.
            note = Section.of("", Text.of(self._outcome.note)) if self._outcome.note else None
            told = (*told, *([note] if note else []), *ends(self._outcome.remarks))
        return python_sections(told, self._path)

    @property
    def _page(self) -> tuple[Section, ...]:
        """Everything that a page shows: of a verb that makes a list, the list too."""
        more = getattr(self._verb, "details", None)
        listed = (Section.of("", rows_of(self.listing)),) if self.listing is not None and not self.written else ()
        return (*listed, *self.sections, *(python_sections(more(self._outcome), self._path) if more else ()))

    def summary(self) -> str:
        """Everything that the terminal would show, as text."""
        listed = [self.text.rstrip()] if self.text is not None and not self.written else []
        return "\n\n".join(part for part in (*listed, text(self.sections)) if part)

    @property
    def plots(self) -> tuple[str, ...]:
        """The names of the figures that `plot(name)` gives."""
        return tuple(name for name, _ in figures(self._page))

    def plot(self, name: str | None = None) -> Plot:
        """A figure of the page by its name (`plots` lists them), without a name the first; a notebook shows it, `save` writes it.

        Raises ModelError where there is none."""
        return choose_plot(self._page, name, FIRST)

    def report(self, file: str | os.PathLike[str]) -> Path:
        """Writes the page: everything that was found, with all figures. Raises FileError."""
        return write_text(file, page(f"robocal {self._path.replace('.', ' ')}", self._page, kind="Result"))

    def _repr_html_(self) -> str:
        listed = () if self.listing is None or self.written else (Section.of("", rows_of(self.listing)),)
        raw = self.text if self.listing is None and not self.written else None
        return cell((*listed, *self.sections), self._page, FIRST, raw, f"robocal-{next(SHOWN)}")

    def _repr_markdown_(self) -> str:
        return f"```text\n{self!r}\n```"

    def __repr__(self) -> str:
        listed = self.text is not None and not self.written
        lines = [line for line in (self.text or "" if listed else self.summary()).splitlines() if line.strip()]
        more = "text has all of it" if listed else "summary() and report(file) say more"
        return "\n".join(lines[:SHORT] + ([f"... {more}"] if len(lines) > SHORT else []))


class Identified(Found[Result]):
    """An identification: a corrected model with its evidence."""

    @property
    def result(self) -> Result:
        """The whole result, as in result.json: mm and deg, parameters in the units of the robot file."""
        found: Result = self._outcome.result.result
        return found

    @property
    def verdict(self) -> str:
        """improved, located, not_improved or refused."""
        return str(self.result.verdict.status)

    @property
    def improved(self) -> bool:
        """Whether the corrected model is better in the whole working range: what status 0 of the command line says."""
        return self.trusted

    @property
    def values(self) -> dict[str, float]:
        """The corrected model: every parameter of the robot by name, in m and rad."""
        return {p.name: p.value for p in self._outcome.result.identification.corrected.table.rows}

    def pose(self, joints: ArrayLike) -> Array:
        """Tool poses of the corrected arm in base coordinates, (m, 4, 4) in m, at joint values (m, n) in rad or m."""
        found = self._outcome.result.identification
        return reach(found.corrected, np.atleast_2d(np.asarray(joints, float)), (), found.conditions)[0]

    def table(self) -> list[dict[str, Any]]:
        """One row per parameter: name, unit, nominal, identified, delta, sigma, interval, status and what is to be known."""
        shown = ("name", "unit", "nominal", "identified", "delta", "sigma", "interval", "status", "note")
        return [{k: getattr(p, k) for k in shown} for p in self.result.parameters]

    @property
    def parameters(self) -> ParameterColumns:
        """The same as columns, which any data frame takes: `pandas.DataFrame(found.parameters)`."""
        return parameter_columns(self.result.parameters)

    @property
    def residuals(self) -> ResidualColumns:
        """What is left of every measurement before and after, as columns (mm, deg, px): `pandas.DataFrame(found.residuals)`."""
        return residual_columns(self._outcome.result.residuals)

    @property
    def covariance(self) -> Covariance:
        """Names, units and covariance matrix of the parameters in SI, as covariance.json of a run folder.

        Raises ModelError for a method that knows none."""
        found = self._outcome.result.identification
        if estimator(found.options.method).blind:
            message = "this method has no covariance"
            raise ModelError(message, argument="method", found=found.options.method, expected='method="lm" or "ekf"')
        table, total = found.table, found.total
        units = tuple(table[n].unit if n in table else "1" for n in total.names)
        return Covariance(tuple(total.names), units, np.array(total.covariance))

    def save(self, folder: str | os.PathLike[str], *, force: bool = False) -> tuple[Path, ...]:
        """Writes the run folder that the other verbs read; one that holds anything but an untouched run only with `force`.
        Raises FileError."""
        place = Path(folder)
        if not force and (there := obstacle(place)):
            raise there
        return save(self._outcome.result, place).written

    def report(self, file: str | os.PathLike[str]) -> Path:
        """Writes the page alone, as report.html of a run folder: everything that was found, with all figures. Raises FileError."""
        from robocal.report.identified import report

        made = self._outcome.result
        folder = made.written[0].parent if made.written else None
        return write_text(file, report(made.result, made.residuals, map_columns(made.identification), folder))
