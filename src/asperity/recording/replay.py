"""Replaying a recording: its positions through its law, compared bit by bit."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.contacts.memory import new_memory
from asperity.content import formula_content, numbers_content, surface_content
from asperity.display import Displayed
from asperity.errors import ParameterError
from asperity.files import Record, open_input
from asperity.kernels.probe import ClampName
from asperity.kernels.tick import ServoSettings, ServoState
from asperity.laws import Law
from asperity.recording.field import FILE, Field, field_of, read_field
from asperity.recording.recording import Recording
from asperity.surface import Surface
from asperity.textures.remade import remade_texture
from asperity.textures.texture import Texture
from asperity.version import __version__

COMPARED = (
    "commanded x", "commanded y", "commanded z", "law anchor x", "law anchor y", "law held",
)  # fmt: skip
"""The columns that are computed again."""


@dataclass(frozen=True)
class Difference(Record):
    """A number that comes out differently.

    Attributes:
        row: of the recording, from 0.
        time: of the sample [s].
        column: its name.
        recorded: what the recording holds.
        replayed: what the law gives now.
    """

    row: int
    time: float
    column: str
    recorded: float
    replayed: float


@dataclass(frozen=True)
class Replay(Record, Displayed):
    """What a replay found.

    Attributes:
        path: of the recording.
        rows: that were computed again.
        differing: of these, rows of which a bit differs.
        first: where it begins to differ; ``None`` if it does not.
        largest: difference of a component of the force [N].
        notes: what has changed since the recording, in sentences.
    """

    path: str
    rows: int
    differing: int
    first: Difference | None
    largest: float
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        same = f"{self.differing} differ" if self.differing else "the same bit for bit"
        return f"<Replay of {self.rows} rows, {same}>"

    @property
    def same(self) -> bool:
        """Whether every row is the same, bit for bit."""
        return self.differing == 0


def replay(recording: Recording, surface: Surface | None = None) -> Replay:
    """Return whether the law gives the forces that a recording holds, bit for bit.

    Position by position the servo's tick is done again: steps of the encoder, law, virtual damping,
    limit and steps of the force, with the law's and the servo's state carried from the first row.

    Args:
        recording: of every sample of a loop.
        surface: another one to compare with; by default the one that the recording holds.

    Raises:
        ParameterError: for a recording without rows, one that lacks a column, leaves samples out or
            holds no surface.
    """
    said = _surface_of(recording)
    if not recording.rows:
        raise ParameterError("recording", "has no rows to replay")
    settings = _settings(recording.about)
    field = _field(recording, said) if surface is None else field_of(surface)
    found = _Comparison()
    for first, block, forces in _replayed(recording, field, settings):
        found.see(first, block, forces)
    notes = (*changes(recording, field.law), *_others(said, surface))
    return Replay(
        str(recording.path), found.rows, found.differing, found.first, found.largest, notes
    )


def recorded_on(recording: Recording, texture: Texture) -> Surface:
    """Return the surface that a recording names, on another texture.

    Raises:
        ParameterError: if it names none, or one that cannot be had here.
    """
    said = _surface_of(recording)
    try:
        return Surface(
            texture, str(said["law"]), said["stiffness"], said["max_depth"], clamp=said["clamp"],
            law_parameters=said["parameters"],
        )  # fmt: skip
    except (KeyError, TypeError) as error:
        raise ParameterError("recording", f"names no whole surface: {error!r}") from None


def recorded_texture(recording: Recording) -> Texture:
    """Return the texture that a recording holds: its very numbers, no file is read again.

    Raises:
        ParameterError: if it holds none, or one that cannot be had here.
    """
    said = _surface_of(recording)
    field = _field(recording, said)
    described = said.get("texture")
    described = described if isinstance(described, Mapping) else {}
    texture = remade_texture(field.texture, field.sampler, described)
    if texture is None or numbers_content(texture.arguments) != said.get("texture_content"):
        words = f"has a texture of a kind of your own, {described.get('kind')}, that cannot be made"
        raise ParameterError("recording", f"{words} again: describe() must name its arguments")
    return texture


def _surface_of(recording: Recording) -> Mapping[str, Any]:
    said = recording.about.get("surface")
    if not isinstance(said, Mapping):
        raise ParameterError("recording", "does not say which surface it was made on")
    return said


def recorded_field(recording: Recording) -> Field:
    """Return the force field that a recording holds.

    Raises:
        ParameterError: if it holds none, or one that is not known here.
    """
    return _field(recording, _surface_of(recording))


def _field(recording: Recording, said: Mapping[str, Any]) -> Field:
    data = recording.attached(FILE)
    if data is None:
        words = "does not hold its surface, which was too large: name it, --surface SURFACE"
        raise ParameterError("recording", words)
    return read_field(said, data)


def _settings(about: Mapping[str, Any]) -> ServoSettings:
    """Return the settings of the servo that a recording names."""
    every, servo = about.get("every", 1), about.get("servo")
    if every != 1:
        words = f"holds each {every}th sample only; the state of the loop goes from one to the next"
        raise ParameterError("recording", f"cannot be replayed: it {words}")
    names = ("position_resolution", "force_resolution", "max_force", "virtual_damping",
             "velocity_share", "period")  # fmt: skip
    try:
        return ServoSettings(*(float(servo[name]) for name in names))  # type: ignore[index]  # else a TypeError
    except (KeyError, TypeError, ValueError):
        raise ParameterError("recording", "does not say the settings of its servo") from None


@lru_cache(maxsize=16)
def _loops(law: Law, sampler: tuple[ModuleType, ...], clamp: ClampName) -> ModuleType:
    from asperity.kernels import tick
    from asperity.kernels.fuse import fuse_on_texture
    from asperity.recording import kernels

    return fuse_on_texture(law, sampler, clamp, (kernels,), (tick,))


def _replayed(
    recording: Recording, field: Field, settings: ServoSettings
) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """Yield number of the first row, time and recorded columns, and the same computed again."""
    names = recording.names
    for name in ("x", "y", "z", *COMPARED):
        if name not in names:
            raise ParameterError("recording", f"cannot be replayed: it has no column {name!r}")
    point = [names.index(axis) for axis in "xyz"]
    compared = [0, *(names.index(name) for name in COMPARED)]
    loops, state, first = _loops(field.law, field.sampler, field.clamp), ServoState(), 0
    memory = new_memory(field.law.contact.looks)
    for block in recording.blocks():
        _check_times(block[:, 0], first, settings.period)
        points = np.ascontiguousarray(block[:, point])
        out = np.empty((len(block), len(COMPARED)))
        arguments = field.texture, field.law_arguments
        state = loops.replay_batch(points, first, state, settings, memory, *arguments, out)
        yield first, block[:, compared], out
        first += len(block)


def _check_times(times: FloatArray, first: int, period: float) -> None:
    """Refuse rows that are not the samples of a loop, one after the other."""
    wrong = np.flatnonzero(np.abs(times / period - np.arange(first, first + len(times))) > 0.5)
    if len(wrong):
        row = first + int(wrong[0])
        words = f"samples are missing before row {row}, at {times[wrong[0]]:g} s"
        raise ParameterError("recording", f"cannot be replayed: {words}")


class _Comparison:
    """Counts rows that differ."""

    def __init__(self) -> None:
        self.rows = self.differing = 0
        self.first: Difference | None = None
        self.largest = 0.0

    def see(self, first: int, block: FloatArray, replayed: FloatArray) -> None:
        """Compare a block, its time first, with what was computed again."""
        recorded = np.ascontiguousarray(block[:, 1:])
        differs = recorded.view(np.int64) != replayed.view(np.int64)
        rows = np.flatnonzero(differs.any(axis=1))
        self.rows += len(block)
        self.differing += len(rows)
        if not len(rows):
            return
        forces = np.abs(recorded[rows, :3] - replayed[rows, :3])
        self.largest = max(self.largest, float(np.nanmax(forces, initial=0.0)))
        if self.first is None:
            row = int(rows[0])
            column = int(np.flatnonzero(differs[row])[0])
            self.first = Difference(
                first + row, float(block[row, 0]), COMPARED[column],
                float(recorded[row, column]), float(replayed[row, column]),
            )  # fmt: skip


def changes(recording: Recording, law: Law) -> Iterator[str]:
    """Yield what is not as it was when the recording was made, in sentences."""
    said = _surface_of(recording)
    if recording.version != __version__:
        yield f"Recorded by asperity {recording.version}; this is {__version__}."
    if said.get("formula") != formula_content(law):
        yield f"The formula of law {said.get('law')} is another one than it was."
    files = recording.about.get("files")
    for name, content in files.items() if isinstance(files, Mapping) else ():
        now = file_content(name)
        if now is not None and now != content:
            yield f"The file {name} has changed since; the recording holds its own copy."


def _others(said: Mapping[str, Any], surface: Surface | None) -> Iterator[str]:
    if surface is not None and surface_content(surface) != said.get("content"):
        now = surface_content(surface)
        yield f"Recorded on another surface: content {said.get('content')}, this is {now}."


def file_content(path: str | Path) -> str | None:
    """Return a hash of a file; ``None`` if it cannot be read."""
    try:
        with open_input(path) as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()[:16]
    except (OSError, ValueError):
        return None
