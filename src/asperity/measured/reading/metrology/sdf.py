"""Read surface data files (SDF: ISO 25178-71, formerly BCR), as text and binary.

The layout follows the tables published by NIST (Internet based Surface Metrology Algorithm Testing
System, "SDF format") and NPL ("Softgauges, data file format"); the value of a missing point for
each data type and the wider counters of version 2.0 follow ISO 25178-71 as implemented in Gwyddion
(sdfile.c) and sdfio.
"""

from __future__ import annotations

import math
import re
import struct
import warnings
from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError
from asperity.measured.lengths import parse_number
from asperity.measured.reading.reader import (
    RawSurface,
    ReadingOptions,
    SurfaceFile,
    check_point_count,
    mask_missing,
)

_TEXT_SIGNATURE = re.compile(
    rb"\s*a[A-Za-z0-9.\-]{2,15}[ \t]*\r*\n(?:[ \t]*(?:;[^\n]*)?\r*\n)*[ \t]*ManufacID\b"
)
_BINARY_SIGNATURE = re.compile(rb"b[A-Z]{2,5}-[0-9]\.[0-9]")
# Version, maker (10), two dates (12 each), two counters, four scales, three bytes.
_HEADER_1 = struct.Struct("<8s10s12s12sHHddddBBB")
_HEADER_2 = struct.Struct("<8s10s12s12sIIddddBBB")
_OLYMPUS_PADDING = 8  # bytes that Olympus adds to the header of bISO-1.0 files (sdfile.c)

# By type code: NumPy type of a height, and the value of a missing point.
_DATA_TYPES = {
    0: ("u1", math.nan),
    1: ("<u2", 2.0**16 - 1),
    2: ("<u4", 2.0**32 - 1),
    3: ("<f4", float(np.finfo(np.float32).min)),
    4: ("i1", -(2.0**7)),
    5: ("<i2", -(2.0**15)),
    6: ("<i4", -(2.0**31)),
    7: ("<f8", float(np.finfo(np.float64).min)),
}


@dataclass(frozen=True)
class _Header:
    points: int
    profiles: int
    scale: tuple[float, float, float]
    dtype: str
    missing: float


def is_sdf(head: bytes) -> bool:
    r"""Whether a file starts with the header of an SDF, text or binary.

    Args:
        head: the first bytes, at least 512 unless the file is shorter.

    Example:
        >>> is_sdf(b"aISO-1.0\r\nManufacID = x"), is_sdf(b"bBCR-1.0 maker"), is_sdf(b"a b")
        (True, True, False)
    """
    return _TEXT_SIGNATURE.match(head) is not None or _BINARY_SIGNATURE.match(head) is not None


def read_sdf(file: SurfaceFile, _options: ReadingOptions) -> RawSurface:
    """Read a surface data file.

    A height is Zscale times the stored number. A point is missing if the text has "BAD" or the
    number is the one that its data type reserves. Profiles have the order of the file.

    Raises:
        SurfaceFileError: not an SDF that can be read, with the reason.

    Reference:
        ISO 25178-71.
    """
    content = file.content
    parse = _parse_binary if _BINARY_SIGNATURE.match(content) else _parse_text
    header, stored = parse(content)
    stored, notes = mask_missing(stored, header.missing)
    x, y, z = header.scale
    with np.errstate(over="ignore", invalid="ignore"):  # infinities are refused by the caller
        heights = stored * z
    if header.profiles == 1:
        return RawSurface(heights, (x,), file.name, notes)
    heights = heights.reshape(header.profiles, header.points)
    return RawSurface(heights, (x, y), file.name, notes)


def _make_header(
    points: int,
    profiles: int,
    scale: tuple[float, float, float],
    type_code: int,
    options: dict[str, int],
) -> _Header:
    if points < 1 or profiles < 1:
        raise SurfaceFileError(f"NumPoints is {points}, NumProfiles {profiles}: both must be > 0")
    check_point_count(points, profiles)
    if type_code not in _DATA_TYPES:
        raise SurfaceFileError(f"DataType is {type_code}; 0 to 7 are defined")
    for key, value in options.items():
        if value != 0:
            raise SurfaceFileError(f"{key} is {value}; only files without (0) are read")
    needed = {"Xscale": scale[0], "Zscale": scale[2]}
    if profiles > 1:  # one profile has no distance to the next
        needed["Yscale"] = scale[1]
    for key, length in needed.items():
        if not (math.isfinite(length) and length > 0):
            raise SurfaceFileError(f"{key} is {length:g}; it must be positive [m]")
    return _Header(points, profiles, scale, *_DATA_TYPES[type_code])


def _parse_binary(content: bytes) -> tuple[_Header, FloatArray]:
    layout = _HEADER_2 if content[5:8] == b"2.0" else _HEADER_1
    if len(content) < layout.size:
        raise SurfaceFileError(f"truncated: {len(content)} bytes; the header has {layout.size}")
    fields = layout.unpack_from(content)
    points, profiles, x, y, z = fields[4:9]
    compression, code, check = fields[10:]
    options = {"Compression": compression, "CheckType": check}
    header = _make_header(points, profiles, (x, y, z), code, options)
    dtype = np.dtype(header.dtype)
    expected, rest = points * profiles * dtype.itemsize, len(content) - layout.size
    if rest < expected:
        raise SurfaceFileError(f"truncated: {rest} bytes of heights, {expected} are expected")
    start = layout.size
    if rest == expected + _OLYMPUS_PADDING and content.startswith(b"bISO-1.0"):
        start += _OLYMPUS_PADDING
    stored = np.frombuffer(content, dtype, points * profiles, start)
    with np.errstate(invalid="ignore"):  # a signalling NaN is a missing point too
        return header, stored.astype(np.float64)


def _parse_text(content: bytes) -> tuple[_Header, FloatArray]:
    head, star, rest = content.partition(b"*")
    if not star:
        raise SurfaceFileError("no '*' ends the header")
    fields = _parse_fields(head.decode("latin-1"))
    options = {key: _field_integer(fields, key, 0) for key in ("Compression", "CheckType")}
    sets = _field_integer(fields, "NumDataSet", 1)
    if sets != 1:
        raise SurfaceFileError(f"holds {sets} data sets; one is expected")
    x, y, z = (parse_number(_field_text(fields, f"{axis}scale"), f"{axis}scale") for axis in "XYZ")
    points, profiles = _field_integer(fields, "NumPoints"), _field_integer(fields, "NumProfiles")
    code = _field_integer(fields, "DataType", 7)
    header = _make_header(points, profiles, (x, y, z), code, options)
    return header, _parse_heights(rest.partition(b"*")[0], points * profiles)


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


def _field_text(fields: dict[str, str], key: str) -> str:
    value = fields.get(key.lower(), "")
    if not value:
        raise SurfaceFileError(f"the header has no {key}")
    return value


def _field_integer(fields: dict[str, str], key: str, default: int | None = None) -> int:
    if default is not None and not fields.get(key.lower()):
        return default
    text = _field_text(fields, key)
    if not re.fullmatch(r"[0-9]{1,12}", text, re.ASCII):
        raise SurfaceFileError(f"{key} is {text[:40]!r}; a whole number is expected")
    return int(text)


def _parse_heights(area: bytes, count: int) -> FloatArray:
    """Return the heights of the data area, by NumPy's parser, which needs little memory."""
    # At least a digit and a blank for each; NumPy reads white space alone as a number.
    if len(area) < 2 * count - 1 or not area.strip():
        raise SurfaceFileError(f"truncated: {len(area)} bytes cannot hold {count} heights")
    plain = re.sub(rb"(?i)\bBAD\b", b"nan", area)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(plain.decode("latin-1"), dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as error:
            raise _bad_height_error(plain) from error
    if len(values) != count:
        raise SurfaceFileError(f"{len(values)} heights; NumPoints times NumProfiles is {count}")
    return values


def _bad_height_error(area: bytes) -> SurfaceFileError:
    for index, match in enumerate(re.finditer(rb"\S+", area), 1):
        word = match.group().decode("latin-1")
        if word.lower() in ("nan", "-nan"):
            continue
        try:
            parse_number(word, f"height {index}")
        except SurfaceFileError as error:
            return error
    return SurfaceFileError("the heights are not numbers")
