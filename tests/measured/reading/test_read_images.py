"""PNG and TIFF images: values, colours, transparency, pages and damaged files."""

from __future__ import annotations

import io
import struct
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface, read_surface

sys.path.insert(0, str(Path(__file__).parents[1] / "writers"))
from image_writer import chunk, write_png, write_tiff

RNG = np.random.default_rng(25178)
BYTES = RNG.integers(0, 256, (7, 11), dtype=np.uint8)
WORDS = RNG.integers(0, 65536, (13, 9), dtype=np.uint16)
FLOATS = RNG.normal(size=(6, 8)).astype(np.float32)


def assert_image(raw: RawSurface, values: NDArray[Any]) -> None:
    np.testing.assert_array_equal(raw.heights, values.astype(np.float64))
    assert raw.heights.dtype == np.float64
    assert raw.pitch is None
    assert raw.relative
    assert not raw.has_units
    assert any("an image has no unit" in note for note in raw.notes)


def stack_channels(values: NDArray[Any], channels: int, alpha: int | None = None) -> NDArray[Any]:
    """Repeat a grey image in channels; alpha is the value of an additional channel."""
    layers = [values] * channels
    if alpha is not None:
        layers.append(np.full_like(values, alpha))
    return np.stack(layers, axis=-1)


@pytest.mark.parametrize("filters", [False, True])
@pytest.mark.parametrize("values", [BYTES, WORDS])
def test_grey_png(tmp_path: Path, values: NDArray[Any], filters: bool) -> None:
    raw = read_surface(write_png(tmp_path / "named-wrongly.x3p", values, filters=filters))
    assert_image(raw, values)


@pytest.mark.parametrize("filters", [False, True])
@pytest.mark.parametrize("values", [BYTES, WORDS])
def test_equal_channels_are_read_as_one_grey_image(
    tmp_path: Path, values: NDArray[Any], filters: bool
) -> None:
    full = int(np.iinfo(values.dtype).max)
    path = tmp_path / "grey.png"
    raw = read_surface(write_png(path, stack_channels(values, 3), filters=filters))
    assert_image(raw, values)
    assert "three equal channels: read as one grey image" in raw.notes
    for channels in (1, 3):
        image = stack_channels(values, channels, full)
        raw = read_surface(write_png(path, image, filters=filters))
        assert_image(raw, values)
        assert "alpha channel dropped: opaque everywhere" in raw.notes


def test_paeth_filter_breaks_ties_in_the_standard_order(tmp_path: Path) -> None:
    """With few distinct values the predictor often has ties, whose order matters."""
    few = RNG.integers(0, 5, (40, 60), dtype=np.uint16) * 257
    path = write_png(tmp_path / "ties.png", stack_channels(few, 3), filters=True)
    assert_image(read_surface(path), few)


@pytest.mark.parametrize("values", [BYTES, WORDS])
@pytest.mark.parametrize("channels", [1, 3])
def test_transparency_is_refused(tmp_path: Path, values: NDArray[Any], channels: int) -> None:
    image = stack_channels(values, channels, int(np.iinfo(values.dtype).max))
    image[2, 3, -1] -= 1
    with pytest.raises(SurfaceFileError, match=r"1 of \d+ pixels are transparent"):
        read_surface(write_png(tmp_path / "clear.png", image))
    tiff = write_tiff(
        tmp_path / "clear.tif", image, photometric=2 if channels == 3 else 1, extra_sample=2
    )
    with pytest.raises(SurfaceFileError, match=r"1 of \d+ pixels are transparent"):
        read_surface(tiff)


@pytest.mark.parametrize("values", [BYTES, WORDS])
def test_colour_images_are_refused(tmp_path: Path, values: NDArray[Any]) -> None:
    image = stack_channels(values, 3)
    image[-1, -1, 1] ^= 1  # the smallest possible difference
    for path in (
        write_png(tmp_path / "colour.png", image),
        write_tiff(tmp_path / "colour.tif", image, photometric=2),
    ):
        with pytest.raises(SurfaceFileError, match="a colour image: its three channels differ"):
            read_surface(path)


def test_unsupported_png_features_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "odd.png"
    palette = chunk(b"PLTE", bytes(768))
    with pytest.raises(SurfaceFileError, match="has a palette"):
        read_surface(write_png(path, BYTES, colour=3, extra=palette))
    with pytest.raises(SurfaceFileError, match="has 4 bit per pixel"):
        read_surface(write_png(path, BYTES, depth=4))
    frames = chunk(b"acTL", struct.pack(">II", 12, 0))
    with pytest.raises(SurfaceFileError, match="an animation of 12 frames"):
        read_surface(write_png(path, BYTES, extra=frames))
    with pytest.raises(SurfaceFileError, match="a transparent colour"):
        read_surface(write_png(path, BYTES, extra=chunk(b"tRNS", b"\0\1")))


@pytest.mark.parametrize("image", [BYTES, stack_channels(WORDS, 3)])
def test_damaged_png_is_refused(tmp_path: Path, image: NDArray[Any]) -> None:
    path = write_png(tmp_path / "cut.png", image)
    whole = path.read_bytes()
    for length in (9, 33, 40, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(SurfaceFileError, match=r"cut\.png: (truncated|damaged) PNG"):
            read_surface(path)
    path.write_bytes(whole[:60] + bytes([whole[60] ^ 1]) + whole[61:])
    with pytest.raises(SurfaceFileError, match=r"damaged PNG image .checksum"):
        read_surface(path)


def test_false_size_in_a_header_allocates_no_memory(tmp_path: Path) -> None:
    path = tmp_path / "lie.png"
    with pytest.raises(SurfaceFileError, match="cannot hold 10000 x 10000 pixels"):
        read_surface(write_png(path, BYTES, size=(10000, 10000)))
    with pytest.raises(SurfaceFileError, match="4000000000 x 2000000000 points; at most"):
        read_surface(write_png(path, BYTES, size=(4_000_000_000, 2_000_000_000)))
    for image in (BYTES, stack_channels(WORDS, 3)):
        rows, columns = image.shape[:2]
        with pytest.raises(SurfaceFileError, match=r"truncated|damaged"):
            read_surface(write_png(path, image, size=(columns, rows + 1)))
    path = write_tiff(tmp_path / "lie.tif", WORDS, tags={257: (4, struct.pack("<I", 10_000))})
    with pytest.raises(SurfaceFileError, match="truncated: 234 bytes cannot hold 9 x 10000"):
        read_surface(path)


@pytest.mark.parametrize("big_endian", [False, True])
@pytest.mark.parametrize("kind", ["u1", "u2", "i2", "u4", "i4", "f2", "f4", "f8"])
def test_grey_tiff(tmp_path: Path, kind: str, big_endian: bool) -> None:
    values = (1000 * FLOATS).astype(kind) if kind[0] != "u" else WORDS.astype(kind)
    assert_image(
        read_surface(write_tiff(tmp_path / "grey.png", values, big_endian=big_endian)), values
    )


def test_float_tiff_with_missing_points(tmp_path: Path) -> None:
    values = FLOATS.copy()
    values[1, 2] = np.nan
    values[3, 4] = -9999.0
    raw = read_surface(write_tiff(tmp_path / "a.tif", values, tags={42113: (2, b"-9999\0")}))
    expected = values.astype(np.float64)
    expected[3, 4] = np.nan
    np.testing.assert_array_equal(raw.heights, expected)
    assert "1 point of -9999, which marks a missing point" in raw.notes
    values[0, 0] = np.inf
    with pytest.raises(SurfaceFileError, match=r"infinite height at index \(0, 0\)"):
        read_surface(write_tiff(tmp_path / "a.tif", values))


def test_rgb_tiff_of_equal_channels_and_inverted_tiff(tmp_path: Path) -> None:
    for image in (stack_channels(WORDS, 3), stack_channels(WORDS, 3, 65535)):
        extra = None if image.shape[-1] == 3 else 2
        raw = read_surface(write_tiff(tmp_path / "a.tif", image, photometric=2, extra_sample=extra))
        assert_image(raw, WORDS)
    raw = read_surface(write_tiff(tmp_path / "a.tif", BYTES, photometric=0))
    assert_image(raw, 255 - BYTES)
    assert any("white is high" in note for note in raw.notes)


def test_unsupported_tiff_features_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "odd.tif"
    with pytest.raises(SurfaceFileError, match="has 3 pages; one is expected"):
        read_surface(write_tiff(path, WORDS, pages=3))
    with pytest.raises(SurfaceFileError, match="has a palette"):
        read_surface(write_tiff(path, BYTES, photometric=3, tags={320: (3, bytes(1536))}))
    with pytest.raises(SurfaceFileError, match="has 5 channels"):
        read_surface(write_tiff(path, stack_channels(BYTES, 5)))
    with pytest.raises(SurfaceFileError, match="stores its pixels as SEPARATED"):
        read_surface(write_tiff(path, stack_channels(BYTES, 4), photometric=5))
    description = (2, b"ImageJ=1.53\nimages=4\nslices=4\n\0")
    with pytest.raises(SurfaceFileError, match="has 4 pages"):
        read_surface(write_tiff(path, WORDS, tags={270: description}))


@pytest.mark.parametrize("compression", ["tiff_lzw", "tiff_adobe_deflate", "packbits"])
@pytest.mark.parametrize("values", [BYTES, WORDS, FLOATS])
def test_compressed_tiff(tmp_path: Path, values: NDArray[Any], compression: str) -> None:
    from PIL import Image

    path = tmp_path / "packed.tif"
    Image.fromarray(values).save(path, compression=compression)
    assert_image(read_surface(path), values)


def test_tiled_tiff_with_a_thumbnail(tmp_path: Path) -> None:
    import tifffile

    path = tmp_path / "tiled.tif"
    large = np.arange(70 * 50, dtype=np.uint16).reshape(70, 50)
    with tifffile.TiffWriter(path) as file:
        file.write(large, tile=(32, 16), compression="zlib", predictor=True)
        file.write(large[::4, ::4], subfiletype=1)
    assert_image(read_surface(path), large)


def test_damaged_tiff_is_refused(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "cut.tif", WORDS)
    whole = path.read_bytes()
    for length in (4, 8, 100, len(whole) - 40):
        path.write_bytes(whole[:length])
        with pytest.raises(SurfaceFileError, match=r"cut\.tif: "):
            read_surface(path)


def test_arguments_of_other_formats_are_refused(tmp_path: Path) -> None:
    path = write_png(tmp_path / "grey.png", BYTES)
    with pytest.raises(ParameterError, match="channel must not be given"):
        read_surface(path, channel="R")
    with pytest.raises(ParameterError, match=r"unit must not be given.*none at all"):
        read_surface(path, unit="mm")


def test_pillow_and_tifffile_agree_with_the_writers(tmp_path: Path) -> None:
    """Files of the test writers are valid: other libraries read the same values."""
    import tifffile
    from PIL import Image

    path = write_png(tmp_path / "a.png", WORDS, filters=True)
    with Image.open(path) as image:
        np.testing.assert_array_equal(np.asarray(image), WORDS)
    np.testing.assert_array_equal(tifffile.imread(write_tiff(tmp_path / "a.tif", FLOATS)), FLOATS)


def test_png_written_by_pillow(tmp_path: Path) -> None:
    from PIL import Image

    for values in (BYTES, WORDS):
        stream = io.BytesIO()
        Image.fromarray(values).save(stream, "PNG", optimize=True)
        (tmp_path / "a.png").write_bytes(stream.getvalue())
        assert_image(read_surface(tmp_path / "a.png"), values)


def test_surplus_compressed_data_is_not_unpacked(tmp_path: Path) -> None:
    """Compressed data beyond the pixels is ignored: decompression stops at the header's size."""
    image = stack_channels(WORDS, 3)
    path = write_png(tmp_path / "a.png", image)
    whole = path.read_bytes()
    compressed = zlib.compress(
        b"".join(b"\0" + row.astype(">u2").tobytes() for row in image) + bytes(10**7)
    )
    content = whole[:33] + chunk(b"IDAT", compressed) + chunk(b"IEND", b"")
    path.write_bytes(content)
    assert_image(read_surface(path), WORDS)
