"""The worst loop in a vertical plane, for a law whose contact point is right above the probe.

In coordinates (t, δ), distance along the line and depth, the curl at a fixed t is mostly affine in
δ, α + (γ - α) δ/D, and its positive part integrates over the depth to a convex function of (α, γ).
On a piece of the line where both are affine but for an error, the mean of a convex function lies
between its value in the middle and the mean of its values at the ends: certified bounds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from asperity.analysis.bounds.problems import ClampKernel, LawKernel
from asperity.analysis.bounds.sampling import contact_jacobians
from asperity.core.checks import FloatArray
from asperity.derive.facts import law_facts
from asperity.enclosures.taylor import TaylorModel, TaylorNumber
from asperity.surface import Surface
from asperity.textures.domain import LineSegments
from asperity.textures.texture import ScanLine, Texture

_MIN_PIECES = 512
_MAX_PIECES = 65_536
_RELATIVE_ERROR = 1e-4
# Layers of depth where the curl is not affine in the depth.
_LAYER_COUNT = 64
_MIN_NODES = 1024
_NODES_PER_CELL = 4
_MAX_NODES = 4096
# Depth at which the force where contact begins is taken, in layers.
_JUST_INSIDE = 1e-6


@dataclass(frozen=True)
class Layer:
    """Depths between which the curl is affine, or nearly so.

    Attributes:
        top: upper end [m].
        bottom: lower end [m].
        is_clamped: whether a clamp acts there.
    """

    top: float
    bottom: float
    is_clamped: bool = False


def depth_layers(surface: Surface, extra_depth: float = 0.0) -> list[Layer]:
    """Return the layers of depth in which a loop may gain energy.

    Down to max_depth, and with a clamp down to where every point is below z_b. A conservative law
    that a clamp makes non-conservative gains energy only where the clamp acts.

    Args:
        surface: the surface.
        extra_depth: additional depth [m].
    """
    clamp = surface.effective_clamp
    facts = surface.facts
    top = surface.max_depth
    bottom = surface.clamped_depth + extra_depth
    result: list[Layer] = []
    if not clamp.changes_force or not law_facts(surface.law).conservative:
        count = 1 if facts.affine_in_depth else _LAYER_COUNT
        end = top if clamp.changes_force else bottom
        result += [Layer(*ends) for ends in pairwise(np.linspace(0.0, end, count + 1).tolist())]
    if clamp.changes_force and bottom > top:
        count = 1 if facts.affine_in_depth or clamp.holds_whole_force else _LAYER_COUNT
        ends = pairwise(np.linspace(top, bottom, count + 1).tolist())
        result += [Layer(*pair, is_clamped=True) for pair in ends]
    return result


def curl_integral_bounds(
    surface: Surface, line: ScanLine, extra_depth: float = 0.0
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return lower and upper bounds of ∬curl⁺ and of ∬curl⁻ [J] over the line and the depth.

    curl = ∂f_t/∂z - ∂f_z/∂t. ``None`` where the law or the line has no enclosures.

    Args:
        surface: the surface.
        line: the line.
        extra_depth: additional depth of the integral [m].
    """
    parts = depth_layers(surface, extra_depth)
    count = _MIN_PIECES
    while True:
        pieces = surface.texture.line_segments(line, count)
        if pieces is None:
            return None
        try:
            with np.errstate(invalid="ignore", over="ignore"):
                sides = [
                    _signed_integral_bounds(surface, line, pieces, parts, sign)
                    for sign in (1.0, -1.0)
                ]
        except TypeError:
            return None
        low = max(low for low, _ in sides)
        high = max(high for _, high in sides)
        enough = math.isfinite(high) and high - low <= _RELATIVE_ERROR * high
        if enough or 2 * len(pieces.centres) > _MAX_PIECES:
            return sides[0], sides[1]
        count = 2 * len(pieces.centres)


def _signed_integral_bounds(
    surface: Surface, line: ScanLine, pieces: LineSegments, layers: Sequence[Layer], sign: float
) -> tuple[float, float]:
    scale = surface.stiffness * pieces.length
    affine = surface.facts.affine_in_depth
    low = high = 0.0
    for layer in layers:
        ends = (layer.top, layer.bottom)
        edges = [
            _curl_model(surface, line, pieces, end, is_clamped=layer.is_clamped) for end in ends
        ]
        error = sum(edge.e for edge in edges) * 0.5
        corners = [
            [sign * (edge.c + side * edge.g[0]) for edge in edges] for side in (-1.0, 0.0, 1.0)
        ]
        left, middle, right = (_mean_positive_part(*corner) for corner in corners)
        if not affine:
            # Between the edges of a layer the curl deviates from the chord.
            error = error + _chord_error(surface, line, pieces, layer, edges)
        size = scale * (layer.bottom - layer.top)
        low += size * float(np.maximum(middle - error, 0.0).sum())
        high += size * float((0.5 * (left + right) + error).sum())
    return low * (1.0 - 1e-12), high * (1.0 + 1e-12)


def _mean_positive_part(alpha: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the mean of (α + (γ - α) s)⁺ over s in [0, 1]."""
    low = np.minimum(alpha, gamma)
    high = np.maximum(alpha, gamma)
    width = np.where(high > low, high - low, 1.0)
    mixed = 0.5 * high * high / width
    return np.where(low >= 0.0, 0.5 * (low + high), np.where(high <= 0.0, 0.0, mixed))


def _chord_error(
    surface: Surface, line: ScanLine, pieces: LineSegments, layer: Layer, edges: list[TaylorModel]
) -> FloatArray:
    """Return a bound of the difference between the curl in a layer and the chord of its edges."""
    n = len(pieces.centres)
    middle = 0.5 * (layer.top + layer.bottom)
    reach = 0.5 * (layer.bottom - layer.top)
    slopes = np.zeros((2, n))
    slopes[1] = reach
    depth = TaylorModel(np.full(n, middle), slopes, np.zeros(n))
    inside = _curl_model(surface, line, pieces, depth, is_clamped=layer.is_clamped)
    # Both are affine in the two coordinates: their difference is greatest at a corner.
    chord_c = 0.5 * (edges[0].c + edges[1].c)
    chord_t = 0.5 * (edges[0].g[0] + edges[1].g[0])
    chord_d = 0.5 * (edges[1].c - edges[0].c)
    mixed = 0.5 * np.abs(edges[1].g[0] - edges[0].g[0])
    difference = np.abs(inside.c - chord_c) + np.abs(inside.g[0] - chord_t)
    return np.asarray(difference + np.abs(inside.g[1] - chord_d) + mixed + inside.e)


def _curl_model(
    surface: Surface,
    line: ScanLine,
    pieces: LineSegments,
    depth: float | TaylorModel,
    *,
    is_clamped: bool,
) -> TaylorModel:
    """Return the enclosure of the curl over k on every piece at a depth."""
    kernel = ClampKernel(surface) if is_clamped else LawKernel(surface)
    models = pieces.models(kernel.names)
    dimensions = 1
    if isinstance(depth, TaylorModel):
        dimensions = 2
        models = {name: _with_depth_axis(model) for name, model in models.items()}
    rows = kernel.rows_at_depth(models, depth)
    tx, ty = (float(part) for part in line.direction)
    curl: TaylorNumber = tx * rows[0][2] + ty * rows[1][2] - (tx * rows[2][0] + ty * rows[2][1])
    if isinstance(curl, TaylorModel):
        return curl
    n = len(pieces.centres)
    return TaylorModel(np.full(n, float(curl)), np.zeros((dimensions, n)), np.zeros(n))


def _with_depth_axis(model: TaylorNumber) -> TaylorNumber:
    if not isinstance(model, TaylorModel):
        return model
    return TaylorModel(model.c, np.concatenate([model.g, np.zeros((1, len(model.c)))]), model.e)


def sample_curl_integrals(surface: Surface, line: ScanLine) -> tuple[float, float]:
    """Return sampled ∬curl⁺ and ∬curl⁻ [J], to choose the line to certify."""
    steps: FloatArray = np.arange(_MIN_NODES, dtype=np.float64) + 0.5
    along = np.asarray(steps * (line.length / _MIN_NODES), dtype=np.float64)
    total = np.zeros(2)
    for layer in depth_layers(surface):
        edges = _curls_at_layer_ends(surface, line, along, layer)
        size = (layer.bottom - layer.top) * line.length / _MIN_NODES
        for side, sign in enumerate((1.0, -1.0)):
            total[side] += size * _mean_positive_part(*(sign * edge for edge in edges)).sum()
    return float(total[0]), float(total[1])


def _curls_at_layer_ends(
    surface: Surface, line: ScanLine, along: FloatArray, layer: Layer
) -> list[FloatArray]:
    """Return the curl [N/m] at distances along a line, at the top and the bottom of a layer."""
    xy = np.ascontiguousarray(line.start + along[:, None] * line.direction)
    derivatives = surface.texture.derivatives(xy)
    n = len(xy)
    result = []
    for level in (layer.top, layer.bottom):
        depth = np.full(n, level)
        if layer.is_clamped:
            # Just below max_depth, so that rounding does not put the probe above it.
            below = surface.law.contact.probe_positions(xy, depth * (1.0 + 1e-9), derivatives)
            result.append(plane_curl(surface.jacobian(below), line))
        else:
            jacobians = contact_jacobians(surface, xy, depth, derivatives, np.zeros((n, 2)))
            result.append(surface.stiffness * plane_curl(jacobians, line))
    return result


def plane_curl(jacobian: FloatArray, line: ScanLine) -> FloatArray:
    """∂f_t/∂z - ∂f_z/∂t in the vertical plane along the line."""
    direction = line.direction
    return np.asarray(jacobian[:, :2, 2] @ direction - jacobian[:, 2, :2] @ direction)


def curl_region_loop(surface: Surface, line: ScanLine, sign: float) -> FloatArray:
    """Return the loop around the region where the curl has a sign, vertices (n, 3) [m]."""
    along = np.asarray(np.linspace(0.0, line.length, _node_count(surface.texture, line) + 1))
    parts = depth_layers(surface)
    # The curl may jump between two layers: their common level is listed twice.
    levels = [level for layer in parts for level in (layer.top, layer.bottom)]
    curls = [
        sign * curl for layer in parts for curl in _curls_at_layer_ends(surface, line, along, layer)
    ]
    if not curls:
        return np.zeros((0, 3))
    top, bottom = positive_interval(levels, np.stack(curls))
    xy = line.start + along[:, None] * line.direction
    surface_z = surface.law.contact.contact_height(surface.texture, np.ascontiguousarray(xy))
    return column_polygon(xy, surface_z - top, surface_z - bottom, periodic=line.periodic)


def contact_loop(surface: Surface, line: ScanLine, sign: float) -> FloatArray:
    """Return a loop through the surface where contact begins, vertices (n, 3) [m].

    For a law whose force does not vanish there: the force jumps, which is a curl in the surface
    itself. Columns that lose are left out.
    """
    along = np.linspace(0.0, line.length, _node_count(surface.texture, line) + 1)
    xy = np.ascontiguousarray(line.start + along[:, None] * line.direction)
    surface_z = surface.law.contact.contact_height(surface.texture, xy)
    bottom = _gaining_depths(surface, line, xy, surface_z, sign)
    # Straight edges between the columns stay outside of the body.
    bulge = surface.texture.bounds[1] * (line.length / (len(along) - 1)) ** 2 / 8.0
    top = surface_z + bulge + surface.clamped_depth / _LAYER_COUNT
    low = np.where(bottom > 0.0, surface_z - bottom, top)
    return column_polygon(xy, top, low, periodic=line.periodic)


def _gaining_depths(
    surface: Surface, line: ScanLine, xy: FloatArray, surface_z: FloatArray, sign: float
) -> FloatArray:
    """Return the depths [m] down to which columns that begin outside gain most, 0 for a loss.

    From a column outside a loop gains -f·t per length at the surface, t its tangent, and the
    integral of the curl down to the depth at which the column ends.
    """
    step = surface.clamped_depth / _LAYER_COUNT
    forces = surface.force(np.column_stack([xy, surface_z - _JUST_INSIDE * step]))
    slope = np.gradient(surface_z, line.length / (len(xy) - 1))
    gains = -sign * (forces[:, :2] @ line.direction + forces[:, 2] * slope)
    best = np.zeros(len(xy))
    bottom = np.zeros(len(xy))
    for layer in range(_LAYER_COUNT):
        middle = np.column_stack([xy, surface_z - (layer + 0.5) * step])
        gains = gains + sign * step * plane_curl(surface.jacobian(middle), line)
        better = gains > best
        best[better] = gains[better]
        bottom[better] = (layer + 1) * step
    return bottom


def _node_count(texture: Texture, line: ScanLine) -> int:
    pieces = texture.line_segments(line, 1)
    cells = 0 if pieces is None else len(pieces.centres)
    return int(np.clip(_NODES_PER_CELL * cells, _MIN_NODES, _MAX_NODES))


def positive_interval(levels: Sequence[float], values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the longest interval of depth where values (levels, n) are positive, per column.

    Linear between the levels; empty intervals have equal ends.
    """
    count = values.shape[1]
    top = np.zeros(count)
    bottom = np.zeros(count)
    for column in range(count):
        start = None
        best = 0.0
        v = values[:, column]
        for i in range(len(levels)):
            if v[i] > 0.0 and start is None:
                start = levels[i] if i == 0 else _zero_crossing(levels, v, i)
            last = i == len(levels) - 1
            if start is not None and (v[i] <= 0.0 or last):
                end = levels[i] if v[i] > 0.0 else _zero_crossing(levels, v, i)
                if end - start > best:
                    best = end - start
                    top[column] = start
                    bottom[column] = end
                start = None
    return top, bottom


def _zero_crossing(levels: Sequence[float], values: FloatArray, i: int) -> float:
    part = values[i - 1] / (values[i - 1] - values[i])
    return float(levels[i - 1] + part * (levels[i] - levels[i - 1]))


def column_polygon(
    xy: FloatArray, top: FloatArray, bottom: FloatArray, *, periodic: bool
) -> FloatArray:
    """Return the polygon along the tops of columns and back along their bottoms.

    Columns without an interval are passed in both directions along the same line. On a periodic
    line the polygon starts after the widest gap.

    Args:
        xy: columns (n, 2) [m]; the last one is the first one shifted by a period.
        top: upper ends [m].
        bottom: lower ends [m].
        periodic: whether the line repeats.
    """
    full = bottom != top
    if not full.any():
        return np.zeros((0, 3))
    if periodic and not full.all():
        n = len(xy) - 1
        first = _after_widest_gap(full[:-1])
        order = (first + np.arange(n + 1)) % n
        turns = (first + np.arange(n + 1)) // n
        xy = xy[order] + turns[:, None] * (xy[-1] - xy[0])
        top = top[order]
        bottom = bottom[order]
        full = full[order]
    inside = np.flatnonzero(full)
    # One empty column on either side closes the region.
    span = slice(max(inside[0] - 1, 0), inside[-1] + 2)
    xy = xy[span]
    top = top[span]
    bottom = bottom[span]
    forth = np.column_stack([xy, top])
    back = np.column_stack([xy, bottom])[::-1]
    vertices = np.concatenate([forth, back])
    moved = np.any(np.diff(vertices, axis=0, prepend=vertices[-1:]) != 0.0, axis=1)
    return np.ascontiguousarray(vertices[moved])


def _after_widest_gap(full: np.ndarray[Any, np.dtype[np.bool_]]) -> int:
    n = len(full)
    best = -1
    where = 0
    run = 0
    for i in range(2 * n):
        run += 1
        if full[i % n]:
            run = 0
        if run > best:
            best = run
            where = i % n
    return where
