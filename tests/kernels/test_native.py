"""Calls from compiled code to C."""

from __future__ import annotations

import ctypes
from typing import Any

import numba
import numpy as np

from asperity.kernels.intrinsics import call_address, load_acquire, store_release


def test_call_address_passes_arrays_numbers_and_booleans() -> None:
    """An array is passed as the address of its data; the signed result is returned."""
    numbers = ctypes.POINTER(ctypes.c_double)

    @ctypes.CFUNCTYPE(ctypes.c_int32, numbers, ctypes.c_double, ctypes.c_int64, ctypes.c_int64)
    def c_function(array: Any, number: float, whole: int, truth: int) -> int:
        array[1] = number
        return -whole if truth else whole

    @numba.njit
    def call(address: int, array: Any, truth: bool) -> Any:
        return call_address(address, array, 2.5, 7, truth)

    address = ctypes.cast(c_function, ctypes.c_void_p).value
    array = np.zeros(3)
    assert (call(address, array, True), call(address, array, False)) == (-7, 7)
    assert array.tolist() == [0.0, 2.5, 0.0]


def test_call_address_with_one_argument() -> None:
    @ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_double)
    def c_function(number: float) -> int:
        return int(10.0 * number)

    @numba.njit
    def call(address: int, number: float) -> Any:
        return call_address(address, number)

    assert call(ctypes.cast(c_function, ctypes.c_void_p).value, -2.5) == -25


def test_load_acquire_and_store_release_use_their_index() -> None:
    @numba.njit
    def exchange(words: Any, value: int) -> Any:
        before = load_acquire(words, 1)
        store_release(words, 1, value)
        return before, load_acquire(words, 2)

    words = np.array([5, 6, 7], dtype=np.int64)
    assert exchange(words, -9) == (6, 7)
    assert words.tolist() == [5, -9, 7]
