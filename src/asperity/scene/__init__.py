"""Scenes: which texture, surface, device, hand and motion a text or a file names."""

from asperity.scene.loading import (
    FILE_ARGUMENTS,
    KINDS,
    SURFACE_ARGUMENTS,
    Scene,
    build_texture,
    load_scene,
)

__all__ = [
    "FILE_ARGUMENTS",
    "KINDS",
    "SURFACE_ARGUMENTS",
    "Scene",
    "build_texture",
    "load_scene",
]
