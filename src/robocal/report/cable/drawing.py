"""What the pictures of cable robots share: the frame of a figure with its own style, colours of tensions and margins,
colour bars."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from importlib.resources import files

from robocal.report.svg import drawing, num

__all__ = ["bar", "brief", "clean", "figure", "tint"]

# Blue, teal, green, amber, orange, red: equally dark all the way, so that each stands out on white and on black.
RAMP = ("#2b7bd6", "#17989a", "#5c9a3a", "#c98a10", "#dd5f1b", "#d0263e")
STEPS = 40  # of a colour bar
MORE = {"map": ("map.css",)}  # kinds of pictures, and the styles that they need besides


def clean(text: str) -> str:
    """Text without control characters and halves of surrogate pairs, which no XML may hold."""
    kept = "".join(c if c >= " " or c in "\n\t" else "\ufffd" for c in text)
    return kept.encode("utf-8", "replace").decode("utf-8")


def figure(
    kind: str, width: float, height: float, parts: Iterable[str], *, title: str, text: str, more: str = ""
) -> str:
    """A whole picture that stands alone, in light and dark; what it shows makes the identifiers that a page needs."""
    body = "".join(parts)
    key = f"{kind.split()[0]}-{zlib.crc32((title + text + body).encode('utf-8', 'replace')):08x}"
    names = ("cable/cable.css", *MORE.get(kind.split()[0], ()))
    style = "".join(files("robocal.report").joinpath(n).read_text(encoding="utf-8").replace("\n", "") for n in names)
    cls = f"cable {kind}"
    return clean(drawing(width, height, [body], title=title, text=text, key=key, cls=cls, style=style, more=more))


def brief(name: str, most: int = 14) -> str:
    """A name that fits beside a mark; the middle is left out, since names of cables differ at their ends."""
    tail = most // 3
    return name if len(name) <= most else f"{name[: most - tail - 1]}…{name[-tail:]}"


def tint(share: float) -> str:
    """The colour at a share of the ramp, 0 to 1; what lies outside gets the end's."""
    at = min(max(share, 0.0), 1.0) * (len(RAMP) - 1)
    i = min(int(at), len(RAMP) - 2)
    ends = [[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in RAMP[i : i + 2]]
    return "#" + "".join(f"{round(a + (at - i) * (b - a)):02x}" for a, b in zip(*ends, strict=True))


def bar(x: float, top: float, bottom: float) -> str:
    """An upright bar with the colours of the ramp, low values at the bottom."""
    high = (bottom - top) / STEPS
    # A hair higher than a step, so that no seam shows.
    return "".join(
        f'<rect x="{num(x)}" y="{bottom - (i + 1) * high:.2f}" width="14" height="{high + 0.6:.2f}" '
        f'shape-rendering="crispEdges" fill="{tint((i + 0.5) / STEPS)}"/>'
        for i in range(STEPS)
    )
