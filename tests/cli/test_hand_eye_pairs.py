"""How `vision hand-eye` pairs views with poses, and what it says where they cannot belong together."""

# obeys: one-stands-still

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal
from hand_eye_stream import stream
from hand_eye_world import IMAGE, World, codes, corners, hand_eye, lens_file, named, off_by, poses, world


def run(folder, made, names=None, told=None, pixels=None):
    views = corners(folder, made, pixels=pixels)
    place = poses(folder, made.told if told is None else told, names=names)
    return [views, place, "--lens", lens_file(folder), "--image", IMAGE]


def test_names_of_which_none_is_that_of_a_view(tmp_path):
    """An error with the first names of both; --pair order is the consent."""
    made = world(31, count=12)
    words = run(tmp_path, made, [f"shot{i:02d}.png" for i in range(12)])
    ran = robocal("vision", "hand-eye", *words)
    assert ran.status == 2 and "v1, v2" in ran.err and "shot00.png" in ran.err and "--pair order" in ran.err
    told, status = hand_eye(*words, "--pair", "order")
    assert status == 0 and "paired-in-order" in codes(told)
    ran = robocal("vision", "hand-eye", *run(tmp_path, made), "--pair", "name")
    assert ran.status == 2 and "no names of poses" in ran.err


def test_some_names_match_and_the_rest_is_listed(tmp_path):
    made = world(32, count=16)
    words = run(tmp_path, made, [*named(made)[:12], *(f"x{i}" for i in range(4))])
    told, status = hand_eye(*words)
    said = {r["code"]: r["numbers"] for r in told["remarks"]}
    assert status == 0 and said["views-without-pose"]["views"] == ["v13", "v14", "v15", "v16"]
    assert said["poses-without-view"]["poses"] == ["x0", "x1", "x2", "x3"]
    words = run(tmp_path, made, [*named(made)[:2], *(f"x{i}" for i in range(14))])
    ran = robocal("vision", "hand-eye", *words)
    assert ran.status == 2 and "2, paired by name" in ran.err and "v3, v4" in ran.err


def test_rows_of_a_log_without_an_image_do_not_count(tmp_path):
    """Most rows of a log name no image; a name that two rows have is refused."""
    made = world(33, count=12)
    log = np.repeat(made.told, 2, axis=0)
    names = [n for name in named(made) for n in (name, "-")]
    told, status = hand_eye(*run(tmp_path, made, names, log))
    assert status == 0 and "poses-without-view" not in codes(told)
    names[1] = names[0]
    ran = robocal("vision", "hand-eye", *run(tmp_path, made, names, log))
    assert ran.status == 2 and "several poses have the name of one view" in ran.err


def test_the_terminal_says_how_many_pairs_it_leaves_out(tmp_path):
    made = world(34, count=15)
    ran = robocal("vision", "hand-eye", *run(tmp_path, made, named(made)))
    assert ran.status == 0 and "and 3 more" in ran.out


def test_one_that_stands_still(tmp_path):
    """One image for all poses, or one pose for all images: named; both fresh, and it is gone."""
    made = world(35, count=10)
    one = run(tmp_path, made, named(made), pixels=np.repeat(made.pixels[:1], 10, 0))
    told, status = hand_eye(*one)
    assert status == 3 and [r["code"] for r in told["verdict"]["remarks"]] == ["one-stands-still"]
    assert "the target in the images turns by" in told["verdict"]["reasons"][0]
    told, status = hand_eye(*run(tmp_path, made, named(made), told=np.repeat(made.told[:1], 10, 0)))
    assert status == 3 and [r["code"] for r in told["verdict"]["remarks"]] == ["one-stands-still"]
    assert "the robot's flange turns by" in told["verdict"]["reasons"][0]
    told, status = hand_eye(*run(tmp_path, made, named(made)))
    assert status == 0 and "one-stands-still" not in codes(told)


def test_all_views_at_one_pose(tmp_path):
    """The hand hardly turns, and nothing is said of the size of the target."""
    one = world(36, count=1)
    made = World(*(np.repeat(a, 8, 0) for a in (one.told, one.pixels, one.seen)), True)
    told, status = hand_eye(*run(tmp_path, made, named(made)))
    assert status == 3 and {r["code"] for r in told["verdict"]["remarks"]} == {"little-turn"}


@pytest.mark.parametrize(("wrong", "option"), [("order", "--target-quaternion wxyz"), ("inverse", "--target-inverse")])
def test_poses_of_a_target_read_otherwise(tmp_path, wrong, option):
    made = world(37, count=14)
    seen = np.linalg.inv(made.seen) if wrong == "inverse" else made.seen
    form = {"form": "abb", "heads": ("qx", "qy", "qz", "qw")} if wrong == "order" else {}
    words = [
        poses(tmp_path, seen, names=named(made), name="target.csv", **form),
        poses(tmp_path, made.told, names=named(made)),
    ]
    told, status = hand_eye(*words)
    reasons = [r for r in told["verdict"]["remarks"] if r["code"] == "poses-read-otherwise"]
    assert status == 3 and option in [r["numbers"]["option"] for r in reasons]
    told, status = hand_eye(*words, *option.split())
    assert status == 0 and np.abs(off_by(told, made)).max() < 6
    ran = robocal("vision", "hand-eye", *run(tmp_path, made, named(made)), *option.split())
    assert ran.status == 2 and "corners are no poses" in ran.err


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_times_of_poses_in_another_unit(tmp_path, unit, factor):
    """Times that are read in s and are not: an error says what to write, and written it is right."""
    _, words = stream(tmp_path, views=12)
    log = tmp_path / "log.csv"
    head, *rows = (line.split(",") for line in log.read_text().splitlines())
    lines = [",".join([f"{float(r[0]) * factor:.0f}", *r[1:]]) for r in rows]
    for first, status in (("time", 2), ("time [s]", 2), (f"time [{unit}]", 0)):
        log.write_text("\n".join([",".join([first, *head[1:]]), *lines]) + "\n")
        ran = robocal("vision", "hand-eye", *words)
        assert ran.status == status and (status == 0 or f"`time [{unit}]`" in ran.err), ran.err


def test_times_from_nothing_in_another_unit(tmp_path):
    """Views at 0 to 10 s beside poses at 0 to 10 000: all views would be at the first pose."""
    _, words = stream(tmp_path, views=12)
    log, views = tmp_path / "log.csv", tmp_path / "stream.csv"
    head, *rows = (line.split(",") for line in log.read_text().splitlines())
    lines = [",".join([f"{(float(r[0]) - 1.7e9) * 1e3:.0f}", *r[1:]]) for r in rows]
    log.write_text("\n".join([",".join(["time", *head[1:]]), *lines]) + "\n")
    out = []
    for line in views.read_text().splitlines():
        cells = line.split(",")
        out.append(
            ",".join(f"{float(c) / 1e9 - 1.7e9:.6f}" if c.startswith("17") and len(c) == 19 else c for c in cells)
        )
    views.write_text("\n".join(out) + "\n")
    ran = robocal("vision", "hand-eye", *words)
    assert ran.status == 2 and "`time [ms]`" in ran.err, ran.err
