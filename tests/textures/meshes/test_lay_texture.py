"""A texture laid on a closed body, against the geometry of plates, spheres and cylinders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import asperity as asp
from asperity.cli.main import cli
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.textures.fields.potential_field import PotentialField
from asperity.textures.meshes.bake_body import bake_body
from asperity.textures.meshes.lay_texture import _corner_normals, _merge, lay_texture
from asperity.textures.meshes.mesh_body import MeshBody, find_faults

MM = 1e-3
WAVES = asp.Fourier(
    amplitudes=[0.03 * MM, 0.02 * MM], wavevectors=[[6000.0, 0.0], [2000.0, 5000.0]], phases=[0, 1]
)


def to_body(mesh: trimesh.Trimesh) -> MeshBody:
    return MeshBody.from_arrays(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64))


def plate(thickness: float = 1 * MM) -> MeshBody:
    return to_body(trimesh.creation.box((5 * MM, 4 * MM, thickness)))


def vertices_of(body: MeshBody, *, components: int = 1) -> FloatArray:
    """Return the vertices of a body that is closed, oriented, and a sphere in topology."""
    vertices, faces = _merge(body.triangles)
    assert find_faults(vertices, faces.reshape(-1, 3)) == []
    assert len(vertices) - len(faces) // 6 == 2 * components  # Euler: F = 2 (V - 2)
    return vertices


def heights(points: FloatArray, axes: tuple[int, int]) -> FloatArray:
    """Return the heights of the waves above their lowest point at two coordinates of points."""
    return WAVES.height(points[:, list(axes)]) - WAVES.extremes[0]


# --- geometry -------------------------------------------------------------------------------------


def test_plate_has_the_heights_of_the_texture() -> None:
    """On its top only: edges, sides and bottom stay where they are."""
    vertices = vertices_of(lay_texture(plate(), WAVES))
    x, y, z = vertices.T
    border = np.minimum(2.5 * MM - np.abs(x), 2.0 * MM - np.abs(y)) < 1e-9
    top = ~border & (z > 0.45 * MM)
    assert top.sum() > 2900
    np.testing.assert_allclose(z[top], 0.5 * MM + heights(vertices[top], (0, 1)), atol=1e-12)
    assert np.ptp(z[top]) > 0.09 * MM
    assert np.abs(z[~top]).max() == 0.5 * MM
    # Its triangles are flat pieces of waves: at most an eighth of the shortest wave is an edge.
    triangles = lay_texture(plate(), WAVES).triangles
    high = triangles[(triangles[..., 2] > 0.5 * MM).all(axis=1)]
    middle = high.mean(axis=1)
    error = middle[:, 2] - 0.5 * MM - heights(middle, (0, 1))
    assert np.abs(error).max() < 0.05 * np.ptp(WAVES.extremes)


@pytest.mark.parametrize(
    ("side", "axis", "sign", "axes"),
    [("+x", 0, 1.0, (1, 2)), ("-y", 1, -1.0, (2, 0)), ("-z", 2, -1.0, (0, 1))],
)
def test_sphere_is_displaced_along_its_radius(
    side: str, axis: int, sign: float, axes: tuple[int, int]
) -> None:
    """By w h: whole to 45 degrees from the axis, a cubic in the cosine to zero at 60 degrees."""
    ball = to_body(trimesh.creation.icosphere(5, radius=3 * MM))
    vertices = vertices_of(lay_texture(ball, WAVES, side))
    radius = np.linalg.norm(vertices, axis=1)
    normal = vertices / radius[:, None]
    r = np.clip((sign * normal[:, axis] - 0.5) / (np.sqrt(0.5) - 0.5), 0.0, 1.0)
    share = r * r * (3.0 - 2.0 * r)
    expected = share * heights(3 * MM * normal, axes)
    facets = 3 * MM * 0.0006  # of the sphere that is a mesh
    np.testing.assert_allclose(radius - 3 * MM, expected, atol=facets)
    assert expected.max() > 30 * facets
    assert (expected[r == 1.0] > 0.5 * expected.max()).any()


def test_normals_are_smooth_but_for_edges() -> None:
    """Radial on a cylinder of strips from rim to rim, constant on its caps and on a box."""
    cylinder = to_body(trimesh.creation.cylinder(2 * MM, 5 * MM, sections=40))
    normals = _corner_normals(cylinder.triangles)
    corners, flat = cylinder.triangles, np.abs(normals[..., 2]) > 0.5
    np.testing.assert_allclose(np.abs(normals[flat]), np.tile([0, 0, 1], (flat.sum(), 1)))
    side = corners[~flat] * [1.0, 1.0, 0.0]
    radial = side / np.linalg.norm(side, axis=1)[:, None]
    np.testing.assert_allclose(normals[~flat], radial, atol=1e-9)
    assert flat.any()
    assert len(radial) == 240  # six corners of forty strips
    box = _corner_normals(plate().triangles)
    np.testing.assert_allclose(np.abs(box).max(axis=-1), 1.0)


def test_heights_do_not_step_between_the_strips_of_a_cylinder() -> None:
    """With the normals of its facets, of 9 degrees, heights would step by 45 µm where they fade."""
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, (0.0, 1.0, 0.0))
    rod = trimesh.creation.cylinder(2 * MM, 4 * MM, sections=40, transform=turn)
    vertices = vertices_of(lay_texture(to_body(rod), WAVES))
    inner = vertices[np.abs(vertices[:, 0]) < 1.99 * MM]
    angle = np.arctan2(inner[:, 1], inner[:, 2])
    radius = np.hypot(inner[:, 1], inner[:, 2])
    fade = np.abs(np.abs(np.degrees(angle)) - 52.5) < 7.4
    assert fade.sum() > 300
    r = np.clip((np.cos(angle[fade]) - 0.5) / (np.sqrt(0.5) - 0.5), 0.0, 1.0)
    base = inner[fade] * (2 * MM / radius[fade])[:, None]
    expected = r * r * (3.0 - 2.0 * r) * heights(base, (0, 1))
    np.testing.assert_allclose(radius[fade] - 2 * MM, expected, atol=15e-6)


# --- the baked field ------------------------------------------------------------------------------


def test_force_is_that_of_the_texture_far_from_edges() -> None:
    body = lay_texture(plate(), WAVES)
    field = bake_body(body, 0.15 * MM, resolution=0.04 * MM)
    assert field.preparation[1] == (
        f"texture of {1e6 * np.ptp(WAVES.extremes):.4g} µm on faces within 60 degrees of +z"
    )
    rng = np.random.default_rng(0)
    xy = rng.uniform(-1.2 * MM, 1.2 * MM, (400, 2))
    z = WAVES.height(xy) - rng.uniform(0.01, 0.14, 400) * MM
    exact = asp.Surface(WAVES, "H", 1000.0, max_depth=0.15 * MM)
    lifted = np.column_stack([xy, z + 0.5 * MM - WAVES.extremes[0]])
    found = asp.Surface(field, "H", 1000.0).force(lifted)
    force = exact.force(np.column_stack([xy, z]))
    difference = np.linalg.norm(found - force, axis=1)
    assert difference.max() < 1000.0 * field.accuracy.bound
    assert np.sqrt(np.square(difference).mean()) < 0.1 * np.sqrt(np.square(force).sum(1).mean())
    assert np.abs(force[:, 0]).max() > 0.02  # the texture is felt sideways


def test_spacing_that_does_not_carry_the_texture_is_refused() -> None:
    body = lay_texture(plate(2 * MM), WAVES)
    assert 1.0 * MM < 4.0 * body.coarsest < 1.3 * MM
    with pytest.raises(ParameterError, match="a quarter of the shortest wave of the texture"):
        bake_body(body, 0.1 * MM, resolution=1.01 * body.coarsest)
    field = bake_body(body, 0.1 * MM, resolution=0.24 * MM)
    assert isinstance(field, PotentialField)


def test_textures_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"texture_side must be one of \+x, .*, got 'up'"):
        lay_texture(plate(), WAVES, "up")
    with pytest.raises(ParameterError, match=r"is too fine for this body: .* 2,000,000 triangles"):
        lay_texture(plate(), asp.Sinusoid(1e-6, 1e-5))
    cone = to_body(trimesh.creation.cone(1 * MM, 5 * MM))
    with pytest.raises(ParameterError, match="no face within 60 degrees"):
        lay_texture(cone, WAVES, "+z")
    assert vertices_of(lay_texture(cone, WAVES, "-z"))[:, 2].min() < -0.05 * MM


def dimple(depth: float) -> MeshBody:
    """Return a block with a dimple of 0.3 mm, whose radius of curvature is 0.09 mm²/depth."""
    block = trimesh.creation.box((4 * MM, 4 * MM, 2 * MM))
    for _ in range(5):
        block = block.subdivide()
    x, y, z = block.vertices.T
    sink = depth * np.exp(-0.5 * (x * x + y * y) / (0.3 * MM) ** 2)
    block.vertices[:, 2] -= np.where(z > 0.99 * MM, sink, 0.0)
    return to_body(block)


def test_texture_higher_than_the_radius_of_curvature_is_refused() -> None:
    waves = asp.Sinusoid(0.35 * MM, 4 * MM)
    with pytest.raises(ParameterError, match=r"radius of curvature of the body at \("):
        lay_texture(dimple(0.4 * MM), waves)
    lay_texture(dimple(0.1 * MM), waves)


def test_command(tmp_path: Path) -> None:
    mesh, path = tmp_path / "block.stl", tmp_path / "block.field"
    trimesh.creation.box((4.0, 4.0, 2.0)).export(mesh)
    waves = "sinusoid:amplitude=0.05mm,period=1mm"
    options = ["--texture", waves, "--texture-side", "-x", "--max-depth", "0.2mm", "-o", str(path)]
    body = ["bake", str(mesh), "--body", "--unit", "mm", "--resolution", "0.1mm", *options]
    result = CliRunner().invoke(cli, body)
    assert result.exit_code == 0, result.output
    assert "texture of 100 µm on faces within 60 degrees of -x" in " ".join(result.output.split())
    # The texture's x is the body's y: a crest at y = 0.25 mm, a trough at -0.25 mm.
    points = np.array([[-2.02, 0.25, 0.0], [-2.02, -0.25, 0.0], [2.02, 0.25, 0.0]]) * MM
    force = asp.Surface(path, "H", 1000.0).force(points)
    assert force[0, 0] == pytest.approx(-0.08, abs=0.02)
    assert np.abs(force[1:]).max() < 0.02
    refused = CliRunner().invoke(cli, ["bake", "cloth", "--texture", waves, "-o", str(path)])
    assert "texture requires --body" in str(refused.exception)
