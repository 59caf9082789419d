"""Laws of controllers: a step is a pure function, its integral never winds up, and a compiled loop takes the same step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robocal.control.pid import ControlLaw, ControllerState, step
from robocal.errors import ModelError


def outputs(law, errors):
    """The output at every error in turn, and the last state."""
    state, out = ControllerState(), []
    for error in errors:
        state, u = step(law, state, error)
        out.append(u)
    return np.array(out), state


def test_a_step_is_pure():
    law, state = ControlLaw(2.0, 3.0, 0.1), ControllerState(0.2, 0.1, -0.3)
    assert step(law, state, 0.5) == step(law, state, 0.5)
    assert state == ControllerState(0.2, 0.1, -0.3)


def test_proportional_is_gain_times_error_within_the_limit():
    errors = np.random.default_rng(1).normal(0, 1, 50)
    np.testing.assert_allclose(outputs(ControlLaw(2.0, limit=1.5), errors)[0], np.clip(2 * errors, -1.5, 1.5))


def test_pid_is_its_formula():
    """Against sums of numpy, far from the limit."""
    law, errors = ControlLaw(2.0, 30.0, 0.01, period=1e-3), np.random.default_rng(2).normal(0, 1, 200)
    rate = np.diff(errors, prepend=0.0) / 1e-3
    np.testing.assert_allclose(
        outputs(law, errors)[0], 2 * errors + 30e-3 * np.cumsum(errors) + 0.01 * rate, atol=1e-12
    )


def test_the_rate_passes_a_filter_of_first_order():
    """The output of a ramp of errors: kd (1 - exp(-t / filter)) within a period's share."""
    law = ControlLaw(0.0, 0.0, 1.0, period=1e-4, filter_time=0.05)
    t = 1e-4 * np.arange(1, 3000)
    np.testing.assert_allclose(outputs(law, t)[0], 1 - np.exp(-t / 0.05), atol=2e-3)


@pytest.mark.parametrize("sign", [1, -1])
def test_the_integral_does_not_wind_up(sign):
    """Ten seconds at the limit: the controller leaves it as soon as the error changes its sign. One that winds up takes ten more."""
    law = ControlLaw(1.0, 20.0, limit=2.0)
    far = np.full(10_000, 1.0)
    out, state = outputs(law, sign * far)
    assert (np.abs(out) <= 2.0).all() and abs(out[-1]) > 1.9
    assert abs(state.integral) < 2.0
    back, _ = outputs(law, np.concatenate([sign * far, -sign * np.full(100, 0.2)]))
    assert (sign * back[10_000:] < 1.0).all()
    plain = 1.0 * 1 + 20e-3 * 10_000  # of a controller without anti-windup
    assert plain > 50 * law.limit


@pytest.mark.parametrize("bad", [{"kp": -1.0}, {"kp": math.nan}, {"kp": 1, "period": 0.0}, {"kp": 1, "limit": 0.0}])
def test_what_is_no_gain_is_refused(bad):
    with pytest.raises(ModelError):
        ControlLaw(**bad)


def test_laws_by_name():
    assert ControlLaw.of("p", kp=0.05, limit=0.2) == ControlLaw(0.05, limit=0.2)
    assert ControlLaw.of("pid", kp=1.0, ki=2.0, kd=3.0, period=2e-3) == ControlLaw(1.0, 2.0, 3.0, period=2e-3)
    for name, numbers, key in (
        ("pi", {"kp": 1.0}, "controller"),
        ("p", {"kp": 1.0, "ki": 2.0}, "ki"),
        ("pid", {"kp": 1.0}, "kd"),
    ):
        with pytest.raises(ModelError) as failure:
            ControlLaw.of(name, **numbers)
        assert failure.value.key == key
