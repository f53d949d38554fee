"""The machine code of compiled loops, kept between runs by way of the cache.

Numba's own cache unpickles an index and code without looking: one flipped bit is a crash at every
start, a planted file is run. Here a kept overload is one entry of :mod:`asperity.cache`, checked
before anything is unpickled, and there is no index.
"""

from __future__ import annotations

import pickle
import sys
from types import FunctionType
from typing import Any

import numba
from numba.core import caching, compiler, serialize

from asperity.cache import cache_folder, keep, recall

ROOM = "code"
# Numba is untyped.
_COMPILED: Any = compiler.CompileResult
_serialize: Any = serialize.dumps


class CodeStore(caching._Cache):
    """The kept overloads of one function, as Numba's dispatcher asks for them.

    Args:
        function: the plain function.
        source: digest of all that is compiled with it.
    """

    def __init__(self, function: FunctionType, source: str) -> None:
        self._function, self._source = function, source

    @property
    def cache_path(self) -> str:
        """The folder of the entries."""
        return str(cache_folder() / ROOM)

    def enable(self) -> None:
        """Nothing: the store is always on."""

    def disable(self) -> None:
        """Nothing: the store is always on."""

    def flush(self) -> None:
        """Nothing: entries depend on all that is compiled, none is ever stale."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled overload of a signature, or nothing."""
        target_context.refresh()
        content = recall(ROOM, self._key(sig, target_context.codegen()))
        if content is None:
            return None
        return _COMPILED._rebuild(target_context, *pickle.loads(content))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled overload."""
        keep(ROOM, self._key(sig, data.codegen), _serialize(data._reduce()))

    def _key(self, sig: Any, codegen: Any) -> str:
        """Return all that the machine code depends on: source, types, processor, versions."""
        version = ".".join(str(part) for part in sys.version_info[:3])
        parts = (self._source, self._function.__name__, str(sig), codegen.magic_tuple())
        return repr((*parts, numba.__version__, version, sys.byteorder))
