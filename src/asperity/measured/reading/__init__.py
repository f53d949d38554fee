"""Reading surfaces: X3P, SDF, NPY, text, images, meshes, instruments' files, and what you add."""

from __future__ import annotations

from asperity.measured.reader import RawSurface, Reader, ReadingOptions, SurfaceFile
from asperity.measured.reading.readers import read_surface, register

__all__ = ["RawSurface", "Reader", "ReadingOptions", "SurfaceFile", "read_surface", "register"]
