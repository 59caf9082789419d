"""The truth law through the same functions for machines that have nothing in common: perturb, synthesise, identify, compare
on configurations that were not used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from prove import machines as made

from robocal.files.opened_file import Bare
from robocal.files.result import Provenance
from robocal.fit.options import Options
from robocal.measure.base import synthesise
from robocal.prove.identify import identify
from robocal.session.identify_outcome import IdentifyOutcome, residual_columns, save, to_result
from robocal.session.opened import Opened

MACHINES = {
    "arm": lambda rng: made.arm(rng, 60),
    "eight cables": lambda rng: made.cables("3R3T", rng, 60),
    "two translations": lambda rng: made.cables("2T", rng, 60),
    "three translations": lambda rng: made.cables("3T", rng, 60),
    "one turn, two translations": lambda rng: made.cables("1R2T", rng, 60),
    "turntable": lambda rng: made.turntable(rng, 40),
}
MOSTLY = 0.35  # of the nominal error, noise included


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", MACHINES)
def test_what_is_identified_is_the_truth(name):
    rng = np.random.default_rng(5)
    robot, truth, data = MACHINES[name](rng)
    found = identify(robot, made.recorded(truth, data, rng, forget=robot.freedom is not None))
    assert found.verdict.status == "improved", list(map(str, found.verdict.reasons))
    first = found.stages[0]
    assert first.held_out.mean < MOSTLY * first.held_out_before.mean
    assert first.held_out.profiled == (robot.freedom is not None)
    for p in found.parameters:
        if p.name in robot.table and p.status == "identified":
            assert abs(p.identified - truth.table[p.name].value) < 4.5 * p.sigma, p
    identified = [p for p in found.parameters if p.status == "identified" and p.name in robot.table]
    assert len(identified) > len(robot.table.free) / 2
    # Where nobody measured: the instruments of the same data read the corrected machine as they read the true one.
    again = np.random.default_rng(6)
    _, _, fresh = MACHINES[name](again)
    seen = synthesise(truth, fresh)
    said = synthesise(found.corrected, made.told(fresh, found.table))
    base = robot.with_values({n: found.baseline[n].value for n in robot.table.names})
    nominal = synthesise(base, made.told(fresh, found.baseline))
    for a, b, c in zip(seen.observations, said.observations, nominal.observations, strict=True):
        if np.abs(a.value - c.value).max() > 1e-9:
            assert np.abs(a.value - b.value).mean() < MOSTLY * np.abs(a.value - c.value).mean()


def test_a_camera_before_a_board_is_a_machine_like_any_other():
    rng = np.random.default_rng(2)
    truth, data = made.board(rng, 25)
    off = (12.0, -9.0, 7.0, -5.0, 0.05, -0.04, 0.0, 0.0, 0.0)
    real = made.recorded(truth, data, rng)
    guess = tuple(a + b for a, b in zip(made.CAMERA, off, strict=True))
    seen = real.observations[0]
    known = {**seen.options, "intrinsics": guess}
    found = identify(made.lens(guess), made.replace(real, observations=(made.replace(seen, options=known),)), Options())
    assert found.verdict.status == "improved", list(map(str, found.verdict.reasons))
    by_name = {p.name: p for p in found.parameters}
    for symbol, true in zip(made.LENS, made.CAMERA, strict=False):
        p = by_name[f"lens.{symbol}"]
        assert p.status == "identified" and abs(p.identified - true) < 4 * p.sigma, p
    pixels = next(s for s in found.stages if s.unit == "px")
    assert pixels.held_out.profiled and pixels.held_out.rms < 1.2 * 0.2 * np.sqrt(2) < pixels.held_out_before.rms


@pytest.mark.sampled(1)
@pytest.mark.parametrize("seed", range(3))
def test_encoders_alone_identify_nothing(seed):
    rng = np.random.default_rng(seed)
    robot, truth, data = made.cables("3R3T", rng, 60, encoders_alone=True)
    found = identify(robot, made.recorded(truth, data, rng))
    told = {p.name for p in found.parameters if p.status == "identified"}
    # Where base and platform have their coordinates nothing says.
    assert found.verdict.status != "improved" or told
    assert "place-open" in {r.code for r in found.warnings}
    codes = {r.code for r in found.verdict.reasons}
    assert found.verdict.status == "improved" or "gain-proven" not in codes


@pytest.mark.slow
def test_poses_of_other_rows_are_no_improvement():
    """The lengths explain themselves whatever the poses: what an instrument saw has to beat its own mean."""
    rng = np.random.default_rng(2)
    robot, truth, data = made.cables("3R3T", rng, 60)
    measured = made.recorded(truth, data, rng)
    poses = next(i for i, o in enumerate(measured.observations) if o.kind == "pose")
    value = measured.observations[poses].value.copy()
    value[:, :3] = value[rng.permutation(60), :3]
    wrong = list(measured.observations)
    wrong[poses] = replace(wrong[poses], value=value)
    right, found = identify(robot, measured), identify(robot, replace(measured, observations=tuple(wrong)))
    assert right.verdict.status == "improved" and "place-open" not in {r.code for r in right.warnings}
    assert found.verdict.status == "refused"
    assert found.verdict.reasons[0].code in ("no-better-than-mean", "unexplained")


def test_a_machine_of_somebody_elses_has_a_run_folder(tmp_path):
    rng = np.random.default_rng(5)
    robot, truth, data = made.turntable(rng, 40)
    found = identify(robot, made.recorded(truth, data, rng, forget=False))
    opened = Opened(Bare(robot, convention="turntable"))
    result = to_result(found, opened, Provenance(version=""))
    kept = save(IdentifyOutcome(result, residual_columns(found), found, opened), tmp_path / "run")
    assert {p.name for p in kept.written} >= {"result.json", "residuals.csv", "report.html", "calibrated.yaml"}
    assert result.verdict.status == "improved" and result.robot.convention == "turntable"
    page = (tmp_path / "run" / "report.html").read_text()
    assert "turntable" in page and "axis.gain" in page
    assert "axis.gain: {value: 1.00" in (tmp_path / "run" / "calibrated.yaml").read_text()
