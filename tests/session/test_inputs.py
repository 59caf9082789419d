"""What belongs together before anything is fitted: robots by any name, units that are doubted, choices by name."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli.runs import small
from units_of_files import doubt_units

from robocal.diagnose.hypotheses.units import misfit
from robocal.errors import FileError, FormatError, ModelError
from robocal.files.dataset import read_datasets
from robocal.measure.data import DataSet
from robocal.session.inputs import choose, open_arm, read_inputs


def test_open_arm_takes_files_folders_and_names(tmp_path: Path) -> None:
    small(tmp_path)
    assert open_arm(tmp_path / "robot.yaml").name == "three axes"
    assert open_arm("panda").path is None
    with pytest.raises(FileError, match=r"calibrated\.yaml"):
        open_arm(tmp_path)
    (tmp_path / "calibrated.yaml").write_bytes((tmp_path / "truth.yaml").read_bytes())
    assert open_arm(tmp_path).chain.table["j2.d"].value != 0.04
    (tmp_path / "result.json").write_text(json.dumps({"provenance": {"options": None}}), encoding="utf-8")
    with pytest.raises(FormatError, match="not a result"):
        open_arm(tmp_path)


def test_the_misfit_does_not_depend_on_units(tmp_path: Path) -> None:
    small(tmp_path)
    inputs = read_inputs(tmp_path / "robot.yaml", [tmp_path / "data.yaml"])
    found = misfit(inputs.opened.machine, inputs.data)
    obs = inputs.data.observations[0]
    shrunk = DataSet(inputs.data.configurations, (replace(obs, value=obs.value * 1e-3, sigma=None),))
    assert found < 0.02 < 10 * found < misfit(inputs.opened.machine, shrunk)


def test_two_wrong_units_at_once_are_found_together(tmp_path: Path) -> None:
    small(tmp_path)
    text = (tmp_path / "data.csv").read_text(encoding="utf-8")
    (tmp_path / "data.csv").write_text(text.replace("[deg]", "[rad]").replace("[mm]", "[m]"), encoding="utf-8")
    arm = open_arm(tmp_path / "robot.yaml").chain
    reading = read_datasets([tmp_path / "data.yaml"], arm)
    assert len(reading.suspicions) == 2
    with pytest.raises(FormatError, match=r"joints values are probably in deg.*likewise the position values"):
        doubt_units(arm, reading)


def test_frames_of_one_name_must_agree(tmp_path: Path) -> None:
    texts = small(tmp_path)
    two = texts["data.yaml"].replace("free: true", "free: [x, y]").replace("data.csv", "two.csv")
    (tmp_path / "two.yaml").write_text(two, encoding="utf-8")
    (tmp_path / "two.csv").write_text("\n".join(texts["data.csv"].splitlines()[:-1]), encoding="utf-8")
    with pytest.raises(FormatError, match="described differently"):
        read_inputs(tmp_path / "robot.yaml", [tmp_path / "data.yaml", tmp_path / "two.yaml"])


def test_choices_by_name_symbol_owner_and_frame(tmp_path: Path) -> None:
    small(tmp_path)
    inputs = read_inputs(tmp_path / "robot.yaml", [tmp_path / "data.yaml"])
    opened, data = choose(
        inputs.opened, inputs.data, free=["theta, j2.d"], fix=["j1", "tracker"], prior=["length=0.5", "j2.theta=0.1"]
    )
    assert opened.machine.table.free == ("j2.theta", "j2.d", "j3.theta") or set(opened.machine.table.free) == {
        "j2.theta",
        "j2.d",
        "j3.theta",
    }
    assert opened.machine.table["j2.d"].prior == pytest.approx(5e-4)
    assert opened.machine.table["j2.theta"].prior == pytest.approx(np.radians(0.1))
    assert data.observations[0].frame is not None and not any(data.observations[0].frame.free)
    for bad in ({"free": ["thteta"]}, {"fix": ["trackr"]}, {"prior": ["j2.dd=1"]}):
        with pytest.raises(ModelError, match="did you mean"):
            choose(inputs.opened, inputs.data, **bad)
