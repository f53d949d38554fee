"""From a file to prepared heights; no textures are known here."""
