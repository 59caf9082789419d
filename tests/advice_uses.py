"""Advice on what is done with a robot and its runs, obeyed."""

from __future__ import annotations

import numpy as np
from advice import arm, beside, cables, edit, found, identify, obeyed
from cli.runs import Ran, robocal


@obeyed("same-measurements")
def same_measurements(folder):
    one, two = folder / "one", folder / "two"
    identify(arm(folder, 60), "-o", one)
    identify(arm(folder, 80, name="later"), "-o", two)
    return robocal("drift", one, one), robocal("drift", one, two)


@obeyed("run-refused")
def refused(folder):
    one, two = folder / "one", folder / "two"
    identify(arm(folder, 60, spoil=lambda q, p, rng: (q[rng.permutation(len(q))], p)), "-o", one)
    identify(arm(folder, 80, name="later"), "-o", two)
    first = robocal("drift", one, two)
    identify(arm(folder, 60), "-o", one, "--force")
    return first, robocal("drift", one, two)


@obeyed("zero-lost")
def zero(folder):
    def lost(q, p, rng):
        return q + np.radians([0, 4, 0, -6, 0, 0]), p

    files, run = arm(folder, 60, spoil=lost), folder / "run"
    first = identify(files, "-o", run)
    later = arm(folder, 200, spoil=lost, name="later")
    edit(later[0], ("0], free: true", "0], free: false"))
    means = [robocal("validate", r, later[1], "--json") for r in (later[0], run)]
    nominal, corrected = (r.document["errors"]["this"]["mean"] for r in means)
    assert corrected < 0.1 * nominal
    return Ran(3, first.out, first.err), means[1]


@obeyed("readings-still")
def still(folder):
    files = arm(folder, spoil=lambda q, p, rng: (q, np.repeat(p[:1], len(p), axis=0)))
    return identify(files), identify(arm(folder))


@obeyed("column-carried")
def carried(folder):
    files = arm(folder)
    rows = beside(files).read_text().splitlines()
    beside(files).write_text(
        "\n".join([rows[0] + ",warm", *(f"{r},{20 + i / 9:.3f}" for i, r in enumerate(rows[1:]))]) + "\n"
    )
    edit(files[1], ("frame:", "configuration: {temperatur: {column: warm, unit: K}}\nframe:"))
    first = identify(files)
    edit(files[1], ("{temperatur:", "{temperature:"))
    return first, identify(files)


@obeyed("keys-unstated")
def unstated(folder):
    files = arm(folder)
    text = files[0].read_text()
    files[0].write_text(text.replace("d: 0, a: 70,", "a: 70,"))
    first = robocal("check", files[0])
    files[0].write_text(text)
    return first, robocal("check", files[0])


# --- cable robots ----------------------------------------------------------------------------------------------------


@obeyed("segment-of-zeros")
def reset(folder):
    def again(y, p, w):
        y[30:] += np.linspace(-0.03, 0.03, y.shape[1])
        return y, p, w

    files = cables(folder, 60, spoil=again)
    first = identify(files)
    return first, identify(files, "--exclude", found(first, r"--exclude (\w+-\w+)"))


@obeyed("position-axes")
def axes(folder):
    return identify(cables(folder, spoil=lambda y, p, w: (y, p * [-1, 1, 1], w))), identify(cables(folder))


@obeyed("orientations-inverted")
def inverted(folder):
    return identify(cables(folder, spoil=lambda y, p, w: (y, p, -w))), identify(cables(folder))


@obeyed("left-handed-poses")
def left_handed(folder):
    wrong = cables(folder, spoil=lambda y, p, w: (y, p * [1, -1, 1], w * [-1, 1, -1]))
    return identify(wrong), identify(cables(folder))


def _forward(folder, off, *options):
    def spoil(y, p, w):
        y[3, 2] += off
        return y, p, w

    files = cables(folder, 8, zero=0.0, size=0.0, spoil=spoil)
    return robocal("cable", "forward", files[0], files[1].with_suffix(".csv"), *options)


@obeyed("lengths-left")
def lengths_left(folder):
    return _forward(folder, 0.2), _forward(folder, 0.0, "--sigma", 0.001)


@obeyed("lengths-unexplained")
def lengths_unexplained(folder):
    return _forward(folder, 0.2, "--sigma", 0.001), _forward(folder, 0.0, "--sigma", 0.001)


def _path(folder, *options):
    files = cables(folder, 8, step=0.02)
    return robocal("cable", "contact", files[0], files[2].with_suffix(".csv"), *options)


@obeyed("no-diameter")
def diameter(folder):
    return _path(folder), _path(folder, "--diameter", 0.004)


@obeyed("tensions-not-asked")
def tensions(folder):
    return _path(folder), _path(folder, "--limits", "1,5000", "--mass", 20)
