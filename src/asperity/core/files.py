"""Input files, atomically written output files, results as plain data, and digests.

Digests of values and of this package are the keys of computed results.
"""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import platform
import stat
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import lru_cache
from importlib.metadata import version
from io import BufferedReader, FileIO
from pathlib import Path
from typing import IO, Any, TypeVar

from asperity.core.errors import ParameterError, escape_unprintable

_MAX_DOTS = 10_000  # in a line of TOML

STANDARD_OUTPUT = "-"

# Absolute paths that were checked not to exist and are not written yet, with their arguments.
_NEW_FILES: dict[str, str] = {}

Function = TypeVar("Function", bound=Callable[..., Any])


def is_special_file(path: str | os.PathLike[str]) -> bool:
    """Return whether a path exists and is not a regular file (a pipe, a device, a folder)."""
    return Path(path).exists() and not Path(path).is_file()


def open_input(path: str | os.PathLike[str], max_bytes: int = 2**31) -> BufferedReader:
    """Open a regular file for reading; reading a pipe or a device might never end.

    Args:
        path: the file, or a link to it.
        max_bytes: greatest size [bytes].

    Raises:
        OSError: if the file cannot be read, is not a regular file, or is larger.
    """
    # The opened file is checked, not the path; O_NONBLOCK avoids waiting for a pipe.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        if status.st_size > max_bytes:
            reason = f"{status.st_size} bytes; at most {max_bytes} are read"
            raise OSError(errno.EFBIG, reason, str(path))
        return os.fdopen(descriptor, "rb")
    except BaseException:  # also for an interrupt
        os.close(descriptor)
        raise


def read_toml(name: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the content of a TOML file of at most 4 MiB.

    Args:
        name: name of the argument, for the error message.
        path: the file.

    Raises:
        ParameterError: if the file cannot be read or is not valid TOML.
    """
    import tomllib

    try:
        with open_input(path, 2**22) as stream:
            # Some editors write a byte order mark.
            text = stream.read().decode("utf-8-sig")
        # tomllib takes quadratic time in the length of a dotted key.
        if any(line.count(".") > _MAX_DOTS for line in text.splitlines()):
            raise ParameterError(name, f"file {path} has a line with more than {_MAX_DOTS} dots")
        return tomllib.loads(text)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ParameterError(name, f"file {path} cannot be read: {reason}") from None
    except RecursionError:
        raise ParameterError(name, f"file {path} is nested too deeply") from None
    except ValueError as error:  # of TOML, of the encoding, of an impossible path or number
        raise ParameterError(name, f"file {path} is not valid TOML: {error}") from None


@contextmanager
def open_atomic(path: str | os.PathLike[str], *, durable: bool = False) -> Iterator[IO[bytes]]:
    """Open a file for writing that replaces an existing file when the block ends without an error.

    The content is written to a temporary file in the same folder, which is then moved. For a
    symbolic link the target is replaced. Devices and pipes are written to directly. A file that
    appeared after :func:`check_not_existing` is kept.

    Args:
        path: the file to write.
        durable: wait until the content is on the disk, so that it survives a loss of power.

    Yields:
        The stream to write to.

    Raises:
        OSError: if the file cannot be written.
        ParameterError: if it was checked not to exist, and does.
    """
    if is_special_file(path):
        with Path(path).open("wb") as stream:
            yield stream
        return
    beside = Path(os.path.realpath(path)).with_name(f".{os.urandom(8).hex()}.tmp")
    try:
        with _open_unnamed(beside.parent) or beside.open("xb") as stream:
            yield stream
            stream.flush()
            if durable:
                os.fsync(stream.fileno())
            if stream.name != str(beside):
                _link_unnamed(stream.fileno(), beside)
        _move_file(beside, path)
    except BaseException:  # also for an interrupt
        beside.unlink(missing_ok=True)
        raise


def _move_file(source: Path, path: str | os.PathLike[str]) -> None:
    """Move a file to a path; one that was checked not to exist is not replaced."""
    key = os.path.abspath(path)
    if key not in _NEW_FILES:
        source.replace(os.path.realpath(path))
        return
    try:
        os.link(source, key)
        source.unlink()
    except OSError:  # the path exists, or the file system has no links
        check_not_existing(_NEW_FILES[key], path, force=False)
        source.rename(key)
    del _NEW_FILES[key]


def _open_unnamed(folder: Path) -> IO[bytes] | None:
    """Open a file without a name, which disappears if the process is killed.

    Returns ``None`` where the system or the file system does not support such files.
    """
    if not hasattr(os, "O_TMPFILE"):
        return None
    try:
        return os.fdopen(os.open(folder, os.O_TMPFILE | os.O_WRONLY, 0o666), "wb")
    except OSError:
        return None  # a named file is tried instead


def _link_unnamed(descriptor: int, path: Path) -> None:
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        # With dst_dir_fd Python calls linkat(), which follows the link in /proc to the open file.
        os.link(f"/proc/self/fd/{descriptor}", path.name, dst_dir_fd=folder)
    finally:
        os.close(folder)


@contextmanager
def open_output(
    name: str, path: str | os.PathLike[str], *, durable: bool = False
) -> Iterator[IO[bytes]]:
    """Open an output file with :func:`open_atomic`.

    Args:
        name: name of the argument, for the error message.
        path: the file.
        durable: see :func:`open_atomic`.

    Yields:
        The stream to write to.

    Raises:
        ParameterError: if the file cannot be written.
    """
    try:
        with open_atomic(path, durable=durable) as stream:
            yield stream
    except OSError as error:
        requirement = f"cannot be written: {error.strerror or error}"
        raise ParameterError(name, requirement, os.fspath(path)) from None


def write_bytes(name: str, path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file of this content; see :func:`open_output`."""
    with open_output(name, path) as stream:
        stream.write(content)


def append_bytes(name: str, stream: FileIO, content: bytes, *, durable: bool = False) -> None:
    """Append a content to an unbuffered file, all of it or nothing.

    Args:
        name: name of the argument, for the error message.
        stream: the file, opened in the mode "ab".
        content: the content.
        durable: wait until it is on the disk, so that it survives a loss of power.

    Raises:
        ParameterError: if it cannot be written; what was in the file before stays.
    """
    end = os.fstat(stream.fileno()).st_size
    remaining = memoryview(content)
    try:
        while remaining:  # the disk may have room for a part
            remaining = remaining[stream.write(remaining) :]
        if durable:
            os.fsync(stream.fileno())
    except OSError as error:
        stream.truncate(end)
        requirement = f"cannot be written: {error.strerror}; what was recorded stays"
        raise ParameterError(name, requirement, str(stream.name)) from None


def json_text(value: Any) -> str:
    """Return a value as JSON text that ends in a line feed; see :func:`to_plain_data`.

    Example:
        >>> print(json_text({"reach": math.inf}), end="")
        {
          "reach": "inf"
        }
    """
    return json.dumps(to_plain_data(value), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def text_digest(text: str) -> str:
    """Return the first 12 digits of the SHA-256 of a text in UTF-8.

    For :func:`json_text` it equals that of ``sha256sum`` for the file written by ``--json``.

    Example:
        >>> text_digest(json_text({"reach": 1.0}))
        '4a07eef8f6b6'
    """
    return hashlib.sha256(text.encode(errors="replace")).hexdigest()[:12]


def to_plain_data(value: Any, infinity: str | None = "inf") -> Any:
    """Return a value as JSON types: dictionaries, lists, strings, numbers, booleans and None.

    NaN becomes None, an enumeration its value, and a dataclass a dictionary of its fields; a
    method ``to_dict`` is used where there is one.

    Args:
        value: the value.
        infinity: replacement of an unbounded number, with a minus sign if it is negative; None
            where infinity is an overflow.

    Raises:
        TypeError: for a value without a plain form.

    Example:
        >>> to_plain_data((1.5, -math.inf, math.nan)), to_plain_data(math.inf, infinity=None)
        ([1.5, '-inf', None], None)
    """
    if isinstance(value, Enum):
        value = value.value
    elif hasattr(value, "tolist"):  # NumPy arrays and scalars
        value = value.tolist()
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, float):
        return _float_to_plain(value, infinity)
    if isinstance(value, Mapping):
        return {str(name): to_plain_data(item, infinity) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [to_plain_data(item, infinity) for item in value]
    if hasattr(value, "to_dict"):
        return value.to_dict()
    return attributes_to_dict(value, infinity=infinity)


def _float_to_plain(value: float, infinity: str | None) -> float | str | None:
    if math.isfinite(value):
        return value
    if infinity is None or math.isnan(value):
        return None
    return infinity if value > 0.0 else f"-{infinity}"


def attributes_to_dict(
    value: Any, *names: str, exclude: Sequence[str] = (), infinity: str | None = "inf"
) -> dict[str, Any]:
    """Return attributes of an object as plain data; see :func:`to_plain_data`.

    Args:
        value: the object.
        names: names of the attributes, in order; default: those of :func:`written_names`.
        exclude: attributes to omit.
        infinity: replacement of an unbounded number.
    """
    if not names:
        kind: type = type(value)
        if not is_dataclass(kind):
            raise TypeError(f"no plain data: {kind.__name__}")
        names = tuple([name for name in written_names(kind) if name not in exclude])
    return {name: to_plain_data(getattr(value, name), infinity) for name in names}


OMITTED = {"written": False}
"""Metadata of a field that is not part of the plain data: ``field(metadata=OMITTED)``."""


def written(function: Function) -> Function:
    """Mark a property as part of the plain data of its class.

    Example:
        >>> from dataclasses import make_dataclass
        >>> area = property(written(lambda square: square.side**2))
        >>> Square = make_dataclass("Square", ["side"], namespace={"area": area})
        >>> attributes_to_dict(Square(3.0))
        {'side': 3.0, 'area': 9.0}
    """
    vars(function)["is_written"] = True
    return function


@lru_cache(maxsize=256)
def written_names(cls: type) -> tuple[str, ...]:
    """Return the attributes that are the plain data of a dataclass.

    They are its fields except the :data:`OMITTED` ones, then the properties that are marked as
    :func:`written` and the texts (:class:`~asperity.core.display.Text`) that are, each in the order
    of definition.
    """
    names = [item.name for item in fields(cls) if item.metadata.get("written", True)]
    for base in reversed(cls.__mro__):
        for name, member in vars(base).items():
            function = getattr(member, "fget", None) or getattr(member, "func", None)
            if hasattr(function or member, "is_written"):
                names.append(name)
    return tuple(dict.fromkeys(names))


class Serializable:
    """Mixin for dataclasses that are written as plain data; see :func:`written_names`."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data in SI units; infinity is the string "inf", an unknown value None."""
        return attributes_to_dict(self)


def check_not_existing(name: str, path: str | os.PathLike[str], *, force: bool) -> None:
    """Check that a file does not exist, or may be replaced.

    If it appears before this process has written it, it is not replaced either.

    Raises:
        ParameterError: if it exists and ``force`` is false.
    """
    if not force and os.path.lexists(path):
        raise ParameterError(
            name, f"exists: {escape_unprintable(path)}; {{force}} replaces it", force=True
        )
    _NEW_FILES.pop(os.path.abspath(path), None)
    if not force:
        _NEW_FILES[os.path.abspath(path)] = name


def check_output(name: str, path: str | None, *, force: bool) -> None:
    """Check before a computation that a path can be written.

    Raises:
        ParameterError: if the file exists and ``force`` is false, the folder does not exist or is
            not writable, or the path is too long, a folder, a link to itself, or a device or a pipe
            that is not writable.
    """
    if path is None or path == STANDARD_OUTPUT:
        return
    try:
        os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        pass
    except (OSError, ValueError) as error:  # the name is too long
        reason = getattr(error, "strerror", None) or str(error)
        raise ParameterError(name, f"cannot be written: {reason}", path) from None
    if Path(path).is_dir():
        raise ParameterError(name, "must be a file, not a folder", path)
    if is_special_file(path):
        if not os.access(path, os.W_OK):
            raise ParameterError(name, "must be a file that can be written", path)
        return
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise ParameterError(name, "must be a file, not a link to itself", path)
    folder = target.parent
    if not folder.is_dir():
        raise ParameterError(name, f"must lie in a folder that exists, {folder} does not")
    if not os.access(folder, os.W_OK):
        raise ParameterError(name, f"must lie in a folder that can be written, not {folder}")
    check_not_existing(name, path, force=force)


_PACKAGE = Path(__file__).parents[1]
_SOURCE_SUFFIXES = (".py", ".toml")


def content_digest(*parts: Any) -> str:
    """Return a digest of numbers, strings, arrays and tuples of them; -0.0 differs from 0.0.

    Example:
        >>> content_digest(1.0, "a") == content_digest(1.0, "a")
        True
        >>> len({content_digest(*parts) for parts in [(1.0, 2.0), ((1.0, 2.0),), (1, 2.0), (1.0,)]})
        4
    """
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, tuple):
            text = f"tuple {content_digest(*part)}"
        elif hasattr(part, "tobytes"):  # NumPy arrays
            # Copied only if it is not contiguous.
            data = part.data if part.flags.c_contiguous else part.tobytes()
            text = f"{part.dtype} {part.shape} {hashlib.sha256(data).hexdigest()}"
        elif part is None or isinstance(part, (str, float, int)):
            text = f"{type(part).__name__} {part!r}"
        else:
            raise TypeError(f"cannot compute a content digest of {part!r}")
        digest.update(f"{len(text)} {text}".encode())
    return digest.hexdigest()


def is_shipped(cls: type) -> bool:
    """Return whether a class and its bases belong to this package or to Python."""
    packages = {base.__module__.partition(".")[0] for base in cls.__mro__}
    return packages <= {_PACKAGE.name} | sys.stdlib_module_names


@lru_cache(maxsize=1)
def package_digest() -> str:
    """Return a digest of this package, of Python, NumPy, SciPy, Numba and the processor type."""
    import numpy as np
    import scipy

    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*")):
        if path.suffix in _SOURCE_SUFFIXES:
            content = path.read_bytes()
            header = f"{path.relative_to(_PACKAGE).as_posix()} {len(content)}\n"
            digest.update(header.encode() + content)
    # Versions of Numba and LLVM come from metadata, since importing Numba is slow.
    libraries = np.__version__, scipy.__version__, version("numba"), version("llvmlite")
    machine = sys.version, platform.machine(), sys.byteorder
    digest.update(repr((libraries, machine)).encode())
    return digest.hexdigest()
