"""What an identification says: the verdict first, then errors, parameters, what cannot be told, remarks, and where the files are.

`result` is the document of result.json as an object; numbers stand in the units that it names.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from shlex import quote
from typing import Any

from robocal.remarks.code import Code
from robocal.report.compared import comparison, groups, layer, linear
from robocal.report.numbers import instrument_frames
from robocal.report.sections import Block, Cell, Remarks, Section, Style, Table, Text, Written, figure, quiet, table

__all__ = ["errors_table", "identified", "strange", "verdict"]

STYLES: dict[str, Style] = {
    "improved": "good",
    "improved where measured": "doubtful",
    "not_improved": "doubtful",
    "refused": "bad",
}
MOST, TEN = 40, 10
STAGES = (
    ("before", "before", "frames fitted"),
    ("after", "after", "as fitted"),
    ("held_out_before", "held out, before", ""),
    ("held_out", "held out, after", "not used to fit"),
    ("k_fold_before", "every fold, before", ""),
    ("k_fold", "every fold, after", "held out in turn"),
    ("leave_one_out_before", "leave-one-out, before", "frames fitted"),
    ("leave_one_out", "leave-one-out", "one by one"),
    ("constant", "predicting the mean", ""),
)
PROOFS = ("held out, after", "every fold, after", "leave-one-out")


def identified(result: Any, written: Sequence[Path] = (), left_out: Sequence[str] = ()) -> Iterator[Section]:
    """The whole story of one identification."""
    yield _head(result)
    for residuals, title in ((result.residuals, "error"), (result.residuals.angle, "angle")):
        if residuals is not None:
            for made in (errors_table(residuals, title), _folds(residuals)):
                if made is not None:
                    yield Section.of("", made)
    shares = result.prediction.coverage if result.prediction else []
    told = [
        f"of {c.n} held-out measurements ({c.quantity}), {c.whole:.0%} lie in their {c.level:.0%} region as fitted"
        for c in shares
    ]
    told += [p.text for p in (result.working_range, result.scale) if p is not None and p.text]
    if told:
        yield Section.of("", *quiet(*told))
    yield _parameters(result)
    yield from _hidden(result)
    if result.offsets is not None:
        yield Section.of("", *quiet(result.offsets.reason.sentence))
    for part in (
        groups(result.groups_tried),
        layer(result.layer),
        linear(result.linearity),
        comparison(result.comparison),
    ):
        if part:
            yield Section.of("", *part)
    if result.outliers:
        yield strange(result.outliers)
    if result.remarks:
        yield Section.of("Worth knowing", Remarks(tuple(result.remarks)))
    yield _ended(result, written, left_out)


def verdict(status: str, reasons: Sequence[str]) -> Text:
    """The verdict with its reasons."""
    word: Cell = (status.replace("_", " ").upper(), STYLES.get(status, "strong"))
    return Text.of(word, *(["  " + "; ".join(reasons)] if reasons else []))


def _head(result: Any) -> Section:
    """The robot, what was fitted, the verdict, and what to do next where the gain is not proven, each advice once."""
    split, said = result.split, result.verdict
    facts = f"{len(split.fit)} configurations"
    if split.held_out:
        facts += f" fitted, {len(split.held_out)} held out"
    if split.embargoed:
        facts += f", {len(split.embargoed)} left out because they share a place with those"
    status = _status(said)
    advice = [] if status == "improved" else list(dict.fromkeys(r.advice for r in said.remarks if r.advice))
    return Section.of(
        "",
        Text.of((result.robot.name, "strong"), f"   {result.method}; {facts}; {result.fit.reason}"),
        verdict(status, said.reasons),
        *quiet(*advice, indent=2),
    )


def errors_table(residuals: Any, title: str) -> Table | None:
    """Errors at every stage in one unit; None when there are none."""
    rows: list[tuple[Cell, ...]] = []
    styles: list[Style] = []
    for name, label, note in STAGES:
        s = getattr(residuals, name)
        if s is None:
            continue
        words = ", ".join(w for w in (note, "profiled" if s.profiled else "") if w)
        rows.append((label, *_numbers(s), (words, "quiet")))
        styles.append("strong" if label in PROOFS else "quiet" if label == "predicting the mean" else "")
        every = getattr(residuals.all_rows, name, None) if residuals.all_rows is not None else None
        if every is not None and every.n != s.n:
            rows.append(("  with gross rows", *_numbers(every), ("all rows", "quiet")))
            styles.append("quiet")
    if not rows:
        return None
    columns = (f"{title} [{residuals.unit}]", "mean", "rms", "95 %", "max", "n", "")
    return table(*columns, right=(1, 2, 3, 4, 5), rows=rows, styles=styles)


def _numbers(s: Any) -> tuple[str, ...]:
    return (*(figure(v) for v in (s.mean, s.rms, s.p95, s.max)), str(s.n))


def _folds(residuals: Any) -> Table | None:
    """The mean error of every fold; None when there are none."""
    if not residuals.folds:
        return None
    rows: list[tuple[Cell, ...]] = [
        (f.name, figure(f.before), figure(f.after), str(f.n), ("profiled" if f.profiled else "", "quiet"))
        for f in residuals.folds
    ]
    return table(f"held out [{residuals.unit}]", "before", "after", "n", "", right=(1, 2, 3), rows=rows)


def _parameters(result: Any) -> Section:
    """The fitted parameters of the robot; frames of instruments and targets in one line each."""
    owners = instrument_frames(p.name for p in result.parameters)
    fitted = [p for p in result.parameters if p.status in ("identified", "prior")]
    own = [p for p in fitted if p.name.rpartition(".")[0] not in owners]
    rows: list[tuple[Cell, ...]] = []
    for p in own[:MOST]:
        digits = _digits(p.sigma)
        note: Cell = ("" if p.status == "identified" else (_short(p) or "mostly prior"), "strange")
        numbers = (
            _fixed(p.nominal, digits),
            _fixed(p.identified, digits),
            _fixed(p.delta, digits, True),
            _half(p.interval),
        )
        rows.append((p.name, *numbers, p.unit, note))
    columns = ("parameter", "nominal", "identified", "change", "± 95 %", "unit", "")
    blocks: list[Block] = [table(*columns, right=(1, 2, 3, 4), rows=rows)] if own else []
    lines = [f"... and {len(own) - MOST} more in result.json"] if len(own) > MOST else []
    others = sorted({p.name.rpartition(".")[0] for p in fitted} & owners)
    if others:
        lines.append(f"also fitted: where {', '.join(others)} {'is' if len(others) == 1 else 'are'}")
    words = {
        "identified": "identified",
        "prior": "only in combination or by prior",
        "dropped": "not seen",
        "fixed": "fixed",
    }
    counts = {s: sum(p.status == s for p in result.parameters) for s in words}
    lines.append(", ".join(f"{n} {words[s]}" for s, n in counts.items() if n))
    return Section.of("", *blocks, *quiet(*lines))


def _short(p: Any) -> str:
    """The note of a parameter, as short as a table wants it."""
    partners = next((r.numbers["partners"] for r in p.remarks if r.code == Code.ONLY_COMBINATION), ())
    return f"only with {', '.join(partners)}" if partners else str(p.note)


def strange(rows: Sequence[Any]) -> Section:
    """Rows that do not belong to the others, by name: the first ten."""
    cells = []
    for o in rows[:TEN]:
        where = o.group + (f", {o.target}" if o.target else "")
        value = f"{', '.join(figure(v) for v in o.value)} {'/'.join(dict.fromkeys(o.units))}"
        told = "used" if not o.set_aside else "not fitted, counted" if o.counted else "set aside"
        why = "" if o.cause is None else o.cause.sentence
        cells.append(
            (o.configuration, where, o.source, str(o.row or "-"), value, f"{figure(o.distance, 3)} sigma", told, why)
        )
    columns = ("strange row", "instrument", "file", "row", "value", "distance", "", "likely cause")
    more = len(rows) - TEN
    return Section.of(
        "",
        table(*columns, right=(3, 5), rows=cells),
        *quiet(*([f"... and {more} more in result.json"] if more > 0 else [])),
    )


def _hidden(result: Any) -> Iterator[Section]:
    """What the data cannot tell, in words."""
    seen = result.identifiability
    if not seen.combinations and not seen.dropped:
        return
    none = [c.terms[0].name for c in seen.combinations if c.code == Code.NO_EFFECT]
    lines = [c.text for c in seen.combinations if c.code != Code.NO_EFFECT]
    if none:
        lines.append(f"no effect on these measurements: {', '.join(none)}")
    heading = f"What these measurements cannot tell ({seen.rank} of {seen.n_free} free parameters are seen)"
    stay = quiet("They stay at their nominal values.", indent=2)
    yield Section.of(heading, *(Text.of(line, indent=2) for line in lines), *stay)


def _ended(result: Any, written: Sequence[Path], left_out: Sequence[str]) -> Section:
    """The verdict once more, where the files are and what one of them cannot hold, what to do next, and the page as the last
    line: what stands at the end of a long output is what people see."""
    head = verdict(_status(result.verdict), result.verdict.reasons[:1])
    if not written:
        return Section.of(
            "", head, *quiet("Nothing was written; -o DIR keeps the result, the calibrated robot and a report.")
        )
    folder, lost = written[0].parent, None
    if left_out:
        text = (
            f"calibrated.urdf does not hold {', '.join(left_out)}; the folder {folder} does: "
            "give the folder, not the file, to validate, export and simulate."
        )
        lost = Text.of((text, "doubtful"))
    page = next((p for p in written if p.name == "report.html"), None)
    return Section.of(
        "",
        head,
        Written(tuple(written)),
        lost,
        *quiet(*_next(result, folder)),
        None if page is None else Text.of(str(page)),
    )


def _next(result: Any, folder: Path) -> list[str]:
    """The command that comes next, by the verdict; nothing where those verbs do not take the machine (without joints)."""
    if result.verdict.status == "improved":
        if not result.robot.joints:
            return []
        place = quote(str(folder))
        return [f"next: robocal validate {place} OTHER_DATA; robocal compensate {place} TARGETS"]
    read = [str(i.file).removeprefix("catalogue:") for i in result.provenance.inputs[:2]]
    files = " ".join(map(quote, read)) or "ROBOT DATA"
    return [f"next: do what the reasons above say; robocal check {files} says what the files can tell"]


def _status(said: Any) -> str:
    """The status of a verdict, with its region where that is not the whole working range."""
    return f"{said.status} where measured" if said.region == "measured" else str(said.status)


def _half(interval: Sequence[float | None] | None) -> str:
    """Half the width of a 95 % interval."""
    if interval is None or interval[0] is None or interval[1] is None:
        return "-"
    return figure((interval[1] - interval[0]) / 2, 2)


def _digits(sigma: float | None) -> int:
    """Decimals that a sigma justifies: two digits of it."""
    if sigma is None or not math.isfinite(sigma) or sigma <= 0:
        return 4
    return min(max(1 - math.floor(math.log10(sigma)), 0), 9)


def _fixed(value: float | None, digits: int, sign: bool = False) -> str:
    if value is None or not math.isfinite(value):
        return "-"
    return f"{value:{'+' if sign else ''}.{digits}f}"
