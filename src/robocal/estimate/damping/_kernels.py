"""Small batched solves, and what becomes of the steps: damping, refusals, stops."""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.estimate._kernels import backward, cholesky, forward


@kernel
def half(block, shared, y):
    """y (l, n) <- L^-1 shared^T, block holds L, shared (n, l)."""
    size, n = y.shape
    for i in range(size):
        for j in range(n):
            y[i, j] = shared[j, i]
        for k in range(i):
            f = block[i, k]
            for j in range(n):
                y[i, j] -= f * y[k, j]
        f = 1.0 / block[i, i]
        for j in range(n):
            y[i, j] *= f


@kernel
def subtract_square(y, s):
    """s -= y^T y, lower triangle, y (l, n)."""
    size, n = y.shape
    for i in range(n):
        out = s[i]
        if size == 6:
            a, b, c, d, e, f = y[0, i], y[1, i], y[2, i], y[3, i], y[4, i], y[5, i]
            for j in range(i + 1):
                out[j] -= a * y[0, j] + b * y[1, j] + c * y[2, j] + d * y[3, j] + e * y[4, j] + f * y[5, j]
        elif size == 3:
            a, b, c = y[0, i], y[1, i], y[2, i]
            for j in range(i + 1):
                out[j] -= a * y[0, j] + b * y[1, j] + c * y[2, j]
        else:
            for k in range(size):
                a = y[k, i]
                for j in range(i + 1):
                    out[j] -= a * y[k, j]


@kernel(inline=True)
def solve_damped(a, g, al, gl, asl, lam, damp, damp_local, held, s, v, step, step_local):
    """(A + lam diag(damp)) step = -g of one problem, local blocks eliminated by Schur complement; False when not positive.

    a (n, n) lower triangle, damp (n,), damp_local (L, l), held (n,) columns that must not move, s (n, n) and v (n,)
    work space.
    """
    n = g.shape[0]
    nloc, nl = gl.shape
    roots = np.empty((nloc, nl, nl))
    bv = np.empty(nl)
    y = np.empty((nl, n))
    for i in range(n):
        for j in range(i + 1):
            s[i, j] = a[i, j]
        s[i, i] += lam * damp[i]
        v[i] = -g[i]
    for t in range(nloc):
        block = roots[t]
        for i in range(nl):
            for j in range(nl):
                block[i, j] = al[t, i, j]
            block[i, i] += lam * damp_local[t, i]
            bv[i] = -gl[t, i]
        if not cholesky(block, nl):
            return False
        forward(block, nl, bv)
        # y = L^-1 A_ls, so that A_sl A_ll^-1 A_ls = y^T y.
        half(block, asl[t], y)
        for i in range(nl):
            f = bv[i]
            for j in range(n):
                v[j] -= f * y[i, j]
        subtract_square(y, s)
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
    for i in range(n):
        step[i] = v[i]
    for t in range(nloc):
        x = step_local[t]
        for i in range(nl):
            x[i] = -gl[t, i]
        for j in range(n):
            for i in range(nl):
                x[i] -= asl[t, j, i] * v[j]
        forward(roots[t], nl, x)
        backward(roots[t], nl, x)
    return True


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
    cost, g, a, gl, al, asl, value, lower, upper, scales, tolerances, damped, away, length, lam, damp, damp_local, step,
    step_local, predicted, reason,
):  # fmt: skip
    """For every running problem: scale, hold columns at their bounds, solve, and say why to stop, in `reason` (B,). Returns how
    many go on.

    value (B, n) are the parameters where bounds apply (B, 0 without bounds); tolerances (3,): cost, gradient, step.
    predicted (B,) is the decrease of half the sum of squares that the undamped model promises; length (B,) the square of
    the step that led a problem away.
    """
    batch, n = g.shape
    nloc = gl.shape[1]
    s = np.empty((n, n))
    v = np.empty(n)
    one = np.empty(1)
    one[0] = 1.0
    held = np.zeros(n, np.bool_)
    running = 0
    for b in range(batch):
        if reason[b] != RUNNING:
            continue
        if not math.isfinite(cost[b]):
            reason[b] = NOT_FINITE
            continue
        worst = scale_columns(cost[b], g[b], a[b], value[b], lower, upper, scales, damp[b], held)
        worst = scale_blocks(gl[b], al[b], damp_local[b], worst)
        # Cosine between the residual and each column, in the metric that the solver sees.
        if not away[b] and worst <= tolerances[1] * math.sqrt(2.0 * cost[b]) + 1e-300:
            reason[b] = GRADIENT
            continue
        before = lam[b]
        failed = False
        while not solve_damped(
            a[b], g[b], al[b], gl[b], asl[b], lam[b], damp[b], damp_local[b], held, s, v, step[b], step_local[b]
        ):
            lam[b] = max(lam[b], 1e-12) * 10.0
            if damped and lam[b] <= 1e12:
                continue
            failed = True
            break
        far, gain, small = promised(step[b], g[b], lam[b], damp[b], scales, tolerances[2])
        for t in range(nloc):
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
