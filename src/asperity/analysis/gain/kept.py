"""Certificates are kept on disk by the content of what they certify, so none is made twice.

The key is a digest of the texture's arguments and kind, the law's kernel, all parameters, the
search, and the source of this package: whatever changes, the certificate is made anew. A file that
cannot be read or written, or that says what no certificate says, only costs time.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import astuple
from functools import lru_cache
from pathlib import Path
from typing import get_args

import numpy as np

from asperity.analysis.bounds.bound import Bound, Method
from asperity.analysis.gain.search import Search
from asperity.files import json_text, write_text
from asperity.kernels.fuse import cache_directory, fuse_sampler, kernel_source
from asperity.surface import Surface
from asperity.textures.texture import Texture

# Small textures cost less to certify than to look up.
_LEAST_NUMBERS = 64


def kept(surface: Surface, name: str, search: Search, make: Callable[[], Bound]) -> Bound:
    """Return a certificate from disk, or make it and keep it there."""
    size = sum(np.size(argument) for argument in surface.texture.arguments)
    if size < _LEAST_NUMBERS:
        return make()
    path = cache_directory().parent / "certificates" / f"{_key(surface, name, search)}.json"
    known = _read(path)
    if known is not None:
        return known
    bound = make()
    _write(path, bound)
    return bound


def _key(surface: Surface, name: str, search: Search) -> str:
    parameters = (
        surface.law_arguments[1:],
        surface.max_depth,
        tuple(surface.law_parameters.items()),
        surface.clamp,
    )
    said = repr((name, surface.law.contact.name, parameters, astuple(search)))
    parts = [said, kernel_source(surface.law), texture_digest(surface.texture), _source_digest()]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


@lru_cache(maxsize=32)
def texture_digest(texture: Texture) -> str:
    """Return a digest of the texture's sampler, of all that it is given, and of what is claimed.

    A compiled sampler is named by its content. A kind of one's own is no part of this package:
    what its files say counts too.
    """
    name = type(texture).__name__ + fuse_sampler(texture.sampler).__name__
    digest = hashlib.sha256(name.encode())
    for kind in type(texture).__mro__:
        file = Path(getattr(sys.modules[kind.__module__], "__file__", None) or "")
        digest.update(file.read_bytes() if file.is_file() else b"")
    for argument in texture.arguments:
        values = np.ascontiguousarray(argument)
        digest.update(f"{values.dtype}{values.shape}".encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _source_digest() -> str:
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parents[2].rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _read(path: Path) -> Bound | None:
    try:
        saved = json.loads(path.read_text(encoding="utf-8"))
        lower, upper = _number(saved["lower"]), _number(saved["upper"])
        at, held = (saved[name] for name in ("at", "deflection"))
        if not lower <= upper or saved["method"] not in get_args(Method):
            return None
        return Bound(
            lower,
            upper,
            saved["method"],
            at=None if at is None else (_number(at[0]), _number(at[1]), _number(at[2])),
            note=str(saved["note"]),
            deflection=None if held is None else (_number(held[0]), _number(held[1])),
            sliding=bool(saved["sliding"]),
        )
    except (OSError, ValueError, KeyError, TypeError, IndexError):
        return None


def _number(text: float | str) -> float:
    value = math.inf if text == "inf" else float(text)
    if math.isnan(value):
        raise ValueError("not a number")
    return value


def _write(path: Path, bound: Bound) -> None:
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, json_text(bound))
