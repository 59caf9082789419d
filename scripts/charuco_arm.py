"""What is left of corners that are held out of the ChArUco board on an arm: `python scripts/charuco_arm.py DATA`.

DATA is the folder `charuco-arm`. Of the 15 views that show six corners or more every fourth is left out, four times; camera and board
are found from the others, and corners of those left out are reprojected by OpenCV. Each row has one source of corners and one
estimate; columns are readings of "rms of what was held out", px:
pooled     over all corners, both axes together: what is asked for (3.7 with the lens fixed, 1.8 free)
axis       the same of each axis
folds      mean of the four rounds
views      root mean square of the views' own
number     pooled, with rounds by the number of the image, not by its place among the 15
inside     pooled, of one fit to all views: no estimate leaves less there
`least squares` counts all corners alike and is no part of robocal; `robocal` is its verb.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from ruamel.yaml import YAML
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

Array = np.ndarray
Corners = dict[int, tuple[Array, Array]]  # points (n, 3), m, and pixels (n, 2) of a view
GIVEN = {"fx": 1352.02747, "fy": 1356.14287, "cx": 789.67065, "cy": 627.2995}
BEND = ("k1", "k2", "p1", "p2", "k3")
BOARD = ("--charuco", "5x7", "--dictionary", "6x6_250", "--square", "36.195", "--size", "18.256")
UPSIDE = np.diag([1.0, -1.0, -1.0, 1.0])  # the board as robocal has it: from its middle, y up
UPSIDE[:2, 3] = -2.5 * 0.036195, 3.5 * 0.036195
FEWEST = 6  # corners of a view
ROUNDS = 4


def rigid(p: dict[str, float]) -> Array:
    t = np.eye(4)
    t[:3, :3] = Rotation.from_quat([p[f"q{n}"] for n in "xyzw"]).as_matrix()
    t[:3, 3] = [p[n] for n in "xyz"]
    return t


def of_vector(v: Array) -> Array:
    t = np.eye(4)
    t[:3, :3], t[:3, 3] = Rotation.from_rotvec(v[:3]).as_matrix(), v[3:]
    return t


def to_vector(t: Array) -> Array:
    return np.append(Rotation.from_matrix(t[:3, :3]).as_rotvec(), t[:3, 3])


def corners_of_opencv(data: Path) -> Corners:
    """As OpenCV's detector has them."""
    words = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    board = cv2.aruco.CharucoBoard((5, 7), 0.036195, 0.018256, words)
    finder, places = cv2.aruco.CharucoDetector(board), board.getChessboardCorners() @ UPSIDE[:3, :3] + UPSIDE[:3, 3]
    out = {}
    for i in range(16):
        seen, ids, _, _ = finder.detectBoard(cv2.imread(str(data / f"images/{i}.png"), 0))
        if ids is not None and len(ids) >= FEWEST:
            out[i] = places[ids.ravel()].astype(float), seen.reshape(-1, 2).astype(float)
    return out


def table(text: str) -> Corners:
    """Corners of squares in a list of `vision detect`."""
    head, *lines = [line.split(",") for line in text.splitlines()]
    at = {name.partition(" [")[0]: k for k, name in enumerate(head)}
    rows: dict[int, list[list[float]]] = {}
    for line in lines:
        if line[at["marker"]] == "board":
            rows.setdefault(int(line[0]), []).append(
                [float(line[at[n]]) for n in ("point_x", "point_y", "point_z", "u", "v")]
            )
    return {k: (1e-3 * np.array(r)[:, :3], np.array(r)[:, 3:]) for k, r in rows.items()}


def left(camera: Array, board: Array, lens: dict[str, float], poses: Array, corners: Corners, views: Sequence[int]):
    """Residuals (n, 2) of each view, px, by OpenCV."""
    matrix = np.array([[lens["fx"], 0, lens["cx"]], [0, lens["fy"], lens["cy"]], [0, 0, 1]])
    bend = np.array([lens.get(k, 0.0) for k in BEND])
    out = []
    for i in views:
        seen = np.linalg.inv(camera) @ poses[i] @ board
        told, _ = cv2.projectPoints(corners[i][0], cv2.Rodrigues(seen[:3, :3])[0], seen[:3, 3], matrix, bend)
        out.append(told[:, 0] - corners[i][1])
    return out


class Case:
    """The data, and a folder for files of the verb."""

    def __init__(self, data: Path, folder: Path) -> None:
        yaml = YAML(typ="safe")
        facts = yaml.load((data / "cal_data.yaml").read_text())
        self.data, self.folder = data, folder
        self.poses = np.array([rigid(yaml.load((data / f"poses/{i}.yaml").read_text())) for i in range(16)])
        camera, board = (rigid(facts[f"{n}_guess"]) for n in ("camera_mount_to_camera", "target_mount_to_target"))
        self.start = np.append(to_vector(camera), to_vector(board @ np.linalg.inv(UPSIDE)))
        numbers = ", ".join(f"{k}: {v}" for k, v in (GIVEN | dict.fromkeys(BEND, 0)).items())
        text = f"robocal: 1\nkind: lens\nmodel: brown\nimage: [1600, 1200]\nnumbers: {{{numbers}}}\n"
        (folder / "lens.yaml").write_text(text)

    def by_squares(self, corners: Corners, views: Sequence[int], free: bool):
        """Camera, board and lens with the least squares of all corners; a lens that is free under the prior of --free-lens."""
        names = [*GIVEN, *BEND[:4]] if free else []
        prior = np.array([10.0] * 4 + [0.1] * 4)[: len(names)]
        was = np.array([GIVEN.get(n, 0.0) for n in names])

        def parts(v: Array):
            return of_vector(v[:6]), of_vector(v[6:12]), GIVEN | dict(zip(names, was + prior * v[12:], strict=True))

        def off(v: Array) -> Array:
            return np.concatenate([*left(*parts(v), self.poses, corners, views)]).ravel() / scale

        def whole(v: Array) -> Array:
            return np.append(off(v), v[12:])

        scale, v = 1.0, np.append(self.start, np.zeros(len(names)))
        if free:
            camera, board, _ = self.by_squares(corners, views, False)
            v[:12] = np.append(to_vector(camera), to_vector(board))
        for _ in range(3 if free else 1):  # the prior weighs as the noise that is found
            v = least_squares(whole, v, x_scale="jac").x
            scale *= float(np.sqrt(np.mean(off(v) ** 2)))
        return parts(v)

    def by_robocal(self, place: Path, views: Sequence[int], free: bool):
        """The same by the verb, from a list of corners."""
        out = [str(i) for i in range(16) if i not in views]
        words = [
            "vision",
            "hand-eye",
            place,
            self.data / "poses",
            "--lens",
            self.folder / "lens.yaml",
            "--camera",
            "fixed",
        ]
        words += [*(["--free-lens"] if free else []), "--image", "1600x1200", "--json"]
        words += ["--exclude", ",".join(out)] if out else []
        ran = subprocess.run(
            [sys.executable, "-m", "robocal", *map(str, words)], capture_output=True, text=True, check=False
        )
        told = json.loads(ran.stdout)
        camera, board = (np.array(f["matrix"]) for f in told["frames"])
        camera[:3, 3] *= 1e-3
        board[:3, 3] *= 1e-3
        lens = dict(GIVEN)
        if told["lens"] is not None:
            names, found = (
                next(c["values"] for c in told["lens"]["columns"] if c["name"] == n) for n in ("name", "found")
            )
            lens |= dict(zip(names, found, strict=True))
        return camera, board, lens


def root(parts: Sequence[Array]) -> float:
    return float(np.sqrt(np.mean(np.sum(np.concatenate(parts) ** 2, axis=1))))


def tell(
    case: Case, words: str, corners: Corners, judge: Corners, fit: Callable[[Corners, Sequence[int]], tuple]
) -> None:
    """A row: found by `corners`, and held out of `judge`."""
    views = sorted(set(corners) & set(judge))
    cells = []
    for folds in (
        [views[k::ROUNDS] for k in range(ROUNDS)],
        [[i for i in views if i % ROUNDS == k] for k in range(ROUNDS)],
    ):
        parts = []
        for held in folds:
            found = fit(corners, [i for i in views if i not in held])
            parts.append(left(*found, case.poses, judge, held))
        every = [p for part in parts for p in part]
        cells.append(
            (
                root(every),
                root(every) / np.sqrt(2),
                np.mean([root(p) for p in parts]),
                np.sqrt(np.mean([root([e]) ** 2 for e in every])),
            )
        )
    inside = root(left(*fit(corners, views), case.poses, judge, views))
    count = sum(len(judge[i][0]) for i in views)
    row = [*cells[0], cells[1][0], inside]
    print(f"| {words} | {len(views)} | {count} | " + " | ".join(f"{v:.2f}" for v in row) + " |", flush=True)


def main() -> None:
    """A row for each source of corners and each estimate."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("data", type=Path)
    given = words.parse_args()
    with tempfile.TemporaryDirectory() as made:
        case = Case(given.data, Path(made))
        own = Path(made) / "own.csv"
        ask = ["vision", "detect", str(given.data / "images"), *BOARD, "-o", str(own)]
        subprocess.run([sys.executable, "-m", "robocal", *ask], capture_output=True, check=True)
        lists = {"OpenCV": corners_of_opencv(given.data), "robocal": table(own.read_text())}
        other = Path(made) / "opencv.csv"
        lines = ["view,marker,corner,u [px],v [px],point_x [mm],point_y [mm],point_z [mm]"]
        for i, (points, pixels) in lists["OpenCV"].items():
            for k, (p, uv) in enumerate(zip(points, pixels, strict=True)):
                lines.append(f"{i},board,{k},{uv[0]:.4f},{uv[1]:.4f},{','.join(f'{1e3 * n:.5f}' for n in p)}")
        other.write_text("\n".join(lines) + "\n")
        print(
            "| lens, corners, estimate, judged by | views | corners | pooled | axis | folds | views | number | inside |\n|---|"
            + "---|" * 8
        )
        for free in (False, True):
            lens = "free" if free else "fixed"
            for name, place in (("OpenCV", other), ("robocal", own)):
                tell(
                    case,
                    f"{lens}, {name}, least squares",
                    lists[name],
                    lists[name],
                    lambda c, v, f=free: case.by_squares(c, v, f),
                )
                tell(
                    case,
                    f"{lens}, {name}, robocal",
                    lists[name],
                    lists[name],
                    lambda c, v, f=free, p=place: case.by_robocal(p, v, f),
                )
            tell(
                case,
                f"{lens}, robocal, robocal, judged by OpenCV's",
                lists["robocal"],
                lists["OpenCV"],
                lambda c, v, f=free: case.by_robocal(own, v, f),
            )


if __name__ == "__main__":
    main()
