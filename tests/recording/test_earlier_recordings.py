"""Recordings of version 1, whose metadata name modules that have been moved since."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

import asperity as asp
from asperity.recording.recorded_field import MOVED_MODULES
from asperity.recording.recording import open_recording
from asperity.recording.replay import recorded_texture, replay

DATA = Path(__file__).parent / "data"


@pytest.mark.parametrize(
    ("name", "kind"),
    [("sinusoid", asp.Sinusoid), ("fourier_profile", asp.Fourier), ("map", asp.HeightMap)],
)
def test_version_1_recording_opens_and_replays(name: str, kind: type) -> None:
    recording = open_recording(DATA / f"{name}.mcap")
    modules = recording.metadata["surface"]["sampler"]
    assert all(module.startswith("asperity.") for module in modules)
    assert MOVED_MODULES.keys() & {*modules}
    result = replay(recording)
    assert (result.rows, result.is_identical) == (30, True)
    assert isinstance(recorded_texture(recording), kind)


def test_moved_modules_exist() -> None:
    for module in MOVED_MODULES.values():
        assert hasattr(importlib.import_module(module), "KERNELS")
