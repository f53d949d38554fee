"""A certified number of a surface: which problem it is, and what its solution says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from asperity.analysis.bounds.bound import Bound, Method
from asperity.analysis.bounds.branch_and_bound import (
    DEFAULT_WORK_LIMIT,
    Problem,
    Supremum,
    supremum,
)
from asperity.analysis.bounds.dense_search import need_depths
from asperity.analysis.bounds.measures import CURL, NORM, ONE_SIDED, Number
from asperity.analysis.bounds.problems import (
    FrictionProblem,
    LawProblem,
    SlopeProblem,
    normal_problem,
)
from asperity.analysis.bounds.sampling import sampled
from asperity.analysis.bounds.witness import Witness, attained, lower_of
from asperity.analysis.gain.friction import largest_singular_value, largest_symmetric_eigenvalue
from asperity.analysis.gain.medial_axis import sharpest_crest
from asperity.checks import FloatArray
from asperity.enclosures.cells import Cells
from asperity.laws import LAWS
from asperity.surface import Surface
from asperity.textures.plane_waves import SingleWave

# Rounding of the few operations between a problem's bound and the number.
_INFLATE = 1.0 + 1e-14
_ABOVE_THE_AXIS = 0.999
# A number that is as good as zero has no relative gap.
_NOTHING = 1e-8
Step = Callable[[float], float]


@dataclass(frozen=True)
class Search:
    """How far to search.

    Attributes:
        tolerance: relative gap; ``None`` for 1e-6 on profiles and periodic sums, 1e-4 on sums of
            three independent waves, 1e-3 on maps and wherever a depth or an anchor's state has
            to be searched as well.
        work_limit: greatest number of cells.
        extent: width and depth [m] of the part of the plane that counts, for sums of waves.
    """

    tolerance: float | None = None
    work_limit: int = DEFAULT_WORK_LIMIT
    extent: tuple[float, float] | None = None

    def margin(self, surface: Surface) -> float:
        """Return how far beyond the extent the surface is felt [m]: feet are not below probes."""
        return surface.law.contact.margin(surface.max_depth)

    def wish(self, cells: Cells) -> float | None:
        """Return the gap to try for where it costs little."""
        return cells.wish if self.tolerance is None else None

    def gap(self, cells: Cells) -> float:
        """Return the relative gap to reach."""
        if self.tolerance is not None:
            return self.tolerance
        return cells.gap


def is_shipped(surface: Surface) -> bool:
    """Return whether the surface's law is one of those that come with the package."""
    return LAWS.get(surface.law.letter) is surface.law


def certified(surface: Surface, number: Number, search: Search) -> Bound:
    """Return a number of a surface by branch and bound, or by sampling where there is no proof.

    Sampling remains for sums of more than three independent waves without an extent, for which
    the safe bound stands as ``upper``, and for laws of your own that are written in pieces.

    Raises:
        ParameterError: for a law of your own on the split contact.
    """
    need_depths(surface)
    cells = surface.texture.cells(search.extent, search.margin(surface))
    if cells is None:
        problem, step = _problem(surface, surface.texture.sampling_cells(), number)
        found = sampled(problem)
        text = "more than three independent waves: certified numbers need an extent"
        return _bound(surface, number, problem, found, safe_bound(surface, number), text)
    radius = _least_radius(surface, search)
    if surface.max_depth >= radius:
        above = _ABOVE_THE_AXIS * radius if radius > 0.0 else 1e-3 * surface.max_depth
        shallow = certified(surface.to_depth(above), number, search)
        text = "attained above the medial axis; where the contact point jumps nothing is proved"
        return replace(shallow, upper=math.inf, method="sampled", note=text)
    problem, step = _problem(surface, cells, number)
    at_once = _at_once(surface, problem, search)
    if at_once is not None:
        text = f"convex on an ellipse, within {at_once.cells} of its tangents"
        return _bound(surface, number, problem, at_once, step(at_once.upper), text)
    try:
        found = supremum(
            problem, search.gap(problem.cells), search.work_limit, search.wish(problem.cells)
        )
    except TypeError as error:
        text = f"the law has no interval kernel ({error}); not a proof"
        return _bound(surface, number, problem, sampled(problem), math.inf, text)
    upper = step(found.upper) * _INFLATE
    text = f"branch and bound, {found.cells} cells"
    if not found.reached:
        text += "; the work limit was reached before the tolerance"
    bound = _bound(surface, number, problem, found, upper, text)
    if found.reached and bound.gap > 1.01 * search.gap(problem.cells) and bound.upper > _NOTHING:
        return replace(bound, note=f"{text}; the witness is only near the supremum")
    return bound


def _at_once(surface: Surface, problem: Problem, search: Search) -> Supremum | None:
    """Return bounds that need no search, if they are as near as was asked for."""
    texture, gap = surface.texture, search.wish(problem.cells) or search.gap(problem.cells)
    wave = texture.single_wave
    if not isinstance(problem, FrictionProblem) or wave is None or search.extent is not None:
        return None
    found = problem.around(wave, texture.bounds[0])
    return found if found.upper <= found.lower * (1.0 + gap) else None


def _problem(surface: Surface, cells: Cells, number: Number) -> tuple[Problem, Step]:
    """Return the problem and the step from its value to the number."""
    letter = surface.law.letter if is_shipped(surface) else ""
    if letter == "A":
        beside = 0.0 if number is CURL else 1.0
        return SlopeProblem(cells, beside), _SLOPE_STEPS[number.name]
    if letter == "E" and number is CURL:
        return SlopeProblem(cells, 0.0), lambda slope: slope / math.hypot(1.0, slope)
    if letter == "G" and number is NORM:
        depth = surface.max_depth
        return normal_problem(cells, 1.0 / depth), lambda change: max(1.0, depth * change)
    if letter == "F":
        entries = largest_singular_value if number is NORM else largest_symmetric_eigenvalue
        return FrictionProblem(surface, cells, entries), _same
    return LawProblem(surface, cells, number), _same


def _least_radius(surface: Surface, search: Search) -> float:
    """Return the depth [m] from which on some feet are no nearest points.

    Law E's numbers do not depend on it: every foot is the nearest point at small depths.
    """
    if surface.law.contact.single_valued or (is_shipped(surface) and surface.law.letter == "E"):
        return math.inf
    margin = search.margin(surface)
    crest = sharpest_crest(surface.texture, extent=search.extent, margin=margin)
    return math.inf if crest is None else crest.least_radius


def _same(value: float) -> float:
    return value


_SLOPE_STEPS: dict[str, Step] = {
    NORM.name: lambda slope: math.hypot(1.0, slope),
    ONE_SIDED.name: lambda slope: 0.5 * (1.0 + math.hypot(1.0, slope)),
    CURL.name: _same,
}


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
    top = max(upper, witness.value)
    method: Method = "certified" if math.isfinite(upper) else "sampled"
    if method == "sampled":
        top = math.inf
    return Bound(witness.value, top, method, witness.at, note, witness.deflection, witness.sliding)


def _witness(surface: Surface, number: Number, problem: Problem, at: FloatArray) -> Witness:
    """Return the best of the depths and states at a contact point."""
    xy = problem.cells.plane(at[None])[0]
    if isinstance(problem, FrictionProblem):
        slope = surface.texture.gradient(xy[None])[0]
        length = float(np.hypot(*slope))
        unit = slope / length if length > 0.0 else np.array([1.0, 0.0])
        return attained(surface, number, xy, surface.max_depth, -surface.max_deflection * unit)
    if not isinstance(problem, LawProblem):
        candidates = [attained(surface, number, xy, depth) for depth in (0.0, surface.max_depth)]
        return max(candidates, key=lambda w: w.value)
    stateful = surface.law.stateful
    candidates = [
        attained(
            surface,
            number,
            xy,
            float(contact.depth[0]),
            contact.deflection[0] if stateful else None,
            sliding=contact.sliding,
        )
        for contact in problem.contacts(at[None])
    ]
    return max(candidates, key=lambda w: w.value)


def safe_bound(surface: Surface, number: Number) -> float:
    """Return a bound from |∇h| <= M and ‖Hess h‖ <= K alone; infinite for a law of your own.

    q_A <= √(1 + M²), q_B <= √(1 + M²) + DK, q_C <= 1 + M² + DK, q_G <= max(1, DK), q_F by the
    greatest entries (MATH section 4). q⁺ is at most the norm, |curl| at most twice the norm.
    """
    if not is_shipped(surface):
        return math.inf
    slope, bend = surface.texture.bounds
    bend *= surface.max_depth
    swing, friction = surface.modulation_depth, surface.friction
    low, high = surface.texture.extremes
    steep = swing * slope / max(high - low, 1e-300)
    a = friction * surface.max_depth * (0.5 * (1.0 + swing) / surface.max_deflection + steep)
    b = 0.5 * friction * (1.0 + swing)
    bounds = {
        "A": math.hypot(1.0, slope),
        "B": math.hypot(1.0, slope) + bend,
        "C": 1.0 + slope * slope + bend,
        "F": float(largest_singular_value(np.array([a]), np.array([b]))[0]),
        "G": max(1.0, bend),
    }
    norm = bounds.get(surface.law.letter, math.inf)
    return 2.0 * norm if number is CURL else norm


def wave_number(
    surface: Surface, wave: SingleWave, number: Number, value: float, phase: float
) -> Bound:
    """Return a number that a closed form gives, with its witness at a phase.

    At full depth; law E's is attained at every depth at which the foot is the nearest point.
    """
    along = (phase - wave.phase) * wave.period / (2.0 * math.pi)
    depth = surface.max_depth if surface.law.contact.single_valued else 0.0
    witness = attained(surface, number, along * np.array(wave.direction), depth)
    return Bound(lower_of(value, witness), value, "closed form", witness.at, "MATH section 4")
