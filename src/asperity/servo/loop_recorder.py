"""Recording of the rows of a loop."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Self

from asperity.core.files import to_plain_data
from asperity.loop.shared_trace import COLUMNS
from asperity.recording.recorded_field import field_attachments, field_metadata
from asperity.recording.writer import RecordingWriter
from asperity.servo.loop_memory import LoopMemory
from asperity.servo.process import ServoProcess
from asperity.simulation.servo import Servo
from asperity.surface import Surface


class LoopRecorder:
    """Records every sample of a loop, if called often enough; use it in a ``with``.

    Args:
        path: path of the recording.
        loop: the loop, or its memory.
        surface: the surface that it renders.
        servo: servo of the loop.
        metadata: further metadata of the recording; plain data.

    Attributes:
        lost_rows: rows that were overwritten before they were read.

    Raises:
        ParameterError: for a path that cannot be written.
    """

    def __init__(
        self, path: str | os.PathLike[str], loop: ServoProcess | LoopMemory, surface: Surface,
        servo: Servo, metadata: Mapping[str, Any],
    ) -> None:  # fmt: skip
        about: dict[str, Any] = {"made_by": "run", "surface": field_metadata(surface)}
        about |= {"servo": to_plain_data(servo), "every": 1, **metadata}
        self._writer = RecordingWriter(path, COLUMNS, about, field_attachments(surface), "record")
        self._loop, self._next_row, self.lost_rows = loop, 0, 0

    def write_new_rows(self) -> None:
        """Write the rows that are new.

        Raises:
            ParameterError: if the disk is full; what is written can be read.
        """
        rows, first = self._loop.rows(self._next_row)
        self.lost_rows += first - self._next_row
        self._next_row = first + len(rows)
        self._writer.append(rows)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.write_new_rows()
        self._writer.close()
