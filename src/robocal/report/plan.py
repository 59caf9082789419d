"""plan.html: how accurate so many poses will be, where they are, and in which order to measure them. Self-contained,
without a script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files

from robocal.report.numbers import entries, finite, section, significant
from robocal.report.svg import Scale, bottom_axis, drawing, label, left_axis, line, num, path, points, span
from robocal.report.words import advised

__all__ = ["accuracy_picture", "place_pictures", "plan_page"]

Points = Sequence[Sequence[float]]
STYLE = ".curve.p95{stroke-dasharray:2 3}.curve.random{stroke:var(--before);stroke-dasharray:6 4}.seen{fill:var(--axis);opacity:.45}"


def plan_page(document: Mapping[str, object], places: Mapping[str, Points]) -> str:
    """The page of a plan.json; `places` are points (m) in base coordinates: candidates, tests, chosen."""
    accuracy = section(document, "accuracy")
    n, enough = finite(document.get("poses")) or 0.0, finite(document.get("enough"))
    name = escape(str(document.get("robot") or "Unnamed robot"))
    facts = [
        ("Poses", f"{n:.0f}"),
        ("Measured before", f"{finite(document.get('measured_before')) or 0:.0f}"),
        ("Kind", str(document.get("kind"))),
        ("Criterion", str(document.get("criterion"))),
        ("Chosen from", f"{finite(document.get('candidates')) or 0:.0f} candidates"),
    ]
    said = (
        f"After these {n:.0f} poses the error at poses that were not measured is foretold to be "
        f"{_mm(accuracy, 'mean_mm')} in the mean, below {_mm(accuracy, 'p95_mm')} at 95 % of them; "
        f"{n:.0f} random poses would reach {_mm(accuracy, 'random_mm')}."
    )
    judged = (
        f"{enough:.0f} poses are enough: five more would hardly help, or what was asked for is reached."
        if enough
        else "Every further pose still helps; no number in this forecast is enough."
    )
    body = [
        '<p class="eyebrow">robocal plan</p>',
        f"<h1>{name}</h1>",
        '<dl class="facts">'
        + "".join(f"<div><dt>{escape(k)}</dt><dd>{escape(v)}</dd></div>" for k, v in facts)
        + "</dl>",
        f'<section class="verdict"><p class="lead">{escape(said)}</p><p>{escape(judged)}</p></section>',
        _warnings(advised(document)),
        "<h2>How many poses</h2>",
        _figure(
            accuracy_picture(document),
            "Foretold error (rms of all three axes) at test poses, from the noise as stated and the errors that are expected "
            "beforehand. What no parameter describes, such as gears and bending, comes on top.",
        ),
        _table(document),
        "<h2>Where</h2>",
        '<div class="pair">' + "".join(_figure(p, c) for p, c in place_pictures(places)) + "</div>",
        '<p class="note">poses.csv holds the joint values in an order that is short to travel; its column rank says which are '
        "worth most. Whether the arm hits itself or anything around it was not checked.</p>",
    ]
    style = files("robocal.report").joinpath("style.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        f"<title>Plan for {name}</title><style>{style}{STYLE}</style></head><body><main>"
        + "\n".join(b for b in body if b)
        + "</main></body></html>\n"
    )


def _mm(data: Mapping[str, object], key: str) -> str:
    return f"{significant(data.get(key))} mm"


def _figure(picture: str, caption: str) -> str:
    return (
        f'<figure><div class="scroll">{picture}</div><figcaption>{escape(caption)}</figcaption></figure>'
        if picture
        else ""
    )


def _warnings(found: Sequence[tuple[str, str]]) -> str:
    """Sentences, each followed by what to do about it."""
    return "".join(f'<p class="warn">{escape(f"{said}. {advice}" if advice else said)}</p>' for said, advice in found)


def _rows(document: Mapping[str, object]) -> list[Mapping[str, object]]:
    return [r for r in entries(document.get("forecast")) if isinstance(r, Mapping)]


def accuracy_picture(document: Mapping[str, object]) -> str:
    """Foretold error against the number of poses on a logarithmic axis: mean, 95 %, random poses; empty text when
    nothing is foretold."""
    n, asked = finite(document.get("poses")) or 0.0, finite(document.get("asked_accuracy_mm"))
    rows = _rows(document)
    # The first poses only find the instrument.
    shown = [r for r in rows if (finite(r.get("poses")) or 0.0) >= min(3.0, n)]
    curves = {k: [finite(r.get(f"{k}_mm")) for r in shown] for k in ("mean", "p95", "random")}
    around = span(v for c in curves.values() for v in c if v is not None)
    if not shown or around is None:
        return ""
    at = [finite(r.get("poses")) or 0.0 for r in shown]
    left, right, bottom, top = 56.0, 922.0, 300.0, 34.0
    x, y = Scale(0.0, at[-1] * 1.04, left, right), Scale(*around, bottom, top, log=True)
    parts = [
        bottom_axis(x, bottom, top, "poses measured"),
        left_axis(y, left, right, "foretold error, mm, logarithmic"),
    ]
    for key, cls in (("random", "curve random"), ("p95", "curve p95"), ("mean", "curve")):
        known = [(x(a), y(v)) for a, v in zip(at, curves[key], strict=True) if v is not None]
        parts.append(path("".join(f"{'L' if i else 'M'}{num(u)} {num(v)}" for i, (u, v) in enumerate(known)), cls))
        if known:
            word = {"mean": "mean", "p95": "95 %", "random": "random poses"}[key]
            parts.append(label(known[0][0] + 8, known[0][1] + {"mean": 12, "p95": -4, "random": 4}[key], word, "name"))
    here = next((v for a, v in zip(at, curves["mean"], strict=True) if a == n and v is not None), None)
    if here is not None:
        parts += [line(x(n), bottom, x(n), y(here), "axis"), points([x(n)], [y(here)], "held")]
        parts.append(label(x(n) + 8, y(here) - 10, f"{n:.0f} poses: {significant(here)} mm", "strong"))
    if asked is not None and around[0] <= asked <= around[1]:
        parts += [
            line(left, y(asked), right, y(asked), "mean held"),
            label(right, y(asked) - 6, "asked for", "name", "end"),
        ]
    first, last = (f"{significant(curves['mean'][i])} mm after {at[i]:.0f} poses" for i in (0, -1))
    said = f"Foretold mean error falls from {first} to {last}."
    return drawing(
        940, 345, parts, title="Foretold error against the number of poses", text=said, key="forecast", cls="wide"
    )


def _table(document: Mapping[str, object]) -> str:
    n = finite(document.get("poses")) or 0.0
    out = []
    for r in _rows(document):
        k = finite(r.get("poses")) or 0.0
        if k < 1 or (k % 5 and k != n):
            continue
        cells = "".join(
            f'<td class="n">{significant(r.get(c))}</td>' for c in ("mean_mm", "p95_mm", "random_mm", "gain_mm")
        )
        out.append(f'<tr{" class=count" if k == n else ""}><th class="n">{k:.0f}</th>{cells}</tr>')
    head = "".join(
        f'<th class="n">{h}</th>'
        for h in ("poses", "mean, mm", "95 %, mm", "random poses, mm", "gain of the last pose, mm")
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(out)}</tbody></table>" if out else ""


def place_pictures(places: Mapping[str, Points]) -> list[tuple[str, str]]:
    """The measured points from above and from the side, each with its caption."""
    every = [p for group in places.values() for p in group]
    if not every:
        return []
    out = []
    for key, (i, j), words in (("above", (0, 1), "From above"), ("side", (0, 2), "From the side")):
        low = [min(p[a] for p in every) for a in (i, j)]
        high = [max(p[a] for p in every) for a in (i, j)]
        half = max(h - w for h, w in zip(high, low, strict=True)) / 2 * 1.05 or 1.0
        middle = [(h + w) / 2 for h, w in zip(high, low, strict=True)]
        x = Scale((middle[0] - half) * 1e3, (middle[0] + half) * 1e3, 52, 452)
        y = Scale((middle[1] - half) * 1e3, (middle[1] + half) * 1e3, 434, 34)
        parts = [bottom_axis(x, 434, 34, f"{'xyz'[i]}, mm"), left_axis(y, 52, 452, f"{'xyz'[j]}, mm")]
        dots = "".join(
            f"M{num(x(p[i] * 1e3) - 1)} {num(y(p[j] * 1e3) - 1)}h2v2h-2z" for p in places.get("candidates", ())
        )
        parts.append(path(dots, "seen"))
        chosen = places.get("chosen", ())
        parts.append(points([x(p[i] * 1e3) for p in chosen], [y(p[j] * 1e3) for p in chosen], "after"))
        parts.append(points([x(0.0)], [y(0.0)], "before") if x.low <= 0 <= x.high and y.low <= 0 <= y.high else "")
        said = f"{words}: {len(chosen)} chosen poses among {len(places.get('candidates', ()))} candidates; the circle is the base."
        out.append((drawing(460, 480, parts, title=f"{words}", text=said, key=key), said))
    return out
