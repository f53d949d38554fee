"""A closed body dilated by a ball: what the centre of a round tip feels."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.core.processes import run_in_threads
from asperity.measured.lengths import format_length
from asperity.textures.meshes.bake_body import BodyLoops
from asperity.textures.meshes.mesh_body import MeshBody
from asperity.textures.meshes.mesh_potential import BodyLaw

# Nodes at which the distance from the body is computed, at most, and steps of the lattice per
# radius, more of which would not be seen: triangles are then 1 % of the radius inside.
_MAX_NODES = 2_000_000
_STEPS_PER_RADIUS = 6
_SAMPLES = 1000
# Least distance of a node from the dilated surface, in steps: a triangle needs some extent.
_LEAST_DISTANCE = 1e-6

# Even permutations of the corners of a tetrahedron: those that are inside come first.
_ONE_INSIDE = ((0, 1, 2, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 2, 1, 0))
_TWO_INSIDE = ((0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 2, 0), (2, 3, 0, 1))

IndexArray = NDArray[np.intp]


def dilate_body(body: MeshBody, radius: float) -> MeshBody:
    """Return all places of the centre of a ball that touches or overlaps a body, as a body.

    Its surface is where the distance from the body is the radius: that of a lattice, interpolated
    in the six tetrahedra of each of its cells (marching tetrahedra).

    Args:
        body: the body.
        radius: of the ball [m].

    Raises:
        ParameterError: the radius is not positive, or exceeds the shortest side of the body, or
            the body has a texture that the lattice would not resolve.

    Reference:
        Doi and Koide (1991), An efficient method of triangulating equi-valued surfaces by using
        tetrahedral cells.
    """
    check_positive("tip_radius", radius, "m")
    lower, upper = body.box
    shortest = float((upper - lower).min())
    if radius > shortest:
        raise ParameterError(
            "tip_radius",
            f"must be at most the shortest side of the body, {format_length(shortest)}",
            radius,
        )
    sides = upper - lower + 2.0 * radius
    step = max(float(np.cbrt(sides.prod() / _MAX_NODES)), radius / _STEPS_PER_RADIUS)
    if step > body.coarsest:
        needed = f"a lattice of {format_length(step)} is finest, the texture needs"
        reason = f"cannot be applied: {needed} {format_length(body.coarsest)}"
        raise ParameterError("tip_radius", reason, radius)
    counts = np.ceil(sides / step).astype(int) + 3
    start = 0.5 * (lower + upper - step * (counts - 1))
    ticks = [start[axis] + step * np.arange(counts[axis]) for axis in range(3)]
    inside = _signed_distance(body, radius + 2.0 * step, ticks) + radius
    least = _LEAST_DISTANCE * step
    inside = np.where(np.abs(inside) < least, np.copysign(least, inside), inside)
    edges = np.concatenate(list(_crossed_edges(inside)))
    keys = edges.min(axis=-1) * inside.size + edges.max(axis=-1)
    keys, faces = np.unique(keys, return_inverse=True)
    nodes = np.stack(np.divmod(keys, inside.size), axis=-1)
    places = start + step * np.stack(np.unravel_index(nodes, inside.shape), axis=-1)
    values = inside.ravel()[nodes]
    share = values[:, :1] / (values[:, :1] - values[:, 1:])
    vertices = places[:, 0] + share * (places[:, 1] - places[:, 0])
    dilated = MeshBody.from_arrays(vertices, faces.reshape(-1, 3).astype(np.int32), body.name)
    error = _greatest_error(body, dilated, radius)
    note = (
        f"probed by a ball of radius {format_length(radius)}, whose centre is the position; its"
        f" surface is wrong by at most {format_length(error)} at {_SAMPLES} sampled places"
    )
    dilated = replace(dilated, faults=body.faults, repaired=body.repaired, coarsest=body.coarsest)
    return replace(dilated, notes=(*body.notes, note))


def _signed_distance(body: MeshBody, margin: float, ticks: list[FloatArray]) -> FloatArray:
    """Return the distance [m] from a body at the nodes of a lattice, at least -margin.

    It is negative outside.
    """
    xy = np.stack(np.meshgrid(ticks[0], ticks[1], indexing="ij"), axis=-1).reshape(-1, 2)
    distance = np.empty((len(xy), len(ticks[2])))
    at_once = len(ticks[1])
    loops = BodyLoops(body, BodyLaw(1.0, margin, math.inf))

    def fill(first: int) -> None:
        part = slice(first, first + at_once)
        loops.columns(xy[part], ticks[2], margin, distance[part])

    run_in_threads(fill, range(0, len(xy), at_once), None)
    return distance.reshape([len(axis) for axis in ticks])


def _crossed_edges(inside: FloatArray) -> Iterator[IndexArray]:
    """Yield triangles as the edges on which their corners lie, (n, 3, 2) nodes.

    Args:
        inside: positive at nodes inside, shape (i, j, k).
    """
    is_inside = inside > 0.0
    cells = np.lib.stride_tricks.sliding_window_view(is_inside, (2, 2, 2)).reshape(
        *[count - 1 for count in inside.shape], 8
    )
    crossed = np.flatnonzero(cells.any(axis=-1) & ~cells.all(axis=-1))
    strides = np.array([inside.shape[1] * inside.shape[2], inside.shape[2], 1])
    corners = np.stack(np.unravel_index(crossed, cells.shape[:3]), axis=-1) @ strides
    flat = is_inside.ravel()
    for axes in permutations(range(3)):
        path = np.append(0, np.cumsum(strides[list(axes)]))
        if np.linalg.det(np.eye(3)[list(axes)]) < 0.0:
            path = path[[0, 1, 3, 2]]
        nodes = corners[:, None] + path
        yield from _cut_tetrahedra(nodes, flat[nodes])


def _cut_tetrahedra(nodes: IndexArray, is_inside: NDArray[np.bool_]) -> Iterator[IndexArray]:
    """Yield the triangles in tetrahedra of nodes (n, 4), whose normals point out of the body."""
    count = is_inside.sum(axis=1)
    for i, j, k, m in _ONE_INSIDE:
        triangle = [[i, j], [i, k], [i, m]]
        yield nodes[(count == 1) & is_inside[:, i]][:, triangle]
        yield nodes[(count == 3) & ~is_inside[:, i]][:, triangle[::-1]]
    for i, j, k, m in _TWO_INSIDE:
        rows = nodes[(count == 2) & is_inside[:, i] & is_inside[:, j]]
        yield rows[:, [[i, k], [i, m], [j, m]]]
        yield rows[:, [[i, k], [j, m], [j, k]]]


def _greatest_error(body: MeshBody, dilated: MeshBody, radius: float) -> float:
    """Return how far sampled triangles of a dilated body are from their place, at most [m]."""
    chosen = np.random.default_rng(0).integers(len(dilated.triangles), size=_SAMPLES)
    loops = BodyLoops(body, BodyLaw(1.0, radius, math.inf))
    errors = []
    for place in dilated.triangles[chosen].mean(axis=1):
        distance = np.empty((1, 1))
        loops.columns(place[None, :2], place[2:], 2.0 * radius, distance)
        errors.append(abs(float(distance[0, 0]) + radius))
    return max(errors)
