"""validation.html from validation.json: the errors of a model, and the figures of ISO 9283 with what cannot be
computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from robocal.report.numbers import entries, finite, section, significant
from robocal.report.page import jinja, style
from robocal.report.svg import Scale, bottom_axis, drawing, left_axis, points, span
from robocal.report.tables import mappings
from robocal.report.words import advised

__all__ = ["render"]

Found = Mapping[str, object]
MEANING = {
    "AP": "pose accuracy: from the commanded position to the barycentre",
    "RP": "pose repeatability: mean distance to the barycentre plus three standard deviations",
    "vAP": "multi-directional variation: largest distance between barycentres",
    "AD": "distance accuracy: mean measured distance minus the commanded one",
    "RD": "distance repeatability: three standard deviations",
}
MOST = 60  # rows of a table in the page; validation.json has all


def render(found: Found) -> str:
    """The text of validation.html from what validation.json holds. Raises MissingExtra without jinja2."""
    iso = section(found, "iso_9283")
    page = jinja().get_template("validation.template.html").render(
        style=style(),
        robot=str(found.get("robot") or "Unnamed robot"),
        against=found.get("against"),
        trusted=found.get("trusted") is True,
        reasons=advised(found, "reasons"),
        errors=[
            {"unit": unit, "rows": _statistics(section(found, key))} for key, unit in (("errors", "mm"), ("angle", "°"))
        ],
        profiled=len(entries(found.get("profiled"))),
        standard=str(iso.get("standard") or "ISO 9283"),
        summary=_summary(iso),
        missing=[(str(k), str(v)) for k, v in section(iso, "not_computable").items()],
        notes=[str(n) for n in entries(iso.get("notes"))],
        poses=_table(mappings(section(iso, "pose").get("rows"))),
        pairs=str(section(iso, "distance").get("pairs") or ""),
        distances=_table(mappings(section(iso, "distance").get("rows"))),
        picture=_picture(mappings(section(iso, "distance").get("rows"))),
        warnings=advised(found),
        command=str(section(found, "provenance").get("command") or ""),
        version=str(section(found, "provenance").get("version") or ""),
        inputs=[(str(i.get("file")), str(i.get("sha256"))) for i in mappings(section(found, "provenance").get("inputs"))],
    )  # fmt: skip
    clean = "".join(c if c >= " " or c in "\n\t" else "\ufffd" for c in page)
    return clean.encode("utf-8", "replace").decode("utf-8")


def _statistics(part: Found) -> list[tuple[str, list[str]]]:
    names = {"this": "this robot", "against": "compared with"}
    out = []
    for key, name in names.items():
        s = section(part, key)
        if s:
            numbers = [significant(s.get(k)) for k in ("mean", "rms", "p95", "max")]
            out.append((name, [*numbers, f"{finite(s.get('n')) or 0:.0f}"]))
    return out


def _summary(iso: Found) -> list[dict[str, Any]]:
    """One row per figure: mean and largest, of this robot and of the one compared with."""
    out = []
    for part in ("pose", "distance"):
        both = section(iso, part, "summary")
        for name, s in section(both, "this").items():
            other = section(both, "against", name) if name.startswith("A") else {}
            angle = name.rpartition("_")[2] in ("a", "b", "c")
            out.append(
                {
                    "name": name,
                    "meaning": MEANING.get(name, ""),
                    "unit": "°" if angle else "mm",
                    "this": [significant(section(s).get(k)) for k in ("mean", "max")],
                    "against": [significant(other.get(k)) for k in ("mean", "max")],
                    "n": f"{finite(section(s).get('n')) or 0:.0f}",
                }
            )
    return out


def _table(rows: Sequence[Found]) -> dict[str, Any]:
    """Header and cells of rows whose keys may differ; what another robot has stands behind."""
    flat = [
        {k: v for k, v in row.items() if not isinstance(v, Mapping)}
        | {f"{k} against": v for k, v in section(row, "against").items() if k == "AP"}
        for row in rows[:MOST]
    ]
    header = list(dict.fromkeys(k for row in flat for k in row))
    cells = [[v if isinstance(v := row.get(k), str) else _number(v) for k in header] for row in flat]
    return {"header": header, "rows": cells, "left_out": max(len(rows) - MOST, 0)}


def _number(value: object) -> str:
    if isinstance(value, int) and not isinstance(value, bool):
        return str(value)
    return significant(value) if finite(value) is not None else ""


def _picture(rows: Sequence[Found]) -> str:
    """|AD| against the commanded distance, of both robots."""
    series = {"after": "AD", "before": "AD_against"}
    at = {
        key: [(c, abs(v)) for row in rows if (c := finite(row.get("commanded"))) is not None
              and (v := finite(row.get(name))) is not None]
        for key, name in series.items()
    }  # fmt: skip
    across, up = span(x for p in at.values() for x, _ in p), span(y for p in at.values() for _, y in p)
    if across is None or up is None or len(at["after"]) < 3:
        return ""
    width, height = 640.0, 260.0
    x = Scale(0.0, across[1], 58, width - 10)
    y = Scale(0.0, up[1], height - 44, 12)
    parts = [left_axis(y, 58, width - 10, "|AD|, mm"), bottom_axis(x, height - 44, 12, "commanded distance, mm")]
    for key in ("before", "after"):
        parts.append(points([x(v) for v, _ in at[key]], [y(v) for _, v in at[key]], key))
    said = "; ".join(f"{key}: {len(p)} pairs" for key, p in at.items() if p)
    return drawing(width, height, parts, title="Distance accuracy", text=said, key="distance")
