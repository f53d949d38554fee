"""What the servo loop asks of a body: how it moves over one sample, and what it stores.

These are the interface alone: each module of a body defines them, and the linker binds the calls
of the loop to the one that is simulated. ``plant`` is the record (NamedTuple) that the module
declares.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray

# What the loop says: it ran to the end, the state left all bounds, the body left its workspace.
RUNNING, DIVERGED, LEFT_WORKSPACE = 0, 1, 2
# Where it says so of several runs: in the row of each, with the samples behind it.
STOP, SAMPLES = 0, 1
# Runs that go side by side: so many numbers are worked on at a time.
LANES = 8


class SampleInput(NamedTuple):
    """What does not change over a sample.

    Attributes:
        fx: held force [N].
        fy: likewise.
        fz: likewise.
        ax: position of the hand's anchor at the beginning of the sample [m].
        ay: likewise.
        az: likewise.
        ux: velocity of the hand's anchor [m/s].
        uy: likewise.
        uz: likewise.
        in_contact: whether the servo found the probe in contact.
    """

    fx: float
    fy: float
    fz: float
    ax: float
    ay: float
    az: float
    ux: float
    uy: float
    uz: float
    in_contact: bool


def advance_body(x: FloatArray, ledger: FloatArray, inputs: SampleInput, plant: object) -> int:
    """Move the body over one sample.

    Args:
        x: state: position [m], velocity [m/s], more; changed.
        ledger: sums, see ``booking``; added to.
        inputs: what does not change over the sample.
        plant: what the body is made of.

    Returns:
        ``RAN``, or ``LEFT`` if the body would leave its workspace: it then stays where it was.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def advance_lanes(
    x: FloatArray,
    ledger: FloatArray,
    inputs: FloatArray,
    progress: NDArray[np.int64],
    plant: object,
) -> None:
    """Move the bodies of at most ``LANES`` runs over one sample, as ``advance_body`` moves each.

    Args:
        x: states, a row a run; changed.
        ledger: sums of each; added to.
        inputs: what does not change, the fields of ``Held`` of each, ``inside`` as 1 or 0.
        progress: of each what stopped it, see ``STOP``; changed. Those that have stopped stay.
        plant: what all bodies are made of.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: object) -> float:
    """Return the stored energy [J] with the hand's anchor at a [m]."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def advance_axis(
    x: FloatArray, i: int, f: float, a: float, u: float, coefficients: FloatArray
) -> tuple[float, float, float]:
    """Move along one axis; returns the displacement [m], loss and work of the hand [J]."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def final_velocity(
    x: FloatArray, i: int, f: float, a: float, u: float, coefficients: FloatArray
) -> float:
    """Velocity along one axis at the end of the part, without friction [m/s]."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it
