"""Height and normal maps: read back they are the surface, within what is stated."""

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
from asperity.report.sentences.map_text import describe_shading

RNG = np.random.default_rng(4)
ROUGH = asp.HeightMap(2e-5 * RNG.normal(size=(24, 37)) + 3e-3, (1.3e-5, 2.9e-5), origin=(1e-3, 0.0))
WAVES = asp.Fourier([1e-4, 6e-5], [[900.0, 0.0], [300.0, 1200.0]], [0.3, 1.1])
WAVE = asp.Sinusoid(amplitude=2e-4, period=2e-3, direction=(0.6, 0.8), phase=0.4)
FLAT = asp.HeightMap(np.zeros((5, 6)), 1e-4)


def written(tmp_path: Path, data: bytes, suffix: str) -> Path:
    path = tmp_path / f"map{suffix}"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("texture", [ROUGH, WAVES, WAVE, FLAT], ids=["map", "sum", "wave", "flat"])
@pytest.mark.parametrize("suffix", [".png", ".tif", ".x3p"])
def test_heights_read_back_within_the_stated_step(
    tmp_path: Path, texture: asp.HeightMap | asp.Fourier | asp.Sinusoid, suffix: str
) -> None:
    sampled = sample_map(texture)
    raw = read_surface(written(tmp_path, HEIGHT_MAPS[suffix](sampled), suffix))
    # Rounding of the last bits comes on top of the step.
    room = 1e-15 * float(np.abs(sampled.heights).max())
    apart = np.abs(raw.heights - sampled.heights).max()
    assert apart <= height_resolution(sampled, suffix) * (1.0 + 1e-6) + room
    assert raw.pitch == pytest.approx(sampled.spacing, rel=1e-15 if suffix != ".tif" else 1e-7)
    if suffix != ".x3p" and texture is not FLAT:
        assert apart > 0.2 * height_resolution(
            sampled, suffix
        )  # and no closer: the step is the step


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_normals_read_back_as_the_surface(tmp_path: Path, convention: str) -> None:
    """The project's reader integrates them: x right, y down, green up the picture."""
    sampled = sample_map(WAVES, extent=(9e-3, 8e-3), spacing=1e-4)
    path = written(tmp_path, normal_png(sampled, convention), ".png")
    raw = read_surface(path, integrate_normals=True)
    assert raw.pitch == sampled.spacing
    assert raw.per_pitch
    assert any("up (OpenGL), which fits better" in note for note in raw.notes)
    heights = raw.heights * sampled.spacing[0]
    error = heights - heights.mean() - (sampled.heights - sampled.heights.mean())
    tilt = np.array([np.gradient(error, axis=axis).mean() for axis in (0, 1)])
    if convention == "chai3d":  # its zero, 128, is read as 1/255: a tilt, which levelling removes
        np.testing.assert_allclose(np.abs(tilt), sampled.spacing[0] / 255.0, rtol=0.1)
        i, j = np.mgrid[: error.shape[0], : error.shape[1]]
        error -= tilt[0] * (i - i.mean()) + tilt[1] * (j - j.mean())
    assert np.sqrt((error**2).mean()) < 0.01 * np.ptp(sampled.heights)


def test_gltf_bytes_are_those_of_the_specification() -> None:
    """Red [0, 255] is x [-1, 1]; green is up the picture; blue is out of it."""
    up = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]])
    rule = CONVENTIONS["gltf"]
    pixels = rule.encode(up)
    assert pixels[0, :, 0].tolist() == [128, 255, 128, 0]
    assert pixels[0, :, 1].tolist() == [255, 128, 128, 128]  # -y points up the picture
    assert pixels[0, :, 2].tolist() == [128, 128, 255, 128]
    np.testing.assert_allclose(rule.decode(pixels), up, atol=0.01)


def test_chai3d_reads_the_normals() -> None:
    """What cAlgorithmFingerProxy makes of a pixel: (R - 128, G - 128, B - 128), v up."""
    sampled = sample_map(WAVES)
    with Image.open(io.BytesIO(normal_png(sampled, "chai3d"))) as image:
        stored = np.asarray(image)[::-1]  # the last row of the file is the first of a cImage
    read = stored.astype(float) - 128.0
    read /= np.sqrt((read**2).sum(axis=-1))[..., None]
    wanted = (sampled.normals * (1.0, -1.0, 1.0))[::-1]  # along u and v, v = 1 - y / height
    assert np.abs(read - wanted).max() < 0.008
    flat = CONVENTIONS["chai3d"].encode(np.array([[[0.0, 0.0, 1.0]]]))
    assert flat.tolist() == [[[128, 128, 255]]]


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_the_error_of_8_bits_is_reached_and_never_passed(convention: str) -> None:
    sampled = sample_map(WAVES)
    rule = CONVENTIONS[convention]
    read = rule.decode(rule.encode(sampled.normals))
    cosine = np.clip((read * sampled.normals).sum(axis=-1), -1.0, 1.0)
    assert np.arccos(cosine).max() == pytest.approx(normal_error(sampled, convention), rel=1e-3)
    assert 1e-3 < normal_error(sampled, convention) < 1e-2


def test_normals_are_those_of_the_surface() -> None:
    sampled = sample_map(WAVES)
    slopes = -sampled.normals[..., :2] / sampled.normals[..., 2:]
    middle = np.gradient(sampled.heights, sampled.spacing[1], axis=0)[1:-1]
    assert np.abs(slopes[1:-1, :, 1] - middle).max() < 0.1 * np.abs(middle).max()
    along = sample_map(WAVE)  # on its own axes: the wave along x
    assert np.abs(along.normals[..., 1]).max() < 1e-12
    assert np.abs(along.normals[..., 0]).max() > 0.3
    north = sample_map(WAVE, extent=4e-3, spacing=1e-4)  # on those of the plane
    assert np.abs(north.normals[..., 1]).max() > 0.3


def test_what_is_sampled_is_said() -> None:
    assert (
        sample_map(ROUGH).description
        == "the extent of the map, 37 x 24 points, 13 µm x 29 µm apart"
    )
    np.testing.assert_allclose(sample_map(ROUGH).heights, ROUGH.heights, rtol=1e-12)
    assert sample_map(WAVE).description == "one period, 16 x 16 points, 125 µm apart"
    assert sample_map(WAVE).is_periodic
    own = sample_map(WAVE, extent=(3e-3, 2e-3), spacing=1e-4)
    assert (own.heights.shape, own.size) == ((20, 30), pytest.approx((3e-3, 2e-3)))
    assert not own.is_periodic
    half = sample_map(ROUGH, spacing=(2.6e-5, 2.9e-5))
    assert half.heights.shape == (23, 18)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"spacing": 1e-9}, "spacing gives 2000000 points on 2 mm; 4 to 8192"),
        ({"spacing": 1e-29}, "spacing gives 8193 points"),
        ({"spacing": 1.0}, "spacing gives 0 points"),
        ({"extent": -1.0}, "extent must be positive"),
        ({"extent": (1.0, 1.0, 1.0)}, "extent must be one length, or two"),
    ],
)
def test_grids_that_cannot_be_are_refused(given: dict[str, float], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        sample_map(WAVE, **given)


def test_other_libraries_read_the_files() -> None:
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
    [
        b"\x011e-5", b"\x011e-5\x00-1", b"\x02" + b"1\x001", b"\x01nan\x001", b"",
        b"\x011\x001\x001",
    ],
)  # fmt: skip
def test_a_size_that_is_none_is_not_taken(chunk: bytes) -> None:
    from asperity.measured.reading.images.pixels import png_scale

    assert png_scale({b"sCAL": chunk}, 16).pitch is None


@pytest.mark.parametrize(
    "rest",
    [
        b"", b"m\x001", b"V\x000\x001", b"m\x000\x00nan", b"m\x000\x000", b"m\x000\x001\x002",
    ],
)  # fmt: skip
def test_a_calibration_that_is_none_is_not_taken(rest: bytes) -> None:
    from asperity.measured.reading.images.pixels import png_scale

    head = b"a\0" + struct.pack(">iiBB", 0, 65535, 0, 2)
    found = png_scale({b"pCAL": head + rest}, 16)
    assert (found.metres_per_value, found.factor, found.offset) == (None, 1.0, 0.0)
    good = png_scale({b"pCAL": head + b"mm\x001\x0065.535"}, 16)
    assert (good.metres_per_value, good.factor, good.offset) == (1e-3, pytest.approx(1e-3), 1.0)


def test_what_shading_costs_is_law_g() -> None:
    surface = asp.Surface(WAVE, "G", stiffness=500.0)
    said = describe_shading(WAVE, 500.0)
    assert said.startswith("A force along these normals is law G. At 500 N/m")
    assert f"up to {asp.characteristic_number(surface).value:.3g} times that of the wall" in said
    assert asp.worst_loop(surface).energy > 0.0
    assert "a loop gains" in said


def test_a_map_says_itself() -> None:
    assert isinstance(sample_map(WAVE), SampledMap)
    assert repr(sample_map(WAVE)).startswith("<SampledMap of one period")
