"""The parameters that were fitted, and what the measurements cannot tell."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from robocal.remarks.code import Code
from robocal.report import sections as blocks
from robocal.report.brief import CHANGES, changes
from robocal.report.numbers import instrument_frames
from robocal.report.sections import Block, Cell, Detail, Noted, Section, Style, Table, Text, figure, quiet, table
from robocal.report.svg import num

__all__ = ["change_text", "hidden", "largest_changes", "parameters"]

MOST = 40  # rows on a terminal
PARTNERS = 2  # that a table for everyone names
UNSHOWN = (6, 7, 8, 10)  # columns for specialists: sigmas, the share of the data, the status
CHANGED = (2, 3, 4, 5, 6, 7, 8)  # columns of what was fitted
FITTED = ("identified", "prior")
COUNTED = {
    "identified": "identified",
    "prior": "only in combination or by prior",
    "dropped": "not seen",
    "fixed": "fixed",
}
SIGNS = {"identified": "●", "prior": "◐", "dropped": "○", "fixed": "▪"}
INDICES = {
    "O1": "size of the region of likely parameters: geometric mean of the singular values",
    "O2": "smallest over largest singular value",
    "O3": "smallest singular value: how well the worst combination is seen",
    "O4": "O3 times O2: noise amplification",
    "O5": "reciprocal of the summed reciprocal singular values",
}
SIGMA: tuple[Cell, ...] = (
    ("σ", "term"), " is one standard deviation of the identified value: about 95 % of such values lie within 2σ of the truth. ",
    ("Instrument", "term"), " counts only the stated noise of the sensors; ",
    ("as fitted", "term"), " also what the model leaves unexplained (noise is added to the stated one until χ²/dof is one) and "
    "what hidden, dropped partners may be off by; it is the one to use. Digits beyond σ are not shown. In the pictures of the "
    "changes, on one scale for each unit, the band behind is two standard deviations of what was ", ("expected", "term"),
    " before anything was measured, as far as there is room.",
)  # fmt: skip
STATUS: tuple[Cell, ...] = (
    (f"{SIGNS['identified']} identified", "term"), ": known from the measurements. ",
    (f"{SIGNS['prior']} prior", "term"), ": the measurements say little, so the stated prior holds it. ",
    (f"{SIGNS['dropped']} dropped", "term"), ": was free, but the measurements cannot tell it; it stays nominal (listed below). ",
    (f"{SIGNS['fixed']} fixed", "term"), ": was not to be identified. ",
    ("From data", "term"), ": the part of what is known about it that the measurements brought; the rest is prior.",
)  # fmt: skip


def largest_changes(result: Any, most: int) -> list[Block]:
    """The parameters that moved most, and how many there are besides."""
    shown, moved = changes(result, most), len(changes(result, len(result.parameters)))
    if not shown:
        return list(quiet("no parameter of the robot changed by more than two standard deviations"))
    count = f"the {len(shown)} largest of {moved}" if moved > len(shown) else str(moved)
    told = quiet(f"{count} changes above two standard deviations")
    return [replace(_table(shown, 0, None, UNSHOWN), terse=()), *told]


def parameters(result: Any) -> Section:
    """The fitted parameters of the robot; a terminal says frames of instruments and targets in one line."""
    owners = instrument_frames(p.name for p in result.parameters)
    by_status = {s: [p for p in result.parameters if p.status == s] for s in COUNTED}
    fitted = [p for p in result.parameters if p.status in FITTED]
    own = [p for p in fitted if p.name.rpartition(".")[0] not in owners]
    frames, fixed = [p for p in fitted if p.name.rpartition(".")[0] in owners], by_status["fixed"]
    lines = [f"... and {len(own) - MOST} more in result.json"] if len(own) > MOST else []
    others = sorted({p.name.rpartition(".")[0] for p in frames})
    if others:
        lines.append(f"also fitted: where {', '.join(others)} {'is' if len(others) == 1 else 'are'}")
    lines.append(", ".join(f"{len(those)} {COUNTED[s]}" for s, those in by_status.items() if those))
    refused = result.verdict.status == "refused"
    free = [*own, *frames]
    warning = "Do not use these values: the verdict is refused; they are listed for diagnosis only."
    brief = () if refused or result.verdict.status == "located" else largest_changes(result, CHANGES)
    return Section.of(
        "", Text.of((warning, "bad")) if refused else None, Detail(lambda: [Text.of(*SIGMA)]),
        _table(free, len(frames), min(len(own), MOST)) if free else None,
        blocks.Folded(f"{len(fixed)} fixed", (_table(fixed, 0, None, CHANGED),)) if fixed else None,
        *quiet(*lines), Detail(lambda: [Text.of(*STATUS)]), title="Parameters", key="parameters", brief=brief, folded=True,
    )  # fmt: skip


def _table(found: Sequence[Any], frames: int, brief: int | None, less: Sequence[int] = ()) -> Table:
    """Those of the robot, `frames` of instruments, and what was not seen, without the columns in `less`."""
    reach = _reaches(found, frames)
    cells: list[tuple[Cell, ...]] = []
    for p in found:
        digits, moved = _digits(p.sigma or p.sigma_instrument), p.status in FITTED
        note = "" if p.status == "identified" else _short(p)
        word = "mostly prior" if p.status == "prior" else p.status
        shown: Cell = Noted(f"{SIGNS[p.status]}\u00a0{p.status}", note)
        brief_note: Cell = ("" if p.status == "identified" else _short(p, PARTNERS if less else 0) or word, "strange")
        share = _share(p)
        bar = Noted("", svg=_bar(p, reach[p.name])) if p.name in reach else ""
        cells.append(
            (
                p.name, _decimals(p.nominal, digits), _decimals(p.identified, digits) if moved else "-",
                _decimals(p.delta, digits, True) if moved else "-", bar, _half(p.interval), figure(p.sigma, 2),
                figure(p.sigma_instrument, 2), share, p.unit, shown, brief_note,
            )
        )  # fmt: skip
    columns = (
        "parameter", "nominal", "identified", "change", "change ± 2σ", "± 95 %", "σ as fitted", "σ instrument", "from data",
        "unit", "status", "",
    )  # fmt: skip
    right, detail, terse = (1, 2, 3, 5, 6, 7, 8), (4, 6, 7, 8, 10), (len(columns) - 1,)
    styles: list[Style] = ["" if p.status in FITTED else "quiet" for p in found]
    every = table(*columns, right=right, rows=cells, styles=styles, detail=detail, terse=terse, brief=brief)
    return every.without(
        [i for i in range(len(columns)) if i in less or (i in (6, 7, 8) and all(row[i] in ("", "-") for row in cells))]
    )


def _reaches(found: Sequence[Any], frames: int) -> dict[str, float]:
    """How far the scale of a parameter's bar goes: one scale for each unit, of the robot and of instruments apart. A tracker
    stands metres away from where nobody said it stands; beside it every joint would be a dot on zero."""
    fitted = [p for p in found if p.status in FITTED and p.delta is not None]
    scale = {p.name: (p.unit, i < len(fitted) - frames) for i, p in enumerate(fitted)}
    reach: dict[tuple[str, bool], float] = {}
    for p in fitted:
        reach[scale[p.name]] = max(reach.get(scale[p.name], 0.0), abs(p.delta) + 2 * (p.sigma or 0.0))
    return {name: reach[key] for name, key in scale.items() if reach[key] > 0}


def _bar(p: Any, reach: float) -> str:
    """A whisker of two sigma and a dot at the change, in a field 96 wide with zero in the middle, before the band of what was
    expected."""
    at, arm = 48 + 44 * p.delta / reach, 44 * 2 * (p.sigma or 0.0) / reach
    band = min(44 * 2 * (p.expected or 0.0) / reach, 48.0)
    behind = f'<path class="expected" d="M{num(48 - band)} 3h{num(2 * band)}v10h{num(-2 * band)}z"/>' if band else ""
    return (
        f'<svg class="whisker" viewBox="0 0 96 16" aria-hidden="true">{behind}<path class="mid" d="M48 1v14"/>'
        f'<path class="curve" d="M{num(at - arm)} 8H{num(at + arm)}"/><circle class="mark after" cx="{num(at)}" cy="8" r="3"/></svg>'
    )


def _short(p: Any, most: int = 0) -> str:
    """The note of a parameter, as short as a table wants it, with the `most` first partners or all."""
    partners = list(next((r.numbers["partners"] for r in p.remarks if r.code == Code.ONLY_COMBINATION), ()))
    if len(partners) > most > 0:
        partners[most:] = [f"{len(partners) - most} more"]
    return f"only with {', '.join(partners)}" if partners else str(p.note)


def hidden(result: Any) -> Section:
    """What the data cannot tell, in words, and how well the rest is seen."""
    seen = result.identifiability
    alone = [c for c in seen.combinations if c.code == Code.NO_EFFECT and c.terms]
    lines = [(c.text, _sum(c)) for c in seen.combinations if c not in alone]
    if alone:
        lines.append((f"no effect on these measurements: {', '.join(c.terms[0].name for c in alone)}", ""))
    title = "What these measurements cannot tell"
    heading = f"{title} ({seen.rank} of {seen.n_free} free parameters are seen)"
    words = "They keep their nominal values; those of an instrument, what the nominal robot gives it."
    stay = quiet(words, indent=2) if lines else ()
    shown = heading if seen.combinations or seen.dropped else ""
    detail = Detail(lambda: _observability(result))
    told = table("what cannot be told", "as a sum", rows=lines, detail=(1,)) if lines else None
    return Section.of(shown, told, *stay, detail, title=title, key="identifiability", brief=(), folded=True)


def _sum(combination: Any) -> str:
    """A combination of several parameters as the sum of them that has no effect."""
    if len(combination.terms) < 2:
        return ""
    told = (f"{figure(t.coefficient, 3)} × {t.name}" for t in combination.terms if t.coefficient is not None)
    return ", ".join(told)


def _dropped(result: Any) -> Table:
    """The parameters that stay nominal, with what the data know of them."""
    lost = [p for p in result.parameters if p.status == "dropped"]
    rows = [(p.name, _decimals(p.nominal, None), p.unit, _share(p)) for p in lost]
    return table(
        "parameter", "nominal", "unit", "from data", right=(1, 3), rows=rows, title="Parameters that stay nominal"
    )


def _share(p: Any) -> str:
    return "" if p.data_share is None else f"{100 * min(max(p.data_share, 0), 1):.0f} %"


def _observability(result: Any) -> Iterator[Block]:
    """How many combinations are seen, how well, and what would part the others."""
    seen = result.identifiability
    less = seen.n_free - seen.rank
    words = f"so {less} cannot be told apart from the others" if less else "all that was free"
    yield Text.of(
        f"{seen.n_free} parameters were free, and the measurements see {seen.rank} independent combinations of them, {words}. (The ",
        ("rank", "term"), " counts a combination when its effect stands out of the noise.)",
    )  # fmt: skip
    if seen.dropped:
        yield Text.of(
            ("Dropped", "term"),
            " parameters: the corrected model describes these measurements just as well without them, since another parameter has "
            "the same effect and takes over their share, or their effect drowns in the noise.",
        )  # fmt: skip
        yield _dropped(result)
    else:
        yield Text.of("Nothing was dropped: every free parameter was kept.")
    if any(len(c.terms) > 1 for c in seen.combinations):
        yield Text.of(
            "Such a ", ("combination", "term"),
            " says what hides a parameter: only the sum of these effects can be seen, not each of them. Measuring something else "
            "(orientation, another target, another instrument) or fixing one of them from a drawing separates them.",
        )  # fmt: skip
    if seen.condition is not None:
        yield Text.of(
            f"Condition number of the fit: {figure(seen.condition, 3)}. ",
            ("The ratio of the best to the worst seen combination; 1 would be ideal.", "quiet"),
        )
    values = {k: getattr(seen.observability, k) for k in INDICES}
    known = [(k, figure(v, 3), INDICES[k]) for k, v in values.items() if v is not None]
    if known:
        caption = "Larger is better; useful to compare sets of poses for one robot, not robots with one another."
        shown = table("index", "value", "meaning", right=(1,), rows=known, caption=caption)
        yield blocks.Folded("Observability indices", (shown,))


def change_text(p: Any) -> str:
    """How far a parameter moved, with half its 95 % interval and its unit."""
    digits = _digits(p.sigma or p.sigma_instrument)
    return f"{_decimals(p.delta, digits, True)} ± {_half(p.interval)} {p.unit}"


def _half(interval: Sequence[float | None] | None) -> str:
    """Half the width of a 95 % interval."""
    low, high = interval or (None, None)
    return "-" if low is None or high is None else figure((high - low) / 2, 2)


def _digits(sigma: float | None) -> int | None:
    """Decimals that a sigma justifies: two digits of it; None without one."""
    if sigma is None or not math.isfinite(sigma) or sigma <= 0:
        return None
    return min(max(1 - math.floor(math.log10(sigma)), 0), 12)


def _decimals(value: float | None, digits: int | None, sign: bool = False) -> str:
    """A number with so many decimals; as it was written where nothing says how many."""
    if value is None or not math.isfinite(value):
        return "-"
    if digits is None:
        return f"{value + 0.0:{'+' if sign and value else ''}.7g}"
    text = f"{value:{'+' if sign else ''}.{digits}f}"
    return text if float(text) else text.lstrip("+-")
