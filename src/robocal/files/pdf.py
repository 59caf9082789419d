"""A page of PDF with rectangles and text, in millimetres from its lower left corner: all that a printed sheet needs."""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["page_of", "rectangles", "text_line"]

POINTS = 72 / 25.4  # in a millimetre
Box = tuple[float, float, float, float]


def rectangles(boxes: Iterable[Box], grey: float) -> str:
    """Filled rectangles (x, y, width, height), one path, so that no seam shows where two meet; grey 0 is black."""
    path = "\n".join(f"{x:.4f} {y:.4f} {w:.4f} {h:.4f} re" for x, y, w, h in boxes)
    return f"{grey:g} g\n{path}\nf\n" if path else ""


def text_line(x: float, y: float, height: float, words: str) -> str:
    """A line of Helvetica; what is no ASCII becomes a question mark."""
    plain = words.encode("ascii", "replace").decode()
    for mark in "\\()":
        plain = plain.replace(mark, "\\" + mark)
    return f"0 g\nBT /F1 {height:g} Tf {x:.3f} {y:.3f} Td ({plain}) Tj ET\n"


def page_of(width: float, height: float, parts: Iterable[str], title: str) -> str:
    """The document; viewers are asked to print it at its own scale."""
    content = f"{POINTS:.10f} 0 0 {POINTS:.10f} 0 0 cm\n" + "".join(parts)
    name = text_line(0, 0, 1, title).partition("Td ")[2].partition(" Tj")[0]
    objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {width * POINTS:.6f} {height * POINTS:.6f}] "
        "/Resources << /Font << /F1 5 0 R >> >> /Contents 4 0 R >>",
        f"<< /Length {len(content)} >>\nstream\n{content}endstream",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        f"<< /Title {name} /Producer (robocal) >>",
    ]
    out, starts = "%PDF-1.4\n", []
    for i, body in enumerate(objects, start=1):
        starts.append(len(out))
        out += f"{i} 0 obj\n{body}\nendobj\n"
    table = "".join(f"{start:010d} 00000 n \n" for start in starts)
    size = len(objects) + 1
    tail = f"trailer\n<< /Size {size} /Root 1 0 R /Info {size - 1} 0 R >>\nstartxref\n{len(out)}\n%%EOF\n"
    return f"{out}xref\n0 {size}\n0000000000 65535 f \n{table}{tail}"
