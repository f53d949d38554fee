"""Surfaces written in each format and read back agree within the format's resolution."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from asperity.measured.reading import read_surface

sys.path.insert(0, str(Path(__file__).parents[1] / "writers"))
from image_writer import write_png, write_tiff
from sdf_writer import SdfSpec, write_ascii, write_binary
from x3p_writer import X3pSpec, write_x3p

Floats = NDArray[np.float64]
Writer = Callable[[Path, Floats], float]


def surface() -> Floats:
    """Return heights [m] of a generic map of 40 x 56 points."""
    i, j = np.mgrid[0.0:40, 0.0:56]
    rough = np.random.default_rng(25).normal(scale=3e-7, size=i.shape)
    return np.asarray(4e-6 * np.sin(0.31 * j + 0.17 * i) + 1e-7 * j + rough)


def x3p(path: Path, heights: Floats) -> float:
    write_x3p(path, X3pSpec(heights))
    return 0.0


def x3p_integers(path: Path, heights: Floats) -> float:
    step = 1e-9
    spec = X3pSpec(np.rint(heights / step), code="I", z_type="I", z_increment=repr(step))
    write_x3p(path, spec)
    return step / 2


def npy(path: Path, heights: Floats) -> float:
    with path.open("wb") as stream:
        np.save(stream, heights)
    return 0.0


def npy_single(path: Path, heights: Floats) -> float:
    with path.open("wb") as stream:
        np.save(stream, heights.astype(np.float32))
    return float(np.abs(heights).max()) * 2**-24


def text(path: Path, heights: Floats) -> float:
    rows = "\n".join(",".join(f"{z * 1e6:.4f}" for z in row) for row in heights)
    path.write_text("heights in um\n" + rows + "\n")
    return 0.5e-10


def sdf_text(path: Path, heights: Floats) -> float:
    write_ascii(path, SdfSpec(heights / 1e-6, scale=("2e-6", "3e-6", "1e-6"), kind=7))
    return 0.0


def sdf_integers(path: Path, heights: Floats) -> float:
    stored = np.rint(heights / 1e-9)
    write_ascii(path, SdfSpec(stored, scale=("2e-6", "3e-6", "1e-9"), kind=6))
    return 0.5e-9


def sdf_binary(path: Path, heights: Floats) -> float:
    write_binary(path, SdfSpec(heights, scale=("2e-6", "3e-6", "1"), version="ISO-2.0"))
    return 0.0


@dataclass(frozen=True)
class Case:
    write: Writer
    pitch: tuple[float, float] | None


LENGTH_FORMATS = [
    Case(x3p, (2e-6, 3e-6)),
    Case(x3p_integers, (2e-6, 3e-6)),
    Case(npy, None),
    Case(npy_single, None),
    Case(text, None),
    Case(sdf_text, (2e-6, 3e-6)),
    Case(sdf_integers, (2e-6, 3e-6)),
    Case(sdf_binary, (2e-6, 3e-6)),
]


@pytest.mark.parametrize("case", LENGTH_FORMATS, ids=lambda case: case.write.__name__)
def test_formats_with_lengths_round_trip_within_resolution(tmp_path: Path, case: Case) -> None:
    heights = surface()
    path = tmp_path / "surface.dat"
    resolution = case.write(path, heights)
    raw = read_surface(path)
    assert raw.heights.shape == heights.shape
    error = np.abs(raw.heights - heights).max()
    assert error <= resolution * (1 + 1e-6) + 4e-21
    assert error >= 0.7 * resolution  # the tolerance is no wider than the format
    assert raw.pitch == case.pitch


def png16(path: Path, heights: Floats) -> float:
    span = np.ptp(heights)
    write_png(path, np.rint((heights - heights.min()) / span * 65535).astype(np.uint16))
    return 0.5 / 65535


def png8(path: Path, heights: Floats) -> float:
    span = np.ptp(heights)
    write_png(path, np.rint((heights - heights.min()) / span * 255).astype(np.uint8))
    return 0.5 / 255


def tiff16(path: Path, heights: Floats) -> float:
    span = np.ptp(heights)
    write_tiff(path, np.rint((heights - heights.min()) / span * 65535).astype(np.uint16))
    return 0.5 / 65535


def tiff_single(path: Path, heights: Floats) -> float:
    write_tiff(path, heights.astype(np.float32))
    return float(np.abs(heights).max() / np.ptp(heights)) * 2**-23


def tiff_double(path: Path, heights: Floats) -> float:
    write_tiff(path, heights, big_endian=True)
    return 0.0


@pytest.mark.parametrize(
    "write", [png8, png16, tiff16, tiff_single, tiff_double], ids=lambda write: write.__name__
)
def test_image_formats_round_trip_up_to_scale(tmp_path: Path, write: Writer) -> None:
    """Images store no lengths, so heights are compared after scaling to their range."""
    heights = surface()
    path = tmp_path / "surface.dat"
    resolution = write(path, heights)
    raw = read_surface(path)
    assert raw.relative
    assert raw.pitch is None
    scaled = (raw.heights - raw.heights.min()) / np.ptp(raw.heights)
    expected = (heights - heights.min()) / np.ptp(heights)
    error = np.abs(scaled - expected).max()
    assert error <= resolution * (1 + 1e-6) + 1e-15
    assert error >= 0.3 * resolution
