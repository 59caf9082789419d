"""What is said of images and lenses that are wrong: `python scripts/image_mistakes.py [CASE ...]`.

Each case draws images, or corners, with one mistake, and runs the command that a user would run. A line tells the exit status, whether
the mistake is named as it should be, and the sentence. The script ends with status 1 where one is not.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import struct
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from image_speed import write_cell

from robocal._types import Array
from robocal.cli.main import main as run_command
from robocal.files.images import family_cells, opencv
from robocal.geometry import so3
from robocal.simulation.images import Photograph, render
from robocal.vision.camera import image_of
from robocal.vision.sheets import Marker, Sheet

FAMILY, EDGE, PITCH = "6x6_250", 0.04, 0.055  # m
SIZE = (420, 300)
LENS = np.array([520.0, 521.0, 212.0, 146.0, -0.1, 0.0, 0.0, 0.0, 0.0])
NAME = ["--dictionary", FAMILY, "--size", "40"]
BOARD = np.array([((i - 4) * 0.025, (3 - j) * 0.025, 0.0) for j in range(7) for i in range(9)])


class Case(NamedTuple):
    """A command in a folder, the status and the words that it should end with."""

    make: Callable[[Path], list[str]]
    status: int
    words: tuple[str, ...] = ()


def draw(numbers=(3, 17, 8, 21), seed=0, shift=(0.0, 0.0), turn=(0.3, -0.2, 0.1), far=0.22, **how) -> Array:  # type: ignore[no-untyped-def]
    """An image of markers in two columns."""
    markers = tuple(
        Marker(FAMILY, n, family_cells(FAMILY, [n])[0], PITCH * (k % 2 - 0.5), PITCH * (0.5 - k // 2), EDGE)
        for k, n in enumerate(numbers)
    )
    at = np.eye(4)
    at[:3, :3] = so3.exp(np.array([np.pi, 0.0, 0.0])) @ so3.exp(np.array(turn))
    at[:3, 3] = *shift, far
    photograph = Photograph(**({"blur": 0.8, "noise": 2.0} | how))
    return render([(Sheet("s", 0.12, 0.12, markers), at)], LENS, SIZE, photograph, rng=np.random.default_rng(seed))


def save(at: Path, image: Array) -> str:
    """Writes an image."""
    at.parent.mkdir(exist_ok=True)
    opencv().imwrite(str(at), image)
    return str(at)


def one(image: Callable[[], Array], *words: str, name: str = "a.png") -> Callable[[Path], list[str]]:
    """`detect` of one image."""
    return lambda at: ["vision", "detect", save(at / name, image()), *(words or NAME)]


def some(*images: Callable[[], Array]) -> Callable[[Path], list[str]]:
    """`detect` of a folder."""

    def make(at: Path) -> list[str]:
        for k, image in enumerate(images):
            save(at / "images" / f"img{k}.png", image())
        return ["vision", "detect", str(at / "images"), *NAME]

    return make


def exif(at: Path) -> list[str]:
    """A JPEG whose notes say: turn by a quarter."""
    data = Path(save(at / "plain.jpg", draw())).read_bytes()
    notes = (
        b"Exif\0\0" + b"II*\0\x08\0\0\0" + struct.pack("<H", 1) + struct.pack("<HHIHH", 0x112, 3, 1, 6, 0) + b"\0" * 4
    )
    (at / "a.jpg").write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", len(notes) + 2) + notes + data[2:])
    return ["vision", "detect", str(at / "a.jpg"), *NAME]


def damaged(change: Callable[[bytes], bytes]) -> Callable[[Path], list[str]]:
    """A PNG that was changed."""

    def make(at: Path) -> list[str]:
        whole = Path(save(at / "whole.png", draw())).read_bytes()
        (at / "a.png").write_bytes(change(whole))
        return ["vision", "detect", str(at / "a.png"), *NAME]

    return make


def glare(radius: float) -> Array:
    """A blob on a marker that is cut off."""
    image = draw().astype(float)
    v, u = np.mgrid[: SIZE[1], : SIZE[0]]
    far = np.hypot(u - 150, v - 95) - radius
    return np.clip(np.maximum(image, 400 / (1 + np.exp(np.clip(far / 1.5, -50, 50)))), 0, 255).astype(np.uint8)


def corners(at: Path, tilt: float, lens: Array = LENS, depth: tuple[float, float] = (0.3, 0.5)) -> str:
    """Views of a board as a list of corners in images of 840 x 600."""
    rng = np.random.default_rng(4)
    wide = np.append(lens[:4] * 2.0, lens[4:])
    lines = ["view,marker,corner,u,v,point_x [m],point_y [m],point_z [m]"]
    for k in range(15):
        turn = so3.exp(np.array([0.0, 0.0, rng.uniform(-3, 3)])) @ so3.exp(np.append(rng.uniform(-tilt, tilt, 2), 0.0))
        place = np.array([*rng.uniform(-0.01, 0.01, 2), rng.uniform(*depth)])
        seen = image_of(BOARD @ (turn @ np.diag([1.0, -1.0, -1.0])).T + place, wide) + rng.normal(
            0, 0.1, (len(BOARD), 2)
        )
        lines += [
            f"v{k},0,{i},{u:.4f},{v:.4f},{x:.4f},{y:.4f},0"
            for i, ((u, v), (x, y, _)) in enumerate(zip(seen, BOARD, strict=True))
        ]
    (at / "corners.csv").write_text("\n".join(lines) + "\n")
    return str(at / "corners.csv")


def intrinsics(tilt: float, depth: tuple[float, float]) -> Callable[[Path], list[str]]:
    """A lens from views that are tilted by so much."""
    return lambda at: ["vision", "intrinsics", corners(at, tilt, depth=depth), "--image", "840x600"]


def robot(camera: str, image: str, exchanged: bool = False) -> Callable[[Path], list[str]]:
    """`check` of an arm with a camera whose lens is in the data."""

    def make(at: Path) -> list[str]:
        write_cell(at, False, exchanged)
        size = "image_width: 1280\nimage_height: 824\ncamera_name: left\n"
        model = (
            "distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [-0.1, 0.02, 0, 0, 0]}\n"
        )
        matrix = "camera_matrix: {rows: 3, cols: 3, data: [900, 0, 640, 0, 905, 412, 0, 0, 1]}\n"
        (at / "lens.yaml").write_text(size + matrix + model)
        text = (at / "data.yaml").read_text().replace("fx: 900, fy: 905, cx: 640, cy: 412, k1: -0.1, k2: 0.02", camera)
        (at / "data.yaml").write_text(text + image)
        return ["check", "ur10", str(at / "data.yaml")]

    return make


def colour() -> Array:
    """The same in three channels."""
    cv2 = opencv()
    return np.asarray(cv2.cvtColor(draw(), cv2.COLOR_GRAY2BGR))


FOLDS = "fx: 900, fy: 905, cx: 640, cy: 412, k1: -6"
CASES = {
    "no marker": Case(one(lambda: np.random.default_rng(0).normal(120, 2, (300, 420)).astype(np.uint8)), 3, ("no image shows a target",)),
    "wrong dictionary": Case(one(draw, "--dictionary", "4x4_50"), 3, ("--dictionary 6x6_50 is probably right",)),
    "one marker": Case(some(draw, lambda: draw(numbers=(3,))), 0, ("show one marker alone: img1",)),
    "islands": Case(some(draw, lambda: draw(numbers=(90, 91))), 0, ("2 groups that no image joins",)),
    "duplicate numbers": Case(one(lambda: draw(numbers=(3, 17, 3, 8))), 0, ("more than once",)),
    "mirrored": Case(one(lambda: np.ascontiguousarray(draw()[:, ::-1])), 3, ("only when they are mirrored",)),
    "two sizes": Case(some(draw, draw, lambda: draw()[:-10, :-10]), 3, ("the images have 2 sizes: img2",)),
    "colour": Case(one(colour), 0, ("a,3,0", "a,8,0", "a,17,0", "a,21,3", "all pixels")),
    "16 bits": Case(one(lambda: draw().astype(np.uint16) * 257, name="a.tiff"), 0, ("a,3,0", "a,8,0", "a,17,0", "a,21,3", "all pixels")),
    "EXIF says: turn": Case(exif, 0, ("as the sensor stored them",)),
    "truncated": Case(damaged(lambda d: d[: len(d) // 2]), 2, ("ends early",)),
    "empty": Case(damaged(lambda d: b""), 2, ("the file is empty",)),
    "huge": Case(damaged(lambda d: d[:16] + struct.pack(">II", 200000, 100000) + d[24:]), 2, ("too large",)),
    "cut by the border": Case(one(lambda: draw(shift=(-0.0457, 0.0))), 0, ("lie at the border",)),
    "overexposed": Case(one(lambda: draw(exposure=1.6)), 0, ("white is cut off",)),
    "motion": Case(one(lambda: draw(motion=(4.0, 2.0))), 0, ("smeared along one direction",)),
    "glare on half a marker": Case(one(lambda: glare(18.0)), 0, ("a,8,0", "all pixels")),
    "lens of half the size": Case(robot("file: lens.yaml", "image: [640, 412]\n"), 2, ("another size", "scale: 0.5")),
    "lens of another shape": Case(robot("file: lens.yaml", "image: [1280, 720]\n"), 2, ("another shape",)),
    "lens scaled as offered": Case(robot("file: lens.yaml, scale: 0.5", "image: [640, 412]\n"), 0),
    "two views exchanged": Case(
        robot("fx: 900, fy: 905, cx: 640, cy: 412, k1: -0.1, k2: 0.02", "", True), 0, ("views v5 and v20 of camera are exchanged",)
    ),
    "all views frontal": Case(intrinsics(0.0, (0.55, 0.55)), 3, ("fx, fy", "do not tell them from the distance")),
    "points beyond the fold": Case(robot(FOLDS, ""), 0, ("folds back",)),
}  # fmt: skip


def run(case: Case) -> tuple[int, str]:
    """The status and everything that a command says, as one line."""
    said = io.StringIO()
    with tempfile.TemporaryDirectory() as place:
        words = case.make(Path(place))
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            status = run_command([*words, "--verbose"])
        return status, " ".join(said.getvalue().replace(place + "/", "").split())


def main() -> int:
    """Prints a line for each case."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("cases", nargs="*", help=f"of {'; '.join(CASES)}; all where none is named")
    wrong = 0
    for name in parser.parse_args().cases or CASES:
        case = CASES[name]
        status, said = run(case)
        named = status == case.status and all(word in said for word in case.words)
        wrong += not named
        first = min((said.find(word) for word in case.words if word in said), default=0)
        print(
            f"{name:24} status {status}  {'named' if named else 'NOT NAMED':9}  ...{said[max(first - 60, 0) : first + 130]}",
            flush=True,
        )
    print(f"{wrong} not named")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
