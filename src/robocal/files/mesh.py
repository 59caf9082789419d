"""Triangle meshes as files: PLY (ASCII) and STL (binary). Neither format has a unit: coordinates are metres, and the header
says so."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robocal._types import Array, Ints
from robocal.errors import ModelError

__all__ = ["ply_text", "stl_bytes"]

HEADER = b"robocal: coordinates in m"  # must not begin with "solid", the mark of the STL that is text
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])


def ply_text(vertices: ArrayLike, faces: ArrayLike) -> str:
    """The text of a PLY file from vertices (n, 3) m and faces (f, 3), triangles whose corners turn left seen from outside.

    Raises ModelError for coordinates that are not finite and for faces that name no vertex.
    """
    points, corners = _check_mesh(vertices, faces)
    head = [
        "ply", "format ascii 1.0", "comment made by robocal; coordinates in m",
        f"element vertex {len(points)}", "property double x", "property double y", "property double z",
        f"element face {len(corners)}", "property list uchar int vertex_indices", "end_header",
    ]  # fmt: skip
    rows = [" ".join(f"{v:.9g}" for v in p) for p in points.tolist()]
    return "\n".join(head + rows + [f"3 {i} {j} {k}" for i, j, k in corners.tolist()]) + "\n"


def stl_bytes(vertices: ArrayLike, faces: ArrayLike) -> bytes:
    """The bytes of a binary STL file, 84 + 50 f of them, from the same; a normal is that of its corners, and zero for a
    triangle without area. Single precision, as the format has it. Raises ModelError as `ply_text` does."""
    points, corners = _check_mesh(vertices, faces)
    x = points[corners]
    across = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    size = np.linalg.norm(across, axis=1, keepdims=True)
    out = np.zeros(len(corners), RECORD)
    out["normal"] = across / np.where(size > 0.0, size, 1.0)
    out["corners"] = x
    return HEADER.ljust(80) + len(corners).to_bytes(4, "little") + out.tobytes()


def _check_mesh(vertices: ArrayLike, faces: ArrayLike) -> tuple[Array, Ints]:
    points, corners = np.asarray(vertices, float), np.asarray(faces)
    corners = corners.astype(np.int64) if corners.size else np.zeros((0, 3), np.int64)
    if points.ndim != 2 or points.shape[1:] != (3,) or not np.isfinite(points).all():
        raise ModelError("vertices of a mesh", expected="finite numbers of shape (n, 3), m", found=points.shape)
    if corners.ndim != 2 or corners.shape[1:] != (3,):
        raise ModelError("faces of a mesh", expected="triangles, shape (f, 3)", found=corners.shape)
    if len(corners) and not (corners.min() >= 0 and corners.max() < len(points)):
        raise ModelError(
            "a face names a vertex that is not there",
            expected=f"0 to {len(points) - 1}",
            found=int(corners.max() if corners.max() >= len(points) else corners.min()),
        )
    return points, corners
