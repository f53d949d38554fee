"""Read the files of instruments through SurfaceTopography (the extra ``asperity[formats]``)."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.lengths import is_pitch, unit_to_metres
from asperity.measured.reader import (
    INTERPOLATE,
    MAX_POINTS,
    RawSurface,
    ReadingOptions,
    SurfaceFile,
)
from asperity.measured.reading.isolation import reject_on_error
from asperity.measured.reading.text_header import names_other_quantity

LIBRARY = "SurfaceTopography"
"""Name of the library that reads the files of instruments."""

# Formats that asperity reads itself, or refuses; HGT accepts any file of a square size.
_OWN_FORMATS = frozenset(("sdf", "xyz", "asc", "npy", "npz", "x3p", "hgt"))
# Formats of which a second library (surfalize) reads other lengths, with the difference.
_WRONG_FORMATS = {
    "nms": "its pitch in nanometres is taken for millimetres",
    "tmd": "surfalize reads all its lengths 1000 times smaller",
    "metropro": "surfalize reads its heights 8 times greater",
    "plu": "surfalize reads some of its heights 11 times greater",
}
WITNESSED_FORMATS = {"al3d", "bcr", "di", "ezd", "ibw", "mnt", "opd", "opdx", "sur", "wsxm"}
"""Formats of which a second reader finds the same lengths (table in ``docs/howto/files.md``)."""
NO_WITNESS = "no second witness for this format: check the lateral scale"
"""The note on a file of any other format."""
_MAX_COMPRESSION_RATIO = 1032  # of deflate, which all compressed formats use


def read_instrument(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
    """Read a file that one of SurfaceTopography's readers recognises.

    For text, only readers that recognise the first bytes are tried: some accept any text.

    Returns:
        Heights [m]; None if no reader recognises the file or the extra is not installed.

    Raises:
        SurfaceFileError: the file is recognised but cannot be read.
        ParameterError: the channel or the unit is missing, or must not be given.
    """
    library = _import_library()
    if library is None:
        return None
    channels = ""
    with _BoundedFile(io.FileIO(file.path)) as stream:
        for reader in _open_recognised(library, stream, definite_only=file.is_text):
            with contextlib.closing(reader), _reject_damaged(reader):
                channel = _select_channel(reader, file.name, options.channel)
                if channel is not None:
                    if fault := _WRONG_FORMATS.get(reader.format()):
                        raise SurfaceFileError(
                            f"a {reader.name()} file, which {LIBRARY} may misread"
                            f": {fault}; export it as X3P or SDF"
                        )
                    return _to_surface(reader, channel, file, options)
                names = [f"{c.name!r} ({c.data_kind.value})" for c in reader.channels]
                channels = channels or ", ".join(names) or "none"
    if channels:
        raise SurfaceFileError(f"no height channel; the file has: {channels}")
    return None


def _reject_damaged(reader: Any) -> contextlib.AbstractContextManager[None]:
    return reject_on_error(f"{reader.name()} file, damaged")


class _BoundedFile(io.BufferedReader):
    """A file that limits each read to the bytes it has.

    Python allocates the memory for a read beforehand, and a damaged header may request terabytes.
    """

    def read(self, size: int | None = -1, /) -> bytes:
        left = max(os.fstat(self.fileno()).st_size - self.tell(), 0)
        if size is None or size < 0:
            return super().read(left)
        return super().read(min(size, left))


def has_library() -> bool:
    """Whether the extra is installed, found without the import, which takes seconds."""
    return find_spec(LIBRARY) is not None


def _import_library() -> Any:
    """Return SurfaceTopography.IO, whose import takes seconds; None if it cannot be imported."""
    try:
        return import_module(f"{LIBRARY}.IO")
    except Exception:  # not installed, or a broken installation
        return None


def _open_recognised(library: Any, stream: _BoundedFile, *, definite_only: bool) -> Iterator[Any]:
    """Yield the file opened by each of the library's readers that recognise it."""
    head = stream.read(512)
    for kind in library.readers:
        if kind.format() in _OWN_FORMATS:
            continue
        match = kind.can_read(head).value
        if match == "no" or (definite_only and match != "yes"):
            continue
        stream.seek(0)
        try:
            with _reject_damaged(kind):
                opened = kind(stream)
        except SurfaceFileError:
            if match == "yes":
                raise
        else:  # otherwise the reader has found that the file is not of its format
            yield opened


def _to_surface(
    reader: Any, channel: Any, file: SurfaceFile, options: ReadingOptions
) -> RawSurface:
    points = int(np.prod([int(n) for n in channel.nb_grid_pts or (0,)]))
    if points > MAX_POINTS or points > _MAX_COMPRESSION_RATIO * file.path.stat().st_size:
        raise SurfaceFileError(f"{points} points, more than are read or the file can hold")
    stated = unit_to_metres(str(channel.unit)) if channel.unit is not None else None
    unit, assumed = options.resolve_unit(file.name, stated)
    if unit is None:
        requirement = f"is required: {file.name} has no unit; give one, such as 'um'"
        raise ParameterError("unit", requirement)
    heights, pitch = _read_channel(channel)
    notes = [f"{reader.name()} file, read by SurfaceTopography"]
    if reader.format() not in WITNESSED_FORMATS:
        notes.append(NO_WITNESS)
    if len(reader.channels) > 1:
        notes.append(f"channel {channel.name!r} of {len(reader.channels)}")
    with np.errstate(over="ignore"):
        scaled = heights * unit
    if pitch is not None:
        pitch = tuple([float(p) * unit for p in pitch])
        if not is_pitch(pitch):
            raise SurfaceFileError(f"the file's pitch {pitch} is not positive")
    return RawSurface(scaled, pitch, file.name, (*notes, *assumed))


def _select_channel(reader: Any, name: str, channel: str | int | None) -> Any | None:
    """Return the named height channel, or the only one; None if there is none."""
    heights = [c for c in reader.channels if c.data_kind.value == "height" and c.dim in (1, 2)]
    heights = [c for c in heights if not names_other_quantity(str(c.name))]
    if not heights:
        return None
    if channel is None and len(heights) == 1:
        return heights[0]
    names = ", ".join([f"{c.index}: {c.name!r}" for c in heights])
    if channel is None:
        channels = f"{len(heights)} height channels: {names}"
        raise ParameterError("channel", f"must be given: {name} has {channels}")
    matching = [c for c in heights if c.name == channel]
    if not matching:
        matching = [c for c in heights if str(c.index) == str(channel)]
    if len(matching) != 1:
        raise ParameterError("channel", f"must be one of the height channels {names}", channel)
    return matching[0]


def _read_channel(channel: Any) -> tuple[FloatArray, tuple[float, ...] | None]:
    """Return heights with x along the last axis and the pitch, in the file's unit."""
    options: dict[str, Any] = {}
    # The library requires a size, unless the points are uneven; the pitch is dropped below.
    if channel.physical_sizes is None and channel.is_uniform is not False:
        options["physical_sizes"] = (1.0,) * len(channel.nb_grid_pts)
    if channel.unit is None:
        options["unit"] = "m"
    topography = channel.topography(**options)
    if not topography.is_uniform or channel.is_uniform is False:
        raise SurfaceFileError(f"the points are not evenly spaced: {INTERPOLATE}")
    stored = np.ma.masked_array(topography.heights(), dtype=np.float64)
    heights = np.ascontiguousarray(stored.filled(np.nan).T)
    if channel.physical_sizes is None:
        return heights, None
    sizes = np.atleast_1d(np.asarray(channel.physical_sizes, dtype=np.float64))
    return heights, tuple(sizes / np.array(heights.shape[::-1]))
