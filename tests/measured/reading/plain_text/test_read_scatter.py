"""Scattered points: refused with advice, and interpolated with ``resample``."""

from __future__ import annotations

import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from asperity import load_texture
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import ReadingOptions, SurfaceFile, read_surface
from asperity.measured.reading.plain_text.text_reader import read_text
from asperity.measured.reading.resampling import (
    _describe_holdout_error,
    resample_points,
    resample_profile,
)

MAIN = "from asperity.cli.main import main; main()"
RNG = np.random.default_rng(11)
POSITIONS = RNG.uniform(0.0, 1e-3, (1500, 2))


def wave(positions: np.ndarray) -> np.ndarray:
    x, y = positions[..., 0], positions[..., 1]
    return 5e-6 * np.sin(2 * np.pi * (x + 0.4 * y) / 4e-4)


def write(folder: Path, positions: np.ndarray, heights: np.ndarray) -> Path:
    path = folder / "points.xyz"
    rows = (f"{x:.9e} {y:.9e} {z:.9e}" for (x, y), z in zip(positions, heights, strict=True))
    path.write_text("x [m] y [m] z [m]\n" + "\n".join(rows) + "\n")
    return path


def test_refusal_suggests_a_working_pitch(tmp_path: Path) -> None:
    path = write(tmp_path, POSITIONS, wave(POSITIONS))
    with pytest.raises(SurfaceFileError, match=r"no regular grid.*--resample") as refusal:
        read_surface(path)
    match = re.search(r"resample=([0-9.e-]+) ", str(refusal.value))
    assert match is not None
    pitch = float(match.group(1))
    raw = read_surface(path, resample=pitch)
    assert raw.pitch == (pitch, pitch)
    assert raw.has_units
    assert 0.8 < raw.heights.size / len(POSITIONS) < 1.25  # as dense as the points
    rows, columns = raw.heights.shape
    y, x = np.mgrid[:rows, :columns] * pitch + POSITIONS.min(axis=0)[::-1, None, None]
    deviation = raw.heights - wave(np.stack((x, y), axis=-1))
    measured = ~np.isnan(deviation)
    assert measured.mean() > 0.9
    rms = float(np.sqrt(np.mean(deviation[measured] ** 2)))
    stated = re.search(r"missed by ([0-9.]+) nm rms, ([0-9.]+) (nm|µm) at most", raw.notes[-1])
    assert stated is not None, raw.notes
    # Cross-validation uses points farther apart, so it bounds this error, within a factor of 4.
    assert rms < 1e-9 * float(stated.group(1)) < 4 * rms


def test_plane_is_interpolated_exactly_inside_the_hull(tmp_path: Path) -> None:
    inside = POSITIONS[
        POSITIONS.sum(axis=1) < 1e-3
    ]  # a triangle; the far corner of the grid is outside
    raw = read_surface(
        write(tmp_path, inside, 0.1 * inside[:, 0] - 0.3 * inside[:, 1]), resample=5e-5
    )
    rows, columns = raw.heights.shape
    y, x = np.mgrid[:rows, :columns] * 5e-5 + inside.min(axis=0)[::-1, None, None]
    outside = np.isnan(raw.heights)
    assert outside[-1, -1]
    assert not outside[2, 2]
    np.testing.assert_array_equal(outside[x + y > 1e-3], True)
    np.testing.assert_allclose(raw.heights[~outside], (0.1 * x - 0.3 * y)[~outside], atol=1e-12)


def test_invalid_points_and_pitches_are_refused(tmp_path: Path) -> None:
    line = np.stack((POSITIONS[:, 0], 2 * POSITIONS[:, 0]), axis=-1)
    with pytest.raises(SurfaceFileError, match=r"points\.xyz: the points lie on one line"):
        read_surface(write(tmp_path, line, wave(line)), resample=1e-5)
    duplicated = np.concatenate((POSITIONS, POSITIONS[:1]))
    with pytest.raises(SurfaceFileError, match="same position"):
        read_surface(write(tmp_path, duplicated, wave(duplicated)), resample=1e-5)
    path = write(tmp_path, POSITIONS, wave(POSITIONS))
    too_fine = "resample is too fine for 1500 points"
    with pytest.raises(ParameterError, match=too_fine):
        read_surface(path, resample=2e-6)  # other readers are tried before the refusal
    for pitch in (1e-12, 1e-29):
        with pytest.raises(ParameterError, match=too_fine):
            read_text(SurfaceFile.open(path), ReadingOptions(resample=pitch))
    for wrong in (0.0, -1e-5, np.nan, "5 kg"):
        with pytest.raises(ParameterError, match=r"resample must be (positive|finite|a quantity)"):
            read_surface(path, resample=wrong)  # wrong type on purpose
    other = tmp_path / "a.txt"
    other.write_text("1 2 3 4\n5 6 7 8\n")
    np.save(tmp_path / "a.npy", np.eye(4))
    for file in (other, tmp_path / "a.npy"):
        with pytest.raises(ParameterError, match="no list of points"):
            read_surface(file, resample=1e-5)


def test_few_points_have_no_error_estimate() -> None:
    heights, note = resample_points(
        np.array([[0, 0, 1.0], [1, 0, 1], [0, 1, 1], [np.nan] * 3]), 0.5
    )
    assert heights[0].tolist() == [1.0, 1.0, 1.0]
    assert "too few points to know its error" in note


def test_resample_works_in_library_scene_and_command_line(tmp_path: Path) -> None:
    path = write(tmp_path, POSITIONS, wave(POSITIONS))
    texture = load_texture(path, resample=2.5e-5)
    assert any("interpolated linearly" in step for step in texture.preparation)
    scene = tmp_path / "scene.toml"
    scene.write_text('[texture]\nkind = "file"\npath = "points.xyz"\nresample = "25 µm"\n')
    for arguments in ([str(path), "--resample", "25um"], [str(scene)]):
        process = subprocess.run(
            [sys.executable, "-c", MAIN, "compare", *arguments, "--laws", "W"],
            capture_output=True,
            text=True,
            check=False,
        )
        assert process.returncode == 0, process.stderr
        assert "interpolated" in process.stdout


def test_error_of_a_huge_profile_does_not_overflow() -> None:
    """The square of 1e308 overflows, so the RMS error must be computed with scaling."""
    _, note = resample_profile(np.arange(4.0), np.array([0.0, 1e308, 0.0, 0.0]), 1.0)
    assert "inf" not in note


def test_error_of_a_huge_map_does_not_overflow() -> None:
    x, y = (axis.ravel().astype(float) for axis in np.meshgrid(np.arange(20), np.arange(20)))
    heights = 1e300 * RNG.normal(size=400)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "inf" not in _describe_holdout_error(np.column_stack([x, y]), heights)
