"""Declarations of compiled modules, and functions that compiled code may call.

A compiled module is plain Python whose top-level functions are compiled by Numba. Arguments are
scalars, whole contiguous arrays and records of both; results are scalars, tuples and records.
Closures, slices and starred arguments are not allowed; records and numbers of the module are. The
constant ``KERNELS`` declares what the module provides; :mod:`asperity.kernels.link`
joins modules by these declarations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
COMPILE_CALLBACKS: list[Callable[[str], None]] = []
"""Functions called with the name of a loop before it is compiled, and "" after; not if cached."""
EPS = 2.0**-52
"""Machine epsilon of double precision; replaced by that of ``float`` in single-precision exports.

Stopping rules of iterations in compiled functions are multiples of it.
"""
SQRT_EPS = 2.0**-26
"""Its square root: the accuracy of a minimum that is located by function values."""


EVERY_FUNCTION = ("*",)
"""Value of ``Kernels.provides`` for a module that provides all its functions except the loops."""


@dataclass(frozen=True)
class Kernels:
    """Declaration of a compiled module: what it provides, and compiler hints.

    Attributes:
        provides: functions for other modules, or ``EVERY_FUNCTION``; the first module that
            provides a name is used.
        loops: functions called from Python.
        shared: large functions with machine code of their own, which contains the functions that
            they call and which other modules call: see :func:`asperity.kernels.link.link_modules`.
        native: those of ``call_address``, ``load_acquire`` and ``store_release`` that the module
            calls; see :mod:`asperity.kernels.intrinsics`.
        for_blocks: whether its functions replace those of the same names in loops over blocks of
            points; see :mod:`asperity.kernels.block_loops`.
        iterates: whether it holds long iterations, for which inlining only slows compilation.
    """

    provides: tuple[str, ...] = ()
    loops: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    native: tuple[str, ...] = ()
    for_blocks: bool = False
    iterates: bool = False


def call_address(address: int, *arguments: object) -> int:
    """Call the C function at an address and return its ``int``; in compiled code only."""
    raise NotImplementedError("call_address works in compiled code only")


def load_acquire(array: NDArray[np.int64], index: int) -> int:
    """Return an element of an int64 array; in compiled code later reads see values as new."""
    return int(array[index])


def store_release(array: NDArray[np.int64], index: int, value: int) -> None:
    """Write an element of an int64 array; in compiled code its readers see all earlier writes."""
    array[index] = value


def local_array(shape: tuple[int, ...]) -> FloatArray:
    """Return an uninitialised float64 array of a constant shape such as ``(5, 4)``.

    In compiled code the array lies on the stack of the calling function, see
    :mod:`asperity.kernels.intrinsics`: pass it to callees, never return it.
    """
    return np.empty(shape)


def multiply_add(a: float, b: float, c: float) -> float:
    """Return a b + c; in compiled batches a fused operation where the processor has one."""
    return a * b + c


def load_unchecked(array: FloatArray, index: int) -> float:
    """Return an element by its flat index, which compiled code does not check."""
    return float(array.reshape(-1)[index])
