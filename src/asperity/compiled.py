"""What a module of compiled functions says of itself, and what such functions may use.

A compiled module is plain Python whose top-level functions Numba compiles: scalars, whole
contiguous arrays and records of both in; scalars, tuples and records out; no closures, no
slices, no stars; it may use records and numbers of its
module. It declares itself in a constant ``KERNELS``; :mod:`asperity.kernels.link` puts
modules together by what they declare.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray

LISTENERS: list[Callable[[str], None]] = []
"""What is told the name of a loop before it is compiled: what is kept needs no compiling."""
EPS = 2.0**-52
"""Distance of 1 to the next number; that of ``float`` where a program is exported in it.

Compiled functions end their iterations at multiples of it: whatever else ends at rounding is in
digits of double precision, which ``float`` never reaches.
"""
ROOT_EPS = 2.0**-26
"""Its square root: so well is a minimum known from its values alone."""


@dataclass(frozen=True)
class Kernels:
    """What a compiled module provides and requires, and hints for the compiler.

    Attributes:
        provides: functions for other modules; of several modules at hand the first that provides a
            name is taken.
        requires: functions that it calls and does not define.
        loops: functions for Python.
        called: functions that are too large to be copied to every place that calls them.
        shared: functions that are as large, and compiled once for all modules that call them, each
            with what it calls: see :func:`asperity.kernels.link.link_parts`.
        merged: functions that are made one with their caller before they compile, where something
            iterates: the compiler optimises everything again at each level of a chain of calls.
        native: functions of :mod:`asperity.kernels.native` that it calls.
        in_blocks: whether its functions take the place of those of their names in loops over blocks
            of points; see :mod:`asperity.kernels.block_loops`.
        iterates: whether iterations run in it that are so long that copies of functions only
            compile more slowly.
    """

    provides: tuple[str, ...] = ()
    requires: tuple[str, ...] = ()
    loops: tuple[str, ...] = ()
    called: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    merged: tuple[str, ...] = ()
    native: tuple[str, ...] = ()
    in_blocks: bool = False
    iterates: bool = False


def local_array(shape: tuple[int, ...]) -> FloatArray:
    """Return an uninitialised float64 array of a constant shape such as ``(5, 4)``.

    Compiled it lies on the stack and lives until the function that asks for it returns: see
    :mod:`asperity.kernels.stack_memory`. Hand it down, never up.
    """
    return np.empty(shape)


def multiply_add(a: float, b: float, c: float) -> float:
    """Return a b + c; compiled it is rounded once where the processor can, in batches alone."""
    return a * b + c


def number_at(array: FloatArray, at: int) -> float:
    """Return a number of an array by its place in memory, which a program must know is in it."""
    return float(array.reshape(-1)[at])
