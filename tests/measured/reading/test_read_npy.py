"""NPY files, and cases common to all formats: missing, empty and foreign files."""

from __future__ import annotations

import io
import random
import struct
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import AsperityError, ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface, read_surface

MAP = np.array([[1.0, 2.0, np.nan, 4.0, 5.0], [-6.0, 7.0, 8.0, 9.0, 0.25]])


def save_array(tmp_path: Path, array: object, name: str = "test.npy") -> Path:
    path = tmp_path / name
    with path.open("wb") as stream:
        np.save(stream, np.asanyarray(array), allow_pickle=True)
    return path


@pytest.mark.parametrize("kind", ["<f8", ">f8", "<f4", "<f2", "<i2", ">i4", "u1", "<u8"])
def test_real_array_types(tmp_path: Path, kind: str) -> None:
    array = np.arange(20).reshape(4, 5).astype(kind)
    raw = read_surface(save_array(tmp_path, array))
    np.testing.assert_array_equal(raw.heights, np.arange(20.0).reshape(4, 5))
    assert raw.heights.dtype == np.float64
    assert raw.pitch is None
    assert not raw.has_units
    assert raw.notes == ("no unit in the file: taken as metres",)
    assert raw.source == "test.npy"


def test_missing_points_memory_order_and_profile(tmp_path: Path) -> None:
    np.testing.assert_array_equal(read_surface(save_array(tmp_path, MAP)).heights, MAP)
    fortran = read_surface(save_array(tmp_path, np.asfortranarray(MAP))).heights
    np.testing.assert_array_equal(fortran, MAP)
    assert fortran.flags.c_contiguous
    profile = read_surface(save_array(tmp_path, MAP[1]))
    assert profile.is_profile
    np.testing.assert_array_equal(profile.heights, MAP[1])


def test_format_is_recognised_by_content(tmp_path: Path) -> None:
    raw = read_surface(save_array(tmp_path, MAP, "named-wrongly.x3p"))
    np.testing.assert_array_equal(raw.heights, MAP)


@pytest.mark.parametrize(
    ("array", "match"),
    [
        (MAP.astype(complex), "complex128; integers or floats"),
        (MAP > 0, "bool; integers or floats"),
        (np.array([{}, 1], dtype=object), "Python objects"),
        (np.zeros(4, dtype=[("x", "<f8")]), "integers or floats"),
        (np.array(["a", "b"]), "integers or floats"),
        (np.array(["2001-01-01"], dtype="M8[D]"), "integers or floats"),
        (np.zeros((2, 3, 4)), r"shape \(2, 3, 4\)"),
        (np.float64(3), r"shape \(\)"),
        (np.zeros((0, 4)), "test.npy: "),
        (np.array([1.0, np.inf, 2, 3]), "infinite height at index"),
    ],
)
def test_other_arrays_are_refused(tmp_path: Path, array: object, match: str) -> None:
    with pytest.raises(SurfaceFileError, match=match):
        read_surface(save_array(tmp_path, array))


def test_truncated_file_is_refused(tmp_path: Path) -> None:
    path = save_array(tmp_path, MAP)
    whole = path.read_bytes()
    for length in (6, 8, 40, 128, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(SurfaceFileError, match=r"test\.npy: (truncated|damaged) NPY"):
            read_surface(path)


def test_false_shape_in_a_header_allocates_no_memory(tmp_path: Path) -> None:
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000, 1000000000), }"
    header = header.ljust(117) + "\n"
    path = tmp_path / "lie.npy"
    path.write_bytes(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode())
    with pytest.raises(SurfaceFileError, match="NPY"):
        read_surface(path)


def test_mutated_files_raise_only_asperity_errors(tmp_path: Path) -> None:
    rng = random.Random(93)
    stream = io.BytesIO()
    np.save(stream, MAP)
    whole = stream.getvalue()
    path = tmp_path / "mutated.npy"
    read_count = 0
    for trial in range(300):
        data = bytearray(whole)
        for _ in range(rng.randint(1, 3)):
            # Half of the trials damage the header.
            at = rng.randrange(6, 80 if trial % 2 else len(data))
            data[at] = rng.choice(b"(){}[]'\",:<>|0123456789fFiucO \\#\n\x00\xff")
        path.write_bytes(data)
        try:
            raw = read_surface(path)
        except AsperityError:
            continue
        read_count += 1
        assert isinstance(raw, RawSurface)
        assert not np.isinf(raw.heights).any()
    assert 10 < read_count < 290


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b"", "is empty"),
        (
            b"\xff\xd8\xff\xe0" + bytes(40),
            "a JPEG image: not a surface format .*16 bit if possible",
        ),
        (b"GIF89a" + bytes(40), "a GIF image"),
        (b"BM" + bytes(40), "a BMP image"),
        (b"\x1f\x8b" + bytes(40), "a gzip archive.*unpack it first"),
        (b"%PDF-1.7\n1 0 obj", "a PDF document"),
        (bytes(range(256)), "a binary file"),
        (b"\x01\x02\x03\x04", "a binary file"),
    ],
)
def test_foreign_files_are_refused_by_name(tmp_path: Path, content: bytes, match: str) -> None:
    path = tmp_path / "strange.dat"
    path.write_bytes(content)
    with pytest.raises(SurfaceFileError, match=match):
        read_surface(path)


def test_unit_scales_the_heights(tmp_path: Path) -> None:
    raw = read_surface(save_array(tmp_path, MAP), unit="um")
    np.testing.assert_allclose(raw.heights, MAP * 1e-6, rtol=1e-15)
    assert raw.has_units
    assert raw.notes == ("no unit in the file: 1e-06 m as given",)


@pytest.mark.parametrize(
    ("argument", "value", "match"),
    [
        ("channel", "Height", "must not be given.*an NPY file.*no channels"),
        ("channel", 0, "must not be given.*no channels"),
        ("unit", "furlong", "must be a unit of length: m, cm, mm, um"),
        ("unit", "", "must be a unit of length"),
        ("unit", "MM", "must be a unit of length"),
    ],
)
def test_inapplicable_and_invalid_arguments_are_refused(
    tmp_path: Path, argument: str, value: object, match: str
) -> None:
    with pytest.raises(ParameterError, match=match) as caught:
        read_surface(save_array(tmp_path, MAP), **{argument: value})
    assert caught.value.argument == argument


def test_missing_file_directory_and_invalid_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SurfaceFileError, match="no such file"):
        read_surface(tmp_path / "absent.x3p")
    with pytest.raises(SurfaceFileError, match="is a directory"):
        read_surface(tmp_path)
    with pytest.raises(SurfaceFileError, match="not a file name"):
        read_surface("nul\0.x3p")


def test_oversized_file_is_refused_before_reading(tmp_path: Path) -> None:
    path = tmp_path / "large.txt"
    with path.open("wb") as stream:
        stream.truncate(2_100_000_000)  # sparse: takes no disk space
    with pytest.raises(SurfaceFileError, match=r"2\.1 GB; at most 2 GB are read: cut out a part"):
        read_surface(path)
