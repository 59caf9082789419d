"""What is said of wrong input to map, hand-eye, joint estimate and probe: `python scripts/vision_mistakes.py [ITEM ...]`.

The items are those that issues 35 and 36 list. Each case makes the files of a user with one mistake, in the worlds of the tests, and runs
the command. A line tells the item, the case, the exit status, whether the mistake is named by the words that are asked, and what was
printed. `right` cases have no mistake, and must not be accused of one. At the end stands `n of N named`.
--issue 35 or 36 runs the items of one, --shard i/n every n-th case, --whole prints all that was said. Status 1 where one is not named.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import re
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "tests"), str(ROOT / "tests" / "files")]

import probe_world as probe  # noqa: E402
import thesis_rig  # noqa: E402
from hand_eye_stream import stream  # noqa: E402
from hand_eye_world import IMAGE, corners, lens_file, named, poses, world  # noqa: E402
from lens_world import LENS, SQUARE, marker_rows, see, write  # noqa: E402
from map_world import EDGE, cameras, map_rows, room, sightings  # noqa: E402

from robocal.cli.main import main as run_command  # noqa: E402

Said = tuple[int, str]


class Case(NamedTuple):
    """What is run in a folder, the exit statuses that it may have, and words, each of which is said; `a|b` is either."""

    item: str
    name: str
    run: Callable[[Path], Said]
    words: tuple[str, ...]
    status: tuple[int, ...] = (2, 3)
    never: tuple[str, ...] = ()


CASES: list[tuple[int, Case]] = []
STOPPED = 130, 143  # statuses of a command that somebody ends


def case(issue: int, item: str, name: str, *words: str, status=(2, 3), never=()):  # type: ignore[no-untyped-def]
    """Lists the function below it."""

    def listed(run):  # type: ignore[no-untyped-def]
        CASES.append((issue, Case(item, name, run, words, status, never)))
        return run

    return listed


def command(*words: object) -> Said:
    """The status of a command and what it says of its input: the error, or the verdict with its reasons and what is told beside them.
    Tables have every word, and are no answer."""
    said, beside = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(beside):
        status = run_command([*map(str, words), "--json"])
    if status not in (0, 3):
        return status, " ".join(beside.getvalue().split())
    document = json.loads(said.getvalue())
    verdict = document.get("verdict") or {"status": "listed", "remarks": []}
    every = [*verdict["remarks"], *document["remarks"]]
    told = [f"[{r['code']}] {r['sentence']}. {r.get('advice') or ''}" for r in every]
    return status, " ".join([verdict["status"].upper(), *told])


# 35: camera and robot


def cell(folder, made, told=None, pixels=None, form="quaternion", names=True, kind="pixels", mount=None, **how):  # type: ignore[no-untyped-def]
    """The words of `hand-eye` by corners of a board, or by poses of it with 0.2 mm of noise."""
    called = named(made) if names is True else names or None
    place = poses(folder, made.told if told is None else told, form, called, **how)
    maker = [] if form in ("quaternion", "abb") else ["--maker", form]
    hand = ["--camera", mount or ("hand" if made.inhand else "fixed")]
    if kind == "pixels":
        views = corners(folder, made, pixels=pixels)
        return ["vision", "hand-eye", views, place, "--lens", lens_file(folder), "--image", IMAGE, *maker, *hand]
    seen = np.array(made.seen)
    seen[:, :3, 3] += 2e-4 * np.random.default_rng(1).normal(size=(len(seen), 3))
    return ["vision", "hand-eye", poses(folder, seen, "ur", called, "target.csv"), place, *maker, *hand]


KINDS = [("pixels", True), ("pixels", False), ("pose", True), ("pose", False)]


def both(kind: str, inhand: bool) -> str:
    """What is seen, and by whom."""
    return f"{'corners' if kind == 'pixels' else 'poses of the target'}, {'in hand' if inhand else 'fixed'}"


STEP, UNIT, TWICE, EXCHANGED = (
    "images out of step by one",
    "time stamps in another unit",
    "duplicate marker",
    "base and flange exchanged, inverse poses",
)
for kind, inhand in KINDS:
    how = both(kind, inhand)

    @case(35, "right", how, "LOCATED", status=(0,), never=("warning",))
    def _(at, kind=kind, inhand=inhand):
        return command(*cell(at, world(16, count=18, inhand=inhand), kind=kind))

    for by in (1, -1):

        @case(
            35,
            STEP,
            f"{how}, {'later' if by > 0 else 'earlier'}",
            "the pose one later|the pose one earlier|stand 1 view",
        )
        def _(at, kind=kind, inhand=inhand, by=by):
            made = world(16, count=18, inhand=inhand)
            return command(*cell(at, made, np.roll(made.told, by, axis=0), names=None, kind=kind))

    @case(
        35,
        STEP,
        f"{how}, from the tenth view on",
        "the pose one later|the pose one earlier|stand 1 view|exchanged|the pose of",
    )
    def _(at, kind=kind, inhand=inhand):
        made = world(16, count=18, inhand=inhand)
        told = np.concatenate([made.told[:9], made.told[10:], made.told[9:10]])
        return command(*cell(at, made, told, names=None, kind=kind))

    @case(35, EXCHANGED, f"{how}, inverse", "--inverse", "--camera")
    def _(at, kind=kind, inhand=inhand):
        made = world(11, inhand=inhand)
        return command(*cell(at, made, np.linalg.inv(made.told), kind=kind))

    @case(35, EXCHANGED, f"{how}, camera said on the other side", "--inverse", "--camera")
    def _(at, kind=kind, inhand=inhand):
        made = world(11, inhand=inhand)
        return command(*cell(at, made, kind=kind, mount="fixed" if inhand else "hand"))

    ORDER = "quaternion order"

    @case(35, ORDER, how, "--quaternion wxyz")
    def _(at, kind=kind, inhand=inhand):
        return command(*cell(at, world(12, inhand=inhand), form="abb", kind=kind, heads=("qx", "qy", "qz", "qw")))

    UNITS = "degrees, mm"

    @case(35, UNITS, f"{how}, mm without a unit", "--units mm")
    def _(at, kind=kind, inhand=inhand):
        return command(*cell(at, world(13, inhand=inhand), kind=kind, units=False))

    @case(35, UNITS, f"{how}, m said to be mm", "--units m|m read as mm|[m]")
    def _(at, kind=kind, inhand=inhand):
        words = cell(at, world(13, inhand=inhand), kind=kind, length=1.0, units=False)
        return command(*words, "--units", "mm,rad")

    @case(35, UNITS, f"{how}, rad said to be deg", "rad")
    def _(at, kind=kind, inhand=inhand):
        words = cell(at, world(14, inhand=inhand), form="ur", kind=kind, length=1.0, units=False)
        return command(*words, "--units", "m,deg")

    @case(35, UNITS, f"{how}, deg said to be rad", "deg", "whole turn|--units")
    def _(at, kind=kind, inhand=inhand):
        return command(*cell(at, world(14, inhand=inhand), form="kuka", kind=kind, units=False), "--units", "mm,rad")

    FEW = "fewer than three rotations"

    @case(35, FEW, f"{how}, two views", "3 at least|three|3 views")
    def _(at, kind=kind, inhand=inhand):
        return command(*cell(at, world(20, count=2, inhand=inhand), kind=kind))

    @case(35, FEW, f"{how}, three views", "few views|three|rotations|views")
    def _(at, kind=kind, inhand=inhand):
        return command(*cell(at, world(20, count=3, inhand=inhand), kind=kind))

    @case(35, FEW, f"{how}, two rotations, ten places", "rotation|turn|axis|axes")
    def _(at, kind=kind, inhand=inhand):
        return command(*cell(at, two_turns(inhand), kind=kind))

    @case(35, FEW, f"{how}, one rotation, ten places", "turn")
    def _(at, kind=kind, inhand=inhand):
        return command(*cell(at, two_turns(inhand, 1), kind=kind))

    AXIS = "all about one axis"
    for axis in ((0, 0, 1), (1, 0, 0)):

        @case(35, AXIS, f"{how}, {'roll' if axis[2] else 'tilt'}", "one axis")
        def _(at, kind=kind, inhand=inhand, axis=axis):
            return command(*cell(at, world(18, count=14, inhand=inhand, axis=axis), kind=kind))

    MOVED = "a marker that moved, also half way"

    @case(35, MOVED, f"{how}, the board half way", "moved")
    def _(at, kind=kind, inhand=inhand):
        made = world(23, count=24, inhand=inhand)
        told, there = np.array(made.told), [0.006, 0.004, 0.0]
        if inhand:
            told[14:, :3, 3] -= there  # a board that went the other way
        else:
            told[14:, :3, 3] += there
        return command(*cell(at, made, told, kind=kind))


def two_turns(inhand, count=2):  # type: ignore[no-untyped-def]
    """Ten views of which no more than `count` orientations differ."""
    from hand_eye_world import HAND, HELD, STAND, TABLE
    from lens_world import BOARD

    made = world(20, count=10, inhand=inhand)
    seen = np.array(made.seen)
    for k in range(10):
        seen[k, :3, :3] = made.seen[k % count, :3, :3]
    ends = np.linalg.inv(HAND @ seen) if inhand else seen
    told = TABLE @ ends if inhand else STAND @ ends @ np.linalg.inv(HELD)
    pixels = np.array([see(BOARD @ y[:3, :3].T + y[:3, 3], LENS) for y in seen])
    return replace(made, told=told, pixels=pixels, seen=seen)


@case(35, ORDER, "the target's poses", "--target-quaternion wxyz")
def _(at):
    made = world(37, count=14)
    seen = poses(at, made.seen, "abb", named(made), "target.csv", heads=("qx", "qy", "qz", "qw"))
    return command("vision", "hand-eye", seen, poses(at, made.told, names=named(made)))


@case(35, EXCHANGED, "the target's poses inverse", "--target-inverse")
def _(at):
    made = world(37, count=14)
    seen = poses(at, np.linalg.inv(made.seen), names=named(made), name="target.csv")
    return command("vision", "hand-eye", seen, poses(at, made.told, names=named(made)))


@case(35, UNITS, "the target's poses in mm", "--target-units mm")
def _(at):
    made = world(7, count=16)
    seen = poses(at, made.seen, name="target.csv", units=False)
    return command("vision", "hand-eye", seen, poses(at, made.told))


for unit, factor in (("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
    for head in ("time", "time [s]"):

        @case(35, UNIT, f"{unit} under {head}", f"time [{unit}]")
        def _(at, factor=factor, head=head):
            _, words = stream(at, views=12)
            log = at / "log.csv"
            first, *rows = (line.split(",") for line in log.read_text().splitlines())
            lines = [",".join([f"{float(r[0]) * factor:.0f}", *r[1:]]) for r in rows]
            log.write_text("\n".join([",".join([head, *first[1:]]), *lines]) + "\n")
            return command("vision", "hand-eye", *words)


@case(35, UNIT, "s under time [ms]", "time [s]")
def _(at):
    _, words = stream(at, views=12)
    log = at / "log.csv"
    log.write_text(log.read_text().replace("time [s]", "time [ms]", 1))
    return command("vision", "hand-eye", *words)


@case(35, UNIT, "from nothing: views s, poses ms", "time [ms]")
def _(at):
    _, words = stream(at, views=12)
    log, views = at / "log.csv", at / "stream.csv"
    head, *rows = (line.split(",") for line in log.read_text().splitlines())
    lines = [",".join([f"{(float(r[0]) - 1.7e9) * 1e3:.0f}", *r[1:]]) for r in rows]
    log.write_text("\n".join([",".join(["time", *head[1:]]), *lines]) + "\n")
    short = re.sub(r"\b17\d{17}\b", lambda m: f"{float(m[0]) / 1e9 - 1.7e9:.6f}", views.read_text())
    views.write_text(short)
    return command("vision", "hand-eye", *words)


HALF = "half-turned board"
for turned in ([3], [3, 7], [2, 5, 9, 11], [0, 1, 2, 3, 4, 5, 6], list(range(14))):
    for inhand in (True, False):
        every = len(turned) == 14

        @case(
            35,
            HALF,
            f"{len(turned)} of 14 views, {'in hand' if inhand else 'fixed'}",
            *([] if every else ["half|other end", "--undo-half-turns"]),
            status=(0, 3),
        )
        def _(at, turned=turned, inhand=inhand):
            made = world(25, count=14, inhand=inhand)
            pixels = np.array(made.pixels)
            pixels[turned] = pixels[turned][:, ::-1]
            return command(*cell(at, made, pixels=pixels))


# 35: markers


def laid(seed=1, count=12):  # type: ignore[no-untyped-def]
    """Markers of a room and views of them."""
    rng = np.random.default_rng(seed)
    placed, views = room(rng), cameras(rng, count)
    return rng, placed, views, np.full(len(placed), EDGE)


def mapped(at, rows, *more, name="map-corners.csv"):  # type: ignore[no-untyped-def]
    """`vision map` of rows of corners."""
    numbers = ", ".join(f"{k}: {v}" for k, v in LENS.items())
    sigma = "sigma: {fx: 2, fy: 2, cx: 2, cy: 2, k1: 0.01}"
    (at / "lens.yaml").write_text(
        f"robocal: 1\nkind: lens\nmodel: brown\nimage: [1280, 960]\nnumbers: {{{numbers}}}\n{sigma}\n"
    )
    return command("vision", "map", write(at / name, rows), "--lens", at / "lens.yaml", "--size", "60", *more)


@case(35, "right", "map", "LOCATED", status=(0,), never=("warning",))
def _(at):
    rng, placed, views, edges = laid(count=20)
    return mapped(at, map_rows(sightings(placed, views, edges), 0.1, rng))


@case(35, TWICE, "map, in one view", "marker 3 in view v1")
def _(at):
    rng, placed, views, edges = laid()
    names = list(range(len(placed)))
    names[6] = 3
    return mapped(at, map_rows(sightings(placed, views, edges), 0.1, rng, names))


@case(35, TWICE, "map, in views of their own", "marker 3", "two places|two markers")
def _(at):
    rng, placed, views, edges = laid(count=20)
    every = sightings(placed, views, edges)
    seen = [(v, 3 if m == 6 else m, uv) for v, m, uv in every if not (m == 3 and v % 2) and not (m == 6 and v % 2 == 0)]
    return mapped(at, map_rows(seen, 0.1, rng))


def two_markers(at, where=((-0.05, 0.02, 0), (0.05, -0.03, 0)), names=("7", "9"), later=None, count=14):  # type: ignore[no-untyped-def]
    """`hand-eye` by two markers of unknown places; from half way on they are elsewhere."""
    made = world(7, count=count)
    rows = []
    for k, y in enumerate(made.seen):
        now = where if later is None or k < count // 2 else later
        points = np.concatenate([0.02 * SQUARE + p for p in now])
        rows.append(see(points @ y[:3, :3].T + y[:3, 3], LENS))
    place = write(at / "markers.csv", marker_rows(np.array(rows), 0.1, np.random.default_rng(3), names))
    told = poses(at, made.told, names=named(made))
    return place, [told, "--lens", lens_file(at), "--image", IMAGE, "--size", "40"]


@case(35, "right", "hand-eye, two markers", "LOCATED", status=(0,), never=("warning",))
def _(at):
    place, words = two_markers(at)
    return command("vision", "hand-eye", place, *words)


@case(35, TWICE, "hand-eye, in one view", "marker 7|7")
def _(at):
    place, words = two_markers(at, names=("7", "7"))
    return command("vision", "hand-eye", place, *words)


@case(35, TWICE, "hand-eye, in views of their own", "7", "two places|moved|exchanged|two markers")
def _(at):
    place, words = two_markers(at)
    lines = Path(place).read_text().splitlines()
    keep = [lines[0]]
    for line in lines[1:]:
        cells = line.split(",")
        if (int(cells[0][1:]) % 2 == 0) == (cells[1] == "7"):
            keep.append(",".join([cells[0], "7", *cells[2:]]))
    Path(place).write_text("\n".join(keep) + "\n")
    return command("vision", "hand-eye", place, *words)


for first, last in ((8, 14), (5, 5), (3, 6), (1, 14)):

    @case(
        35,
        TWICE,
        f"hand-eye, the numbers of two exchanged in views {first} to {last}",
        *(() if last - first == 13 else ("7", "9", "exchanged")),
        status=(0, 3),
    )
    def _(at, first=first, last=last):
        place, words = two_markers(at)
        head, *rows = (line.split(",") for line in Path(place).read_text().splitlines())
        to = {"7": "9", "9": "7"}
        changed = [[r[0], to[r[1]], *r[2:]] if first <= int(r[0][1:]) <= last else r for r in rows]
        Path(place).write_text("\n".join(map(",".join, [head, *changed])) + "\n")
        return command("vision", "hand-eye", place, *words)


@case(35, MOVED, "hand-eye, the last two views are off by 60 px", "v17", "v18", status=(0, 3))
def _(at):
    made = world(16, count=18)
    pixels = np.array(made.pixels)
    pixels[16:, :, 0] += 60
    return command(*cell(at, made, pixels=pixels))


ONCE, ISLANDS = "no marker seen twice", "islands"


@case(35, ONCE, "map", "no marker is seen in two views")
def _(at):
    rng, placed, views, edges = laid()
    seen = [s for s in sightings(placed, views[:6], edges) if s[1] % 6 == s[0]]
    return mapped(at, map_rows(seen, 0.1, rng))


@case(35, ONCE, "hand-eye", "seen twice|two views|one view|once")
def _(at):
    place, words = two_markers(at)
    lines = Path(place).read_text().splitlines()
    kept = [line.split(",") for line in lines[1:] if line.split(",")[1] == "7"]
    Path(place).write_text("\n".join([lines[0], *(",".join([c[0], c[0][1:], *c[2:]]) for c in kept)]) + "\n")
    return command("vision", "hand-eye", place, *words)


@case(35, ISLANDS, "map", "no view joins", "0, 1, 2, 3")
def _(at):
    rng, placed, views, edges = laid()
    seen = [s for s in sightings(placed, views, edges) if (s[1] < 4) == (s[0] % 2 == 0)]
    return mapped(at, map_rows(seen, 0.1, rng))


@case(35, ISLANDS, "map, three of them", "no view joins")
def _(at):
    rng, placed, views, edges = laid(count=24)
    seen = [s for s in sightings(placed, views, edges) if s[1] // 5 == s[0] % 3]
    return mapped(at, map_rows(seen, 0.1, rng))


for far in (0.003, 0.01, 0.05):

    @case(35, MOVED, f"map, {1e3 * far:g} mm half way", "marker 4", "moved|v11")
    def _(at, far=far):
        rng, placed, views, edges = laid(count=20)
        other = placed.copy()
        other[4, :3, 3] += [far, -far / 2, 0.0]
        seen = [
            *sightings(placed, views[:10], edges),
            *((v + 10, m, uv) for v, m, uv in sightings(other, views[10:], edges)),
        ]
        return mapped(at, map_rows(seen, 0.1, rng))

    @case(35, MOVED, f"map, {1e3 * far:g} mm since last month", "4", "moved-since", status=(0,))
    def _(at, far=far):
        rng, placed, views, edges = laid(count=20)
        status, said = mapped(at, map_rows(sightings(placed, views, edges), 0.1, rng), "-o", at / "march.yaml")
        if status:
            return status, said
        placed[4, :3, 3] += [far, -far / 2, 0.0]
        again = cameras(np.random.default_rng(9), 20)
        return mapped(
            at, map_rows(sightings(placed, again, edges), 0.1, rng), "--prior", at / "march.yaml", name="june.csv"
        )

    @case(35, MOVED, f"map that stays, {1e3 * far:g} mm", "4", "moved|does not fit|elsewhere", status=(0, 2, 3))
    def _(at, far=far):
        rng, placed, views, edges = laid(count=20)
        status, said = mapped(at, map_rows(sightings(placed, views, edges), 0.1, rng), "-o", at / "march.yaml")
        if status:
            return status, said
        placed[4, :3, 3] += [far, -far / 2, 0.0]
        again = cameras(np.random.default_rng(9), 20)
        rows = map_rows(sightings(placed, again, edges), 0.1, rng)
        return command(
            "vision", "map", write(at / "june.csv", rows), "--lens", at / "lens.yaml", "--held", at / "march.yaml"
        )

    @case(35, MOVED, f"hand-eye, one of two markers {1e3 * far:g} mm half way", "moved", "7|9")
    def _(at, far=far):
        place, words = two_markers(at, later=((-0.05 + far, 0.02, 0), (0.05, -0.03, 0)), count=20)
        return command("vision", "hand-eye", place, *words)


# 36: encoders and images


def thesis(
    at,
    change=lambda rig: rig,
    case="dome15",
    lens=None,
    text=lambda t: t,
    rows=lambda r: r,
    lengths=lambda r: r,
    seed=3,
    more=(),
):  # type: ignore[no-untyped-def]
    """`identify` of a platform on cables with a camera, in which something is changed."""
    said = YAML(typ="safe").load((ROOT / "examples" / "cable-camera" / "rig.yaml").read_text(encoding="utf-8"))
    rig, rng, camera = thesis_rig.draw(said, seed, case)
    if lens is not None:
        rig = replace(rig, given_lens=rig.lens + lens)
    thesis_rig.write(
        said, at, change(rig, said) if change.__code__.co_argcount == 2 else change(rig), rng, camera, case
    )
    (at / "pixels.yaml").write_text(text((at / "pixels.yaml").read_text()))
    for name, edit in (("pixels.csv", rows), ("lengths.csv", lengths)):
        head, *table = (at / name).read_text().splitlines()
        changed = edit([line.split(",") for line in table])
        (at / name).write_text("\n".join([head, *map(",".join, changed)]) + "\n")
    return command("identify", *(at / f"{n}.yaml" for n in ("robot", "lengths", "pixels")), "--no-leave-one-out", *more)


def pose(row):  # type: ignore[no-untyped-def]
    """The number of the pose of a row."""
    return int(row[0][1:])


@case(
    36,
    "right",
    "camera on a platform",
    "IMPROVED",
    status=(0,),
    never=("contradicted", "-moved", "slipped", "[late", "aside"),
)
def _(at):
    return thesis(at)


for wrong in (0.015, 0.05):
    bend = np.array([0, 0, 0, 0, wrong, 0, 0, 0, 0])

    @case(36, "k1", f"wrong by {wrong}, prior of 0.05", "IMPROVED", status=(0,))
    def _(at, bend=bend):
        return thesis(at, lens=bend)

    @case(36, "k1", f"wrong by {wrong}, prior of 0.0005", "the camera (lens)|camera", "sigma", status=(0, 3))
    def _(at, bend=bend):
        return thesis(at, lens=bend, case="tight")

    @case(36, "k1", f"wrong by {wrong}, lens fixed", "lens|k1", status=(0, 3))
    def _(at, bend=bend):
        return thesis(at, lens=bend, text=lambda t: re.sub(r", sigma: \{fx[^}]*\}", "", t))


for cable in range(1, 9):

    @case(36, "a cable that slipped 20 mm", f"c{cable}", f"c{cable}.l0", "slipped")
    def _(at, cable=cable):
        def slip(rows):  # type: ignore[no-untyped-def]
            return [[*r[:cable], f"{float(r[cable]) + 0.02 * (pose(r) >= 15):.6f}", *r[cable + 1 :]] for r in rows]

        return thesis(at, lengths=slip)


def pushed(which, first, by=(0.008, 0.006, 0.0)):  # type: ignore[no-untyped-def]
    """A marker that is elsewhere from a pose on."""

    def change(rig, said):  # type: ignore[no-untyped-def]
        other = rig.markers.copy()
        other[which, :3, 3] += by
        eyes = rig.poses[: said["poses"]["calibration"]] @ rig.eye
        later = thesis_rig.sightings(said, eyes, rig.lens, other, rig.edge)
        return replace(rig, seen=[s for s in rig.seen if s[0] < first] + [s for s in later if s[0] >= first])

    return change


SLID = "a marker moved 10 mm, also half way"
for which in (2, 7, 12, 18):

    @case(36, SLID, f"m{which} half way", "[frame-moved]|[sights-aside]", f"m{which}", status=(0, 2, 3))
    def _(at, which=which):
        return thesis(at, pushed(which, 15))


def surveyed(at, which, by=(0.008, 0.006, 0.0)):  # type: ignore[no-untyped-def]
    """Markers that were surveyed to 1 mm, one of which was moved after that."""
    said = YAML(typ="safe").load((ROOT / "examples" / "cable-camera" / "rig.yaml").read_text(encoding="utf-8"))
    rig, _, _ = thesis_rig.draw(said, 3, "dome15")
    place = {f"m{i}": thesis_rig.told_pose(t) for i, t in enumerate(rig.markers)}

    def text(told):  # type: ignore[no-untyped-def]
        prior = "prior: {length: 0.001, angle: 0.2}"
        return re.sub(
            r"  (m[1-9]\d*): \{mount: base, free: true\}",
            lambda m: f"  {m[1]}: {{mount: base, free: true, {place[m[1]]}, {prior}}}",
            told,
        )

    return thesis(at, pushed(which, 0, by), text=text)


@case(36, "right", "surveyed markers", "IMPROVED", status=(0,), never=("contradicted", "-moved"))
def _(at):
    return surveyed(at, 7, (0.0, 0.0, 0.0))


for which in (2, 7, 12, 18):

    @case(
        36,
        SLID,
        f"m{which} before all, surveyed to 1 mm",
        f"m{which}",
        "[prior-contradicted]|[frame-elsewhere]",
        status=(0, 2, 3),
    )
    def _(at, which=which):
        return surveyed(at, which)


NEXT = "a view whose encoders belong to the next"
for view in (5, 12, 28):

    @case(
        36,
        NEXT,
        f"image of p{view + 1} beside p{view}",
        f"p{view}",
        f"p{view + 1}",
        "[view-of-another]|[readings-of-another]|[views-exchanged]",
        status=(0, 3),
    )
    def _(at, view=view):
        def other(rows):  # type: ignore[no-untyped-def]
            return [r for r in rows if pose(r) != view] + [[f"p{view}", *r[1:]] for r in rows if pose(r) == view + 1]

        return thesis(at, rows=other)

    @case(
        36,
        NEXT,
        f"lengths of p{view + 1} beside p{view}",
        f"p{view}",
        f"p{view + 1}",
        "[view-of-another]|[readings-of-another]|[views-exchanged]",
        status=(0, 3),
    )
    def _(at, view=view):
        return thesis(at, lengths=lambda rows: [[r[0], *rows[view + 1][1:]] if pose(r) == view else r for r in rows])


@case(36, NEXT, "all of them", "one row|out of step|next|shifted")
def _(at):
    return thesis(at, rows=lambda rows: [[f"p{(pose(r) + 1) % 30}", *r[1:]] for r in rows])


LATE = "a delay between camera and encoders, to 10 %"
for delay in (0.05, -0.1, 0.3):

    @case(36, LATE, f"{1e3 * delay:g} ms", "late|behind|before|after", status=(0, 2, 3))
    def _(at, delay=delay):
        from prove.test_late_camera import lag

        said = lag(delay, 1)
        if said is None:
            return 0, "nothing is said"
        code, found = said
        words = f"{code}: {1e3 * found:.1f} ms late, {100 * (found / delay - 1):+.1f} %"
        return (3, words) if abs(found / delay - 1) < 0.1 else (0, f"{100 * (found / delay - 1):+.1f} % off")


@case(
    36,
    "flat field from one height opens exactly the listed groups",
    "level, at one height",
    "robot: open",
    "lens: in part",
    "hand-eye: not open",
    "map: open",
    "size: open",
    "delay: fixed",
    status=(0,),
)
def _(at):
    from field_world import rig
    from prove.test_opened_groups import opened

    model, _, data = rig(level=True)
    _, said = opened(model, data)
    return 0, "; ".join(f"{n}: {g.state}" for n, g in said.items())


# 36: the probe


def scan(at, wrong=lambda text: text, table=lambda rows: rows, verb="identify", points=None):  # type: ignore[no-untyped-def]
    """`identify` of a probe over wires or beads, with another data.yaml or table."""
    drawn = probe.draw(3, wires=not points)
    robot, data = probe.files_of(at, drawn, points=points)
    text = data.read_text()
    changed = wrong(text)
    data.write_text(changed)
    head, *rows = (at / "data.csv").read_text().splitlines()
    (at / "data.csv").write_text("\n".join([head, *map(",".join, table([r.split(",") for r in rows]))]) + "\n")
    return command(verb, robot, data)


LEFT, INCH, WIRES = (
    "image plane left-handed, or in mm per pixel of another depth",
    "a phantom in inches",
    "wires named wrongly",
)


@case(36, "right", "probe over wires", "LOCATED", status=(0,), never=("phantom-",))
def _(at):
    return scan(at)


# u and v exchanged, or counted from the other side, are a turn of the plane about an axis in it: points tell it from no other turn.


@case(36, LEFT, "negative size of a pixel", "size of a pixel")
def _(at):
    return scan(at, lambda t: t.replace("pixel: [0.08, 0.074]", "pixel: [0.08, -0.074]"))


@case(36, LEFT, "left-handed matrix of PLUS", "left-handed")
def _(at):
    from test_plane_points import CONFIG, RESULT

    (at / "res.xml").write_text(RESULT.replace('Matrix="0.08 0 0 0 0 0.07', 'Matrix="-0.08 0 0 0 0 0.07'))
    (at / "conf.xml").write_text(CONFIG)
    return command("vision", "probe", at / "res.xml", at / "conf.xml", "-o", at / "out")


for factor in (2.0, 0.5, 1.3):

    @case(36, LEFT, f"pixels {factor:g} times as large", "pixel", "depth", status=(0, 3))
    def _(at, factor=factor):
        return scan(at, lambda t: t.replace("pixel: [0.08, 0.074]", f"pixel: [{0.08 * factor:g}, {0.074 * factor:g}]"))


def relist(text, change):  # type: ignore[no-untyped-def]
    """The data.yaml with other numbers in the list of wires."""

    def wire(m):  # type: ignore[no-untyped-def]
        ends = (", ".join(f"{v:g}" for v in change(np.array(list(map(float, e.split(",")))))) for e in m.groups()[1:])
        front, back = ends
        return f"  {m[1]}: {{front: [{front}], back: [{back}]}}"

    return re.sub(r"  (\w+): \{front: \[([^]]*)\], back: \[([^]]*)\]\}", wire, text)


@case(36, INCH, "wires", "inch")
def _(at):
    return scan(at, lambda t: relist(t, lambda v: v / 25.4))


@case(36, INCH, "beads", "inch")
def _(at):
    return scan(at, lambda t: t, points={n: tuple((np.array(p) / 25.4).tolist()) for n, p in probe.BEADS.items()})


def rename(*pairs):  # type: ignore[no-untyped-def]
    """Names of wires exchanged in the table."""
    to = {n: n for n in (*probe.NAMES, *probe.BEADS)}
    for a, b in pairs:
        to[a], to[b] = to[b], to[a]
    return lambda rows: [[r[0], to[r[1]], *r[2:]] for r in rows]


for pairs in (
    (("L1", "L5"),),
    (("G1", "M1"),),
    (("L1", "H3"),),
    (("G1", "L1"), ("G3", "M3")),
    (("G1", "L1"), ("L1", "M1")),
):

    @case(36, WIRES, " and ".join("-".join(p) for p in pairs), *{n for p in pairs for n in p})
    def _(at, pairs=pairs):
        return scan(at, table=rename(*pairs))


@case(36, WIRES, "the rows of wires from the other side", "mirrored|exchanged")
def _(at):
    return scan(at, table=rename(*((a, b) for a, b in (("G1", "M1"), ("G3", "M3"), ("H5", "M5")))))


@case(36, WIRES, "beads b1-b3", "b1", "b3")
def _(at):
    return scan(at, table=rename(("b1", "b3")), points=probe.BEADS)


@case(36, WIRES, "a name that is not listed", "unknown wire", "G1")
def _(at):
    return scan(at, lambda t: t.replace("  G1:", "  G2:"))


CORNERS, BARE = "one file of corners twice", "corners without a lens"


def example(at, text=lambda t: t):  # type: ignore[no-untyped-def]
    """The files of the example of a platform with a camera."""
    folder = ROOT / "examples" / "cable-camera"
    for name in ("robot.yaml", "lengths.yaml", "lengths.csv", "pixels.csv"):
        (at / name).write_text((folder / name).read_text())
    (at / "pixels.yaml").write_text(text((folder / "pixels.yaml").read_text()))
    return [at / f"{n}.yaml" for n in ("robot", "lengths", "pixels")]


@case(36, CORNERS, "identify, the same file", "twice")
def _(at):
    words = example(at)
    return command("identify", *words, words[-1])


@case(36, CORNERS, "identify, a copy of its table", "twice")
def _(at):
    words = example(at)
    (at / "copy.csv").write_text((at / "pixels.csv").read_text())
    (at / "copy.yaml").write_text(words[-1].read_text().replace("pixels.csv", "copy.csv"))
    return command("identify", *words, at / "copy.yaml")


@case(36, CORNERS, "identify, a copy as another camera", "twice|same")
def _(at):
    words = example(at)
    (at / "copy.csv").write_text((at / "pixels.csv").read_text())
    text = words[-1].read_text().replace("pixels.csv", "copy.csv")
    (at / "copy.yaml").write_text(text.replace("name: eye", "name: eye2").replace("name: lens", "name: lens2"))
    return command("identify", *words, at / "copy.yaml")


@case(36, CORNERS, "identify, every row twice", "equal others|equal another", "every measurement once")
def _(at):
    words = example(at)
    head, *rows = (at / "pixels.csv").read_text().splitlines()
    (at / "pixels.csv").write_text("\n".join([head, *rows, *rows]) + "\n")
    return command("identify", *words, "--no-leave-one-out")


@case(36, CORNERS, "map, every row twice", "twice|same|in view")
def _(at):
    rng, placed, views, edges = laid()
    rows = map_rows(sightings(placed, views, edges), 0.1, rng)
    return mapped(at, [*rows, *rows])


@case(36, CORNERS, "hand-eye, every row twice", "equal others|equal another", "every measurement once")
def _(at):
    words = cell(at, world(16, count=18))
    head, *rows = Path(words[2]).read_text().splitlines()
    Path(words[2]).write_text("\n".join([head, *rows, *rows]) + "\n")
    return command(*words)


@case(36, BARE, "identify", "camera|lens")
def _(at):
    return command("identify", *example(at, lambda t: re.sub(r"camera: \{[^\n]*\n", "", t)))


@case(36, BARE, "hand-eye", "--lens")
def _(at):
    words = cell(at, world(16, count=18))
    where = words.index("--lens")
    return command(*words[:where], *words[where + 2 :])


@case(36, BARE, "map", "--lens")
def _(at):
    rng, placed, views, edges = laid()
    return command(
        "vision", "map", write(at / "c.csv", map_rows(sightings(placed, views, edges), 0.1, rng)), "--size", "60"
    )


def judge(one: Case, status: int, said: str) -> bool:
    """Whether a mistake is named."""
    low = said.lower()
    asked = all(any(word.lower() in low for word in words.split("|")) for words in one.words)
    return (
        status in one.status
        and asked
        and not any(word.lower() in low for word in one.never)
        and "Traceback" not in said
    )


def shown(one: Case, said: str, room: int = 170) -> str:
    """Where the asked words stand in what was printed."""
    low = said.lower()
    every = [w.lower() for words in one.words for w in words.split("|")]
    first = min((low.find(w) for w in every if w in low), default=0)
    return said[max(first - 70, 0) : first + room - 70]


def main() -> int:
    """Prints a line for each case, and the count."""
    words = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    words.add_argument("items", nargs="*", help="parts of the names of items; all where none is named")
    words.add_argument("--issue", type=int)
    words.add_argument("--shard", default="0/1")
    words.add_argument("--whole", action="store_true")
    given = words.parse_args()
    part, parts = map(int, given.shard.split("/"))
    chosen = [(i, c) for i, c in CASES if given.issue in (None, i)]
    chosen = [(i, c) for i, c in chosen if not given.items or any(w in f"{c.item}: {c.name}" for w in given.items)]
    good = 0
    for issue, one in chosen[part::parts]:
        began = time.process_time()
        with tempfile.TemporaryDirectory() as place:
            try:
                status, said = one.run(Path(place))
            except Exception:
                status, said = -1, " ".join(traceback.format_exc().split())
            said = said.replace(f"{place}/", "")
        if status in STOPPED:
            return status
        fine = judge(one, status, said)
        good += fine
        spent = time.process_time() - began
        word = "named" if fine else "NOT NAMED"
        text = said if given.whole or status < 0 else shown(one, said)
        print(
            f"{issue} {one.item}: {one.name} | asked {' + '.join(one.words)} | status {status} | {word} | {spent:.1f} s | ...{text}",
            flush=True,
        )
    print(f"{good} of {len(chosen[part::parts])} named")
    return int(good < len(chosen[part::parts]))


if __name__ == "__main__":
    sys.exit(main())
