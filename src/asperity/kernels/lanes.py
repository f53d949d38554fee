"""What loops that take many points at a time need beyond plain arithmetic.

Python's own versions are in :mod:`asperity.compiled`.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]  # it has no types
from numba.core import types
from numba.extending import intrinsic

_DOUBLE = ir.DoubleType()


@intrinsic
def multiply_add(_typing: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a b + c, rounded once where the processor has an instruction for it, else twice.

    Which of both is a matter of the processor alone: a point has the same bits whether it goes
    alone or with others.
    """

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        told = zip(values, signature.args, strict=True)
        numbers = [context.cast(builder, value, kind, types.float64) for value, kind in told]
        kind = ir.FunctionType(_DOUBLE, [_DOUBLE] * 3)
        function = builder.module.declare_intrinsic("llvm.fmuladd", [_DOUBLE], kind)
        return builder.call(function, numbers)

    return types.float64(a, b, c), generate


@intrinsic
def number_at(_typing: Any, array: Any, at: Any) -> Any:
    """Return a number of an array by its place in memory; nothing is checked."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, values[0]).data
        return builder.load(builder.gep(data, [values[1]]))

    return types.float64(array, at), generate
