"""The energy of a force field: its work around a closed polygon, and the potential of law H.

For laws with state the work is taken along the anchor's path.

Between two points of an edge the anchor either sticks (the deflection grows with the probe) or
slides at full deflection (the anchor runs along a tractrix, the curve of an object pulled by a
string of fixed length). The sampled map of the device converges to this for small steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.contacts.contact_kinds import SPLIT
from asperity.core.checks import FloatArray, check_array, check_points, check_positive
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.surface import Surface

# Steps to find where an edge enters and leaves contact: per wave of the height, and at most.
_CONTACT_STEPS_PER_WAVE = 16
_MAX_CONTACT_STEPS = 65_536
_CONTACT_BISECTIONS = 52


class TooSteepError(ParameterError):
    """A surface whose waves are too short for the loop around which work is integrated."""


DeflectionFunction = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class AnchoredSegment:
    """A segment of an edge along which the anchor only sticks or only slides.

    Attributes:
        start: first point [m], shape (3,).
        end: last point [m], shape (3,).
        deflection: deflection of the anchor [m] at fractions of the segment, (m,) -> (m, 2).
    """

    start: FloatArray
    end: FloatArray
    deflection: DeflectionFunction


def anchored_segments(
    surface: Surface, starts: FloatArray, ends: FloatArray, wave: float = math.inf
) -> list[AnchoredSegment]:
    """Return the segments of a path between changes of contact, sticking and sliding.

    The anchor exists while the contact's own depth is positive, as in the kernel: a vertex
    exactly on the surface is out of contact and releases it.

    Args:
        surface: a surface whose law has state.
        starts: first points of the edges [m], shape (n, 3).
        ends: last points [m], shape (n, 3).
        wave: shortest wavelength of the height [m].
    """
    longest = surface.parameter("max_deflection")
    result: list[AnchoredSegment] = []
    deflection: FloatArray | None = None  # None: the anchor is released
    for start, end in zip(starts, ends, strict=True):
        for a, b, inside in _contact_intervals(surface, start, end, wave):
            if not inside:
                deflection = None
                continue
            initial = np.zeros(2) if deflection is None else deflection
            parts, deflection = _segments_in_contact(a, b, initial, longest)
            result += parts
    return result


def _contact_intervals(
    surface: Surface, start: FloatArray, end: FloatArray, wave: float
) -> list[tuple[FloatArray, FloatArray, bool]]:
    """Return the parts of an edge in and out of contact, in order, possibly of length zero."""
    contact = surface.law.contact

    def points(s: FloatArray) -> FloatArray:
        return np.asarray((1.0 - s)[:, None] * start + s[:, None] * end)

    steps = _CONTACT_STEPS_PER_WAVE
    if contact.begins_on_texture:  # else contact begins at a plane, which an edge crosses once
        length = float(np.linalg.norm(end - start))
        steps = max(steps, min(math.ceil(steps * length / wave), _MAX_CONTACT_STEPS))
    s: FloatArray = np.linspace(0.0, 1.0, steps + 1)
    inside = contact.is_in_contact(surface.texture, points(s))
    turns = np.flatnonzero(inside[1:] != inside[:-1])
    low = s[turns]
    high = s[turns + 1]
    for _ in range(_CONTACT_BISECTIONS if len(turns) else 0):
        middle = 0.5 * (low + high)
        same = contact.is_in_contact(surface.texture, points(middle)) == inside[turns]
        low = np.where(same, middle, low)
        high = np.where(same, high, middle)
    places = [start, *points(high), end]
    held = [bool(inside[0]), *inside[turns + 1].tolist()]
    return [(a, b, kind) for (a, b), kind in zip(pairwise(places), held, strict=True)]


def _segments_in_contact(
    start: FloatArray, end: FloatArray, initial_deflection: FloatArray, max_deflection: float
) -> tuple[list[AnchoredSegment], FloatArray]:
    """Return the segments of an edge in contact, and the deflection at its end."""
    move = (end - start)[:2]
    distance = float(np.hypot(*move))
    if distance == 0.0:
        segment = AnchoredSegment(start, end, lambda s: np.tile(initial_deflection, (len(s), 1)))
        return [segment], initial_deflection
    along = move / distance
    free = min(_sticking_distance(initial_deflection, along, max_deflection), distance)
    middle = start + (free / distance) * (end - start)

    def stick(s: FloatArray) -> FloatArray:
        return initial_deflection + (free * s)[:, None] * along

    result = [AnchoredSegment(start, middle, stick)] if free > 0.0 else []
    if free == distance:
        return result, initial_deflection + distance * along
    slide = _tractrix(initial_deflection + free * along, along, distance - free, max_deflection)
    result.append(AnchoredSegment(middle, end, slide))
    return result, slide(np.array([1.0]))[0]


def _sticking_distance(
    initial_deflection: FloatArray, along: FloatArray, max_deflection: float
) -> float:
    """Return the distance [m] of the probe until the anchor slides."""
    b = float(initial_deflection @ along)
    c = float(initial_deflection @ initial_deflection) - max_deflection**2
    # The greater root of r² + 2 b r + c = 0, without cancellation.
    root = math.sqrt(max(b * b - c, 0.0))
    if b > 0.0:
        return max(-c / (b + root), 0.0)
    return max(-b + root, 0.0)


def _tractrix(
    initial_deflection: FloatArray, along: FloatArray, distance: float, max_deflection: float
) -> DeflectionFunction:
    """Return the deflection while the anchor slides along a straight line.

    With φ the angle from the direction of motion to d: tan(φ/2) falls as exp(-run/d_max).
    """
    across = np.array([-along[1], along[0]])
    angle = math.atan2(float(initial_deflection @ across), float(initial_deflection @ along))
    start = math.tan(0.5 * angle)

    def deflection(s: FloatArray) -> FloatArray:
        phi = 2.0 * np.arctan(start * np.exp(-distance * s / max_deflection))
        unit = np.cos(phi)[:, None] * along + np.sin(phi)[:, None] * across
        return np.asarray(max_deflection * unit)

    return deflection


DEFAULT_TOLERANCE = 1e-13
# A panel with a jump is halved this often; its contribution is then negligible.
_MAX_REFINEMENTS = 52
_MAX_PANELS = 4096
# Panels at once: some 200 MB, and seconds. A loop around a map of 2048 nodes has 35 000.
_MAX_TOTAL_PANELS = 200_000
# Rounding of a force, over that of the heights and places that it follows from.
_FORCE_ROUNDING = 8.0 * float(np.finfo(np.float64).eps)
# From this number of edges on each edge is short.
_MANY_EDGES = 64

# Clenshaw-Curtis: its nodes include both ends of a panel, so a jump close to one is detected.
_ORDER = 16


def _clenshaw_curtis(order: int) -> FloatArray:
    """Return the weights on [0, 1] at s_j = (1 - cos(πj/order))/2; order even."""
    j = np.arange(order + 1)
    k = np.arange(1, order // 2 + 1)
    factor = np.where(k == order // 2, 1.0, 2.0) / (4.0 * k * k - 1.0)
    weights = 1.0 - np.cos(2.0 * np.pi * np.outer(j, k) / order) @ factor
    ends = np.where((j == 0) | (j == order), 1.0, 2.0)
    return np.asarray(0.5 * ends * weights / order)


_QUADRATURE_NODES = 0.5 * (1.0 - np.cos(np.pi * np.arange(_ORDER + 1) / _ORDER))
_FINE_WEIGHTS = _clenshaw_curtis(_ORDER)
_COARSE_WEIGHTS = _clenshaw_curtis(_ORDER // 2)


def loop_work(surface: Surface, vertices: ArrayLike, tolerance: float = DEFAULT_TOLERANCE) -> float:
    """Return the work of the field on the probe around a closed polygon.

    W = ∮ f · dp, by adaptive Clenshaw-Curtis quadrature along the edges. W > 0: the field does net
    work on the hand. For a law with state the loop is traversed once, slowly, with the anchor
    released before the first vertex; the anchor follows the path exactly (sticking, then sliding
    along a tractrix).

    Args:
        surface: the surface.
        vertices: vertices of the polygon [m], shape (n, 3), n >= 2, closed by an edge.
        tolerance: tolerance of two nested rules, relative to the absolute work of an edge.

    Returns:
        W [J].

    Raises:
        ParameterError: for another shape, fewer than 2 vertices, values that are not finite, a
            tolerance that is not positive, or a surface with friction beside its law: its work is
            the sum of force times step along :meth:`Surface.trace`.

    Reference:
        The paper's (12), (27), (29) and Fig. 3.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> a, l = 0.8e-3, 2e-3
        >>> surface = Surface(Sinusoid(amplitude=a, period=l), "A")
        >>> path = [[0, 0, 0], [l / 4, 0, 0], [l / 4, 0, a], [0, 0, a]]
        >>> round(loop_work(surface, path) * 1e3, 9)  # k A²/2 in mJ
        0.32
    """
    corners = check_array("vertices", vertices, (None, 3), "m")
    tolerance = check_positive("tolerance", tolerance)
    if len(corners) < 2:
        raise ParameterError("vertices", "must be at least 2 points (n, 3) [m]", len(corners))
    if surface.contact_friction is not None:
        reason = "has friction beside its law: sum force times step along surface.trace(path)"
        raise ParameterError("surface", reason)
    ends = np.roll(corners, -1, axis=0)
    wave = shortest_wavelength(surface)
    if not surface.law.stateful:
        return _field_work(surface, corners, ends, wave, tolerance)
    length = float(np.linalg.norm(ends - corners, axis=1).sum())
    _check_panel_count(2.0 * length / wave, surface, length, wave)
    segments = anchored_segments(surface, corners, ends, wave)
    return float(sum(_segment_work(surface, segment, wave, tolerance) for segment in segments))


# Turns after which those of a law with state are taken to be alike.
_TURNS = 3


def steady_work(surface: Surface, vertices: ArrayLike) -> float:
    """Return the work of the field in a turn around a closed polygon once turns are alike [J].

    For a law with state that is the third turn, with the anchor released before the first one;
    without state each turn is like the first, :func:`loop_work`.

    Args:
        surface: the surface.
        vertices: vertices of the polygon [m], shape (n, 3), n >= 2, closed by an edge.

    Raises:
        ParameterError: as :func:`loop_work`.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.1e-3, period=1e-3), "F")
        >>> path = [[0, 0, -1e-4], [5e-3, 0, -1e-4]]  # the first turn loads the anchor
        >>> loop_work(surface, path) < steady_work(surface, path)
        True
    """
    corners = check_array("vertices", vertices, (None, 3), "m")
    if not surface.law.stateful:
        return loop_work(surface, corners)
    before, after = (loop_work(surface, np.tile(corners, (n, 1))) for n in (_TURNS - 1, _TURNS))
    return after - before


def _field_work(
    surface: Surface, starts: FloatArray, ends: FloatArray, wave: float, tolerance: float
) -> float:
    """Return the work along all edges by one quadrature over the panels of all edges."""
    along = ends - starts
    lengths = np.linalg.norm(along, axis=1)
    counts = [_panel_count(float(length), wave, len(along)) for length in lengths]
    _check_panel_count(sum(counts), surface, float(lengths.sum()), wave)
    edge = np.repeat(np.arange(len(along)), counts)
    first = np.concatenate([np.arange(count) for count in counts])
    parts = np.repeat(1.0 / np.array(counts), counts)
    # The abscissa of panel p of edge e is e + part; its integrand is the work per edge.
    left = edge + first * parts
    width = parts

    def integrand(s: FloatArray) -> FloatArray:
        which = np.minimum(np.floor(s).astype(np.int64), len(along) - 1)
        points = starts[which] + (s - which)[:, None] * along[which]
        return np.asarray(np.einsum("ni,ni->n", surface.force(points), along[which]))

    return _integrate_adaptively(
        integrand, left, width, tolerance, work_rounding(surface, starts, ends)
    )


def work_rounding(surface: Surface, starts: FloatArray, ends: FloatArray) -> float:
    """Return about the greatest rounding error of the work along straight edges (n, 3) [J].

    A depth is a difference of heights at a rounded place. A horizontal force is a depth times a
    slope, in which heights cancel that are as close as samples.
    """
    texture = surface.texture
    slope, hessian = texture.bounds
    x, y, z = np.abs(np.concatenate([starts, ends])).max(axis=0).tolist()
    across = math.hypot(x, y)
    height = max(map(abs, texture.extremes)) + z
    sides = np.linalg.norm(texture.domain.spans, axis=1) / texture.sample_counts()
    lowest = float(np.minimum(starts, ends)[:, 2].min())
    depth = max(surface.law.contact.extremes(texture)[1] - lowest, 0.0)
    upward = height + slope * across
    sideways = slope * upward + depth * (hessian * across + slope + height / sides.min())
    move = np.abs(ends - starts)
    lengths = upward * move[:, 2] + sideways * np.hypot(*move[:, :2].T)
    return _FORCE_ROUNDING * surface.stiffness * float(lengths.max())


def _check_panel_count(panels: float, surface: Surface, path_length: float, wave: float) -> None:
    """Refuse a loop that is too long for the shortest wavelength, before allocating arrays.

    Raises:
        TooSteepError: if it needs too many panels.
    """
    if panels <= _MAX_TOTAL_PANELS:
        return
    length = format_quantity(path_length, "m")
    turn = format_quantity(wave, "m")
    size = "max_deflection" if surface.law.stateful else "max_depth"
    raise TooSteepError(
        "surface",
        f"is too steep for its leak, slopes up to {surface.texture.bounds[0]:.2g}: a loop of "
        f"{length} turns every {turn}; give less amplitude (rms, height) or {size}, or a longer "
        "period (cutoff, pitch)",
    )


def initial_panels(surface: Surface, length: float) -> int:
    """Return the initial number of panels on a straight line of a length [m]."""
    return _panel_count(length, shortest_wavelength(surface), 1)


def _panel_count(length: float, wave: float, edges: int) -> int:
    least = 4 if edges < _MANY_EDGES else 1
    return int(min(max(np.ceil(2.0 * length / wave), least), _MAX_PANELS))


def shortest_wavelength(surface: Surface) -> float:
    """Return the shortest wavelength [m] that the derivative bounds allow: 2π M/K."""
    slope, hessian = surface.texture.bounds
    if hessian <= 0.0:
        return np.inf
    return 2.0 * np.pi * slope / hessian


def _segment_work(
    surface: Surface, segment: AnchoredSegment, wave: float, tolerance: float
) -> float:
    along = segment.end - segment.start
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return 0.0

    def integrand(s: FloatArray) -> FloatArray:
        points = segment.start + s[:, None] * along
        return surface.force(points, deflection=segment.deflection(s)) @ along

    return integrate(
        integrand,
        _panel_count(length, wave, 1),
        tolerance,
        work_rounding(surface, segment.start[None], segment.end[None]),
    )


def integrate(
    integrand: Callable[[FloatArray], FloatArray],
    panels: int,
    tolerance: float = DEFAULT_TOLERANCE,
    rounding: float = 0.0,
) -> float:
    """Return the integral over [0, 1] of a function with kinks and jumps at unknown places.

    Args:
        integrand: function of an array of abscissae.
        panels: initial number of equal panels.
        tolerance: panels are halved until two nested rules agree to this part of the integral of
            the absolute value.
        rounding: error of the integrand, below which none is lowered.

    Raises:
        TooSteepError: if panels become ever more.
    """
    return _integrate_adaptively(
        integrand, np.arange(panels) / panels, np.full(panels, 1.0 / panels), tolerance, rounding
    )


def _integrate_adaptively(
    integrand: Callable[[FloatArray], FloatArray],
    left: FloatArray,
    width: FloatArray,
    tolerance: float,
    rounding: float,
) -> float:
    """Return the integral over panels, halved until two nested rules agree; see integrate()."""
    total = 0.0
    scale = 0.0
    for level in range(_MAX_REFINEMENTS):
        nodes = left[:, None] + width[:, None] * _QUADRATURE_NODES
        # The last node must not be taken for the first one of the next edge.
        nodes[:, -1] = np.nextafter(nodes[:, -1], nodes[:, 0])
        values = integrand(nodes.ravel()).reshape(-1, len(_QUADRATURE_NODES))
        fine = width * (values @ _FINE_WEIGHTS)
        error = np.abs(fine - width * (values[:, ::2] @ _COARSE_WEIGHTS))
        scale = max(scale, float((width * (np.abs(values) @ _FINE_WEIGHTS)).sum()))
        refine = error > np.maximum(tolerance * scale, width * rounding)
        if level == _MAX_REFINEMENTS - 1:
            refine[:] = False
        total += float(fine[~refine].sum())
        if not refine.any():
            break
        if np.count_nonzero(refine) > _MAX_TOTAL_PANELS:
            reason = "cannot be reached: the force is too rough, or rounding is greater"
            raise TooSteepError("tolerance", reason, tolerance)
        half = 0.5 * width[refine]
        left = np.concatenate([left[refine], left[refine] + half])
        width = np.concatenate([half, half])
    return total


@dataclass(frozen=True)
class SplitState:
    """The split god-object at n probe points.

    Attributes:
        potential: energy k U [J], shape (n,); zero outside the body.
        atoms: number of points of the split god-object, shape (n,); zero outside.
        gap: duality gap of the energy [J], shape (n,): the force is exact to
            √(2 (1 + c) k gap) [N].
    """

    potential: FloatArray
    atoms: NDArray[np.intp]
    gap: FloatArray

    def __repr__(self) -> str:
        most = int(np.max(self.atoms, initial=0))
        return f"<SplitState of {np.size(self.atoms)} points, into {most} points at most>"


def split_state(surface: Surface, points: ArrayLike) -> SplitState:
    """Return potential, number of atoms and certified gap of law H.

    U(p) = min over weights on the free set of ½ [|p - z̄|² + (1 - μ) Var w], μ = 1/(1 + c).

    Args:
        surface: a surface with a law on the split contact.
        points: probe positions [m], shape (n, 3), or (3,) for one, with scalar results.

    Raises:
        ParameterError: for another law, another shape, or positions that are not finite.

    Reference:
        docs/theory/split.md.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> steep = Surface(Sinusoid(amplitude=0.8e-3, period=1e-3), "H")
        >>> split_state(steep, [[0.25e-3, 0.0, 0.0], [0.0, 0.0, -1e-5]]).atoms.tolist()
        [2, 1]
    """
    if surface.law.contact is not SPLIT:
        raise ParameterError("surface", f"must have a law on the split contact, not {surface.law}")
    probes = check_points("points", points, 3, "m")
    out = np.empty((probes.count, 3))
    surface._loops.split_batch(probes.rows, out, surface.continuity, surface.texture.arguments)
    potential, atoms, gap = out.T
    k = surface.stiffness
    return SplitState(
        potential=probes.restore_shape(k * potential),
        atoms=probes.restore_shape(atoms.astype(np.intp)),
        gap=probes.restore_shape(k * gap),
    )
