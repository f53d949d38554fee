"""The characteristic numbers of laws D and H, from the curvature of the sharpest crest."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.bounds.bound import Bound, Method
from asperity.analysis.bounds.branch_and_bound import supremum
from asperity.analysis.bounds.highest import highest_point
from asperity.analysis.bounds.measures import NORM
from asperity.analysis.bounds.problems import CrestProblem
from asperity.analysis.bounds.witness import attained, lower_of, upper_of
from asperity.analysis.gain import closed_forms
from asperity.analysis.gain.medial_axis import Crest, sharpest_crest
from asperity.analysis.gain.search import Search
from asperity.surface import Surface
from asperity.textures.plane_waves import SingleWave

_ROUNDING = 1e-14
_ONSET = "the depth reaches the medial axis, where the force jumps; its onset is given"
_UNDECIDED = "crest curvature: whether the depth reaches the medial axis is not settled"


def crest_number(surface: Surface, search: Search) -> Bound:
    """Return q_D: 1, y/(1 - y) with y = depth times crest curvature, or infinity from y = 1 on.

    ‖J‖/k at depth δ above a foot of crest curvature κ is max(1, δκ/(1 - δκ)), and every foot stays
    the nearest point down to the least radius of all crests (see ``medial_axis.py``).
    """
    texture, depth = surface.texture, surface.max_depth
    if texture.single_wave is not None and search.extent is None:
        return _wave_number(surface, texture.single_wave)
    if depth * texture.bounds[1] <= 0.5:
        witness = attained(surface, NORM, highest_point(texture), depth)
        note = "depth times the bound of the second derivatives is at most 1/2"
        return Bound(lower_of(surface, NORM, 1.0, witness), 1.0, "theorem", witness.at, note)
    margin = search.margin(surface)
    crest = sharpest_crest(texture, extent=search.extent, margin=margin)
    if crest is None:
        witness = attained(surface, NORM, highest_point(texture), 0.0)
        note = "the surface has no crest"
        return Bound(lower_of(surface, NORM, 1.0, witness), 1.0, "certified", witness.at, note)
    if depth >= crest.radius:
        return Bound(math.inf, math.inf, _method(crest), crest.centre, _ONSET)
    foot, least = np.array(crest.foot[:2]), crest.least_radius
    cells = texture.cells(search.extent, margin)
    if cells is not None:
        found = supremum(
            CrestProblem(cells, depth),
            search.gap(cells),
            search.work_limit,
            search.cheap_gap(cells),
        )
        least = 1.0 / found.upper
        if found.at is not None:
            foot = cells.plane(found.at[None])[0]
    elif texture.bounds[1] > 0.0:
        least = max(least, 1.0 / texture.bounds[1])
    witness = attained(surface, NORM, foot, depth)
    # What rounding costs grows towards the medial axis.
    upper = _number(_depth_over(least, depth)) * (1.0 + _ROUNDING)
    proof: Method = "certified" if math.isfinite(upper) else "sampled"
    note = "crest curvature" if proof == "certified" else _UNDECIDED
    top = upper_of(surface, NORM, upper, witness)
    return Bound(witness.value, top, proof, witness.at, note)


def _wave_number(surface: Surface, wave: SingleWave) -> Bound:
    value, crest = closed_forms.q_d(wave, surface.max_depth), sharpest_crest(surface.texture)
    assert crest is not None
    if math.isinf(value):
        return Bound(math.inf, math.inf, "closed form", crest.centre, _ONSET)
    witness = attained(surface, NORM, np.array(crest.foot[:2]), surface.max_depth)
    lower = lower_of(surface, NORM, value, witness)
    return Bound(lower, value, "closed form", witness.at, "MATH section 4")


def gain_above_crest(surface: Surface, height: float) -> float:
    """Return sup‖J‖/k of law D over the body above a height [m].

    y/(1 - y) at the sharpest crest, infinite if its centre of curvature is above the height.
    """
    crest = sharpest_crest(surface.texture)
    if crest is None:
        return 1.0
    return _number((crest.foot[2] - height) / (crest.foot[2] - crest.centre[2]))


def split_number(surface: Surface, search: Search) -> Bound:
    """Return q_H: max(1, c) by theorem, less only where nothing is deep enough to split.

    Down to the fraction c/(1 + c) of the crest's radius H is law D, whose number grows to c there.
    """
    c = surface.parameter("continuity")
    reason = "-c <= Hess U <= 1 for any surface: q = max(1, c)"
    crest = None
    if c > 1.0:
        margin = search.margin(surface)
        crest = sharpest_crest(surface.texture, extent=search.extent, margin=margin)
    if crest is None:
        witness = attained(surface, NORM, highest_point(surface.texture), 0.0)
        return Bound(lower_of(surface, NORM, 1.0, witness), 1.0, "theorem", witness.at, reason)
    share = c / (1.0 + c) * crest.radius
    foot = np.array(crest.foot[:2])
    # The very depth at which the foot splits has two derivatives.
    depths = (min(surface.max_depth, (1.0 - 1e-6) * share), min(surface.max_depth, 1.05 * share))
    witness = max((attained(surface, NORM, foot, d) for d in depths), key=lambda w: w.value)
    least = crest.least_radius
    alone = _number(_depth_over(least, surface.max_depth))
    upper = min(c, alone * (1.0 + _ROUNDING) if alone > 1.0 else 1.0)
    if upper < c:
        reason = "law D's number: the depth is too small for the god-object to split"
    return Bound(lower_of(surface, NORM, upper, witness), upper, "theorem", witness.at, reason)


def _depth_over(radius: float, depth: float) -> float:
    """Return y, rounded up; a radius of which nothing is proved is zero."""
    return depth / radius * (1.0 + _ROUNDING) if radius > 0.0 else math.inf


def _number(y: float) -> float:
    return math.inf if y >= 1.0 else max(1.0, y / (1.0 - y))


def _method(crest: Crest) -> Method:
    return "certified" if crest.least_radius > 0.0 else "sampled"
