"""Bake law H of a texture as a potential field."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.core.processes import run_in_threads
from asperity.core.units import round_up
from asperity.laws import LAWS
from asperity.laws.clamps import NONE
from asperity.textures.fields import node_potentials
from asperity.textures.fields.field_bricks import BRICK_BYTES
from asperity.textures.fields.field_certificate import Progress, cells_above, certify_gain
from asperity.textures.fields.field_grid import RAMP, FieldGrid, SingleArray
from asperity.textures.fields.field_record import FieldArguments, largest_coefficient, largest_step
from asperity.textures.fields.potential_field import FieldAccuracy, PotentialField
from asperity.textures.texture import CertifiedNumber, Texture

_MAX_PASSES = 15
# Part of the cells above the goal that a pass may leave and still help.
_STALLED = 0.8
# Number of depths at which the difference from exact H is measured, for bodies and for surfaces,
# and of probes at each of them.
DEPTHS = 12
PRESSES = 16
PROBES = 256
_PROBES_AT_ONCE = 64
# Mean force over stiffness from which on differences count [m]: 0.1 N on a stiff device.
LIGHT_TOUCH = 0.1 / 3000.0
LEAST_DEPTH = 0.03
# Distance [m] from the surface at which contact may begin, and the part of its heights' range.
_ONSET = 10e-6, 0.02
# Depth at which the place of a body's surface is measured, over the greatest.
SHALLOW = 0.04
_TRIAL_BYTES = 2**20
# Share of the goal that is aimed at; powers of the resolution that the share of the force and the
# distance of contact are assumed to follow, and the least and greatest; least error over the goal.
_AIM = 0.88
_POWERS = 1.3, 2.0
_LEAST_POWERS = 0.7, 1.2
_GREATEST_POWER = 3.0
_LEAST_ERROR = 0.01
_MAX_TRIALS = 12
# The same share where errors are foreseen from samples, that from which on it is close enough, and
# the resolution over that of the last trial from which on none are needed.
_SAMPLED_AIM = 0.98
_CLOSE_TO_AIM = 0.93
_NEAR = 0.65
# What smoothing adds to either error, over the same in a trial of a coarser resolution: 0.2 to 1.3
# was measured on six surfaces, and 0.4 to 0.8. On a noise that a trial hardly resolved it was 6,
# and a third trial followed.
_ADDED_BY_SMOOTHING = 1.3, 1.0
_MAX_SAMPLES = 4
# Parts of the progress that is left of the first trial, and of each further one.
_FIRST_PART = 0.1
_NEXT_PART = 0.9
_FLAT = 1e-9  # of the greatest force: less is rounding
_BYTES_PER_NODE = 4
# Height of the cells in which a field fades below its floor, over the range of the vertical force
# there.
_FADE = 0.8
# Greatest q that rounding to bricks was measured to add: 0.001 to 0.010.
_GAIN_OF_ROUNDING = 0.01
_UNKNOWN_GAIN = CertifiedNumber(0.0, math.inf, (0.0, 0.0, 0.0))
# Growth of cells with depth over the share of the goal, of which it then causes about half however
# close nodes are, and the most.
_GROWTH_PER_SHARE = 3.0
_MOST_GROWTH = 0.25


@dataclass(frozen=True)
class BakeGoal:
    """What a field must reach.

    Attributes:
        share: greatest RMS difference from exact H over the RMS of the texture's force, at every
            depth at which the mean force is at least 0.1 N at 3000 N/m.
        max_gain: greatest certified q over max(1, c): smoothing is repeated until it is reached.
        max_bytes: greatest size of the coefficients.
    """

    share: float = 0.06
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

    lift = 0.0

    def __init__(
        self, texture: Texture, max_depth: float, continuity: float, goal: BakeGoal
    ) -> None:
        self.texture = texture
        self.max_depth = max_depth
        self.continuity = continuity
        self.goal = goal
        self.gain = self.lipschitz = max(1.0, continuity)
        self.columns = node_potentials.split_columns(texture, continuity)
        self._law_arguments = (1.0, 0.0, 1.0, max_depth, 0.0, continuity)
        low, top = texture.extremes
        self.floor = low - max_depth
        self.onset_limit = max(_ONSET[0], _ONSET[1] * (top - low))
        size = (PROBES, len(texture.domain.spans))
        xy = texture.domain.points(np.random.default_rng(0).uniform(size=size))
        deepest = top - self.floor
        least = LEAST_DEPTH * min(deepest, 2.0 * (top - low) or deepest)
        depths = np.geomspace(least, deepest, PRESSES)
        level = np.repeat(top - depths, PROBES)
        points = np.column_stack([np.tile(xy, (PRESSES, 1)), level])
        self.set_probes(points, np.repeat(np.arange(PRESSES), PROBES), depths)
        forces = self.force[-PROBES:, 2]
        self.lift = float(forces.min())
        self.fade = _FADE * float(np.ptp(forces))
        self.set_shallow(np.column_stack([xy, texture.height(xy) - 2.0 * self.onset_limit]))

    def set_probes(self, points: FloatArray, rows: NDArray[np.intp], depths: FloatArray) -> None:
        """Set the probes at which the difference from exact H is measured.

        Args:
            points: [m], (n, 3).
            rows: index of the depth of each.
            depths: [m]; those at which hardly any force is felt are omitted, but for the last.
        """
        force = self.exact_force(points)
        felt = _mean_of_rows(np.linalg.norm(force, axis=1), rows, len(depths)) >= LIGHT_TOUCH
        felt[-1] = True
        self.depths = depths[felt]
        used = felt[rows]
        self.probes = points[used]
        self.rows = (np.cumsum(felt) - 1)[rows[used]]
        self.force = force[used]
        count = len(self.depths)
        mean = np.column_stack([_mean_of_rows(part, self.rows, count) for part in self.force.T])
        around = np.square(self.force - mean[self.rows]).sum(axis=1)
        self.row_rms = np.sqrt(_mean_of_rows(around, self.rows, count))
        self.presses = np.linalg.norm(mean, axis=1)
        self.texture_scale = float(np.abs(self.force).max())

    def set_shallow(self, points: FloatArray) -> None:
        """Set the points [m], (n, 3), just below the surface at which its place is measured."""
        self.shallow = points
        self.shallow_depth = self.exact_depth(points)

    def exact_force(self, points: FloatArray) -> FloatArray:
        """Return the exact force over the stiffness [m], (n, 3)."""
        return self._render_force(self.texture, points)

    def exact_depth(self, points: FloatArray) -> FloatArray:
        """Return the exact depth √(2U) [m], (n,)."""
        return self._render_depth(self.texture, points)

    def _render_force(self, texture: Texture, points: FloatArray) -> FloatArray:
        loop = self._loops(texture).force_batch
        return _evaluate(loop, points, texture.arguments, self._law_arguments)

    def _render_depth(self, texture: Texture, points: FloatArray) -> FloatArray:
        loop = self._loops(texture).split_batch
        potential = _evaluate(loop, points, self.continuity, texture.arguments)[:, 0]
        return np.sqrt(np.maximum(2.0 * potential, 0.0))

    def _loops(self, texture: Texture) -> Any:
        from asperity.kernels.fuse import fuse_surface

        return fuse_surface(LAWS["H"], texture.sampler, NONE)

    def grid(self, resolution: float) -> FieldGrid:
        """Return the coarsest grid of a resolution [m]."""
        heights = self.texture.extremes
        domain = self.texture.domain
        growth = 1.0 + min(_GROWTH_PER_SHARE * self.goal.share, _MOST_GROWTH)
        return FieldGrid.fit(domain, heights, self.max_depth, self.fade, resolution, growth)

    def shares(self, difference: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
        """Return the RMS of differences over that of the texture's force, at each depth."""
        square = _mean_of_rows(np.square(difference).sum(axis=1), rows, len(self.depths))
        ratio: FloatArray = np.sqrt(square) / np.maximum(self.row_rms, 1e-300)
        return np.where(self.row_rms > _FLAT * self.texture_scale, ratio, 0.0)

    def bake(self, resolution: float, progress: Progress | None) -> PotentialField:
        """Return the field of a resolution [m]."""
        field = self.trial(resolution, scale_progress(progress, 0.0, 0.9))
        return self.certify(field, scale_progress(progress, 0.9, 0.1))

    def trial(self, resolution: float, progress: Progress | None) -> PotentialField:
        """Return the field of a resolution [m], whose gain is not certified yet."""
        grid = self.grid(resolution)
        self.check_size(grid)
        quick, *repairs = node_potentials.lattice_columns(self.texture, self.continuity, grid)
        repairs.append(self.columns)
        potentials = node_potentials.compute_potentials(
            quick, grid, progress, repairs=repairs, continuity=self.continuity
        )
        return self.measure(potentials, grid)

    def certify(self, field: PotentialField, progress: Progress | None) -> PotentialField:
        """Set the certified gain of a field, and return it."""
        field.gain, field.one_sided = certify_gain(field.grid, field.arguments, progress)
        return field

    def bake_coarsest(self, progress: Progress | None) -> PotentialField:
        """Return the field of the coarsest resolution that reaches the goal."""
        finest = self.finest_resolution()
        coarsest = max(self.grid(math.inf).spacing)
        resolution = max(self.finest_resolution(_TRIAL_BYTES), finest)
        limits = [finest, coarsest]
        tried: list[tuple[float, FloatArray]] = []
        done = 0.0
        for _trial in range(_MAX_TRIALS):
            part = (1.0 - done) * (_NEXT_PART if tried else _FIRST_PART)
            field = self.trial(resolution, scale_progress(progress, done, part))
            done += part
            errors = self.relative_errors(field.accuracy)
            is_reached = bool(errors.max() <= 1.0)
            if resolution == limits[is_reached] or 0.5 <= errors.max() <= 1.0:
                break
            limits[not is_reached] = resolution
            tried.append((resolution, errors))
            resolution = _between(self.foresee(tried, limits), limits, (finest, coarsest))
        if resolution == finest and not is_reached:
            field.accuracy = replace(field.accuracy, is_limited=True)
        self.certify(field, scale_progress(progress, done, 1.0 - done))
        return field

    def foresee(self, tried: list[tuple[float, FloatArray]], limits: list[float]) -> float:
        """Return the resolution [m], within limits, at which the goal is expected to be reached.

        One close to that of the last trial is guessed. Otherwise errors of fields that are not
        smoothed are sampled at ever better guesses; smoothing adds a part to them that is known
        from the last trial, within a margin.

        Args:
            tried: resolutions [m] of the trials, and their errors over those of the goal.
            limits: least and greatest resolution [m].
        """
        last, errors = tried[-1]
        resolution = next_resolution(tried)
        if _NEAR < resolution / last < 1.0 / _NEAR:
            return resolution
        added = errors / self.unsmoothed_errors - 1.0
        ratio = 1.0 + added * np.where(added > 0.0, _ADDED_BY_SMOOTHING, 1.0)
        samples = tried[-1:]
        reached = []
        for _sample in range(_MAX_SAMPLES):
            resolution = min(max(next_resolution(samples, _SAMPLED_AIM), limits[0]), limits[1])
            errors = ratio * self.sample_errors(resolution)
            if errors.max() <= 1.0:
                reached.append(resolution)
            if _CLOSE_TO_AIM <= errors.max() <= 1.0 or resolution in limits:
                break
            samples.append((resolution, errors))
        return max(reached, default=resolution)

    def sample_errors(self, resolution: float) -> FloatArray:
        """Return the errors of a field that is not smoothed, over those of the goal.

        Only the nodes around the probes are computed, and exactly: a lattice misses ever more
        closest points where a field is deep, and nothing would repair them.
        """
        grid = self.grid(resolution)
        places = self.probes[:, :2], self.shallow[:, :2]
        xy = np.unique(np.concatenate(places), axis=0)
        depths = node_potentials.compute_around(self.columns, grid, xy)
        field = self._measured_field(grid.arguments(depths, self.lift), grid, 0)
        return self.relative_errors(field.accuracy)

    def relative_errors(self, accuracy: FieldAccuracy) -> FloatArray:
        """Return the share of the force, and the distance of contact, over those of the goal."""
        errors = accuracy.share / self.goal.share, accuracy.onset / self.onset_limit
        return np.maximum(errors, _LEAST_ERROR)

    def finest_resolution(self, max_bytes: float = math.inf) -> float:
        """Return the finest resolution [m] of a field within the size allowed, to three digits."""
        limit = min(max_bytes, self.goal.max_bytes)
        coarse = max(self.grid(math.inf).spacing)
        fine = 1e-5 * coarse
        while coarse > 1.001 * fine:
            middle = math.sqrt(fine * coarse)
            if self._bytes(middle) <= limit:
                coarse = middle
            else:
                fine = middle
        return coarse

    def _bytes(self, resolution: float) -> int:
        return _BYTES_PER_NODE * math.prod(self.grid(resolution).node_counts)

    def check_size(self, grid: FieldGrid) -> None:
        """Refuse a grid that is larger than allowed.

        Raises:
            ParameterError: it states a resolution that fits.
        """
        size = _BYTES_PER_NODE * math.prod(grid.node_counts)
        limit = self.goal.max_bytes
        if size > limit:
            nodes = " x ".join(map(str, grid.node_counts))
            smallest = self._bytes(math.inf)
            fits = f"even the coarsest one takes {smallest} byte"
            if smallest <= limit:  # rounded up, so that the resolution in the message fits
                fits = f"{round_up(self.finest_resolution()):.3g} m fits"
            excess = f"would need a field of {nodes} nodes, {size / 1e6:,.1f} MB, more than"
            excess += f" max_bytes = {limit / 1e6:,.1f} MB; {fits}"
            raise ParameterError("resolution", excess, max(grid.spacing))

    def measure(self, potentials: SingleArray, grid: FieldGrid) -> PotentialField:
        """Return the field, smoothed until its gain reaches the goal, and its accuracy.

        Args:
            potentials: at the nodes of the grid.
            grid: the nodes.
        """
        is_large = potentials.nbytes > BRICK_BYTES
        limit = self.goal.max_gain * self.gain - _GAIN_OF_ROUNDING * is_large
        arguments, passes = self._smooth(potentials, grid, limit)
        if is_large:
            arguments = grid.to_bricks(potentials, arguments)
        return self._measured_field(arguments, grid, passes)

    def _measured_field(
        self, arguments: FieldArguments, grid: FieldGrid, passes: int
    ) -> PotentialField:
        """Return the field of coefficients, and its accuracy."""
        sizes = largest_coefficient(arguments), largest_step(arguments)
        force, energy = grid.error_bounds(self.lipschitz, passes, *sizes)
        field = PotentialField(
            self.texture,
            grid,
            arguments,
            max_depth=self.max_depth,
            continuity=self.continuity,
            passes=passes,
            gain=_UNKNOWN_GAIN,
            one_sided=_UNKNOWN_GAIN,
            accuracy=FieldAccuracy(force, energy),
        )
        difference = self._render_force(field, self.probes) - self.force
        shift = np.abs(self._render_depth(field, self.shallow) - self.shallow_depth)
        field.accuracy = replace(
            field.accuracy,
            rms=float(np.sqrt(np.square(difference).sum(axis=1).mean())),
            largest=float(np.linalg.norm(difference, axis=1).max()),
            depths=tuple(self.depths.tolist()),
            presses=tuple(self.presses.tolist()),
            shares=tuple(self.shares(difference, self.rows).tolist()),
            onset=float(shift.max()),
            onset_places=len(shift),
        )
        return field

    def _smooth(
        self, potentials: SingleArray, grid: FieldGrid, limit: float
    ) -> tuple[FieldArguments, int]:
        """Smooth potentials until no gain is above a limit; return the field and the passes.

        The errors before that are ``unsmoothed_errors``.
        """
        arguments = grid.arguments(potentials, self.lift)
        unsmoothed = self._measured_field(arguments, grid, 0).accuracy
        self.unsmoothed_errors = self.relative_errors(unsmoothed)
        passes = 0
        before = np.inf
        ramp = RAMP
        cells = np.ones(grid.node_counts, np.uint8)
        while True:
            cells = cells_above(arguments, limit, cells)
            count = int(np.count_nonzero(cells))
            if passes == self.goal.passes or count == 0:
                return arguments, passes
            # What is left is due to the borders of smoothed parts: they are widened.
            if count > _STALLED * before:
                ramp = 2 * ramp + 1
            before = count
            weights, cells = node_potentials.spread_marks(cells, grid.border, ramp)
            node_potentials.smooth(potentials, weights, grid)
            arguments = grid.arguments(potentials, self.lift)
            passes += 1


def next_resolution(tried: list[tuple[float, FloatArray]], aim: float = _AIM) -> float:
    """Return the resolution [m] at which errors are expected at an aim.

    Args:
        tried: resolutions [m] and the errors there: they follow powers of the resolution, first
            assumed and then those of the last two.
        aim: greatest error.
    """
    resolution, errors = tried[-1]
    powers = np.array(_POWERS)
    if len(tried) > 1:
        before, errors_before = tried[-2]
        rise = np.log(errors / errors_before) / math.log(resolution / before)
        powers = np.clip(rise, _LEAST_POWERS, _GREATEST_POWER)
    return resolution * float(((aim / errors) ** (1.0 / powers)).min())


def _between(resolution: float, limits: list[float], ends: tuple[float, float]) -> float:
    """Return a resolution between those tried, or one of the ends if none was tried beyond."""
    lower, upper = limits
    if lower < resolution < upper:
        return resolution
    limit = lower if resolution <= lower else upper
    return limit if limit in ends else math.sqrt(lower * upper)


def _evaluate(loop: Callable[..., None], points: FloatArray, *arguments: Any) -> FloatArray:
    """Return the numbers (n, 3) that a compiled loop writes at points (n, 3), in threads."""
    numbers = np.empty(points.shape)
    parts = [slice(k, k + _PROBES_AT_ONCE) for k in range(0, len(points), _PROBES_AT_ONCE)]
    run_in_threads(lambda part: loop(points[part], numbers[part], *arguments), parts, None)
    return numbers


def _mean_of_rows(values: FloatArray, rows: NDArray[np.intp], count: int) -> FloatArray:
    """Return the mean of the values of each row, 0 for a row of none."""
    total = np.bincount(rows, weights=values, minlength=count)
    return total / np.maximum(np.bincount(rows, minlength=count), 1)
