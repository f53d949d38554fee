"""The interface between the servo loop and a body: its motion over one sample, its stored energy.

The functions are declarations: the module of a body defines them, and the linker binds the calls of
the loop to it. ``plant`` is the record (NamedTuple) of that module.
"""

from typing import NamedTuple

from asperity.core.checks import FloatArray

# Why a run stops: it does not, its state diverged, or the body left its workspace.
RUNNING = 0
DIVERGED = 1
LEFT_WORKSPACE = 2


class SampleInput(NamedTuple):
    """The input of a body over one sample.

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
        in_contact: whether the probe is in contact.
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
        ledger: sums, see ``simulated_device``; changed.
        inputs: force and motion of the hand's anchor.
        plant: record of the body.

    Returns:
        ``RUNNING``, or ``LEFT_WORKSPACE`` if the body would leave it: it then stays where it was.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: object) -> float:
    """Return the stored energy [J] with the hand's anchor at a [m]."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it
