"""The correlation picture: squares as large as the correlation, filled when positive, hollow when negative, so it
survives grey."""

from __future__ import annotations

from collections.abc import Sequence

from robocal.report.svg import drawing, label, num, path

__all__ = ["correlation", "strongest"]

MOST = 70  # more names than this cannot be read; the most entangled are shown
FAINT = 0.05
LETTER = 12.5  # px, of all pictures: style.css


Rows = Sequence[Sequence[float | None]]


def strongest(names: Sequence[str], rows: Rows, most: int = 6, least: float = 0.7) -> list[tuple[str, str, float]]:
    """The pairs with the largest correlation (absolute), strongest first."""
    pairs = [
        (names[j], names[i], v)
        for i, row in enumerate(rows)
        for j, v in enumerate(row[:i])
        if v is not None and abs(v) >= least
    ]
    return sorted(pairs, key=lambda p: (-abs(p[2]), p[0], p[1]))[:most]


def correlation(names: Sequence[str], rows: Rows) -> tuple[str, int]:
    """The picture (empty text when there are fewer than two names) and how many names it leaves out."""
    if len(names) < 2 or len(rows) < len(names):
        return "", 0
    left_out = max(0, len(names) - MOST)
    if left_out:
        strength = [
            max((abs(v) for j, v in enumerate(row) if j != i and v is not None), default=0.0)
            for i, row in enumerate(rows)
        ]
        keep = sorted(sorted(range(len(names)), key=lambda i: -strength[i])[:MOST])
        names = [names[i] for i in keep]
        rows = [[rows[i][j] for j in keep] for i in keep]
    return _draw(names, rows), left_out


def _draw(names: Sequence[str], rows: Rows) -> str:
    n = len(names)
    cell = max(9.0, min(22.0, 640 / n))
    font = min(11.5, cell * 0.82)
    short = [name if len(name) <= 22 else name[:21] + "…" for name in names]
    margin = max(len(s) for s in short) * font * 0.62 + 10
    side = n * cell
    full, hollow, grid = "", "", ""
    for i, row in enumerate(rows):
        y = 4 + i * cell
        grid += f"M{num(margin)} {num(y)}h{num((i + 1) * cell)}M{num(margin + i * cell)} {num(y)}V{num(4 + side)}"
        for j, v in enumerate(row[:i]):
            if v is None or abs(v) < FAINT:
                continue
            size = (cell - 1.6) * min(abs(v), 1.0) ** 0.5 - (0 if v > 0 else 1)
            if size <= 0:
                continue
            x0, y0 = margin + (j + 0.5) * cell - size / 2, y + cell / 2 - size / 2
            square = f"M{x0:.1f} {y0:.1f}h{size:.1f}v{size:.1f}h-{size:.1f}z"
            full, hollow = (full + square, hollow) if v > 0 else (full, hollow + square)
    parts = [path(grid, "grid"), path(full, "rho plus"), path(hollow, "rho minus")]
    for i, name in enumerate(short):
        y = 4 + (i + 0.5) * cell + font * 0.35
        ends = [(margin - 6, "end")] + ([(margin + (i + 0.75) * cell, "start")] if i < n - 1 else [])
        for x, anchor in ends:  # no style of its own: a page under a strict policy would drop it
            place = f'<text transform="translate({num(x)} {num(y)}) scale({font / LETTER:.3f})" '
            parts.append(label(0, 0, name, "tick", anchor).replace("<text ", place))
    width = margin + side + 8 + margin * 0.4
    most = [f" The largest is {v:.2f}, between {a} and {b}." for a, b, v in strongest(names, rows, 1, 0.0)]
    said, title = f"Correlations of {n} parameters.{''.join(most)}", "Correlation of the identified parameters"
    return drawing(width, side + 8, parts, title=title, text=said, key="correlation", cls="matrix")
