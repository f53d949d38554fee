"""What drivers share whose device another thread talks to, beside the compiled loop."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from asperity.errors import ParameterError
from asperity.servo.drivers.driver import UNTURNED, Driver, Frame
from asperity.servo.kernels import exchanged, slot
from asperity.servo.kernels.exchanged import ExchangedDevice
from asperity.servo.kernels.slot import PATIENCE, PLACES, SILENT, STALE, WORDS, Slot
from asperity.servo.loop import address, no_clock, system_clock

OPENING = 2.0
"""[s] that a device may take for each answer before the loop runs."""


def new_slot(patience: float = 0.0) -> Slot:
    """Return an empty slot.

    Args:
        patience: that the thread has with a loop that holds a force [s].
    """
    words = np.zeros(WORDS, np.int64)
    words[PATIENCE] = round(1e9 * patience)
    return Slot(words, words.view(np.float64))


@dataclass
class ExchangedDriver(Driver):
    """A driver whose device another thread talks to.

    Attributes:
        placed: where the surface lies.
        stale: greatest age of a reading that the loop still uses [s].
        patience: time that the loop may hold a force without a word [s]; then the thread takes it
            away.
    """

    placed: Frame = UNTURNED
    stale: float = 0.02
    patience: float = 0.05

    @property
    def frame(self) -> Frame:
        """Where the surface lies in the device's frame."""
        return self.placed

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return what exchanges with the thread."""
        return exchanged, slot

    def blank(self) -> ExchangedDevice:
        """Return a record of no device."""
        return ExchangedDevice(*new_slot(), 0, no_clock(), 0, -1)

    def record(self, shared: Slot, bell: int | None = None) -> ExchangedDevice:
        """Return the record of an open device.

        Args:
            shared: the slot.
            bell: file that wakes the thread; ``None`` for a thread that comes by itself.
        """
        stale = round(1e9 * self.stale)
        write = 0 if bell is None else address(ctypes.CDLL(None).write)
        return ExchangedDevice(*shared, stale, system_clock(), write, -1 if bell is None else bell)

    def explain(self, code: int) -> str:
        """Return what went wrong between loop and thread."""
        words = {
            STALE: f"the newest reading of the device is older than {1e3 * self.stale:g} ms",
            SILENT: f"the loop held a force for {1e3 * self.patience:g} ms without a word",
        }
        return words.get(code, f"error {code}")


def wait_for_a_place(shared: Slot, reason: Callable[[], str]) -> None:
    """Wait until the thread has put a first place into the slot.

    Args:
        shared: the slot.
        reason: returns what the thread found wrong, or nothing.

    Raises:
        ParameterError: if that is something, or it takes too long.
    """
    end = time.monotonic() + OPENING
    while not shared.words[PLACES]:
        if said := reason():
            raise ParameterError("driver", f"cannot use the device: {said}")
        if time.monotonic() > end:
            raise ParameterError("driver", f"has no reading of the device for {OPENING:g} s")
        time.sleep(1e-3)
