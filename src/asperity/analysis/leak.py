"""How much energy the worst simple loop gains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.analysis.loops import loop_work
from asperity.checks import FloatArray
from asperity.derive.fuse import fuse_contact
from asperity.surface import Surface
from asperity.textures.texture import ScanLine

_POINTS = 4096
_LINES = 33
_STARTS = 64
# The grid of the nearest contact, whose points cost most: along the line, and in depth.
_NEAREST_GRID = {True: (1024, 128), False: (256, 32)}
_NEAREST_LINES = 4
# Gauss-Legendre abscissae in depth: exact for every law that is polynomial in the depth.
_DEPTHS, _WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Leak:
    """The worst simple loop, turned once, in a vertical plane along a scan line.

    Its energy is the larger of ∬curl⁺ and ∬curl⁻ over the length of the line and the depth range,
    curl = ∂f_t/∂z - ∂f_z/∂t, t along the line.

    Attributes:
        energy: work of the field on the probe [J]; 0 for a conservative law.
        line: the scan line of the plane.
        method: ``"theorem"`` (zero by proof) or ``"sampled"``.
        description: the loop in words.
        vertices: the loop as a polygon (n, 3) [m] where it is one, else empty.
    """

    energy: float
    line: ScanLine
    method: str
    description: str
    vertices: FloatArray

    @property
    def per_length(self) -> float:
        """Energy over the length of the line [J/m]: a mean thrust [N]."""
        return self.energy / self.line.length

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "energy": self.energy,
            "per_length": self.per_length,
            "line": {
                "start": self.line.start.tolist(),
                "direction": self.line.direction.tolist(),
                "length": self.line.length,
                "periodic": self.line.periodic,
            },
            "method": self.method,
            "description": self.description,
            "vertices": self.vertices.tolist(),
        }


def worst_loop(surface: Surface, conservative: bool) -> Leak:
    """Return the worst simple loop over the working region, sampled.

    For a law on the nominal or the vertical contact the depth is measured from its own boundary;
    for the nearest contact the region is where the distance to the surface is at most max_depth.
    Maps are searched along several parallel lines. For law F, whose force is no field of
    position, the paper's path of (27) is traced with its state from many starting points.

    Args:
        surface: the surface.
        conservative: what the symbolic curl says; then the energy is zero by theorem.
    """
    line = surface.texture.scan_line()
    nothing = np.zeros((0, 3))
    if conservative:
        return Leak(0.0, line, "theorem", "every closed loop: zero by the symbolic curl", nothing)
    if surface.law.stateful:
        return _friction_loop(surface, line)
    lines = _parallel_lines(surface, line)
    if surface.law.contact == "nearest":
        energies = [_nearest_leak(surface, candidate) for candidate in lines]
    else:
        energies = [_column_leak(surface, candidate) for candidate in lines]
    worst = int(np.argmax(energies))
    among = f", the worst of {len(lines)} parallel lines" if len(lines) > 1 else ""
    text = f"around the region of one sign of the curl, depth to {surface.max_depth * 1e3:g} mm"
    return Leak(float(energies[worst]), lines[worst], "sampled", text + among, nothing)


def _parallel_lines(surface: Surface, line: ScanLine) -> list[ScanLine]:
    domain = surface.texture.domain
    if surface.texture.is_profile:
        return [line]
    across = np.array([-line.direction[1], line.direction[0]])
    reach = domain.spans @ across
    low, high = float(np.minimum(reach, 0.0).sum()), float(np.maximum(reach, 0.0).sum())
    count = _NEAREST_LINES if surface.law.contact == "nearest" else _LINES
    first = float((domain.origin - line.start) @ across) + low
    shifts = first + (high - low) * (np.arange(count) + 0.5) / count
    return [
        ScanLine(line.start + shift * across, line.direction, line.length, line.periodic)
        for shift in shifts
    ]


def _larger_side(curl: FloatArray, area: float | FloatArray) -> float:
    """Return the larger of the integrals of the positive and the negative part."""
    weighted = curl * area
    return float(max(weighted[weighted > 0.0].sum(), -weighted[weighted < 0.0].sum(), 0.0))


def _column_leak(surface: Surface, line: ScanLine) -> float:
    """∬curl⁺ or ∬curl⁻ for a contact above or below the probe: exact in depth, dense in t."""
    xy = line.points(_POINTS)
    derivatives = surface.texture.derivatives(xy)
    loops = fuse_contact(surface.law)
    n, depth = len(xy), surface.max_depth
    deflection, sliding = np.zeros((n, 2)), np.zeros(n, dtype=bool)
    force, jacobian = np.empty((n, 3)), np.empty((n, 3, 3))
    # A curl that keeps its sign over the depth is integrated exactly; panels keep it honest else.
    curl = np.empty((len(_DEPTHS), n))
    for row, node in enumerate(_DEPTHS):
        level = np.full(n, 0.5 * depth * (1.0 + node))
        loops.contact_batch(
            xy, level, derivatives, deflection, sliding, force, jacobian, surface.law_arguments
        )
        curl[row] = _curl(jacobian, line)
    area = 0.5 * depth * _WEIGHTS[:, None] * line.length / n
    return _larger_side(curl, area)


def _curl(jacobian: FloatArray, line: ScanLine) -> FloatArray:
    """∂f_t/∂z - ∂f_z/∂t in the vertical plane along the line."""
    along = line.direction
    result: FloatArray = jacobian[:, :2, 2] @ along - jacobian[:, 2, :2] @ along
    return result


def _nearest_leak(surface: Surface, line: ScanLine) -> float:
    """∬curl⁺ or ∬curl⁻ where the distance to the surface is at most max_depth.

    The distance grows on the way down, so a column ends where it first exceeds max_depth.
    """
    columns, rows = _NEAREST_GRID[surface.texture.is_profile]
    xy = line.points(columns)
    heights = surface.texture.height(xy)
    # Deeper than the lowest point by max_depth, no point is near enough.
    step = (heights - float(heights.min()) + surface.max_depth) / rows
    active = np.arange(columns)
    curl, area = [np.zeros(0)], [np.zeros(0)]
    for row in range(rows):
        z = heights[active] - (row + 0.5) * step[active]
        points = np.column_stack([xy[active], z])
        feet = surface.texture.nearest(points)
        near = np.linalg.norm(feet - points, axis=1) <= surface.max_depth
        points, active = points[near], active[near]
        curl.append(_curl(surface.jacobian(points), line))
        area.append(step[active] * (line.length / columns))
    return _larger_side(np.concatenate(curl), np.concatenate(area))


def friction_path(surface: Surface, start: FloatArray, along: FloatArray) -> FloatArray:
    """Return the paper's path of (27) from a point of the plane, vertices (5, 3) [m].

    Down to light contact, along by max_deflection, down to max_depth, back, and up.
    """
    depth, light = surface.max_depth, 1e-6 * surface.max_depth
    end = start + surface.max_deflection * along
    above = 0.1 * depth
    return np.array(
        [
            [*start, above],
            [*start, -light],
            [*end, -light],
            [*end, -depth],
            [*start, -depth],
        ]
    )


def _friction_loop(surface: Surface, line: ScanLine) -> Leak:
    """The paper's path of (27), both ways, from starting points all along the line."""
    paths = [
        friction_path(surface, start, sign * line.direction)
        for start in line.points(_STARTS)
        for sign in (1.0, -1.0)
    ]
    energies = [loop_work(surface, path) for path in paths]
    worst = int(np.argmax(energies))
    text = (
        f"the paper's path of (27), worst of {len(paths)} starts: "
        f"{surface.max_deflection * 1e3:g} mm along in light contact, "
        f"back at {surface.max_depth * 1e3:g} mm"
    )
    return Leak(max(float(energies[worst]), 0.0), line, "sampled", text, paths[worst])
