"""Read a surface file, whatever its format: the content decides, not the name."""

from __future__ import annotations

import os
import stat
from dataclasses import replace
from pathlib import Path

import numpy as np

from asperity.errors import AsperityError, SurfaceFileError
from asperity.files import open_input
from asperity.measured.length_words import positive_number
from asperity.measured.reading.foreign import FORMATS, too_large, unread
from asperity.measured.reading.raw import RawSurface
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile
from asperity.measured.reading.registry import readers

MAX_BYTES = 2 * 10**9


def read_surface(
    path: str | os.PathLike[str],
    *,
    channel: str | int | None = None,
    unit: str | None = None,
    integrate_normals: bool = False,
    resample: float | None = None,
) -> RawSurface:
    r"""Read a measured or drawn surface, recognising its format by content.

    X3P (ISO 25178-72), SDF (ISO 25178-71, text and binary), NumPy arrays (NPY), text matrices
    and two-column profiles with or without an instrument's header, PNG and TIFF images, STL and
    OBJ patches, and the files of instruments that SurfaceTopography reads where the extra
    ``asperity[formats]`` is installed.

    Args:
        path: the file.
        channel: name or number (from 0) of the height channel, for a file with several.
        unit: unit of length of a file that has none, such as "mm": required for STL and OBJ,
            optional for NPY and text (metres if not given).
        integrate_normals: integrate a normal map (an image of slopes) to heights.
        resample: pitch [m] of the map that is interpolated through a list of x, y, z points on no
            regular grid, or of the profile through uneven ones; its error is in the notes.

    Returns:
        The heights [m] as the file gives them, with the pitch where the file has one. Heights
        of images have no unit: ``relative`` is True, and the pitch None.

    Raises:
        SurfaceFileError: the file cannot be read, with the reason.
        ParameterError: an argument that is needed, unknown or of no use for this file.

    Example:
        >>> import tempfile, pathlib
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder) / "groove.csv"
        ...     _ = file.write_text("x [um],z [nm]\n0.0,1\n0.5,2\n1.0,4\n1.5,2\n")
        ...     groove = read_surface(file)
        >>> groove.heights.shape, [f"{p:.1e}" for p in groove.pitch]
        ((4,), ['5.0e-07'])
    """
    name = Path(path).name or str(path)
    if resample is not None:
        resample = positive_number("resample", resample)
    options = ReadingOptions(channel, unit, integrate_normals, resample)
    try:
        _ = options.metres  # an unknown unit is refused whatever the file is
        _check_file(Path(path), name)
        with open_input(path, MAX_BYTES) as stream:
            file = SurfaceFile(Path(path), stream.read(4096))
        return _finite(_read(file, options))
    except MemoryError as error:
        raise SurfaceFileError(f"{name}: not enough memory to read this surface") from error
    except OSError as error:
        raise SurfaceFileError(f"{name}: cannot be read ({_reason(error)})") from error


def _read(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    """Return what the first reader that can read the file makes of it."""
    refusal: AsperityError | None = None
    faults: list[str] = []
    for reader in readers(faults):
        if not reader.recognises(file):
            continue
        try:
            raw = reader.read(file, options)
        except AsperityError as error:
            refusal = error
            if reader.certain:
                break
            continue
        if raw is not None:
            reader.check(file, options)
            return replace(raw, notes=(*_assumed(raw), *raw.notes, *faults))
    refusal = refusal or unread(file)
    if faults and isinstance(refusal, SurfaceFileError):
        raise SurfaceFileError("; ".join((str(refusal), *faults))) from refusal
    raise refusal


def _assumed(raw: RawSurface) -> tuple[str, ...]:
    """Return the sentence for a file that leaves its unit open; pixels have none at all."""
    return () if raw.has_units or raw.relative else ("no unit in the file: taken as metres",)


def _check_file(path: Path, name: str) -> None:
    try:
        status = path.stat()
    except FileNotFoundError as error:
        raise SurfaceFileError(f"{path}: no such file") from error
    except ValueError as error:  # a NUL in the name
        raise SurfaceFileError(f"{str(path)!r} is not a file name") from error
    if stat.S_ISDIR(status.st_mode):
        raise SurfaceFileError(f"{path} is a directory; a surface file is expected ({FORMATS})")
    if not stat.S_ISREG(status.st_mode):
        raise SurfaceFileError(f"{path} is not a regular file")
    if status.st_size == 0:
        raise SurfaceFileError(f"{name} is empty")
    if status.st_size > MAX_BYTES:
        raise too_large(name, status.st_size, MAX_BYTES)


def _finite(raw: RawSurface) -> RawSurface:
    infinite = np.isinf(raw.heights)
    if infinite.any():
        where = tuple(int(k) for k in np.argwhere(infinite)[0])
        raise SurfaceFileError(
            f"{raw.source}: infinite height at index {where}; a missing point is written as NaN"
        )
    return raw


def _reason(error: OSError) -> str:
    return error.strerror or str(error) or type(error).__name__
