"""The resolution of a renderer: noise, steps of position, and steps of force.

Below these scales a secant shows the steps and not the renderer: in single precision at 0.3 m, a
secant of 1 nm has 22 times the true gain. They are found first; a change of force counts only
beyond what they explain, and distances are long enough for that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.certification.region import RendererCalls
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable

_REPEATS = 48
_PLACES = 12
_SAMPLES = 512
_SPANS = 10.0 ** np.arange(-9.0, -2.0)
"""Lengths of the lines on which steps are looked for [m]."""
_SHORTEST_STEP = 1e-7
_STEPS_PER_SECANT = 40.0
_ROUNDING = 1e-7


@dataclass(frozen=True)
class Resolution(Serializable):
    """What the renderer itself makes uncertain.

    Attributes:
        noise: greatest difference between repeated calls, doubled [N]; 0 if they agree.
        position_step: greatest distance on each axis over which the force does not change [m].
        force_step: common divisor of the forces [N]; 0 if there is none.
        secant: length of the secants that count [m].
    """

    noise: float
    position_step: tuple[float, float, float]
    force_step: float
    secant: float

    @property
    def position_error(self) -> float:
        """Distance by which the position may be off [m]."""
        return math.hypot(*self.position_step)

    @property
    def force_error(self) -> float:
        """Difference of two forces that noise and steps explain [N]."""
        return self.noise + math.sqrt(3.0) * self.force_step

    def explained(self, gain: float) -> float:
        """Return the change of force that noise and steps explain for a gain [N/m], in N."""
        return self.force_error + 2.0 * gain * self.position_error


def find_resolution(calls: RendererCalls, points: FloatArray, effort: float = 1.0) -> Resolution:
    """Return the resolution of a renderer near points with a force, shape (n, 3).

    Args:
        calls: the renderer.
        points: [m].
        effort: share of the places that are tried.
    """
    places = points[: max(2, int(effort * _PLACES))]
    repeated = calls.at(np.repeat(places, _REPEATS, axis=0)).reshape(len(places), _REPEATS, 3)
    noise = 2.0 * float(np.nanmax(np.ptp(repeated, axis=1), initial=0.0))
    force_step = 0.0 if noise else _common_step(calls.at(points))
    steps = _position_steps(calls, places, noise)
    typical = _typical_gain(calls, places)
    secant = max(_SHORTEST_STEP, _STEPS_PER_SECANT * max(steps))
    if typical > 0.0:
        secant = max(secant, _STEPS_PER_SECANT * (noise + force_step) / typical)
    return Resolution(noise, steps, force_step, min(secant, 0.05 * float(calls.region.size.max())))


def _common_step(forces: FloatArray) -> float:
    """Return the step of which all components of forces are multiples [N]; 0 if there is none.

    Forces of single precision have no common step: their steps depend on the magnitude.
    """
    values = np.unique(np.abs(forces[np.isfinite(forces)]))
    gaps = np.diff(values)
    gaps = gaps[gaps > 1e-12 * values.max(initial=0.0)]
    if len(gaps) < 2:
        return 0.0
    step = float(gaps.min())
    multiples = values / step
    is_multiple = np.abs(multiples - np.round(multiples)) < 1e-3
    few = values.max() / step < 1e5
    return step if few and is_multiple.all() and len(gaps) > 4 else 0.0


def _position_steps(
    calls: RendererCalls, places: FloatArray, noise: float
) -> tuple[float, float, float]:
    """Return the longest distance on each axis over which the force stays the same, then jumps.

    Steps that change the force by less than the noise [N], or by its rounding, do not count.
    """
    least = max(noise, _ROUNDING * calls.largest_force)
    steps = np.zeros(3)
    region = calls.region
    for axis in range(3):
        for span in _SPANS[region.size[axis] >= _SPANS]:
            lines = np.repeat(places[:, None], _SAMPLES, axis=1)
            first = np.minimum(places[:, axis] - 0.5 * span, region.high[axis] - span)
            first = np.maximum(first, region.low[axis])
            lines[..., axis] = first[:, None] + np.linspace(0.0, span, _SAMPLES)
            forces = calls.at(lines.reshape(-1, 3)).reshape(lines.shape)
            changes = np.asarray((np.abs(np.diff(forces, axis=1)) > least).any(axis=2))
            counts = changes.sum(axis=1)
            # A smooth part beside a flat one changes from sample to sample, which steps do not.
            adjacent = (changes[:, 1:] & changes[:, :-1]).sum(axis=1)
            is_stepped = (counts >= 4) & (counts < 0.5 * _SAMPLES) & (adjacent <= 0.05 * counts)
            for line in changes[is_stepped]:
                ends = np.flatnonzero(line)
                plateau = float(np.median(np.diff(ends))) * span / (_SAMPLES - 1)
                steps[axis] = max(steps[axis], plateau)
    x, y, z = steps.tolist()
    return x, y, z


def _typical_gain(calls: RendererCalls, places: FloatArray) -> float:
    """Return the median of the secants of 1 % of the region, or half its height [N/m]."""
    region = calls.region
    length = min(0.01 * float(region.size.max()), 0.5 * float(region.size[2]))
    ends = places.copy()
    ends[:, 2] += np.where(places[:, 2] + length <= region.high[2], length, -length)
    change = calls.at(ends) - calls.at(places)
    gains = np.sqrt(np.square(change).sum(axis=1)) / length
    return float(np.nanmedian(gains)) if len(gains) else 0.0
