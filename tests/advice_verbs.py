"""Advice on what is done with a robot and its runs: validate, compensate, export, predict, plan, study; obeyed."""

from __future__ import annotations

import shutil

import numpy as np
from advice import arm, beside, draw, edit, found, identify, obeyed, see, write
from cli.runs import Ran, robocal
from cli.test_urdf_runs import URDF
from run_folders import earlier
from studies.specs import EXAMPLES, TEXT

# --- validate --------------------------------------------------------------------------------------------------------


@obeyed("few-unseen-here")
def seen(folder):
    """Of a file whose first rows were fitted, three are new; twenty more are measured."""
    files = arm(folder, 83)
    head, *rows = beside(files).read_text().splitlines()
    said = []
    beside(files).write_text("\n".join([head, *rows[:60]]) + "\n")
    identify(files, "-o", folder / "run")
    for m in (63, 83):
        beside(files).write_text("\n".join([head, *rows[:m]]) + "\n")
        said.append(robocal("validate", folder / "run", files[1]))
    return tuple(said)


@obeyed("target-remounted")
def remounted(folder):
    """What is told is written into the robot's file."""
    nominal, _, q, rng = draw()
    at = np.array([-0.04, 0.025, 0.09])
    p = nominal.point(q, nominal.tool + at) + 1e-4 * rng.normal(size=(len(q), 3)) + [0.5, 0.2, 0.1]
    files = write(folder, nominal, q, p)
    first = robocal("validate", *files)
    told = [float(v) for v in found(first, r"a target that sits \(([^)]*)\)").replace(" mm", "").split(",")]
    old = nominal.tool * 1e3
    edit(
        files[0], ("xyz: [30, -20, 110]", f"xyz: [{', '.join(f'{a + b:.3f}' for a, b in zip(old, told, strict=True))}]")
    )
    then = robocal("validate", *files, "--json")
    assert then.document["errors"]["this"]["mean"] < 0.5, then.said
    return first, then


@obeyed("tool-not-stated")
def no_tool(folder):
    """The nominal arm, with its tool in the file and without."""
    nominal, _, q, rng = draw()
    files = write(folder, nominal, q, see(nominal, q, rng))
    given = files[0].read_text()
    edit(files[0], ("xyz: [30, -20, 110]", "xyz: [0, 0, 0]"))
    first = robocal("validate", *files)
    files[0].write_text(given)
    then = robocal("validate", *files, "--json")
    assert then.document["errors"]["this"]["mean"] < 0.5, then.said
    return first, then


@obeyed("no-lengths")
def directions(folder):
    for kind in ("bearing", "position"):
        robocal("simulate", "rv-2aj", "-n", 30, "--kind", kind, "-o", folder / kind)
    return tuple(
        robocal("validate", folder / k / "truth.yaml", folder / k / "data.yaml") for k in ("bearing", "position")
    )


@obeyed("few-visits")
def visits(folder):
    def visited(times, name):
        nominal, true, q, rng = draw(6)
        q = np.repeat(q, times, axis=0)
        return write(folder, nominal, q, see(true, q, rng), name=name)

    return tuple(robocal("validate", *visited(n, name)) for n, name in ((5, "few"), (30, "many")))


@obeyed("few-after-frames")
def few(folder):
    return robocal("validate", *arm(folder, 3)), robocal("validate", *arm(folder, 40))


@obeyed("mean-as-good")
def shuffled(folder):
    bad = arm(folder, 60, spoil=lambda q, p, rng: (q[rng.permutation(len(q))], p))
    return robocal("validate", *bad), robocal("validate", *arm(folder, 60))


# --- compensate ------------------------------------------------------------------------------------------------------


def targets(folder, place=(0.35, 0.1, 0.5), name="targets.csv"):
    (folder / name).write_text(
        "id,x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]\n"
        + f"a,{','.join(map(str, place))},0,170,0\nb,0.3,0.05,0.45,0,170,0\n"
    )
    return folder / name


def joint_targets(folder):
    (folder / "q.csv").write_text(
        ",".join(f"j{i} [deg]" for i in range(1, 7)) + "\n10,20,-20,15,40,5\n-20,30,-40,5,50,15\n"
    )
    return folder / "q.csv"


@obeyed("branch-unknown")
def branch(folder):
    identify(arm(folder, 60), "-o", folder / "run")
    return robocal("compensate", folder / "run", targets(folder)), robocal(
        "compensate", folder / "run", joint_targets(folder)
    )


@obeyed("calibration-unproven")
def unproven(folder):
    bad = arm(folder, 60, spoil=lambda q, p, rng: (q[rng.permutation(len(q))], p))
    identify(bad, "-o", folder / "run")
    first = robocal("compensate", folder / "run", joint_targets(folder))
    identify(arm(folder, 60), "-o", folder / "run", "--force")
    return first, robocal("compensate", folder / "run", joint_targets(folder))


@obeyed("targets-unreached")
def unreached(folder):
    """A target is moved towards the shoulder by what the table says of it."""
    identify(arm(folder, 60), "-o", folder / "run")
    shoulder, far = np.array([0, 0, 0.29]), np.array([0.9, 0.1, 0.5])
    first = robocal("compensate", folder / "run", targets(folder, far))
    away = float(found(first, r"the nearest pose that the arm reaches is ([0-9.]+) mm")) * 1e-3
    near = far + 1.3 * away * (shoulder - far) / np.linalg.norm(shoulder - far)
    return first, robocal("compensate", folder / "run", targets(folder, near))


@obeyed("models-apart")
def another_robot(folder):
    files = arm(folder, 60)
    identify(files, "-o", folder / "run")
    arm(folder, name="long", arm="long")
    nominal = (folder / "long" / "robot.yaml", files[0])
    return tuple(robocal("compensate", folder / "run", joint_targets(folder), "--nominal", n) for n in nominal)


# --- export and run folders of a URDF --------------------------------------------------------------------------------


def of_urdf(folder):
    """A URDF, data of a true arm whose target sits elsewhere, its run, and data of another day."""
    urdf, one, two = folder / "u.urdf", folder / "one", folder / "two"
    urdf.write_text(URDF, encoding="utf-8")
    robocal("export", urdf, "-o", folder / "u.yaml")
    robocal("simulate", folder / "u.yaml", "-n", 60, "--set", "tool.x=0.12", "--set", "tool.z=0.03", "-o", one)
    still = ("--length-error", 0, "--angle-error", 0, "--seed", 5)
    robocal("simulate", one / "truth.yaml", "-n", 60, *still, "-o", two)
    return identify([urdf, one / "data.yaml"], "-o", folder / "run"), two / "data.yaml"


@obeyed("run-holds-more")
def whole_folder(folder):
    """The folder, given to validate, meets what the file alone misses by its tool."""
    first, data = of_urdf(folder)
    alone = robocal("validate", folder / "run" / "calibrated.urdf", data, "--json")
    then = robocal("validate", folder / "run", data, "--json")
    assert then.document["errors"]["this"]["mean"] < 0.3
    return Ran(3, first.out + alone.out, first.err + alone.err), then


@obeyed("result-missing")
def without_result(folder):
    _, data = of_urdf(folder)
    kept = (folder / "run" / "result.json").rename(folder / "result.json")
    first = robocal("validate", folder / "run", data)
    kept.rename(folder / "run" / "result.json")
    return first, robocal("validate", folder / "run", data)


@obeyed("beyond-left-out")
def beyond(folder):
    files = arm(folder, 80, spoil=lambda q, p, rng: (q - 5e-3 * np.sin(q + np.arange(6)), p))
    identify(files, "--groups", "eccentricity", "-o", folder / "run")
    return tuple(robocal("export", folder / "run", "--format", f) for f in ("csv", "yaml"))


@obeyed("worth-unknown")
def judged(folder):
    """Offsets of a file alone, judged on data."""
    files = arm(folder, 60)
    identify(files, "-o", folder / "run")
    table = folder / "offsets.csv"
    first = robocal(
        "export", folder / "run" / "calibrated.yaml", "--nominal", files[0], "--format", "offsets", "-o", table
    )
    other = arm(folder, 60, name="other")
    return first, robocal("validate", files[0], other[1], "--offsets", table)


# --- predict ---------------------------------------------------------------------------------------------------------


def ask(folder, run, *rows, more=""):
    (folder / "ask.csv").write_text("\n".join([",".join(f"j{i} [deg]" for i in range(1, 7)) + more, *rows]) + "\n")
    return robocal("predict", run, folder / "ask.csv")


@obeyed("outside-measured")
def outside(folder):
    """Measured there too."""
    said = []
    for name, share in (("near", 0.3), ("far", 0.9)):
        identify(arm(folder, 60, share=share, name=name), "-o", folder / f"run-{name}")
        said.append(ask(folder, folder / f"run-{name}", "80,30,-40,5,60,10", "-80,30,-40,5,60,10"))
    return tuple(said)


@obeyed("run-unrecorded")
def unrecorded(folder):
    run, files = folder / "run", arm(folder, 60)
    identify(files, "-o", run)
    earlier(run)
    first = ask(folder, run, "10,20,-20,15,40,5")
    identify(files, "-o", run, "--force")
    return first, ask(folder, run, "10,20,-20,15,40,5")


@obeyed("conditions-assumed")
def side(folder):
    """Backlash of a joint whose side of approach is recorded, and then stated for the poses too."""

    nominal, true, q, rng = draw(100)
    way = rng.choice([-1, 1], len(q))
    real = q + 2e-3 * way[:, None] * np.eye(6)[1]
    files = write(folder, nominal, q, see(true, real, rng))
    head, *rows = beside(files).read_text().splitlines()
    beside(files).write_text("\n".join([f"{head},side", *(f"{r},{w}" for r, w in zip(rows, way, strict=True))]) + "\n")
    edit(files[1], ("frame:", "configuration: {approach.j2: side}\nframe:"))
    identify(files, "--groups", "backlash", "-o", folder / "run")
    row = "10,20,-20,15,40,5"
    return ask(folder, folder / "run", row), ask(folder, folder / "run", row + ",1", more=",approach.j2")


# --- plan and study --------------------------------------------------------------------------------------------------


@obeyed("accuracy-not-reached")
def accuracy(folder):
    how = ("--accuracy", 0.02, "--draw", 200)
    return robocal("plan", "rv-2aj", *how), robocal("plan", "rv-2aj", *how, "--noise", 0.01)


@obeyed("no-trial-ended")
def study(folder):
    """So much noise that no trial ends, then as much as an instrument has."""
    shutil.copy(EXAMPLES / "cable-laval" / "robot.yaml", folder)
    text = TEXT.replace("trials: 60", "trials: 8").replace("chunk: 10", "chunk: 8")
    said = []
    for noise in ("100 m", "4 mm"):
        (folder / "study.yaml").write_text(
            text.replace("{residual: [length, squared]}", f"{{noise.length: [3 mm, {noise}]}}")
        )
        said.append(robocal("study", folder / "study.yaml", "--workers", 1, "--force"))
    return tuple(said)
