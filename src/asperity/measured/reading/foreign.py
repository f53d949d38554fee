"""Refuse files that asperity does not read, and say what they are and what helps.

Say what a zip archive is before anything in it is unpacked.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

from asperity.errors import SurfaceFileError
from asperity.measured.reading.instruments import has_library
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile
from asperity.measured.reading.tiff import TIFF_MAGIC

ZIP_MAGIC = (b"PK\x03\x04", b"PK\x05\x06")  # the second begins an empty archive
_MOST = 2 * 10**9
_DAMAGE = (
    zipfile.BadZipFile,
    ValueError,
    NotImplementedError,  # a compression that zipfile does not know
    EOFError,
    KeyError,
)


def archive_kind(path: Path) -> str:
    """Return "X3P", "NPZ" or "other"; a damaged archive counts as an X3P, whose reader says so.

    Args:
        path: a file that begins as a zip archive.

    Raises:
        SurfaceFileError: an archive that would unpack to gigabytes.
    """
    try:
        with zipfile.ZipFile(path) as file:
            members = file.infolist()
    except _DAMAGE:
        return "X3P"
    names = [member.filename.replace("\\", "/").lower() for member in members]
    if any(name.rpartition("/")[2] == "main.xml" for name in names):
        return "X3P"  # whose reader checks each member against the size that main.xml asks for
    size = sum(member.file_size for member in members)
    if size > _MOST:
        raise SurfaceFileError(
            f"{path.name} unpacks to {size / 1e9:.1f} GB; at most {_MOST / 1e9:.0f} GB are read"
        )
    return "NPZ" if any(name.endswith(".npy") for name in names) else "other"


FORMATS = "X3P, SDF, NPY, text matrix, two-column profile, PNG, TIFF, STL, OBJ"
_EXTRA = "the files of most instruments need the extra: pip install 'asperity[formats]'"

_PICTURE = "save the heights as a grey PNG or TIFF, 16 bit if possible"
# First bytes of files that people take for surfaces, so that the message can name them.
_FOREIGN: tuple[tuple[bytes, str, str], ...] = (
    (b"\xff\xd8\xff", "JPEG image", _PICTURE),
    (b"GIF8", "GIF image", _PICTURE),
    (b"BM", "BMP image", _PICTURE),
    (b"%PDF", "PDF document", ""),
    (b"\x1f\x8b", "gzip archive", "unpack it first"),
    (b"BZh", "bzip2 archive", "unpack it first"),
    (b"7z\xbc\xaf", "7-Zip archive", "unpack it first"),
    (b"Rar!", "RAR archive", "unpack it first"),
    (b"<?xml", "XML document", ""),
    (b"{\\rtf", "RTF document", ""),
)


def is_foreign(file: SurfaceFile) -> bool:
    """Return whether a file is of a format that is known to be none of surfaces."""
    return _is_npz(file) or _mark(file) is not None


def refuse_foreign(file: SurfaceFile, _options: ReadingOptions) -> None:
    """Refuse a foreign file: say what it is, and what to do instead.

    Raises:
        SurfaceFileError: in any case.
    """
    if _is_npz(file):
        raise SurfaceFileError(
            f"{file.name} is an NPZ archive that asperity did not prepare;"
            " save one array of heights as NPY"
        )
    kind, advice = _mark(file) or ("foreign file", "")
    raise _foreign(file, f"a {kind}", advice)


def _is_npz(file: SurfaceFile) -> bool:
    return file.head.startswith(ZIP_MAGIC) and archive_kind(file.path) == "NPZ"


def _mark(file: SurfaceFile) -> tuple[str, str] | None:
    """Return what the first bytes say that the file is, and what helps."""
    for magic, kind, advice in _FOREIGN:
        # Two letters alone may also begin a text ("BMS profile ..."): ask for a binary byte.
        if file.head.startswith(magic) and (
            len(magic) > 2 or b"\x00" in file.head[:64] or magic[0] < 32  # a control character
        ):
            return kind, advice
    return None


def unread(file: SurfaceFile) -> SurfaceFileError:
    """Return the refusal of a file that no reader recognises."""
    if file.head.startswith(TIFF_MAGIC):
        return _foreign(file, "an instrument's TIFF file", _EXTRA)
    advice = "" if has_library() else _EXTRA
    if file.head.startswith(ZIP_MAGIC):
        tail = f"; {advice}" if advice else ""
        return SurfaceFileError(f"{file.name}: a zip archive without a main.xml is no X3P{tail}")
    return _foreign(file, "a binary file", advice)


def _foreign(file: SurfaceFile, kind: str, advice: str) -> SurfaceFileError:
    tail = f"; {advice}" if advice else ""
    return SurfaceFileError(
        f"{file.name} looks like {kind}: not a surface format that asperity reads: {FORMATS}{tail}"
    )


def too_large(name: str, size: int, limit: int, what: str = "") -> SurfaceFileError:
    """Return the refusal of a file that memory would not hold."""
    return SurfaceFileError(
        f"{name} has {size / 1e9:.1f} GB{what}; at most {limit / 1e9:g} GB are read:"
        " cut out a part, take every second point, or save as X3P or NPY in single precision"
    )
