"""What enters and leaves: files to read, files that are whole or not there, data for JSON."""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import secrets
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from enum import Enum
from io import BufferedReader
from pathlib import Path
from typing import IO, Any, ClassVar, overload

from asperity.errors import ParameterError

_MOST_DOTS = 10_000  # in a line of TOML


def is_device(path: str | os.PathLike[str]) -> bool:
    """Return whether there is something that is no regular file (a pipe, a device, a folder)."""
    return Path(path).exists() and not Path(path).is_file()


def open_input(path: str | os.PathLike[str], most: int = 2**31) -> BufferedReader:
    """Open a file for reading, if it is one: a pipe or a device would hang or never end.

    Args:
        path: the file, or a link to it.
        most: bytes that it may have.

    Raises:
        OSError: if it cannot be read, is no regular file, or is larger.
    """
    # What is looked at is what is read: it is opened once, and a pipe is not waited for.
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    try:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        if status.st_size > most:
            raise OSError(
                errno.EFBIG, f"{status.st_size} bytes; at most {most} are read", str(path)
            )
        return os.fdopen(descriptor, "rb")
    except BaseException:  # nothing may leave it open, an interrupt neither; all is passed on
        os.close(descriptor)
        raise


def read_toml(name: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the content of a TOML file of at most 4 MiB.

    Args:
        name: what it is, for the error.
        path: the file.

    Raises:
        ParameterError: if it cannot be read, or is no TOML.
    """
    import tomllib

    try:
        with open_input(path, 2**22) as stream:
            # Editors of some systems put a mark of the encoding in front.
            text = stream.read().decode("utf-8-sig")
        # A dotted key takes a time that grows with the square of its length.
        if any(line.count(".") > _MOST_DOTS for line in text.splitlines()):
            raise ParameterError(name, f"file {path} has a line with more than {_MOST_DOTS} dots")
        return tomllib.loads(text)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ParameterError(name, f"file {path} cannot be read: {reason}") from None
    except RecursionError:
        raise ParameterError(name, f"file {path} is nested too deeply") from None
    except ValueError as error:  # of TOML, of the encoding, of an impossible path or number
        raise ParameterError(name, f"file {path} is not valid TOML: {error}") from None


@contextmanager
def whole_file(path: str | os.PathLike[str], *, durable: bool = False) -> Iterator[IO[bytes]]:
    """Open a file for writing that replaces an existing one only when all is written.

    It is written beside its place under another name and moved there at the end, so that nobody
    ever reads half a file, and an error leaves what was there. A link stays one: the file that it
    leads to is replaced. A device or a pipe is written to, never replaced.

    Args:
        path: the file to write.
        durable: wait until the content is on the disk, so that it survives a loss of power.

    Yields:
        The stream to write to.

    Raises:
        OSError: if the file cannot be written.
    """
    if is_device(path):
        with Path(path).open("wb") as stream:
            yield stream
        return
    target = Path(os.path.realpath(path))
    beside = target.with_name(f".{secrets.token_hex(8)}.tmp")
    try:
        with _without_name(target.parent) or beside.open("xb") as stream:
            yield stream
            stream.flush()
            if durable:
                os.fsync(stream.fileno())
            if stream.name != str(beside):
                _give_name(stream.fileno(), beside)
        beside.replace(target)
    except BaseException:  # nothing may leave half a file, an interrupt neither; all is passed on
        beside.unlink(missing_ok=True)
        raise


def _without_name(folder: Path) -> IO[bytes] | None:
    """Open a file that has no name yet, so that a killed process leaves none behind.

    Nothing where the system or the file system has no such files.
    """
    if not hasattr(os, "O_TMPFILE"):
        return None
    try:
        return os.fdopen(os.open(folder, os.O_TMPFILE | os.O_WRONLY, 0o666), "wb")
    except OSError:
        return None  # the named file fails in the same way, or can be written


def _give_name(descriptor: int, path: Path) -> None:
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        # A folder makes it linkat(), which follows the link of /proc to the open file.
        os.link(f"/proc/self/fd/{descriptor}", path.name, dst_dir_fd=folder)
    finally:
        os.close(folder)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text as UTF-8; see :func:`whole_file`."""
    with whole_file(path) as stream:
        stream.write(text.encode())


def json_text(value: Any) -> str:
    """Return a value as JSON text with a line feed at its end; see :func:`plain`.

    Example:
        >>> print(json_text({"reach": math.inf}), end="")
        {
          "reach": "inf"
        }
    """
    return json.dumps(plain(value), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def digest(text: str) -> str:
    """Return the first 12 digits of the SHA-256 of a text in UTF-8.

    Of :func:`json_text` it is what ``sha256sum`` says of the file that ``--json`` writes.

    Example:
        >>> digest(json_text({"reach": 1.0}))
        '4a07eef8f6b6'
    """
    return hashlib.sha256(text.encode()).hexdigest()[:12]


@overload
def plain(value: Mapping[str, Any], infinity: str | None = "inf") -> dict[str, Any]: ...
@overload
def plain(value: Any, infinity: str | None = "inf") -> Any: ...
def plain(value: Any, infinity: str | None = "inf") -> Any:
    """Return a value as JSON has it: dictionaries, lists, texts, numbers, truth values and None.

    A number that is not known (NaN) is None. Enumerations are their values, dataclasses their
    fields by name; what has a method ``to_dict`` says itself what it is.

    Args:
        value: the value.
        infinity: what an unbounded number becomes, with a minus sign if it is negative; None where
            infinity is no answer but an overflow.

    Raises:
        TypeError: for a kind of value that has no plain form.

    Example:
        >>> plain((1.5, -math.inf, math.nan)), plain(math.inf, infinity=None)
        ([1.5, '-inf', None], None)
    """
    if isinstance(value, Enum):
        value = value.value
    elif hasattr(value, "tolist"):  # arrays and scalars of NumPy, which is not imported for this
        value = value.tolist()
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else _not_finite(value, infinity)
    if isinstance(value, Mapping):
        return {str(name): plain(item, infinity) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item, infinity) for item in value]
    return value.to_dict() if hasattr(value, "to_dict") else record(value, infinity=infinity)


def _not_finite(value: float, infinity: str | None) -> str | None:
    if infinity is None or math.isnan(value):
        return None
    return infinity if value > 0.0 else f"-{infinity}"


def record(
    value: Any, *names: str, without: Sequence[str] = (), infinity: str | None = "inf"
) -> dict[str, Any]:
    """Return attributes of an object as plain data; see :func:`plain`.

    Args:
        value: the object.
        names: of its attributes, in order; by default all fields of a dataclass.
        without: names of fields that are left out.
        infinity: what an unbounded number becomes.
    """
    if not names:
        if not is_dataclass(value):
            raise TypeError(f"no plain data: {type(value).__name__}")
        names = tuple(field.name for field in fields(value) if field.name not in without)
    return {name: plain(getattr(value, name), infinity) for name in names}


class Record:
    """A dataclass that is written as plain data: field by field, or as its class says.

    Attributes:
        written: names of the attributes that are written, in order, apart by blanks; all fields if
            there are none.
    """

    written: ClassVar[str] = ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units: infinity is the string "inf", what is not known None."""
        return record(self, *self.written.split())
