"""The rows of a loop on disk, as they come."""

from __future__ import annotations

import os
from collections.abc import Mapping
from types import TracebackType
from typing import Any, Self

from asperity.files import plain
from asperity.recording.field import describe_field, field_files
from asperity.recording.writer import RecordingWriter
from asperity.servo.kernels.published import COLUMNS
from asperity.servo.process import ServoProcess
from asperity.servo.shared import Shared
from asperity.simulation.servo import Servo
from asperity.surface import Surface


class Recorder:
    """Records a loop: every sample, if it is asked often enough; use it in a ``with``.

    Args:
        path: of the recording.
        loop: that runs, or ran, or its rows.
        surface: what it renders.
        servo: of the loop.
        about: what the recording says of itself besides; plain data.

    Attributes:
        lost: rows that were overwritten before they were taken.

    Raises:
        ParameterError: for a path that cannot be written.
    """

    def __init__(
        self, path: str | os.PathLike[str], loop: ServoProcess | Shared, surface: Surface,
        servo: Servo, about: Mapping[str, Any],
    ) -> None:  # fmt: skip
        said = {"made_by": "run", "surface": describe_field(surface), "servo": plain(servo),
                "every": 1, **about}  # fmt: skip
        self._writer = RecordingWriter(path, COLUMNS, said, field_files(surface), "record")
        self._loop, self._next, self.lost = loop, 0, 0

    def take(self) -> None:
        """Write the rows that have come since.

        Raises:
            ParameterError: if the disk is full; what is written can be read.
        """
        rows, first = self._loop.rows(self._next)
        self.lost += first - self._next
        self._next = first + len(rows)
        self._writer.append(rows)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        self.take()
        self._writer.close()
