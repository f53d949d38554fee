"""A prepared surface, and the file that keeps it with everything that was done to it."""

from __future__ import annotations

import hashlib
import json
import os
import tokenize
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.errors import ParameterError, SurfaceFileError
from asperity.files import json_text, open_input, plain, whole_file
from asperity.measured.history import Stage, stages_of

SCHEMA = 1
"""Version of the file's layout."""

_MARK = "asperity_schema"
_ZIP_MAGIC = b"PK\x03\x04"
_MAX_POINTS = 2**27
_MAX_TEXT = 2**20
_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    KeyError,
    NotImplementedError,  # a compression that zipfile does not know
    RuntimeError,  # an encrypted member
    tokenize.TokenError,  # a damaged header of an array, from Python 3.12 on
)


@dataclass(frozen=True, eq=False)
class Prepared:
    """A surface that is ready to become a texture.

    Attributes:
        heights: [m], shape (ny, nx) or (n,), finite.
        pitch: (px, py) or (px,) [m].
        steps: what was done, in order, one sentence each with its numbers.
        filled: where heights were missing and have been interpolated, same shape; None for
            nowhere.
        periodic: whether the surface repeats after n times the pitch.
        history: the surface's parameters as read and after each step; none of a file of old.
    """

    heights: FloatArray
    pitch: tuple[float, ...]
    steps: tuple[str, ...]
    filled: NDArray[np.bool_] | None = None
    periodic: bool = False
    history: tuple[Stage, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data without the heights, SI units."""
        return {
            "schema": SCHEMA,
            "points": list(self.heights.shape[::-1]),
            "pitch": list(self.pitch),
            "periodic": self.periodic,
            "steps": list(self.steps),
            "stages": plain(self.history),
        }


def save_prepared(
    path: str | os.PathLike[str], prepared: Prepared, source: str | os.PathLike[str]
) -> None:
    """Save a prepared surface as NPZ: heights, pitch, mask, steps, and where it came from.

    The file appears whole or not at all; see :func:`asperity.files.whole_file`.

    Args:
        path: the file to write; an existing one is replaced.
        prepared: the surface.
        source: the file that it was made from; its name and the SHA-256 of its content are kept.

    Raises:
        ParameterError: if the path is the source, its folder is missing, or it cannot be written.
    """
    target = Path(path)
    check_target(target, Path(source))
    filled = np.zeros(prepared.heights.shape, bool) if prepared.filled is None else prepared.filled
    members = {
        _MARK: np.array(SCHEMA),
        "heights": prepared.heights,
        "pitch": np.array(prepared.pitch),
        "periodic": np.array(prepared.periodic),
        "filled": filled,
        "steps": np.array(prepared.steps, dtype=np.str_),
        "history": np.array(json_text(prepared.history)),
        "source": np.array(Path(source).name),
        "sha256": np.array(_sha256(Path(source))),
    }
    try:
        with whole_file(target, durable=True) as file:
            np.savez(file, **members)  # type: ignore[arg-type]  # typed as if one might be a flag
    except OSError as error:
        raise ParameterError(
            "output", f"cannot be written: {error.strerror or error}", str(path)
        ) from None


def check_target(target: Path, source: Path) -> None:
    """Refuse a path that a prepared surface cannot be written to, before any work is done.

    Raises:
        ParameterError: for a missing folder, a folder, or the source itself.
    """
    folder = target.absolute().parent
    if not folder.is_dir():
        raise ParameterError("output", f"must lie in a folder that exists, {folder} does not")
    if target.is_dir():
        raise ParameterError("output", "must be a file, not a folder", str(target))
    if target.exists() and source.exists() and target.samefile(source):
        raise ParameterError("output", "must be another file than the surface", str(target))
    if not os.access(folder, os.W_OK):
        raise ParameterError("output", f"must lie in a folder that can be written, not {folder}")


def is_prepared(path: str | os.PathLike[str]) -> bool:
    """Tell by its content whether a file is a prepared surface."""
    try:
        with open_input(path) as stream:
            if stream.read(4) != _ZIP_MAGIC:
                return False
            with zipfile.ZipFile(stream) as archive:
                return f"{_MARK}.npy" in archive.namelist()
    except (OSError, ValueError, *_DAMAGE):  # the reader of surfaces says what is wrong
        return False


def load_prepared(path: str | os.PathLike[str]) -> Prepared:
    """Read a surface that :func:`save_prepared` has written.

    Raises:
        SurfaceFileError: for a file that is damaged, or of a later version.
    """
    name = Path(path).name
    try:
        with open_input(path) as stream, zipfile.ZipFile(stream) as archive:
            return _read(archive)
    except SurfaceFileError as error:
        raise SurfaceFileError(f"{name}: {error}") from None
    except OSError as error:
        raise SurfaceFileError(f"{name}: cannot be read ({error.strerror or error})") from None
    except (ValueError, *_DAMAGE) as error:
        raise SurfaceFileError(f"{name}: damaged prepared surface ({error})") from None


def _read(archive: zipfile.ZipFile) -> Prepared:
    schema = int(_member(archive, _MARK, "iu", 0))
    if schema != SCHEMA:
        raise SurfaceFileError(
            f"prepared surface of version {schema}; this asperity reads version {SCHEMA}"
        )
    heights = _member(archive, "heights", "f")
    pitch = tuple(float(p) for p in _member(archive, "pitch", "f", 1))
    filled = _member(archive, "filled", "b")
    steps = tuple(str(step) for step in _member(archive, "steps", "U", 1))
    periodic = bool(_member(archive, "periodic", "b", 0))
    if heights.dtype != np.float64 or heights.ndim not in (1, 2) or min(heights.shape) < 4:
        raise SurfaceFileError("heights must be float64 of shape (ny, nx) or (n,), at least 4")
    if len(pitch) != heights.ndim or not all(np.isfinite(p) and p > 0 for p in pitch):
        raise SurfaceFileError(f"pitch must be {heights.ndim} positive lengths, got {pitch}")
    if filled.shape != heights.shape:
        raise SurfaceFileError(f"the mask has shape {filled.shape}, the heights {heights.shape}")
    if not np.isfinite(heights).all():
        raise SurfaceFileError("has heights that are not finite")
    mask = filled if filled.any() else None
    history: tuple[Stage, ...] = ()
    if "history.npy" in archive.namelist():  # a file of old has none
        history = stages_of(json.loads(str(_member(archive, "history", "U", 0))))
    return Prepared(np.ascontiguousarray(heights), pitch, steps, mask, periodic, history)


def _member(archive: zipfile.ZipFile, name: str, kinds: str, axes: int | None = None) -> Any:
    """Read one array whose header was checked first: a lying one cannot ask for memory."""
    info = archive.getinfo(f"{name}.npy")
    if info.compress_type != zipfile.ZIP_STORED:
        raise SurfaceFileError(f"member {name} is compressed; asperity writes it plain")
    with archive.open(info) as stream:
        shape, dtype = _header(stream)
    size = int(np.prod(shape, dtype=object)) * dtype.itemsize
    wrong_kind = dtype.kind not in kinds or (axes is not None and len(shape) != axes)
    if wrong_kind or not 0 <= info.file_size - size <= _MAX_TEXT or min(shape, default=0) < 0:
        raise SurfaceFileError(f"member {name} is damaged: {dtype} of shape {shape}")
    if size > 8 * _MAX_POINTS:
        raise SurfaceFileError(
            f"member {name} has {size} bytes; at most {8 * _MAX_POINTS} are read"
        )
    with archive.open(info) as stream:
        return np.lib.format.read_array(stream, allow_pickle=False)


def _header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    version = np.lib.format.read_magic(stream)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read is None:
        raise SurfaceFileError(f"array of NPY version {version}")
    shape, _fortran, dtype = read(stream)
    return shape, dtype


def _sha256(path: Path) -> str:
    with open_input(path) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
