"""`validate` judges two robots alike: equal robots do not differ, a target that was mounted elsewhere is named, no fit that failed counts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal

from robocal.files.robot import open_robot
from robocal.geometry import se3, so3
from robocal.verbs.validate import result


def measured(folder: Path, name: str, target: tuple[float, float, float], seed: int = 0) -> Path:
    """data.csv of an arm before a tracker, with its target there on the flange."""
    rng, arm = np.random.default_rng(seed), open_robot(name).chain
    low, high = np.clip(arm.limits.T, -1.5, 1.5)
    q = 0.6 * rng.uniform(low, high, (40, len(low)))
    pose = arm.pose(q, {}) @ se3.compose(np.eye(3), np.array(target))
    away = se3.compose(so3.exp(rng.uniform(-1, 1, 3)), rng.uniform(-2, 2, 3))
    seen = 1e3 * ((away @ pose)[:, :3, 3] + 5e-5 * rng.normal(size=(40, 3)))
    head = ",".join([f"j{i + 1} [rad]" for i in range(len(low))] + ["x [mm]", "y [mm]", "z [mm]"])
    np.savetxt(folder / "data.csv", np.column_stack([q, seen]), delimiter=",", header=head, comments="", fmt="%.9g")
    return folder / "data.csv"


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", ["irb-120", "ur10", "panda"])
def test_a_robot_does_not_differ_from_itself(tmp_path: Path, name: str, seed: int) -> None:
    data = measured(tmp_path, name, (0.03, 0.01, 0.15), seed)
    told = robocal("validate", name, data, "--against", name, "--json")
    assert told.status == 0, told.err
    assert told.document["errors"]["this"] == told.document["errors"]["against"]
    assert {told.document["gain"][k] for k in ("mean", "low", "high")} == {0.0}
    assert told.document["profiled"] == told.document["profiled_against"]
    assert "no difference" in robocal("validate", name, data, "--against", name).out


def test_a_target_that_was_mounted_elsewhere_is_named(tmp_path: Path) -> None:
    data = measured(tmp_path, "ur10", (-0.04, 0.025, 0.09))
    for more in ((), ("--against", "ur10")):
        found = robocal("validate", "ur10", data, *more, "--json").document["remarks"]
        (told,) = [r for r in found if r["code"] == "target-remounted"]
        assert [told["numbers"][k]["value"] for k in "xyz"] == pytest.approx([-40, 25, 90], abs=0.3)
    straight = measured(tmp_path, "ur10", (0.0, 0.0, 0.0))
    found = robocal("validate", "ur10", straight, "--against", "ur10", "--json").document["remarks"]
    assert "target-remounted" not in [r["code"] for r in found]


def test_errors_after_a_fit_that_failed_are_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data, honest = measured(tmp_path, "irb-120", (0.0, 0.0, 0.1)), result.model_errors
    monkeypatch.setattr(result, "model_errors", lambda *a, **k: replace(honest(*a, **k), converged=False))
    told = robocal("validate", "irb-120", data, "--against", "irb-120", "--json")
    assert told.status == 3 and any("did not converge" in r for r in told.document["reasons"])
