"""The leak: the energy gained on the worst simple loop, and the speed at which it is absorbed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from asperity.analysis.bounds.branch_and_bound import DIFFERENCE_AMPLIFICATION, ROUNDING_ERROR
from asperity.analysis.energy import curl_columns
from asperity.analysis.energy.absorbing_friction import (
    LOOP_TOLERANCE,
    find_absorbing_friction,
    path_work,
    region_floor,
)
from asperity.analysis.energy.closed_loops import AbsorbingFriction, Leak, LoopKind, LoopOrigin
from asperity.analysis.energy.field_energy import (
    TooSteepError,
    initial_panels,
    integrate,
    loop_work,
    steady_work,
    work_rounding,
)
from asperity.analysis.energy.straight_scan import (
    lines_across,
    parallel_scan_lines,
    scan_height,
    scan_line_along,
)
from asperity.analysis.gain.surface_cache import cached_result
from asperity.analysis.gain.theorems import residual_bound
from asperity.core.checks import FloatArray
from asperity.core.errors import InternalError
from asperity.derive.facts import law_facts
from asperity.surface import Surface
from asperity.textures.texture import ScanLine

# Grid of the region: columns along the line and levels of depth, for profiles and for maps.
_GRID = {True: (512, 96), False: (160, 24)}
# Equal steps, accurate for a periodic mean.
_THRUST_STEPS = 512


def worst_loop(surface: Surface, direction: tuple[float, float] | None = None) -> Leak:
    """Return the worst simple loop over the working region.

    For a law on the nominal or the vertical contact the depth is measured from its own boundary
    and the energy is certified; for the nearest contact the region is where the distance to the
    surface is at most max_depth. On maps the worst of lines in many directions is taken; on a
    profile no plane is worse than that across its grooves. For a law with state, whose force is no
    field of position, loops are traced from many starting points.

    Args:
        surface: the surface.
        direction: direction (x, y) of the vertical planes; by default all are searched.

    Raises:
        ParameterError: for a direction without length.

    Reference:
        The paper's section III.C and (27); docs/theory/numbers.md.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.8e-3, period=2e-3), "A", max_depth=0.8e-3)
        >>> leak = worst_loop(surface)  # k D 2A, down one flank and up the other
        >>> round(leak.energy * 1e3, 3), round(leak.upper_per_period * 1e3, 3)
        (1.28, 1.28)
    """
    line = surface.texture.scan_line() if direction is None else scan_line_along(surface, direction)
    key = (line.start.tolist(), line.direction.tolist(), line.length, line.periodic)
    leak = cached_result(
        "worst loop",
        surface,
        lambda unit: _find_worst_loop(unit, line, in_all_directions=direction is None),
        repr((key, direction is None)),
    )
    return leak.scale(surface.stiffness)


def _find_worst_loop(surface: Surface, line: ScanLine, *, in_all_directions: bool) -> Leak:
    if surface.law.stateful:
        return _stateful_leak(surface, line)
    if surface.facts.conservative:
        thrust = 0.0 if line.periodic else None
        origin = LoopOrigin(LoopKind.EVERY_LOOP)
        return Leak(0.0, 0.0, line, "theorem", origin, np.zeros((0, 3)), thrust)
    lines = parallel_scan_lines(surface, line)
    directions = 1
    if in_all_directions:
        others, more = lines_across(surface)
        lines += others
        directions += more
    search = _column_leak if surface.law.contact.is_above_probe else _nearest_leak
    leak = search(surface, lines)
    return replace(
        leak,
        origin=replace(leak.origin, lines=len(lines), directions=directions),
        absorbing=find_absorbing_friction(surface, line, leak.vertices),
    )


def _column_leak(surface: Surface, lines: list[ScanLine]) -> Leak:
    """Return the loop around the curl of one sign, certified in the plane of the worst line."""
    sides = [curl_columns.sample_curl_integrals(surface, line) for line in lines]
    worst = int(np.argmax([max(side) for side in sides]))
    line = lines[worst]
    sign = 1.0 if sides[worst][0] >= sides[worst][1] else -1.0
    vertices, energy = orient_loop(surface, curl_columns.curl_region_loop(surface, line, sign))
    bounds = None
    if law_facts(surface.law).vanishes_at_contact:
        bounds = curl_columns.curl_integral_bounds(surface, line)
    else:
        loops = [(vertices, energy)]
        for each in lines:
            loops += [
                orient_loop(surface, curl_columns.contact_loop(surface, each, sign))
                for sign in (1.0, -1.0)
            ]
        vertices, energy = max(loops, key=lambda loop: loop[1])
    upper = math.inf
    method = "sampled"
    if bounds is not None:
        method = "certified"
        upper = max(high for _low, high in bounds)
    if energy > upper:
        _check_against_bound(surface, line, vertices, energy)
        energy = upper  # straight edges pass below the region, where more may be gained
    origin = LoopOrigin(LoopKind.CURL_BY_DEPTH, surface.clamped_depth)
    thrust = _mean_thrust(surface, line)
    return Leak(energy, upper, line, method, origin, vertices, thrust)


def _check_against_bound(
    surface: Surface, line: ScanLine, vertices: FloatArray, energy: float
) -> None:
    """Refuse a loop that gains more than is proved.

    A straight edge between two columns at distance Δ is deeper than the region by at most K Δ²/8,
    the sag of the surface between them, so the bound for that depth holds. The quadrature of each
    edge adds its tolerance, and each force its rounding.

    Raises:
        InternalError: if the loop gains more than that.
    """
    gap = float(np.hypot(*np.diff(vertices[:, :2], axis=0).T).max())
    sag = surface.texture.bounds[1] * gap * gap / 8.0
    bounds = curl_columns.curl_integral_bounds(surface, line, sag) if math.isfinite(sag) else None
    if bounds is None:
        return
    proved = max(high for _low, high in bounds)
    edges = np.linalg.norm(np.diff(vertices, axis=0, append=vertices[:1]), axis=1)
    force = float(np.linalg.norm(surface.force(vertices), axis=1).max())
    height = 1.0 + max(map(abs, surface.texture.extremes)) / surface.max_depth
    error = len(edges) * LOOP_TOLERANCE + ROUNDING_ERROR * DIFFERENCE_AMPLIFICATION * height
    if energy > proved + error * force * float(edges.sum()):
        raise InternalError(
            f"the leak of {surface!r} along {line.direction} from {line.start} m is proved to be "
            f"at most {proved:.17g} J, but a loop of {len(edges)} edges gains {energy:.17g} J. No "
            "number of this surface can be trusted; please report it"
        )


def orient_loop(surface: Surface, vertices: FloatArray) -> tuple[FloatArray, float]:
    """Return a polygon in the orientation in which it gains energy, and its work [J]."""
    if len(vertices) < 2:
        return np.zeros((0, 3)), 0.0
    work = path_work(surface, vertices)
    if work < 0.0:
        return np.ascontiguousarray(vertices[::-1]), -work
    return vertices, work


def _nearest_leak(surface: Surface, lines: list[ScanLine]) -> Leak:
    """Return the loop around the curl of one sign within the distance max_depth of the surface."""
    outlines = [outline for line in lines for outline in _nearest_outlines(surface, line)]
    _estimate, polygon, line = max(outlines, key=lambda outline: outline[0])
    vertices, energy = orient_loop(surface, polygon)
    origin = LoopOrigin(LoopKind.CURL_BY_DISTANCE, surface.max_depth)
    thrust = _mean_thrust(surface, line)
    return Leak(energy, math.inf, line, "sampled", origin, vertices, thrust)


def _nearest_outlines(
    surface: Surface, line: ScanLine
) -> Iterator[tuple[float, FloatArray, ScanLine]]:
    """Yield the polygons around the regions of either sign of the curl in a vertical plane.

    Each comes with a grid estimate of ∬|curl| inside [J].

    The region is where the distance to the surface is at most max_depth. The distance grows with
    the depth, so a column ends where it first exceeds max_depth; in each column the longest
    interval of the sign is used.
    """
    columns, levels = _GRID[surface.texture.is_profile]
    along = np.linspace(0.0, line.length, columns + 1)
    xy = np.ascontiguousarray(line.start + along[:, None] * line.direction)
    tops = surface.texture.height(xy)
    reach = tops - region_floor(surface, xy)
    parts: FloatArray = np.linspace(0.0, 1.0, levels + 1)
    # At the surface the curl is evaluated just below it.
    inside = np.maximum(parts, 0.5 / levels)
    points = np.concatenate([np.column_stack([xy, tops - part * reach]) for part in inside])
    curls = curl_columns.plane_curl(surface.jacobian(points), line).reshape(levels + 1, -1)
    area = reach * line.length / (columns * levels)
    for sign in (1.0, -1.0):
        top, bottom = curl_columns.positive_interval(parts.tolist(), sign * curls)
        chosen = (parts[:, None] >= top) & (parts[:, None] <= bottom) & (sign * curls > 0.0)
        estimate = float((np.where(chosen, np.abs(curls), 0.0) * area).sum())
        low = tops - bottom * reach
        high = tops - top * reach
        yield estimate, curl_columns.column_polygon(xy, high, low, periodic=line.periodic), line


def _mean_thrust(surface: Surface, line: ScanLine) -> float:
    """Return (1/l) ∫ f_t dt along a line at constant height [N].

    At z = max h - max_depth, on the nominal contact at -max_depth.

    Args:
        surface: a surface whose law has no state.
        line: the line; its whole length counts.
    """
    height = scan_height(surface)
    tangent = np.array([*line.direction, 0.0])

    def integrand(s: FloatArray) -> FloatArray:
        xy = line.start + (s * line.length)[:, None] * line.direction
        points = np.column_stack([xy, np.full(len(s), height)])
        return np.asarray(surface.force(points) @ tangent)

    if surface.law.contact.requires_search:
        # For costly contacts: equal steps suffice for a periodic mean.
        steps = (np.arange(_THRUST_STEPS) + 0.5) / _THRUST_STEPS
        return float(integrand(steps).mean())
    start = np.array([[*line.start, height]])
    return integrate(
        integrand,
        initial_panels(surface, line.length),
        rounding=work_rounding(surface, start, start + line.length * tangent) / line.length,
    )


# --- loops of laws with state, from the onset of contact, where the anchor is created ------------

_START_POINTS = 64
_COLUMNS = 128
# In-plane loops whose work is computed, those with the greatest estimates.
_EVALUATED_LOOPS = 4
_RADIUS_FACTOR = 1.0 - 1e-9


def _stateful_leak(surface: Surface, line: ScanLine) -> Leak:
    """Return the worst of the paper's path of (27) and of loops at constant depth."""
    loops = [light_then_deep_loop(surface, line), in_plane_loop(surface, line)]
    worst = max(loops, key=lambda loop: loop.energy)
    pressing = 0.5 * surface.stiffness * surface.max_depth**2
    if worst.energy <= LOOP_TOLERANCE * pressing:  # error of the quadrature
        none = LoopOrigin(LoopKind.NO_GAIN)
        return replace(_sampled_leak(0.0, line, none, np.zeros((0, 3))), steady=0.0)
    densest = max(loops, key=lambda loop: loop.energy / loop.length)
    density = densest.energy / densest.length
    absorbing = AbsorbingFriction(density, math.inf, densest.energy, densest.vertices)
    winding = [both_sides_path(surface, at, line.direction) for at in line.points(_START_POINTS)]
    path = winding[int(np.argmax([loop_work(surface, path) for path in winding]))]
    steady = max([steady_work(surface, vertices) for vertices in (worst.vertices, path)])
    return replace(worst, absorbing=absorbing, steady=steady)


def _sampled_leak(energy: float, line: ScanLine, origin: LoopOrigin, vertices: FloatArray) -> Leak:
    return Leak(energy, math.inf, line, "sampled", origin, vertices, None)


def friction_path(surface: Surface, start: FloatArray, along: FloatArray) -> FloatArray:
    """Return the paper's path of (27) from a point of the plane, vertices (5, 3) [m].

    Down to light contact, along by max_deflection, down to max_depth, back, and up.
    """
    depth = surface.max_depth
    light = 1e-6 * surface.max_depth
    end = start + surface.parameter("max_deflection") * along
    above = 0.1 * depth
    return np.array(
        [[*start, above], [*start, -light], [*end, -light], [*end, -depth], [*start, -depth]]
    )


def both_sides_path(surface: Surface, start: FloatArray, along: FloatArray) -> FloatArray:
    """Return a path that winds in contact, vertices (8, 3) [m]: forth, and the same backwards.

    The anchor is loaded in light contact and unloaded at max_depth on one side of the point, then
    on the other.
    """
    sides = [friction_path(surface, start, sign * along)[1:] for sign in (1.0, -1.0)]
    return np.concatenate(sides)


def light_then_deep_loop(surface: Surface, line: ScanLine) -> Leak:
    """Return the best of the paper's paths of (27), in both directions, from points on the line."""
    paths = [
        friction_path(surface, start, sign * line.direction)
        for start in line.points(_START_POINTS)
        for sign in (1.0, -1.0)
    ]
    energies = [loop_work(surface, path) for path in paths]
    best = int(np.argmax(energies))
    deflection = surface.parameter("max_deflection")
    origin = LoopOrigin(LoopKind.FRICTION_PATH, surface.max_depth, len(paths), deflection)
    return _sampled_leak(float(energies[best]), line, origin, paths[best])


def in_plane_loop(surface: Surface, line: ScanLine) -> Leak:
    """Return the best loop at constant depth about an anchor that sticks.

    There f = -k D μ (1 - m) d/d_max is a field of the deflection d, whose curl k D μ ∇m × d/d_max
    has opposite signs on the two sides of the scan line, which swap where m falls instead of rises.
    The polygon encloses one sign of it within the circle |d| < d_max.
    """
    outlines = [
        _in_plane_outline(surface, line, start, sign)
        for start in line.points(_START_POINTS)
        for sign in (1.0, -1.0)
    ]
    outlines.sort(key=lambda outline: -outline[0])
    origin = LoopOrigin(LoopKind.IN_PLANE, surface.max_depth)
    paths = [path for _estimate, path in outlines[:_EVALUATED_LOOPS]]
    loops = [_sampled_leak(loop_work(surface, path), line, origin, path) for path in paths]
    return max(loops, key=lambda loop: loop.energy)


def _in_plane_outline(
    surface: Surface, line: ScanLine, anchor: FloatArray, sign: float
) -> tuple[float, FloatArray]:
    """Return ∬|∇m × d| within the outline, up to a factor, and the polygon."""
    longest = surface.parameter("max_deflection")
    t = np.linspace(-1.0, 1.0, _COLUMNS + 1) * longest * _RADIUS_FACTOR
    along = line.direction
    across = np.array([-line.direction[1], line.direction[0]])
    xy = anchor + t[:, None] * along
    slope = surface.texture.gradient(xy) @ along
    width = np.sqrt(np.maximum((_RADIUS_FACTOR * longest) ** 2 - t * t, 0.0))
    estimate = float((np.abs(slope) * width * width).sum())
    side = sign * np.where(slope >= 0.0, width, -width)
    low = np.minimum(side, 0.0)
    high = np.maximum(side, 0.0)
    forth = xy + low[:, None] * across
    back = (xy + high[:, None] * across)[::-1]
    plane = np.concatenate([anchor[None], forth, back, anchor[None]])
    depth = np.full((len(plane), 1), -surface.max_depth)
    above = np.array([[*anchor, 0.1 * surface.max_depth]])
    return estimate, np.concatenate([above, np.hstack([plane, depth])])


def find_leak(surface: Surface, direction: tuple[float, float] | None = None) -> Leak:
    """Return the worst loop; of unknown energy, NaN, where the surface is too steep for it."""
    try:
        return worst_loop(surface, direction)
    except TooSteepError:
        origin = LoopOrigin(LoopKind.TOO_STEEP, surface.max_depth)
        line = surface.texture.scan_line()
        absorbing = AbsorbingFriction(0.0, residual_bound(surface), 0.0, np.zeros((0, 3)), planes=0)
        return Leak(math.nan, math.inf, line, "unknown", origin, np.zeros((0, 3)), None, absorbing)
