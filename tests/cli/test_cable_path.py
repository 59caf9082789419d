"""The builder's whole path: from `new cable` to a validated robot and a program without contacts, in ten commands.

The simulated robot has drums that err by a per cent, zeros that nobody knows, and a tracker that stands anywhere.
"""

from __future__ import annotations

import csv
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from cables.virtual_cell import HEADER, Cell, write
from cli.runs import robocal
from sizes import size

from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.pose_lists import read_platform_poses
from robocal.geometry import fits, se3, so3

MOST = 1.5  # of the foretold error
NOISE = ("--sigma", "0.5", "--pose-noise", "0.2,0.02")


@dataclass
class Path_:
    """The folder of a builder, the built machine, and what the commands said."""

    home: Path
    cell: Cell
    said: dict
    fresh: np.ndarray | None = None

    def run(self, *words, doubt="nothing"):
        """One command, which must succeed, or doubt this alone."""
        with chdir(self.home):
            ran = robocal(*words)
        assert ran.status == 0 or (ran.status == 3 and doubt in ran.remarks), (words, ran.out, ran.remarks)
        self.said[" ".join(map(str, words[:2]))] = ran
        return ran

    def fill_in(self, folder, poses):
        """What somebody measures at poses: both tables of a folder, by the ids that are there."""
        rows = [line.split(",")[0] for line in (self.home / folder / "lengths.csv").read_text().splitlines()[2:]]
        cables = [f"c{i} [mm]" for i in range(1, 9)]
        write(self.home / folder / "lengths.csv", rows, cables, self.cell.shown(poses))
        write(self.home / folder / "measured.csv", rows, HEADER, self.cell.seen(poses))


def anywhere(rng, count):
    """Poses in the middle of the frame."""
    vector = np.concatenate([rng.uniform(-0.7, 0.7, (count, 3)) + [0, 0, 1.5], rng.normal(0, 0.12, (count, 3))], axis=1)
    return se3.from_vector(vector)


def table(path, name, poses):
    """What the sensors show at poses, as a table."""
    write(
        path.home / name,
        [f"p{i}" for i in range(len(poses))],
        [f"c{i} [mm]" for i in range(1, 9)],
        path.cell.shown(poses),
    )


def walk(home, seed, count=100):
    """The ten commands, with what is measured between them."""
    path = Path_(home, None, {})
    path.run("new", "cable", "-o", "cell")  # 1
    robot = read_cable(home / "cell" / "robot.yaml").robot
    path.cell = cell = Cell(robot.a, robot.b, seed)
    path.run("cable", "poses", "cell/robot.yaml", "-n", count, "--choose", 20, *NOISE, "-o", "first")  # 2
    path.fill_in("first", read_platform_poses(home / "first" / "chosen.csv", robot).values)
    data = "first/lengths.yaml", "first/poses.yaml"
    path.run("check", "cell/robot.yaml", *data)  # 3
    path.run("identify", "cell/robot.yaml", *data, "-o", "run")  # 4
    # 5: poses from lengths, the first of them where the platform stands after power-up
    path.fresh = np.concatenate(
        [se3.from_vector(np.array([[0, 0, 1.5, 0, 0, 0]])), anywhere(np.random.default_rng(seed + 100), 40)]
    )
    table(path, "fresh.csv", path.fresh)
    path.run("cable", "forward", "run", "fresh.csv", "--sigma", 0.5, "-o", "known.csv", doubt="equally well")
    path.run("new", "run", "-o", "tuesday")  # 6: another day, another power-up, another place of the tracker
    cell.zeros, cell.tracker = cell.rng.uniform(-2, 2, 8), cell.stand()
    path.fill_in("tuesday", anywhere(cell.rng, 20))
    path.run("validate", "run", "tuesday/lengths.yaml", "tuesday/poses.yaml", "--against", "cell/robot.yaml")  # 7
    table(path, "home.csv", path.fresh[:3])
    path.run("cable", "rezero", "run", "home.csv", "--poses", "known.csv", "--sigma", 1, "-o", "today.yaml")  # 8
    path.run("cable", "poses", "today.yaml", "-n", 20, "-o", "program")  # 9
    path.run("cable", "contact", "today.yaml", "program/program.csv")  # 10
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return walk(tmp_path_factory.mktemp("path"), 1)


def columns(place):
    """A table by the words of its headers."""
    rows = list(csv.DictReader(place.read_text().splitlines()))
    return {k.split(" [")[0]: np.array([float(r[k]) for r in rows]) for k in rows[0] if k not in ("id", "pose", "way")}


def vectors(read):
    """Poses (k, 4, 4) of a table in mm and deg."""
    vector = np.stack([read[s] for s in ("x", "y", "z", "rx", "ry", "rz")], axis=1)
    return se3.from_vector(vector * np.repeat([1e-3, np.pi / 180], 3))


def place_base(found, true):
    """The found poses with their base placed best over all rows: no measurement shows where it stands."""
    for _ in range(5):
        off = np.concatenate(
            [true[:, :3, 3] - found[:, :3, 3], so3.log(true[:, :3, :3] @ found[:, :3, :3].swapaxes(1, 2))], axis=1
        )
        field = np.zeros((len(found), 6, 6))
        field[:, :3, :3] = field[:, 3:, 3:] = np.eye(3)
        field[:, :3, 3:] = -so3.skew(found[:, :3, 3])
        v, w = np.split(np.linalg.lstsq(field.reshape(-1, 6), off.ravel(), rcond=None)[0], 2)
        shifted = found[:, :3, 3] + v + np.cross(w, found[:, :3, 3])
        found = se3.compose(so3.exp(w) @ found[:, :3, :3], shifted)
    return found


def told(path):
    """Errors (m) and turns (rad) of poses from lengths, and what `cable forward` foretold, as root mean squares."""
    read = columns(path.home / "known.csv")
    # Of a pose that is not the only one the command says so, and ends with status 3.
    only = read["solutions"] == 1
    assert only.sum() >= len(only) - 2
    read, true = {k: v[only] for k, v in read.items()}, path.fresh[only]
    found = place_base(vectors(read), true)
    place = np.linalg.norm(found[:, :3, 3] - true[:, :3, 3], axis=1)
    turn = np.linalg.norm(so3.log(found[:, :3, :3] @ true[:, :3, :3].swapaxes(1, 2)), axis=1)
    each = (place, 1e-3 * read["sigma_position"], turn, np.radians(read["sigma_orientation"]))
    return [float(np.sqrt(np.mean(v**2))) for v in each]


def said(seed, place, foretold, turn, spun):
    """One line of evidence."""
    return (
        f"seed {seed}: position {1e3 * place:.3f} mm, foretold {1e3 * foretold:.3f} (asked {MOST} of it: {place / foretold:.2f}); "
        f"turn {1e3 * turn:.2f} mrad, foretold {1e3 * spun:.2f} ({turn / spun:.2f})"
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, size(12, 3)))
def test_other_workshops(seed, tmp_path):
    """`ROBOCAL_FULL=1 pytest -s -m slow tests/cli/test_cable_path.py` prints ten of them."""
    place, foretold, turn, spun = told(walk(tmp_path, seed))
    print(said(seed, place, foretold, turn, spun))
    assert place < MOST * foretold and turn < MOST * spun


def test_poses_from_lengths_are_as_good_as_foretold(path):
    place, foretold, turn, spun = told(path)
    print(said(1, place, foretold, turn, spun))
    assert place < MOST * foretold and turn < MOST * spun
    assert foretold < 5e-3  # m: of a robot whose drums err by 40 mm in 4 m


def test_the_program_contains_gains_and_zeros(path):
    """Its lengths are those that the built machine's sensors show there, but for the calibration's error: without the gain 10 to 40 mm
    would be missing."""
    read = columns(path.home / "program" / "program.csv")
    robot = read_cable(path.home / "today.yaml").robot
    assert np.abs(robot.gain - path.cell.gain).max() < 1e-3 < np.abs(robot.gain - 1).min()
    shown = 1e-3 * np.stack([read[c] for c in robot.cables], axis=1)
    at = vectors(read)
    ends = at[:, None, :3, 3] + np.einsum("kij,mj->kmi", at[:, :3, :3], robot.b) - robot.a
    assert np.abs(shown - (np.linalg.norm(ends, axis=2) - robot.zeros) / robot.gain).max() < 1e-9
    # In the frame of the built machine, where the base is known from the poses of the tenth command's list alone.
    known = vectors(columns(path.home / "known.csv"))
    base = fits.rigid(known[:, :3, 3], path.fresh[:, :3, 3])
    assert np.abs(1e-3 * path.cell.shown(base @ at, 0.0) - shown).max() < 5e-3


def test_the_other_day_confirms_it_and_nothing_touches(path):
    said = path.said["validate run"].out
    assert "mean error smaller by" in said
    # What the builder asks for: where the platform is, by the lengths alone.
    table = said.partition("position from lengths")[2].splitlines()
    this, against = (
        float(next(w for w in table if w.startswith(who)).removeprefix(who).split()[0])
        for who in ("this robot", "against")
    )
    assert this < 2 and against > 5 * this, said
    assert "can be gone to their end" in path.said["cable contact"].out
    assert len(path.said) == 9  # `new` twice with other words, `cable poses` twice with the same: ten commands


def test_check_says_in_one_sentence_what_nobody_can_see(path):
    full = path.said["check cell/robot.yaml"].out
    with chdir(path.home):
        said = robocal("check", "cell/robot.yaml", "first/lengths.yaml", "first/poses.yaml", verbose=False).out
    assert "no measurement shows the base along x" in said and "these 6 are not observable" in said
    assert "cannot be separated" not in said
    assert full.count("cannot be separated") == 6


def test_zeros_that_nobody_named_are_found_and_the_line_is_told(path):
    """Free `l0` in place of `zeros: NAME`: the nominal robot has no zeros to be compared with, and the first reason says so."""
    free = path.home / "cell" / "l0.yaml"
    free.write_text((path.home / "cell" / "robot.yaml").read_text().replace("az, gain]", "az, gain, l0]"))
    data = path.home / "first" / "lengths.yaml"
    bare = data.with_name("bare.yaml")
    bare.write_text("".join(line for line in data.read_text().splitlines(True) if not line.startswith("zeros")))
    poses = path.home / "first" / "poses.yaml"
    lost = robocal("identify", free, bare, poses, "--json")
    assert lost.status == 3 and "cables are off by" in lost.document["verdict"]["reasons"][0]
    found = {p["name"]: p["identified"] for p in lost.document["parameters"]}
    assert np.abs([found[f"c{i}.l0"] / 1e3 - z for i, z in enumerate(path.cell.first, 1)]).max() < 0.05
    bare.write_text(bare.read_text() + "zeros: monday\n")
    assert robocal("identify", free, bare, poses, "--json").document["verdict"]["status"] == "improved"


@pytest.mark.parametrize("gain", ["1000", "0.001"])
def test_a_gain_that_is_a_slip_of_the_unit_is_named(gain, path):
    other = path.home / "cell" / "gain.yaml"
    other.write_text((path.home / "cell" / "robot.yaml").read_text().replace("gain: 1}", f"gain: {gain}}}"))
    ran = robocal("identify", other, *(path.home / "first" / n for n in ("lengths.yaml", "poses.yaml")))
    assert ran.status == 2 and "disagree on the size of the robot" in ran.remarks, ran.remarks
