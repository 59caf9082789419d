"""The rigs, drawn: one arm, one line style, ink for the robot, blue for the instrument, red for what is measured."""

from __future__ import annotations

import math
from html import escape
from itertools import pairwise

Point = tuple[float, float]
WIDTH, HEIGHT, FLOOR = 640, 330, 290
STYLE = """
.ink{stroke:#222;stroke-width:2;fill:none}.link{stroke:#222;stroke-width:9;fill:none}.core{stroke:#e9e6df;stroke-width:5;fill:none}
.ghost{stroke:#aaa;stroke-width:7;fill:none}.ghostcore{stroke:#f6f5f1;stroke-width:4;fill:none}
.blue{stroke:#1f5fa8;stroke-width:2;fill:none}.bluefill{stroke:#1f5fa8;stroke-width:2;fill:#e3edf8}
.red{stroke:#c0392b;stroke-width:2;fill:none}.sight{stroke:#c0392b;stroke-width:1.6;fill:none;stroke-dasharray:7 5}
.redfill{stroke:#c0392b;stroke-width:2;fill:#fbe9e7}.joint{stroke:#222;stroke-width:2;fill:#fff}.ghostjoint{stroke:#aaa;stroke-width:2;fill:#fff}
.floor{stroke:#999;stroke-width:1.5;fill:none}.plate{stroke:#1f5fa8;stroke-width:3;fill:none}
text{font:14px system-ui,sans-serif;fill:#222}.b{fill:#1f5fa8}.r{fill:#c0392b}.g{fill:#777}
path{stroke-linecap:round;stroke-linejoin:round}
"""
REACH = ((105.0, 215.0), (150.0, 110.0), (262.0, 92.0), (300.0, 140.0))
LOW = ((105.0, 215.0), (175.0, 140.0), (270.0, 180.0), (312.0, 215.0))
HIGH = ((105.0, 215.0), (105.0, 112.0), (195.0, 50.0), (245.0, 72.0))


class Sheet:
    """A drawing under way."""

    def __init__(self, title: str, text: str) -> None:
        self.title, self.text, self.parts, self.count = title, text, [], 0

    def line(self, *points: Point, cls: str = "ink") -> None:
        """A line through points, each stroke a little bowed as a hand draws it."""
        d = f"M{points[0][0]:.1f} {points[0][1]:.1f}"
        for (ax, ay), (bx, by) in pairwise(points):
            self.count += 1
            length = math.hypot(bx - ax, by - ay) or 1.0
            bow = (0.008 if cls in ("link", "core", "ghost", "ghostcore") else 0.012) * length * (-1) ** self.count
            mx, my = (ax + bx) / 2 - (by - ay) / length * bow, (ay + by) / 2 + (bx - ax) / length * bow
            d += f"Q{mx:.1f} {my:.1f} {bx:.1f} {by:.1f}"
        self.parts.append(f'<path class="{cls}" d="{d}"/>')

    def shape(self, *points: Point, cls: str) -> None:
        """A closed outline."""
        d = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        self.parts.append(f'<path class="{cls}" d="M{d}Z"/>')

    def circle(self, x: float, y: float, r: float, cls: str) -> None:
        self.parts.append(f'<circle class="{cls}" cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>')

    def arc(self, x: float, y: float, r: float, start: float, stop: float, cls: str = "red") -> None:
        """Part of a circle; angles in degrees, counterclockwise from the right."""
        a, b = math.radians(start), math.radians(stop)
        big = int(abs(stop - start) > 180)
        self.parts.append(
            f'<path class="{cls}" d="M{x + r * math.cos(a):.1f} {y - r * math.sin(a):.1f}A{r} {r} 0 {big} '
            f'{int(stop < start)} {x + r * math.cos(b):.1f} {y - r * math.sin(b):.1f}"/>'
        )

    def label(self, x: float, y: float, text: str, cls: str = "", anchor: str = "start") -> None:
        end = f' text-anchor="{anchor}"' if anchor != "start" else ""
        self.parts.append(f'<text x="{x:.0f}" y="{y:.0f}" class="{cls}"{end}>{escape(text)}</text>')

    def arrow(self, a: Point, b: Point, cls: str = "red") -> None:
        self.line(a, b, cls=cls)
        turn = math.atan2(b[1] - a[1], b[0] - a[0])
        for side in (2.6, -2.6):
            self.line(
                b,
                (b[0] + 11 * math.cos(turn + side), b[1] + 11 * math.sin(turn + side)),
                cls=cls.replace("sight", "red"),
            )

    def span(self, a: Point, b: Point, text: str) -> None:
        """A dimension between two points, its text below."""
        self.arrow(a, b, "blue")
        self.arrow(b, a, "blue")
        self.label((a[0] + b[0]) / 2, max(a[1], b[1]) + 19, text, "b", "middle")

    def axes(self, x: float, y: float, turn: float = 0.0, cls: str = "blue", size: float = 30) -> None:
        """A coordinate frame seen from the side."""
        for angle in (turn, turn + 90):
            a = math.radians(angle)
            self.arrow((x, y), (x + size * math.cos(a), y - size * math.sin(a)), cls)

    def floor(self) -> None:
        self.line((20, FLOOR), (620, FLOOR), cls="floor")

    def arm(self, points: tuple[Point, ...] = REACH, ghost: bool = False) -> Point:
        """The robot on its foot; returns where its tool ends."""
        outer, core, joint = ("ghost", "ghostcore", "ghostjoint") if ghost else ("link", "core", "joint")
        if not ghost:
            self.shape((72, FLOOR), (138, FLOOR), (124, FLOOR - 24), (86, FLOOR - 24), cls="joint")
            self.line((105, FLOOR - 24), points[0], cls=outer)
            self.line((105, FLOOR - 24), points[0], cls=core)
        self.line(*points, cls=outer)
        self.line(*points, cls=core)
        for x, y in points[:-1]:
            self.circle(x, y, 9, joint)
        return points[-1]

    def tripod(self, x: float, y: float) -> None:
        for foot in (-26, 0, 26):
            self.line((x, y), (x + foot, FLOOR), cls="blue")

    def svg(self, key: str) -> str:
        size = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
        about = f'<title id="{key}-t">{escape(self.title)}</title><desc id="{key}-d">{escape(self.text)}</desc>'
        white = f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>'
        head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-labelledby="{key}-t {key}-d">'
        return f"{head}{about}<style>{STYLE}</style>{white}{''.join(self.parts)}</svg>\n"


def tracker(s: Sheet, x: float = 520, y: float = 165) -> Point:
    """A laser tracker on its tripod; returns where the beam begins."""
    s.tripod(x, y + 30)
    s.shape((x - 20, y + 30), (x + 20, y + 30), (x + 16, y), (x - 16, y), cls="bluefill")
    s.circle(x, y - 8, 15, "bluefill")
    return x - 15, y - 10


def camera(s: Sheet, x: float, y: float, turn: float = 180.0) -> Point:
    """A camera that looks along `turn` (degrees); returns its lens."""
    a = math.radians(turn)
    u, v = (math.cos(a), -math.sin(a)), (math.sin(a), math.cos(a))

    def at(p: float, q: float) -> Point:
        return x + p * u[0] + q * v[0], y + p * u[1] + q * v[1]

    s.shape(at(-22, -15), at(14, -15), at(14, 15), at(-22, 15), cls="bluefill")
    s.shape(at(14, -7), at(28, -12), at(28, 12), at(14, 7), cls="bluefill")
    return at(28, 0)


def socket(s: Sheet, x: float, y: float) -> None:
    """A cone on a stand that holds a ball."""
    s.line((x - 13, y - 6), (x, y + 10), (x + 13, y - 6), cls="plate")
    s.line((x, y + 10), (x, FLOOR), cls="blue")


def _position(s: Sheet) -> None:
    s.floor()
    tip = s.arm()
    eye = tracker(s)
    s.line(eye, tip, cls="sight")
    s.circle(*tip, 8, "redfill")
    s.axes(575, 262)
    s.label(300, 172, "reflector", "r", "middle")
    s.label(420, 112, "x, y, z", "r", "middle")
    s.label(520, 124, "tracker", "b", "middle")
    s.label(540, 318, "its frame is found too", "b", "middle")


def _pose(s: Sheet) -> None:
    s.floor()
    tip = s.arm()
    eye = tracker(s)
    s.line(eye, (tip[0] + 20, tip[1]), cls="sight")
    s.shape(
        (tip[0] - 4, tip[1] - 17),
        (tip[0] + 16, tip[1] - 17),
        (tip[0] + 16, tip[1] + 17),
        (tip[0] - 4, tip[1] + 17),
        cls="redfill",
    )
    s.axes(tip[0] + 6, tip[1], -35, "red", 44)
    s.label(330, 200, "6D target or marker", "r", "middle")
    s.label(415, 78, "place and orientation", "r", "middle")
    s.label(520, 124, "tracker or camera", "b", "middle")
    s.axes(575, 262)
    s.label(540, 318, "its frame is found too", "b", "middle")


def _spherical(s: Sheet) -> None:
    s.floor()
    tip = s.arm(HIGH)
    eye = tracker(s)
    s.line(eye, tip, cls="sight")
    s.line(eye, (eye[0] - 130, eye[1]), cls="blue")
    s.circle(*tip, 8, "redfill")
    s.arc(*eye, 92, 180, 163)
    s.label(402, 143, "elevation", "r", "end")
    s.label(360, 92, "range", "r", "middle")
    s.arc(520, 215, 34, 200, 340)
    s.label(566, 240, "azimuth", "r")
    s.label(548, 148, "tracker", "b")
    s.label(245, 48, "reflector", "r")


def _bearing(s: Sheet) -> None:
    s.floor()
    tip = s.arm()
    for x, y, name in ((455, 190, "theodolite 1"), (570, 150, "theodolite 2")):
        s.tripod(x, y + 20)
        s.shape((x - 14, y + 20), (x + 14, y + 20), (x + 14, y - 12), (x - 14, y - 12), cls="bluefill")
        s.line((x - 24, y - 2), (x + 12, y - 2), cls="plate")
        s.line((x - 26, y - 2), tip, cls="sight")
        s.label(x, FLOOR + 19, name, "b", "middle")
    s.circle(*tip, 8, "redfill")
    s.arc(429, 188, 62, 180, 160)
    s.line((429, 188), (352, 188), cls="blue")
    s.label(352, 214, "elevation", "r", "middle")
    s.label(420, 92, "two angles, no distance", "r", "middle")
    s.label(318, 126, "target", "r")


def _range(s: Sheet) -> None:
    s.floor()
    tip = s.arm()
    for i, (x, y, side) in enumerate(((420, 45, -1), (590, 95, -1), (455, 245, -1), (585, 225, -1))):
        s.shape((x, y - 6), (x + side * 16, y - 14), (x + side * 16, y + 14), (x, y + 6), cls="bluefill")
        s.line((x + side * 16, y), tip, cls="sight")
        s.label(x + 8, y + 5, f"r{i + 1}", "b")
    for r in (18, 27, 36):
        s.arc(*tip, r, -40, 60)
    s.circle(*tip, 8, "redfill")
    s.label(285, 176, "emitter", "r", "middle")
    s.label(520, 318, "receivers: places found too", "b", "middle")
    s.label(440, 165, "time of flight", "r")


def _distance(s: Sheet) -> None:
    s.floor()
    tip = s.arm()
    socket(s, 480, 235)
    mid = (390.0, 188.0)
    s.line(tip, mid, cls="plate")
    s.line((mid[0] - 8, mid[1] - 13), (mid[0] - 16, mid[1] + 4), cls="blue")
    s.line((mid[0] - 40, mid[1] - 27), (480, 235), cls="blue")
    s.circle(*tip, 8, "redfill")
    s.circle(480, 235, 9, "redfill")
    s.label(404, 162, "reading", "r")
    s.label(284, 172, "ball on the tool", "r", "middle")
    s.label(500, 240, "ball in a socket,", "b")
    s.label(500, 260, "its place is found", "b")
    s.label(360, 110, "ballbar, telescopic bar or draw-wire", "b")


def _displacement(s: Sheet) -> None:
    s.floor()
    other = s.arm(LOW, ghost=True)
    tip = s.arm(HIGH)
    s.circle(*other, 7, "redfill")
    s.circle(*tip, 7, "redfill")
    s.arrow(tip, (other[0] - 5, other[1] - 12))
    lens = camera(s, 540, 140)
    s.line(lens, tip, cls="sight")
    s.line(lens, other, cls="sight")
    s.tripod(545, 156)
    s.label(300, 152, "p(second) - p(first)", "r")
    s.label(245, 52, "first", "g")
    s.label(330, 232, "second", "g")
    s.label(540, 110, "instrument", "b", "middle")
    s.label(515, 318, "only how it is turned is seen", "b", "middle")


def _relative_pose(s: Sheet) -> None:
    s.floor()
    other = s.arm(LOW, ghost=True)
    tip = s.arm(HIGH)
    s.axes(*tip, -20, "red", 40)
    s.axes(*other, -55, "red", 40)
    s.arc(255, 145, 92, 42, -30)
    s.arrow((342, 174), (334, 196))
    s.label(358, 140, "T_first_second", "r")
    s.label(192, 32, "first", "g", "end")
    s.label(330, 270, "second", "g")
    s.label(430, 210, "an inertial unit, a camera", "b")
    s.label(430, 230, "that sees its own motion:", "b")
    s.label(430, 250, "no frame, no base", "b")


def _point(s: Sheet) -> None:
    s.floor()
    low = ((105.0, 215.0), (205.0, 118.0), (300.0, 150.0), (350.0, 222.0))
    s.arm(((105.0, 215.0), (150.0, 90.0), (290.0, 90.0), (350.0, 222.0)), ghost=True)
    tip = s.arm(low)
    socket(s, *tip)
    s.circle(tip[0], tip[1], 10, "redfill")
    socket(s, 500, 222)
    s.circle(500, 222, 10, "joint")
    s.span((364, 256), (486, 256), "known distance")
    s.label(366, 205, "the ball rests in a socket", "r")
    s.label(270, 70, "again and again, from other configurations", "g")
    s.label(500, 318, "two sockets, places found", "b", "middle")


def _plane(s: Sheet) -> None:
    s.floor()
    tip = s.arm(((105.0, 215.0), (170.0, 100.0), (290.0, 120.0), (330.0, 212.0)))
    s.line((270, 222), (410, 222), cls="plate")
    s.line((340, 224), (340, FLOOR), cls="blue")
    s.circle(tip[0], tip[1], 10, "redfill")
    s.line((450, 250), (520, 120), cls="plate")
    s.line((486, 190), (520, FLOOR), cls="blue")
    s.line((330, 40), (460, 70), cls="plate")
    s.line((440, 66), (590, 66), (590, FLOOR), cls="blue")
    s.arrow((385, 222), (385, 180), "blue")
    s.label(392, 186, "n", "b")
    s.label(262, 208, "touches", "r", "end")
    s.label(350, 246, "plate 1", "b")
    s.label(530, 150, "plate 2", "b")
    s.label(390, 40, "plate 3", "b")
    s.label(500, 318, "heights and tilts are found", "b", "middle")


def _sphere(s: Sheet) -> None:
    s.floor()
    tip = s.arm(((105.0, 215.0), (170.0, 96.0), (290.0, 100.0), (345.0, 172.0)))
    for x in (380.0, 520.0):
        s.circle(x, 205, 30, "bluefill")
        s.line((x, 235), (x, FLOOR), cls="blue")
    s.circle(355, 180, 6, "redfill")
    s.line(tip, (353, 178), cls="red")
    s.arrow((380, 205), (401, 184), "blue")
    s.label(388, 218, "R", "b")
    s.span((394, 256), (506, 256), "known distance")
    s.label(330, 200, "the probe", "r", "end")
    s.label(330, 218, "touches", "r", "end")
    s.label(450, 160, "from many sides", "g", "middle")
    s.label(500, 318, "centres are found", "b", "middle")


def _pixels(s: Sheet) -> None:
    s.floor()
    tip = s.arm()
    corners = [(tip[0] + x, tip[1] + y) for x, y in ((2, -26), (26, -18), (24, 22), (0, 26))]
    s.line((tip[0], tip[1]), corners[0], cls="ink")
    s.shape(*corners, cls="redfill")
    lens = camera(s, 545, 175)
    s.tripod(545, 192)
    for c in corners:
        s.line(lens, c, cls="sight")
        s.circle(*c, 3, "redfill")
    s.shape((440, 22), (600, 22), (600, 112), (440, 112), cls="bluefill")
    for u, v in ((490, 45), (535, 50), (532, 90), (487, 86)):
        s.line((u - 4, v), (u + 4, v), cls="red")
        s.line((u, v - 4), (u, v + 4), cls="red")
    s.label(447, 40, "u, v", "r")
    s.label(312, 190, "marker", "r", "middle")
    s.label(545, 148, "camera", "b", "middle")
    s.label(510, 318, "or in the hand, marker at rest", "b", "middle")


KINDS = {
    "position": (_position, "A tracker sees a reflector on the tool"),
    "pose": (_pose, "A tracker or camera sees where a target on the tool is and how it is turned"),
    "spherical": (_spherical, "A laser tracker reads a range and two angles"),
    "bearing": (_bearing, "Two theodolites read two angles each"),
    "range": (_range, "Receivers around the arm measure times of flight"),
    "distance": (_distance, "A bar between a socket beside the robot and a ball on its tool"),
    "displacement": (_displacement, "How far the tool moved between two configurations"),
    "relative_pose": (_relative_pose, "How the tool moved and turned between two configurations"),
    "point": (
        _point,
        "A ball on the tool rests in a socket from many configurations; a second socket stands at a known distance",
    ),
    "plane": (_plane, "A ball on the tool touches three plates"),
    "sphere": (_sphere, "A probe on the tool touches two spheres"),
    "pixels": (_pixels, "A fixed camera sees the corners of a marker on the tool"),
}


def drawings() -> dict[str, str]:
    """The pictures by kind, as SVG text."""
    out = {}
    for kind, (draw, text) in KINDS.items():
        sheet = Sheet(f"Rig: {kind}", text)
        draw(sheet)
        out[kind] = sheet.svg(kind)
    return out
