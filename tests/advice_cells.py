"""Advice on load cells, tensions and drifts of cable robots, obeyed."""

from __future__ import annotations

import shutil

import numpy as np
from advice import cables, identify, obeyed
from advice_statics import HOLDS, listed
from cli.runs import Ran, robocal
from listings import rows_of
from worlds import Cables

LOAD = """robocal: 1
kind: load
file: load.csv
load: {columns: [t1, t2, t3, t4, t5, t6, t7, t8], unit: N, sigma: 0.5}
free: [mass, cx, cy, cz]
configuration: {id: id}
"""


def built(folder, m=60, seed=0):
    """A robot as it was drawn, as it was built, poses at which it hangs, and the tensions there."""
    rng = np.random.default_rng(seed)
    nominal = Cables.nominal("eight", rng)
    true = nominal.true(rng)
    p, w = nominal.draw(rng, 2 * m, half=np.array([0.7, 0.5, 0.5]), turn=0.12)
    y = np.zeros((2 * m, 8))
    files = [folder / f for f in true.write(folder, y, p, w, 1e-3)]
    files[0].write_text(files[0].read_text() + HOLDS)
    held = rows_of(
        robocal("cable", "tension", files[0], folder / "poses.csv", "--method", "mid", "--json").document["poses"]
    )
    at = [k for k, r in enumerate(held) if r["feasible"]][:m]
    return nominal, true, p[at], w[at], np.array([held[k]["tension"] for k in at]), rng


def cell(folder, change=lambda t: t, more=HOLDS, where="load"):
    """Lengths, poses and tensions: of load cells, or in the file of the lengths."""
    nominal, true, p, w, t, rng = built(folder)
    soft = 2.5e-6 if more == ELASTIC else 0.0
    y = (true.lengths(p, w) + true.l0) / (1 + soft * t) - true.l0 + 3e-4 * rng.normal(size=t.shape)
    near = [v + 2e-4 * rng.normal(size=v.shape) for v in (p, w)]
    files = [folder / f for f in nominal.write(folder, y, *near, 3e-4)]
    files[0].write_text(files[0].read_text() + more)
    rows = change(t + 0.5 * rng.normal(size=t.shape))
    if where == "load":
        head = ",".join(["id", *(f"t{i}" for i in range(1, 9))])
        listed(
            folder,
            *(f"p{k:04d}," + ",".join(f"{v:.4f}" for v in r) for k, r in enumerate(rows)),
            head=head,
            name="load.csv",
        )
        (folder / "load.yaml").write_text(LOAD)
        return [*files, folder / "load.yaml"]
    table = folder / "lengths.csv"
    head, *told = table.read_text().splitlines()
    told = [f"{a}," + ",".join(f"{v:.4f}" for v in r) for a, r in zip(told, rows, strict=True)]
    table.write_text("\n".join([",".join([head, *(f"t{i}" for i in range(1, 9))]), *told]) + "\n")
    files[1].write_text(
        files[1].read_text() + f"tension: {{columns: [{', '.join(f't{i}' for i in range(1, 9))}], unit: N}}\n"
    )
    return files


def mended(change):
    def make(folder):
        return identify(cell(folder, change)), identify(cell(folder))

    return make


obeyed("cells-weigh")(mended(lambda t: t / 9.80665))
obeyed("not-at-rest")(mended(lambda t: t[:, ::-1]))
obeyed("tensions-exchanged")(mended(lambda t: t[:, [1, 0, *range(2, 8)]]))
obeyed("tensions-shifted")(mended(lambda t: np.roll(t, 1, axis=0)))


ELASTIC = HOLDS.replace("tension:", "elasticity: 2.5e-6, tension:")


@obeyed("tensions-weigh")
def weigh(folder):
    """Tensions in kgf of which the file says N."""
    return identify(cell(folder, lambda t: t / 9.80665, ELASTIC, "lengths")), identify(
        cell(folder, lambda t: t, ELASTIC, "lengths")
    )


@obeyed("stretch-left")
def stretch(folder):
    files = cell(folder, more=ELASTIC)[:3]
    return identify(files), identify(cell(folder, lambda t: t, ELASTIC, "lengths"))


# --- drift ------------------------------------------------------------------------------------------------------------


def runs(folder, *changes, zeros=True):
    """Runs of one robot, before each of which something of it changed."""
    rng = np.random.default_rng(3)
    nominal = Cables.nominal("eight", rng)
    true, out = nominal.true(rng), []
    for k, change in enumerate(changes):
        true = change(true)
        p, w = nominal.draw(rng, 60)
        y = true.lengths(p, w) + 3e-4 * rng.normal(size=(60, 8))
        at = folder / f"d{k}"
        at.mkdir()
        near = [v + 3e-4 * rng.normal(size=v.shape) for v in (p, w)]
        files = [at / f for f in nominal.write(at, y, *near, 3e-4)]
        identify(files, "-o", folder / f"r{k}")
        out.append(folder / f"r{k}")
    return out


def same(true):
    return true


def moved(true, by=5e-3, cable=5):
    return Cables(true.a + by * np.outer(np.arange(8) == cable, [1, 0, 0]), true.b, true.l0)


def counted(by):
    def change(true):
        return Cables(true.a, true.b, true.l0 + np.array(by) * np.arange(1, 9) / 8)

    return change


def drift(*words):
    return robocal("cable", "drift", *words)


@obeyed("smallest-drift-free")
def unchanged(folder):
    two = runs(folder, same, same)
    return drift(*two), drift(*two, "--zeros-unchanged")


@obeyed("anchor-moved")
def later(folder):
    """Lengths of another day, at known poses: the later calibration is nearer."""
    two = runs(folder, same, moved)
    first = drift(*two, "--zeros-unchanged")
    return first, drift(two[1], *runs_of_later(folder), "--zeros-unchanged")


def runs_of_later(folder):
    place = folder / "again"
    place.mkdir()
    return [runs(place, same, moved, same)[2]]


@obeyed("anchor-or-zero")
def either(folder):
    """An anchor that moved by 7 mm towards the platform, of sensors that counted on."""

    def nearer(true):
        to = true.a.mean(axis=0) - true.a[5]
        return Cables(true.a + np.outer(np.arange(8) == 5, 0.007 * to / np.linalg.norm(to)), true.b, true.l0)

    two = runs(folder, same, nearer)
    return drift(*two), drift(*two, "--zeros-unchanged")


@obeyed("measurements-shared")
def shared(folder):
    one, two = runs(folder, same, same)
    identify([folder / "d0" / f for f in ("robot.yaml", "lengths.yaml")], "-o", folder / "part")
    return drift(one, folder / "part", "--base-moves"), drift(one, two, "--base-moves")


@obeyed("nothing-known-of-errors")
def files_alone(folder):
    two = runs(folder, same, same)
    alone = [shutil.copy(r / "calibrated.yaml", folder / f"{r.name}.yaml") for r in two]
    return drift(*alone), drift(*two)


@obeyed("base-not-measured")
def no_instrument(folder):
    one, two = runs(folder, same, same)
    for k in (0, 1):
        identify([folder / f"d{k}" / f for f in ("robot.yaml", "lengths.yaml")], "-o", folder / f"alone{k}")
    return drift(folder / "alone0", folder / "alone1"), drift(one, two)


@obeyed("zeros-changed")
def power_up(folder):
    """Runs of one power-up are compared instead."""
    one, two, three = runs(folder, same, counted(0.05), same)
    return drift(one, two), drift(two, three, "--zeros-unchanged")


@obeyed("size-changed")
def scale(folder):
    """Lengths and marker in units 0.3 % too large; then read by their true scale."""
    one, two = runs(folder, same, same)
    files = [folder / "d1" / f for f in ("robot.yaml", "lengths.yaml", "poses.yaml")]
    for table, until in (("lengths.csv", 9), ("poses.csv", 4)):
        head, *rows = (folder / "d1" / table).read_text().splitlines()
        cut = [r.split(",") for r in rows]
        rows = [",".join([r[0], *(f"{1.003 * float(v):.6f}" for v in r[1:until]), *r[until:]]) for r in cut]
        (folder / "d1" / table).write_text("\n".join([head, *rows]) + "\n")
    identify(files, "-o", folder / "wrong")
    return drift(one, folder / "wrong"), drift(one, two)


# --- gains of drums --------------------------------------------------------------------------------------------------


@obeyed("cable-file-lacks")
def drums(folder):
    """Zeros of two power-ups: the file gets those of the one that is on by `cable rezero`, and forward reads lengths by it."""
    files = cables(folder, 60, zero=0.2)
    table, text = files[1].with_suffix(".csv"), files[1].read_text()
    head, *rows = table.read_text().splitlines()
    later = [r.split(",") for r in rows[30:]]
    later = [",".join([r[0], *(f"{float(v) + 40:.6f}" for v in r[1:])]) for r in later]
    table.write_text("\n".join([head, *rows[:30]]) + "\n")
    (folder / "later.csv").write_text("\n".join([head, *later]) + "\n")
    files[1].write_text(text + "zeros: monday\n")
    (folder / "later.yaml").write_text(text.replace(table.name, "later.csv") + "zeros: evening\n")
    first = identify([*files, folder / "later.yaml"], "-o", folder / "run")
    (folder / "now.csv").write_text("\n".join([head, *later[:10]]) + "\n")
    told = robocal(
        "cable",
        "rezero",
        folder / "run",
        folder / "now.csv",
        "--poses",
        files[2].with_suffix(".csv"),
        "-o",
        folder / "now.yaml",
    )
    assert told.status == 0, told.said
    then = robocal(
        "cable", "forward", folder / "now.yaml", folder / "later.csv", "--sigma", 0.002, "--json", "--starts", 0
    )
    assert np.mean([np.abs(r["residual"]).mean() for r in rows_of(then.document["poses"])]) < 2e-3
    return Ran(3, first.out, first.err), then


@obeyed("zeros-disagree")
def zeros_of_poses(folder):
    """Two rows of the lengths changed places: their zeros differ by metres; each beside its own pose, they agree."""
    files = cables(folder, 60, sigma=1e-5, size=0.0, zero=0.3)
    head, *rows = files[1].with_suffix(".csv").read_text().splitlines()
    one, other = (r.split(",", 1) for r in rows[:2])
    ran = []
    for name, first, second in (("wrong", other[1], one[1]), ("right", one[1], other[1])):
        table = folder / f"{name}.csv"
        table.write_text("\n".join([head, f"{one[0]},{first}", f"{other[0]},{second}"]) + "\n")
        poses = files[2].with_suffix(".csv")
        ran.append(
            robocal(
                "cable", "rezero", files[0], table, "--poses", poses, "--sigma", 0.001, "-o", folder / f"{name}.yaml"
            )
        )
    return ran
