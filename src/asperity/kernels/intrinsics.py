"""Intrinsics of compiled code: C functions by address, shared memory, and arrays on the stack.

The address of a C function is an ordinary argument of a loop, so that machine code contains no
addresses and can be cached, and a missing library is detected before anything compiles. A compiled
module declares the intrinsics for C functions and shared memory that it uses in
``Kernels(native=...)``, and imports all intrinsics from :mod:`asperity.core.compiled`, which
declares them without Numba.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]  # it has no types
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np import arrayobj
from numpy.typing import NDArray

_WORD_BYTES = 8


def _call_address(_typing: Any, address: Any, *arguments: Any) -> Any:
    passed_types: Any = arguments
    if len(arguments) == 1 and isinstance(arguments[0], types.BaseTuple):
        passed_types = arguments[0]
    kinds = [_c_type(kind) for kind in passed_types]
    if not isinstance(address, types.Integer) or None in kinds:
        return None

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        numba_types = signature.args[1]
        parts = [builder.extract_value(values[1], index) for index in range(len(numba_types))]
        pairs = zip(numba_types, parts, strict=True)
        passed = [_c_argument(context, builder, *pair) for pair in pairs]
        pointer = ir.FunctionType(ir.IntType(32), kinds).as_pointer()
        word = context.cast(builder, values[0], signature.args[0], types.int64)
        answer = builder.call(builder.inttoptr(word, pointer), passed)
        return builder.sext(answer, ir.IntType(64))

    return types.int64(address, types.StarArgTuple.from_types(passed_types)), generate


def _c_argument(context: Any, builder: Any, numba_type: Any, value: Any) -> Any:
    """Return an argument in its C representation."""
    if isinstance(numba_type, types.Array):
        data = context.make_array(numba_type)(context, builder, value).data
        return builder.bitcast(data, ir.IntType(8).as_pointer())
    if isinstance(numba_type, (types.Integer, types.Boolean)):
        return context.cast(builder, value, numba_type, types.int64)
    return value


def _c_type(numba_type: Any) -> Any:
    """Return the C type of an argument; ``None`` if there is none."""
    if isinstance(numba_type, types.Array):
        return ir.IntType(8).as_pointer()
    if numba_type == types.float64:
        return ir.DoubleType()
    if isinstance(numba_type, (types.Integer, types.Boolean)):
        return ir.IntType(64)
    return None


def _element_address(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Return the address of a number in an array."""
    data = context.make_array(signature.args[0])(context, builder, values[0]).data
    return builder.gep(data, [values[1]])


def _is_int64_array(array: Any) -> bool:
    return isinstance(array, types.Array) and bool(array.dtype == types.int64)


def _load_acquire(_typing: Any, array: Any, index: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.load_atomic(
            _element_address(context, builder, signature, values), "acquire", _WORD_BYTES
        )

    if not _is_int64_array(array) or not index:
        return None
    return types.int64(array, types.intp), generate


def _store_release(_typing: Any, array: Any, index: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _element_address(context, builder, signature, values)
        builder.store_atomic(values[2], place, "release", _WORD_BYTES)
        return context.get_dummy_value()

    if not (_is_int64_array(array) and index and value):
        return None
    return types.void(array, types.intp, types.int64), generate


call_address: Callable[..., int] = intrinsic(_call_address)
"""Call the C function at an address, the first argument; return its ``int``.

Numbers of 64 bits go as ``double`` or ``int64_t``, and arrays as the address of their first number.
An integer of any narrower type is read from the same register on x86-64 and on arm64; so is a
handle or a pointer.
"""
load_acquire: Callable[[NDArray[np.int64], int], int] = intrinsic(_load_acquire)
"""Return an element of an int64 array; later reads see values at least as new."""
store_release: Callable[[NDArray[np.int64], int, int], None] = intrinsic(_store_release)
"""Write an element of an int64 array; whoever reads it sees all earlier writes."""


_DOUBLE = ir.DoubleType()


@intrinsic  # type: ignore[untyped-decorator]  # of Numba
def multiply_add(_typing: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a b + c, rounded once where the processor has an instruction for it, else twice.

    This depends on the processor only: a point has the same bits alone and in a batch.
    """

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        pairs = zip(values, signature.args, strict=True)
        numbers = [context.cast(builder, value, kind, types.float64) for value, kind in pairs]
        kind = ir.FunctionType(_DOUBLE, [_DOUBLE] * 3)
        function = builder.module.declare_intrinsic("llvm.fmuladd", [_DOUBLE], kind)
        return builder.call(function, numbers)

    return types.float64(a, b, c), generate


@intrinsic  # type: ignore[untyped-decorator]  # of Numba
def load_unchecked(_typing: Any, array: Any, index: Any) -> Any:
    """Return an element of an array by its position in memory, without a bounds check."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.load(_element_address(context, builder, signature, values))

    return types.float64(array, index), generate


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]  # of Numba
def local_array(_typing: Any, shape: Any) -> Any:
    """Return an uninitialised float64 array of a constant shape, such as ``local_array((5, 4))``.

    It lives until the calling function returns: pass it to callees, never return it.
    """
    lengths: list[Any] = [getattr(length, "literal_value", None) for length in shape]
    if None in lengths:
        return None
    array_type = types.Array(types.float64, len(lengths), "C")

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        layout = np.empty(lengths)
        number = context.get_value_type(types.float64)
        memory = cgutils.alloca_once(builder, number, size=layout.size)
        array = arrayobj.make_array(array_type)(context, builder)
        word = context.get_value_type(types.intp)
        arrayobj.populate_array(
            array,
            data=memory,
            shape=[word(length) for length in lengths],
            strides=[word(stride) for stride in layout.strides],
            itemsize=word(8),
            meminfo=None,
        )
        return array._getvalue()

    return array_type(shape), generate
