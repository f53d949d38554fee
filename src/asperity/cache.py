"""What is kept between runs: compiled kernels and certificates, each checked before it is used.

One file per entry, in a room (a folder) of the cache folder: ``ASPERITY_CACHE_DIR`` if set, else
the user's cache directory. A file carries a digest of its key and its content: what is damaged,
exchanged or planted is set aside and made again, before anything of it is looked at. Whoever may
write in the folder may put code there, so one that others own or may write is not used. A folder
that cannot be used costs time, never the answer. The folder has a limit of size,
:func:`size_limit`: what was not used for longest goes first.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import stat
import tempfile
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from asperity.errors import ParameterError
from asperity.files import open_input, whole_file

try:
    import fcntl
except ImportError:  # Windows: what two processes need at once, both make
    fcntl = None  # type: ignore[assignment]

_MAGIC = b"asperity cache 1\n"
_DIGEST = 32
_HEAD = len(_MAGIC) + _DIGEST
_SET_ASIDE = ".damaged"
# What this package has put there; whatever else lies in the folder is not counted nor deleted.
_ENTRY = re.compile(r"[0-9a-f]{40}(\.damaged)?|\.[0-9a-f]{16}\.tmp")

_DIR, _SIZE = "ASPERITY_CACHE_DIR", "ASPERITY_CACHE_SIZE"
DEFAULT_SIZE = 2 * 10**9
"""The size [bytes] that the folder may have unless ``ASPERITY_CACHE_SIZE`` says otherwise."""
_LARGEST = 8
"""One entry may have this part of the limit, so that none drives out all others."""
_KEPT_OF_FULL = 0.75
PATIENCE = 30.0
"""Time [s] for which a process waits for what another one makes, before it waits no more."""
_LOOK = 0.02  # [s] between two looks at that
_TURNS = ".turns"


class CacheWarning(UserWarning):
    """Something about the cache that costs time and that the user can mend."""


def cache_folder() -> Path:
    """Return the cache folder, whether or not it exists."""
    chosen = os.environ.get(_DIR)
    if chosen:
        return Path(chosen)
    from platformdirs import user_cache_path

    try:
        return user_cache_path("asperity")
    except RuntimeError:  # a user without a name and a home, as in a container
        return Path(tempfile.gettempdir(), f"asperity-{os.getuid()}")


def size_limit() -> int:
    """Return the size [bytes] that the folder may have: ``ASPERITY_CACHE_SIZE``, or 2 GB.

    Raises:
        ParameterError: for a value that is no size.
    """
    given = os.environ.get(_SIZE)
    if not given:
        return DEFAULT_SIZE
    match = re.fullmatch(r"\s*(\d{1,15}(?:\.\d{1,6})?)\s*(k|M|G|T)B\s*|\s*0\s*", given)
    if match is None:
        raise ParameterError(_SIZE, "must be a size such as '500MB' or '4GB'", given)
    return int(float(match[1]) * 1000.0 ** " kMGT".index(match[2])) if match[1] else 0


@contextmanager
def no_cache() -> Iterator[None]:
    """Take nothing from the cache and leave nothing: it is an empty folder, gone afterwards."""
    before = os.environ.get(_DIR)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        os.environ[_DIR] = folder
        try:
            yield
        finally:
            if before is None:
                del os.environ[_DIR]
            else:
                os.environ[_DIR] = before


@dataclass(frozen=True)
class Entry:
    """A file of the cache.

    Attributes:
        room: the name of its folder.
        path: the file.
        size: [bytes].
        used: when it was last used [ns].
    """

    room: str
    path: Path
    size: int
    used: int


def entries() -> list[Entry]:
    """Return all that is in the cache; what cannot be looked at counts as not there."""
    found = []
    with suppress(OSError):
        for room in sorted(path for path in cache_folder().iterdir() if path.is_dir()):
            with suppress(OSError):
                for path in room.iterdir():
                    if _ENTRY.fullmatch(path.name):
                        status = path.stat()
                        found.append(Entry(room.name, path, status.st_size, status.st_mtime_ns))
    return found


def clear() -> list[Entry]:
    """Delete all that is in the cache, and nothing else that lies in its folder.

    Returns:
        What is left: what could not be deleted.
    """
    _delete(entries())
    return entries()


def _delete(some: list[Entry]) -> None:
    for entry in some:
        with suppress(OSError):  # another process may have deleted it, or it may be in use
            entry.path.unlink()


def recall(room: str, key: str) -> bytes | None:
    """Return what was kept under a key, or nothing.

    Args:
        room: kind of entry, the name of a folder.
        key: everything that the content depends on.
    """
    path = cache_folder() / room / _name(key)
    try:
        if not (_trusted(path.parent.parent) and _trusted(path.parent)):
            return None
        with open_input(path) as stream:
            whole = stream.read()
    except (FileNotFoundError, NotADirectoryError):  # what is in the way is said when writing
        return None
    except (OSError, ValueError) as error:
        if isinstance(error, OSError) and error.errno == errno.EINVAL:  # a folder, a pipe
            set_aside(room, key)
        else:
            _say_of_folder(f"cannot be read ({_reason(error)}): {_AGAIN}")
        return None
    if whole[:_HEAD] == _MAGIC + _digest(key, whole[_HEAD:]):
        with suppress(OSError):  # in a folder that can only be read nothing goes
            os.utime(path)  # what was not used for longest goes first
        return whole[_HEAD:]
    set_aside(room, key)
    return None


def keep(room: str, key: str, content: bytes) -> None:
    """Keep a content under a key, whole or not at all; what cannot be kept is made again."""
    if len(content) > size_limit() // _LARGEST:
        return
    path = cache_folder() / room / _name(key)
    try:
        if _made(path.parent) and _trusted(path.parent):
            with whole_file(path) as stream:
                stream.write(_MAGIC + _digest(key, content) + content)
            _stay_small(_HEAD + len(content))
    except (OSError, ValueError) as error:
        _say_of_folder(f"cannot be written ({_reason(error)}): {_AGAIN}")


def my_turn(room: str, key: str) -> bool:
    """Wait while another process makes the content of a key; then it is this one's to make.

    Returns:
        Whether another one was waited for: it may have kept the content meanwhile.
    """
    begin = time.monotonic()
    waited = False
    while cache_folder() / room not in _hanging and not _claimed(room, key):
        if time.monotonic() > begin + PATIENCE:  # it hangs, or is suspended: work is done twice
            _hanging.add(cache_folder() / room)
            return False
        waited = True
        time.sleep(_LOOK)
    return waited


def turn_is_over(room: str, key: str) -> None:
    """Let others make the content of a key, or find it."""
    _claimed(room, key, over=True)


def _claimed(room: str, key: str, over: bool = False) -> bool:
    """Return whether no other process makes a content: it locks a byte of a file, one for each key.

    However a process ends, its locks end with it. Where nothing can be locked, all is free.
    """
    if fcntl is None or not size_limit():
        return True
    try:
        file = _turns_file(cache_folder() / room)
    except (OSError, ValueError):
        return True
    wanted = fcntl.LOCK_UN if over else fcntl.LOCK_EX | fcntl.LOCK_NB
    try:
        fcntl.lockf(file, wanted, 1, int(_name(key)[:12], 16))
    except (BlockingIOError, PermissionError):
        return False
    except OSError:  # a file system without locks
        return True
    return True


# Of one folder: its file stays open, for locks go with the first of a process's that is closed.
_turns: dict[Path, int] = {}
# Who hangs may hold several.
_hanging: set[Path] = set()


def _turns_file(folder: Path) -> int:
    if folder not in _turns:
        if not (_made(folder) and _trusted(folder)):
            raise ValueError(folder)
        file = os.open(folder / _TURNS, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        for former in _turns.values():
            os.close(former)
        _turns.clear()
        _turns[folder] = file
    return _turns[folder]


def set_aside(room: str, key: str) -> None:
    """Move a damaged entry out of the way, where it can be looked at, and say so once."""
    path = cache_folder() / room / _name(key)
    with suppress(OSError):  # another process may be mending it now
        path.replace(path.with_name(path.name + _SET_ASIDE))
    _say(f"the cache {cache_folder()} had damaged entries: they were set aside and made again")


def _made(room: Path) -> bool:
    """Return whether a room is there, made if need be in a folder that can be trusted."""
    room.parent.mkdir(mode=0o755, parents=True, exist_ok=True)
    if not _trusted(room.parent):
        return False
    if not room.exists():
        room.mkdir(exist_ok=True)
        room.chmod(stat.S_IMODE(room.parent.stat().st_mode))  # made for a group: so is the room
    return True


# Bytes that this process may write before it looks at the whole folder again.
_unseen = {"left": 0}


def _stay_small(written: int) -> None:
    """Delete what was not used for longest, once the folder is above its limit."""
    _unseen["left"] -= written
    if _unseen["left"] > 0:
        return
    limit, there = size_limit(), entries()
    size = sum(entry.size for entry in there)
    if size > limit:
        there.sort(key=lambda entry: entry.used)
        while there and size > _KEPT_OF_FULL * limit:
            oldest = there.pop(0)
            _delete([oldest])
            size -= oldest.size
    # Other processes write too: each looks again after a part of what is left.
    _unseen["left"] = (limit - size) // _LARGEST


_AGAIN = "the work is done again each time"


def _name(key: str) -> str:
    return hashlib.sha256(key.encode()).hexdigest()[:40]


def _digest(key: str, content: bytes) -> bytes:
    # The key is part of it: two entries that change places are as wrong as a flipped bit.
    return hashlib.sha256(hashlib.sha256(key.encode()).digest() + content).digest()


def _reason(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)


_told: set[str] = set()


def _say(message: str, about: str = "") -> None:
    """Say something once in a process; of several that are about the same, the first alone."""
    if (about or message) not in _told:
        _told.add(about or message)
        warnings.warn(message, CacheWarning, stacklevel=2)


def _say_of_folder(trouble: str, room: Path | None = None) -> None:
    """Say what ails the folder: what cannot be read can seldom be written either."""
    _say(f"the cache {room or cache_folder()} {trouble}", str(cache_folder()))


def _trusted(folder: Path) -> bool:
    """Return whether what lies in a folder can be trusted, and say it if not.

    Raises:
        OSError: for a folder that is not there.
    """
    reason = _why_not(folder.stat())
    if reason:
        advice = "set ASPERITY_CACHE_DIR to a folder of your own"
        _say_of_folder(f"is not used: {reason}; {advice}", folder)
    return not reason


def _why_not(status: os.stat_result) -> str:
    """Return why a folder's content cannot be trusted: it holds code that is run; else nothing."""
    if not hasattr(os, "geteuid"):
        return ""  # no owners and modes to look at
    mode, groups = status.st_mode, {os.getegid(), *os.getgroups()}
    for_group = bool(mode & stat.S_ISGID) and status.st_gid in groups
    if mode & stat.S_IWOTH:
        return "everybody may write there"
    if status.st_uid not in {os.geteuid(), 0} and not for_group:
        return "somebody else owns it"
    # With a group of one's own for each user, folders that the group may write are usual.
    if mode & stat.S_IWGRP and not for_group and status.st_gid != os.getegid():
        return "another group may write there"
    return ""
