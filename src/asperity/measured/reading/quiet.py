"""Keep the log messages of other libraries away while a file is read."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator


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
