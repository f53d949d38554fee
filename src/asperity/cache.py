"""What is kept between runs: compiled kernels and certificates, each checked before it is used.

One file per entry, in a room (a folder) of the cache folder: ``ASPERITY_CACHE_DIR`` if set, else
the user's cache directory. A file carries a digest of its key and its content: what is damaged,
exchanged or planted is set aside and made again, before anything of it is looked at. Whoever may
write in the folder may put code there, so one that others own or may write is not used. A folder
that cannot be used costs time, never the answer.
"""

from __future__ import annotations

import errno
import hashlib
import os
import stat
import warnings
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from asperity.files import open_input, whole_file

_MAGIC = b"asperity cache 1\n"
_DIGEST = 32
_HEAD = len(_MAGIC) + _DIGEST
_SET_ASIDE = ".damaged"


class CacheWarning(UserWarning):
    """Something about the cache that costs time and that the user can mend."""


def cache_folder() -> Path:
    """Return the cache folder, whether or not it exists."""
    chosen = os.environ.get("ASPERITY_CACHE_DIR")
    if chosen:
        return Path(chosen)
    from platformdirs import user_cache_path

    return user_cache_path("asperity")


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
            _say(f"the cache {cache_folder()} cannot be read ({_reason(error)}): {_AGAIN}")
        return None
    if whole[:_HEAD] == _MAGIC + _digest(key, whole[_HEAD:]):
        return whole[_HEAD:]
    set_aside(room, key)
    return None


def keep(room: str, key: str, content: bytes) -> None:
    """Keep a content under a key, whole or not at all; what cannot be kept is made again."""
    path = cache_folder() / room / _name(key)
    try:
        if _made(path.parent) and _trusted(path.parent):
            with whole_file(path) as stream:
                stream.write(_MAGIC + _digest(key, content) + content)
    except (OSError, ValueError) as error:
        _say(f"the cache {cache_folder()} cannot be written ({_reason(error)}): {_AGAIN}")


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


_AGAIN = "the work is done again each time"


def _name(key: str) -> str:
    return hashlib.sha256(key.encode()).hexdigest()[:40]


def _digest(key: str, content: bytes) -> bytes:
    # The key is part of it: two entries that change places are as wrong as a flipped bit.
    return hashlib.sha256(hashlib.sha256(key.encode()).digest() + content).digest()


def _reason(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)


@lru_cache(maxsize=32)
def _say(message: str) -> None:
    """Say something once in a process."""
    warnings.warn(message, CacheWarning, stacklevel=2)


def _trusted(folder: Path) -> bool:
    """Return whether what lies in a folder can be trusted, and say it if not.

    Raises:
        OSError: for a folder that is not there.
    """
    reason = _why_not(folder.stat())
    if reason:
        advice = "set ASPERITY_CACHE_DIR to a folder of your own"
        _say(f"the cache {folder} is not used: {reason}; {advice}")
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
