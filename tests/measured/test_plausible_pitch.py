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
    with pytest.raises(ParameterError, match=r"pitch must be given: part\.nms says .*pitch="):
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


@pytest.mark.parametrize("orientation", range(1, 10))
def test_turned_tiff_is_refused(tmp_path: Path, orientation: int) -> None:
    import tifffile

    path, heights = tmp_path / "a.tif", np.arange(20, dtype=np.uint16).reshape(4, 5)
    tifffile.imwrite(path, heights, extratags=[(274, "H", 1, orientation, True)])
    if orientation == 1:
        np.testing.assert_array_equal(read_surface(path).heights, heights)
        return
    with pytest.raises(SurfaceFileError, match=f"mirrored .Orientation {orientation}.: turn it"):
        read_surface(path)
