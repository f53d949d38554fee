"""Straight scans at constant height: their lines, and the strength and support of a law on them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.analysis.bounds.bound import NORM, spectral_norm
from asperity.analysis.bounds.sampling import dense_maximum
from asperity.analysis.gain.characteristic import cached_number
from asperity.analysis.gain.surface_cache import cached_result
from asperity.analysis.gain.theorems import theorem_on
from asperity.core.checks import FloatArray, check_array
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable
from asperity.surface import Surface
from asperity.textures.domain import Domain
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


# Further lines across a map, by whether the contact searches: directions, and lines in each.
_DIRECTIONS = {False: 12, True: 4}
_CHORDS = {False: 12, True: 3}


def lines_across(surface: Surface) -> tuple[list[ScanLine], int]:
    """Return lines across a map in many directions, and the number of directions.

    Each is the part of a straight line within the domain of the texture; none on a profile, where
    no other plane is worse than that across the grooves.
    """
    domain = surface.texture.domain
    if surface.texture.is_profile:
        return [], 0
    costly = surface.law.contact.requires_search
    lines = []
    for angle in np.arange(_DIRECTIONS[costly]) * (math.pi / _DIRECTIONS[costly]):
        direction = np.array([math.cos(angle), math.sin(angle)])
        across = np.array([-direction[1], direction[0]])
        reach = domain.spans @ across
        low = float(np.minimum(reach, 0.0).sum())
        width = float(np.abs(reach).sum())
        for part in (np.arange(_CHORDS[costly]) + 0.5) / _CHORDS[costly]:
            start, length = _clip_to_domain(domain, (low + part * width) * across, direction)
            lines.append(ScanLine(start, direction, length, periodic=False))
    return lines, _DIRECTIONS[costly]


def _clip_to_domain(
    domain: Domain, offset: FloatArray, direction: FloatArray
) -> tuple[FloatArray, float]:
    """Return start and length [m] of the part of a line in the domain of a map."""
    place, rate = np.linalg.solve(domain.spans.T, np.stack([offset, direction]).T).T
    with np.errstate(divide="ignore"):
        ends = np.stack([-place / rate, (1.0 - place) / rate])
    first = float(ends.min(axis=0).max())
    return domain.origin + offset + first * direction, float(ends.max(axis=0).min()) - first


@dataclass(frozen=True)
class FrictionScan(Serializable):
    """Friction on the scan line at the height of :func:`merit`, sliding.

    Attributes:
        mean: mean force of friction against the motion [N].
        ripple: RMS of its oscillating part [N].
        remaining: that over the RMS with which the slip limit oscillates [1]; less than 1 where the
            limit changes along the line by more than κ.
    """

    mean: float
    ripple: float
    remaining: float


def friction_scan(surface: Surface) -> FrictionScan | None:
    """Return the friction on a straight scan; ``None`` for a surface without friction.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> options = {"friction": 0.5, "presliding_stiffness": 1e3, "friction_modulation": 1.0}
        >>> wall = Surface(Sinusoid(1e-4, 1e-3), "W", 1000.0, 2e-4, **options)
        >>> scan = friction_scan(wall)
        >>> round(scan.mean, 3), round(scan.ripple, 4), round(scan.remaining, 2)
        (0.05, 0.0354, 1.0)
    """
    friction = surface.contact_friction
    if friction is None:
        return None
    line = surface.texture.scan_line()
    along = np.append(line.direction, 0.0)
    way = np.linspace(-line.length, line.length, 2 * _SCAN_POINTS_PER_LINE)
    path = np.full((len(way), 3), scan_height(surface))
    path[:, :2] = line.start + way[:, None] * line.direction
    law = surface.force(path)
    beyond = np.tile(along[: friction.axes], (len(way), 1))
    beyond *= surface.deflection_beyond_limit(friction, path)
    forces = law - surface.trace(path), law - surface.force(path, beyond)
    rendered, limit = (force[_SCAN_POINTS_PER_LINE:] @ along for force in forces)
    ripple = float(rendered.std())
    varies = float(limit.std()) > 1e-9 * float(np.abs(limit).max())
    remaining = ripple / float(limit.std()) if varies else 1.0
    return FrictionScan(float(rendered.mean()), ripple, remaining)


_SCAN_POINTS_PER_LINE = 2048
_NEAREST_SCAN_POINTS = {True: 2048, False: 128}


@dataclass(frozen=True)
class Merit:
    """Strength and support of a law on a straight scan at constant height.

    Attributes:
        strength: T, RMS of the oscillating force / (sup‖J‖ · l) [1]; without a period,
            RMS / sup‖J‖ [m].
        support: S, d⟨f_z⟩/d depth / sup‖J‖ [1].
        ripple: RMS of the oscillating force over the stiffness, RMS/k [m].
        gain: sup‖J‖/k over the body above the scan height [1].
        height: z of the scan [m].
        contact_lost: fraction of the scan without contact.
    """

    strength: float
    support: float
    ripple: float
    gain: float
    height: float
    contact_lost: float


def merit(surface: Surface) -> Merit:
    """Return strength and support (docs/theory/merit.md), sampled.

    The scan runs at z = max h - max_depth (vertical and nearest contact) or z = -max_depth
    (nominal contact), along the texture's scan line; on a map along parallel lines, each with
    its own mean. A law with state slides, its anchor trailing the probe at full deflection.
    """
    return cached_result("merit", surface, _compute_merit)


def _compute_merit(surface: Surface) -> Merit:
    line = surface.texture.scan_line()
    height = scan_height(surface)
    scan = scan_force(surface)
    gain = _gain_above_height(surface, height)
    unit = line.length if line.periodic else 1.0
    if math.isinf(gain) or gain == 0.0:  # a constant force has neither
        strength = support = 0.0
    else:
        strength = scan.ripple / (gain * unit)
        support = scan.slope / gain
    return Merit(strength, support, scan.ripple, gain, height, scan.contact_lost)


@dataclass(frozen=True)
class ScanForce:
    """The force on the scan of :func:`merit`, per stiffness.

    Attributes:
        ripple: RMS of the oscillating force over the stiffness [m].
        peak: greatest magnitude of the oscillating force over the stiffness [m].
        slope: mean of d f_z/d depth over the stiffness [1].
        contact_lost: fraction of the scan without contact.
    """

    ripple: float
    peak: float
    slope: float
    contact_lost: float


def scan_force(surface: Surface, points: int | None = None) -> ScanForce:
    """Return what :func:`merit` tells of the force on its scan, without the gain.

    Args:
        surface: the surface.
        points: of each scan line, without the cache; by default those of ``merit``.
    """
    if points is not None:
        return _scan_force(surface, points)
    return cached_result("scan force", surface, _scan_force)


def _scan_force(surface: Surface, points: int | None = None) -> ScanForce:
    line = surface.texture.scan_line()
    height = scan_height(surface)
    forces, slopes, lost = _scan_forces_and_slopes(surface, line, height, points)
    squares = np.square(forces - forces.mean(axis=1, keepdims=True)).sum(axis=2)
    size = float(np.mean(np.square(forces).sum(axis=2)))
    variance = float(squares.mean())
    # The variance of a constant force is rounding.
    peak = float(squares.max()) if variance > 1e-24 * size else 0.0
    return ScanForce(
        math.sqrt(variance if peak else 0.0), math.sqrt(peak), float(slopes.mean()), lost
    )


def sliding_state(surface: Surface, count: int) -> tuple[NDArray[Any], ...]:
    """Return deflection and sliding of a law with state that slides along its scan line."""
    if not surface.law.stateful:
        return ()
    deflection = surface.max_deflection * surface.texture.scan_line().direction
    return np.tile(deflection, (count, 1)), np.ones(count, dtype=bool)


def _scan_forces_and_slopes(
    surface: Surface, line: ScanLine, height: float, points: int | None = None
) -> tuple[FloatArray, FloatArray, float]:
    """Return f/k and -J_zz/k on the scan, and the fraction without contact."""
    costly = surface.law.contact.requires_search
    count = _NEAREST_SCAN_POINTS[surface.texture.is_profile] if costly else _SCAN_POINTS_PER_LINE
    xy = parallel_line_points(surface.texture, line, points or count)
    shape = xy.shape[:2]
    flat = np.column_stack([xy.reshape(-1, 2), np.full(math.prod(shape), height)])
    forces, jacobians = surface.force_and_jacobian(flat, *sliding_state(surface, len(flat)))
    lost = float(np.mean(~jacobians.any(axis=(1, 2))))
    slopes = -jacobians[:, 2, 2].reshape(shape) / surface.stiffness
    return forces.reshape(*shape, 3) / surface.stiffness, slopes, lost


def _gain_above_height(surface: Surface, height: float) -> float:
    """Return sup‖J‖/k over the body above a height: by theorem, else sampled."""
    proved = theorem_on(surface).gain_above_height
    if proved is not None:  # q covers this part of the body, and may be less
        return min(proved(surface, height), cached_number(surface, NORM).upper)

    def limit(derivatives: FloatArray) -> FloatArray:
        return surface.law.contact.depth_at_height(height, derivatives)

    return dense_maximum(surface, spectral_norm, limit).value
