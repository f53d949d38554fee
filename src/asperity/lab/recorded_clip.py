"""Recordings opened in the lab: their rows, and the scene that they were made on."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from asperity.core.errors import ParameterError
from asperity.devices import Device, load_device
from asperity.lab.clips import RECORDING_FILE
from asperity.lab.playback import Playback, load_playback
from asperity.lab.scene_state import DEFAULT_DEVICE, SceneState, make_scene_state
from asperity.recording.recorded_field import TEXTURE_FILE
from asperity.recording.recording import Recording, is_recording, open_recording
from asperity.recording.replay import recorded_surface_on
from asperity.scene.recorded_scene import load_recorded_scene

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
                raise ParameterError(
                    "recording", f"{source} contains a recording larger than 1 GiB"
                )
            with (
                archive.open(RECORDING_FILE) as packed,
                (folder / RECORDING_FILE).open("wb") as file,
            ):
                shutil.copyfileobj(packed, file)
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
    _require_surface(recording)
    scene, assumed = load_recorded_scene(recording)
    playback = load_playback(recording, recorded_surface_on(recording, scene.texture))
    used = modify_device(device or scene.device or load_device(DEFAULT_DEVICE))
    state = make_scene_state(scene, source, surface, used)
    assumptions = (*assumed, *state.setup.assumptions)
    return replace(state, setup=replace(state.setup, assumptions=assumptions)), playback


def _require_surface(recording: Recording) -> None:
    if "surface" in recording.metadata and recording.attachment(TEXTURE_FILE) is None:
        reason = "does not contain its surface, which was too large: asperity lab SURFACE shows it"
        raise ParameterError("recording", f"{reason}, asperity recording plot the recording")
