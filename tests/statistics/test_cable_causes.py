"""What is wrong with the files of cable robots is named, of robots with eight cables and in a plane; nothing where nothing is.

ROBOCAL_FULL=1: twenty draws for each; robots 1 to 20 mm off, noise of 0.02 to 1 mm, 30 to 150 poses.
"""

from __future__ import annotations

import re

import numpy as np
import pytest
from cli.runs import robocal
from sizes import size
from worlds import Cables

FACTORS = {("cm", "mm"): 0.1, ("m", "mm"): 1e-3, ("inch", "mm"): 1 / 25.4}
ROBOTS = ("eight", "planar")


def times(place, factor, columns):
    """A table with some of its columns in another unit."""
    head, *rows = place.read_text().splitlines()
    cells = [r.split(",") for r in rows]
    made = [[f"{float(c) * factor:.9g}" if i in columns else c for i, c in enumerate(r)] for r in cells]
    place.write_text("\n".join([head, *(",".join(r) for r in made)]) + "\n")


def in_mm(place):
    """The robot's numbers in mm, the unit that is stated still m."""
    own = re.sub(
        r"(?<=: )\[([-\d., e]+)\]",
        lambda m: f"[{', '.join(f'{float(v) * 1e3:.9g}' for v in m[1].split(','))}]",
        place.read_text(),
    )
    place.write_text(own)


def spoil(cause, folder, rng, name):
    """Files with one cause, and the words that name it."""
    nominal = Cables.nominal(name, rng)
    true, m, sigma = (
        nominal.true(rng, size=1e-3 * 20 ** rng.random()),
        int(rng.integers(30, 151)),
        2e-5 * 50 ** rng.random(),
    )
    p, w = true.draw(rng, m)
    y = true.lengths(p, w) + sigma * rng.normal(size=(m, len(true.l0)))
    n, words = len(true.l0), ""
    if cause == "exchanged":
        a, b = sorted(rng.choice(n, 2, replace=False))
        y[:, [a, b]] = y[:, [b, a]]
        words = rf"lengths of c{a + 1} and c{b + 1} are exchanged"
    if cause in ("sign", "sign and unit"):
        y, words = -y, "the lengths count the other way"
    p, w = (v + sigma * rng.normal(size=v.shape) for v in nominal._flat(p, w))
    nominal.write(folder, y, p, w, sigma)
    (unit, _), factor = list(FACTORS.items())[int(rng.integers(3))]
    if cause in ("lengths", "sign and unit"):
        times(folder / "lengths.csv", factor, range(1, n + 1))
        words = f"the lengths are in {unit}, not in mm.*{words}"
    if cause == "positions":
        times(folder / "poses.csv", factor, range(1, 4))
        words = f"the positions are in {unit}, not in mm"
    if cause == "robot":
        in_mm(folder / "robot.yaml")
        words = "the robot's own lengths are in mm, not in m"
    return words


CAUSES = ("lengths", "positions", "robot", "exchanged", "sign", "sign and unit", "nothing")


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("cause", CAUSES)
def test_a_cause_is_named(cause, name, tmp_path):
    draws, missed = size(20, 1), []
    for k in range(draws):
        words = spoil(cause, tmp_path, np.random.default_rng([k, CAUSES.index(cause), ROBOTS.index(name)]), name)
        ran = robocal("check", *(tmp_path / f for f in ("robot.yaml", "lengths.yaml", "poses.yaml")))
        said = " ".join(ran.err.split())
        right = ran.status == 0 if cause == "nothing" else ran.status == 2 and re.search(words, said)
        missed += [] if right else [(k, words, said)]
    assert len(missed) <= 0.05 * draws, missed


@pytest.mark.parametrize(
    ("cause", "key"), [("lengths", "lengths.yaml"), ("positions", "poses.yaml"), ("sign", "lengths.csv")]
)
def test_its_line_helps(cause, key, tmp_path):
    """The unit that is told is stated, the lengths are turned round: then the robot is improved."""
    spoil(cause, tmp_path, np.random.default_rng(5), "eight")
    files = [tmp_path / f for f in ("robot.yaml", "lengths.yaml", "poses.yaml")]
    said = robocal("check", *files).err
    told, place = re.search(r"expected (\w+)", said)[1], tmp_path / key
    if cause == "sign":
        times(place, -1.0, range(1, 9))
    else:
        table = tmp_path / key.replace(".yaml", ".csv")
        head, rest = table.read_text().split("\n", 1)
        table.write_text(head.replace("[mm]", f"[{told}]") + "\n" + rest)
        place.write_text(place.read_text().replace("unit: mm", f"unit: {told}"))
    ran = robocal("identify", *files, "--json")
    assert ran.status == 0 and ran.document["verdict"]["status"] == "improved", (ran.out[-500:], ran.err)
