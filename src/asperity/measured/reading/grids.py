"""Read grids of heights: NumPy arrays (NPY), and surface data files (SDF) as text and binary.

An array has no unit. The layout of SDF (ISO 25178-71, formerly BCR) follows the tables published by
NIST (Internet based Surface Metrology Algorithm Testing System, "SDF format") and NPL ("Softgauges,
data file format"); the value of a missing point for each data type and the wider counters of
version 2.0 follow ISO 25178-71 as implemented in Gwyddion (sdfile.c) and sdfio.
"""

from __future__ import annotations

import math
import re
import struct
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError
from asperity.measured import reader
from asperity.measured.lengths import parse_heights, parse_number
from asperity.measured.reading.isolation import describe_exception

NPY_MAGIC = b"\x93NUMPY"


def read_npy(file: reader.SurfaceFile, options: reader.ReadingOptions) -> reader.RawSurface:
    """Read a real array, 1-D (profile) or 2-D (map); heights are metres if no unit is given.

    Returns:
        The heights [m]; an NPY file has no pitch.

    Raises:
        SurfaceFileError: not a real array of one or two dimensions, or truncated.
    """
    array = _map_file(file.path)
    _check_array(array)
    unit, notes = options.resolve_unit(file.name)
    # A long double beyond float64 becomes inf, refused later; a signalling NaN is missing too.
    with np.errstate(over="ignore", invalid="ignore"):
        heights = np.array(array, dtype=np.float64, order="C") * (unit or 1.0)
    return reader.RawSurface(heights, None, file.name, notes, has_units=unit is not None)


def _map_file(path: Path) -> np.ndarray[Any, np.dtype[Any]]:
    """Map the file instead of loading it, so that a damaged header cannot exhaust the memory."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # headers of NumPy under Python 2 are accepted
            array: np.ndarray[Any, np.dtype[Any]] = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception as error:  # NumPy documents no list of errors for damaged headers
        raise SurfaceFileError(_describe_error(error, path)) from error
    return array


def _describe_error(error: Exception, path: Path) -> str:
    text = str(error)
    if "Object arrays" in text or "Python objects" in text or "pickle" in text:
        return "an array of Python objects; a real numeric array is expected"
    if "greater than file size" in text or "empty" in text or "EOF" in text:
        return f"truncated NPY file ({path.stat().st_size} bytes)"
    return f"damaged NPY file ({describe_exception(error)})"


def _check_array(array: np.ndarray[Any, np.dtype[Any]]) -> None:
    if array.dtype.kind not in "iuf":
        raise SurfaceFileError(f"array of type {array.dtype}; integers or floats are expected")
    if array.ndim not in (1, 2) or min(array.shape) < 1:
        raise SurfaceFileError(
            f"array of shape {array.shape}; (ny, nx) for a map or (n,) for a profile is expected"
        )
    reader.check_point_count(*array.shape[::-1])


_TEXT_SIGNATURE = re.compile(
    rb"\s*a[A-Za-z0-9.\-]{2,15}[ \t]*\r*\n(?:[ \t]*(?:;[^\n]*)?\r*\n)*[ \t]*ManufacID\b"
)
_BINARY_SIGNATURE = re.compile(rb"b[A-Z]{2,5}-[0-9]\.[0-9]")
# Version, maker (10), two dates (12 each), two counters, four scales, three bytes.
_HEADER_1 = struct.Struct("<8s10s12s12sHHddddBBB")
_HEADER_2 = struct.Struct("<8s10s12s12sIIddddBBB")
_OLYMPUS_PADDING = 8  # bytes that Olympus adds to the header of bISO-1.0 files (sdfile.c)

# By type code: NumPy type of a height, and the value of a missing point; its negative, which is no
# height of the type or the other end of the floats, marks one too.
_DATA_TYPES = (
    ("u1", math.nan),
    ("<u2", 65535.0),
    ("<u4", 4294967295.0),
    ("<f4", -3.4028234663852886e38),
    ("i1", -128.0),
    ("<i2", -32768.0),
    ("<i4", -2147483648.0),
    ("<f8", -1.7976931348623157e308),
)


class _Header(NamedTuple):
    """The entries of a header, in the order of a binary one; scales in metres."""

    points: int
    profiles: int
    x_scale: float
    y_scale: float
    z_scale: float
    z_resolution: float
    compression: int
    data_type: int
    check_type: int


def is_sdf(head: bytes) -> bool:
    r"""Whether a file starts with the header of an SDF, text or binary.

    Args:
        head: the first bytes, at least 512 unless the file is shorter.

    Example:
        >>> is_sdf(b"aISO-1.0\r\nManufacID = x"), is_sdf(b"bBCR-1.0 maker"), is_sdf(b"a b")
        (True, True, False)
    """
    return _TEXT_SIGNATURE.match(head) is not None or _BINARY_SIGNATURE.match(head) is not None


def read_sdf(file: reader.SurfaceFile, _options: reader.ReadingOptions) -> reader.RawSurface:
    """Read a surface data file.

    A height is Zscale times the stored number. A point is missing if the text has "BAD" or the
    number is one that its data type reserves. Profiles have the order of the file.

    Raises:
        SurfaceFileError: not an SDF that can be read, with the reason.

    Reference:
        ISO 25178-71.
    """
    content = file.content
    parse = _parse_binary if _BINARY_SIGNATURE.match(content) else _parse_text
    header, stored = parse(content)
    notes: tuple[str, ...] = ()
    code = _DATA_TYPES[header.data_type][1]
    for marker in (code, -code):
        stored, found = reader.mask_missing(stored, marker)
        notes += found
    with np.errstate(over="ignore", invalid="ignore"):  # infinities are refused by the caller
        heights = stored * header.z_scale
    if header.profiles == 1:
        return reader.RawSurface(heights, (header.x_scale,), file.name, notes)
    heights = heights.reshape(header.profiles, header.points)
    return reader.RawSurface(heights, (header.x_scale, header.y_scale), file.name, notes)


def _check_header(header: _Header) -> _Header:
    points = header.points
    profiles = header.profiles
    if points < 1 or profiles < 1:
        raise SurfaceFileError(f"NumPoints is {points}, NumProfiles {profiles}: both must be > 0")
    reader.check_point_count(points, profiles)
    if not 0 <= header.data_type < len(_DATA_TYPES):
        raise SurfaceFileError(f"DataType is {header.data_type}; 0 to 7 are defined")
    for key, value in (("Compression", header.compression), ("CheckType", header.check_type)):
        if value != 0:
            raise SurfaceFileError(f"{key} is {value}; only files without (0) are read")
    scales = {"Xscale": header.x_scale, "Zscale": header.z_scale}
    if profiles > 1:  # one profile has no distance to the next
        scales["Yscale"] = header.y_scale
    for key, length in scales.items():
        if not 0.0 < length < math.inf:
            raise SurfaceFileError(f"{key} is {length:g}; it must be positive [m]")
    return header


def _parse_binary(content: bytes) -> tuple[_Header, FloatArray]:
    layout = _HEADER_2 if content[5:8] == b"2.0" else _HEADER_1
    start = layout.size
    if len(content) < start:
        raise SurfaceFileError(f"truncated: {len(content)} bytes; the header has {start}")
    header = _check_header(_Header(*layout.unpack_from(content)[4:]))
    dtype = np.dtype(_DATA_TYPES[header.data_type][0])
    count = header.points * header.profiles
    expected = count * dtype.itemsize
    rest = len(content) - start
    if rest < expected:
        raise SurfaceFileError(f"truncated: {rest} bytes of heights, {expected} are expected")
    if rest == expected + _OLYMPUS_PADDING and content.startswith(b"bISO-1.0"):
        start += _OLYMPUS_PADDING
    with np.errstate(invalid="ignore"):  # a signalling NaN is a missing point too
        return header, np.frombuffer(content, dtype, count, start).astype(np.float64)


def _parse_text(content: bytes) -> tuple[_Header, FloatArray]:
    head, star, rest = content.partition(b"*")
    if not star:
        raise SurfaceFileError("no '*' ends the header")
    fields = _parse_fields(head.decode("latin-1"))
    sets = _parse_integer(fields, "NumDataSet", "1")
    if sets != 1:
        raise SurfaceFileError(f"holds {sets} data sets; one is expected")
    counts = [_parse_integer(fields, key) for key in ("NumPoints", "NumProfiles")]
    scales = [parse_number(_field(fields, f"{axis}scale"), f"{axis}scale") for axis in "XYZ"]
    defaults = {"Compression": "0", "DataType": "7", "CheckType": "0"}
    codes = [_parse_integer(fields, key, default) for key, default in defaults.items()]
    header = _check_header(_Header._make((*counts, *scales, 0.0, *codes)))
    return header, _parse_data(rest.partition(b"*")[0], header.points * header.profiles)


def _parse_fields(head: str) -> dict[str, str]:
    """Return the "Name = value" lines below the first one, by lower-case name."""
    fields: dict[str, str] = {}
    for line in head.splitlines()[1:]:
        key, equals, value = line.partition("=")
        if line.lstrip().startswith(";") or not equals:
            continue
        if fields.setdefault(key.strip().lower(), value.strip()) != value.strip():
            raise SurfaceFileError(f"the header gives {key.strip()[:40]} twice")
    return fields


def _field(fields: dict[str, str], key: str, default: str = "") -> str:
    value = fields.get(key.lower()) or default
    if not value:
        raise SurfaceFileError(f"the header has no {key}")
    return value


def _parse_integer(fields: dict[str, str], key: str, default: str = "") -> int:
    text = _field(fields, key, default)
    if not re.fullmatch(r"[0-9]{1,12}", text, re.ASCII):
        raise SurfaceFileError(f"{key} is {text[:40]!r}; a whole number is expected")
    return int(text)


def _parse_data(area: bytes, count: int) -> FloatArray:
    """Return the heights of the data area."""
    # At least a digit and a blank for each.
    if len(area) < 2 * count - 1 or not area.strip():
        raise SurfaceFileError(f"truncated: {len(area)} bytes cannot hold {count} heights")
    values = parse_heights(re.sub(r"(?i)\bBAD\b", "nan", area.decode("latin-1")))
    if len(values) != count:
        raise SurfaceFileError(f"{len(values)} heights; NumPoints times NumProfiles is {count}")
    return values
