"""Dependence on history: the force at one point after different approaches, and after a reset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.certification.region import RendererCalls
from asperity.certification.resolution import Resolution
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable

_POINTS = 48
_APPROACHES = 8
_STEPS = (1, 20, 200)


@dataclass(frozen=True)
class History(Serializable):
    """How the force at a point depends on what was before.

    Attributes:
        spread: greatest difference of the forces at one point after different approaches [N]; 0
            where noise and steps explain it.
        at: the point [m]; ``None`` without a spread.
        step_spread: greatest difference between the same approach in few and in many steps [N].
        reset_spread: greatest difference between the same path after a reset, behind other paths
            and behind none [N]; a renderer that forgets everything has 0.
    """

    spread: float
    at: tuple[float, ...] | None
    step_spread: float
    reset_spread: float

    @property
    def has_memory(self) -> bool:
        """Whether the force depends on more than the position."""
        return self.spread > 0.0 or self.step_spread > 0.0

    @property
    def is_reset(self) -> bool:
        """Whether a reset makes it forget."""
        return self.reset_spread == 0.0


def find_history(
    calls: RendererCalls, resolution: Resolution, points: FloatArray, seed: int, effort: float = 1.0
) -> History:
    """Return the dependence on history at points with a force.

    Args:
        calls: the renderer.
        resolution: its noise and steps.
        points: [m], shape (n, 3).
        seed: of the random numbers.
        effort: share of the points that are tried.
    """
    random = np.random.default_rng(seed)
    points = points[: max(6, int(effort * _POINTS))]
    scale = 10.0 ** random.uniform(-4.0, -0.3, (_APPROACHES, len(points), 1))
    directions = random.normal(size=(_APPROACHES, len(points), 3))
    starts = points + scale * directions * calls.region.size
    starts[0] = points
    ends = np.empty((len(_STEPS), _APPROACHES, len(points), 3))
    for index, steps in enumerate(_STEPS):
        ends[index] = _forces_at_end(calls, starts, points, steps)
    threshold = resolution.force_error + 1e-9 * calls.largest_force
    spreads = np.sqrt(np.square(np.ptp(ends[1], axis=0)).sum(axis=1))
    step_spreads = np.sqrt(np.square(np.ptp(ends, axis=0)).sum(axis=2))
    resets = _forces_at_end(calls, starts[1:], points, _STEPS[1]) - ends[1, 1:]
    reversed_order = _forces_at_end(calls, starts[::-1], points, _STEPS[1])[::-1] - ends[1]
    reset_spread = max(_largest(resets), _largest(reversed_order))
    at = int(np.nanargmax(np.nan_to_num(spreads)))
    spread = _beyond(float(np.nan_to_num(spreads).max()), threshold)
    place = tuple(points[at].tolist()) if spread else None
    step_spread = _beyond(float(np.nan_to_num(step_spreads).max()), threshold)
    return History(spread, place, step_spread, _beyond(reset_spread, threshold))


def _forces_at_end(
    calls: RendererCalls, starts: FloatArray, points: FloatArray, steps: int
) -> FloatArray:
    """Return the forces at points at the end of straight approaches, shape (a, n, 3)."""
    shares = np.linspace(0.0, 1.0, steps + 1)[:, None]
    paths = starts[:, :, None] + shares * (points - starts)[:, :, None]
    paths[:, :, -1] = points
    forces = calls.along(paths.reshape(-1, steps + 1, 3))[:, -1]
    return forces.reshape(starts.shape)


def _largest(changes: FloatArray) -> float:
    return float(np.sqrt(np.nan_to_num(np.square(changes).sum(axis=-1))).max())


def _beyond(spread: float, threshold: float) -> float:
    return spread if spread > threshold else 0.0
