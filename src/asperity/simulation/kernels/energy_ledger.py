"""The ledger: sums of energies [J], and where each of them stands."""

from asperity.core.compiled import FloatArray, Kernels

KERNELS = Kernels(provides=("add_energies",))

# Work of the held force, per axis; the paper's same-sample sum, per axis; loss; work of the hand;
# work of dry friction; what sampling adds; all without their signs.
SUPPLIED = 0
SAME_SAMPLE = 3
LOST = 6
HAND = 7
FRICTION = 8
SAMPLING = 9
EXCHANGED = 10
LEDGER_SIZE = 11


def add_energies(
    ledger: FloatArray, wx: float, wy: float, wz: float, lost: float, hand: float, rubbed: float
) -> None:
    """Add work of the held force per axis, loss, work of the hand and of dry friction [J]."""
    ledger[SUPPLIED] += wx
    ledger[SUPPLIED + 1] += wy
    ledger[SUPPLIED + 2] += wz
    ledger[LOST] += lost
    ledger[HAND] += hand
    ledger[FRICTION] += rubbed
    ledger[EXCHANGED] += abs(wx) + abs(wy) + abs(wz) + abs(lost) + abs(hand) + abs(rubbed)
