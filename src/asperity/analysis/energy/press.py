"""The press: the mean normal force on a scan at constant height, and the depth that it reaches."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from asperity.analysis.energy.straight_scan import parallel_line_points, scan_height
from asperity.analysis.gain.surface_cache import cached_result
from asperity.analysis.gain.theorems import theorem_on
from asperity.core.checks import FloatArray
from asperity.surface import Surface

_POINTS = 2048
_NEAREST_POINTS = {True: 1024, False: 128}
_PERIODS = 4
_TOLERANCE = 1e-6
_DOUBLING = math.log(2.0)
_MAX_DOUBLINGS = 24
_MAX_HALVINGS = 8
_EDGE_HALVINGS = 4
_LEAST_SHARE = 1e-300
_ROOT_TOLERANCE = 1e-4
# Growth of the press per doubling of the depth below which it counts as its greatest.
_LEAST_GAIN = 1.01


def mean_press(surface: Surface) -> float:
    """Return the mean of f_z [N] over the scan at ``max_depth``; of a body, where there is contact.

    The scan runs at z = max h - max_depth, or -max_depth on the nominal contact, as in
    :func:`~asperity.analysis.energy.straight_scan.merit`; with that press a hand reaches
    ``max_depth``.
    """
    return cached_result("mean press", surface, _mean_force) * surface.stiffness


def scan_force_peak(surface: Surface) -> float:
    """Return the greatest magnitude of the force [N] on that scan, forth and back, with friction.

    A periodic texture is scanned over several periods, until friction has its full force.
    """
    points = _scan_points(surface)
    line = surface.texture.scan_line()
    if line.periodic:
        period = np.append(line.length * line.direction, 0.0)
        points = np.concatenate([points + k * period for k in range(_PERIODS)], axis=1)
    paths = np.concatenate([points, points[:, ::-1]], axis=1)
    return float(np.linalg.norm(surface.trace(paths.reshape(-1, 3)), axis=1).max())


def _mean_force(surface: Surface) -> float:
    forces = surface.force(_scan_points(surface).reshape(-1, 3))[:, 2]
    if surface.texture.is_body and forces.any():
        forces = forces[forces != 0.0]  # nobody presses beside a body
    return float(forces.mean())


def _scan_points(surface: Surface) -> FloatArray:
    """Return the points [m] of the scan at ``max_depth``, shape (lines, n, 3)."""
    count = _POINTS
    if surface.law.contact.requires_search:
        count = _NEAREST_POINTS[surface.texture.is_profile]
    xy = parallel_line_points(surface.texture, surface.texture.scan_line(), count)
    return np.dstack([xy, np.full(xy.shape[:2], scan_height(surface))])


def holds_at_any_press(surface: Surface) -> bool:
    """Return whether what is proved down to ``max_depth`` holds at every depth.

    So it does where a clamp holds the whole force, and for laws whose numbers are the same.
    """
    clamped = surface.effective_clamp.holds_whole_force
    return clamped or theorem_on(surface).holds_at_any_depth(surface)


def depth_at_press(surface: Surface, press: float) -> float:
    """Return the depth [m] at which the mean normal force is a press [N].

    Args:
        surface: the surface at its stiffness; its ``max_depth`` does not count.
        press: F [N].

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> wall = Surface(Sinusoid(1e-4, 1e-3), "W", 500.0)
        >>> round(depth_at_press(wall, 0.2), 9)
        0.0004
    """
    from scipy.optimize import brentq

    def excess(depth: float) -> float:
        return (_press_at(surface, depth) if depth > 0.0 else 0.0) - press

    low = 0.0
    high = press / surface.stiffness
    while excess(high) < 0.0:
        low = high
        high *= 2.0
    return float(brentq(excess, low, high, xtol=_TOLERANCE * high))


def _press_at(surface: Surface, depth: float) -> float:
    return _mean_force(surface.to_depth(depth))


def region_of_press(
    surface: Surface, press: float, start: Callable[[Surface], float]
) -> tuple[float | None, float]:
    """Return the least depth at which a law, at its start, is pressed with a force; and the force.

    A deeper region has a smaller start, and a greater press at it: the least depth D with
    start(D) m(D) >= F gives the stiffest start, m being the mean force per stiffness.

    Args:
        surface: the surface.
        press: F [N].
        start: start [N/m] of a surface for its ``max_depth``; 0 for none.

    Returns:
        The depth [m], ``None`` if no depth has that press; and the greatest press found [N].
    """
    from scipy.optimize import brentq

    unit = surface.to_stiffness(1.0)

    @cache
    def excess(logarithm: float) -> float:
        depth = math.exp(logarithm)
        stiffness = start(surface.to_depth(depth))
        if not stiffness:
            return math.nan
        return math.log(max(stiffness * _press_at(unit, depth) / press, _LEAST_SHARE))

    stiffness = start(surface)
    first_depth = press / stiffness if stiffness else surface.max_depth
    low, high = _bracket(excess, math.log(first_depth))
    if high is None:
        greatest = 0.0 if math.isnan(excess(low)) else math.exp(excess(low))
        return None, press * greatest
    if excess(low) >= 0.0:
        return math.exp(low), press
    return math.exp(brentq(excess, low, high, xtol=_ROOT_TOLERANCE)), press


def _bracket(excess: Callable[[float], float], depth: float) -> tuple[float, float | None]:
    """Return a depth with too little press, and one with enough; ``None`` if there is none.

    Depths are natural logarithms; without a start the excess is NaN.
    """
    value = excess(depth)
    for _ in range(_MAX_HALVINGS):
        if value < 0.0:
            break
        depth -= _DOUBLING
        value = excess(depth)
    for _ in range(_MAX_DOUBLINGS):
        deeper = excess(depth + _DOUBLING)
        if deeper >= 0.0:
            return depth, depth + _DOUBLING
        if math.isnan(deeper):
            return _deepest_start(excess, depth)
        if math.log(_LEAST_SHARE) < deeper <= value + math.log(_LEAST_GAIN):
            break
        depth += _DOUBLING
        value = deeper
    return depth, None


def _deepest_start(excess: Callable[[float], float], depth: float) -> tuple[float, float | None]:
    """Return the same for a depth beyond whose double there is no start."""
    step = _DOUBLING
    for _ in range(_EDGE_HALVINGS):
        step *= 0.5
        if excess(depth + step) >= 0.0:
            return depth, depth + step
        if excess(depth + step) > excess(depth):
            depth += step
    return depth, None
