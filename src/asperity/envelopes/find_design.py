"""The texture that meets a target on a device with the greatest margin."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from asperity.analysis.results.compare import DEFAULT_DEVICE, Comparison, Progress, compare
from asperity.analysis.results.recommendation import LawRow
from asperity.core.cache import bypass_results
from asperity.core.checks import check_fraction, check_items, check_keywords, check_positive
from asperity.core.display import Reportable, Tabular
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict
from asperity.core.processes import precompute
from asperity.core.units import round_down
from asperity.devices import DeviceLike
from asperity.envelopes.envelope import make_cases
from asperity.envelopes.searches import (
    FORCE,
    MET,
    MOTOR,
    PERCEPTIBILITY,
    RMS,
    Answer,
    Search,
    Target,
    are_consistent,
)
from asperity.laws import Law
from asperity.textures.catalogue import TextureLike, as_texture

SCHEMA = 2
_COMPARISONS = 3


@dataclass(frozen=True)
class Design(Reportable, Tabular):
    """The texture that meets a target on a device with the greatest margin.

    Attributes:
        target: the target.
        factor: factor of the texture: of its height for a single wave, else in all directions.
        comparison: comparison of the law on that texture at that stiffness.
        margins: by which factor each requirement is exceeded; it is met from 1 on.
        reachable: texture force that can be reached [N], at most that of the target, or factor of
            the largest texture; 0 for none.
        binding: requirements that limit the answer: those that are just met, or with the least
            margin.
    """

    target: Target
    factor: float
    comparison: Comparison
    margins: Mapping[str, float]
    reachable: float
    binding: tuple[str, ...]

    @property
    def row(self) -> LawRow:
        """The law in the comparison."""
        return self.comparison.rows[0]

    @property
    def is_feasible(self) -> bool:
        """Whether every requirement is met, and the comparison agrees."""
        is_stable = self.row.recommended_stiffness >= MET * self.row.surface.stiffness
        return min(self.margins.values()) >= MET and is_stable and self.row.tier == "felt"

    @property
    def lost(self) -> dict[str, float]:
        """What the device takes away, without what is zero: by name, with units.

        RMS of the texture's force and lengths of waves that it does not resolve; parts of the
        height below the depth to which it is pressed, and of the scan without contact.
        """
        felt = self.row.perceptibility
        surface = self.row.surface
        if felt is None:
            return {}
        waves = felt.speed / felt.spectrum.frequencies[~felt.spectrum.is_resolved]
        is_long = waves > self.comparison.device.workspace_size
        losses = {
            "texture force [N]": math.sqrt(1.0 - min(felt.resolved, 1.0)) * felt.texture_rms,
            "waves up to [m]": waves[~is_long].max(initial=0.0),
            "waves from [m]": waves[is_long].min(initial=math.inf),
            "height": 1.0 - surface.max_depth / surface.texture.peak_to_valley,
            "contact": self.row.contact_lost,
        }
        return {name: float(value) for name, value in losses.items() if 1e-6 < value < math.inf}

    def __repr__(self) -> str:
        state = "meets" if self.is_feasible else f"is kept by {self.binding[0]} from"
        k = self.row.surface.stiffness
        return f"<Design: law {self.row.law.letter} at {k:g} N/m {state} the target>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return factor, margins and the numbers of the law, in one row; SI units."""
        margins = {f"margin of {name}": value for name, value in self.margins.items()}
        return [{"factor": self.factor} | margins | self.comparison.table_rows()[0]]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        names = "target factor is_feasible margins reachable binding lost comparison"
        return {"schema": SCHEMA} | attributes_to_dict(self, *names.split())


def design(
    texture: TextureLike,
    device: DeviceLike = DEFAULT_DEVICE,
    laws: str | Sequence[str | Law] | None = None,
    *,
    texture_force: float | None = None,
    peak_force: float | None = None,
    at: str = MOTOR,
    max_leak: float | None = None,
    min_support: float | None = None,
    law_parameters: Mapping[str, float | Sequence[float]] | None = None,
    progress: Progress | None = None,
    **conditions: Any,
) -> Design:
    """Find law, stiffness and factor of a texture that meet a target with the greatest margin.

    Requirements: the stiffness is at most the recommended and at least the least one, the texture
    is felt: it moves the hand by more than what is felt, and its force exceeds some force steps of
    the device; its force is at least ``texture_force`` or ``peak_force``, the leak at most
    ``max_leak``, the support at least ``min_support``, contact is kept on half of the scan, and a
    texture with a border fits into the workspace. The margin is the least factor by which they are
    exceeded. Without a force the answer is the largest texture that meets the others, at its
    recommended stiffness. The height of a single wave is scaled; other textures are magnified in
    all directions. A law without curl is preferred where one meets the target.

    Args:
        texture: the surface; see :func:`~asperity.analysis.results.compare.compare`.
        device: see :func:`~asperity.analysis.results.compare.compare`.
        laws: letters or names, of which the best one is chosen; by default all with a texture.
        texture_force: least RMS of the texture's force [N].
        peak_force: least peak of the texture's force at the motor [N], in place of its RMS.
        at: where ``texture_force`` acts, ``"motor"`` or ``"hand"``.
        max_leak: greatest energy gained on the worst loop per period [J].
        min_support: least support S [1]; see :func:`~asperity.analysis.energy.straight_scan.merit`.
        law_parameters: parameters of laws by name, each a value or several that are tried.
        progress: called with what is computed next: each law, and each comparison.
        **conditions: ``speed``, ``min_stiffness``, ``max_depth`` and ``grip``; see
            :func:`~asperity.envelopes.envelope.envelope`.

    Returns:
        The design; for a target that cannot be reached the nearest one that can.

    Raises:
        ParameterError: for a value that cannot be used.

    Reference:
        docs/theory/envelopes.md.

    Example:
        >>> result = design("sinusoid:period=2mm,amplitude=0.1mm", "touch", "C", texture_force=5e-3)
        >>> result.is_feasible, result.binding
        (True, ('stability', 'least stiffness'))
    """
    if at not in (MOTOR, "hand"):
        raise ParameterError("at", "must be motor or hand", at)
    check_keywords(conditions, {"speed", "min_stiffness", "max_depth", "grip"}, design)
    target = _make_target(texture_force, peak_force, at, max_leak, min_support)
    base = as_texture(texture)
    if base.peak_to_valley == 0.0:
        raise ParameterError("texture", "must have a height: this one is flat")
    values = {name: check_items(name, items) for name, items in (law_parameters or {}).items()}
    searches = {}
    for combination in product(*values.values()):
        parameters = dict(zip(values, combination, strict=True))
        for case in make_cases(device, laws, parameters, design, conditions):
            searches[case.letter, str(case.law_parameters)] = Search(case, base, target)
    report = progress or (lambda _step: None)
    return _confirm(*_best_law([*searches.values()], report), report)


def _make_target(
    texture_force: float | None,
    peak_force: float | None,
    at: str,
    max_leak: float | None,
    min_support: float | None,
) -> Target:
    """Return the target from arguments of :func:`design`, checked."""
    if texture_force is not None:
        texture_force = check_positive("texture_force", texture_force, "N")
    if peak_force is not None:
        peak_force = check_positive("peak_force", peak_force, "N")
        if texture_force is not None:
            raise ParameterError("peak_force", "replaces texture_force: leave one out")
        if at != MOTOR:
            raise ParameterError("peak_force", "is at the motor, at='hand' is not: leave one out")
    return Target(
        texture_force=texture_force if peak_force is None else peak_force,
        at=at,
        max_leak=math.inf if max_leak is None else check_positive("max_leak", max_leak, "J"),
        min_support=0.0 if min_support is None else check_fraction("min_support", min_support),
        measure=RMS if peak_force is None else "peak",
    )


Found = tuple[Search, Answer]


def search_law(search: Search) -> Found:
    """Return a search and its answer, also in a worker process."""
    if search.texture.single_wave is None:
        return search, search.find_answer()
    # Many waves are tried, and each takes less time than the cache.
    with bypass_results():
        return search, search.find_answer()


def _best_law(searches: Sequence[Search], report: Progress) -> Found:
    """Return the search of the best law; those with curl only if no other meets the target."""
    results: list[Found] = []
    for is_conservative in (True, False):
        group = [search for search in searches if search.is_conservative is is_conservative]
        # A user-defined law cannot be sent to another process.
        shared = [search if isinstance(search.case.law, str) else None for search in group]
        with precompute(search_law, shared) as precomputed:
            for search, computed in zip(group, precomputed, strict=True):
                report(f"law {search.case.letter}")
                results.append(computed or search_law(search))
        if any(answer.is_met for _search, answer in results):
            break
    return max(results, key=_preference)


def _preference(result: Found) -> tuple[Any, ...]:
    """Return what is preferred: to meet the target, or nearly; no curl; the margin or the size."""
    search, answer = result
    return answer.is_met, answer.reachable > 0.0, search.is_conservative, answer.candidate.score


def _confirm(search: Search, answer: Answer, report: Progress) -> Design:
    """Return the design of an answer whose numbers are those of a comparison.

    Where they differ from the ones that were searched, these are corrected, and searched again.
    """
    designs: list[Design] = []
    for _ in range(_COMPARISONS):
        factor = float(f"{math.exp(answer.candidate.log_factor):.5g}")
        log_factor = math.log(factor)
        greatest = search.max_stiffness(log_factor)
        stiffness = round_down(min(answer.candidate.stiffness, greatest), 4)
        report(f"comparison of law {search.case.letter}, factor {factor:g}")
        compared = _make_design(search, answer, factor, stiffness)
        designs.append(compared)
        expected = search.ratios(log_factor, compared.row.surface.stiffness)
        if are_consistent(expected, compared.margins):
            break
        relaxed = {
            name: search.relaxed.get(name, 1.0) * margin / expected[name]
            for name, margin in compared.margins.items()
        }
        search = replace(search, relaxed=relaxed)
        answer = search.find_answer()
    best = max(designs, key=lambda compared: (compared.is_feasible, compared.reachable))
    felt = best.row.perceptibility
    if felt is None or PERCEPTIBILITY not in best.margins:
        return best
    # The comparison counts numbers of the device that are not verified, too.
    return replace(best, margins={**best.margins, PERCEPTIBILITY: felt.level})


def _make_design(search: Search, answer: Answer, factor: float, stiffness: float) -> Design:
    case = search.case
    target = search.target
    conditions = case.conditions
    comparison = compare(
        search.scaled_texture(factor),
        case.device,
        [case.law],
        stiffness or None,
        max_depth=conditions.max_depth,
        speed=conditions.speed,
        grip=conditions.grip,
        law_parameters=case.law_parameters,
    )
    sample = search.compute_sample(factor)
    ratios = sample.ratios(target, comparison.rows[0].surface.stiffness)
    margins = {name: ratio for name, ratio in ratios.items() if ratio < 1e20}
    reachable = factor
    if target.texture_force is not None:
        reachable = target.texture_force * min(1.0, margins[FORCE])
    others = [ratio for name, ratio in margins.items() if name != FORCE]
    if min(others) < MET:
        reachable = 0.0
    binding = search.limiting_requirements(answer, ratios)
    return Design(target, factor, comparison, margins, reachable, binding)
