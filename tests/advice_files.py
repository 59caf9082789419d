"""Advice on files, and on what is done with a run, obeyed."""

from __future__ import annotations

from advice import arm, beside, edit, identify, obeyed
from cli.runs import Ran, robocal


def check(files, *options) -> Ran:
    return robocal("check", *files, *options)


def change(file, at, how):
    """A row of a table with other text."""
    rows = file.read_text(encoding="utf-8").splitlines()
    rows[at] = how(rows[at])
    file.write_text("\n".join(rows) + "\n", encoding="utf-8")


@obeyed("robot-size")
def robot_size(folder):
    files = arm(folder)
    edit(files[0], ("length: mm", "length: m"))
    first = check(files[:1])
    edit(files[0], ("length: m,", "length: mm,"))
    return first, check(files[:1])


@obeyed("over-a-turn")
def over_a_turn(folder):
    files = arm(folder)
    edit(files[0], ("alpha: -90", "alpha: -5156"))
    first = check(files[:1])
    edit(files[0], ("alpha: -5156", "alpha: -90"))
    return first, check(files[:1])


@obeyed("outside-limits")
def outside(folder):
    files = arm(folder)
    edit(files[0], ("limits: [-165, 165]", "limits: [-16, 16]"))
    first = check(files)
    edit(files[0], ("limits: [-16, 16]", "limits: [-165, 165]"))
    return first, check(files)


@obeyed("copied")
def copied(folder):
    files = arm(folder)
    rows = beside(files).read_text().splitlines()
    beside(files).write_text("\n".join([*rows[:9], rows[5], rows[6], *rows[9:]]) + "\n")
    return check(files), check(files, "--exclude", "10-11")


@obeyed("repeats-differ")
def repeats(folder):
    files = arm(folder)
    rows = beside(files).read_text().splitlines()
    moved = []
    for r in rows[3:6]:
        cut = r.split(",")
        moved.append(",".join([*cut[:6], f"{float(cut[6]) + 9:.6f}", *cut[7:]]))
    beside(files).write_text("\n".join([*rows, *moved]) + "\n")
    return check(files), check(files, "--exclude", "42-44")


@obeyed("rows-excluded")
def excluded(folder):
    files = arm(folder)
    return check(files, "--exclude", "5-9"), check(files)


@obeyed("rows-missing")
def missing(folder):
    files = arm(folder)
    edit(files[1], ("units:", "csv: {missing: skip}\nunits:"))
    text = beside(files).read_text()
    for at in (5, 8):
        change(beside(files), at, lambda r: ",".join([*r.split(",")[:-1], ""]))
    first = check(files)
    beside(files).write_text(text)
    return first, check(files)


@obeyed("columns-unread")
def unread(folder):
    files = arm(folder)
    rows = beside(files).read_text().splitlines()
    beside(files).write_text("\n".join([rows[0] + ",tme [s]", *(f"{r},{i}" for i, r in enumerate(rows[1:]))]) + "\n")
    first = check(files)
    edit(beside(files), ("tme [s]", "time [s]"))
    edit(files[1], ("frame:", "configuration: {time: time}\nframe:"))
    return first, check(files)


@obeyed("csv-title")
def title(folder):
    files = arm(folder)
    text = beside(files).read_text()
    beside(files).write_text("measured in May\nby us\n" + text)
    first = check(files)
    beside(files).write_text("# measured in May\n# by us\n" + text)
    return first, check(files)


@obeyed("csv-western")
def western(folder):
    files = arm(folder)
    text = beside(files).read_text().replace("j1 [deg]", "j1 [°]")
    beside(files).write_bytes(text.encode("cp1252"))
    first = check(files)
    beside(files).write_text(text, encoding="utf-8")
    return first, check(files)


@obeyed("fitted-to-these")
def same_data(folder):
    files, run = arm(folder), folder / "run"
    identify(files, "-o", run)
    other = arm(folder, seed=0, name="other", m=60)
    return robocal("validate", run, files[1]), robocal("validate", run, other[1])


@obeyed("gain-proven")
def use(folder):
    """The corrected robot on measurements of another day, beside the nominal one."""
    files, run = arm(folder, 60), folder / "run"
    first = identify(files, "-o", run)
    other = arm(folder, name="other", m=200)
    edit(other[0], ("0], free: true", "0], free: false"))
    nominal, corrected = (robocal("validate", robot, other[1], "--json") for robot in (files[0], run))
    mean = [r.document["errors"]["this"]["mean"] for r in (nominal, corrected)]
    assert mean[1] < 0.5 * mean[0]
    return Ran(3, first.out, first.err), corrected
