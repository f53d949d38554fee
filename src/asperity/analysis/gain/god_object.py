"""The characteristic numbers of laws D and H, from the curvature of the sharpest crest."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.bounds.bound import (
    Bound,
    Method,
    bound_from_theorem,
    checked_upper_bound,
    witness_in_contact,
)
from asperity.analysis.bounds.measures import NORM
from asperity.analysis.bounds.problems import CrestProblem
from asperity.analysis.bounds.sampling import highest_point
from asperity.analysis.gain import closed_forms
from asperity.analysis.gain.medial_axis import sharpest_crest
from asperity.analysis.gain.search_options import SearchOptions
from asperity.surface import Surface
from asperity.textures.plane_waves import SingleWave

_RELATIVE_ROUNDING = 1e-14
_ONSET_NOTE = "the depth reaches the medial axis, where the force jumps; its onset is given"
_UNDECIDED_NOTE = "crest curvature: undecided whether the depth reaches the medial axis"


def crest_number(surface: Surface, options: SearchOptions) -> Bound:
    """Return q_D: 1, y/(1 - y) with y = depth times crest curvature, or infinity from y = 1 on.

    ‖J‖/k at depth δ below a surface point of crest curvature κ is max(1, δκ/(1 - δκ)), and every
    point stays the closest one down to the least radius of all crests (see ``medial_axis.py``).
    """
    texture, depth = surface.texture, surface.max_depth
    if texture.single_wave is not None and options.extent is None:
        return _crest_number_of_wave(surface, texture.single_wave)
    if depth * texture.bounds[1] <= 0.5:
        note = "depth times the bound of the second derivatives is at most 1/2"
        return bound_from_theorem(
            surface, NORM, 1.0, "theorem", note, highest_point(texture), [depth]
        )
    crest = options.crest(surface)
    if crest is None:
        note, xy = "the surface has no crest", highest_point(texture)
        return bound_from_theorem(surface, NORM, 1.0, "certified", note, xy, [0.0])
    if depth >= crest.radius:
        method: Method = "certified" if crest.min_radius > 0.0 else "sampled"
        return Bound(math.inf, math.inf, method, crest.centre, _ONSET_NOTE)
    xy, least = np.array(crest.point[:2]), crest.min_radius
    cells = texture.cells(options.extent, options.margin(surface))
    if cells is not None:
        found = options.supremum(CrestProblem(cells, depth))
        least = 1.0 / found.upper
        if found.at is not None:
            xy = cells.to_plane(found.at[None])[0]
    else:
        least = max(least, 1.0 / texture.bounds[1])
    witness = witness_in_contact(surface, NORM, xy, depth)
    # The effect of rounding grows towards the medial axis.
    upper = _norm_from_curvature(_curvature_times_depth(least, depth)) * (1.0 + _RELATIVE_ROUNDING)
    top = checked_upper_bound(surface, NORM, upper, witness)
    if math.isinf(upper):
        return Bound(witness.value, top, "sampled", witness.at, _UNDECIDED_NOTE)
    return Bound(witness.value, top, "certified", witness.at, "crest curvature")


def _crest_number_of_wave(surface: Surface, wave: SingleWave) -> Bound:
    value, crest = closed_forms.q_d(wave, surface.max_depth), sharpest_crest(surface.texture)
    assert crest is not None
    if math.isinf(value):
        return Bound(math.inf, math.inf, "closed form", crest.centre, _ONSET_NOTE)
    xy, depths = np.array(crest.point[:2]), [surface.max_depth]
    return bound_from_theorem(
        surface, NORM, value, "closed form", "formula on a sinusoid", xy, depths
    )


def gain_above_crest(surface: Surface, height: float) -> float:
    """Return sup‖J‖/k of law D over the body above a height [m].

    y/(1 - y) at the sharpest crest, infinite if its centre of curvature is above the height.
    """
    crest = sharpest_crest(surface.texture)
    if crest is None:
        return 1.0
    above, reach = crest.point[2] - height, crest.point[2] - crest.centre[2]
    if reach <= 0.0:  # a radius below the precision of the height
        return math.inf if above > 0.0 else 1.0
    return _norm_from_curvature(above / reach)


def split_number(surface: Surface, options: SearchOptions) -> Bound:
    """Return q_H: max(1, c) by theorem, less only where no depth suffices for a split.

    Down to the fraction c/(1 + c) of the crest's radius H is law D, whose number grows to c there.
    """
    c = surface.parameter("continuity")
    reason = "-c <= Hess U <= 1 for any surface: q = max(1, c)"
    crest = options.crest(surface) if c > 1.0 else None
    if crest is None:
        return bound_from_theorem(
            surface, NORM, 1.0, "theorem", reason, highest_point(surface.texture), [0.0]
        )
    share = c / (1.0 + c) * crest.radius
    xy = np.array(crest.point[:2])
    # At the onset of the split the force has two one-sided derivatives.
    depths = [min(surface.max_depth, (1.0 - 1e-6) * share), min(surface.max_depth, 1.05 * share)]
    alone = _norm_from_curvature(_curvature_times_depth(crest.min_radius, surface.max_depth))
    upper = min(c, alone * (1.0 + _RELATIVE_ROUNDING) if alone > 1.0 else 1.0)
    if upper < c:
        reason = "law D's number: the depth is too small for the god-object to split"
    return bound_from_theorem(surface, NORM, upper, "theorem", reason, xy, depths)


def _curvature_times_depth(radius: float, depth: float) -> float:
    """Return y, rounded up, infinite for a radius of zero, which means without proof."""
    return depth / radius * (1.0 + _RELATIVE_ROUNDING) if radius > 0.0 else math.inf


def _norm_from_curvature(y: float) -> float:
    return math.inf if y >= 1.0 else max(1.0, y / (1.0 - y))
