"""Read X3P files (ISO 5436-2, ISO 25178-72): a zip archive of XML and binary heights."""

from __future__ import annotations

import hashlib
import re
import struct
import zipfile
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.errors import SurfaceFileError
from asperity.measured.reading.numbers import parse_number
from asperity.measured.reading.raw import RawSurface
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile, naming
from asperity.measured.reading.spacing import spacing
from asperity.measured.reading.x3p_document import Axis, Document, Link, parse_document

_MAX_XML = 64 * 2**20
_SMALL = 64 * 2**20
_BOMB = 500  # heights of an instrument, even with many points missing, pack far less
_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    EOFError,
    KeyError,
    NotImplementedError,  # a compression that zipfile does not know
    RuntimeError,  # an encrypted member
    ValueError,
)


@naming
def read_x3p(file: SurfaceFile, _options: ReadingOptions) -> RawSurface:
    """Read an X3P surface or profile.

    Heights are offset + increment * stored for an incremental height axis, and offset + stored
    for an absolute one, whatever their data type. A point is missing where its height is NaN,
    its validity bit is 0 or its Datum is empty.

    Returns:
        Heights [m], pitch [m] and what is odd about the file.

    Raises:
        SurfaceFileError: not an X3P that can be read, with the reason.
    """
    try:
        with zipfile.ZipFile(file.path) as archive:
            return _read(_archive(archive, file.path.stat().st_size), file.name)
    except SurfaceFileError:
        raise
    except _DAMAGE as error:
        raise SurfaceFileError(f"damaged zip archive ({error})") from error


def _read(archive: _Archive, name: str) -> RawSurface:
    main = archive.read("main.xml", limit=_MAX_XML)
    document = parse_document(main)
    notes = list(document.notes)
    notes.extend(_checksum_notes(archive, document, main))
    notes.extend(archive.annotations())
    columns = _columns(archive, document, notes)
    heights = columns[-1].reshape(document.shape)
    pitch = _pitch(document, columns)
    if document.profile:
        return RawSurface(heights[0], pitch[:1], name, tuple(notes))
    return RawSurface(heights, pitch, name, tuple(notes))


@dataclass(frozen=True)
class _Archive:
    """The members beside main.xml, by lower-case name relative to its folder."""

    file: zipfile.ZipFile
    members: dict[str, zipfile.ZipInfo]
    size: int  # of the whole archive [bytes]

    def read(self, name: str, *, limit: int = 0, expected: int = 0) -> bytes:
        """Return a member's bytes; the size is checked before anything is unpacked."""
        info = self.members.get(_normal(name))
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
                f" the matrix dimension and data types ask for {expected}"
            )
        if info.compress_size > self.size:  # zipfile would reserve so much memory
            raise SurfaceFileError(f"{name} is truncated")
        if info.file_size > max(_BOMB * info.compress_size, _SMALL):
            raise SurfaceFileError(
                f"{name} unpacks from {info.compress_size} bytes to {info.file_size}:"
                " no measured surface does; the archive is damaged or a zip bomb"
            )
        content = self.file.read(info)
        if len(content) != info.file_size:
            raise SurfaceFileError(f"{name} is truncated")
        return content

    def annotations(self) -> list[str]:
        """Return a note where x3ptools left a mask, which marks regions but changes no height."""
        masks = [name for name in self.members if name.rpartition("/")[2] == "mask.png"]
        return [f"{name} is an annotation: not applied" for name in masks]


def _normal(name: str) -> str:
    """Return a member's name in lower case with plain slashes: writers disagree about both."""
    parts = name.replace("\\", "/").lower().split("/")
    return "/".join(part for part in parts if part not in ("", "."))


def _archive(file: zipfile.ZipFile, size: int) -> _Archive:
    named = [
        (_normal(info.filename), info)
        for info in file.infolist()
        # ZipInfo.is_dir fails for a member without a name.
        if info.filename
        and not info.filename.endswith("/")
        and "__macosx" not in _normal(info.filename).split("/")
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


def _checksum_notes(archive: _Archive, document: Document, main: bytes) -> list[str]:
    name = document.checksum_file
    if _normal(name) not in archive.members:
        return [f"no {name[:60]}: main.xml is not verified"]
    found = re.search(rb"[0-9a-fA-F]{32}", archive.read(name, limit=2**16))
    if found is None:
        return [f"{name[:60]} holds no MD5: main.xml is not verified"]
    if found.group().decode().lower() != _md5(main):
        return ["main.xml does not match its MD5"]
    return []


def _md5(content: bytes) -> str:
    return hashlib.md5(content, usedforsecurity=False).hexdigest()


def _linked(archive: _Archive, link: Link, expected: int, notes: list[str]) -> bytes:
    content = archive.read(link.name, expected=expected)
    if not link.md5:
        notes.append(f"main.xml has no MD5 of {link.name[:60]}: not verified")
    elif _md5(content) != link.md5:
        raise SurfaceFileError(f"{link.name} does not match its MD5: the data are damaged")
    return content


def _columns(
    archive: _Archive, document: Document, notes: list[str]
) -> tuple[NDArray[np.float64], ...]:
    """Return the stored coordinates in metres, one flat array per stored axis, z last."""
    count = document.shape[0] * document.shape[1]
    if document.points is None:
        return _inline(document, count)
    axes = document.stored_axes
    record = np.dtype([(axis.name, axis.dtype) for axis in axes])
    content = _linked(archive, document.points, count * record.itemsize, notes)
    table = np.frombuffer(content, dtype=record)
    columns = tuple(_metres(axis, table[axis.name]) for axis in axes)
    if document.validity is not None:
        packed = _linked(archive, document.validity, (count + 7) // 8, notes)
        bits = np.unpackbits(np.frombuffer(packed, np.uint8), count=count, bitorder="little")
        columns[-1][bits == 0] = np.nan
    return columns


def _metres(axis: Axis, stored: NDArray[np.generic]) -> NDArray[np.float64]:
    with np.errstate(over="ignore", invalid="ignore"):  # infinities are refused by the caller
        return axis.offset + axis.factor * stored.astype(np.float64)


def _inline(document: Document, count: int) -> tuple[NDArray[np.float64], ...]:
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
            table[index] = _datum(text, index, width)
    if width > len(axes):
        _check_indices(document, table)
        keep = [axis in axes for axis in document.axes]
        table = table[:, keep]
    return tuple(_metres(axis, table[:, k]) for k, axis in enumerate(axes))


def _datum(text: str, index: int, width: int) -> list[float]:
    parts = [part.strip() for part in text.split(";")]
    if len(parts) != width:
        raise SurfaceFileError(f"Datum {index + 1} has {len(parts)} numbers instead of {width}")
    what = f"Datum {index + 1}"
    missing = ("", "nan")
    return [np.nan if p.lower() in missing else parse_number(p, what) for p in parts]


def _check_indices(document: Document, table: NDArray[np.float64]) -> None:
    """Refuse coordinates of an incremental axis that contradict the order of the points."""
    rows, columns = np.divmod(np.arange(len(table)), document.shape[1])
    for k, index in ((0, columns), (1, rows)):
        axis = document.axes[k]
        given = table[:, k]
        if not axis.incremental:
            continue
        by_index = np.abs(given - index)
        by_metre = np.abs(given - (axis.offset + axis.increment * index)) / axis.increment
        if np.nanmax(np.minimum(by_index, by_metre), initial=0.0) > 1e-3:
            raise SurfaceFileError(f"{axis.name} of a Datum is not where the order of points says")


def _pitch(document: Document, columns: tuple[NDArray[np.float64], ...]) -> tuple[float, float]:
    stored = {axis.name: column for axis, column in zip(document.stored_axes, columns, strict=True)}
    x, y, _ = document.axes
    px = x.increment if x.incremental else _step(document, x, stored[x.name], along=1)
    if document.profile:  # one row has no distance to the next
        return px, px
    py = y.increment if y.incremental else _step(document, y, stored[y.name], along=0)
    return px, py


def _step(document: Document, axis: Axis, column: NDArray[np.float64], along: int) -> float:
    """Return the step of an absolute axis, whose coordinates must form a uniform grid."""
    grid = np.moveaxis(column.reshape(document.shape), along, 0)
    if len(grid) < 2:
        raise SurfaceFileError(f"{axis.name} is absolute and has one position: no pitch")
    known = np.isfinite(grid)
    if not known.any(axis=1).all():
        raise SurfaceFileError(f"{axis.name} has positions that no point gives")
    low = np.min(grid, axis=1, where=known, initial=np.inf)
    high = np.max(grid, axis=1, where=known, initial=-np.inf)
    if not np.all(np.diff(low) > 0):
        raise SurfaceFileError(f"{axis.name} is absolute and its positions do not increase")
    digit = axis.factor if axis.dtype.kind == "i" else float(np.finfo(axis.dtype).eps)
    scale = 1.0 if axis.dtype.kind == "i" else float(np.abs(low).max())
    result = spacing(low, digit * scale)
    if not result.uniform or np.max(high - low) > 1e-3 * result.step:
        raise SurfaceFileError(
            f"{axis.name} is absolute and its positions are no uniform grid"
            f" (deviation up to {max(result.deviation, float(np.max(high - low))):.3g} m)"
        )
    return result.step
