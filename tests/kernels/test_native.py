"""What compiled code hands to C."""

from __future__ import annotations

import ctypes
from typing import Any

import numba
import numpy as np

from asperity.kernels.intrinsics import call_address, load_acquire, store_release


def test_a_function_by_address_is_given_arrays_numbers_and_truth_values() -> None:
    """An array as the address of its data; the answer is C's, with its sign."""
    numbers = ctypes.POINTER(ctypes.c_double)

    @ctypes.CFUNCTYPE(ctypes.c_int32, numbers, ctypes.c_double, ctypes.c_int64, ctypes.c_int64)
    def answer(array: Any, number: float, whole: int, truth: int) -> int:
        array[1] = number
        return -whole if truth else whole

    @numba.njit
    def ask(address: int, array: Any, truth: bool) -> Any:
        return call_address(address, array, 2.5, 7, truth)

    address = ctypes.cast(answer, ctypes.c_void_p).value
    array = np.zeros(3)
    assert (ask(address, array, True), ask(address, array, False)) == (-7, 7)
    assert array.tolist() == [0.0, 2.5, 0.0]


def test_a_function_by_address_may_be_given_one_argument() -> None:
    @ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_double)
    def answer(number: float) -> int:
        return int(10.0 * number)

    @numba.njit
    def ask(address: int, number: float) -> Any:
        return call_address(address, number)

    assert ask(ctypes.cast(answer, ctypes.c_void_p).value, -2.5) == -25


def test_a_number_is_stored_and_loaded_at_its_place() -> None:
    @numba.njit
    def exchange(words: Any, value: int) -> Any:
        before = load_acquire(words, 1)
        store_release(words, 1, value)
        return before, load_acquire(words, 2)

    words = np.array([5, 6, 7], dtype=np.int64)
    assert exchange(words, -9) == (6, 7)
    assert words.tolist() == [5, -9, 7]
