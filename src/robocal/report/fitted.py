"""How the fit came about, for pages: its convergence, correlations of what was found, noise of the sensors, and its recipe."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

from robocal.diagnose.limits import PRIOR_SIGMA
from robocal.estimate.choosing.choice import together
from robocal.report import matrix, pictures
from robocal.report.numbers import ranges
from robocal.report.passes import over_measurements, over_passes
from robocal.report.sections import Block, Cell, Detail, Facts, Figure, Folded, Pair, Section, Text, figure, table

__all__ = ["fit_sections", "recipe"]


def fit_sections(result: Any) -> Iterator[Section]:
    """Convergence, correlations, sensors."""
    fit, found = result.fit, result.correlation
    yield Section.of(
        "", Detail(lambda: _convergence(result)), title="Convergence", key="convergence", brief=(), folded=True
    )
    yield Section.of(
        "",
        Detail(lambda: _correlation(found)),
        title="Correlation of parameters",
        key="correlation",
        brief=(),
        folded=True,
    )
    yield Section.of(
        "", Detail(lambda: _sensors(fit)), title="Sensors and their noise", key="groups", brief=(), folded=True
    )
    if any(g.farthest for g in fit.agreement):
        yield Section.of(
            "",
            Detail(lambda: _agreement(fit.agreement)),
            title="What sensors say of each other",
            key="agreement",
            brief=(),
            folded=True,
        )
    if fit.opened:
        yield Section.of(
            "",
            Detail(lambda: _opened(fit.opened)),
            title="Which groups the data open",
            key="opened",
            brief=(),
            folded=True,
        )


def _convergence(result: Any) -> Iterator[Block | None]:
    fit = result.fit
    reason = f"; {fit.reason}" if fit.reason else ""
    yield Text.of(f"{fit.iterations} iteration{'' if fit.iterations == 1 else 's'}{reason}.")
    costs = [c for c in fit.history if c is not None]
    if costs:
        yield Text.of((f"Last values of the cost: {', '.join(figure(c, 7) for c in costs[-5:])}.", "quiet"))
    caption = (
        "The cost is half the sum of squared residuals, each divided by its sigma. A line that flattens has converged; one that "
        "still falls at the end has not."
    )
    shown = [Figure(s, caption) for s in [pictures.convergence(costs)] if s]
    if fit.passes is not None:
        both = zip(fit.passes.greatest_error, fit.passes.after, strict=False)
        known = [(error, count) for error, count in both if math.isfinite(error)]
        errors, after = [e for e, _ in known], [n for _, n in known]
        svg = pictures.convergence(errors, after, "greatest error", fit.passes.unit, "greatest-error")
        shown += [Figure(svg, "The greatest error of any measurement that was fitted.")] if svg else []
    yield Pair(tuple(shown)) if len(shown) > 1 else shown[0] if shown else None
    yield over_passes(result)
    yield over_measurements(result)


def _correlation(found: Any) -> Iterator[Block]:
    """Which parameters can be traded for one another."""
    svg, left_out = matrix.correlation(found.names, found.matrix)
    if not svg:
        yield Text.of(("There are no correlations: fewer than two parameters were identified.", "quiet"))
        return
    yield Text.of(
        "Two parameters with a correlation near ±1 can be traded for one another with hardly any effect on the errors: their sum "
        "is known better than each alone."
    )
    less = f" The {left_out} least entangled parameters are left out." if left_out else ""
    caption = "Area shows the size of a correlation; filled squares are positive, hollow ones negative. Columns are named on the diagonal."
    yield Figure(svg, caption + less)
    pairs = [(a, b, f"{v:+.3f}") for a, b, v in matrix.strongest(found.names, found.matrix)]
    if pairs:
        yield table("parameter", "and", "correlation", right=(2,), rows=pairs, title="Strongest pairs")
    else:
        yield Text.of("No pair exceeds ±0.7.")


def _sensors(fit: Any) -> Iterator[Block]:
    """What each sensor's residuals say of its noise."""
    if fit.groups:
        rows = [
            (
                g.name, g.kind, str(g.n), figure(g.dof), figure(g.chi2), _ratio(g.chi2, g.dof), figure(g.rms, 3),
                figure(g.sigma, 3), g.unit, g.sigma_source or "-", chi2_word(g.chi2, g.dof, g.sigma_source),
            )
            for g in fit.groups
        ]  # fmt: skip
        columns = ("sensor", "kind", "values", "dof", "χ²", "χ²/dof", "rms", "σ", "unit", "σ from", "in words")
        caption = "χ²/dof compares what is left with the sensor's noise: near 1 is what the noise alone would leave."
        yield table(*columns, right=(2, 3, 4, 5, 6, 7), rows=rows, caption=caption)
    if fit.chi2 is not None:
        word = chi2_word(fit.chi2, fit.dof, fit.sigma_source)
        ratio = f" with {figure(fit.dof)} degrees of freedom, χ²/dof = {_ratio(fit.chi2, fit.dof)}" if fit.dof else ""
        yield Text.of(f"All together: χ² = {figure(fit.chi2)}{ratio}{f': {word}' if word else ''}.")
    yield Text.of(
        "σ is ", ("stated", "term"), " (given with the data), from ", ("repeats", "term"),
        " (the spread of repeated measurements) or ", ("estimated", "term"),
        " (from the residuals of this fit, which then cannot test themselves).",
    )  # fmt: skip


def _agreement(found: Any) -> Iterator[Block]:
    """What each group of sensors, and what was stated, says of the others."""
    rows = [
        (
            g.name, g.kind, str(g.n), figure(g.dof, 3), figure(g.chi2, 3), _ratio(g.chi2, g.dof), figure(g.length, 3), g.farthest or "-",
            figure(g.z, 2),
        )
        for g in found
    ]  # fmt: skip
    columns = ("group", "kind", "values", "dof", "χ²", "χ²/dof", "rms, mm", "farthest", "σ")
    caption = (
        "Sensors: what is left against their noise; pixels also in mm at the points that they show. What was stated: how far the others "
        "move it, against what they may. χ²/dof is near 1 where all agree."
    )
    yield table(*columns, right=(2, 3, 4, 5, 6, 8), rows=rows, caption=caption)
    worst = max((g for g in found if g.z is not None), key=lambda g: g.z)
    if worst.z > PRIOR_SIGMA:
        yield Text.of(
            f"The others contradict what was stated of {worst.name}: {worst.farthest} is {figure(worst.z, 2)} σ off."
        )
    else:
        yield Text.of("The others contradict nothing that was stated.")


ASKED = {
    "": "nothing of it was free",
    "path": "no path was measured: nothing would show it",
    "asked": "never free; along this path nothing asks for one",
    "late": "never free; the readings ask for one",
}

OBSTACLES = {"own": "only if one knew others of this group too", "noise": "these data say too little"}


def _opened(found: Any) -> Iterator[Block]:
    """Groups of numbers in their order, each with what is told, and what stands in the way of the rest."""
    rows = [(g.name, str(g.n), str(g.new), g.state, _names(g.identified), _obstacles(g)) for g in found]
    caption = (
        "In the order in which groups are opened. New: directions that the data see above the noise, beyond the groups before. "
        "Identified: narrowed to half of what was expected, all others unknown too. The rest stays within what was stated."
    )
    yield table("group", "free", "new", "state", "identified", "the rest", right=(1, 2), rows=rows, caption=caption)


def _names(names: Any) -> str:
    shown, more = together([(n, 1.0) for n in names])
    return ", ".join(shown) + (f" and {more} more" if more else "") or "-"


def _obstacles(group: Any) -> str:
    """What stands in the way of the names that are not told."""
    if group.state == "fixed":
        return ASKED[group.asked]
    told = (
        f"{_names(o.names)}: " + (f"if one knew {' and '.join(o.rivals)}" if o.rivals else OBSTACLES[o.why])
        for o in group.rest
    )
    return "; ".join(told) or "-"


def _ratio(chi2: float | None, dof: float | None) -> str:
    return figure(chi2 / dof, 3) if chi2 is not None and dof else "-"


def chi2_word(chi2: float | None, dof: float | None, source: str) -> str:
    """What chi2 / dof says about the stated noise, from a 95 % interval (Wilson and Hilferty's cube root)."""
    if chi2 is None or dof is None or dof <= 0:
        return ""
    if "estimated" in source:
        return "sigma was taken from these residuals, so this is 1 by construction and tests nothing"
    spread = math.sqrt(2 / (9 * dof))
    low, high = ((1 - 2 / (9 * dof) + z * spread) ** 3 for z in (-1.96, 1.96))
    ratio = chi2 / dof
    if ratio > high:
        return "more than the stated noise explains; for the sigmas as fitted, noise is added until this is one"
    if ratio < low:
        return "less than the stated noise; that sigma looks too large"
    return "as the stated noise predicts"


def recipe(result: Any) -> Section:
    """What makes the same numbers again."""
    return Section.of("", Detail(lambda: _recipe(result)), title="Recipe", key="recipe", brief=(), folded=True)


def _recipe(result: Any) -> Iterator[Block]:
    made, split = result.provenance, result.split
    if made.command or made.inputs:
        yield Text.of("With these files, options and this version, the same numbers come out again.")
    options = sorted((str(k), _option(v)) for k, v in made.options.items())
    known = (
        ("Command", made.command),
        ("robocal version", f"{made.version} (result format {result.robocal})"),
        ("Seed", "" if made.seed is None else str(made.seed)),
        ("Started", made.started),
        ("Duration", "" if made.seconds is None else f"{figure(made.seconds, 2)} s"),
        *options,
    )
    yield Facts(tuple((name, value) for name, value in known if value))
    if made.inputs:
        rows: list[tuple[Cell, ...]] = [(i.file, (i.sha256, "code")) for i in made.inputs]
        yield table("file", "SHA-256", rows=rows, title="Inputs")
    lists = (("Fit", split.fit), ("Held out", split.held_out), ("Left out", split.embargoed))
    shown = Facts(tuple((name, ranges(ids)) for name, ids in lists if ids))
    if shown.pairs:
        yield Folded(f"Configurations of the fit ({len(split.fit)}) and held out ({len(split.held_out)})", (shown,))


def _option(value: object) -> str:
    if isinstance(value, str):
        return value
    return f"{value:.6g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False, default=str)
