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
from asperity.measured.reading.reader import (
    RawSurface,
    ReadingOptions,
    SurfaceFile,
    check_point_count,
)
from asperity.measured.reading.resampling import measure_spacing
from asperity.measured.reading.unsupported import ARCHIVE_ERRORS

DTYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}


@dataclass(frozen=True)
class CoordinateAxis:
    """A coordinate axis: a coordinate is offset + factor * stored number.

    The data of an absolute axis are in metres: its increment is ignored, with a note.
    """

    name: str
    is_incremental: bool
    type_code: str
    increment: float
    offset: float

    @property
    def dtype(self) -> np.dtype[Any]:
        """NumPy type of the stored numbers."""
        return np.dtype(DTYPES[self.type_code])

    @property
    def factor(self) -> float:
        """Metres per stored unit."""
        return self.increment if self.is_incremental else 1.0


@dataclass(frozen=True)
class BinaryLink:
    """Name and MD5 (empty if none) of a binary file in the archive."""

    name: str
    md5: str


@dataclass(frozen=True)
class X3pDocument:
    """The content of main.xml; either ``points_link`` or ``datums`` is set."""

    axes: tuple[CoordinateAxis, CoordinateAxis, CoordinateAxis]
    is_profile: bool
    shape: tuple[int, int]
    points_link: BinaryLink | None
    validity_link: BinaryLink | None
    datums: tuple[str, ...] | None
    checksum_file: str
    notes: tuple[str, ...]

    @property
    def stored_axes(self) -> tuple[CoordinateAxis, ...]:
        """The axes whose coordinates are stored with each point."""
        x, y, z = self.axes
        return (*(axis for axis in (x, y) if not axis.is_incremental), z)


class _Builder(ET.TreeBuilder):
    """Builds the tree with local names; refuses a DOCTYPE, which would allow entity attacks."""

    def start(self, tag: str, attrs: dict[str, str], /) -> ET.Element:
        return super().start(tag.rpartition("}")[2], attrs)

    def end(self, tag: str, /) -> ET.Element:
        return super().end(tag.rpartition("}")[2])

    def doctype(self, name: str, *_: str | None) -> None:
        raise SurfaceFileError(f"main.xml declares a DOCTYPE ({name}), which an X3P must not have")


def parse_document(content: bytes) -> X3pDocument:
    """Parse main.xml.

    Args:
        content: the bytes of main.xml.

    Returns:
        The validated content.

    Raises:
        SurfaceFileError: not the main.xml of a surface or profile that can be read.
    """
    notes: list[str] = []
    root = _parse_tree(content, notes)
    profile = _is_profile(_required_text(root, "Record1/FeatureType"))
    x, y, z = (_parse_axis(root, name, notes) for name in ("CX", "CY", "CZ"))
    if root.find("Record1/Axes/Rotation") is not None:
        notes.append("the rotation in main.xml is not applied: heights are along the file's z")
    points, validity, datums = _parse_data(root)
    return X3pDocument(
        axes=(x, y, z),
        is_profile=profile,
        shape=_parse_shape(root, profile),
        points_link=points,
        validity_link=validity,
        datums=datums,
        checksum_file=(root.findtext("Record4/ChecksumFile") or "").strip() or "md5checksum.hex",
        notes=tuple(notes),
    )


def _parse_tree(content: bytes, notes: list[str]) -> ET.Element:
    try:
        root = _parse_xml(content)
    except SurfaceFileError:  # also a ValueError, but no wrong encoding
        raise
    except (ET.ParseError, ValueError, LookupError) as error:
        if _is_utf8(content):
            raise SurfaceFileError(f"main.xml is not valid XML ({error})") from error
        # Only free text can be affected: all numbers and names that are used are ASCII.
        text = re.sub(r"^\s*<\?xml[^>]*\?>", "", content.decode("latin-1"))
        try:
            root = _parse_xml(text.encode())
        except ET.ParseError as second:
            raise SurfaceFileError(f"main.xml is not valid XML ({second})") from second
        notes.append("main.xml is not in the encoding it names: read as Latin-1")
    if not root.tag.startswith("ISO5436"):
        raise SurfaceFileError(f"main.xml has the root <{root.tag}>; <ISO5436_2> is expected")
    return root


def _parse_xml(content: bytes) -> ET.Element:
    parser = ET.XMLParser(target=_Builder())
    parser.feed(content)
    root = parser.close()
    assert isinstance(root, ET.Element)
    return root


def _is_utf8(content: bytes) -> bool:
    try:
        return bool(content.decode("utf-8"))
    except UnicodeDecodeError:
        return False


def _required_text(root: ET.Element, path: str) -> str:
    value = (root.findtext(path) or "").strip()
    if not value:
        raise SurfaceFileError(f"main.xml has no {path}")
    return value


def _is_profile(feature: str) -> bool:
    kinds = {"SUR": False, "PRF": True}
    if feature == "PCL":
        raise SurfaceFileError("an X3P point cloud (PCL) has no grid; SUR or PRF is expected")
    if feature not in kinds:
        raise SurfaceFileError(f"FeatureType is {feature[:40]!r}; SUR or PRF is expected")
    return kinds[feature]


def _parse_axis(root: ET.Element, name: str, notes: list[str]) -> CoordinateAxis:
    path = f"Record1/Axes/{name}"
    kind = _required_text(root, f"{path}/AxisType")
    if kind not in ("I", "A"):
        raise SurfaceFileError(f"{name} has AxisType {kind[:40]!r}; I or A is expected")
    incremental = kind == "I"
    code = _parse_type_code(root, name, stored=name == "CZ" or not incremental)
    text = (root.findtext(f"{path}/Increment") or "").strip()
    if not text and incremental:
        raise SurfaceFileError(f"{name} is incremental but has no Increment")
    increment = parse_number(text, f"{name} Increment") if text else 1.0
    offset = (root.findtext(f"{path}/Offset") or "").strip()
    axis = CoordinateAxis(
        name=name,
        is_incremental=incremental,
        type_code=code,
        increment=increment,
        offset=parse_number(offset, f"{name} Offset") if offset else 0.0,
    )
    if axis.factor <= 0:
        raise SurfaceFileError(f"{name} Increment is {text}; it must be positive [m]")
    if axis.factor != increment:
        notes.append(f"{name} Increment {text} ignored: the axis is absolute, in metres")
    return axis


def _parse_type_code(root: ET.Element, name: str, *, stored: bool) -> str:
    code = (root.findtext(f"Record1/Axes/{name}/DataType") or "").strip()
    if not stored:  # an incremental x or y axis stores no numbers
        return "D"
    if code not in DTYPES:
        raise SurfaceFileError(f"{name} has DataType {code[:40]!r}; I, L, F or D is expected")
    return code


def _parse_shape(root: ET.Element, profile: bool) -> tuple[int, int]:
    if root.find("Record3/MatrixDimension") is None:
        raise SurfaceFileError("main.xml has no Record3/MatrixDimension: the points have no grid")
    nx, ny, nz = (_parse_size(root, f"Size{letter}") for letter in "XYZ")
    if nz != 1:
        raise SurfaceFileError(f"SizeZ is {nz}: a file of several layers is no single surface")
    if profile and ny != 1:
        raise SurfaceFileError(f"a profile (PRF) has SizeY 1, got {ny}")
    check_point_count(nx, ny)
    return ny, nx


def _parse_size(root: ET.Element, name: str) -> int:
    text = _required_text(root, f"Record3/MatrixDimension/{name}")
    if not re.fullmatch(r"[0-9]{1,12}", text) or int(text) < 1:
        raise SurfaceFileError(f"{name} is {text[:40]!r}; a positive integer is expected")
    return int(text)


def _parse_data(
    root: ET.Element,
) -> tuple[BinaryLink | None, BinaryLink | None, tuple[str, ...] | None]:
    inline = root.find("Record3/DataList")
    linked = root.find("Record3/DataLink")
    if (inline is None) == (linked is None):
        raise SurfaceFileError("Record3 must have either a DataLink or a DataList")
    if inline is not None:
        return None, None, tuple((datum.text or "").strip() for datum in inline.iter("Datum"))
    points = _required_text(root, "Record3/DataLink/PointDataLink")
    valid = (root.findtext("Record3/DataLink/ValidPointsLink") or "").strip()
    validity = BinaryLink(valid, _parse_md5(root, "MD5ChecksumValidPoints")) if valid else None
    return BinaryLink(points, _parse_md5(root, "MD5ChecksumPointData")), validity, None


def _parse_md5(root: ET.Element, name: str) -> str:
    text = (root.findtext(f"Record3/DataLink/{name}") or "").strip().lower()
    return text if re.fullmatch(r"[0-9a-f]{32}", text) else ""


Columns = tuple[FloatArray, ...]
_MAX_XML = 64 * 2**20


def read_x3p(file: SurfaceFile, _options: ReadingOptions) -> RawSurface:
    """Read an X3P surface or profile.

    Heights are offset + increment * stored for an incremental height axis, and offset + stored
    for an absolute one, whatever their data type. A point is missing where its height is NaN,
    its validity bit is 0 or its Datum is empty.

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
    document = parse_document(main)
    notes = list(document.notes)
    notes.extend(_checksum_notes(archive, document, main))
    # x3ptools adds a mask that marks regions but changes no height.
    masks = [member for member in archive.members if member.rpartition("/")[2] == "mask.png"]
    notes.extend(f"{mask} is an annotation: not applied" for mask in masks)
    columns = _read_columns(archive, document, notes)
    heights = columns[-1].reshape(document.shape)
    pitch = _find_pitch(document, columns)
    if document.is_profile:
        return RawSurface(heights[0], pitch[:1], name, tuple(notes))
    return RawSurface(heights, pitch, name, tuple(notes))


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
                f"{name} {fault}: {info.file_size} bytes,"
                f" the matrix dimension and data types require {expected}"
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
    named = [
        (_normalise_name(info.filename), info)
        for info in file.infolist()
        # ZipInfo.is_dir fails for a member without a name.
        if info.filename
        and not info.filename.endswith("/")
        and "__macosx" not in _normalise_name(info.filename).split("/")
    ]
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


def _checksum_notes(archive: _Archive, document: X3pDocument, main: bytes) -> list[str]:
    name = document.checksum_file
    if _normalise_name(name) not in archive.members:
        return [f"no {name[:60]}: main.xml is not verified"]
    found = re.search(rb"[0-9a-fA-F]{32}", archive.read(name, limit=2**16))
    if found is None:
        return [f"{name[:60]} holds no MD5: main.xml is not verified"]
    if found.group().decode().lower() != _md5(main):
        return ["main.xml does not match its MD5"]
    return []


def _md5(content: bytes) -> str:
    return hashlib.md5(content, usedforsecurity=False).hexdigest()


def _read_linked(archive: _Archive, link: BinaryLink, expected: int, notes: list[str]) -> bytes:
    """Return a binary member of a known size, verified by its MD5 if main.xml has one."""
    content = archive.read(link.name, expected=expected)
    if not link.md5:
        notes.append(f"main.xml has no MD5 of {link.name[:60]}: not verified")
    elif _md5(content) != link.md5:
        raise SurfaceFileError(f"{link.name} does not match its MD5: the data are damaged")
    return content


def _read_columns(archive: _Archive, document: X3pDocument, notes: list[str]) -> Columns:
    """Return the stored coordinates in metres, one flat array per stored axis, z last."""
    count = document.shape[0] * document.shape[1]
    if document.points_link is None:
        return _read_inline(document, count)
    axes = document.stored_axes
    record = np.dtype([(axis.name, axis.dtype) for axis in axes])
    content = _read_linked(archive, document.points_link, count * record.itemsize, notes)
    table = np.frombuffer(content, dtype=record)
    columns = tuple(_to_metres(axis, table[axis.name]) for axis in axes)
    if document.validity_link is not None:
        packed = _read_linked(archive, document.validity_link, (count + 7) // 8, notes)
        bits = np.unpackbits(np.frombuffer(packed, np.uint8), count=count, bitorder="little")
        columns[-1][bits == 0] = np.nan
    return columns


def _to_metres(axis: CoordinateAxis, stored: NDArray[np.generic]) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):  # infinities are refused by the caller
        return axis.offset + axis.factor * stored.astype(np.float64)


def _read_inline(document: X3pDocument, count: int) -> Columns:
    """Return the coordinates of a DataList; a Datum holds the stored axes, or all three."""
    datums = document.datums or ()
    if len(datums) != count:
        raise SurfaceFileError(f"{len(datums)} Datum elements; the matrix has {count} points")
    axes = document.stored_axes
    width = max((text.count(";") + 1 for text in datums if text), default=len(axes))
    if width not in (len(axes), 3):
        raise SurfaceFileError(f"a Datum has {width} numbers; {len(axes)} or 3 are expected")
    table = np.full((count, width), np.nan)
    for index, text in enumerate(datums):
        if text:
            table[index] = _parse_datum(text, index, width)
    if width > len(axes):
        _check_indices(document, table)
        table = table[:, [axis in axes for axis in document.axes]]
    return tuple(_to_metres(axis, table[:, k]) for k, axis in enumerate(axes))


def _parse_datum(text: str, index: int, width: int) -> list[float]:
    parts = [part.strip() for part in text.split(";")]
    if len(parts) != width:
        raise SurfaceFileError(f"Datum {index + 1} has {len(parts)} numbers instead of {width}")
    what = f"Datum {index + 1}"
    missing = ("", "nan")
    return [np.nan if p.lower() in missing else parse_number(p, what) for p in parts]


def _check_indices(document: X3pDocument, table: FloatArray) -> None:
    """Refuse coordinates of an incremental axis that contradict the order of the points."""
    rows, columns = np.divmod(np.arange(len(table)), document.shape[1])
    for k, index in ((0, columns), (1, rows)):
        axis = document.axes[k]
        given = table[:, k]
        if not axis.is_incremental:
            continue
        by_index = np.abs(given - index)
        by_metre = np.abs(given - (axis.offset + axis.increment * index)) / axis.increment
        if np.nanmax(np.minimum(by_index, by_metre), initial=0.0) > 1e-3:
            raise SurfaceFileError(f"{axis.name} of a Datum contradicts the order of the points")


def _find_pitch(document: X3pDocument, columns: Columns) -> tuple[float, float]:
    stored = {axis.name: column for axis, column in zip(document.stored_axes, columns, strict=True)}
    x, y, _ = document.axes
    px = x.increment if x.is_incremental else _absolute_step(document, x, stored[x.name], along=1)
    if document.is_profile:  # one row has no distance to the next
        return px, px
    py = y.increment if y.is_incremental else _absolute_step(document, y, stored[y.name], along=0)
    return px, py


def _absolute_step(
    document: X3pDocument, axis: CoordinateAxis, column: FloatArray, along: int
) -> float:
    """Return the step of an absolute axis, refused unless its coordinates form a uniform grid."""
    grid = np.moveaxis(column.reshape(document.shape), along, 0)
    if len(grid) < 2:
        raise SurfaceFileError(f"{axis.name} is absolute and has one position: no pitch")
    known = np.isfinite(grid)
    if not known.any(axis=1).all():
        raise SurfaceFileError(f"{axis.name} has positions without any point")
    low = np.min(grid, axis=1, where=known, initial=np.inf)
    high = np.max(grid, axis=1, where=known, initial=-np.inf)
    if not np.all(np.diff(low) > 0):
        raise SurfaceFileError(f"{axis.name} is absolute and its positions do not increase")
    digit = axis.factor if axis.dtype.kind == "i" else float(np.finfo(axis.dtype).eps)
    scale = 1.0 if axis.dtype.kind == "i" else float(np.abs(low).max())
    result = measure_spacing(low, digit * scale)
    if not result.is_uniform or np.max(high - low) > 1e-3 * result.step:
        raise SurfaceFileError(
            f"{axis.name} is absolute and its positions are no uniform grid"
            f" (deviation up to {max(result.deviation, float(np.max(high - low))):.3g} m)"
        )
    return result.step
