"""What every kind reads, against its formula written once more; several kinds in one identification."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measure.rigs import BALL, PLATES, at_the_place, recorded, stated, touching
from measure.scenarios import arm, observations, platform
from unit.arm_data import arm as five
from unit.arm_data import true_arm

from robocal.estimate.terms import Residuals
from robocal.fit.misfit import errors
from robocal.fit.options import Options
from robocal.geometry import se3, so3
from robocal.measure.base import kind_of, problem, synthesise
from robocal.measure.bearing import angles, wrap
from robocal.measure.data import Configurations, DataSet, Frame, Observations
from robocal.measure.swivel import across
from robocal.prove.identify import identify

M = 6
EYE = Frame("eye", (1.0, 2.0, 0.3, 0.2, -0.4, 1.1))
PLACE = Frame("place", (0.3, -0.2, 0.6, 0.2, 0.5, -0.3))
SPOT = Frame("spot", (0.1, 0.9, 0.2, 0.0, 0.0, 0.0))
SEEN = se3.from_vector(EYE.value)
SECOND = np.array([3, 5, 1, 0, 2, 4])


@pytest.fixture
def where(rng):
    return Configurations(tuple("abcdef"), rng.uniform(-0.8, 0.8, (M, len(arm().joints))))


def read(where, kind, frame=None, targets=(BALL,), second=False, extra=None, **options):
    obs = observations(kind, M, 1e-3, frame, targets, options=options, extra=extra or {})
    obs = replace(obs, second=SECOND if second else None)
    return synthesise(arm(), DataSet(where, (obs,))).observations[0].value


def balls(where):
    return arm().pose(where.joints) @ se3.from_vector(BALL.value)


def places(where):
    return balls(where)[:, :3, 3]


def test_displacement_reads_the_difference_in_the_instruments_axes(where):
    p = places(where)
    np.testing.assert_allclose(read(where, "displacement", EYE, second=True), (p[SECOND] - p) @ SEEN[:3, :3].T)
    np.testing.assert_allclose(read(where, "displacement", second=True), p[SECOND] - p, atol=1e-15)


def test_relative_pose_reads_the_second_in_the_first(where):
    t = balls(where)
    expected = se3.to_vector(np.linalg.inv(t) @ t[SECOND])
    np.testing.assert_allclose(read(where, "relative_pose", second=True), expected, atol=1e-12)


def test_distances(where):
    p = places(where)
    np.testing.assert_allclose(
        read(where, "distance", second=True)[:, 0], np.linalg.norm(p[SECOND] - p, axis=1), atol=1e-14
    )
    ends = (SPOT, BALL)
    far = np.linalg.norm(p - SPOT.value[:3], axis=1)
    np.testing.assert_allclose(read(where, "distance", None, (), ends=ends)[:, 0], far, atol=1e-14)
    bar = {"ends": ends, "length": "bar", "values": {"length": 0.3}}
    np.testing.assert_allclose(read(where, "distance", None, (), **bar)[:, 0], far - 0.3, atol=1e-14)


def test_places_that_are_touched(where):
    p, t = places(where), se3.from_vector(PLACE.value)
    np.testing.assert_allclose(read(where, "point", place=PLACE), p - t[:3, 3], atol=1e-14)
    ball = {"radius": "ball2", "values": {"radius": 0.02}}
    far = np.linalg.norm(p - t[:3, 3], axis=1)
    np.testing.assert_allclose(read(where, "sphere", place=PLACE, **ball)[:, 0], far - 0.02, atol=1e-14)
    own = (p - t[:3, 3]) @ t[:3, :3]
    np.testing.assert_allclose(read(where, "plane", place=PLACE, **ball)[:, 0], own[:, 2] - 0.02, atol=1e-14)
    n = np.resize([[0.0, 2, 0], [-1, 0, 0]], (M, 3))
    more = {"normal": n, "offset": np.full(M, 0.1)}
    expected = np.where(n[:, 1] > 0, own[:, 1], -own[:, 0]) - 0.1
    np.testing.assert_allclose(read(where, "plane", place=PLACE, extra=more)[:, 0], expected, atol=1e-14)


def test_angles_and_ranges(where):
    x, y, z = ((places(where) @ SEEN[:3, :3].T) + SEEN[:3, 3]).T
    expected = np.stack([np.arctan2(y, x), np.arcsin(z / np.sqrt(x * x + y * y + z * z))], axis=1)
    np.testing.assert_allclose(read(where, "bearing", EYE), expected, atol=1e-14)
    far = np.sqrt(x * x + y * y + z * z)[:, None]
    np.testing.assert_allclose(read(where, "spherical", EYE), np.hstack([far, expected]), atol=1e-14)


def test_a_slower_sound_seems_farther(where):
    air = {"place": PLACE, "medium": "air", "speed": 343.0, "values": {"speed": 340.0, "delay": 0.01}}
    far = np.linalg.norm(places(where) - PLACE.value[:3], axis=1)
    # What the clock says, times the speed that the instrument believes in.
    np.testing.assert_allclose(read(where, "range", **air)[:, 0], far / 340.0 * 343.0 + 0.01, atol=1e-14)
    np.testing.assert_allclose(read(where, "range", place=PLACE)[:, 0], far, atol=1e-14)


def test_inclinations_are_those_of_the_sensors_axes(where):
    """By how much its x and its y rise above the horizon, whose plumb is the z axis of the frame."""
    turn = SEEN[:3, :3] @ balls(where)[:, :3, :3]
    expected = np.arcsin(turn[:, 2, :2])
    np.testing.assert_allclose(read(where, "inclination", EYE), expected, atol=1e-14)
    np.testing.assert_allclose(read(where, "inclination"), np.arcsin(balls(where)[:, 2, :2]), atol=1e-14)


def test_pulleys_swivel_towards_their_cables():
    """From the base's x about the pulley's axis; each encoder counts from a zero of its own."""
    machine = platform()
    start = np.array([[0.3, -0.2, 1.0, 0.1, 0.2, -0.3], [-0.4, 0.1, 1.2, 0.0, -0.2, 0.5]])
    options = {"cables": machine.cables, "values": {"swivel": 0.3}, "free": ()}
    row, cable = np.repeat([0, 1], 4), np.tile(np.arange(4), 2)
    obs = Observations("swivel", row, np.zeros((8, 1)), extra={"cable": cable}, options=options)
    found = synthesise(machine, DataSet(Configurations(("a", "b"), start=start), (obs,))).observations[0].value[:, 0]
    t = se3.from_vector(start)
    d = t[row, :3, 3] + np.einsum("kij,kj->ki", t[row, :3, :3], machine.b[cable]) - machine.a[cable]
    np.testing.assert_allclose(found, wrap(np.arctan2(d[:, 1], d[:, 0]) - 0.3), atol=1e-14)
    one, two = across(np.array([[1.0, 0, 0], [0, 0, 2.0], [0, 1.0, 1.0]]))
    np.testing.assert_allclose(one, [[0, 1, 0], [1, 0, 0], [1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(two, [[0, 0, 1], [0, 1, 0], np.cross([0, 1, 1], [1, 0, 0]) / np.sqrt(2)], atol=1e-15)


def test_an_angle_next_to_the_seam_is_not_a_turn_off(where):
    """Azimuths at +180 and -180 degrees are neighbours."""
    seam = replace(EYE, value=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    obs = observations("bearing", M, 1e-3, seam, (BALL,))
    data = synthesise(arm(), DataSet(where, (obs,)))
    value = data.observations[0].value
    # Turned so that the first target is seen at the seam, and read from its other side.
    turned = replace(seam, value=(0.0, 0.0, 0.0, 0.0, 0.0, float(np.pi - value[0, 0] - 1e-4)))
    seen = synthesise(arm(), DataSet(where, (replace(obs, frame=turned),))).observations[0]
    assert seen.value[0, 0] == pytest.approx(np.pi - 1e-4)
    off = replace(seen, value=seen.value + [2e-4, 0.0] - 2 * np.pi * (np.arange(2) == 0))
    p = problem(arm(), DataSet(where, (off,)))
    np.testing.assert_allclose(p.residuals(p.start)[0].value, np.tile([-2e-4, 0.0], (M, 1)), atol=1e-12)
    np.testing.assert_allclose(wrap(np.array([np.pi, -np.pi, 3.0])), [-np.pi, -np.pi, 3.0])


def test_noise_of_every_kind_has_the_stated_size(where, rng):
    """Of a relative pose it turns about the axes of the first."""
    many = replace(observations("relative_pose", M, 1e-3), value=np.tile([0.1, 0.2, 0.3, 2.0, 1.0, -0.5], (M, 1)))
    noise = rng.normal(scale=1e-3, size=(M, 6))
    out = kind_of(many).disturb(many.value, noise)
    np.testing.assert_allclose(so3.exp(out[:, 3:]), so3.exp(noise[:, 3:]) @ so3.exp(many.value[:, 3:]), atol=1e-14)
    for kind in ("bearing", "spherical", "plane", "range", "displacement"):
        value = np.zeros((4000, kind_of(observations(kind, 1, 1.0)).size))
        spread = rng.normal(scale=2e-4, size=value.shape)
        np.testing.assert_array_equal(kind_of(observations(kind, 1, 1.0)).disturb(value, spread), spread)


def mixed(rng):
    """A tracker, two theodolites, receivers, plates and two sockets on one five-joint arm, a part of its poses each."""
    truth = true_arm(names=[n for n in five().geometric if n in five().table.free])
    parts = [recorded(k, truth, rng, m, contact=m) for k, m in (("position", 30), ("bearing", 30), ("range", 30))]
    plates = touching(
        "plane",
        3,
        lambda r, i, k: (r.uniform(-0.05, 0.05, (k, 3)) * (1, 1, 0), np.tile([0.0, 0, 1], (k, 1, 1))),
        axes=PLATES,
    )
    sockets = touching("point", 2, at_the_place)
    parts += [plates(truth, rng, 60, 60), sockets(truth, rng, 30, 30)]
    # Every part has its own names.
    renamed = [rename(p, f"k{i}") for i, p in enumerate(parts)]
    data = renamed[0]
    for p in renamed[1:]:
        data = data + p
    return data


def rename(data, prefix):
    def new(f):
        return f if f is None or f.mount == "tool" else replace(f, name=prefix + f.name)

    out = []
    for o in data.observations:
        options = {**o.options, **({"place": new(o.options["place"])} if "place" in o.options else {})}
        out.append(replace(o, frame=new(o.frame), options=options, group=prefix + o.label))
    ids = tuple(prefix + i for i in data.configurations.ids)
    return DataSet(replace(data.configurations, ids=ids), tuple(out))


@pytest.fixture(scope="module")
def together():
    rng = np.random.default_rng(4)
    return stated(mixed(rng), rng, error=1e-3)


@pytest.mark.slow
def test_several_kinds_in_one_identification(together):
    """Each with its own frame and sigma, from a table of zeros; chi2 is told for each and is what it should be."""
    found = identify(five(), together, Options(leave_one_out=False))
    assert found.verdict.status == "improved"
    assert {g.kind for g in found.groups} == {"position", "bearing", "range", "plane", "point"}
    assert sum(g.dof for g in found.groups) == pytest.approx(
        sum(g.n for g in found.groups) - len(found.correlation_names)
    )
    for g in found.groups:
        assert g.sigma_source == "stated" and abs(g.chi2 / g.dof - 1) < 5 * np.sqrt(2 / g.dof), g.name


@pytest.mark.slow
def test_a_wrong_sensor_model_shows_in_its_own_chi2(together):
    """One receiver whose clock runs fast, which the shared speed of sound cannot say: its chi2 tells, the others stay."""
    wrong = tuple(replace(o, value=o.value * 1.002) if o.label == "k2ear1" else o for o in together.observations)
    found = identify(five(), DataSet(together.configurations, wrong), Options(leave_one_out=False))
    ratio = {g.name: g.chi2 / g.dof for g in found.groups}
    assert max(ratio, key=ratio.get) == "k2ear1" and ratio["k2ear1"] > 3
    assert {g.name for g in found.groups if g.sigma_source != "stated"} == {"k2ear1"}


def test_the_error_of_a_spherical_reading_is_the_distance_between_two_places():
    """Not the range alone: a target beside the beam is as far off as one along it."""
    rng = np.random.default_rng(3)
    seen = rng.normal(size=(50, 3)) * 2
    moved = seen + 1e-5 * rng.normal(size=(50, 3))
    value, other = (np.hstack([np.linalg.norm(p, axis=1, keepdims=True), angles(p)[0]]) for p in (seen, moved))
    obs = Observations("spherical", np.arange(50), value, np.ones((50, 3)))
    where = Configurations(tuple(map(str, range(50))), rng.normal(size=(50, len(arm().joints))))
    term = problem(arm(), DataSet(where, (obs,))).terms[0]
    told = Residuals(
        other - value, term.scale, term.configuration, term.group, term.kind, term.parts, term.used, term.lever
    )
    # First order in 1e-5 m at 2 m.
    np.testing.assert_allclose(errors([told], "m")[0], np.linalg.norm(moved - seen, axis=1), rtol=1e-4)
    assert len(errors([told], "rad")[0]) == 50
