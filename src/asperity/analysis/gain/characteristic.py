"""How much a law raises the loop gain: the characteristic number q and the one-sided number q⁺.

q = sup ‖J‖₂/k is the paper's (5); q⁺ = sup λ_max(-sym J)/k decides for conservative laws (MATH
section 4). Both are taken over the working region: depths up to the surface's max_depth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.bounds.branch_and_bound import DEFAULT_WORK_LIMIT
from asperity.analysis.bounds.measures import CURL, NORM, ONE_SIDED, Number
from asperity.analysis.bounds.sampling import highest_point
from asperity.analysis.bounds.witness import proved
from asperity.analysis.gain.answers import at_unit_stiffness, kept_answer
from asperity.analysis.gain.certificate import certified, wave_number, with_clamp
from asperity.analysis.gain.kept import kept
from asperity.analysis.gain.search import Search
from asperity.analysis.gain.theorems import theorem_of
from asperity.checks import positive
from asperity.errors import ParameterError
from asperity.surface import Surface


def characteristic_number(
    surface: Surface,
    tolerance: float | None = None,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
) -> Bound:
    """Return q = sup ‖J‖₂/k over the working region, between proved bounds.

    Theorem for W, E and H; closed form for A, B, C, D and G on a sinusoid; else certified by
    branch and bound with enclosures of the height's derivatives. What cannot be certified is
    sampled and says so.

    Args:
        surface: the surface.
        tolerance: relative gap (upper - lower)/lower at which to stop; by default 1e-6 on
            profiles and periodic sums, 1e-4 on sums of three independent waves, 1e-3 on those of
            four and on maps.
        work_limit: greatest number of cells to look at; if it is reached the bounds found by then
            are returned, and the note says so.
        extent: width and depth [m] of the part of the plane that counts, from the origin, for
            sums of waves; the whole plane by default. For laws that feel the nearest point it is
            widened by the depth on every side.

    Returns:
        A :class:`Bound`; infinite for D where the depth reaches the medial axis, ``at`` then
        being the onset, the least depth of the medial axis.

    Raises:
        ParameterError: for a tolerance, a limit or an extent that is not positive, or a law of
            your own on the split contact.

    Reference:
        The paper's (5), (10) and Table II; MATH section 4 for the rest.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> paper = Sinusoid(amplitude=0.8e-3, period=1e-3)
        >>> round(characteristic_number(Surface(paper, "A")).value, 4)
        5.1251
    """
    return _number(surface, NORM, _search(surface, tolerance, work_limit, extent))


def one_sided_number(
    surface: Surface,
    tolerance: float | None = None,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
) -> Bound:
    """Return q⁺ = sup λ_max(-sym J)/k over the working region; see :func:`characteristic_number`.

    1 by theorem for W, D, E and H; closed form for A and C on a sinusoid.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> paper = Sinusoid(amplitude=0.8e-3, period=1e-3)
        >>> one_sided_number(Surface(paper, "D")).value
        1.0
    """
    return _number(surface, ONE_SIDED, _search(surface, tolerance, work_limit, extent))


def curl_number(
    surface: Surface,
    tolerance: float | None = None,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
) -> Bound:
    """Return sup |curl f|/k over the working region: the greatest work per area of a small loop.

    Zero by theorem for a conservative law; see :func:`characteristic_number` for the rest.

    Raises:
        ParameterError: for a law with state, whose force is no field of position.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> paper = Sinusoid(amplitude=0.8e-3, period=1e-3)
        >>> round(curl_number(Surface(paper, "A")).value, 4)  # the greatest slope, 2πA/l
        5.0265
    """
    search = _search(surface, tolerance, work_limit, extent)
    if surface.law.stateful:
        raise ParameterError("law", f"{surface.law} has state: its force is no field with a curl")
    facts = surface.facts
    if facts.conservative:
        return Bound(0.0, 0.0, "theorem", None, facts.reason)
    return _number(surface, CURL, search)


def _search(
    surface: Surface,
    tolerance: float | None,
    work_limit: int,
    extent: tuple[float, float] | None,
) -> Search:
    if not isinstance(surface, Surface):
        raise ParameterError("surface", "must be a Surface", surface)
    gap = None if tolerance is None else positive("tolerance", tolerance)
    limit = int(positive("work_limit", work_limit))
    if extent is not None:
        if not isinstance(extent, Sequence) or isinstance(extent, str) or len(extent) != 2:
            raise ParameterError("extent", "must be (width, depth) [m]", extent)
        width, depth = (positive("extent", side, "m") for side in extent)
        extent = (width, depth)
    return Search(gap, limit, extent)


def _number(surface: Surface, number: Number, search: Search) -> Bound:
    """Return a number of the force that is rendered: of the law, and where its clamp acts."""
    unit, asked = at_unit_stiffness(surface), repr(astuple(search))
    return kept_answer(f"number {number.name}", unit, lambda: _found(unit, number, search), asked)


def _found(surface: Surface, number: Number, search: Search) -> Bound:
    above = _above_the_clamp(surface, number, search)
    if surface.acting_clamp == "none":
        return above
    name = f"{number.name}, clamped"
    return kept(surface, name, search, lambda: with_clamp(surface, number, search, above))


def _above_the_clamp(surface: Surface, number: Number, search: Search) -> Bound:
    theorem, wave = theorem_of(surface.law), surface.texture.single_wave
    known = theorem.constants.get(number)
    if known is not None:
        # Just inside the highest point the normal is e_z.
        top = highest_point(surface.texture)
        return proved(surface, number, known.value, "theorem", known.reason, top, [0.0])
    own_way = theorem.own_way.get(number)
    if own_way is not None:
        return kept(surface, f"{number.name}, proved", search, lambda: own_way(surface, search))
    if wave is not None and search.extent is None and number in theorem.on_a_wave:
        return wave_number(surface, number, wave, theorem.on_a_wave[number])
    return kept(surface, number.name, search, lambda: certified(surface, number, search))
