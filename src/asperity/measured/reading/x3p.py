"""Read X3P files (ISO 5436-2, ISO 25178-72): a zip archive of XML and binary heights."""

from __future__ import annotations

import hashlib
import re
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError
from asperity.measured.lengths import parse_number
from asperity.measured.reader import (
    ARCHIVE_ERRORS,
    RawSurface,
    ReadingOptions,
    SurfaceFile,
    check_point_count,
    measure_spacing,
    states_periodic,
)

DTYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
_MAX_XML = 64 * 2**20


def read_x3p(file: SurfaceFile, _options: ReadingOptions) -> RawSurface:
    """Read an X3P surface or profile.

    Heights are offset + increment * stored for an incremental height axis and for integers (where
    the increment is 1 if it is not stated), and offset + stored for floats on an absolute axis. A
    point is missing where its height is NaN or its validity bit is 0.

    Returns:
        Heights [m], pitch [m] and notes on peculiarities of the file.

    Raises:
        SurfaceFileError: not an X3P that can be read, with the reason.
    """
    try:
        with zipfile.ZipFile(file.path) as archive:
            return _read_archive(_open_archive(archive, file.path.stat().st_size), file.name)
    except SurfaceFileError:
        raise
    except ARCHIVE_ERRORS as error:
        raise SurfaceFileError(f"damaged zip archive ({error})") from error


def _read_archive(archive: _Archive, name: str) -> RawSurface:
    main = archive.read("main.xml", limit=_MAX_XML)
    notes: list[str] = []
    header = parse_header(main, notes)
    notes.extend(_checksum_notes(archive, header, main))
    # x3ptools adds a mask that marks regions but changes no height.
    masks = [member for member in archive.members if member.rpartition("/")[2] == "mask.png"]
    notes.extend(f"{mask} is an annotation: not applied" for mask in masks)
    coordinates = _read_coordinates(archive, header, notes)
    heights = coordinates["CZ"].reshape(header.shape)
    px = _find_step(header, header.axes[0], coordinates, along=1)
    if header.is_profile:  # one row has no distance to the next
        return RawSurface(heights[0], (px,), name, tuple(notes))
    py = _find_step(header, header.axes[1], coordinates, along=0)
    repeats = states_periodic(_text(header.root, "Record2/Comment"))
    return RawSurface(heights, (px, py), name, tuple(notes), is_periodic=repeats)


# --- the archive --------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Archive:
    """The members in the folder of main.xml, by lower-case name relative to it."""

    zip_file: zipfile.ZipFile
    members: dict[str, zipfile.ZipInfo]
    size: int  # of the whole archive [bytes]

    def read(self, name: str, *, limit: int = 0, expected: int = 0) -> bytes:
        """Return a member's bytes; its size is checked before it is unpacked."""
        info = self.members.get(_normalise_name(name))
        if info is None:
            raise SurfaceFileError(f"the archive has no {name}")
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise SurfaceFileError(f"{name} is packed by a method other than store and deflate")
        if limit and info.file_size > limit:
            raise SurfaceFileError(f"{name} has {info.file_size} bytes; at most {limit} are read")
        if expected and info.file_size != expected:
            fault = "is truncated" if info.file_size < expected else "is too long"
            raise SurfaceFileError(
                f"{name} {fault}: {info.file_size} bytes, "
                f"the matrix dimension and data types require {expected}"
            )
        if info.compress_size > self.size:  # zipfile would allocate this size
            raise SurfaceFileError(f"{name} is truncated")
        content = self.zip_file.read(info)
        if len(content) != info.file_size:
            raise SurfaceFileError(f"{name} is truncated")
        return content


def _normalise_name(name: str) -> str:
    """Return a member's name in lower case with forward slashes: writers differ in both."""
    parts = name.replace("\\", "/").lower().split("/")
    return "/".join(part for part in parts if part not in ("", "."))


def _open_archive(file: zipfile.ZipFile, size: int) -> _Archive:
    # ZipInfo.is_dir fails for a member without a name.
    files = [info for info in file.infolist() if info.filename and info.filename[-1] != "/"]
    named = [(_normalise_name(info.filename), info) for info in files]
    named = [(name, info) for name, info in named if "__macosx" not in name.split("/")]
    mains = [name for name, _ in named if name.rpartition("/")[2] == "main.xml"]
    if not mains:
        raise SurfaceFileError("a zip archive without a main.xml is no X3P")
    if len(mains) > 1:
        raise SurfaceFileError(f"the archive has {len(mains)} main.xml; one is expected")
    folder = mains[0].removesuffix("main.xml")
    members: dict[str, zipfile.ZipInfo] = {}
    for name, info in named:
        if name.startswith(folder) and members.setdefault(name[len(folder) :], info) is not info:
            raise SurfaceFileError(f"the archive has {name} twice")
    return _Archive(file, members, size)


def _checksum_notes(archive: _Archive, header: X3pHeader, main: bytes) -> list[str]:
    name = _text(header.root, "Record4/ChecksumFile") or "md5checksum.hex"
    if _normalise_name(name) not in archive.members:
        return [f"no {name[:60]}: main.xml is not verified"]
    md5 = re.search(rb"[0-9a-fA-F]{32}", archive.read(name, limit=2**16))
    if md5 is None:
        return [f"{name[:60]} holds no MD5: main.xml is not verified"]
    if md5.group().decode().lower() != _md5(main):
        return ["main.xml does not match its MD5"]
    return []


def _md5(content: bytes) -> str:
    return hashlib.md5(content, usedforsecurity=False).hexdigest()


# --- main.xml -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class CoordinateAxis:
    """A coordinate axis: a coordinate is offset + factor * stored number.

    Floats of an absolute axis are in metres: its increment is ignored, with a note.
    """

    name: str
    is_incremental: bool
    dtype: np.dtype[Any]
    factor: float
    offset: float


@dataclass(frozen=True)
class X3pHeader:
    """The tree of main.xml with its axes x, y and z, and the shape (ny, nx) of the points."""

    root: ET.Element
    axes: tuple[CoordinateAxis, ...]
    is_profile: bool
    shape: tuple[int, int]

    @property
    def stored_axes(self) -> tuple[CoordinateAxis, ...]:
        """The axes whose coordinates are stored with each point."""
        return tuple(axis for axis in self.axes if axis.name == "CZ" or not axis.is_incremental)


class _Builder(ET.TreeBuilder):
    """Builds the tree with local names; refuses a DOCTYPE, which would allow entity attacks."""

    def start(self, tag: str, attrs: dict[str, str], /) -> ET.Element:
        return super().start(tag.rpartition("}")[2], attrs)

    def end(self, tag: str, /) -> ET.Element:
        return super().end(tag.rpartition("}")[2])

    def doctype(self, name: str, *_: str | None) -> None:
        raise SurfaceFileError(f"main.xml declares a DOCTYPE ({name}), which an X3P must not have")


def parse_header(content: bytes, notes: list[str]) -> X3pHeader:
    """Parse main.xml.

    Args:
        content: the bytes of main.xml.
        notes: receives a sentence for each peculiarity.

    Raises:
        SurfaceFileError: not the main.xml of a surface or profile that can be read.
    """
    root = _parse_tree(content, notes)
    feature = _required_text(root, "Record1/FeatureType")
    if feature == "PCL":
        raise SurfaceFileError("an X3P point cloud (PCL) has no grid; SUR or PRF is expected")
    if feature not in ("SUR", "PRF"):
        raise SurfaceFileError(f"FeatureType is {feature[:40]!r}; SUR or PRF is expected")
    axes = tuple(_parse_axis(root, name, notes) for name in ("CX", "CY", "CZ"))
    if root.find("Record1/Axes/Rotation") is not None:
        notes.append("the rotation in main.xml is not applied: heights are along the file's z")
    is_profile = feature == "PRF"
    return X3pHeader(root, axes, is_profile, _parse_shape(root, is_profile))


def _parse_tree(content: bytes, notes: list[str]) -> ET.Element:
    try:
        root = _parse_xml(content)
    except SurfaceFileError:  # also a ValueError, but no wrong encoding
        raise
    except (ET.ParseError, ValueError, LookupError) as error:
        # Only free text can be affected: all numbers and names that are used are ASCII.
        text = re.sub(r"^\s*<\?xml[^>]*\?>", "", content.decode("latin-1"))
        try:
            root = _parse_xml(text.encode())
        except ET.ParseError:
            raise SurfaceFileError(f"main.xml is not valid XML ({error})") from error
        notes.append("main.xml is not in the encoding it names: read as Latin-1")
    if not root.tag.startswith("ISO5436"):
        raise SurfaceFileError(f"main.xml has the root <{root.tag}>; <ISO5436_2> is expected")
    return root


def _parse_xml(content: bytes) -> ET.Element:
    parser = ET.XMLParser(target=_Builder())
    parser.feed(content)
    return parser.close()


def _text(root: ET.Element, path: str) -> str:
    return (root.findtext(path) or "").strip()


def _required_text(root: ET.Element, path: str) -> str:
    value = _text(root, path)
    if not value:
        raise SurfaceFileError(f"main.xml has no {path}")
    return value


def _parse_axis(root: ET.Element, name: str, notes: list[str]) -> CoordinateAxis:
    path = f"Record1/Axes/{name}"
    kind = _required_text(root, f"{path}/AxisType")
    if kind not in ("I", "A"):
        raise SurfaceFileError(f"{name} has AxisType {kind[:40]!r}; I or A is expected")
    incremental = kind == "I"
    # An incremental x or y axis stores no numbers.
    code = "D" if incremental and name != "CZ" else _text(root, f"{path}/DataType")
    if code not in DTYPES:
        raise SurfaceFileError(f"{name} has DataType {code[:40]!r}; I, L, F or D is expected")
    text = _text(root, f"{path}/Increment")
    if not text and incremental:
        raise SurfaceFileError(f"{name} is incremental but has no Increment")
    increment = parse_number(text or "1", f"{name} Increment")
    offset = parse_number(_text(root, f"{path}/Offset") or "0", f"{name} Offset")
    dtype = np.dtype(DTYPES[code])
    is_scaled = incremental or dtype.kind == "i"
    if is_scaled and increment <= 0:
        raise SurfaceFileError(f"{name} Increment is {text}; it must be positive [m]")
    if not is_scaled and increment != 1.0:
        notes.append(f"{name} Increment {text} ignored: floats of an absolute axis are in metres")
        increment = 1.0
    return CoordinateAxis(name, incremental, dtype, increment, offset)


def _parse_shape(root: ET.Element, is_profile: bool) -> tuple[int, int]:
    sizes = []
    for name in ("SizeX", "SizeY", "SizeZ"):
        text = _required_text(root, f"Record3/MatrixDimension/{name}")
        if not re.fullmatch(r"[0-9]{1,12}", text) or int(text) < 1:
            raise SurfaceFileError(f"{name} is {text[:40]!r}; a positive integer is expected")
        sizes.append(int(text))
    nx, ny, nz = sizes
    if nz != 1:
        raise SurfaceFileError(f"SizeZ is {nz}: a file of several layers is no single surface")
    if is_profile and ny != 1:
        raise SurfaceFileError(f"a profile (PRF) has SizeY 1, got {ny}")
    check_point_count(nx, ny)
    return ny, nx


# --- the points ---------------------------------------------------------------------------------


def _read_coordinates(
    archive: _Archive, header: X3pHeader, notes: list[str]
) -> dict[str, FloatArray]:
    """Return the stored coordinates [m], one flat array by name of each stored axis."""
    count = header.shape[0] * header.shape[1]
    axes = header.stored_axes
    record = np.dtype([(axis.name, axis.dtype) for axis in axes])
    content = _read_linked(archive, header, "PointData", count * record.itemsize, notes)
    table = np.frombuffer(content, dtype=record)
    columns = {axis.name: _to_metres(axis, table[axis.name]) for axis in axes}
    if _text(header.root, "Record3/DataLink/ValidPointsLink"):
        packed = _read_linked(archive, header, "ValidPoints", (count + 7) // 8, notes)
        bits = np.unpackbits(np.frombuffer(packed, np.uint8), count=count, bitorder="little")
        columns["CZ"][bits == 0] = np.nan
    return columns


def _read_linked(
    archive: _Archive, header: X3pHeader, kind: str, size: int, notes: list[str]
) -> bytes:
    """Return a binary member of a known size, verified by its MD5 if main.xml has one."""
    name = _required_text(header.root, f"Record3/DataLink/{kind}Link")
    md5 = _text(header.root, f"Record3/DataLink/MD5Checksum{kind}").lower()
    content = archive.read(name, expected=size)
    if not re.fullmatch(r"[0-9a-f]{32}", md5):
        notes.append(f"main.xml has no MD5 of {name[:60]}: not verified")
    elif _md5(content) != md5:
        raise SurfaceFileError(f"{name} does not match its MD5: the data are damaged")
    return content


def _to_metres(axis: CoordinateAxis, stored: NDArray[np.generic]) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):  # infinities are refused by the caller
        return axis.offset + axis.factor * stored.astype(np.float64)


def _find_step(
    header: X3pHeader, axis: CoordinateAxis, coordinates: dict[str, FloatArray], along: int
) -> float:
    """Return the step of an axis [m], refused unless absolute coordinates are uniform."""
    if axis.is_incremental:
        return axis.factor
    grid = np.moveaxis(coordinates[axis.name].reshape(header.shape), along, 0)
    known = np.isfinite(grid)
    if len(grid) < 2 or not known.any(axis=1).all():
        raise SurfaceFileError(f"{axis.name} is absolute and lacks positions: no pitch")
    low = np.min(grid, axis=1, where=known, initial=np.inf)
    high = np.max(grid, axis=1, where=known, initial=-np.inf)
    if not np.all(np.diff(low) > 0):
        raise SurfaceFileError(f"{axis.name} is absolute and its positions do not increase")
    is_whole = axis.dtype.kind == "i"
    resolution = axis.factor if is_whole else float(np.finfo(axis.dtype).eps * np.abs(low).max())
    result = measure_spacing(low, resolution)
    deviation = max(result.deviation, float(np.max(high - low)))
    if not result.is_uniform or np.max(high - low) > 1e-3 * result.step:
        fault = f"its positions are no uniform grid (deviation up to {deviation:.3g} m)"
        raise SurfaceFileError(f"{axis.name} is absolute and {fault}")
    return result.step
