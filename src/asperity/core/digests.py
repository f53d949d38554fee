"""Digests of values and of this package, which are the keys of computed results."""

from __future__ import annotations

import hashlib
import platform
import sys
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

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
