"""What used to be read otherwise than it was meant, without a word: each is an error or a remark that names it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli.runs import ROBOT
from files.data_samples import DATA, TABLE
from files.data_samples import read as read_small
from files.kind_samples import ARM, put, texts
from files.test_cable import BODIES, caspr
from files.test_cable import ROBOT as CABLES
from units_of_files import doubt_units

from robocal.arms import catalog
from robocal.arms.conventions import chain
from robocal.errors import FormatError, ModelError
from robocal.files.cable.cable_robot import read_cable
from robocal.files.cable.pose_lists import read_platform_poses
from robocal.files.dataset import read_datasets
from robocal.files.robot import describe, open_robot, parse_robot, render_robot
from robocal.files.text import Source
from robocal.measure.data import Frame
from robocal.remarks.code import Code
from robocal.session.inputs import open_machine, read_inputs

EXAMPLES = Path(__file__).parents[2] / "examples"


def robot(text: str):
    return parse_robot(Source(Path("robot.yaml"), text, "0"))


def said(remarks, code: Code) -> list[str]:
    return [f"{r.sentence}. {r.advice}" for r in remarks if r.code == code]


# --- columns ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("sxx,sy,sz", ["row 1", "column sx", "columns of a set are missing", "did you mean 'sxx'"]),
        ("sx,sx,sz", ["row 1", "column sy", "columns of a set are missing", "sx, sx, sz"]),
        ("sx,sy,sy", ["row 1", "column sz", "columns of a set are missing"]),
    ],
)
def test_a_sigma_that_is_not_whole(tmp_path, header, words):
    table = texts("position")[1].replace("sx [mm],sy [mm],sz [mm]", header)
    (tmp_path / "table.csv").write_text(table)
    with pytest.raises(FormatError) as caught:
        read_datasets([tmp_path / "table.csv"], ARM)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_a_header_that_is_read_and_doubled_is_an_error(tmp_path):
    with pytest.raises(
        FormatError, match=r"table\.csv, row 2, column sx: several columns have this name; found 'columns 7, 8"
    ):
        read_small(tmp_path, table=TABLE.replace("sx,sy,sz", "sx,sx,sz"))


def test_columns_that_nobody_reads_are_named_once(tmp_path):
    table = TABLE.replace("T [degC]", "temperatur [degC]")
    made = read_small(tmp_path, DATA.replace(", temperature: T", ""), table)
    assert made.warnings == ()
    both = read_datasets([tmp_path / "data.yaml"], open_small())
    assert said(both.warnings, Code.COLUMNS_UNREAD) == [
        f"{tmp_path / 'table.csv'}: columns that are not read: temperatur; did you mean temperature by temperatur?. "
        "Correct the header, or name the column in the data file, where it is to be read."
    ]
    # What another data file of the same run reads is read.
    other = (
        DATA.replace("temperature: T", "temperature: temperatur")
        .replace("tracker", "second")
        .replace("[x, y, z]", "[x, y, T2]")
    )
    more = table.replace("temperatur [degC]", "temperatur [degC],T2 [mm]")
    more = "\n".join(line + ("" if i < 2 or not line else f",{i}") for i, line in enumerate(more.splitlines())) + "\n"
    (tmp_path / "other.yaml").write_text(other)
    (tmp_path / "table.csv").write_text(more)
    assert not said(
        read_datasets([tmp_path / "data.yaml", tmp_path / "other.yaml"], open_small()).warnings, Code.COLUMNS_UNREAD
    )


def open_small():
    from files.data_samples import ARM as SMALL

    return SMALL


def test_a_force_under_another_name(tmp_path):
    (tmp_path / "robot.yaml").write_text(CABLES)
    cables = read_cable(tmp_path / "robot.yaml").robot
    for header, remark in (("f_z [N]", "f_z; did you mean fz by f_z?"), ("wind [N]", "wind. "), ("lambda", "")):
        (tmp_path / "poses.csv").write_text(
            f"id,x [m],y [m],z [m],rx [deg],ry [deg],rz [deg],{header}\na,0,0,1,0,0,0,5\n"
        )
        made = read_platform_poses(tmp_path / "poses.csv", cables)
        assert made.wrench is None and len(made.warnings) == bool(remark)
        assert all(remark in text for text in said(made.warnings, Code.COLUMNS_UNREAD))
    (tmp_path / "poses.csv").write_text("id,x [m],y [m],z [m],rx [deg],ry [deg],rz [deg],Fz [N]\na,0,0,1,0,0,0,5\n")
    with pytest.raises(FormatError, match="column Fz"):
        read_platform_poses(tmp_path / "poses.csv", cables)


# --- keys -------------------------------------------------------------------------------------------------------------------


def test_a_key_that_all_other_joints_state():
    made = robot(ROBOT.replace("alpha: 20, d: 250,", "alpha: 20,"))
    (text,) = said(made.warnings, Code.KEYS_UNSTATED)
    assert "robot.yaml, row 9: joint j3 does not state d, as all others do: it is taken with d: 0" in text
    both = robot(ROBOT.replace(", limits: [-60, 120]", "").replace("d: 40, ", ""))
    assert [r.numbers["keys"] for r in both.warnings] == [("limits", "d")]


def test_tables_with_their_zeros_left_out_are_no_remark():
    sparse = ROBOT.replace("alpha: 0, d: 0, theta: 0, ", "").replace(", r: 0,", ",").replace("theta: 0, ", "")
    assert "d: 40" in sparse and robot(sparse).warnings == ()


@pytest.mark.parametrize("place", sorted(EXAMPLES.glob("**/robot*.yaml")), ids=lambda p: "/".join(p.parts[-2:]))
def test_examples_are_not_noisy(place):
    assert not said(open_machine(place).warnings, Code.KEYS_UNSTATED)
    data = place.with_name("data.yaml")
    if place.name == "robot.yaml" and data.exists() and "ur10" not in str(place):
        reading = read_datasets([data], open_machine(place).machine)
        assert not said(reading.warnings, Code.COLUMNS_UNREAD) and not said(reading.warnings, Code.PLACES_UNTOUCHED)


def test_what_we_write_ourselves_is_not_noisy():
    """Zeros that a calibration leaves zero are stated where it gives all other rows another value."""
    for name in catalog.names():
        arm = open_robot(name)
        changed = {
            n: arm.chain.table[n].value + 1e-3
            for n in arm.chain.geometric
            if not n.startswith(arm.chain.joint_names[1])
        }
        again = robot(render_robot(arm, changed)[0])
        assert not said(again.warnings, Code.KEYS_UNSTATED), name
        assert not said(robot(describe(arm.chain)).warnings, Code.KEYS_UNSTATED)
    short = robot(
        "robocal: 1\nname: a\nunits: {length: m, angle: rad}\nconvention: dh\njoints: [{a: 1}, {a: 2}, {a: 0.5}, {a: 3}]\n"
    )
    text = render_robot(short, {"j1.d": 0.1, "j3.d": 0.2, "j4.d": 0.1})[0]
    assert "{a: 2, d: 0}" in text and robot(text).warnings == ()


def test_a_gain_of_zero_and_keys_that_mean_nothing():
    with pytest.raises(FormatError, match=r"row 9, key j3\.gain: a joint with this gain never moves"):
        robot(ROBOT.replace("theta: 0, r: 30,", "theta: 0, r: 30, gain: 0,"))
    with pytest.raises(ModelError, match=r"j2\.gain: this key means nothing in a row of type fixed"):
        chain("a", "dh", [{"a": 1.0}, {"type": "fixed", "gain": 2.0}])
    row = {"axis": [0, 0, 1], "point": [0, 0, 0]}
    with pytest.raises(ModelError, match=r"j2\.shift_u: this key means nothing in a row of type prismatic"):
        chain("a", "zero-reference", [row, {**row, "type": "prismatic", "shift_u": 0.1}])
    assert chain("a", "dh", [{"a": 1.0}, {"type": "fixed", "gain": 1.0}]).joint_names == ("j1",)


# --- CASPR ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "bodies", "words"),
    [
        (("<link>1<", "<link>1.5<"), BODIES, ["row 5", "links [0, 1.5]"]),
        (("<link>1<", "<link>1_0<"), BODIES, ["<link>", "1_0"]),
        (("<link>1<", "<link>1<b>0</b><"), BODIES, ["<link>", "text between elements", "'1'"]),
        (("<properties>", "<properties>10"), BODIES, ["<properties>", "text between elements", "'10'"]),
        (("<force_min>0.5<", "<force_min>&low;0.5<"), BODIES, ["an entity is not accepted", "&low;"]),
        (('reference="joint"', 'reference="joint&x;"'), BODIES, ["entity"]),
        (
            ("", ""),
            BODIES.replace("<mass>2.5</mass>", "<mass>2.5</mass><mass>3</mass>"),
            ["more than one <mass>", "row 3"],
        ),
        (
            ("", ""),
            BODIES.replace("<mass>", "<mas>").replace("</mass>", "</mas>"),
            ["has no <mass>", "did you mean 'mas'"],
        ),
        (("", ""), BODIES.replace("<num>0<", "<num>3<"), ["hangs on the base", "'3'"]),
    ],
)
def test_caspr_that_would_be_read_otherwise(tmp_path, change, bodies, words):
    place = caspr(tmp_path, bodies=bodies, change=change)
    if "&" in change[1]:
        # A parser leaves entities out without a word where their declarations stand in another file.
        place.write_text(place.read_text().replace("<!DOCTYPE cables [", '<!DOCTYPE cables SYSTEM "cables.dtd" ['))
    with pytest.raises(FormatError) as caught:
        read_cable(place)
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_elements_of_caspr_that_nobody_reads(tmp_path):
    place = caspr(tmp_path)
    place.write_text(
        place.read_text().replace("<properties>", "<properties><diametre>0.004</diametre><friction>1</friction>")
    )
    (text,) = said(read_cable(place).warnings, Code.ELEMENTS_UNREAD)
    assert "<diametre>, <friction>; did you mean diameter by <diametre>?" in text


# --- one name, one thing ----------------------------------------------------------------------------------------------------


def halves(folder: Path, kind: str, change=lambda text: text) -> list[Path]:
    """The rows of a kind in two files, the second described in other words."""
    described, table = texts(kind)
    head, *lines = table.splitlines()
    out = []
    for name, rows, text in (("one", lines[::2], described), ("two", lines[1::2], change(described))):
        (folder / f"{name}.csv").write_text("\n".join([head, *rows]) + "\n")
        (folder / f"{name}.yaml").write_text(text.replace("table.csv", f"{name}.csv"))
        out.append(folder / f"{name}.yaml")
    return out


def undescribed(text: str) -> str:
    """A data file that names its places, and says nothing of them."""
    lines = text.splitlines()
    starts = [i for i, line in enumerate(lines) if line in ("places:", "between:")]
    kept = [
        line
        for i, line in enumerate(lines)
        if i not in starts and not (line.startswith("  ") and any(i > s for s in starts))
    ]
    return "\n".join(kept) + "\n"


def test_places_of_two_files_are_one_thing(tmp_path):
    made = read_datasets(halves(tmp_path, "point", undescribed), ARM).dataset
    places: dict[str, set[tuple[float, ...]]] = {}
    for obs in made.observations:
        ends = obs.options.get("ends", (obs.options.get("place"),))
        for frame in ends:
            assert isinstance(frame, Frame)
            places.setdefault(frame.name, set()).add((*frame.value, *frame.free))
    assert set(places) == {"a", "b"} and all(len(v) == 1 and any(next(iter(v))[:3]) for v in places.values())


def test_a_known_distance_is_said_once_however_many_files_say_it(tmp_path):
    made = read_datasets(halves(tmp_path, "point"), ARM).dataset
    assert sum(o.kind == "distance" for o in made.observations) == 1
    joints = made.configurations.joints
    assert joints is not None and np.isnan(joints).all(axis=1).sum() == 1


def test_a_ball_of_two_files_is_one_thing(tmp_path):
    def named(text: str) -> str:
        return undescribed(text).replace(
            "radius: {name: ruby, value: 15, unit: mm, free: false}", "radius: {name: ruby}"
        )

    made = read_datasets(halves(tmp_path, "sphere", named), ARM).dataset
    balls = {
        (o.options["radius"], str(o.options["values"]), o.options["free"])
        for o in made.observations
        if "radius" in o.options
    }
    assert balls == {("ruby", "{'radius': 0.015}", ())}


def test_files_that_contradict_each_other_are_refused(tmp_path):
    (tmp_path / "robot.yaml").write_text(ROBOT)
    files = halves(tmp_path, "point", lambda text: text.replace("a: {xyz: [", "a: {xyz: [1"))
    with pytest.raises(FormatError, match="described differently in another file"):
        read_inputs(tmp_path / "robot.yaml", files)


# --- the unit is blamed only where it explains ------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["position", "pose", "spherical", "bearing", "range"])
def test_equal_readings_are_said_as_what_they_are(kind, tmp_path):
    described, table = texts(kind)
    head, *lines = (line.split(",") for line in table.splitlines())
    measured = [i for i, name in enumerate(head) if i > 3 and name != "place"]
    equal = [[lines[0][i] if i in measured else cell for i, cell in enumerate(line)] for line in lines]
    put(tmp_path, described, "\n".join(map(",".join, [head, *equal])) + "\n")
    (tmp_path / "robot.yaml").write_text(ROBOT)
    with pytest.raises(FormatError, match="all readings are equal, though the joints move"):
        read_inputs(tmp_path / "robot.yaml", [tmp_path / "data.yaml"])


def test_a_place_that_nobody_touches_is_said_as_what_it_is(tmp_path):
    described, table = texts("point")
    lines = [line for line in table.splitlines() if ",b," not in line]
    put(tmp_path, described, "\n".join(lines) + "\n")
    (tmp_path / "robot.yaml").write_text(ROBOT)
    made = read_inputs(tmp_path / "robot.yaml", [tmp_path / "data.yaml"])
    assert "never measured: b" in said(made.warnings, Code.PLACES_UNTOUCHED)[0]
    assert not said(made.warnings, Code.OTHER_UNIT) and all(o.kind == "point" for o in made.data.observations)
    # Where it stands is known, so the distance to it tells where the other is.
    fixed = described.replace("575], free: [x, y, z]", "575], free: false")
    assert fixed != described
    (tmp_path / "data.yaml").write_text(fixed)
    assert any(o.kind == "distance" for o in read_datasets([tmp_path / "data.yaml"], ARM).dataset.observations)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", ["position", "point", "distance", "pixels"])
@pytest.mark.parametrize("key", ["alpha: -90, ", "alpha: 20, ", "d: 250, ", "d: 40, "])
def test_a_forgotten_key_is_said_and_no_unit_is_blamed(kind, key, tmp_path):
    put(tmp_path, *texts(kind))
    (tmp_path / "robot.yaml").write_text(ROBOT.replace(key, ""))
    made = read_inputs(tmp_path / "robot.yaml", [tmp_path / "data.yaml"])
    assert key.partition(":")[0] in said(made.warnings, Code.KEYS_UNSTATED)[0] and not said(
        made.warnings, Code.OTHER_UNIT
    )


def test_a_unit_is_named_where_it_explains(tmp_path):
    described, table = texts("position")
    put(tmp_path, described, table.replace("[mm]", "[m]"))
    (tmp_path / "robot.yaml").write_text(ROBOT)
    with pytest.raises(FormatError, match="probably in mm"):
        read_inputs(tmp_path / "robot.yaml", [tmp_path / "data.yaml"])
    # Where a forgotten key may explain too, it is a remark beside that of the key.
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("d: 40, ", ""))
    made = read_inputs(tmp_path / "robot.yaml", [tmp_path / "data.yaml"])
    assert said(made.warnings, Code.OTHER_UNIT) and said(made.warnings, Code.KEYS_UNSTATED)


def test_a_unit_that_leaves_most_of_the_misfit_explains_nothing(tmp_path, monkeypatch):
    from robocal.diagnose.hypotheses import units
    from robocal.files.units import UNITS

    put(tmp_path, *texts("position"))
    reading = read_datasets([tmp_path / "data.yaml"], ARM)
    assert reading.alternatives and UNITS
    left = {True: 4.0, False: 0.3}
    monkeypatch.setattr(units, "misfit", lambda chain, data: left[data is reading.dataset])
    assert doubt_units(ARM, replace(reading, suspicions=())) == ()
    left[False] = 0.04
    with pytest.raises(FormatError, match="probably in"):
        doubt_units(ARM, replace(reading, suspicions=()))
