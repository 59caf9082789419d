"""What of the results the documentation shows by itself: the block of cables in docs/benchmarks.md."""

from pathlib import Path

import table

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks.md"
BEGIN, END = "<!-- cables: begin -->\n", "<!-- cables: end -->"


def number(value: float | None, unit: str = "") -> str:
    """Three digits, whole numbers from a thousand on, and nothing for nothing."""
    if value is None:
        return ""
    return f"{value:.0f} {unit}".strip() if abs(value) >= 1000 else f"{value:.3g} {unit}".strip()


def tension(rows: list[dict]) -> str:
    """One row per contestant; feasible and infeasible poses side by side."""
    by_kind = {kind: {r["what"]: r for r in rows if r["poses"] == kind} for kind in ("feasible", "infeasible")}
    body = []
    for name, good in by_kind["feasible"].items():
        bad = by_kind["infeasible"].get(name, {})
        wrong = good["wrong"] + bad.get("wrong", 0)
        ratio, other = number(good["cpu_over_robocal"]), number(bad.get("cpu_over_robocal"))
        body.append(
            [name, number(good["cpu_us"], "us"), number(bad.get("cpu_us"), "us"), f"{ratio}, {other}"]
            + [str(wrong), number(good["off_N"], "N")]
        )
    return table.markdown(
        ["tension of one pose", "feasible", "infeasible", "over robocal", "wrong", "off by at most"], body
    )


def poses(rows: list[dict]) -> str:
    """One row per contestant and length of list."""
    body = [
        [f"{r['what']} of {r['poses']}" if "list" in r["what"] else r["what"], number(r["cpu_ms"], "ms")]
        + [number(r["cpu_over_robocal"]), number(r["off_lambda"]), number(r["off_m"] and 1e3 * r["off_m"], "mm")]
        for r in rows
    ]
    return table.markdown(
        ["one reachable pose", "CPU time", "over one by one", "lambda off by", "lengths off by"], body
    )


def grid(rows: list[dict]) -> str:
    """One row per contestant; the whole grid."""
    body = [
        [r["what"], number(r["cpu_s"], "s"), number(r["cpu_over_robocal"]), str(r["cells"])]
        + ["" if r["wrong"] is None else str(r["wrong"]), number(r["off_N"], "N")]
        for r in rows
    ]
    total = max(r["cells"] for r in rows)
    return table.markdown(
        [f"grid of {total} poses", "CPU time", "over robocal", "from cells", "wrong", "margin off by at most"], body
    )


def block(document: dict) -> str:
    """The block, without its markers."""
    made, on = document["sections"], document["measured"]["cables"]
    parts = [
        f"Last run: {on['date']}, {on['cpu']}, {on['cores']} cores, Python {on['python']}, one thread each; CPU time.",
        tension(made["cable_tension"]),
        poses(made["cable_poses"]),
        grid(made["cable_grid"]),
    ]
    return "\n\n".join(parts) + "\n"


def publish(document: dict, page: Path = PAGE) -> None:
    """Put the block between its markers, if the results have it."""
    if "cables" not in document.get("measured", {}):
        return
    text = page.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    page.write_text(before + BEGIN + block(document) + END + rest.split(END)[1], encoding="utf-8")
