"""Read a surface file, whatever its format: the content decides, not the name."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asperity.errors import AsperityError, ParameterError, SurfaceFileError
from asperity.measured.reading.archive import archive_kind
from asperity.measured.reading.arrays import NPY_MAGIC, read_npy
from asperity.measured.reading.formats import has_library, read_instrument
from asperity.measured.reading.image import Pixels, surface_of_pixels
from asperity.measured.reading.length_units import metres_of
from asperity.measured.reading.mesh import mesh_kind, read_mesh
from asperity.measured.reading.png import PNG_MAGIC, read_png
from asperity.measured.reading.raw import RawSurface
from asperity.measured.reading.sdf import is_sdf, read_sdf
from asperity.measured.reading.text import read_text
from asperity.measured.reading.tiff import TIFF_MAGIC, read_tiff
from asperity.measured.reading.vendor import is_instrument_tiff
from asperity.measured.reading.x3p import ZIP_MAGIC, read_x3p

MAX_BYTES = 2 * 10**9
_MAX_TEXT = 5 * 10**8  # numbers in text take several times their size while they are read
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


@dataclass(frozen=True)
class _Options:
    """The arguments of read_surface, which only some formats can use."""

    channel: str | int | None
    unit: str | None
    integrate_normals: bool

    def metres(self) -> float | None:
        return None if self.unit is None else metres_of(self.unit)

    def check(self, name: str, kind: str, *allowed: str) -> None:
        """Refuse an argument that says nothing about this kind of file."""
        for argument, why in (
            ("channel", "has no channels to choose from"),
            ("unit", "has its own unit, or none at all"),
            ("integrate_normals", "is no image"),
        ):
            given = getattr(self, argument)
            absent = given is None or given is False  # a channel may be number 0
            if not absent and argument not in allowed:
                raise ParameterError(argument, f"must not be given: {name} ({kind}) {why}", given)


def read_surface(
    path: str | os.PathLike[str],
    *,
    channel: str | int | None = None,
    unit: str | None = None,
    integrate_normals: bool = False,
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
    options = _Options(channel, unit, integrate_normals)
    try:
        options.metres()  # an unknown unit is refused whatever the file is
        return _finite(_read(Path(path), name, options))
    except MemoryError as error:
        raise SurfaceFileError(f"{name}: not enough memory to read this surface") from error
    except OSError as error:
        raise SurfaceFileError(f"{name}: cannot be read ({_reason(error)})") from error


def _read(path: Path, name: str, options: _Options) -> RawSurface:
    _check_file(path, name)
    with path.open("rb") as stream:
        head = stream.read(4096)
    if head.startswith(ZIP_MAGIC):
        return _read_zip(path, name, options)
    if head.startswith(NPY_MAGIC):
        options.check(name, "an NPY file", "unit")
        return read_npy(path, options.metres())
    for magic, kind, advice in _FOREIGN:
        # Two letters alone may also begin a text ("BMS profile ..."): ask for a binary byte.
        if head.startswith(magic) and (
            len(magic) > 2 or b"\x00" in head[:64] or magic[0] < 32  # a control character
        ):
            raise _foreign(name, f"a {kind}", advice)
    if head.startswith((PNG_MAGIC, *TIFF_MAGIC)):
        return _read_image(path, name, options)
    if is_sdf(head):
        options.check(name, "an SDF file")
        return read_sdf(path.read_bytes(), name)
    return _read_rest(path, name, options)


def _read_zip(path: Path, name: str, options: _Options) -> RawSurface:
    kind = archive_kind(path)
    if kind == "NPZ":
        raise SurfaceFileError(
            f"{name} is an NPZ archive that asperity did not prepare;"
            " save one array of heights as NPY"
        )
    if kind == "other":
        raw = _instrument(path, name, options)
        if raw is not None:
            return raw
        if not has_library():
            raise SurfaceFileError(f"{name}: a zip archive without a main.xml is no X3P; {_EXTRA}")
    options.check(name, "an X3P file")
    return read_x3p(path)


def _read_image(path: Path, name: str, options: _Options) -> RawSurface:
    content = path.read_bytes()
    try:
        pixels = _pixels(content)
    except SurfaceFileError as error:
        raise SurfaceFileError(f"{name}: {error}") from error
    if pixels is None:
        raw = _instrument(path, name, options)
        if raw is None:
            raise _foreign(name, "an instrument's TIFF file", _EXTRA)
        return raw
    options.check(name, "an image", "integrate_normals")
    try:
        return surface_of_pixels(pixels, name, integrate_normals=options.integrate_normals)
    except SurfaceFileError as error:
        raise SurfaceFileError(f"{name}: {error}") from error


def _pixels(content: bytes) -> Pixels | None:
    """Return the picture, None where a TIFF is an instrument's."""
    if content.startswith(PNG_MAGIC):
        return read_png(content)
    return None if is_instrument_tiff(content) else read_tiff(content)


def _read_rest(path: Path, name: str, options: _Options) -> RawSurface:
    """Read what has no magic of ours: meshes, instruments' binary files, text."""
    content = path.read_bytes()
    mesh = mesh_kind(content)
    if mesh is not None:
        options.check(name, f"an {mesh} mesh", "unit")
        return read_mesh(content, mesh, name, options.metres())
    if _is_binary(content):
        del content
        raw = _instrument(path, name, options)
        if raw is None:
            raise _foreign(name, "a binary file", _advice())
        return raw
    if len(content) > _MAX_TEXT:
        raise _too_large(name, len(content), _MAX_TEXT, " of text")
    try:
        raw = read_text(content, name, options.metres())
    except AsperityError:
        # Only now: text is ours, and some readers take any text for theirs.
        other = _instrument(path, name, options, sure=True)
        if other is None:
            raise
        return other
    options.check(name, "a text file", "unit")
    return raw


def _instrument(
    path: Path, name: str, options: _Options, *, sure: bool = False
) -> RawSurface | None:
    try:
        raw = read_instrument(
            path, name, channel=options.channel, metres=options.metres(), sure=sure
        )
    except ModuleNotFoundError:
        return None
    if raw is not None:
        options.check(name, "an instrument's file", "channel", "unit")
    return raw


def _advice() -> str:
    return "" if has_library() else _EXTRA


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
        raise _too_large(name, status.st_size, MAX_BYTES)


def _too_large(name: str, size: int, limit: int, what: str = "") -> SurfaceFileError:
    return SurfaceFileError(
        f"{name} has {size / 1e9:.1f} GB{what}; at most {limit / 1e9:g} GB are read:"
        " cut out a part, take every second point, or save as X3P or NPY in single precision"
    )


def _is_binary(content: bytes) -> bool:
    """True where control characters show that this is no text."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):  # UTF-16 text has NULs
        return False
    sample = content[:65536]
    controls = sum(sample.count(c) for c in range(32) if c not in b"\t\n\v\f\r\x1a")
    return b"\x00" in content or controls > len(sample) // 100


def _foreign(name: str, kind: str, advice: str) -> SurfaceFileError:
    tail = f"; {advice}" if advice else ""
    return SurfaceFileError(
        f"{name} looks like {kind}: not a surface format that asperity reads: {FORMATS}{tail}"
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
