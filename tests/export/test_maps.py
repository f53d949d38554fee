"""Height and normal maps: read back they equal the surface within the stated resolution."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

import asperity as asp
from asperity.core.errors import ParameterError
from asperity.export.surface_maps import (
    CONVENTIONS,
    HEIGHT_MAPS,
    SampledMap,
    height_resolution,
    normal_error,
    normal_png,
    sample_map,
)
from asperity.measured.reading import read_surface
from asperity.report.sentences.surface_text import describe_shading

RNG = np.random.default_rng(4)
ROUGH = asp.HeightMap(2e-5 * RNG.normal(size=(24, 37)) + 3e-3, (1.3e-5, 2.9e-5), origin=(1e-3, 0.0))
WAVES = asp.Fourier([1e-4, 6e-5], [[900.0, 0.0], [300.0, 1200.0]], [0.3, 1.1])
WAVE = asp.Sinusoid(amplitude=2e-4, period=2e-3, direction=(0.6, 0.8), phase=0.4)
FLAT = asp.HeightMap(np.zeros((5, 6)), 1e-4)


def write_map(tmp_path: Path, data: bytes, suffix: str) -> Path:
    path = tmp_path / f"map{suffix}"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("texture", [ROUGH, WAVES, WAVE, FLAT], ids=["map", "sum", "wave", "flat"])
@pytest.mark.parametrize("suffix", [".png", ".tif", ".x3p"])
def test_heights_read_back_within_the_stated_resolution(
    tmp_path: Path, texture: asp.HeightMap | asp.Fourier | asp.Sinusoid, suffix: str
) -> None:
    sampled = sample_map(texture)
    raw = read_surface(write_map(tmp_path, HEIGHT_MAPS[suffix](sampled), suffix))
    # Rounding of the last bits is added to the resolution.
    rounding = 1e-15 * float(np.abs(sampled.heights).max())
    error = np.abs(raw.heights - sampled.heights).max()
    assert error <= height_resolution(sampled, suffix) * (1.0 + 1e-6) + rounding
    assert raw.pitch == pytest.approx(sampled.spacing, rel=1e-15 if suffix != ".tif" else 1e-7)
    if suffix != ".x3p" and texture is not FLAT:
        assert error > 0.2 * height_resolution(
            sampled, suffix
        )  # the stated resolution is not too coarse


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_normals_read_back_give_the_slopes(tmp_path: Path, convention: str) -> None:
    """As Pillow reads them: red points right, green up the picture, blue out of it."""
    sampled = sample_map(WAVES, extent=(9e-3, 8e-3), spacing=1e-4)
    path = write_map(tmp_path, normal_png(sampled, convention), ".png")
    with Image.open(path) as image:
        normals = 2.0 * np.asarray(image, dtype=np.float64)[..., :3] / 255.0 - 1.0
    down, along_x = np.gradient(sampled.heights, *sampled.spacing[::-1])
    inside = slice(1, -1), slice(1, -1)  # the differences are one-sided at the border
    for component, slope in ((-normals[..., 0], along_x), (normals[..., 1], down)):
        error = (component / normals[..., 2] - slope)[inside]
        assert np.sqrt((error**2).mean()) < 1.5 / 255.0 < 0.05 * np.ptp(slope)  # of 8 bits


def test_gltf_bytes_follow_the_specification() -> None:
    """Red [0, 255] is x [-1, 1]; green points up the picture; blue points out of it."""
    normals = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]])
    convention = CONVENTIONS["gltf"]
    pixels = convention.encode(normals)
    assert pixels[0, :, 0].tolist() == [128, 255, 128, 0]
    assert pixels[0, :, 1].tolist() == [255, 128, 128, 128]  # -y points up the picture
    assert pixels[0, :, 2].tolist() == [128, 128, 255, 128]
    np.testing.assert_allclose(convention.decode(pixels), normals, atol=0.01)


def test_chai3d_decodes_the_normals() -> None:
    """In CHAI3D cAlgorithmFingerProxy decodes a pixel as (R - 128, G - 128, B - 128), with v up."""
    sampled = sample_map(WAVES)
    with Image.open(io.BytesIO(normal_png(sampled, "chai3d"))) as image:
        stored = np.asarray(image)[::-1]  # the last row of the file is the first of a cImage
    decoded = stored.astype(float) - 128.0
    decoded /= np.sqrt((decoded**2).sum(axis=-1))[..., None]
    expected = (sampled.normals * (1.0, -1.0, 1.0))[::-1]  # along u and v, v = 1 - y / height
    assert np.abs(decoded - expected).max() < 0.008
    flat = CONVENTIONS["chai3d"].encode(np.array([[[0.0, 0.0, 1.0]]]))
    assert flat.tolist() == [[[128, 128, 255]]]


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_normal_error_equals_the_maximum_error_of_8_bits(convention: str) -> None:
    sampled = sample_map(WAVES)
    rule = CONVENTIONS[convention]
    decoded = rule.decode(rule.encode(sampled.normals))
    cosine = np.clip((decoded * sampled.normals).sum(axis=-1), -1.0, 1.0)
    assert np.arccos(cosine).max() == pytest.approx(normal_error(sampled, convention), rel=1e-3)
    assert 1e-3 < normal_error(sampled, convention) < 1e-2


def test_normals_equal_the_gradient_of_the_heights() -> None:
    sampled = sample_map(WAVES)
    slopes = -sampled.normals[..., :2] / sampled.normals[..., 2:]
    differences = np.gradient(sampled.heights, sampled.spacing[1], axis=0)[1:-1]
    assert np.abs(slopes[1:-1, :, 1] - differences).max() < 0.1 * np.abs(differences).max()
    own_axes = sample_map(WAVE)  # on the axes of the texture, with the wave along x
    assert np.abs(own_axes.normals[..., 1]).max() < 1e-12
    assert np.abs(own_axes.normals[..., 0]).max() > 0.3
    plane_axes = sample_map(WAVE, extent=4e-3, spacing=1e-4)  # on the axes of the plane
    assert np.abs(plane_axes.normals[..., 1]).max() > 0.3


def test_default_extent_and_spacing_are_described() -> None:
    assert (
        sample_map(ROUGH).description
        == "the extent of the map, 37 x 24 points, 13 µm x 29 µm apart"
    )
    np.testing.assert_allclose(sample_map(ROUGH).heights, ROUGH.heights, rtol=1e-12)
    assert sample_map(WAVE).description == "one period, 16 x 16 points, 125 µm apart"
    assert sample_map(WAVE).is_periodic
    part = sample_map(WAVE, extent=(3e-3, 2e-3), spacing=1e-4)
    assert (part.heights.shape, part.size) == ((20, 30), pytest.approx((3e-3, 2e-3)))
    assert not part.is_periodic
    half = sample_map(ROUGH, spacing=(2.6e-5, 2.9e-5))
    assert half.heights.shape == (23, 18)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"spacing": 1e-9}, "spacing gives 2000000 points on 2 mm; 4 to 8192"),
        ({"spacing": 1e-29}, "spacing gives 8193 points"),
        ({"spacing": 1.0}, "spacing gives 0 points"),
        ({"extent": -1.0}, "extent must be positive"),
        ({"extent": (1.0, 1.0, 1.0)}, "extent must be one length, or two"),
    ],
)
def test_invalid_grids_are_refused(options: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        sample_map(WAVE, **options)


def test_pillow_and_tifffile_read_the_files() -> None:
    sampled = sample_map(ROUGH)
    with Image.open(io.BytesIO(HEIGHT_MAPS[".png"](sampled))) as image:
        grey = np.asarray(image)
        assert image.info["Description"].startswith("Heights; x to the right, y down")
    assert (grey.min(), grey.max(), grey.dtype.itemsize >= 2) == (0, 65535, True)
    with tifffile.TiffFile(io.BytesIO(HEIGHT_MAPS[".tif"](sampled))) as file:
        assert file.is_imagej
        assert file.asarray().dtype == np.float32


@pytest.mark.parametrize(
    "chunk",
    [b"\x011e-5", b"\x011e-5\x00-1", b"\x02" + b"1\x001", b"\x01nan\x001", b"", b"\x011\x001\x001"],
)
def test_invalid_png_sizes_are_ignored(chunk: bytes) -> None:
    from asperity.measured.reading.pixels import png_scale

    assert png_scale({b"sCAL": chunk}, 16).pitch is None


@pytest.mark.parametrize(
    "rest", [b"", b"m\x001", b"V\x000\x001", b"m\x000\x00nan", b"m\x000\x000", b"m\x000\x001\x002"]
)
def test_invalid_png_calibrations_are_ignored(rest: bytes) -> None:
    from asperity.measured.reading.pixels import png_scale

    head = b"a\0" + struct.pack(">iiBB", 0, 65535, 0, 2)
    invalid = png_scale({b"pCAL": head + rest}, 16)
    assert (invalid.metres_per_value, invalid.factor, invalid.offset) == (None, 1.0, 0.0)
    valid = png_scale({b"pCAL": head + b"mm\x001\x0065.535"}, 16)
    assert (valid.metres_per_value, valid.factor, valid.offset) == (1e-3, pytest.approx(1e-3), 1.0)


def test_description_of_shading_gives_the_numbers_of_law_g() -> None:
    surface = asp.Surface(WAVE, "G", stiffness=500.0)
    description = describe_shading(WAVE, 500.0)
    assert description.startswith("A force along these normals is law G. At 500 N/m")
    assert (
        f"up to {asp.characteristic_number(surface).value:.3g} times that of the wall"
        in description
    )
    assert asp.worst_loop(surface).energy > 0.0
    assert "a loop gains" in description


def test_repr_of_a_sampled_map_is_short() -> None:
    assert isinstance(sample_map(WAVE), SampledMap)
    assert repr(sample_map(WAVE)).startswith("<SampledMap of one period")
