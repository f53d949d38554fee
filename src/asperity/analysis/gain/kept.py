"""Certificates are kept on disk by the content of what they certify, so none is made twice.

The key is a digest of the texture's kind and arguments, the law's kernel and facts, all parameters,
the search, and the source of the modules that make a certificate: whatever of these changes, it is
made anew. Where code of one's own has a part, as in a texture kind or a theorem, nothing is kept:
what it reads and imports is not known. One that was changed on disk is not believed, see
:mod:`asperity.cache`.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import astuple, fields, is_dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.gain.answers import is_shipped_law
from asperity.analysis.gain.search import Search
from asperity.analysis.gain.sources import is_own, source_digest
from asperity.analysis.gain.theorems import theorem_of
from asperity.cache import keep, recall
from asperity.files import json_text, record
from asperity.kernels.fuse import fuse_sampler, kernel_source
from asperity.surface import Surface
from asperity.textures.texture import Texture

ROOM = "certificates"
"""Their folder in the cache."""

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
    content = recall(ROOM, key)
    if content is not None:
        return _read(content)
    bound = make()
    keep(ROOM, key, json_text(record(bound)).encode())
    return bound


def _key(surface: Surface, name: str, search: Search) -> str | None:
    """Return what a certificate depends on as a digest; ``None`` where it is not known."""
    law = surface.law
    makers = _makers(surface)
    source = source_digest(makers) if all(map(is_own, makers)) else None
    if source is None:
        return None
    # Of a shipped law the stiffness is a factor; one of one's own may depend on it in any way.
    first = 1 if is_shipped_law(law) else 0
    parameters = (
        surface.law_arguments[first:],
        surface.max_depth,
        tuple(surface.law_parameters.items()),
        surface.clamp,
    )
    said = repr((name, law.contact.name, parameters, astuple(search), surface.facts))
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


def _read(content: bytes) -> Bound:
    saved = json.loads(content)
    for name in ("lower", "upper"):
        saved[name] = math.inf if saved[name] == "inf" else saved[name]
    for name in ("at", "deflection"):
        saved[name] = None if saved[name] is None else tuple(saved[name])
    return Bound(**saved)
