"""Advice on what is compared or brought from elsewhere: verify, import, drift, truth; obeyed."""

from __future__ import annotations

import json
import re

import numpy as np
from advice import SIGMA, arm, draw, found, identify, obeyed, see, write
from cli.runs import Ran, robocal
from cli.test_cable_import import CROSSED, EIGHT, PARENT, SPRING, body, links, planar, sets, spatial
from cli.test_cable_import import cables as rows_of_cables
from run_folders import earlier

from robocal.files.cable.cable_robot import read_cable

# --- verify: what a source has that the reference has not, corrected -------------------------------------------------


def _verify(spoil):
    def make(folder):
        rng = np.random.default_rng(5)
        p, w = rng.uniform(-1, 1, (12, 3)), 0.4 * rng.normal(size=(12, 3))
        near = p + 1e-3 * rng.normal(size=p.shape)
        for name, rows in (("tracker", (p, w)), ("robot", (near, w)), ("wrong", spoil(near, w))):
            lines = (
                f"p{i},{','.join(f'{v:.9g}' for v in (*a, *b))}" for i, (a, b) in enumerate(zip(*rows, strict=True))
            )
            head = "id,x [m],y [m],z [m],rx [rad],ry [rad],rz [rad]"
            (folder / f"{name}.csv").write_text("\n".join([head, *lines]) + "\n")
        return tuple(robocal("verify", folder / "tracker.csv", folder / f"{n}.csv") for n in ("wrong", "robot"))

    return make


obeyed("unlike-mirrored")(_verify(lambda p, w: (p[:, [1, 0, 2]], w)))
obeyed("unlike-scaled")(_verify(lambda p, w: (p * 1000, w)))
obeyed("unlike-shifted")(_verify(lambda p, w: (np.roll(p, 1, axis=0), np.roll(w, 1, axis=0))))
obeyed("unlike-still")(_verify(lambda p, w: (1e-4 * p, w)))
obeyed("unlike-turn-inverted")(_verify(lambda p, w: (p, -w)))
obeyed("unlike-turn-unit")(_verify(lambda p, w: (p, np.radians(w))))
obeyed("unlike-unknown")(_verify(lambda p, w: (p[[3, 7, 1, 0, 9, 2, 11, 4, 5, 10, 8, 6]], w)))


@obeyed("poses-not-in-all")
def left_out(folder):
    make = _verify(lambda p, w: (p, w))
    make(folder)
    right = (folder / "robot.csv").read_text()
    (folder / "robot.csv").write_text(right.replace("\np1", "\nq1"))
    first = robocal("verify", folder / "tracker.csv", folder / "robot.csv")
    (folder / "robot.csv").write_text(right)
    return first, robocal("verify", folder / "tracker.csv", folder / "robot.csv")


# --- import: models of CASPR -----------------------------------------------------------------------------------------


@obeyed("said-of-some")
def some(folder):
    stiff, plain = rows_of_cables(EIGHT[:4], **SPRING), rows_of_cables(EIGHT[4:])
    first = robocal("import", spatial(sets(used=stiff + plain)).write(folder))
    return first, robocal("import", spatial(sets(used=rows_of_cables(EIGHT, **SPRING))).write(folder))


@obeyed("cable-sets-aside")
def another_set(folder):
    """The set that is asked for stands in the robot.yaml, whose cables are those of that set."""
    model = spatial(sets(used=rows_of_cables(EIGHT), spare=rows_of_cables(CROSSED))).write(folder)
    first = robocal("import", model)
    then = robocal("import", model, "--cables", "spare", "-o", folder / "spare.yaml")
    robot = read_cable(folder / "spare.yaml").robot
    assert (
        then.status == 0
        and np.allclose(robot.a, [a for a, _ in CROSSED])
        and np.allclose(robot.b, [b for _, b in CROSSED])
    )
    return Ran(3, first.out, first.err), then


@obeyed("inertia-of-no-body")
def moments(folder):
    bad = planar("PLANAR_XZ")
    bad.bodies = bad.bodies.replace("<Iyy>0.625", "<Iyy>5")
    first = robocal("import", bad.write(folder))
    return first, robocal("import", planar("PLANAR_XZ").write(folder))


@obeyed("counted-from-elsewhere")
def from_elsewhere(folder):
    """Lengths of CASPR at its positions are those of robot.yaml at these and what is told."""
    model = spatial(bodies=links(body(parent=PARENT.replace("0 0 0", "0.5 0 1")))).write(folder)
    first = robocal("import", model, "-o", folder / "robot.yaml")
    told = [
        float(found(first, rf"counts the platform's position from {'[-0-9.e]+, ' * i}([-0-9.e]+)")) for i in range(3)
    ]
    of_caspr = np.array([0.1, 0.2, 0.4])
    at = of_caspr + told
    (folder / "p.csv").write_text(
        "id,x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]\na," + ",".join(map(str, at)) + ",0,0,0\n"
    )
    then = robocal("cable", "inverse", folder / "robot.yaml", folder / "p.csv")
    lengths = [float(v) for v in then.out.splitlines()[1].split(",")[1:]]
    a, b = (np.array([e[i] for e in EIGHT]) for i in (0, 1))
    assert np.allclose(lengths, np.linalg.norm(of_caspr + [0.5, 0, 1] + b - a, axis=1), atol=1e-6), lengths
    return first, then


# --- drift -----------------------------------------------------------------------------------------------------------


def _runs(folder, *counts, noise=SIGMA, grown=0.0):
    """Runs of one arm, of that many measurements; of the last one a link grew."""
    out = []
    for k, m in enumerate(counts):
        nominal, true, _, _ = draw()
        rng = np.random.default_rng(k + 5)
        if grown and k == len(counts) - 1:
            true.rows[1, 2] += grown
        q = nominal.draw(rng, m)
        files = write(folder, nominal, q, see(true, q, rng, noise), noise, name=f"d{k}")
        identify(files, "-o", folder / f"r{k}")
        out.append(folder / f"r{k}")
    return out


@obeyed("change-open")
def undecided(folder):
    one, two, three, four = _runs(folder, 30, 30, 200, 200)
    return robocal("drift", one, two), robocal("drift", three, four)


@obeyed("change-above")
def grew(folder):
    """The later run meets what is measured later, the earlier one does not."""
    one, two = _runs(folder, 60, 60, grown=1e-3)
    first = robocal("drift", one, two)
    nominal, true, _, _ = draw()
    true.rows[1, 2] += 1e-3
    rng = np.random.default_rng(99)
    q = nominal.draw(rng, 60)
    later = write(folder, nominal, q, see(true, q, rng), name="later")
    means = [robocal("validate", r, later[1], "--json") for r in (one, two)]
    before, after = (m.document["errors"]["this"]["mean"] for m in means)
    assert after < 0.6 * before, (before, after)
    return Ran(3, first.out, first.err), means[1]


@obeyed("rows-not-kept")
def without_rows(folder):
    one, two = _runs(folder, 60, 60)
    known = json.loads((two / "covariance.json").read_text())
    del known["rows"]
    (earlier(two) / "covariance.json").write_text(json.dumps(known))
    first = robocal("drift", one, two)
    identify([folder / "d1" / f for f in ("robot.yaml", "data.yaml")], "-o", two, "--force")
    return first, robocal("drift", one, two)


@obeyed("errors-shared")
def same_poses(folder):
    """What the model cannot say repeats at the same poses, and cancels."""

    def run(name, seed):
        nominal, true, _, _ = draw()
        rng = np.random.default_rng(seed)
        q, rng = nominal.way(rng, 150, 0.02), np.random.default_rng(ord(name))
        bent = q - 2e-3 * np.sin(2 * q + np.arange(6))
        identify(write(folder, nominal, q, see(true, bent, rng, 2e-5), 2e-5, name=name), "-o", folder / f"run-{name}")
        return folder / f"run-{name}"

    one, two, again = run("a", 1), run("b", 2), run("c", 1)
    return robocal("drift", one, two), robocal("drift", one, again)


@obeyed("run-not-improved")
def not_improved(folder):
    runs = folder / "one", folder / "two", folder / "more"
    identify(arm(folder, 40, size=0.03, name="a"), "-o", runs[0])
    identify(arm(folder, 60, name="b"), "-o", runs[1])
    identify(arm(folder, 300, name="c"), "-o", runs[2])
    return robocal("drift", runs[0], runs[1]), robocal("drift", runs[2], runs[1])


# --- truth -----------------------------------------------------------------------------------------------------------


def simulated(folder, *options):
    robocal("simulate", "rv-2aj", "-n", 60, "--seed", 3, "-o", folder / "sim")
    files = [folder / "sim" / f for f in ("robot.yaml", "data.yaml")]
    return files, folder / "sim" / "truth.yaml"


@obeyed("truth-held", "truth-missed")
def held(folder):
    files, truth = simulated(folder)
    identify(files, "--fix", "j3.d,j2.theta", "-o", folder / "held")
    identify(files, "-o", folder / "free")
    return robocal("drift", folder / "held", truth), robocal("drift", folder / "free", truth)


@obeyed("truth-missed-by")
def mistyped(folder):
    """A number of the truth file that was mistyped, and is named."""
    files, truth = simulated(folder)
    identify(files, "-o", folder / "run")
    right = truth.read_text()
    d = re.search(r"name: j3,.*? d: ([-0-9.]+)", right)
    truth.write_text(right.replace(d[0], d[0].replace(d[1], f"{float(d[1]) + 5:.6f}")))
    first = robocal("drift", folder / "run", truth)
    assert "j3.d" in found(first, r"farther from the truth than chance explains: ([^.]*\.[a-z]+)")
    truth.write_text(right)
    return first, robocal("drift", folder / "run", truth)
