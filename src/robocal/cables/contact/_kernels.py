"""First contact along straight motions, by steps that are proven not to pass one; callers own every buffer.

Each advance_* walks one pair along lambda in [0, stop]. At every stop it finds a plane that separates the two, and steps
as far as that same plane is certain to separate them; where it ends, nothing has touched before. It gives back lambda and
the clearance there: at most `tolerance` at a contact, more than it when stop or the limit of steps came first.
"""

from __future__ import annotations

import math

import numpy as np

from robocal._jit import kernel
from robocal.cables.contact.ends._kernels import FAR, advance_wheel, leave, move
from robocal.cables.contact.segments._kernels import cross_norm, dot, separation
from robocal.geometry._kernels import rotation_from_vector


@kernel
def span(gap, rate, bend):
    """The largest h for which gap + rate t - bend t^2 / 2 >= 0 on all of [0, h]; gap > 0, bend >= 0."""
    root = math.sqrt(rate * rate + 2.0 * bend * gap)
    if rate < 0.0:
        return 2.0 * gap / (root - rate)
    return (rate + root) / bend if bend * FAR > rate + root else FAR


@kernel
def swing(ck, cl, rk, rl, share, c):
    """c (3,) <- the smallest rate of the normal n with c . c_k + n . B_k' = 0 where n meets cable k inside, and so for l.

    rk, rl: n . B_k' and n . B_l'; with them the plane turns along with the cables. Returns |c|.
    """
    kk, ll, kl = dot(ck, ck), dot(cl, cl), dot(ck, cl)
    inside_k, inside_l = 0.0 < share[0] < 1.0, 0.0 < share[1] < 1.0
    x = y = 0.0
    if inside_k and inside_l:
        det = kk * ll - kl * kl
        if det > 1e-12 * kk * ll:
            x, y = (kl * rl - ll * rk) / det, (kl * rk - kk * rl) / det
    elif inside_k:
        x = -rk / kk
    elif inside_l:
        y = -rl / ll
    for i in range(3):
        c[i] = x * ck[i] + y * cl[i]
    return math.sqrt(dot(c, c))


@kernel
def swinging_step(tk, bk, dk, fast_k, tl, bl, dl, fast_l, n, c, rate, reach, twist_k, twist_l, twist_kl):
    """How long the plane across n + h c is certain to separate two cables; twist: bounds on the anchors' accelerations, fast: on the
    speeds of the points at which they leave their wheels."""
    step = 1.0 / rate if rate * FAR > 1.0 else FAR  # up to here |n + h c| <= 2
    for corner in range(4):
        at_k, at_l = corner >= 2, corner % 2 == 1
        g0, g1, g2 = -reach, 0.0, 0.0
        for i in range(3):
            gap = (bk[i] if at_k else tk[i]) - (bl[i] if at_l else tl[i])
            speed = (dk[i] if at_k else 0.0) - (dl[i] if at_l else 0.0)
            g0 += n[i] * gap
            g1 += c[i] * gap + n[i] * speed
            g2 -= 2.0 * c[i] * speed
        twist = twist_kl if at_k and at_l else (twist_k if at_k else (twist_l if at_l else 0.0))
        rolls = (0.0 if at_k else fast_k) + (0.0 if at_l else fast_l)
        # |n + h c| <= 1 + h (n . c) + h^2 |c|^2 / 2, of which the middle is rounding.
        g1 -= reach * abs(dot(n, c)) + rolls
        g2 = max(g2 + 2.0 * twist + reach * rate * rate + 2.0 * rate * rolls, 0.0)
        step = min(step, span(g0, g1, g2)) if g0 > 0.0 else 0.0
    return step


@kernel(inline=True)
def advance_cables(a, axis, wheel, near, lever, position, v, w, speed, k, l, reach, stop, tolerance, limit, work):
    """Two cables without a common end, from `near` on where their anchors on the frame are one; `reach` is the sum of their radii,
    work (15, 3) scratch."""
    bk, dk, bl, dl, n, apart = work[0], work[1], work[2], work[3], work[4], work[5]
    rot, share, ck, cl, c, tk, tl = work[6:9], work[9], work[10], work[11], work[12], work[13], work[14]
    turn = math.sqrt(dot(w, w))
    for i in range(3):
        apart[i] = lever[k, i] - lever[l, i]
    twist_k, twist_l, twist_kl = cross_norm(w, lever[k]), cross_norm(w, lever[l]), cross_norm(w, apart)
    # Points that keep their share s, t of their cables part no faster than at a corner of (s, t) in [0, 1]^2.
    corner = twist_kl
    over = wheel[k] > 0.0 or wheel[l] > 0.0
    fast_k, fast_l, room_k, room_l = 0.0, 0.0, FAR, FAR
    for i in range(3):
        tk[i], tl[i] = a[k, i], a[l, i]
    twist_k, twist_l, twist_kl = turn * twist_k, turn * twist_l, turn * twist_kl
    lam = 0.0
    clear = np.inf
    for _ in range(limit):
        rotation_from_vector(lam * w[0], lam * w[1], lam * w[2], rot)
        move(lam, position, v, w, lever[k], rot, bk, dk)
        move(lam, position, v, w, lever[l], rot, bl, dl)
        if over:
            fast_k, room_k = leave(a[k], axis[k], wheel[k], near, bk, speed[k], tk)
            fast_l, room_l = leave(a[l], axis[l], wheel[l], near, bl, speed[l], tl)
        clear = separation(tk, bk, tl, bl, n, share) - reach
        if clear <= tolerance:
            return lam, clear
        ak, al, ek, el = dot(n, tk), dot(n, tl), dot(n, bk), dot(n, bl)
        # What the plane across n proves, whatever the rounding of n: this, not the distance, is what steps rest on.
        clear = min(ak, ek) - max(al, el) - reach
        if clear <= tolerance:
            return lam, clear
        rk, rl = dot(n, dk), dot(n, dl)
        step = min(
            span(ak - el - reach, -rl - fast_k, twist_l),
            span(ek - al - reach, rk - fast_l, twist_k),
            span(ek - el - reach, rk - rl, twist_kl),
            span(ak - al - reach, -fast_k - fast_l, 0.0),
        )
        for i in range(3):
            ck[i] = bk[i] - tk[i]
            cl[i] = bl[i] - tl[i]
        rate = swing(ck, cl, rk, rl, share, c)
        swung = swinging_step(tk, bk, dk, fast_k, tl, bl, dl, fast_l, n, c, rate, reach, twist_k, twist_l, twist_kl)
        step = max(step, swung)
        fastest = max(speed[k] + fast_l, speed[l] + fast_k, corner, fast_k + fast_l)
        if fastest > 0.0 and step * fastest < clear:
            step = clear / fastest
        lam += min(step, room_k, room_l)
        if lam >= stop:
            return stop, clear
    return lam, clear


@kernel
def shortened(x, relief, out):
    """out (3,) <- x drawn in to a length of at most relief; returns the length of x."""
    length = math.sqrt(dot(x, x))
    factor = relief / length if length > relief else 1.0
    for i in range(3):
        out[i] = factor * x[i]
    return length


@kernel(inline=True)
def advance_common(
    a, axis, wheel, lever, position, v, w, speed, k, l, at_platform, reach, relief, stop, tolerance, limit, work
):
    """Two cables with a common end: the gap between their points at `relief` from it. Over wheels they have none on the frame."""
    bk, dk, bl, dl, qk, ql = work[0], work[1], work[2], work[3], work[4], work[5]
    rot, tk, tl = work[6:9], work[13], work[14]
    lam = 0.0
    clear = np.inf
    for _ in range(limit):
        rotation_from_vector(lam * w[0], lam * w[1], lam * w[2], rot)
        move(lam, position, v, w, lever[k], rot, bk, dk)
        move(lam, position, v, w, lever[l], rot, bl, dl)
        fast_k, room_k = leave(a[k], axis[k], wheel[k], 0.0, bk, speed[k], tk)
        fast_l, room_l = leave(a[l], axis[l], wheel[l], 0.0, bl, speed[l], tl)
        sign = -1.0 if at_platform else 1.0
        for i in range(3):
            bk[i] = sign * (bk[i] - tk[i])
            bl[i] = sign * (bl[i] - tl[i])
        long_k, long_l = shortened(bk, relief, qk), shortened(bl, relief, ql)
        d2 = 0.0
        for i in range(3):
            d2 += (qk[i] - ql[i]) ** 2
        clear = math.sqrt(d2) - reach
        if clear <= tolerance:
            return lam, clear
        step = FAR
        for c in range(2):
            s, length = (speed[k] + fast_k, long_k) if c == 0 else (speed[l] + fast_l, long_l)
            # Drawn in to c, an end of speed s moves at min(s, s c / length), and the length shrinks by at most s.
            half = 0.5 * clear
            if s > 0.0:
                step = min(step, max(half / s, half * length / (s * (relief + half))))
        lam += min(step, room_k, room_l)
        if lam >= stop:
            return stop, clear
    return lam, clear


@kernel(inline=True)
def advance_body(
    a, axis, wheel, lever, position, v, w, speed, k, normals, depth, radius, relief, stop, tolerance, limit, work
):
    """A cable and the body that it hangs on: its point at `relief` from the anchor against every half-space.

    normals (f, 3) turned by R_0, depth (f,) of the anchor below each face, at least 0.
    """
    y, x, rate, wv, rot, b, db, t = work[0], work[1], work[2], work[3], work[6:9], work[4], work[5], work[13]
    turn = math.sqrt(dot(w, w))
    # |x''| <= |w| |w x (a - p)| + 2 |w x v|, the former largest at an end of the motion; on a wheel a is twice its radius off at most.
    bend = 0.0
    for c in range(2):
        for i in range(3):
            y[i] = a[k, i] - position[i] - c * v[i]
        bend = max(bend, turn * cross_norm(w, y))
    bend += 2.0 * cross_norm(w, v) + 2.0 * turn * turn * wheel[k]
    lam = 0.0
    clear = np.inf
    for _ in range(limit):
        if wheel[k] > 0.0:
            rotation_from_vector(lam * w[0], lam * w[1], lam * w[2], rot)
            move(lam, position, v, w, lever[k], rot, b, db)
        fast, room = leave(a[k], axis[k], wheel[k], 0.0, b, speed[k], t)
        rotation_from_vector(-lam * w[0], -lam * w[1], -lam * w[2], rot)
        for i in range(3):
            y[i] = t[i] - position[i] - lam * v[i]
        wv[0] = -v[0] - w[1] * y[2] + w[2] * y[1]
        wv[1] = -v[1] - w[2] * y[0] + w[0] * y[2]
        wv[2] = -v[2] - w[0] * y[1] + w[1] * y[0]
        for i in range(3):  # x: from platform to frame anchor in the axes of the start, and its velocity
            x[i] = rot[i, 0] * y[0] + rot[i, 1] * y[1] + rot[i, 2] * y[2] - lever[k, i]
            rate[i] = rot[i, 0] * wv[0] + rot[i, 1] * wv[1] + rot[i, 2] * wv[2]
        length = math.sqrt(dot(x, x))
        longer = max(length, relief)
        clear = -np.inf
        step = 0.0
        for f in range(normals.shape[0]):
            height = dot(normals[f], x)
            above = height * relief / longer - depth[f] - radius
            clear = max(clear, above)
            share = (depth[f] + radius) / relief
            if above > tolerance:
                gap = height - share * longer
                step = max(step, span(gap, dot(normals[f], rate) - fast - share * (speed[k] + fast), bend))
        if clear <= tolerance:
            return lam, clear
        lam += min(step, room)
        if lam >= stop:
            return stop, clear
    return lam, clear


@kernel
def first_contacts(
    a, b, axis, wheel, radius, common, normals, offsets, relief, start, v, w, tolerance, limit, fraction, kind, who, gap
):
    """fraction (B,), kind (B,), who (B, 2), gap (B,) <- the first contact of each motion, over all pairs.

    axis (m, 3), wheel (m,): swivel axes and radii of pulleys, radius 0 for an eyelet. common (m, m): 0 no common end, 1 at the
    frame, 2 at the platform, 3 at the frame over a wheel; kind: 0 none, 1 two cables, 2 a cable and the body, 3 an anchor and its wheel.
    """
    m = a.shape[0]
    lever = np.empty((m, 3))
    turned = np.empty_like(normals)
    depth = np.empty(normals.shape[0])
    speed = np.empty(m)
    work = np.empty((15, 3))
    for g in range(fraction.shape[0]):
        r = start[g, :3, :3]
        position = start[g, :3, 3].copy()
        vg, wg = v[g], w[g]
        for i in range(m):
            for c in range(3):
                lever[i, c] = r[c, 0] * b[i, 0] + r[c, 1] * b[i, 1] + r[c, 2] * b[i, 2]
            speed[i] = math.sqrt(dot(vg, vg)) + cross_norm(wg, lever[i])
        for f in range(normals.shape[0]):
            for c in range(3):
                turned[f, c] = r[c, 0] * normals[f, 0] + r[c, 1] * normals[f, 1] + r[c, 2] * normals[f, 2]
        stop = 1.0
        kind[g], who[g, 0], who[g, 1], gap[g] = 0, -1, -1, np.inf
        for k in range(m):
            if wheel[k] > 0.0:
                lam, clear = advance_wheel(
                    a, axis, wheel, lever, position, vg, wg, speed, k, stop, tolerance, limit, work
                )
                if lam < stop:
                    stop = lam
                    kind[g], who[g, 0], who[g, 1], gap[g] = 3, k, -1, clear
        for k in range(m):
            if normals.shape[0]:
                for f in range(normals.shape[0]):
                    depth[f] = max(offsets[f] - dot(normals[f], b[k]), 0.0)
                lam, clear = advance_body(
                    a, axis, wheel, lever, position, vg, wg, speed, k, turned, depth, radius[k], relief, stop, tolerance,
                    limit, work,
                )  # fmt: skip
                if lam < stop:
                    stop = lam
                    kind[g], who[g, 0], who[g, 1], gap[g] = 2, k, -1, clear
            for l in range(k + 1, m):
                reach = radius[k] + radius[l]
                if common[k, l] == 0 or common[k, l] == 3:
                    near = relief if common[k, l] == 3 else 0.0
                    lam, clear = advance_cables(
                        a, axis, wheel, near, lever, position, vg, wg, speed, k, l, reach, stop, tolerance, limit, work
                    )
                else:
                    lam, clear = advance_common(
                        a, axis, wheel, lever, position, vg, wg, speed, k, l, common[k, l] == 2, reach, relief, stop, tolerance,
                        limit, work,
                    )  # fmt: skip
                if lam < stop:
                    stop = lam
                    kind[g], who[g, 0], who[g, 1], gap[g] = 1, k, l, clear
        fraction[g] = stop
