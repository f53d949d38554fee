"""The work of the field around a closed polygon."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from asperity.analysis.energy.anchor import Stretch, anchored_stretches
from asperity.checks import FloatArray, array, positive
from asperity.errors import ParameterError
from asperity.surface import Surface
from asperity.units import engineering

DEFAULT_TOLERANCE = 1e-13
# A panel that holds a jump is halved until it is this short; what it adds is then negligible.
_DEEPEST = 52
_MOST_PANELS = 4096
# Panels at once: some 200 MB, and seconds. Of a loop around a map of 2048 nodes there are 35 000.
_MOST_AT_ONCE = 200_000
# From so many edges on each of them is short.
_MANY_EDGES = 64

# Clenshaw-Curtis: its nodes include both ends of a panel, so a jump close to one is seen.
_ORDER = 16


def _clenshaw_curtis(order: int) -> FloatArray:
    """Return the weights on [0, 1] at s_j = (1 - cos(πj/order))/2; order even."""
    j, k = np.arange(order + 1), np.arange(1, order // 2 + 1)
    factor = np.where(k == order // 2, 1.0, 2.0) / (4.0 * k * k - 1.0)
    weights = 1.0 - np.cos(2.0 * np.pi * np.outer(j, k) / order) @ factor
    ends = np.where((j == 0) | (j == order), 1.0, 2.0)
    result: FloatArray = 0.5 * ends * weights / order
    return result


_S = 0.5 * (1.0 - np.cos(np.pi * np.arange(_ORDER + 1) / _ORDER))
_FINE = _clenshaw_curtis(_ORDER)
_COARSE = _clenshaw_curtis(_ORDER // 2)


def loop_work(surface: Surface, vertices: ArrayLike, tolerance: float = DEFAULT_TOLERANCE) -> float:
    """Return the work of the field on the probe around a closed polygon.

    W = ∮ f · dp, by adaptive Clenshaw-Curtis quadrature along the edges. W > 0 feeds the hand. For
    a law with state the loop is traversed once, slowly, with the anchor released before the first
    vertex; the anchor follows the path exactly (sticking, then dragged along a tractrix).

    Args:
        surface: the surface.
        vertices: of the polygon [m], shape (n, 3), n >= 2; the last is joined to the first.
        tolerance: at which two nested rules agree, relative to the absolute work of an edge.

    Returns:
        W [J].

    Raises:
        ParameterError: for another shape, fewer than 2 vertices, values that are not finite, or a
            tolerance that is not positive.

    Reference:
        The paper's (12), (27), (29) and Fig. 3.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> a, l = 0.8e-3, 2e-3
        >>> surface = Surface(Sinusoid(amplitude=a, period=l), "A")
        >>> path = [[0, 0, 0], [l / 4, 0, 0], [l / 4, 0, a], [0, 0, a]]
        >>> round(loop_work(surface, path) * 1e3, 9)  # k A²/2 in mJ
        0.32
    """
    corners = array("vertices", vertices, (None, 3), "m")
    tolerance = positive("tolerance", tolerance)
    if len(corners) < 2:
        raise ParameterError("vertices", "must be at least 2 points (n, 3) [m]", len(corners))
    ends = np.roll(corners, -1, axis=0)
    wave = _wavelength(surface)
    if not surface.law.stateful:
        return _field_work(surface, corners, ends, wave, tolerance)
    way = float(np.linalg.norm(ends - corners, axis=1).sum())
    _refuse_work(2.0 * way / wave, surface, way, wave)
    stretches = anchored_stretches(surface, corners, ends, wave)
    return float(sum(_stretch_work(surface, stretch, wave, tolerance) for stretch in stretches))


def _field_work(
    surface: Surface, starts: FloatArray, ends: FloatArray, wave: float, tolerance: float
) -> float:
    """Return the work along all edges together: one quadrature of panels of all of them."""
    along = ends - starts
    lengths = np.linalg.norm(along, axis=1)
    counts = [_panels(float(length), wave, len(along)) for length in lengths]
    _refuse_work(sum(counts), surface, float(lengths.sum()), wave)
    edge = np.repeat(np.arange(len(along)), counts)
    first = np.concatenate([np.arange(count) for count in counts])
    parts = np.repeat(1.0 / np.array(counts), counts)
    # The abscissa of panel p of edge e is e + part; its integrand is the work per edge.
    left, width = edge + first * parts, parts

    def integrand(s: FloatArray) -> FloatArray:
        which = np.minimum(np.floor(s).astype(np.int64), len(along) - 1)
        points = starts[which] + (s - which)[:, None] * along[which]
        return np.asarray(np.einsum("ni,ni->n", surface.force(points), along[which]))

    return _adaptive(integrand, left, width, tolerance)


def _refuse_work(panels: float, surface: Surface, way: float, wave: float) -> None:
    """Refuse a loop whose way is long beside what the height does, before there are arrays.

    Raises:
        ParameterError: if it takes too many panels.
    """
    if panels <= _MOST_AT_ONCE:
        return
    slope = surface.texture.bounds[0]
    size = "max_deflection" if surface.law.stateful else "max_depth"
    raise ParameterError(
        "surface",
        f"is too steep for its leak, slopes up to {slope:.2g}: a loop of {engineering(way, 'm')} "
        f"turns every {engineering(wave, 'm')}; give less amplitude (rms, height) or {size}, or a "
        "longer period (cutoff, pitch)",
    )


def smooth_panels(surface: Surface, length: float) -> int:
    """Return how many panels to begin with on a straight way of a length [m]."""
    return _panels(length, _wavelength(surface), 1)


def _panels(length: float, wave: float, edges: int) -> int:
    least = 4 if edges < _MANY_EDGES else 1
    return int(min(max(np.ceil(2.0 * length / wave), least), _MOST_PANELS))


def _wavelength(surface: Surface) -> float:
    """Return the length [m] over which the height can change its course: 2π M/K."""
    slope, bend = surface.texture.bounds
    return 2.0 * np.pi * slope / bend if bend > 0.0 else np.inf


def _stretch_work(surface: Surface, stretch: Stretch, wave: float, tolerance: float) -> float:
    along = stretch.end - stretch.start
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return 0.0

    def integrand(s: FloatArray) -> FloatArray:
        points = stretch.start + s[:, None] * along
        return surface.force(points, deflection=stretch.deflection(s)) @ along

    return integrate(integrand, _panels(length, wave, 1), tolerance)


def integrate(
    integrand: Callable[[FloatArray], FloatArray],
    panels: int,
    tolerance: float = DEFAULT_TOLERANCE,
) -> float:
    """Return the integral over [0, 1] of a function with kinks and jumps at unknown places.

    Args:
        integrand: of an array of abscissae.
        panels: how many equal panels to start with.
        tolerance: panels are halved until two nested rules agree to this part of the integral of
            the absolute value.
    """
    return _adaptive(
        integrand, np.arange(panels) / panels, np.full(panels, 1.0 / panels), tolerance
    )


def _adaptive(
    integrand: Callable[[FloatArray], FloatArray],
    left: FloatArray,
    width: FloatArray,
    tolerance: float,
) -> float:
    """Return the integral over panels, halved until two nested rules agree."""
    total, scale = 0.0, 0.0
    for level in range(_DEEPEST):
        nodes = left[:, None] + width[:, None] * _S
        # The last node must not be taken for the first one of the next edge.
        nodes[:, -1] = np.nextafter(nodes[:, -1], nodes[:, 0])
        values = integrand(nodes.ravel()).reshape(-1, len(_S))
        fine = width * (values @ _FINE)
        error = np.abs(fine - width * (values[:, ::2] @ _COARSE))
        scale = max(scale, float((width * (np.abs(values) @ _FINE)).sum()))
        refine = error > tolerance * scale
        if level == _DEEPEST - 1:
            refine[:] = False
        total += float(fine[~refine].sum())
        if not refine.any():
            break
        half = 0.5 * width[refine]
        left = np.concatenate([left[refine], left[refine] + half])
        width = np.concatenate([half, half])
    return total
