"""More advice on arms, their files and their identification, obeyed."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from advice import arm, beside, cables, draw, edit, found, identify, obeyed, see, unseen, write
from advice_arms import one_row
from cli.runs import robocal
from cli.test_urdf_runs import URDF
from prove.test_frames_alone import seen as sights
from prove.test_frames_alone import world
from prove.test_frames_alone import write as write_poses
from scipy.spatial.transform import Rotation

# --- rows ------------------------------------------------------------------------------------------------------------


def _targets(folder, spoil=None, m=60):
    """Two targets by name, on a tool that is known; `spoil` changes names and where they sit on the tool, (m, 3)."""
    nominal, true, q, rng = draw(m, 1)
    named, on_tool = (np.array(v)[np.arange(m) % 2] for v in (list("AB"), [[0.03, -0.02, 0.11], [0.13, 0.05, 0.11]]))
    if spoil is not None:
        spoil(named, on_tool)
    p = true.point(q, on_tool) + rng.normal(size=(m, 3)) * 1e-4 + [0.5, 0.2, 0.1]
    files = write(folder, nominal, q, p)
    head, *rows = beside(files).read_text().splitlines()
    rows = [f"{r},{n}" for r, n in zip(rows, named, strict=True)]
    beside(files).write_text("\n".join([f"{head},target", *rows]) + "\n")
    free = ", ".join(f"{n}: {{free: true, xyz: [0, 0, 0]}}" for n in dict.fromkeys(named))
    files[1].write_text(files[1].read_text() + f"target: {{column: target}}\ntargets: {{{free}}}\n")
    return files


@obeyed("row-target")
def labels(folder):
    def swap(named, on_tool):
        on_tool[[10, 11]] = on_tool[[11, 10]]

    fixed = ("--fix", "tool")
    return robocal("identify", *_targets(folder, swap), *fixed), robocal("identify", *_targets(folder), *fixed)


@obeyed("segment-of-target")
def moved_target(folder):
    """One of two targets was knocked, and got another name from there on."""

    def knock(named, on_tool, name="B"):
        late = (named == "B") & (np.arange(80) >= 40)
        on_tool[late] += [4e-3, 0, 3e-3]
        named[late] = name

    def rename(named, on_tool):
        knock(named, on_tool, "C")

    fixed = ("--fix", "tool")
    return identify(_targets(folder, knock, 80), *fixed), identify(_targets(folder, rename, 80), *fixed)


def _shift(q, p, rng):
    p[20:26, 1] = p[21:27, 1].copy()
    return q, p


obeyed("row-shifted")(one_row(_shift))


@obeyed("strange")
def suspect(folder):
    """A row that is far off beside what the model leaves anyway."""

    def stray(q, p, rng):
        q = q - 0.004 * rng.uniform(0.5, 1, 6) * np.sin(1.3 * q + rng.uniform(0, 6, 6))
        p[7] += [6e-3, -3.6e-3, 2.4e-3]
        return q, p

    files = arm(folder, 100, spoil=stray)
    return identify(files), identify(files, "--exclude", "9")


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


@obeyed("other-unit")
def a_key_or_a_unit(folder):
    """A forgotten key may explain the misfit as well."""
    files = arm(folder)
    edit(files[0], ("d: 0, a: 270,", "d: 0,"))
    edit(beside(files), ("[mm]", "[m]"))
    first = robocal("check", *files)
    edit(beside(files), ("[m]", "[mm]"))
    return first, robocal("check", *files)


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


@obeyed("csv-commented")
def commented(folder):
    files = arm(folder)
    text = beside(files).read_text()
    beside(files).write_text(f"# {text}")
    first = robocal("check", *files)
    beside(files).write_text(text)
    return first, robocal("check", *files)


# --- what stood elsewhere --------------------------------------------------------------------------------------------


@obeyed("remounted")
def remounted(folder):
    """One target on the tool, 30 mm elsewhere in the second file."""
    nominal, true, q, rng = draw(60)
    tools = np.repeat([[0.03, -0.02, 0.11], [0.06, 0.01, 0.14]], 30, axis=0)
    p = true.point(q, tools) + rng.normal(size=(60, 3)) * 1e-4 + [0.5, 0.2, 0.1]
    files = [*write(folder, nominal, q[:30], p[:30], name="one"), write(folder, nominal, q[30:], p[30:], name="two")[1]]
    first = identify(files)
    for file, name in zip(files[1:], ("A", "B"), strict=True):
        file.write_text(file.read_text() + f"targets: {{{name}: {{free: true, xyz: [0, 0, 0]}}}}\n")
    return first, identify(files, "--fix", "tool")


@obeyed("residual-grows")
def warming(folder):
    def drift(q, p, rng):
        return q, p + np.linspace(0, 1, len(p))[:, None] * [6e-4, 4e-4, -5e-4]

    return identify(arm(folder, 120, spoil=drift)), identify(arm(folder, 120))


@obeyed("late-doubted")
def a_little_late(folder):
    nominal, true, _, rng = draw(60)
    q = nominal.way(rng, 61, 0.05)
    told, between = q[:-1], q[:-1] + 0.006 * (q[1:] - q[:-1])
    first = identify(write(folder, nominal, told, see(true, between, rng)))
    return first, identify(arm(folder, 60))


@obeyed("segment-of-either")
def moved_or_reset(folder):
    """Four cables in a plane: zeros that were all reset are nearly an instrument that moved."""

    def step(y, p, w):
        p[23:] += [8e-3, 0, -9e-3]
        return y, p, w

    files = cables(folder, 80, seed=2, name="four", step=0.05, spoil=step)
    first = identify(files)
    return first, identify(files, "--exclude", found(first, r"--exclude ([\w:.]+-\w+)"))


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


@obeyed("nothing-identified")
def parallel_offsets(folder):
    """Offsets along two parallel axes are one number."""
    nominal, _, q, rng = draw(60)
    longer = nominal.rows.copy()
    longer[1, 1] += 2e-3
    files = write(folder, nominal, q, see(replace(nominal, rows=longer), q, rng))
    return identify(files, "--free", "j2.d,j3.d,tracker"), identify(files, "--free", "j2.d,tracker")


@obeyed("band-too-narrow")
def uneven_noise(folder):
    """Unseen errors of another day are as large as those that were held out."""

    def loud(q, p, rng):
        there = q[:, 0] > 1.2
        p[there] += 4e-4 * rng.normal(size=p[there].shape)
        return q, p

    files, run = arm(folder, 120, spoil=loud), folder / "run"
    first = identify(files, "-o", run)
    later = arm(folder, 300, spoil=loud, name="later")
    edit(later[0], ("0], free: true", "0], free: false"))
    then = robocal("validate", run, later[1], "--json")
    assert abs(then.document["errors"]["this"]["mean"] / unseen(first) - 1) < 0.3
    return first, then


# --- options ---------------------------------------------------------------------------------------------------------


@obeyed("leave-one-out-left")
def one_by_one(folder):
    files = arm(folder, 26)
    few = ("--method", "particle", "--particles", 50, "--fix", "j3,j4,j5,j6")
    return identify(files, *few), identify(files, *few, "--leave-one-out")


@obeyed("at-bound")
def bound(folder):
    files = arm(folder, 60)
    edit(files[0], ("beta]}", "beta], bounds: {j4.d: [301.99, 302.01]}}"))
    first = identify(files)
    edit(files[0], ("301.99, 302.01", "290, 314"))
    return first, identify(files)


@obeyed("rank-zero")
def nothing_seen(folder):
    """The last zero turns a target about itself."""
    files = arm(folder, 60)
    edit(files[0], ("xyz: [30, -20, 110]", "xyz: [0, 0, 110]"))
    edit(files[1], ("free: true", "free: false, xyz: [500, 200, 100]"))
    return identify(files, "--free", "j6.theta"), identify(files)


@obeyed("little-said", "hidden-partners")
def hidden(folder):
    return identify(arm(folder, 40, share=0.1)), identify(arm(folder, 200))


def _far(folder, noise):
    """A nominal model that is nothing like the robot, and one that is."""
    nominal, true, q, rng = draw(60, size=40.0)
    p = see(true, q, rng, noise)
    near = replace(nominal, rows=true.rows + 1e-3 * rng.normal(size=true.rows.shape))
    return identify(write(folder, nominal, q, p, noise)), identify(write(folder, near, q, p, noise))


@obeyed("implausible")
def another_robot(folder):
    return _far(folder, 1e-4)


@obeyed("bent")
def another_robot_before_a_coarse_instrument(folder):
    return _far(folder, 5e-3)


@obeyed("filter-unsettled")
def unsettled(folder):
    files = arm(folder, 60)
    return identify(files, "--method", "ekf", "--iterations", 2), identify(files)


@obeyed("frames-not-explained")
def frames_alone(folder):
    files = arm(folder, 60, spoil=lambda q, p, rng: (q + np.radians([0, 4, -3, 5, 2, 0]), p))
    return identify(files, "--free", "tracker"), identify(files)


# --- the zeros alone -------------------------------------------------------------------------------------------------


OFF = (0, 0.4, 0.3, -0.6, 0.5, 0)


def _off(q, p, rng):
    return q + np.radians(OFF), p


@obeyed("offsets-proven")
def offsets(folder):
    """What the controller is given are the zeros that were lost."""
    files, run, table = arm(folder, 60, size=0.1, spoil=_off), folder / "run", folder / "offsets.csv"
    first = identify(files, "-o", run)
    then = robocal("export", run, "--format", "offsets", "-o", table)
    rows = [r.split(",") for r in table.read_text().splitlines() if r.startswith("j")]
    told = {r[0]: float(r[1]) for r in rows if r[0] != "joint"}
    assert all(abs(told[j] + v) < 0.1 for j, v in zip(("j2", "j3", "j4", "j5"), OFF[1:5], strict=True)), told
    return first, then


@obeyed("offsets-not-proven")
def whole_model(folder):
    """Twists alone are off: the whole model, on measurements of another day."""
    nominal, true, q, rng = draw(60)
    true = replace(true, rows=nominal.rows + (true.rows - nominal.rows) * [0, 0, 0, 1, 0])
    files, run = write(folder, nominal, q, see(true, q, rng)), folder / "run"
    first = identify(files, "-o", run)
    q = nominal.draw(rng, 100)
    later = write(folder, nominal, q, see(true, q, rng), name="later")
    edit(later[0], ("0], free: true", "0], free: false"))
    means = [robocal("validate", r, later[1], "--json") for r in (later[0], run)]
    nominally, wholly = (r.document["errors"]["this"]["mean"] for r in means)
    assert wholly < 0.5 * nominally
    return first, means[1]


@obeyed("offsets-unseen")
def zeros_unseen(folder):
    """One joint alone moves."""
    nominal, true, q, rng = draw(40)
    q[:, 1:] = [-0.4, 0.3, 0.2, 0.8, 0.1]
    return identify(write(folder, nominal, q, see(true, q, rng))), identify(arm(folder, 100, spoil=_off))


@obeyed("below-the-rest")
def on_the_last_axis(folder):
    """A target on the axis of the last joint does not see its zero."""
    nominal, true, q, rng = draw(60)

    def files(tool, name):
        there, made = (replace(a, tool=np.array(tool)) for a in (true, nominal))
        return write(folder, made, q, see(there, q, rng), name=name)

    near, far = files([0, 0, 0.11], "near"), files([0.15, 0.1, 0.11], "far")
    return identify(near, "--fix", "tool"), identify(far, "--fix", "tool")


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


@obeyed("several-poses")
def three_cables(folder):
    files = cables(folder, 8, seed=1, name="four", zero=0.0, size=0.0)
    four, table, less = files[0].read_text(), beside(files), folder / "three.csv"
    files[0].write_text(re.sub(r"  (- \{name: c4|A4:|B4:).*\n", "", four))
    less.write_text("\n".join(r.rpartition(",")[0] for r in table.read_text().splitlines()) + "\n")
    first = robocal("cable", "forward", files[0], less, "--sigma", 0.001)
    files[0].write_text(four)
    return first, robocal("cable", "forward", files[0], table, "--sigma", 0.001)
