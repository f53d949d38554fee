"""What is kept between runs: compiled kernels and certificates, each checked before it is used.

One file per entry, in a room (a folder) of the cache folder: ``ASPERITY_CACHE_DIR`` if set, else
the user's cache directory. A file carries a digest of its key and its content: what is damaged,
exchanged or planted is set aside and made again. A folder that cannot be used costs time, never
the answer.
"""

from __future__ import annotations

import hashlib
import os
import stat
import warnings
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from asperity.files import whole_file

_MAGIC = b"asperity cache 1\n"
_DIGEST = 32
_LARGEST = 2**30
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
    folder = _usable(cache_folder())
    if folder is None:
        return None
    path = folder / room / _name(key)
    try:
        # Not to hang where somebody put a pipe.
        with os.fdopen(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)), "rb") as stream:
            if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
                return None
            whole = stream.read(_LARGEST)
    except OSError:
        return None
    head, content = whole[: len(_MAGIC) + _DIGEST], whole[len(_MAGIC) + _DIGEST :]
    if head == _MAGIC + _digest(key, content):
        return content
    _set_aside(path)
    return None


def keep(room: str, key: str, content: bytes) -> None:
    """Keep a content under a key, whole or not at all; what cannot be kept is made again."""
    folder = _usable(cache_folder())
    if folder is None:
        return
    try:
        (folder / room).mkdir(parents=True, exist_ok=True)
        with whole_file(folder / room / _name(key)) as stream:
            stream.write(_MAGIC + _digest(key, content) + content)
    except OSError as error:
        _say(f"the cache {folder} cannot be written ({error.strerror}): it is done again each time")


def _name(key: str) -> str:
    return hashlib.sha256(key.encode()).hexdigest()[:40]


def _digest(key: str, content: bytes) -> bytes:
    # The key is part of it: two entries that change places are as wrong as a flipped bit.
    return hashlib.sha256(hashlib.sha256(key.encode()).digest() + content).digest()


def _set_aside(path: Path) -> None:
    """Move a damaged entry out of the way, where it can be looked at."""
    with suppress(OSError):  # another process may be mending it now
        path.replace(path.with_name(path.name + _SET_ASIDE))
    _say(f"the cache {path.parent.parent} had a damaged entry: it was set aside and made again")


@lru_cache(maxsize=32)
def _say(message: str) -> None:
    """Say something once in a process."""
    warnings.warn(message, CacheWarning, stacklevel=2)


def _usable(folder: Path) -> Path | None:
    """Return the folder if what lies in it can be trusted, made if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        status = folder.stat()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        _say(f"the cache {folder} cannot be used ({reason}): it is done again each time")
        return None
    reason = _why_not(status)
    if reason:
        _say(f"the cache {folder} is not used: {reason}; set ASPERITY_CACHE_DIR to one of your own")
        return None
    return folder


def _why_not(status: os.stat_result) -> str:
    """Return why a folder's content cannot be trusted: it holds code that is run; else nothing."""
    if not stat.S_ISDIR(status.st_mode):
        return "it is no folder"
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
