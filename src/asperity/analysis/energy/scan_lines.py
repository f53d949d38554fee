"""The lines along which laws are scanned: their height, points, directions and parallels."""

from __future__ import annotations

import math

import numpy as np

from asperity.core.checks import FloatArray, check_array
from asperity.core.errors import ParameterError
from asperity.surface import Surface
from asperity.textures.texture import ScanLine, Texture

# Parallel lines on a map: for strength and support, and for the leak.
_MAP_LINES = 16
_SCAN_LINES = 33
_NEAREST_SCAN_LINES = 4


def scan_height(surface: Surface) -> float:
    """Return z [m] of the scan at which laws are compared."""
    return surface.law.contact.extremes(surface.texture)[1] - surface.max_depth


def parallel_line_points(texture: Texture, line: ScanLine, count: int) -> FloatArray:
    """Return points (lines, count, 2) [m] of the scan line of a profile, or 16 lines of a map.

    The lines of a map are parallel to its scan line and spread evenly over the domain.
    """
    xy = line.points(count)
    if texture.is_profile:
        return xy[None]
    spans = texture.domain.spans
    parts = (np.arange(_MAP_LINES) + 0.5) / _MAP_LINES
    across = spans[np.argmin(np.abs(spans @ line.direction) / np.hypot(*spans.T))]
    first = line.start if line.periodic else texture.domain.origin
    shifts = parts[:, None] * across + (first - line.start)
    return np.asarray(xy + shifts[:, None, :])


def scan_line_along(surface: Surface, direction: tuple[float, float]) -> ScanLine:
    """Return the line in a direction through the start of the texture's own scan line."""
    vector = check_array("direction", direction, (2,), "1")
    size = math.hypot(*vector)
    if size == 0.0:
        raise ParameterError("direction", "must have a length", direction)
    own = surface.texture.scan_line()
    unit = vector / size
    if abs(float(unit @ own.direction)) > 1.0 - 1e-12:
        return own
    domain = surface.texture.domain
    reach = float(np.abs(domain.spans @ unit).max())
    return ScanLine(domain.origin, unit, reach if reach > 0.0 else own.length, periodic=False)


def parallel_scan_lines(surface: Surface, line: ScanLine) -> list[ScanLine]:
    """Return lines parallel to a line, spread over a map; on a profile only the line itself."""
    domain = surface.texture.domain
    if surface.texture.is_profile:
        return [line]
    across = np.array([-line.direction[1], line.direction[0]])
    reach = domain.spans @ across
    low = float(np.minimum(reach, 0.0).sum())
    high = float(np.maximum(reach, 0.0).sum())
    count = _SCAN_LINES if surface.law.contact.is_above_probe else _NEAREST_SCAN_LINES
    first = float((domain.origin - line.start) @ across) + low
    shifts = first + (high - low) * (np.arange(count) + 0.5) / count
    return [
        ScanLine(line.start + shift * across, line.direction, line.length, line.periodic)
        for shift in shifts
    ]
