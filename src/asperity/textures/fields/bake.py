"""Bake law H of a texture as a potential field."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from asperity.clamps import NONE
from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.core.units import round_up
from asperity.laws import LAWS
from asperity.textures.fields.field_certificate import Progress, curvature_bounds, run_in_threads
from asperity.textures.fields.field_grid import FieldGrid, SingleArray
from asperity.textures.fields.node_potentials import (
    ColumnFunction,
    compute_potentials,
    smooth,
    split_columns,
)
from asperity.textures.fields.potential_field import FieldAccuracy, PotentialField, certified_number
from asperity.textures.texture import Texture

_MAX_PASSES = 4
PROBES = 1024
"""Number of probes at which the difference from exact H is measured."""
_TRIAL_PROBES = 100
_TRIAL_PASSES = 1
_BYTES_PER_NODE = 4


@dataclass(frozen=True)
class BakeGoal:
    """What a field must reach.

    Attributes:
        share: greatest RMS difference from exact H over the RMS of the texture's force.
        max_gain: greatest certified q over max(1, c): smoothing is repeated until it is reached.
        max_bytes: greatest size of the coefficients.
    """

    share: float = 0.05
    max_gain: float = 1.15
    max_bytes: int = 2**28

    @property
    def passes(self) -> int:
        """Greatest number of smoothing passes."""
        return _MAX_PASSES if self.max_gain < math.inf else 0


def bake_texture(
    texture: Texture,
    max_depth: float,
    continuity: float = 1.0,
    *,
    resolution: float | None = None,
    goal: BakeGoal = BakeGoal(),
    progress: Progress | None = None,
) -> PotentialField:
    """Return a texture whose law H is rendered as a baked potential field.

    Args:
        texture: a texture that repeats, or is mirrored at its border.
        max_depth: depth below the least height down to which the field extends [m].
        continuity: c of law H.
        resolution: greatest distance of the nodes [m]; by default the coarsest one that reaches
            the goal.
        goal: what the field must reach.
        progress: called with the finished fraction, from 0 to 1.

    Raises:
        ParameterError: for a texture that neither repeats nor has a border, a field that is larger
            than allowed (the message states what fits), or a resolution coarser than the texture.
    """
    if isinstance(texture, PotentialField):
        raise ParameterError("texture", "is a baked field already")
    if not (texture.domain.periodic or texture.is_mirrored):
        raise ParameterError(
            "texture", "never repeats: no finite field represents it; give an extent"
        )
    plan = BakePlan(texture, max_depth, continuity, goal)
    chosen = plan.choose() if resolution is None else check_positive("resolution", resolution, "m")
    grid = plan.grid(chosen)
    plan.check_size(grid)
    deep = grid.extend_down(goal.passes)
    potentials = compute_potentials(plan.columns, deep, scale_progress(progress, 0.0, 0.9))
    return plan.certify(potentials, grid, scale_progress(progress, 0.9, 0.1))


def scale_progress(progress: Progress | None, start: float, size: float) -> Progress | None:
    """Return the progress of a part of a task that reports its own from 0 to 1."""
    return None if progress is None else lambda done: progress(start + size * done)


class BakePlan:
    """A field to bake: exact force and potential at probes, from which its grid is chosen."""

    def __init__(
        self, texture: Texture, max_depth: float, continuity: float, goal: BakeGoal
    ) -> None:
        self.texture, self.max_depth, self.continuity = texture, max_depth, continuity
        self.goal, self.gain = goal, max(1.0, continuity)
        self.lipschitz = self.gain
        self.columns: ColumnFunction = split_columns(texture, continuity)
        self._law_arguments = (1.0, 0.0, 1.0, max_depth, 0.0, continuity)
        self.probes = self._random_probes(PROBES)
        self.force = self._exact_force(self.probes)
        self.texture_rms = self._texture_force()

    def grid(self, resolution: float) -> FieldGrid:
        """Return the coarsest grid of a resolution [m]."""
        texture = self.texture
        heights, passes = texture.extremes, self.goal.passes
        return FieldGrid.fit(texture.domain, heights, self.max_depth, resolution, passes)

    def _exact_force(self, points: FloatArray) -> FloatArray:
        """Return the exact force over the stiffness [m], (n, 3)."""
        from asperity.kernels.fuse import fuse_surface

        loops, out = fuse_surface(LAWS["H"], self.texture.sampler, NONE), np.empty(points.shape)
        loops.force_batch(points, out, self.texture.arguments, self._law_arguments)
        return out

    def _random_probes(self, count: int) -> FloatArray:
        """Return points between floor and surface, as many of each depth below the surface."""
        rng, domain = np.random.default_rng(0), self.texture.domain
        xy = domain.points(rng.uniform(size=(count, len(domain.spans))))
        low = self.texture.extremes[0] - self.max_depth
        top = self.texture.height(xy)
        return np.column_stack([xy, low + (top - low) * rng.uniform(size=count)])

    def _texture_force(self) -> float:
        """Return the RMS of the force about its mean at the least height [m]."""
        points = self.probes.copy()
        points[:, 2] = self.texture.extremes[0]
        force = self._exact_force(points)
        return float(np.sqrt(np.square(force - force.mean(axis=0)).sum(axis=1).mean()))

    def choose(self) -> float:
        """Return the coarsest resolution whose estimated difference is below the goal [m]."""
        coarse = max(self.grid(math.inf).spacing)
        fits = self.finest_resolution()
        fine = coarse
        while fine > fits and self._estimate(fine) > self.goal.share * self.texture_rms:
            coarse, fine = fine, 0.5 * fine
        while coarse > 1.03 * fine and fine < coarse:
            middle = math.sqrt(fine * coarse)
            if self._estimate(middle) > self.goal.share * self.texture_rms:
                coarse = middle
            else:
                fine = middle
        return max(fine, fits)

    def _estimate(self, resolution: float) -> float:
        """Return the RMS difference of a field of a resolution from the exact force [m].

        The force at a few probes, at random places among the nodes, is computed from the potentials
        at the nodes around each of them.
        """
        steps = _step_vectors(self.grid(resolution))
        points, exact = self.probes[:_TRIAL_PROBES], self.force[:_TRIAL_PROBES]
        place = np.random.default_rng(1).uniform(-0.5, 0.5, (len(points), len(steps)))
        reach = 1 + _TRIAL_PASSES
        ticks = [np.arange(-reach, reach + 1.0)] * len(steps)
        plane = np.stack(np.meshgrid(*ticks[1:], indexing="ij"), axis=-1).reshape(
            -1, len(steps) - 1
        )
        xy = points[:, None, :2] + (plane - place[:, None, :-1]) @ steps[:-1, :2]
        z = points[:, 2:] + (ticks[0] - place[:, -1:]) * steps[-1, 2]
        values = np.empty((len(points), len(plane), len(ticks[0])), np.float32)
        run_in_threads(lambda i: self.columns(xy[i], z[i], values[i]), range(len(points)), None)
        values = values.reshape(len(points), *map(len, ticks))
        weights, slopes = _smoothed_weights(place, _TRIAL_PASSES)
        gradient = np.empty((len(points), len(steps)))
        for axis in range(len(steps)):
            rest = values
            for other in range(len(steps)):
                factor = slopes if other == axis else weights
                rest = np.einsum("nk...,nk->n...", rest, factor[:, other])
            gradient[:, axis] = rest
        difference = exact + gradient @ np.linalg.pinv(steps).T
        return float(np.sqrt(np.square(difference).sum(axis=1).mean()))

    def finest_resolution(self) -> float:
        """Return the finest resolution [m] of a field within the size allowed, to three digits."""
        coarse = max(self.grid(math.inf).spacing)
        while self._bytes(0.5 * coarse) <= self.goal.max_bytes and coarse > 1e-12:
            coarse *= 0.5
        fine = 0.5 * coarse
        while coarse > 1.001 * fine:
            middle = math.sqrt(fine * coarse)
            fits = self._bytes(middle) <= self.goal.max_bytes
            fine, coarse = (fine, middle) if fits else (middle, coarse)
        return coarse

    def _bytes(self, resolution: float) -> int:
        return _BYTES_PER_NODE * math.prod(self.grid(resolution).node_counts)

    def check_size(self, grid: FieldGrid) -> None:
        """Refuse a grid that is larger than allowed.

        Raises:
            ParameterError: it states a resolution that fits.
        """
        size, limit = _BYTES_PER_NODE * math.prod(grid.node_counts), self.goal.max_bytes
        if size <= limit:
            return
        nodes = " x ".join(str(count) for count in grid.node_counts)
        least = self._bytes(math.inf)
        fits = f"even the coarsest one takes {least} byte"
        if least <= limit:  # rounded up, so that the resolution in the message fits
            fits = f"{round_up(self.finest_resolution()):.3g} m fits"
        raise ParameterError(
            "resolution",
            f"would need a field of {nodes} nodes, {size / 1e6:,.1f} MB, more than max_bytes = "
            f"{limit / 1e6:,.1f} MB; {fits}",
            max(grid.spacing),
        )

    def certify(
        self, potentials: SingleArray, grid: FieldGrid, progress: Progress | None
    ) -> PotentialField:
        """Return the field, smoothed until its certified gain reaches the goal.

        Args:
            potentials: at the nodes of the grid, and at one level below for each smoothing pass.
            grid: the nodes.
            progress: called with the finished fraction.
        """
        passes, most = 0, self.goal.passes
        while True:
            arguments = grid.arguments(potentials[..., most - passes :])
            limit = math.inf if passes == most else self.goal.max_gain * self.gain
            upper, attained = curvature_bounds(grid, arguments, progress, limit)
            if max(upper) <= limit:
                break
            potentials, passes = smooth(potentials, grid), passes + 1
        numbers = [certified_number(float(upper[i]), attained[i]) for i in range(2)]
        one_sided, other = numbers
        larger = max(numbers, key=lambda number: number.lower)
        largest = float(arguments.c.max(initial=0.0))
        force, energy = grid.error_bounds(self.lipschitz, passes, largest)
        accuracy = FieldAccuracy(math.nan, math.nan, force, energy, self.texture_rms, PROBES)
        field = PotentialField(
            self.texture, grid, arguments, max_depth=self.max_depth, continuity=self.continuity,
            passes=passes, gain=replace(larger, upper=max(one_sided.upper, other.upper)),
            one_sided=one_sided, accuracy=accuracy,
        )  # fmt: skip
        return self._measure(field)

    def _measure(self, field: PotentialField) -> PotentialField:
        """Return the field with its measured difference from exact H."""
        from asperity.kernels.fuse import fuse_surface

        loops, out = fuse_surface(LAWS["H"], field.sampler, NONE), np.empty(self.probes.shape)
        loops.force_batch(self.probes, out, field.arguments, self._law_arguments)
        distance = np.linalg.norm(out - self.force, axis=1)
        rms, largest = float(np.sqrt(np.square(distance).mean())), float(distance.max())
        field.accuracy = replace(field.accuracy, rms=rms, largest=largest)
        return field


def _step_vectors(grid: FieldGrid) -> FloatArray:
    """Return the vectors from node to node [m], (d + 1, 3)."""
    steps = np.zeros((len(grid.steps) + 1, 3))
    steps[:-1, :2] = grid.steps
    steps[-1, 2] = grid.level_spacing
    return steps


def _smoothed_weights(place: FloatArray, passes: int) -> tuple[FloatArray, FloatArray]:
    """Return weights of nodes around probes along each axis, and their derivatives.

    Args:
        place: of the probes from their nearest node, in nodes, shape (n, d).
        passes: number of smoothing passes.

    Returns:
        Two arrays of shape (n, d, 3 + 2 passes).
    """
    t = place
    found = []
    for parts in (
        (0.5 * (0.5 - t) ** 2, 0.75 - t * t, 0.5 * (0.5 + t) ** 2),
        (t - 0.5, -2.0 * t, t + 0.5),
    ):
        weights = np.stack(parts, axis=-1)
        for _ in range(passes):
            wide = np.pad(weights, [(0, 0), (0, 0), (2, 2)])
            weights = 0.25 * (wide[..., :-2] + wide[..., 2:]) + 0.5 * wide[..., 1:-1]
        found.append(weights)
    return found[0], found[1]
