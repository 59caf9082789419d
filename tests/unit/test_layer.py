"""The residual layer: it reproduces a smooth field within its bars, refuses white noise, and keeps its numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from unit.arm_data import arm, measured, true_arm

from robocal.errors import FormatError
from robocal.files.runfolder import layer_text, read_layer
from robocal.fit.baseline import baseline
from robocal.fit.fit import fit
from robocal.fit.options import Options
from robocal.prove.nongeometric.layer import LayerRows, layer_errors, layer_rows, learn, try_layer
from robocal.remarks.code import Code

NAMES = ("a", "b", "c")


def field(q):
    return 1e-4 * np.stack(
        [np.sin(2 * q[:, 0]) + 0.5 * np.cos(q[:, 1]), np.cos(q[:, 0] - q[:, 1]), 3 * q[:, 2]], axis=1
    )


def test_a_smooth_field_is_reproduced_within_its_bars(rng):
    turning = (True, True, False)

    def sample(m):
        return np.column_stack([rng.uniform(-3, 3, (m, 2)), rng.uniform(0, 0.3, m)])

    q, noise = sample(300), 1e-5
    layer = learn(NAMES, turning, q, field(q) + noise * rng.normal(size=(300, 3)), points=250)
    there = sample(2000)
    left = layer.predict(there) - field(there)
    assert np.std(left) < 0.15 * np.std(field(there))
    inside = np.abs(left + noise * rng.normal(size=left.shape)) < 1.96 * layer.deviation(there)
    assert 0.92 < inside.mean() < 0.98
    # It repeats with the turn, and knows that it knows nothing far along the slide.
    np.testing.assert_allclose(layer.predict(there + [2 * np.pi, -2 * np.pi, 0]), layer.predict(there), atol=1e-12)
    far = there + [0, 0, 100.0]
    np.testing.assert_allclose(layer.predict(far), 0, atol=1e-9)
    assert (layer.deviation(far).min(axis=0) > 4 * np.median(layer.deviation(there), axis=0)).all()


def identified(data):
    everyone = np.arange(len(data.configurations))
    return fit(arm(), data, everyone, Options(), baseline(arm(), data, everyone)[1])


def disturbed(size):
    """Positions of an arm that is off by a smooth field besides its geometry, in the tracker's axes."""
    data = measured(160, truth=true_arm(), sigma=3e-5)
    q = data.configurations.joints
    obs = data.observations[0]
    wave = size * np.stack([np.sin(6 * q[:, 0]), np.cos(5 * q[:, 1] + 1), np.sin(5 * q[:, 0] + 5 * q[:, 1])], axis=1)
    return replace(data, observations=(replace(obs, value=obs.value + wave),))


def test_a_field_switches_it_on_and_is_taken_away():
    data = disturbed(2e-4)
    part = identified(data)
    found = try_layer(arm(), part.data, part.problem, part.solution.x)
    assert found.layer is not None and found.gain[1] > 0 and found.after < 0.6 * found.before
    assert 0.9 < found.coverage < 0.99
    rows = layer_rows(data, part.problem, part.solution.x)
    left = layer_errors(found.layer, rows, data.configurations.joints)
    assert left.mean() < 0.5 * np.linalg.norm(rows.missed, axis=1).mean()


def test_white_noise_refuses_it():
    switched = 0
    for seed in range(3):
        data = measured(100, seed=seed, truth=true_arm(), sigma=1e-4)
        part = identified(data)
        found = try_layer(arm(), part.data, part.problem, part.solution.x)
        assert found.gain is not None
        switched += found.layer is not None
    assert switched == 0


def test_few_configurations_and_other_kinds_are_refused():
    part = identified(measured(30))
    assert try_layer(arm(), part.data, part.problem, part.solution.x).reason.code is Code.GROUP_FEW


def test_its_file_keeps_every_number(tmp_path, rng):
    q = rng.uniform(-1, 1, (60, 3))
    layer = learn(NAMES, (True, True, False), q, field(q))
    place = tmp_path / "layer.json"
    place.write_text(layer_text(layer))
    again = read_layer(place)
    there = rng.uniform(-1, 1, (20, 3))
    np.testing.assert_array_equal(again.predict(there), layer.predict(there))
    np.testing.assert_allclose(again.deviation(there), layer.deviation(there), rtol=1e-12)


@pytest.mark.parametrize("broken", ["", "[]", "{}", '{"robocal": 1, "frame": "tool"}'])
def test_a_broken_file_is_one_error(tmp_path, broken):
    place = tmp_path / "layer.json"
    place.write_text(broken)
    with pytest.raises(FormatError):
        read_layer(place)


@pytest.mark.parametrize(("what", "said"), [("lengths", "lengths"), ("size", "size")])
def test_lengths_and_sizes_are_above_zero_and_outputs_three_or_six(tmp_path, rng, what, said):
    q = rng.uniform(-1, 1, (10, 3))
    layer = learn(NAMES, (True,) * 3, q, field(q))
    place = tmp_path / "layer.json"
    for wrong in (
        replace(layer, **{what: 0 * getattr(layer, what)}),
        replace(layer, size=layer.size[:2], weights=layer.weights[:, :2]),
    ):
        place.write_text(layer_text(wrong))
        with pytest.raises(FormatError, match=said if wrong.size.size == 3 else "3 numbers or 6"):
            read_layer(place)


def test_a_layer_of_positions_serves_poses(rng):
    q = rng.uniform(-1, 1, (40, 3))
    layer = learn(NAMES, (True,) * 3, q, field(q))
    rows = LayerRows(np.hstack([field(q), np.full((40, 3), 0.1)]), np.arange(40))
    alone = LayerRows(field(q), np.arange(40))
    np.testing.assert_array_equal(layer_errors(layer, rows, q), layer_errors(layer, alone, q))


def test_missing_numbers_are_said(tmp_path, rng):
    q = rng.uniform(-1, 1, (10, 3))
    layer = learn(NAMES, (True,) * 3, q, field(q))
    place = tmp_path / "layer.json"
    place.write_text(layer_text(replace(layer, weights=layer.weights[:-1])))
    with pytest.raises(FormatError, match="numbers are missing"):
        read_layer(place)
