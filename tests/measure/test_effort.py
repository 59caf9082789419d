"""Efforts of a motor: the Jacobian against differences, and the short way to the normal equations against the long one."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.drives.drive_sweep import sweep_of
from robocal.drives.motor import GAIN, LAG, motor_of
from robocal.errors import ModelError
from robocal.measure.base import problem
from robocal.measure.effort import EffortRows
from robocal.measure.machine import Rig
from robocal.session.drive.drive_data import NUMBERS, drive_data


def made(by_direction: bool, eccentric: bool):
    rng = np.random.default_rng(1)
    way = np.sort(rng.uniform(0, 7, 80))
    angle = np.concatenate([way, way[::-1]])
    sweep = sweep_of("s", "A", np.arange(160.0), angle, rng.standard_normal(160))
    data = drive_data([sweep], [sweep.used], NUMBERS)
    motor = motor_of("m", (3, 8), "A", 1.0, by_direction=by_direction, eccentric=eccentric)
    whole = problem(motor.with_table(motor.table.with_free({*motor.table.free, LAG, GAIN})), data)
    x = whole.start + 0.1 * rng.standard_normal(whole.start.shape)
    if not eccentric:
        x[:, [whole.table.index[n] for n in ("encoder.cos", "encoder.sin")]] = 0.0
    return whole, x


@pytest.mark.parametrize("by_direction", [False, True])
@pytest.mark.parametrize("eccentric", [False, True])
def test_the_jacobian_and_both_ways_to_the_normal_equations(by_direction, eccentric, monkeypatch):
    whole, x = made(by_direction, eccentric)
    lin = whole.linearize(x)
    for column, name in enumerate(whole.free):
        step = np.zeros_like(x)
        step[0, whole.table.index[name]] = 1e-6
        ends = [whole.linearize(x + s * step).r for s in (1, -1)]
        assert np.abs((ends[0] - ends[1]) / 2e-6 - lin.j[:, column]).max() < 1e-5 * np.abs(lin.j).max(), name
    short = whole.normal(x)
    assert np.allclose(np.tril(short.a[0]), np.tril(lin.j.T @ lin.j), rtol=1e-10, atol=1e-6)
    assert np.allclose(short.g[0], lin.j.T @ lin.r, rtol=1e-10, atol=1e-6)
    monkeypatch.setattr(EffortRows, "accumulate", lambda *_: False)
    long = whole.normal(x)
    assert np.allclose(np.tril(short.a[0]), np.tril(long.a[0]), rtol=1e-12)
    assert short.cost == pytest.approx(long.cost, rel=1e-12)


def test_efforts_are_of_a_motor():
    sweep = sweep_of("s", "A", np.arange(160.0), np.linspace(0, 7, 160), np.ones(160))
    with pytest.raises(ModelError, match="of a motor"):
        problem(Rig(), drive_data([sweep], [sweep.used]))
