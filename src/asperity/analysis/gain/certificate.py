"""A certified number of a surface: which problem it is, and what its solution says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from asperity.analysis.bounds.bound import Bound, Method
from asperity.analysis.bounds.branch_and_bound import Problem, Supremum
from asperity.analysis.bounds.clamp_zone import ZoneProblem
from asperity.analysis.bounds.dense_search import need_depths
from asperity.analysis.bounds.measures import Number
from asperity.analysis.bounds.problems import LawProblem
from asperity.analysis.bounds.sampling import sampled
from asperity.analysis.bounds.witness import Witness, attained, proved, rendered, upper_of
from asperity.analysis.gain.search import Search
from asperity.analysis.gain.theorems import ClosedForm, safe_bound, theorem_of
from asperity.checks import FloatArray
from asperity.enclosures.cells import Cells
from asperity.surface import Surface
from asperity.textures.plane_waves import SingleWave

# Rounding of the few operations between a problem's bound and the number.
_INFLATE = 1.0 + 1e-14
_ABOVE_THE_AXIS = 0.999
# A number that is as good as zero has no relative gap.
_NOTHING = 1e-8
Step = Callable[[float], float]


def certified(surface: Surface, number: Number, search: Search) -> Bound:
    """Return a number of a surface by branch and bound, or by sampling where there is no proof.

    Sampling remains for sums of more than four independent waves without an extent, for which
    the safe bound stands as ``upper``, and for laws of your own that are written in pieces.

    Raises:
        ParameterError: for a law of your own on the split contact.
    """
    need_depths(surface)
    cells = surface.texture.cells(search.extent, search.margin(surface))
    if cells is None:
        problem, step = _problem(surface, surface.texture.sampling_cells(), number)
        found = sampled(problem)
        text = "more than four independent waves: certified numbers need an extent"
        return _bound(surface, number, problem, found, safe_bound(surface, number), text)
    radius = _least_radius(surface, search)
    if surface.max_depth >= radius:
        above = _ABOVE_THE_AXIS * radius if radius > 0.0 else 1e-3 * surface.max_depth
        shallow = certified(surface.to_depth(above), number, search)
        text = "attained above the medial axis; where the contact point jumps nothing is proved"
        return replace(shallow, upper=math.inf, method="sampled", note=text)
    problem, step = _problem(surface, cells, number)
    at_once = _at_once(problem, search)
    if at_once is not None:
        text = f"convex on an ellipse, within {at_once.cells} of its tangents"
        return _bound(surface, number, problem, at_once, step(at_once.upper), text)
    try:
        found = search.supremum(problem)
    except TypeError as error:
        text = f"the law has no interval kernel ({error}); not a proof"
        return _bound(surface, number, problem, sampled(problem), math.inf, text)
    upper = step(found.upper) * _INFLATE
    text = f"branch and bound, {found.cells} cells"
    if not found.reached:
        text += "; the work limit was reached before the tolerance"
        upper = min(upper, safe_bound(surface, number))
    bound = _bound(surface, number, problem, found, upper, text)
    if found.reached and bound.gap > 1.01 * search.gap(problem.cells) and bound.upper > _NOTHING:
        return replace(bound, note=f"{text}; the witness is only near the supremum")
    return bound


def _at_once(problem: Problem, search: Search) -> Supremum | None:
    """Return bounds that need no search, if they are as near as was asked for."""
    found = problem.at_once() if search.extent is None else None
    gap = search.cheap_gap(problem.cells) or search.gap(problem.cells)
    return found if found is not None and found.upper <= found.lower * (1.0 + gap) else None


def _problem(surface: Surface, cells: Cells, number: Number) -> tuple[Problem, Step]:
    """Return the problem and the step from its value to the number."""
    reduction = theorem_of(surface.law).reductions.get(number)
    if reduction is None:
        return LawProblem(surface, cells, number), lambda value: value
    return reduction.problem(surface, cells), partial(reduction.step, surface)


def _least_radius(surface: Surface, search: Search) -> float:
    """Return the depth [m] from which on some feet are no nearest points, if that matters."""
    if surface.law.contact.single_valued or theorem_of(surface.law).on_every_foot:
        return math.inf
    crest = search.crest(surface)
    return math.inf if crest is None else crest.least_radius


def _bound(
    surface: Surface,
    number: Number,
    problem: Problem,
    found: Supremum,
    upper: float,
    note: str,
) -> Bound:
    """Return the bound with a witness that is evaluated by the surface itself."""
    where = found.at
    if where is None:
        # Nothing is above the floor, which every point attains.
        where = problem.cells.samples(1)[0]
    witness = _witness(surface, number, problem, where)
    top = upper_of(surface, number, upper, witness)
    method: Method = "certified" if math.isfinite(upper) else "sampled"
    return Bound(witness.value, top, method, witness.at, note, witness.deflection, witness.sliding)


def _witness(surface: Surface, number: Number, problem: Problem, at: FloatArray) -> Witness:
    """Return the best of the depths and states at a contact point."""
    xy = problem.cells.plane(at[None])[0]
    stateful = surface.law.stateful
    states: list[tuple[float, FloatArray | None, bool]] = [
        (float(c.depth[0]), c.deflection[0] if stateful else None, c.sliding)
        for c in problem.contacts(at[None])
    ]
    ends = [(depth, None, False) for depth in (0.0, surface.max_depth)]
    witnesses = [
        attained(surface, number, xy, depth, held, sliding=sliding)
        for depth, held, sliding in states or ends
    ]
    return max(witnesses, key=lambda witness: witness.value)


def with_clamp(surface: Surface, number: Number, search: Search, above: Bound) -> Bound:
    """Return a number of the force that is rendered, from that of the law above max_depth.

    Under a whole or backed clamp it holds at every depth, under a lateral one down to
    ``clamped_depth``. Where nothing is proved of the zone there is no upper bound.
    """
    if math.isinf(above.upper) or _nothing_greater(surface, number):
        return above
    problem = _zone(surface, number, search, above.upper)
    try:
        found = None if problem is None else search.supremum(problem)
    except (AttributeError, TypeError, ValueError):  # a kernel in pieces, or a function unknown
        found = None
    if problem is None or found is None:
        note = f"{above.note}; where the clamp acts, below max_depth, nothing is proved"
        return replace(above, upper=math.inf, method="sampled", note=note)
    if found.upper <= problem.floor:
        return above
    note = f"where the {surface.acting_clamp} clamp acts; branch and bound, {found.cells} cells"
    upper = found.upper * _INFLATE
    if found.at is None:
        return replace(above, upper=upper, method="certified", note=note)
    xy = problem.cells.plane(found.at[None])[0]
    depths = problem.depths(found.at, surface)
    witnesses = [rendered(surface, number, xy, depth) for depth in depths]
    witness = max(witnesses, key=lambda witness: witness.value)
    top = upper_of(surface, number, upper, witness)
    if witness.value < above.lower:
        return replace(above, upper=top, method="certified", note=note)
    return Bound(witness.value, top, "certified", witness.at, note)


def _nothing_greater(surface: Surface, number: Number) -> bool:
    """Return whether the number is nowhere greater where a clamp acts, if any does."""
    clamp = surface.acting_clamp
    held = theorem_of(surface.law).held.get(clamp, ())
    nowhere = clamp == "lateral" and surface.clamped_depth <= surface.max_depth
    return clamp == "none" or number in held or nowhere


def _zone(surface: Surface, number: Number, search: Search, floor: float) -> ZoneProblem | None:
    """Return the problem of the zone where the clamp acts, if there are enclosures of it."""
    cells = surface.texture.cells(search.extent, search.margin(surface))
    if cells is None or surface.law.stateful:
        return None
    return ZoneProblem(surface, cells, number, max(floor, _NOTHING))


def wave_number(surface: Surface, number: Number, wave: SingleWave, form: ClosedForm) -> Bound:
    """Return a number that a closed form gives on a single wave, with its witness.

    At full depth; on the nearest contact at every depth at which the foot is the nearest point.
    """
    value, phase = (of(wave, surface.max_depth) for of in (form.value, form.phase))
    along = (phase - wave.phase) * wave.period / (2.0 * math.pi)
    depth = surface.max_depth if surface.law.contact.single_valued else 0.0
    xy = along * np.array(wave.direction)
    return proved(surface, number, value, "closed form", "formula on a sinusoid", xy, [depth])
