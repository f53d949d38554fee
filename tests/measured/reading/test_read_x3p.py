"""X3P files: real files, every data type, and invalid files."""

from __future__ import annotations

import random
import re
import struct
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import AsperityError, SurfaceFileError
from asperity.measured.reading import RawSurface, read_surface

sys.path.insert(0, str(Path(__file__).parents[1] / "writers"))
from x3p_writer import X3pSpec, write_x3p

DATA = Path(__file__).parents[3].parent / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="real surfaces (../shared/data) missing")

HEIGHTS = np.array([[1.5, -2.0, 3.25, 7.0, 0.5], [0.0, 4.0, -5.5, 6.0, 8.0], [9, 1, 2, 3, 4.0]])
SPEC = X3pSpec(HEIGHTS * 1e-6)


def read_spec(tmp_path: Path, spec: X3pSpec) -> RawSurface:
    return read_surface(write_x3p(tmp_path / "test.x3p", spec))


def assert_refused(tmp_path: Path, spec: X3pSpec, match: str) -> None:
    with pytest.raises(SurfaceFileError, match=match) as caught:
        read_spec(tmp_path, spec)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("test.x3p: ")


@needs_data
@pytest.mark.parametrize(
    ("name", "folder", "size", "increment", "missing"),
    [
        ("sample-land.x3p", "sample-land/", (918, 256), 2.58e-6, 25292),
        ("testing.x3p", "", (30, 20), 0.0274999996026357, 0),
    ],
)
def test_real_files(
    name: str, folder: str, size: tuple[int, int], increment: float, missing: int
) -> None:
    raw = read_surface(DATA / name)
    with zipfile.ZipFile(DATA / name) as archive:
        xml = archive.read(f"{folder}main.xml").decode()
        content = archive.read(f"{folder}bindata/data.bin")
    nx, ny = (int(re.search(f"<Size{k}>(\\d+)<", xml)[1]) for k in "XY")
    assert (nx, ny) == size
    assert raw.heights.shape == (ny, nx)
    assert raw.heights.dtype == np.float64
    assert raw.pitch == (increment, increment)
    assert int(np.isnan(raw.heights).sum()) == missing
    # X runs fastest: column j of row i is value i * nx + j.
    for i, j in ((0, 0), (0, 1), (3, 7), (ny - 1, nx - 1), (ny // 2, nx // 3)):
        (value,) = struct.unpack_from("<d", content, 8 * (i * nx + j))
        assert raw.heights[i, j] == value or (np.isnan(value) and np.isnan(raw.heights[i, j]))
    assert np.nansum(raw.heights) == pytest.approx(np.nansum(np.frombuffer(content, "<f8")))


@needs_data
def test_notes_of_real_files() -> None:
    assert any("mask.png" in note for note in read_surface(DATA / "sample-land.x3p").notes)
    assert not any("MD5" in note for note in read_surface(DATA / "sample-land.x3p").notes)
    assert not any("MD5" in note for note in read_surface(DATA / "testing.x3p").notes)


@pytest.mark.parametrize("code", "ILFD")
def test_data_types(tmp_path: Path, code: str) -> None:
    stored = np.array([[1, -2, 300, 4], [5, 6, -32768, 8], [9, 10, 11, 32767.0]])
    raw = read_spec(tmp_path, X3pSpec(stored, code=code))
    np.testing.assert_array_equal(raw.heights, stored)
    assert raw.pitch == (2e-6, 3e-6)
    assert raw.notes == ()
    assert raw.has_units


@pytest.mark.parametrize("z_type", "IA")
@pytest.mark.parametrize("code", "IL")
def test_integer_heights_are_offset_plus_increment_times_stored(
    tmp_path: Path, code: str, z_type: str
) -> None:
    """Increment is the multiplier of integers on any axis (schema of ISO 25178-72)."""
    stored = np.arange(-6.0, 6.0).reshape(3, 4)
    spec = X3pSpec(stored, code=code, z_type=z_type, z_increment="1e-9", z_offset="2e-6")
    raw = read_spec(tmp_path, spec)
    np.testing.assert_allclose(raw.heights, 2e-6 + 1e-9 * stored, rtol=1e-14)
    assert raw.notes == ()


@pytest.mark.parametrize("code", "IL")
def test_integer_heights_of_an_absolute_axis_without_increment(tmp_path: Path, code: str) -> None:
    stored = np.arange(-6.0, 6.0).reshape(3, 4)
    spec = X3pSpec(stored, code=code, z_increment="", z_offset="2")
    np.testing.assert_array_equal(read_spec(tmp_path, spec).heights, 2 + stored)


@pytest.mark.parametrize("code", "FD")
def test_absolute_floats_ignore_the_increment(tmp_path: Path, code: str) -> None:
    stored = np.rint(HEIGHTS)
    spec = X3pSpec(stored, code=code, z_type="A", z_increment="0.5", z_offset="100")
    raw = read_spec(tmp_path, spec)
    np.testing.assert_array_equal(raw.heights, stored + 100)
    assert any("CZ Increment 0.5 ignored" in note for note in raw.notes)
    raw = read_spec(tmp_path, replace(spec, z_type="I"))
    np.testing.assert_array_equal(raw.heights, 0.5 * stored + 100)


def test_stored_nans_are_missing_points(tmp_path: Path) -> None:
    stored = HEIGHTS.copy()
    stored[1, 2] = np.nan
    raw = read_spec(tmp_path, X3pSpec(stored))
    np.testing.assert_array_equal(raw.heights, stored)


@pytest.mark.parametrize("code", "ID")
def test_validity_bits_run_from_the_least_significant(tmp_path: Path, code: str) -> None:
    valid = np.ones((3, 5), dtype=bool)
    valid[0, 1] = valid[2, 3] = False
    stored = np.arange(15.0).reshape(3, 5)
    if code == "D":
        stored[1, 1] = np.nan  # a set bit does not revive a missing height
    raw = read_spec(tmp_path, X3pSpec(stored, code=code, valid=valid))
    np.testing.assert_array_equal(raw.heights, np.where(valid, stored, np.nan))


def test_validity_bits_of_a_known_byte(tmp_path: Path) -> None:
    spec = X3pSpec(np.arange(10.0).reshape(2, 5), code="I", valid=np.ones((2, 5), bool))
    path = write_x3p(tmp_path / "a.x3p", replace(spec, valid_md5=""))
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members["bindata/valid.bin"] = bytes([0x95, 0xFD])  # bits 0 2 4 7 | 8: points 1 3 5 6 9 miss
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    missing = np.flatnonzero(np.isnan(read_surface(path).heights))
    assert missing.tolist() == [1, 3, 5, 6, 9]


def test_subfolder_and_unrelated_members(tmp_path: Path) -> None:
    extra = {
        "__MACOSX/scan/._main.xml": b"junk",
        "__MACOSX/main.xml": b"junk",
        "bindata/.DS_Store": b"\0\0",
        "bindata/mask.png": b"\x89PNG",
    }
    raw = read_spec(tmp_path, replace(SPEC, folder="scan/", extra=extra))
    np.testing.assert_array_equal(raw.heights, SPEC.stored)
    assert raw.notes == ("bindata/mask.png is an annotation: not applied",)


def test_other_root_name_of_x3ptools(tmp_path: Path) -> None:
    np.testing.assert_array_equal(
        read_spec(tmp_path, replace(SPEC, root="ISO5436")).heights, SPEC.stored
    )


@pytest.mark.parametrize("md5_file", ["{md5} *main.xml", "{md5}", "{md5}\n"])
def test_md5_of_main(tmp_path: Path, md5_file: str) -> None:
    spec = replace(SPEC, md5_file=md5_file)
    assert read_spec(tmp_path, spec).notes == ()
    wrong = read_spec(tmp_path, replace(spec, main_md5="0" * 32))
    assert wrong.notes == ("main.xml does not match its MD5",)
    np.testing.assert_array_equal(wrong.heights, SPEC.stored)


def test_md5_of_main_missing(tmp_path: Path) -> None:
    assert "not verified" in read_spec(tmp_path, replace(SPEC, md5_file=None)).notes[0]
    assert "not verified" in read_spec(tmp_path, replace(SPEC, md5_file="N/A")).notes[0]


def test_md5_of_data(tmp_path: Path) -> None:
    assert_refused(tmp_path, replace(SPEC, point_md5="0" * 32), "data.bin does not match its MD5")
    assert_refused(
        tmp_path,
        replace(SPEC, valid=np.ones((3, 5), bool), valid_md5="0" * 32),
        "valid.bin does not match its MD5",
    )
    assert "no MD5" in read_spec(tmp_path, replace(SPEC, point_md5="")).notes[0]


def test_points_inside_of_main_xml_are_refused(tmp_path: Path) -> None:
    assert_refused(
        tmp_path, replace(SPEC, inline=True), "main.xml has no Record3/DataLink/PointDataLink"
    )


def test_profile(tmp_path: Path) -> None:
    spec = X3pSpec(HEIGHTS[:1] * 1e-6, feature="PRF")
    raw = read_spec(tmp_path, spec)
    np.testing.assert_array_equal(raw.heights, HEIGHTS[0] * 1e-6)
    assert raw.pitch == (2e-6,)
    assert_refused(tmp_path, replace(SPEC, feature="PRF"), "SizeY 1, got 3")


def test_absolute_lateral_axes(tmp_path: Path) -> None:
    y, x = np.mgrid[:3, :5].astype(float)
    spec = replace(
        SPEC,
        x_type="A",
        y_type="A",
        x_positions=0.1 + 4e-6 * x,
        y_positions=5e-6 * y,
        x_increment="1",
        y_increment="1",
    )
    raw = read_spec(tmp_path, spec)
    np.testing.assert_array_equal(raw.heights, SPEC.stored)
    assert raw.pitch == pytest.approx((4e-6, 5e-6), rel=1e-9)
    crooked = 4e-6 * x
    crooked[:, 2] += 1e-6
    assert_refused(tmp_path, replace(spec, x_positions=crooked), "CX is absolute.*no uniform grid")
    sheared = 4e-6 * x + 1e-6 * y
    assert_refused(tmp_path, replace(spec, x_positions=sheared), "CX is absolute.*no uniform grid")
    assert_refused(tmp_path, replace(spec, x_positions=-x), "do not increase")
    counts = replace(spec, x_positions=4.0 * x, y_positions=5.0 * y, position_code="L")
    counts = replace(counts, x_increment="1e-6", y_increment="1e-6")
    assert read_spec(tmp_path, counts).pitch == pytest.approx((4e-6, 5e-6), rel=1e-9)
    shifted = replace(counts, x_positions=np.array([0.0, 4.0, 10.0, 12.0, 16.0]) + 0.0 * x)
    assert_refused(tmp_path, shifted, "CX is absolute.*no uniform grid")


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"feature": "PCL"}, "point cloud"),
        ({"feature": "XYZ"}, "FeatureType is 'XYZ'"),
        ({"size": ("5", "3", "2")}, "SizeZ is 2"),
        ({"size": ("0", "3", "1")}, "SizeX is '0'"),
        ({"size": ("-5", "3", "1")}, "SizeX is '-5'"),
        ({"size": ("9" * 5000, "3", "1")}, "SizeX is '9999"),
        ({"size": ("1" + "0" * 9, "1" + "0" * 9, "1")}, "points; at most"),
        ({"size": ("6", "3", "1")}, "is truncated: 120 bytes.* require 144"),
        ({"size": ("4", "3", "1")}, "is too long: 120 bytes.* require 96"),
        ({"cut": 1}, "is truncated: 119 bytes"),
        ({"x_increment": "0"}, "CX Increment is 0; it must be positive"),
        ({"x_increment": "-2e-6"}, "CX Increment is -2e-6"),
        ({"y_increment": "nan"}, "CY Increment is 'nan'"),
        ({"y_increment": "1e999"}, "CY Increment is '1e999'"),
        ({"y_increment": "2,5e-6"}, "CY Increment is '2,5e-6'"),
        ({"y_increment": ""}, "CY is incremental but has no Increment"),
        ({"z_offset": "x"}, "CZ Offset is 'x'"),
        ({"code": "I", "z_type": "I", "z_increment": "0"}, "CZ Increment is 0"),
        ({"code": "I", "z_increment": "-1e-9"}, "CZ Increment is -1e-9; it must be positive"),
        ({"x_type": "Q"}, "CX has AxisType 'Q'"),
        ({"root": "gpx"}, "root <gpx>"),
        ({"with_main": False}, "without a main.xml"),
        ({"extra": {"other/main.xml": b""}}, "2 main.xml"),
        ({"prolog": "<!DOCTYPE a [<!ENTITY b 'c'>]>"}, "DOCTYPE"),
        ({"prolog": "<oops>"}, "not valid XML"),
    ],
)
def test_invalid_files_are_refused(tmp_path: Path, changes: dict[str, object], match: str) -> None:
    assert_refused(tmp_path, replace(SPEC, **changes), match)


def test_doctype_is_refused_in_utf_16(tmp_path: Path) -> None:
    prolog = '<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE a [<!ENTITY b "c">]>'
    assert_refused(tmp_path, replace(SPEC, prolog=prolog, encoding="utf-16"), "DOCTYPE")


def test_main_in_another_encoding(tmp_path: Path) -> None:
    raw = read_spec(tmp_path, replace(SPEC, encoding="latin-1", revision="µ", date="März"))
    np.testing.assert_array_equal(raw.heights, SPEC.stored)
    assert any("Latin-1" in note for note in raw.notes)


def test_infinite_height_is_refused(tmp_path: Path) -> None:
    stored = HEIGHTS.copy()
    stored[2, 1] = np.inf
    with pytest.raises(SurfaceFileError, match=r"infinite height at index \(2, 1\)"):
        read_spec(tmp_path, X3pSpec(stored))


def test_rotation_is_noted(tmp_path: Path) -> None:
    raw = read_spec(tmp_path, replace(SPEC, rotation="<Rotation><r11>1</r11></Rotation>"))
    assert any("rotation" in note for note in raw.notes)


def test_damaged_archives_are_refused(tmp_path: Path) -> None:
    whole = write_x3p(tmp_path / "whole.x3p", SPEC).read_bytes()
    for length in (4, 30, len(whole) // 2, len(whole) - 1):
        path = tmp_path / "cut.x3p"
        path.write_bytes(whole[:length])
        with pytest.raises(SurfaceFileError, match=r"cut\.x3p: damaged zip"):
            read_surface(path)


def test_crc_error_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "crc.x3p"
    write_x3p(path, replace(SPEC, point_md5=""))
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    data = path.read_bytes()
    at = data.index(members["bindata/data.bin"])
    path.write_bytes(data[: at + 3] + b"\x55" + data[at + 4 :])
    with pytest.raises(SurfaceFileError, match="CRC"):
        read_surface(path)


def test_other_zip_archives_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "arrays.npz"
    np.savez(path, a=HEIGHTS)
    with pytest.raises(SurfaceFileError, match="an NPZ archive that asperity did not prepare"):
        read_surface(path)
    with zipfile.ZipFile(path, "w"):
        pass
    with pytest.raises(SurfaceFileError, match=r"without a main\.xml"):
        read_surface(path)


def test_decompression_bomb_is_refused_before_unpacking(tmp_path: Path) -> None:
    path = tmp_path / "bomb.x3p"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("main.xml", b" " * (65 * 2**20))
    with pytest.raises(SurfaceFileError, match=r"main\.xml has 68157440 bytes; at most"):
        read_surface(path)


def test_false_compressed_size_allocates_no_memory(tmp_path: Path) -> None:
    path = write_x3p(tmp_path / "lie.x3p", SPEC)
    data = path.read_bytes()
    at = data.index(b"PK\x01\x02")  # the central directory: packed size at byte 20
    path.write_bytes(data[: at + 20] + struct.pack("<I", 4_000_000_000) + data[at + 24 :])
    with pytest.raises(SurfaceFileError, match=r"lie\.x3p: \S+ is truncated"):
        read_surface(path)


def test_member_without_a_name_is_ignored(tmp_path: Path) -> None:
    path = write_x3p(tmp_path / "nameless.x3p", SPEC)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("x", b"")
    data = path.read_bytes()
    at = data.rindex(b"PK\x01\x02")  # its entry: length of the name at byte 28
    data = data[: at + 28] + b"\0\0" + data[at + 30 : at + 46] + data[at + 47 :]
    end = data.rindex(b"PK\x05\x06")  # the directory is one byte shorter
    size = struct.unpack_from("<I", data, end + 12)[0] - 1
    path.write_bytes(data[: end + 12] + struct.pack("<I", size) + data[end + 16 :])
    with zipfile.ZipFile(path) as archive:
        assert "" in archive.namelist()
    np.testing.assert_array_equal(read_surface(path).heights, SPEC.stored)


def test_mutated_files_raise_only_asperity_errors(tmp_path: Path) -> None:
    rng = random.Random(5436)
    whole = write_x3p(tmp_path / "whole.x3p", replace(SPEC, valid=np.ones((3, 5), bool)))
    with zipfile.ZipFile(whole) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    path = tmp_path / "mutated.x3p"
    outcomes = {"read": 0, "refused": 0}
    for trial in range(300):
        if trial % 2:  # damage the archive
            path.write_bytes(_mutated(rng, whole.read_bytes()))
        else:  # damage a member inside a sound archive
            victim = rng.choice(list(members))
            with zipfile.ZipFile(path, "w") as archive:
                for name, content in members.items():
                    archive.writestr(name, _mutated(rng, content) if name == victim else content)
        try:
            raw = read_surface(path)
        except AsperityError:
            outcomes["refused"] += 1
            continue
        outcomes["read"] += 1
        assert isinstance(raw, RawSurface)
        assert not np.isinf(raw.heights).any()
    assert min(outcomes.values()) > 10, outcomes


def _mutated(rng: random.Random, content: bytes) -> bytes:
    data = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(data))
        kind = rng.randrange(4)
        if kind == 0:
            data[at] = rng.randrange(256)
        elif kind == 1:
            del data[at : at + rng.randint(1, 8)]
        elif kind == 2:
            data[at:at] = bytes(rng.randrange(256) for _ in range(rng.randint(1, 8)))
        else:
            data[at:at] = rng.choice([b"-", b"0", b"9", b"e", b"<", b">", b"I", b"A", b"&"])
        data = data or bytearray(b"x")
    return bytes(data)
