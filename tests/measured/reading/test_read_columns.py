"""Text files with non-length columns, and points on no grid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError, SurfaceFileError
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


PRF = (
    "1 2\r\nNAME 0.0 PRF\r\nCX M {count} MM 1.0e+0 D\r\nCZ M {count} {unit} 1.0e-6 L\r\nEOR\r\n"
    "STYLUS_RADIUS 2.0e-3 MM\r\nSPACING CX {spacing}\r\nEOR\r\n1500\r\n-20\r\n300\r\nEOR\r\nEOF\r\n"
)


def test_prf_profiles_have_unit_and_spacing(tmp_path: Path) -> None:
    raw = read_text(tmp_path, PRF.format(count="3.0e+0", unit="MM", spacing="5.0e-4"))
    np.testing.assert_allclose(raw.heights, [1.5e-6, -20e-9, 300e-9], rtol=1e-12)
    assert raw.pitch == pytest.approx((0.5e-6,))
    assert (raw.has_units, raw.notes) == (True, ())


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"count": "4"}, r"truncated PRF profile \(3 of 4 heights\)"),
        ({"count": "x"}, "damaged PRF profile"),
        ({"unit": "FURLONG"}, "FURLONG|furlong"),
        ({"spacing": "0"}, "its points are 0 m apart"),
        ({"spacing": ""}, "an axis, SPACING or EOR lacks|damaged PRF"),
    ],
)
def test_damaged_prf_profiles_are_refused(
    tmp_path: Path, entries: dict[str, str], message: str
) -> None:
    text = PRF.format(**{"count": "3", "unit": "MM", "spacing": "5e-4"} | entries)
    with pytest.raises((SurfaceFileError, ParameterError), match=message):
        read_text(tmp_path, text)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (b"Gwyddion Simple Field 1.0\nXRes = 2\nYRes = 2\n\0\0", r"Gwyddion simple field \(GSF\)"),
        (b"DSAA\n2 2\n0 1\n0 1\n0 1\n1 2\n3 4\n", r"Surfer grid \(GRD, text\)"),
        (b"DSBB" + bytes(60), r"Surfer grid \(GRD\)"),
        (b"DSRB" + bytes(60), r"Surfer grid \(GRD\)"),
    ],
)
def test_formats_that_are_not_read_are_named(tmp_path: Path, head: bytes, words: str) -> None:
    (tmp_path / "land.bin").write_bytes(head)
    with pytest.raises(SurfaceFileError, match=f"looks like a {words}: .*save i?ts?"):
        read_surface(tmp_path / "land.bin")


def test_esri_grid_is_refused_with_advice(tmp_path: Path) -> None:
    """Its first row is the northern one: as a matrix it would be mirrored."""
    grid = "ncols 4\nnrows 3\nxllcorner 3.0\nyllcorner 4\ncellsize 30\n1 2 3 4\n5 6 7 8\n9 8 7 6\n"
    for text in (grid, grid.upper()):
        with pytest.raises(SurfaceFileError, match=r"ESRI ASCII grid.*save its numbers as a text"):
            read_text(tmp_path, text)
