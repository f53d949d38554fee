"""Lengths of TIFF images: the ``unit`` argument, and the metadata of ImageJ and OME."""

from __future__ import annotations

import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "writers"))
from image_writer import write_tiff

from asperity.core.errors import ParameterError
from asperity.measured.preparation import prepare
from asperity.measured.reading import read_surface
from asperity.measured.reading.pixels import ImageScale, imagej_scale, ome_scale

HEIGHTS = (np.random.default_rng(2).normal(size=(6, 9)) * 3).astype(np.float32)
RELATIVE = "an image has no unit: heights are pixel values, y runs down the image"
OME = (
    '<?xml version="1.0" encoding="UTF-8"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/'
    '2016-06"><Image ID="Image:0"><Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="float"'
    ' SizeX="9" SizeY="6" SizeZ="1" SizeC="1" SizeT="1"{sizes}><TiffData/></Pixels></Image></OME>'
)


def rational(value: float) -> bytes:
    return struct.pack("<II", round(value * 10**6), 10**6)


def write_imagej_tiff(
    path: Path, *lines: str, per_unit: float = 4.0, values: Any = HEIGHTS
) -> Path:
    """Write a TIFF with ImageJ's keys in the description and pixels per unit as resolution."""
    text = "\n".join(("ImageJ=1.54f", "images=1", *lines, "")).encode("latin-1") + b"\0"
    tags = {270: (2, text), 282: (5, rational(per_unit)), 283: (5, rational(per_unit / 2))}
    return write_tiff(path, values, tags=tags)


@pytest.mark.starts_readers
def test_float_heights_in_a_given_unit(tmp_path: Path) -> None:
    raw = read_surface(write_tiff(tmp_path / "a.tif", HEIGHTS), unit="um")
    np.testing.assert_allclose(raw.heights, 1e-6 * HEIGHTS.astype(float), rtol=1e-15)
    assert (raw.has_units, raw.relative, raw.pitch) == (True, False, None)
    assert raw.notes == ("no unit in the file: 1e-06 m as given", "y runs down the image")
    assert prepare(raw, pitch=1e-6).heights.shape == HEIGHTS.shape
    integers = read_surface(
        write_tiff(tmp_path / "w.tif", np.arange(54, dtype="<u2").reshape(6, 9)), unit="nm"
    )
    assert integers.heights[5, 8] == pytest.approx(53e-9, rel=1e-15)


def test_imagej_metadata_give_pitch_and_unit_of_heights(tmp_path: Path) -> None:
    path = write_imagej_tiff(
        tmp_path / "a.tif", "unit=micron", "cf=0", "c0=1.5", "c1=2.0", "vunit=nm"
    )
    raw = read_surface(path)
    assert raw.pitch == pytest.approx((0.25e-6, 0.5e-6), rel=1e-12)
    np.testing.assert_allclose(raw.heights, 1e-9 * (1.5 + 2.0 * HEIGHTS.astype(float)), rtol=1e-14)
    assert raw.has_units
    assert raw.notes == (
        "pixel size 250 nm x 500 nm from ImageJ's metadata",
        "unit of heights nm from ImageJ's metadata",
        "calibrated as ImageJ's metadata says: 1.5 + 2 value",
        "y runs down the image",
    )
    with pytest.raises(ParameterError, match=r"must not be given: a\.tif names its unit"):
        read_surface(path, unit="um")


@pytest.mark.parametrize("unit", ["\\u00B5m", "µm", "um", "micron", "microns"])
def test_spellings_of_micrometres_in_imagej_metadata(tmp_path: Path, unit: str) -> None:
    raw = read_surface(write_imagej_tiff(tmp_path / "a.tif", f"unit={unit}"))
    assert raw.pitch == pytest.approx((0.25e-6, 0.5e-6), rel=1e-12)
    assert raw.relative  # the pixels have a size, the heights have no unit


@pytest.mark.parametrize("line", ["unit=pixel", "unit=inch-ish", "loop=false", "unit=sec"])
def test_imagej_without_a_length_unit_gives_no_pitch(tmp_path: Path, line: str) -> None:
    raw = read_surface(write_imagej_tiff(tmp_path / "a.tif", line))
    assert (raw.pitch, raw.relative) == (None, True)
    assert raw.notes == (RELATIVE,)


def test_unit_argument_with_the_pitch_of_write_imagej_tiff(tmp_path: Path) -> None:
    raw = read_surface(
        write_imagej_tiff(tmp_path / "a.tif", "unit=mm", "vunit=Gray Value"), unit="um"
    )
    assert raw.pitch == pytest.approx((0.25e-3, 0.5e-3), rel=1e-12)
    np.testing.assert_allclose(raw.heights, 1e-6 * HEIGHTS.astype(float), rtol=1e-15)


def test_imagej_and_ome_files_of_tifffile(tmp_path: Path) -> None:
    import tifffile

    path = tmp_path / "a.tif"
    tifffile.imwrite(
        path, HEIGHTS, imagej=True, resolution=(2.0, 2.0), metadata={"unit": "um", "axes": "YX"}
    )
    assert read_surface(path).pitch == pytest.approx((0.5e-6, 0.5e-6), rel=1e-6)
    path = tmp_path / "a.ome.tif"
    sizes = {
        "PhysicalSizeX": 0.7,
        "PhysicalSizeXUnit": "µm",
        "PhysicalSizeY": 0.9,
        "PhysicalSizeYUnit": "mm",
    }
    tifffile.imwrite(path, HEIGHTS, ome=True, metadata={"axes": "YX", **sizes})
    raw = read_surface(path, unit="nm")
    assert raw.pitch == pytest.approx((0.7e-6, 0.9e-3), rel=1e-12)
    assert raw.notes[0] == "pixel size 700 nm x 900 µm from the OME metadata"
    np.testing.assert_allclose(raw.heights, 1e-9 * HEIGHTS.astype(float), rtol=1e-15)


@pytest.mark.parametrize(
    ("sizes", "pitch"),
    [
        (' PhysicalSizeX="2" PhysicalSizeY="3"', (2e-6, 3e-6)),  # micrometres by default
        (" PhysicalSizeX='2' PhysicalSizeY='3' PhysicalSizeYUnit='nm'", (2e-6, 3e-9)),
        (' PhysicalSizeX="2"', None),
        ("", None),
        (' PhysicalSizeX="2" PhysicalSizeY="3" PhysicalSizeXUnit="pixel"', None),
        (' PhysicalSizeX="2" PhysicalSizeY="nan"', None),
        (' PhysicalSizeX="-2" PhysicalSizeY="3"', None),
        (' PhysicalSizeX="x" PhysicalSizeY="3"', None),
    ],
)
def test_pitch_of_an_ome_tiff(
    tmp_path: Path, sizes: str, pitch: tuple[float, float] | None
) -> None:
    text = OME.format(sizes=sizes).encode() + b"\0"
    raw = read_surface(write_tiff(tmp_path / "a.tif", HEIGHTS, tags={270: (2, text)}))
    assert raw.pitch == (pitch if pitch is None else pytest.approx(pitch, rel=1e-15))
    assert raw.relative
    assert ome_scale("nothing of this kind") == ImageScale()


@pytest.mark.parametrize(
    "metadata",
    [
        {"unit": 3, "vunit": 4},
        {"unit": "um", "cf": 0, "c0": float("inf"), "c1": 2.0},
        {"unit": "um", "cf": 1, "c1": 2.0},  # a parabola, which is not applied
        {"cf": 0, "c1": "x"},
        {"cf": 0, "c0": 1.0, "c1": 0.0},
    ],
)
def test_unusable_imagej_metadata_are_ignored(metadata: dict[str, Any]) -> None:
    scale = imagej_scale(metadata, (0.0, float("nan")))
    assert (scale.pitch, scale.metres_per_value, scale.factor, scale.offset) == (
        None,
        None,
        1.0,
        0.0,
    )


def test_print_resolution_is_not_a_pitch(tmp_path: Path) -> None:
    tags = {282: (5, rational(300)), 283: (5, rational(300)), 296: (3, struct.pack("<H", 2))}
    assert read_surface(write_tiff(tmp_path / "a.tif", HEIGHTS, tags=tags)).pitch is None
