"""Refuse files of unsupported formats, naming the format and a remedy."""

from __future__ import annotations

import struct
import tomllib
import zipfile
import zlib
from pathlib import Path

from asperity.core.errors import SurfaceFileError
from asperity.measured.reading.images.image_files import TIFF_MAGIC
from asperity.measured.reading.metrology.surface_topography import has_library
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile

ZIP_MAGIC = (b"PK\x03\x04", b"PK\x05\x06")  # the second is that of an empty archive
_MAX_UNPACKED_BYTES = 2 * 10**9
# RuntimeError: an encrypted member, or a compression that zipfile does not support.
_DAMAGED = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, KeyError, ValueError)
ARCHIVE_ERRORS = (*_DAMAGED, RuntimeError)
"""Errors that zipfile raises for a damaged archive."""


def classify_archive(path: Path) -> str:
    """Return "X3P", "NPZ" or "other"; a damaged archive counts as X3P, whose reader refuses it.

    Args:
        path: a file with the signature of a zip archive.

    Raises:
        SurfaceFileError: the archive would unpack to gigabytes.
    """
    try:
        with zipfile.ZipFile(path) as file:
            members = file.infolist()
    except ARCHIVE_ERRORS:
        return "X3P"
    names = [member.filename.replace("\\", "/").lower() for member in members]
    if any(name.rpartition("/")[2] == "main.xml" for name in names):
        return "X3P"  # its reader checks the size of each member against main.xml
    size = sum(member.file_size for member in members)
    if size > _MAX_UNPACKED_BYTES:
        limit = f"at most {_MAX_UNPACKED_BYTES / 1e9:.0f} GB are read"
        raise SurfaceFileError(f"{path.name} unpacks to {size / 1e9:.1f} GB; {limit}")
    return "NPZ" if any(name.endswith(".npy") for name in names) else "other"


SUPPORTED_FORMATS = "X3P, SDF, NPY, text matrix, two-column profile, PNG, TIFF, STL, OBJ"
_EXTRA_HINT = "the files of most instruments need the extra: pip install 'asperity[formats]'"

# Signatures of formats that are mistaken for surfaces, so that the message can name them.
_SIGNATURES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))["signatures"]


def reject_unsupported(file: SurfaceFile, _options: ReadingOptions) -> None:
    """Refuse a file of a known format that holds no surface, with a remedy.

    Raises:
        SurfaceFileError: the file has such a format.
    """
    if file.head.startswith(ZIP_MAGIC) and classify_archive(file.path) == "NPZ":
        fault = "an NPZ archive that asperity did not prepare; save one array of heights as NPY"
        raise SurfaceFileError(f"{file.name} is {fault}")
    for signature, kind, advice in _SIGNATURES:
        magic = signature.encode("latin-1")
        # Text may start with the same two letters ("BMS profile ..."): require a binary byte too.
        is_binary = len(magic) > 2 or b"\x00" in file.head[:64] or magic[0] < 32
        if file.head.startswith(magic) and is_binary:
            raise _unsupported_error(file, f"a {kind}", advice)


def unrecognised_error(file: SurfaceFile) -> SurfaceFileError:
    """Return the error for a file that no reader recognises."""
    if file.head.startswith(TIFF_MAGIC):
        return _unsupported_error(file, "an instrument's TIFF file", _EXTRA_HINT)
    advice = "" if has_library() else _EXTRA_HINT
    if file.head.startswith(ZIP_MAGIC):
        tail = f"; {advice}" if advice else ""
        return SurfaceFileError(f"{file.name}: a zip archive without a main.xml is no X3P{tail}")
    return _unsupported_error(file, "a binary file", advice)


def _unsupported_error(file: SurfaceFile, kind: str, advice: str) -> SurfaceFileError:
    tail = f"; {advice}" if advice else ""
    fault = f"not a surface format that asperity reads: {SUPPORTED_FORMATS}{tail}"
    return SurfaceFileError(f"{file.name} looks like {kind}: {fault}")


def too_large_error(name: str, size: int, limit: int, what: str = "") -> SurfaceFileError:
    """Return the error for a file that is too large for the memory."""
    return SurfaceFileError(
        f"{name} has {size / 1e9:.1f} GB{what}; at most {limit / 1e9:g} GB are read:"
        " cut out a part, take every second point, or save as X3P or NPY in single precision"
    )
