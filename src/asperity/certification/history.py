"""Dependence on history: the force at one point after different approaches, and after a reset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.certification.region import RendererCalls
from asperity.certification.resolution import Resolution
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable

_POINTS = 48
_LEAST_POINTS = 12
_REPEATS = 4
_APPROACHES = 8
_STEPS = (1, 20, 100)


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
    points = points[: max(_LEAST_POINTS, int(effort * _POINTS))]
    scale = 10.0 ** random.uniform(-4.0, -0.3, (_APPROACHES, len(points), 1))
    directions = random.normal(size=(_APPROACHES, len(points), 3))
    directions[::2, :, 2] = 0.0  # a proxy on a surface moves along it
    region = calls.region
    starts = region.clip(points + scale * directions * region.size)
    starts[0] = points
    threshold = resolution.force_error + 1e-9 * calls.largest_force
    spreads = _measure_spreads(calls, starts, points)
    if np.max(spreads) > threshold:  # noise that is rare does not come again
        others = [_measure_spreads(calls, starts, points) for _ in range(_REPEATS)]
        spreads = np.min([spreads, *others], axis=0)
    by_approach, by_steps, by_reset = np.where(spreads > threshold, spreads, 0.0)
    at = int(np.argmax(by_approach))
    place = tuple(points[at].tolist()) if by_approach[at] else None
    return History(float(by_approach[at]), place, float(by_steps.max()), float(by_reset.max()))


def _measure_spreads(calls: RendererCalls, starts: FloatArray, points: FloatArray) -> FloatArray:
    """Return spreads at points by approach, by number of steps and by reset [N], shape (3, n)."""
    ends = np.array([_forces_at_end(calls, starts, points, steps) for steps in _STEPS])
    resets = _forces_at_end(calls, starts[1:], points, _STEPS[1]) - ends[1, 1:]
    reversed_order = _forces_at_end(calls, starts[::-1], points, _STEPS[1])[::-1] - ends[1]
    changes = np.concatenate([resets, reversed_order])
    by_approach = np.sqrt(np.square(np.ptp(ends[1], axis=0)).sum(axis=1))
    by_steps = np.sqrt(np.square(np.ptp(ends, axis=0)).sum(axis=2)).max(axis=0)
    by_reset = np.sqrt(np.square(changes).sum(axis=2)).max(axis=0)
    return np.asarray(np.nan_to_num([by_approach, by_steps, by_reset]))


def _forces_at_end(
    calls: RendererCalls, starts: FloatArray, points: FloatArray, steps: int
) -> FloatArray:
    """Return the forces at points at the end of straight approaches, shape (a, n, 3)."""
    shares = np.linspace(0.0, 1.0, steps + 1)[:, None]
    paths = starts[:, :, None] + shares * (points - starts)[:, :, None]
    paths[:, :, -1] = points
    forces = calls.along(paths.reshape(-1, steps + 1, 3))[:, -1]
    return forces.reshape(starts.shape)
