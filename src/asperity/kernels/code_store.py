"""The machine code of compiled loops, kept between runs by way of the cache.

Numba's own cache unpickles an index and code without looking: one flipped bit is a crash at every
start, a planted file is run. Here a kept overload is one entry of :mod:`asperity.cache`, checked
before anything is unpickled, and there is no index. Of two processes that need the same code at
once one compiles it, and the other waits for that.
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable
from types import FunctionType
from typing import Any

import llvmlite  # type: ignore[import-untyped]  # it has no types
import numba
from numba.core import caching, compiler, serialize, types

from asperity.cache import cache_folder, keep, my_turn, recall, set_aside, turn_is_over
from asperity.compiled import LISTENERS

ROOM = "code"
# Numba is untyped.
_COMPILED: Any = compiler.CompileResult
_serialize: Any = serialize.dumps
_TUPLES: Any = types.BaseTuple


class CodeStore(caching._Cache):
    """The kept overloads of one function, as Numba's dispatcher asks for them.

    Args:
        function: the plain function, in a module that is named after all that is compiled with it.
    """

    def __init__(self, function: FunctionType) -> None:
        self._function = function

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
        """Return the compiled overload of a signature, or nothing: then it is compiled."""
        key = self._key(sig, target_context.codegen())
        found = self._kept(key, sig, target_context)
        if found is None and my_turn(ROOM, key):
            found = self._kept(key, sig, target_context)
            if found is not None:
                turn_is_over(ROOM, key)
        if found is None:
            for tell in LISTENERS:
                tell(self._function.__name__)
        return found

    def _kept(self, key: str, sig: Any, target_context: Any) -> Any:
        target_context.refresh()
        content = recall(ROOM, key)
        if content is None:
            return None
        try:
            found = _COMPILED._rebuild(target_context, *pickle.loads(content))
        except Exception:  # whole, but of another build of Numba: whatever it raises, compile
            set_aside(ROOM, key)
            return None
        # A record that was defined again has the same name: code for the former one is not its.
        return found if tuple(found.signature.args) == tuple(sig) else None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled overload."""
        *parts, environments = data._reduce()
        # An ingredient may be of another module, which is not there where this code is loaded; as
        # no compiled function asks for an environment, none is missed.
        own = self._function.__module__
        mine = tuple(one for one in environments if one.globals["__name__"] == own)
        key = self._key(sig, data.codegen)
        keep(ROOM, key, _serialize((*parts, mine)))
        turn_is_over(ROOM, key)

    def _key(self, sig: Any, codegen: Any) -> str:
        """Return all that the machine code depends on: source, types, processor, versions."""
        versions = (sys.version, numba.__version__, llvmlite.__version__, sys.byteorder)
        taken = (str(sig), *map(_fields, sig))
        said = (self._function.__module__, self._function.__name__, taken)
        return repr((*said, codegen.magic_tuple(), *versions))


def _fields(kind: Any) -> tuple[Any, ...]:
    """Return a record's module and the names in it, in order: code knows them by their places."""
    names = tuple(getattr(kind, "fields", ()))
    if names:
        names = (kind.instance_class.__module__, *names)
    return (*names, *map(_fields, kind.types)) if isinstance(kind, _TUPLES) else names


def keep_code(decorator: Callable[..., Any]) -> Callable[..., Any]:
    """Return a decorator of Numba whose functions keep their machine code between runs."""

    def decorate(function: FunctionType) -> Any:
        dispatcher = decorator(function)
        dispatcher._cache = CodeStore(function)
        return dispatcher

    return decorate
