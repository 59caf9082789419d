"""A model whose run did not prove it is handed on with a word about that."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest
from cli.runs import robocal

EXAMPLE = Path(__file__).parents[2] / "examples" / "instruments" / "position"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("handed") / "run"
    assert robocal("identify", str(EXAMPLE / "robot.yaml"), str(EXAMPLE / "data.yaml"), "-o", str(folder)).status == 0
    return folder


@pytest.mark.parametrize(
    ("status", "said"), [("improved", None), ("not_improved", "was not improved"), ("refused", "was refused")]
)
def test_export_and_predict_tell_the_verdict(run, tmp_path, status, said):
    folder = tmp_path / "run"
    shutil.copytree(run, folder)
    result = json.loads((folder / "result.json").read_text())
    result["verdict"]["status"] = status
    (folder / "result.json").write_text(json.dumps(result))
    exported = robocal("export", str(folder), "--format", "yaml")
    predicted = robocal("predict", str(folder), str(EXAMPLE / "data.csv"), "--json", "-o", str(tmp_path / "rows.csv"))
    drawn, told = (tmp_path / "rows.html").read_text(), json.loads(predicted.out)
    order = re.findall(r"<h([123])", drawn)
    assert order[:2] == ["1", "2"] and order.count("1") == 1, "a heading of the page, then one of a part"
    assert f'max="{len(told["poses"]["columns"][0]["values"]) - 1}"' in drawn and told["written"][1].endswith(
        "rows.html"
    )
    there = robocal("predict", str(folder), str(EXAMPLE / "data.csv"), "-o", str(tmp_path / "rows.csv"))
    assert there.status == 2 and "rows.csv" in there.err, "nothing is replaced without --force"
    assert robocal("predict", str(folder), str(EXAMPLE / "data.csv"), "-o", str(tmp_path / "a.html")).status == 2
    assert exported.status == predicted.status == 0
    for text in (exported.err, predicted.err):
        assert (said in text) if said else "verdict of this run" not in text
    offsets = robocal("export", str(folder), "--format", "offsets")
    assert offsets.status == (2 if status == "refused" else 0)
