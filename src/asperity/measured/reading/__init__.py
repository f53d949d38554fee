"""Reading surfaces: X3P, SDF, NPY, text, images, meshes, instruments' files, and what you add."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asperity.measured.reader import RawSurface, Reader, ReadingOptions, SurfaceFile

if TYPE_CHECKING:
    from asperity.measured.reading.readers import read_surface as read_surface
    from asperity.measured.reading.readers import register as register

__all__ = ["RawSurface", "Reader", "ReadingOptions", "SurfaceFile", "read_surface", "register"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'asperity.measured.reading' has no attribute {name!r}")
    from asperity.measured.reading import readers  # a dozen modules, for a surface of a file alone

    return getattr(readers, name)
