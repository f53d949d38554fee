"""How much a law raises the loop gain: the characteristic number q and the one-sided number q⁺.

q = sup ‖J‖₂/k is the paper's (5); q⁺ = sup λ_max(-sym J)/k decides for conservative laws (MATH
section 4). Both are taken over the working region: depths up to the surface's max_depth.
"""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis import closed_forms
from asperity.analysis.bound import Bound
from asperity.analysis.friction import friction_number
from asperity.analysis.ridges import crest_number
from asperity.analysis.search import Measure, greatest, one_sided, spectral_norm
from asperity.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid


def characteristic_number(surface: Surface) -> Bound:
    """Return q = sup ‖J‖₂/k over the working region.

    Closed form for sinusoids (A, B, C, D, G), theorem for W, E, H and for D where the depth times
    the curvature bound is at most 1/2, certified for F on a sinusoid, else densely sampled and
    zoomed in on: then ``upper`` is infinite and ``lower`` a value that is attained.

    Returns:
        A :class:`Bound`; infinite for D where the depth reaches the medial axis, ``at`` then
        being the onset, the least depth of the medial axis.

    Reference:
        The paper's (5), (10) and Table II; MATH section 4 for the rest.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> paper = Sinusoid(amplitude=0.8e-3, period=1e-3)
        >>> round(characteristic_number(Surface(paper, "A")).value, 4)
        5.1251
    """
    letter = surface.law.letter
    if letter in {"W", "E"} and _shipped(surface):
        return _constant(surface, 1.0, "‖J‖ is exactly k everywhere")
    if letter == "D" and _shipped(surface):
        return crest_number(surface)
    if letter == "H" and _shipped(surface):
        reason = "-c <= Hess U <= 1 for any surface: q = max(1, c)"
        return _constant(surface, max(1.0, surface.continuity), reason)
    return _number(surface, spectral_norm, closed_forms.Q)


def one_sided_number(surface: Surface) -> Bound:
    """Return q⁺ = sup λ_max(-sym J)/k over the working region; see :func:`characteristic_number`.

    1 by theorem for W, D, E and H; closed form for A and C on a sinusoid.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> paper = Sinusoid(amplitude=0.8e-3, period=1e-3)
        >>> one_sided_number(Surface(paper, "D")).value
        1.0
    """
    reasons = {
        "W": "-J = k e_z e_zᵀ",
        "D": "the potential is half a squared distance, whose Hessian is at most the identity",
        "H": "the potential is an infimum of functions whose Hessian is the identity",
        "E": "λ_max of the symmetric part of e_z nᵀ is (1 + n_z)/2, 1 where the surface is level",
    }
    if surface.law.letter in reasons and _shipped(surface):
        return _constant(surface, 1.0, reasons[surface.law.letter])
    return _number(surface, one_sided, closed_forms.ONE_SIDED)


def _shipped(surface: Surface) -> bool:
    from asperity.laws import LAWS

    return LAWS.get(surface.law.letter) is surface.law


def _constant(surface: Surface, value: float, reason: str) -> Bound:
    """Return a number that a theorem gives for every surface.

    1 is attained just inside a crest, where the normal is e_z. A number of law H above 1 is
    approached where the god-object is split; no witness is given for it.
    """
    if surface.law.contact == "nominal":
        return Bound(value, value, "theorem", (0.0, 0.0, 0.0), reason)
    if value > 1.0:
        return Bound(value, value, "theorem", None, reason)
    # The foot where -J_zz of law D, k n_z² there, is greatest: a level point.
    god_object = Surface(surface.texture, "D", max_depth=surface.max_depth)
    at = greatest(god_object, lambda matrices: -matrices[:, 2, 2], _zero_depth).probe
    return Bound(value, value, "theorem", at, reason)


def _zero_depth(derivatives: FloatArray) -> FloatArray:
    return np.zeros(len(derivatives))


def _number(
    surface: Surface, measure: Measure, formulas: dict[str, closed_forms.ClosedForm]
) -> Bound:
    depth = surface.max_depth
    if surface.law.letter == "F" and _shipped(surface) and isinstance(surface.texture, Sinusoid):
        return friction_number(surface, measure is one_sided)
    found = greatest(surface, measure, lambda derivatives: np.full(len(derivatives), depth))
    formula = formulas.get(surface.law.letter) if _shipped(surface) else None
    if formula is not None and isinstance(surface.texture, Sinusoid):
        value = formula(surface.texture, depth)
        # The witness attains the closed form to rounding; the two are one number.
        lower = min(found.value, value)
        return Bound(lower, value, "closed form", found.probe, "MATH section 4")
    note = f"greatest of {found.samples} samples; not a proof"
    return Bound(found.value, math.inf, "sampled", found.probe, note)
