"""What changed more than once along a file: each change looks like serial correlation to the others, and all are named together."""

from __future__ import annotations

import numpy as np
import pytest
from cables.logs import Log
from scipy.spatial.transform import Rotation
from sizes import size
from worlds import Arm, Cables, frame

import robocal as rc
from robocal.fit.options import Options
from robocal.prove.identify import identify

FRAME = frame(Rotation.from_rotvec([0.3, -0.2, 1.1]).as_matrix(), np.array([1.5, -0.7, 0.4]))


def at_parts(count, starts, rng, size):
    """Numbers of every row, (count, size), that change at some rows: nothing ahead of the first."""
    steps = np.concatenate([np.zeros((1, size)), rng.normal(size=(len(starts), size))])
    return steps[np.searchsorted(starts, np.arange(count), side="right")]


def cable_files(folder, kind, seed, count, starts, by=6e-3):
    """A cable robot of which all zeros are another ones from some rows on."""
    rng = np.random.default_rng(seed)
    nominal = Cables.nominal(kind, rng)
    true = nominal.true(rng, 4e-3, 3e-3)
    p, w = true.draw(rng, count)
    y = (
        true.lengths(p, w)
        + by * at_parts(count, starts, rng, len(true.a))
        + 1e-3 * rng.normal(size=(count, len(true.a)))
    )
    return nominal.write(folder, y, p + 1e-3 * rng.normal(size=p.shape), w + 1e-3 * rng.normal(size=w.shape), 1e-3)


def arm_files(folder, kind, seed, count, starts, what, by=5e-3):
    """An arm of which tracker or target stood elsewhere from some rows on."""
    rng = np.random.default_rng(seed)
    nominal = Arm.nominal(kind)
    true, off = nominal.true(rng), by * at_parts(count, starts, rng, 3)
    q = true.draw(rng, count)
    p = true.point(q, true.tool + off) if what == "target" else true.point(q) + off
    seen = (p + 2e-4 * rng.normal(size=p.shape)) @ FRAME[:3, :3].T + FRAME[:3, 3]
    return nominal.write(folder, q, seen, 2e-4)


def told(folder, files):
    """How the verdict is, and what it says of changes."""
    robot, *data = (folder / f for f in files)
    verdict = rc.identify(robot, data).result.verdict
    return verdict.status, [r for r in verdict.remarks if r.code.startswith("segment")]


@pytest.mark.parametrize(("kind", "seed", "starts"), [("eight", 13, (17, 33)), ("plane", 7, (15, 31, 48))])
def test_zeros_set_anew_several_times_are_named_with_each_row(tmp_path, kind, seed, starts):
    status, (said,) = told(tmp_path, cable_files(tmp_path, kind, seed, starts[-1] + 18, starts))
    assert status == "refused" and said.code == "segments" and said.numbers["file"].endswith("lengths.csv")
    assert said.numbers["times"] == len(starts) and said.numbers["rows"] == ", ".join(str(s + 2) for s in starts)


@pytest.mark.parametrize(("what", "line"), [("target", "targets: {NAME: {}}"), ("tracker", "frame: {name: NAME}")])
def test_an_arm_whose_tracker_or_target_moved_twice(tmp_path, what, line):
    status, (said,) = told(tmp_path, arm_files(tmp_path, "six", 22, 57, (19, 40), what))
    assert status == "refused" and (said.code, said.numbers["rows"]) == ("segments", "21, 42")
    assert line in said.advice


# obeys: segments
def test_parts_that_are_read_by_files_of_their_own_are_calibrated(tmp_path):
    """The advice, obeyed."""
    robot, lengths, poses = cable_files(tmp_path, "eight", 13, 51, (17, 33))
    parts = [("2-18", "z1"), ("19-34", "z2"), ("35-52", "z3")]
    text, files = (tmp_path / lengths).read_text(), []
    for rows, name in parts:
        others = ", ".join(r for r, _ in parts if r != rows)
        files.append(f"{name}.yaml")
        (tmp_path / files[-1]).write_text(f"{text}exclude: [{others}]\nzeros: {name}\n")
    assert told(tmp_path, (robot, *files, poses)) == ("improved", [])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["eight", "planar"])
@pytest.mark.parametrize("what", ["zeros", "zero", "instrument"])
def test_of_several_changes_nearly_all_are_refused_and_most_with_every_row(kind, what):
    count, refused, named = size(30, 4), 0, 0
    for seed in range(5100, 5100 + count):
        rng, log = np.random.default_rng(seed), Log(kind, seed=seed, path=seed % 2 == 0)
        at = np.sort(rng.choice(np.arange(15, 80, 16), 2 + seed // 2 % 2, replace=False)) + rng.integers(0, 4)
        for row in at:
            if what == "instrument":
                log.shift_instrument(row, 0.01)
            elif what == "zero":
                log.y[row:, 1] += 0.012
            else:
                log.y[row:] += 8e-3 * rng.choice([-1, 1], len(log.a)) * rng.uniform(0.5, 1.5, len(log.a))
        verdict = identify(log.nominal(), log.data(), Options(leave_one_out=False)).verdict
        refused += verdict.status == "refused"
        said = [r.numbers for r in verdict.reasons if r.code.startswith("segment")]
        rows = [int(v) for n in said for v in str(n.get("rows", n.get("first"))).split(", ")]
        named += len(rows) == len(at) and bool(np.abs(np.sort(rows) - at - 2).max() <= 2)
    print(f"{kind}, {what}: of {count} {refused} refused, {named} with every row")
    # Eight cables of their own errors hide much of 10 mm: there each of two moves is seldom large beside the other.
    weak = (kind, what) == ("eight", "instrument")
    assert refused >= (0.4 if weak else 0.9) * count and named >= (0.2 if weak else 0.75) * count
