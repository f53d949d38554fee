"""Normal maps: recognition and refusal."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from asperity.core.errors import SurfaceFileError
from asperity.measured.reading import read_surface
from asperity.measured.reading.images.normal_maps import is_normal_map

sys.path.insert(0, str(Path(__file__).parents[2] / "writers"))
from image_writer import write_png

Floats = NDArray[np.float64]
SHAPE = (96, 128)
ROW, COLUMN = np.mgrid[0.0 : SHAPE[0], 0.0 : SHAPE[1]]


def waves() -> tuple[Floats, Floats]:
    """Return slope along x and slope down the image; not symmetric."""
    k, m = 2 * np.pi / 31, 2 * np.pi / 23
    u = 0.21 * ROW + 0.11 * COLUMN
    along_x = 2.0 * k * np.cos(k * COLUMN + 0.4) * np.cos(m * ROW + 0.2) + 0.14 * np.cos(u)
    down = -2.0 * m * np.sin(k * COLUMN + 0.4) * np.sin(m * ROW + 0.2) + 0.27 * np.cos(u)
    return along_x, down


def encode_normals(along_x: Floats, down: Floats, bits: int = 16) -> NDArray[Any]:
    """Return a normal map whose green channel points up (OpenGL)."""
    normals = np.stack((-along_x, down, np.ones(SHAPE)), axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    full = 2**bits - 1
    return np.rint((normals + 1) / 2 * full).astype(np.uint16 if bits == 16 else np.uint8)


@pytest.mark.parametrize("bits", [8, 16])
def test_normal_map_is_refused_with_advice(tmp_path: Path, bits: int) -> None:
    along_x, down = waves()
    path = write_png(tmp_path / "n.png", encode_normals(along_x, down, bits))
    with pytest.raises(SurfaceFileError, match=r"looks like a normal map.*save the height map"):
        read_surface(path)


def test_normal_maps_are_distinguished_from_other_images() -> None:
    rng = np.random.default_rng(4)
    noise = rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)
    assert not is_normal_map(noise)
    grey = np.repeat(noise[..., :1], 3, axis=-1)
    assert not is_normal_map(grey)
    for colour in ((70, 130, 180), (200, 160, 120), (255, 255, 255), (0, 0, 255)):
        assert not is_normal_map(np.full((8, 8, 3), colour, dtype=np.uint8)), colour
    along_x, down = waves()
    normal_map = encode_normals(along_x, down, 8)
    assert is_normal_map(normal_map)
    assert not is_normal_map(255 - normal_map)
    assert not is_normal_map(normal_map[..., [2, 0, 1]])
    mostly = normal_map.copy()
    mostly[:10] = (40, 90, 60)
    assert not is_normal_map(mostly)  # one pixel in ten is not a normal
    mostly = normal_map.copy()
    mostly[:3] = (40, 90, 60)
    assert is_normal_map(mostly)
