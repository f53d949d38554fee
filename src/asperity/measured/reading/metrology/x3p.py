"""Read X3P files (ISO 5436-2, ISO 25178-72): a zip archive of XML and binary heights."""

from __future__ import annotations

import hashlib
import re
import zipfile
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import SurfaceFileError
from asperity.measured.lengths import parse_number
from asperity.measured.reading.metrology import x3p_document
from asperity.measured.reading.metrology.x3p_document import BinaryLink, CoordinateAxis, X3pDocument
from asperity.measured.reading.raw_surface import RawSurface
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile
from asperity.measured.reading.resampling import measure_spacing
from asperity.measured.reading.unsupported import ARCHIVE_ERRORS

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
    document = x3p_document.parse_document(main)
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
