"""How much a law raises the loop gain: the characteristic number q and the one-sided number q⁺.

q = sup ‖J‖₂/k is the paper's (5); q⁺ = sup λ_max(-sym J)/k decides for conservative laws (MATH
section 4). Both are taken over the working region: depths up to the surface's max_depth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple
from typing import TypeVar

from asperity.analysis.bounds.bound import (
    CURL,
    NORM,
    ONE_SIDED,
    Bound,
    JacobianMeasure,
    bound_from_theorem,
)
from asperity.analysis.bounds.branch_and_bound import DEFAULT_WORK_LIMIT
from asperity.analysis.bounds.sampling import highest_point
from asperity.analysis.gain.certificate import certify, include_clamp
from asperity.analysis.gain.medial_axis import SearchOptions
from asperity.analysis.gain.theorems import THEOREMS, theorem_on
from asperity.core.cache import get_or_compute
from asperity.core.checks import check_positive
from asperity.core.digests import content_digest, is_shipped
from asperity.core.errors import ParameterError
from asperity.kernels.fuse import kernel_source
from asperity.laws import LAWS, Law
from asperity.surface import Surface
from asperity.textures.plane_waves import point_at_phase


def characteristic_number(
    surface: Surface,
    tolerance: float | None = None,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
) -> Bound:
    """Return q = sup ‖J‖₂/k over the working region, between proved bounds.

    Theorem for W, E and H; closed form for A, B, C, D and G on a sinusoid; else certified by
    branch and bound with enclosures of the height's derivatives. What cannot be certified is
    sampled, as its method and note state.

    Args:
        surface: the surface.
        tolerance: relative gap (upper - lower)/lower at which to stop; by default 1e-6 on
            profiles and periodic sums, 1e-4 on sums of three independent waves, 1e-3 on those of
            four and on maps.
        work_limit: greatest number of cells to evaluate; when it is reached, the bounds found so
            far are returned with a note.
        extent: width and depth [m] of the part of the plane to search, from the origin, for
            sums of waves; the whole plane by default. For laws on the nearest contact it is
            widened by the depth on every side.

    Returns:
        A :class:`Bound`; infinite for D where the depth reaches the medial axis; ``at`` is then
        the onset, the point of least depth on the medial axis.

    Raises:
        ParameterError: for a tolerance, a limit or an extent that is not positive, or a
            user-defined law on the split contact.

    Reference:
        The paper's (5), (10) and Table II; docs/theory/numbers.md for the rest.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> paper = Sinusoid(amplitude=0.8e-3, period=1e-3)
        >>> round(characteristic_number(Surface(paper, "A")).value, 4)
        5.1251
    """
    return _compute_bound(surface, NORM, make_options(surface, tolerance, work_limit, extent))


def one_sided_number(
    surface: Surface,
    tolerance: float | None = None,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
) -> Bound:
    """Return q⁺ = sup λ_max(-sym J)/k over the working region; see :func:`characteristic_number`.

    1 by theorem for W, D, E and H; closed form for A and C on a sinusoid.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> paper = Sinusoid(amplitude=0.8e-3, period=1e-3)
        >>> one_sided_number(Surface(paper, "D")).value
        1.0
    """
    return _compute_bound(surface, ONE_SIDED, make_options(surface, tolerance, work_limit, extent))


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
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> paper = Sinusoid(amplitude=0.8e-3, period=1e-3)
        >>> round(curl_number(Surface(paper, "A")).value, 4)  # the greatest slope, 2πA/l
        5.0265
    """
    options = make_options(surface, tolerance, work_limit, extent)
    if surface.law.stateful:
        raise ParameterError(
            "law", f"{surface.law} has state: its force is not a field with a curl"
        )
    facts = surface.facts
    if facts.conservative:
        return Bound(0.0, 0.0, "theorem", None, facts.reason)
    return cached_number(surface, CURL, options)


def make_options(
    surface: Surface,
    tolerance: float | None = None,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
) -> SearchOptions:
    """Return the checked options of a search; see :func:`characteristic_number`."""
    if not isinstance(surface, Surface):
        raise ParameterError("surface", "must be a Surface", surface)
    if tolerance is not None:
        tolerance = check_positive("tolerance", tolerance)
    limit = int(check_positive("work_limit", work_limit))
    if extent is not None:
        if not isinstance(extent, Sequence) or isinstance(extent, str) or len(extent) != 2:
            raise ParameterError("extent", "must be (width, depth) [m]", extent)
        width, depth = (check_positive("extent", side, "m") for side in extent)
        extent = (width, depth)
    return SearchOptions(tolerance, limit, extent)


def cached_number(
    surface: Surface, measure: JacobianMeasure, options: SearchOptions | None = None
) -> Bound:
    """Return a number from the cache, also where it is a theorem or a closed form.

    Reading the cache is faster than importing the compiled kernels that evaluate a witness.

    Args:
        surface: the surface.
        measure: the measure of the Jacobian.
        options: options of the search; the default ones if omitted.
    """
    search = options or SearchOptions()
    return cached_result(
        f"number {measure.name}",
        surface,
        lambda unit: _search_bound(unit, measure, search),
        repr(astuple(search)),
    )


def _compute_bound(surface: Surface, measure: JacobianMeasure, options: SearchOptions) -> Bound:
    """Return a number of the rendered force: by theorem or closed form, else by a cached search."""
    known = None
    if not surface.effective_clamp.changes_force:
        known = _bound_without_search(surface, measure, options)
    return known or cached_number(surface, measure, options)


def _search_bound(surface: Surface, measure: JacobianMeasure, options: SearchOptions) -> Bound:
    bound = _bound_without_search(surface, measure, options)
    if bound is None:
        proof = theorem_on(surface).special_proofs.get(measure)
        bound = certify(surface, measure, options) if proof is None else proof(surface, options)
    return include_clamp(surface, measure, options, bound)


def _bound_without_search(
    surface: Surface, measure: JacobianMeasure, options: SearchOptions
) -> Bound | None:
    """Return a number above max_depth by theorem or closed form, ``None`` if it needs a search."""
    theorem = theorem_on(surface)
    wave = surface.texture.single_wave
    constant = theorem.constants.get(measure)
    if constant is not None:
        # Just inside the highest point the normal is e_z.
        top = highest_point(surface.texture)
        return bound_from_theorem(
            surface, measure, constant.value, "theorem", constant.reason, top, [0.0]
        )
    if wave is None or options.extent is not None:
        return None
    proof = theorem.special_proofs.get(measure)
    form = theorem.closed_forms.get(measure)
    if proof is not None:
        return proof(surface, options)
    if form is None:
        return None
    value = form.value(wave, surface.max_depth)
    phase = form.phase(wave, surface.max_depth)
    xy = point_at_phase(wave, phase)
    # At full depth; on the nearest contact wherever the closest point is unique.
    depth = surface.max_depth if surface.law.contact.single_valued else 0.0
    note = "formula on a sinusoid"
    return bound_from_theorem(surface, measure, value, "closed form", note, xy, [depth])


# --- results cached between runs ------------------------------------------------------------------
#
# Every shipped law is k times a function of position: its numbers are computed at 1 N/m, cached
# without the stiffness, and scaled, so a cached result equals a fresh one to the last bit. A
# user-defined law need not be proportional to k: its results hold at its own stiffness only.
# Results that rest on code of the user, in a texture kind, a contact or a theorem, are not cached:
# what that code reads is unknown.

Result = TypeVar("Result")


def is_shipped_law(law: Law) -> bool:
    """Return whether a law belongs to this package: its force is then proportional to k."""
    return LAWS.get(law.letter) is law


def at_unit_stiffness(surface: Surface) -> Surface:
    """Return the surface at 1 N/m; a surface with a user-defined law is returned unchanged."""
    return surface.to_stiffness(1.0) if is_shipped_law(surface.law) else surface


def cached_result(
    name: str, surface: Surface, compute: Callable[[Surface], Result], *extra: str
) -> Result:
    """Return a result about a surface from the cache, or compute and cache it.

    Args:
        name: name of the result.
        surface: the surface; for a shipped law its stiffness does not count.
        compute: computes the result from :func:`at_unit_stiffness`.
        extra: everything else the result depends on.
    """
    content = surface_content(surface, *extra)
    return get_or_compute(name, content, lambda: compute(at_unit_stiffness(surface)))


def surface_content(surface: Surface, *extra: str) -> str | None:
    """Return a digest of a surface, without the stiffness for a shipped law.

    ``None`` where code of the user takes part.
    """
    law = surface.law
    texture = surface.texture.digest
    formula: tuple[str | float, ...] = (law.letter,)
    if not is_shipped_law(law):
        if law in THEOREMS or not is_shipped(type(law.contact)):
            return None
        formula = (kernel_source(law), law.contact.name, surface.stiffness)
    if texture is None:
        return None
    parameters = tuple(surface.law_parameters.items())
    return content_digest(
        texture, formula, surface.max_depth, surface.effective_clamp.name, parameters, *extra
    )
