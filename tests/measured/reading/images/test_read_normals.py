"""Normal maps: recognition, refusal, and integration with a stated error."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface, read_surface
from asperity.measured.reading.images.normal_maps import is_normal_map

sys.path.insert(0, str(Path(__file__).parents[2] / "writers"))
from image_writer import write_png, write_tiff

Floats = NDArray[np.float64]
SHAPE = (96, 128)
ROW, COLUMN = np.mgrid[0.0 : SHAPE[0], 0.0 : SHAPE[1]]


def waves(tilt: float = 0.0) -> tuple[Floats, Floats, Floats]:
    """Return height, slope along x and slope down the image, in pixels; not symmetric."""
    a, b, k, m = 2.0, 1.3, 2 * np.pi / 31, 2 * np.pi / 23
    u = 0.21 * ROW + 0.11 * COLUMN
    height = a * np.sin(k * COLUMN + 0.4) * np.cos(m * ROW + 0.2) + b * np.sin(u) + tilt * COLUMN
    along_x = a * k * np.cos(k * COLUMN + 0.4) * np.cos(m * ROW + 0.2) + 0.11 * b * np.cos(u) + tilt
    down = -a * m * np.sin(k * COLUMN + 0.4) * np.sin(m * ROW + 0.2) + 0.21 * b * np.cos(u)
    return height, along_x, down


def encode_normals(
    along_x: Floats, down: Floats, bits: int = 16, *, up: bool = True
) -> NDArray[Any]:
    """Return a normal map whose green channel points up (OpenGL) or down (Direct3D)."""
    normals = np.stack((-along_x, down if up else -down, np.ones(SHAPE)), axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    full = 2**bits - 1
    return np.rint((normals + 1) / 2 * full).astype(np.uint16 if bits == 16 else np.uint8)


def integrate(tmp_path: Path, image: NDArray[Any]) -> RawSurface:
    return read_surface(write_png(tmp_path / "n.png", image), integrate_normals=True)


def relative_error(raw: RawSurface, height: Floats) -> float:
    """Return the RMS error of the heights without means, relative to the RMS height."""
    expected = height - height.mean()
    return float(np.sqrt(np.mean((raw.heights - expected) ** 2) / np.mean(expected**2)))


def stated_mismatch(raw: RawSurface) -> tuple[float, float]:
    """Return the mismatch stated in the notes, absolute and relative."""
    pattern = r"RMS mismatch of the slopes (\S+) \((\S+) of their RMS"
    match = next(filter(None, (re.search(pattern, note) for note in raw.notes)))
    return float(match[1]), float(match[2])


@pytest.mark.parametrize("bits", [8, 16])
def test_normal_map_is_refused_with_advice(tmp_path: Path, bits: int) -> None:
    _, along_x, down = waves()
    path = write_png(tmp_path / "n.png", encode_normals(along_x, down, bits))
    with pytest.raises(SurfaceFileError, match=r"looks like a normal map.*integrate_normals=True"):
        read_surface(path)


@pytest.mark.parametrize("tilt", [0.0, 0.3])
@pytest.mark.parametrize(("bits", "tolerance"), [(16, 2e-3), (8, 2e-2)])
def test_integration_recovers_the_heights(
    tmp_path: Path, bits: int, tolerance: float, tilt: float
) -> None:
    height, along_x, down = waves(tilt)
    raw = integrate(tmp_path, encode_normals(along_x, down, bits))
    if bits == 8:  # a constant rounding error is a tilt, which levelling removes
        fit = np.linalg.lstsq(
            np.stack((COLUMN.ravel(), ROW.ravel(), np.ones(ROW.size)), axis=1),
            (raw.heights - height).ravel(),
            rcond=None,
        )[0]
        assert np.abs(fit[:2]).max() < 2 / 255
        height = height + fit[0] * COLUMN + fit[1] * ROW
    assert relative_error(raw, height) < tolerance
    assert raw.per_pitch
    assert raw.relative
    assert raw.pitch is None


@pytest.mark.parametrize("up", [True, False])
def test_direction_of_the_green_channel_is_detected(tmp_path: Path, up: bool) -> None:
    height, along_x, down = waves()
    raw = integrate(tmp_path, encode_normals(along_x, down, up=up))
    assert relative_error(raw, height) < 2e-3
    assert any(("up (OpenGL)" if up else "down (Direct3D)") in note for note in raw.notes)
    assert any("fits better" in note for note in raw.notes)


def test_ambiguous_direction_of_green_is_noted(tmp_path: Path) -> None:
    _, along_x, _ = waves()
    along_x = np.broadcast_to(along_x[:1], SHAPE)
    raw = integrate(tmp_path, encode_normals(along_x, np.zeros(SHAPE)))
    assert any("check which one your program writes" in note for note in raw.notes)


def test_integration_error_is_of_fourth_order_in_the_pixel(tmp_path: Path) -> None:
    errors = []
    for length in (8.0, 16.0):
        k = 2 * np.pi / length  # whole periods: no border
        slope = 0.5 * np.cos(k * (COLUMN + 0.5))
        image = encode_normals(slope, np.zeros(SHAPE)).astype(np.float64)
        normals = image / 65535 * 2 - 1
        exact = np.stack((-slope, np.zeros(SHAPE), np.ones(SHAPE)), axis=-1)
        assert np.abs(normals - exact / np.linalg.norm(exact, axis=-1, keepdims=True)).max() < 2e-5
        path = write_tiff(
            tmp_path / "n.tif", exact / np.linalg.norm(exact, axis=-1, keepdims=True), photometric=2
        )
        raw = read_surface(path, integrate_normals=True)
        middle = slice(24, 104)
        ratio = (raw.heights * np.sin(k * (COLUMN + 0.5)))[:, middle].mean() / (0.25 / k)
        errors.append(abs(ratio - 1))
    assert errors[0] < 7e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)


def test_stated_mismatch_is_small_for_slopes_and_large_for_noise(tmp_path: Path) -> None:
    _, along_x, down = waves()
    absolute, relative = stated_mismatch(integrate(tmp_path, encode_normals(along_x, down)))
    total = np.sqrt((np.mean(along_x**2) + np.mean(down**2)) / 2)
    assert relative < 2e-3
    assert absolute == pytest.approx(relative * total, rel=0.05)
    # Negative control: slopes that are no gradient.
    swirl = integrate(tmp_path, encode_normals(down, -along_x))
    assert stated_mismatch(swirl)[1] > 0.3


def test_stated_mismatch_is_the_curl_of_the_noise(tmp_path: Path) -> None:
    """Least squares integrates the gradient part of white noise; its curl is the mismatch."""
    height, along_x, down = waves()
    sigma = 0.05
    noise = sigma * np.random.default_rng(3).normal(size=(2, *SHAPE))
    raw = integrate(tmp_path, encode_normals(along_x + noise[0], down + noise[1]))
    kx, ky = np.meshgrid(*(np.pi * (np.arange(400) + 0.5) / 400 for _ in "xy"))

    def transfer(k: Floats) -> Floats:  # transfer function of the integral over one pixel
        return np.asarray((13 * np.cos(k / 2) - np.cos(3 * k / 2)) / 12)

    sx, sy = np.sin(kx / 2), np.sin(ky / 2)
    curl = ((transfer(kx) * sy) ** 2 + (transfer(ky) * sx) ** 2) / (sx**2 + sy**2)
    assert stated_mismatch(raw)[0] == pytest.approx(sigma * np.sqrt(curl.mean() / 2), rel=0.03)
    assert relative_error(raw, height) < 0.1


def test_in_metres_multiplies_heights_by_the_pitch(tmp_path: Path) -> None:
    height, along_x, down = waves()
    raw = integrate(tmp_path, encode_normals(along_x, down))
    metres = raw.in_metres(2e-5)
    np.testing.assert_allclose(metres.heights, raw.heights * 2e-5, rtol=1e-15)
    assert relative_error(RawSurface(metres.heights / 2e-5, None, "", ()), height) < 2e-3
    assert not metres.relative
    assert not metres.per_pitch
    assert metres.has_units
    assert raw.in_metres((2e-5, 2e-5)).heights[3, 4] == metres.heights[3, 4]
    assert raw.in_metres(None) is raw
    with pytest.raises(ParameterError, match="must be the same along x and y"):
        raw.in_metres((1e-5, 2e-5))
    for wrong in (0.0, -1e-5, float("nan")):
        with pytest.raises(ParameterError, match="pitch must be positive"):
            raw.in_metres(wrong)
    plain = RawSurface(np.zeros((4, 4)), None, "", ())
    assert plain.in_metres(2.0) is plain


def test_steep_normals_are_bounded_and_counted(tmp_path: Path) -> None:
    _, along_x, down = waves()
    image = encode_normals(along_x, down)
    image[4:8, 5] = (65535, 32768, 32768)
    raw = integrate(tmp_path, image)
    assert np.isfinite(raw.heights).all()
    assert any("4 normals near or below the horizon" in note for note in raw.notes)


def test_normal_maps_are_distinguished_from_other_images() -> None:
    rng = np.random.default_rng(4)
    noise = rng.integers(0, 256, (64, 64, 3), dtype=np.uint8)
    assert not is_normal_map(noise)
    grey = np.repeat(noise[..., :1], 3, axis=-1)
    assert not is_normal_map(grey)
    for colour in ((70, 130, 180), (200, 160, 120), (255, 255, 255), (0, 0, 255)):
        assert not is_normal_map(np.full((8, 8, 3), colour, dtype=np.uint8)), colour
    _, along_x, down = waves()
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


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e200, -7.0])
def test_pixels_that_are_no_normals_are_refused(tmp_path: Path, wrong: float) -> None:
    _, along_x, down = waves()
    normals = np.stack((-along_x, down, np.ones(SHAPE)), axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    normals[5, 6:9, 1] = wrong
    path = write_tiff(tmp_path / "n.tif", normals, photometric=2)
    with pytest.raises(SurfaceFileError, match="has 3 pixels that are no normals"):
        read_surface(path, integrate_normals=True)


def test_normal_map_below_4_by_4_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SurfaceFileError, match="less than 4 x 4"):
        integrate(tmp_path, np.full((3, 9, 3), (128, 128, 255), dtype=np.uint8))
