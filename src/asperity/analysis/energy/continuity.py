"""Continuity of the force in the probe position, and the places where it jumps."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from functools import cached_property

import numpy as np

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.gain.medial_axis import Crest, sharpest_crest
from asperity.analysis.gain.surface_cache import cached_result
from asperity.analysis.gain.theorems import theorem_on
from asperity.core.checks import FloatArray
from asperity.core.display import Text
from asperity.core.files import OMITTED, Serializable, written
from asperity.surface import Surface
from asperity.textures.texture import Texture

Point = tuple[float, float, float]


class ContinuityCause(Enum):
    """Why the force is continuous, or not."""

    JUMP_AT_CONTACT = auto()
    """The formula does not vanish with the depth."""
    SINGLE_VALUED = auto()
    """Force and contact point change without jumps."""
    DISTANCE = auto()
    """The force depends on the distance to the surface alone."""
    CURVATURE = auto()
    """The bound of the second derivatives makes the nearest point unique."""
    CRESTS = auto()
    """The contact point jumps below crests."""
    NOT_FOUND = auto()
    """No medial axis was found down to max_depth."""
    BLUNT_CRESTS = auto()
    """It is proved that no crest is so sharp."""


# Depths between the onset and max_depth at which a jump is located.
JUMP_LEVELS = 8
# Distance of the points of a witness pair, relative to the texture's extent.
_PAIR_DISTANCE = 1e-11
# A jump of the closest point is this many times longer than the pair is wide: no slope is so steep.
_JUMP_RATIO = 1e4
_CROSSING_SAMPLES = 65
_MAX_STEPS = 512
# Greatest step along the ridge relative to the depth, and the tolerance of a depth.
_MAX_STEP = 0.5
_DEPTH_TOLERANCE = 1e-9
_SCAN_POINTS = 256


@dataclass(frozen=True)
class Jump(Serializable):
    """A place where the force jumps, with a witness on either side of it.

    Attributes:
        depth: depth of the witnesses [m], by the law's own contact; 0 where contact begins.
        size: |f(after) - f(before)| [N].
        before: probe position [m] on one side.
        after: probe position [m] on the other, less than 1e-9 of the texture's extent away.
    """

    depth: float
    size: float
    before: Point
    after: Point


@dataclass(frozen=True)
class Continuity(Serializable):
    """Whether the force jumps inside the working region.

    Attributes:
        continuous: whether the force is continuous.
        cause: the reason.
        surface: the surface.
        lipschitz: Lipschitz constant k q [N/m] of a continuous force along straight paths inside
            the working region; ``None`` if the force jumps.
        onset: depth [m] from which the contact point jumps below crests; 0 where that is not the
            cause.
    """

    continuous: bool
    cause: ContinuityCause = field(metadata=OMITTED)
    surface: Surface = field(repr=False, compare=False, metadata=OMITTED)
    lipschitz: Bound | None = None
    onset: float = field(default=0.0, metadata=OMITTED)
    reason = Text[str]("The reason, in one sentence.")

    @cached_property
    @written
    def jumps(self) -> tuple[Jump, ...]:
        """Jumps of the force, see :func:`find_jumps`; located on first access."""
        if self.continuous:
            return ()
        return find_jumps(self.surface)


def continuity(surface: Surface, q: Bound) -> Continuity:
    """Return whether the force is continuous over the working region, and why.

    The force starts at zero where its formula vanishes with the depth. Deeper it can jump only
    where the contact point jumps, so only for the nearest contact, and there only if it depends on
    more than the depth, which never jumps. The closest point is unique down to 1/K,
    K >= ‖Hess h‖: the free set has at least that reach. Further down, the sharpest crest
    determines the onset of jumps.

    Args:
        surface: the surface.
        q: its characteristic number; infinite where the depth reaches the medial axis.

    Example:
        >>> from asperity.analysis import characteristic_number
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.2e-3, period=1e-3), "D")
        >>> result = continuity(surface, characteristic_number(surface))
        >>> result.continuous, len(result.jumps)
        (False, 8)
    """
    facts = surface.facts
    if not facts.vanishes_at_contact:
        return Continuity(False, ContinuityCause.JUMP_AT_CONTACT, surface)
    if surface.law.contact.single_valued:
        return _continuous_force(surface, q, ContinuityCause.SINGLE_VALUED)
    if not facts.depends_on_surface:
        return _continuous_force(surface, q, ContinuityCause.DISTANCE)
    return _nearest_continuity(surface, q)


def _nearest_continuity(surface: Surface, q: Bound) -> Continuity:
    """Return whether the medial axis, where the closest point jumps, is deeper than max_depth.

    For a law with that theorem q decides, else the sharpest crest.
    """
    depth = surface.max_depth
    if depth * surface.texture.bounds[1] < 1.0:
        return _continuous_force(surface, q, ContinuityCause.CURVATURE)
    key = repr((q.lower, q.upper, q.at))
    onset, proved = cached_result("onset of jumps", surface, lambda unit: _jump_onset(unit, q), key)
    if onset <= depth:
        return Continuity(False, ContinuityCause.CRESTS, surface, onset=onset)
    cause = ContinuityCause.BLUNT_CRESTS if proved else ContinuityCause.NOT_FOUND
    return _continuous_force(surface, q, cause)


def _jump_onset(surface: Surface, q: Bound) -> tuple[float, bool]:
    """Return the onset of jumps [m], and whether their absence above max_depth is proved."""
    depth = surface.max_depth
    if theorem_on(surface).detects_medial_axis:
        onset = math.inf
        if math.isinf(q.lower) and q.at is not None:
            distance = np.linalg.norm(surface.texture.nearest([q.at])[0] - np.array(q.at))
            onset = min(float(distance), depth)
        proved = math.isfinite(q.upper)
    else:
        crest = sharpest_crest(surface.texture)
        onset = math.inf if crest is None else crest.radius
        proved = crest is not None and depth < crest.min_radius
    return onset, proved


def _continuous_force(surface: Surface, q: Bound, cause: ContinuityCause) -> Continuity:
    k = surface.stiffness
    # One unit in the last place covers the rounding of the product.
    upper = math.nextafter(k * q.upper, math.inf)
    slope = replace(q, lower=k * q.lower, upper=upper, note=f"k q [N/m]; q: {q.note}")
    return Continuity(True, cause, surface, slope)


# --- jumps ----------------------------------------------------------------------------------------


def find_jumps(surface: Surface, levels: int = JUMP_LEVELS) -> tuple[Jump, ...]:
    """Return the jumps of the force, each with a point on either side.

    Where contact begins (depth 0): the greatest jump on the scan line. Below the sharpest crest:
    the ridge of the medial axis is followed from the crest's centre of curvature down to
    max_depth; at equal steps of depth it is crossed at right angles, and the jump of the closest
    point is enclosed by bisection. The size is the difference of the force at the two points.

    Args:
        surface: the surface.
        levels: number of depths, at equal steps from the onset (excluded: there the jump is zero)
            to max_depth.

    Returns:
        The jumps; empty for a continuous force.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.2e-3, period=1e-3), "D")
        >>> last = find_jumps(surface)[-1]
        >>> before, after = surface.force([last.before, last.after])
        >>> bool(np.linalg.norm(after - before) == last.size), f"{last.size:.3f} N"
        (True, '0.611 N')
    """
    facts = surface.facts
    jumps = []
    if not facts.vanishes_at_contact:
        jumps += _jump_at_contact(surface)
    if not surface.law.contact.single_valued and facts.depends_on_surface:
        jumps += _ridge_jumps(surface, levels)
    # The forces are exact up to rounding; smaller differences are not jumps.
    rounding = 1e-9 * surface.stiffness * surface.max_depth
    return tuple(jump for jump in jumps if jump.size > rounding)


def _jump_at_contact(surface: Surface) -> list[Jump]:
    """Return the greatest jump where contact begins, along the scan line."""
    xy = surface.texture.scan_line().points(_SCAN_POINTS)
    level = surface.law.contact.contact_height(surface.texture, xy)
    half = 0.5 * _PAIR_DISTANCE * _shortest_span(surface.texture)
    outside = np.column_stack([xy, level + half])
    inside = np.column_stack([xy, level - half])
    sizes = np.linalg.norm(surface.force(inside) - surface.force(outside), axis=1)
    worst = int(np.argmax(sizes))
    return [Jump(0.0, float(sizes[worst]), _to_point(outside[worst]), _to_point(inside[worst]))]


def _ridge_jumps(surface: Surface, levels: int) -> list[Jump]:
    crest = sharpest_crest(surface.texture)
    if crest is None or crest.radius >= surface.max_depth:
        return []
    ridge = _Ridge(surface.texture, crest)
    result = []
    for level in range(1, levels + 1):
        depth = crest.radius + (surface.max_depth - crest.radius) * level / levels
        pair = ridge.descend(depth)
        if pair is None:
            break
        forces = surface.force(pair)
        size = float(np.linalg.norm(forces[1] - forces[0]))
        result.append(Jump(ridge.depth, size, _to_point(pair[0]), _to_point(pair[1])))
    return result


class _Ridge:
    """A path down the medial axis below a crest.

    Let u₁, u₂ be the unit vectors from a point of the axis to its two closest points. Its normal
    there is u₂ - u₁; along the axis, in steepest descent, the depth grows at the rate of the upward
    components of u₁ and u₂, which are positive: normals of a height function point upwards.
    """

    def __init__(self, texture: Texture, crest: Crest) -> None:
        self.texture = texture
        self.extent = _shortest_span(texture)
        self.position = np.array(crest.centre)
        self.depth = crest.radius
        self.across = _sharpest_direction(texture, crest)
        self._update_direction((np.array(crest.point) - self.position) / crest.radius)
        slope, hessian = texture.bounds
        # The shortest wavelength that the derivative bounds allow.
        self.wavelength = 2.0 * math.pi * slope / hessian

    def descend(self, depth: float) -> FloatArray | None:
        """Return the witness pair (2, 3) [m] at a depth; ``None`` if the ridge is lost."""
        for _ in range(_MAX_STEPS):
            if self.rate <= 0.0:  # below the precision of the points
                return None
            run = (depth - self.depth) / self.rate
            # A step within the ball that touches the surface cannot leave the body.
            longest = _MAX_STEP * self.depth
            pair = self._advance(min(max(run, -longest), longest))
            if pair is None or abs(self.depth - depth) <= _DEPTH_TOLERANCE * depth:
                return pair
        return None

    def _advance(self, run: float) -> FloatArray | None:
        """Step along the tangent of the ridge and back onto it; return the pair."""
        guess = self.position + run * self.down
        free = float(np.linalg.norm(self.texture.nearest(guess[None, :])[0] - guess))
        widest = min(0.5 * self.wavelength, 0.9 * free)
        half = min(2.0 * abs(run) + 1e-6 * self.wavelength, widest)
        pair = self._bracket_jump(guess, half)
        while pair is None and half < widest:
            half = min(4.0 * half, widest)
            pair = self._bracket_jump(guess, half)
        if pair is None:
            return None
        toward = self.texture.nearest(pair) - pair
        lengths = np.linalg.norm(toward, axis=1)
        first, second = toward / lengths[:, None]
        self.position = pair.mean(axis=0)
        self.depth = float(lengths.mean())
        self.across = (second - first) / np.linalg.norm(second - first)
        self._update_direction(0.5 * (first + second))
        return pair

    def _update_direction(self, toward: FloatArray) -> None:
        """Set the direction of steepest descent along the ridge, and the rate of the depth."""
        down = self.across[2] * self.across - np.array([0.0, 0.0, 1.0])
        self.down = down / np.linalg.norm(down)
        self.rate = -float(self.down @ toward)

    def _bracket_jump(self, middle: FloatArray, half: float) -> FloatArray | None:
        """Return the points on either side of the closest point's jump nearest to the middle."""

        def closest_points(offsets: FloatArray) -> FloatArray:
            return self.texture.nearest(middle + offsets[:, None] * self.across)

        offsets = half * np.linspace(-1.0, 1.0, _CROSSING_SAMPLES)
        ends = closest_points(offsets)
        gaps = np.linalg.norm(np.diff(ends, axis=0), axis=1)
        wide = np.flatnonzero(gaps >= 0.5 * gaps.max())
        best = int(wide[np.argmin(np.abs(wide + 0.5 - 0.5 * (_CROSSING_SAMPLES - 1)))])
        part = slice(best, best + 2)
        width = _PAIR_DISTANCE * self.extent
        low, high = _bisect(closest_points, offsets[part], ends[part], width)
        pair = middle + np.array([[low], [high]]) * self.across
        left, right = self.texture.nearest(pair)
        apart = np.linalg.norm(pair[1] - pair[0])
        if np.linalg.norm(right - left) <= _JUMP_RATIO * apart:
            return None
        return pair


def _bisect(
    closest_points: Callable[[FloatArray], FloatArray],
    ends: FloatArray,
    values: FloatArray,
    width: float,
) -> tuple[float, float]:
    """Return an interval of that width by bisection towards the greater change."""
    (low, high) = ends
    (left, right) = values
    while high - low > width:
        middle = 0.5 * (low + high)
        value = closest_points(np.array([middle]))[0]
        if np.linalg.norm(value - left) > np.linalg.norm(right - value):
            high = middle
            right = value
        else:
            low = middle
            left = value
    return float(low), float(high)


def _sharpest_direction(texture: Texture, crest: Crest) -> FloatArray:
    """Return the unit tangent (3,) of greatest downward curvature at the crest."""
    _h, p, q, r, s, t = texture.derivatives([crest.point[:2]])[0]
    metric = np.array([[1.0 + p * p, p * q], [p * q, 1.0 + q * q]])
    inverse = np.linalg.inv(np.linalg.cholesky(metric))
    _curvatures, directions = np.linalg.eigh(inverse @ np.array([[r, s], [s, t]]) @ inverse.T)
    a, b = inverse.T @ directions[:, 0]
    tangent = np.array([a, b, p * a + q * b])
    return np.asarray(tangent / np.linalg.norm(tangent))


def _shortest_span(texture: Texture) -> float:
    """Return the shortest edge of the domain [m]."""
    return float(np.linalg.norm(texture.domain.spans, axis=1).min())


def _to_point(values: FloatArray) -> Point:
    x, y, z = (float(value) for value in values)
    return x, y, z
