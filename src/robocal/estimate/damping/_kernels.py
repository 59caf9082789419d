"""Small batched solves, and what becomes of the steps: damping, refusals, stops."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import LANES, WIDE, backward, cholesky, forward, products


@kernel
def half(block, shared, known, first, y, v):
    """Rows of y (n, .), from number `first` on, <- L^-1 of the rows of shared (n, l), and v (n,) -= y known (l,); block holds L."""
    size = block.shape[0]
    if size == 6:  # free poses: in registers
        b = block
        i0, i1, i2 = 1.0 / b[0, 0], 1.0 / b[1, 1], 1.0 / b[2, 2]
        i3, i4, i5 = 1.0 / b[3, 3], 1.0 / b[4, 4], 1.0 / b[5, 5]
        k0, k1, k2, k3, k4, k5 = known[0], known[1], known[2], known[3], known[4], known[5]
        for j in range(shared.shape[0]):
            p = i0 * shared[j, 0]
            q = i1 * (shared[j, 1] - b[1, 0] * p)
            r = i2 * (shared[j, 2] - b[2, 0] * p - b[2, 1] * q)
            s = i3 * (shared[j, 3] - b[3, 0] * p - b[3, 1] * q - b[3, 2] * r)
            t = i4 * (shared[j, 4] - b[4, 0] * p - b[4, 1] * q - b[4, 2] * r - b[4, 3] * s)
            u = i5 * (shared[j, 5] - b[5, 0] * p - b[5, 1] * q - b[5, 2] * r - b[5, 3] * s - b[5, 4] * t)
            y[j, first], y[j, first + 1], y[j, first + 2] = p, q, r
            y[j, first + 3], y[j, first + 4], y[j, first + 5] = s, t, u
            v[j] -= k0 * p + k1 * q + k2 * r + k3 * s + k4 * t + k5 * u
        return
    for j in range(shared.shape[0]):
        for i in range(size):
            f = shared[j, i]
            for k in range(i):
                f -= block[i, k] * y[j, first + k]
            y[j, first + i] = f / block[i, i]
            v[j] -= known[i] * y[j, first + i]


@kernel
def rest(gradient, shared, v, x):
    """x (l,) <- -gradient - shared^T v, shared (n, l)."""
    if x.shape[0] == 6:
        p, q, r, s, t, u = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(v.shape[0]):
            f = v[j]
            p += f * shared[j, 0]
            q += f * shared[j, 1]
            r += f * shared[j, 2]
            s += f * shared[j, 3]
            t += f * shared[j, 4]
            u += f * shared[j, 5]
        x[0], x[1], x[2], x[3], x[4], x[5] = -p, -q, -r, -s, -t, -u
        for i in range(6):
            x[i] -= gradient[i]
        return
    for i in range(x.shape[0]):
        f = gradient[i]
        for j in range(v.shape[0]):
            f += shared[j, i] * v[j]
        x[i] = -f


@kernel(inline=True)
def system(lam, a, g, damp, s, v):
    """s (n, n) <- A + lam diag(damp), lower triangle, and v (n,) <- -g."""
    for i in range(g.shape[0]):
        for j in range(i + 1):
            s[i, j] = a[i, j]
        s[i, i] += lam * damp[i]
        v[i] = -g[i]


@kernel
def eliminate(lam, al, gl, asl, damp, roots, known, y, square, s, v):
    """Takes the blocks al (L, l, l), gl (L, l), asl (L, n, l) out of the system s, v; False when one is not positive definite.

    roots (L, l, l) receive their factors; known (l,), y (lanes, wide) and square (lanes, lanes) are work space: what is eliminated
    waits in rows of y, a few blocks of it, to be multiplied at once.
    """
    count, size = gl.shape
    n = v.shape[0]
    waiting = 0
    square[:] = 0.0
    for p in range(n, y.shape[0]):
        y[p] = 0.0
    for t in range(count):
        block = roots[t]
        for i in range(size):
            for j in range(size):
                block[i, j] = al[t, i, j]
            block[i, i] += lam * damp[t, i]
            known[i] = -gl[t, i]
        if not cholesky(block, size):
            return False
        forward(block, size, known)
        if waiting + size > y.shape[1]:
            products(y, waiting, square)
            waiting = 0
        # y = A_sl L^-T, so that A_sl A_ll^-1 A_ls = y y^T.
        half(block, asl[t], known, waiting, y, v)
        waiting += size
    products(y, waiting, square)
    for i in range(n):
        for j in range(i + 1):
            s[i, j] -= square[i, j]
    return True


@kernel(inline=True)
def solved(held, s, v):
    """v (n,) <- s^-1 v, but zero for columns held (n,) that must not move; False when s is not positive definite."""
    n = v.shape[0]
    for i in range(n):
        if held[i]:
            for j in range(n):
                if j < i:
                    s[i, j] = 0.0
                elif j > i:
                    s[j, i] = 0.0
            s[i, i] = 1.0
            v[i] = 0.0
    if not cholesky(s, n):
        return False
    forward(s, n, v)
    backward(s, n, v)
    return True


@kernel
def blocks_back(roots, gl, asl, v, step):
    """The steps (L, l) of the blocks from that of what they share, v (n,)."""
    for t in range(gl.shape[0]):
        rest(gl[t], asl[t], v, step[t])
        forward(roots[t], gl.shape[1], step[t])
        backward(roots[t], gl.shape[1], step[t])


# Codes shared with least_squares.Reason.
COST, GRADIENT, STEP, SINGULAR = 1, 2, 3, 5
LOST = -1  # a step that failed and cannot be followed
SHORTER = 0.1  # squared length, in the solver's metric, of a step back to the floor of a valley
SHARE = 1e-4  # of the cost, for an expected error of a column: below, its damping does not follow its length
EPS = float(np.finfo(np.float64).eps)  # not asked for in a kernel: numba's answer brings half of its library with it
ROUNDING = 1e-15  # a smaller decrease cannot be told from rounding


@kernel(inline=True)
def scale_columns(cost, g, a, value, lower, upper, scales, damp, held):
    """The damping of the free columns, which of them are held at a bound, and the largest cosine between the residual and one of
    the others, times the residual's length."""
    n = g.shape[0]
    tiny = EPS**2
    largest = 1e-300
    for i in range(n):
        largest = max(largest, a[i, i])
    worst = 0.0
    for i in range(n):
        # A column that carries nothing still needs a positive pivot to stay where it is, and one that carries
        # rounding alone has no length of its own: its error is expected to be worth a share of what is to be
        # explained. Otherwise noise-free data throw an angle that does nothing yet by 1e11 rad.
        damp[i] = max(damp[i], a[i, i], largest * tiny, SHARE * 2.0 * cost / scales[i] ** 2)
        if damp[i] == 0.0:
            damp[i] = 1.0
        held[i] = value.shape[0] > 0 and ((value[i] <= lower[i] and g[i] > 0) or (value[i] >= upper[i] and g[i] < 0))
        if not held[i]:
            worst = max(worst, abs(g[i]) / math.sqrt(damp[i]))
    return worst


@kernel(inline=True)
def scale_blocks(gl, al, damp, worst):
    """The same of the blocks of a family."""
    nloc, nl = gl.shape
    tiny = EPS**2
    for t in range(nloc):
        largest = 1e-300
        for i in range(nl):
            largest = max(largest, al[t, i, i])
        for i in range(nl):
            damp[t, i] = max(damp[t, i], al[t, i, i], largest * tiny)
            if damp[t, i] == 0.0:  # no row sees the block, as when its rows weigh nothing
                damp[t, i] = 1.0
            worst = max(worst, abs(gl[t, i]) / math.sqrt(damp[t, i]))
    return worst


@kernel(inline=True)
def promised(step, g, lam, damp, scales, tolerance):
    """Of a step: its squared length in the solver's metric, twice the decrease that the damped model promises, and whether it is
    below the resolution of x; scales (n,), or one for all."""
    far, gain, small = 0.0, 0.0, True
    for i in range(step.shape[0]):
        x = step[i]
        far += damp[i] * x * x
        gain += x * (lam * damp[i] * x - g[i])
        small = small and abs(x) <= tolerance * (scales[i] if scales.shape[0] > 1 else scales[0])
    return far, gain, small


@kernel(inline=True)
def judge(far, gain, small, failed, cost, tolerances, away, before, length, lam, predicted):
    """Why to stop with a step, or 0; the damping to go on with, the step's length, and the decrease that is promised.

    Problems that are `away` are stepped and not stopped, but LOST where the step is no shorter than the one that led away.
    """
    if away:
        # What leads back to the floor of a valley is far shorter than what led away from it along the floor.
        if failed or not far < SHORTER * length:
            return LOST, before, length, predicted
        return 0, lam, length, predicted
    if failed:
        return SINGULAR, lam, far, predicted
    # For a step that solves the damped system, decrease = 1/2 step . (lam D step - g).
    predicted = 0.5 * gain
    # A heavily damped step promises little anywhere; what counts is what the model promises without damping.
    if predicted * (1.0 + lam) <= max(tolerances[0], ROUNDING) * cost:
        return COST, lam, far, predicted
    return (STEP if small else 0), lam, far, predicted


@kernel
def propose(
    cost, g, a, blocks, value, lower, upper, scales, tolerances, damped, away, length, lam, damp, step, predicted, reason,
):  # fmt: skip
    """For every running problem: scale, hold columns at their bounds, solve, and say why to stop, in `reason` (B,). Returns how
    many go on.

    blocks: None without local blocks, which is compiled by itself, else gl, al, asl, their damping and their steps (B, L, l).
    value (B, n) are the parameters where bounds apply (B, 0 without bounds); tolerances (3,): cost, gradient, step.
    predicted (B,) is the decrease of half the sum of squares that the undamped model promises; length (B,) the square of
    the step that led a problem away.
    """
    batch, n = g.shape
    s = np.empty((n, n))
    v = np.empty(n)
    one = np.empty(1)
    one[0] = 1.0
    held = np.zeros(n, np.bool_)
    if blocks is not None:
        gl, al, asl, damp_local, step_local = blocks
        count, size = gl.shape[1], gl.shape[2]
        lanes, wide = (n + LANES - 1) // LANES * LANES, max(WIDE, size)
        roots, known = np.empty((count, size, size)), np.empty(size)
        y, square = np.empty((lanes, wide)), np.empty((lanes, lanes))
    running = 0
    for b in range(batch):
        if reason[b] != RUNNING:
            continue
        if not math.isfinite(cost[b]):
            reason[b] = NOT_FINITE
            continue
        worst = scale_columns(cost[b], g[b], a[b], value[b], lower, upper, scales, damp[b], held)
        if blocks is not None:
            worst = scale_blocks(gl[b], al[b], damp_local[b], worst)
        # Cosine between the residual and each column, in the metric that the solver sees.
        if not away[b] and worst <= tolerances[1] * math.sqrt(2.0 * cost[b]) + 1e-300:
            reason[b] = GRADIENT
            continue
        before = lam[b]
        failed = False
        while True:
            system(lam[b], a[b], g[b], damp[b], s, v)
            good = True
            if blocks is not None:
                good = eliminate(lam[b], al[b], gl[b], asl[b], damp_local[b], roots, known, y, square, s, v)
            if good and solved(held, s, v):
                break
            lam[b] = max(lam[b], 1e-12) * 10.0
            if not (damped and lam[b] <= 1e12):
                failed = True
                break
        if not failed:
            for i in range(n):
                step[b, i] = v[i]
            if blocks is not None:
                blocks_back(roots, gl[b], asl[b], v, step_local[b])
        far, gain, small = promised(step[b], g[b], lam[b], damp[b], scales, tolerances[2])
        if blocks is not None:
            for t in range(count):
                f, h, tiny = promised(step_local[b, t], gl[b, t], lam[b], damp_local[b, t], one, tolerances[2])
                far, gain, small = far + f, gain + h, small and tiny
        reason[b], lam[b], length[b], predicted[b] = judge(
            far, gain, small, failed, cost[b], tolerances, away[b], before, length[b], lam[b], predicted[b]
        )
        if reason[b] == RUNNING:
            running += 1
    return running


RUNNING, NOT_FINITE, STALLED = 0, 6, 7
STAY, TAKE, OUT, HOME = 0, 1, 2, 3
GROW = 10.0  # of the damping, after the first step that fails


@kernel
def settle(cost, trial, first, predicted, damped, lam, grow, best, away, iterations, reason, move):
    """Says what becomes of the trial of every running problem, in `move`, and moves its damping; cost (B,) and trial
    and move (running,) in the same order; first (B,) is the cost at the start. Returns how many trials are taken.

    Where the model foretells the decrease the damping falls fast, where it fails it grows ever faster. The first step
    that fails is followed once (OUT), see `least_squares`; best (B,) is the cost to come back with.
    """
    i = 0
    taken = 0
    for b in range(cost.shape[0]):
        if reason[b] != RUNNING:
            continue
        iterations[b] += 1
        finite = math.isfinite(trial[i])
        decrease = (best[b] if away[b] else cost[b]) - trial[i]
        if finite and (decrease > (0.25 * predicted[b] if away[b] else 0.0) or not damped):
            move[i] = TAKE
            taken += 1
            # What the model foretold was the first of two steps.
            ratio = decrease / predicted[b]
            if ratio > 0.9:
                lam[b] *= 0.02
            elif ratio > 0.5:
                lam[b] *= 0.2
            elif ratio <= 0.25:
                lam[b] *= 4.0
            grow[b] = GROW
            away[b] = False
        elif damped and not away[b] and grow[b] == GROW and finite and trial[i] < first[b]:
            move[i] = OUT
            best[b] = cost[b]
            away[b] = True
        else:
            move[i] = HOME if away[b] else STAY
            away[b] = False
            lam[b] = max(lam[b], 1e-9) * grow[b]
            grow[b] = min(grow[b] * 2.0, 1e4)
            if lam[b] > 1e14 or not damped:
                reason[b] = STALLED
        i += 1
    return taken
