"""Headers of maps: unit of the heights, pitch, channels, codes of missing points."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.text_files import (
    MAP,
    assert_refused,
    assert_unit_is_open,
    point_lines,
    read_text,
)

from asperity.core.errors import ParameterError
from asperity.measured.preparation import prepare


def test_a_map_without_pitch_and_unit_asks_once_for_both(tmp_path: Path) -> None:
    raw = read_text(tmp_path, f"Pixel size: 2 um\nZ unit: nm\n{MAP}{MAP}")
    with pytest.raises(
        ParameterError, match=r"pitch and unit must be given.*pitch=1e-06 unit='um'"
    ):
        prepare(raw)


@pytest.mark.parametrize(
    "header",
    [
        *("LSB = 0.5 nm", "Z step 0.1 nm", "Z-scale = 1e-9 m", "height conversion factor=6.3e-8"),
        *("z factor (-> m)=many", "Z unit: nm\nZ factor: 0.001", "1 count = 2 nm of height"),
        *("Z unit: nm\nheight unit: um", "Z Calibration (nm/digit),0.1", "Z resolution: 0.1 nm"),
        *("Z unit: nm\nScale: 2", "heights are multiplied by 1000", "data unit=rad"),
        *("Z unit: nm\nZ magnification: 20", "Z unit: nm\nZ axis: inverted"),
    ],
)
def test_entries_that_no_layout_declares_leave_the_unit_open(tmp_path: Path, header: str) -> None:
    raw = read_text(tmp_path, f"{header}\n{MAP}")
    assert_unit_is_open(raw)
    assert raw.pitch is None


@pytest.mark.parametrize(
    "header",
    [
        *("Lateral sampling (um)", "Tip radius: 2 um", "Cutoff: 0.8mm", "Wavelength: 633 nm"),
        *("Sample: 5 mm steel plate", r"File: C:\nm\um.txt", "Height of fixture: 4 mm", "Unit,um"),
        *("Scan size: 10 um", "Stylus,Radius: 2.5 um", "Z range: 80 um", "Sa = 12 nm", "in um"),
        *("Roughness (nm)", "Unit X = um", "Stage z position: 3 mm", "Dx=2um"),
    ],
)
def test_units_of_other_lengths_are_not_those_of_the_heights(tmp_path: Path, header: str) -> None:
    assert_unit_is_open(read_text(tmp_path, f"{header}\n{MAP}"))


@pytest.mark.parametrize("header", [*("z [um]", "# heights in um", "Value units: um", "Höhe (µm)")])
def test_headings_and_declared_entries_state_the_unit(tmp_path: Path, header: str) -> None:
    raw = read_text(tmp_path, f"Cutoff: 0.8 mm\n{header}\n{MAP}")
    np.testing.assert_allclose(raw.heights[0], np.array([1e-6, -2e-6, 3e-6, 4e-6]), rtol=1e-14)
    assert raw.notes[0].startswith("heights in units of 1e-06 m: header ")


@pytest.mark.parametrize("header", ["Pixel size: 2 um", "Dx=2um\nDy=3um", "Width: 8 um"])
def test_pitch_that_no_layout_declares_is_asked(tmp_path: Path, header: str) -> None:
    assert read_text(tmp_path, f"{header}\nz [nm]\n{MAP}").pitch is None


def test_pixel_size_does_not_turn_points_into_a_matrix(tmp_path: Path) -> None:
    text = "Pixel size: 1 um\nx [um] y [um] z [nm]\n" + "\n".join(point_lines())
    assert read_text(tmp_path, text).heights.shape == (4, 5)


@pytest.mark.parametrize("order", ["yxz", "zyx", "xzy", "zx", "xyzw", "wxyz"])
def test_named_columns_in_another_order_are_refused(tmp_path: Path, order: str) -> None:
    head = ",".join(f"{name} [um]" for name in order)
    rows = "".join(f"{','.join(str(k + i) for i in range(len(order)))}\n" for k in range(5))
    assert_refused(tmp_path, f"{head}\n{rows}", "are not x and z, or x, y and z: leave out")
    assert_refused(tmp_path, f"x y z [nm]\n{MAP}", "are not x and z, or x, y and z: leave out")


@pytest.mark.parametrize(
    "header",
    ["Channel: Deflection", "Channel: Z-Axis (Deflection)", "# AmplitudeError", "Deflection [nm]"],
)
def test_other_channels_are_no_heights(tmp_path: Path, header: str) -> None:
    assert_refused(
        tmp_path, f"{header}\nValue units: nm\n{MAP}", "names another quantity, which is no height"
    )
    assert_refused(
        tmp_path, "x [um],Deflection [nm]\n0,1\n1,5\n2,3\n3,1\n", "are not x and z, or x, y and z"
    )


@pytest.mark.parametrize("code", ["-9999", "-32768", "1.70141e38", "1.70141E+38", "-99999.0"])
def test_codes_of_missing_points_are_missing(tmp_path: Path, code: str) -> None:
    raw = read_text(tmp_path, f"z [nm]\n1 2 {code} 4\n5 3 7 8\n")
    assert np.argwhere(np.isnan(raw.heights)).tolist() == [[0, 2]]
    assert any("which marks a missing point" in note for note in raw.notes)


def test_codes_among_the_heights_are_asked_about(tmp_path: Path) -> None:
    text = "z [nm]\n-9000 2 -9999 4\n5 3 7 8000\n"
    assert_refused(tmp_path, text, r"of -9999, which may be a height or mark a missing point: decl")
    for declared, missing in (("-9999", 1), ("nan", 0)):
        raw = read_text(tmp_path, f"nodata: {declared}\n{text}")
        assert int(np.isnan(raw.heights).sum()) == missing


def test_positions_around_a_matrix_are_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    heights = rng.normal(size=(7, 5)).round(3)
    rows = [[f"{0.5 * i:g}", *map(str, row)] for i, row in enumerate(heights)]
    framed = [["0", *(f"{0.2 * j:g}" for j in range(5))], *rows]
    for lines in (framed, rows, [["y\\x", *framed[0][1:]], *rows], np.array(rows).T.tolist()):
        text = "z [nm]\n" + "\n".join(",".join(line) for line in lines)
        assert_refused(tmp_path, text, "looks like positions or numbers of the others")
    plane = np.add.outer(np.arange(6.0), 2.0 * np.arange(8.0))  # heights in equal steps
    text = "z [nm]\n" + "\n".join(" ".join(map(str, row)) for row in plane)
    np.testing.assert_allclose(read_text(tmp_path, text).heights, 1e-9 * plane, rtol=1e-12)


def test_value_unit_is_found_anywhere_in_the_header(tmp_path: Path) -> None:
    raw = read_text(
        tmp_path, "# Value units: nm\n# Width: 8 um\n# Height: 3 um\n# made today\n" + MAP
    )
    assert raw.heights[0, 1] == -2e-9
    assert raw.pitch == pytest.approx((2e-6, 1e-6), rel=1e-15)


@pytest.mark.parametrize("names", [("Width", "Height"), ("Breite", "Höhe")])
def test_gwyddion_map_of_three_columns_is_not_a_point_list(
    tmp_path: Path, names: tuple[str, str]
) -> None:
    head = f"# Channel: Z\n# {names[0]}: 12 µm\n# {names[1]}: 8 µm\n# Value units: m\n"
    raw = read_text(tmp_path, head + "1 1.5 3\n-2 -3 -6\n0 0 0\n9 9 9\n")
    assert raw.heights.shape == (4, 3)
    assert raw.pitch == pytest.approx((4e-6, 2e-6), rel=1e-15)


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("columns", [3, 5])
def test_map_exported_by_gwyddion(tmp_path: Path, decimal: str, columns: int) -> None:
    """Format of asciiexport.c: sizes as "# %s %.*f %s", values as "%.*g", separated by tabs."""
    heights = np.random.default_rng(5).normal(0.0, 3e-9, (6, columns))
    rows = "\n".join("\t".join(f"{z:.5g}" for z in row) for row in heights)
    head = "# Channel: Z (Retrace)\n# Width: 10.00 µm\n# Height: 4.00 µm\n"
    raw = read_text(tmp_path, f"{head}# Value units: m\n{rows}\n".replace(".", decimal))
    np.testing.assert_allclose(raw.heights, heights, rtol=1e-4)
    assert raw.pitch == pytest.approx((10e-6 / columns, 4e-6 / 6), rel=1e-14)
    assert raw.has_units
    raw = read_text(tmp_path, f"{head}{rows}\n")
    assert raw.notes[0].startswith("pitch ")
    assert_unit_is_open(raw)
    assert_refused(tmp_path, f"{head}# Value units: V\n{rows}\n", "names the unit 'V'")


def test_points_exported_by_gwyddion(tmp_path: Path) -> None:
    """Format of xyzexport.c: units of x, y and of z are on separate header lines."""
    head = "# XYZ data: Z\n# Lateral units: µm\n# Value units: nm\n"
    rows = "\n".join(f"{x / 2:.9g}\t{y:.9g}\t{x * y:.9g}" for y in range(4) for x in range(5))
    raw = read_text(tmp_path, head + rows)
    assert raw.pitch == pytest.approx((0.5e-6, 1e-6), rel=1e-14)
    assert raw.heights[3, 4] == pytest.approx(12e-9, rel=1e-14)
    assert_refused(tmp_path, head.replace("nm", "V") + rows, "names the unit 'V'")
    assert_refused(tmp_path, head.replace("µm", "deg") + rows, "names the unit 'deg'")


@pytest.mark.parametrize(
    "header", ["[(" * 16_000, " " * 50_000, "no data" + " " * 50_000, "um (" * 12_000, "=" * 50_000]
)
def test_long_header_is_read_in_linear_time(tmp_path: Path, header: str) -> None:
    """Quadratic searches took 17 s and more; the limit leaves room for a busy machine."""
    before = time.process_time()
    raw = read_text(tmp_path, f"x{header}x\n{MAP}")
    assert time.process_time() - before < 5.0
    assert raw.heights.shape == (3, 4)
