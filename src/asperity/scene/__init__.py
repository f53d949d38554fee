"""Scenes: which texture, surface, device, hand and motion a text or a file names."""

from asperity.scene.loading import KINDS, Scene, load_scene
from asperity.textures.naming import build_texture

__all__ = ["KINDS", "Scene", "build_texture", "load_scene"]
