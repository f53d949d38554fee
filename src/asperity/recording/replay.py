"""Replay of a recording: its positions through its law, compared bit by bit."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from asperity.contacts.warm_start import new_warm_start
from asperity.core.checks import FloatArray
from asperity.core.display import Displayable
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable, open_input
from asperity.core.version import __version__
from asperity.kernels import tick
from asperity.kernels.fuse import fuse_on_texture
from asperity.kernels.tick import ServoSettings
from asperity.laws import Law
from asperity.loop import no_guards, replayed_device, servo_loop
from asperity.loop.interface import LoopState
from asperity.loop.replayed_device import ReplayedDevice
from asperity.recording import replay_trace, row_encoding
from asperity.recording.recorded_field import (
    TEXTURE_FILE,
    LimitCounts,
    RecordedField,
    formula_digest,
    read_field,
    surface_field,
)
from asperity.recording.recording import Recording, open_recording
from asperity.recording.replay_trace import ReplayTrace
from asperity.surface import Surface
from asperity.textures.texture import Texture

COMPARED_COLUMNS = (
    "commanded x",
    "commanded y",
    "commanded z",
    "law anchor x",
    "law anchor y",
    "law held",
    "law anchor z",
)


@dataclass(frozen=True)
class Difference(Serializable):
    """A difference between recording and replay.

    Attributes:
        row: of the recording, from 0.
        time: of the sample [s].
        column: its name.
        recorded_value: value in the recording.
        replayed_value: value computed now.
    """

    row: int
    time: float
    column: str
    recorded_value: float
    replayed_value: float


@dataclass(frozen=True)
class Replay(Serializable, Displayable):
    """The result of a replay.

    Attributes:
        path: path of the recording.
        rows: number of rows computed.
        differing_rows: number of rows with a bit that differs.
        first_difference: the first difference; ``None`` if there is none.
        max_force_difference: largest difference of a component of the force [N].
        notes: changes since the recording, in sentences.
        limits: rows at the force limit and below ``max_depth``, see :func:`recorded_limits`.
        recorded_rows: number of rows of the recording.
        missing_before: time of the row before which samples are missing [s]: the replay ends there,
            as the state of the loop is not known; ``None`` if none are missing.
    """

    path: str
    rows: int
    differing_rows: int
    first_difference: Difference | None
    max_force_difference: float
    notes: tuple[str, ...] = ()
    limits: LimitCounts | None = None
    recorded_rows: int = 0
    missing_before: float | None = None

    def __repr__(self) -> str:
        result = "the same bit for bit" if self.is_identical else f"{self.differing_rows} differ"
        rows = f"{self.rows} rows"
        if self.missing_before is not None:
            rows = f"{self.rows} of {self.recorded_rows} rows, up to a missing sample"
        return f"<Replay of {rows}, {result}>"

    @property
    def is_identical(self) -> bool:
        """Whether every computed row is the same, bit for bit."""
        return self.differing_rows == 0


def replay(recording: Recording | str | os.PathLike[str], surface: Surface | None = None) -> Replay:
    """Replay a recording, and compare the forces of the law bit for bit.

    The servo's tick is computed for each position: steps of the encoder, law, virtual damping,
    limit and steps of the force, with the law's and the servo's state carried from the first row.
    The replay ends before the first missing sample, see ``missing_before`` of the result.

    Args:
        recording: a recording with every sample of a loop, or its path.
        surface: surface to evaluate in place of the recorded one.

    Raises:
        ParameterError: for a recording without rows, a column, a sample or the surface.
    """
    if not isinstance(recording, Recording):
        recording = open_recording(recording)
    surface_data = _surface_metadata(recording)
    if not recording.rows:
        raise ParameterError("recording", "has no rows to replay")
    settings = _servo_settings(recording.metadata)
    notes = []
    if surface is None:
        field = recorded_field(recording)
    else:
        field = surface_field(surface)
        content = surface_data.get("content")
        if surface.digest != content:
            note = f"Recorded on another surface: content {content}, this is {surface.digest}."
            notes.append(note)
    notes = [*describe_changes(recording, field.law), *notes]
    limits = recorded_limits(recording)
    result = Replay(str(recording.path), 0, 0, None, 0.0, tuple(notes), limits, recording.rows)
    for first, block, forces in _replay_blocks(recording, field, settings):
        result = _compare(result, first, block, forces)
    if result.rows == recording.rows:
        return result
    time = float(recording[recording.names[0]][result.rows])
    if not result.rows:
        reason = f"samples are missing before its first row, at {time:g} s"
        raise ParameterError("recording", f"cannot be replayed: {reason}")
    return replace(result, missing_before=time)


def rounded_step(recording: Recording) -> float:
    """Return the step [m] to which a loop rounded positions that it recorded exactly; 0 for none.

    The column ``supplied`` is the work along the rounded positions.
    """
    try:
        return float(recording.metadata["servo"]["position_resolution"])
    except (KeyError, TypeError, ValueError):
        return 0.0


def omitted_delay(recording: Recording) -> int:
    """Return by how many samples the columns ``applied`` and ``supplied`` ignore the delay.

    Real-time loops of early versions recorded the force before the delay, and its work.
    """
    about = recording.metadata
    if about.get("made_by") != "run" or about.get("has_applied_delay"):
        return 0
    try:
        return min(int(about["servo"]["delay"]), recording.rows)
    except (KeyError, TypeError, ValueError):
        return 0


@lru_cache(maxsize=1)  # the page and the data of one recording state it
def recorded_limits(recording: Recording) -> LimitCounts | None:
    """Return how many rows of a recording are at the force limit and below ``max_depth``.

    ``None`` for a recording that does not hold its surface, or not the limits.
    """
    try:
        field = recorded_field(recording)
        servo = recording.metadata["servo"]
        depth = float(_surface_metadata(recording)["max_depth"])
        counts = LimitCounts(float(servo["max_force"]), float(servo["force_resolution"]), depth)
        columns = [
            row_encoding.find_column(recording.columns, name)
            for name in ("x", "y", "z", *COMPARED_COLUMNS[:3])
        ]
    except (ParameterError, KeyError, TypeError, ValueError):
        return None
    for block in recording.blocks():
        counts.count(block[:, columns[3:]], field.depths(block[:, columns[:3]]))
    return counts


def recorded_surface_on(recording: Recording, texture: Texture) -> Surface:
    """Return the surface that a recording names, on another texture.

    Raises:
        ParameterError: it names none, or one that is not available.
    """
    surface_data = _surface_metadata(recording)
    try:
        return Surface(
            texture,
            str(surface_data["law"]),
            surface_data["stiffness"],
            surface_data["max_depth"],
            clamp=surface_data["clamp"],
            law_parameters=surface_data["parameters"],
            **surface_data.get("friction", {}),
        )
    except (KeyError, TypeError) as error:
        raise ParameterError("recording", f"names no whole surface: {error!r}") from None


def _surface_metadata(recording: Recording) -> Mapping[str, Any]:
    surface_data = recording.metadata.get("surface")
    if not isinstance(surface_data, Mapping):
        raise ParameterError("recording", "does not say which surface it was made on")
    return surface_data


def recorded_field(recording: Recording) -> RecordedField:
    """Return the force field that a recording holds.

    Raises:
        ParameterError: if it holds none, or one that is not known here.
    """
    metadata = _surface_metadata(recording)
    data = recording.attachment(TEXTURE_FILE)
    if data is None:
        raise ParameterError(
            "recording",
            "does not hold its surface, which was too large: name it as {surface}",
            surface=None,
        )
    return read_field(metadata, data)


def _servo_settings(metadata: Mapping[str, Any]) -> ServoSettings:
    """Return the settings of the servo that a recording names."""
    every = metadata.get("every", 1)
    servo = metadata.get("servo")
    if every != 1:
        reason = f"it holds each {every}th sample only; the state goes from one to the next"
        raise ParameterError("recording", f"cannot be replayed: {reason}")
    try:
        return ServoSettings(
            position_step=float(servo["position_resolution"]),  # type: ignore[index]  # else a TypeError
            force_step=float(servo["force_resolution"]),  # type: ignore[index]  # likewise
            max_force=float(servo["max_force"]),  # type: ignore[index]  # likewise
            virtual_damping=float(servo["virtual_damping"]),  # type: ignore[index]  # likewise
            velocity_share=float(servo["velocity_share"]),  # type: ignore[index]  # likewise
            period=float(servo["period"]),  # type: ignore[index]  # likewise
        )
    except (KeyError, TypeError, ValueError):
        raise ParameterError("recording", "does not say the settings of its servo") from None


def _replay_blocks(
    recording: Recording, field: RecordedField, settings: ServoSettings
) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """Yield number of the first row, time and recorded columns, and the same computed again.

    The rows end where samples are missing.
    """
    names = recording.names
    compared_names = list(COMPARED_COLUMNS)
    if COMPARED_COLUMNS[-1] not in names:  # recorded before closed bodies had friction
        compared_names.pop()
    for name in ("x", "y", "z", *compared_names):
        if name not in names:
            raise ParameterError("recording", f"cannot be replayed: it has no column {name!r}")
    point = [names.index(axis) for axis in "xyz"]
    compared = [0, *map(names.index, compared_names)]
    parts = servo_loop, no_guards, replayed_device, replay_trace, tick
    loops = fuse_on_texture(
        field.law, field.sampler, field.clamp, parts, has_friction=field.has_friction
    )
    state = LoopState()
    first = 0
    memory = new_warm_start(field.law.contact.max_evaluations)
    for recorded in recording.blocks():
        block = recorded[: _count_consecutive(recorded[:, 0], first, settings.period)]
        points = np.ascontiguousarray(block[:, point])
        out = np.empty((len(block), len(COMPARED_COLUMNS)))
        device = ReplayedDevice(points, np.zeros(1, np.int64))
        _cause, _code, state = loops.servo_loop(
            state,
            first + len(block),
            settings,
            (),
            (),
            device,
            ReplayTrace(out, first),
            memory,
            field.texture,
            field.law_arguments,
        )
        yield first, block[:, compared], np.ascontiguousarray(out[:, : len(compared_names)])
        if len(block) < len(recorded):
            return
        first += len(block)


def _count_consecutive(times: FloatArray, first: int, period: float) -> int:
    """Return how many rows from the first on are samples of a loop, one after the other."""
    wrong = np.abs(times / period - np.arange(first, first + len(times))) > 0.5
    return int(np.append(np.flatnonzero(wrong), len(times))[0])


def _compare(result: Replay, first: int, block: FloatArray, replayed: FloatArray) -> Replay:
    """Return a result with a block, its time first, compared with what was computed again."""
    recorded = np.ascontiguousarray(block[:, 1:])
    differs = recorded.view(np.int64) != replayed.view(np.int64)
    rows = np.flatnonzero(differs.any(axis=1))
    result = replace(
        result, rows=result.rows + len(block), differing_rows=result.differing_rows + len(rows)
    )
    if not len(rows):
        return result
    greatest = np.nanmax(np.abs(recorded[rows, :3] - replayed[rows, :3]), initial=0.0)
    difference = result.first_difference
    row = int(rows[0])
    if difference is None:
        column = int(np.flatnonzero(differs[row])[0])
        values = float(recorded[row, column]), float(replayed[row, column])
        time = float(block[row, 0])
        name = COMPARED_COLUMNS[column]
        difference = Difference(first + row, time, name, *values)
    force = max(result.max_force_difference, float(greatest))
    return replace(result, first_difference=difference, max_force_difference=force)


def describe_changes(recording: Recording, law: Law) -> Iterator[str]:
    """Yield the changes since the recording, in sentences."""
    surface_data = _surface_metadata(recording)
    if recording.version != __version__:
        yield f"Recorded by asperity {recording.version}; this is {__version__}."
    if surface_data.get("formula") != formula_digest(law):
        yield f"The formula of law {surface_data.get('law')} is another one than it was."
    files = recording.metadata.get("files")
    if not isinstance(files, Mapping):
        return
    for name, content in files.items():
        if file_digest(name) not in (None, content):
            yield f"The file {name} has changed since; the recording holds its own copy."


def file_digest(path: str | Path) -> str | None:
    """Return a hash of a file; ``None`` if it cannot be read."""
    try:
        with open_input(path) as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()[:16]
    except (OSError, ValueError):
        return None
