"""Read a surface file, whatever its format: the content decides, not the name."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import numpy as np

from ...errors import SurfaceFileError
from .arrays import NPY_MAGIC, read_npy
from .raw import RawSurface
from .text import read_text
from .x3p import ZIP_MAGIC, read_x3p

MAX_BYTES = 2 * 10**9
FORMATS = "X3P, NPY, text matrix, two-column profile"

# First bytes of files that people take for surfaces, so that the message can name them.
_FOREIGN: tuple[tuple[bytes, str], ...] = (
    (b"\x89PNG", "PNG image"),
    (b"\xff\xd8\xff", "JPEG image"),
    (b"II*\x00", "TIFF image"),
    (b"MM\x00*", "TIFF image"),
    (b"II+\x00", "TIFF image"),
    (b"MM\x00+", "TIFF image"),
    (b"GIF8", "GIF image"),
    (b"BM", "BMP image"),
    (b"%PDF", "PDF document"),
    (b"FRTM", "FRT file"),
    (b"\x89HDF", "HDF5 file"),
    (b"\x1f\x8b", "gzip archive"),
    (b"BZh", "bzip2 archive"),
    (b"7z\xbc\xaf", "7-Zip archive"),
    (b"Rar!", "RAR archive"),
    (b"GWYP", "Gwyddion file"),
    (b"DSCOMPRESSED", "Digital Surf SUR file"),
    (b"DIGITAL SURF", "Digital Surf SUR file"),
    (b"<?xml", "XML document"),
    (b"{\\rtf", "RTF document"),
    (b"MATLAB 5.0 MAT-file", "MATLAB file"),
)


def read_surface(path: str | os.PathLike[str]) -> RawSurface:
    r"""Read a measured surface, recognising its format by content.

    X3P (ISO 5436-2, ISO 25178-72), NumPy arrays (NPY), text matrices and two-column
    profiles, with or without an instrument's header.

    Args:
        path: the file.

    Returns:
        The heights [m] as the file gives them, with the pitch where the file has one.

    Raises:
        SurfaceFileError: the file cannot be read, with the reason.

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
    try:
        return _finite(_read(Path(path), name))
    except MemoryError as error:
        raise SurfaceFileError(f"{name}: not enough memory to read this surface") from error
    except OSError as error:
        raise SurfaceFileError(f"{name}: cannot be read ({_reason(error)})") from error


def _read(path: Path, name: str) -> RawSurface:
    _check_file(path, name)
    with path.open("rb") as stream:
        head = stream.read(64)
    if head.startswith(ZIP_MAGIC):
        return read_x3p(path)
    if head.startswith(NPY_MAGIC):
        return read_npy(path)
    for magic, kind in _FOREIGN:
        # Two letters alone may also begin a text ("BMS profile ..."): ask for a binary byte.
        if head.startswith(magic) and (len(magic) > 2 or b"\x00" in head or magic[0] < 32):
            raise _foreign(name, f"a {kind}")
    content = path.read_bytes()
    if _is_binary(content):
        raise _foreign(name, "a binary file")
    return read_text(content, name)


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
        raise SurfaceFileError(
            f"{name} has {status.st_size / 1e9:.1f} GB; at most {MAX_BYTES / 1e9:.0f} GB are read"
        )


def _is_binary(content: bytes) -> bool:
    """True where control characters show that this is no text."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):  # UTF-16 text has NULs
        return False
    sample = content[:65536]
    controls = sum(sample.count(c) for c in range(32) if c not in b"\t\n\v\f\r\x1a")
    return b"\x00" in content or controls > len(sample) // 100


def _foreign(name: str, kind: str) -> SurfaceFileError:
    return SurfaceFileError(
        f"{name} looks like {kind}: not a surface format that asperity reads: {FORMATS}"
    )


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
