"""The medial axis below the crests, where the god-object jumps.

Below a crest of curvature radius R the closest surface point splits at depth R, the centre of
curvature; above it law D's tangential stiffness is k δκ/(1 - δκ) with κ = 1/R, unbounded towards R.
The least depth of the whole medial axis is the radius of the sharpest crest: along the axis the
depth is least either at a centre of curvature or half-way between two surface points
whose normals are opposite (Aamari et al., Electron. J. Statist. 13 (2019) 1359, theorem 3.4), and
the normals of a height function all point upwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asperity.analysis.bounds import bound
from asperity.analysis.bounds.branch_and_bound import (
    DEFAULT_WORK_LIMIT,
    Problem,
    Supremum,
    supremum,
)
from asperity.analysis.bounds.sampling import highest_point, sample_supremum
from asperity.analysis.gain.proofs import CrestProblem, norm_from_curvature, q_d
from asperity.core.checks import FloatArray
from asperity.enclosures.cells import Cells
from asperity.surface import Surface
from asperity.textures.plane_waves import SingleWave, point_at_phase
from asperity.textures.texture import Texture

_CURVATURE_TOLERANCE = 1e-4


@dataclass(frozen=True)
class Crest:
    """The sharpest crest.

    Attributes:
        point: the surface point [m].
        radius: radius of curvature [m], the depth at which the medial axis begins below it.
        centre: the centre of curvature [m].
        min_radius: proved lower bound of every crest's radius [m]; zero without proof.
    """

    point: tuple[float, float, float]
    radius: float
    centre: tuple[float, float, float]
    min_radius: float


def crest_curvature(derivatives: FloatArray) -> FloatArray:
    """Return the greatest downward curvature -κ [1/m] of the surface, shape (n,).

    κ are the principal curvatures of the graph: eigenvalues of S = G⁻¹ H / s with G = I + g gᵀ.

    Args:
        derivatives: h, h_x, h_y, h_xx, h_xy, h_yy, shape (n, 6).
    """
    _h, p, q, r, s, t = derivatives.T
    w = 1.0 + p * p + q * q
    mean = ((1.0 + q * q) * r - 2.0 * p * q * s + (1.0 + p * p) * t) / (2.0 * w**1.5)
    gauss = (r * t - s * s) / (w * w)
    return np.asarray(np.sqrt(np.maximum(mean * mean - gauss, 0.0)) - mean)


@lru_cache(maxsize=16)
def sharpest_crest(
    texture: Texture, extent: tuple[float, float] | None = None, margin: float = 0.0
) -> Crest | None:
    """Return the crest of least radius, certified; ``None`` for a surface without crests.

    Exact for a sinusoid; else by branch and bound to 1e-4 of the curvature. A sum of more than four
    independent waves is sampled unless an extent is given, which is then searched with a margin on
    every side.
    """
    if texture.single_wave is not None and extent is None:
        wave = texture.single_wave
        curvature = (2.0 * math.pi / wave.period) ** 2 * wave.amplitude
        return _make_crest(texture, point_at_phase(wave, 0.5 * math.pi), curvature)
    cells = texture.cells(extent, margin)
    if cells is None:
        cells = texture.sampling_cells()
        crest_bound = sample_supremum(CrestProblem(cells))
    else:
        # Cells without a refined gap reach only their default gap in reasonable time.
        least_gap = 0.0 if cells.refined_gap else cells.default_gap
        gap = max(_CURVATURE_TOLERANCE, least_gap)
        crest_bound = supremum(CrestProblem(cells), gap, cheap_gap=cells.refined_gap)
    if crest_bound.at is None:
        return None
    return _make_crest(texture, cells.to_plane(crest_bound.at[None])[0], crest_bound.upper)


def _make_crest(texture: Texture, xy: FloatArray, max_curvature: float) -> Crest | None:
    derivatives = texture.derivatives(xy[None, :])
    curvature = float(crest_curvature(derivatives)[0])
    if curvature <= 0.0:
        return None
    radius = 1.0 / curvature
    h, hx, hy = derivatives[0, :3]
    below = radius / math.sqrt(1.0 + hx * hx + hy * hy)
    point = (float(xy[0]), float(xy[1]), float(h))
    centre = (point[0] + below * float(hx), point[1] + below * float(hy), point[2] - below)
    least = 1.0 / max_curvature if math.isfinite(max_curvature) else 0.0
    return Crest(point, radius, centre, min(least, radius))


@dataclass(frozen=True)
class SearchOptions:
    """Options of a search.

    Attributes:
        tolerance: relative gap; ``None`` for 1e-6 on profiles and periodic sums, 1e-4 on sums of
            three independent waves, 1e-3 on those of four, on maps and wherever a depth or the
            state of an anchor is searched too.
        work_limit: greatest number of cells.
        extent: width and depth [m] of the part of the plane to search, for sums of waves.
    """

    tolerance: float | None = None
    work_limit: int = DEFAULT_WORK_LIMIT
    extent: tuple[float, float] | None = None

    def margin(self, surface: Surface) -> float:
        """Return the reach of contact beyond the extent [m]: closest points lie beside probes."""
        return surface.law.contact.lateral_reach(surface.max_depth)

    def crest(self, surface: Surface) -> Crest | None:
        """Return the sharpest crest in reach; ``None`` for a surface without crests."""
        return sharpest_crest(surface.texture, self.extent, self.margin(surface))

    def cheap_tolerance(self, cells: Cells) -> float | None:
        """Return the relative gap to reach where it costs little."""
        if self.tolerance is not None:
            return None
        return cells.refined_gap

    def relative_tolerance(self, cells: Cells) -> float:
        """Return the relative gap to reach."""
        if self.tolerance is None:
            return cells.default_gap
        return self.tolerance

    def supremum(self, problem: Problem) -> Supremum:
        """Return proved bounds of the supremum of a problem."""
        cells = problem.cells
        return supremum(
            problem, self.relative_tolerance(cells), self.work_limit, self.cheap_tolerance(cells)
        )


_RELATIVE_ROUNDING = 1e-14
_ONSET_NOTE = "the depth reaches the medial axis, where the force jumps; its onset is given"
_UNDECIDED_NOTE = "crest curvature: undecided whether the depth reaches the medial axis"


def crest_number(surface: Surface, options: SearchOptions) -> bound.Bound:
    """Return q_D: 1, y/(1 - y) with y = depth times crest curvature, or infinity from y = 1 on.

    ‖J‖/k at depth δ below a surface point of crest curvature κ is max(1, δκ/(1 - δκ)), and every
    point stays the closest one down to the least radius of all crests (see ``medial_axis.py``).
    """
    texture = surface.texture
    depth = surface.max_depth
    if texture.single_wave is not None and options.extent is None:
        return _crest_number_of_wave(surface, texture.single_wave)
    if depth * texture.bounds[1] <= 0.5:
        note = "depth times the bound of the second derivatives is at most 1/2"
        return bound.bound_from_theorem(
            surface, bound.NORM, 1.0, "theorem", note, highest_point(texture), [depth]
        )
    crest = options.crest(surface)
    if crest is None:
        note = "the surface has no crest"
        xy = highest_point(texture)
        return bound.bound_from_theorem(surface, bound.NORM, 1.0, "certified", note, xy, [0.0])
    if depth >= crest.radius:
        method: bound.Method = "certified" if crest.min_radius > 0.0 else "sampled"
        return bound.Bound(math.inf, math.inf, method, crest.centre, _ONSET_NOTE)
    xy = np.array(crest.point[:2])
    least = crest.min_radius
    cells = texture.cells(options.extent, options.margin(surface))
    if cells is not None:
        crest_bound = options.supremum(CrestProblem(cells, depth))
        least = 1.0 / crest_bound.upper
        if crest_bound.at is not None:
            xy = cells.to_plane(crest_bound.at[None])[0]
    else:
        least = max(least, 1.0 / texture.bounds[1])
    witness = bound.witness_in_contact(surface, bound.NORM, xy, depth)
    # The effect of rounding grows towards the medial axis.
    upper = norm_from_curvature(_curvature_times_depth(least, depth)) * (1.0 + _RELATIVE_ROUNDING)
    top = bound.checked_upper_bound(surface, bound.NORM, upper, witness)
    if math.isinf(upper):
        return bound.Bound(witness.value, top, "sampled", witness.at, _UNDECIDED_NOTE)
    return bound.Bound(witness.value, top, "certified", witness.at, "crest curvature")


def _crest_number_of_wave(surface: Surface, wave: SingleWave) -> bound.Bound:
    value = q_d(wave, surface.max_depth)
    note = "formula on a sinusoid"
    if math.isinf(value):
        crest = sharpest_crest(surface.texture)
        assert crest is not None
        return bound.Bound(math.inf, math.inf, "closed form", crest.centre, _ONSET_NOTE)
    xy = point_at_phase(wave, 0.5 * math.pi)
    depths = [surface.max_depth]
    return bound.bound_from_theorem(surface, bound.NORM, value, "closed form", note, xy, depths)


def gain_above_crest(surface: Surface, height: float) -> float:
    """Return sup‖J‖/k of law D over the body above a height [m].

    y/(1 - y) at the sharpest crest, infinite if its centre of curvature is above the height.
    """
    crest = sharpest_crest(surface.texture)
    if crest is None:
        return 1.0
    above = crest.point[2] - height
    reach = crest.point[2] - crest.centre[2]
    if reach <= 0.0:  # a radius below the precision of the height
        return math.inf if above > 0.0 else 1.0
    return norm_from_curvature(above / reach)


def split_number(surface: Surface, options: SearchOptions) -> bound.Bound:
    """Return q_H: max(1, c) by theorem, less only where no depth suffices for a split.

    Down to the fraction c/(1 + c) of the crest's radius H is law D, whose number grows to c there.
    """
    c = surface.parameter("continuity")
    reason = "-c <= Hess U <= 1 for any surface: q = max(1, c)"
    crest = options.crest(surface) if c > 1.0 else None
    if crest is None:
        return bound.bound_from_theorem(
            surface, bound.NORM, 1.0, "theorem", reason, highest_point(surface.texture), [0.0]
        )
    share = c / (1.0 + c) * crest.radius
    xy = np.array(crest.point[:2])
    # At the onset of the split the force has two one-sided derivatives.
    depths = [min(surface.max_depth, (1.0 - 1e-6) * share), min(surface.max_depth, 1.05 * share)]
    alone = norm_from_curvature(_curvature_times_depth(crest.min_radius, surface.max_depth))
    upper = min(c, alone * (1.0 + _RELATIVE_ROUNDING) if alone > 1.0 else 1.0)
    if upper < c:
        reason = "law D's number: the depth is too small for the god-object to split"
    return bound.bound_from_theorem(surface, bound.NORM, upper, "theorem", reason, xy, depths)


def _curvature_times_depth(radius: float, depth: float) -> float:
    """Return y, rounded up, infinite for a radius of zero, which means without proof."""
    if radius <= 0.0:
        return math.inf
    return depth / radius * (1.0 + _RELATIVE_ROUNDING)
