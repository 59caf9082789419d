"""Real images: AprilTags of a webcam, the checkerboard of a UR3, a ChArUco board on an arm."""

from __future__ import annotations

import numpy as np
import pytest
from cli.runs import robocal

cv2 = pytest.importorskip("cv2")
TAGS = 71  # that AprilTag's own detector finds with no wrong bit


def columns(document):
    return {c["name"]: c["values"] for c in document["corners"]["columns"]}


def test_apriltags_are_found_all_and_no_others(shared_data):
    told = robocal("vision", "detect", shared_data / "apriltags", "--json").document
    old = tuple(map(int, cv2.__version__.split(".")[:2])) < (4, 12)  # 4.10 misses one of 15 px
    assert told["target"]["dictionary"] == "36h11" and told["methods"] == {"all pixels": TAGS - old}
    found = columns(told)
    ids = {v: {m for w, m in zip(found["view"], found["marker"], strict=True) if w == v} for v in set(found["view"])}
    print(f"\n71 tags asked, found {told['methods']}")
    scenes = [{22, 24, 58, 85, 144, 198}, {60, 82, 318, 328, 387}, {76}]
    assert all(any(some <= scene for scene in scenes) for some in ids.values())
    assert not {r["code"] for r in told["remarks"]} & {"motion-blur", "image-overexposed", "two-of-one-number"}


def test_a_checkerboard_is_calibrated_with_half_the_residual_of_a_corner_search(shared_data, tmp_path):
    folder = shared_data / "ur3-cameras" / "images" / "cam1"
    (tmp_path / "list.txt").write_text("\n".join(str(folder / f"img{k}_cam1.png") for k in range(1, 41, 3)))
    told = robocal("vision", "detect", tmp_path / "list.txt", "--square", 20, "--json").document
    assert told["target"]["squares"] == [10, 8]
    found = columns(told)
    place, points = np.column_stack([found["u"], found["v"]]), np.column_stack([found["point_x"], found["point_y"]])
    views = np.array(found["view"])
    assert len(set(found["view"])) == 14 and len(place) == 14 * 63
    board = [
        np.column_stack([points[views == v], np.zeros(63)]).astype(np.float32) for v in dict.fromkeys(found["view"])
    ]
    seen = [place[views == v].astype(np.float32) for v in dict.fromkeys(found["view"])]
    assert cv2.calibrateCamera(board, seen, (1280, 720), None, None)[0] < 0.16  # 0.24 by the published corners


def test_a_charuco_board_is_found(shared_data):
    words = ["--charuco", "5x7", "--dictionary", "6x6_250", "--square", 36.195, "--size", 18.256, "--json"]
    told = robocal("vision", "detect", shared_data / "charuco-arm" / "images", *words).document
    assert sum(v["markers"] for v in told["views"]) >= 250 and sum(v["corners"] > 0 for v in told["views"]) == 16
    assert "image-overexposed" in {r["code"] for r in told["remarks"]}


@pytest.mark.slow
def test_the_lens_of_a_ur3_camera_is_no_worse_than_published(shared_data, tmp_path):
    folder = shared_data / "ur3-cameras" / "intrinsics" / "cam1"
    corners = tmp_path / "corners.csv"
    assert robocal("vision", "detect", folder, "--checker", "10x8", "--square", 20, "-o", corners).status == 0
    told = robocal("vision", "intrinsics", corners, "--json").document
    assert told["verdict"]["status"] == "improved" and len(told["views"]["columns"][0]["values"]) == 36
    print("\n0.249 px asked, fitted {fitted[rms]:.4f}, left out {left_out[rms]:.4f}".format(**told["errors"]))
    assert told["errors"]["fitted"]["rms"] < 0.235  # published: 0.249
    assert told["errors"]["fitted"]["rms"] < told["errors"]["left_out"]["rms"] < 0.26
    of = {c["name"]: c["values"] for c in told["numbers"]["columns"]}
    names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
    published = dict(
        zip(names, (1572.93, 1582.40, 952.94, 578.20, -0.3811, 0.0909, -0.00471, -0.00128, 0.0795), strict=True)
    )
    for name, value, sigma in zip(of["name"], of["value"], of["sigma"], strict=True):
        assert abs(value - published[name]) < sigma  # the same images
    # What a board that is not flat leaves is the same in a whole view: even noise would say 1.4 px.
    assert 4 < of["sigma"][0] < 10


def test_corners_of_a_charuco_board_lie_in_its_plane(shared_data):
    """The plane is that of the four board corners around a marker; the code lies 0.08 of a cell beside the marker's border."""
    off, sizes, axis, marks = [], [], {}, []
    xs, ys = np.meshgrid(np.arange(4) - 1.5, 2.5 - np.arange(6))
    inner = np.column_stack([xs.ravel(), ys.ravel()]) * 36.195
    for number in (1, 5, 10, 11, 12, 13):
        words = ["--charuco", "5x7", "--dictionary", "6x6_250", "--square", 36.195, "--size", 18.256, "--json"]
        told = robocal("vision", "detect", shared_data / "charuco-arm" / "images" / f"{number}.png", *words).document
        found = columns(told)
        name, corner = np.array(found["marker"], dtype=str), np.array(found["corner"])
        place = np.column_stack([found["u"], found["v"]])
        point = np.column_stack([found["point_x"], found["point_y"]])
        board = dict(zip(corner[name == "board"].tolist(), place[name == "board"], strict=True))
        alone = name != "board"
        of = {m: point[name == m].mean(axis=0) for m in set(name[alone])}
        marks.append((place[alone], point[alone], np.array([of[m] for m in name[alone]])))
        left, by = [], []
        for marker in sorted(set(name) - {"board"}):
            mine = name == marker
            if mine.sum() != 4:
                continue
            middle = point[mine].mean(axis=0)
            around = np.flatnonzero((np.abs(inner - middle) < 20).all(axis=1))
            if len(around) < 4 or not all(k in board for k in around.tolist()):
                continue
            h = cv2.findHomography(inner[around], np.array([board[k] for k in around.tolist()]))[0]
            at, more = (
                cv2.perspectiveTransform(p[None], h)[0] for p in (point[mine], 1.001 * point[mine] - 0.001 * middle)
            )
            left.append(place[mine] - at)
            by.append((more - at) / 0.001)
        grown = np.sum(np.multiply(left, by)) / np.sum(np.square(by))
        sizes.append(1 + grown)
        axis[number] = np.array(left) - grown * np.array(by)
        off.append(axis[number])
    plane = np.sqrt(np.mean(np.square(np.concatenate(off))))
    print(f"\n0.56 px asked, in the plane {plane:.3f}; 0.4 % asked, sizes {np.std(sizes) / np.mean(sizes):.2%}")
    assert plane < 0.48  # four edges 0.48, the whole marker in its place 0.55
    assert np.sqrt(np.mean(np.square(axis[12]))) < 0.25  # 0.38 by the whole marker in its place
    assert np.std(sizes) / np.mean(sizes) < 0.004
    # The issue's own figures are of homographies and one lens: 0.797 of a corner search and 0.599 of its four edges; asked 0.56, 0.4 %.
    rms, own = plane_residual(marks)
    assert rms < 0.56 and np.ptp(own) / np.mean(own) < 0.004


def plane_residual(marks):
    """rms per axis (px) of corners of markers in the board's plane, and the size of a marker in each image: a homography and a size for each
    image, and k1 and k2 of all of them."""
    focal, centre = np.array([1352.02747, 1356.14287]), np.array([789.67065, 627.2995])
    begin = [np.zeros(2)]
    for place, point, _ in marks:
        h = cv2.findHomography(point, (place - centre) / focal)[0]
        begin += [(h / h[2, 2]).ravel()[:8], [1.0]]

    def left(x):
        out = []
        for k, (place, point, middle) in enumerate(marks):
            own = x[2 + 9 * k : 11 + 9 * k]
            there = np.column_stack([middle + own[8] * (point - middle), np.ones(len(point))])
            there = there @ np.append(own[:8], 1.0).reshape(3, 3).T
            xy = there[:, :2] / there[:, 2:]
            far = (xy**2).sum(axis=1, keepdims=True)
            out.append((xy * (1 + x[0] * far + x[1] * far**2) * focal + centre - place).ravel())
        return np.concatenate(out)

    x = np.concatenate(begin)
    size = np.maximum(np.abs(x), 1e-3)
    for _ in range(12):  # Gauss-Newton
        now = left(x)
        by = np.column_stack([(left(x + 1e-6 * s * e) - now) / 1e-6 for s, e in zip(size, np.eye(len(x)), strict=True)])
        x = x - size * np.linalg.lstsq(by, now, rcond=None)[0]
    return float(np.sqrt(np.mean(left(x) ** 2))), x[10::9]
