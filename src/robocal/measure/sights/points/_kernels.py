"""Points of one frame before a camera: their pixels, what motions of the frame and numbers of the camera do to these, and what a loss makes
of them; a tile of points at a time, so that several are computed at once."""

from __future__ import annotations

import math

from robocal._jit import kernel
from robocal.estimate._kernels import kept, robust

BROWN, RATIONAL, FISHEYE = 9, 12, 8  # numbers of a camera (`vision.camera.MODELS`)
AXIS = 1e-24  # of a square of slopes: so near to the axis, angle and slope are one
TILE = 64  # points that are projected at once
# Where the numbers of a tile lie: points in the camera's axes and seen from the origin of their frame, pixels, their derivatives,
# what multiplies these, and the share that a loss keeps; then the derivatives of both pixels by every number of a Brown lens.
# Constants: so the compiler sees that no two of them meet.
X, Y, Z, LX, LY, LZ, U, V, UX, UY, UZ, VX, VY, VZ, BY_U, BY_V, SHARE, FLAT_X, FLAT_Y, ANSWERS = (
    TILE * i for i in range(20)
)
SIZE, WIDE = ANSWERS + 2 * BROWN * TILE, 2 * TILE


@kernel
def project_points(w, n, f):
    """The pixels of n points of a tile w, with derivatives by x, y and z: `vision.camera.project`, several points at once. How many
    numbers f the camera has says which lens it is."""
    if f.shape[0] == RATIONAL:
        project_rational(w, n, f)
        return
    if f.shape[0] == FISHEYE:
        project_fisheye(w, n, f)
        return
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8]
    for i in range(n):
        iz = 1.0 / w[Z + i]
        x, y = w[X + i] * iz, w[Y + i] * iz
        w[FLAT_X + i], w[FLAT_Y + i] = x, y
        xx, yy, xy = x * x, y * y, x * y
        r2 = xx + yy
        d = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3)  # of d with respect to r2
        a = d + 2.0 * xx * slope + 2.0 * p1 * y + 6.0 * p2 * x
        b = 2.0 * xy * slope + 2.0 * p1 * x + 2.0 * p2 * y
        c = d + 2.0 * yy * slope + 6.0 * p1 * y + 2.0 * p2 * x
        w[U + i] = fx * (x * d + 2.0 * p1 * xy + p2 * (r2 + 2.0 * xx)) + cx
        w[V + i] = fy * (y * d + p1 * (r2 + 2.0 * yy) + 2.0 * p2 * xy) + cy
        u, v = fx * iz, fy * iz
        w[UX + i], w[UY + i], w[UZ + i] = u * a, u * b, -u * (a * x + b * y)
        w[VX + i], w[VY + i], w[VZ + i] = v * b, v * c, -v * (b * x + c * y)


@kernel
def project_rational(w, n, f):
    """The same of a rational lens: d is a quotient."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8]
    for i in range(n):
        iz = 1.0 / w[Z + i]
        x, y = w[X + i] * iz, w[Y + i] * iz
        w[FLAT_X + i], w[FLAT_Y + i] = x, y
        xx, yy, xy = x * x, y * y, x * y
        r2 = xx + yy
        under = 1.0 / (1.0 + r2 * (f[9] + r2 * (f[10] + r2 * f[11])))
        d = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) * under
        slope = (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3) - d * (f[9] + r2 * (2.0 * f[10] + 3.0 * r2 * f[11]))) * under
        a = d + 2.0 * xx * slope + 2.0 * p1 * y + 6.0 * p2 * x
        b = 2.0 * xy * slope + 2.0 * p1 * x + 2.0 * p2 * y
        c = d + 2.0 * yy * slope + 6.0 * p1 * y + 2.0 * p2 * x
        w[U + i] = fx * (x * d + 2.0 * p1 * xy + p2 * (r2 + 2.0 * xx)) + cx
        w[V + i] = fy * (y * d + p1 * (r2 + 2.0 * yy) + 2.0 * p2 * xy) + cy
        u, v = fx * iz, fy * iz
        w[UX + i], w[UY + i], w[UZ + i] = u * a, u * b, -u * (a * x + b * y)
        w[VX + i], w[VY + i], w[VZ + i] = v * b, v * c, -v * (b * x + c * y)


@kernel
def project_fisheye(w, n, f):
    """The same of a fisheye: the flat place lies along x and y, as far off as the angle to the axis."""
    fx, fy, cx, cy, k1, k2, k3, k4 = f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7]
    for i in range(n):
        px, py, pz = w[X + i], w[Y + i], w[Z + i]
        across = px * px + py * py
        iall = 1.0 / (across + pz * pz)
        if across > AXIS * pz * pz:
            rho = math.sqrt(across)
            s = math.atan2(rho, pz) / rho
            q = (pz * iall - s) / across
        else:
            s, q = 1.0 / pz, 0.0
        x, y = px * s, py * s
        w[FLAT_X + i], w[FLAT_Y + i] = x, y
        xx, xy, yy = s + q * px * px, q * px * py, s + q * py * py  # of the flat place by px and py
        xz, yz = -px * iall, -py * iall
        r2 = x * x + y * y
        d = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)))
        slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * (3.0 * k3 + r2 * 4.0 * k4)))
        a, b, c = d + x * x * slope, x * y * slope, d + y * y * slope
        w[U + i], w[V + i] = fx * x * d + cx, fy * y * d + cy
        w[UX + i], w[UY + i], w[UZ + i] = fx * (a * xx + b * xy), fx * (a * xy + b * yy), fx * (a * xz + b * yz)
        w[VX + i], w[VY + i], w[VZ + i] = fy * (b * xx + c * xy), fy * (b * xy + c * yy), fy * (b * xz + c * yz)


@kernel
def answer_brown(w, n, f):
    """In the tile w, the derivatives of the two pixels of n points by each of the nine numbers f of a Brown lens."""
    fx, fy, k1, k2, p1, p2, k3 = f[0], f[1], f[4], f[5], f[6], f[7], f[8]
    for i in range(n):
        x, y = w[FLAT_X + i], w[FLAT_Y + i]
        xx, yy, xy = x * x, y * y, x * y
        r2 = xx + yy
        d = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        by_p1, by_p2 = r2 + 2.0 * yy, r2 + 2.0 * xx
        w[ANSWERS + i], w[ANSWERS + TILE + i] = x * d + 2.0 * p1 * xy + p2 * by_p2, 0.0
        w[ANSWERS + 2 * TILE + i], w[ANSWERS + 3 * TILE + i] = 0.0, y * d + p1 * by_p1 + 2.0 * p2 * xy
        w[ANSWERS + 4 * TILE + i], w[ANSWERS + 5 * TILE + i] = 1.0, 0.0
        w[ANSWERS + 6 * TILE + i], w[ANSWERS + 7 * TILE + i] = 0.0, 1.0
        u, v = fx * x * r2, fy * y * r2
        w[ANSWERS + 8 * TILE + i], w[ANSWERS + 9 * TILE + i] = u, v
        u, v = u * r2, v * r2
        w[ANSWERS + 10 * TILE + i], w[ANSWERS + 11 * TILE + i] = u, v
        w[ANSWERS + 12 * TILE + i], w[ANSWERS + 13 * TILE + i] = 2.0 * fx * xy, fy * by_p1
        w[ANSWERS + 14 * TILE + i], w[ANSWERS + 15 * TILE + i] = fx * by_p2, 2.0 * fy * xy
        w[ANSWERS + 16 * TILE + i], w[ANSWERS + 17 * TILE + i] = u * r2, v * r2


@kernel
def answer_points(own, w, n, f, out):
    """out (c, 2 n) <- the derivatives of the two pixels of n points of a tile by the numbers own (c,) of a camera f, times what multiplies
    them: those of u, then those of v."""
    if f.shape[0] == BROWN:
        answer_brown(w, n, f)
        for p in range(own.shape[0]):
            at = ANSWERS + 2 * TILE * own[p]
            for i in range(n):
                out[p, i], out[p, n + i] = w[BY_U + i] * w[at + i], w[BY_V + i] * w[at + TILE + i]
    else:
        for p in range(own.shape[0]):
            for i in range(n):
                x, y = answer_wide(own[p], w[FLAT_X + i], w[FLAT_Y + i], f)
                out[p, i], out[p, n + i] = w[BY_U + i] * x, w[BY_V + i] * y


@kernel
def answer_wide(number, x, y, f):
    """The same at a flat place (x, y) of a rational lens or a fisheye."""
    if number == 2 or number == 3:
        return (1.0, 0.0) if number == 2 else (0.0, 1.0)
    r2 = x * x + y * y
    if f.shape[0] == FISHEYE:
        if number < 2:
            d = 1.0 + r2 * (f[4] + r2 * (f[5] + r2 * (f[6] + r2 * f[7])))
            return (x * d, 0.0) if number == 0 else (0.0, y * d)
        gain = r2 ** (number - 3)
        return f[0] * x * gain, f[1] * y * gain
    if number == 6:
        return 2.0 * f[0] * x * y, f[1] * (r2 + 2.0 * y * y)
    if number == 7:
        return f[0] * (r2 + 2.0 * x * x), 2.0 * f[1] * x * y
    under = 1.0 / (1.0 + r2 * (f[9] + r2 * (f[10] + r2 * f[11])))
    d = (1.0 + r2 * (f[4] + r2 * (f[5] + r2 * f[8]))) * under
    if number == 0:
        return x * d + 2.0 * f[6] * x * y + f[7] * (r2 + 2.0 * x * x), 0.0
    if number == 1:
        return 0.0, y * d + f[6] * (r2 + 2.0 * y * y) + 2.0 * f[7] * x * y
    gain = under * r2 if number == 4 else under * r2 * r2 if number == 5 else under * r2 * r2 * r2
    if number > 8:
        gain = -d * under * r2 ** (number - 8)
    return f[0] * x * gain, f[1] * y * gain


@kernel
def place_points(rows, n, point, growth, edge, there, f, w):
    """The tile w of n points, rows (n,): where `there` (3, 4) has them, seen from the origin of the frame f, in the axes of the camera;
    each is edge times growth from where it is stated."""
    a0, a1, a2, a3 = there[0, 0], there[0, 1], there[0, 2], there[0, 3]
    b0, b1, b2, b3 = there[1, 0], there[1, 1], there[1, 2], there[1, 3]
    c0, c1, c2, c3 = there[2, 0], there[2, 1], there[2, 2], there[2, 3]
    fx, fy, fz = f[0, 3], f[1, 3], f[2, 3]
    for i in range(n):
        j = rows[i]  # no view of a row is made: each costs as much as a point
        x, y, z = (
            point[j, 0] + edge * growth[j, 0],
            point[j, 1] + edge * growth[j, 1],
            point[j, 2] + edge * growth[j, 2],
        )
        lx, ly, lz = a0 * x + a1 * y + a2 * z + a3, b0 * x + b1 * y + b2 * z + b3, c0 * x + c1 * y + c2 * z + c3
        w[LX + i], w[LY + i], w[LZ + i] = lx, ly, lz
        w[X + i], w[Y + i], w[Z + i] = lx + fx, ly + fy, lz + fz


@kernel
def grow_points(rows, n, growth, there, w, out):
    """out (2 n) <- the derivatives of the two pixels of n points of a tile, rows (n,), by the edge of what was printed, times what
    multiplies them: those of u, then those of v."""
    for i in range(n):
        x, y, z = growth[rows[i], 0], growth[rows[i], 1], growth[rows[i], 2]
        gx = there[0, 0] * x + there[0, 1] * y + there[0, 2] * z
        gy = there[1, 0] * x + there[1, 1] * y + there[1, 2] * z
        gz = there[2, 0] * x + there[2, 1] * y + there[2, 2] * z
        out[i] = w[BY_U + i] * (w[UX + i] * gx + w[UY + i] * gy + w[UZ + i] * gz)
        out[n + i] = w[BY_V + i] * (w[VX + i] * gx + w[VY + i] * gy + w[VZ + i] * gz)


@kernel
def move_points(w, n, by, slope, out, first):
    """What motions (v, w) of their frame do to one pixel of n points of a tile, times its numbers `by`: six columns, out[first],
    out[first + WIDE] and so on, of its slope by x, y and z, and of the levers."""
    for i in range(n):
        # d point = v + w x lever, so d uv = jp v + (lever x jp) w.
        f, at = w[by + i], first + i
        x, y, z = f * w[slope + i], f * w[slope + TILE + i], f * w[slope + 2 * TILE + i]
        lx, ly, lz = w[LX + i], w[LY + i], w[LZ + i]
        out[at], out[WIDE + at], out[2 * WIDE + at] = x, y, z
        out[3 * WIDE + at], out[4 * WIDE + at], out[5 * WIDE + at] = ly * z - lz * y, lz * x - lx * z, lx * y - ly * x


@kernel
def whiten_points(rows, n, value, scale, heavy, loss, tuning, curved, w):
    """What n points of a tile w, rows (n,), cost twice: their pixels become whitened residuals, times the root of the weight `heavy` and of
    that of the loss, as what multiplies derivatives has it too."""
    total = 0.0
    for i in range(n):
        one, two = scale[rows[i], 0], scale[rows[i], 1]
        x, y = (w[U + i] - value[rows[i], 0]) * one, (w[V + i] - value[rows[i], 1]) * two
        rho, slope = robust(loss, tuning, x * x + y * y)
        total += rho
        root = math.sqrt(heavy * slope)
        if root == 0.0:  # forgotten: it may lie anywhere, behind the camera too
            x, y, w[FLAT_X + i], w[FLAT_Y + i] = 0.0, 0.0, 0.0, 0.0
            for e in range(6):
                w[UX + e * TILE + i] = 0.0
        w[U + i], w[V + i], w[BY_U + i], w[BY_V + i] = root * x, root * y, root * one, root * two
        if curved:
            w[SHARE + i] = kept(loss, tuning, x * x + y * y)
    return total


@kernel
def bend_points(w, n, heap, g):
    """Adds to g what n points of a tile w pull, and takes from their rows, columns of `heap`, what the curvature of the loss takes from the
    matrix alone (`estimate._kernels.shorten`); the residuals, behind them, say no more."""
    size = g.shape[0]
    for i in range(n):
        x, y = w[U + i], w[V + i]
        less = (1.0 - w[SHARE + i]) / (x * x + y * y) if w[SHARE + i] < 1.0 and x * x + y * y > 0.0 else 0.0
        for p in range(size):
            along = heap[p, i] * x + heap[p, n + i] * y
            g[p] += along
            heap[p, i] -= less * along * x
            heap[p, n + i] -= less * along * y
        heap[size, i] = heap[size, n + i] = 0.0
