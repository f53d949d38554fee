"""Why a loop ended, and the error that carries its last samples."""

from __future__ import annotations

from enum import Enum
from typing import ClassVar

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import AsperityError

KEPT = 50
"""Samples that a fault carries."""


class Cause(Enum):
    """What ended a loop; the values are those of the compiled loop, and two of the watcher's own.

    The first four are no faults.
    """

    GOING = 0
    STOPPED = 1
    SWAP = 2
    FINISHED = 3
    NUMBER = 4
    """A position or a force that is no number."""
    DEVICE = 5
    """The driver reported an error."""
    WORKSPACE = 6
    """The handle was read where no handle can be."""
    DEPTH = 7
    """The probe was deeper than what was analysed."""
    MISSES = 8
    """Too many samples in a row were late."""
    LATE = 9
    """A sample was later than the limit."""
    PARENT = 10
    """The process that watches the loop was not heard of."""
    SILENT = 11
    """The loop did not go on: the device does not answer."""
    DIED = 12
    """The process of the loop ended."""

    @property
    def is_fault(self) -> bool:
        """Whether it is one."""
        return self.value > Cause.FINISHED.value


_WORDS = {
    Cause.NUMBER: "a position or a force is not a number",
    Cause.WORKSPACE: "the handle was read outside its workspace",
    Cause.DEPTH: "the probe is deeper than max_depth, for which the surface was analysed",
    Cause.MISSES: "too many samples in a row were late",
    Cause.LATE: "a sample was too late",
    Cause.PARENT: "the program that watches the loop was not heard of",
    Cause.SILENT: "the device does not answer",
    Cause.DIED: "the process of the loop ended",
}


def words_of(cause: Cause) -> str:
    """Return what was wrong, in words; a driver's own errors it says itself."""
    return _WORDS[cause]


class DeviceFault(AsperityError):  # noqa: N818 - the field's word for it
    """The loop was ended by what it found wrong; the force was made zero.

    Attributes:
        cause: what it was.
        samples: the last rows of the loop, at most ``KEPT``; see
            :data:`asperity.servo.kernels.published.COLUMNS`.
    """

    exit_code: ClassVar[int] = 3

    def __init__(self, cause: Cause, words: str, samples: FloatArray | None = None) -> None:
        self.cause = cause
        self.samples = np.empty((0, 0)) if samples is None else samples
        super().__init__(words)
