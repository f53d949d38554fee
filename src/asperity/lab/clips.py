"""Clips: the newest seconds of a session as a recording, and recordings opened in the lab."""

from __future__ import annotations

import asyncio
import io
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from asperity.analysis.results.compare import DEFAULT_DEVICE
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import to_plain_data
from asperity.devices import Device, load_device
from asperity.lab.messages import COLUMN_NAMES, POSITION
from asperity.lab.playback import ANCHOR_COLUMNS, Playback, load_playback, make_playback
from asperity.lab.scene_export import format_scene
from asperity.lab.scene_state import SceneState, make_scene_state
from asperity.lab.session import Session
from asperity.loop.shared_trace import COLUMNS
from asperity.recording.recorded_field import TEXTURE_FILE, field_attachments, field_metadata
from asperity.recording.recording import is_recording, open_recording
from asperity.recording.replay import recorded_surface_on
from asperity.recording.writer import RecordingWriter
from asperity.scene.recorded_scene import load_recorded_scene
from asperity.scene.sections import PATH_COLUMNS
from asperity.scene.setup import SIMULATED_DRIVER
from asperity.servo.drivers.pointer import PointerHand
from asperity.servo.kernels.pointer_anchor import HISTORY_SAMPLES
from asperity.servo.loop_memory import LoopMemory

RECORDING_FILE = "recording.mcap"
SCENE_FILE = "scene.toml"
HAND_FILE = "hand.csv"
"""Files of a clip: rows of the loop, the scene that reproduces them, and the motion of the hand,
besides the plugins of the user."""
MAX_CLIP_ROWS = HISTORY_SAMPLES - 4000
"""Greatest number of rows of a clip: more may be overwritten while they are read."""

_FORCES = slice(COLUMN_NAMES.index("commanded x"), COLUMN_NAMES.index("applied z") + 1)
_LAW_ANCHOR = slice(COLUMN_NAMES.index("law anchor x"), COLUMN_NAMES.index("law anchor y") + 1)
_MAX_CHANGES = 10_000  # of the surface since the start of the loop
_MIN_DURATION = 0.2  # of a clip [s]


@dataclass(frozen=True)
class Clip:
    """Some seconds of a loop.

    Attributes:
        scene_state: the scene.
        rows: of the loop from time 0, with ``COLUMNS``, shape (n, columns).
        anchors: of the hand at the rows [m], shape (n, 3).
        velocity: of the handle at the first row [m/s], shape (3,).
    """

    scene_state: SceneState
    rows: FloatArray
    anchors: FloatArray
    velocity: FloatArray

    @property
    def duration(self) -> float:
        """Duration in the time of the loop [s]."""
        return len(self.rows) * self.scene_state.setup.servo.period

    def archive(self) -> bytes:
        """Return recording, scene and motion of the hand as a ZIP archive."""
        packed = io.BytesIO()
        with TemporaryDirectory() as folder, zipfile.ZipFile(packed, "w") as archive:
            self.write(Path(folder))
            for name in (RECORDING_FILE, SCENE_FILE, HAND_FILE, *self.scene_state.plugin_files):
                archive.write(Path(folder, name), name, zipfile.ZIP_DEFLATED, 1)
        return packed.getvalue()

    def write(self, folder: Path) -> None:
        """Write recording, scene and motion of the hand into a folder."""
        setup = self.scene_state.setup
        metadata = {
            "made_by": "run",
            "surface": field_metadata(setup.rendered),
            "servo": to_plain_data(setup.servo),
            "every": 1,
            **setup.recording_metadata(SIMULATED_DRIVER),
        }
        field = field_attachments(setup.rendered)
        columns = (*COLUMNS, *ANCHOR_COLUMNS)
        with RecordingWriter(folder / RECORDING_FILE, columns, metadata, field) as writer:
            writer.append(self._table)
        path = np.column_stack([self.rows[:, 0], self.anchors])
        header = ",".join(PATH_COLUMNS)
        np.savetxt(folder / HAND_FILE, path, "%.17g", ",", header=header, comments="")
        start = self.duration, self.rows[0, POSITION], self.velocity
        text = format_scene(self.scene_state, HAND_FILE, RECORDING_FILE if field else "", *start)
        (folder / SCENE_FILE).write_text(text, "utf-8")
        for name, content in self.scene_state.plugin_files.items():
            (folder / name).write_bytes(content)

    def playback(self) -> Playback:
        """Return the rows for the page."""
        setup = self.scene_state.setup
        return make_playback(self._table, setup.servo.period, setup.surface.texture)

    @property
    def _table(self) -> FloatArray:
        return np.column_stack([self.rows, self.anchors])


def extract_clip(scene_state: SceneState, shared: LoopMemory, pointer_hand: PointerHand) -> Clip:
    """Return the newest seconds of a loop, from a sample in which the probe was free.

    The states of law and servo are initial there, so that a simulation from there reproduces the
    rows.

    Raises:
        ParameterError: if the probe was not free since the last change.
    """
    rows, first = shared.rows(max(shared.row_count - MAX_CLIP_ROWS, 0))
    track = pointer_hand.history
    start, end = _find_segment(rows, scene_state.setup.servo.delay)
    if end - start < _MIN_DURATION / scene_state.setup.servo.period:
        raise ParameterError("recording", "must start with a free probe: lift it, then continue")
    rows = rows[start:end].copy()
    places = _track_indices(rows[:, POSITION], first + start, track)
    rows[:, 0] = np.arange(len(rows)) * scene_state.setup.servo.period
    supplied = COLUMN_NAMES.index("supplied")
    rows[:, supplied] -= rows[0, supplied]
    # A simulation from here starts without an anchor of the law.
    anchored = rows[:, COLUMN_NAMES.index("law held")].argmax()
    rows[: anchored or len(rows), _LAW_ANCHOR] = 0.0
    return Clip(scene_state, rows, track[places, 0], track[places[0], 1])


def _find_segment(rows: FloatArray, delay: int) -> tuple[int, int]:
    """Return first and last index of the newest rows with the whole force, from a free sample."""
    whole = rows[:, COLUMN_NAMES.index("share")] == 1.0
    end = int(whole.nonzero()[0][-1]) + 1 if whole.any() else 0
    ramped = np.flatnonzero(~whole[:end])
    changed = int(ramped[-1]) + 1 if len(ramped) else 0
    states = [COLUMN_NAMES.index(name) for name in ("inside", "law held")]
    busy = (rows[:, _FORCES] != 0.0).any(axis=1) | (rows[:, states] != 0.0).any(axis=1)
    # Commands of the last samples are still delayed.
    waits = np.convolve(busy, np.ones(delay + 2))[: len(rows)] > 0.5
    free = np.flatnonzero(~waits[changed:end])
    return (changed + int(free[0]) if len(free) else end), end


def _track_indices(points: FloatArray, first: int, track: FloatArray) -> Any:
    """Return the indices (n,) of rows in the track of the device, by their positions.

    At each change of the surface the device executes one sample without a row.
    """
    count = np.arange(first, first + len(points))
    for changes in range(_MAX_CHANGES):
        places = (count + changes) % HISTORY_SAMPLES
        if (track[places[:: len(places) - 1], 2] == points[:: len(points) - 1]).all() and (
            track[places, 2] == points
        ).all():
            return places
    raise ParameterError("recording", "was lost: the loop was faster than the reader")


MAX_CLIPS = 4
"""Greatest number of stored clips; each takes some megabytes."""
_ARCHIVE_TYPE = "application/zip"
_CHUNK_TYPE = "application/octet-stream"


class ClipStore:
    """Clips by name, fetched as ``NAME.zip`` or in chunks ``NAME.0``, ``NAME.1``, ...

    Args:
        session: the session, which restores their scenes.

    Attributes:
        announcements: descriptions of the clips for pages, the newest last.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._playbacks: dict[str, Playback] = {}
        self._archives: dict[str, bytes] = {}
        self.announcements: list[dict[str, Any]] = []
        self._saved_count = 0
        self._is_saving = False

    def add(
        self, name: str, playback: Playback, scene_state: SceneState, **words: Any
    ) -> dict[str, Any]:
        """Add a clip, or a recording, which is never discarded; return its description."""
        self._playbacks[name] = playback
        self._session.saved_scenes.clip_scenes[name] = scene_state
        clip = {"name": name, "law": scene_state.setup.surface.law.letter, "archive": None, **words}
        self.announcements.append(clip | {"playback": playback})
        return self.announcements[-1]

    async def save_clip(self) -> dict[str, Any]:
        """Store the newest seconds of the session as a clip.

        Returns:
            The description of the clip for pages.

        Raises:
            ParameterError: without a running loop, or while another clip is being stored.
        """
        session = self._session
        shared = session.shared
        if shared is None or session.state != "running":
            raise ParameterError("recording", "needs a running loop")
        if session.pointer_hand is None:
            raise ParameterError("recording", "of a real device: use asperity run --record")
        if self._is_saving:
            raise ParameterError("recording", "is being written already")
        self._is_saving = True
        try:
            arguments = session.scene_state, shared, session.pointer_hand
            clip = await asyncio.to_thread(extract_clip, *arguments)
            archive = await asyncio.to_thread(clip.archive)
        finally:
            self._is_saving = False
        self._saved_count += 1
        name = f"clip-{self._saved_count}"
        self._archives[name] = archive
        if len(self._archives) > MAX_CLIPS:
            self._discard(next(iter(self._archives)))
        files = {"title": str(self._saved_count), "archive": f"{name}.zip"}
        return self.add(name, clip.playback(), clip.scene_state, **files)

    def _discard(self, name: str) -> None:
        for clips in (self._archives, self._playbacks, self._session.saved_scenes.clip_scenes):
            del clips[name]
        self.announcements = [clip for clip in self.announcements if clip["name"] != name]

    async def fetch(self, file_name: str) -> tuple[str, bytes] | None:
        """Return type and content of a file by its name; ``None`` for an unknown name."""
        name, _dot, part = file_name.rpartition(".")
        if part == "zip" and name in self._archives:
            return _ARCHIVE_TYPE, self._archives[name]
        playback = self._playbacks.get(name)
        if playback is None or not part.isdecimal() or int(part) >= playback.chunk_count:
            return None
        return _CHUNK_TYPE, await asyncio.to_thread(playback.chunk, int(part))


_RECORDING_SUFFIX = ".mcap"
_MAX_RECORDING_BYTES = 2**30  # of a recording in an archive


def find_recording(source: str, folder: Path) -> Path | None:
    """Return the recording at a path; ``None`` for another kind of source.

    Args:
        source: path of a recording, or of an archive written by the lab.
        folder: receives the recording of an archive.

    Raises:
        ParameterError: for an archive whose recording cannot be read.
    """
    if is_recording(source) or source.lower().endswith(_RECORDING_SUFFIX):
        return Path(source)
    try:
        with zipfile.ZipFile(source) as archive:
            if RECORDING_FILE not in archive.namelist():
                return None  # some measured surfaces are archives too
            if archive.getinfo(RECORDING_FILE).file_size > _MAX_RECORDING_BYTES:
                reason = f"{source} contains a recording larger than 1 GiB"
                raise ParameterError("recording", reason)
            archive.extract(RECORDING_FILE, folder)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError) as error:
        if not zipfile.is_zipfile(source):
            return None
        raise ParameterError("recording", f"{source} cannot be read: {error}") from None
    except (OSError, ValueError):
        return None  # the reader of surfaces reports the error
    return folder / RECORDING_FILE


def load_recorded_clip(
    path: Path, source: str, surface: Mapping[str, Any], device: Device | None,
    modify_device: Callable[[Device], Device] = lambda device: device,
) -> tuple[SceneState, Playback]:  # fmt: skip
    """Return the scene of a recording and its rows.

    The loop is built from surface, law, device, servo and hand of the recording, see
    :func:`~asperity.scene.recorded_scene.load_recorded_scene`; missing data are assumed, which the
    setup lists.

    Args:
        path: of the recording.
        source: as given by the user.
        surface: arguments of the surface that override the recording's.
        device: overrides the recording's.
        modify_device: returns a device with requested changes.

    Raises:
        ParameterError: for a recording that cannot be shown, with the missing data.
    """
    recording = open_recording(path)
    if "surface" in recording.metadata and recording.attachment(TEXTURE_FILE) is None:
        reason = "does not contain its surface, which was too large: asperity lab SURFACE shows it"
        raise ParameterError("recording", f"{reason}, asperity recording plot the recording")
    scene, assumed = load_recorded_scene(recording)
    playback = load_playback(recording, recorded_surface_on(recording, scene.texture))
    used = modify_device(device or scene.device or load_device(DEFAULT_DEVICE))
    state = make_scene_state(scene, source, surface, used)
    assumptions = (*assumed, *state.setup.assumptions)
    return replace(state, setup=replace(state.setup, assumptions=assumptions)), playback
