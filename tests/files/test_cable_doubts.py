"""What a cable robot's file is told about where it stands: keys of other formats, anchors that nobody uses."""

from __future__ import annotations

import pytest

from robocal.errors import FormatError
from robocal.files.cable.cable_robot import read_cable
from robocal.remarks.code import Code

ANCHORS = "[[-2, 0, 3], [2, 0, 3], [0, 2, 3], [0, -2, 3]]"
PUBLISHED = f"""name: p
length_unit: m
mass_kg: 5
tension_limits_N: [10, 100]
cable: {{diameter_m: 0.004, elongation_per_N: 2.5e-5, weight_N_per_m: 0.1}}
frame_anchors: {ANCHORS}
platform_anchors: [[0.1, 0, 0.1], [0, 0, 0], [0, 0.2, 0], [0, -0.1, 0.3]]
"""


@pytest.mark.parametrize(
    ("old", "new", "row", "key"),
    [
        ("[10, 100]", "[100, 10]", 4, "tension_limits_N"),
        ("mass_kg: 5", "mass_kg: 0", 3, "mass_kg"),
        ("0.004", "-0.004", 5, "cable.diameter_m"),
        ("2.5e-5", "-2.5e-5", 5, "cable.elongation_per_N"),
        ("_m: 0.1", "_m: -0.1", 5, "cable.weight_N_per_m"),
    ],
)
def test_a_published_robot_is_refused_at_its_own_keys(tmp_path, old, new, row, key):
    assert PUBLISHED.count(old) == 1
    path = tmp_path / "robot.yaml"
    path.write_text(PUBLISHED.replace(old, new))
    with pytest.raises(FormatError) as error:
        read_cable(path)
    assert (error.value.row, error.value.key) == (row, key)


def test_anchors_that_no_cable_uses_are_remarked_on(tmp_path):
    path = tmp_path / "robot.yaml"
    text = (
        "robocal: 1\nname: four\nkind: cable\nunits: {length: m}\ndegrees: 2T\n"
        f"frame_anchors: {ANCHORS}\nplatform_anchors: {{hook: [0, 0, 0]}}\n"
        "cables: [{platform: hook}, {platform: hook}, {platform: hook}, {platform: hook}]\n"
    )
    path.write_text(text)
    assert not any(w.code is Code.ANCHORS_UNUSED for w in read_cable(path).warnings)
    path.write_text(text.replace(", {platform: hook}]", "]"))
    assert [w for w in read_cable(path).warnings if w.sentence.endswith("no cable uses frame anchor 4")]
