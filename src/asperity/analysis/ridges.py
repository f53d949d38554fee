"""Where the god-object jumps: the medial axis below the crests.

The nearest surface point splits below a crest of curvature radius R at depth R, the centre of
curvature, if the ball of that radius around it is free of other surface. Above it, law D's
tangential stiffness is k δκ/(1 - δκ) with κ = 1/R, which is unbounded towards R.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.analysis import closed_forms
from asperity.analysis.bound import Bound
from asperity.analysis.search import sample_fractions
from asperity.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid
from asperity.textures.texture import Texture

_CANDIDATES = 64
_ZOOM_STEPS = 44
# The ball is taken this much smaller: at the centre itself many points are equally near.
_SHRINK = 1e-3


@dataclass(frozen=True)
class Crest:
    """A crest whose ball of curvature is free.

    Attributes:
        foot: the surface point [m].
        radius: radius of curvature [m], the depth at which the medial axis begins below it.
        centre: the centre of curvature [m].
    """

    foot: tuple[float, float, float]
    radius: float
    centre: tuple[float, float, float]


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


def sharpest_crest(texture: Texture) -> Crest | None:
    """Return the free crest of least radius, or nothing if no sampled crest is free.

    The crest curvature is sampled over the domain, the highest samples are zoomed in on, and
    the sharpest whose ball of curvature holds no other surface is returned.
    """
    if isinstance(texture, Sinusoid):
        return _sinusoid_crest(texture)
    fractions, spacing = sample_fractions(texture)
    values = np.concatenate(
        [
            crest_curvature(texture.derivatives(texture.domain.points(block)))
            for block in np.array_split(fractions, max(len(fractions) // 100_000, 1))
        ]
    )
    centres = fractions[_local_best(values)]
    centres = _zoom(texture, centres, spacing)
    curvature = crest_curvature(texture.derivatives(texture.domain.points(centres)))
    for index in np.argsort(-curvature):
        if curvature[index] <= 0.0:
            return None
        crest = _crest(texture, texture.domain.points(centres[index : index + 1])[0])
        if _is_free(texture, crest):
            return crest
    return None


def _sinusoid_crest(texture: Sinusoid) -> Crest:
    along = texture.period * (0.25 - texture.phase / (2.0 * math.pi))
    return _crest(texture, along * np.array(texture.direction))


def _local_best(values: FloatArray) -> FloatArray:
    """Return indices of the highest samples of the highest blocks."""
    starts = np.arange(0, len(values), max(len(values) // 1024, 1))
    best = np.array(
        [
            start + np.argmax(part)
            for start, part in zip(starts, np.split(values, starts[1:]), strict=True)
        ]
    )
    order = np.argsort(values[best], kind="stable")[-_CANDIDATES:]
    return np.asarray(best[order])


def _zoom(texture: Texture, centres: FloatArray, step: FloatArray) -> FloatArray:
    width = len(step)
    offsets = np.stack(np.meshgrid(*[(0.0, -1.0, -0.5, 0.5, 1.0)] * width), -1).reshape(-1, width)
    for _ in range(_ZOOM_STEPS):
        trial = centres[:, None, :] + offsets * step
        if not texture.domain.periodic:
            trial = np.clip(trial, 0.0, 1.0)
        points = texture.domain.points(trial.reshape(-1, width))
        scores = crest_curvature(texture.derivatives(points)).reshape(trial.shape[:2])
        centres = trial[np.arange(len(trial)), np.argmax(scores, axis=1)]
        step = step * 0.5
    return centres


def _crest(texture: Texture, xy: FloatArray) -> Crest:
    derivatives = texture.derivatives(xy[None, :])
    radius = 1.0 / float(crest_curvature(derivatives)[0])
    h, hx, hy = derivatives[0, :3]
    below = radius / math.sqrt(1.0 + hx * hx + hy * hy)
    foot = (float(xy[0]), float(xy[1]), float(h))
    centre = (foot[0] + below * float(hx), foot[1] + below * float(hy), foot[2] - below)
    return Crest(foot, radius, centre)


def _is_free(texture: Texture, crest: Crest) -> bool:
    foot, centre = np.array(crest.foot), np.array(crest.centre)
    inside = foot + (1.0 - _SHRINK) * (centre - foot)
    nearest = texture.nearest(inside[None, :])[0]
    distance = float(np.linalg.norm(nearest - inside))
    return distance >= (1.0 - _SHRINK) * crest.radius * (1.0 - 1e-7)


def crest_number(surface: Surface) -> Bound:
    """Return q_D: 1, y/(1 - y) with y = depth times crest curvature, or infinity from y = 1 on.

    Proved where depth · K <= 1/2 with the certified bound K of ‖Hess h‖, and for a sinusoid;
    else from the sharpest free crest that sampling finds.
    """
    texture, depth = surface.texture, surface.max_depth
    crest = sharpest_crest(texture)
    if isinstance(texture, Sinusoid):
        assert crest is not None
        value = closed_forms.q_d(texture, depth)
        below = crest.radius if math.isinf(value) else depth if value > 1.0 else 0.0
        at = _below(crest, below)
        return Bound(value, value, "closed form", at, "MATH section 4")
    if depth * texture.bounds[1] <= 0.5:
        level = None if crest is None else crest.foot
        return Bound(1.0, 1.0, "theorem", level, "depth times the curvature bound is at most 1/2")
    if crest is None:
        return Bound(1.0, math.inf, "sampled", None, "no sampled crest has a free ball")
    y = depth / crest.radius
    if y >= 1.0:
        note = "the depth reaches the medial axis, where the force jumps; its onset is given"
        return Bound(math.inf, math.inf, "sampled", crest.centre, note)
    value = max(1.0, y / (1.0 - y))
    return Bound(value, math.inf, "sampled", _below(crest, depth), "sharpest crest found")


def _below(crest: Crest, depth: float) -> tuple[float, float, float]:
    part = depth / crest.radius
    x, y, z = (f + part * (c - f) for f, c in zip(crest.foot, crest.centre, strict=True))
    return x, y, z
