"""Bodies dilated by a ball, against the volume and the distances of solids of boxes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.textures.meshes.dilate_body import dilate_body
from asperity.textures.meshes.mesh_body import MeshBody, find_faults, merge_vertices, signed_volume

MM = 1e-3
Box = tuple[tuple[float, float, float], tuple[float, float, float]]
FOOT: Box = ((0.0, 0.0, 0.0), (6 * MM, 3 * MM, 2 * MM))
ARM: Box = ((4 * MM, 0.0, 2 * MM), (6 * MM, 3 * MM, 6 * MM))
"""With the foot an L, concave along one edge."""


def to_body(*boxes: Box) -> MeshBody:
    """Return a box, or the L of both."""
    if len(boxes) == 1:
        mesh = trimesh.creation.box(bounds=np.array(boxes[0]))
    else:
        profile = [[0.0, 0.0], [6.0, 0.0], [6.0, 6.0], [4.0, 6.0], [4.0, 2.0], [0.0, 2.0]]
        mesh = extrude(MM * np.array(profile), 3 * MM)
    return MeshBody.from_arrays(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64))


def extrude(profile: FloatArray, depth: float) -> trimesh.Trimesh:
    """Return the prism of the L above, profile in x and z."""
    front = np.column_stack([profile[:, 0], np.zeros(6), profile[:, 1]])
    caps = [[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4]]
    faces = [*caps, *[[a + 6, c + 6, b + 6] for a, b, c in caps]]
    for i in range(6):
        j = (i + 1) % 6
        faces += [[i, i + 6, j], [j, i + 6, j + 6]]
    vertices = np.concatenate([front, front + np.array([0.0, depth, 0.0])])
    return trimesh.Trimesh(vertices, faces, process=False)


def distance(points: FloatArray, boxes: tuple[Box, ...]) -> FloatArray:
    """Return the distance of points (n, 3) outside from the nearest box."""
    parts = []
    for box in boxes:
        lower, upper = np.array(box)
        outside = np.maximum(np.maximum(lower - points, points - upper), 0.0)
        parts.append(np.linalg.norm(outside, axis=1))
    return np.asarray(np.min(parts, axis=0))


def volume(body: MeshBody) -> float:
    corners = body.triangles.reshape(-1, 3)
    vertices, faces = merge_vertices(corners, np.arange(len(corners)))
    faces = faces.reshape(-1, 3)
    assert find_faults(vertices, faces) == []
    assert 2 * len(vertices) - len(faces) == 4  # Euler: a sphere in topology
    return signed_volume(vertices, faces)


@pytest.mark.parametrize("radius", [0.5 * MM, 2 * MM])
def test_box_has_the_volume_of_steiners_formula(radius: float) -> None:
    a, b, c = FOOT[1]
    edges = math.pi * radius**2 * (a + b + c)
    sides = 2.0 * radius * (a * b + b * c + c * a)
    expected = a * b * c + sides + edges + 4.0 / 3.0 * math.pi * radius**3
    found = volume(dilate_body(to_body(FOOT), radius))
    assert 0.996 * expected < found < expected  # triangles lie inside of the rounded edges


@pytest.mark.parametrize("boxes", [(FOOT,), (FOOT, ARM)])
def test_surface_is_at_the_radius(boxes: tuple[Box, ...]) -> None:
    """Corners to the error of interpolation; the printed error is that of the triangles."""
    radius = 1 * MM
    body = to_body(*boxes)
    assert volume(body) > 0.0
    dilated = dilate_body(body, radius)
    error = np.abs(distance(dilated.triangles.reshape(-1, 3), boxes) - radius)
    assert error.max() < 0.06 * radius
    assert np.median(error) < 1e-6 * radius
    centres = dilated.triangles.mean(axis=1)
    worst = np.abs(distance(centres, boxes) - radius).max()
    (note,) = dilated.notes
    stated = float(note.split("wrong by at most ")[1].split(" µm")[0]) * 1e-6
    assert 0.2 * worst < stated <= worst * (1.0 + 1e-3)


def test_ball_that_exceeds_the_body_is_refused() -> None:
    with pytest.raises(ParameterError, match="at most the shortest side of the body, 2 mm"):
        dilate_body(to_body(FOOT), 2.1 * MM)
    with pytest.raises(ParameterError, match="tip_radius must be positive"):
        dilate_body(to_body(FOOT), 0.0)


def test_texture_is_resolved_or_refused() -> None:
    """The nodes of a field of a textured body stay as fine as without the ball."""
    body = replace(to_body(FOOT), coarsest=0.2 * MM)
    assert dilate_body(body, 0.5 * MM).coarsest == body.coarsest
    fine = replace(body, coarsest=0.01 * MM)
    with pytest.raises(ParameterError, match="the texture needs 10 µm"):
        dilate_body(fine, 0.5 * MM)
