"""Files of maps: what is written comes back in every format, axes and corners are those of each format's definition, and whatever is no
map is refused by file, key and marker."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from robocal.errors import FileError, FormatError, InputError, ModelError
from robocal.files.map import MAP_FORMS, map_covariance_text, map_text, read_map
from robocal.geometry import se3, so3
from robocal.vision.map_gauge import move_map, project_covariance, rigid_motions, rigid_projector, take_markers
from robocal.vision.maps import MarkerMap


def map_of(count=5, covariance=True, seed=3):
    rng = np.random.default_rng(seed)
    vector = np.hstack([rng.normal(size=(count, 3)), rng.normal(size=(count, 3))])
    bare = MarkerMap(
        tuple(str(7 * i) for i in range(count)), rng.uniform(0.05, 0.2, count), vector, None, "36h11", "a test: 9 views"
    )
    if not covariance:
        return bare
    a = 1e-4 * rng.normal(size=(6 * count, 6 * count))
    return MarkerMap(bare.names, bare.size, vector, project_covariance(bare, a @ a.T), bare.family, bare.source)


def write(tmp_path, text, name="map.yaml"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def local_sigma(known):
    """Standard deviations (M, 6) about the axes of each marker."""
    out = []
    for i, t in enumerate(known.poses):
        turn = np.kron(np.eye(2), t[:3, :3])
        own = known.covariance[6 * i : 6 * i + 6, 6 * i : 6 * i + 6]
        out.append(np.sqrt(np.diag(turn.T @ own @ turn)))
    return np.array(out)


@pytest.mark.parametrize("form", MAP_FORMS)
def test_what_is_written_comes_back(tmp_path, form):
    given = map_of()
    write(tmp_path, map_covariance_text(given), "map.covariance.csv")
    found = read_map(write(tmp_path, map_text(given, form, "map.covariance.csv")))
    back = found.map
    assert found.form == form and back.names == given.names and back.family == "36h11" and not found.file.remarks
    np.testing.assert_allclose(back.corners, given.corners, atol=2e-9)
    np.testing.assert_allclose(back.size, given.size, rtol=1e-12)
    if form in ("robocal", "json"):
        np.testing.assert_allclose(back.covariance, given.covariance, rtol=0, atol=1e-11 * given.covariance.max())
        assert back.source == given.source
    elif form == "tagslam":
        alone = np.zeros_like(given.covariance)
        for i, sigma in enumerate(local_sigma(given)):
            turn = np.kron(np.eye(2), given.poses[i, :3, :3])
            alone[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = turn @ np.diag(sigma**2) @ turn.T
        np.testing.assert_allclose(back.covariance, project_covariance(given, alone), atol=1e-14)
    else:
        assert back.covariance is None


@pytest.mark.parametrize("form", ["robocal", "json"])
def test_sizes_that_were_found_come_back(tmp_path, form):
    """With their covariance beside the places, and what was told of them; a part of the map, and a turned one, have theirs."""
    bare = map_of()
    a = 1e-4 * np.random.default_rng(1).normal(size=(35, 35))
    joint = a @ a.T
    joint[:30, :30] = project_covariance(bare, joint[:30, :30])
    joint[30:, :30] = joint[30:, :30] @ rigid_projector(bare).T
    joint[:30, 30:] = joint[30:, :30].T
    given = replace(bare, covariance=joint[:30, :30], size_covariance=joint[30:], size_errors=(2e-4, 3e-3))
    write(tmp_path, map_covariance_text(given), "map.covariance.csv")
    text = map_text(given, form, "map.covariance.csv")
    back = read_map(write(tmp_path, text)).map
    np.testing.assert_allclose(back.joint, joint, rtol=0, atol=1e-11 * joint.max())
    assert back.size_errors == pytest.approx((2e-4, 3e-3))
    some = take_markers(move_map(back, se3.from_vector([1, 2, 3, 0.4, 0.5, 0.6])), back.names[1:3])
    rows = [*range(6, 18), 31, 32]
    np.testing.assert_allclose(some.size_covariance[:, 12:], joint[31:33, 31:33], atol=1e-11 * joint.max())
    assert np.linalg.eigvalsh(some.joint) == pytest.approx(np.linalg.eigvalsh(joint[np.ix_(rows, rows)]), rel=1e-3)
    gone = "\n".join(line for line in text.replace(', "size_', ',\n"size_').splitlines() if "size_scatter" not in line)
    with pytest.raises(FormatError, match="size_sigma or size_scatter is missing"):
        read_map(write(tmp_path, gone))
    with pytest.raises(FormatError, match="not a standard deviation"):
        read_map(write(tmp_path, re.sub(r'size_sigma("?): [0-9.e-]+', r"size_sigma\1: -1", text)))


def test_sizes_beside_a_covariance_without_edges(tmp_path):
    """As a prior they would count twice, once in the places and once in today's sizes: refused by key, and right without them."""
    given = map_of()
    write(tmp_path, map_covariance_text(given), "map.covariance.csv")
    text = map_text(given, "robocal", "map.covariance.csv")
    for key, value in (("size_sigma", 0.2), ("size_scatter", 0.3)):
        with pytest.raises(FormatError, match="what places and sizes share") as error:
            read_map(write(tmp_path, f"{text}{key}: {value}\n"))
        assert error.value.key == key
    with pytest.raises(FormatError, match="no marker is known as badly"):
        read_map(write(tmp_path, f"{text}size_sigma: 300\n"))
    assert read_map(write(tmp_path, text)).map.size_covariance is None


def test_a_map_without_covariance(tmp_path):
    given = map_of(covariance=False)
    for form in ("robocal", "json", "markermapper", "ply"):
        assert read_map(write(tmp_path, map_text(given, form))).map.covariance is None
    with pytest.raises(ModelError, match="no covariance"):
        map_text(given, "tagslam")
    with pytest.raises(ModelError, match="no covariance"):
        map_covariance_text(given)
    with pytest.raises(ModelError, match="no such format"):
        map_text(given, "plyy")


# obeys: map-covariance-missing
def test_without_its_table_the_sigmas_stay(tmp_path):
    given = map_of()
    path = write(tmp_path, map_text(given, "robocal", "map.covariance.csv"))
    alone = read_map(path)
    assert [r.code for r in alone.file.remarks] == ["map-covariance-missing"]
    np.testing.assert_allclose(alone.map.covariance, np.diag(np.diag(given.covariance)), rtol=1e-4, atol=0)
    write(tmp_path, map_covariance_text(given), "map.covariance.csv")
    assert not read_map(path).file.remarks


def test_names_that_are_no_numbers(tmp_path):
    given = map_of(3, False)
    named = MarkerMap(("door", "007", "12"), given.size, given.vector)
    for form in ("robocal", "json"):
        assert read_map(write(tmp_path, map_text(named, form))).map.names == named.names
    for form in ("markermapper", "ply"):
        with pytest.raises(ModelError, match="by numbers") as error:
            map_text(named, form)
        assert error.value.found == "door"


def test_a_map_stays_readable(tmp_path):
    text = map_text(map_of(96), "robocal", "map.covariance.csv")
    assert len(text.splitlines()) < 110 and max(map(len, text.splitlines())) < 240


# --- axes and corners of each format --------------------------------------------------------------------------------------

TAGSLAM = """bodies:
 - rig: {is_static: false, type: simple}
 - wall:
     is_static: true
     default_tag_size: 0.2
     type: simple
     pose:
       position: {x: 1, y: 2, z: 3}
       rotation: {x: 0, y: 0, z: 1.5707963267948966}
       position_noise: {x: 0.001, y: 0.002, z: 0.003}
       rotation_noise: {x: 1.0e-05, y: 1.0e-05, z: 1.0e-05}
     tags:
     - id: 4
       pose:
         position: {x: 0.5, y: 0, z: 0}
         rotation: {x: 1.5707963267948966, y: 0, z: 0}
         position_noise: {x: 0.0001, y: 0.0002, z: 0.0004}
         rotation_noise: {x: 1.0e-05, y: 1.0e-05, z: 1.0e-05}
     - id: 5
       size: 0.1
       pose: {position: {x: -0.5, y: 0, z: 0}, rotation: {x: 0, y: 0, z: 0}}
 - board:
     is_static: true
     type: board
     board: {tag_start_id: 10, tag_size: 0.12, tag_bits: 6, tag_spacing: 0.25, tag_rows: 2, tag_columns: 3,
             tag_rotation_noise: 0.001, tag_position_noise: 0.002}
"""


def test_tagslam_by_its_definition(tmp_path):
    """Tag 4 stands half a metre along the body's x, which is the world's y, and its z (out of the tag) looks along the world's x: the
    body's -y. TagSLAM's corners go from the bottom left counter-clockwise."""
    found = read_map(write(tmp_path, TAGSLAM))
    wall, board = found.maps
    assert found.form == "tagslam" and wall.names == ("4", "5") and wall.family == "36h11"
    np.testing.assert_allclose(wall.size, [0.2, 0.1])
    np.testing.assert_allclose(wall.vector[0, :3], [1, 2.5, 3])
    np.testing.assert_allclose(wall.poses[0, :3, 2], [1, 0, 0], atol=1e-12)
    body = se3.from_vector([1, 2, 3, 0, 0, np.pi / 2])
    corners = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])
    tag = body @ se3.from_vector([0.5, 0, 0, np.pi / 2, 0, 0])
    np.testing.assert_allclose(wall.corners[0][[3, 2, 1, 0]], corners @ tag[:3, :3].T + tag[:3, 3], atol=1e-12)
    assert board.names == tuple("10 11 12 13 14 15".split())
    np.testing.assert_allclose(board.vector[:, :3], [[x, y, 0] for y in (0, 0.15) for x in (0, 0.15, 0.3)], atol=1e-12)
    with pytest.raises(FormatError, match="2 groups of markers have no place to one another") as error:
        _ = found.map
    assert "4, 5" in error.value.found


def test_what_a_body_may_be_off_by_is_of_the_map_as_a_whole(tmp_path):
    text = TAGSLAM.replace("{x: 0.0001, y: 0.0002, z: 0.0004}", "{x: 0, y: 0, z: 0}")
    at = text.index("rotation_noise", text.index("rotation_noise") + 1)
    text = text[:at] + text[at:].replace("{x: 1.0e-05, y: 1.0e-05, z: 1.0e-05}", "{x: 0, y: 0, z: 0}", 1)
    known = read_map(write(tmp_path, text)).maps[0]
    assert np.abs(known.covariance).max() < 1e-18


def test_tagslam_noise_is_about_the_axes_of_the_tag(tmp_path):
    """The tag's x is the world's y, its y the world's z, its z the world's x."""
    known = read_map(write(tmp_path, TAGSLAM)).maps[0]
    noise = np.zeros((12, 12))
    noise[:6, :6] = np.diag(np.square([4e-4, 1e-4, 2e-4, 1e-5, 1e-5, 1e-5]))
    np.testing.assert_allclose(known.covariance, project_covariance(known, noise), atol=1e-18)


def test_tagslam_root_of_information(tmp_path):
    root = np.diag([1e3, 1e3, 1e3, 1e4, 5e3, 1e4])  # rotations first
    text = TAGSLAM.replace(
        "         position_noise: {x: 0.0001, y: 0.0002, z: 0.0004}\n         rotation_noise: {x: 1.0e-05, y: 1.0e-05, z: 1.0e-05}\n",
        f"         R: [{', '.join(f'{v:.1f}' for v in root.ravel())}]\n",
    )
    with_root = read_map(write(tmp_path, text)).maps[0]
    noise = text.replace(
        text[text.index("         R:") : text.index("     - id: 5")],
        "         position_noise: {x: 0.0001, y: 0.0002, z: 0.0001}\n         rotation_noise: {x: 0.001, y: 0.001, z: 0.001}\n",
    )
    np.testing.assert_allclose(with_root.covariance, read_map(write(tmp_path, noise)).maps[0].covariance, atol=1e-18)


def test_an_output_of_tagslam_lists_board_tags_again(tmp_path):
    text = (
        TAGSLAM
        + "     tags:\n     - {id: 11, size: 0.12, pose: {position: {x: 9, y: 0, z: 0}, rotation: {x: 0, y: 0, z: 0}}}\n"
    )
    assert read_map(write(tmp_path, text)).maps[1].names == tuple("10 11 12 13 14 15".split())


def test_the_boards_of_the_real_hall(shared_data):
    found = read_map(shared_data / "tag-map" / "tagslam.yaml")
    assert len(found.maps) == 16 and sum(len(m.names) for m in found.maps) == 96
    placed = found.maps[0]
    assert placed.names == ("60", "61", "62", "63", "64", "65")
    np.testing.assert_allclose(placed.vector[0], [0.00635, 0.126675, 0.5505, *[1.20919958] * 3])
    np.testing.assert_allclose(placed.vector[4, :3] - placed.vector[0, :3], [0, 0.15, 0.15], atol=1e-8)
    np.testing.assert_allclose(placed.poses[0, :3, 2], [1, 0, 0], atol=1e-7)


MAPPER = """%YAML:1.0
---
aruco_bc_dict: ARUCO_MIP_36h12
aruco_bc_nmarkers: 2
aruco_bc_mInfoType: 1
aruco_bc_markers:
   - { id:3, corners:[ [ -0.05, 0.05, 0. ], [ 0.05, 0.05, 0. ], [ 0.05,
       -0.05, 0. ], [ -0.05, -0.05, 0. ] ] }
   - { id:8, corners:[ [ 0.25, 0.05, 1. ], [ 0.35, 0.05, 1. ], [
       0.35, -0.05, 1. ], [ 0.25, -0.05, 1. ] ] }
"""


def test_markermapper_by_its_definition(tmp_path):
    found = read_map(write(tmp_path, MAPPER, "map.yml"))
    known = found.map
    assert found.form == "markermapper" and known.names == ("3", "8") and known.family == "mip_36h12"
    np.testing.assert_allclose(known.size, 0.1)
    np.testing.assert_allclose(known.vector, [[0] * 6, [0.3, 0, 1, 0, 0, 0]], atol=1e-12)


def test_opencv_reads_what_is_written_and_writes_what_is_read(tmp_path):
    cv2 = pytest.importorskip("cv2")
    given = map_of(4)
    path = write(tmp_path, map_text(given, "markermapper"), "map.yml")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert storage.getNode("aruco_bc_nmarkers").real() == 4 and storage.getNode("aruco_bc_mInfoType").real() == 1
    markers = storage.getNode("aruco_bc_markers")
    corners = [
        [[markers.at(i).getNode("corners").at(j).at(k).real() for k in range(3)] for j in range(4)] for i in range(4)
    ]
    np.testing.assert_allclose(corners, given.corners, atol=1e-12)
    storage.release()
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("aruco_bc_dict", "TAG36h11")
    storage.write("aruco_bc_nmarkers", 4)
    storage.write("aruco_bc_mInfoType", 1)
    storage.startWriteStruct("aruco_bc_markers", cv2.FileNode_SEQ)
    for name, places in zip(given.names, given.corners, strict=True):
        storage.startWriteStruct("", cv2.FileNode_MAP | cv2.FileNode_FLOW)
        storage.write("id", int(name))
        storage.startWriteStruct("corners", cv2.FileNode_SEQ | cv2.FileNode_FLOW)
        for point in places:
            storage.startWriteStruct("", cv2.FileNode_SEQ | cv2.FileNode_FLOW)
            for v in point:
                storage.write("", float(v))
            storage.endWriteStruct()
        storage.endWriteStruct()
        storage.endWriteStruct()
    storage.endWriteStruct()
    storage.release()
    np.testing.assert_allclose(read_map(path).map.corners, given.corners, atol=1e-12)


def test_ply_faces_turn_left_seen_from_the_printed_side():
    given = map_of(3)
    lines = map_text(given, "ply").splitlines()
    top = lines.index("end_header") + 1
    points = np.array([[float(v) for v in line.split()[:3]] for line in lines[top : top + 12]])
    for i, face in enumerate(lines[top + 12 :]):
        a, b, c, _ = points[[int(v) for v in face.split()[1:]]]
        assert np.cross(b - a, c - b) @ given.poses[i, :3, 2] > 0


# --- the map as a whole ---------------------------------------------------------------------------------------------------


def test_no_motion_of_the_whole_map_is_counted():
    given = map_of()
    g = rigid_motions(given.vector[:, :3])
    moved = given.covariance + g @ np.diag([1, 2, 3, 4, 5, 6.0]) @ g.T
    np.testing.assert_allclose(project_covariance(given, moved), given.covariance, atol=1e-9)
    assert (np.linalg.eigvalsh(given.covariance)[:6] < 1e-20).all()


def test_a_moved_map_is_the_same_map():
    given = map_of()
    t = se3.from_vector([0.3, -2, 1, 0.4, 1.0, -0.7])
    there = move_map(given, t)
    np.testing.assert_allclose(there.corners, given.corners @ t[:3, :3].T + t[:3, 3], atol=1e-12)
    np.testing.assert_allclose(project_covariance(there, there.covariance), there.covariance, atol=1e-15)
    np.testing.assert_allclose(local_sigma(there), local_sigma(given), rtol=1e-9)
    assert so3.log(there.poses[0, :3, :3]) == pytest.approx(there.vector[0, 3:])


# --- what is refused ------------------------------------------------------------------------------------------------------

OWN = map_text(map_of(2), "robocal")
LINE = next(line for line in OWN.splitlines() if "id: 7" in line)


@pytest.mark.parametrize(
    ("text", "words", "key"),
    [
        (OWN.replace("kind: map", "kind: lens"), "this is no map", "kind"),
        (OWN.replace("id: 7", "id: 0"), "a marker stands twice", "markers[1].id"),
        (OWN.replace(LINE, LINE.replace("size: ", "size: -")), "marker 7: not a size", "markers[1].size"),
        (OWN.replace(LINE, LINE[: LINE.index(", sigma")] + "}"), "marker 7 has no sigma", "markers[1]"),
        (OWN.replace(LINE, LINE.replace("sigma: [", "sigma: [-")), "marker 7: not standard", "markers[1].sigma"),
        (OWN.replace(LINE, LINE.replace("xyz: [", "xyz: [1, ")), "4 numbers instead of 3", "markers[1].xyz"),
        (OWN.replace("length: mm", "length: mn"), "unknown unit", "units.length"),
        (OWN.replace("length: mm", "length: deg"), "another quantity", "units.length"),
        (OWN.replace("markers:", "marker:"), "unknown key", "marker"),
        (OWN + "covariance: ../map.csv\n", "not the name of a file beside", "covariance"),
        (OWN + "covariance: [[1, 2], [2, 1]]\n", "wrong number of values", "covariance[0]"),
        ("robocal: 1\nkind: map\nunits: {length: m, angle: rad}\nmarkers: []\n", "without markers", "markers"),
        ("joints: []\n", "this is no map", None),
        ("static_objects: []\n", "this is no map", None),
        ("<map/>", "this is XML", None),
        ("{", "not valid JSON", None),
        ('{"kind": "map"}', "this is no map", None),
        (TAGSLAM.replace("id: 5", "id: 4"), "twice on a body", "bodies[1].wall"),
        (TAGSLAM.replace("tag_start_id: 10", "tag_start_id: 3"), "a tag is on two bodies", "bodies[2].board"),
        (TAGSLAM.replace("rotation: {x: 0, y: 0, z: 1.57", "rotation: {x: 0, y: 90, z: 1.57"), "more than a turn",
         "bodies[1].wall.pose.rotation"),
        (TAGSLAM.replace("size: 0.1\n", "size: 0\n"), "tag 5: not a size", "bodies[1].wall.tags[1].size"),
        (TAGSLAM.replace("position: {x: 1, y: 2, z: 3}", "position: {x: 1, y: 2}"), "a key is missing",
         "bodies[1].wall.pose.position.z"),
        (TAGSLAM.replace("tag_rows: 2", "tag_rows: 0"), "rows and columns", "bodies[2].board.board"),
        (TAGSLAM.replace("tag_spacing: 0.25", "tag_spacing: wide"), "not a spacing", "bodies[2].board.board.tag_spacing"),
        (TAGSLAM.replace("tag_bits: 6", "tag_bits: 5"), "several dictionaries", "bodies"),
        (MAPPER.replace("mInfoType: 1", "mInfoType: 0"), "not in metres", "aruco_bc_mInfoType"),
        (MAPPER.replace("nmarkers: 2", "nmarkers: 3"), "another number of markers", "aruco_bc_nmarkers"),
        (MAPPER.replace("id:8", "id:3"), "a marker stands twice", "aruco_bc_markers[1].id"),
        (MAPPER.replace("0.35, 0.05, 1.", "0.45, 0.05, 1."), "marker 8: not a square", "aruco_bc_markers[1].corners"),
        (MAPPER.replace("0.35, 0.05, 1.", "0.35, 0.05"), "marker 8: not four corners", "aruco_bc_markers[1].corners"),
    ],
)  # fmt: skip
def test_what_is_no_map_is_refused_by_key(tmp_path, text, words, key):
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=words) as error:
        read_map(path)
    assert error.value.file == str(path) and (key is None or error.value.key == key)


def test_a_table_of_another_map_is_refused(tmp_path):
    given = map_of()
    path = write(tmp_path, map_text(given, "robocal", "map.covariance.csv"))
    other = map_of(seed=4)
    write(tmp_path, map_covariance_text(other), "map.covariance.csv")
    with pytest.raises(FormatError, match="of another map") as error:
        read_map(path)
    assert error.value.file == str(tmp_path / "map.covariance.csv")
    write(tmp_path, map_covariance_text(map_of(3)), "map.covariance.csv")
    with pytest.raises(FormatError, match="of other markers"):
        read_map(path)
    write(tmp_path, map_covariance_text(given).replace("[m]", "[mm]"), "map.covariance.csv")
    with pytest.raises(FormatError, match="another unit") as error:
        read_map(path)
    assert error.value.column == "0.x"


def test_a_matrix_that_is_no_covariance_is_refused(tmp_path):
    data = json.loads(map_text(map_of(2), "json"))
    for change, words in (
        (lambda c: c[0].__setitem__(1, 1.0), "not symmetric"),
        (lambda c: c[2].__setitem__(2, -1.0), "a variance below 0"),
        (lambda c: (c[0].__setitem__(1, 1.0), c[1].__setitem__(0, 1.0)), "below 0 in some direction"),
    ):
        bad = json.loads(json.dumps(data))
        change(bad["covariance"])
        with pytest.raises(FormatError, match=words):
            read_map(write(tmp_path, json.dumps(bad)))


PLY = map_text(map_of(2), "ply")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (PLY.replace("format ascii", "format binary_little_endian"), "not a PLY in text"),
        (PLY.replace("property int marker\n", ""), "a property is missing"),
        (PLY.replace("end_header\n", ""), "without end_header"),
        (PLY.replace("element vertex 8", "element vertex 9"), "not four corners a marker"),
        (PLY.replace("element vertex 8", "element vertex 800"), "not four corners a marker"),
        (PLY[: PLY.index("element face")] + PLY[PLY.index("element face") :].replace(" 7\n", " 0\n"), "stands twice"),
        (PLY[: PLY.index("element face")] + PLY[PLY.index("element face") :].replace(" 7\n", " 9\n", 1), "follow one another"),
        (PLY.replace("end_header\n", "end_header\nnan 0 0 1 1 1 3\n"), "not a vertex"),
    ],
)  # fmt: skip
def test_what_is_no_ply_of_markers_is_refused(tmp_path, text, words):
    with pytest.raises(InputError, match=words) as error:
        read_map(write(tmp_path, text, "map.ply"))
    assert error.value.row is not None


@pytest.mark.parametrize(
    "data", [b"", b"\x89PNG\r\n\x1a\n\0\0", b"\xff\xfer\0o\0", b"\0" * 100, b"- 1\n- 2\n", b"[1]", b"ply", b"{}"]
)
def test_no_text_at_all(tmp_path, data):
    with pytest.raises((FileError, FormatError)):
        read_map(write(tmp_path, data))
