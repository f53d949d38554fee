"""A texture laid on a closed body: its height displaces the surface along smooth normals."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.measured.lengths import format_length
from asperity.textures.meshes.mesh_body import MeshBody, merge_vertices
from asperity.textures.texture import Texture

SIDES = ("+x", "+y", "+z", "-x", "-y", "-z")
# Cosines of the angles of normal and axis at which the texture begins and is whole.
_STEEPEST = 0.5
_WHOLE = math.sqrt(0.5)
# Triangles that meet at more than 45 degrees have an edge, across which no normal is smooth.
_EDGE = math.sqrt(0.5)
_EDGES_PER_WAVE = 8
_NODES_PER_WAVE = 4
_MAX_TRIANGLES = 2_000_000
_SAMPLES = 4096


def lay_texture(body: MeshBody, texture: Texture, side: str = "+z") -> MeshBody:
    """Return a body with a texture on the faces that are seen from one side.

    The texture is projected along an axis: the height of a point is that at its two other
    coordinates, counted from the lowest point of the texture. The point is moved by it along its
    normal, which is interpolated over the triangles. Where the normal is 45 to 60 degrees from the
    axis the height fades to zero, so that no wave on the body is longer than twice its length in
    the texture. Edges of more than 45 degrees towards a steeper face stay where they are.

    Args:
        body: the body.
        texture: the texture.
        side: ``"+x"``, ``"-x"``, ``"+y"``, ``"-y"``, ``"+z"`` or ``"-z"``, the axis that points to
            the viewer. The texture's x and y are y and z, z and x, or x and y of the body.

    Raises:
        ParameterError: no face is seen from this side, the texture is too fine for the body, or too
            high for its curvature.
    """
    import trimesh

    if side not in SIDES:
        raise ParameterError("texture_side", f"must be one of {', '.join(SIDES)}", side)
    axis = SIDES.index(side) % 3
    up = (1.0 if side[0] == "+" else -1.0) * np.eye(3)[axis]
    plane = [(axis + 1) % 3, (axis + 2) % 3]
    wave = _wavelength(texture, *(corner[plane] for corner in body.box))
    corners = _refine_side(body, up, wave / _EDGES_PER_WAVE)
    points, faces = _merge(corners)
    normals = _unit(corners[..., 3:6].reshape(-1, 3))
    shares = np.ones(len(points))
    np.minimum.at(shares, faces, _share(normals, up))
    if not shares.any():
        raise ParameterError("texture_side", "has no face within 60 degrees of it", side)
    heights = texture.height(points[:, plane]) - texture.extremes[0]
    moved = points + (shares * heights)[:, None] * _unit(_sums(faces, normals))
    triangles = moved[faces.reshape(-1, 3)]
    before = trimesh.triangles.cross(corners[..., :3])
    after = trimesh.triangles.cross(triangles)
    folded = (before * after).sum(axis=1) < 0.0
    if folded.any():
        place = ", ".join(map(format_length, corners[folded][0, 0, :3].tolist()))
        reason = f"is higher than the radius of curvature of the body at ({place})"
        raise ParameterError("texture", reason, texture)
    height = format_length(float(np.ptp(texture.extremes)))
    note = f"texture of {height} on faces within 60 degrees of {side}"
    return replace(
        body, triangles=triangles, notes=(*body.notes, note), coarsest=wave / _NODES_PER_WAVE
    )


def _wavelength(texture: Texture, lower: FloatArray, upper: FloatArray) -> float:
    """Return the length [m] of a wave whose slope and Hessian have the RMS of the texture's."""
    xy = np.random.default_rng(0).uniform(lower, upper, (_SAMPLES, 2))
    hessian = float(np.square(np.linalg.norm(texture.hessian(xy), 2, axis=(1, 2))).mean())
    slope = float(np.square(texture.gradient(xy)).sum(axis=1).mean())
    return 2.0 * math.pi * math.sqrt(slope / hessian) if hessian > 0.0 else math.inf


def _share(normals: FloatArray, up: FloatArray) -> FloatArray:
    """Return the share of the texture's height at unit normals (n, 3)."""
    ramp = np.clip((normals @ up - _STEEPEST) / (_WHOLE - _STEEPEST), 0.0, 1.0)
    return np.asarray(ramp * ramp * (3.0 - 2.0 * ramp))


def _merge(corners: FloatArray) -> tuple[FloatArray, NDArray[np.int32]]:
    """Return the distinct corners of triangles (m, 3) and the index of each corner (3 n,)."""
    return merge_vertices(corners[..., :3].reshape(-1, 3), np.arange(3 * len(corners)))


def _unit(vectors: FloatArray) -> FloatArray:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, 1e-300))


def _corner_normals(triangles: FloatArray) -> FloatArray:
    """Return the normals at the corners (n, 3, 3): means over the triangles that meet smoothly.

    They are weighted by the angles of the triangles at the corner (Thürmer and Wüthrich 1998).
    """
    import trimesh
    from scipy.sparse import coo_matrix, csgraph

    library: Any = trimesh  # its functions are not typed
    vertices = _merge(triangles)[1].reshape(-1, 3)
    pairs, edges = library.graph.face_adjacency(vertices, return_edges=True)
    flat = _unit(trimesh.triangles.cross(triangles))
    is_smooth = flat[pairs].prod(axis=1).sum(axis=1) > _EDGE
    pairs = pairs[is_smooth]
    edges = edges[is_smooth]
    # Corners of both triangles at each end of their edge.
    ends = (vertices[pairs][:, None] == edges[:, :, None, None]).argmax(axis=-1)
    links = (3 * pairs[:, None] + ends).reshape(-1, 2).T
    size = vertices.size
    graph = coo_matrix((np.ones(len(links[0]), bool), (links[0], links[1])), (size, size))
    group = csgraph.connected_components(graph, directed=False)[1]
    weighted = library.triangles.angles(triangles)[..., None] * flat[:, None]
    smooth = _unit(_sums(group, weighted))[group].reshape(-1, 3, 3)
    # At the tip of a cone the mean is the normal of none of its triangles.
    near = (smooth * flat[:, None]).sum(axis=-1, keepdims=True) > _EDGE
    return np.where(near, smooth, flat[:, None])


def _sums(group: NDArray[np.integer[Any]], vectors: FloatArray) -> FloatArray:
    """Return the sums of vectors by the group of each, from 0 up."""
    parts = vectors.reshape(-1, 3).T
    return np.stack([np.bincount(group, part) for part in parts], axis=1)


def _refine_side(body: MeshBody, up: FloatArray, longest: float) -> FloatArray:
    """Return triangles (n, 3, 7): corners, normals, and marks of the side with the texture.

    Their edges are at most so long on this side, and 8 times as long elsewhere.
    """
    ones = np.ones((len(body.triangles), 3, 1))
    corners = _refine(
        np.dstack([body.triangles, _corner_normals(body.triangles), ones]), 8.0 * longest
    )
    points, faces = _merge(corners)
    marks = np.zeros(len(points))
    marks[faces[_share(_unit(corners[..., 3:6].reshape(-1, 3)), up) > 0.0]] = 1.0
    corners[..., 6] = marks[faces].reshape(-1, 3)
    return _refine(corners, longest)


def _refine(corners: FloatArray, longest: float) -> FloatArray:
    """Return triangles (n, 3, 7) bisected until no edge between marks is longer.

    The marks of its ends add up to at least 1. Whether an edge is bisected depends on its own ends
    alone, so that both of its triangles end with the same points on it.
    """
    while True:
        ends = np.roll(corners, -1, axis=1)
        x, y, z = np.moveaxis(np.square(ends[..., :3] - corners[..., :3]), -1, 0)
        squares = (x + y + z) * (ends[..., 6] + corners[..., 6] >= 1.0)
        rows = np.flatnonzero(squares.max(axis=1) > longest**2)
        if len(rows) == 0:
            return corners
        if len(corners) + len(rows) > _MAX_TRIANGLES:
            reason = f"is too fine for this body: it takes more than {_MAX_TRIANGLES:,} triangles"
            raise ParameterError("texture", reason)
        start = squares[rows].argmax(axis=1)
        a = corners[rows, start]
        b = corners[rows, (start + 1) % 3]
        c = corners[rows, (start + 2) % 3]
        middle = 0.5 * (a + b)
        corners[rows] = np.stack([a, middle, c], axis=1)
        corners = np.concatenate([corners, np.stack([middle, b, c], axis=1)])
