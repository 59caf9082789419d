"""Compiled image of printed sheets through a lens; callers own every buffer.

Light is integrated, not picked at points: a sample is the mean over its square of a pixel's part, where every edge of the print is a
straight line that shears the square into a trapezoid. So no edge aliases, whatever its direction.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.vision._kernels import distort

ROUNDS = 30  # of Newton's search; it takes two from the neighbour's solution
EMPTY = 1e-9  # of a square: no edge crosses it
STILL = 1e-13  # of a ray, where the search ends


@kernel
def undistort(u, v, lens, limit, ray, slope):
    """ray (2,) <- the ray (x, y) of an undistorted pinhole that the lens (n,) images at (u, v), from what ray holds; slope (4,) <- its
    derivatives xu, xv, yu, yv. Returns False where none is within the radius whose square is `limit`."""
    fx, fy, cx, cy = lens[0], lens[1], lens[2], lens[3]
    x, y = ray[0], ray[1]
    for _ in range(ROUNDS):
        px, py, xx, xy, yy = distort(x, y, lens)
        xx, yy = fx * xx, fy * yy
        a, b = u - cx - fx * px, v - cy - fy * py
        det = xx * yy - fx * fy * xy * xy
        if not det > 0.0:
            return False
        slope[0], slope[1], slope[2], slope[3] = yy / det, -fx * xy / det, -fy * xy / det, xx / det
        dx, dy = slope[0] * a + slope[1] * b, slope[2] * a + slope[3] * b
        x, y = x + dx, y + dy
        if abs(dx) + abs(dy) < STILL:
            ray[0], ray[1] = x, y
            return x * x + y * y < limit
    return False


@kernel
def above(d, a, b):
    """The share of a sheared square that lies above a line at distance -d from its middle; a, b: the square's two sides across it."""
    a, b = abs(a), abs(b)
    if a < b:
        a, b = b, a
    far, near = 0.5 * (a + b), 0.5 * (a - b)
    if d >= far:
        return 1.0
    if d <= -far:
        return 0.0
    if d > near:
        return 1.0 - (far - d) * (far - d) / (2.0 * a * b)
    if d < -near:
        return (far + d) * (far + d) / (2.0 * a * b)
    return 0.5 + d / a


@kernel
def shade(x, y, xu, xv, yu, yv, grow, sheet, papers, bins, first, members, patches, shapes, ink, out):
    """out (3,) <- cover of the paper, white share of what covers, and whether an edge of print or paper crosses the sheared square about
    (x, y) of sides (xu, yu) and (xv, yv), by which white grows `grow` of them."""
    width, height, front = papers[sheet, 0], papers[sheet, 1], papers[sheet, 2]
    left = above(x + 0.5 * width, xu, xv)
    right = above(0.5 * width - x, xu, xv)
    low = above(y + 0.5 * height, yu, yv)
    high = above(0.5 * height - y, yu, yv)
    cover = max(left + right - 1.0, 0.0) * max(low + high - 1.0, 0.0)
    out[0], out[1] = cover, 1.0
    out[2] = 1.0 if 0.0 < cover < 1.0 else 0.0
    if cover == 0.0 or front == 0.0:
        return
    columns, rows = bins[sheet, 0], bins[sheet, 1]
    i = min(max(int((x / width + 0.5) * columns), 0), columns - 1)
    j = min(max(int((y / height + 0.5) * rows), 0), rows - 1)
    at = bins[sheet, 2] + j * columns + i
    steep, rise = math.sqrt(xu * xu + xv * xv), math.sqrt(yu * yu + yv * yv)
    white = 1.0
    for m in range(first[at], first[at + 1]):
        p = members[m]
        cell = patches[p, 2]
        high_count, wide_count, start = shapes[p, 0], shapes[p, 1], shapes[p, 2]
        cx, cy = (x - patches[p, 0]) / cell, (patches[p, 1] - y) / cell
        au, av, bu, bv = xu / cell, xv / cell, yu / cell, yv / cell
        sx, sy = grow * steep / cell, grow * rise / cell
        far_x, far_y = 0.5 * (abs(au) + abs(av)) + abs(sx), 0.5 * (abs(bu) + abs(bv)) + abs(sy)
        if cx <= -far_x or cx >= wide_count + far_x or cy <= -far_y or cy >= high_count + far_y:
            continue
        c, r = math.floor(cx + 0.5), math.floor(cy + 0.5)  # the nearest lines of the cells
        dx, dy = cx - c, cy - r
        inside = above(cx, au, av) + above(wide_count - cx, au, av) - 1.0
        inside *= above(cy, bu, bv) + above(high_count - cy, bu, bv) - 1.0
        dark = 0.0
        for row in range(r - 1, r + 1):
            for column in range(c - 1, c + 1):
                if row < 0 or row >= high_count or column < 0 or column >= wide_count:
                    continue
                if ink[start + row * wide_count + column] == 0.0:
                    continue
                # White grows where this black cell ends, not where the next is black too.
                beside, over = 2 * c - 1 - column, 2 * r - 1 - row
                ends = beside < 0 or beside >= wide_count or ink[start + row * wide_count + beside] == 0.0
                stops = over < 0 or over >= high_count or ink[start + over * wide_count + column] == 0.0
                tx, ty = (sx if ends else 0.0), (sy if stops else 0.0)
                across = above(dx - tx, au, av) if column == c else 1.0 - above(dx + tx, au, av)
                along = above(dy - ty, bu, bv) if row == r else 1.0 - above(dy + ty, bu, bv)
                dark += across * along
        inside = max(inside, dark)
        if (EMPTY < inside < 1.0 - EMPTY) or (EMPTY < dark < 1.0 - EMPTY) or far_x > 0.5 or far_y > 0.5:
            out[2] = 1.0
        white = white * (1.0 - inside) + inside - dark
    out[1] = white


@kernel
def place(x, y, back, at):
    """at (3,) <- where the ray (x, y) meets a sheet, and one over its depth; back (3, 3): the inverse of [r1 r2 t]."""
    at[2] = back[2, 0] * x + back[2, 1] * y + back[2, 2]
    at[0] = (back[0, 0] * x + back[0, 1] * y + back[0, 2]) / at[2]
    at[1] = (back[1, 0] * x + back[1, 1] * y + back[1, 2]) / at[2]


@kernel
def expose(
    lens,
    limit,
    backs,
    papers,
    bins,
    first,
    members,
    patches,
    shapes,
    ink,
    levels,
    grow,
    discs,
    samples,
    reach,
    wx,
    wy,
    light,
    cover,
):
    """light, cover (h, w) <- grey of the sheets times their cover, and that cover, blurred by the weights wx, wy (n, taps) of n moments.

    backs (s, 3, 3), papers (s, 3): width, height, whether it is seen from its front; bins, first, members: patches by places of the sheet;
    levels (2,): grey of black and white; discs (d, 4): middle, radius and grey of what hides; samples: along a pixel's side.
    """
    height, width = light.shape
    count, moments, taps = len(backs), len(wx), wx.shape[1]
    light[:] = 0.0
    cover[:] = 0.0
    fine = (width + 2 * reach) * samples
    grey, share = np.empty((samples, fine)), np.empty((samples, fine))
    ray, slope, start, own, spare = np.zeros(2), np.empty(4), np.zeros(2), np.empty(2), np.empty(4)
    at, shaded = np.empty(3), np.empty(3)
    order, depth, by = np.empty(count, np.int64), np.empty(count), np.empty((count, 4))
    line, veil = np.empty(width), np.empty(width)
    for ev in range(height + 2 * reach):
        v = float(ev - reach)
        grey[:] = 0.0
        share[:] = 0.0
        least, most = width + 2 * reach, -1
        ray[0], ray[1] = start[0], start[1]
        for eu in range(width + 2 * reach):
            u = float(eu - reach)
            valid = undistort(u, v, lens, limit, ray, slope)
            if not valid:
                ray[0], ray[1] = 0.0, 0.0
                valid = undistort(u, v, lens, limit, ray, slope)
                if not valid:
                    ray[0], ray[1] = 0.0, 0.0
            if eu == 0:
                start[0], start[1] = ray[0], ray[1]
            hits, edge = 0, False
            if valid:
                for s in range(count):
                    place(ray[0], ray[1], backs[s], at)
                    if not at[2] > 0.0:
                        continue
                    back, t = backs[s], 1.0 / at[2]
                    ax, ay = (back[0, 0] - at[0] * back[2, 0]) * t, (back[0, 1] - at[0] * back[2, 1]) * t
                    bx, by_ = (back[1, 0] - at[1] * back[2, 0]) * t, (back[1, 1] - at[1] * back[2, 1]) * t
                    xu, xv = ax * slope[0] + ay * slope[2], ax * slope[1] + ay * slope[3]
                    yu, yv = bx * slope[0] + by_ * slope[2], bx * slope[1] + by_ * slope[3]
                    if abs(at[0]) > 0.5 * papers[s, 0] + abs(xu) + abs(xv):
                        continue
                    if abs(at[1]) > 0.5 * papers[s, 1] + abs(yu) + abs(yv):
                        continue
                    k = hits  # the nearest first
                    while k > 0 and depth[k - 1] < at[2]:
                        depth[k], order[k] = depth[k - 1], order[k - 1]
                        k -= 1
                    depth[k], order[k] = at[2], s
                    by[s, 0], by[s, 1], by[s, 2], by[s, 3] = xu, xv, yu, yv
                    hits += 1
            hidden, veils = 0.0, False
            for d in range(len(discs)):
                far = math.hypot(u - discs[d, 0], v - discs[d, 1]) - discs[d, 2]
                if far < 1.0:
                    veils = True
                    edge = edge or far > -1.0
            if hits == 0 and not veils:
                continue
            least, most = min(least, eu), max(most, eu)
            # One look over the whole pixel, and a pixel more for what growth and bend of the lens may do: is there an edge?
            here, rest = 0.0, 1.0
            for k in range(hits):
                s = order[k]
                place(ray[0], ray[1], backs[s], at)
                # tolerance: of the pixel's size, for the bend within it
                shade(
                    at[0], at[1], 1.1 * by[s, 0], 1.1 * by[s, 1], 1.1 * by[s, 2], 1.1 * by[s, 3], grow, s, papers, bins, first, members,
                    patches, shapes, ink, shaded,
                )  # fmt: skip
                edge = edge or shaded[2] > 0.0
                here += rest * shaded[0] * (levels[0] + (levels[1] - levels[0]) * shaded[1])
                rest *= 1.0 - shaded[0]
            part = 1.0 / samples
            for j in range(samples):
                for i in range(samples):
                    column = eu * samples + i
                    if edge:
                        du, dv = (i + 0.5) * part - 0.5, (j + 0.5) * part - 0.5
                        here, rest = 0.0, 1.0
                        if hits > 0:
                            own[0] = ray[0] + slope[0] * du + slope[1] * dv
                            own[1] = ray[1] + slope[2] * du + slope[3] * dv
                            undistort(u + du, v + dv, lens, limit, own, spare)
                        for k in range(hits):
                            s = order[k]
                            place(own[0], own[1], backs[s], at)
                            shade(
                                at[0], at[1], part * by[s, 0], part * by[s, 1], part * by[s, 2], part * by[s, 3], grow * samples, s, papers,
                                bins, first, members, patches, shapes, ink, shaded,
                            )  # fmt: skip
                            here += rest * shaded[0] * (levels[0] + (levels[1] - levels[0]) * shaded[1])
                            rest *= 1.0 - shaded[0]
                    else:
                        du, dv = 0.0, 0.0
                    value, through = here, rest
                    if veils:
                        for d in range(len(discs)):
                            far = math.hypot(u + du - discs[d, 0], v + dv - discs[d, 1]) - discs[d, 2]
                            hidden = min(max(0.5 - far * samples, 0.0), 1.0)
                            value = value * (1.0 - hidden) + hidden * discs[d, 3]
                            through *= 1.0 - hidden
                    grey[j, column], share[j, column] = value, 1.0 - through
        if most < 0:
            continue
        low, high = max(least - 2 * reach, 0), min(most + 1, width)
        for m in range(moments):
            for j in range(samples):
                for i in range(low, high):
                    a, b = 0.0, 0.0
                    for t in range(taps):
                        a += wx[m, t] * grey[j, i * samples + t]
                        b += wx[m, t] * share[j, i * samples + t]
                    line[i], veil[i] = a, b
                for row in range(max(ev - 2 * reach, 0), min(ev + 1, height)):
                    w = wy[m, (ev - row) * samples + j]
                    for i in range(low, high):
                        light[row, i] += w * line[i]
                        cover[row, i] += w * veil[i]
