"""Laws of cogging, of moments and of what orders are called."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.drives import order_choice
from robocal.drives._kernels import cogging_at
from robocal.drives.cogging import Cogging, harmonics
from robocal.drives.drive_sweep import escaped_rows, led_directions, sweep_of
from robocal.drives.moments import moments_of
from robocal.drives.order_choice import choose_orders
from robocal.drives.order_exchange import normal_equations
from robocal.drives.order_names import guess_motor, name_order, not_torque
from robocal.drives.seed_table import seed_table


def made(rng: np.random.Generator, rows: int = 4000, noise: float = 0.02):
    angle = np.sort(rng.uniform(0, 2 * np.pi, rows))
    angle = np.concatenate([angle, angle[::-1]])
    d = np.repeat([1.0, -1.0], rows)
    truth = Cogging((6, 18), (0.2, 0.0), (0.1, -0.3), 0.004)
    return angle, d, truth, truth.at(angle, d) + 0.05 * d + 0.01 + noise * rng.standard_normal(2 * rows)


def test_the_kernel_and_the_table_say_the_same():
    truth = Cogging((6, 18), (0.2, 0.0), (0.1, -0.3), 0.004)
    orders, cos, sin = (np.array(v, float) for v in (truth.orders, truth.cosine, truth.sine))
    for angle, d in ((0.3, 1.0), (2.0, -1.0), (5.0, 0.0)):
        waves = harmonics(angle - d * truth.lag, orders)
        assert truth.at(angle, d) == pytest.approx(waves @ np.concatenate([cos, sin]), abs=1e-14)
        assert cogging_at(angle, d, orders, cos, sin, truth.lag) == pytest.approx(float(truth.at(angle, d)), abs=1e-14)


@pytest.mark.parametrize("by_direction", [False, True])
def test_moments_are_the_normal_equations_of_any_orders_and_lag(by_direction):
    rng = np.random.default_rng(1)
    angle, d, _, y = made(rng, 300)
    arc = rng.integers(0, 4, len(angle))
    found = moments_of(angle, y, d, arc, 20)
    a, b = (v.sum(axis=0) for v in found.normal((3, 7, 20), 0.01, by_direction))
    waves = harmonics(angle - 0.01 * d, (3, 7, 20))
    dense = np.column_stack([np.ones_like(d), d, waves, *([d[:, None] * waves] if by_direction else [])])
    assert np.abs(a - dense.T @ dense).max() < 1e-9
    assert np.abs(b - dense.T @ y).max() < 1e-9
    held = arc == 2
    x = np.linalg.lstsq(dense[~held], y[~held], rcond=None)[0]
    assert found.unseen((3, 7, 20), 0.01, by_direction)[2] == pytest.approx(
        np.sum((y - dense @ x)[held] ** 2), rel=1e-8
    )


def test_the_orders_are_those_of_the_truth_and_no_others():
    rng = np.random.default_rng(2)
    angle, d, truth, y = made(rng)
    found = choose_orders(moments_of(angle, y, d, (angle / (np.pi / 6)).astype(int) % 12, 60), 20, 1.8, 0.02)
    assert set(found.orders) == {6, 18}
    assert found.lag == pytest.approx(truth.lag, abs=3e-4)


def test_what_an_order_takes_is_what_a_fit_of_all_rows_says():
    rng = np.random.default_rng(6)
    angle, d, _, y = made(rng, 300)
    normal = normal_equations(moments_of(angle, y, d, np.zeros(len(d), int), 20), 0.01)

    def left(orders):
        dense = np.column_stack([np.ones_like(d), d, harmonics(angle - 0.01 * d, orders)])
        return float(np.sum((y - dense @ np.linalg.lstsq(dense, y, rcond=None)[0]) ** 2))

    assert normal.left((3, 7)) == pytest.approx(left((3, 7)), rel=1e-6)
    gains = normal.gains((3, 7), np.array([6, 18]))
    assert gains == pytest.approx([left((3, 7)) - left((3, 7, n)) for n in (6, 18)], rel=1e-4)


def escaped(seed: int):
    """Rows of a motor that escapes four times a turn: forward 42 of 90 deg are left, back 24, and 41 are lost in both."""
    rng = np.random.default_rng(seed)
    angle = np.concatenate([np.sort(rng.uniform(0, 2 * np.pi, 12000))] * 2)
    d = np.repeat([1.0, -1.0], 12000)
    at = np.mod(np.degrees(angle), 90)
    kept = np.where(d > 0, at > 48, ((at > 14) & (at < 19)) | ((at > 46) & (at < 65)))
    angle, d = angle[kept], d[kept]
    a, phase = np.array([0.06, 0.03, 0.02, 0.012]), np.array([0.3, 1.1, -0.7, 2.0])
    truth = Cogging((4, 8, 12, 24), tuple(a * np.cos(phase)), tuple(-a * np.sin(phase)), 0.0105)
    return angle, d, truth, truth.at(angle, d) + 0.1 * d + 0.02 * rng.standard_normal(len(d))


def curve_error(seed: int) -> float:
    """How far the curve of the chosen orders is off, of the peak."""
    angle, d, truth, y = escaped(seed)
    moments = moments_of(angle, y, d, (angle / (np.pi / 6)).astype(int) % 12, 60)
    found = choose_orders(moments, 20, 1.8, 0.0262)
    x, n = moments.fit(found.orders, found.lag)[0], len(found.orders)
    turn = np.linspace(0, 2 * np.pi, 1440, endpoint=False)
    off = Cogging(found.orders, tuple(x[2 : 2 + n]), tuple(x[2 + n :]), 0.0).at(turn) - truth.at(turn)
    return float(np.abs(off).max() / np.abs(truth.at(turn)).max())


def test_orders_are_exchanged_where_arcs_lack(monkeypatch):
    assert np.median([curve_error(seed) for seed in range(5)]) < 0.25
    monkeypatch.setattr(order_choice, "MIXED", 2.0)
    assert np.median([curve_error(seed) for seed in range(5)]) > 0.5  # chosen one after the other


@pytest.mark.parametrize("orders", [(1, 2, 3, 4), (1, 2, 3, 6)])
def test_low_orders_that_are_sure_only_together_are_found(orders):
    for seed in range(4):
        rng = np.random.default_rng(seed)
        a, phase = rng.permutation([0.06, 0.03, 0.02, 0.012]), rng.uniform(0, 2 * np.pi, 4)
        truth = Cogging(orders, tuple(a * np.cos(phase)), tuple(a * np.sin(phase)), 0.01)
        angle, d, _, _ = made(rng)
        y = truth.at(angle, d) + 0.1 * d + 0.02 * rng.standard_normal(len(d))
        moments = moments_of(angle, y - y.mean(), d, (angle / (np.pi / 6)).astype(int) % 12, 60)
        assert set(choose_orders(moments, 20, 1.8, 0.02).orders) == set(orders)


def test_noise_alone_has_no_order():
    rng = np.random.default_rng(3)
    angle, d, _, _ = made(rng)
    y = 0.02 * rng.standard_normal(len(angle))
    assert (
        choose_orders(moments_of(angle, y, d, (angle / (np.pi / 6)).astype(int) % 12, 60), 20, 1.8, 0.02).orders == ()
    )


def test_the_document_s_table_is_the_filter_of_savitzky_and_golay():
    from scipy.signal import savgol_filter

    cells = 3600
    angle = np.tile((np.arange(cells) + 0.5) * 2 * np.pi / cells, 2)
    angle[cells:] = angle[cells:][::-1]
    y = np.random.default_rng(4).standard_normal(2 * cells)
    sweep = sweep_of("s", "A", np.arange(2.0 * cells), angle, y)
    sweep.used[:] = True
    table = seed_table(sweep, np.zeros(len(sweep), bool), 2, np.radians(5.0))
    expected = savgol_filter(y[:cells], 51, 2, mode="wrap")
    assert (
        np.abs(table.values[0] - expected)[100:-100].max() < 1e-9
    )  # the row at which it turns belongs to one direction


def test_a_gap_of_one_direction_is_repaired_from_the_other():
    angle, d, truth, y = made(np.random.default_rng(5), 30000, 0.0)
    sweep = sweep_of("s", "A", np.arange(float(len(angle))), angle, y)
    sweep.used[:] = True
    gone = (d > 0) & (angle > 1.0) & (angle < 1.4)
    table = seed_table(sweep, gone, 2, np.radians(2.0))
    assert table.repaired[0].sum() > 100
    assert not table.lost.any()
    some = np.linspace(1.1, 1.3, 50)
    assert np.abs(table.at(some, 1.0) - truth.at(some, 1.0)).max() < 0.06  # the lag moves order 18 by 0.05


def test_directions_are_led_ones():
    way = np.concatenate([np.linspace(0, 7, 500), np.linspace(7, 0, 500)]) + 0.01 * np.sin(np.arange(1000))
    d, turns = led_directions(way, 0.05)
    assert (d[5:490] == 1).all()
    assert (d[510:] == -1).all()
    assert len(turns) == 1
    assert not led_directions(np.zeros(10), 0.05)[0].any()


def test_an_escape_is_seen_and_a_led_rotor_has_none():
    t = np.arange(6000) / 50
    led = np.radians(3.0) * t
    rotor = led.copy()
    rotor[2000:2100] = np.maximum(rotor[2000:2100], led[2000] + np.radians(5.0))  # it jumps, and waits
    y = np.cos(4 * rotor)
    assert not escaped_rows(sweep_of("s", "A", t, led, np.cos(4 * led))).any()
    out = escaped_rows(sweep_of("s", "A", t, rotor, y))
    assert out[2005:2080].all()
    assert not out[:1950].any()
    assert not out[2300:].any()


def test_orders_have_names():
    assert name_order(72, 18, 24) == "lcm of slots and poles"
    assert name_order(144, 18, 24) == "lcm of slots and poles, 2 times"
    assert "not torque" in name_order(12, 18, 24)
    assert name_order(36, 18, 24) == "slots, 2 times"
    assert name_order(71, 18, 24, (72,)).startswith("sideband of 72")
    assert name_order(55, 18, 24) == "no name"
    assert not_torque(12, 24)
    assert not not_torque(12, None)
    assert guess_motor((72, 18, 12, 24), np.array([1.0, 0.3, 0.2, 0.1])) == (18, 24)
    assert guess_motor((), np.zeros(0)) is None
