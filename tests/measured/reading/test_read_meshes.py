"""STL and OBJ meshes, sampled as heights over their best-fit plane."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface, read_surface
from asperity.measured.reading.mesh import fit_plane

sys.path.insert(0, str(Path(__file__).parents[1] / "writers"))
from mesh_writer import grid_mesh, write_ascii_stl, write_obj, write_stl

Floats = NDArray[np.float64]
ROWS, COLUMNS, PITCH = 21, 33, 0.25  # [mm]


def relief() -> Floats:
    """Return generic heights [mm] that are only nearly orthogonal to planes."""
    i, j = np.mgrid[0.0:ROWS, 0.0:COLUMNS]
    return 0.2 * np.cos(2 * np.pi * j / 16) * np.cos(2 * np.pi * i / 10) + 0.05 * np.sin(0.7 * i)


def remove_plane(heights: Floats) -> Floats:
    """Return heights without their least-squares plane."""
    i, j = np.mgrid[0.0 : heights.shape[0], 0.0 : heights.shape[1]]
    known = np.isfinite(heights)
    planes = np.stack((i[known], j[known], np.ones(known.sum())), axis=1)
    fit = np.linalg.lstsq(planes, heights[known], rcond=None)[0]
    return np.asarray(heights - (fit[0] * i + fit[1] * j + fit[2]))


def rotation(axis: tuple[float, float, float], angle: float) -> Floats:
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def triangles_of(heights: Floats) -> Floats:
    vertices, faces = grid_mesh(heights, PITCH)
    return np.asarray(vertices[faces])


def assert_refused(path: Path, match: str) -> str:
    with pytest.raises(SurfaceFileError, match=match) as caught:
        read_surface(path, unit="mm")
    assert str(caught.value).startswith(path.name)
    return str(caught.value)


def assert_relief(raw: RawSurface, tolerance: float = 3e-3) -> None:
    """Assert equality with the relief; the best-fit planes of surface and grid differ slightly."""
    assert raw.heights.shape == (ROWS, COLUMNS)
    assert raw.pitch == pytest.approx((PITCH * 1e-3, PITCH * 1e-3), rel=tolerance)
    np.testing.assert_allclose(
        remove_plane(raw.heights), remove_plane(relief() * 1e-3), atol=tolerance * 2e-4
    )
    assert raw.has_units
    assert not raw.relative


@pytest.mark.starts_readers
def test_level_patch_is_sampled_at_its_vertices(tmp_path: Path) -> None:
    vertices, faces = grid_mesh(relief() - fitted_plane(relief()), PITCH)
    for path in (
        write_stl(tmp_path / "a.dat", vertices[faces]),
        write_ascii_stl(tmp_path / "b.dat", vertices[faces]),
        write_obj(tmp_path / "c.dat", vertices, faces),
        write_stl(tmp_path / "d.stl", vertices[faces], header=b"solid but binary"),
    ):
        raw = read_surface(path, unit="mm")
        assert_relief(raw)
        assert not np.isnan(raw.heights).any()
        assert any("pitch 250" in note for note in raw.notes)


def fitted_plane(heights: Floats) -> Floats:
    return np.asarray(heights - remove_plane(heights))


@pytest.mark.parametrize("unit", [("mm", 1e-3), ("um", 1e-6), ("in", 0.0254)])
def test_unit_is_required_and_scales_the_heights(tmp_path: Path, unit: tuple[str, float]) -> None:
    path = write_stl(tmp_path / "a.stl", triangles_of(relief()))
    with pytest.raises(ParameterError, match=r"unit is required: a\.stl is an STL file") as caught:
        read_surface(path)
    assert caught.value.argument == "unit"
    raw = read_surface(path, unit=unit[0])
    assert not any("check the unit" in note for note in raw.notes)
    assert raw.pitch == pytest.approx((PITCH * unit[1], PITCH * unit[1]), rel=3e-3)
    assert np.ptp(raw.heights) == pytest.approx(np.ptp(remove_plane(relief())) * unit[1], rel=0.02)


def test_best_fit_plane_is_independent_of_the_triangulation() -> None:
    """Subdividing some triangles into four each does not change the plane."""
    corners = np.random.default_rng(8).normal(size=(7, 3, 3)) * (3.0, 2.0, 0.4)
    a, b, c = corners[:4, 0], corners[:4, 1], corners[:4, 2]
    d, e, f = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [np.stack(p, axis=1) for p in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))]
    planes = []
    for triangles in (corners, np.concatenate((*parts, corners[4:]))):
        cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        planes.append(fit_plane(triangles, cross, 0.5 * np.linalg.norm(cross, axis=1)))
    (centre, axes, _), (other_centre, other_axes, _) = planes
    np.testing.assert_allclose(axes[2], other_axes[2], atol=1e-12)
    np.testing.assert_allclose(centre, other_centre, atol=1e-12)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)


def test_patch_larger_than_a_metre_is_noted(tmp_path: Path) -> None:
    raw = read_surface(write_stl(tmp_path / "a.stl", triangles_of(relief())), unit="m")
    assert "the patch is 8.25 m long: check the unit" in raw.notes


@pytest.mark.parametrize("angle", [0.3, 1.2, 2.5, np.pi])
def test_any_orientation_gives_the_same_heights(tmp_path: Path, angle: float) -> None:
    rotated = rotation((0.3, -0.8, 0.45), angle)
    moved = (triangles_of(relief()) + np.array((10, -20, 30))) @ rotated.T
    raw = read_surface(write_stl(tmp_path / "a.stl", moved), unit="mm")
    match = re.search(r"normal \((.*?)\)", " ".join(raw.notes))
    assert match is not None
    normal = np.array([float(x) for x in match[1].split(",")])
    assert normal @ rotated[:, 2] > 0.999  # the textured side faces up
    # Within the plane the patch may have any of four orientations.
    heights = raw.heights if raw.heights.shape == (ROWS, COLUMNS) else np.rot90(raw.heights)
    assert heights.shape == (ROWS, COLUMNS)
    expected = remove_plane(relief() * 1e-3)
    errors = [np.abs(remove_plane(h) - expected).max() for h in (heights, heights[::-1, ::-1])]
    assert min(errors) < 2e-2 * np.ptp(expected)


def test_ruled_surface_is_sampled_at_the_strip_width(tmp_path: Path) -> None:
    """For long thin triangles the pitch follows the width of the strips, not the median edge."""
    j = np.arange(65.0)
    profile = 0.1 * np.cos(2 * np.pi * j / 16)
    vertices, faces = grid_mesh(np.stack((profile, profile)), 0.05)
    vertices[65:, 1] = 4.0
    raw = read_surface(write_stl(tmp_path / "a.stl", vertices[faces]), unit="mm")
    assert raw.heights.shape[1] == 65
    expected = (profile - profile.mean()) * 1e-3
    middle = raw.heights[raw.heights.shape[0] // 2]
    np.testing.assert_allclose(middle - middle.mean(), expected, atol=2e-6)


def test_holes_are_missing_points(tmp_path: Path) -> None:
    vertices, faces = grid_mesh(relief() - fitted_plane(relief()), PITCH)
    centres = vertices[faces].mean(axis=1)
    inside = np.all(np.abs(centres[:, :2] - (4.0, 2.5)) < 0.6, axis=1)
    raw = read_surface(write_stl(tmp_path / "a.stl", vertices[faces[~inside]]), unit="mm")
    missing = np.argwhere(np.isnan(raw.heights))
    assert 4 <= len(missing) <= 16
    assert np.all(np.abs(missing * PITCH - (2.5, 4.0)) < 0.61)


def test_overhangs_are_refused_with_their_area(tmp_path: Path) -> None:
    corners = triangles_of(relief())
    area = 0.5 * np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    flipped = corners.copy()
    flipped[5:8] = flipped[5:8, ::-1]
    message = assert_refused(write_stl(tmp_path / "a.stl", flipped), "3 triangles overhang")
    match = re.search(r"overhang, (\S+) mm² or (\S+) % of the surface", message)
    assert match is not None
    assert float(match[1]) == pytest.approx(area[5:8].sum(), rel=1e-3)
    assert float(match[2]) == pytest.approx(100 * area[5:8].sum() / area.sum(), abs=0.006)


def test_leaning_lip_is_refused_as_overhang(tmp_path: Path) -> None:
    """A lip that leans over the surface below it is an overhang."""
    vertices, faces = grid_mesh(np.zeros((9, 12)), 1.0)
    vertices[:, 0] += np.where(vertices[:, 0] == 5, 2.5, 0.0)
    vertices[:, 2] += np.where(vertices[:, 0] == 7.5, 2.0, 0.0)
    assert_refused(
        write_stl(tmp_path / "a.stl", vertices[faces]), r"triangles overhang, .* cut them off"
    )


def test_closed_body_is_refused_with_advice(tmp_path: Path) -> None:
    top = triangles_of(relief())
    bottom = top[:, ::-1] - (0, 0, 3.0)
    walled = np.concatenate((top, bottom))
    assert_refused(write_stl(tmp_path / "a.stl", walled), "cut off the textured side")


def test_layers_are_refused(tmp_path: Path) -> None:
    two_layers = np.concatenate(
        (triangles_of(relief()), triangles_of(relief()) + np.array((0, 0, 1.0)))
    )
    assert_refused(
        write_stl(tmp_path / "a.stl", two_layers),
        r"lies above itself at \d\d\d grid points, about \d\d\.\d+ mm²",
    )


def test_degenerate_meshes_are_refused(tmp_path: Path) -> None:
    corners = triangles_of(relief())
    assert_refused(write_stl(tmp_path / "a.stl", corners[:1]), "a mesh of 1 triangles")
    assert_refused(write_stl(tmp_path / "a.stl", corners[:2]), r"too coarse a mesh: \d x 2 points")
    flat = np.repeat(corners[:, :1], 3, axis=1)
    assert_refused(write_stl(tmp_path / "a.stl", flat), "a mesh of 0 triangles")
    broken = corners.copy()
    broken[3, 1, 2] = np.nan
    assert_refused(write_stl(tmp_path / "a.stl", broken), "not finite")
    far = corners.copy()
    far[0, 0, 0] = 1e30
    assert_refused(
        write_stl(tmp_path / "a.stl", far), "too large|too uneven|overhang|on edge|too coarse"
    )
    vertices, faces = grid_mesh(relief(), PITCH)
    huge = write_obj(tmp_path / "a.obj", vertices * 1e160, faces)
    assert_refused(huge, "too large for floating-point")


def test_uneven_mesh_is_refused_without_allocating_memory(tmp_path: Path) -> None:
    corners = triangles_of(np.zeros((9, 9)))
    wide = np.array([[[9, 9, 0], [1e5, 9, 0], [9, 1e5, 0]]], dtype=float)
    assert_refused(
        write_stl(tmp_path / "a.stl", np.concatenate((corners, wide))), "too uneven a mesh"
    )


def test_damaged_stl_is_refused(tmp_path: Path) -> None:
    path = write_ascii_stl(tmp_path / "a.stl", triangles_of(relief())[:60])
    text = path.read_text()
    path.write_text(text.replace("e-01", "e-x1", 3))
    assert_refused(path, "damaged STL mesh")
    for length in (len(text) // 2, len(text) - 60):
        path.write_text(text[:length])
        assert_refused(path, "damaged or truncated STL mesh|damaged STL mesh")


@pytest.mark.parametrize(
    "line", ["f 1 2 99999", "f 0 1 2", "f 1/1 2/1 0/1", "f 1 2", "f a b c", "f 1 2 3.5", "v 1 2"]
)
def test_damaged_obj_is_refused(tmp_path: Path, line: str) -> None:
    vertices, faces = grid_mesh(relief(), PITCH)
    path = write_obj(tmp_path / "a.obj", vertices, faces)
    path.write_text(path.read_text() + line + "\n")
    assert_refused(path, "damaged (or truncated )?OBJ mesh")


def test_obj_with_continued_lines_and_negative_indices(tmp_path: Path) -> None:
    vertices, faces = grid_mesh(relief() - fitted_plane(relief()), PITCH)
    path = write_obj(tmp_path / "a.obj", vertices, faces[2:])
    first, last = faces[0], faces[1]
    lines = f"f {first[0] + 1} {first[1] + 1} \\\n {first[2] + 1}\n"
    lines += "f " + " ".join(str(int(k) - len(vertices)) for k in last) + "\n"
    path.write_text(path.read_text() + lines)
    raw = read_surface(path, unit="mm")
    assert_relief(raw)
    assert any("1280 triangles" in note for note in raw.notes)


def test_resampling_error_is_stated(tmp_path: Path) -> None:
    vertices, faces = grid_mesh(relief() - fitted_plane(relief()), PITCH)
    raw = read_surface(write_stl(tmp_path / "a.stl", vertices[faces]), unit="mm")
    text = next(note for note in raw.notes if "within" in note)
    match = re.search(r"within (\S+) µm", text)
    assert match is not None
    assert float(match[1]) < 3.0  # of 500 µm: the vertices are a slightly tilted grid
    # Negative control: vertices that a grid of the median edge cannot follow.
    rng = np.random.default_rng(5)
    inner = np.all((vertices[:, :2] > 0.1) & (vertices[:, :2] < (7.9, 4.9)), axis=1)
    vertices[inner, :2] += rng.uniform(-0.08, 0.08, (int(inner.sum()), 2))
    raw = read_surface(write_stl(tmp_path / "a.stl", vertices[faces]), unit="mm")
    match = re.search(r"within (\S+) µm", " ".join(raw.notes))
    assert match is not None
    assert float(match[1]) > 10.0


def test_arguments_of_other_formats_are_refused(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "a.stl", triangles_of(relief()))
    with pytest.raises(ParameterError, match="channel must not be given"):
        read_surface(path, unit="mm", channel=1)


@pytest.mark.starts_readers
@pytest.mark.parametrize(("distance", "noted"), [(0.0, False), (1e5, True)])
def test_coarse_coordinates_are_noted(distance: float, noted: bool, tmp_path: Path) -> None:
    """A binary STL has single precision: 100 m from the origin its steps are 7.8 µm."""
    triangles = triangles_of(relief()) + np.array([distance, 0.0, 0.0])
    write_stl(tmp_path / "far.stl", triangles)
    notes = read_surface(tmp_path / "far.stl", unit="mm").notes
    assert (
        any("far from the origin for numbers in single precision" in one for one in notes) is noted
    )
