"""Bake law H of a texture as a potential field."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from asperity.clamps import NONE
from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.core.units import round_up
from asperity.laws import LAWS
from asperity.textures.fields.field_certificate import Progress, curvature_bounds, run_in_threads
from asperity.textures.fields.field_grid import NEIGHBOUR_WEIGHT, FieldGrid, SingleArray
from asperity.textures.fields.field_sampler import quadratic_weight_slopes, quadratic_weights
from asperity.textures.fields.node_potentials import compute_potentials, smooth, split_columns
from asperity.textures.fields.potential_field import FieldAccuracy, PotentialField, certified_number
from asperity.textures.texture import Texture

_MAX_PASSES = 6
# Number of probes at which the difference from exact H is measured.
PROBES = 1024
_TRIAL_PROBES = 128
_TRIAL_COARSENING = 2.0
_TRIAL_MARGIN = 0.95
_MAX_TRIALS = 12
_BYTES_PER_NODE = 4
# Depth in which a field fades below its floor, over half the range of the vertical force there.
_FADE_DEPTH = 2.0


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
        resolution: maximum spacing of the nodes [m]; by default the coarsest one that reaches
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
        reason = "never repeats: no finite field represents it; give an extent"
        raise ParameterError("texture", reason)
    plan = BakePlan(texture, max_depth, continuity, goal)
    if resolution is not None:
        return plan.bake(check_positive("resolution", resolution, "m"), progress)
    return plan.bake_coarsest(progress)


def scale_progress(progress: Progress | None, start: float, size: float) -> Progress | None:
    """Return the progress of a part of a task that reports its own from 0 to 1."""
    return None if progress is None else lambda done: progress(start + size * done)


class BakePlan:
    """A field to bake: exact force and potential at probes, from which its grid is chosen."""

    def __init__(
        self, texture: Texture, max_depth: float, continuity: float, goal: BakeGoal
    ) -> None:
        self.texture, self.max_depth, self.continuity = texture, max_depth, continuity
        self.goal = goal
        self.gain = self.lipschitz = max(1.0, continuity)
        self._exact_columns = split_columns(texture, continuity)
        self._law_arguments = (1.0, 0.0, 1.0, max_depth, 0.0, continuity)
        self.probes = self._random_probes(PROBES)
        self.force = self._force(texture, self.probes)
        level = np.column_stack([self.probes[:, :2], np.full(PROBES, texture.extremes[0])])
        force = self._force(texture, level)
        self.texture_rms = float(np.sqrt(np.square(force - force.mean(axis=0)).sum(axis=1).mean()))
        level[:, 2] = self.floor = texture.extremes[0] - max_depth
        lifts = self._force(texture, level)[:, 2]
        self.lift, self.lift_range = 0.5 * (lifts.max() + lifts.min()), 0.5 * np.ptp(lifts)
        self.fade = max(_FADE_DEPTH * self.lift_range, 1e-9 * max_depth)

    def columns(self, xy: FloatArray, z: FloatArray, out: SingleArray) -> None:
        """Write the potential at columns of nodes; see :data:`ColumnFunction`.

        Below the floor it is U(floor - ψ) + g: with r = depth/fade below it, ψ' = 1 - r falls to
        zero, and so does the variation of the force along z; g makes up for its mean, so that the
        second derivative along z is at most 1 and that of the flat wall in the end.
        """
        depth = np.maximum(self.floor - z, 0.0)
        r = np.minimum(depth / self.fade, 1.0)
        beyond = np.maximum(depth - self.fade, 0.0)
        warped = np.maximum(z, self.floor) - self.fade * (r - 0.5 * r * r)
        # All levels that are deeper than the fade have the potential of one place.
        same = max(int(np.count_nonzero(r >= 1.0)) - 1, 0)
        exact = np.empty((len(xy), len(z) - same), np.float32)
        self._exact_columns(xy, warped[same:], exact)
        out[:, same:], out[:, :same] = exact, exact[:, :1]
        slope = self.lift - self.lift_range
        gained = self.fade**2 * (0.5 - 0.125 * r) * r**3 + 0.5 * self.fade * slope * r * r
        out += (gained + (self.fade + slope + 0.5 * beyond) * beyond).astype(np.float32)

    def grid(self, resolution: float) -> FieldGrid:
        """Return the coarsest grid of a resolution [m]."""
        heights, domain = self.texture.extremes, self.texture.domain
        fitted = FieldGrid.fit(domain, heights, self.max_depth, resolution, self.goal.passes)
        return fitted.extend_down(math.ceil(self.fade / fitted.level_spacing) + 2)

    def _force(self, texture: Texture, points: FloatArray) -> FloatArray:
        """Return the force over the stiffness [m], (n, 3)."""
        from asperity.kernels.fuse import fuse_surface

        loops, out = fuse_surface(LAWS["H"], texture.sampler, NONE), np.empty(points.shape)
        loops.force_batch(points, out, texture.arguments, self._law_arguments)
        return out

    def _random_probes(self, count: int) -> FloatArray:
        """Return points between floor and surface, as many of each depth below the surface."""
        rng, domain = np.random.default_rng(0), self.texture.domain
        xy = domain.points(rng.uniform(size=(count, len(domain.spans))))
        low = self.texture.extremes[0] - self.max_depth
        top = self.texture.height(xy)
        return np.column_stack([xy, low + (top - low) * rng.uniform(size=count)])

    def bake(self, resolution: float, progress: Progress | None) -> PotentialField:
        """Return the field of a resolution [m]."""
        grid = self.grid(resolution)
        self.check_size(grid)
        deep, first_part = grid.extend_down(self.goal.passes), scale_progress(progress, 0.0, 0.9)
        potentials = compute_potentials(self.columns, deep, first_part)
        return self.certify(potentials, grid, scale_progress(progress, 0.9, 0.1))

    def bake_coarsest(self, progress: Progress | None) -> PotentialField:
        """Return the field of the coarsest resolution that reaches the goal.

        The resolution is corrected by the measured difference, first of a field of few nodes.
        """
        finest, coarsest = self.finest_resolution(), max(self.grid(math.inf).spacing)
        resolution = min(max(_TRIAL_COARSENING * self.choose(), finest), coarsest)
        part = scale_progress(progress, 0.0, 0.1)
        for trial in range(_MAX_TRIALS):
            field = self.bake(resolution, part)
            share, goal = field.accuracy.share, self.goal.share
            if resolution == (coarsest if share <= goal else finest) or 0.5 * goal <= share <= goal:
                break
            if field.gain.upper > _TRIAL_MARGIN * self.goal.max_gain * self.gain:
                # A finer field may need one more smoothing pass: about this power of the variance.
                share *= ((2.0 + field.passes) / (1.0 + field.passes)) ** 0.65
            ratio = 0.92 * goal / max(share, 0.01 * goal)
            power = 0.77 if trial == 0 else 1.0  # near the goal rather too fine than once more
            resolution = min(max(resolution * ratio**power, finest), coarsest)
            part = scale_progress(progress, 0.1, 0.9)
        return field

    def choose(self) -> float:
        """Return a resolution [m] at which a field that is smoothed once meets the goal.

        It is the coarsest one by an estimate at few probes.
        """
        resolution = coarsest = max(self.grid(math.inf).spacing)
        finest, goal = self.finest_resolution(), self.goal.share * self.texture_rms
        for _ in range(_MAX_TRIALS):
            ratio = goal / max(self.estimate(resolution, 1, _TRIAL_PROBES), 1e-6 * goal)
            changed = min(max(resolution * (0.98 * ratio) ** 0.8, finest), coarsest)
            if changed == resolution or 1.0 <= ratio <= 1.1:
                break
            resolution = changed
        return resolution

    def estimate(self, resolution: float, passes: int, count: int) -> float:
        """Return the RMS difference of a field from the exact force at the first probes [m].

        The force is computed from the potentials at the nodes around each probe.
        """
        grid, points = self.grid(resolution), self.probes[:count]
        axes = len(grid.steps) + 1
        steps = np.vstack([np.pad(grid.steps, [(0, 0), (0, 1)]), [0.0, 0.0, grid.level_spacing]])
        inverse = np.linalg.pinv(steps)
        place = (points - [*grid.start, grid.height(0)]) @ inverse
        place -= np.rint(place)
        ticks = [np.arange(-1.0 - passes, 2.0 + passes)] * axes
        plane = np.stack(np.meshgrid(*ticks[1:], indexing="ij"), axis=-1).reshape(-1, axes - 1)
        xy = points[:, None, :2] + (plane - place[:, None, :-1]) @ steps[:-1, :2]
        z = points[:, 2:] + (ticks[0] - place[:, -1:]) * steps[-1, 2]
        values = np.empty((len(points), len(plane), len(ticks[0])), np.float32)
        run_in_threads(lambda i: self.columns(xy[i], z[i], values[i]), range(len(points)), None)
        functions: list[Any] = [quadratic_weights, quadratic_weight_slopes]
        weights = np.stack([np.stack(function(place), axis=-1) for function in functions])
        for _ in range(passes):
            wide = np.pad(weights, [(0, 0), (0, 0), (0, 0), (2, 2)])
            sides = NEIGHBOUR_WEIGHT * (wide[..., :-2] + wide[..., 2:])
            weights = sides + (1.0 - 2.0 * NEIGHBOUR_WEIGHT) * wide[..., 1:-1]
        difference = self.force[:count].copy()
        for axis in range(axes):
            rest = values.reshape(len(points), *map(len, ticks))
            for other in range(axes):
                rest = np.einsum("nk...,nk->n...", rest, weights[int(other == axis)][:, other])
            difference += rest[:, None] * inverse[:, axis]
        return float(np.sqrt(np.square(difference).sum(axis=1).mean()))

    def finest_resolution(self) -> float:
        """Return the finest resolution [m] of a field within the size allowed, to three digits."""
        coarse = max(self.grid(math.inf).spacing)
        fine = 1e-5 * coarse
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
        if size > limit:
            nodes, least = " x ".join(map(str, grid.node_counts)), self._bytes(math.inf)
            fits = f"even the coarsest one takes {least} byte"
            if least <= limit:  # rounded up, so that the resolution in the message fits
                fits = f"{round_up(self.finest_resolution()):.3g} m fits"
            words = (
                f"would need a field of {nodes} nodes, {size / 1e6:,.1f} MB, more than max_bytes"
            )
            words += f" = {limit / 1e6:,.1f} MB; {fits}"
            raise ParameterError("resolution", words, max(grid.spacing))

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
        one_sided, other = (certified_number(float(upper[i]), attained[i]) for i in range(2))
        larger = max(one_sided, other, key=lambda number: number.lower)
        largest = float(arguments.c.max(initial=0.0))
        force, energy = grid.error_bounds(self.lipschitz, passes, largest)
        accuracy = FieldAccuracy(math.nan, math.nan, force, energy, self.texture_rms, PROBES)
        field = PotentialField(
            self.texture, grid, arguments, max_depth=self.max_depth, continuity=self.continuity,
            passes=passes, gain=replace(larger, upper=max(one_sided.upper, other.upper)),
            one_sided=one_sided, accuracy=accuracy,
        )  # fmt: skip
        distance = np.linalg.norm(self._force(field, self.probes) - self.force, axis=1)
        rms, largest = float(np.sqrt(np.square(distance).mean())), float(distance.max())
        field.accuracy = replace(field.accuracy, rms=rms, largest=largest)
        return field
