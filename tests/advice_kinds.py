"""Advice on instruments, on the forms of files and on cables, obeyed."""

from __future__ import annotations

import re

import numpy as np
from advice import arm, beside, cables, edit, found, identify, obeyed
from cli.runs import robocal
from cli.test_urdf_runs import URDF
from prove.test_frames_alone import seen as sights
from prove.test_frames_alone import world
from prove.test_frames_alone import write as write_poses
from scipy.spatial.transform import Rotation

# --- kinds of instruments --------------------------------------------------------------------------------------------


def simulate(folder, kind, count=60):
    """Robot and data of a simulated arm."""
    ran = robocal("simulate", "ur10", "--kind", kind, "-n", count, "-o", folder / kind)
    assert ran.status == 0, ran.said
    return [folder / kind / f for f in ("robot.yaml", "data.yaml")]


def _distance(files, change):
    told = float(re.search(r"distance: ([0-9.]+)", files[1].read_text())[1])
    edit(files[1], (f"distance: {told}", f"distance: {told + change}"))


@obeyed("scale-doubted")
def a_bar(folder):
    files = simulate(folder, "point")
    _distance(files, 0.95)
    first = identify(files)
    _distance(files, -0.95)
    return first, identify(files)


@obeyed("pixels-beyond-fold")
def another_lens(folder):
    files = simulate(folder, "pixels")
    edit(files[1], ("k1: 0,", "k1: -3,"))
    first = identify(files)
    edit(files[1], ("k1: -3,", "k1: 0,"))
    return first, identify(files)


@obeyed("scale-open")
def no_bar(folder):
    files = simulate(folder, "point")
    text = files[1].read_text()
    files[1].write_text(re.sub(r"between:\n.*\n", "", text))
    first = identify(files)
    files[1].write_text(text)
    return first, identify(files)


def _delay(folder, delay):
    files = simulate(folder, "range")
    edit(files[1], ("delay: 0,", f"delay: {delay},"))
    first = identify(files)
    edit(files[1], ("free: []", "free: [delay]"))
    return first, identify(files)


@obeyed("number-wrong")
def delay(folder):
    return _delay(folder, 5)


@obeyed("number-doubted")
def small_delay(folder):
    return _delay(folder, 0.3)


@obeyed("layer-needs")
def layer(folder):
    return identify(simulate(folder, "range"), "--layer"), identify(arm(folder, 60), "--layer")


@obeyed("places-untouched")
def untouched(folder):
    files = simulate(folder, "point", 30)
    edit(files[1], ("  b: {free", "  c: {free: [x, y, z]}\n  b: {free"))
    first = robocal("check", *files)
    edit(files[1], ("  c: {free: [x, y, z]}\n", ""))
    return first, robocal("check", *files)


@obeyed("sigma-assumed")
def no_sigma(folder):
    files = arm(folder)
    edit(files[1], (", sigma: 0.1}", "}"))
    few = ("-n", 20, "--draw", 100)
    first = robocal("plan", *files, *few)
    edit(files[1], ("[x, y, z]}", "[x, y, z], sigma: 0.1}"))
    return first, robocal("plan", *files, *few)


@obeyed("angles-left")
def coarse_angles(folder):
    """Orientations that are coarser than was stated."""
    nominal, true, hand, base, rng = world(3, 0.5)
    q = nominal.draw(rng, 40, 0.6)
    seen = sights(true, q, hand, base, False, rng)
    seen[:, :3, :3] @= Rotation.from_rotvec(0.03 * rng.normal(size=(40, 3))).as_matrix()
    write_poses(folder, nominal, q, seen, False)
    files = [folder / "robot.yaml", folder / "data.yaml"]
    first = identify(files)
    files[1].write_text(re.sub(r"unit: deg, sigma: [0-9.e-]+", "unit: deg, sigma: 1.72", files[1].read_text()))
    return first, identify(files)


@obeyed("angles-unexplained")
def order_of_columns(folder):
    """Components of the rotation vector in another order."""
    nominal, true, hand, base, rng = world(3, 0.5)
    q = nominal.draw(rng, 40, 0.6)
    write_poses(folder, nominal, q, sights(true, q, hand, base, False, rng), False)
    files = [folder / "robot.yaml", folder / "data.yaml"]
    edit(files[1], ("[rx, ry, rz]", "[ry, rx, rz]"))
    first = identify(files)
    edit(files[1], ("[ry, rx, rz]", "[rx, ry, rz]"))
    return first, identify(files)


@obeyed("frames-open")
def hardly_turned(folder):
    """A coarse tracker, a hand that hardly turns, and positions alone."""

    def files(turn):
        nominal, true, hand, base, rng = world(3)
        q = nominal.draw(rng, 1, 0.4) + rng.uniform(-turn, turn, (24, 6))
        there = sights(true, q, hand, base, False, rng, 40.0)[:, :3, 3]
        made = [folder / f for f in nominal.write(folder, q, there, 6e-3)]
        ball = "targets: {ball: {mount: tool, free: true, xyz: [0, 0, 0]}}\n"
        made[1].write_text(made[1].read_text() + ball)
        return made

    frames = ("--free", "tracker,ball")
    return identify(files(0.1), *frames), identify(files(0.8), *frames)


# --- URDF ------------------------------------------------------------------------------------------------------------


def _urdf(folder, *changes):
    """A URDF that is read with other words, and as it should be."""
    file = folder / "u.urdf"
    file.write_text(URDF, encoding="utf-8")
    edit(file, *changes)
    first = robocal("check", file)
    edit(file, *(pair[::-1] for pair in changes))
    return first, robocal("check", file)


@obeyed("urdf-size")
def millimetres(folder):
    return _urdf(folder, ('xyz="0 0 0.3"', 'xyz="0 0 300"'), ('xyz="0.25 0 0"', 'xyz="250 0 0"'))


@obeyed("urdf-limits")
def limits_in_degrees(folder):
    return _urdf(folder, ('lower="-2.5" upper="2.5"', 'lower="-143" upper="143"'))


@obeyed("urdf-turn")
def degrees(folder):
    return _urdf(folder, ('rpy="0.3 0 0"', 'rpy="17.19 0 0"'))


@obeyed("elements-unread")
def misspelt(folder):
    return _urdf(folder, ('<limit lower="-2.5"', '<limits lower="-2.5"'))


@obeyed("tip-chosen")
def tip(folder):
    """A camera beside the last link."""
    file = folder / "u.urdf"
    camera = '<link name="c"/><joint name="f" type="fixed"><parent link="l3"/><child link="c"/></joint></robot>'
    text = URDF.replace('type="revolute"><parent link="l3"', 'type="fixed"><parent link="l3"')
    file.write_text(text.replace("</robot>", camera), encoding="utf-8")
    return robocal("check", file), robocal("check", file, "--tip", "c")


@obeyed("urdf-placeholders")
def efforts(folder):
    file = folder / "a.urdf"
    first = robocal("export", "ur10", "--format", "urdf", "-o", file)
    file.write_text(file.read_text().replace('effort="0" velocity="0"', 'effort="150" velocity="2"'))
    then = robocal("export", "ur10", "--format", "urdf", "--into", file, "-o", folder / "b.urdf")
    assert 'effort="150"' in (folder / "b.urdf").read_text()
    return first, then


@obeyed("urdf-tool-off")
def no_fixed_joint(folder):
    files, whole = arm(folder), folder / "a.urdf"
    assert robocal("export", files[0], "--format", "urdf", "-o", whole).status == 0
    text = whole.read_text()
    bare = re.sub(r'<joint name="tool_fixed".*?</joint>', "", text, flags=re.S).replace('<link name="tool"/>', "")
    (folder / "b.urdf").write_text(bare)
    into = ("export", files[0], "--format", "urdf", "--into")
    return robocal(*into, folder / "b.urdf"), robocal(*into, whole)


@obeyed("csv-commented")
def commented(folder):
    files = arm(folder)
    text = beside(files).read_text()
    beside(files).write_text(f"# {text}")
    first = robocal("check", *files)
    beside(files).write_text(text)
    return first, robocal("check", *files)


@obeyed("other-unit")
def a_key_or_a_unit(folder):
    """A forgotten key may explain the misfit as well."""
    files = arm(folder)
    edit(files[0], ("d: 0, a: 270,", "d: 0,"))
    edit(beside(files), ("[mm]", "[m]"))
    first = robocal("check", *files)
    edit(beside(files), ("[m]", "[mm]"))
    return first, robocal("check", *files)


# --- cable robots ----------------------------------------------------------------------------------------------------


@obeyed("segment-of-either")
def moved_or_reset(folder):
    """Four cables in a plane: zeros that were all reset are nearly an instrument that moved."""

    def step(y, p, w):
        p[23:] += [8e-3, 0, -9e-3]
        return y, p, w

    files = cables(folder, 80, seed=2, name="four", step=0.05, spoil=step)
    first = identify(files)
    begin, end = (int(found(first, rf"--exclude {p}")) for p in (r"(\d+)-", r"\d+-(\d+)"))
    text, later = files[2].read_text(), files[2].with_name("later.yaml")
    files[2].write_text(f"{text}exclude: [{begin}-{end}]\n")
    moved = re.sub("frame: .*", "frame: {name: moved}", text)
    later.write_text(f"{moved}exclude: [2-{begin - 1}]\n")
    return first, identify([*files, later])


@obeyed("lengths-count-the-other-way")
def turned_round(folder):
    return identify(cables(folder, 60, spoil=lambda y, p, w: (-y, p, w))), identify(cables(folder, 60))


@obeyed("cables-in-another-unit")
def metres(folder):
    files = cables(folder, 60)
    changes = [(files[1], "unit: mm}", "unit: m}"), (files[1].with_suffix(".csv"), "[mm]", "[m]")]
    for file, right, wrong in changes:
        edit(file, (right, wrong))
    first = identify(files)
    for file, right, wrong in changes:
        edit(file, (wrong, right))
    return first, identify(files)


@obeyed("slack-cable")
def slack(folder):
    def hang(y, p, w):
        y[:, 2] += np.where(np.arange(len(y)) % 6 == 0, np.linspace(0.02, 0.06, len(y)), 0.0)
        return y, p, w

    files = cables(folder, 60, spoil=hang)
    first = identify(files)
    return first, identify(files, "--exclude", found(first, r"--exclude ([^)]+)\)"))


@obeyed("scale-of-instrument")
def marker(folder):
    files = cables(folder, 60, spoil=lambda y, p, w: (y, 1.01 * p, w))
    edit(files[2], ("sigma: 1, unit: mm}", "sigma: 1, unit: mm}\nscale: {sigma: 0.2 %}"))
    return identify(files), identify(cables(folder, 60))


@obeyed("several-poses")
def three_cables(folder):
    files = cables(folder, 8, seed=1, name="four", zero=0.0, size=0.0)
    four, table, less = files[0].read_text(), beside(files), folder / "three.csv"
    files[0].write_text(re.sub(r"  (- \{name: c4|A4:|B4:).*\n", "", four))
    less.write_text("\n".join(r.rpartition(",")[0] for r in table.read_text().splitlines()) + "\n")
    first = robocal("cable", "forward", files[0], less, "--sigma", 0.001)
    files[0].write_text(four)
    return first, robocal("cable", "forward", files[0], table, "--sigma", 0.001)
