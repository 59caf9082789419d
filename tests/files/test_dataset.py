"""Measurements in every way in which people write them, to the same numbers in SI."""

from __future__ import annotations

import numpy as np
import pytest
from files.data_samples import ARM, DATA, DEG, TABLE, put, read, write_dataset

from robocal.errors import FormatError, ModelError
from robocal.files.dataset import read_dataset, read_datasets
from robocal.files.orientation import euler
from robocal.files.units import UNITS, Units
from robocal.geometry import se3, so3
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.remarks.code import Code

Q = np.array([[0, 10 * DEG, 0.1], [30 * DEG, 20 * DEG, 0.05], [60 * DEG, -30 * DEG, 0.0], [80 * DEG, -10 * DEG, 0.02]])
P = np.array([[0.4, 0, 0.7], [0.3, -0.0205, 0.65], [0.2, -0.15, 0.6], [0.1, -0.25, 0.5]])


def check(reading, *, sigma=True):
    c, o = reading.dataset.configurations, reading.dataset.observations[0]
    np.testing.assert_allclose(c.joints, Q, atol=1e-15)
    np.testing.assert_allclose(o.value, P, atol=1e-15)
    if sigma:
        np.testing.assert_allclose(o.sigma, np.tile([1e-5, 2e-5, 3e-5], (4, 1)))
    return c, o


def test_a_data_file_with_its_table(tmp_path):
    reading = read(tmp_path)
    c, o = check(reading)
    assert c.ids == ("p1", "p2", "p3", "p4")
    np.testing.assert_allclose(c.columns["temperature"], [293.15, 293.65, 294.15, 295.15])
    assert o.kind == "position" and o.rows.tolist() == [3, 4, 6, 7] and o.targets == () and o.target is None
    assert o.frame == Frame("tracker", (0.0,) * 6, (True,) * 6, "base", (10.0, 3.0))
    assert reading.warnings == () and reading.suspicions == () and reading.units.length.name == "mm"
    assert [f.file.name for f in reading.files] == ["data.yaml", "table.csv"] and len(reading.files[1].sha256) == 64


def german(text):
    return text.replace(",", ";").replace(".", ",")


@pytest.mark.parametrize(
    ("change", "csv"),
    [
        (lambda t: german(t), '{separator: ";", decimal: ","}'),
        (lambda t: german(t), '{decimal: ","}'),
        (lambda t: t.replace(",", "\t"), "{separator: tab}"),
        (lambda t: t.replace(",", "\t"), "{}"),
        (lambda t: t.replace("\n", "\r\n"), "{}"),
        (lambda t: t.replace("\n", "\r"), "{}"),
        (lambda t: "\ufeff" + t, "{}"),
        (lambda t: t.replace("\n", ",\n"), "{}"),
        (lambda t: t.replace("\n", ",,\n"), "{}"),
        (lambda t: t.replace("p1,0,10", '"p1","0", 10 '), "{}"),
        (lambda t: t.rstrip("\n"), "{}"),
        (lambda t: t.replace("p2", "# a note\np2").replace("p3", " \n,,,,\np3"), "{}"),
    ],
)
def test_any_csv(tmp_path, change, csv):
    check(read(tmp_path, DATA + f"csv: {csv}\n", change(TABLE)))


def test_columns_by_number_without_a_header(tmp_path):
    table = "\n".join(line for line in TABLE.splitlines() if not line.startswith("name"))
    data = """\
robocal: 1
kind: position
file: table.csv
csv: {header: false}
joints: {columns: [1, 2, 3], unit: [deg, deg, mm]}
position: {columns: [4, 5, 6], unit: mm, sigma: {columns: [7, 8, 9]}}
configuration: {id: 0}
"""
    c, o = check(read(tmp_path, data, table))
    assert o.frame.name == "table" and c.ids[0] == "p1"


def test_a_csv_that_describes_itself(tmp_path):
    table = (
        TABLE.replace("x,y,z,sx,sy,sz,T", "x [mm],y [mm],z [mm],sx [mm],sy [mm],sz [um],T")
        .replace("0.03", "30")
        .replace("name", "id")
    )
    put(tmp_path, table=table)
    c, o = check(read_dataset(tmp_path / "table.csv", ARM))
    assert c.ids[0] == "p1" and o.frame.name == "table" and o.kind == "position"


def test_sigma_as_a_number_one_column_or_absent(tmp_path):
    assert read(tmp_path, DATA.replace("{columns: [sx, sy, sz]}", "0.5")).dataset.observations[
        0
    ].sigma == pytest.approx(np.full((4, 3), 5e-4))
    one = read(tmp_path, DATA.replace("[sx, sy, sz]", "[sy]")).dataset.observations[0].sigma
    assert one == pytest.approx(np.full((4, 3), 2e-5))
    assert read(tmp_path, DATA.replace(", sigma: {columns: [sx, sy, sz]}", "")).dataset.observations[0].sigma is None


# --- poses ------------------------------------------------------------------------------------------------------------------

TURN = np.array([[0.1, -0.2, 0.3], [3.1, 0.0, 0.1], [-1.0, 2.0, 0.5], [0.0, 0.0, 0.0]])
R = so3.exp(TURN)
JOINTS = "joints: {columns: [q1, q2, q3], unit: [rad, rad, m]}\n"


def pose_table(names, numbers):
    rows = [",".join(["q1", "q2", "q3", "x", "y", "z", *names])]
    for q, p, n in zip(Q, P, numbers, strict=True):
        rows.append(",".join(repr(float(v)) for v in (*q, *p, *np.ravel(n))))
    return "\n".join(rows)


def quaternions():
    angle = np.linalg.norm(TURN, axis=1)
    axis = TURN / np.where(angle == 0, 1, angle)[:, None]
    return np.column_stack([axis * np.sin(angle / 2)[:, None], np.cos(angle / 2)])


ORIENTATIONS = {
    "matrix": ("columns: [a, b, c, d, e, f, g, h, i], form: matrix", "abcdefghi", R),
    "matrix by prefix": ("columns: T, form: matrix", [f"T_{i}{j}" for i in range(3) for j in range(3)], R),
    "xyzw": ("columns: [a, b, c, d], form: quaternion_xyzw", "abcd", quaternions()),
    "wxyz": ("columns: [a, b, c, d], form: quaternion_wxyz", "abcd", quaternions()[:, [3, 0, 1, 2]]),
    "vector": ("columns: [a, b, c], form: rotation_vector, unit: deg", "abc", TURN / DEG),
}


@pytest.mark.parametrize("name", ORIENTATIONS)
def test_orientation_forms(tmp_path, name):
    words, names, numbers = ORIENTATIONS[name]
    data = f"robocal: 1\nkind: pose\nfile: table.csv\n{JOINTS}position: {{columns: [x, y, z], unit: m}}\norientation: {{{words}}}\n"
    o = read(tmp_path, data, pose_table(list(names), numbers)).dataset.observations[0]
    np.testing.assert_allclose(so3.exp(o.value[:, 3:]), R, atol=1e-12)
    np.testing.assert_allclose(o.value[:, :3], P, atol=1e-15)
    # The same file, for its positions only.
    o = read(tmp_path, data, pose_table(list(names), numbers), kind="position").dataset.observations[0]
    assert o.kind == "position" and o.value.shape == (4, 3)


@pytest.mark.parametrize("frame", ["intrinsic", "extrinsic"])
@pytest.mark.parametrize("order", ["XYZ", "ZYX"])
def test_euler_angles_and_their_sigma(tmp_path, frame, order):
    angles = np.array([[10.0, 20, 30], [-100, 45, 0], [0, 0, 0], [90, -80, 170]])
    data = (
        f"robocal: 1\nkind: pose\nfile: table.csv\n{JOINTS}position: {{columns: [x, y, z], unit: m, sigma: 0.001}}\n"
        f"orientation: {{columns: [a, b, c], form: euler, order: {order}, frame: {frame}, unit: deg, sigma: {{columns: [d, e, f]}}}}\n"
    )
    table = pose_table("abcdef", np.column_stack([angles, np.tile([1.0, 2.0, 3.0], (4, 1))]))
    o = read(tmp_path, data, table).dataset.observations[0]
    expected = euler(angles * DEG, order, intrinsic=frame == "intrinsic")
    np.testing.assert_allclose(so3.exp(o.value[:, 3:]), expected, atol=1e-12)
    # Where all angles are zero every angle turns about its own axis.
    by_axis = [order.index(letter) + 1 for letter in "XYZ"]
    np.testing.assert_allclose(o.sigma[2], [1e-3, 1e-3, 1e-3, *(DEG * np.array(by_axis))])
    assert (o.sigma[:, 3:] > 0).all()


def test_a_pose_in_one_matrix(tmp_path):
    t = se3.compose(R, P * 1000)
    names = [f"cam_{i}{j}" + (" [mm]" if j == 3 else " [1]") for i in range(3) for j in range(4)]
    table = pose_table(names, t[:, :3]).replace("q1,q2,q3,x,y,z", "q1 [rad],q2 [rad],q3 [m],no1,no2,no3")
    put(tmp_path, table=table)
    o = read_dataset(tmp_path / "table.csv", ARM).dataset.observations[0]
    np.testing.assert_allclose(o.value[:, :3], P, atol=1e-12)
    np.testing.assert_allclose(so3.exp(o.value[:, 3:]), R, atol=1e-12)
    data = "robocal: 1\nkind: position\nfile: table.csv\norientation: {columns: cam, form: matrix}\n"
    np.testing.assert_allclose(read(tmp_path, data, table).dataset.observations[0].value, P, atol=1e-12)


# --- frames, targets, configurations --------------------------------------------------------------------------------


def test_frames_and_targets(tmp_path):
    data = DATA.replace(
        "{name: tracker, free: true}", "{name: cam, xyz: [1, 2, 3], rpy: [0, 0, 90], mount: tool, free: [x, rz]}"
    )
    data += "units: {length: cm, angle: deg}\ntarget: ball\n"
    data += "targets: {smr1: {xyz: [0, 0, 10], free: true}, smr2: {}, smr3: {xyz: [1, 0, 0]}}\n"
    table = TABLE.replace("T [degC]", "T [degC],ball")
    for number, row in enumerate(["20", "20.5", "21", "22"]):
        table = table.replace(f"0.03,{row}\n", f"0.03,{row},smr{(2, 1, 3, 2)[number]}\n")
    o = read(tmp_path, data, table).dataset.observations[0]
    assert o.frame.mount == "tool" and o.frame.free == (True, False, False, False, False, True)
    assert o.frame.value == pytest.approx((0.01, 0.02, 0.03, 0, 0, np.pi / 2))
    assert [t.name for t in o.targets] == ["smr1", "smr2", "smr3"] and o.target.tolist() == [1, 0, 2, 1]
    # A position sees no turn of a target; a target whose place is not stated is unknown, one that is stated stays.
    assert o.targets[0].value[2] == pytest.approx(0.1) and o.targets[0].free == (True, True, True, False, False, False)
    assert o.targets[1].free == (True, True, True, False, False, False) and o.targets[2].free == (False,) * 6


def test_targets_of_the_manual_are_in_the_unit_of_the_positions(tmp_path):
    o = read(tmp_path, DATA + "targets: {smr1: {xyz: [0, 0, 0.1], free: true}}\n").dataset.observations[0]
    assert o.targets[0].value[2] == pytest.approx(1e-4) and o.target.tolist() == [0, 0, 0, 0]


def test_rows_with_one_id_are_one_configuration(tmp_path):
    table = TABLE.replace("p2,30,20,50", "p1,0,10,100")
    reading = read(tmp_path, table=table)
    assert len(reading.dataset.configurations) == 3 and reading.dataset.observations[0].configuration.tolist() == [
        0,
        0,
        1,
        2,
    ]
    with pytest.raises(
        FormatError, match=r"table\.csv, row 4: this configuration has other joint values than in row 3; found 'p1'"
    ):
        read(tmp_path, table=TABLE.replace("p2", "p1"))


def test_several_files(tmp_path):
    put(tmp_path)
    (tmp_path / "other.csv").write_text(TABLE.replace("p1", "o1"))
    (tmp_path / "data.yaml").write_text(DATA.replace("table.csv", "[table.csv, other.csv]"))
    both = read_dataset(tmp_path / "data.yaml", ARM)
    assert len(both.dataset.configurations) == 8 and len(both.files) == 3
    assert {o.frame.name for o in both.dataset.observations} == {"tracker"}
    # Instruments that nobody named are kept apart, also when their files have one name.
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        own = TABLE.replace("400,0,700", f"40{len(name) + ord(name)},0,700")
        put(tmp_path / name, DATA.replace("frame: {name: tracker, free: true}\n", ""), own)
    two = read_datasets([tmp_path / "a" / "data.yaml", tmp_path / "b" / "data.yaml"], ARM)
    assert [o.frame.name for o in two.dataset.observations] == ["table", "b_table"]
    with pytest.raises(FormatError, match=r"given twice; found 'as in a/table\.csv'"):
        read_datasets([tmp_path / "a" / "data.yaml", tmp_path / "b" / "data.yaml", tmp_path / "a" / "data.yaml"], ARM)
    with pytest.raises(FormatError, match="no data files"):
        read_datasets([], ARM)


# --- doubts -----------------------------------------------------------------------------------------------------------------


def test_joints_outside_their_limits_are_a_warning(tmp_path):
    warnings = read(tmp_path, table=TABLE.replace("p2,30", "p2,95").replace("p4,80", "p4,-95")).warnings
    (said,) = warnings
    assert said.code is Code.OUTSIDE_LIMITS and "2 rows" in said.sentence
    assert said.numbers["joints"] == ("j1",) and "first row 4" in said.sentence


def test_repeats_that_differ_are_a_warning(tmp_path):
    table = TABLE.replace("p2,30,20,50,300,-20.5,650", "p2,0,10,100,400,0,700.{}")
    assert read(tmp_path, table=table.format("2")).warnings == ()
    warnings = read(tmp_path, table=table.format("5")).warnings
    assert len(warnings) == 1 and "10 sigma" in warnings[0].sentence and "rows 3 and 4" in warnings[0].sentence


def test_degrees_for_radians_is_a_suspicion(tmp_path):
    table = TABLE.replace("q1 [deg],q2 [deg]", "q1 [rad],q2 [rad]")
    reading = read(tmp_path, table=table)
    (doubt,) = reading.suspicions
    assert (doubt.part, doubt.stated, doubt.alternative) == ("joints", "rad", "deg") and "look like deg" in str(
        doubt.remark
    )
    np.testing.assert_allclose(doubt.apply(reading.dataset).configurations.joints, Q, atol=1e-12)


def test_radians_for_degrees_is_a_suspicion(tmp_path):
    table = "q1 [deg],q2 [deg],q3 [mm],x [mm],y [mm],z [mm]\n"
    table += "0,0.1,100,400,0,700\n0.5,0.3,50,300,0,650\n1,-0.5,0,200,1,600\n1.4,-0.2,2,100,1,500"
    put(tmp_path, table=table)
    reading = read_dataset(tmp_path / "table.csv", ARM)
    (doubt,) = reading.suspicions
    assert (doubt.part, doubt.stated, doubt.alternative) == ("joints", "deg", "rad")
    assert doubt.apply(reading.dataset).configurations.joints[3, 0] == pytest.approx(1.4)
    assert doubt.apply(reading.dataset).configurations.joints[3, 2] == pytest.approx(0.002)


@pytest.mark.parametrize(("stated", "alternative", "factor"), [("m", "mm", 1e-3), ("um", "mm", 1e3)])
def test_another_length_unit_is_a_suspicion_of_that_file_only(tmp_path, stated, alternative, factor):
    good = read(tmp_path).dataset
    wrong = read(tmp_path, DATA.replace("unit: mm", f"unit: {stated}"))
    (doubt,) = wrong.suspicions
    assert (doubt.part, doubt.stated, doubt.alternative) == (
        "position",
        stated,
        alternative,
    ) and doubt.factor == pytest.approx(factor)
    np.testing.assert_allclose(doubt.apply(wrong.dataset).observations[0].value, P)
    assert doubt.apply(wrong.dataset).observations[0].sigma[0, 0] == pytest.approx(1e-5)
    from dataclasses import replace

    other = DataSet(good.configurations, (replace(good.observations[0], source="another file"),))
    joined = doubt.apply(other + wrong.dataset)
    np.testing.assert_allclose([o.value for o in joined.observations], [P, P])


# --- written and read back ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["position", "pose"])
@pytest.mark.parametrize("suffix", ["yaml", "csv"])
def test_what_is_written_is_read_back(tmp_path, rng, kind, suffix):
    value = np.hstack([P, TURN])[:, : 6 if kind == "pose" else 3]
    targets = (
        Frame("smr1", (0.0, 0.0, 0.1, 0, 0, 0), (True,) * 3 + (False,) * 3),
        Frame("smr2", free=(True,) * 3 + (False,) * 3),
    )
    frame = Frame("tracker", (1.0, 2.0, 3.0, 0.1, 0.2, 0.3), (True,) * 6)
    obs = Observations(
        kind, np.arange(4), value, rng.uniform(1e-5, 2e-5, value.shape), frame, targets if suffix == "yaml" else (),
        np.array([0, 1, 1, 0]) if suffix == "yaml" else None,
    )  # fmt: skip
    data = DataSet(
        Configurations(("a", "b", "c", "d"), Q, {"temperature": np.array([293.15, 294.0, 295.0, 296.0])}), (obs,)
    )
    for units in (Units(), Units(UNITS["inch"], UNITS["rad"])):
        write_dataset(data, ARM, tmp_path / f"out.{suffix}", units)
        read_back = read_dataset(tmp_path / f"out.{suffix}", ARM).dataset
        o = read_back.observations[0]
        assert o.kind == kind and read_back.configurations.ids == ("a", "b", "c", "d")
        np.testing.assert_allclose(read_back.configurations.joints, Q, atol=1e-14)
        np.testing.assert_allclose(o.value, value, atol=1e-13)
        np.testing.assert_allclose(o.sigma, obs.sigma, rtol=1e-12)
        if suffix == "yaml":
            assert [t.name for t in o.targets] == ["smr1", "smr2"] and o.target.tolist() == [0, 1, 1, 0]
            assert o.frame.value == pytest.approx(frame.value) and o.targets[0].free == targets[0].free


def test_what_a_table_cannot_hold():
    obs = Observations("lengths", np.arange(4), np.zeros((4, 2)))
    with pytest.raises(ModelError, match="lengths"):
        write_dataset(DataSet(Configurations(("a",) * 4, Q), (obs,)), ARM, "never.csv")
    with pytest.raises(ModelError, match="one instrument"):
        write_dataset(DataSet(Configurations(("a",) * 4, Q), (obs, obs)), ARM, "never.csv")
