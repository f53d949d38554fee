"""End reasons of a loop, and the error that carries its last samples."""

from __future__ import annotations

from enum import Enum
from typing import ClassVar

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError

FAULT_SAMPLES = 50
"""Samples that a fault carries."""


class EndReason(Enum):
    """Why a loop ended: the end causes of the compiled loop, and two of the supervisor.

    The first four are not faults.
    """

    RUNNING = 0
    STOPPED = 1
    SWAP = 2
    FINISHED = 3
    NOT_FINITE = 4
    """A position or a force is not a finite number."""
    DEVICE = 5
    """The driver reported an error."""
    WORKSPACE = 6
    """The handle was read outside its workspace."""
    DEPTH = 7
    """The probe is deeper than the analysed depth."""
    LATE_SAMPLE = 8
    """The loop was late for longer than the limit."""
    NO_HEARTBEAT = 9
    """The supervising process sent no heartbeat."""
    UNRESPONSIVE = 10
    """The loop made no progress: the device does not answer."""
    DIED = 11
    """The process of the loop ended."""

    @property
    def is_fault(self) -> bool:
        """Whether the reason is a fault."""
        return self.value > EndReason.FINISHED.value


FAULT_DESCRIPTIONS = {
    EndReason.NOT_FINITE: "a position or a force is not a number",
    EndReason.WORKSPACE: "the handle was read outside its workspace",
    EndReason.DEPTH: "the probe is deeper than max_depth, for which the surface was analysed",
    EndReason.LATE_SAMPLE: "the loop was late for too long",
    EndReason.NO_HEARTBEAT: "the supervising program sent no heartbeat",
    EndReason.UNRESPONSIVE: "the device does not answer",
    EndReason.DIED: "the process of the loop ended",
}
"""Faults in words; errors of a driver are described by the driver."""


class DeviceFault(AsperityError):  # noqa: N818 - the field's word for it
    """A fault that ended the loop; the force was made zero.

    Attributes:
        cause: end reason.
        samples: the last rows of the loop, at most ``FAULT_SAMPLES``; see
            :data:`asperity.loop.shared_trace.COLUMNS`.
    """

    exit_code: ClassVar[int] = 3

    def __init__(self, cause: EndReason, message: str, samples: FloatArray | None = None) -> None:
        self.cause = cause
        self.samples = np.empty((0, 0)) if samples is None else samples
        super().__init__(message)
