"""The readers of surface files, in the order in which they are asked.

First those that know a file by its own mark. Then a user's own: registered ones in the order of
registration, then the entry points of the group ``asperity.readers`` by name, which are loaded only
when a file comes that far. Last those that take what is left: text, and the files of instruments.

The readers that asperity brings.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import EntryPoint, entry_points, version

import numpy as np

from asperity.errors import AsperityError, ParameterError, SurfaceFileError
from asperity.measured.reading.arrays import NPY_MAGIC, read_npy
from asperity.measured.reading.esri import is_esri, read_esri
from asperity.measured.reading.foreign import (
    ZIP_MAGIC,
    archive_kind,
    is_foreign,
    refuse_foreign,
    too_large,
)
from asperity.measured.reading.image import surface_of_pixels
from asperity.measured.reading.instruments import LIBRARY, has_library, read_instrument
from asperity.measured.reading.mesh import mesh_reader
from asperity.measured.reading.png import PNG_MAGIC, read_png
from asperity.measured.reading.raw import RawSurface
from asperity.measured.reading.reader import Reader, ReadingOptions, SurfaceFile, naming
from asperity.measured.reading.sdf import is_sdf, read_sdf
from asperity.measured.reading.text import read_text
from asperity.measured.reading.tiff import TIFF_MAGIC, read_tiff_image
from asperity.measured.reading.x3p import read_x3p

_MOST_TEXT = 5 * 10**8  # numbers in text take several times their size while they are read


@naming
def _read_png(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    integrate = options.integrate_normals
    return surface_of_pixels(read_png(file.content), file.name, integrate_normals=integrate)


def _is_x3p(file: SurfaceFile) -> bool:
    return file.head.startswith(ZIP_MAGIC) and archive_kind(file.path) == "X3P"


def _is_png(file: SurfaceFile) -> bool:
    return file.head.startswith(PNG_MAGIC)


def _is_tiff(file: SurfaceFile) -> bool:
    return file.head.startswith(TIFF_MAGIC)


def _read_text(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
    size = file.path.stat().st_size
    if size > _MOST_TEXT:
        raise too_large(file.name, size, _MOST_TEXT, " of text")
    return read_text(file, options)


MARKED = (
    Reader("an X3P file", _is_x3p, read_x3p),
    Reader("an NPY file", lambda file: file.head.startswith(NPY_MAGIC), read_npy, ("unit",)),
    Reader("a PNG image", _is_png, _read_png, ("integrate_normals",)),
    Reader("a TIFF image", _is_tiff, read_tiff_image, ("integrate_normals", "unit")),
    Reader("an ESRI ASCII grid", is_esri, read_esri, ("unit",)),
    Reader("an SDF file", lambda file: is_sdf(file.head), read_sdf),
    mesh_reader("STL"),
    mesh_reader("OBJ"),
)
"""Those that know a file by its own mark."""

_OF_TEXT = ("unit", "resample")

LAST = (
    Reader("a file of another kind", is_foreign, refuse_foreign),
    Reader("a text file", lambda file: file.is_text, _read_text, _OF_TEXT, certain=False),
    Reader(
        "an instrument's file",
        lambda _: has_library(),
        read_instrument,
        ("channel", "unit", "resample"),
        certain=False,
    ),
)
"""Those that take what is left, or refuse it."""


ENTRY_POINTS = "asperity.readers"
"""Group of the entry points by which an installed package brings a :class:`Reader`."""

_PASSED = (AsperityError, OSError, MemoryError)  # what a reader may raise
OWN: dict[str, Reader] = {}


def register(reader: Reader) -> None:
    """Let a reader of your own be asked, after the shipped ones that know a file by its mark.

    Args:
        reader: the reader.

    Raises:
        ParameterError: its name is taken.
    """
    if reader.name in {known.name for known in (*MARKED, *OWN.values(), *LAST)}:
        raise ParameterError("reader", "must have a name that no other reader has", reader.name)
    OWN[reader.name] = reader


def readers(faults: list[str]) -> Iterator[Reader]:
    """Yield all readers in the order in which they are asked.

    Args:
        faults: receives a sentence for each reader of the user's that cannot be used.
    """
    yield from MARKED
    for reader in OWN.values():
        yield _guarded(reader, faults)
    for point in sorted(entry_points(group=ENTRY_POINTS), key=lambda point: point.name):
        loaded = _loaded(point, faults)
        if loaded is not None:
            yield _guarded(loaded, faults)
    yield from LAST


def outside_readers() -> str | None:
    """Return what reads files besides this package: the version of the library, if it is there.

    ``None`` where readers of one's own may have a part, of which nothing is known.
    """
    if OWN or entry_points(group=ENTRY_POINTS):
        return None
    return version(LIBRARY) if has_library() else ""


def _loaded(point: EntryPoint, faults: list[str]) -> Reader | None:
    try:
        reader = point.load()
        if not isinstance(reader, Reader):
            raise TypeError(f"{point.value} is no Reader")
    except Exception as error:  # a package of somebody else's may raise anything
        faults.append(f"the reader {point.name!r} cannot be used ({_reason(error)})")
        return None
    return reader


def _guarded(reader: Reader, faults: list[str]) -> Reader:
    """Return a user's reader whose own mistakes do not stop the others."""

    def recognises(file: SurfaceFile) -> bool:
        try:
            return bool(reader.recognises(file))
        except _PASSED:
            raise
        except Exception as error:  # a user's code may raise anything
            faults.append(f"the reader of {reader.name} cannot be used ({_reason(error)})")
            return False

    def read(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
        try:
            return _checked(reader.read(file, options))
        except _PASSED:
            raise
        except Exception as error:  # as above
            message = f"{file.name}: the reader of {reader.name} failed ({_reason(error)})"
            raise SurfaceFileError(message) from error

    return replace(reader, recognises=recognises, read=read)


def _checked(raw: RawSurface | None) -> RawSurface | None:
    """Return a surface as the others are made, or refuse what is none."""
    if raw is None:
        return None
    if not isinstance(raw, RawSurface):
        raise TypeError(f"{type(raw).__name__} instead of a RawSurface")
    heights = np.ascontiguousarray(raw.heights, dtype=np.float64)
    if heights.ndim not in (1, 2) or heights.size == 0:
        raise ValueError(f"heights of shape {heights.shape}")
    pitch = None if raw.pitch is None else tuple(float(p) for p in raw.pitch)
    if pitch is not None and not (
        len(pitch) == heights.ndim and all(np.isfinite(p) and p > 0.0 for p in pitch)
    ):
        raise ValueError(f"pitch {pitch} for heights of shape {heights.shape}")
    return replace(raw, heights=heights, pitch=pitch)


def _reason(error: Exception) -> str:
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text[:120]}" if text else type(error).__name__
