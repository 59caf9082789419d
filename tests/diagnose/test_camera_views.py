"""What is wrong with all views of a camera is named, with the cameras, and is gone when the advice is obeyed."""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import pytest
from view_worlds import LENS, MACHINES, pixels

from robocal.diagnose.camera_views import IMAGE_MIRRORED, wrong_views
from robocal.diagnose.check_registry import Context
from robocal.fit.baseline import Baseline, baseline
from robocal.fit.options import Options
from robocal.prove.identify import identify
from robocal.remarks.remark import Quantity, Remark

FULL = pytest.mark.skipif(not os.environ.get("ROBOCAL_FULL"), reason="ROBOCAL_FULL=1")
M = 30
WIDTH, LAST = 1280, np.array([0.16, 0.12, 0.0])
MISTAKES = {
    "good": lambda o: o,
    "axes-exchanged": lambda o: replace(o, value=o.value[:, ::-1].copy()),
    "image-mirrored": lambda o: replace(o, value=np.column_stack([WIDTH - 1 - o.value[:, 0], o.value[:, 1]])),
    "views-shifted": lambda o: replace(o, configuration=(o.configuration + 1) % M),
    "target-turned": lambda o: turned(o, 11),
}


def turned(obs, count):
    """The points of some views from the other end."""
    bad = np.isin(obs.configuration, np.random.default_rng(5).permutation(M)[:count])
    point = np.array(obs.extra["point"])
    point[bad] = LAST - point[bad]
    return replace(obs, extra={"point": point})


def spoiled(data, some, mistake):
    seen = [mistake(o) if i in some else o for i, o in enumerate(data.observations)]
    return replace(data, observations=tuple(seen))


def found_in(model, data):
    problem, x = baseline(model, data, np.arange(M))
    return [f.remark for f in wrong_views.run(Context(model, data, Baseline(problem, x)))]


# obeys: axes-exchanged
# obeys: image-mirrored
# obeys: views-shifted
# obeys: target-turned
@pytest.mark.parametrize("code", MISTAKES)
@pytest.mark.parametrize(
    "machine",
    ["arm", pytest.param("cable", marks=[pytest.mark.slow, FULL]), pytest.param("rig", marks=pytest.mark.slow)],
)
def test_each_mistake_is_named_for_its_camera(machine, code, rng):
    model, _, data = MACHINES[machine](rng, M)
    own = pixels(data)[1]
    said = found_in(model, spoiled(data, [own], MISTAKES[code]))
    if code == "good":
        assert not said
        return
    (one,) = said
    assert one.code == code and dict(one.items)["instruments"] == ("cam1",)
    # Every mistake undoes itself, but a shift.
    undo = (
        (lambda o: replace(o, configuration=(o.configuration - 1) % M)) if code == "views-shifted" else MISTAKES[code]
    )
    if code == "views-shifted":
        assert "1 view below" in one.sentence and "up by 1 view" in one.advice
    assert not found_in(model, spoiled(spoiled(data, [own], MISTAKES[code]), [own], undo))


@pytest.mark.parametrize("code", [c for c in MISTAKES if c != "good"])
def test_all_cameras_of_an_arm_are_told_together(code, rng):
    model, _, data = MACHINES["arm"](rng, M)
    (one,) = found_in(model, spoiled(data, pixels(data), MISTAKES[code]))
    assert one.code == code and dict(one.items)["instruments"] == ("cam0", "cam1")


def test_a_camera_that_has_its_target_the_other_way_round_is_told_by_the_others(rng):
    model, _, data = MACHINES["arm"](rng, M)
    (one,) = found_in(model, spoiled(data, pixels(data)[1:], lambda o: turned(o, M)))
    numbers = dict(one.items)
    assert (one.code, numbers["count"], numbers["instruments"]) == ("target-turned", M, ("cam1",))


def lens_of(factor, symbols):
    own = tuple(v * (factor if i in symbols else 1) for i, v in enumerate(LENS))
    return lambda o: replace(o, options={**o.options, "intrinsics": own})


# obeys: lens-factor
# obeys: lens-factor-doubted
@pytest.mark.parametrize(
    ("factor", "symbols", "ratio"), [(1.5, (0, 1, 2, 3), "2/3"), (1.1, (0, 1), None), (0.75, (0, 1, 2, 3), "4/3")]
)
def test_a_lens_that_is_a_factor_off_is_named(factor, symbols, ratio, rng):
    model, _, data = MACHINES["arm"](rng, M)
    fast = Options(hold_out=0.0, leave_one_out=False)
    found = identify(model, spoiled(data, pixels(data), lens_of(factor, symbols)), fast)
    (said,) = (r for r in (*found.verdict.reasons, *found.warnings) if r.code.startswith("lens-factor"))
    numbers = dict(said.items)
    assert numbers["factor"] == pytest.approx(1 / factor, rel=0.02) and numbers["ratio"] == ratio
    well = identify(model, data, fast)
    assert not [r for r in (*well.verdict.reasons, *well.warnings) if r.code.startswith("lens-factor")]


@pytest.mark.parametrize(("behind", "said"), [(None, ", and as they are 9 px"), (0.75, "75 % of the views")])
def test_a_mirrored_image_is_told_wherever_the_fit_ended(behind, said):
    """A fit of a small target may end before the camera, with a large error; then no view has it behind."""
    amounts = {"stated": None if behind else Quantity(9.0, "px"), "left": Quantity(0.2, "px")}
    sentence = Remark.of(IMAGE_MIRRORED, instruments=("cam0",), files=("a.csv",), behind=behind, **amounts).sentence
    assert said in sentence and "0.2 px" in sentence
