"""More advice on arms, their files and their identification, obeyed."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
from advice import arm, beside, draw, edit, identify, obeyed, see, unseen, write
from advice_arms import one_row
from cli.runs import robocal

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


@obeyed("little-said")
def coarse(folder):
    how = {"noise": 1e-3, "sigma": 1e-3}
    return identify(arm(folder, 26, **how)), identify(arm(folder, 300, **how))


@obeyed("hidden-partners")
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


@obeyed("offsets-missing")
def a_row_short(folder):
    files, run, table = arm(folder, 60, size=0.1, spoil=_off), folder / "run", folder / "offsets.csv"
    identify(files, "-o", run)
    assert robocal("export", run, "--format", "offsets", "-o", table).status == 0
    whole = table.read_text()
    later = arm(folder, 60, size=0.1, spoil=_off, name="later")
    given = ("validate", files[0], later[1], "--offsets", table)
    table.write_text(re.sub("j3,.*\n", "", whole))
    first = robocal(*given)
    table.write_text(whole)
    return first, robocal(*given)


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
