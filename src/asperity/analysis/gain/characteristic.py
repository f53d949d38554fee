"""How much a law raises the loop gain: the characteristic number q and the one-sided number q⁺.

q = sup ‖J‖₂/k is the paper's (5); q⁺ = sup λ_max(-sym J)/k decides for conservative laws (MATH
section 4). Both are taken over the working region: depths up to the surface's max_depth.
A number without a theorem or a closed form is certified by branch and bound.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, replace

from asperity.analysis.bounds.bound import (
    CURL,
    NORM,
    ONE_SIDED,
    Bound,
    JacobianMeasure,
    Method,
    Witness,
    bound_from_theorem,
    checked_upper_bound,
    witness_at_depth,
    witness_in_contact,
)
from asperity.analysis.bounds.branch_and_bound import DEFAULT_WORK_LIMIT, Problem, Supremum
from asperity.analysis.bounds.problems import ClampProblem, LawProblem
from asperity.analysis.bounds.sampling import highest_point, require_depth_contact, sample_supremum
from asperity.analysis.gain.medial_axis import SearchOptions
from asperity.analysis.gain.surface_cache import cached_result
from asperity.analysis.gain.theorems import Reduction, derivative_bound, theorem_on
from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
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
    proof = theorem_on(surface).special_proofs.get(measure)
    if bound is None and proof is not None:
        bound = proof(surface, options)
    elif bound is None:
        bound = certify(surface, measure, options)
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


# Rounding of the few operations between a problem's bound and the number.
_ROUNDING_FACTOR = 1.0 + 1e-14
_ABOVE_MEDIAL_AXIS = 0.999
# Below this a number counts as zero and has no relative gap.
_ZERO_THRESHOLD = 1e-8


def certify(surface: Surface, measure: JacobianMeasure, options: SearchOptions) -> Bound:
    """Return a number of a surface by branch and bound, or by sampling where there is no proof.

    Numbers are sampled for sums of more than four independent waves without an extent, where
    ``upper`` is the bound from the derivative bounds, and for user-defined piecewise laws.

    Raises:
        ParameterError: for a user-defined law on the split contact.
    """
    require_depth_contact(surface)
    reduction = theorem_on(surface).reductions.get(measure) or Reduction(
        lambda surface, cells: LawProblem(surface, cells, measure)
    )
    cells = surface.texture.cells(options.extent, options.margin(surface))
    if cells is None:
        problem = reduction.problem(surface, surface.texture.sampling_cells())
        text = "more than four independent waves: certified numbers need an extent"
        upper = derivative_bound(surface, measure)
        return _make_bound(surface, measure, problem, sample_supremum(problem), upper, text)
    radius = _unique_depth(surface, options)
    if surface.max_depth >= radius:
        above = _ABOVE_MEDIAL_AXIS * radius if radius > 0.0 else 1e-3 * surface.max_depth
        shallow = certify(surface.to_depth(above), measure, options)
        text = "attained above the medial axis; nothing is proved where the contact point jumps"
        return replace(shallow, upper=math.inf, method="sampled", note=text)
    problem = reduction.problem(surface, cells)
    direct = _direct_bound(problem, options)
    if direct is not None:
        text = f"convex on an ellipse, within {direct.cell_count} of its tangents"
        upper = reduction.to_number(surface, direct.upper)
        return _make_bound(surface, measure, problem, direct, upper, text)
    try:
        supremum = options.supremum(problem)
    except TypeError as error:
        text = f"the law has no interval kernel ({error}); not a proof"
        return _make_bound(surface, measure, problem, sample_supremum(problem), math.inf, text)
    upper = reduction.to_number(surface, supremum.upper) * _ROUNDING_FACTOR
    text = f"branch and bound, {supremum.cell_count} cells"
    if not supremum.converged:
        text += "; the work limit was reached before the tolerance"
        upper = min(upper, derivative_bound(surface, measure))
    bound = _make_bound(surface, measure, problem, supremum, upper, text)
    if (
        supremum.converged
        and bound.gap > 1.01 * options.relative_tolerance(problem.cells)
        and bound.upper > _ZERO_THRESHOLD
    ):
        return replace(bound, note=f"{text}; the witness is only near the supremum")
    return bound


def _direct_bound(problem: Problem, options: SearchOptions) -> Supremum | None:
    """Return bounds that need no search, if they meet the tolerance."""
    bound = problem.direct_bound()
    if bound is None or options.extent is not None:
        return None
    gap = options.cheap_tolerance(problem.cells) or options.relative_tolerance(problem.cells)
    if bound.upper > bound.lower * (1.0 + gap):
        return None
    return bound


def _unique_depth(surface: Surface, options: SearchOptions) -> float:
    """Return the depth [m] below which closest points may be ambiguous, infinite if irrelevant."""
    if surface.law.contact.single_valued or theorem_on(surface).holds_beyond_medial_axis:
        return math.inf
    crest = options.crest(surface)
    if crest is None:
        return math.inf
    return crest.min_radius


def _make_bound(
    surface: Surface,
    measure: JacobianMeasure,
    problem: Problem,
    supremum: Supremum,
    upper: float,
    note: str,
) -> Bound:
    """Return the bound with a witness evaluated by the surface itself."""
    where = supremum.at
    if where is None:
        # No value is above the floor, which every point attains.
        where = problem.cells.sample_coordinates(1)[0]
    witness = _best_witness(surface, measure, problem, where)
    top = checked_upper_bound(surface, measure, upper, witness)
    method: Method = "certified" if math.isfinite(upper) else "sampled"
    return Bound(witness.value, top, method, witness.at, note, witness.deflection, witness.sliding)


def _best_witness(
    surface: Surface, measure: JacobianMeasure, problem: Problem, at: FloatArray
) -> Witness:
    """Return the best witness over the depths and states at a contact point."""
    xy = problem.cells.to_plane(at[None])[0]
    stateful = surface.law.stateful
    states: list[tuple[float, FloatArray | None, bool]] = [
        (float(c.depth[0]), c.deflection[0] if stateful else None, c.sliding)
        for c in problem.contacts(at[None])
    ]
    ends = [(depth, None, False) for depth in (0.0, surface.max_depth)]
    witnesses = [
        witness_in_contact(surface, measure, xy, depth, deflection, sliding=sliding)
        for depth, deflection, sliding in states or ends
    ]
    return max(witnesses, key=lambda witness: witness.value)


def include_clamp(
    surface: Surface, measure: JacobianMeasure, options: SearchOptions, unclamped: Bound
) -> Bound:
    """Return a number of the rendered force, from that of the law above max_depth.

    Under a whole or backed clamp it holds at every depth, under a lateral one down to
    ``clamped_depth``. There is no upper bound where nothing is proved about the clamped zone.
    """
    if math.isinf(unclamped.upper) or _is_unaffected_by_clamp(surface, measure):
        return unclamped
    problem = _clamp_problem(surface, measure, options, unclamped.upper)
    try:
        supremum = None if problem is None else options.supremum(problem)
    except (AttributeError, TypeError, ValueError):  # a piecewise kernel or an unknown function
        supremum = None
    if problem is None or supremum is None:
        note = f"{unclamped.note}; nothing is proved where the clamp acts, below max_depth"
        return replace(unclamped, upper=math.inf, method="sampled", note=note)
    if supremum.upper <= problem.floor:
        return unclamped
    clamp = surface.effective_clamp
    note = f"where the {clamp} clamp acts; branch and bound, {supremum.cell_count} cells"
    upper = supremum.upper * _ROUNDING_FACTOR
    if supremum.at is None:
        return replace(unclamped, upper=upper, method="certified", note=note)
    xy = problem.cells.to_plane(supremum.at[None])[0]
    depths = problem.depths(supremum.at, surface)
    witnesses = [witness_at_depth(surface, measure, xy, depth) for depth in depths]
    witness = max(witnesses, key=lambda witness: witness.value)
    top = checked_upper_bound(surface, measure, upper, witness)
    if witness.value < unclamped.lower:
        return replace(unclamped, upper=top, method="certified", note=note)
    return Bound(witness.value, top, "certified", witness.at, note)


def _is_unaffected_by_clamp(surface: Surface, measure: JacobianMeasure) -> bool:
    """Return whether no clamp acts, or the number is not greater where it acts."""
    clamp = surface.effective_clamp
    not_raised = theorem_on(surface).not_raised_by_clamp.get(clamp, ())
    is_empty = not clamp.holds_whole_force and surface.clamped_depth <= surface.max_depth
    return measure in not_raised or is_empty


def _clamp_problem(
    surface: Surface, measure: JacobianMeasure, options: SearchOptions, floor: float
) -> ClampProblem | None:
    """Return the problem of the clamped zone, ``None`` without enclosures of it."""
    cells = surface.texture.cells(options.extent, options.margin(surface))
    if cells is None or surface.law.stateful:
        return None
    return ClampProblem(surface, cells, measure, max(floor, _ZERO_THRESHOLD))
