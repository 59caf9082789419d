"""`vision hand-eye` of views out of step from one on, of poses that were copied, and of markers with the number of another: each is named,
and where the advice is obeyed nothing is said."""

# obeys: views-out-of-step
# obeys: readings-of-another
# obeys: marker-twice
# obeys: markers-exchanged
# obeys: sights-aside

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal
from hand_eye_world import IMAGE, codes, hand_eye, lens_file, named, off_by, poses, world
from lens_world import LENS, SQUARE, marker_rows, see, write

from robocal.session.vision.hand_eye_step import find_step

CODES = {
    "views-out-of-step",
    "readings-of-another",
    "marker-twice",
    "markers-exchanged",
    "sights-aside",
    "view-of-another",
}


def told_of(document):
    every = {r["code"]: r for r in (*document["verdict"]["remarks"], *document["remarks"])}
    return {c: every[c]["numbers"] for c in CODES & set(every)}


def by_poses(folder, made, told=None, names=None):
    """The words of a run by poses of the target with 0.2 mm of noise."""
    seen = np.array(made.seen)
    seen[:, :3, 3] += 2e-4 * np.random.default_rng(1).normal(size=(len(seen), 3))
    told = made.told if told is None else told
    mount = ["--camera", "hand" if made.inhand else "fixed"]
    return [poses(folder, seen, "ur", names, "target.csv"), poses(folder, told, names=names), *mount]


@pytest.mark.parametrize("inhand", [True, False])
def test_views_that_are_out_of_step_from_one_on(tmp_path, inhand):
    """One pose was not taken, and the last one twice: the ninth view has the pose of the tenth."""
    made = world(16, count=16, inhand=inhand)
    lost = np.concatenate([made.told[:8], made.told[9:], made.told[15:]])
    told, status = hand_eye(*by_poses(tmp_path, made, lost))
    assert status == 3 and set(told_of(told)) == {"views-out-of-step"}, told["verdict"]
    assert told_of(told)["views-out-of-step"]["first"] == "target.csv:9"
    assert told_of(told)["views-out-of-step"]["word"] == "earlier"
    names = named(made)
    told, status = hand_eye(*by_poses(tmp_path, made, made.told, names))
    assert status == 0 and not told_of(told)


def test_a_step_is_found_wherever_it_is():
    made = world(17, count=18)
    machine = np.linalg.inv(made.told)
    assert find_step(made.seen, machine) is None and find_step(made.seen, np.roll(machine, 1, axis=0)) is None
    for k in range(2, 16):
        assert find_step(made.seen, np.concatenate([machine[:k], machine[k + 1 :], machine[k : k + 1]])) == (k, -1)


def test_a_pose_that_was_copied_into_the_row_below(tmp_path):
    """No view has the pose that is lost; but another one fits what was copied."""
    made = world(11, count=12)
    copied = np.array(made.told)
    copied[5] = made.told[4]
    names = named(made)
    told, _ = hand_eye(*by_poses(tmp_path, made, copied, names))
    said = told_of(told)
    assert set(said) == {"readings-of-another"}, told
    assert (said["readings-of-another"]["view"], said["readings-of-another"]["partner"]) == (names[5], names[4])
    told, status = hand_eye(*by_poses(tmp_path, made, made.told, names))
    assert status == 0 and not told_of(told)


def markers(folder, change, count=14):
    """The words of a run by two markers; `change` rewrites a row (view, marker) and says by how much it is moved, m."""
    made = world(7, count=count)
    corner = 0.02 * SQUARE
    rows = []
    for k, y in enumerate(made.seen):
        for name, at in (("7", (-0.05, 0.02, 0.0)), ("9", (0.05, -0.03, 0.0))):
            called, by = change(k + 1, name)
            uv = see((corner + at + [by, 0, 0]) @ y[:3, :3].T + y[:3, 3], LENS)
            rng = np.random.default_rng([k, int(name)])
            rows += [r | {"view": f"v{k + 1}"} for r in marker_rows(uv[None], 0.1, rng, (called,)) if called]
    told = poses(folder, made.told, names=named(made))
    views = write(folder / "markers.csv", rows)
    return made, [views, told, "--lens", lens_file(folder), "--image", IMAGE, "--size", "40"]


SWAP = {"7": "9", "9": "7"}


def right(view, name):
    return name, 0.0


@pytest.mark.parametrize(
    ("change", "code", "views"),
    [
        (lambda v, n: (SWAP[n] if 3 <= v <= 6 else n, 0.0), "markers-exchanged", (3, 4, 5, 6)),
        (lambda v, n: (SWAP[n] if v == 5 else n, 0.0), "markers-exchanged", (5,)),
        (lambda v, n: ("7" if (v % 3 == 0) == (n == "9") else "", 0.0), "marker-twice", (3, 6, 9, 12)),
        (lambda v, n: (n, 0.02 if n == "9" and v in (4, 11) else 0.0), "sights-aside", (4, 11)),
    ],
)
def test_numbers_of_markers_that_are_wrong(tmp_path, change, code, views):
    made, words = markers(tmp_path, change)
    told, status = hand_eye(*words)
    said = told_of(told)
    assert set(said) == {code}, (told["verdict"], said)
    assert tuple(said[code]["views"]) == tuple(f"v{v}" for v in views)
    assert status == 3 or np.abs(off_by({"frames": told["frames"][:1] * 2}, made)[0]).max() < 4
    told, status = hand_eye(*words, "--exclude", ",".join(f"v{v}" for v in views))
    assert status == 0 and not told_of(told), told["verdict"]
    _, words = markers(tmp_path, right)
    told, status = hand_eye(*words)
    assert status == 0 and not told_of(told)


def test_markers_of_which_none_is_in_two_views(tmp_path):
    _, words = markers(tmp_path, lambda v, n: (str(v) if n == "7" else "", 0.0))
    ran = robocal("vision", "hand-eye", *words)
    assert ran.status == 2 and "no marker is seen in two views" in ran.err, ran.err


def test_turns_in_rad_that_are_read_in_degrees(tmp_path):
    """The hand seems to turn hardly at all; what the views show is no little turn."""
    made = world(14, inhand=False)
    seen = poses(tmp_path, made.seen, "ur", named(made), "target.csv")
    words = [seen, poses(tmp_path, made.told, "ur", named(made), length=1.0, units=False), "--maker", "ur"]
    told, status = hand_eye(*words, "--camera", "fixed", "--units", "m,deg")
    assert status == 3 and codes(told) & {"poses-read-otherwise"}, told["verdict"]
    assert "--units rad" in told["verdict"]["remarks"][0]["advice"]
    assert hand_eye(*words, "--camera", "fixed", "--units", "m,rad")[1] == 0
