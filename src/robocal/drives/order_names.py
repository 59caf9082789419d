"""What the orders of a motor's cogging are called, from its slots and poles.

    k lcm(slots, poles)    cogging: what an ideal motor has
    k slots                magnets that differ
    k poles                slots that differ
    pole pairs             the zero of a current sensor, once per electrical turn: it is no torque
    2 pole pairs           the gains of two current sensors that differ, twice per electrical turn: it is no torque
    m - 1, m + 1           sidebands of a strong order m: a rotor or an encoder disc off its centre

Where slots and poles are not known, those that name most of what was found are looked for, among windings of three phases.
Source: seed document, 1.4.2; Hanselman, Brushless Permanent Magnet Motor Design (2003), 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import lcm

import numpy as np

from robocal._types import Array

__all__ = ["guess_motor", "name_order", "named_share", "not_torque"]

MOST_SLOTS, MOST_POLES = 96, 96
STRONG = 3.0  # grid: times as large as its sideband is the order that has one


def not_torque(order: int, poles: int | None) -> bool:
    """Whether an order may come from the current sensors: once or twice per pole pair."""
    return poles is not None and order in (poles // 2, poles)


def name_order(order: int, slots: int | None, poles: int | None, strong: Sequence[int] = ()) -> str:
    """What an order is called; `strong` are orders that are larger than it by far. Of slots and poles one may be known alone."""
    if slots is not None and poles is not None and order % (whole := lcm(slots, poles)) == 0:
        times = order // whole
        return "lcm of slots and poles" + (f", {times} times" if times > 1 else "")
    if poles is not None:
        if order == poles // 2:
            return "once per pole pair: sensor zero, not torque"
        if order == poles:
            return "twice per pole pair: sensor gains, or slots"
    if slots is not None and order % slots == 0:
        return "slots" + (f", {order // slots} times" if order > slots else "")
    if poles is not None:
        if order % poles == 0:
            return f"poles, {order // poles} times"
        if order % (poles // 2) == 0:
            return f"pole pairs, {order // (poles // 2)} times"
    for main in strong:
        if 0 < abs(order - main) <= 2:
            return f"sideband of {main}: off its centre"
    return "once per turn: off its centre, or weight of a load" if order == 1 else "no name"


def named_share(orders: Sequence[int], amplitudes: Array, slots: int, poles: int) -> float:
    """The share of the variance in orders that slots and poles name, sidebands of them included."""
    power = np.asarray(amplitudes, float) ** 2
    main = [n % slots == 0 or n % (poles // 2) == 0 for n in orders]
    near = [
        any(m and abs(n - k) <= 2 and p < q / STRONG**2 for k, m, q in zip(orders, main, power, strict=True))
        for n, p in zip(orders, power, strict=True)
    ]
    named = np.array([a or b for a, b in zip(main, near, strict=True)])
    return float(power[named].sum() / power.sum()) if power.sum() > 0 else 0.0


@cache
def _windings() -> tuple[tuple[int, int], ...]:
    """Slots and poles of windings of three phases: a coil for each, and as many coils as turn each way."""
    out = []
    for slots in range(3, MOST_SLOTS + 1, 3):
        for poles in range(2, MOST_POLES + 1, 2):
            # A winding of q = slots / (3 poles) with a denominator that three divides has no balanced phases.
            if (
                poles != slots
                and (slots // np.gcd(slots, 3 * poles) or 1)
                and (3 * poles // np.gcd(slots, 3 * poles)) % 3
            ):
                out.append((slots, poles))
    return tuple(out)


def guess_motor(
    orders: Sequence[int], amplitudes: Array, known: tuple[int | None, int | None] = (None, None)
) -> tuple[int, int] | None:
    """Slots and poles that name the strongest order as their lcm, and have their own orders in the sweep too; None where none has.
    One of them may be known."""
    if not len(orders):
        return None
    power = dict(zip(orders, (np.asarray(amplitudes, float) ** 2).tolist(), strict=True))
    strongest = max(power, key=lambda n: power[n])
    best, found = 0.0, None
    for slots, poles in _windings():
        if lcm(slots, poles) != strongest or slots == strongest or poles == strongest:
            continue
        if any(k is not None and k != own for k, own in zip(known, (slots, poles), strict=True)):
            continue
        own = power.get(slots, 0.0) * power.get(poles // 2, 0.0)
        if own > best:
            best, found = own, (slots, poles)
    # Whose poles are a half of these has its pole pair in the sweep too: what was taken for once is twice per pole pair.
    if found is None:
        return None
    slots, half = found[0], found[1] // 2
    if (
        known[1] is None
        and half % 2 == 0
        and half // 2 in power
        and lcm(slots, half) == strongest
        and (slots, half) in _windings()
    ):
        return slots, half
    return found
