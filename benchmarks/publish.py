"""What of the results the documentation shows by itself: the blocks of cables and of joint estimates in docs/benchmarks.md."""

from pathlib import Path

import table

PAGE = Path(__file__).resolve().parents[1] / "docs" / "benchmarks.md"


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


def place(rows: list[dict]) -> str:
    """One row per contestant."""
    body = [
        [
            r["what"],
            number(r["cpu_us"], "us"),
            number(r["cpu_over_robocal"]),
            number(r["off_m"] and 1e9 * r["off_m"], "nm"),
        ]
        for r in rows
    ]
    return table.markdown(["pose from eight lengths", "CPU time", "over pose by pose", "off by at most"], body)


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


def joint(rows: list[dict]) -> str:
    """One row per scene and contestant."""
    body = [
        [f"{r['scene']}, {r['corners']} corners", r["what"], number(r["cpu_s"], "s"), number(r["cpu_over_robocal"]), str(r["iterations"])]
        + [number(r["off_cost"])]
        for r in rows
    ]  # fmt: skip
    return table.markdown(
        ["views x markers", "", "CPU time", "over robocal", "iterations", "cost above the lowest"], body
    )


def robust(rows: list[dict]) -> str:
    """One row per loss and contestant."""
    body = [
        [r["scene"], r["what"], number(r["cpu_s"], "s"), number(r["cpu_over_plain"]), str(r["iterations"])]
        for r in rows
    ]
    return table.markdown(["3 % gross corners, loss", "", "CPU time", "over none", "iterations"], body)


def evidence(rows: list[dict]) -> str:
    """One row per piece of evidence."""
    body = [
        [r["what"], r["scene"], number(r["cpu_s"], "s"), number(r["more_MB"], "MB"), number(r["peak_MB"], "MB")]
        for r in rows
    ]
    return table.markdown(
        ["robocal", "views x markers", "CPU time", "memory more than before", "largest of the process"], body
    )


def likelihood(rows: list[dict]) -> str:
    """One row per way to take poses that were measured."""
    ways = {
        "likelihood": "maximum likelihood, poses free under their priors",
        "generalised": "generalised least squares, until a pass moves nothing",
        "one-pass": "generalised least squares, one linearisation for all draws",
    }
    body = [[ways[r["what"]], number(r["cpu_s"], "s"), f"{r['off_sigma']:.1e}"] for r in rows]
    return table.markdown(
        ["eight cables, 100 poses", "CPU time of one draw of 200", "off maximum likelihood, in sigma"], body
    )


def waits(rows: list[dict]) -> str:
    """One row per command."""
    body = [
        [r["what"], number(r["cpu_s"], "s"), number(r["peak_MB"], "MB"), number(r.get("before_cpu_s"), "s")]
        + [number(r.get("before_peak_MB"), "MB"), number(r["cpu_s_over_before"]), number(r.get("wall_s_over_before"))]
        for r in rows
    ]
    heads = ["robocal", "CPU time", "memory", "before", "memory before", "CPU time over before", "by the clock"]
    return table.markdown(heads, body)


def head(document: dict, section: str) -> str:
    """When and where a section was measured."""
    on = document["measured"][section]
    return (
        f"Last run: {on['date']}, {on['cpu']}, {on['cores']} cores, Python {on['python']}, one thread each; CPU time."
    )


def cables(document: dict) -> list[str]:
    """The parts of the block of cables."""
    made = document["sections"]
    return [
        tension(made["cable_tension"]),
        place(made["cable_place"]),
        poses(made["cable_poses"]),
        grid(made["cable_grid"]),
    ]


def joints(document: dict) -> list[str]:
    """The parts of the block of joint estimates."""
    made = document["sections"]
    return [
        joint(made["joint"]),
        robust(made["joint_robust"]),
        evidence(made["joint_evidence"]),
        likelihood(made["joint_likelihood"]),
        joint(made["joint_growth"]),
    ]


BLOCKS = {"cables": cables, "joint": joints, "waits": lambda document: [waits(document["sections"]["waits"])]}


def publish(document: dict, page: Path = PAGE) -> None:
    """Put every block that the results have between its markers."""
    text = page.read_text(encoding="utf-8")
    for name, parts in BLOCKS.items():
        begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->"
        if name not in document.get("measured", {}) or begin not in text:
            continue
        before, rest = text.split(begin)
        block = "\n\n".join([head(document, name), *parts(document)]) + "\n"
        text = before + begin + block + end + rest.split(end)[1]
    page.write_text(text, encoding="utf-8")
