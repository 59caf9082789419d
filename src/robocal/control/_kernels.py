"""Compiled steps of controllers: numbers in, numbers out, so that any loop can call them and nothing stays between two calls."""

from __future__ import annotations

from robocal._jit import kernel


@kernel
def pid_step(kp, ki, kd, filter_time, limit, period, integral, last, rate, error):
    """Returns integral, last error, filtered rate of the error, and the output within the limit; `control.pid` says the formula."""
    slope = rate + period / (filter_time + period) * ((error - last) / period - rate)
    grown = integral + ki * error * period
    raw = kp * error + grown + kd * slope
    if abs(raw) > limit and raw * error > 0.0:
        grown = integral
        raw = kp * error + grown + kd * slope
    return grown, error, slope, min(limit, max(-limit, raw))
