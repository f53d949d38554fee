"""What the hand has just felt, kept: a recording, and the scene that does it again."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.files import plain
from asperity.lab.reel import ANCHOR, Reel, reel_of
from asperity.lab.scene_text import scene_text
from asperity.lab.stage import Stage
from asperity.recording.field import describe_field, field_files
from asperity.recording.writer import RecordingWriter
from asperity.scene.sections import PATH_COLUMNS
from asperity.scene.setup import SIMULATED
from asperity.servo.drivers.steered import Wheel
from asperity.servo.kernels.published import COLUMNS
from asperity.servo.kernels.steered import KEPT
from asperity.servo.shared import Shared

RECORDING, SCENE, HAND = "recording.mcap", "scene.toml", "hand.csv"
"""The files of a take: rows of the loop, what does it again, and how the hand moved; besides these
files of the user's own."""
MOST_ROWS = KEPT - 4000
"""Of a take, the newest: more may be overwritten while they are read."""

_NAMES = [name for name, _unit in COLUMNS]
_PLACE = slice(_NAMES.index("x"), _NAMES.index("z") + 1)
_FORCE = slice(_NAMES.index("commanded x"), _NAMES.index("applied z") + 1)
_ANCHOR = slice(_NAMES.index("law anchor x"), _NAMES.index("law anchor y") + 1)
_MOST_CHANGES = 10_000  # of the surface since the loop's start
_SHORTEST = 0.2  # [s] that a take lasts at least


@dataclass(frozen=True)
class Take:
    """Some seconds of a loop.

    Attributes:
        stage: that was shown.
        rows: of the loop, the first at time 0, with ``COLUMNS`` (n, columns).
        anchors: of the hand at the rows [m], shape (n, 3).
        velocity: of the handle at the first row [m/s], shape (3,).
    """

    stage: Stage
    rows: FloatArray
    anchors: FloatArray
    velocity: FloatArray

    @property
    def duration(self) -> float:
        """In the time of the loop [s]."""
        return len(self.rows) * self.stage.setup.servo.period

    def archive(self) -> bytes:
        """Return recording, scene and the hand's way as a ZIP archive."""
        packed = io.BytesIO()
        with TemporaryDirectory() as folder, zipfile.ZipFile(packed, "w") as archive:
            self.write(Path(folder))
            for name in (RECORDING, SCENE, HAND, *self.stage.code):
                archive.write(Path(folder, name), name, zipfile.ZIP_DEFLATED, 1)
        return packed.getvalue()

    def write(self, folder: Path) -> None:
        """Write recording, scene and the hand's way into a folder."""
        setup = self.stage.setup
        said = {"made_by": "run", "surface": describe_field(setup.surface),
                "servo": plain(setup.servo), "every": 1, **setup.about(SIMULATED)}  # fmt: skip
        field, columns = field_files(setup.surface), (*COLUMNS, *ANCHOR)
        with RecordingWriter(folder / RECORDING, columns, said, field) as writer:
            writer.append(self._table)
        way = np.column_stack([self.rows[:, 0], self.anchors])
        np.savetxt(folder / HAND, way, "%.17g", ",", header=",".join(PATH_COLUMNS), comments="")
        begin = self.duration, self.rows[0, _PLACE], self.velocity
        text = scene_text(self.stage, HAND, RECORDING if field else "", *begin)
        (folder / SCENE).write_text(text, "utf-8")
        for name, content in self.stage.code.items():
            (folder / name).write_bytes(content)

    def reel(self) -> Reel:
        """Return what the page shows of it."""
        setup = self.stage.setup
        return reel_of(self._table, setup.servo.period, setup.surface.texture)

    @property
    def _table(self) -> FloatArray:
        return np.column_stack([self.rows, self.anchors])


def take(stage: Stage, shared: Shared, wheel: Wheel) -> Take:
    """Return the newest seconds of a loop, from where the probe was free.

    There the law and the servo carry nothing, so that who begins there goes the same way.

    Raises:
        ParameterError: if the probe was not free since the last change.
    """
    rows, first = shared.rows(max(shared.head - MOST_ROWS, 0))
    track = wheel.track
    begin, end = _stretch(rows, stage.setup.servo.delay)
    if end - begin < _SHORTEST / stage.setup.servo.period:
        raise ParameterError("recording", "begins where the probe is free: lift it, then go on")
    rows = rows[begin:end].copy()
    places = _places(rows[:, _PLACE], first + begin, track)
    rows[:, 0] = np.arange(len(rows)) * stage.setup.servo.period
    supplied = _NAMES.index("supplied")
    rows[:, supplied] -= rows[0, supplied]
    # What the law held before counts no more; who begins here has held nothing.
    held = rows[:, _NAMES.index("law held")].argmax()
    rows[: held or len(rows), _ANCHOR] = 0.0
    return Take(stage, rows, track[places, 0], track[places[0], 1])


def _stretch(rows: FloatArray, delay: int) -> tuple[int, int]:
    """Return the newest rows with all of the law, from where on nothing is on its way yet."""
    whole = rows[:, _NAMES.index("share")] == 1.0
    end = int(whole.nonzero()[0][-1]) + 1 if whole.any() else 0
    ramped = np.flatnonzero(~whole[:end])
    changed = int(ramped[-1]) + 1 if len(ramped) else 0
    busy = (rows[:, _FORCE] != 0.0).any(axis=1)
    busy |= (rows[:, _NAMES.index("inside")] != 0.0) | (rows[:, _NAMES.index("law held")] != 0.0)
    # What was commanded in the last samples is still on its way.
    waits = np.convolve(busy, np.ones(delay + 2))[: len(rows)] > 0.5
    free = np.flatnonzero(~waits[changed:end])
    return (changed + int(free[0]) if len(free) else end), end


def _places(points: FloatArray, first: int, track: FloatArray) -> Any:
    """Return where in the track the samples of rows are, by their positions (n,).

    Each change of the surface lets the device do one sample of which there is no row.
    """
    count = np.arange(first, first + len(points))
    for changes in range(_MOST_CHANGES):
        places = (count + changes) % KEPT
        if (track[places[:: len(places) - 1], 2] == points[:: len(points) - 1]).all() and (
            track[places, 2] == points
        ).all():
            return places
    raise ParameterError("recording", "was lost: the loop went faster than it could be read")
