"""Read surface data files (SDF: ISO 25178-71, formerly BCR), as text and binary.

The layout follows the tables that NIST (Internet based Surface Metrology Algorithm Testing
System, "SDF format") and NPL ("Softgauges, data file format") publish; the value of a missing
point of each data type and the wider counters of version 2.0 follow ISO 25178-71 as the readers
Gwyddion (sdfile.c) and sdfio have it.
"""

from __future__ import annotations

import math
import re
import struct
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.errors import SurfaceFileError
from asperity.measured.reading.numbers import parse_number
from asperity.measured.reading.raw import MAX_POINTS, RawSurface
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile, naming
from asperity.memory import reserve

_TEXT = re.compile(
    rb"\s*a[A-Za-z0-9.\-]{2,15}[ \t]*\r*\n(?:[ \t]*(?:;[^\n]*)?\r*\n)*[ \t]*ManufacID\b"
)
_BINARY = re.compile(rb"b[A-Z]{2,5}-[0-9]\.[0-9]")
_VERSION = 8
# Version, maker (10), two dates (12 each), two counters, four scales, three bytes.
_HEADER_1 = struct.Struct("<8s10s12s12sHHddddBBB")
_HEADER_2 = struct.Struct("<8s10s12s12sIIddddBBB")
_OLYMPUS = 8  # bytes that Olympus adds to the header of its bISO-1.0 files (Gwyddion, sdfile.c)


# By the code of a type: how a height is stored, and the value that stands for a missing one.
_TYPES = {
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
    r"""Tell whether a file begins as an SDF, text or binary.

    Args:
        head: the first bytes, at least 512 of them where the file has so many.

    Example:
        >>> is_sdf(b"aISO-1.0\r\nManufacID = x"), is_sdf(b"bBCR-1.0 maker"), is_sdf(b"a b")
        (True, True, False)
    """
    return _TEXT.match(head) is not None or _BINARY.match(head) is not None


@naming
def read_sdf(file: SurfaceFile, _options: ReadingOptions) -> RawSurface:
    """Read a surface data file.

    A height is Zscale times the stored number. A point is missing where a text has "BAD" and
    where the number is the one that its data type reserves. Profiles keep the file's order.

    Raises:
        SurfaceFileError: not an SDF that can be read, with the reason.

    Reference:
        ISO 25178-71.
    """
    content = file.content
    header, stored = _binary(content) if _BINARY.match(content) else _text(content)
    notes = []
    missing = stored == header.missing
    if missing.any():
        count, marker = int(missing.sum()), header.missing
        notes.append(f"{count} points hold {marker:.6g}, which marks a missing point")
    x, y, z = header.scale
    with np.errstate(over="ignore", invalid="ignore"):  # infinities are refused by the caller
        heights = np.where(missing, np.nan, stored * z)
    if header.profiles == 1:
        return RawSurface(heights, (x,), file.name, tuple(notes))
    heights = heights.reshape(header.profiles, header.points)
    return RawSurface(heights, (x, y), file.name, tuple(notes))


def _checked(
    points: int,
    profiles: int,
    scale: tuple[float, float, float],
    code: int,
    options: dict[str, int],
) -> _Header:
    if points < 1 or profiles < 1:
        raise SurfaceFileError(f"NumPoints is {points}, NumProfiles {profiles}: both must be > 0")
    if points * profiles > MAX_POINTS:
        raise SurfaceFileError(f"{points} x {profiles} points; at most {MAX_POINTS} are read")
    reserve(points, profiles)
    if code not in _TYPES:
        raise SurfaceFileError(f"DataType is {code}; 0 to 7 are defined")
    for key, value in options.items():
        if value != 0:
            raise SurfaceFileError(f"{key} is {value}; only files without (0) are read")
    needed = {"Xscale": scale[0], "Zscale": scale[2]}
    if profiles > 1:  # one profile has no distance to the next
        needed["Yscale"] = scale[1]
    for key, length in needed.items():
        if not (math.isfinite(length) and length > 0):
            raise SurfaceFileError(f"{key} is {length:g}; it must be positive [m]")
    return _Header(points, profiles, scale, *_TYPES[code])


def _binary(content: bytes) -> tuple[_Header, NDArray[np.float64]]:
    layout = _HEADER_2 if content[5:_VERSION] == b"2.0" else _HEADER_1
    if len(content) < layout.size:
        raise SurfaceFileError(
            f"truncated: {len(content)} bytes, the header alone has {layout.size}"
        )
    fields = layout.unpack_from(content)
    points, profiles, x, y, z = fields[4:9]
    compression, code, check = fields[10:]
    options = {"Compression": compression, "CheckType": check}
    header = _checked(points, profiles, (x, y, z), code, options)
    dtype = np.dtype(header.dtype)
    expected, rest = points * profiles * dtype.itemsize, len(content) - layout.size
    if rest < expected:
        raise SurfaceFileError(f"truncated: {rest} bytes of heights, {expected} are expected")
    start = layout.size
    if rest == expected + _OLYMPUS and content.startswith(b"bISO-1.0"):
        start += _OLYMPUS
    stored = np.frombuffer(content, dtype, points * profiles, start)
    with np.errstate(invalid="ignore"):  # a signalling NaN is a missing point too
        return header, stored.astype(np.float64)


def _text(content: bytes) -> tuple[_Header, NDArray[np.float64]]:
    head, star, rest = content.partition(b"*")
    if not star:
        raise SurfaceFileError("no '*' ends the header")
    fields = _fields(head.decode("latin-1"))
    options = {key: _whole(fields, key, 0) for key in ("Compression", "CheckType")}
    sets = _whole(fields, "NumDataSet", 1)
    if sets != 1:
        raise SurfaceFileError(f"holds {sets} data sets; one is expected")
    scale = (_number(fields, "Xscale"), _number(fields, "Yscale"), _number(fields, "Zscale"))
    points, profiles = _whole(fields, "NumPoints"), _whole(fields, "NumProfiles")
    header = _checked(points, profiles, scale, _whole(fields, "DataType", 7), options)
    return header, _numbers(rest.partition(b"*")[0], points * profiles)


def _fields(head: str) -> dict[str, str]:
    """Return the "Name = value" lines below the first one, by lower-case name."""
    fields: dict[str, str] = {}
    for line in head.splitlines()[1:]:
        key, equals, value = line.partition("=")
        if line.lstrip().startswith(";") or not equals:
            continue
        if fields.setdefault(key.strip().lower(), value.strip()) != value.strip():
            raise SurfaceFileError(f"the header gives {key.strip()[:40]} twice")
    return fields


def _value(fields: dict[str, str], key: str) -> str:
    value = fields.get(key.lower(), "")
    if not value:
        raise SurfaceFileError(f"the header has no {key}")
    return value


def _number(fields: dict[str, str], key: str) -> float:
    return parse_number(_value(fields, key), key)


def _whole(fields: dict[str, str], key: str, default: int | None = None) -> int:
    if default is not None and not fields.get(key.lower()):
        return default
    text = _value(fields, key)
    if not re.fullmatch(r"[0-9]{1,12}", text, re.ASCII):
        raise SurfaceFileError(f"{key} is {text[:40]!r}; a whole number is expected")
    return int(text)


def _numbers(area: bytes, count: int) -> NDArray[np.float64]:
    """Return the heights of the data area; NumPy's own parser takes little memory."""
    # A digit each and white space between; and NumPy makes a number of white space alone.
    if len(area) < 2 * count - 1 or not area.strip():
        raise SurfaceFileError(f"truncated: {len(area)} bytes cannot hold {count} heights")
    plain = re.sub(rb"(?i)\bBAD\b", b"nan", area)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(plain.decode("latin-1"), dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as error:
            raise _not_a_number(plain) from error
    if len(values) != count:
        raise SurfaceFileError(
            f"{len(values)} heights; NumPoints times NumProfiles asks for {count}"
        )
    return values


def _not_a_number(area: bytes) -> SurfaceFileError:
    for index, match in enumerate(re.finditer(rb"\S+", area), 1):
        word = match.group().decode("latin-1")
        if word.lower() in ("nan", "-nan"):
            continue
        try:
            parse_number(word, f"height {index}")
        except SurfaceFileError as error:
            return error
    return SurfaceFileError("the heights are not numbers")
