"""Reading measured surfaces: X3P, NPY, text matrix, two-column profile."""

from __future__ import annotations

from .raw import RawSurface
from .read import read_surface

__all__ = ["RawSurface", "read_surface"]
