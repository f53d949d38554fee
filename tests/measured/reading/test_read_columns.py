"""Text files with non-length columns, and points on no grid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import SurfaceFileError
from asperity.measured.reading import RawSurface, read_surface


def read_text(folder: Path, text: str, encoding: str = "utf-8", **arguments: Any) -> RawSurface:
    path = folder / "a.txt"
    path.write_bytes(text.encode(encoding))
    return read_surface(path, **arguments)


@pytest.mark.parametrize(
    "header",
    [
        *("X;Y;valid\n[mm];[mm];[1/0]\n", "index;x [um];z [um]\n"),
        "valid;x [um];y [um];z [nm]\n",
        "x [um];y [um];z [nm];mask\n",
    ],
)
def test_columns_beside_positions_and_heights_are_refused(tmp_path: Path, header: str) -> None:
    count = header.splitlines()[0].count(";") + 1
    rows = "".join(";".join(str(k + c) for c in range(count)) + "\n" for k in range(6))
    with pytest.raises(SurfaceFileError, match=r"are not x and z|names the unit '1/0'"):
        read_text(tmp_path, header + rows)


def test_unnamed_third_column_is_a_height(tmp_path: Path) -> None:
    """Three columns ending in 0 or 1 are points x, y, z unless the header names a validity."""
    raw = read_text(tmp_path, "0 0 1\n1 0 0\n0 1 1\n1 1 1\n", unit="m")
    np.testing.assert_array_equal(raw.heights, [[1, 0], [1, 1]])


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
