"""An identification on the terminal: the verdict first, then errors, parameters, what cannot be told, warnings, and
where the files are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from robocal.cli import show_beyond
from robocal.cli.show_beside import comparison, linear
from robocal.cli.tables import PlainTable
from robocal.cli.terminal import Terminal
from robocal.remarks.code import Code
from robocal.remarks.remark import Said

if TYPE_CHECKING:
    from robocal.jobs.outcome import Outcome

__all__ = [
    "errors_table",
    "figure",
    "indented",
    "show_outcome",
    "show_paths",
    "show_warnings",
    "strange",
    "table",
    "verdict_line",
]

COLOURS = {
    "improved": "bold green",
    "improved where measured": "bold yellow",
    "not_improved": "bold yellow",
    "refused": "bold red",
}
MOST = 40
TEN = 10
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


def figure(value: float | None, digits: int = 4) -> str:
    """A number as people read it: significant digits, no exponent where it can be helped."""
    if value is None or not math.isfinite(value):
        return "-"
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if size < -6 or size > 6:
        return f"{value:.{digits - 1}e}"
    return f"{value:.{max(digits - 1 - size, 0)}f}"


def table(*columns: str, right: Sequence[int] = (), title: str = "") -> Table:
    """A plain table: a rule under the header and nothing else; columns in `right` hold numbers."""
    return PlainTable(*columns, right=right, title=title)


def indented(*lines: str, style: str = "", by: int = 2) -> list[Any]:
    """Lines whose continuations are indented too."""
    from rich.padding import Padding

    return [Padding(Text(line, style=style), (0, 0, 0, by)) for line in lines]


def verdict_line(status: str, reasons: Sequence[str]) -> Text:
    """The verdict with its reasons."""
    text = Text()
    text.append(status.replace("_", " ").upper(), style=COLOURS.get(status, "bold"))
    if reasons:
        text.append("  " + "; ".join(reasons))
    return text


def advised(verdict: Any) -> list[Any]:
    """What to do next where the gain is not proven, each advice once."""
    if verdict.status == "improved" and verdict.region != "measured":
        return []
    return indented(*dict.fromkeys(r.advice for r in verdict.remarks if r.advice), style="dim")


def qualified(verdict: Any) -> str:
    """The status of a verdict, with its region where that is not the whole working range."""
    return f"{verdict.status} where measured" if verdict.region == "measured" else str(verdict.status)


def errors_table(residuals: Any, title: str) -> Table | None:
    """Errors at every stage in one unit; None when there are none."""
    rows = [
        (name, label, getattr(residuals, name), note)
        for name, label, note in STAGES
        if getattr(residuals, name) is not None
    ]
    if not rows:
        return None
    made = table(f"{title} [{residuals.unit}]", "mean", "rms", "95 %", "max", "n", "", right=(1, 2, 3, 4, 5))
    for name, label, s, note in rows:
        style = "bold" if label in PROOFS else "dim" if label == "predicting the mean" else ""
        words = ", ".join(w for w in (note, "profiled" if s.profiled else "") if w)
        made.add_row(
            label,
            figure(s.mean),
            figure(s.rms),
            figure(s.p95),
            figure(s.max),
            str(s.n),
            Text(words, style="dim"),
            style=style,
        )
        every = getattr(residuals.all_rows, name, None) if residuals.all_rows is not None else None
        if every is not None and every.n != s.n:
            numbers = (figure(v) for v in (every.mean, every.rms, every.p95, every.max))
            made.add_row("  with gross rows", *numbers, str(every.n), Text("all rows", style="dim"), style="dim")
    return made


def folds_table(residuals: Any) -> Table | None:
    """The mean error of every fold; None when there are none."""
    if not residuals.folds:
        return None
    made = table(f"held out [{residuals.unit}]", "before", "after", "n", "", right=(1, 2, 3))
    for f in residuals.folds:
        words = Text("profiled" if f.profiled else "", style="dim")
        made.add_row(f.name, figure(f.before), figure(f.after), str(f.n), words)
    return made


def show_outcome(terminal: Terminal, outcome: Outcome) -> None:
    """The whole story of one identification."""
    if terminal.json:
        for remark in outcome.result.remarks:
            # A prediction is no warning; it is in the document.
            if remark.code != Code.ELSEWHERE:
                terminal.warn(remark)
        return
    result = outcome.result
    split = result.split
    facts = (
        f"{len(split.fit)} configurations fitted, {len(split.held_out)} held out"
        if split.held_out
        else f"{len(split.fit)} configurations"
    )
    if split.embargoed:
        facts += f", {len(split.embargoed)} left out because they share a place with those"
    terminal.show(Text.assemble((result.robot.name, "bold"), f"   {result.method}; {facts}; {result.fit.reason}"))
    terminal.show(verdict_line(qualified(result.verdict), result.verdict.reasons), *advised(result.verdict), Text(""))
    for residuals, title in ((result.residuals, "error"), (result.residuals.angle, "angle")):
        made = errors_table(residuals, title) if residuals is not None else None
        if made is not None:
            terminal.show(made, Text(""))
        if residuals is not None and (folds := folds_table(residuals)) is not None:
            terminal.show(folds, Text(""))
    shares = result.prediction.coverage if result.prediction else []
    for c in shares:
        words = (
            f"of {c.n} held-out measurements ({c.quantity}), {c.whole:.0%} lie in their {c.level:.0%} region as fitted"
        )
        terminal.show(Text(words, style="dim"))
    parts = (result.working_range, result.scale)
    told = [Text(p.text, style="dim") for p in parts if p is not None and p.text]
    terminal.show(*told, *([Text("")] if shares or told else []), *parameters(result), *hidden(result))
    if result.offsets is not None:
        terminal.show(Text(result.offsets.reason.sentence, style="dim"), Text(""))
    terminal.show(*show_beyond.groups(result.groups_tried, figure, table), *show_beyond.layer(result.layer, figure))
    terminal.show(*linear(result.linearity, figure), *comparison(result.comparison, figure, table))
    terminal.show(*strange(result.outliers))
    show_warnings(terminal, result.remarks)
    show_paths(terminal, outcome.written)
    if outcome.left_out:
        names = ", ".join(outcome.left_out)
        text = (
            f"calibrated.urdf does not hold {names}; the folder {outcome.written[0].parent} does: "
            "give the folder, not the file, to validate, export and simulate."
        )
        terminal.show(Text(text, style="bold yellow"))
    if not outcome.written:
        terminal.show(
            Text("Nothing was written; -o DIR keeps the result, the calibrated robot and a report.", style="dim")
        )


def parameters(result: Any) -> list[Any]:
    """The fitted parameters of the robot; frames of instruments and targets in one line each."""
    owners = _frames_of(result)
    fitted = [p for p in result.parameters if p.status in ("identified", "prior")]
    own = [p for p in fitted if p.name.rpartition(".")[0] not in owners]
    counts = {s: sum(p.status == s for p in result.parameters) for s in ("identified", "prior", "dropped", "fixed")}
    made = table("parameter", "nominal", "identified", "change", "± 95 %", "unit", "", right=(1, 2, 3, 4))
    for p in own[:MOST]:
        digits = _digits(p.sigma)
        note = "" if p.status == "identified" else (_short(p) or "mostly prior")
        made.add_row(
            p.name, _fixed(p.nominal, digits), _fixed(p.identified, digits), _fixed(p.delta, digits, True), _half(p.interval), p.unit,
            Text(note, style="yellow"),
        )  # fmt: skip
    out: list[Any] = [made] if own else []
    if len(own) > MOST:
        out.append(Text(f"... and {len(own) - MOST} more in result.json", style="dim"))
    others = sorted({p.name.rpartition(".")[0] for p in fitted} & owners)
    if others:
        out.append(Text(f"also fitted: where {', '.join(others)} {'is' if len(others) == 1 else 'are'}", style="dim"))
    words = {
        "identified": "identified",
        "prior": "only in combination or by prior",
        "dropped": "not seen",
        "fixed": "fixed",
    }
    out += [Text(", ".join(f"{n} {words[s]}" for s, n in counts.items() if n), style="dim"), Text("")]
    return out


def _short(p: Any) -> str:
    """The note of a parameter, as short as a table wants it."""
    partners = next((r.numbers["partners"] for r in p.remarks if r.code == Code.ONLY_COMBINATION), ())
    return f"only with {', '.join(partners)}" if partners else str(p.note)


def strange(rows: Sequence[Any]) -> list[Any]:
    """Rows that do not belong to the others, by name: the first ten."""
    if not rows:
        return []
    made = table("strange row", "instrument", "file", "row", "value", "distance", "", "likely cause", right=(3, 5))
    for o in rows[:TEN]:
        where = o.group + (f", {o.target}" if o.target else "")
        value = f"{', '.join(figure(v) for v in o.value)} {'/'.join(dict.fromkeys(o.units))}"
        told = "used" if not o.set_aside else "not fitted, counted" if o.counted else "set aside"
        why = "" if o.cause is None else o.cause.sentence
        made.add_row(
            o.configuration, where, o.source, str(o.row or "-"), value, f"{figure(o.distance, 3)} sigma", told, why
        )
    more = len(rows) - TEN
    return [made, *([Text(f"... and {more} more in result.json", style="dim")] if more > 0 else []), Text("")]


def _frames_of(result: Any) -> set[str]:
    """Owners of frames that belong to data files: six parameters that no joint of the robot has."""
    robot = {"base", "tool", "home"}
    by_owner: dict[str, set[str]] = {}
    for p in result.parameters:
        owner, _, symbol = p.name.rpartition(".")
        by_owner.setdefault(owner, set()).add(symbol)
    frame = {"x", "y", "z", "rx", "ry", "rz"}
    return {o for o, symbols in by_owner.items() if symbols == frame and o not in robot and not o.startswith("j")}


def hidden(result: Any) -> list[Any]:
    """What the data cannot tell, in words."""
    seen = result.identifiability
    if not seen.combinations and not seen.dropped:
        return []
    lines = [
        Text(
            f"What these measurements cannot tell ({seen.rank} of {seen.n_free} free parameters are seen)", style="bold"
        )
    ]
    quiet = [c.terms[0].name for c in seen.combinations if c.code == Code.NO_EFFECT]
    lines += indented(*(c.text for c in seen.combinations if c.code != Code.NO_EFFECT))
    if quiet:
        lines += indented(f"no effect on these measurements: {', '.join(quiet)}")
    return [*lines, *indented("They stay at their nominal values.", style="dim"), Text("")]


def show_warnings(terminal: Terminal, warnings: Sequence[Said]) -> None:
    """Warnings, one per line, each with what to do about it."""
    if warnings and not terminal.json:
        terminal.show(Text("Worth knowing", style="bold"))
        for said in warnings:
            terminal.show(*indented(said.sentence))
            if said.advice:
                terminal.show(*indented(said.advice, style="dim", by=4))
        terminal.show(Text(""))


def show_paths(terminal: Terminal, written: Sequence[Any]) -> None:
    """Where the files are; the report first, because that is what people open."""
    if written and not terminal.json:
        ordered = sorted(written, key=lambda p: (p.name != "report.html", p.name))
        terminal.say(f"Written to {ordered[0].parent}: {', '.join(p.name for p in ordered)}")


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
