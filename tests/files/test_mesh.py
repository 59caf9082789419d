"""Meshes that are written can be read back: PLY as text, STL as records."""

from __future__ import annotations

import numpy as np
import pytest

from robocal.errors import ModelError
from robocal.files.mesh import ply_text, stl_bytes

# A tetrahedron whose faces turn left seen from outside, and a triangle without area.
VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1 / 3]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def test_ply_is_read_back() -> None:
    lines = ply_text(VERTICES, FACES).split("\n")
    assert lines[0] == "ply" and lines[1] == "format ascii 1.0" and lines[-1] == ""
    assert any("coordinates in m" in line for line in lines if line.startswith("comment"))
    end = lines.index("end_header")
    count = {line.split()[1]: int(line.split()[2]) for line in lines[:end] if line.startswith("element")}
    body = lines[end + 1 : -1]
    assert len(body) == count["vertex"] + count["face"]
    x = np.array([row.split() for row in body[: count["vertex"]]], float)
    np.testing.assert_allclose(x, VERTICES, rtol=1e-8)
    faces = np.array([row.split() for row in body[count["vertex"] :]], int)
    assert (faces[:, 0] == 3).all()
    np.testing.assert_array_equal(faces[:, 1:], FACES)


def test_stl_is_read_back_with_normals_outwards() -> None:
    data = stl_bytes(VERTICES, FACES)
    assert len(data) == 84 + 50 * len(FACES) and not data.startswith(b"solid") and b"coordinates in m" in data[:80]
    assert int.from_bytes(data[80:84], "little") == len(FACES)
    record = np.dtype([("n", "<f4", 3), ("x", "<f4", (3, 3)), ("spare", "<u2")])
    found = np.frombuffer(data[84:], record)
    np.testing.assert_allclose(found["x"], VERTICES[FACES], rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(found["n"], axis=1), 1.0, rtol=1e-6)
    away = found["x"].mean(axis=1) - VERTICES.mean(axis=0)
    assert (np.einsum("ij,ij->i", found["n"], away) > 0).all()
    volume = np.einsum("ij,ij->", found["x"][:, 0], np.cross(found["x"][:, 1], found["x"][:, 2])) / 6
    assert volume == pytest.approx(1 / 18, rel=1e-6)


def test_meshes_without_faces_and_faces_without_area() -> None:
    assert len(stl_bytes(np.zeros((0, 3)), np.zeros((0, 3), int))) == 84
    assert "element face 0" in ply_text(VERTICES, [])
    flat = np.frombuffer(stl_bytes(VERTICES, [[0, 1, 1]])[84:96], "<f4")
    assert (flat == 0).all()


@pytest.mark.parametrize(
    ("vertices", "faces", "said"),
    [
        (VERTICES, [[0, 1, 4]], "vertex that is not there"),
        (VERTICES, [[0, 1, -1]], "vertex that is not there"),
        (VERTICES * np.nan, FACES, "finite"),
        (VERTICES[:, :2], FACES, "shape"),
        (VERTICES, [[0, 1]], "triangles"),
    ],
)
def test_what_is_no_mesh_is_refused(vertices: np.ndarray, faces: object, said: str) -> None:
    for write in (ply_text, stl_bytes):
        with pytest.raises(ModelError) as error:
            write(vertices, faces)
        assert said in str(error.value)
