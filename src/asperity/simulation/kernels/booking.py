"""Energies into the ledger."""

from typing import Any

from asperity.compiled import Kernels

KERNELS = Kernels(provides=("book_energies",))


def book_energies(
    ledger: Any, wx: float, wy: float, wz: float, lost: float, hand: float, rubbed: float
) -> None:
    """Add work of the held force per axis, loss, work of the hand and of dry friction [J]."""
    ledger[0] += wx
    ledger[1] += wy
    ledger[2] += wz
    ledger[6] += lost
    ledger[7] += hand
    ledger[8] += rubbed
    ledger[10] += abs(wx) + abs(wy) + abs(wz) + abs(lost) + abs(hand) + abs(rubbed)
