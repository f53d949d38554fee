"""A recording of elsewhere in the lab: its rows, and the stage that it was made on."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from asperity.devices import Device, load_device
from asperity.errors import ParameterError
from asperity.lab.reel import Reel, recorded_reel
from asperity.lab.stage import DEVICE, Stage, make_stage
from asperity.lab.takes import RECORDING
from asperity.recording.field import FILE
from asperity.recording.recording import Recording, is_recording, open_recording
from asperity.recording.replay import recorded_on
from asperity.scene.recorded import recorded_scene

_SUFFIX = ".mcap"
_MOST_BYTES = 2**30  # of a recording in an archive


def recording_in(named: str, folder: Path) -> Path | None:
    """Return the recording that a path names; ``None`` for something else.

    Args:
        named: path of a recording, or of an archive that the lab has written.
        folder: where the recording of an archive is put.

    Raises:
        ParameterError: for an archive whose recording cannot be read.
    """
    if is_recording(named) or named.lower().endswith(_SUFFIX):
        return Path(named)
    try:
        with zipfile.ZipFile(named) as archive:
            if RECORDING not in archive.namelist():
                return None  # some measured surfaces are archives, too
            if archive.getinfo(RECORDING).file_size > _MOST_BYTES:
                raise ParameterError("recording", f"{named} holds one of more than a gigabyte")
            with archive.open(RECORDING) as packed, (folder / RECORDING).open("wb") as file:
                shutil.copyfileobj(packed, file)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError) as error:
        if not zipfile.is_zipfile(named):
            return None
        raise ParameterError("recording", f"{named} cannot be read: {error}") from None
    except (OSError, ValueError):
        return None  # who reads surfaces says why
    return folder / RECORDING


def open_recorded(
    path: Path, named: str, surface: Mapping[str, Any], device: Device | None,
    changed: Callable[[Device], Device] = lambda device: device,
) -> tuple[Stage, Reel]:  # fmt: skip
    """Return the stage of a recording and its rows.

    The loop behind is made of what the recording holds: surface, law, device, servo and hand, see
    :func:`~asperity.scene.recorded.recorded_scene`; what it does not say is assumed, and told.

    Args:
        path: of the recording.
        named: by which it was asked for.
        surface: arguments of the surface that come before the recording's.
        device: comes before the recording's.
        changed: returns a device with what else was asked for.

    Raises:
        ParameterError: for a recording that cannot be shown, with what it lacks.
    """
    recording = open_recording(path)
    _need_surface(recording)
    scene, said = recorded_scene(recording)
    reel = recorded_reel(recording, recorded_on(recording, scene.texture))
    shown = changed(device or scene.device or load_device(DEVICE))
    stage = make_stage(scene, named, surface, shown)
    assumptions = (*said, *stage.setup.assumptions)
    return replace(stage, setup=replace(stage.setup, assumptions=assumptions)), reel


def _need_surface(recording: Recording) -> None:
    if "surface" in recording.about and recording.attached(FILE) is None:
        words = "does not hold its surface, which was too large: asperity lab SURFACE shows that"
        raise ParameterError("recording", f"{words}, asperity recording plot the recording")
