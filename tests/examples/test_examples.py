"""Every command of an example's README runs as it stands there, and ends as the README says."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

from robocal.cli.main import main
from robocal.files.kinds.registry import READERS

EXAMPLES = Path(__file__).parents[2] / "examples"
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
# Folder, number of its command, exit status, verdict.
EXPECTED = [
    ("rv-2aj", 0, 0, "improved"),
    ("rv-2aj", 2, 0, "improved"),
    ("rx-90", 0, 0, "improved"),
    ("rx-90", 1, 3, "not_improved"),
    ("small-arm", 0, 3, "not_improved"),
    ("small-arm", 1, 0, "improved"),
    ("hand-eye", 0, 0, "located"),
    ("hand-eye", 1, 0, "located"),
    ("hand-eye", 2, 0, "improved"),
    ("stereo", 0, 0, "located"),
    ("probe-ultrasound", 0, 0, "located"),
    ("arm-with-camera", 0, 3, "refused"),
    ("arm-with-probe", 0, 3, "refused"),
]


def commands(folder):
    text = (EXAMPLES / folder / "README.md").read_text(encoding="utf-8")
    return [line for block in BLOCK.findall(text) for line in block.splitlines() if line.startswith("robocal ")]


@pytest.fixture
def place(tmp_path, monkeypatch):
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(command, capsys):
    """Exit status and the JSON document of a command."""
    status = main([*shlex.split(command)[1:], "--json"])
    return status, json.loads(capsys.readouterr().out)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", READERS)
def test_instruments(place, capsys, kind):
    """One example per kind: the errors fall on configurations that were not used, to what the README says."""
    found, document = run(commands(f"instruments/{kind}")[0], capsys)
    said = re.search(
        r"falls from ([\d.]+) to ([\d.]+) (\w+)\.", (EXAMPLES / "instruments" / kind / "README.md").read_text()
    )
    residuals = document["residuals"]
    assert found == 0 and document["verdict"]["status"] == "improved", document["verdict"]
    assert said[3] == residuals["unit"]
    assert residuals["held_out_before"]["mean"] == pytest.approx(float(said[1]), rel=0.06)
    assert residuals["held_out"]["mean"] == pytest.approx(float(said[2]), rel=0.06)


def test_instrument_data_are_what_the_script_makes():
    namespace = {"__name__": "make", "__file__": str(EXAMPLES / "instruments" / "make.py")}
    exec(compile((EXAMPLES / "instruments" / "make.py").read_text(), "make.py", "exec"), namespace)
    for kind in ("position", "point"):
        for name, text in namespace["texts"](kind).items():
            kept = (EXAMPLES / "instruments" / kind / name).read_text()
            # A contact is solved for: its last digits may differ between machines.
            assert numbers(text) == pytest.approx(numbers(kept), abs=2e-3), (kind, name)


def numbers(text):
    return [float(n) for n in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text)]


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("folder", "number", "status", "verdict"), EXPECTED)
def test_command(place, capsys, folder, number, status, verdict):
    found, document = run(commands(folder)[number], capsys)
    assert document["verdict"]["status"] == verdict, document["verdict"]
    assert found == status


def test_every_command_is_tried():
    """The validation and the UR10 have tests of their own below, cable robots, studies and cameras theirs in files of their own."""
    own = {
        ("arm-eye-in-hand", 0),
        ("arm-eye-in-hand", 1),
        ("arm-fixed-camera", 0),
        ("arm-fixed-camera", 1),
        ("camera", 0),
        ("camera", 1),
        *(("cogging", i) for i in range(7)),
        *(("commissioning", i) for i in range(3)),
        ("rv-2aj", 1),
        ("rv-2aj", 3),
        ("rv-2aj", 4),
        ("ur10-tracker", 0),
        ("ur10-tracker", 1),
    }
    known = {(folder, number) for folder, number, *_ in EXPECTED} | own
    folders = sorted(p.name for p in EXAMPLES.iterdir() if p.is_dir() and not p.name.startswith(("cable-", "studies")))
    for kind in READERS:
        assert len(commands(f"instruments/{kind}")) == 1
    assert sorted(p.name for p in (EXAMPLES / "instruments").iterdir() if p.is_dir()) == sorted(READERS)
    assert {(f, i) for f in folders for i in range(len(commands(f)))} == known


def test_rv_2aj_elsewhere(place, capsys):
    first, second = commands("rv-2aj")[:2]
    assert main(shlex.split(first)[1:]) == 0
    capsys.readouterr()
    status = main(shlex.split(second)[1:])
    text = capsys.readouterr().out
    assert status == 0
    mean = {
        line.split()[0]: float(line.split()[-5]) for line in text.splitlines() if line.startswith(("this", "against"))
    }
    assert mean["this"] < 1.0 < 5.0 < mean["against"]


def test_rv_2aj_at_3600_points(place, capsys):
    """What the README says of the verification points of the paper, by the script that makes them."""
    text = (EXAMPLES / "rv-2aj" / "README.md").read_text()
    script, words = shlex.split(re.search(r"^python (.*)$", text, re.MULTILINE)[1])[:2]
    assert words == "--verification" and Path(script).is_file()
    namespace = {"__name__": "make_data", "__file__": script}
    exec(compile(Path(script).read_text(), "make_data.py", "exec"), namespace)
    for name, rows in namespace["verification"]().items():
        (place / "examples" / "rv-2aj" / name).write_text(rows)
    assert main(shlex.split(commands("rv-2aj")[0])[1:]) == 0
    capsys.readouterr()
    status, document = run(commands("rv-2aj")[3], capsys)
    said = re.findall(r"^\| (?:before|after).*\| ([\d.]+) \(([\d.]+)\)", text, re.MULTILINE)
    assert status == 0 and len(said) == 2
    for part, (mean, most) in zip(("against", "this"), said, strict=True):
        found = document["errors"][part]
        assert found["n"] == 3600
        assert found["mean"] == pytest.approx(float(mean), rel=0.05) and found["max"] == pytest.approx(
            float(most), rel=0.05
        )
    page = (place / "verification" / "validation.html").read_text()
    assert page.count("3600 places") >= 2 and "Before (against)" in page and "After (this robot)" in page


def test_rv_2aj_program(place, capsys):
    first, last = commands("rv-2aj")[0], commands("rv-2aj")[4]
    assert main(shlex.split(first)[1:]) == 0
    capsys.readouterr()
    status, document = run(last, capsys)
    assert status == 0 and document["status"] | {"near singular": 0} == {
        "ok": 6, "orientation relaxed": 0, "near singular": 0, "outside limits": 0, "unreachable": 1
    }  # fmt: skip
    assert document["errors"]["after"]["max"] < 1e-3 < 2.5 < document["errors"]["before"]["mean"] < 4.0


@pytest.fixture
def ur10(place, shared_data):
    csv = shared_data / "ur10-laser-tracker" / "Series_C" / "measurements_random_poses.csv"
    if not csv.is_file():
        pytest.skip(f"the data set's {csv.name} is not here")
    shutil.copyfile(csv, place / "examples" / "ur10-tracker" / csv.name)


def test_ur10(ur10, capsys):
    status, document = run(commands("ur10-tracker")[0], capsys)
    assert status == 0
    held = document["residuals"]["held_out"]
    assert held["n"] == 555 and held["mean"] < 0.46


@pytest.mark.slow
def test_ur10_beyond_geometry(ur10, capsys):
    """What the README promises of the non-geometric groups, on the same 555 poses."""
    status, document = run(commands("ur10-tracker")[1], capsys)
    said = re.search(r"predicted to ([\d.]+) mm", (EXAMPLES / "ur10-tracker" / "README.md").read_text())
    held = document["residuals"]["held_out"]
    assert status == 0 and document["verdict"]["status"] == "improved", document["verdict"]
    assert held["n"] == 555 and held["mean"] == pytest.approx(float(said[1]), rel=0.02)


def test_simulated_data_are_what_the_script_makes():
    namespace = {"__name__": "make_data", "__file__": str(EXAMPLES / "rv-2aj" / "make_data.py")}
    exec(compile((EXAMPLES / "rv-2aj" / "make_data.py").read_text(), "make_data.py", "exec"), namespace)
    for name, text in namespace["tables"]().items():
        kept = (EXAMPLES / "rv-2aj" / name).read_text()
        digits = 6  # the last digits may differ between machines
        assert rounded(text, digits) == rounded(kept, digits), name


def rounded(text, digits):
    """Cells with numbers rounded."""
    head, *rows = text.splitlines()
    return [head, *([r.split(",")[0], *(round(float(c), digits) for c in r.split(",")[1:])] for r in rows)]


def test_readmes_say_what_is_simulated_and_what_is_real():
    assert "simulated" in (EXAMPLES / "rv-2aj" / "README.md").read_text()
    assert "computed" in (EXAMPLES / "rx-90" / "README.md").read_text()
    assert "computed" in (EXAMPLES / "small-arm" / "README.md").read_text()
    for name in ("arm-with-camera", "arm-with-probe"):
        assert "ten real measurements" in " ".join((EXAMPLES / name / "README.md").read_text().split())
