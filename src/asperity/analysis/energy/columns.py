"""The worst loop of a law whose contact is right above the probe, in a vertical plane.

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

from asperity.analysis.bounds.clamp_zone import ZoneKernel
from asperity.analysis.bounds.dense_search import ContactField
from asperity.analysis.bounds.problems import law_constants, law_kernel, rows_of
from asperity.checks import FloatArray
from asperity.derive.facts import law_facts
from asperity.enclosures.cells import NAMES
from asperity.enclosures.taylor import Number, Taylor
from asperity.surface import Surface
from asperity.textures.cells.lines import Pieces
from asperity.textures.texture import ScanLine, Texture

_LEAST_PIECES, _MOST_PIECES = 512, 65_536
_GAP = 1e-4
# Layers of depth where the curl is not affine in the depth.
_LAYERS = 64
_NODES = 1024
_NODES_PER_CELL, _MOST_NODES = 4, 4096


@dataclass(frozen=True)
class Layer:
    """Depths between which the curl is affine, or nearly so.

    Attributes:
        top: upper end [m].
        bottom: lower end [m].
        held: whether that is where a clamp holds the depth.
    """

    top: float
    bottom: float
    held: bool = False


def layers(surface: Surface, deeper: float = 0.0) -> list[Layer]:
    """Return the layers of depth in which a loop may gain something.

    Down to max_depth, and where a clamp acts down to where everything is below z_b. A conservative
    law under a clamp that takes that from it gains only where the clamp acts.

    Args:
        surface: the surface.
        deeper: how much deeper than that [m].
    """
    clamp, facts = surface.acting_clamp, surface.facts
    top, bottom = surface.max_depth, surface.clamped_depth + deeper
    result: list[Layer] = []
    if clamp == "none" or not law_facts(surface.law).conservative:
        count = 1 if facts.affine_in_depth else _LAYERS
        end = bottom if clamp == "none" else top
        result += [Layer(*ends) for ends in pairwise(np.linspace(0.0, end, count + 1).tolist())]
    if clamp != "none" and bottom > top:
        count = 1 if facts.affine_in_depth or clamp != "lateral" else _LAYERS
        ends = pairwise(np.linspace(top, bottom, count + 1).tolist())
        result += [Layer(*pair, held=True) for pair in ends]
    return result


def curl_integral(
    surface: Surface, line: ScanLine, deeper: float = 0.0
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return lower and upper bounds of ∬curl⁺ and of ∬curl⁻ [J] over the line and the depth.

    curl = ∂f_t/∂z - ∂f_z/∂t. Nothing where the law or the line has no enclosures.

    Args:
        surface: the surface.
        line: the line.
        deeper: how much deeper than its layers to integrate [m].
    """
    parts = layers(surface, deeper)
    count = _LEAST_PIECES
    while True:
        pieces = surface.texture.line_pieces(line, count)
        if pieces is None:
            return None
        try:
            with np.errstate(invalid="ignore", over="ignore"):
                sides = [_bounds(surface, line, pieces, parts, sign) for sign in (1.0, -1.0)]
        except TypeError:
            return None
        low, high = max(low for low, _ in sides), max(high for _, high in sides)
        enough = math.isfinite(high) and high - low <= _GAP * high
        if enough or 2 * len(pieces.centres) > _MOST_PIECES:
            return sides[0], sides[1]
        count = 2 * len(pieces.centres)


def _bounds(
    surface: Surface, line: ScanLine, pieces: Pieces, parts: Sequence[Layer], sign: float
) -> tuple[float, float]:
    scale, affine = surface.stiffness * pieces.length, surface.facts.affine_in_depth
    low = high = 0.0
    for layer in parts:
        ends = (layer.top, layer.bottom)
        edges = [_curl_model(surface, line, pieces, end, held=layer.held) for end in ends]
        error = sum(edge.e for edge in edges) * 0.5
        corners = [
            [sign * (edge.c + side * edge.g[0]) for edge in edges] for side in (-1.0, 0.0, 1.0)
        ]
        left, middle, right = (_positive_part(*corner) for corner in corners)
        if not affine:
            # Between the edges of a layer the curl strays from the chord.
            error = error + _sag(surface, line, pieces, layer, edges)
        size = scale * (layer.bottom - layer.top)
        low += size * float(np.maximum(middle - error, 0.0).sum())
        high += size * float((0.5 * (left + right) + error).sum())
    return low * (1.0 - 1e-12), high * (1.0 + 1e-12)


def _positive_part(alpha: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the mean of (α + (γ - α) s)⁺ over s in [0, 1]."""
    low, high = np.minimum(alpha, gamma), np.maximum(alpha, gamma)
    width = np.where(high > low, high - low, 1.0)
    mixed = 0.5 * high * high / width
    return np.where(low >= 0.0, 0.5 * (low + high), np.where(high <= 0.0, 0.0, mixed))


def _sag(
    surface: Surface,
    line: ScanLine,
    pieces: Pieces,
    layer: Layer,
    edges: list[Taylor],
) -> FloatArray:
    """Bound how far the curl inside a layer is from the chord of its edges."""
    n = len(pieces.centres)
    middle, reach = 0.5 * (layer.top + layer.bottom), 0.5 * (layer.bottom - layer.top)
    slopes = np.zeros((2, n))
    slopes[1] = reach
    depth = Taylor(np.full(n, middle), slopes, np.zeros(n))
    inside = _curl_model(surface, line, pieces, depth, held=layer.held)
    # Both are affine in the two coordinates: they differ most at a corner.
    chord_c = 0.5 * (edges[0].c + edges[1].c)
    chord_t = 0.5 * (edges[0].g[0] + edges[1].g[0])
    chord_d = 0.5 * (edges[1].c - edges[0].c)
    twist = 0.5 * np.abs(edges[1].g[0] - edges[0].g[0])
    apart = np.abs(inside.c - chord_c) + np.abs(inside.g[0] - chord_t)
    return np.asarray(apart + np.abs(inside.g[1] - chord_d) + twist + inside.e)


def _curl_model(
    surface: Surface, line: ScanLine, pieces: Pieces, depth: float | Taylor, *, held: bool
) -> Taylor:
    """Return the enclosure of the curl over k on every piece at a depth."""
    zone = ZoneKernel(surface) if held else None
    kernel, arguments = law_kernel(surface.law)
    names = [name for name in NAMES if name in arguments] if zone is None else zone.names
    models, dimensions = pieces.models(names), 1
    if isinstance(depth, Taylor):
        dimensions = 2
        models = {name: _lifted(model) for name, model in models.items()}
    if zone is None:
        known: dict[str, Any] = {**models, **law_constants(surface), "depth": depth}
        rows = rows_of(kernel(**{name: known[name] for name in arguments})[3:])
    else:
        rows = zone.at(models, depth)
    tx, ty = (float(part) for part in line.direction)
    curl: Number = tx * rows[0][2] + ty * rows[1][2] - (tx * rows[2][0] + ty * rows[2][1])
    if isinstance(curl, Taylor):
        return curl
    n = len(pieces.centres)
    return Taylor(np.full(n, float(curl)), np.zeros((dimensions, n)), np.zeros(n))


def _lifted(model: Number) -> Number:
    if not isinstance(model, Taylor):
        return model
    return Taylor(model.c, np.concatenate([model.g, np.zeros((1, len(model.c)))]), model.e)


def sampled_sides(surface: Surface, line: ScanLine) -> tuple[float, float]:
    """Return ∬curl⁺ and ∬curl⁻ [J] by sampling: what is certified later for the worst line."""
    steps: FloatArray = np.arange(_NODES, dtype=np.float64) + 0.5
    along = np.asarray(steps * (line.length / _NODES), dtype=np.float64)
    total = np.zeros(2)
    for layer in layers(surface):
        edges = _edge_curls(surface, line, along, layer)
        size = (layer.bottom - layer.top) * line.length / _NODES
        for side, sign in enumerate((1.0, -1.0)):
            total[side] += size * _positive_part(*(sign * edge for edge in edges)).sum()
    return float(total[0]), float(total[1])


def _edge_curls(
    surface: Surface, line: ScanLine, along: FloatArray, layer: Layer
) -> list[FloatArray]:
    """Return the curl [N/m] at distances along a line, at the top and the bottom of a layer."""
    xy = np.ascontiguousarray(line.start + along[:, None] * line.direction)
    derivatives, n = surface.texture.derivatives(xy), len(xy)
    result = []
    for level in (layer.top, layer.bottom):
        depth = np.full(n, level)
        if layer.held:
            # Just below max_depth, so that rounding does not put the probe above it.
            below = surface.law.contact.probe(xy, depth * (1.0 + 1e-9), derivatives)
            result.append(plane_curl(surface.jacobian(below), line))
        else:
            field = ContactField(surface)
            jacobians = field.jacobians(xy, depth, derivatives, np.zeros((n, 2)))
            result.append(surface.stiffness * plane_curl(jacobians, line))
    return result


def plane_curl(jacobian: FloatArray, line: ScanLine) -> FloatArray:
    """∂f_t/∂z - ∂f_z/∂t in the vertical plane along the line."""
    direction = line.direction
    result: FloatArray = jacobian[:, :2, 2] @ direction - jacobian[:, 2, :2] @ direction
    return result


def column_loop(surface: Surface, line: ScanLine, sign: float) -> FloatArray:
    """Return the loop around the region where the curl has a sign, vertices (n, 3) [m]."""
    along = np.asarray(np.linspace(0.0, line.length, _node_count(surface.texture, line) + 1))
    parts = layers(surface)
    # Where two layers meet the curl may jump: their common level is there twice.
    levels = [level for layer in parts for level in (layer.top, layer.bottom)]
    curls = [sign * curl for layer in parts for curl in _edge_curls(surface, line, along, layer)]
    if not curls:
        return np.zeros((0, 3))
    top, bottom = positive_interval(levels, np.stack(curls))
    xy = line.start + along[:, None] * line.direction
    surface_z = surface.law.contact.begin(surface.texture, np.ascontiguousarray(xy))
    return comb(xy, surface_z - top, surface_z - bottom, periodic=line.periodic)


def _node_count(texture: Texture, line: ScanLine) -> int:
    pieces = texture.line_pieces(line, 1)
    cells = 0 if pieces is None else len(pieces.centres)
    return int(np.clip(_NODES_PER_CELL * cells, _NODES, _MOST_NODES))


def positive_interval(levels: Sequence[float], values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the longest interval of depth where values (levels, n) are positive, per column.

    Linear between the levels; empty intervals begin and end at the same level.
    """
    count = values.shape[1]
    top, bottom = np.zeros(count), np.zeros(count)
    for column in range(count):
        start, best = None, 0.0
        v = values[:, column]
        for i in range(len(levels)):
            if v[i] > 0.0 and start is None:
                start = levels[i] if i == 0 else _crossing(levels, v, i)
            last = i == len(levels) - 1
            if start is not None and (v[i] <= 0.0 or last):
                end = levels[i] if v[i] > 0.0 else _crossing(levels, v, i)
                if end - start > best:
                    best, top[column], bottom[column] = end - start, start, end
                start = None
    return top, bottom


def _crossing(levels: Sequence[float], values: FloatArray, i: int) -> float:
    part = values[i - 1] / (values[i - 1] - values[i])
    return float(levels[i - 1] + part * (levels[i] - levels[i - 1]))


def comb(xy: FloatArray, top: FloatArray, bottom: FloatArray, *, periodic: bool) -> FloatArray:
    """Return the polygon along the tops of columns and back along their bottoms.

    Columns without an interval are passed both ways along the same line. On a periodic line the
    polygon begins after the widest gap.

    Args:
        xy: columns (n, 2) [m]; the last one is the first one after a period.
        top: upper ends [m].
        bottom: lower ends [m].
        periodic: whether the line may be begun anywhere.
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
        top, bottom, full = top[order], bottom[order], full[order]
    inside = np.flatnonzero(full)
    # One empty column on either side closes the region.
    span = slice(max(inside[0] - 1, 0), inside[-1] + 2)
    xy, top, bottom = xy[span], top[span], bottom[span]
    forth = np.column_stack([xy, top])
    back = np.column_stack([xy, bottom])[::-1]
    vertices = np.concatenate([forth, back])
    moved = np.any(np.diff(vertices, axis=0, prepend=vertices[-1:]) != 0.0, axis=1)
    return np.ascontiguousarray(vertices[moved])


def _after_widest_gap(full: np.ndarray[Any, np.dtype[np.bool_]]) -> int:
    n = len(full)
    best, where, run = -1, 0, 0
    for i in range(2 * n):
        run = 0 if full[i % n] else run + 1
        if run > best:
            best, where = run, i % n
    return where
