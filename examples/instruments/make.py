"""Simulates every example in this folder anew: python examples/instruments/make.py [KIND...].

The robot is a small six-axis arm whose true lengths are off by 0.3 mm and angles by 1 mrad (one standard deviation).
Nothing here was measured.
"""

from __future__ import annotations

import csv
import io
import re
import sys
from pathlib import Path

import numpy as np

from robocal.arms import catalog
from robocal.files.datawrite import data_text, table_text
from robocal.files.kinds.registry import READERS
from robocal.files.robot import describe
from robocal.files.units import Units
from robocal.session.simulated_robot import sample_joints
from robocal.session.simulator import Errors, true_model
from robocal.simulation.rigs import FINE, Instrument, hidden, measure

HERE = Path(__file__).parent
ARM, POSES = "irb-120", {"pixels": 30, "point": 60, "plane": 60, "sphere": 60, "bearing": 60, "distance": 60}
COMMENTS = {
    "joints": "one column per joint, from the base on",
    "second": "the joints of the other configuration of a row",
    "position": "where the tool is",
    "orientation": "and how it is turned",
    "displacement": "second minus first, in the instrument's axes",
    "distance": "from one end to the other",
    "range": "or times: unit: us",
    "bearing": "azimuth about z from x, elevation above the xy plane",
    "contact": "how well it touches",
    "places": "where they stand is found; xyz says roughly where",
    "place": "the column that says which",
    "between": "known from the plate's drawing",
    "ends": "a ball in a socket beside the robot, another on its tool",
    "medium": "m/s; what a time would be multiplied by",
    "radius": "of the sphere and the probe's ball together",
    "pixels": "what the camera saw",
    "points": "the corners, in the marker's frame",
    "camera": "from a calibration of its own; free: true identifies it too",
    "frame": "where the instrument stands is found from the data",
    "configuration": "rows with one id are one configuration",
}


def texts(kind: str) -> dict[str, str]:
    """robot.yaml, data.yaml and data.csv of a kind."""
    arm, units = catalog.get(ARM), Units()
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence(5).spawn(3)]
    truth = true_model(arm, arm.geometric, Errors(), streams[0])
    q = np.radians(np.round(np.degrees(sample_joints(arm, POSES.get(kind, 40), streams[1])), 2))
    data = hidden(measure(truth, q, Instrument(kind, angle_noise=FINE.get(kind, 1e-4)), streams[2]))
    table, described = plain(table_text(data, arm, units, digits=False), data_text(data, arm, "data.csv", units))
    said = "# SIMULATED, not measured: examples/instruments/make.py"
    return {"robot.yaml": describe(arm, units), "data.yaml": f"{said}\n{commented(described)}", "data.csv": table}


def plain(table: str, described: str) -> tuple[str, str]:
    """A standard deviation that is the same in all rows is one number in data.yaml, not a column."""
    head, *rows = list(csv.reader(io.StringIO(table)))
    names = [h.partition(" [")[0] for h in head]
    gone: set[int] = set()

    def stated(found: re.Match[str]) -> str:
        columns = [names.index(n.strip()) for n in found[1].split(",")]
        values = {row[c] for row in rows for c in columns}
        if len(values) != 1:
            return found[0]
        gone.update(columns)
        return f"sigma: {values.pop()}"

    described = re.sub(r"sigma: \{columns: \[([^\]]*)\]\}", stated, described)
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(
        [cell for i, cell in enumerate(row) if i not in gone] for row in (head, *rows)
    )
    return stream.getvalue(), described


def commented(described: str) -> str:
    """Every key with a word on what it says."""
    lines = []
    for line in described.splitlines():
        words = COMMENTS.get(line.partition(":")[0])
        lines.append(f"{line}    # {words}" if words else line)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    for kind in sys.argv[1:] or READERS:
        folder = HERE / kind
        folder.mkdir(exist_ok=True)
        for name, text in texts(kind).items():
            (folder / name).write_text(text, encoding="utf-8")
        print(folder)
