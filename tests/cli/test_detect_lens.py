"""`vision detect --lens`: a marker through a wide lens, whose edges are curves; corners are found as if the lens were none."""

from __future__ import annotations

import json

import numpy as np
import pytest
from cli.runs import robocal as run

from robocal.geometry import so3
from robocal.simulation.images import Photograph, render, texture
from robocal.vision.camera import image_of
from robocal.vision.sheets import SQUARE, Marker, Sheet

cv2 = pytest.importorskip("cv2")
SIZE, FAMILY, EDGE = (640, 480), "4x4_50", 0.1
LENS = np.array([450.0, 451, 322, 238, -0.25, 0.08, 5e-4, -4e-4, 0])


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    """A folder of images, a lens.yaml, and the true corners by view, (4, 2)."""
    from robocal.files.images import family_cells

    folder, true = tmp_path_factory.mktemp("bent"), {}
    sheet = Sheet("one", 1.6 * EDGE, 1.6 * EDGE, (Marker(FAMILY, 0, family_cells(FAMILY, [0])[0], 0.0, 0.0, EDGE),))
    (folder / "images").mkdir()
    for k, (x, y) in enumerate([(-0.2, -0.12), (0.2, -0.1), (0.2, 0.13), (-0.2, 0.1)]):
        at = np.eye(4)
        at[:3, :3] = so3.exp(np.array([0.2, -0.3, 0.4 * k])) @ np.diag([1.0, -1, -1])
        at[:3, 3] = x, y, 0.5
        rng = np.random.default_rng(k)
        grey = render([(sheet, at)], LENS, SIZE, Photograph(blur=0.8, noise=3.0), texture(SIZE, k), rng)
        cv2.imwrite(str(folder / "images" / f"v{k}.png"), grey)
        true[f"v{k}"] = image_of(EDGE / 2 * SQUARE @ at[:3, :3].T + at[:3, 3], LENS)
    words = ", ".join(f"{n}: {v}" for n, v in zip("fx fy cx cy k1 k2 p1 p2 k3".split(), LENS.tolist(), strict=True))
    (folder / "lens.yaml").write_text(
        f"robocal: 1\nkind: lens\nmodel: brown\nimage: [{SIZE[0]}, {SIZE[1]}]\nnumbers: {{{words}}}\n"
    )
    return folder, true


def corners(folder, *words):
    """Errors and sigmas of all corners, (n, 2) px."""
    ran = run("vision", "detect", str(folder / "images"), "--dictionary", FAMILY, "--size", "100", *words, "--json")
    assert ran.status == 0, ran.err
    listed = {c["name"]: c["values"] for c in json.loads(ran.out)["corners"]["columns"]}
    return np.column_stack([listed[n] for n in ("u", "v")]), np.column_stack([listed[n] for n in ("su", "sv")]), listed


def test_corners_through_a_known_lens_are_off_by_less_and_say_so(images):
    folder, true = images
    spread = []
    for words in ((), ("--lens", str(folder / "lens.yaml"))):
        found, sigma, listed = corners(folder, *words)
        off = found - np.array([true[v][int(k)] for v, k in zip(listed["view"], listed["corner"], strict=True)])
        spread.append((np.sqrt(np.mean(off**2)), np.sqrt(np.mean(sigma**2)), np.mean((off / sigma) ** 2)))
    (blind, told, _), (known, sure, chi2) = spread
    assert known < 0.3 * blind and sure < 0.3 * told
    assert 0.4 < chi2 < 2.2  # of 32 numbers, 8 of them of one marker


def test_a_lens_of_images_of_another_size_is_refused(images, tmp_path):
    folder, _ = images
    (tmp_path / "lens.yaml").write_text((folder / "lens.yaml").read_text().replace("[640, 480]", "[1280, 960]"))
    ran = run("vision", "detect", str(folder / "images"), "--dictionary", FAMILY, "--lens", str(tmp_path / "lens.yaml"))
    assert ran.status == 2 and "--lens" in ran.err and "640 x 480" in ran.err and "1280 x 960" in ran.err
