"""Is the force continuous in the position of the probe, and where does it jump if not?"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.gain.answers import kept_answer
from asperity.analysis.gain.medial_axis import Crest, sharpest_crest
from asperity.analysis.gain.theorems import theorem_of
from asperity.checks import FloatArray
from asperity.files import Record
from asperity.surface import Surface
from asperity.textures.texture import Texture
from asperity.units import engineering, rounded_down

Point = tuple[float, float, float]

# Depths between the onset and max_depth at which a jump is located.
LEVELS = 8
# The points of a witness pair are this part of the texture's extent apart.
_APART = 1e-11
# A jump of the foot is this many times longer than the pair is wide: no slope of it is so steep.
_STEEP = 1e4
_SAMPLES = 65
_MOST_STEPS = 512
# A step along the ridge, as a part of the depth; and how well a depth is met.
_LONGEST = 0.5
_SAME_DEPTH = 1e-9
_STARTS = 256


@dataclass(frozen=True)
class Jump(Record):
    """A place where the force jumps, with two witnesses on either side of it.

    Attributes:
        depth: of the witnesses [m], by the law's own contact; 0 where contact begins.
        size: |f(after) - f(before)| [N].
        before: probe position [m] on one side.
        after: probe position [m] on the other, less than 1e-9 of the texture's extent away.
    """

    depth: float
    size: float
    before: Point
    after: Point


@dataclass(frozen=True)
class Continuity(Record):
    """Whether the force jumps inside the working region.

    Attributes:
        continuous: whether it does not.
        reason: one sentence.
        lipschitz: for a continuous force k q [N/m], by which the force changes at most per metre
            along straight paths inside the working region; ``None`` if the force jumps.
        surface: the surface.
    """

    written = "continuous reason lipschitz jumps"

    continuous: bool
    reason: str
    lipschitz: Bound | None = None
    surface: Surface | None = field(default=None, repr=False, compare=False)

    @cached_property
    def jumps(self) -> tuple[Jump, ...]:
        """Where the force jumps, see :func:`jumps`; located when first asked for."""
        if self.continuous or self.surface is None:
            return ()
        return jumps(self.surface)


def continuity(surface: Surface, q: Bound) -> Continuity:
    """Return whether the force is continuous over the working region, and why.

    The force begins at zero where its formula vanishes with the depth. It can jump further in
    only where the contact point jumps, so only for the nearest contact, and there only if it
    depends on more than the depth, which itself never jumps. The nearest point is unique down to
    1/K, K >= ‖Hess h‖: the free set has at least that reach. Below that, the sharpest crest
    says where it jumps first.

    Args:
        surface: the surface.
        q: its characteristic number; infinite where the depth reaches the medial axis.

    Example:
        >>> from asperity.analysis import characteristic_number
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.2e-3, period=1e-3), "D")
        >>> found = continuity(surface, characteristic_number(surface))
        >>> found.continuous, len(found.jumps)
        (False, 8)
    """
    facts = surface.facts
    if not facts.begins_at_zero:
        text = "the force jumps where contact begins: its formula does not vanish with the depth"
        return Continuity(False, text, surface=surface)
    if surface.law.contact.single_valued:
        return _smooth(surface, q, "force and contact point change without jumps")
    if not facts.looks_at_surface:
        return _smooth(surface, q, "the distance to the surface never jumps")
    return _nearest(surface, q)


def _nearest(surface: Surface, q: Bound) -> Continuity:
    """Return whether the medial axis, on which the nearest point jumps, is deeper than max_depth.

    q knows for a law with that theorem; else the sharpest crest does.
    """
    depth = surface.max_depth
    if depth * surface.texture.bounds[1] < 1.0:
        return _smooth(surface, q, "the nearest point is unique down to 1/K, K >= ‖Hess h‖")
    asked = repr((q.lower, q.upper, q.at))
    onset, proved = kept_answer("onset of jumps", surface, lambda: _onset(surface, q), asked)
    if onset <= depth:
        onset_text = engineering(rounded_down(onset), "m")
        text = f"the contact point jumps below crests, from {onset_text} down"
        return Continuity(False, text, surface=surface)
    deep = engineering(depth, "m")
    if proved:
        return _smooth(surface, q, f"no crest is so sharp that the nearest point jumps at {deep}")
    return _smooth(surface, q, f"no medial axis found down to {deep}; the force jumps below it")


def _onset(surface: Surface, q: Bound) -> tuple[float, bool]:
    """Return where jumps begin [m], and whether it is proved that there are none above that."""
    depth = surface.max_depth
    if theorem_of(surface.law).knows_medial_axis:
        onset = math.inf
        if math.isinf(q.lower) and q.at is not None:
            onset = min(_distance(surface, q.at), depth)
        proved = math.isfinite(q.upper)
    else:
        crest = sharpest_crest(surface.texture)
        onset = math.inf if crest is None else crest.radius
        proved = crest is not None and depth < crest.least_radius
    return onset, proved


def _distance(surface: Surface, point: Point) -> float:
    """Return the distance to the surface [m]."""
    return float(np.linalg.norm(surface.texture.nearest([point])[0] - np.array(point)))


def _smooth(surface: Surface, q: Bound, reason: str) -> Continuity:
    k = surface.stiffness
    # One unit in the last place covers the rounding of the product.
    upper = math.nextafter(k * q.upper, math.inf)
    slope = replace(q, lower=k * q.lower, upper=upper, note=f"k q [N/m]; q: {q.note}")
    if math.isinf(upper):
        return Continuity(True, reason, slope, surface)
    text = f"{reason}; Lipschitz constant at most {_rounded_up(upper):.10g} N/m"
    return Continuity(True, text, slope, surface)


def _rounded_up(value: float) -> float:
    """Return the value in three digits, never less than it is, but for rounding of its own."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2) if value > 0.0 else 1.0
    return round(math.ceil(value / step * (1.0 - 1e-12)) * step, 12)


# --- where it jumps -------------------------------------------------------------------------------


def jumps(surface: Surface, levels: int = LEVELS) -> tuple[Jump, ...]:
    """Return where the force jumps, each with two points on either side.

    Where contact begins (depth 0): the greatest jump on the scan line. Below the sharpest crest:
    the ridge of the medial axis is followed from the crest's centre of curvature down to
    max_depth; at equal steps of depth it is crossed at right angles, and the jump of the nearest
    point is enclosed by bisection. The size is the difference of the force at the two points.

    Args:
        surface: the surface.
        levels: at how many depths, at equal steps from the onset (left out: there the jump is
            zero) to max_depth.

    Returns:
        None for a law whose force does not jump.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> surface = Surface(Sinusoid(amplitude=0.2e-3, period=1e-3), "D")
        >>> last = jumps(surface)[-1]
        >>> before, after = surface.force([last.before, last.after])
        >>> bool(np.linalg.norm(after - before) == last.size), f"{last.size:.3f} N"
        (True, '0.611 N')
    """
    facts = surface.facts
    found = [] if facts.begins_at_zero else _first_jump(surface)
    if not surface.law.contact.single_valued and facts.looks_at_surface:
        found += _ridge_jumps(surface, levels)
    # The force of either side is exact to rounding; what is left of no jump is not one.
    rounding = 1e-9 * surface.stiffness * surface.max_depth
    return tuple(jump for jump in found if jump.size > rounding)


def _first_jump(surface: Surface) -> list[Jump]:
    """Return the greatest jump where contact begins, along the scan line."""
    xy = surface.texture.scan_line().points(_STARTS)
    level = surface.law.contact.begin(surface.texture, xy)
    half = 0.5 * _APART * _extent(surface.texture)
    outside, inside = np.column_stack([xy, level + half]), np.column_stack([xy, level - half])
    sizes = np.linalg.norm(surface.force(inside) - surface.force(outside), axis=1)
    worst = int(np.argmax(sizes))
    return [Jump(0.0, float(sizes[worst]), _point(outside[worst]), _point(inside[worst]))]


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
        result.append(Jump(ridge.depth, size, _point(pair[0]), _point(pair[1])))
    return result


class _Ridge:
    """A walk down the medial axis below a crest.

    Let u₁, u₂ be the unit vectors from a point of it to its two nearest points. Its normal there
    is u₂ - u₁; along it, as steeply down as that allows, the depth grows at the rate of the
    upward parts of u₁ and u₂, which are positive: normals of a height function point upwards.
    """

    def __init__(self, texture: Texture, crest: Crest) -> None:
        self.texture = texture
        self.extent = _extent(texture)
        self.place = np.array(crest.centre)
        self.depth = crest.radius
        self.across = _sharpest_direction(texture, crest)
        self._aim((np.array(crest.foot) - self.place) / crest.radius)
        slope, bend = texture.bounds
        # Over a shorter length the height cannot change its course.
        self.reach = 2.0 * math.pi * slope / bend

    def descend(self, depth: float) -> FloatArray | None:
        """Return the witness pair (2, 3) [m] at a depth, reached in steps; none if it is lost."""
        for _ in range(_MOST_STEPS):
            if self.rate <= 0.0:  # below the digits of the points: the ridge is lost
                return None
            run = (depth - self.depth) / self.rate
            # Within the ball that touches the surface a step cannot leave the body.
            longest = _LONGEST * self.depth
            pair = self._step(min(max(run, -longest), longest))
            if pair is None or abs(self.depth - depth) <= _SAME_DEPTH * depth:
                return pair
        return None

    def _step(self, run: float) -> FloatArray | None:
        """Go a length along the ridge as if it were straight, then onto it; return the pair."""
        guess = self.place + run * self.down
        free = float(np.linalg.norm(self.texture.nearest(guess[None, :])[0] - guess))
        widest = min(0.5 * self.reach, 0.9 * free)
        half = min(2.0 * abs(run) + 1e-6 * self.reach, widest)
        pair = self._cross(guess, half)
        while pair is None and half < widest:
            half = min(4.0 * half, widest)
            pair = self._cross(guess, half)
        if pair is None:
            return None
        toward = self.texture.nearest(pair) - pair
        lengths = np.linalg.norm(toward, axis=1)
        first, second = toward / lengths[:, None]
        self.place, self.depth = pair.mean(axis=0), float(lengths.mean())
        self.across = (second - first) / np.linalg.norm(second - first)
        self._aim(0.5 * (first + second))
        return pair

    def _aim(self, toward: FloatArray) -> None:
        """Set the steepest way down along the ridge, and how fast the depth grows on it."""
        down = self.across[2] * self.across - np.array([0.0, 0.0, 1.0])
        self.down = down / np.linalg.norm(down)
        self.rate = -float(self.down @ toward)

    def _cross(self, middle: FloatArray, half: float) -> FloatArray | None:
        """Return the points on either side of the jump of the foot nearest to the middle."""

        def feet(offsets: FloatArray) -> FloatArray:
            return self.texture.nearest(middle + offsets[:, None] * self.across)

        offsets = half * np.linspace(-1.0, 1.0, _SAMPLES)
        ends = feet(offsets)
        gaps = np.linalg.norm(np.diff(ends, axis=0), axis=1)
        wide = np.flatnonzero(gaps >= 0.5 * gaps.max())
        best = int(wide[np.argmin(np.abs(wide + 0.5 - 0.5 * (_SAMPLES - 1)))])
        low, high = _bisect(feet, offsets[best : best + 2], ends[best : best + 2],
                            _APART * self.extent)  # fmt: skip
        pair = middle + np.array([[low], [high]]) * self.across
        left, right = self.texture.nearest(pair)
        apart = np.linalg.norm(pair[1] - pair[0])
        return pair if np.linalg.norm(right - left) > _STEEP * apart else None


def _bisect(
    feet: Callable[[FloatArray], FloatArray], ends: FloatArray, values: FloatArray, width: float
) -> tuple[float, float]:
    """Return an interval of that width, always the half over which the foot moves farther."""
    (low, high), (left, right) = ends, values
    while high - low > width:
        middle = 0.5 * (low + high)
        value = feet(np.array([middle]))[0]
        if np.linalg.norm(value - left) > np.linalg.norm(right - value):
            high, right = middle, value
        else:
            low, left = middle, value
    return float(low), float(high)


def _sharpest_direction(texture: Texture, crest: Crest) -> FloatArray:
    """Return the unit tangent (3,) of greatest downward curvature at the crest."""
    _h, p, q, r, s, t = texture.derivatives([crest.foot[:2]])[0]
    metric = np.array([[1.0 + p * p, p * q], [p * q, 1.0 + q * q]])
    inverse = np.linalg.inv(np.linalg.cholesky(metric))
    _curvatures, directions = np.linalg.eigh(inverse @ np.array([[r, s], [s, t]]) @ inverse.T)
    a, b = inverse.T @ directions[:, 0]
    tangent = np.array([a, b, p * a + q * b])
    return np.asarray(tangent / np.linalg.norm(tangent))


def _extent(texture: Texture) -> float:
    """Return the shortest edge of the domain [m]."""
    return float(np.linalg.norm(texture.domain.spans, axis=1).min())


def _point(values: FloatArray) -> Point:
    x, y, z = (float(value) for value in values)
    return x, y, z
