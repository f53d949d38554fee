"""Sampled suprema, where nothing is proved: dense samples, refined around the best ones.

A contact is (X, Y, depth, deflection, sliding). The law's ``contact_batch`` gives the Jacobian at
a contact without a texture, so depth zero, the limit from inside, can be sampled too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from asperity.analysis.bounds.bound import Measure, precise_norm, precise_one_sided, spectral_norm
from asperity.analysis.bounds.branch_and_bound import Problem, Supremum, polish
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.enclosures.cells import Cells
from asperity.kernels.fuse import fuse_contact, uses_position
from asperity.surface import Surface
from asperity.textures.plane_waves import point_at_phase
from asperity.textures.texture import Texture

_ZOOM_CANDIDATES = 12
_ZOOM_STEPS = 44
_BLOCK = 100_000
DEPTH_FRACTIONS = (0.0, 0.25, 0.5, 0.75, 1.0)

DepthLimit = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class DenseMaximum:
    """The greatest value found and the contact that attains it.

    Attributes:
        value: value of the measure, in units of the stiffness [1].
        xy: contact point [m].
        depth: depth [m].
    """

    value: float
    xy: tuple[float, float]
    depth: float


def contact_jacobians(
    surface: Surface,
    xy: FloatArray,
    depth: FloatArray,
    derivatives: FloatArray,
    deflection: FloatArray,
    *,
    sliding: bool = False,
) -> FloatArray:
    """Return J/k of a surface at contacts, shape (n, 3, 3)."""
    n = len(xy)
    law = surface.law
    points = np.zeros((n, 3))
    force = np.empty((n, 3))
    jacobian = np.empty((n, 3, 3))
    if uses_position(law):
        points = law.contact.probe_positions(xy, depth, derivatives)
    contact = points, depth, derivatives, deflection, np.full(n, sliding)
    arguments = (1.0, *surface.law_arguments[1:])
    fuse_contact(law).contact_batch(*contact, force, jacobian, arguments)
    return jacobian


def worst_deflection(surface: Surface, slope: FloatArray) -> FloatArray:
    """Return the deflection that maximises every norm of law F, (n, 2) [m], for slopes (n, 2).

    ‖J‖ and λ_max are convex in d, hence greatest for |d| = d_max, and there for d against
    the slope of the height: the friction then falls along d fastest (docs/theory/jacobians.md).
    """
    length = np.hypot(*slope.T)[:, None]
    unit = np.where(length > 0.0, slope / np.where(length > 0.0, length, 1.0), [1.0, 0.0])
    return np.ascontiguousarray(-surface.parameter("max_deflection") * unit)


def require_depth_contact(surface: Surface) -> None:
    """Refuse a law whose contacts are not determined by a point and a depth: it has no samples.

    Raises:
        ParameterError: for such a law; its numbers need a theorem.
    """
    contact = surface.law.contact
    if not contact.is_determined_by_depth:
        raise ParameterError(
            "law", f"{surface.law} is on the {contact} contact, which has no samples"
        )


def sample_fractions(texture: Texture) -> tuple[FloatArray, FloatArray]:
    """Return sample points as fractions of the domain's spans (n, d), and their spacing (d,)."""
    counts = texture.sample_counts()
    axes = [(np.arange(count) + texture.sample_offset) / count for count in counts]
    if not texture.domain.periodic:
        axes = [np.linspace(0.0, 1.0, count + 1) for count in counts]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(counts))
    return grid, 1.0 / np.array(counts, dtype=float)


def dense_maximum(surface: Surface, measure: Measure, depth_limit: DepthLimit) -> DenseMaximum:
    """Return the greatest value of a measure of J/k over the contacts of a surface.

    Dense samples of the domain at five depths (at both ends of the depth range where the Jacobian
    is affine in the depth); the best dozen are refined until the step is below 1e-12 of the sample
    spacing. The result is a lower bound, attained at the returned contact; nothing is certified.

    Args:
        surface: the surface, without its clamp.
        measure: :func:`~asperity.analysis.bounds.bound.spectral_norm` or ``one_sided``.
        depth_limit: greatest depth [m] of each contact from its height derivatives (n, 6).

    Raises:
        ParameterError: for a user-defined law on the split contact.
    """
    require_depth_contact(surface)
    texture = surface.texture

    def contacts(rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        xy = texture.domain.points(rows[:, :-1])
        derivatives = texture.derivatives(xy)
        depth = np.ascontiguousarray(rows[:, -1] * np.maximum(depth_limit(derivatives), 0.0))
        deflection = np.zeros((len(xy), 2))
        if surface.law.stateful:
            deflection = worst_deflection(surface, derivatives[:, 1:3])
        return xy, depth, derivatives, deflection

    def values(rows: FloatArray) -> FloatArray:
        return measure(contact_jacobians(surface, *contacts(rows)))

    fractions, spacing = sample_fractions(texture)
    levels = (0.0, 1.0) if surface.facts.affine_in_depth else DEPTH_FRACTIONS
    sampled = _sample_values(values, fractions, levels)
    point = _best_of_blocks(sampled.max(axis=1))
    level = np.argmax(sampled[point], axis=1)
    centres = np.column_stack([fractions[point], np.array(levels)[level]])
    bounded = slice(-1 if texture.domain.periodic else 0, None)
    centres = _zoom_in(values, centres, np.append(spacing, 0.25), bounded)
    best = contacts(centres[[int(np.argmax(values(centres)))]])
    accurate = precise_norm if measure is spectral_norm else precise_one_sided
    value = accurate(contact_jacobians(surface, *best))[0]
    ((x, y),) = best[0].tolist()
    return DenseMaximum(float(value), (x, y), float(best[1][0]))


def _sample_values(values: Measure, fractions: FloatArray, levels: Sequence[float]) -> FloatArray:
    """Return the values at every sample and depth, shape (n, levels)."""
    blocks = [fractions[first : first + _BLOCK] for first in range(0, len(fractions), _BLOCK)]

    def at(part: float) -> FloatArray:
        rows = (np.column_stack([block, np.full(len(block), part)]) for block in blocks)
        return np.concatenate([values(block) for block in rows])

    return np.stack([at(part) for part in levels], axis=1)


def _best_of_blocks(values: FloatArray) -> NDArray[np.intp]:
    """Return the indices of the best samples of the best blocks, one candidate per block."""
    starts = np.arange(0, len(values), max(len(values) // 256, 1))
    blocks = np.split(np.arange(len(values)), starts[1:])
    best = np.array([block[np.argmax(values[block])] for block in blocks])
    return best[np.argsort(values[best], kind="stable")[-_ZOOM_CANDIDATES:]]


def _zoom_in(values: Measure, centres: FloatArray, step: FloatArray, bounded: slice) -> FloatArray:
    """Return the candidates after repeatedly halving the step around the best neighbour."""
    width = len(step)
    offsets = np.stack(np.meshgrid(*[(-1.0, -0.5, 0.0, 0.5, 1.0)] * width), axis=-1)
    offsets = offsets.reshape(-1, width)
    # The centre first: of equal values the first one is chosen.
    offsets = offsets[np.argsort(np.abs(offsets).sum(axis=1), kind="stable")]
    for _ in range(_ZOOM_STEPS):
        trial = centres[:, None, :] + offsets * step
        trial[..., bounded] = np.clip(trial[..., bounded], 0.0, 1.0)
        scores = values(trial.reshape(-1, width)).reshape(trial.shape[:2])
        centres = trial[np.arange(len(trial)), np.argmax(scores, axis=1)]
        step = step * 0.5
    return centres


_POLISHED_SAMPLES = 12
_SAMPLE_COUNT = 65_536


def sample_supremum(problem: Problem) -> Supremum:
    """Return the greatest value found, without an upper bound."""
    points = problem.cells.sample_coordinates(_SAMPLE_COUNT)
    values = np.concatenate([problem.values(part) for part in np.array_split(points, 16)])
    _chunks, half = problem.cells.initial_cells()
    best = problem.floor
    at = None
    for index in np.argsort(-values)[:_POLISHED_SAMPLES]:
        top, where = polish(problem, points[index], half, float(values[index]))
        if top > best:
            best = top
            at = where
    return Supremum(best, math.inf, at, len(points), converged=False)


class HeightProblem(Problem):
    """The height [m]; the textures themselves certify its extremes."""

    floor = -np.inf

    def __init__(self, cells: Cells) -> None:
        self.cells = cells

    def values(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Problem`."""
        return self.cells.derivatives(coordinates)[:, 0]


@lru_cache(maxsize=16)
def highest_point(texture: Texture) -> FloatArray:
    """Return a point of the plane (2,) [m] at a local maximum of the height."""
    if texture.single_wave is not None:
        return point_at_phase(texture.single_wave, 0.5 * math.pi)
    cells = texture.sampling_cells()
    highest = sample_supremum(HeightProblem(cells))
    assert highest.at is not None
    return np.asarray(cells.to_plane(highest.at[None])[0])
