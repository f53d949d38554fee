"""A closed body from a mesh file: its faults, their repair, and the tree of its triangles."""

from __future__ import annotations

import gc
import math
import os
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.lengths import format_length, unit_to_metres
from asperity.measured.reading.isolation import reject_on_error
from asperity.measured.reading.mesh import find_precision, precision_notes
from asperity.textures.meshes.triangle_tree import LEAF_SIZE, TriangleTree

MESH_FORMATS = ("stl", "obj", "ply", "glb", "gltf")
MAX_TRIANGLES = 30_000_000
"""Largest mesh that is read."""
# A triangle takes at least these bytes in a file of each format, whatever its header states.
_LEAST_BYTES = {"stl": 50, "obj": 8, "ply": 7, "glb": 6, "gltf": 6}
_STL_HEADER = 84
_SAME_PLANE = 1e-9  # 1 - cosine of the angle between triangles of one plane


@dataclass(frozen=True, eq=False)
class MeshBody:
    """A solid bounded by triangles whose normals point out of it.

    Attributes:
        triangles: corners [m], shape (n, 3, 3).
        name: of the file.
        faults: faults found and not repaired, none of which leaves the inside undefined.
        repaired: the faults that were repaired.
        notes: what was done to the mesh, for reports.
        coarsest: the coarsest spacing of nodes [m] that resolves what was done.
    """

    triangles: FloatArray
    name: str = "mesh"
    faults: tuple[MeshFault, ...] = ()
    repaired: tuple[MeshFault, ...] = ()
    notes: tuple[str, ...] = ()
    coarsest: float = math.inf

    @cached_property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Corners of least and of greatest coordinates [m], (3,) each."""
        corners = self.triangles.reshape(-1, 3)
        return corners.min(axis=0), corners.max(axis=0)

    @cached_property
    def tree(self) -> TriangleTree:
        """The record in which closest points are searched."""
        return build_tree(self.triangles)

    @classmethod
    def from_arrays(
        cls,
        vertices: FloatArray,
        faces: NDArray[np.integer[Any]],
        name: str = "mesh",
        repair: bool = False,
    ) -> MeshBody:
        """Return the body with the given vertices (m, 3) [m] and faces (n, 3), if it is sound.

        Raises:
            SurfaceFileError: for an empty mesh, vertices that are not finite, or faults that leave
                the inside undefined and are not, or cannot be, repaired.
        """
        if len(faces) == 0:
            raise SurfaceFileError(f"{name} has no triangles")
        if not np.isfinite(vertices).all():
            raise SurfaceFileError(f"{name} has corners that are not finite numbers")
        vertices, faces = merge_vertices(vertices, faces)
        faults = find_faults(vertices, faces)
        notes: tuple[str, ...] = ()
        if any(fault.kind == NON_MANIFOLD for fault in faults):
            united = remove_shared_faces(vertices, faces)
            if len(united) < len(faces):
                notes = (
                    f"parts united: {len(faces) - len(united)} triangles between them removed",
                )
                faces = united
                faults = find_faults(vertices, faces)
        repaired: list[MeshFault] = []
        if repair and _unsound(faults):
            repaired = faults
            vertices, faces = _repair(vertices, faces)
            faults = find_faults(vertices, faces)
        if _unsound(faults):
            tried = " after the repair" if repaired else "; the repair option may close and turn it"
            reasons = "; ".join(map(str, _unsound(faults)))
            raise SurfaceFileError(f"{name} has no defined inside{tried}: {reasons}")
        triangles = vertices[faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]]
        if not len(triangles) or not np.ptp(triangles.reshape(-1, 3), axis=0).all():
            raise SurfaceFileError(f"{name} is flat: it encloses no volume")
        return cls(triangles, name, tuple(faults), tuple(repaired), notes)


def _unsound(faults: Sequence[MeshFault]) -> list[MeshFault]:
    return [fault for fault in faults if fault.kind in UNSOUND]


def load_mesh(
    path: str | os.PathLike[str], unit: str | None = None, *, repair: bool = False
) -> MeshBody:
    """Load a closed body from an STL, OBJ, PLY or glTF file.

    Args:
        path: the file.
        unit: unit of its coordinates, such as ``"mm"``; glTF files are in metres by definition.
        repair: whether open edges are filled and triangles turned, by trimesh's repair functions.

    Raises:
        ParameterError: no unit, or one that is unknown.
        SurfaceFileError: the file is damaged or too large, or its inside is undefined.

    Example:
        Not run as a test: it needs a file.

        >>> load_mesh("part.stl", "mm").triangles.shape  # doctest: +SKIP
        (12, 3, 3)
    """
    path = Path(path)
    suffix = path.suffix.lower().lstrip(".")
    if suffix not in MESH_FORMATS:
        raise SurfaceFileError(f"{path.name} is none of {', '.join(MESH_FORMATS)}")
    if unit is None and suffix in ("glb", "gltf"):
        unit = "m"
    if unit is None:
        raise ParameterError("unit", f"is required: {path.name} does not state one, such as 'mm'")
    metres = unit_to_metres(unit)
    _check_count(path, suffix)
    vertices, faces = _parse(path, suffix)
    gc.collect()  # trimesh's objects refer to each other, and hold several copies
    step = metres * find_precision(vertices)
    np.multiply(vertices, metres, out=vertices)
    body = MeshBody.from_arrays(vertices, faces, path.name, repair)
    coarse = precision_notes(step, float(np.subtract(*body.box[::-1]).min()))
    return replace(body, notes=(*body.notes, *coarse))


def _check_count(path: Path, suffix: str) -> None:
    """Refuse a file whose header states, or whose size allows for, too many triangles."""
    try:
        size = path.stat().st_size
        with path.open("rb") as stream:
            head = stream.read(4096)
    except OSError as error:
        raise SurfaceFileError(f"cannot read {path.name}: {error.strerror or error}") from None
    count = size // _LEAST_BYTES[suffix]
    stated = _stated_count(head, suffix)
    if stated is not None:
        if suffix == "stl" and size != _STL_HEADER + 50 * stated:
            fault = f"it states {stated:,} triangles and holds {(size - _STL_HEADER) // 50:,}"
            raise SurfaceFileError(f"{path.name} is damaged: {fault}")
        count = stated
    if count > MAX_TRIANGLES:
        excess = f"{count:,} triangles, more than {MAX_TRIANGLES:,}"
        raise SurfaceFileError(f"{path.name} may hold {excess}")


def _stated_count(head: bytes, suffix: str) -> int | None:
    """Return the number of triangles in the header of a file; ``None`` if it states none."""
    if suffix == "stl" and b"\0" in head[:_STL_HEADER] and len(head) >= _STL_HEADER:
        return int(struct.unpack_from("<I", head, 80)[0])
    if suffix == "ply":
        stated = re.search(rb"^element\s+face\s+(\d+)\s*$", head, re.MULTILINE)
        return None if stated is None else int(stated[1])
    return None


def _parse(path: Path, suffix: str) -> tuple[FloatArray, NDArray[np.int32]]:
    """Return vertices in the file's unit, and faces."""
    import trimesh

    with reject_on_error(f"damaged mesh {path.name}"):
        loaded: Any = trimesh.load(path, file_type=suffix, process=False, skip_materials=True)
        mesh = loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded
        vertices = np.asarray(mesh.vertices, dtype=np.float64).view(np.ndarray)
        # A cloud of points has no faces.
        faces = np.asarray(getattr(mesh, "faces", ()), np.int64).view(np.ndarray).reshape(-1, 3)
    if len(faces) and not (faces.min() >= 0 and faces.max() < len(vertices)):
        raise SurfaceFileError(f"damaged mesh {path.name} (a triangle has a corner that is none)")
    return vertices, faces.astype(np.int32)


def merge_vertices(
    vertices: FloatArray, faces: NDArray[np.integer[Any]]
) -> tuple[FloatArray, NDArray[np.int32]]:
    """Return each vertex once: files repeat them for each triangle, or along seams."""
    order = np.lexsort(vertices.T).astype(np.int32)
    new = np.zeros(len(order), dtype=bool)
    new[:1] = True
    for axis in range(3):
        values = vertices[order, axis]
        new[1:] |= values[1:] != values[:-1]
    index = np.empty(len(order), np.int32)
    index[order] = np.cumsum(new, dtype=np.int32) - 1
    return vertices[order[new]], index[faces]


def remove_shared_faces(vertices: FloatArray, faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the faces (n, 3) without plane patches that two parts share, which become one.

    Patches of opposite orientation with the same border, whatever their triangles, enclose no
    volume: the number of times that the mesh winds around a point is the same without them.

    Args:
        vertices: [m], shape (m, 3), each once.
        faces: indices of vertices, shape (n, 3).
    """
    ends = np.roll(faces, -1, axis=1)
    is_shared = np.zeros(len(faces), dtype=bool)
    patches: dict[frozenset[tuple[int, int]], NDArray[np.intp]] = {}
    for patch in _plane_patches(vertices, faces):
        edges = set(zip(faces[patch].ravel().tolist(), ends[patch].ravel().tolist(), strict=True))
        turned = {(end, start) for start, end in edges}
        other = patches.pop(frozenset(turned - edges), None)
        if other is None:
            patches[frozenset(edges - turned)] = patch
        else:
            is_shared[np.append(patch, other)] = True
    return faces[~is_shared]


def _plane_patches(vertices: FloatArray, faces: NDArray[np.int32]) -> list[NDArray[np.intp]]:
    """Return the connected faces of one plane that end at an edge of more than two triangles."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    _, index, counts = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    index = index.ravel()
    order = np.argsort(index, kind="stable")
    sizes = counts[index[order]]
    pairs = (order[sizes == 2] // 3).reshape(-1, 2)
    pairs = pairs[np.prod(normals[pairs], axis=1).sum(axis=1) > 1.0 - _SAME_PLANE]
    graph = coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(faces), len(faces)))
    labels = connected_components(graph, directed=False)[1]
    rows = np.flatnonzero(np.isin(labels, labels[order[sizes > 2] // 3]))
    rows = rows[np.argsort(labels[rows], kind="stable")]
    return np.split(rows, np.flatnonzero(np.diff(labels[rows])) + 1)


def _repair(vertices: FloatArray, faces: NDArray[np.int32]) -> tuple[FloatArray, NDArray[np.int32]]:
    """Return the mesh with holes filled and triangles turned by trimesh."""
    import trimesh

    if find_spec("networkx") is None:  # trimesh turns triangles along its graphs
        raise ParameterError("repair", "needs the optional dependency: asperity[meshes]")
    repair: Any = trimesh.repair
    size = np.ptp(vertices, axis=0).max() or 1.0  # its tolerances are absolute
    with reject_on_error("the mesh cannot be repaired"):
        mesh = trimesh.Trimesh(vertices / size, faces, process=False)
        mesh.update_faces(mesh.unique_faces())
        repair.fix_winding(mesh)
        repair.fill_holes(mesh)
        repair.fix_normals(mesh, multibody=True)
    return size * np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int32)


OPEN = "open edges"
ORIENTATION = "edges of triangles with opposite orientation"
NON_MANIFOLD = "edges shared by more than two triangles"
DEGENERATE = "triangles without extent"
INVERTED = "bodies turned inside out"
INTERSECTING = "columns of nodes where the mesh overlaps itself"
TOUCHING = "sampled places where a part touches or overlaps another one: unite them first"
UNSOUND = (OPEN, ORIENTATION, INVERTED, INTERSECTING, TOUCHING)
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
    x, y, z = places[0].tolist()
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
    signs = 2 * (keys & 1) - 1
    keys >>= 1
    first = np.flatnonzero(np.r_[True, keys[1:] != keys[:-1]]) if len(keys) else np.empty(0, int)
    counts = np.diff(np.r_[first, len(keys)])
    return keys, first, counts, np.add.reduceat(signs, first) if len(first) else signs


def signed_volume(vertices: FloatArray, faces: NDArray[np.int32]) -> float:
    """Return the enclosed volume [m³]; negative where the triangles point inwards."""
    a = vertices[faces[:, 0]] - vertices[0]
    b = vertices[faces[:, 1]] - vertices[0]
    c = vertices[faces[:, 2]] - vertices[0]
    return float(np.einsum("ni,ni->", a, np.cross(b, c))) / 6.0


def build_tree(triangles: FloatArray) -> TriangleTree:
    """Return the tree of triangles (n, 3, 3) [m].

    Each node is halved at the median along the longest side of the box of its triangles' centres.
    The last leaf is filled with triangles of no extent.
    """
    leaves = 1
    while leaves * LEAF_SIZE < len(triangles):
        leaves *= 2
    order = _median_order(triangles, leaves)
    ordered = triangles[np.minimum(order, len(triangles) - 1)]
    ordered[order >= len(triangles)] = triangles[-1, 0]
    boxes = np.empty((2 * leaves - 1, 6), np.float32)
    _write_boxes(ordered.reshape(leaves, 3 * LEAF_SIZE, 3), boxes)
    return TriangleTree(ordered.reshape(-1, 9), boxes, leaves)


def _median_order(triangles: FloatArray, leaves: int) -> NDArray[np.int32]:
    """Return the indices of the triangles in the order of the leaves."""
    order = np.arange(leaves * LEAF_SIZE, dtype=np.int32)[None]
    centres = np.empty((order.size, 3), np.float32)
    centres[: len(triangles)] = triangles.mean(axis=1)
    centres[len(triangles) :] = triangles[-1, 0]
    while len(order) < leaves:
        places = centres[order]
        axis = np.ptp(places, axis=1).argmax(axis=1)
        keys = np.take_along_axis(places, axis[:, None, None], axis=2)[..., 0]
        del places
        half = order.shape[1] // 2
        parts = np.argpartition(keys, half, axis=1).astype(np.int32)
        order = np.take_along_axis(order, parts, axis=1).reshape(-1, half)
    return order.ravel()


def _write_boxes(corners: FloatArray, boxes: NDArray[np.float32]) -> None:
    """Write the boxes of all nodes, rounded outwards, from the corners (leaves, m, 3)."""
    leaves = len(corners)
    last = boxes[leaves - 1 :]
    lower = corners.min(axis=1).astype(np.float32)
    upper = corners.max(axis=1).astype(np.float32)
    last[:, :3] = np.nextafter(lower, np.float32(-np.inf))
    last[:, 3:] = np.nextafter(upper, np.float32(np.inf))
    while leaves > 1:
        children = boxes[leaves - 1 : 2 * leaves - 1].reshape(-1, 2, 6)
        leaves //= 2
        parents = boxes[leaves - 1 : 2 * leaves - 1]
        parents[:, :3] = children[:, :, :3].min(axis=1)
        parents[:, 3:] = children[:, :, 3:].max(axis=1)
