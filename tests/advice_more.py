"""More advice on arms, their files and their identification, obeyed."""

from __future__ import annotations

import numpy as np
from advice import arm, beside, draw, edit, found, identify, obeyed, see, write
from advice_arms import one_row
from cli.runs import Ran, robocal

# --- rows ------------------------------------------------------------------------------------------------------------


def _targets(folder, spoil=None, m=60, name=""):
    """Two targets by name, on a tool that is known; `spoil` changes names and readings."""
    nominal, true, q, rng = draw(m, 1)
    tools = np.array([[0.03, -0.02, 0.11], [0.13, 0.05, 0.11]])
    at = np.arange(m) % 2
    p = true.point(q, tools[at]) + rng.normal(size=(m, 3)) * 1e-4 + [0.5, 0.2, 0.1]
    named = np.array(list("AB"))[at]
    if spoil is not None:
        named, p = spoil(named.copy(), p)
    files = write(folder, nominal, q, p, name=name)
    head, *rows = beside(files).read_text().splitlines()
    rows = [f"{r},{n}" for r, n in zip(rows, named, strict=True)]
    beside(files).write_text("\n".join([f"{head},target", *rows]) + "\n")
    free = ", ".join(f"{n}: {{free: true, xyz: [0, 0, 0]}}" for n in dict.fromkeys(named))
    files[1].write_text(files[1].read_text() + f"target: {{column: target}}\ntargets: {{{free}}}\n")
    return files


@obeyed("row-target")
def labels(folder):
    def swap(named, p):
        named[[10, 11]] = named[[11, 10]]
        return named, p

    fixed = ("--fix", "tool")
    return robocal("identify", *_targets(folder, swap), *fixed), robocal("identify", *_targets(folder), *fixed)


@obeyed("segment-of-target")
def moved_target(folder):
    def step(named, p):
        p[30:][named[30:] == "B"] += [4e-3, 0, 3e-3]
        return named, p

    def rename(named, p):
        named, p = step(named, p)
        named[30:][named[30:] == "B"] = "C"
        return named, p

    fixed = ("--fix", "tool")
    return identify(_targets(folder, step), *fixed), identify(_targets(folder, rename), *fixed)


def _zeros(q, p, rng):
    p[[7, 20]] = 0.0
    return q, p


def _shift(q, p, rng):
    p[20:26, 1] = p[21:27, 1].copy()
    return q, p


obeyed("row-zero")(one_row(_zeros))
obeyed("row-shifted")(one_row(_shift))


@obeyed("strange")
def suspect(folder):
    def off(q, p, rng):
        p[[7, 20]] += [[6e-4, -7e-4, 5e-4], [-7e-4, 6e-4, 6e-4]]
        return q, p

    files = arm(folder, 60, spoil=off)
    return identify(files), identify(files, "--exclude", "9,22")


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


# --- options ---------------------------------------------------------------------------------------------------------


@obeyed("leave-one-out-left")
def one_by_one(folder):
    files = arm(folder, 26)
    few = ("--method", "ekf", "--fix", "j2,j3,j4,j5,j6")
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
    files = arm(folder, 60)
    return identify(files, "--free", "j6.alpha"), identify(files)


@obeyed("little-said", "hidden-partners")
def hidden(folder):
    return identify(arm(folder, 40, share=0.1)), identify(arm(folder, 200))


@obeyed("not-linear")
def far(folder):
    """One step and the iteration that is needed."""
    files = arm(folder, 60, size=40.0)
    return identify(files), identify(files)


@obeyed("particles-stuck")
def stuck(folder):
    files = arm(folder, 26)
    few = ("--fix", "j2,j3,j4,j5,j6")
    return identify(files, *few, "--method", "particle", "--particles", 50), identify(files, *few)


# --- the zeros alone -------------------------------------------------------------------------------------------------


def _off(q, p, rng):
    return q + np.radians([0, 0.4, 0.3, -0.6, 0.5, 0]), p


@obeyed("offsets-proven")
def offsets(folder):
    """The controller with its new zeros, beside the old ones."""
    files, run = arm(folder, 60, size=0.1, spoil=_off), folder / "run"
    first = identify(files, "-o", run)
    table = folder / "offsets.csv"
    written = robocal("export", run, "--format", "offsets", "-o", table)
    assert written.status == 0, written.said
    return first, written


@obeyed("offsets-unseen", "below-the-rest")
def zeros_unseen(folder):
    return identify(arm(folder, 40, share=0.02, size=0.1)), identify(arm(folder, 100, spoil=_off))


@obeyed("offsets-not-proven")
def no_offsets(folder):
    return identify(arm(folder, 40)), identify(arm(folder, 40))
