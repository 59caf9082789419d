"""A cable robot as MJCF: the file says the robot's cables, and MuJoCo finds the equilibrium that the statics find, from one file at every
pose and for soft and stiff cables."""

from __future__ import annotations

import csv
import io
import xml.etree.ElementTree as xml

import numpy as np
import pytest
from called import export

from robocal.cables.cable_lengths import inverse
from robocal.cables.geometry import CableRobot, cable_robot
from robocal.cables.pulley import Pulleys
from robocal.cables.tension import hold
from robocal.errors import InputError, ModelError
from robocal.files.cable.mjcf import mjcf
from robocal.files.cable.write import describe_cable
from robocal.geometry import se3, so3
from robocal.simulation.platform.platform_plant import box_inertia

WITHIN = 1e-6  # N, and N m: what the issue of an equilibrium may be off by
A = np.array([[sx * 2.1, sy * 1.7, z] for z in (0.1, 2.9) for sx in (-1, 1) for sy in (-1, 1)])
B = np.array([[sx * 0.21, sy * 0.13, z] for z in (0.11, -0.09) for sx in (-1, 1) for sy in (-1, 1)])


def robot(ea: float = 4e4, **known: object) -> CableRobot:
    return cable_robot(
        "R & D <eight>", A + 0.01 * np.sin(np.arange(24).reshape(8, 3)), B, np.linspace(-0.2, 0.3, 8),
        elasticity=1 / ea, **{"mass": 7.3, "com": np.array([0.01, -0.02, 0.03]), "limits": np.tile([20.0, 400.0], (8, 1)), **known},
    )  # fmt: skip


def planar() -> CableRobot:
    a = np.array([[-2.0, 0, 0.2], [2.0, 0, 0.2], [-2.0, 0, 3.0], [2.0, 0, 3.0]])
    b = np.array([[-0.2, 0, 0.1], [0.2, 0, 0.1], [-0.2, 0, -0.1], [0.2, 0, -0.1]])
    limits = np.tile([10.0, 500.0], (4, 1))
    return cable_robot("plane", a, b, elasticity=2e-5, mass=4.0, limits=limits, degrees="1R2T", plane="xz")


def poses(machine: CableRobot, n: int = 10) -> np.ndarray:
    """Poses near home that tensions hold, (n, 4, 4)."""
    rng = np.random.default_rng(5)
    twist = np.zeros((40 * n, 6))
    twist[:, machine.axes] = (
        rng.uniform(-1, 1, (40 * n, len(machine.axes))) * np.array([0.8, 0.6, 0.6, 0.2, 0.2, 0.2])[list(machine.axes)]
    )
    at = se3.compose(so3.exp(twist[:, 3:]), machine.home[:3, 3] + twist[:, :3])
    return at[hold(machine, at).has_solution][:n]


def rest_lengths(machine: CableRobot, pose: np.ndarray, tension: np.ndarray) -> np.ndarray:
    return inverse(machine, pose, tension)[0] + machine.zeros


def numbers(element: xml.Element, key: str) -> np.ndarray:
    return np.array([float(v) for v in element.attrib[key].split()])


@pytest.mark.parametrize("ea", [4e4, 4e5, 4e6])
def test_the_law_in_the_file_gives_the_tensions_of_the_statics(ea):
    machine = robot(ea)
    tree = xml.fromstring(mjcf(machine))
    at = poses(machine)
    tension = hold(machine, at).tension
    control = 1 / rest_lengths(machine, at, tension)
    sites = {s.attrib["name"]: numbers(s, "pos") for s in tree.iter("site") if "name" in s.attrib}
    assert len(at) == 10
    for i, element in enumerate(tree.iter("general")):
        name = element.attrib["name"]
        ends = [s.attrib["site"] for s in tree.find(f".//spatial[@name='{name}']")]
        span = at[:, :3, :3] @ sites[ends[1]] + at[:, :3, 3] - sites[ends[0]]
        length = np.linalg.norm(span, axis=1)
        gain, bias = numbers(element, "gainprm"), numbers(element, "biasprm")
        force = (gain[0] + gain[1] * length) * control[:, i] + bias[0] + bias[1] * length
        assert np.abs(force + tension[:, i]).max() < WITHIN
        assert numbers(element, "forcerange")[1] == 0.0


@pytest.mark.parametrize(("make", "ea"), [(robot, 4e4), (robot, 4e5), (robot, 4e6), (planar, 0.0)])
def test_mujoco_rests_where_the_statics_rest(make, ea):
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'robocal[oracles]'")
    machine = make(ea) if ea else make()
    model = mujoco.MjModel.from_xml_string(mjcf(machine))
    data = mujoco.MjData(model)
    at = poses(machine)
    tension = hold(machine, at).tension
    control = 1 / rest_lengths(machine, at, tension)
    whole = len(machine.axes) == 6
    for pose, pull, u in zip(at, tension, control, strict=True):
        turn = so3.log(pose[:3, :3])
        angle = float(np.linalg.norm(turn))
        axis = turn / angle
        free = [*pose[:3, 3], np.cos(angle / 2), *(np.sin(angle / 2) * axis)]
        data.qpos[:] = free if whole else [[*pose[:3, 3], *turn][i] for i in machine.axes]
        data.qvel[:], data.ctrl[:] = 0.0, u
        mujoco.mj_forward(model, data)
        assert np.abs(data.actuator_force + pull).max() < WITHIN
        # forces on the platform, weight included: what would make it move
        assert np.abs(data.qfrc_actuator - data.qfrc_bias).max() < WITHIN
    if whole:  # the key frame is at rest too, and stays there
        mujoco.mj_resetDataKeyframe(model, data, 0)
        before = data.qpos.copy()
        for _ in range(200):
            mujoco.mj_step(model, data)
        assert np.abs(data.qpos - before).max() < 1e-9


def test_drums_change_no_unstretched_length_and_are_told():
    """Controls are 1 / unstretched length, whatever the sensors show; the first comment says what they show of it."""
    plain, gain, growth = robot(), np.linspace(0.98, 1.02, 8), np.linspace(1e-4, 2e-4, 8)
    wound = cable_robot(
        "R & D <eight>", plain.a, plain.b, plain.zeros, gain=gain, build_up=growth,
        elasticity=plain.elasticity, mass=plain.mass, com=plain.com, limits=plain.limits,
    )  # fmt: skip
    keys = [xml.fromstring(mjcf(m)).find("keyframe/key").attrib["ctrl"].split() for m in (plain, wound)]
    assert np.allclose(*(np.array(k, float) for k in keys), rtol=1e-12, atol=0)
    comment = mjcf(wound).partition("-->")[0]
    said = [[float(w.split()[-1]) for w in c.split(", ")[1:]] for c in comment.split("zero:\n")[1].split(";")]
    assert np.allclose(said, np.column_stack([wound.zeros, gain, growth]), rtol=1e-15, atol=0)
    assert "gain y + build-up y^2 + zero" in comment


@pytest.mark.parametrize(
    ("machine", "key"),
    [
        (robot().having(pulleys=Pulleys(np.full(8, 0.05), np.tile([0.0, 0.0, 1.0], (8, 1)))), "c1.pulley"),
        (robot(density=np.full(8, 0.1)), "density"),
        (robot().having(elasticity=None), "elasticity"),
        (robot(mass=None), "mass"),
    ],
)
def test_what_no_tendon_can_be_is_refused_by_name(machine, key):
    with pytest.raises(ModelError) as failure:
        mjcf(machine)
    assert failure.value.key == key


def test_the_inertia_of_a_flat_platform_is_that_of_a_box():
    points = np.array([[-1.0, -2, 0], [1.0, 2, 0]])
    assert np.allclose(np.diag(box_inertia(points, 12.0)), [16 + 1e-6, 4 + 1e-6, 20])


def test_the_table_has_every_number_again(tmp_path):
    machine = robot()
    (tmp_path / "robot.yaml").write_text(describe_cable(machine), encoding="utf-8")
    made = export(str(tmp_path / "robot.yaml"), form="csv")
    rows = list(csv.DictReader(io.StringIO(made.text)))
    assert [r["cable"] for r in rows] == list(machine.cables)
    read = np.array([[float(v) for k, v in r.items() if k != "cable"] for r in rows])
    assert np.allclose(read, np.column_stack([machine.numbers, machine.elasticity]), rtol=1e-14, atol=0)


def test_what_is_refused_names_the_file(tmp_path):
    (tmp_path / "sags.yaml").write_text(describe_cable(robot(density=np.full(8, 0.1))), encoding="utf-8")
    with pytest.raises(InputError, match=r"sags.yaml: key density|sags.yaml, key density"):
        export(str(tmp_path / "sags.yaml"), form="mjcf")


@pytest.mark.parametrize(("form", "key"), [("urdf", "--format"), ("offsets", "--format"), ("dh", "--format")])
def test_forms_of_arms_are_refused(form, key, tmp_path):
    (tmp_path / "robot.yaml").write_text(describe_cable(robot()), encoding="utf-8")
    with pytest.raises(InputError) as failure:
        export(str(tmp_path / "robot.yaml"), form=form)
    assert failure.value.key == key and "mjcf" in str(failure.value)


def test_an_arm_is_no_mjcf_yet():
    with pytest.raises(InputError) as failure:
        export("ur10", form="mjcf")
    assert failure.value.key == "--format"


# obeys: inertia-assumed
def test_the_inertia_that_was_assumed_is_told_until_it_is_stated(tmp_path):
    known = robot(inertia=np.diag([0.2, 0.3, 0.25]))
    for machine, told in ((robot(), ["inertia-assumed"]), (known, [])):
        (tmp_path / "robot.yaml").write_text(describe_cable(machine), encoding="utf-8")
        made = export(str(tmp_path / "robot.yaml"), form="mjcf")
        assert [r.code for r in made.remarks] == told
        assert ("inertia is assumed" in made.text) == bool(told)
    assert 'fullinertia="0.2 0.3 0.25 0.0 0.0 0.0"' in made.text
