"""Pictures of cable robots: every robot is drawn whole, inside its picture, and nothing in a robot file becomes markup."""

from __future__ import annotations

import colorsys
import json
import re

import numpy as np
import pytest
from report.cable.drawn import inside, of_class, parsed
from report.cable.machines import LIMITS, ball, robot_of

from robocal.cables.boundary import Outline, Surface
from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import cable_robot
from robocal.cables.pulley import Pulleys
from robocal.errors import ModelError
from robocal.geometry import se3
from robocal.report.cable.part import part
from robocal.report.cable.scene import scene
from robocal.report.cable.scene_rows import SceneRows
from robocal.report.cable.solids import courses, decimate, hull_loops, wheels
from robocal.report.page import page
from robocal.report.view import View, best, fit_view


@pytest.mark.parametrize("m", range(3, 13))
def test_every_cable_is_drawn_inside(m: int) -> None:
    robot = robot_of(m)
    root = parsed(scene(robot, robot.home, tension=np.linspace(*LIMITS, m), caption="A robot at its first pose"))
    assert {e.attrib["data-cable"] for e in root.iter() if "data-cable" in e.attrib} == {str(i + 1) for i in range(m)}
    assert len(of_class(root, "anchor")) == len(of_class(root, "joint")) == m
    assert len(of_class(root, "notch")) == m
    assert inside(root)


@pytest.mark.parametrize("degrees", ["2T", "1R2T"])
@pytest.mark.parametrize("plane", ["xy", "xz", "yz"])
@pytest.mark.parametrize("m", [3, 4, 7])
def test_planar_robots_lie_in_their_plane(degrees: str, plane: str, m: int) -> None:
    robot = robot_of(m, degrees, plane)
    turn = np.linspace(0, 2 * np.pi, 40)
    points = np.zeros((40, 3))
    i, j = ("xyz".index(axis) for axis in plane)
    points[:, i], points[:, j] = 0.5 * np.cos(turn), 0.4 * np.sin(turn)
    outline = Outline(robot.home[:3, 3], points + robot.home[:3, 3])
    root = parsed(scene(robot, robot.home, tension=np.full(m, 50.0), surface=outline))
    assert inside(root) and len(of_class(root, "edge")) == 1 and "data-eye" not in root.attrib
    # The first axis goes right and the second up, both to one scale.
    places = [[float(e.attrib["cx"]), -float(e.attrib["cy"])] for e in of_class(root, "anchor")]
    wanted = robot.a[:, [i, j]]
    order = np.lexsort((np.round(wanted[:, 1], 6), np.round(wanted[:, 0], 6)))
    found = np.array(sorted(places))
    wanted = wanted[order]
    scale = np.ptp(found[:, 0]) / np.ptp(wanted[:, 0])
    np.testing.assert_allclose(found - found.mean(0), scale * (wanted - wanted.mean(0)), atol=0.2)


@pytest.mark.parametrize("limits", [LIMITS, (1.0, 500.0), None])
def test_colours_follow_the_tension(limits: tuple[float, float] | None) -> None:
    robot = robot_of(12)
    robot = cable_robot("rig", robot.a, robot.b, limits=None if limits is None else np.tile(limits, (12, 1)))
    tension = np.linspace(*(limits or LIMITS), 12)
    root = parsed(scene(robot, robot.home, tension=tension))
    colour = {int(e.attrib["data-cable"]): e.attrib["stroke"] for e in of_class(root, "held")}
    hue = []
    for i in range(1, 13):
        r, g, b = (int(colour[i][k : k + 2], 16) / 255 for k in (1, 3, 5))
        h = colorsys.rgb_to_hsv(r, g, b)[0]
        hue.append(h if h < 0.8 else h - 1)
    assert (np.diff(hue) < 0).all()  # from blue over green to red
    heights = [float(re.findall(r"M\S+ (\S+)l", e.attrib["d"])[0]) for e in of_class(root, "notch")]
    assert (np.diff(heights) < 0).all()


def test_what_is_wrong_with_a_tension_is_seen() -> None:
    robot = robot_of(6)
    tension = np.array([np.nan, 5.0, 20.0 - 1e-9, 125.0 + 1e-9, 160.0, -3.0])
    root = parsed(scene(robot, robot.home, tension=tension))
    state = {}
    for e in root.iter():
        if "data-cable" in e.attrib:
            state[int(e.attrib["data-cable"])] = e.attrib["class"].split()[1]
            assert ("stroke" in e.attrib) == (state[int(e.attrib["data-cable"])] != "none")
    assert state == {1: "none", 2: "slack", 3: "held", 4: "held", 5: "over", 6: "slack"}
    words = ["".join(e.itertext()) for e in root.iter() if "data-w" in e.attrib]
    assert words == [
        "c1 no tension",
        "c2 5.00\u00a0N, slack",
        "c3 20.0\u00a0N",
        "c4 125\u00a0N",
        "c5 160\u00a0N, over limit",
        "c6 −3.00\u00a0N, slack",
    ]
    said = root.findtext("{http://www.w3.org/2000/svg}desc") or ""
    assert "Slack: c2, c6." in said and "Over limit: c5." in said and "No tension: c1." in said
    # Nothing known at all: no cable has a colour, and the picture still stands.
    lost = parsed(scene(robot, robot.home, tension=np.full(6, np.nan)))
    assert not of_class(lost, "held") and inside(lost)
    plain = parsed(scene(robot, robot.home))
    assert of_class(plain, "plain") and not of_class(plain, "notch")


def test_surfaces_are_thinned_to_what_a_page_holds() -> None:
    robot, whole = robot_of(8), ball(4000)
    vertices, faces = decimate(whole)
    assert 1000 < len(faces) <= 1500
    assert abs(Surface(whole.start, vertices, faces).volume / whole.volume - 1) < 0.02
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # closed
    poses = np.tile(np.eye(4), (4000, 1, 1))
    text = scene(robot, robot.home, tension=np.full(8, 60.0), surface=whole, poses=poses)
    assert len(text) < 1_000_000
    root = parsed(text)
    assert len(of_class(root, "face")) == len(faces) and len(of_class(root, "spot")) == 1500 and inside(root)
    empty = Surface(whole.start, np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    assert not of_class(parsed(scene(robot, robot.home, surface=empty)), "face")


@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_robots_of_any_size_fit(size: float) -> None:
    robot = robot_of(8, size=size)
    assert inside(parsed(scene(robot, robot.home, tension=np.full(8, 60.0))))
    long = robot_of(8, names=[f"a rather long name {i}" for i in range(8)])
    assert inside(parsed(scene(long, long.home, tension=np.full(8, 1e-7))))


def test_a_robot_far_from_its_base_says_so() -> None:
    robot = robot_of(8)
    far = cable_robot("far", robot.a + [100.0, 0, 0], robot.b)
    text = scene(far, far.home)
    assert inside(parsed(text)) and "base origin outside, its axes at a corner" in text


def test_nothing_in_a_robot_file_becomes_markup() -> None:
    evil = ['<script>alert("1")</script>', 'a" onload="x', "b&c", "</svg>", "nul\x00\x0b\ud800"]
    robot = robot_of(5, names=evil)
    drawn = scene(robot, robot.home, tension=[30, 40, np.nan, 5, 60], caption="<b>&")
    root = parsed(drawn)
    assert any("".join(e.itertext()).startswith("b&c") for e in root.iter() if "data-w" in e.attrib)
    text = page("<i>title</i>", [part("<u>", "<q>&", drawn, [["<td>", "<th>"], ["<tr>", "<em>"]])], kind="Cable robot")
    for bad in (
        "<script>alert",
        '" onload="',
        "<b>&",
        "<i>title",
        "<u>",
        "<q>",
        "<td><td>",
        "<th><th>",
        "<tr><tr>",
        "<em>",
        "\x00",
    ):
        assert bad not in text
    text.encode("utf-8")


def test_shapes_that_do_not_fit_are_refused() -> None:
    robot = robot_of(4)
    with pytest.raises(ModelError, match="pose to be drawn"):
        scene(robot, np.eye(3))
    with pytest.raises(ModelError, match="pose to be drawn"):
        scene(robot, np.full((4, 4), np.nan))
    with pytest.raises(ModelError, match="one per cable"):
        scene(robot, robot.home, tension=[1.0, 2.0])


def test_hulls_however_flat() -> None:
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = hull_loops(cube)
    assert sorted(len(f) for f in faces) == [4] * 6
    for f in faces:  # in order around a square, and turning left seen from outside
        assert np.allclose(np.linalg.norm(np.roll(f, -1, axis=0) - f, axis=1), 1)
        assert np.cross(f[1] - f[0], f[2] - f[1]) @ (f.mean(0) - 0.5) > 0
    assert [len(f) for f in hull_loops(cube[[0, 1, 2, 3, 0]])] == [4]
    assert [len(f) for f in hull_loops(np.array([[0.0, 0, 0], [1, 1, 1], [0.5, 0.5, 0.5]]))] == [2]
    assert [len(f) for f in hull_loops(np.ones((5, 3)))] == [1]


def test_cables_go_round_their_pulleys(rng: np.random.Generator) -> None:
    plain = robot_of(8)
    axis = rng.normal(size=(8, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    radius = np.array([0.0, *rng.uniform(0.02, 0.2, 7)])
    robot = cable_robot("wheels", plain.a, plain.b, pulleys=Pulleys(radius, axis))
    ends = robot.home[:3, 3] + robot.b
    lengths = inverse(robot, robot.home[None])[0][0]
    found = courses(robot, ends)
    for i, line in enumerate(found):
        np.testing.assert_allclose(line[0], ends[i], atol=1e-12)
        np.testing.assert_allclose(line[-1], robot.a[i], atol=1e-12)
        # Chords of a sixth of the wrap are a little shorter than their arcs.
        assert 0.94 * lengths[i] < np.linalg.norm(np.diff(line, axis=0), axis=1).sum() <= lengths[i] + 1e-9
    assert len(wheels(robot, ends)) == 7
    assert len(of_class(parsed(scene(robot, robot.home)), "pulley")) == 7


def test_views_keep_what_they_promise(rng: np.random.Generator) -> None:
    points = rng.normal(size=(50, 3)) * [3, 2, 1]
    view = fit_view(View(-60.0, 20.0, points.mean(axis=0)), [(points, (100.0, 50.0, 700.0, 400.0))], perspective=True)
    xy, near = view.flat(points)
    assert (xy.min(0) >= [100 - 1e-6, 50 - 1e-6]).all() and (xy.max(0) <= [700 + 1e-6, 400 + 1e-6]).all()
    assert np.isclose(np.ptp(xy[:, 0]), 600, atol=0.01) or np.isclose(np.ptp(xy[:, 1]), 350, atol=0.01)
    np.testing.assert_allclose(view.axes @ view.axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(view.axes) > 0
    # Nearer is larger.
    one = view.flat(np.stack([points, points + 0.01 * view.axes[0]]))[0]
    size = np.linalg.norm(one[1] - one[0], axis=1)
    assert (np.diff(size[np.argsort(near)]) > 0).all()


def test_the_best_view_does_not_hide_a_cable_behind_another() -> None:
    start = np.array([[2.0, y, 1.0] for y in (-2, -1, 0, 1, 2)])
    end = np.array([[0.0, y, 1.0] for y in (-2, -1, 0, 1, 2)])
    view = best(np.zeros(3), start, end)
    assert abs(view.axes[2, 1]) < 0.5  # not along y, in which they stand one behind another


def test_a_page_needs_nothing_from_outside() -> None:
    robot = robot_of(8)
    drawn = [scene(robot, robot.home, tension=np.full(8, t)) for t in (30.0, 60.0)]
    flat = scene(robot_of(4, "2T"), robot_of(4, "2T").home)
    table = [["cable", "tension", "note"], ["c1", "30.0 N", "held"], ["c2", "–", ""]]
    text = page(
        "Two poses",
        [*(part(f"Pose {i}", "One.\n\nTwo.", d) for i, d in enumerate(drawn)), part("Table", table=table)],
        kind="Cable robot",
    )
    assert text.count("<p>One.</p>") == 2 and text.count("<script>") == 1 and "script-src 'sha256-" in text
    assert not re.search(r"(src|href)=\"(?!data:)", text) and "@import" not in text and "url(" not in text
    keys = re.findall(r'\sid="([^"]*)"', text)
    assert len(keys) == len(set(keys))
    assert '<td class="n">30.0 N</td><td>held</td>' in text
    bare = page("Bare", [part("Numbers", table=[["", ""], ["mass", "5 kg"]])], kind="Cable robot")
    assert "<thead>" not in bare and '<td class="n">5 kg</td>' in bare
    assert "<script" not in page("Plane", [part("Plane", figure=flat)], kind="Cable robot")


def test_a_turned_scene_starts_where_the_still_one_stands() -> None:
    """turn.js projects `data-p` by `data-view`, `data-eye` and `data-at`: that must give the drawn places."""
    robot = robot_of(8)
    root = parsed(scene(robot, robot.home, tension=np.full(8, 60.0)))
    a, e = np.radians([float(v) for v in root.attrib["data-view"].split()])
    f = np.array([[-np.sin(a), np.cos(a), 0], [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)],
                  [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]])  # fmt: skip
    at, eye = np.array(root.attrib["data-at"].split(), float), float(root.attrib["data-eye"])
    for mark in [*of_class(root, "anchor"), *of_class(root, "joint")]:
        seen = f @ np.array(mark.attrib["data-p"].split(), float)
        xy = at + seen[:2] * [1, -1] * eye / (eye - seen[2])
        np.testing.assert_allclose(xy, [float(mark.attrib["cx"]), float(mark.attrib["cy"])], atol=0.3)


@pytest.mark.parametrize("degrees", ["3R3T", "1R2T"])
@pytest.mark.parametrize("wheels_too", [False, True])
def test_a_slider_knows_where_everything_is_at_every_row(degrees: str, wheels_too: bool) -> None:
    """turn.js takes knots of cables from `data-rows`; at the row that is drawn they give the marks that are drawn."""
    robot = robot_of(7, degrees)
    if wheels_too:
        robot = robot.having(pulleys=Pulleys(np.full(7, 0.08), np.tile([0.0, 0.0, 1.0], (7, 1))))
    poses = np.tile(robot.home, (80, 1, 1))
    poses[:, 0, 3] += np.linspace(-0.3, 0.3, 80)
    poses[5, 0, 3] = np.nan
    pull = np.tile(np.linspace(*LIMITS, 7), (80, 1))
    pull[41] = [np.nan, *pull[0, 1:]]
    rows = SceneRows([f"<p{i}>" for i in range(80)], poses, pull, first=41)
    root = parsed(scene(robot, poses[41], tension=pull[41], rows=rows, caption="<p41>"))
    led = json.loads(root.attrib["data-rows"])
    assert len(led["rows"]) <= 61 and led["rows"][led["first"]]["name"] == "<p41>" and inside(root)
    assert "<p5>" not in {row["name"] for row in led["rows"]}
    here = led["rows"][led["first"]]
    assert here["states"][0] == "none" and here["notches"][0] is None and here["colours"][0] == ""
    pieces = [m for m in root.iter() if "data-c" in m.attrib and "rope" in m.attrib["class"]]
    assert len(pieces) == sum(led["pieces"] + len(k) // 3 - 2 for k in here["knots"])
    for mark in pieces:
        i, k = map(int, mark.attrib["data-c"].split())
        knots = np.reshape(here["knots"][i], (-1, 3))
        free = knots[0] + np.arange(led["pieces"] + 1)[:, None] / led["pieces"] * (knots[1] - knots[0])
        every = np.concatenate([free, knots[2:]])
        np.testing.assert_allclose(
            np.reshape(mark.attrib["data-p"].split(), (2, 3)).astype(float), every[k : k + 2], atol=0.2
        )
        assert (mark.attrib.get("visibility") == "hidden") == (i == 0 and k % 2 == 1)
    view = here["origin"], next(m for m in root.iter() if "data-o" in m.attrib).attrib["data-p"].split()
    np.testing.assert_allclose(*(np.array(v, float) for v in view), atol=0.2)
    other = led["rows"][0]
    scale = float(np.ptp([row["origin"][0] for row in led["rows"]])) / 0.6
    moved = np.array(here["knots"][3][:3]) - other["knots"][3][:3]
    np.testing.assert_allclose(moved, scale * (poses[41] - poses[0])[:3, 3], atol=0.3)


def test_near_marks_hide_far_ones() -> None:
    robot = robot_of(8)
    root = parsed(scene(robot, robot.home, tension=np.full(8, 60.0)))
    view = np.radians([float(v) for v in root.attrib["data-view"].split()])
    towards = np.array([np.cos(view[1]) * np.cos(view[0]), np.cos(view[1]) * np.sin(view[0]), np.sin(view[1])])
    marks = next(g for g in root.iter() if g.attrib.get("data-part") == "marks")
    near = [
        (np.array(m.attrib["data-p"].split(), float).reshape(-1, 3) @ towards).mean()
        + float(m.attrib.get("data-lift", 0))
        for m in marks
    ]
    assert len(near) > 100 and (np.diff(near) > -0.3).all()  # to the rounding of the numbers


def test_poses_of_every_orientation_keep_the_platform_whole() -> None:
    robot = robot_of(6)
    pose = se3.from_vector(np.array([[0.2, -0.1, 1.2, 0.4, 1.1, -0.6]]))[0]
    root = parsed(scene(robot, pose, tension=np.full(6, 60.0)))
    assert inside(root) and len(of_class(root, "body")) == len(hull_loops(robot.b))
