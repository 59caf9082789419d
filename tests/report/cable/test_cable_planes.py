"""Sections, tensions over poses, and figure 3.6: what is counted, coloured and marked is what was given."""

from __future__ import annotations

import re

import numpy as np
import pytest
from report.cable.drawn import ends, inside, of_class, parsed
from report.cable.machines import robot_of

from robocal.cables.boundary import Outline
from robocal.cables.interference import Contacts
from robocal.cables.pose_list import PoseBox, PoseList
from robocal.cables.workspace import Grid
from robocal.errors import ModelError
from robocal.report.cable.list_picture import draw_reach
from robocal.report.cable.plane_sections import section
from robocal.report.cable.tension_series import tensions
from robocal.report.contour import contour

START = np.array([0.1, -0.2, 1.5])


def circle(axes: tuple[int, int], radius: float = 0.8) -> Outline:
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    points = np.tile(START, (90, 1))
    points[:, axes[0]] += radius * np.cos(turn)
    points[:, axes[1]] += radius * np.sin(turn)
    return Outline(START, points)


def cells(counts: tuple[int, int, int], margins: bool = True) -> Grid:
    """Margins that fall with the distance from START: zero on a sphere of 0.8 m."""
    sides = np.array([[-1.5, 1.5], [-1.5, 1.5], [0.0, 3.0]])
    cell = (sides[:, 1] - sides[:, 0]) / counts
    axes = tuple(s[0] + c * (np.arange(n) + 0.5) for s, c, n in zip(sides, cell, counts, strict=True))
    at = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    margin = 50 * (0.8 - np.linalg.norm(at - START, axis=-1))
    margin[0, 0, 0] = -np.inf
    return Grid(axes, cell, margin >= 0, margin if margins else None)  # type: ignore[arg-type]


def area(root: object, name: str) -> float:
    """Covered by the rectangles of a class, px^2."""
    total = 0.0
    for e in of_class(root, name):  # type: ignore[arg-type]
        if e.tag.endswith("path"):
            for box in re.findall(r"M(\S+) (\S+)H(\S+)V(\S+)H", e.attrib["d"]):
                x0, y0, x1, y1 = map(float, box)
                total += (x1 - x0) * (y1 - y0)
    return total


@pytest.mark.parametrize("axes", [(0, 1), (0, 2), (1, 2), (1, 0), (2, 0)])
@pytest.mark.parametrize("margins", [True, False])
def test_sections_colour_what_is_held(axes: tuple[int, int], margins: bool) -> None:
    robot, grid, line = robot_of(8), cells((40, 50, 60), margins), circle(axes)
    root = parsed(section(robot, [line], grid, axes, points=line.points[::10]))
    assert inside(root) and len(of_class(root, "outline")) == 1
    assert len(of_class(root, "dots")[0].attrib["d"].split("M")) - 1 == 9
    drawn = np.array(ends(of_class(root, "outline")[0].attrib["d"]))
    radius = np.ptp(drawn[:, 0]) / 2
    assert radius == pytest.approx(np.ptp(drawn[:, 1]) / 2, rel=0.01)  # one scale both ways
    held = sum(area(root, name) for name in (["m1", "m2", "m3", "m4", "m5", "m6"] if margins else ["in"]))
    assert held == pytest.approx(np.pi * radius**2, rel=0.06)
    if margins:
        # The zero of the margin runs along the outline.
        zero = np.array([p for e in of_class(root, "zero")[:1] for p in ends(e.attrib["d"])])
        middle = (drawn.max(0) + drawn.min(0)) / 2
        assert len(zero) > 50 and np.abs(np.linalg.norm(zero - middle, axis=1) / radius - 1).max() < 0.03


def test_sections_without_anything_held_or_drawn() -> None:
    robot = robot_of(8)
    assert inside(parsed(section(robot, [], None, (0, 1))))
    nothing = cells((10, 10, 1))
    lost = Grid(nothing.axes, nothing.cell, nothing.inside & False, np.full((10, 10, 1), -np.inf))
    root = parsed(section(robot, [], lost, (0, 1)))
    assert inside(root) and not area(root, "m1") and area(root, "n1") + area(root, "n6") > 0
    planar = robot_of(4, "2T")
    assert inside(parsed(section(planar, [], None, (0, 2))))


def test_anchors_that_are_seen_as_one_share_a_label() -> None:
    robot = robot_of(8, names=[f"<{i}>" for i in range(8)])
    root = parsed(section(robot, [], None, (0, 1)))
    words = ", ".join("".join(e.itertext()) for e in of_class(root, "name"))
    assert sorted(re.findall(r"<\d>", words)) == [f"<{i}>" for i in range(8)]


def test_contours_lie_where_a_quantity_passes() -> None:
    u, v = np.linspace(-1, 1, 60), np.linspace(-1.2, 1, 70)
    x, y = np.meshgrid(u, v, indexing="ij")
    found = contour(u, v, 0.7 - np.hypot(x, y))
    assert np.abs(np.linalg.norm(found, axis=-1) - 0.7).max() < 1e-3
    assert np.linalg.norm(found[:, 1] - found[:, 0], axis=1).sum() == pytest.approx(2 * np.pi * 0.7, rel=2e-3)
    # A saddle is cut twice; what is infinite counts as outside.
    sides = np.array([0.0, 1.0])
    for high in (2.0, 0.5):
        cuts = contour(sides, sides, np.array([[high, -1], [-1, high]]))
        # The middle decides which pair of corners is joined: the cuts part the other two from it.
        parted = [[0.0, 1], [1, 0]] if high > 1 else [[0.0, 0], [1, 1]]
        assert len(cuts) == 2
        assert all(min(np.linalg.norm(c.mean(0) - p) for p in parted) < 0.4 for c in cuts)
    lone = np.full((3, 3), -np.inf)
    lone[1, 1] = 2.0
    assert len(contour(np.arange(3.0), np.arange(3.0), lone)) == 4
    assert len(contour(np.arange(3.0), np.arange(3.0), np.where(lone > 0, np.nan, lone), unknown=True)) == 0
    assert not len(contour(u, v, np.full((60, 70), np.nan))) and not len(contour(u, v, np.ones((60, 70))))


@pytest.mark.parametrize(("k", "m"), [(1, 3), (7, 8), (60, 12), (1200, 4), (5000, 3)])
def test_tensions_over_poses(k: int, m: int) -> None:
    rng = np.random.default_rng(k)
    t = rng.uniform(20, 125, (k, m))
    bad = rng.random(k) < 0.2
    t[bad] = np.nan
    text = tensions([f"p{i}" for i in range(k)], t, np.tile([20.0, 125.0], (m, 1)), [f"cable_{i}" for i in range(m)])
    root = parsed(text)
    assert inside(root) and len(text) < 500_000 and len(of_class(root, "band")) == m + 1
    runs = int((np.diff(np.concatenate([[0], bad.astype(int)])) == 1).sum())
    assert sum(e.attrib["d"].count("M") for e in of_class(root, "lost") if e.tag.endswith("path")) == runs
    if k <= 1200:
        assert sum(e.attrib["d"].count("M") for e in of_class(root, "value")) == m * int((~bad).sum())
        assert not of_class(root, "beyond")
    assert f"{int(bad.sum())} of them without" in (root.findtext("{http://www.w3.org/2000/svg}desc") or "")


def test_tensions_beyond_their_limits_are_marked() -> None:
    t = np.array([[20.0, 30.0], [19.0, 126.0], [125.0, 50.0]])
    root = parsed(tensions(["a", "b", "<c>"], t, [[20.0, 125.0]] * 2, ["x&", "y"]))
    assert sum(e.attrib["d"].count("M") for e in of_class(root, "beyond")) == 2
    far = parsed(tensions(["a"], [[300.0, 280.0]], [[100.0, 5000.0]] * 2, ["x", "y"]))
    assert inside(far) and "up to 5000 N, above the strips" in "".join(far.itertext())
    with pytest.raises(ModelError, match="tensions to be drawn"):
        tensions(["a"], t, [[20.0, 125.0]] * 2, ["x", "y"])
    with pytest.raises(ModelError, match="tensions to be drawn"):
        tensions([], np.zeros((0, 2)), [[20.0, 125.0]] * 2, ["x", "y"])
    assert inside(parsed(tensions(["a", "b"], np.full((2, 2), np.nan), [[0.0, np.inf]] * 2, ["x", "y"])))


def test_figure_3_6_counts_what_it_shows(rng: np.random.Generator) -> None:
    n, box = 150, PoseBox(np.array([1.2, 1.1, 1.0]), np.full(3, 0.5))
    start = np.eye(4)
    start[:3, 3] = START
    v = rng.uniform(-1, 1, (n, 3)) * box.translation
    far = np.minimum(0.8 / np.linalg.norm(v, axis=1), 1.0)
    contacts = Contacts(far, np.zeros(n, np.int64), np.full((n, 2), -1), np.full(n, np.inf), 1e-6)
    listing = PoseList(start, v, np.zeros((n, 3)), 0.95 * far, far, np.where(far < 1, 1, 0), contacts)
    root = parsed(draw_reach(circle((0, 1)), listing, box=box))
    assert inside(root)
    wished, found = (of_class(root, name)[0].attrib["d"] for name in ("wished", "found"))
    assert wished.count("M") == n and len(re.findall(r"M\S+ \S+l", found)) == n
    z = np.array(ends(of_class(root, "zbox")[0].attrib["d"]))
    dots = np.array([[float(x), float(y)] for x, y in re.findall(r"M(\S+) (\S+?)a", wished)])
    assert (dots >= z.min(0) - 3).all() and (dots <= z.max(0) + 3).all()
    assert np.ptp(z[:, 0]) / np.ptp(z[:, 1]) == pytest.approx(1.2 / 1.1, rel=0.01)
    # Every cross lies on the straight way from X_0 to its dot.
    crosses = np.array([[float(x), float(y)] for x, y in re.findall(r"M(\S+) (\S+?)l", found)])
    crosses += 3.4
    dots[:, 0] += 0.75 * 3.4
    middle = z[:4].mean(0)
    np.testing.assert_allclose(crosses - middle, (dots - middle) * listing.fraction[:, None], atol=0.3)
    # x goes right and y up.
    assert np.corrcoef(dots[:, 0], v[:, 0])[0, 1] > 0.999 and np.corrcoef(dots[:, 1], v[:, 1])[0, 1] < -0.999
    assert f"{100 * listing.reach_share:.0f} % reached" in "".join(root.itertext())
    bare = parsed(draw_reach(None, listing, (0, 2)))
    assert inside(bare) and not of_class(bare, "zbox") and not of_class(bare, "space")


def test_long_names_of_cables_stay_apart() -> None:
    names = [f"upper winch of the hall, number {i}" for i in range(1, 13)]
    text = tensions(["a", "b"], np.full((2, 12), 50.0), np.tile([20.0, 125.0], (12, 1)), names)
    shown = {e.text for e in parsed(text).iter() if e.text and "…" in e.text}
    assert len(shown) == 12 and all(len(s) <= 14 for s in shown)
