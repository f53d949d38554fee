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

from asperity.analysis.bounds.branch_and_bound import DEFAULT_WORK_LIMIT, Supremum, supremum
from asperity.analysis.bounds.problems import CrestProblem
from asperity.analysis.bounds.sampling import sample_on_texture
from asperity.core.checks import FloatArray
from asperity.textures.plane_waves import SingleWave
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
    result: FloatArray = np.sqrt(np.maximum(mean * mean - gauss, 0.0)) - mean
    return result


@lru_cache(maxsize=16)
def sharpest_crest(
    texture: Texture,
    tolerance: float = _CURVATURE_TOLERANCE,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
    margin: float = 0.0,
) -> Crest | None:
    """Return the crest of least radius, certified; ``None`` for a surface without crests.

    Exact for a sinusoid; else by branch and bound to a relative tolerance of the curvature. A sum
    of more than four independent waves is sampled unless an extent is given, which is then
    searched with a margin on every side.
    """
    if texture.single_wave is not None and extent is None:
        return _crest_of_wave(texture, texture.single_wave)
    cells = texture.cells(extent, margin)
    found: Supremum
    if cells is None:
        cells, found = sample_on_texture(texture, CrestProblem)
    else:
        # Cells without a refined gap reach only their default gap in reasonable time.
        gap = tolerance if cells.refined_gap else max(tolerance, cells.default_gap)
        found = supremum(CrestProblem(cells), gap, work_limit, cells.refined_gap)
    if found.at is None:
        return None
    return _make_crest(texture, cells.to_plane(found.at[None])[0], found.upper)


def _crest_of_wave(texture: Texture, wave: SingleWave) -> Crest:
    along = wave.period * (0.25 - wave.phase / (2.0 * math.pi))
    curvature = (2.0 * math.pi / wave.period) ** 2 * wave.amplitude
    crest = _make_crest(texture, along * np.array(wave.direction), curvature)
    assert crest is not None
    return crest


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
