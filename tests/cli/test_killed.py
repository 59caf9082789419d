"""Every verb that writes, killed while it does: the old files, the new ones, or none that anybody reads; then the same once more.

By default ten calls of the system in one run, before each of which a copy is made of what would be left, and one run that is killed; with
ROBOCAL_KILLS every call, and so many random moments, each in a run of its own.
"""

from __future__ import annotations

import os
import shutil
import zlib
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from cli.runs import ROBOT
from files.test_cable import caspr
from killing import FOREIGN, count_calls, duration, judge, killed_after, killed_at, left_before, readable
from printed import draw_images

from robocal.cli.main import main
from robocal.errors import MissingExtra

KILLS = int(os.environ.get("ROBOCAL_KILLS", "0"))
LAVAL = Path(__file__).parents[2] / "examples" / "cable-laval" / "robot.yaml"
CABLE = ("cable",)
# Words of a command, the folder that it writes last, and words that make it write something else.
VERBS = {
    "identify": (("identify", "robot.yaml", "one/data.yaml", "--no-leave-one-out", "--force", "-o", "OUT"), ("--fix", "j3")),
    "identify, layer": (("identify", "robot.yaml", "one/data.yaml", "--layer", "--force", "-o", "OUT"), ("--seed", "5")),
    "report": (("report", "run", "-o", "OUT/page.html"), None),
    "predict": (("predict", "run", "q.csv", "-o", "OUT/predicted.csv", "--force"), ("--absolute",)),
    "validate": (("validate", "run", "two/data.yaml", "--force", "-o", "OUT"), ("--against", "robot.yaml")),
    "drift": (("drift", "run", "run-two", "--force", "-o", "OUT"), ("--matters", "0.3mm")),
    "compensate": (("compensate", "run", "q.csv", "--force", "-o", "OUT"), ("--tool", "own")),
    "export": (("export", "run", "-o", "OUT/robot.txt", "--force"), ("--format", "urdf")),
    "plan": (("plan", "robot.yaml", "-n", "12", "--draw", "60", "--force", "-o", "OUT"), ("--seed", "7")),
    "simulate": (("simulate", "robot.yaml", "-n", "20", "--force", "-o", "OUT"), ("--seed", "7")),
    "demo": (("demo", "tracker", "-o", "OUT"), ("--seed", "5")),
    "new": (("new", "ur10", "-o", "OUT", "--force"), ("--kind", "pose")),
    "import": (("import", "flat_cables.xml", "-o", "OUT/flat.yaml", "--force"), ("--cables", "other")),
    "cable inverse": ((*CABLE, "inverse", "LAVAL", "p.csv", "-o", "OUT/l.csv", "--force"), ("--tension", "60")),
    "cable forward": ((*CABLE, "forward", "LAVAL", "l.csv", "-o", "OUT/p.csv", "--force"), ("--sigma", "0.5")),
    "cable tension": ((*CABLE, "tension", "LAVAL", "p.csv", "--force", "-o", "OUT"), ("--payload", "5")),
    "cable workspace": ((*CABLE, "workspace", "LAVAL", "--cells", "8", "--rays", "100", "--force", "-o", "OUT"), ("--payload", "5")),
    "vision detect": (("vision", "detect", "images", "--dictionary", "6x6_250", "--force", "-o", "OUT/corners.csv"), ("--size", "48")),
    "vision sheet": (("vision", "sheet", "--force", "-o", "OUT/sheet.pdf"), ("--first", "7")),
    "cable poses": ((*CABLE, "poses", "LAVAL", "-n", "20", "--force", "-o", "OUT"), ("--seed", "7")),
}  # fmt: skip


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Robots, data and runs that the verbs read."""
    here = tmp_path_factory.mktemp("killed")
    small = here / "small.yaml"
    small.write_text(ROBOT, encoding="utf-8")
    for name, seed in (("one", "1"), ("two", "2")):
        assert main(["simulate", str(small), "-n", "40", "--seed", seed, "-o", str(here / name)]) == 0
    shutil.copy(here / "one" / "robot.yaml", here / "robot.yaml")
    for run, data in (("run", "one"), ("run-two", "two")):
        main(["identify", str(here / "robot.yaml"), str(here / data / "data.yaml"), "-o", str(here / run)])
    model = caspr(here)
    used = model.read_text().partition('<cable_set id="used">')[2].partition("</cable_set>")[0]
    model.write_text(model.read_text().replace('"spare">', f'"other">{used}'))
    (here / "q.csv").write_text("j1 [deg],j2 [deg],j3 [deg]\n10,20,30\n-20,10,5\n")
    (here / "p.csv").write_text("x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]\n0,0,0.1,0,0,0\n0.1,0,0,0,0,0\n")
    assert main(["cable", "inverse", str(LAVAL), str(here / "p.csv"), "-o", str(here / "l.csv")]) == 0
    with suppress(MissingExtra):
        draw_images(here / "images")
    return here


def command(home, words, out):
    """The words with their files where they are; it is an error to be refused."""
    given = [str(LAVAL) if w == "LAVAL" else w.replace("OUT", str(out)) for w in words]
    made = [str(home / w) if (home / w).exists() and not w.startswith("-") else w for w in given]

    def run():
        assert main(made) in (0, 3), made

    return run


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_that_is_killed(home, tmp_path, verb):
    words, other = VERBS[verb]
    if words[0] == "vision":
        pytest.importorskip("cv2")
    old, new = tmp_path / "old", tmp_path / "new"
    for folder, more in ((old, ()), (new, other or ())):
        folder.mkdir()
        command(home, (*words, *more), folder)()  # here, so that kernels are compiled before anything is killed
    for name, content in FOREIGN.items():
        (old / name).write_bytes(content)
        (new / name).write_bytes(content)
    before, after = readable(old), readable(new)
    assert other is None or before != after, "the two are to differ"

    def once(folder, number=None, seconds=None):
        """What is found in a folder: as it lies there, or after a command that is killed in it."""
        run = command(home, (*words, *(other or ())), folder)
        if number is not None:
            killed_at(run, number)
        elif seconds is not None:
            killed_after(run, seconds)
        state = judge(folder, before, after)
        if KILLS or state == "refused":
            run()
            last = readable(folder)
            assert last.keys() == after.keys() and None not in last.values(), "once more leaves what it always leaves"
        return state

    def fresh(name):
        shutil.rmtree(tmp_path / name, ignore_errors=True)
        return shutil.copytree(old, tmp_path / name)

    scratch = fresh("scratch")
    run = command(home, (*words, *(other or ())), scratch)
    calls = count_calls(run)
    assert calls >= 3, "it wrote"
    if KILLS:
        states = [once(fresh("out"), number=n) for n in range(1, calls + 1)]
        whole = duration(run)
        rng = np.random.default_rng(zlib.crc32(verb.encode()))
        states += [once(fresh("out"), seconds=float(rng.uniform(0, 1.1 * whole))) for _ in range(KILLS)]
    else:
        numbers = np.unique(np.linspace(1, calls, 10).astype(int)).tolist()
        out = fresh("out")
        left = left_before(command(home, (*words, *(other or ())), out), out, numbers, tmp_path / "left")
        # One of them dies in earnest, and leaves the files of the copy.
        middle = numbers[len(numbers) // 2]
        killed_at(command(home, (*words, *(other or ())), fresh("out")), middle)
        mine, copied = (readable(f) for f in (out, left[numbers.index(middle)]))
        assert all(mine.get(n) == copied.get(n) for n in {*before, *after, *FOREIGN})
        states = [once(folder) for folder in (*left, out)]
    print(f"{verb}: {len(states)} ends: " + ", ".join(f"{s} {states.count(s)}" for s in ("old", "refused", "new")))
    assert "old" in states or other is None
