"""Scenes: texture, surface, device, hand and motion of a specification or a scene file."""

from asperity.scene.scene_file import TEXTURE_KINDS, Scene, load_scene
from asperity.textures.catalogue import build_texture

__all__ = ["TEXTURE_KINDS", "Scene", "build_texture", "load_scene"]
