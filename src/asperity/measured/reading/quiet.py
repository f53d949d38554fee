"""Calls of other libraries: silent, and a refusal of the file whatever they raise."""

from __future__ import annotations

import contextlib
import logging
import warnings
from collections.abc import Iterator

from asperity.errors import SurfaceFileError


@contextlib.contextmanager
def quiet_log(name: str) -> Iterator[None]:
    """Silence a logger for a while: what matters of a damaged file is in the error.

    Args:
        name: name of the logger.
    """
    logger = logging.getLogger(name)
    before = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        logger.setLevel(before)


@contextlib.contextmanager
def guarded(what: str, name: str) -> Iterator[None]:
    """Silence a library, and refuse the file where it raises: none names a closed list of errors.

    Args:
        what: is wrong, for the message.
        name: name of the library's logger.

    Raises:
        SurfaceFileError: for any error but those of asperity and of memory.
    """
    try:
        with warnings.catch_warnings(), quiet_log(name):
            warnings.simplefilter("ignore")
            yield
    except (SurfaceFileError, MemoryError):
        raise
    except Exception as error:  # a library of others may raise anything
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise SurfaceFileError(f"{what} ({reason})") from error
