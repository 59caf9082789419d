"""Advice on arms and their identification, obeyed."""

from __future__ import annotations

import numpy as np
from advice import arm, beside, draw, edit, found, identify, obeyed, see, write
from cli.runs import Ran, robocal

# --- measurements that were asked for are simulated ------------------------------------------------------------------


@obeyed("exact", "computed")
def computed(folder):
    return identify(arm(folder, noise=0.0)), identify(arm(folder))


@obeyed("nominal-exact")
def nominal(folder):
    return identify(arm(folder, noise=0.0, size=0.0)), identify(arm(folder))


@obeyed("gain-not-proven")
def undecided(folder):
    return identify(arm(folder, 26, size=0.03)), identify(arm(folder, 300, size=0.03))


@obeyed("few-unseen")
def few(folder):
    return identify(arm(folder, 4)), identify(arm(folder, 40))


@obeyed("few-places")
def places(folder):
    def again(q, p, rng):
        some = np.repeat(np.arange(5), 8)
        return q[some], p[some] + rng.normal(size=(40, 3)) * 1e-4

    return identify(arm(folder, spoil=again)), identify(arm(folder))


@obeyed("one-place")
def one_place(folder):
    def still(q, p, rng):
        return np.repeat(q[:1], 40, axis=0), p[:1] + rng.normal(size=(40, 3)) * 1e-4

    return identify(arm(folder, spoil=still)), identify(arm(folder))


@obeyed("few-measurements", "few-numbers")
def few_numbers(folder):
    return identify(arm(folder, 10), "--folds", 5), identify(arm(folder, 60), "--folds", 5)


@obeyed("joints-still")
def still(folder):
    nominal, true, q, rng = draw()
    q[:, 4] = 0.3
    return identify(write(folder, nominal, q, see(true, q, rng))), identify(arm(folder))


@obeyed("one-plane")
def plane(folder):
    nominal, true, q, rng = draw()
    q[:, 1:] = [-0.4, 0.3, 0.0, 0.8, 0.0]
    return identify(write(folder, nominal, q, see(true, q, rng))), identify(arm(folder))


@obeyed("curved")
def curved(folder):
    held = ("--prior", "angle=3deg", "--prior", "length=10mm")
    return identify(arm(folder, 26), *held), identify(arm(folder, 26))


@obeyed("no-better-than-mean")
def shuffled(folder):
    files = arm(folder, 60, spoil=lambda q, p, rng: (q[rng.permutation(len(q))], p))
    return identify(files), identify(arm(folder))


def labelled(folder, share, m, name=""):
    """Three targets, of which a share has the name of any."""
    nominal, true, q, rng = draw(m, 1)
    tools = np.array([[0.03, -0.02, 0.11], [0.13, 0.05, 0.11], [-0.06, 0.08, 0.16]])
    at = rng.integers(0, 3, m)
    p = true.point(q, tools[at]) + rng.normal(size=(m, 3)) * 1e-4 + [0.5, 0.2, 0.1]
    named = np.where(rng.random(m) < share, rng.integers(0, 3, m), at)
    files = write(folder, nominal, q, p, name=name)
    head, *rows = beside(files).read_text().splitlines()
    rows = [f"{r},{'ABC'[i]}" for r, i in zip(rows, named, strict=True)]
    beside(files).write_text("\n".join([f"{head},target", *rows]) + "\n")
    free = ", ".join(f"{n}: {{free: true, xyz: [0, 0, 0]}}" for n in "ABC")
    files[1].write_text(files[1].read_text() + f"target: {{column: target}}\ntargets: {{{free}}}\n")
    return files


@obeyed("unexplained")
def labels(folder):
    return identify(labelled(folder, 0.6, 100), "--fix", "tool"), identify(labelled(folder, 0.0, 100), "--fix", "tool")


@obeyed("nothing-of-robot")
def names(folder):
    return identify(labelled(folder, 0.5, 40), "--fix", "tool"), identify(labelled(folder, 0.0, 40), "--fix", "tool")


@obeyed("left")
def loud_names(folder):
    robust = ("--fix", "tool", "--loss", "huber")
    return identify(labelled(folder, 0.5, 60), *robust), identify(labelled(folder, 0.0, 60), *robust)


@obeyed("unmade")
def mistyped(folder):
    files = arm(folder, 60)
    edit(files[0], ("d: 302,", "d: 342,"))
    first = identify(files)
    edit(files[0], ("d: 342,", f"d: {found(first, 'j4.d: you wrote 342 mm, the data say ([0-9.]+) mm')},"))
    return first, identify(files)


@obeyed("scale-wrong")
def scale(folder):
    return identify(arm(folder, 100, spoil=lambda q, p, rng: (q, 1.03 * p))), identify(arm(folder, 100))


@obeyed("scaled")
def scaled(folder):
    return identify(arm(folder, 60, spoil=lambda q, p, rng: (q, 1.01 * p))), identify(arm(folder, 60))


@obeyed("above-stated-noise")
def stated(folder):
    return identify(arm(folder, sigma=1e-5)), identify(arm(folder, sigma=1e-4))


@obeyed("below-stated-noise")
def overstated(folder):
    return identify(arm(folder, sigma=2e-3)), identify(arm(folder, sigma=1e-4))


@obeyed("segment")
def moved(folder):
    def step(q, p, rng):
        p[30:] += [4e-3, 0, 3e-3]
        return q, p

    files = arm(folder, 60, spoil=step)
    first = identify(files)
    return first, identify(files, "--exclude", found(first, r"--exclude (\d+-\d+)"))


@obeyed("late")
def late(folder):
    nominal, true, _, rng = draw(60)
    q = nominal.way(rng, 61, 0.05)
    told, between = q[:-1], q[:-1] + 0.35 * (q[1:] - q[:-1])
    first = identify(write(folder, nominal, told, see(true, between, rng)))
    return first, identify(write(folder, nominal, between, see(true, between, rng)))


@obeyed("wrong-unit")
def radians(folder):
    files = arm(folder, spoil=lambda q, p, rng: (np.radians(q), p))
    first = identify(files)
    edit(beside(files), ("[deg]", f"[{first.document['error']['expected']}]"))
    return first, identify(files)


@obeyed("outliers", "cause-alone")
def gross(folder):
    def far(q, p, rng):
        p[7] += [0.03, -0.05, 0.04]
        return q, p

    files = arm(folder, spoil=far)
    first = robocal("identify", *files)
    return first, robocal("identify", *files, "--exclude", "9")


def one_row(change):
    def make(folder):
        files = arm(folder, 60, spoil=change)
        return robocal("identify", *files), robocal("identify", *arm(folder, 60))

    return make


def _zero(q, p, rng):
    p[7] = 0.0
    return q, p


def _copy(q, p, rng):
    p[8] = p[7]
    return q, p


def _swap(q, p, rng):
    p[[7, 20]] = p[[20, 7]]
    return q, p


def _sign(q, p, rng):
    p[7, 1] = -p[7, 1]
    return q, p


def _digit(q, p, rng):
    p[7, 0] += 0.02
    return q, p


def _turn(q, p, rng):
    p[[7, 20, 33]] = p[[20, 33, 7]]
    return q, p


obeyed("cause-zeros")(one_row(_zero))
obeyed("row-copy")(one_row(_copy))
obeyed("row-swapped")(one_row(_swap))
obeyed("row-sign")(one_row(_sign))
obeyed("row-column")(one_row(_digit))
obeyed("row-elsewhere")(one_row(_turn))


@obeyed("too-many-aside")
def many_gross(folder):
    def far(q, p, rng):
        p[::4] += rng.normal(size=p[::4].shape) * 0.1
        return q, p

    files = arm(folder, 100, spoil=far)
    rows = ",".join(str(r + 2) for r in range(0, 100, 4))
    return identify(files), identify(files, "--exclude", rows)


@obeyed("priors-help")
def soft(folder):
    def stray(q, p, rng):
        return q - 0.05 * rng.uniform(0.5, 1, 6) * np.sin(1.3 * q + rng.uniform(0, 6, 6)), p

    files = arm(folder, 26, spoil=stray, size=3.0)
    first = identify(files)
    return first, identify(files, *found(first, r"\((--prior [^)]*)\)").split())


@obeyed("errors-follow")
def warming(folder):
    """Warm machines are what is asked for."""

    def warm(q, p, rng):
        walk = np.cumsum(rng.normal(size=p.shape), axis=0)
        return q, p + 1.2e-4 * (walk - walk.mean(axis=0))

    files = arm(folder, 150, spoil=warm)
    return identify(files), identify(arm(folder, 150))


# --- options


@obeyed("not-converged")
def steps(folder):
    files = arm(folder)
    return identify(files, "--iterations", 1), identify(files, "--iterations", 100)


@obeyed("nothing-held-out")
def held_out(folder):
    files = arm(folder)
    return identify(files, "--hold-out", 0, "--no-leave-one-out"), identify(files, "--hold-out", 0.2)


@obeyed("band-unchecked")
def bands(folder):
    files = arm(folder)
    return identify(files, "--folds", 5), identify(files, "--hold-out", 0.2)


@obeyed("holds-where-measured")
def corner(folder):
    files = arm(folder, 60, share=0.1)
    return identify(files), identify(files, "--region", "measured")


@obeyed("one-step-misleads")
def one_step(folder):
    """The warning stands beside the fit that needed more steps; the one step that it warns of is worse."""
    files = arm(folder, 60, spoil=lambda q, p, rng: (q[rng.permutation(len(q))], p))
    step, fit = identify(files, "--method", "lse", "--hold-out", 0.2), identify(files)
    return Ran(step.status, step.out, step.err + fit.out), fit


@obeyed("priors-ignored")
def blind(folder):
    files = arm(folder, size=8.0, share=0.4, m=26)
    return identify(files, "--method", "lse", "--prior", "length=1"), identify(
        files, "--prior", "length=8mm", "--prior", "angle=1deg"
    )


@obeyed("particles-gaussian")
def particles(folder):
    files = arm(folder, 30)
    few = ("--method", "particle", "--particles", 50, "--fix", "j3,j4,j5,j6")
    return identify(files, *few), identify(files, *few, "--loss", "cauchy")


@obeyed("parallel-axes")
def parallel(folder):
    files = arm(folder, 60)
    text = files[0].read_text().replace("dh-hayati", "dh").replace(", beta: 0", "").replace(", beta]", "]")
    files[0].write_text(text)
    first = identify(files)
    return first, identify(arm(folder, 60))


@obeyed("only-combination")
def combination(folder):
    files = arm(folder)
    return identify(files), identify(files, "--fix", "j3.d,j3.beta,j4.beta,j5.beta")


@obeyed("groups-help")
def geared(folder):
    files = arm(folder, 60, spoil=lambda q, p, rng: (q / (1 + 3e-3 * np.linspace(-1, 1, 6)), p))
    first = identify(files)
    return first, identify(files, "--groups", found(first, r"--groups ([a-z,]+)\)"))


@obeyed("group-few")
def few_groups(folder):
    return identify(arm(folder, 20), "--groups", "gain"), identify(arm(folder, 60), "--groups", "gain")


@obeyed("group-unseen")
def approach(folder):
    return identify(arm(folder, 40), "--groups", "backlash"), identify(arm(folder, 40), "--groups", "gain")


@obeyed("nothing-free")
def nothing_free(folder):
    files = arm(folder)
    edit(
        files[0],
        ("calibrate: {free: [theta, d, a, alpha, beta]}", "calibrate: {free: []}"),
        ("0], free: true", "0], free: false"),
    )
    return robocal("check", *files), robocal("identify", *files, "--free", "theta,d,a,alpha,beta")
