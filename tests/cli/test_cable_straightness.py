"""`cable straightness`: what it says, what loads tell, and what is wrong with files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli.runs import robocal

from robocal.cables.rope import EXPONENT, strain
from robocal.session.cable.load_fits import fit_loads

ROBOT = str(Path(__file__).parents[2] / "examples" / "cable-laval" / "robot.yaml")
SAGS = "tension [N],sag [mm],span [mm]\n4.6,80,4925\n10.4,37,4925\n14.5,26,4925\n18.6,21,4925\n"


def elongations(exponent=1.0, noise=2e-5, count=24, seed=3):
    rng = np.random.default_rng(seed)
    t = np.linspace(5, 130, count)
    y = 1e3 * (2.2 * strain(t, 2.5e-5, exponent, 50.0) - 4e-4 + rng.normal(0, noise, count))
    return "tension [N],elongation [mm],length [mm]\n" + "".join(
        f"{a:.2f},{b:.4f},2200\n" for a, b in zip(t, y, strict=True)
    )


def counting_down(text):
    head, *rows = text.splitlines()
    cells = [row.split(",") for row in rows]
    return "\n".join([head, *(f"{t},{-float(y)},{span}" for t, y, span in cells)]) + "\n"


@pytest.fixture
def put(tmp_path):
    def make(name, text):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return str(tmp_path / name)

    return make


def test_the_table_of_the_thesis():
    ran = robocal("cable", "straightness", ROBOT, "--span", "4925", "--at", "4.6,10.4,14.5,18.6,100", "--json")
    assert ran.status == 0
    level = {c["name"]: c["values"] for c in json.loads(ran.out)["level"]["columns"]}
    np.testing.assert_allclose(level["sag"][:4], [80.44e-3, 35.57e-3, 25.51e-3, 19.89e-3], rtol=1e-2)
    np.testing.assert_allclose(level["excess"][:4], [3.502e-3, 0.685e-3, 0.352e-3, 0.214e-3], rtol=1e-2)
    assert level["stretch"][4] == pytest.approx(12.31e-3, rel=1e-2)


def test_weight_and_both_laws_with_their_intervals(put, tmp_path):
    words = ("--loads", put("sag.csv", SAGS), "--loads", put("longer.csv", elongations()), "-o", str(tmp_path / "out"))
    ran = robocal("cable", "straightness", ROBOT, *words)
    assert ran.status == 0, ran.err
    told = json.loads((tmp_path / "out" / "straightness.json").read_text())
    columns = {c["name"]: c["values"] for c in told["loads"]["columns"]}
    found = {
        (f, n): (low, high)
        for f, n, low, high in zip(*(columns[k] for k in ("fit", "number", "low", "high")), strict=True)
    }
    for key, truth in (
        (("weight", "cable.weight"), 0.122),
        (("constant", "cable.elasticity"), 2.5e-5),
        (("curve", EXPONENT), 1.0),
    ):
        assert found[key][0] < truth < found[key][1], key
    assert all(v is not None for v in columns["left out, rms"])
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Elongation under loads" in page and "Sag under loads" in page and page.count("<svg") == 4
    assert "How a level cable hangs" in page and "stretch, curve" in page
    columns = {c["name"]: c["values"] for c in told["measured"]["columns"]}
    printed = [0.071, 0.014, 0.007, 0.004]  # %, Table 3.2
    np.testing.assert_allclose(columns["of the span"][:4], printed, atol=1e-3)
    assert len((tmp_path / "out" / "straightness.csv").read_text().splitlines()) == 2


def test_a_rope_that_stiffens_takes_the_curve(put):
    linear, bent = (fit_loads([put(f"{p}.csv", elongations(p))], 0.122, 2.5e-5) for p in (1.0, 0.7))
    assert (linear.law.what, bent.law.what) == ("constant", "curve")
    low, high = next(p.interval for p in bent.curve.parameters if p.name == EXPONENT)
    assert low < 0.7 < high < 1
    half = bent.curve.strain_half(np.array([50.0]))
    assert abs(float(bent.law.rope.strain(50.0)) - 2.5e-5 * 50) < half[0] < 0.1 * 2.5e-5 * 50


def test_a_tension_by_hand_and_a_wanted_error():
    ran = robocal("cable", "straightness", ROBOT, "--tension", "20", "--wanted", "0.1mm", "--json")
    told = json.loads(ran.out)
    assert ran.status == 0 and told["needed"]["sag.length"]["value"] < 20
    assert told["needed"]["stretch.length"]["value"] < 20
    lengths = {c["name"]: c["values"] for c in told["errors"]["columns"]}["length"]
    assert lengths[0] < 1e-4 < lengths[1]


WRONG = {
    "no unit": (SAGS.replace(" [N]", ""), "the unit is missing"),
    "a unit of another quantity": (SAGS.replace("[N]", "[mm]"), "a force is needed"),
    "swapped columns": (
        SAGS.replace("sag [mm],span [mm]", "span [mm],sag [mm]"),
        "no cable hangs by more than its span",
    ),
    "a sag in m": (SAGS.replace("sag [mm]", "sag [m]"), "no cable hangs by more than its span"),
    "no span": (SAGS.replace("span", "spam"), "a key is missing"),
    "no load": (SAGS.replace("14.5,", "0,"), "does not tighten"),
    "a hole": (SAGS.replace(",26,", ",nan,"), "not a finite number"),
    "neither": (SAGS.replace("sag", "height"), "these headers say of no load"),
    "an upward sag": (SAGS.replace(",26,", ",-26,"), "a cable hangs down"),
    "text": ("tension", "no rows"),
}


@pytest.mark.parametrize("what", WRONG)
def test_wrong_loads_are_refused_by_name(put, what, tmp_path):
    text, said = WRONG[what]
    ran = robocal("cable", "straightness", ROBOT, "--loads", put("loads.csv", text), "-o", str(tmp_path / "out"))
    assert ran.status == 2 and said in " ".join(ran.err.split()), ran.err
    assert "Traceback" not in ran.err and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--wanted", "1"), "unit"),
        (("--wanted", "-1mm"), "above zero"),
        (("--at", "5,x"), "not tensions"),
        (("--tension", "0"), "a slack cable is not straight"),
        (("--span", "0"), "out of range"),
        (("--poses", "none.csv"), "none.csv"),
        (("--span", "4925", "--at", "0.001"), "no cable hangs by more than its span"),
    ],
)
def test_wrong_options_are_refused_by_name(words, said):
    ran = robocal("cable", "straightness", ROBOT, *words)
    assert ran.status == 2 and said in " ".join(ran.err.split()), ran.err


def test_cables_of_which_nobody_knows_the_weight(put):
    text = Path(ROBOT).read_text(encoding="utf-8")
    bare = "\n".join(line for line in text.splitlines() if not line.strip().startswith(("density", "elasticity")))
    robot = put("bare.yaml", bare)
    ran = robocal("cable", "straightness", robot)
    assert ran.status == 2 and "the weight of the cables is not known" in ran.err
    ran = robocal("cable", "straightness", robot, "--loads", put("sag.csv", SAGS))
    assert ran.status == 2 and "the elasticity of the cables is not known" in ran.err
    assert (
        robocal(
            "cable", "straightness", robot, "--loads", put("sag.csv", SAGS), "--loads", put("l.csv", elongations())
        ).status
        == 0
    )


def test_a_cable_without_weight_is_refused(put):
    text = Path(ROBOT).read_text(encoding="utf-8")
    assert "density: {value: 0.000122" in text
    weightless = put("weightless.yaml", text.replace("density: {value: 0.000122", "density: {value: 0"))
    ran = robocal("cable", "straightness", weightless)
    assert ran.status == 2 and "every cable weighs something" in " ".join(ran.err.split()), ran.err


# obeys: load-not-above
@pytest.mark.parametrize(
    ("name", "wrong", "right"),
    [
        ("sag.csv", SAGS.replace("sag [mm],span [mm]", "sag [m],span [m]"), SAGS),
        ("longer.csv", counting_down(elongations()), elongations()),
    ],
    ids=["mm as m", "counting down"],
)
def test_no_cable_weighs_or_lengthens_less_than_nothing(put, name, wrong, right):
    ran = robocal("cable", "straightness", ROBOT, "--loads", put(name, wrong), "--json")
    assert ran.status == 3 and "load-not-above" in {r["code"] for r in json.loads(ran.out)["remarks"]}, ran.err
    ran = robocal("cable", "straightness", ROBOT, "--loads", put(name, right), "--json")
    assert ran.status == 0 and "load-not-above" not in ran.out


def test_loads_of_one_tension_tell_no_elasticity(put):
    rows = "".join(f"50,{4 + v:.2f},2200\n" for v in (0.01, 0.02, 0.0, 0.03, 0.01))
    ran = robocal(
        "cable", "straightness", ROBOT, "--loads", put("one.csv", f"tension [N],elongation [mm],length [mm]\n{rows}")
    )
    assert ran.status == 2 and "one.csv" in ran.err and "5 of 50 to 50 N" in ran.err


def test_a_cable_too_loose_to_hang_has_no_length():
    ran = robocal("cable", "straightness", ROBOT, "--tension", "1e-6", "--json")
    told = {c["name"]: c["values"] for c in json.loads(ran.out)["errors"]["columns"]}
    assert told["length"][0] is None and told["length"][1] > 0
