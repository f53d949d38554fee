"""Certificates are kept on disk by the content of what they certify, so none is made twice.

The key is a digest of the texture's kind and arguments, the law's kernel and facts, all parameters,
the search, and the source of the modules that make a certificate: whatever of these changes, it is
made anew. A file that cannot be read or written, or that says what no certificate says, only costs
time.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import astuple, fields, is_dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args

import numpy as np

from asperity.analysis.bounds.bound import Bound, Method
from asperity.analysis.gain.search import Search
from asperity.analysis.gain.sources import source_digest
from asperity.analysis.gain.theorems import theorem_of
from asperity.derive.facts import law_facts
from asperity.files import json_text, write_text
from asperity.kernels.fuse import cache_directory, fuse_sampler, kernel_source
from asperity.surface import Surface
from asperity.textures.texture import Texture

# Where the search for a number begins; it imports all that a certificate rests on.
_SEARCH = "asperity.analysis.gain.certificate"
# Small textures cost less to certify than to look up.
_LEAST_NUMBERS = 64


def kept(surface: Surface, name: str, search: Search, make: Callable[[], Bound]) -> Bound:
    """Return a certificate from disk, or make it and keep it there."""
    size = sum(np.size(argument) for argument in surface.texture.arguments)
    key = _key(surface, name, search) if size >= _LEAST_NUMBERS else None
    if key is None:
        return make()
    path = cache_directory().parent / "certificates" / f"{key}.json"
    known = _read(path)
    if known is not None:
        return known
    bound = make()
    _write(path, bound)
    return bound


def _key(surface: Surface, name: str, search: Search) -> str | None:
    """Return what a certificate depends on as a digest; ``None`` where it is not known."""
    law = surface.law
    source = source_digest(_makers(surface))
    if source is None:
        return None
    parameters = (
        surface.law_arguments[1:],
        surface.max_depth,
        tuple(surface.law_parameters.items()),
        surface.clamp,
    )
    said = repr((name, law.contact.name, parameters, astuple(search), law_facts(law)))
    parts = [said, kernel_source(law), texture_digest(surface.texture), source]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


def _makers(surface: Surface) -> frozenset[str]:
    """Return the modules that make certificates: of the search, the kind, the contact, the law."""
    kinds = [*type(surface.texture).__mro__, *type(surface.law.contact).__mro__]
    classes = {kind.__module__ for kind in kinds if kind.__module__ not in sys.stdlib_module_names}
    return frozenset({_SEARCH, *classes, *_modules_of(theorem_of(surface.law))})


def _modules_of(theorem: Any) -> Iterator[str]:
    """Return the modules of the functions that a theorem names."""
    if is_dataclass(theorem):
        theorem = {field.name: getattr(theorem, field.name) for field in fields(theorem)}
    if isinstance(theorem, Mapping):
        for part in theorem.values():
            yield from _modules_of(part)
    elif callable(theorem):
        yield theorem.__module__


@lru_cache(maxsize=32)
def texture_digest(texture: Texture) -> str:
    """Return a digest of the texture's kind, its sampler and all that the sampler is given.

    A compiled sampler is named by its content.
    """
    name = type(texture).__qualname__ + fuse_sampler(texture.sampler).__name__
    digest = hashlib.sha256(name.encode())
    for argument in texture.arguments:
        values = np.ascontiguousarray(argument)
        digest.update(f"{values.dtype}{values.shape}".encode())
        digest.update(values.tobytes())
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
