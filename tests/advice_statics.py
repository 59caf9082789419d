"""Advice on poses, lengths, tensions and workspaces of cable robots, obeyed."""

from __future__ import annotations

import numpy as np
from advice import cables, edit, obeyed
from cli.runs import Ran, robocal
from listings import rows_of

HOLDS = "every_cable: {tension: [1, 400]}\nplatform: {mass: 12}\n"
HEAD = "id,x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]"
STRETCHES = "every_cable: {elasticity: 2.5e-5, tension: [10, 400]}\nplatform: {mass: 12}\n"
HANGS = """robocal: 1
name: hangs
kind: cable
units: {length: m}
frame_anchors: [[2, 2, 3], [-2, 2, 3], [-2, -2, 3], [2, -2, 3], [2, 2, 3.4], [-2, 2, 3.4], [-2, -2, 3.4], [2, -2, 3.4]]
platform_anchors: [[0, 0.2, 0.1], [-0.2, 0, 0.1], [0, -0.2, 0.1], [0.2, 0, 0.1], [0.2, 0.1, -0.1], [-0.1, 0.2, -0.1], [-0.2, -0.1, -0.1], [0.1, -0.2, -0.1]]
every_cable: {tension: [1, 400]}
platform: {mass: 12}
"""
APART = """robocal: 1
name: apart
kind: cable
units: {length: mm, force: kN}
degrees: 1R2T
frame_anchors: [[900, 0, 1400], [1500, 0, 700], [-1300, 0, 2200], [0, 0, 2300]]
platform_anchors: [[600, 0, 300], [-500, 0, 0], [100, 0, -100], [500, 0, 100]]
every_cable: {tension: [0.001, 0.3]}
platform: {mass: 5}
"""
QUICK = ("--cells", 9, "--rays", 100)


def robot(folder, more=HOLDS, **how):
    """A robot that is as it was built, and a list of lengths and one of poses."""
    file, lengths, poses = cables(folder, 8, size=0.0, zero=0.0, **how)
    file.write_text(file.read_text() + more)
    return file, lengths.with_suffix(".csv"), poses.with_suffix(".csv")


def text(folder, words, name="robot.yaml"):
    (folder / name).write_text(words)
    return folder / name


def listed(folder, *rows, head=HEAD, name="list.csv"):
    return text(folder, "\n".join([head, *rows]) + "\n", name)


def cable(verb, *words):
    return robocal("cable", verb, *words)


# --- lengths and poses -----------------------------------------------------------------------------------------------


@obeyed("lengths-geometric")
def stretched(folder):
    file, _, poses = robot(folder, STRETCHES)
    return cable("inverse", file, poses), cable("inverse", file, poses, "--tension", 80)


@obeyed("lengths-taken-geometric")
def taken(folder):
    file, lengths, _ = robot(folder, STRETCHES, sigma=1e-9)
    wrong = cable("forward", file, lengths, "--sigma", 0.0001)
    edit(lengths, *((f"c{i} [mm]", f"c{i}.geometric [mm]") for i in range(1, 9)))
    return wrong, cable("forward", file, lengths, "--sigma", 0.0001)


@obeyed("tensions-aside")
def aside(folder):
    file, _, _ = robot(folder)
    head = HEAD + "".join(f",c{i}.tension [N]" for i in range(1, 9))
    poses = listed(folder, "a,0,0,1.5,0,0,0" + ",80" * 8, head=head)
    first = cable("inverse", file, poses)
    edit(file, ("every_cable: {", "every_cable: {elasticity: 2.5e-5, "))
    return first, cable("inverse", file, poses)


@obeyed("singular-pose")
def singular(folder):
    """A flat platform in the plane of its frame; another pose is measured."""
    file = text(
        folder,
        "robocal: 1\nname: n\nkind: cable\nunits: {length: m}\n"
        "frame_anchors: [[1.6, 1.6, 3], [-1.6, 1.6, 3], [-1.6, -1.6, 3], [1.6, -1.6, 3], [2, 2, 3], [-2, 2, 3], [-2, -2, 3], [2, -2, 3]]\n"
        "platform_anchors: [[0.1, 0.12, 0], [-0.1, 0.12, 0], [-0.1, -0.12, 0], [0.12, -0.12, 0], [0.1, 0.12, 0], [-0.1, 0.12, 0], [-0.1, -0.12, 0], [0.12, -0.12, 0]]\n",
    )
    said = []
    for name, height in (("here", 3.0), ("below", 1.0)):
        pose = listed(folder, f"{name},0.3,-0.2,{height},0,0,10")
        lengths = text(folder, cable("inverse", file, pose).out, f"{name}.csv")
        said.append(cable("forward", file, lengths, "--sigma", 0.0001, "--starts", 0))
    return tuple(said)


@obeyed("no-pose")
def hanging(folder):
    """A density in g/m that was written as kg/m."""
    file, _, poses = robot(folder, "every_cable: {elasticity: 2.5e-5, density: 0.1}\n")
    lengths = text(folder, cable("inverse", file, poses, "--tension", 80, "--sag").out, "l.csv")
    edit(file, ("density: 0.1", "density: 100"))
    first = cable("forward", file, lengths, "--tension", 80, "--sag")
    edit(file, ("density: 100", "density: 0.1"))
    return first, cable("forward", file, lengths, "--tension", 80, "--sag")


@obeyed("search-unended")
def unended(folder):
    file, _, poses = robot(folder)
    right = cable("inverse", file, poses).out
    wrong = text(folder, right.replace("[m]", "[mm]"), "l.csv")
    first = cable("forward", file, wrong)
    return first, cable("forward", file, text(folder, right, "l.csv"))


@obeyed("pose-undetermined")
def undetermined(folder):
    file, _, _ = robot(folder)
    whole = file.read_text()
    few = "\n".join(
        r
        for r in whole.splitlines()
        if not any(f"  {n}{i}:" in r or f"name: c{i}" in r for n in "AB" for i in (6, 7, 8))
    )
    file.write_text(few + "\n")
    first = robocal("check", file)
    file.write_text(few.replace("degrees: 3R3T", "degrees: 3T") + "\n")
    edit(file, *((line, re_b) for line, re_b in _points(few)))
    return first, robocal("check", file)


def _points(words):
    """Platform anchors at one point, as a platform without orientation has them."""
    return [(r, r[: r.index(":")] + ": [0, 0, 0]") for r in words.splitlines() if r.startswith("  B")]


@obeyed("pose-out-of-reach", "leaning")
def across(folder):
    """A list whose column across the plane holds another: corrected."""
    file, _, _ = robot(folder, name="four")
    wrong = listed(folder, "here,0,0,1.4,0,0,0", "there,0,0.4,1.4,0,0,0")
    first = cable("tension", file, wrong)
    right = listed(folder, "here,0,0,1.4,0,0,0", "there,0.4,0,1.4,0,0,0")
    return first, cable("tension", file, right)


@obeyed("mirror-image")
def plane(folder):
    file, _, _ = robot(folder)
    rng = np.random.default_rng(0)

    def rows(turn):
        at, by = rng.uniform(-0.5, 0.5, (40, 2)), turn * rng.uniform(-1, 1, (40, 3))
        return [
            f"p{i},{x:.4f},{y:.4f},1.5,{a:.3f},{b:.3f},{c:.3f}"
            for i, ((x, y), (a, b, c)) in enumerate(zip(at, by, strict=True))
        ]

    noise = ("--sigma", "3mm", "--sigma-position", "1mm", "--sigma-orientation", "0.1deg")
    return tuple(cable("require", file, listed(folder, *rows(t)), *noise) for t in (0, 15))


@obeyed("poses-away")
def away(folder):
    file, _, poses = robot(folder)
    noise = ("--sigma", "3mm", "--sigma-position", "1mm", "--sigma-orientation", "0.1deg")
    right = poses.read_text()
    poses.write_text(right.replace("[mm]", "[m]"))
    first = cable("require", file, poses, *noise)
    poses.write_text(right)
    return first, cable("require", file, poses, *noise)


def _choose(folder, *options):
    file, _, _ = robot(folder, HOLDS)
    return cable("poses", file, "-n", 30, "--choose", 8, "--diameter", 0.002, *options)


@obeyed("length-noise-assumed")
def assumed(folder):
    return _choose(folder), _choose(folder, "--sigma", 0.001)


@obeyed("poses-taken-exact")
def taken_exact(folder):
    return _choose(folder, "--sigma", 0.001), _choose(folder, "--sigma", 0.001, "--pose-noise", "0.001,0.05")


@obeyed("noise-teaches-nothing")
def loud(folder):
    return _choose(folder, "--sigma", 20), _choose(folder, "--sigma", 0.02)


# --- tensions --------------------------------------------------------------------------------------------------------


@obeyed("not-held")
def lost(folder):
    file, _, _ = robot(folder)
    pose = listed(folder, "here,0,0,1.5,0,0,0")
    return cable("tension", file, pose, "--payload", 5000), cable("tension", file, pose, "--payload", 5)


@obeyed("closed-form-leaves")
def closed(folder):
    file, _, _ = robot(folder)
    pose = listed(folder, "here,1.31,0.63,0.70,0,0,0")
    limits = ("--limits", "10,150")
    return cable("tension", file, pose, "--method", "closed", *limits), cable(
        "tension", file, pose, "--method", "mid", *limits
    )


@obeyed("wrench-unbalanced")
def unbalanced(folder):
    file, _, _ = robot(folder, name="four")
    pose = listed(folder, "here,0,0,1.4,0,0,0")
    first = cable("tension", file, pose, "--wrench", "1,5,0,0,0,0")
    return first, cable("tension", file, pose, "--wrench", "1,0,0,0,0,0")


@obeyed("no-margin")
def bare(folder):
    """Two cables that pull as hard as they may; wider limits leave a margin."""
    file = text(
        folder,
        "robocal: 1\nname: two\nkind: cable\nunits: {length: m}\ndegrees: 2T\nplane: xz\n"
        "frame_anchors: [[-2, 0, 3], [2, 0, 3], [0, 0, 0]]\nplatform_anchors: [[0, 0, 0], [0, 0, 0], [0, 0, 0]]\n"
        "every_cable: {tension: [1, 400]}\nplatform: {mass: 12}\n",
    )
    pose = listed(folder, "here,0,0,1.5,0,0,0")
    most = max(rows_of(cable("tension", file, pose, "--json").document["poses"])[0]["tension"])
    return cable("tension", file, pose, "--limits", f"1,{most!r}"), cable("tension", file, pose)


# --- workspaces ------------------------------------------------------------------------------------------------------


@obeyed("nothing-held")
def heavy(folder):
    file, _, _ = robot(folder)
    return cable("workspace", file, *QUICK, "--mass", 9000), cable("workspace", file, *QUICK, "--mass", 12)


@obeyed("nothing-closed")
def hung(folder):
    file = text(folder, HANGS)
    return cable("workspace", file, *QUICK, "--closure"), cable("workspace", file, *QUICK)


def _coarse(folder, *options):
    file, _, _ = robot(folder)
    box = "--box=-9,-9,-9,9,9,9"
    return (
        cable("workspace", file, box, "--cells", 2, "--rays", 100, *options),
        cable("workspace", file, box, "--cells", 21, "--rays", 100, *options),
    )


@obeyed("only-start-held")
def only_held(folder):
    return _coarse(folder)


@obeyed("only-start-closed")
def only_closed(folder):
    return _coarse(folder, "--closure")


@obeyed("parts-apart", "start-sees-part")
def parts(folder):
    """Started in the other part, the rays find what the first ones missed: the two make the whole."""
    file, out = text(folder, APART), folder / "out"
    first = cable("workspace", file, "--cells", 41, "-o", out)
    rows = np.array(
        [[float(v or "nan") for v in r.split(",")[:5]] for r in (out / "workspace.csv").read_text().splitlines()[1:]]
    )
    held = rows[rows[:, 3] == 1]
    here, whole = cable("workspace", file, "--cells", 41, "--json"), 0.0
    at = np.array(here.document["rays"]["start"]["value"]) * 1e3
    good = held[held[:, 4] > np.median(held[:, 4])]
    far = good[np.argmax(np.linalg.norm(good[:, :3] - at, axis=1)), :3]
    there = cable("workspace", file, "--cells", 41, "--json", "--start=" + ",".join(map(str, far)))
    whole = sum(r.document["rays"]["size"]["value"] for r in (here, there))
    assert abs(whole / here.document["grid"]["size"]["value"] - 1) < 0.05
    return Ran(3, first.out, first.err), there


@obeyed("rays-differ")
def differ(folder):
    file, _, _ = robot(folder)
    return (
        cable("workspace", file, "--cells", 4, "--rays", 40),
        cable("workspace", file, "--cells", 41, "--rays", 2000),
    )


@obeyed("only-singular")
def radial(folder):
    """Cables that all point at the middle of the platform; other anchors cross them."""

    def built(heights):
        b = ", ".join(f"[{x}, 0, {z}]" for x, z in zip((-0.2, 0.2, 0.2, -0.2), heights, strict=True))
        return text(
            folder,
            "robocal: 1\nname: radial\nkind: cable\nunits: {length: m}\ndegrees: 1R2T\nplane: xz\n"
            f"frame_anchors: [[-2, 0, 3], [2, 0, 3], [2, 0, 0], [-2, 0, 0]]\nplatform_anchors: [{b}]\n{HOLDS}",
        )

    box = ("--box=-0.000001,0,1.2,0.000001,0,1.8", *QUICK)
    first = cable("workspace", built((0.15, 0.15, -0.15, -0.15)), *box)
    return first, cable("workspace", built((-0.15, -0.15, 0.15, 0.15)), *box)
