"""Absurd pitches and slopes of a file are questions; a given pitch or height range answers them."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.preparation import MIN_MEAN_SLOPE, PITCH_LIMITS, prepare
from asperity.measured.reading import RawSurface, read_surface

HEIGHTS = 1e-7 * np.random.default_rng(4).normal(size=(12, 15))


@pytest.mark.parametrize("pitch", [0.3125, 0.101, 0.99e-11])
def test_absurd_pitch_of_a_file_must_be_confirmed(pitch: float) -> None:
    raw = RawSurface(HEIGHTS * pitch, (pitch, pitch), "part.nms", ())
    with pytest.raises(ParameterError, match=r"pitch must be given: part\.nms says .*--pitch"):
        prepare(raw)
    with pytest.raises(ParameterError, match="height_range"):  # the slope is left to confirm
        prepare(raw, pitch=pitch)
    prepare(raw, pitch=pitch, height_range=1e-6)


def test_pitches_at_the_limits_are_accepted() -> None:
    for pitch in PITCH_LIMITS:
        prepare(RawSurface(1e6 * HEIGHTS * pitch, (pitch, pitch), "part.sdf", ()))


def test_absurdly_small_slope_must_be_confirmed() -> None:
    for slope, match in ((2.0, ""), (0.5, "height_range must be given: .* less than 1e-06")):
        heights = np.tile([0.0, 1.0], (6, 4)) * slope * MIN_MEAN_SLOPE * 1e-5
        raw = RawSurface(heights, (1e-5, 1e-5), "part.sdf", ())
        if match:
            with pytest.raises(ParameterError, match=match):
                prepare(raw)
        else:
            prepare(raw)
    prepare(RawSurface(np.zeros((5, 5)), (1e-5, 1e-5), "flat.sdf", ()))


def test_nanofocus_file_is_refused(tmp_path: Path) -> None:
    """Its pitch of 312.5 nm would be read as 312.5 mm."""
    pytest.importorskip("SurfaceTopography", reason="the extra 'formats' is not installed")
    head = bytearray(3468)
    struct.pack_into("<2d", head, 16, -1.0, 1.0)
    struct.pack_into("<2I2d", head, 1368, 12, 9, 312.5, 312.5)
    numbers = np.arange(108, dtype="<u2").tobytes()
    (tmp_path / "a.nms").write_bytes(bytes(head) + numbers)
    with pytest.raises(SurfaceFileError, match="may misread: its pitch in nanometres"):
        read_surface(tmp_path / "a.nms")


@pytest.mark.parametrize("orientation", range(1, 9))
def test_turned_tiff_is_turned_upright(tmp_path: Path, orientation: int) -> None:
    """Pillow's own transposition is the witness; the pixel size of ImageJ turns along."""
    import tifffile
    from PIL import Image, ImageOps

    path, heights = tmp_path / "a.tif", np.arange(20, dtype=np.uint16).reshape(4, 5)
    tag = (274, "H", 1, orientation, True)
    resolution = (0.5, 0.25)  # pixels per micrometre along the stored rows and columns
    tifffile.imwrite(
        path, heights, imagej=True, resolution=resolution, metadata={"unit": "um"}, extratags=[tag]
    )
    image = Image.fromarray(heights.astype(np.int32), "I")
    image.getexif()[274] = orientation
    expected = np.asarray(ImageOps.exif_transpose(image))
    raw = read_surface(path)
    np.testing.assert_array_equal(raw.heights, expected)
    assert raw.pitch == pytest.approx((2e-6, 4e-6) if orientation < 5 else (4e-6, 2e-6))
    assert any(f"Orientation {orientation} " in note for note in raw.notes) == (orientation > 1)


def test_undefined_orientation_is_refused(tmp_path: Path) -> None:
    import tifffile

    path = tmp_path / "a.tif"
    tifffile.imwrite(path, np.zeros((4, 5), np.uint8), extratags=[(274, "H", 1, 9, True)])
    with pytest.raises(SurfaceFileError, match="Orientation 9; 1 to 8"):
        read_surface(path)


def test_turned_and_compressed_tiff_is_refused(tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "a.tif"
    image = Image.fromarray(np.arange(20, dtype=np.uint8).reshape(4, 5))
    image.save(path, tiffinfo={274: 6}, compression="tiff_lzw")
    with pytest.raises(SurfaceFileError, match="compressed and stored turned"):
        read_surface(path)
