"""Data of the figures: a segment of the scan line, forces on it, the field below it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from asperity.analysis.bounds.bound import spectral_norm
from asperity.analysis.energy.straight_scan import scan_height, sliding_state
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.texture import ScanLine, Texture

_SURVEY_POINTS = 4096
_ARROW_COLUMNS = 20
_ARROW_ROWS = 12
# Greatest cost of a field, in evaluations of the height of a map; beyond it the grid is coarser.
_BUDGET = 2.2e6


@dataclass(frozen=True)
class ScanSegment:
    """The part of a scan line shown in a figure; several periods of a short one.

    Attributes:
        line: the scan line.
        start: distance from the start of the line [m].
        length: [m].
    """

    line: ScanLine
    start: float
    length: float

    def xy(self, along: FloatArray) -> FloatArray:
        """Return points (n, 2) [m] at distances (n,) [m] from the start of the segment."""
        distance = self.start + np.asarray(along)
        return np.ascontiguousarray(self.line.start + distance[:, None] * self.line.direction)

    def distances(self, count: int) -> FloatArray:
        """Return distances (count,) [m] from end to end of the segment."""
        return np.linspace(0.0, self.length, count)

    def project(self, xy: FloatArray) -> tuple[float, float]:
        """Return position along the segment and distance from its line [m] of a point (2,) [m]."""
        offset = xy - self.xy(np.zeros(1))[0]
        along = float(offset @ self.line.direction)
        return along, float(np.linalg.norm(offset - along * self.line.direction))

    @property
    def description(self) -> str:
        """The extent of the segment as text."""
        if self.line.periodic and self.length >= self.line.length * (1.0 - 1e-9):
            periods = round(self.length / self.line.length)
            return "one period" if periods == 1 else f"{periods} periods"
        if self.length >= self.line.length * (1.0 - 1e-9):
            return "the whole scan line"
        return f"{100.0 * self.length / self.line.length:.2g} % of the scan line"


def feature_length(texture: Texture) -> float:
    """Return the typical wavelength along the scan line [m]: 2π RMS height / RMS slope."""
    line = texture.scan_line()
    xy = line.points(_SURVEY_POINTS)
    heights = texture.height(xy)
    slope = float(np.sqrt(np.mean((texture.gradient(xy) @ line.direction) ** 2)))
    spread = float(heights.std())
    if slope * line.length <= 1e-12 * spread or spread == 0.0:
        return line.length
    return min(2.0 * math.pi * spread / slope, line.length)


def choose_segment(texture: Texture, target_length: float, max_length: float) -> ScanSegment:
    """Return a segment of about the target length.

    Whole periods if one is no longer than ``max_length``, else a part about the highest point.

    Args:
        texture: the texture.
        target_length: length [m].
        max_length: greatest length [m].
    """
    line = texture.scan_line()
    if line.length <= max_length * (1.0 + 1e-9):
        fitting = round(min(target_length, max_length) / line.length)
        periods = max(1, fitting) if line.periodic else 1
        return ScanSegment(line, 0.0, periods * line.length)
    length = min(max(target_length, 0.0) or max_length, max_length)
    highest = int(np.argmax(texture.height(line.points(_SURVEY_POINTS))))
    centre = (highest + 0.5) * line.length / _SURVEY_POINTS
    start = min(max(centre - 0.5 * length, 0.0), line.length - length)
    return ScanSegment(line, start, length)


@dataclass(frozen=True)
class PlaneForces:
    """Forces in the vertical plane of the scan.

    Attributes:
        along: distance along the scan [m], shape (n,).
        z: height [m], shape (n,).
        tangential: component along the scan [N], shape (n,).
        normal: component out of the body [N], shape (n,).
    """

    along: FloatArray
    z: FloatArray
    tangential: FloatArray
    normal: FloatArray


def _compute_plane_forces(
    surface: Surface, segment: ScanSegment, along: FloatArray, xy: FloatArray, z: FloatArray
) -> PlaneForces:
    points = np.column_stack([xy, z])
    forces = surface.force(points, *sliding_state(surface, len(points))[:1])
    return PlaneForces(along, z, forces[:, :2] @ segment.line.direction, forces[:, 2])


def scan_forces(surface: Surface, segment: ScanSegment, count: int = 900) -> PlaneForces:
    """Return the forces along the segment at the height of the scan."""
    along = segment.distances(count)
    height = np.full(count, scan_height(surface))
    return _compute_plane_forces(surface, segment, along, segment.xy(along), height)


def field_range(surfaces: Iterable[Surface], segment: ScanSegment) -> tuple[float, float]:
    """Return bottom and top [m] of the figures of the field, the same for all laws."""
    surfaces = list(surfaces)
    heights = surfaces[0].texture.height(segment.xy(segment.distances(1000)))
    low = min([float(heights.min()), *map(scan_height, surfaces)])
    high = max(float(heights.max()), 0.0)
    margin = 0.06 * (high - low)
    return low - margin, high + margin


@dataclass(frozen=True)
class CurlField:
    """The curl of a force field in the vertical plane of the scan.

    The cells fill the contact region from the bottom of the figure to the surface.

    Attributes:
        along: corners of the cells [m], shape (n + 1, m + 1).
        z: corners of the cells [m], shape (n + 1, m + 1).
        curl: ∂f_t/∂z - ∂f_z/∂t [N/m] in the middle of each cell, shape (n, m).
        gain: ‖J‖₂/k in the middle of each cell [1], or that of a jump, shape (n, m).
        max_norm: the largest Frobenius norm of J over the cells [N/m].
    """

    along: FloatArray
    z: FloatArray
    curl: FloatArray
    gain: FloatArray
    max_norm: float


def secant_gain(surface: Surface, points: FloatArray) -> FloatArray:
    """Return |Δf| / (k |Δp|) to the farthest off of the neighbours on a grid; n, m and 3 points.

    Where the force jumps, the gain is without bound on a line, which no grid of points meets; the
    secant across that line is at least the jump over the distance of the points.
    """
    flat = points.reshape(-1, 3)
    force = surface.force(flat, *sliding_state(surface, len(flat))[:1]).reshape(points.shape)
    gain = np.zeros(points.shape[:2])
    for axis in (0, 1):
        change = np.linalg.norm(np.diff(force, axis=axis), axis=2)
        ratio = change / (surface.stiffness * np.linalg.norm(np.diff(points, axis=axis), axis=2))
        for ends in ((1, 0), (0, 1)):
            widths = [ends if side == axis else (0, 0) for side in (0, 1)]
            gain = np.maximum(gain, np.pad(ratio, widths))
    return gain


def curl_field(
    surface: Surface,
    segment: ScanSegment,
    bottom: float,
    columns: int = 160,
    rows: int = 90,
    *,
    jumps: bool = False,
) -> CurlField:
    """Return the curl below the surface, from the exact Jacobian.

    Args:
        surface: a law with state slides along the line at full deflection.
        segment: the part of the scan line.
        bottom: of the region [m], below the surface everywhere.
        columns: number of cells along the scan; fewer for an expensive contact.
        rows: number of cells upwards; likewise.
        jumps: whether the force may jump: the gain is then at least that of :func:`secant_gain`.
    """
    coarser = math.sqrt(min(1.0, _BUDGET / (surface.law.contact.relative_cost * columns * rows)))
    columns = max(1, round(coarser * columns))
    rows = max(1, round(coarser * rows))
    edges = segment.distances(columns + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    xy = segment.xy(middles)
    begin = surface.law.contact.contact_height
    texture = surface.texture
    tops = begin(texture, xy)
    corner_tops = begin(texture, segment.xy(edges))
    fractions = (np.arange(rows) + 0.5) / rows
    z = bottom + (tops - bottom)[:, None] * fractions
    points = np.column_stack([np.repeat(xy, rows, axis=0), z.ravel()])
    J = surface.jacobian(points, *sliding_state(surface, len(points)))
    direction = segment.line.direction
    curl = J[:, :2, 2] @ direction - J[:, 2, :2] @ direction
    corner_z = bottom + (corner_tops - bottom)[:, None] * np.linspace(0.0, 1.0, rows + 1)
    corner_t = np.broadcast_to(edges[:, None], corner_z.shape).copy()
    norm = float(np.linalg.norm(J, axis=(1, 2)).max(initial=0.0))
    gain = spectral_norm(J).reshape(columns, rows) / surface.stiffness
    if jumps:
        gain = np.maximum(gain, secant_gain(surface, points.reshape(columns, rows, 3)))
    return CurlField(corner_t, corner_z, curl.reshape(columns, rows), gain, norm)


def arrow_field(surface: Surface, segment: ScanSegment, bottom: float, top: float) -> PlaneForces:
    """Return forces on a regular grid between bottom and top [m], in contact only."""
    steps = (np.arange(_ARROW_COLUMNS) + 0.5) * (segment.length / _ARROW_COLUMNS)
    levels = bottom + (np.arange(_ARROW_ROWS) + 0.5) * ((top - bottom) / _ARROW_ROWS)
    along = np.repeat(steps, len(levels))
    z = np.tile(levels, len(steps))
    xy = segment.xy(along)
    inside = surface.law.contact.is_in_contact(surface.texture, np.column_stack([xy, z]))
    return _compute_plane_forces(surface, segment, along[inside], xy[inside], z[inside])
