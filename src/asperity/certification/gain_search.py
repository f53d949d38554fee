"""Search for the largest gain of a renderer: greatest change of force per change of position.

Halton points of the region are seeds; the best climb the norm of the finite-difference Jacobian,
and enter the next round again. What counts at last is a secant between two points, less what noise
and steps of the renderer explain: a lower bound of the gain with its witness.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.analysis.bounds.bound import one_sided, spectral_norm
from asperity.certification.climbing import climb
from asperity.certification.region import RendererCalls, approach_paths, step_changes
from asperity.certification.resolution import Resolution
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable

_MAX_CLIMBS = 2048
_MIN_CLIMBS = 8
_SEEDS_PER_CLIMB = 8
_MAX_SEEDS_PER_PLACE = 3
_CALLS_PER_JACOBIAN = 4
_STEPS = 60
_CONFIRMED = 16
_FIRST_SPREAD = 0.05


@dataclass(frozen=True)
class GainWitness(Serializable):
    """Two points whose forces show a gain.

    Attributes:
        value: the gain shown, less what noise and steps explain [N/m].
        start: first point [m].
        end: second point [m].
        approach: where the path to both begins, for a renderer with memory [m].
        force_change: difference of the forces [N].
    """

    value: float
    start: tuple[float, ...]
    end: tuple[float, ...]
    approach: tuple[float, ...]
    force_change: tuple[float, ...]


class GainSearch:
    """Search for one gain in rounds.

    A place is a point; for a renderer with memory also the beginning of its approach.

    Args:
        calls: the renderer in its region.
        resolution: its noise and steps.
        is_one_sided: whether only the change of force against the motion counts.
        seed: of the random numbers.

    Attributes:
        best: witness of the greatest gain; ``None`` for none.
    """

    def __init__(
        self, calls: RendererCalls, resolution: Resolution, is_one_sided: bool, seed: int
    ) -> None:
        from scipy.stats import qmc

        self.calls = calls
        self.resolution = resolution
        self.is_one_sided = is_one_sided
        self.best: GainWitness | None = None
        self._measure = one_sided if is_one_sided else spectral_norm
        self._random = np.random.default_rng(seed)
        self._halton = qmc.Halton(3, seed=seed)
        self._best_places: list[FloatArray] = []

    @property
    def value(self) -> float:
        """The greatest gain so far [N/m]; 0 for none."""
        return 0.0 if self.best is None else self.best.value

    def run(self, deadline: float, climbs: int, progress: Callable[[str], None]) -> None:
        """Search in rounds until a time of the monotonic clock [s].

        Args:
            deadline: the time.
            climbs: number of climbs of a round.
            progress: called after each round with a text.
        """
        region = self.calls.region
        while True:
            places = self._seeds(_SEEDS_PER_CLIMB * climbs)
            order = np.argsort(-self._values(places))[:climbs]
            self._confirm(places[order])
            places, _values = climb(
                np.concatenate([*self._best_places, places[order]]),
                self._values,
                region.limit,
                lambda: time.monotonic() >= deadline,
                self._random,
                _FIRST_SPREAD * region.size,
                _STEPS,
            )
            self._confirm(places)
            self._best_places = [places[: max(1, climbs // 8)]]
            progress(f"gain at least {self.value:.4g} N/m")
            if time.monotonic() >= deadline:
                return

    def _seeds(self, count: int) -> FloatArray:
        """Return places: Halton points, with approaches from near at many scales."""
        region = self.calls.region
        points = region.points(self._halton.random(_MAX_SEEDS_PER_PLACE * count))
        points = points[region.contains(points)][:count, None]
        if not self.calls.approaches:
            return points
        scales = 10.0 ** self._random.uniform(-3.0, -0.5, (len(points), 1, 1))
        starts = points + scales * region.size * self._random.normal(size=points.shape)
        return np.concatenate([points, region.clip(starts)], axis=1)

    def _values(self, places: FloatArray) -> FloatArray:
        """Return the measure of the Jacobians at places, -1 where they do not exist."""
        jacobians, is_valid = self._jacobians(places)
        return np.where(is_valid, self._measure(jacobians), -1.0)

    def _jacobians(self, places: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return finite-difference Jacobians, and whether they are inside of the region."""
        region = self.calls.region
        step = self.resolution.secant
        stencils = np.repeat(places[:, :1], 4, axis=1)
        ends = stencils[:, 1:]
        axes = np.arange(3)
        ends[:, axes, axes] += step
        inside = region.contains(ends.reshape(-1, 3)).reshape(-1, 3)
        steps = np.where(inside, step, -step)
        ends[:, axes, axes] += steps - step
        inside[~inside] = region.contains(ends[~inside])
        ends[:] = np.where(inside[:, :, None], ends, places[:, :1])
        forces = self.calls.after(places[:, -1], places[:, 0], stencils)
        jacobians = np.swapaxes((forces[:, 1:] - forces[:, :1]) / steps[:, :, None], 1, 2)
        is_valid = np.asarray(inside.all(axis=1) & np.isfinite(jacobians).all(axis=(1, 2)))
        jacobians[~is_valid] = 0.0
        return jacobians, is_valid

    def _confirm(self, places: FloatArray) -> None:
        """Measure secants along the directions in which Jacobians are greatest."""
        places = places[:_CONFIRMED]
        jacobians = self._jacobians(places)[0]
        directions = np.linalg.svd(jacobians)[2][:, 0]
        if self.is_one_sided:
            directions = np.linalg.eigh(-jacobians - np.swapaxes(jacobians, 1, 2))[1][..., -1]
        points = places[:, 0]
        for step in (self.resolution.secant, -self.resolution.secant):
            self.record(points, points + step * directions, places)

    def record(self, starts: FloatArray, ends: FloatArray, places: FloatArray) -> None:
        """Keep the greatest gain of secants [m], shape (n, 3) each, at places.

        Shorter ones than the resolution allows are extended from their beginning. Each is measured
        twice, and the smaller gain counts: noise that is rare does not come again.
        """
        shares = self.resolution.secant / np.sqrt(np.square(ends - starts).sum(axis=1))
        ends = starts + np.maximum(shares, 1.0)[:, None] * (ends - starts)
        inside = self.calls.region.contains(starts) & self.calls.region.contains(ends)
        if not inside.any():
            return
        starts, ends, places = [array[inside] for array in (starts, ends, places)]
        steps = ends - starts
        lengths = np.sqrt(np.square(steps).sum(axis=1))
        gains = np.full(len(steps), np.inf)
        paths = approach_paths(places[:, -1], starts, ends)
        for _ in range(2):
            changes, sizes = step_changes(self.calls.along(paths))
            shown = self._gains(changes, sizes, steps, lengths)
            gains = np.minimum(gains, np.nan_to_num(shown, nan=0.0))
        index = int(np.argmax(gains))
        if gains[index] > self.value:
            rows = (starts[index], ends[index], places[index, -1], changes[index])
            self.best = GainWitness(float(gains[index]), *[tuple(row.tolist()) for row in rows])

    def _gains(
        self, changes: FloatArray, sizes: FloatArray, steps: FloatArray, lengths: FloatArray
    ) -> FloatArray:
        """Return what changes of force show beyond noise and steps [N/m], shape (n,)."""
        if self.is_one_sided:
            sizes = sizes - np.sqrt(np.square(changes).sum(axis=1))
            sizes -= (changes * steps).sum(axis=1) / lengths
        beyond = sizes - self.resolution.force_error
        return np.asarray(beyond / (lengths + 2.0 * self.resolution.position_error))


def number_of_climbs(calls: RendererCalls, seconds: float) -> int:
    """Return how many climbs a round has so that three rounds fit into a time [s]."""
    per_climb = _CALLS_PER_JACOBIAN * (_SEEDS_PER_CLIMB + _STEPS)
    climbs = int(calls.rate * seconds / (3 * per_climb * calls.per_force))
    return min(max(climbs, _MIN_CLIMBS), _MAX_CLIMBS)
