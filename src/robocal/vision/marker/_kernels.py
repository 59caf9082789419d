"""Compiled fit of a square marker of known cells to the pixels that show it; callers own every buffer.

parameters (18,): a homography of the square [-1, 1]^2, then blur and edge shift (px), then light, then the place (cells) of what is
printed in the square, where it is off; `size` of them are fitted, 16 or all:
    u = (h0 X + h1 Y + h2) / (h6 X + h7 Y + 1),  v = (h3 X + h4 Y + h5) / (h6 X + h7 Y + 1)
    grey = o0 + o1 X + o2 Y + (g0 + g1 X + g2 Y) t(X, Y)
t is the cells' print (1 white, 0 black), blurred by a normal law and by the pixel's own square: in each cell a product of error functions,
and where an edge of cells meets another one the bivariate normal's series in the correlation (Mehler), since cells appear sheared.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import backward, cholesky, forward

H, BLUR, SHIFT, LIGHT, PRINT, SIZE = 8, 8, 9, 10, 16, 18
REACH = 4.0  # standard deviations beyond which an edge is not felt: 3e-5 of the contrast
BOX = 1.0 / 12.0  # px^2, the variance of a pixel's own width
TAIL = 1.0 / 120.0  # px^4, less its fourth cumulant
CUT = 254.5  # grey levels: the brightest that there is
NEARLY, SURE = 0.01, 1e-3  # px, damping: a step so small is the last, and taken without another look at the pixels
BLOCK = 64  # pixels that are summed at once
NODES = 32  # of the table, per standard deviation: its series is right to 1e-8
BELL = np.array(
    [math.exp(-0.5 * (k / NODES - REACH) ** 2) / math.sqrt(2 * math.pi) for k in range(int(2 * REACH * NODES) + 1)]
)
SUM = np.array([0.5 * math.erfc(-(k / NODES - REACH) / math.sqrt(2)) for k in range(int(2 * REACH * NODES) + 1)])


@kernel
def invert(h, out):
    """out (3, 3) <- the inverse of the homography h (8,)."""
    a, b, c, d, e, f, g, k = h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7]
    det = a * (e - f * k) - b * (d - f * g) + c * (d * k - e * g)
    out[0, 0] = (e - f * k) / det
    out[0, 1] = (c * k - b) / det
    out[0, 2] = (b * f - c * e) / det
    out[1, 0] = (f * g - d) / det
    out[1, 1] = (a - c * g) / det
    out[1, 2] = (c * d - a * f) / det
    out[2, 0] = (d * k - e * g) / det
    out[2, 1] = (b * g - a * k) / det
    out[2, 2] = (a * e - b * d) / det


@kernel
def choose(ideal, slope, h, blur, quiet, clear, joined, out):
    """out (m,) <- whether a pixel shows the marker or its quiet zone (`quiet`, in X), at least `clear` blur widths from the zone's rim, and
    of markers `joined` by black squares at their corners from these; returns how many. ideal (m, 2), slope (m, 4)."""
    inverse = np.empty((3, 3))
    invert(h, inverse)
    count = 0
    variance = blur * blur + BOX
    for i in range(len(ideal)):
        u, v = ideal[i, 0], ideal[i, 1]
        w = inverse[2, 0] * u + inverse[2, 1] * v + inverse[2, 2]
        x = (inverse[0, 0] * u + inverse[0, 1] * v + inverse[0, 2]) / w
        y = (inverse[1, 0] * u + inverse[1, 1] * v + inverse[1, 2]) / w
        xu, xv = (inverse[0, 0] - x * inverse[2, 0]) / w, (inverse[0, 1] - x * inverse[2, 1]) / w
        yu, yv = (inverse[1, 0] - y * inverse[2, 0]) / w, (inverse[1, 1] - y * inverse[2, 1]) / w
        a, b = xu * slope[i, 0] + xv * slope[i, 2], xu * slope[i, 1] + xv * slope[i, 3]
        c, d = yu * slope[i, 0] + yv * slope[i, 2], yu * slope[i, 1] + yv * slope[i, 3]
        across, along = clear * math.sqrt(variance * (a * a + b * b)), clear * math.sqrt(variance * (c * c + d * d))
        out[i] = abs(x) <= 1.0 + quiet - across and abs(y) <= 1.0 + quiet - along
        if joined and abs(x) > 1.0 - across and abs(y) > 1.0 - along:
            out[i] = False
        count += out[i]
    return count


@kernel(inline=True)
def edges(at, off, width, low, high, tail, z_of, e, d):
    """z_of, e, d (n + 1,) <- in low..high how far `at` (cells) is from the edge k, in widths, the response to that edge, and its slope: the
    normal law's, by its series about a node of the table, with the pixel's square in the fourth cumulant (Edgeworth). Edges between the
    first and the last lie `off` (cells) from their places."""
    for k in range(low, high + 1):
        z = (at - k) / width
        if 0 < k < len(e) - 1:
            z -= off / width
        z_of[k] = z
        if z >= REACH:
            e[k], d[k] = 1.0, 0.0
        elif z <= -REACH:
            e[k], d[k] = 0.0, 0.0
        else:
            node = int((z + REACH) * NODES + 0.5)
            z0 = node / NODES - REACH
            dz = z - z0
            f = BELL[node]
            e[k] = SUM[node] + f * dz * (1.0 - dz * (0.5 * z0 - dz * (z0 * z0 - 1.0) / 6.0))
            f *= 1.0 - dz * (z0 - dz * (0.5 * (z0 * z0 - 1.0) - dz * z0 * (z0 * z0 - 3.0) / 6.0))
            zz = z * z
            e[k] += tail * (zz - 3.0) * z * f
            d[k] = f * (1.0 - tail * (zz * (zz - 6.0) + 3.0))


@kernel
def sum_pixels(grey, ideal, slope, p, cells, corners, limit, size, g, a, rest):
    """g (18,), lower a (18, 18) <- gradient and normal matrix of the robust cost, which is returned, by the first `size` parameters; rest
    (m,) <- residuals; cells (n, n): the print less 1; corners (n + 1, n + 1): its mixed differences; limit: the residual beyond which the
    cost is linear (Huber)."""
    n = cells.shape[0]
    inverse = np.empty((3, 3))
    invert(p, inverse)
    rows, left, weights = np.empty((SIZE, BLOCK)), np.empty(BLOCK), np.empty((SIZE, BLOCK))
    ex, ey, dx, dy = np.empty(n + 1), np.empty(n + 1), np.empty(n + 1), np.empty(n + 1)
    qx, qy = np.empty(n + 1), np.empty(n + 1)
    for i in range(size):
        g[i] = 0.0
        for j in range(i + 1):
            a[i, j] = 0.0
    variance = p[BLUR] * p[BLUR] + BOX
    width = math.sqrt(variance)
    half = 0.5 * n
    cost = 0.0
    filled = 0
    for i in range(len(grey)):
        u, v = ideal[i, 0], ideal[i, 1]
        w = 1.0 / (inverse[2, 0] * u + inverse[2, 1] * v + inverse[2, 2])
        x = (inverse[0, 0] * u + inverse[0, 1] * v + inverse[0, 2]) * w
        y = (inverse[1, 0] * u + inverse[1, 1] * v + inverse[1, 2]) * w
        xu, xv = (inverse[0, 0] - x * inverse[2, 0]) * w, (inverse[0, 1] - x * inverse[2, 1]) * w
        yu, yv = (inverse[1, 0] - y * inverse[2, 0]) * w, (inverse[1, 1] - y * inverse[2, 1]) * w
        sa, sb = half * (xu * slope[i, 0] + xv * slope[i, 2]), half * (xu * slope[i, 1] + xv * slope[i, 3])
        sc, sd = half * (yu * slope[i, 0] + yv * slope[i, 2]), half * (yu * slope[i, 1] + yv * slope[i, 3])
        xx, yy = sa * sa + sb * sb, sc * sc + sd * sd  # (cells per pixel of the image)^2
        steep, high = math.sqrt(xx), math.sqrt(yy)
        sx, sy = width * steep, width * high
        rho = (sa * sc + sb * sd) / (steep * high)
        tail = TAIL / (24.0 * variance * variance)
        cx, cy = half * (x + 1.0), half * (y + 1.0)  # in cells
        px, py = p[PRINT], p[PRINT + 1]
        far, deep = REACH * sx + abs(px), REACH * sy + abs(py)
        c0, c1 = max(math.ceil(cx - far) - 1, 0), min(math.floor(cx + far) + 1, n)
        r0, r1 = max(math.ceil(cy - deep) - 1, 0), min(math.floor(cy + deep) + 1, n)
        edges(cx, px, sx, c0, c1, tail * (sa**4 + sb**4) / (xx * xx), qx, ex, dx)
        edges(cy, py, sy, r0, r1, tail * (sc**4 + sd**4) / (yy * yy), qy, ey, dy)
        t, tx, ty, ts, te = 1.0, 0.0, 0.0, 0.0, 0.0
        ux = uy = 0.0  # the part of tx, ty that the square's own edges have
        for r in range(r0, r1):
            hy, gy = ey[r] - ey[r + 1], dy[r] - dy[r + 1]
            by = dy[r] * qy[r] - dy[r + 1] * qy[r + 1]
            rim = (dy[r] if r == 0 else 0.0) - (dy[r + 1] if r == n - 1 else 0.0)
            for c in range(c0, c1):
                if cells[r, c] == 0.0:
                    continue
                hx, gx = ex[c] - ex[c + 1], dx[c] - dx[c + 1]
                t += cells[r, c] * hx * hy
                tx += cells[r, c] * gx * hy
                ty += cells[r, c] * hx * gy
                ux += cells[r, c] * hy * ((dx[0] if c == 0 else 0.0) - (dx[n] if c == n - 1 else 0.0))
                uy += cells[r, c] * hx * rim
                ts -= cells[r, c] * ((dx[c] * qx[c] - dx[c + 1] * qx[c + 1]) * hy + hx * by)
                # White grows into the black: an edge between two black cells is none.
                own = 0.0
                if c == 0 or cells[r, c - 1] == 0.0:
                    own += dx[c] * hy
                if c == n - 1 or cells[r, c + 1] == 0.0:
                    own += dx[c + 1] * hy
                if r == 0 or cells[r - 1, c] == 0.0:
                    own += dy[r] * hx
                if r == n - 1 or cells[r + 1, c] == 0.0:
                    own += dy[r + 1] * hx
                te -= cells[r, c] * own
        for r in range(r0, r1 + 1):
            if dy[r] == 0.0:
                continue
            z = qy[r]
            z2 = z * z - 1.0
            z3 = z * (z2 - 2.0)
            for c in range(c0, c1 + 1):
                if corners[r, c] == 0.0 or dx[c] == 0.0:
                    continue
                q = qx[c]
                q2 = q * q - 1.0
                q3 = q * (q2 - 2.0)
                f = corners[r, c] * dx[c] * dy[r] * rho
                b, d, e = rho / 2.0, rho * rho / 6.0, rho**3 / 24.0
                t += f * (1.0 + b * q * z + d * q2 * z2 + e * q3 * z3)
                tx -= f * (q + b * q2 * z + d * q3 * z2)
                ty -= f * (z + b * q * z2 + d * q2 * z3)
        ax, ay = (ux - tx) / sx, (uy - ty) / sy  # by the place of the print; where edges cross, to first order
        tx, ty = tx / sx * half, ty / sy * half  # by X, Y
        te /= width
        t += p[SHIFT] * te
        gain = p[LIGHT + 3] + p[LIGHT + 4] * x + p[LIGHT + 5] * y
        residual = p[LIGHT] + p[LIGHT + 1] * x + p[LIGHT + 2] * y + gain * t - grey[i]
        rest[i] = residual
        weight = 1.0
        if grey[i] >= CUT and residual > 0.0:  # cut off: it may have been as bright as that
            rest[i] = residual = weight = 0.0
        elif abs(residual) > limit:
            weight = limit / abs(residual)
            cost += limit * (abs(residual) - 0.5 * limit)
        else:
            cost += 0.5 * residual * residual
        # A step of the homography carries the print by (du, dv): the pixel sees what lay at -(du, dv).
        gx, gy = gain * tx + p[LIGHT + 1] + p[LIGHT + 4] * t, gain * ty + p[LIGHT + 2] + p[LIGHT + 5] * t
        scale = 1.0 / (p[6] * x + p[7] * y + 1.0)
        gu, gv = -scale * (gx * xu + gy * yu), -scale * (gx * xv + gy * yv)
        gw = -(gu * u + gv * v)
        k = filled
        rows[0, k], rows[1, k], rows[2, k] = gu * x, gu * y, gu
        rows[3, k], rows[4, k], rows[5, k] = gv * x, gv * y, gv
        rows[6, k], rows[7, k] = gw * x, gw * y
        rows[8, k], rows[9, k] = gain * ts * p[BLUR] / variance, gain * te
        rows[10, k], rows[11, k], rows[12, k] = 1.0, x, y
        rows[13, k], rows[14, k], rows[15, k] = t, t * x, t * y
        rows[16, k], rows[17, k] = gain * ax, gain * ay
        left[k] = residual
        for j in range(size):
            weights[j, k] = weight * rows[j, k]
        filled += 1
        if filled == BLOCK or i == len(grey) - 1:
            for k in range(filled, BLOCK):
                left[k] = 0.0
                for j in range(size):
                    rows[j, k] = weights[j, k] = 0.0
            for j in range(size):
                f = 0.0
                for k in range(BLOCK):
                    f += weights[j, k] * left[k]
                g[j] += f
                for m in range(j + 1):
                    f = 0.0
                    for k in range(BLOCK):
                        f += weights[j, k] * rows[m, k]
                    a[j, m] += f
            filled = 0
    return cost


@kernel
def fit_pixels(grey, ideal, slope, p, cells, corners, limit, rounds, still, size, a, rest):
    """Levenberg-Marquardt from p (18,), in place, by the first `size` parameters, until no corner moves by `still` px; lower a (18, 18) <-
    the normal matrix there; rest (m,) <- residuals. Returns the cost, or -1 where it finds no step."""
    g, trial_g, q, step = np.empty(SIZE), np.empty(SIZE), np.zeros(SIZE), np.empty(SIZE)
    trial_a, held = np.empty((SIZE, SIZE)), np.empty((SIZE, SIZE))
    lam = 1e-3
    cost = sum_pixels(grey, ideal, slope, p, cells, corners, limit, size, g, a, rest)
    for _ in range(rounds):
        for i in range(size):
            for j in range(i):
                held[i, j] = a[i, j]
            held[i, i] = a[i, i] * (1.0 + lam) + 1e-9
            step[i] = -g[i]
        if not cholesky(held, size):
            lam *= 10.0
            if lam > 1e6:
                return -1.0
            continue
        forward(held, size, step)
        backward(held, size, step)
        for i in range(size):
            q[i] = p[i] + step[i]
        q[BLUR] = min(max(abs(q[BLUR]), 0.05), 8.0)
        if lam <= SURE and farthest(p, q) < max(NEARLY, still):
            for i in range(size):
                p[i] = q[i]
            break
        trial = sum_pixels(grey, ideal, slope, q, cells, corners, limit, size, trial_g, trial_a, rest)
        if trial <= cost:
            moved = farthest(p, q)
            for i in range(size):
                p[i], g[i] = q[i], trial_g[i]
                for j in range(i + 1):
                    a[i, j] = trial_a[i, j]
            cost, lam = trial, max(0.1 * lam, 1e-9)
            if moved < still:
                break
        else:
            lam *= 10.0
            if lam > 1e6:
                break
    return cost


@kernel
def share_misfits(grey, inside, rest, width, limit, near):
    """By how much misfits that neighbours share, within `near` px, widen a variance: the sum of products of neighbours' misfits by that of
    their squares, weighed by the slope of the image as corners are; 1 where they are noise. grey, inside (m,): a box of `width`; rest: of
    the pixels inside."""
    height = len(grey) // width
    field = np.zeros(len(grey))
    k = 0
    for i in range(len(grey)):
        if not inside[i]:
            continue
        r, c = i // width, i % width
        if 0 < r < height - 1 and 0 < c < width - 1:
            du, dv = grey[i + 1] - grey[i - 1], grey[i + width] - grey[i - width]
            field[i] = min(max(rest[k], -limit), limit) * math.sqrt(du * du + dv * dv)
        k += 1
    own = shared = 0.0
    for r in range(near, height - near):
        for c in range(near, width - near):
            f, around = field[r * width + c], 0.0
            for y in range(r - near, r + near + 1):
                for i in range(y * width + c - near, y * width + c + near + 1):
                    around += field[i]
            own, shared = own + f * f, shared + f * around
    return max(shared / own, 1.0) if own > 0.0 else 1.0


@kernel
def farthest(p, q):
    """How far (px) a corner of the square moves between two homographies."""
    most = 0.0
    for k in range(4):
        x, y = (-1.0 if k in (0, 3) else 1.0), (-1.0 if k < 2 else 1.0)
        a, b = p[6] * x + p[7] * y + 1.0, q[6] * x + q[7] * y + 1.0
        du = (p[0] * x + p[1] * y + p[2]) / a - (q[0] * x + q[1] * y + q[2]) / b
        dv = (p[3] * x + p[4] * y + p[5]) / a - (q[3] * x + q[4] * y + q[5]) / b
        most = max(most, abs(du), abs(dv))
    return most
