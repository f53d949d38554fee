"""The characteristic number of law D, from the curvature of the sharpest crest."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis import closed_forms
from asperity.analysis.bound import Bound, Method
from asperity.analysis.branch_and_bound import supremum
from asperity.analysis.cells import cells_of
from asperity.analysis.certificate import Search
from asperity.analysis.highest import highest_point
from asperity.analysis.measures import NORM
from asperity.analysis.problems import CrestProblem
from asperity.analysis.ridges import Crest, sharpest_crest
from asperity.analysis.witness import attained
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid


def crest_number(surface: Surface, search: Search) -> Bound:
    """Return q_D: 1, y/(1 - y) with y = depth times crest curvature, or infinity from y = 1 on.

    ‖J‖/k at depth δ above a foot of crest curvature κ is max(1, δκ/(1 - δκ)), and every foot stays
    the nearest point down to the least radius of all crests (see ``ridges.py``).
    """
    texture, depth = surface.texture, surface.max_depth
    if depth * texture.bounds[1] <= 0.5 and not isinstance(texture, Sinusoid):
        witness = attained(surface, NORM, highest_point(texture), depth)
        note = "depth times the bound of the second derivatives is at most 1/2"
        return Bound(min(witness.value, 1.0), 1.0, "theorem", witness.at, note)
    crest = sharpest_crest(texture, extent=search.extent)
    if crest is None:
        return Bound(1.0, 1.0, "certified", None, "the surface has no crest")
    if depth >= crest.radius:
        method: Method = "closed form" if isinstance(texture, Sinusoid) else _method(crest)
        note = "the depth reaches the medial axis, where the force jumps; its onset is given"
        return Bound(math.inf, math.inf, method, crest.centre, note)
    foot, least = np.array(crest.foot[:2]), crest.least_radius
    if isinstance(texture, Sinusoid):
        value = closed_forms.q_d(texture, depth)
        witness = attained(surface, NORM, foot, depth)
        return Bound(min(witness.value, value), value, "closed form", witness.at, "MATH section 4")
    cells = cells_of(texture, search.extent)
    if cells is not None:
        found = supremum(CrestProblem(cells, depth), search.gap(cells), search.work_limit)
        least = 1.0 / found.upper
        if found.at is not None:
            foot = cells.plane(found.at[None])[0]
    elif texture.bounds[1] > 0.0:
        least = max(least, 1.0 / texture.bounds[1])
    witness = attained(surface, NORM, foot, depth)
    upper = _number(depth / least) * (1.0 + 1e-13)
    proof: Method = "certified" if math.isfinite(upper) else "sampled"
    return Bound(witness.value, max(upper, witness.value), proof, witness.at, "crest curvature")


def _number(y: float) -> float:
    return math.inf if y >= 1.0 else max(1.0, y / (1.0 - y))


def _method(crest: Crest) -> Method:
    return "certified" if crest.least_radius > 0.0 else "sampled"
