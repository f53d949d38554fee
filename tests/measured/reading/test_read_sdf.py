"""Surface data files (SDF), text and binary."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface, read_surface

sys.path.insert(0, str(Path(__file__).parents[1] / "writers"))
from sdf_writer import SdfSpec, write_ascii, write_binary

STORED = np.array([[120.0, -30, 7, 0], [55, 66, -77, 88], [9, 10, 11, 12.0]])
SPEC = SdfSpec(STORED)
EXPECTED = STORED * 1e-9


def read_ascii(tmp_path: Path, spec: SdfSpec, name: str = "test.sdf") -> RawSurface:
    return read_surface(write_ascii(tmp_path / name, spec))


def read_binary(tmp_path: Path, spec: SdfSpec, extra: bytes = b"") -> RawSurface:
    return read_surface(write_binary(tmp_path / "test.sdf", spec, extra))


@pytest.mark.parametrize("kind", range(8))
@pytest.mark.parametrize("version", ["ISO-1.0", "ISO-2.0", "BCR-1.0"])
def test_every_data_type_and_version(tmp_path: Path, version: str, kind: int) -> None:
    stored = np.abs(STORED) if kind < 3 else STORED
    spec = SdfSpec(stored, version=version, kind=kind)
    for raw in (read_ascii(tmp_path, spec), read_binary(tmp_path, spec)):
        np.testing.assert_allclose(raw.heights, stored * 1e-9, rtol=1e-15)
        assert raw.pitch == (2.5e-6, 3e-6)
        assert raw.notes == ()
        assert raw.has_units
        assert not raw.relative


@pytest.mark.parametrize("version", ["ISO-1.0", "BCR-0.0", "NIST-1.0", "NPL-V1.0", "BC-1.0"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r\r\n"])
def test_versions_and_line_ends(tmp_path: Path, version: str, end: str) -> None:
    trailers = ("", f"{end}*{end}", f"{end}*{end}*{end}", f"{end}*{end}Note = 5 * 3{end}*{end}")
    for trailer in trailers:
        spec = replace(SPEC, version=version, end=end, trailer=trailer)
        raw = read_ascii(tmp_path, spec, "named-wrongly.x3p")
        np.testing.assert_allclose(raw.heights, EXPECTED, rtol=1e-15)


def test_comments_case_and_unknown_fields_are_accepted(tmp_path: Path) -> None:
    path = write_ascii(tmp_path / "test.sdf", replace(SPEC, fields={"NumDataSet": "1"}))
    text = path.read_bytes().replace(b"NumPoints ", b"; a comment = 7\r\nnumpoints ")
    path.write_bytes(text)
    np.testing.assert_allclose(read_surface(path).heights, EXPECTED, rtol=1e-15)


def test_single_profile_needs_no_y_scale(tmp_path: Path) -> None:
    spec = replace(SPEC, stored=STORED.reshape(1, -1), scale=("0.5e-6", "0", "1E-06"))
    for raw in (read_ascii(tmp_path, spec), read_binary(tmp_path, spec)):
        assert raw.is_profile
        assert raw.pitch == (0.5e-6,)
        np.testing.assert_allclose(raw.heights, STORED.ravel() * 1e-6, rtol=1e-15)


def test_missing_points_of_a_text_file(tmp_path: Path) -> None:
    stored = STORED.copy()
    stored[0, 1] = stored[2, 3] = np.nan
    np.testing.assert_allclose(
        read_ascii(tmp_path, replace(SPEC, stored=stored)).heights, stored * 1e-9, rtol=1e-15
    )


@pytest.mark.parametrize(
    ("kind", "marker"),
    [(1, 65535.0), (2, 4294967295.0), (4, -128.0), (5, -32768.0), (6, -2147483648.0)],
)
def test_integer_markers_of_missing_points(tmp_path: Path, kind: int, marker: float) -> None:
    stored = np.abs(STORED)
    stored[1, 2] = marker
    raw = read_binary(tmp_path, SdfSpec(stored, kind=kind))
    assert np.argwhere(np.isnan(raw.heights)).tolist() == [[1, 2]]
    assert any("1 point of" in note for note in raw.notes)


@pytest.mark.parametrize(("kind", "type_"), [(3, np.float32), (7, np.float64)])
def test_greatest_floats_and_nan_mark_missing_points(
    tmp_path: Path, kind: int, type_: type[np.floating]
) -> None:
    stored = STORED.copy()
    stored[1, 2] = np.finfo(type_).min
    stored[2, 1] = np.finfo(type_).max
    stored[0, 0] = np.nan
    raw = read_binary(tmp_path, SdfSpec(stored, kind=kind))
    assert np.argwhere(np.isnan(raw.heights)).tolist() == [[0, 0], [1, 2], [2, 1]]


def test_olympus_header_with_eight_extra_bytes(tmp_path: Path) -> None:
    raw = read_binary(tmp_path, SPEC, extra=b"\x05\0\0\0\x01\0\0\0")
    np.testing.assert_allclose(raw.heights, EXPECTED, rtol=1e-15)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"fields": {"NumPoints": "5"}}, "12 heights; NumPoints times NumProfiles is 15"),
        ({"fields": {"NumPoints": "3"}}, "12 heights; .* is 9"),
        ({"fields": {"NumPoints": "0"}}, "both must be > 0"),
        ({"fields": {"NumPoints": "-4"}}, "NumPoints is '-4'; a whole number"),
        ({"fields": {"NumPoints": "9" * 9, "NumProfiles": "9" * 9}}, "at most 134217728"),
        ({"fields": {"NumPoints": "9999999"}}, "truncated: .* cannot hold 29999997"),
        ({"fields": {"Xscale": "0"}}, r"Xscale is 0; it must be positive \[m\]"),
        ({"fields": {"Yscale": "-1e-6"}}, "Yscale is -1e-06"),
        ({"fields": {"Zscale": "1,0E-6"}}, "Zscale is '1,0E-6'; a finite number"),
        ({"fields": {"Zscale": "nan"}}, "Zscale is 'nan'"),
        ({"fields": {"Compression": "1"}}, "Compression is 1; only files without"),
        ({"fields": {"CheckType": "2"}}, "CheckType is 2"),
        ({"fields": {"DataType": "8"}}, "DataType is 8; 0 to 7"),
        ({"fields": {"NumDataSet": "2"}}, "holds 2 data sets"),
        ({"fields": {"NUMPOINTS": "5"}}, "gives NUMPOINTS twice"),
        ({"without": ("Zscale",)}, "the header has no Zscale"),
        ({"without": ("NumProfiles",)}, "the header has no NumProfiles"),
        ({"trailer": " 4x4\r\n*"}, "height 13 is '4x4'"),
        ({"trailer": " 1_3\r\n*"}, "height 13 is '1_3'"),
        ({"trailer": "e400\r\n*"}, "infinite height"),
    ],
)
def test_invalid_text_files_are_refused(
    tmp_path: Path, changes: dict[str, object], match: str
) -> None:
    with pytest.raises(SurfaceFileError, match=match) as caught:
        read_ascii(tmp_path, replace(SPEC, **changes))
    assert str(caught.value).startswith("test.sdf: ")


@pytest.mark.parametrize("area", ["", "   \r\n  ", "BAD", "-", "0x10"])
def test_empty_or_invalid_data_area_is_refused(tmp_path: Path, area: str) -> None:
    path = write_ascii(tmp_path / "test.sdf", replace(SPEC, stored=np.zeros((1, 1))))
    head = path.read_bytes().partition(b"*")[0]
    path.write_bytes(head + b"*\r\n" + area.encode() + b"\r\n*\r\n")
    if area == "BAD":
        assert np.isnan(read_surface(path).heights).all()
        return
    with pytest.raises(SurfaceFileError, match=r"truncated|height 1 is"):
        read_surface(path)


def test_invalid_binary_files_are_refused(tmp_path: Path) -> None:
    path = write_binary(tmp_path / "test.sdf", SPEC)
    whole = path.read_bytes()
    for length in (20, 80, 81, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(SurfaceFileError, match=r"test\.sdf: truncated"):
            read_surface(path)
    with pytest.raises(SurfaceFileError, match="Compression is 3"):
        read_binary(tmp_path, replace(SPEC, fields={"Compression": "3"}))


def test_arguments_of_other_formats_are_refused(tmp_path: Path) -> None:
    path = write_ascii(tmp_path / "test.sdf", SPEC)
    with pytest.raises(ParameterError, match=r"unit must not be given: test\.sdf \(an SDF file\)"):
        read_surface(path, unit="mm")
