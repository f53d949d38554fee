"""Closed bodies from meshes: closest points, faults, and law H baked inside them."""

from __future__ import annotations

import struct
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import asperity as asp
from asperity.cli.main import cli
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.textures.catalogue import as_texture
from asperity.textures.fields.bake import BakeGoal
from asperity.textures.fields.field_file import save_field
from asperity.textures.fields.potential_field import PotentialField
from asperity.textures.meshes.bake_body import BodyLoops, bake_body
from asperity.textures.meshes.mesh_body import MeshBody, load_mesh
from asperity.textures.meshes.mesh_potential import BodyLaw
from asperity.textures.texture import Texture

MM = 1e-3


def to_body(mesh: trimesh.Trimesh) -> MeshBody:
    return MeshBody.from_arrays(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64))


def exact(body: MeshBody, points: np.ndarray, max_depth: float = 1.0) -> np.ndarray:
    law = BodyLaw(1.0, max_depth, 0.0)
    return BodyLoops(body, law).evaluate(np.ascontiguousarray(points, dtype=float))


@cache
def cube() -> MeshBody:
    turn = trimesh.transformations.rotation_matrix(0.4, (1.0, 2.0, 0.5))
    return to_body(trimesh.creation.box((4 * MM, 4 * MM, 4 * MM), transform=turn))


@cache
def baked(name: str) -> PotentialField:
    makers = {
        "cube": cube,
        "torus": lambda: to_body(trimesh.creation.torus(3 * MM, 1 * MM)),
        "tetrahedron": lambda: to_body(
            trimesh.Trimesh(
                4 * MM * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]),
                [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]],
            )
        ),
    }
    return bake_body(makers[name](), 0.6 * MM, resolution=0.15 * MM)


# --- the exact law --------------------------------------------------------------------------------


def test_sphere_is_law_d_to_half_its_radius_and_quadratic_beyond() -> None:
    """Beyond, the god-object splits over the whole sphere: U = (r² - 2 |p|²)/4 for c = 1."""
    radius = 2 * MM
    body = to_body(trimesh.creation.icosphere(5, radius=radius))
    direction = np.array([0.36, 0.48, 0.8])
    sizes = np.linspace(0.05, 0.999, 40) * radius
    found = exact(body, sizes[:, None] * direction)
    outer = 0.5 * (radius - sizes) ** 2
    inner = 0.25 * (radius**2 - 2.0 * sizes**2)
    expected = np.where(sizes >= 0.5 * radius, outer, inner)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-3 * radius**2)
    pull = np.where(sizes >= 0.5 * radius, radius - sizes, sizes)
    np.testing.assert_allclose(found[:, 1:4], pull[:, None] * direction, atol=0.03 * radius)


def test_box_is_exact_at_faces_and_edges() -> None:
    """At an edge against the definition, maximised over a grid."""
    body = to_body(trimesh.creation.box((4 * MM, 6 * MM, 4 * MM)))
    face = np.array([[0.1, 0.2, 1.7], [0.3, -0.2, 1.2], [0.0, 1.0, 1.05]]) * MM
    depth = 2 * MM - face[:, 2]
    found = exact(body, face)
    np.testing.assert_allclose(found[:, 0], 0.5 * depth**2, rtol=1e-12)
    np.testing.assert_allclose(found[:, 3], depth, rtol=1e-12)
    rng = np.random.default_rng(0)
    corner = 2 * MM - rng.uniform(0.05, 0.4, (40, 2)) * MM
    points = np.column_stack([corner[:, 0], np.zeros(40), corner[:, 1]])
    found = exact(body, points)
    for point, value in zip(points, found, strict=True):
        ticks = np.linspace(0.0, 2.0 * MM, 801)
        y = np.stack(np.meshgrid(ticks, ticks), axis=-1)
        phi = 0.5 * np.square(2 * MM - y.max(axis=-1))
        best = 0.5 * (phi - np.square(y - point[[0, 2]]).sum(axis=-1)).max()
        assert value[0] == pytest.approx(best, abs=2e-3 * MM * 2.5e-3 * MM + 1e-3 * best)


def test_outside_there_is_nothing() -> None:
    rng = np.random.default_rng(1)
    torus = to_body(trimesh.creation.torus(3 * MM, 1 * MM))
    points = rng.uniform(-5 * MM, 5 * MM, (3000, 3))
    around = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 3 * MM, points[:, 2])
    found = exact(torus, points)
    assert not found[around > 1.001 * MM].any()
    inside = around < 0.95 * MM
    assert inside.sum() > 50
    assert (found[inside, 0] > 0.0).all()


def test_inside_on_lines_through_vertices_and_edges() -> None:
    """The vertical lines of this lattice meet vertices, edges and vertical faces."""
    body = to_body(trimesh.creation.box((4.0, 4.0, 4.0)).subdivide())
    ticks = np.arange(-3.0, 3.5, 0.5)
    points = np.stack(np.meshgrid(ticks, ticks, ticks), axis=-1).reshape(-1, 3)
    found = exact(body, points, 10.0)[:, 0] > 0.0
    np.testing.assert_array_equal(found, np.abs(points).max(axis=1) < 2.0)


def test_closest_points_agree_with_brute_force() -> None:
    mesh = trimesh.creation.icosphere(3, radius=2.0)  # trimesh's tolerances are absolute
    mesh.vertices *= 1.0 + 0.2 * np.sin(3.0 * mesh.vertices[:, [1, 2, 0]])
    points = np.random.default_rng(2).uniform(-1.0, 1.0, (50, 3))
    found = exact(to_body(mesh), points, 100.0)[:, 4]
    triangles = np.asarray(mesh.triangles)
    for point, distance in zip(points, found, strict=True):
        closest = trimesh.triangles.closest_point(triangles, np.tile(point, (len(triangles), 1)))
        least = np.linalg.norm(closest - point, axis=1).min()
        assert distance == pytest.approx(least, rel=1e-12)


# --- the baked field ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["cube", "torus", "tetrahedron"])
def test_secants_are_below_the_certified_gain(name: str) -> None:
    """Also over edges and through corners; a bound 2 % below the attained gain fails."""
    field = baked(name)
    surface = asp.Surface(field, "H", 1000.0)
    rng = np.random.default_rng(3)
    corners = field.source.domain.points(rng.uniform(size=(30_000, 2)))
    z = rng.uniform(field.grid.floor, field.source.extremes[1], len(corners))
    a = np.column_stack([corners, z])
    b = a + rng.normal(size=a.shape) * 10 ** rng.uniform(-7, -3, (len(a), 1))
    rates = np.linalg.norm(surface.force(b) - surface.force(a), axis=1)
    rates /= 1000.0 * np.linalg.norm(b - a, axis=1)
    assert 0.9 < rates.max() <= field.gain.upper
    assert field.gain.upper <= 1.15


@pytest.mark.parametrize("name", ["cube", "tetrahedron"])
def test_closed_paths_gain_nothing(name: str) -> None:
    """The midpoint rule on short chords; a field with curl gains more by orders of magnitude."""
    surface = asp.Surface(baked(name), "H", 1000.0)
    angle = np.linspace(0.0, 2.0 * np.pi, 40_001)
    rng = np.random.default_rng(4)
    for _ in range(3):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        centre = rng.uniform(-1 * MM, 1 * MM, 3)
        path = centre + 1.5 * MM * (
            np.cos(angle)[:, None] * frame[0] + np.sin(angle)[:, None] * frame[1]
        )
        middle, step = 0.5 * (path[1:] + path[:-1]), np.diff(path, axis=0)
        force = surface.force(middle)
        scale = np.abs((force * step).sum(axis=1)).sum()
        assert abs((force * step).sum()) < 1e-7 * scale
        twisted = force + 0.01 * np.cross(frame[2], force)
        assert abs((twisted * step).sum()) > 1e-4 * scale


def test_force_is_close_to_exact_h() -> None:
    field, body = baked("cube"), cube()
    surface = asp.Surface(field, "H", 1.0)
    loops = BodyLoops(body, BodyLaw(1.0, 0.6 * MM, 0.0))
    probes = loops.surface_probes(np.random.default_rng(5).uniform(0.0, 0.6 * MM, 2000))
    probes = probes[loops.evaluate(probes)[:, 4] > 0.0]
    difference = surface.force(probes) - loops.evaluate(probes)[:, 1:4]
    largest = np.linalg.norm(difference, axis=1).max()
    assert largest <= field.accuracy.bound
    assert 0.05 * 0.6 * MM < largest < 0.2 * 0.6 * MM
    outside = np.array([[9.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 0.0, -4.0]]) * MM
    assert not surface.force(outside).any()


def test_contact_ends_within_half_a_spacing_after_all_passes() -> None:
    """The grid needs no more room around a body however often its field is smoothed."""
    goal = BakeGoal(max_gain=0.5)  # cannot be reached
    body = to_body(trimesh.creation.box((4 * MM, 3 * MM, 2 * MM)))
    field = bake_body(body, 0.5 * MM, resolution=0.125 * MM, goal=goal)
    assert field.passes == goal.passes
    surface = asp.Surface(field, "H", max_depth=0.5 * MM)
    places = np.random.default_rng(2).uniform(-1.0, 1.0, (4000, 3))
    axis = np.arange(4000) % 3
    places[np.arange(4000), axis] = np.sign(places[np.arange(4000), axis])
    half = np.array([2.0, 1.5, 1.0]) * MM
    assert not surface.force(places * (half + 0.5 * field.resolution)).any()
    places[np.abs(places) < 1.0] *= 0.4  # away from the edges, which are rounded
    assert surface.force(places * (half - 0.5 * field.resolution)).any(axis=1).all()


def test_heights_are_those_seen_from_above(tmp_path: Path) -> None:
    body = to_body(trimesh.creation.icosphere(4, radius=2 * MM))
    field = bake_body(body, 0.5 * MM, resolution=0.2 * MM)
    nodes = field.grid.positions(np.array([[12, 12], [10, 15]]))
    heights = field.height(nodes)
    expected = np.sqrt((2 * MM) ** 2 - np.square(nodes).sum(axis=1))
    np.testing.assert_allclose(heights, expected, atol=0.02 * MM)
    assert field.filled_mask is not None
    assert field.filled_mask[0, 0]
    assert not field.filled_mask.all()
    assert "seen from above" in field.preparation[0]
    loaded = _saved(field, tmp_path / "ball.field")
    np.testing.assert_array_equal(loaded.filled_mask, field.filled_mask)


def _saved(field: PotentialField, path: Path) -> Texture:
    save_field(path, field)
    return as_texture(path)


def test_thin_parts_are_reported(tmp_path: Path) -> None:
    plate = trimesh.creation.box((6 * MM, 6 * MM, 0.6 * MM))
    field = bake_body(to_body(plate), 0.3 * MM, resolution=0.1 * MM)
    assert field.thin_regions == ()
    assert _saved(field, tmp_path / "plate.field").thin_regions == ()
    dumbbell = trimesh.creation.box((6 * MM, 2 * MM, 2 * MM))
    vertices = dumbbell.subdivide().subdivide().vertices.copy()
    waist = np.abs(vertices[:, 0]) < 1 * MM
    vertices[waist, 2] *= 0.25
    faces = dumbbell.subdivide().subdivide().faces
    field = bake_body(to_body(trimesh.Trimesh(vertices, faces)), 0.5 * MM, resolution=0.15 * MM)
    region = field.thin_regions[0]
    assert region.half_thickness == pytest.approx(0.25 * MM, rel=0.05)
    assert abs(region.at[0]) < 1.5 * MM
    assert abs(region.at[2]) < 0.1 * MM
    loaded = _saved(field, tmp_path / "dumbbell.field")
    assert loaded.thin_regions == field.thin_regions
    shown, kept = field.thin_map, loaded.thin_map
    assert shown is not None
    assert kept is not None
    np.testing.assert_array_equal(kept, shown)
    assert np.nanmin(shown) == region.half_thickness
    x, y = field.grid.positions(np.argwhere(np.isfinite(shown.T))).T
    assert np.abs(x).max() < 2.0 * MM  # the waist, and not the thick ends
    assert 0.7 * MM < np.abs(y).max() < 1.0 * MM
    assert "thinner than twice the depth: 1, the thinnest at (" in loaded.preparation[-2]


def test_thin_parts_between_nodes_are_found() -> None:
    """A fin of 0.1 mm between levels of nodes 0.3 mm apart; the rim of a lens is not thin."""
    block = trimesh.creation.box((2 * MM, 2 * MM, 2 * MM))
    fin = trimesh.creation.box((2 * MM, 2 * MM, 0.1 * MM))
    fin.apply_translation((3 * MM, 0.0, 0.13 * MM))
    field = bake_body(
        to_body(trimesh.util.concatenate([block, fin])), 0.5 * MM, resolution=0.3 * MM
    )
    (region,) = field.thin_regions
    assert region.half_thickness == pytest.approx(0.05 * MM, rel=1e-9)
    assert region.at[2] == pytest.approx(0.13 * MM, abs=1e-6 * MM)
    assert 2 * MM < region.at[0] < 4 * MM
    ball = to_body(trimesh.creation.icosphere(4, radius=2 * MM))
    assert bake_body(ball, 0.5 * MM, resolution=0.2 * MM).thin_regions == ()


# --- bad input ------------------------------------------------------------------------------------


def test_faults_are_counted_with_their_place() -> None:
    mesh = trimesh.creation.icosphere(2, radius=1 * MM)
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)
    with pytest.raises(SurfaceFileError, match=r"3 open edges, one at \("):
        MeshBody.from_arrays(vertices, faces[1:])
    turned = faces.copy()
    turned[5] = turned[5, ::-1]
    with pytest.raises(SurfaceFileError, match="3 edges of triangles with opposite orientation"):
        MeshBody.from_arrays(vertices, turned)
    with pytest.raises(SurfaceFileError, match="inside out"):
        MeshBody.from_arrays(vertices, faces[:, ::-1])
    with pytest.raises(SurfaceFileError, match="no triangles"):
        MeshBody.from_arrays(vertices, faces[:0])
    with pytest.raises(SurfaceFileError, match="not finite"):
        MeshBody.from_arrays(vertices * np.nan, faces)
    degenerate = np.concatenate([faces, [[1, 1, 2]]])
    body = MeshBody.from_arrays(vertices, degenerate)
    assert [fault.count for fault in body.faults] == [1]
    assert len(body.triangles) == len(faces)


@pytest.mark.parametrize("repair", [False, True])
def test_vertices_that_coincide_enclose_nothing(repair: bool) -> None:
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    with pytest.raises(SurfaceFileError, match="is flat: it encloses no volume"):
        MeshBody.from_arrays(np.full((4, 3), 0.25), faces, repair=repair)


@pytest.mark.parametrize(("distance", "noted"), [(0.0, False), (1000.0, False), (1e5, True)])
def test_coarse_coordinates_are_noted(distance: float, noted: bool, tmp_path: Path) -> None:
    """A binary STL has single precision: 100 m from the origin its steps are 7.8 µm."""
    box = trimesh.creation.box((2.0, 2.0, 2.0)).apply_translation((distance, 0.0, 0.0))
    box.export(tmp_path / "box.stl")
    notes = load_mesh(tmp_path / "box.stl", "mm").notes
    assert [("in steps of 7.81 µm, 0.39 % of the height" in note) for note in notes] == [
        True
    ] * noted


def test_repair_on_request() -> None:
    pytest.importorskip("networkx", reason="not run: the extra 'meshes' is not installed")
    mesh = trimesh.creation.icosphere(2, radius=1 * MM)
    faces = np.array(mesh.faces, dtype=np.int64)[1:]
    faces[::4] = faces[::4, ::-1]
    body = MeshBody.from_arrays(np.array(mesh.vertices), faces, repair=True)
    assert len(body.triangles) == len(mesh.faces)
    assert {fault.kind for fault in body.repaired} >= {"open edges"}


def test_overlapping_bodies_are_refused() -> None:
    first = trimesh.creation.box((2 * MM, 2 * MM, 2 * MM))
    second = first.copy().apply_translation((1 * MM, 0.3 * MM, 0.2 * MM))
    both = trimesh.util.concatenate([first, second])
    with pytest.raises(SurfaceFileError, match="overlaps"):
        bake_body(to_body(both), 0.3 * MM, resolution=0.2 * MM)


def test_parts_that_share_a_face_are_united() -> None:
    """The force over the joint is that beside it, whatever the triangles of the shared face."""
    first = trimesh.creation.box((4 * MM, 4 * MM, 2 * MM))
    second = first.copy().apply_translation((4 * MM, 0.0, 0.0))
    mirrored = first.copy().apply_scale((-1.0, 1.0, 1.0)).apply_translation((4 * MM, 0.0, 0.0))
    for other in (second, mirrored):
        both = to_body(trimesh.util.concatenate([first, other]))
        assert both.notes == ("parts united: 4 triangles between them removed",)
        assert (len(both.triangles), both.faults) == (20, ())
        joint, beside = exact(both, np.array([[2 * MM, 0.0, 0.6 * MM], [0.0, 0.0, 0.6 * MM]]))
        assert joint == pytest.approx(beside, abs=1e-12)
        assert joint[3] == pytest.approx(0.4 * MM)
    corner = to_body(
        trimesh.util.concatenate([first, first.copy().apply_translation((4 * MM, 4 * MM, 0.0))])
    )
    assert len(corner.triangles) == 24
    assert not BodyLoops(corner, BodyLaw(1.0, MM, np.inf)).find_contacts()


@pytest.mark.parametrize("shift", [(4, 1, 0), (0.5, 0.3, 2), (4 + 2e-6, 1, 0)])
def test_parts_that_touch_in_another_way_are_refused(shift: tuple[float, float, float]) -> None:
    turn = trimesh.transformations.rotation_matrix(0.7, (0.3, 1.0, 0.6))
    first = trimesh.creation.box((4 * MM, 4 * MM, 2 * MM))
    second = first.copy().apply_translation(MM * np.array(shift))
    both = to_body(trimesh.util.concatenate([first, second]).apply_transform(turn))
    with pytest.raises(SurfaceFileError, match=r"touches or overlaps .* one at \("):
        bake_body(both, 0.3 * MM, resolution=0.2 * MM)


def test_gaps_and_sharp_hollows_are_no_contacts() -> None:
    first = trimesh.creation.box((4 * MM, 4 * MM, 2 * MM))
    second = first.copy().apply_translation((4.001 * MM, 1 * MM, 0.0))
    spiky = trimesh.creation.icosphere(4, radius=MM)
    spiky.vertices *= 1.0 + 0.3 * np.random.default_rng(0).random((len(spiky.vertices), 1))
    for mesh in (trimesh.util.concatenate([first, second]), spiky):
        assert not BodyLoops(to_body(mesh), BodyLaw(1.0, MM, np.inf)).find_contacts()


@pytest.mark.parametrize("factor", [1e-6, 1e3])
def test_fields_without_a_force_are_refused(factor: float) -> None:
    vertices = factor * cube().triangles.reshape(-1, 3)
    body = MeshBody.from_arrays(vertices, np.arange(len(vertices)).reshape(-1, 3))
    with pytest.raises(ParameterError, match="check the unit") as caught:
        bake_body(body, goal=BakeGoal(max_bytes=500_000))
    assert caught.value.argument == "max_depth"


def test_depth_and_resolution_must_fit() -> None:
    with pytest.raises(ParameterError, match="greatest depth") as caught:
        bake_body(cube(), 2.5 * MM, resolution=0.4 * MM)
    assert caught.value.argument == "max_depth"
    with pytest.raises(ParameterError, match="thinnest side"):
        bake_body(cube(), 0.5 * MM, resolution=3 * MM)
    with pytest.raises(ParameterError, match="max_bytes"):
        bake_body(cube(), 0.5 * MM, resolution=1e-6)
    with pytest.raises(ParameterError, match="at least 1"):
        bake_body(cube(), 0.5 * MM, 0.5)


def test_automatic_resolution_reaches_the_goal() -> None:
    """The first field misses it: 10.4 %. One that fits in no more memory states what it reaches."""
    torus = to_body(trimesh.creation.torus(3 * MM, 1 * MM))
    field = bake_body(torus, 0.6 * MM, goal=BakeGoal(share=0.1))
    assert 0.05 < field.accuracy.share <= 0.1
    # The mean force all around: nearly that of a wall of the same depth.
    depths = np.array(field.accuracy.depths)
    assert np.all(np.array(field.accuracy.presses)[:-1] > 0.95 * depths[:-1])
    small = bake_body(torus, 0.6 * MM, goal=BakeGoal(share=0.1, max_bytes=200_000))
    assert small.accuracy.share > 0.1
    assert small.bytes <= 200_000
    assert f"{100.0 * small.accuracy.share:.2g} % RMS" in small.preparation[-1]


def test_depth_of_a_slender_body_is_found_at_the_nodes() -> None:
    """A coarse lattice finds no point of a ring at that depth."""
    turn = trimesh.transformations.rotation_matrix(0.7, (0.3, 1.0, 0.6))
    ring = to_body(trimesh.creation.torus(3.0, 0.12, transform=turn).apply_scale(MM))
    assert BodyLoops(ring, BodyLaw(1.0, 0.11 * MM, np.inf)).sample_depth() < 0.11 * MM
    assert bake_body(ring, 0.11 * MM, resolution=0.05 * MM).max_depth == 0.11 * MM


def test_files(tmp_path: Path) -> None:
    mesh = trimesh.creation.box((4.0, 4.0, 4.0))
    for suffix in ("stl", "ply", "obj", "glb"):
        path = tmp_path / f"part.{suffix}"
        mesh.export(path)
        body = load_mesh(path, "mm")
        assert len(body.triangles) == 12
        np.testing.assert_allclose(body.box[1], 2e-3)
    assert load_mesh(tmp_path / "part.glb").box[1][0] == pytest.approx(2.0)
    with pytest.raises(ParameterError, match="unit is required"):
        load_mesh(tmp_path / "part.stl")
    surface = asp.bake_mesh(tmp_path / "part.stl", "mm", 0.5e-3, 0.25e-3)
    force = surface.force([[0.1e-3, 0.2e-3, 1.7e-3]])
    np.testing.assert_allclose(force, [[0.0, 0.0, 0.3]], atol=0.01)
    huge = tmp_path / "huge.stl"
    with huge.open("wb") as stream:
        stream.write(bytes(80) + struct.pack("<I", 10**8))
        stream.truncate(84 + 50 * 10**8)
    with pytest.raises(SurfaceFileError, match="100,000,000 triangles"):
        load_mesh(huge, "mm")


def _ply(count: int, body: bytes = b"") -> bytes:
    axes = b"".join(b"property float %c\n" % axis for axis in b"xyz")
    faces = b"element face %d\nproperty list uchar int vertex_indices\n" % count
    start = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\n"
    return start + axes + (faces if count else b"") + b"end_header\n" + bytes(36) + body


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    """Each with what is wrong; the command ends with code 2 and writes nothing."""
    box = tmp_path / "box.stl"
    trimesh.creation.box((4.0, 4.0, 4.0)).export(box)
    whole, stated = box.read_bytes(), struct.pack("<I", 10**8)
    damages = {
        "cut.stl": (whole[:-20], "states 12 triangles and holds 11"),
        "claims.stl": (whole[:80] + stated + whole[84:], "states 100,000,000 triangles and holds"),
        "longer.stl": (whole + bytes(50), "states 12 triangles and holds 13"),
        "zero.stl": (bytes(84), "has no triangles"),
        "empty.stl": (b"", "has no triangles"),
        "text.stl": (b"solid x\nfacet", "has no triangles"),
        "claims.ply": (_ply(10**8), "may hold 100,000,000 triangles"),
        "cut.ply": (_ply(2, bytes(13)), "damaged mesh"),
        "points.ply": (_ply(0), "has no triangles"),
        "text.ply": (b"ply\nnothing", "damaged mesh"),
        "empty.obj": (b"", "has no triangles"),
        "nan.obj": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
        "index.obj": (b"v 0 0 0\nv 1 0 0\nf 1 2 9\n", "damaged mesh"),
    }
    for name, (content, reason) in damages.items():
        path, output = tmp_path / name, tmp_path / "out.field"
        path.write_bytes(content)
        arguments = ["bake", str(path), "--body", "--unit", "mm", "-o", str(output)]
        error = CliRunner().invoke(cli, arguments).exception
        assert isinstance(error, SurfaceFileError), name
        assert error.exit_code == 2
        assert name in str(error)
        assert reason in str(error), name
        assert not output.exists()
