"""Text matrices and profiles: separators, units, columns, and mutated files."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.text_files import (
    HEIGHTS,
    assert_asked,
    assert_refused,
    assert_unit_is_open,
    matrix_text,
    read_text,
)

from asperity.core.errors import AsperityError, ParameterError, SurfaceFileError
from asperity.measured.reader import measure_spacing
from asperity.measured.reading import RawSurface, read_surface
from asperity.measured.reading import readers as registry

DATA = Path(__file__).parents[3].parent / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="real surfaces (../shared/data) missing")


@needs_data
def test_real_profile_of_a_stylus() -> None:
    raw = read_surface(DATA / "dektak-1.csv")
    text = (DATA / "dektak-1.csv").read_bytes().decode("latin-1").splitlines()
    start = next(k for k, line in enumerate(text) if line.startswith("Lateral um"))
    rows = [line.split(",") for line in text[start + 1 :] if line.strip()]
    heights = np.array([float(row[1]) for row in rows]) * 1e-6
    assert raw.heights.shape == (9600,)
    np.testing.assert_allclose(raw.heights, heights, rtol=1e-14)
    assert raw.pitch == pytest.approx((1499.8e-6 / 9599,), rel=1e-12)
    assert raw.pitch == pytest.approx((0.15625e-6,), rel=1e-4)  # 64 samples in 10 um
    assert raw.notes == ()
    assert raw.has_units


def test_unit_for_a_file_without_units(tmp_path: Path) -> None:
    path = tmp_path / "test.txt"
    path.write_text(matrix_text(","))
    raw = read_surface(path, unit="nm")
    np.testing.assert_allclose(raw.heights, HEIGHTS * 1e-9, rtol=1e-15)
    assert raw.has_units
    assert raw.notes == ("no unit in the file: 1e-09 m as given",)
    path.write_text("0 5\n20 6\n40 8\n60 5\n")
    with pytest.raises(ParameterError, match="does not state the unit of its positions and height"):
        read_surface(path)
    raw = read_surface(path, unit="um")
    assert raw.pitch == pytest.approx((20e-6,), rel=1e-12)
    np.testing.assert_allclose(raw.heights, np.array([5, 6, 8, 5]) * 1e-6, rtol=1e-15)
    path.write_text("x [um],z [nm]\n0,1\n1,2\n2,3\n3,1\n")
    with pytest.raises(ParameterError, match=r"unit must not be given: test\.txt names its unit"):
        read_surface(path, unit="um")
    path.write_text(matrix_text(","))  # numbers that are multiples of a step
    np.testing.assert_allclose(
        read_surface(path, unit="0.5 nm").heights, HEIGHTS * 0.5e-9, rtol=1e-15
    )
    with pytest.raises(ParameterError, match="must be a unit of length"):
        read_surface(path, unit="0.5 V")


def test_oversized_text_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_MAX_TEXT_BYTES", 20)
    with pytest.raises(SurfaceFileError, match=r"of text; at most 2e-08 GB are read: cut out"):
        read_text(tmp_path, matrix_text(","))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n"])
@pytest.mark.parametrize("separator", ["\t", ";", ",", " ", "   ", ", ", " ; "])
def test_separators_and_line_ends(tmp_path: Path, separator: str, end: str) -> None:
    raw = read_text(tmp_path, matrix_text(separator, end=end))
    np.testing.assert_array_equal(raw.heights, HEIGHTS)
    assert raw.pitch is None
    assert raw.notes == ()
    assert_unit_is_open(raw)


@pytest.mark.parametrize(
    "text",
    [
        "z [um]\n5,00\n5,98\n6,10\n7,05\n",
        "1,25,2,50,3,75\n1,50,2,05,3,00\n",
        "1,25, 2,50\n1,50, 2,75\n1,02, 2,75\n1,50, 2,75\n",
    ],
)
def test_commas_that_may_be_decimal_signs_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(SurfaceFileError, match="commas are decimal signs, or numbers begin with 0"):
        read_text(tmp_path, text)


def test_whole_numbers_between_commas_are_read(tmp_path: Path) -> None:
    raw = read_text(tmp_path, "0,10,200\n7,0,5\n-3,4,0\n")
    np.testing.assert_array_equal(raw.heights, [[0, 10, 200], [7, 0, 5], [-3, 4, 0]])


@pytest.mark.parametrize("separator", ["\t", ";", " ", "; "])
def test_decimal_comma(tmp_path: Path, separator: str) -> None:
    raw = read_text(tmp_path, matrix_text(separator, decimal=","))
    np.testing.assert_array_equal(raw.heights, HEIGHTS)
    assert any("comma" in note for note in raw.notes)
    assert_refused(tmp_path, "1.234,5;2\n2;3\n3;4\n4;5\n5;6\n", "line 1 .* is not a row of numbers")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_encodings_and_micro_signs(tmp_path: Path, encoding: str) -> None:
    raw = read_text(tmp_path, f"# Höhe [µm]\n{matrix_text(' ')}".encode(encoding))
    np.testing.assert_allclose(raw.heights, HEIGHTS * 1e-6, rtol=1e-14)
    assert raw.notes == ("heights in units of 1e-06 m: header 'Höhe [µm]'",)


def test_comments_blank_lines_and_missing_points(tmp_path: Path) -> None:
    raw = read_text(
        tmp_path, "# by hand\n\n1,,3,4\n% aside\n5,nan,7,8 # end\n\n9,10,---,NaN\n,2,3,4\n"
    )
    n = np.nan
    expected = [[1, n, 3, 4], [5, n, 7, 8], [9, 10, n, n], [n, 2, 3, 4]]
    np.testing.assert_array_equal(raw.heights, expected)


def test_trailing_separators_are_ignored(tmp_path: Path) -> None:
    raw = read_text(tmp_path, matrix_text(",").replace("\n", ",,\n") + ",,,,,\n")
    np.testing.assert_array_equal(raw.heights, HEIGHTS)


def test_column_of_heights_is_a_profile(tmp_path: Path) -> None:
    raw = read_text(tmp_path, "z [nm]\n1\n2\n4\n8\n")
    np.testing.assert_allclose(raw.heights, np.array([1, 2, 4, 8]) * 1e-9, rtol=1e-14)
    assert raw.pitch is None


@pytest.mark.parametrize(
    ("header", "x", "z"),
    [
        ("x [um],z [nm]", 1e-6, 1e-9),
        ("Lateral um,Raw Micrometer,", 1e-6, 1e-6),
        ("Position (mm), Height (µm)", 1e-3, 1e-6),
        ("x/μm z/nm", 1e-6, 1e-9),
        ("# x in microns, z in Angstrom", 1e-6, 1e-10),
        ("x [mm],z [A]", 1e-3, 1e-10),
        ("m,m", 1.0, 1.0),
        ("µm,nm", 1e-6, 1e-9),
        ("A (mm),B (um)", 1e-3, 1e-6),
    ],
)
def test_units_of_a_profile(tmp_path: Path, header: str, x: float, z: float) -> None:
    raw = read_text(tmp_path, f"{header}\n0.0,1\n0.5,2\n1.0,4\n1.5,7\n")
    assert raw.pitch == pytest.approx((0.5 * x,), rel=1e-14)
    np.testing.assert_allclose(raw.heights, np.array([1, 2, 4, 7]) * z, rtol=1e-14)
    assert raw.has_units
    assert raw.notes == ()


@pytest.mark.parametrize(
    ("header", "match"),
    [
        ("x [inch],z [inch]", "names the unit 'inch'"),
        ("x [um],z [V]", "names the unit 'V'"),
        ("x [um] or [nm],z [nm]", r"'x \[um\] or \[nm\]' names several units"),
    ],
)
def test_unusable_units_are_refused(tmp_path: Path, header: str, match: str) -> None:
    assert_refused(tmp_path, f"{header}\n0.0,1\n0.5,2\n1.0,4\n1.5,7\n", match)


@pytest.mark.parametrize(
    ("header", "what"),
    [
        ("", "positions and heights"),
        ("x,z", "positions and heights"),
        ("x [um],height", "heights"),
        ("x,height [um]", "positions"),
        ("x z [nm]", "positions"),
    ],
)
def test_each_column_needs_a_unit(tmp_path: Path, header: str, what: str) -> None:
    """A unit stated once is not applied to the other column."""
    text = f"{header}\n0.0,1e-6\n1e-6,2e-6\n2e-6,3e-6\n3e-6,2e-6\n"
    assert_asked(tmp_path, text, f"does not state the unit of its {what}; give it")
    raw = read_surface(tmp_path / "test.txt", unit="mm")  # for each column that has none
    assert raw.pitch == pytest.approx((1e-12 if "x [um]" in header else 1e-9,), rel=1e-12)
    height = 1e-6 * (1e-9 if "nm" in header else 1e-6 if "height [um]" in header else 1e-3)
    assert raw.heights[0] == pytest.approx(height, rel=1e-12)


def test_two_columns_are_a_profile_or_a_matrix(tmp_path: Path) -> None:
    assert read_text(tmp_path, "x [um] z [um]\n1 5\n2 6\n3 7\n4 8\n").is_profile
    assert read_text(tmp_path, "1 5\n0 6\n3 7\n2 8\n").heights.shape == (4, 2)
    reverse = read_text(tmp_path, "x [m] z [m]\n4 5\n3 6\n2 7\n1 8\n")
    assert reverse.heights.tolist() == [8, 7, 6, 5]
    assert any("reversed" in note for note in reverse.notes)
    twice = "".join(f"{k // 2} {k}\n" for k in range(20))
    assert read_text(tmp_path, twice).heights.shape == (20, 2)
    assert_refused(tmp_path, f"x [um] z [um]\n{twice}", "line 3: the positions .* must increase")
    many = [f"{k} 1" for k in range(9)] + ["7 1"] + [f"{k} 1" for k in range(10, 30)]
    assert_refused(tmp_path, "\n".join(many), "line 10: the positions .* must increase")


def test_rounded_positions_are_a_uniform_grid(tmp_path: Path) -> None:
    true = 0.15625 * np.arange(200)
    text = "x [mm],z [um]\n" + "".join(f"{x:.1f},{k}\n" for k, x in enumerate(true))
    raw = read_text(tmp_path, text)
    assert raw.pitch == pytest.approx((1e-3 * round(true[-1], 1) / 199,), rel=1e-12)
    text = "x [mm],z [um]\n" + "".join(f"{x + 123:.6g},{k}\n" for k, x in enumerate(true))
    assert read_text(tmp_path, text).pitch == pytest.approx((0.15625e-3,), rel=1e-3)


def test_nonuniform_sampling_is_refused(tmp_path: Path) -> None:
    true = 0.15625 * np.arange(200)
    true[150:] += 0.3  # a gap of three digits
    text = "x [mm],z [um]\n" + "".join(f"{x:.1f},{k}\n" for k, x in enumerate(true))
    assert_refused(
        tmp_path, text, "not uniform: the step to line 152 differs by .* from the median"
    )
    text = "x [m] z [m]\n0.000 1\n0.100 1\n0.203 1\n0.300 1\n"
    assert_refused(tmp_path, text, "step to line [45] differs by 3 mm from the median of 100 mm")
    # A lost sample is not rounding, even if positions are printed as coarsely as the step.
    indices = [k for k in range(8) if k != 4]
    text = "x [m] z [m]\n" + "\n".join(f"{k} 1" for k in indices)
    assert_refused(tmp_path, text, "the step to line 6 differs by 1 m from the median of 1 m")
    text = "x [um] z [m]\n" + "\n".join(f"{-2 * k} 1" for k in indices)
    assert_refused(tmp_path, text, "the step to line 6 differs by 2 µm from the median of 2 µm")


def test_spacing_accepts_rounded_grids_and_refuses_gaps() -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        n = int(rng.integers(9, 400))
        step = float(rng.uniform(0.16, 3.0))
        true = float(rng.uniform(-50, 50)) + step * np.arange(n)
        assert measure_spacing(np.round(true, 1), 0.1).is_uniform
        true[n // 2 :] += 0.12 + 0.02 * step
        assert not measure_spacing(np.round(true, 4), 1e-4).is_uniform


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("1 2 3 4\n1 2 3 4\n1 2 3\n1 2 3 4\n", "line 3 has 3 values where line 1 has 4"),
        ("1 2\n1 2 3 4\n1 2 3 4\n", "line 1 has 2 values where line 2 has 4"),
        ("1 2 3 4\n1 2 x 4\n1 2 3 4\n1 2 3 4\n", "line 2 .'1 2 x 4'. is not a row of numbers"),
        ("1 2 3 4\n1 2 3 4\n1 2 3 4\n1 2 x 4\n1 2 3 4\n", "line 4 .* is not a row of numbers"),
        ("1 2 x 4\n1 2 3 4\n1 2 3 4\n", "line 1 .* is not a row of numbers"),
        ("1 2 3 4\n1 2 3 4\n1 2 x 4\n", "line 3 .* is not a row of numbers"),
        ("0.1,bad\n0.2,1\n0.3,1\n0.4,1\n0.5,1\n", "line 1 .* is not a row of numbers"),
        ("1 2 3 4\n1 2 inf 4\n1 2 3 4\n", "line 2 has an infinite number"),
        ("1 2 3 4\n1 2 1e999 4\n1 2 3 4\n", "line 2 has an infinite number"),
        ("1 2\n3 4\n5 6\n", "3 rows of 2 numbers"),
        ("1\n2\n3\n", "at least 4 points"),
        ("x [m] y [m] z [m]\n1 2 3\n1 2 3\n1 2 3\n1 2 3\n", "three columns"),
        ("nothing here\n", "no row of numbers"),
        ("\n\n \n", "no row of numbers"),
        ("a,b\nc,d\n", "no row of numbers"),
        (",0,1,2\n0,5,3,7\n1,5,6,9\n2,5,2,1\n", "looks like positions or numbers of the others"),
        ("1_0 2 3 4\n1_0 2 3 4\n", "no row of numbers"),
    ],
)
def test_invalid_texts_are_refused(tmp_path: Path, text: str, match: str) -> None:
    assert_refused(tmp_path, text, match)


def test_header_and_footer_are_skipped(tmp_path: Path) -> None:
    raw = read_text(
        tmp_path, f"Report 7\nOperator: A. B.\n12 March 2020\n\n{matrix_text(' ')}\nEnd of data\n"
    )
    np.testing.assert_array_equal(raw.heights, HEIGHTS)
    assert "1 lines of text after the numbers ignored" in raw.notes


def test_header_of_gwyddion(tmp_path: Path) -> None:
    header = "# Channel: Height\n# Width: 8.0 µm\n# Height: 9.0 µm\n# Value units: nm\n"
    raw = read_text(tmp_path, header + matrix_text("\t"))
    np.testing.assert_allclose(raw.heights, HEIGHTS * 1e-9, rtol=1e-14)
    assert raw.pitch == pytest.approx((2e-6, 3e-6), rel=1e-14)


def test_several_maps_in_one_file_are_refused(tmp_path: Path) -> None:
    header = "# Channel: Height\n# Width: 8.0 µm\n# Height: 9.0 µm\n# Value units: nm\n"
    assert_refused(tmp_path, 2 * (header + matrix_text("\t")), "several maps in one file")
    one = header + matrix_text("\t").replace(
        "\n", "\n# Width: by hand\n"
    )  # a comment is not a header
    np.testing.assert_allclose(read_text(tmp_path, one).heights, HEIGHTS * 1e-9, rtol=1e-14)


def test_declared_value_of_missing_points(tmp_path: Path) -> None:
    raw = read_text(tmp_path, "columns 4\nNODATA_value -9999\n1 2 3 -9999\n5 6 7 8\n-9999 2 3 4\n")
    n = np.nan
    np.testing.assert_array_equal(raw.heights, [[1, 2, 3, n], [5, 6, 7, 8], [n, 2, 3, 4]])
    assert any("of -9999, which marks a missing point" in note for note in raw.notes)


def test_mutated_files_raise_only_asperity_errors(tmp_path: Path) -> None:
    rng = random.Random(16610)
    seeds = [
        "Scan\nx [um],z [nm]\n0.0,1.5\n0.2,2.5\n0.3,4.0\n0.5,7.0\n0.6,1\n",
        matrix_text("\t"),
        matrix_text(";", ","),
        "# z in um\n" + matrix_text(" "),
    ]
    tokens = [
        ",",
        ";",
        "\t",
        " ",
        "-",
        "e",
        "E9",
        "1",
        "nan",
        "inf",
        "x",
        "\n",
        "\r",
        "#",
        ".",
        "µ",
    ]
    outcomes = {"read": 0, "refused": 0}
    for _ in range(300):
        text = list(rng.choice(seeds))
        for _ in range(rng.randint(1, 3)):
            at = rng.randrange(len(text))
            text[at : at + rng.randint(0, 2)] = rng.choice(tokens)
        try:
            raw = read_text(
                tmp_path, "".join(text).encode(rng.choice(["utf-8", "latin-1", "utf-16"]))
            )
        except AsperityError:
            outcomes["refused"] += 1
            continue
        outcomes["read"] += 1
        assert isinstance(raw, RawSurface)
        assert not np.isinf(raw.heights).any()
        assert raw.pitch is None or min(raw.pitch) > 0
    assert min(outcomes.values()) > 30, outcomes
