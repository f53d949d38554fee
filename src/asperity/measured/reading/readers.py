"""Read a surface file of any supported format, recognised by content rather than by name.

The readers are tried in this order: those that recognise a signature; the user's in the order of
registration; last the readers of text and of instruments' files, which recognise almost anything.
Files of formats that hold no surface are refused with the name of the format and a remedy.
"""

from __future__ import annotations

import os
import tomllib
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import numpy as np

from asperity.core.errors import AsperityError, ParameterError, SurfaceFileError, nearest_names
from asperity.measured.file_arguments import READING_ARGUMENTS
from asperity.measured.lengths import is_pitch
from asperity.measured.reader import (
    ARCHIVE_ERRORS,
    ZIP_MAGIC,
    RawSurface,
    Reader,
    ReadingOptions,
    SurfaceFile,
)
from asperity.measured.reading.grids import NPY_MAGIC, is_sdf, read_npy, read_sdf
from asperity.measured.reading.image_files import PNG_MAGIC, TIFF_MAGIC, read_png, read_tiff
from asperity.measured.reading.isolation import describe_exception, read_isolated
from asperity.measured.reading.mesh import is_binary_stl, is_obj, is_text_stl, read_mesh
from asperity.measured.reading.prf import is_prf, read_prf
from asperity.measured.reading.surface_topography import LIBRARY, has_library, read_instrument
from asperity.measured.reading.text_reader import read_text
from asperity.measured.reading.x3p import read_x3p

_MAX_UNPACKED_BYTES = 2 * 10**9


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
    size = sum([member.file_size for member in members])
    if size > _MAX_UNPACKED_BYTES:
        limit = f"at most {_MAX_UNPACKED_BYTES / 1e9:.0f} GB are read"
        raise SurfaceFileError(f"{path.name} unpacks to {size / 1e9:.1f} GB; {limit}")
    if any(name.endswith(".npy") for name in names):
        return "NPZ"
    return "other"


SUPPORTED_FORMATS = "X3P, SDF, PRF, NPY, text matrix, two-column profile, PNG, TIFF, STL, OBJ"
_EXTRA_HINT = "the files of most instruments need the extra: pip install 'asperity[formats]'"

# Signatures of formats that are mistaken for surfaces, so that the message can name them.
_SIGNATURES = tomllib.loads(Path(__file__).with_name("unsupported.toml").read_text("utf-8"))[
    "signatures"
]


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
    advice = _EXTRA_HINT if not has_library() else ""
    if file.head.startswith(ZIP_MAGIC):
        fault = "a zip archive without a main.xml is no X3P"
        return SurfaceFileError(f"{file.name}: {_with_advice(fault, advice)}")
    return _unsupported_error(file, "a binary file", advice)


def _unsupported_error(file: SurfaceFile, kind: str, advice: str) -> SurfaceFileError:
    fault = f"not a surface format that asperity reads: {SUPPORTED_FORMATS}"
    return SurfaceFileError(f"{file.name} looks like {kind}: {_with_advice(fault, advice)}")


def _with_advice(fault: str, advice: str) -> str:
    return f"{fault}; {advice}" if advice else fault


def too_large_error(name: str, size: int, limit: int, what: str = "") -> SurfaceFileError:
    """Return the error for a file that is too large for the memory."""
    return SurfaceFileError(
        f"{name} has {size / 1e9:.1f} GB{what}; at most {limit / 1e9:g} GB are read:"
        " cut out a part, take every second point, or save as X3P or NPY in single precision"
    )


MAX_BYTES = 2 * 10**9
_MAX_TEXT_BYTES = 5 * 10**8  # parsing text takes several times the size of the file


def _is_x3p(file: SurfaceFile) -> bool:
    is_zip = file.head.startswith(ZIP_MAGIC)
    return is_zip and classify_archive(file.path) == "X3P"


def _read_text(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    size = file.path.stat().st_size
    if size > _MAX_TEXT_BYTES:
        raise too_large_error(file.name, size, _MAX_TEXT_BYTES, " of text")
    return read_text(file, options)


SIGNATURE_READERS = (
    Reader("an X3P file", _is_x3p, read_x3p),
    Reader("an NPY file", lambda file: file.head.startswith(NPY_MAGIC), read_npy, ("unit",)),
    Reader("a PNG image", lambda f: f.head.startswith(PNG_MAGIC), read_png, ("green",)),
    Reader(
        "a TIFF image",
        lambda file: file.head.startswith(TIFF_MAGIC),
        read_tiff,
        ("unit", "green"),
        is_isolated=True,
    ),
    Reader("a PRF profile", is_prf, read_prf),
    Reader("an SDF file", lambda file: is_sdf(file.head), read_sdf),
    Reader("a binary STL mesh", is_binary_stl, read_mesh, ("unit",)),
    Reader("a text STL mesh", is_text_stl, read_mesh, ("unit",), is_isolated=True),
    Reader("an OBJ mesh", is_obj, read_mesh, ("unit",), is_isolated=True),
)
"""Readers that recognise a signature of their format."""

FALLBACK_READERS = (
    Reader("a file of another kind", lambda _: True, reject_unsupported),
    Reader("a text file", lambda file: file.is_text, _read_text, ("unit",), certain=False),
    Reader(
        "an instrument's file",
        lambda _: has_library(),
        read_instrument,
        ("channel", "unit"),
        certain=False,
        is_isolated=True,
    ),
)
"""Readers of files without a signature, tried last."""

_EXPECTED_ERRORS = (AsperityError, OSError, MemoryError)  # errors that a reader may raise
USER_READERS: dict[str, Reader] = {}


def register(reader: Reader) -> None:
    """Register a user-defined reader; it is tried after the built-in ones with a signature.

    Args:
        reader: the reader.

    Raises:
        ParameterError: another reader has the same name.
    """
    taken = (*SIGNATURE_READERS, *USER_READERS.values(), *FALLBACK_READERS)
    if reader.name in {other.name for other in taken}:
        raise ParameterError("reader", "must have a name that no other reader has", reader.name)
    USER_READERS[reader.name] = reader


def iter_readers() -> Iterator[Reader]:
    """Yield all readers in the order in which they are tried."""
    yield from SIGNATURE_READERS
    yield from map(_guard_reader, USER_READERS.values())
    yield from FALLBACK_READERS


def external_reader_version() -> str | None:
    """Return the version of SurfaceTopography, empty if it is not installed.

    ``None`` if there are user-defined readers, whose versions are unknown.
    """
    if USER_READERS:
        return None
    if not has_library():
        return ""
    return version(LIBRARY)


def _guard_reader(reader: Reader) -> Reader:
    """Return a user-defined reader whose programming errors are refusals of the file."""

    @contextmanager
    def refuse_errors(file: SurfaceFile) -> Iterator[None]:
        try:
            yield
        except _EXPECTED_ERRORS:
            raise
        except Exception as error:  # a user's code may raise anything
            message = f"{file.name}: the reader of {reader.name} failed ({_describe_error(error)})"
            raise SurfaceFileError(message) from error

    def recognises(file: SurfaceFile) -> bool:
        with refuse_errors(file):
            return bool(reader.recognises(file))

    def read(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
        with refuse_errors(file):
            return _check_result(_run(reader, file, options))

    return replace(reader, recognises=recognises, read=read, is_isolated=False)


def _check_result(raw: RawSurface | None) -> RawSurface | None:
    """Return the result of a user-defined reader with floats, or refuse it."""
    if raw is None:
        return None
    if not isinstance(raw, RawSurface):
        raise TypeError(f"{type(raw).__name__} instead of a RawSurface")
    heights = np.ascontiguousarray(raw.heights, dtype=np.float64)
    if heights.ndim not in (1, 2) or heights.size == 0:
        raise ValueError(f"heights of shape {heights.shape}")
    if raw.pitch is None:
        return replace(raw, heights=heights)
    pitch = tuple(map(float, raw.pitch))
    if len(pitch) != heights.ndim or not is_pitch(pitch):
        raise ValueError(f"pitch {pitch} for heights of shape {heights.shape}")
    return replace(raw, heights=heights, pitch=pitch)


def _describe_error(error: Exception) -> str:
    return f"{type(error).__name__}: {describe_exception(error)}"


def read_surface(
    path: str | os.PathLike[str],
    *,
    channel: str | int | None = None,
    unit: str | None = None,
    green: str | None = None,
) -> RawSurface:
    r"""Read a measured or synthetic surface; the content of the file decides its format.

    X3P (ISO 25178-72), SDF (ISO 25178-71, text and binary), NumPy arrays (NPY), text matrices
    and two-column profiles with or without an instrument's header, PNG and TIFF images, STL and
    OBJ patches, and the files of instruments that SurfaceTopography reads where the extra
    ``asperity[formats]`` is installed.

    Args:
        path: the file.
        channel: name or number (from 0) of the height channel, for a file with several.
        unit: unit of length of a file that has none, such as "mm": required for STL and OBJ,
            optional for NPY (metres if not given)
            and for text that does not state it.
        green: direction that the green channel of a normal map encodes in the picture, "up"
            (glTF, OpenGL) or "down" (DirectX); required unless the name of the file ends like
            "normal_gl" or "NormalDX".

    Returns:
        The heights [m] of the file, and the pitch if the file has one. Heights of images have no
        unit: ``relative`` is True, and the pitch None. Those of a normal map follow from its
        slopes (:func:`asperity.measured.reading.normal_map.integrate_slopes`), in units of the
        pitch.

    Raises:
        SurfaceFileError: the file cannot be read, with the reason.
        ParameterError: an argument is missing, unknown or does not apply to this file.

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
    if green is not None:
        green = READING_ARGUMENTS[-1].validate(green)
    options = ReadingOptions(channel, unit, green)
    try:
        _ = options.metres_per_unit  # refuses an unknown unit, whatever the file is
        _check_file(Path(path), name)
        return _check_finite(_read_first(SurfaceFile.open(Path(path)), options))
    except MemoryError as error:
        raise SurfaceFileError(f"{name}: not enough memory to read this surface") from error
    except OSError as error:
        reason = error.strerror or describe_exception(error)
        raise SurfaceFileError(f"{name}: cannot be read ({reason})") from error


def _read_first(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    """Return the result of the first reader that can read the file."""
    refusal: AsperityError | None = None
    for reader in iter_readers():
        if not reader.recognises(file):
            continue
        try:
            raw = _run(reader, file, options)
        except AsperityError as error:
            refusal = error
            if reader.certain:
                break
            continue
        if raw is not None:
            reader.check_options(file, options)
            if raw.has_units or raw.relative:
                return raw
            return replace(raw, notes=("no unit in the file: taken as metres", *raw.notes))
    raise refusal or unrecognised_error(file)


def _run(reader: Reader, file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
    """Run a reader, in a subprocess if it is isolated; its refusals name the file."""
    try:
        if reader.is_isolated:
            return read_isolated(reader.read, file, options)
        return reader.read(file, options)
    except SurfaceFileError as error:
        if str(error).startswith(file.name):
            raise
        raise SurfaceFileError(f"{file.name}: {error.template}", **error.suggestions) from error


def _check_file(path: Path, name: str) -> None:
    """Refuse what is no file of a size that can be read, with a hint."""
    try:
        is_folder = path.is_dir()
        size = path.stat().st_size
    except FileNotFoundError as error:
        near = nearest_names(path.name, [other.name for other in path.parent.glob("*")])
        raise SurfaceFileError(f"{path}: no such file{near and f'; {near.strip()}'}") from error
    except ValueError as error:  # a NUL in the name
        raise SurfaceFileError(f"{str(path)!r} is not a file name") from error
    if is_folder:
        formats = SUPPORTED_FORMATS
        raise SurfaceFileError(f"{path} is a directory; a file is expected ({formats})")
    if path.is_file() and size == 0:
        raise SurfaceFileError(f"{name} is empty")
    if size > MAX_BYTES:
        raise too_large_error(name, size, MAX_BYTES)


def _check_finite(raw: RawSurface) -> RawSurface:
    infinite = np.isinf(raw.heights)
    if infinite.any():
        index = tuple(np.argwhere(infinite)[0].tolist())
        fault = f"infinite height at index {index}; a missing point is written as NaN"
        raise SurfaceFileError(f"{raw.source}: {fault}")
    return raw
