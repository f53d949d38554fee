"""Say what a zip archive is before anything in it is unpacked."""

from __future__ import annotations

import zipfile
from pathlib import Path

from asperity.errors import SurfaceFileError

ZIP_MAGIC = (b"PK\x03\x04", b"PK\x05\x06")  # the second begins an empty archive
_MOST = 2 * 10**9
_DAMAGE = (zipfile.BadZipFile, ValueError, NotImplementedError, EOFError, KeyError)


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
