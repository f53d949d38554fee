"""Certified numbers of a surface: the optimization problem to solve, and the resulting bound."""

from __future__ import annotations

import math
from dataclasses import replace

from asperity.analysis.bounds.bound import (
    Bound,
    JacobianMeasure,
    Method,
    Witness,
    checked_upper_bound,
    witness_at_depth,
    witness_in_contact,
)
from asperity.analysis.bounds.branch_and_bound import Problem, Supremum
from asperity.analysis.bounds.problems import ClampProblem, LawProblem
from asperity.analysis.bounds.sampling import require_depth_contact, sample_supremum
from asperity.analysis.gain.medial_axis import SearchOptions
from asperity.analysis.gain.theorems import Reduction, derivative_bound, theorem_on
from asperity.core.checks import FloatArray
from asperity.surface import Surface

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
        found = options.supremum(problem)
    except TypeError as error:
        text = f"the law has no interval kernel ({error}); not a proof"
        return _make_bound(surface, measure, problem, sample_supremum(problem), math.inf, text)
    upper = reduction.to_number(surface, found.upper) * _ROUNDING_FACTOR
    text = f"branch and bound, {found.cell_count} cells"
    if not found.converged:
        text += "; the work limit was reached before the tolerance"
        upper = min(upper, derivative_bound(surface, measure))
    bound = _make_bound(surface, measure, problem, found, upper, text)
    if (
        found.converged
        and bound.gap > 1.01 * options.relative_tolerance(problem.cells)
        and bound.upper > _ZERO_THRESHOLD
    ):
        return replace(bound, note=f"{text}; the witness is only near the supremum")
    return bound


def _direct_bound(problem: Problem, options: SearchOptions) -> Supremum | None:
    """Return bounds that need no search, if they meet the tolerance."""
    found = problem.direct_bound() if options.extent is None else None
    gap = options.cheap_tolerance(problem.cells) or options.relative_tolerance(problem.cells)
    return found if found is not None and found.upper <= found.lower * (1.0 + gap) else None


def _unique_depth(surface: Surface, options: SearchOptions) -> float:
    """Return the depth [m] below which closest points may be ambiguous, infinite if irrelevant."""
    if surface.law.contact.single_valued or theorem_on(surface).holds_beyond_medial_axis:
        return math.inf
    crest = options.crest(surface)
    return math.inf if crest is None else crest.min_radius


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
        found = None if problem is None else options.supremum(problem)
    except (AttributeError, TypeError, ValueError):  # a piecewise kernel or an unknown function
        found = None
    if problem is None or found is None:
        note = f"{unclamped.note}; nothing is proved where the clamp acts, below max_depth"
        return replace(unclamped, upper=math.inf, method="sampled", note=note)
    if found.upper <= problem.floor:
        return unclamped
    clamp = surface.effective_clamp
    note = f"where the {clamp} clamp acts; branch and bound, {found.cell_count} cells"
    upper = found.upper * _ROUNDING_FACTOR
    if found.at is None:
        return replace(unclamped, upper=upper, method="certified", note=note)
    xy = problem.cells.to_plane(found.at[None])[0]
    depths = problem.depths(found.at, surface)
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
