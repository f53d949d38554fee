"""Text files with non-length columns, and points on no grid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import SurfaceFileError
from asperity.measured.reading import RawSurface, read_surface

PROFILE = "X;Y;valid\n[mm];[mm];[1/0]\n"
ROWS = "8.6722;106.25;1\n8.6727;-999;0\n8.6732;106.5;1\n8.6737;106.75;1\n"


def read_text(folder: Path, text: str, encoding: str = "utf-8", **arguments: Any) -> RawSurface:
    path = folder / "a.txt"
    path.write_bytes(text.encode(encoding))
    return read_surface(path, **arguments)


def test_profile_with_a_validity_column(tmp_path: Path) -> None:
    raw = read_text(tmp_path, PROFILE + ROWS)
    assert raw.pitch == pytest.approx((5e-7,), rel=1e-9)
    np.testing.assert_allclose(raw.heights, [0.10625, np.nan, 0.1065, 0.10675], rtol=1e-12)
    assert raw.has_units
    assert raw.notes == ("1 of 4 points are marked as not valid: missing",)
    assert read_text(tmp_path, (PROFILE + ROWS).replace(";", "\t")).heights.shape == (4,)


@pytest.mark.parametrize(
    "header",
    [
        "x;y;z;valid\n[um];[um];[nm];[0/1]\n",
        "valid;x [um];y [um];z [nm]\n",
        "x [um] y [um] z [nm] mask\n",
    ],
)
def test_points_with_a_validity_column(tmp_path: Path, header: str) -> None:
    first = header.startswith("valid")
    rows = []
    for y in range(3):
        for x in range(4):
            is_invalid = (x, y) == (2, 1)
            cells = [f"{2 * x}", f"{3 * y}", "1e9" if is_invalid else f"{x + 10 * y}"]
            flag = "0" if is_invalid else "1"
            rows.append([flag, *cells] if first else [*cells, flag])
    separator = ";" if ";" in header else " "
    raw = read_text(tmp_path, header + "".join(separator.join(row) + "\n" for row in rows))
    expected = 1e-9 * (np.arange(4.0) + 10 * np.arange(3.0)[:, None])
    expected[1, 2] = np.nan
    np.testing.assert_allclose(raw.heights, expected, rtol=1e-12)
    assert raw.pitch == pytest.approx((2e-6, 3e-6), rel=1e-12)


def test_unnamed_third_column_is_a_height(tmp_path: Path) -> None:
    """Three columns ending in 0 or 1 are points x, y, z unless the header names a validity."""
    raw = read_text(tmp_path, "0 0 1\n1 0 0\n0 1 1\n1 1 1\n", unit="m")
    np.testing.assert_array_equal(raw.heights, [[1, 0], [1, 1]])


def test_validity_other_than_0_or_1_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SurfaceFileError, match="line 4: validity must be 0 or 1"):
        read_text(tmp_path, PROFILE + ROWS.replace("-999;0", "-999;7"))


def test_index_column_is_dropped(tmp_path: Path) -> None:
    rows = "".join(f"{k},{-9 + 0.5 * k},{k % 3}\n" for k in range(6))
    raw = read_text(tmp_path, "index,x in µm,y in µm\n" + rows, "utf-16")
    assert raw.pitch == pytest.approx((5e-7,), rel=1e-9)
    np.testing.assert_allclose(raw.heights, 1e-6 * np.array([0, 1, 2, 0, 1, 2]), rtol=1e-12)
    assert raw.notes == ("the first column numbers the points: left out",)
    later = "".join(f"{k + 5},{-9 + 0.5 * k},{k % 3}\n" for k in range(6))
    for other in (rows.replace("3,", "8,", 1), later):  # not consecutive from 0: columns x, y, z
        with pytest.raises(SurfaceFileError, match="are not x and z, or x, y and z"):
            read_text(tmp_path, "index,x in µm,y in µm\n" + other, "utf-16")


# --- uneven profiles ------------------------------------------------------------------------------


def test_points_on_no_grid_are_refused_with_advice(tmp_path: Path) -> None:
    profile = "x [um] z [nm]\n0 0\n1 2\n4 8\n5 10\n6.5 13\n8 16\n"
    scattered = "x [um] y [um] z [nm]\n0 0 1\n1 0.3 2\n0.2 1 3\n1.1 1.2 4\n0.6 0.5 5\n2 2 6\n"
    for text in (profile, scattered):
        with pytest.raises(SurfaceFileError, match=r"interpolate them to a grid first.*griddata"):
            read_text(tmp_path, text)


def test_uneven_profile_of_an_instrument_file(tmp_path: Path) -> None:
    """SurfaceTopography reads a NetCDF profile with nonuniform positions."""
    pytest.importorskip("SurfaceTopography", reason="SurfaceTopography is not installed")
    from SurfaceTopography import NonuniformLineScan

    line = NonuniformLineScan([0.0, 1.0, 4.0, 5.0, 8.0], [0.0, 2.0, 8.0, 10.0, 16.0], unit="um")
    path = tmp_path / "line.nc"
    line.to_netcdf(str(path))
    with pytest.raises(SurfaceFileError, match="not evenly spaced: interpolate them"):
        read_surface(path)


def test_esri_grid_is_refused_with_advice(tmp_path: Path) -> None:
    """Its first row is the northern one: as a matrix it would be mirrored."""
    grid = "ncols 4\nnrows 3\nxllcorner 3.0\nyllcorner 4\ncellsize 30\n1 2 3 4\n5 6 7 8\n9 8 7 6\n"
    for text in (grid, grid.upper()):
        with pytest.raises(SurfaceFileError, match=r"ESRI ASCII grid.*save its numbers as a text"):
            read_text(tmp_path, text)
