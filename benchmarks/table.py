"""What the benchmark prints and stores: summaries of the answers, plain tables, the machine."""

import datetime
import os
import platform
import statistics
from pathlib import Path

MEASURED = "robocal"


def machine() -> dict:
    """CPU model, cores and Python; nothing that names the computer or its user."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")
        ]
        model = names[0] if names else model
    return {
        "cpu": model,
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        "date": datetime.date.today().isoformat(),
    }


def summarise(record) -> dict:
    """A contestant's answers (a `run.Record`) as a row."""
    return {
        "name": record.name,
        "how": record.how,
        "versions": record.versions,
        "seconds": {
            "median": statistics.median(record.seconds),
            "min": min(record.seconds),
            "max": max(record.seconds),
            "count": len(record.seconds),
        },
        "prepare_seconds_median": statistics.median(record.prepare),
        "iterations_median": statistics.median(record.iterations),
        "instances": len(record.errors),
        "held_out_mean_mm": statistics.fmean(record.errors.values()),
    }


def compare(rows: list[dict]) -> list[dict]:
    """Adds each row's time over robocal's and its held-out error over the best of all."""
    own = next((row["seconds"]["median"] for row in rows if row["name"] == MEASURED), None)
    best = min(row["held_out_mean_mm"] for row in rows)
    return [
        row
        | {
            "time_over_robocal": row["seconds"]["median"] / own if own else None,
            "held_out_over_best": row["held_out_mean_mm"] / best,
        }
        for row in rows
    ]


def plain(header: list[str], rows: list[list[str]]) -> str:
    """A table in plain text: the first column to the left, the others to the right."""
    widths = [max(len(line[k]) for line in [header, *rows]) for k in range(len(header))]

    def line(cells):
        return "  ".join(
            c.ljust(w) if k == 0 else c.rjust(w) for k, (c, w) in enumerate(zip(cells, widths, strict=True))
        )

    return "\n".join([line(header), "  ".join("-" * w for w in widths), *map(line, rows)])


def markdown(header: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown: the first column to the left, the others to the right."""
    bars = [header, ["---", *["---:"] * (len(header) - 1)], *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in bars)


def job_table(rows: list[dict]) -> str:
    """The table of the 56-pose job."""
    header = ["", "median ms", "min ms", "max ms", "solves", "held-out mm", "/ best", "time / robocal"]
    body = [
        [
            row["name"],
            f"{1e3 * row['seconds']['median']:.3f}",
            f"{1e3 * row['seconds']['min']:.3f}",
            f"{1e3 * row['seconds']['max']:.3f}",
            str(row["seconds"]["count"]),
            f"{row['held_out_mean_mm']:.5f}",
            f"{row['held_out_over_best']:.4f}",
            f"{row['time_over_robocal']:.1f}" if row["time_over_robocal"] else "-",
        ]
        for row in rows
    ]
    return plain(header, body)


def section_table(rows: list[dict]) -> str:
    """Any list of dictionaries, columns in order of first appearance."""
    header = list(dict.fromkeys(key for row in rows for key in row))

    def cell(value):
        return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)

    return plain(header, [[cell(row.get(key)) for key in header] for row in rows])
