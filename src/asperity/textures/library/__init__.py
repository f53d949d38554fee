"""Named synthetic surfaces of physical size: deterministic, periodic, band-limited."""

from __future__ import annotations

from asperity.textures.library.surface_library import (
    LIBRARY,
    NamedSurface,
    named_surface,
    surface_names,
)

__all__ = ["LIBRARY", "NamedSurface", "named_surface", "surface_names"]
