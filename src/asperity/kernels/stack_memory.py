"""Small arrays on the stack of a compiled function: no allocation, and safe in several threads."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np import arrayobj

# Numba's own tools for code generation are untyped.
_CODE: Any = cgutils
_ARRAYS: Any = arrayobj


@intrinsic(prefer_literal=True)
def local_array(_typing: Any, shape: Any) -> Any:
    """Return an uninitialised float64 array of a constant shape, such as ``local_array((5, 4))``.

    It lives until the function that asks for it returns; hand it down, never up.
    """
    lengths: list[Any] = [getattr(length, "literal_value", None) for length in shape]
    if None in lengths:
        return None
    array_type = types.Array(types.float64, len(lengths), "C")

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        layout = np.empty(lengths)
        number = context.get_value_type(types.float64)
        memory = _CODE.alloca_once(builder, number, size=layout.size)
        array = _ARRAYS.make_array(array_type)(context, builder)
        word = context.get_value_type(types.intp)
        _ARRAYS.populate_array(
            array,
            data=memory,
            shape=[word(length) for length in lengths],
            strides=[word(stride) for stride in layout.strides],
            itemsize=word(8),
            meminfo=None,
        )
        return array._getvalue()

    return array_type(shape), generate
