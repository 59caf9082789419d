"""Pages of cable robots answer first: what was asked, what came out, what next, in words; what looks like a failure and is none says so."""

from __future__ import annotations

import re

import pytest
from cli.runs import robocal
from cli.test_cable_poses import planar, robot
from report.test_brief import PAGE, above_fold, body_of, lost, words_of

from robocal.files.cable.write import describe_cable

SYMBOL = re.compile(r"\b[A-Z]_[a-z0-9]\b|\blambda\b|\bmu\b|\bbox Z\b|\bworkspace W\b")
PATH = "id,x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]\nlow,0,0,1.2,0,0,0\nhigh,0,0,1.8,0,0,0\naway,0.2,0,1.5,0,0,4\n"
FLAT = "id,x [m],y [m],z [m],rx [deg],ry [deg],rz [deg]\nmiddle,0,0,1.5,0,0,0\nhigh,0.2,0,1.8,0,0,0\n"
POSES = ("cable", "poses", "robot.yaml", "-n", 30, "--choose", 6)
RUNS = {
    "poses": (POSES, "list.json"),
    "poses of a planar robot": (("cable", "poses", "planar.yaml", "-n", 30), "list.json"),
    "workspace": (("cable", "workspace", "robot.yaml", "--cells", 9, "--rays", 300), "workspace.json"),
    "area": (("cable", "workspace", "planar.yaml", "--cells", 9, "--rays", 60), "workspace.json"),
    "tension": (("cable", "tension", "robot.yaml", "path.csv"), "tension.json"),
    "tension in a plane": (("cable", "tension", "planar.yaml", "flat.csv"), "tension.json"),
    "not held": (("cable", "tension", "planar.yaml", "flat.csv", "--payload", 40), "tension.json"),
    "contact": (("cable", "contact", "robot.yaml", "path.csv"), "contact.json"),
    "require": (("cable", "require", "robot.yaml", "list/poses.csv", "--accuracy", "4mm"), "require.json"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("answers")
    for name, text in {
        "robot.yaml": describe_cable(robot()), "planar.yaml": describe_cable(planar()), "path.csv": PATH, "flat.csv": FLAT,
    }.items():  # fmt: skip
        (place / name).write_text(text, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        assert robocal(*POSES, "-o", "list").status == 0
    return place


def page_of(folder, monkeypatch, command, document):
    """The body of the page, and what its document says."""
    monkeypatch.chdir(folder)
    out = folder / "_".join(str(w).replace("/", "") for w in command[1:4]) / "out"
    ran = robocal(*command, "-o", out, "--force")
    assert ran.status in (0, 3), ran.said
    return body_of((out / "report.html").read_text(encoding="utf-8")), (out / document).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", RUNS)
def test_the_answer_stands_first_and_in_words(folder, monkeypatch, name):
    body, document = page_of(folder, monkeypatch, *RUNS[name])
    asked, found, after = (body.index(f"<dt>{word}</dt>") for word in ("Asked", "Found", "Next"))
    assert asked < found < after < body.index("<h2")
    shown = above_fold(body[: body.index("<footer")])
    assert len(words_of(shown).split()) <= PAGE and "How it was worked out" not in shown
    assert "How it was worked out" in body[body.index('id="specialist"') :]
    # A symbol stands in brackets after the words for it.
    assert not SYMBOL.search(re.sub(r"\([^()]*\)", "", words_of(body[: body.index("<footer")])))
    told = re.sub(r"<(header|svg|footer)\b.*?</\1>|<figcaption>.*?</figcaption>", "", body[:after], flags=re.S)
    rest = re.sub(r"<dl class=.kv.>.*?</dl>", "", body, count=1, flags=re.S)
    assert not lost(words_of(told).replace("0; at the border 0", ""), words_of(rest) + document + "100 0")


def test_few_targets_reached_are_no_failure_and_all_reached_ask_for_no_words(folder, monkeypatch):
    large, _ = page_of(folder, monkeypatch, ("cable", "poses", "robot.yaml", "-n", 20, "--scale", 2), "list.json")
    head = words_of(large[: large.index("<dt>Asked")])
    share = re.search(r"([\d.]+) % of the targets reached", head)
    assert share and float(share[1]) < 50 and head.index(share[0]) < head.index("no failure") < head.index("each pose")
    small = ("cable", "poses", "planar.yaml", "-n", 20, "--box=-0.1,0,1.4,0.1,0,1.6")
    body, document = page_of(folder, monkeypatch, small, "list.json")
    assert '"reached": 1.0' in document and "100 % of the targets reached" in body and "no failure" not in body


def test_a_workspace_that_the_search_cut_off_says_so(folder, monkeypatch):
    box = "--box=-0.2,-0.2,1.3,0.2,0.2,1.7"
    cut, _ = page_of(
        folder, monkeypatch, ("cable", "workspace", "robot.yaml", box, "--cells", 7, "--rays", 100), "workspace.json"
    )
    told = words_of(cut[: cut.index("<h2")])
    assert "z is greatest" in told and "the search ended, not the strength of the cables" in told
    free, _ = page_of(folder, monkeypatch, *RUNS["area"])
    assert "the search ended" not in words_of(free) or "cut off by the box" in words_of(free)


def test_what_is_not_held_and_what_pulls_its_least_are_told_apart(folder, monkeypatch):
    held, _ = page_of(folder, monkeypatch, *RUNS["tension in a plane"])
    first = words_of(held[: held.index("<h2")])
    assert "c3 at every pose: no failure" in first and "cannot balance" not in first
    lost_, _ = page_of(folder, monkeypatch, *RUNS["not held"])
    first = words_of(lost_[: lost_.index("<h2")])
    assert "Not held" in first and "2 poses: within the limits the cables cannot balance the load there" in first
    assert "less payload" in first
