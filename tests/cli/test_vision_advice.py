"""The advice of `vision detect`, obeyed: images on which it is given, then what it asks for, and it is given no more."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli.runs import robocal as run
from cli.test_vision_detect import TILT, checker, codes, detect, grid, save
from files.test_image_files import turned
from printed import image_of, places

cv2 = pytest.importorskip("cv2")
WIDTH, HEIGHT = 240, 130
NAME = ("--dictionary", "6x6_250", "--size", 48)
Words = tuple[object, ...]
Then = Words | Callable[[dict[str, Any]], Words]
CASES: dict[str, Callable[[Path], tuple[Words, Then]]] = {}


def advice(name):
    """A case: the words of a command on which a remark comes, and those, or what makes them from the document, when it was obeyed."""

    def register(make):
        CASES[name] = make
        return make

    return register


@cache
def drawn(numbers=(3, 17), family="6x6_250", shift=(0.0, 0.0), width=WIDTH, height=HEIGHT, cell=4.5, gap=25.0, **how):
    sheet, _ = grid(family, numbers, cell, gap)
    h = np.array([[1, 0, shift[0]], [0, 1, shift[1]], [0, 0, 1]]) @ TILT
    return image_of(sheet, h, width, height, **how)


def plain(**how):
    return drawn(**how).copy()


def folder(place, *images):
    """A folder of these images."""
    for k, image in enumerate(images):
        save(place, f"img{k}.png", image)
    return str(place)


def empty(seed=0):
    return np.random.default_rng(seed).normal(120, 2, (HEIGHT, WIDTH)).clip(0, 255).astype(np.uint8)


def disc(image, at, radius, level):
    v, u = np.mgrid[: image.shape[0], : image.shape[1]]
    image[(u - at[0]) ** 2 + (v - at[1]) ** 2 < radius**2] = level
    return image


def numbers_of(document, code):
    return next(r for r in document["remarks"] if r["code"] == code)["numbers"]


# obeys: image-turned
@advice("image-turned")
def turned_by_exif(at):
    for name, way in (("a/1", 6), ("a/2", 6), ("b/1", 1), ("b/2", 1)):
        turned(at / f"{name}.jpg", way, plain())
    return (at / "a", *NAME), (at / "b", *NAME)


# obeys: video-ends-early
@advice("video-ends-early")
def film(at):
    whole, part = at / "whole.avi", at / "part.avi"
    made = cv2.VideoWriter(str(whole), cv2.VideoWriter_fourcc(*"MJPG"), 10, (WIDTH, HEIGHT))
    if not made.isOpened():
        pytest.skip("this OpenCV writes no video")
    for _ in range(20):
        made.write(cv2.cvtColor(plain(), cv2.COLOR_GRAY2BGR))
    made.release()
    part.write_bytes(whole.read_bytes()[: whole.stat().st_size * 2 // 3])
    return (part, *NAME), (whole, *NAME)


# obeys: image-sizes-differ
@advice("image-sizes-differ")
def sizes(at):
    whole = plain()
    return (folder(at / "a", whole, whole[:-10, :-10]), *NAME), (folder(at / "b", whole, whole), *NAME)


# obeys: no-target-found
@advice("no-target-found")
def no_rim(at):
    cut = plain(numbers=(3,))
    cut[cut > 110] = 34  # what is black around the marker leaves nothing to find
    return (save(at, "a.png", cut), *NAME), (save(at, "b.png", plain()), *NAME)


@advice("no-target-found: unsharp")
def unsharp(at):
    return (save(at, "a.png", plain(blur=4.5)), *NAME), (save(at, "b.png", plain()), *NAME)


@advice("no-target-found: not named")
def not_named(at):
    """Three images tell what the target is; it is in others."""
    place = folder(at / "a", empty(), plain(), empty(1), plain(seed=2), empty(2))
    return (place,), (place, *NAME)


# obeys: no-marker-in-view
@advice("no-marker-in-view")
def away(at):
    """The page shows those that lack something, whatever number they have."""
    first = [plain()] * 30
    first[27] = empty()
    place = folder(at / "a", *first)
    (at / "page").mkdir()
    ran = run("vision", "detect", place, *NAME, "-o", at / "page" / "corners.csv")
    assert ran.status == 0 and "img27: 0 corners" in (at / "page" / "corners.html").read_text()
    few = folder(at / "b", plain(), empty())
    return (few, *NAME), (folder(at / "c", plain(), plain(seed=1)), *NAME)


# obeys: one-marker-in-view
@advice("one-marker-in-view")
def lone(at):
    return (folder(at / "a", plain(), plain(numbers=(3,))), *NAME), (folder(at / "b", plain(), plain(seed=1)), *NAME)


# obeys: other-dictionary
@advice("other-dictionary")
def other(at):
    """The dictionary that is named holds the numbers of images that were not asked too."""
    place = folder(at / "a", *(plain(numbers=n) for n in ((3, 17), (3, 120), (3, 17), (3, 17), (3, 17))))

    def then(told):
        assert numbers_of(told, "other-dictionary")["better"] == "6x6_250"
        return place, "--size", 48, "--dictionary", "6x6_250"

    return (place, "--dictionary", "5x5_100", "--size", 48), then


@advice("other-dictionary: too small")
def too_small(at):
    """Of a dictionary that ends too early some markers are found."""
    place = folder(at / "a", plain(numbers=(3, 90)), plain(numbers=(3, 90), seed=1))
    return (place, "--dictionary", "6x6_50", "--size", 48), lambda told: (
        place, "--size", 48, "--dictionary", numbers_of(told, "other-dictionary")["better"],
    )  # fmt: skip


# obeys: dictionary-found
@advice("dictionary-found")
def unnamed(at):
    place = save(at, "a.png", plain())
    return (place, "--size", 48), lambda told: (place, "--size", 48, "--dictionary", told["target"]["dictionary"])


# obeys: dictionary-unsure
@advice("dictionary-unsure")
def two_families(at):
    both = np.hstack([plain(), plain(family="4x4_50", numbers=(3, 17))])
    place = save(at, "a.png", both)
    return (place, "--size", 48), lambda told: (
        place, "--size", 48, "--dictionary", numbers_of(told, "dictionary-unsure")["first"],
    )  # fmt: skip


# obeys: board-found
@advice("board-found")
def board(at):
    sheet, _ = checker(6, 5, 14.0)
    place = save(at, "a.png", image_of(sheet, TILT, 180, 160))
    return (place, "--square", 14), lambda told: (
        place, "--square", 14, "--checker", "{columns}x{rows}".format(**numbers_of(told, "board-found")),
    )  # fmt: skip


# obeys: size-not-stated
@advice("size-not-stated")
def no_size(at):
    place = save(at, "a.png", plain())
    return (place, *NAME[:2]), lambda told: (place, *NAME[:2], numbers_of(told, "size-not-stated")["option"], 48)


# obeys: two-of-one-number
@advice("two-of-one-number")
def twins(at):
    wide = {"width": 330}
    return (save(at, "a.png", plain(numbers=(3, 3, 5), **wide)), *NAME), (
        save(at, "b.png", plain(numbers=(3, 4, 5), **wide)), *NAME,
    )  # fmt: skip


@advice("two-of-one-number: covered")
def covered(at):
    wide = {"width": 330}
    hidden = plain(numbers=(3, 3, 5), **wide)
    hidden[:, :85] = 120
    return (save(at, "a.png", plain(numbers=(3, 3, 5), **wide)), *NAME), (save(at, "b.png", hidden), *NAME)


# obeys: mirrored-image
@advice("mirrored-image")
def mirrored(at):
    return (save(at, "a.png", plain()[:, ::-1]), *NAME), (save(at, "b.png", plain()), *NAME)


@advice("mirrored-image: all of them, no dictionary")
def mirrored_unnamed(at):
    views = [plain(seed=s) for s in range(5)]
    place = folder(at / "a", *(v[:, ::-1] for v in views))
    return (place, "--size", 48), (folder(at / "b", *views), *NAME)


# obeys: markers-apart
@advice("markers-apart")
def apart(at):
    one, two, both = plain(), plain(numbers=(90, 91)), plain(numbers=(3, 91))
    return (folder(at / "a", one, two), *NAME), (folder(at / "b", one, both, two), *NAME)


@advice("markers-apart: alone")
def groups(at):
    place = folder(at / "a", plain(), plain(numbers=(90, 91)))
    return (place, *NAME), (f"{place}/img1.png", *NAME)


# obeys: markers-at-border
@advice("markers-at-border")
def border(at):
    return (save(at, "a.png", plain(shift=(-38.0, 0.0))), *NAME), (save(at, "b.png", plain()), *NAME)


# obeys: image-overexposed
@advice("image-overexposed")
def overexposed(at):
    return (save(at, "a.png", plain(bright=290.0)), *NAME), (save(at, "b.png", plain(bright=190.0)), *NAME)


# obeys: motion-blur
@advice("motion-blur")
def smeared(at):
    """Half the time is half the way."""
    return tuple((save(at, f"{s}.png", plain(smear=(s, s / 2))), *NAME) for s in (4.0, 2.0))


# obeys: image-blurred
@advice("image-blurred")
def blurred(at):
    return tuple((save(at, f"{b}.png", plain(blur=b)), *NAME) for b in (2.3, 1.2))


# obeys: edges-alone
@advice("edges-alone")
def dark(at):
    """Half of what is seen is noise: four times the light."""
    return tuple((save(at, f"{b}.png", plain(bright=b, noise=10.0, cell=6.0)), *NAME) for b in (60.0, 150.0))


def hide(at, level, *discs):
    """Images in which something lies on one corner of a marker, and those without."""
    clean, corners = plain(cell=6.0, width=300, height=160), places(TILT, grid("6x6_250", (3,), 6.0)[1][3])
    first = folder(at / "a", *(disc(clean.copy(), corners[k], radius, level) for k, radius in discs))
    return (first, *NAME), (folder(at / "b", *(clean for _ in discs)), *NAME)


@advice("edges-alone: fingers")
def fingers(at):
    return hide(at, 120, (0, 11), (1, 10), (3, 11), (3, 13))


# obeys: lens-bends
@advice("lens-bends")
def foreign_lens(at):
    """Images without distortion, through a lens of their size that has much of it."""
    numbers = {"fx": 240, "fy": 240, "cx": 119.5, "cy": 64.5, "k1": -2.5, "k2": 0, "p1": 0, "p2": 0, "k3": 0}
    words = ", ".join(f"{s}: {v}" for s, v in numbers.items())
    text = f"robocal: 1\nkind: lens\nmodel: brown\nimage: [{WIDTH}, {HEIGHT}]\nnumbers: {{{words}}}\n"
    (at / "lens.yaml").write_text(text, encoding="utf-8")
    images = folder(at / "a", *(plain(seed=k) for k in range(8)))
    return (images, *NAME, "--lens", at / "lens.yaml"), (images, *NAME)


# obeys: marker-dropped
@advice("marker-dropped")
def glare(at):
    return hide(at, 255, (0, 12), (2, 9), (3, 11), (3, 12))


# obeys: image-hardly-covered
@advice("image-hardly-covered")
def corner_alone(at):
    one = [plain(width=480, height=260)] * 5
    other = [np.roll(i, (100 * (s // 2 % 2), 230 * (s % 2)), axis=(0, 1)) for s, i in enumerate(one)]
    return (folder(at / "a", *one), *NAME), (folder(at / "b", *other), *NAME)


@pytest.mark.parametrize("case", CASES)
def test_advice_of_detect_helps(case, tmp_path):
    code = case.partition(":")[0]
    first, then = CASES[case](tmp_path)
    before, status = detect(*first)
    assert code in codes(before), codes(before)
    after, better = detect(*(then(before) if callable(then) else then))
    assert code not in codes(after) and better == 0 and after["corners"]["columns"][0]["values"], codes(after)
    assert status == 3 or codes(after) <= codes(before), (codes(before), codes(after))


def test_numbers_that_are_twice_are_told_where_nothing_else_is_seen(tmp_path):
    """Not only that no image shows a target: it shows every marker, and each two times."""
    whole = plain()
    ran = run("vision", "detect", save(tmp_path, "a.png", np.concatenate([whole, whole])), *NAME)
    assert ran.status == 3 and "more than once" in ran.err and ran.err.index("once") < ran.err.index("no image shows")
