"""Images of printed markers and boards, drawn by the tests themselves: a plane under a homography, with 6 x 6 samples a pixel, blur and noise."""

from __future__ import annotations

import numpy as np

SAMPLES = 6


def paper(cells, left, top, cell, sheet=None):
    """A function of (x, y) that is 0 where cells are black; y down; over another one."""
    n, m = cells.shape

    def value(x, y):
        i, j = np.floor((y - top) / cell).astype(int), np.floor((x - left) / cell).astype(int)
        inside = (i >= 0) & (i < n) & (j >= 0) & (j < m)
        under = np.ones(np.shape(x)) if sheet is None else sheet(x, y)
        return np.where(inside, cells[np.clip(i, 0, n - 1), np.clip(j, 0, m - 1)], under)

    return value


def image_of(sheet, h, width, height, *, blur=0.7, noise=1.5, smear=(0.0, 0.0), dark=30.0, bright=200.0, seed=0):
    """Grey levels (height, width) of a sheet; h (3, 3) takes the sheet to pixels; smear: a motion in pixels while it is exposed."""
    at = (np.arange(width * SAMPLES) + 0.5) / SAMPLES - 0.5, (np.arange(height * SAMPLES) + 0.5) / SAMPLES - 0.5
    inverse = np.linalg.inv(h)
    steps = np.linspace(-0.5, 0.5, 9 if any(smear) else 1)
    shade = 0.0
    for t in steps if any(smear) else (0.0,):
        u, v = np.meshgrid(at[0] + t * smear[0], at[1] + t * smear[1])
        x, y, w = (inverse[k, 0] * u + inverse[k, 1] * v + inverse[k, 2] for k in range(3))
        shade = shade + sheet(x / w, y / w) / len(steps)
    if blur:
        reach = int(4 * blur * SAMPLES)
        bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (blur * SAMPLES)) ** 2)
        bell /= bell.sum()
        for axis in (0, 1):
            wide = np.pad(shade, [(reach, reach) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
            shade = np.apply_along_axis(np.convolve, axis, wide, bell, mode="valid")
    shade = shade.reshape(height, SAMPLES, width, SAMPLES).mean(axis=(1, 3))
    levels = dark + (bright - dark) * shade + np.random.default_rng(seed).normal(0, noise, shade.shape)
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8)


def places(h, points):
    """Pixels (k, 2) of points (k, 2) of the sheet."""
    q = np.column_stack([points, np.ones(len(points))]) @ h.T
    return q[:, :2] / q[:, 2:]


def draw_images(folder):
    """Two images of two markers of 48 mm, of 6x6_250, in a new folder. Raises MissingExtra without OpenCV."""
    from robocal.files.images import family_cells, opencv

    sheet = None
    for k, cells in enumerate(family_cells("6x6_250", (3, 17))):
        sheet = paper(cells, 75.0 * k, 0.0, 6.0, sheet)
    folder.mkdir()
    for k in range(2):
        image = image_of(sheet, np.array([[1, 0.05, 30.0 + k], [-0.03, 1, 40.0], [0, 1e-4, 1]]), 220, 130)
        assert opencv().imwrite(str(folder / f"{k}.png"), image)
