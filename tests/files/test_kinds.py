"""Every kind of measurement in files: what is written is read back, in any unit, and what is wrong is said."""

from __future__ import annotations

import numpy as np
import pytest
from files.data_samples import write_dataset
from files.kind_samples import ARM, KINDS, put, simulated, texts

from robocal._record import replace
from robocal.errors import FormatError
from robocal.files.dataset import read_dataset
from robocal.files.kinds.corner_covariance import WITH_OTHERS
from robocal.files.kinds.registry import READERS
from robocal.files.units import UNITS, Units
from robocal.measure.base import KINDS as MEASURED
from robocal.measure.base import kind_of, problem
from robocal.measure.data import Frame
from robocal.measure.sights.correlations import COVARIANCES, SQUARE_CORNER


def frames(obs):
    return {f.name: f for f in (*((obs.frame,) if obs.frame else ()), *obs.targets, *kind_of(obs).frames(obs))}


def same(a, b):
    """Two data sets are equal but for rounding; rows may be sorted by place."""
    assert [(o.kind, o.label, len(o)) for o in a.observations] == [(o.kind, o.label, len(o)) for o in b.observations]
    for one, two in zip(a.observations, b.observations, strict=True):
        np.testing.assert_allclose(one.value, two.value, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(one.sigma, two.sigma, rtol=1e-12)
        assert (one.second is None) == (two.second is None)
        for c, d in ((one.configuration, two.configuration), (one.second, two.second)):
            if c is not None:
                joints = a.configurations.joints[c], b.configurations.joints[d]
                np.testing.assert_allclose(*joints, atol=1e-14)
                assert [a.configurations.ids[i] for i in c] == [b.configurations.ids[i] for i in d]
        assert frames(one).keys() == frames(two).keys()
        for name, frame in frames(one).items():
            np.testing.assert_allclose(frame.value, frames(two)[name].value, atol=1e-14)
            assert (frame.free, frame.mount) == (frames(two)[name].free, frames(two)[name].mount)
        for key, column in one.extra.items():
            np.testing.assert_allclose(column, two.extra[key], atol=1e-14)
        plain = {k: v for k, v in one.options.items() if not isinstance(v, Frame) and k != "ends"}
        assert plain == {k: v for k, v in two.options.items() if k in plain}


@pytest.mark.parametrize("units", [Units(), Units(UNITS["m"], UNITS["rad"])], ids=["mm deg", "m rad"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_read_back(tmp_path, kind, units):
    data = simulated(kind)
    write_dataset(data, ARM, tmp_path / "data.yaml", units)
    reading = read_dataset(tmp_path / "data.yaml", ARM)
    same(data, reading.dataset)
    assert reading.warnings == () and reading.suspicions == ()
    assert problem(ARM, reading.dataset).configurations == len(data.configurations)


def test_every_kind_is_known_to_files_but_those_of_machines_without_an_arm():
    assert {k for k, kind in MEASURED.items() if kind.terms.__module__.startswith("robocal.")} - set(READERS) == {
        "lengths",
        "swivel",
        "load",
        "inclination",
        "sag",
        "elongation",
        "winches",
        "joint_torque",
        "plane_points",
        "plane_targets",
        "current",
        "torque",
    }


@pytest.mark.parametrize("kind", ["spherical", "bearing", "displacement", "relative_pose"])
def test_headers_say_enough(tmp_path, kind):
    data = simulated(kind)
    write_dataset(data, ARM, tmp_path / "table.csv")
    (obs,) = read_dataset(tmp_path / "table.csv", ARM).dataset.observations
    assert obs.kind == kind
    np.testing.assert_allclose(obs.value, data.observations[0].value, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(obs.sigma, data.observations[0].sigma, rtol=1e-12)
    assert (obs.second is None) == (data.observations[0].second is None)


def head(kind):
    return f"robocal: 1\nkind: {kind}\nfile: table.csv\njoints: {{columns: [a, b, c], unit: deg}}\n"


def read(folder, described, table):
    return read_dataset(put(folder, described, table), ARM)


# --- two configurations ---------------------------------------------------------------------------------------------


def test_the_other_configuration_by_the_id_of_another_row(tmp_path):
    table = "name,to,a,b,c,d\nfirst,,0,0,0,0\np,first,10,20,30,100\nq,p,20,10,5,120\nfirst,q,0,0,0,130\n"
    data = read(
        tmp_path,
        head("distance") + "distance: {columns: [d], unit: mm}\nsecond: {id: to}\nconfiguration: {id: name}\n",
        table,
    ).dataset
    (obs,) = data.observations
    assert data.configurations.ids == ("first", "p", "q")
    assert obs.configuration.tolist() == [1, 2, 0] and obs.second.tolist() == [0, 1, 2]
    np.testing.assert_allclose(obs.value[:, 0], [0.1, 0.12, 0.13])
    assert obs.rows.tolist() == [3, 4, 5]


def test_the_other_configuration_by_columns(tmp_path):
    table = "a,b,c,a2,b2,c2,T,s,dx,dy,dz\n1,2,3,4,5,6,20,1,1,2,3\n4,5,6,1,2,4,21,-1,3,2,1\n"
    described = head("displacement") + (
        "second: {columns: [a2, b2, c2]}\ndisplacement: {unit: mm}\n"
        "configuration: {temperature: {column: T, unit: degC}, approach.j2: {column: s, unit: '1'}}\n"
    )
    data = read(tmp_path, described, table).dataset
    (obs,) = data.observations
    where = data.configurations
    assert len(where) == 4 and obs.second.tolist() == [2, 3]
    np.testing.assert_allclose(where.joints[2], np.radians([4, 5, 6]))
    # The temperature of a row holds for both of its configurations, the approach was that of the first one.
    np.testing.assert_allclose(where.columns["temperature"], [293.15, 294.15, 293.15, 294.15])
    assert np.isnan(where.columns["approach.j2"][2:]).all() and where.columns["approach.j2"][0] == 1


def test_what_is_recorded_per_joint_and_groups(tmp_path):
    table = "a,b,c,s1,s2,s3,t,x,y,z,where\n1,2,3,1,0,-1,5,1,2,3,left\n4,5,6,-1,1,1,6,3,2,1,right\n"
    described = head("position") + (
        "position: {columns: [x, y, z], unit: mm}\n"
        "configuration: {approach: {columns: [s1, s2, s3]}, torque.j1: {column: t, unit: Nm}, group: where}\n"
    )
    where = read(tmp_path, described.replace("columns: [s1, s2, s3]", "columns: [s1, s2, s3], unit: '1'"), table)
    where = where.dataset.configurations
    assert where.groups == ("left", "right")
    np.testing.assert_allclose(where.columns["approach.j3"], [-1, 1])
    np.testing.assert_allclose(where.columns["torque.j1"], [5, 6])


# --- places ---------------------------------------------------------------------------------------------------------

TOUCH = "a,b,c,s\n1,2,3,left\n4,5,6,right\n2,3,1,left\n"


def test_places_are_named_by_a_column_or_stand_alone(tmp_path):
    one = read(
        tmp_path, head("point") + "place: {name: cone, xyz: [1, 2, 3]}\nunits: {length: mm, angle: deg}\n", TOUCH
    )
    (obs,) = one.dataset.observations
    place = obs.options["place"]
    assert place == Frame("cone", (1e-3, 2e-3, 3e-3, 0, 0, 0), (True,) * 3 + (False,) * 3, "base", (0.1, 0.1))
    assert obs.label == "cone" and obs.sigma is None and obs.value.shape == (3, 3) and not obs.value.any()
    two = read(tmp_path, head("point") + "place: s\ncontact: {unit: mm, sigma: 0.02}\n", TOUCH).dataset.observations
    assert [o.label for o in two] == ["left", "right"] and [o.rows.tolist() for o in two] == [[2, 4], [3]]
    np.testing.assert_allclose(two[0].sigma, 2e-5)


def test_a_known_distance_belongs_to_no_configuration(tmp_path):
    described = head("point") + "place: s\nbetween: {places: [left, right], distance: 50, unit: mm, sigma: 0.01}\n"
    data = read(tmp_path, described, TOUCH).dataset
    known = data.observations[-1]
    assert known.kind == "distance" and known.value.tolist() == [[0.05]] and known.sigma.tolist() == [[1e-5]]
    assert np.isnan(data.configurations.joints[known.configuration]).all()
    assert [e.name for e in known.options["ends"]] == ["left", "right"]


def test_faces_of_a_cube(tmp_path):
    table = "a,b,c,face\n1,2,3,+x\n4,5,6,-z\n2,3,1,y\n"
    described = head("plane") + (
        "cube: {column: face, edge: 100}\nunits: {length: mm, angle: deg}\nradius: {name: ruby, value: 3, unit: mm}\n"
    )
    (obs,) = read(tmp_path, described, table).dataset.observations
    np.testing.assert_array_equal(obs.extra["normal"], [[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    np.testing.assert_allclose(obs.extra["offset"], 0.05)
    assert obs.options["radius"] == "ruby" and obs.options["values"] == {"radius": 0.003} and obs.options["free"] == ()
    assert obs.options["place"].free == (True,) * 6


def test_times_of_flight_of_several_receivers(tmp_path):
    table = "a,b,c,r1 [us],r2 [us]\n1,2,3,1000,2000\n4,5,6,3000,1500\n"
    described = head("range") + "range: {columns: [r1, r2], sigma: 2}\nmedium: {name: air, speed: 340, free: speed}\n"
    one, two = read(tmp_path, described, table).dataset.observations
    assert (one.label, two.label) == ("r1", "r2")
    np.testing.assert_allclose(one.value[:, 0], [0.34, 1.02])
    np.testing.assert_allclose(two.sigma, 2e-6 * 340)
    assert one.options["speed"] == 340 and one.options["free"] == ("speed",) and one.options["medium"] == "air"


def test_a_bar_of_unknown_length_has_no_readings(tmp_path):
    described = head("distance") + (
        "distance: {unit: mm, sigma: 0.005}\nlength: {name: bar, free: true}\n"
        "ends: {cone: {mount: base}, ball: {mount: tool, xyz: [0, 0, 10]}}\nunits: {length: mm, angle: deg}\n"
    )
    (obs,) = read(tmp_path, described, TOUCH).dataset.observations
    cone, ball = obs.options["ends"]
    assert cone.free == (True,) * 3 + (False,) * 3 and ball.value[2] == 0.01 and not any(ball.free)
    assert obs.options["length"] == "bar" and "values" not in obs.options and obs.options["free"] == ("length",)
    assert not obs.value.any() and obs.sigma[0, 0] == pytest.approx(5e-6)
    assert "bar.length" in problem(ARM, read(tmp_path, described, TOUCH).dataset).table.free


def test_the_zero_of_ranges_is_unknown_where_somebody_speaks_of_it(tmp_path):
    table = "a,b,c,r [mm],az [deg],el [deg]\n1,2,3,1000,20,5\n4,5,6,1500,30,6\n"
    described = head("spherical") + "range: {columns: [r], sigma: 0.01}\nbearing: {columns: [az, el], sigma: 0.001}\n"
    (bare,) = read(tmp_path, described, table).dataset.observations
    assert "zero" not in bare.options
    (obs,) = read(
        tmp_path, described + "zero: {name: prism, value: -0.5, unit: mm, free: true}\n", table
    ).dataset.observations
    assert (
        obs.options["zero"] == "prism" and obs.options["values"] == {"zero": -5e-4} and obs.options["free"] == ("zero",)
    )


def test_corners_of_a_marker(tmp_path):
    table = "a,b,c,k,u,v\n1,2,3,0,100,200\n1,2,3,2,300,400\n"
    described = head("pixels") + (
        "pixels: {sigma: 0.2}\ncorners: {column: k, size: 60}\ncamera: {fx: 900, fy: 900, cx: 320, cy: 240, free: true}\n"
        "units: {length: mm, angle: deg}\nframe: {name: eye, mount: tool}\ntargets: {tag: {mount: base, xyz: [1, 2, 3]}}\n"
    )
    (obs,) = read(tmp_path, described, table).dataset.observations
    np.testing.assert_allclose(obs.extra["point"], [[-0.03, 0.03, 0], [0.03, -0.03, 0]])
    assert len(obs.options["free"]) == 9 and obs.frame.mount == "tool" and obs.targets[0].mount == "base"
    np.testing.assert_allclose(obs.sigma, 0.2)


def test_covariances_of_corners_are_written_and_read_back(tmp_path):
    """Those of a marker, of a corner alone, and of rows whose standard deviations have changed, which are independent."""
    rng = np.random.default_rng(3)
    root = rng.normal(size=(3, 8, 8))
    whole = 0.01 * (root @ root.transpose(0, 2, 1) + np.eye(8))
    lines = ["a,b,c,marker,corner,point_x,point_y,point_z,u,v,su,sv,suv," + ",".join(WITH_OTHERS)]
    for view, marker in ((0, 5), (1, 5), (2, 7)):
        for k in range(4):
            mine = whole[view][2 * k : 2 * k + 2]
            own = mine[:, 2 * k : 2 * k + 2]
            others = ["" for _ in WITH_OTHERS] if view == 2 else [f"{x:.12g}" for x in mine.ravel()]
            cells = [
                view,
                2,
                3,
                marker,
                k,
                k,
                2 * k,
                0,
                100 + 30 * k,
                200 - 20 * k,
                own[0, 0] ** 0.5,
                own[1, 1] ** 0.5,
                own[0, 1],
            ]
            lines.append(",".join([*(f"{x:.12g}" for x in cells), *others]))
    described = head("pixels") + (
        "pixels: {columns: [u, v], sigma: {columns: [su, sv]}}\npoints: {columns: [point_x, point_y, point_z], unit: mm}\n"
        "units: {length: mm, angle: deg}\nframe: {name: eye, mount: tool}\n"
        "camera: {name: lens, fx: 900, fy: 900, cx: 320, cy: 240, free: []}\n"
    )
    data = read(tmp_path, described, "\n".join(lines) + "\n").dataset
    (obs,) = data.observations
    other = replace(obs, sigma=obs.sigma * np.where(np.arange(len(obs)) < 2, 1.5, 1.0)[:, None])
    for k, one in enumerate((obs, other)):
        write_dataset(replace(data, observations=(one,)), ARM, tmp_path / f"again{k}.yaml")
        (back,) = read_dataset(tmp_path / f"again{k}.yaml", ARM).dataset.observations
        changed = np.arange(len(one)) < 2 * k
        np.testing.assert_allclose(back.sigma, one.sigma, rtol=1e-9)
        np.testing.assert_allclose(back.extra[COVARIANCES][~changed], one.extra[COVARIANCES][~changed], rtol=1e-9)
        # Which rows are of one square, and which corner each is.
        for before, after in ((one.extra[SQUARE_CORNER], back.extra[SQUARE_CORNER]),):
            assert (after[:, 1] == before[:, 1]).all()
            np.testing.assert_array_equal(
                np.equal.outer(before[:, 0], before[:, 0]), np.equal.outer(after[:, 0], after[:, 0])
            )
        corner = back.extra[SQUARE_CORNER][:, 1].astype(int)
        suv = back.extra[COVARIANCES][np.arange(len(back)), 0, 2 * corner + 1]
        assert (suv[changed] == 0).all() and (suv[~changed] != 0).all()


# --- what is wrong --------------------------------------------------------------------------------------------------

FAULTS = [
    ("point", "place: s\nplaces: {left: {}, rigt: {}}\n", TOUCH, ["row 3", "column s", "'right'", "did you mean 'rigt'"]),
    ("point", "place: t\n", TOUCH, ["column t", "no such column"]),
    ("point", "places: {left: {}, right: {}}\n", TOUCH, ["place", "column"]),
    ("point", "place: s\nbetween: {places: [left, rihgt], distance: 5}\n", TOUCH, ["between.places", "did you mean 'right'"]),
    ("point", "place: s\nbetween: {places: [left], distance: 5}\n", TOUCH, ["between", "two places"]),
    ("point", "place: s\nbetween: {places: [left, right], distance: -5}\n", TOUCH, ["between.distance", "above 0"]),
    ("point", "place: {name: j2}\n", TOUCH, ["place.name", "taken"]),
    ("point", "place: {nme: cone}\n", TOUCH, ["place.nme", "unknown key", "did you mean 'name'"]),
    ("point", "contact: {sigma: 0.1}\n", TOUCH, ["contact.unit", "missing"]),
    ("point", "frame: {name: tracker}\n", TOUCH, ["unknown key", "frame"]),
    ("plane", "cube: {column: s, edge: 100}\n", TOUCH, ["row 2", "column s", "face", "+x"]),
    ("plane", "normal: {columns: [a, b, c]}\n", TOUCH, ["row 2", "unit normal"]),
    ("plane", "cube: {column: s, edge: 1}\noffset: a\n", TOUCH, ["stated twice"]),
    ("sphere", "radius: {name: ruby, unit: mm}\n", TOUCH, ["radius.value", "missing"]),
    ("sphere", "radius: {name: ruby, value: 3, unit: deg}\n", TOUCH, ["radius.unit", "length"]),
    ("range", "range: {columns: [a], unit: kg}\nplace: s\n", TOUCH, ["range.unit", "time or a length"]),
    ("range", "range: {columns: [a]}\nplace: s\n", TOUCH, ["range.unit", "missing"]),
    ("range", "range: {columns: [a, b], unit: us}\nplace: s\n", TOUCH, ["place", "several columns"]),
    ("range", "range: {columns: [a], unit: us}\nmedium: {free: [sped]}\n", TOUCH, ["medium.free", "speed, delay"]),
    ("range", "range: {columns: [a], unit: us}\n", TOUCH.replace("\n1,2", "\n-1,2"), ["row 2", "above 0"]),
    ("bearing", "bearing: {columns: [a, b], unit: mm}\n", TOUCH, ["bearing.unit", "angle"]),
    ("bearing", "bearing: {columns: [a], unit: deg}\n", TOUCH, ["bearing.columns", "2: azimuth, elevation"]),
    ("bearing", "bearing: {columns: [a, b], unit: turn}\n", TOUCH, ["row 2", "zenith"]),
    ("spherical", "range: {columns: [a], unit: mm, sigma: 1}\nbearing: {columns: [b, c], unit: deg}\n", TOUCH, ["bearing.sigma"]),
    ("distance", "distance: {columns: [a], unit: mm}\n", TOUCH, ["ends", "missing"]),
    ("distance", "distance: {columns: [a], unit: mm}\nends: {x: {}}\n", TOUCH, ["ends", "2"]),
    ("distance", "distance: {columns: [a], unit: mm}\nends: {x: {}, y: {}}\n", TOUCH, ["moves with the arm", "mount: tool"]),
    ("distance", "distance: {columns: [a], unit: mm}\nsecond: {id: s}\n", TOUCH, ["configuration.id", "missing"]),
    ("distance", "distance: {columns: [a], unit: mm}\nsecond: {id: s}\nconfiguration: {id: a}\n", TOUCH, ["row 2", "no row has this configuration", "'left'"]),
    ("distance", "distance: {columns: [a], unit: mm}\nsecond: {columns: [a, b]}\n", TOUCH, ["second.columns", "3 for"]),
    ("displacement", "displacement: {columns: [a, b, c], unit: mm}\n", TOUCH, ["second.a", "no such column"]),
    ("relative_pose", "position: {columns: [a, b, c], unit: mm}\n", TOUCH, ["orientation", "missing"]),
    ("pixels", "pixels: {columns: [a, b]}\ncamera: {fx: 1, fy: 1, cx: 0, cy: 0}\n", TOUCH, ["points", "the measured points are not specified"]),
    ("pixels", "pixels: {columns: [a, b]}\ncamera: {fx: 1, fy: 1, cx: 0, cy: 0, free: [fz]}\ncorners: {column: a, size: 1}\n", TOUCH, ["camera.free", "fx"]),
    ("pixels", "pixels: {columns: [a, b]}\ncorners: {column: a, size: 1}\ncamera: {fx: 1, fy: 1, cx: 0, cy: 0}\n", TOUCH, ["row 3", "corner", "0, 1, 2, 3"]),
    ("pixels", "pixels: {columns: [a, b]}\ncorners: {column: a, size: 1}\n", TOUCH, ["camera", "missing"]),
    ("pixels", "pixels: {columns: [a, b]}\ncorners: {column: a, size: 150}\ncamera: {fx: 1, fy: 1, cx: 0, cy: 0}\n", TOUCH.replace("4,", "3,"), ["corners.size", "150 m", "unit"]),
    ("pixels", "pixels: {columns: [a, b]}\ncorners: {column: a, size: 0.00015}\ncamera: {fx: 1, fy: 1, cx: 0, cy: 0}\n", TOUCH.replace("4,", "3,"), ["corners.size", "0.00015 m", "unit"]),
    ("position", "position: {columns: [a, b, c], unit: mm}\nconfiguration: {approach.j2: a}\n", TOUCH, ["column a", "side of approach", "-1, 0 or 1"]),
    ("position", "position: {columns: [a, b, c], unit: mm}\nconfiguration: {approach.j9: a}\n", TOUCH, ["approach.j9", "no joint has this name", "did you mean 'j"]),
    ("position", "position: {columns: [a, b, c], unit: mm}\nconfiguration: {approach: {columns: [a]}}\n", TOUCH, ["configuration.approach", "one per joint"]),
    ("position", "position: {columns: [a, b, c], unit: mm}\nconfiguration: {id: c, group: s}\n", TOUCH.replace("2,3,1", "1,2,3").replace("3,left\n4", "3,up\n4"), ["row 4", "another group"]),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "more", "table", "words"), FAULTS)
def test_what_is_wrong_is_said(tmp_path, kind, more, table, words):
    with pytest.raises(FormatError) as info:
        read(tmp_path, head(kind) + more, table)
    for word in words:
        assert word in str(info.value), str(info.value)


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_of_a_table_is_read(tmp_path, kind):
    """A cell that is no number is found in every column that is used."""
    described, table = texts(kind)
    lines = table.splitlines()
    names = lines[0].split(",")
    texts_ = {"configuration", "second", "place", "target", "group"}
    for i, name in enumerate(names):
        if name in texts_:
            continue
        cells = lines[2].split(",")
        cells[i] = "twelve"
        broken = "\n".join([*lines[:2], ",".join(cells), *lines[3:]]) + "\n"
        with pytest.raises(FormatError) as info:
            read(tmp_path, described, broken)
        assert "row 3" in str(info.value) and name.partition(" [")[0] in str(info.value)
