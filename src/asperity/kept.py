"""Answers that are kept between runs by their content, so that none is worked out twice.

An answer is kept under all that it depends on: what was asked, of which numbers and heights, and
the digest of this package, of NumPy, SciPy and Numba. Only what follows from code of this package
is kept: what code of one's own does is not known, and is worked out each time. Entries are checked,
see :mod:`asperity.cache`, and hold no more than numbers, texts and arrays.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import platform
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from asperity.cache import keep, recall, set_aside

ROOM = "answers"
"""Their folder in the cache."""

Answer = TypeVar("Answer")

_ANEW: ContextVar[bool] = ContextVar("anew", default=False)
_PACKAGE = Path(__file__).parent
# What a number may follow from: code, and tables beside it.
_SOURCES = (".py", ".toml")


def kept(name: str, content: str | None, make: Callable[[], Answer]) -> Answer:
    """Return an answer from disk, or work it out and keep it there.

    Args:
        name: of what is asked.
        content: a digest of all that the answer depends on besides the package, see
            :func:`content_digest`; ``None`` where that is not known: nothing is kept then.
        make: works it out.
    """
    return kept_each(name, [content], lambda _which: iter([(0, make())]))[0]


def kept_each(
    name: str,
    contents: Sequence[str | None],
    make: Callable[[Sequence[int]], Iterator[tuple[int, Answer]]],
) -> list[Answer]:
    """Return several answers, those from disk that are there.

    Args:
        name: of what is asked; of all.
        contents: of each, see :func:`kept`.
        make: works out the others, by number, in any order; each is kept as soon as it is there.
    """
    keys = [_key(name, content) for content in contents]
    answers: dict[int, Answer] = {}
    for number, key in enumerate(keys):
        found = None if key is None else recall(ROOM, key)
        if key is None or found is None:
            continue
        try:
            answers[number] = pickle.loads(found)
        except Exception:  # whole, but not for this Python: whatever it raises, it is made again
            set_aside(ROOM, key)
    missing = [number for number in range(len(keys)) if number not in answers]
    for number, answer in make(missing) if missing else ():
        answers[number] = answer
        key = keys[number]
        if key is not None:
            keep(ROOM, key, pickle.dumps(answer, protocol=5))
    return [answers[number] for number in range(len(keys))]


def _key(name: str, content: str | None) -> str | None:
    package = None if content is None or _ANEW.get() else package_digest()
    return None if package is None else f"{name}\n{content}\n{package}"


@contextmanager
def anew() -> Iterator[None]:
    """Work every answer out, and keep none; compiled code is taken from the cache all the same."""
    token = _ANEW.set(True)
    try:
        yield
    finally:
        _ANEW.reset(token)


def content_digest(*parts: Any) -> str:
    """Return a digest of numbers, texts, arrays and tuples of them; -0.0 is not 0.0.

    Example:
        >>> content_digest(1.0, "a") == content_digest(1.0, "a")
        True
        >>> len({content_digest(*parts) for parts in [(1.0, 2.0), ((1.0, 2.0),), (1, 2.0), (1.0,)]})
        4
    """
    digest = hashlib.sha256()
    for part in parts:
        if isinstance(part, tuple):
            said = f"tuple {content_digest(*part)}"
        elif hasattr(part, "tobytes"):  # arrays of NumPy, which is not imported for this
            # Copied only where it is not contiguous; the digest is of the numbers in order.
            data = part.data if part.flags.c_contiguous else part.tobytes()
            said = f"{part.dtype} {part.shape} {hashlib.sha256(data).hexdigest()}"
        elif part is None or isinstance(part, (str, float, int)):
            said = f"{type(part).__name__} {part!r}"
        else:
            raise TypeError(f"not known by its content: {part!r}")
        digest.update(f"{len(said)} {said}".encode())
    return digest.hexdigest()


def is_shipped(kind: type) -> bool:
    """Return whether all that a class is made of belongs to this package or to Python."""
    own = {base.__module__.partition(".")[0] for base in kind.__mro__}
    return own <= {_PACKAGE.name} | sys.stdlib_module_names


@lru_cache(maxsize=1)
def package_digest() -> str | None:
    """Return a digest of this package, of Python, NumPy, SciPy, Numba and the kind of processor.

    ``None`` where the package's files are not to be found.
    """
    import numpy as np
    import scipy

    digest = hashlib.sha256()
    count = 0
    for folder, inner, names in os.walk(_PACKAGE):
        inner.sort()
        for name in sorted(names):
            if name.endswith(_SOURCES):
                path = Path(folder, name)
                content = path.read_bytes()
                said = f"{path.relative_to(_PACKAGE).as_posix()} {len(content)}\n"
                digest.update(said.encode() + content)
                count += 1
    # Numba is slow to import; what it compiles is LLVM's.
    libraries = np.__version__, scipy.__version__, version("numba"), version("llvmlite")
    machine = sys.version, platform.machine(), sys.byteorder
    digest.update(repr((libraries, machine)).encode())
    return digest.hexdigest() if count else None
