"""What compiled loops need beyond arithmetic: C functions by address, and memory that is shared.

An address is an ordinary number that a loop is given, so its machine code holds none: it is kept
between runs like any other, and a library that is missing is found out before anything compiles.
A compiled module that uses these names them in ``Kernels(native=...)``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]  # it has no types
from numba.core import types
from numba.extending import intrinsic
from numpy.typing import NDArray

_WORD = 8
# Numba's own tools are untyped.
_TUPLES: Any = types.StarArgTuple
_native: Any = intrinsic


def _call(_typing: Any, address: Any, *arguments: Any) -> Any:
    given = arguments[0] if len(arguments) == 1 and _is_tuple(arguments[0]) else arguments
    kinds = [_c_type(kind) for kind in given]
    if not isinstance(address, types.Integer) or None in kinds:
        return None

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        told = signature.args[1]
        parts = [builder.extract_value(values[1], index) for index in range(len(told))]
        passed = [_passed(context, builder, *pair) for pair in zip(told, parts, strict=True)]
        pointer = ir.FunctionType(ir.IntType(32), kinds).as_pointer()
        word = context.cast(builder, values[0], signature.args[0], types.int64)
        answer = builder.call(builder.inttoptr(word, pointer), passed)
        return builder.sext(answer, ir.IntType(64))

    return types.int64(address, _TUPLES.from_types(given)), generate


def _passed(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return an argument as C takes it."""
    if isinstance(kind, types.Array):
        data = context.make_array(kind)(context, builder, value).data
        return builder.bitcast(data, ir.IntType(8).as_pointer())
    if isinstance(kind, (types.Integer, types.Boolean)):
        return context.cast(builder, value, kind, types.int64)
    return value


def _is_tuple(kind: Any) -> bool:
    return isinstance(kind, types.BaseTuple)


def _c_type(kind: Any) -> Any:
    """Return how C takes an argument; ``None`` for what it cannot be given."""
    if isinstance(kind, types.Array):
        return ir.IntType(8).as_pointer()
    if kind == types.float64:
        return ir.DoubleType()
    return ir.IntType(64) if isinstance(kind, (types.Integer, types.Boolean)) else None


def _place(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Return the address of a number in an array."""
    data = context.make_array(signature.args[0])(context, builder, values[0]).data
    return builder.gep(data, [values[1]])


def _is_words(array: Any) -> bool:
    return isinstance(array, types.Array) and bool(array.dtype == types.int64)


def _load(_typing: Any, array: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.load_atomic(_place(context, builder, signature, values), "acquire", _WORD)

    return (types.int64(array, types.intp), generate) if _is_words(array) and index else None


def _store(_typing: Any, array: Any, index: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _place(context, builder, signature, values)
        builder.store_atomic(values[2], place, "release", _WORD)
        return context.get_dummy_value()

    if not (_is_words(array) and index and value):
        return None
    return types.void(array, types.intp, types.int64), generate


call_address: Callable[..., int] = _native(_call)
"""Call the C function at an address, the first argument; return its ``int``.

Numbers of 64 bits go as ``double`` or ``int64_t``, and arrays as the address of their first number.
An integer of any narrower type is read from the same register on x86-64 and on arm64; so is a
handle or a pointer.
"""
load_acquire: Callable[[NDArray[np.int64], int], int] = _native(_load)
"""Return a number of an int64 array; what is read afterwards is at least as new."""
store_release: Callable[[NDArray[np.int64], int, int], None] = _native(_store)
"""Write a number of an int64 array; whoever reads it sees all that was written before."""
