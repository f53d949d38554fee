"""Faults of a triangle mesh, with their number and place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.measured.lengths import format_length

OPEN = "open edges"
ORIENTATION = "edges of triangles with opposite orientation"
NON_MANIFOLD = "edges shared by more than two triangles"
DEGENERATE = "triangles without extent"
INVERTED = "bodies turned inside out"
INTERSECTING = "columns of nodes where the mesh overlaps itself"
UNSOUND = (OPEN, ORIENTATION, INVERTED, INTERSECTING)
"""Faults with which the inside is undefined."""


@dataclass(frozen=True)
class MeshFault:
    """A kind of fault.

    Attributes:
        kind: what is counted.
        count: how often it occurs.
        at: one place [m], x, y, z.
    """

    kind: str
    count: int
    at: tuple[float, float, float]

    def __str__(self) -> str:
        place = ", ".join(map(format_length, self.at))
        return f"{self.count} {self.kind}, one at ({place})"


def make_fault(kind: str, places: FloatArray) -> list[MeshFault]:
    """Return the fault that occurs at places (n, 3) [m]; nothing if there are none."""
    if len(places) == 0:
        return []
    x, y, z = (float(value) for value in places[0])
    return [MeshFault(kind, len(places), (x, y, z))]


def find_faults(vertices: FloatArray, faces: NDArray[np.int32]) -> list[MeshFault]:
    """Return the faults of the edges, degenerate triangles, and an inverted mesh.

    Args:
        vertices: [m], shape (m, 3), each once.
        faces: indices of vertices, shape (n, 3).
    """
    degenerate = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    faults = make_fault(DEGENERATE, vertices[faces[degenerate, 0]])
    faces = faces[~degenerate]
    keys, start, counts, sums = _edges(faces, len(vertices))
    if len(keys) == 0:
        return faults
    turned = (counts > 1) & (sums != 0)
    kinds = ((OPEN, counts == 1), (ORIENTATION, turned), (NON_MANIFOLD, counts > 2))
    for kind, where in kinds:
        first, second = np.divmod(keys[start[where]], len(vertices))
        faults += make_fault(kind, 0.5 * (vertices[first] + vertices[second]))
    if all(fault.kind not in UNSOUND for fault in faults) and signed_volume(vertices, faces) < 0.0:
        faults += make_fault(INVERTED, vertices[faces[:1, 0]])
    return faults


def _edges(
    faces: NDArray[np.int32], vertex_count: int
) -> tuple[NDArray[np.int64], NDArray[np.intp], NDArray[np.intp], NDArray[np.int64]]:
    """Return the sorted edges; where each begins, how often it occurs, and the sum of its signs."""
    ends = np.roll(faces, -1, axis=1).ravel()
    starts = faces.ravel()
    keys = np.minimum(starts, ends).astype(np.int64) * vertex_count + np.maximum(starts, ends)
    keys = np.sort(2 * keys + (starts < ends))  # the sign is the last digit: one array is sorted
    keys, signs = keys >> 1, 2 * (keys & 1) - 1
    first = np.flatnonzero(np.r_[True, keys[1:] != keys[:-1]]) if len(keys) else np.empty(0, int)
    counts = np.diff(np.r_[first, len(keys)])
    return keys, first, counts, np.add.reduceat(signs, first) if len(first) else signs


def signed_volume(vertices: FloatArray, faces: NDArray[np.int32]) -> float:
    """Return the enclosed volume [m³]; negative where the triangles point inwards."""
    a, b, c = (vertices[faces[:, k]] - vertices[0] for k in range(3))
    return float(np.einsum("ni,ni->", a, np.cross(b, c))) / 6.0
