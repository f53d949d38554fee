"""Cache on disk for compiled code and computed results.

Each entry is a file in a namespace (a folder) of the cache folder: ``ASPERITY_CACHE_DIR`` if set,
else the user's cache directory. A file starts with a digest of its key and content; a damaged or
exchanged file is moved aside before its content is used. Since entries hold machine code, no format
could make foreign ones harmless: a folder or a file that another user owns or may write, other than
root, is not used. A cache that cannot be used costs time only. The total size is limited, see
:func:`size_limit`; the least recently used entries are deleted first.

A result is stored under the digest of all that it depends on, which includes this package and its
numerical libraries. Results of user-defined code are not stored, since their dependencies are
unknown.
"""

from __future__ import annotations

import errno
import hashlib
import os
import pickle
import re
import stat
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from asperity.core.files import open_atomic, open_input, package_digest
from asperity.core.units import parse_size

if TYPE_CHECKING:
    from filelock import FileLock

_MAGIC = b"asperity cache 1\n"
_HEADER_SIZE = len(_MAGIC) + 32
_QUARANTINE_SUFFIX = ".damaged"
_LOCK_SUFFIX = ".lock"
# Files of this package; others in the folder are neither counted nor deleted.
_ENTRY_NAME = re.compile(r"[0-9a-f]{40}(\.damaged|\.lock)?|\.[0-9a-f]{16}\.tmp")

_FOLDER_VARIABLE = "ASPERITY_CACHE_DIR"
_SIZE_VARIABLE = "ASPERITY_CACHE_SIZE"
DEFAULT_SIZE_LIMIT = 2 * 10**9
"""Size limit of the cache [bytes] unless ``ASPERITY_CACHE_SIZE`` is set."""
_ENTRIES_PER_LIMIT = 8
"""The largest entry takes this part of the limit, so that it cannot evict all others."""
_FRACTION_AFTER_EVICTION = 0.75
LOCK_TIMEOUT = 30.0
"""Time [s] to wait for an entry that another process computes."""
_CONSEQUENCE = "results are computed again each time"


class CacheWarning(UserWarning):
    """A problem of the cache that costs time and that the user can solve."""


def cache_folder() -> Path:
    """Return the cache folder, whether or not it exists."""
    folder = os.environ.get(_FOLDER_VARIABLE)
    if folder:
        return Path(folder)
    from platformdirs import user_cache_path

    try:
        return user_cache_path("asperity")
    except RuntimeError:  # a user without a name and a home, as in a container
        return Path(tempfile.gettempdir(), f"asperity-{os.getuid()}")


def size_limit() -> int:
    """Return the size limit of the cache [bytes]: ``ASPERITY_CACHE_SIZE``, or 2 GB.

    Raises:
        ParameterError: for a value that is not a size.
    """
    value = os.environ.get(_SIZE_VARIABLE)
    if not value:
        return DEFAULT_SIZE_LIMIT
    return parse_size(_SIZE_VARIABLE, value)


@contextmanager
def bypass() -> Iterator[None]:
    """Use an empty temporary folder in place of the cache."""
    previous = os.environ.get(_FOLDER_VARIABLE)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        os.environ[_FOLDER_VARIABLE] = folder
        try:
            yield
        finally:
            if previous is None:
                del os.environ[_FOLDER_VARIABLE]
            else:
                os.environ[_FOLDER_VARIABLE] = previous


# --- entries --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class CacheEntry:
    """A file of the cache.

    Attributes:
        namespace: name of its folder.
        path: the file.
        size: size [bytes].
        last_used: time of its last use [ns].
    """

    namespace: str
    path: Path
    size: int
    last_used: int


def list_entries() -> list[CacheEntry]:
    """Return the entries of the cache that can be read."""
    entries = []
    paths = list[Path]()
    for folder in cache_folder().glob("*"):
        with suppress(OSError):  # no folder, or another process has deleted it
            paths += folder.iterdir()
    for path in paths:
        if _ENTRY_NAME.fullmatch(path.name):
            with suppress(OSError):  # another process may have deleted it
                status = path.stat()
                namespace = path.parent.name
                entries.append(CacheEntry(namespace, path, status.st_size, status.st_mtime_ns))
    return entries


def clear() -> list[CacheEntry]:
    """Delete all entries and return those that could not be deleted."""
    _delete(list_entries())
    return list_entries()


def _delete(entries: list[CacheEntry]) -> None:
    for entry in entries:
        with suppress(OSError):  # another process may have deleted it, or may be using it
            entry.path.unlink()


def get_entry(namespace: str, key: str) -> bytes | None:
    """Return the content of an entry, or ``None``.

    Args:
        namespace: kind of entry, the name of a folder.
        key: text of all that the content depends on.
    """
    path = _entry_path(namespace, key)
    try:
        if not (_is_trusted(path.parent.parent) and _is_trusted(path.parent)):
            return None
        with open_input(path) as stream:
            data = stream.read()
            if reason := _distrust_reason(os.fstat(stream.fileno())):
                _warn_about_folder(f"has an entry that is not used: {reason}")
                return None
    except (FileNotFoundError, NotADirectoryError):  # reported when an entry is written
        return None
    except (OSError, ValueError) as error:
        if isinstance(error, OSError) and error.errno == errno.EINVAL:  # a folder, a pipe
            quarantine(namespace, key)
        else:
            _warn_about_folder(f"cannot be read ({_error_text(error)}): {_CONSEQUENCE}")
        return None
    content = entry_content(key, data)
    if content is None:
        quarantine(namespace, key)
        return None
    with suppress(OSError):  # the folder may be read-only
        os.utime(path)  # entries are evicted in the order of their last use
    return content


def entry_content(key: str, data: bytes) -> bytes | None:
    """Return the content of the file of an entry; ``None`` if it is damaged or of another key."""
    content = data[_HEADER_SIZE:]
    if data[:_HEADER_SIZE] == _MAGIC + _entry_digest(key, content):
        return content
    return None


def put_entry(namespace: str, key: str, content: bytes) -> None:
    """Store an entry; without a usable cache nothing is stored."""
    if len(content) > size_limit() // _ENTRIES_PER_LIMIT:
        return
    path = _entry_path(namespace, key)
    try:
        if _ensure_folder(path.parent):
            with open_atomic(path) as stream:
                if hasattr(os, "fchmod"):
                    os.fchmod(stream.fileno(), 0o644)  # whatever the umask
                stream.write(_MAGIC + _entry_digest(key, content) + content)
            _evict(_HEADER_SIZE + len(content))
    except (OSError, ValueError) as error:
        _warn_about_folder(f"cannot be written ({_error_text(error)}): {_CONSEQUENCE}")


def quarantine(namespace: str, key: str) -> None:
    """Move a damaged entry aside and warn once."""
    path = _entry_path(namespace, key)
    with suppress(OSError):  # another process may be replacing it
        path.replace(path.with_name(path.name + _QUARANTINE_SUFFIX))
    warn_once(f"the cache {cache_folder()} had damaged entries: they were moved aside")


# Bytes that this process may write before it measures the whole folder again.
_unchecked_bytes = {"left": 0}


def _evict(written: int) -> None:
    """Delete the least recently used entries if the folder is above its limit."""
    _unchecked_bytes["left"] -= written
    if _unchecked_bytes["left"] > 0:
        return
    limit = size_limit()
    entries = list_entries()
    size = sum(entry.size for entry in entries)
    if size > limit:
        for oldest in sorted(entries, key=lambda entry: entry.last_used):
            _delete([oldest])
            size -= oldest.size
            if size <= _FRACTION_AFTER_EVICTION * limit:
                break
    # Other processes write too, so the folder is measured again after a part of the rest.
    _unchecked_bytes["left"] = (limit - size) // _ENTRIES_PER_LIMIT


def _entry_path(namespace: str, key: str) -> Path:
    return cache_folder() / namespace / entry_name(key)


def entry_name(key: str) -> str:
    """Return the name of the file of an entry."""
    return hashlib.sha256(key.encode()).hexdigest()[:40]


def _entry_digest(key: str, content: bytes) -> bytes:
    # The digest includes the key, so that exchanged entries are detected.
    return hashlib.sha256(hashlib.sha256(key.encode()).digest() + content).digest()


# --- locks ----------------------------------------------------------------------------------------

_locks: dict[Path, FileLock] = {}
# Folders in which a wait ended by a timeout: the process that holds the lock may hold others.
_unresponsive: set[Path] = set()


def wait_and_lock(namespace: str, key: str) -> bool:
    """Lock an entry before its content is computed; wait while another process computes it.

    The lock is released by :func:`unlock` or when the process ends. Without a usable cache, and
    after a timeout, nothing is locked.

    Returns:
        Whether another process was waited for: it may have stored the content.
    """
    path = _entry_path(namespace, key).with_suffix(_LOCK_SUFFIX)
    if path in _locks or path.parent in _unresponsive or not size_limit():
        return False
    from filelock import FileLock  # 80 modules, for a result that is not in the cache

    lock = FileLock(path, thread_local=False)
    try:
        if not _ensure_folder(path.parent):
            return False
        waited = not _acquire(lock, 0.0) and _acquire(lock, LOCK_TIMEOUT)
    except (OSError, ValueError, NotImplementedError):  # a file system without locks
        return False
    if lock.is_locked:
        _locks[path] = lock
    else:
        _unresponsive.add(path.parent)
    return waited


def _acquire(lock: FileLock, timeout: float) -> bool:
    with suppress(TimeoutError):
        lock.acquire(timeout=timeout, poll_interval=0.02)
    return lock.is_locked


def unlock(namespace: str, key: str) -> None:
    """Release the lock of an entry."""
    path = _entry_path(namespace, key).with_suffix(_LOCK_SUFFIX)
    if path in _locks:
        with suppress(OSError):  # Windows does not delete an open file
            path.unlink()
        _locks.pop(path).release()


# --- trusted folders and warnings -----------------------------------------------------------------


def _ensure_folder(folder: Path) -> bool:
    """Create the folder of a namespace, and return whether it is trusted."""
    folder.parent.mkdir(mode=0o755, parents=True, exist_ok=True)
    if not _is_trusted(folder.parent):
        return False
    if not folder.exists():
        folder.mkdir(mode=stat.S_IMODE(folder.parent.stat().st_mode), exist_ok=True)
    return _is_trusted(folder)


def _is_trusted(folder: Path) -> bool:
    """Return whether the content of a folder can be trusted, and warn if not.

    Raises:
        OSError: for a folder that does not exist.
    """
    if reason := _distrust_reason(folder.stat()):
        advice = "set ASPERITY_CACHE_DIR to a folder of your own"
        _warn_about_folder(f"is not used: {reason}; {advice}", folder)
    return not reason


def _distrust_reason(status: os.stat_result) -> str:
    """Return why a folder or a file cannot be trusted; empty if it can."""
    if not hasattr(os, "geteuid"):
        return ""  # a system without owners and modes
    if status.st_uid not in {os.geteuid(), 0}:
        return "somebody else owns it"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return "others may write there"
    return ""


_warned: set[str] = set()


def warn_once(message: str, topic: str = "") -> None:
    """Warn once per process and topic; default topic: the message."""
    if (topic or message) not in _warned:
        _warned.add(topic or message)
        warnings.warn(message, CacheWarning, stacklevel=2)


def _warn_about_folder(problem: str, folder: Path | None = None) -> None:
    # One warning per folder: what cannot be read can seldom be written.
    warn_once(f"the cache {folder or cache_folder()} {problem}", str(cache_folder()))


def _error_text(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)


# --- results --------------------------------------------------------------------------------------

RESULTS_NAMESPACE = "results"
"""Folder of computed results in the cache."""

Value = TypeVar("Value")

_BYPASS_RESULTS: ContextVar[bool] = ContextVar("bypass_results", default=False)


def get_or_compute(name: str, content: str | None, compute: Callable[[], Value]) -> Value:
    """Return a result from the cache, or compute and store it.

    Args:
        name: name of the result.
        content: :func:`~asperity.core.files.content_digest` of all that the result depends on
            besides the package; ``None`` if it is unknown: then nothing is stored.
        compute: computes the result.
    """
    return get_or_compute_each(name, [content], lambda _indices: iter([(0, compute())]))[0]


def get_or_compute_each(
    name: str,
    contents: Sequence[str | None],
    compute: Callable[[Sequence[int]], Iterator[tuple[int, Value]]],
) -> list[Value]:
    """Return several results of one name, from the cache where they are stored.

    Args:
        name: name of the results.
        contents: digest for each result, see :func:`get_or_compute`.
        compute: yields index and value of the missing results, in any order, which are stored.
    """
    keys = [_result_key(name, content) for content in contents]
    results: dict[int, Value] = {}
    for index, key in enumerate(keys):
        entry = None if key is None else get_entry(RESULTS_NAMESPACE, key)
        if key is None or entry is None:
            continue
        try:
            results[index] = pickle.loads(entry)
        except Exception:  # undamaged, but written by an incompatible Python
            quarantine(RESULTS_NAMESPACE, key)
    missing = [index for index in range(len(keys)) if index not in results]
    for index, value in compute(missing) if missing else ():
        results[index] = value
        if (key := keys[index]) is not None:
            put_entry(RESULTS_NAMESPACE, key, pickle.dumps(value, protocol=5))
    return [results[index] for index in range(len(keys))]


def _result_key(name: str, content: str | None) -> str | None:
    if content is None or _BYPASS_RESULTS.get():
        return None
    return f"{name}\n{content}\n{package_digest()}"


@contextmanager
def bypass_results() -> Iterator[None]:
    """Compute all results without the cache; compiled code is still taken from it."""
    token = _BYPASS_RESULTS.set(True)
    try:
        yield
    finally:
        _BYPASS_RESULTS.reset(token)
