"""Scenes: which texture, surface, device, hand and motion a text or a file names."""

from asperity.scene.loading import Scene, build_texture, load_scene
from asperity.scene.sections import KINDS

__all__ = ["KINDS", "Scene", "build_texture", "load_scene"]
