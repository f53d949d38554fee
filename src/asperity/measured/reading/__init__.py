"""Reading surfaces: X3P, SDF, NPY, text, images, meshes, and instruments' files by an extra."""

from __future__ import annotations

from asperity.measured.reading.raw import RawSurface
from asperity.measured.reading.read import read_surface

__all__ = ["RawSurface", "read_surface"]
