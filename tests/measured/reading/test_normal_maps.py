"""Normal maps: heights by least squares from slopes, the direction of green, the residue."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import asperity as asp
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.export.surface_maps import normal_png, sample_map
from asperity.measured.preparation import prepare
from asperity.measured.reading import normal_map, read_surface
from asperity.measured.reading.normal_map import integrate_slopes

sys.path.insert(0, str(Path(__file__).parents[1] / "writers"))
from image_writer import write_png, write_tiff

SHAPE = (60, 75)


def bumps(window: float = 1.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return heights in pixels, and their slopes along x and down y, with oblique waves.

    Args:
        window: share of a period that the map shows; 1 for a map that repeats.
    """
    rows, columns = SHAPE
    y, x = np.mgrid[:rows, :columns].astype(float)
    heights, along_x, along_y = (np.zeros(SHAPE) for _ in range(3))
    for amplitude, waves_x, waves_y, phase in (
        (1.0, 3, 2, 0.3),
        (0.6, -5, 4, 1.0),
        (0.4, 2, 1, 2.0),
    ):
        k_x = 2.0 * np.pi * waves_x * window / columns
        k_y = 2.0 * np.pi * waves_y * window / rows
        angle = k_x * x + k_y * y + phase
        heights += amplitude * np.sin(angle)
        along_x += amplitude * k_x * np.cos(angle)
        along_y += amplitude * k_y * np.cos(angle)
    return heights, along_x, along_y


def encode(along_x: FloatArray, along_y: FloatArray, green: str, kind: Any) -> NDArray[Any]:
    """Return an image of normals: red to the right, green up or down, blue out of the picture."""
    up = along_y if green == "up" else -along_y
    normals = np.stack([-along_x, up, np.ones(SHAPE)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    full = np.iinfo(kind).max
    return np.round((normals + 1.0) / 2.0 * full).astype(kind)


@pytest.mark.parametrize("green", ["up", "down"])
@pytest.mark.parametrize(("kind", "error"), [(np.uint8, 0.03), (np.uint16, 2e-4)])
def test_heights_of_a_normal_map_are_those_it_was_made_from(
    tmp_path: Path, green: str, kind: Any, error: float
) -> None:
    """PNG and TIFF, in units of the pitch, which makes them metres; the wrong green is noticed."""
    heights, along_x, along_y = bumps()
    image = encode(along_x, along_y, green, kind)
    png = write_png(tmp_path / "stone.png", image)
    tiff = write_tiff(tmp_path / "stone.tif", image, photometric=2)
    for path in (png, tiff):
        raw = read_surface(path, green=green)
        assert np.abs(raw.heights - heights).max() < error
        assert "its borders fit: one period" in raw.notes
        assert raw.in_pitches
        assert not raw.relative
    metres = prepare(raw, pitch=5e-5, form=0, s_cutoff=1.01e-4).heights
    assert np.ptp(metres) == pytest.approx(5e-5 * np.ptp(heights), rel=0.05)
    with pytest.raises(ParameterError, match="pitch must be equal along x and y"):
        prepare(raw, pitch=(5e-5, 6e-5))
    other = {"up": "down", "down": "up"}[green]
    wrong = read_surface(png, green=other)
    assert np.abs(wrong.heights - heights).max() > 0.3
    assert any(f"is it {other}?" in note for note in wrong.notes)


def test_direction_of_green_is_asked_for_with_the_residues_or_is_in_the_name(
    tmp_path: Path,
) -> None:
    _heights, along_x, along_y = bumps()
    image = encode(along_x, along_y, "down", np.uint8)
    with pytest.raises(ParameterError, match=r"green is required: .* pitch=5e-05 green='down'"):
        read_surface(write_png(tmp_path / "stone.png", image))
    for name, direction in (
        ("rock_nor_gl_1k", "up"),
        ("Rock_NormalDX", "down"),
        ("normal-dx", "down"),
    ):
        notes = read_surface(write_png(tmp_path / f"{name}.png", image)).notes
        assert f"green is {direction} according to the file's name" in notes
    with pytest.raises(ParameterError, match="green is required"):  # "dxf" is not "dx"
        read_surface(write_png(tmp_path / "normal_dxf.png", image))
    with pytest.raises(ParameterError, match="green is unknown: 'left'"):
        read_surface(tmp_path / "stone.png", green="left")
    grey = write_png(tmp_path / "grey.png", image[..., 0])
    with pytest.raises(ParameterError, match=r"grey\.png is no normal map"):
        read_surface(grey, green="up")
    text = tmp_path / "table.txt"
    text.write_text("1 2 3\n2 3 4\n3 4 5\n")
    with pytest.raises(ParameterError, match=r"green must not be given: table\.txt"):
        read_surface(text, green="up")
    colours = np.random.default_rng(1).integers(0, 256, (*SHAPE, 3), dtype=np.uint8)
    with pytest.raises(SurfaceFileError, match="colour image"):
        read_surface(write_png(tmp_path / "photo.png", colours))


def test_a_map_that_does_not_repeat_is_mirrored() -> None:
    heights, along_x, along_y = bumps(window=0.37)
    found = integrate_slopes(along_x, along_y)
    assert not found.is_periodic
    centred = heights - heights.mean()
    assert np.abs(found.heights - centred).max() < 0.02 * np.ptp(heights)
    # Negative control: taken as one period, the same slopes give other heights.
    forced = normal_map._solve(along_x, along_y, is_periodic=True).heights
    assert np.abs(forced - centred).max() > 0.2 * np.ptp(heights)


def test_residue_is_the_share_of_slopes_that_no_heights_have() -> None:
    """0 for a surface, 1 for a field of curl alone, and in between for their sum."""
    _heights, along_x, along_y = bumps()
    assert integrate_slopes(along_x, along_y).residue < 1e-12
    turned_x, turned_y = -along_y, along_x
    assert integrate_slopes(turned_x, turned_y).residue == pytest.approx(1.0, abs=1e-12)
    curl = np.square(turned_x).sum() + np.square(turned_y).sum()
    share = 0.3
    mixed = integrate_slopes(along_x + share * turned_x, along_y + share * turned_y)
    total = (
        np.square(along_x + share * turned_x).sum() + np.square(along_y + share * turned_y).sum()
    )
    assert mixed.residue == pytest.approx(share * np.sqrt(curl / total), rel=1e-9)


def test_a_written_normal_map_is_read_back(tmp_path: Path) -> None:
    """With the pitch that the file contains."""
    texture = asp.Fourier([4e-5, 3e-5], [[3141.59, 0.0], [6283.19, 3141.59]], [0.3, 1.0])
    written = sample_map(texture, extent=(2e-3, 2e-3), spacing=2.5e-5)
    path = tmp_path / "normals.png"
    path.write_bytes(normal_png(written, "gltf"))
    raw = read_surface(path, green="up")
    assert raw.pitch == pytest.approx((2.5e-5, 2.5e-5))
    heights = written.heights - written.heights.mean()
    assert np.abs(2.5e-5 * raw.heights - heights).max() < 0.03 * np.ptp(heights)
