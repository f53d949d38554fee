"""Points on no regular grid: refused with what helps, interpolated where it is asked for."""

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
from asperity.measured.reading import read_surface
from asperity.measured.reading.resampling import (
    _describe_holdout_error,
    resample_points,
    resample_profile,
)

MAIN = "from asperity.cli.main import main; main()"
RNG = np.random.default_rng(11)
PLACES = RNG.uniform(0.0, 1e-3, (1500, 2))


def wave(places: np.ndarray) -> np.ndarray:
    x, y = places[..., 0], places[..., 1]
    return 5e-6 * np.sin(2 * np.pi * (x + 0.4 * y) / 4e-4)


def write(folder: Path, places: np.ndarray, heights: np.ndarray) -> Path:
    path = folder / "points.xyz"
    rows = (f"{x:.9e} {y:.9e} {z:.9e}" for (x, y), z in zip(places, heights, strict=True))
    path.write_text("x [m] y [m] z [m]\n" + "\n".join(rows) + "\n")
    return path


def test_the_refusal_names_a_pitch_that_works(tmp_path: Path) -> None:
    path = write(tmp_path, PLACES, wave(PLACES))
    with pytest.raises(SurfaceFileError, match=r"no regular grid.*--resample") as refusal:
        read_surface(path)
    found = re.search(r"resample=([0-9.e-]+) ", str(refusal.value))
    assert found is not None
    pitch = float(found.group(1))
    raw = read_surface(path, resample=pitch)
    assert raw.pitch == (pitch, pitch)
    assert raw.has_units
    assert 0.8 < raw.heights.size / len(PLACES) < 1.25  # the density of the points
    rows, columns = raw.heights.shape
    y, x = np.mgrid[:rows, :columns] * pitch + PLACES.min(axis=0)[::-1, None, None]
    missed = raw.heights - wave(np.stack((x, y), axis=-1))
    known = ~np.isnan(missed)
    assert known.mean() > 0.9
    rms = float(np.sqrt(np.mean(missed[known] ** 2)))
    said = re.search(r"missed by ([0-9.]+) nm rms, ([0-9.]+) (nm|µm) at most", raw.notes[-1])
    assert said is not None, raw.notes
    # What cross-validation says of points farther apart is true of these, and not much more.
    assert rms < 1e-9 * float(said.group(1)) < 4 * rms


def test_a_plane_is_exact_and_the_outside_is_missing(tmp_path: Path) -> None:
    inside = PLACES[PLACES.sum(axis=1) < 1e-3]  # a triangle: the far corner is outside
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


def test_what_cannot_be_interpolated(tmp_path: Path) -> None:
    line = np.stack((PLACES[:, 0], 2 * PLACES[:, 0]), axis=-1)
    with pytest.raises(SurfaceFileError, match=r"points\.xyz: the points lie on one line"):
        read_surface(write(tmp_path, line, wave(line)), resample=1e-5)
    twice = np.concatenate((PLACES, PLACES[:1]))
    with pytest.raises(SurfaceFileError, match="same position"):
        read_surface(write(tmp_path, twice, wave(twice)), resample=1e-5)
    path = write(tmp_path, PLACES, wave(PLACES))
    for pitch in (1e-12, 1e-29, 2e-6):
        with pytest.raises(ParameterError, match="resample is too fine for 1500 points"):
            read_surface(path, resample=pitch)
    for wrong in (0.0, -1e-5, np.nan, "5um"):
        with pytest.raises(ParameterError, match=r"resample must be (positive|finite|a number)"):
            read_surface(path, resample=wrong)  # what is refused
    other = tmp_path / "a.txt"
    other.write_text("1 2 3 4\n5 6 7 8\n")
    np.save(tmp_path / "a.npy", np.eye(4))
    for file in (other, tmp_path / "a.npy"):
        with pytest.raises(ParameterError, match="no list of points"):
            read_surface(file, resample=1e-5)


def test_few_points_say_so() -> None:
    heights, said = resample_points(
        np.array([[0, 0, 1.0], [1, 0, 1], [0, 1, 1], [np.nan] * 3]), 0.5
    )
    assert heights[0].tolist() == [1.0, 1.0, 1.0]
    assert "too few points to know its error" in said


def test_library_scene_and_command_line_have_it(tmp_path: Path) -> None:
    path = write(tmp_path, PLACES, wave(PLACES))
    texture = load_texture(path, resample=2.5e-5)
    assert any("interpolated linearly" in step for step in texture.preparation)
    scene = tmp_path / "scene.toml"
    scene.write_text('[texture]\nkind = "file"\npath = "points.xyz"\nresample = "25 µm"\n')
    for given in ([str(path), "--resample", "25um"], [str(scene)]):
        done = subprocess.run(
            [sys.executable, "-c", MAIN, "compare", *given, "--laws", "W"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert "interpolated" in done.stdout


def test_what_a_line_misses_may_be_huge() -> None:
    """The square of 1e308 is infinite: its mean was said, with a warning of NumPy's."""
    _, said = resample_profile(np.arange(4.0), np.array([0.0, 1e308, 0.0, 0.0]), 1.0)
    assert "inf" not in said


def test_what_a_plane_misses_may_be_huge() -> None:
    x, y = (axis.ravel().astype(float) for axis in np.meshgrid(np.arange(20), np.arange(20)))
    heights = 1e300 * RNG.normal(size=400)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "inf" not in _describe_holdout_error(np.column_stack([x, y]), heights)
