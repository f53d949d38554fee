"""Write STL and OBJ meshes for tests, and the triangles to put into them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def grid_mesh(
    heights: NDArray[np.float64], pitch: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices (n, 3) and faces (m, 3) of a triangulated height field, facing up."""
    rows, columns = heights.shape
    j, i = np.meshgrid(np.arange(columns), np.arange(rows))
    vertices = np.stack((pitch * j, pitch * i, heights), axis=-1).reshape(-1, 3)
    a = (i * columns + j)[:-1, :-1].ravel()
    quads = np.stack((a, a + 1, a + columns + 1, a + columns), axis=1)
    return vertices, np.concatenate((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]))


def write_stl(path: Path, corners: NDArray[np.float64], header: bytes = b"tests") -> Path:
    """Write a binary STL of triangles, shape (n, 3, 3)."""
    content = header.ljust(80, b"\0") + struct.pack("<I", len(corners))
    for triangle in corners.reshape(-1, 9).tolist():
        content += struct.pack("<12fH", 0, 0, 1, *triangle, 0)
    path.write_bytes(content)
    return path


def write_ascii_stl(path: Path, corners: NDArray[np.float64]) -> Path:
    """Write a text STL."""
    lines = ["solid tests"]
    for triangle in corners.tolist():
        lines += [" facet normal 0 0 1", "  outer loop"]
        lines += ["   vertex " + " ".join(f"{x:.9e}" for x in corner) for corner in triangle]
        lines += ["  endloop", " endfacet"]
    path.write_text("\n".join([*lines, "endsolid tests", ""]))
    return path


def write_obj(path: Path, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Path:
    """Write an OBJ with texture indices, as drawing programs do."""
    lines = ["# tests", "mtllib nowhere.mtl", "o patch", "vt 0 0", "usemtl none"]
    lines += ["v " + " ".join(f"{x:.12g}" for x in vertex) for vertex in vertices.tolist()]
    lines += ["f " + " ".join(f"{k + 1}/1" for k in face) for face in faces.tolist()]
    path.write_text("\n".join([*lines, ""]))
    return path
