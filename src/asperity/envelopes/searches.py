"""Textures of one law on a device that differ by a factor: which one meets a target best.

Each requirement is a ratio that has to be at least 1 (docs/theory/envelopes.md). Factor and
stiffness are searched on grids, between whose points SciPy refines the best.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from asperity.analysis.energy.leak import find_leak
from asperity.analysis.energy.straight_scan import merit, scan_force
from asperity.analysis.limits import perceptibility, wave_scan
from asperity.core.arguments import FIELD, SEARCH
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable
from asperity.envelopes.wave_borders import AMPLITUDE_RANGE, Trial, WaveCase
from asperity.surface import Surface
from asperity.textures.kinds.prepare_synthetic import prepare_texture
from asperity.textures.texture import Texture

STABILITY = "stability"
LEAST_STIFFNESS = "least stiffness"
PERCEPTIBILITY = "perceptibility"
STEPS = "force steps"
WORKSPACE = "workspace"
CONTACT = "contact"
LEAK = "leak"
SUPPORT = "support"
FORCE = "texture force"
"""The requirements."""
RANGE = "range of factors"
"""What limits a design at the least or the greatest factor."""
MET_WITH_LESS_STIFFNESS = {STABILITY, LEAK}
MET_WITH_MORE_STIFFNESS = {LEAST_STIFFNESS, PERCEPTIBILITY, STEPS, FORCE}
"""Requirements that a greater stiffness exceeds by less, and by more."""

MOTOR = "motor"
RMS = "RMS"
MET = 0.995
"""Ratio from which a requirement counts as met: factor and stiffness are rounded."""
EQUAL = 1.01
"""Factor within which ratios count as equal."""

_LEAST_RATIO = 1e-30
# Weight of the logarithm by which a requirement is missed, against force and size.
_PENALTY = 100.0
_TOLERANCE = 1e-3
_MAX_FACTOR = 100.0
_FACTORS_PER_DECADE = 4
_REFINED_FACTORS = 3
# Stiffnesses tried at a factor: the force on the hand has resonances.
_STIFFNESSES = 48


@dataclass(frozen=True)
class Target(Serializable):
    """What a texture has to reach.

    Attributes:
        texture_force: least RMS or peak of the texture's force [N]; ``None``: the texture is to be
            as large as possible.
        at: where that force acts: ``"motor"`` or ``"hand"``.
        max_leak: greatest energy gained on the worst loop per period [J].
        min_support: least support S [1].
        measure: what the texture's force is: ``"RMS"`` or ``"peak"``.
    """

    texture_force: float | None = None
    at: str = MOTOR
    max_leak: float = math.inf
    min_support: float = 0.0
    measure: str = RMS


class Sample(NamedTuple):
    """A texture at its recommended stiffness.

    Attributes:
        trial: the trial of :class:`~asperity.envelopes.wave_borders.WaveCase`.
        leak: energy gained on the worst loop per period and per stiffness [m²].
        contact_lost: fraction of the scan without contact.
        support: S [1], computed if there is a least one.
        crest_factor: peak of the texture's force on the scan over its RMS if the target is a peak,
            else 1.
    """

    trial: Trial
    leak: float
    contact_lost: float
    support: float
    crest_factor: float

    def ratios(self, target: Target, stiffness: float) -> dict[str, float]:
        """Return by which factor each requirement is exceeded; all are met from 1 on."""
        if self.trial.waves is None:
            return {STABILITY: _LEAST_RATIO, FORCE: _LEAST_RATIO}
        waves = self.trial.waves.at_stiffness(stiffness)
        response = perceptibility.respond_felt(waves)
        texture = self.trial.surface.texture
        ratios = {
            STABILITY: self.trial.recommended.stiffness / stiffness,
            LEAST_STIFFNESS: stiffness / self.trial.min_stiffness,
            PERCEPTIBILITY: perceptibility.felt_level(response),
            STEPS: perceptibility.force_step_ratio(waves.case, response.is_resolved),
            WORKSPACE: _workspace_ratio(texture, waves.reach),
            CONTACT: perceptibility.MAX_CONTACT_LOST / max(self.contact_lost, _LEAST_RATIO),
            LEAK: target.max_leak / max(self.leak * stiffness, _LEAST_RATIO),
            SUPPORT: self.support / max(target.min_support, _LEAST_RATIO),
            FORCE: self._force(waves, target) / (target.texture_force or _LEAST_RATIO),
        }
        return {
            name: min(max(ratio, _LEAST_RATIO), 1.0 / _LEAST_RATIO)
            for name, ratio in ratios.items()
        }

    def _force(self, waves: wave_scan.WaveScan, target: Target) -> float:
        """Return the texture's force [N] where and as the target measures it."""
        if target.at == MOTOR:
            return self.crest_factor * float(np.linalg.norm(waves.case.forces)) / math.sqrt(2.0)
        felt = perceptibility.classify_perceptibility(waves, self.trial.doubtful, 0, 0, None)
        return felt.hand_force / math.sqrt(2.0)


def _workspace_ratio(texture: Texture, workspace_size: float) -> float:
    """Return the width of the workspace over the size of a texture with a border."""
    if not texture.is_mirrored:
        return 1.0 / _LEAST_RATIO
    return workspace_size / perceptibility.texture_length(texture)


class Candidate(NamedTuple):
    """A factor of the texture with a stiffness.

    Attributes:
        score: what is maximized.
        log_factor: natural logarithm of the factor.
        stiffness: [N/m].
    """

    score: float
    log_factor: float
    stiffness: float


class Answer(NamedTuple):
    """The best candidate of a search.

    Attributes:
        is_met: whether it meets the target.
        reachable: texture force [N], at most the target's, or factor of the largest texture that
            meets all other requirements; 0 for none.
        candidate: the candidate.
    """

    is_met: bool
    reachable: float
    candidate: Candidate


Score = Callable[[Mapping[str, float]], float]


@dataclass(frozen=True)
class Search:
    """Textures of one law that differ by a factor: of the height of a single wave, else of all.

    Attributes:
        case: law, device and conditions.
        texture: the texture of factor 1.
        target: the target.
        relaxed: factors by which ratios are multiplied, by requirement.
        samples: samples by the logarithm of the factor.
    """

    case: WaveCase
    texture: Texture
    target: Target
    relaxed: Mapping[str, float] = field(default_factory=dict)
    samples: dict[float, Sample] = field(default_factory=dict)

    @property
    def is_conservative(self) -> bool:
        """Whether the law is conservative."""
        return Surface(self.texture, self.case.law).facts.conservative

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Natural logarithms of the least and the greatest factor."""
        if self.texture.single_wave is not None:
            greatest = 2.0 * AMPLITUDE_RANGE[1] / self.texture.peak_to_valley
            decades = 6
        else:
            fitting = _workspace_ratio(self.texture, self.case.device.workspace_size)
            greatest = min(_MAX_FACTOR, 1.5 * fitting)
            decades = 4
        return math.log(greatest / 10**decades), math.log(greatest)

    # --- one factor -------------------------------------------------------------------------------

    def scaled_texture(self, factor: float) -> Texture:
        """Return the texture of a factor."""
        if self.texture.single_wave is None:
            return prepare_texture(self.texture, magnify=factor)
        return prepare_texture(self.texture, magnify_height=factor)

    def compute_sample(self, factor: float, rendering: str = FIELD) -> Sample:
        """Return the sample of a factor, by default with the numbers of a comparison."""
        case = replace(self.case, rendering=rendering)
        is_magnified = rendering == SEARCH and self.texture.single_wave is None
        original = (self.texture, factor) if is_magnified else None
        trial = case.trial(self.scaled_texture(factor), original)
        surface = trial.surface
        leak = 0.0
        if math.isfinite(self.target.max_leak) and not surface.facts.conservative:
            leak = find_leak(surface).worst_per_period / surface.stiffness
            leak = math.inf if math.isnan(leak) else leak
        support = 1.0
        if self.target.min_support:
            support = merit(trial.numbered).support
        scan = scan_force(trial.numbered)
        crest_factor = 1.0
        if self.target.measure != RMS:
            texture_scan = scan_force(trial.scanned)
            if texture_scan.ripple:
                crest_factor = texture_scan.peak / texture_scan.ripple
        return Sample(trial, leak, scan.contact_lost, support, crest_factor)

    def sample(self, log_factor: float) -> Sample:
        """Return the sample of a factor, from its logarithm; law H is searched, not baked."""
        if log_factor not in self.samples:
            self.samples[log_factor] = self.compute_sample(math.exp(log_factor), SEARCH)
        return self.samples[log_factor]

    def max_stiffness(self, log_factor: float) -> float:
        """Return the recommended stiffness at a factor [N/m], relaxed; 0 if none is known."""
        stiffness = self.sample(log_factor).trial.recommended.stiffness
        return stiffness * self.relaxed.get(STABILITY, 1.0)

    def ratios(self, log_factor: float, stiffness: float) -> dict[str, float]:
        """Return by which factor each requirement is exceeded, relaxed; all are met from 1 on."""
        ratios = self.sample(log_factor).ratios(self.target, stiffness)
        return {name: ratio * self.relaxed.get(name, 1.0) for name, ratio in ratios.items()}

    # --- scores -----------------------------------------------------------------------------------

    def score_margin(self, ratios: Mapping[str, float]) -> float:
        """Return the logarithm of the least ratio."""
        return math.log(min(ratios.values()))

    def score_reach(self, ratios: Mapping[str, float]) -> float:
        """Return the logarithm of the ratio of the force, or 0 for the largest texture.

        What the other requirements miss is subtracted, with a weight by which the best candidate
        meets them where any does.
        """
        others = dict(ratios)
        force = others.pop(FORCE)
        missed = _PENALTY * min(0.0, self.score_margin(others))
        if self.target.texture_force is None:
            return missed
        return math.log(force) + missed

    # --- the search -------------------------------------------------------------------------------

    def find_answer(self) -> Answer:
        """Return the candidate that meets the target with the greatest margin, or the nearest."""
        force = self.target.texture_force
        if force is not None:
            candidate = self._best_candidate(self.score_margin)
            if candidate.score >= 0.0:
                return Answer(True, force, candidate)
        candidate = self._best_candidate(self.score_reach)
        ratios = self.ratios(candidate.log_factor, candidate.stiffness or 1.0)
        force_ratio = ratios.pop(FORCE)
        if min(ratios.values()) < MET:
            return Answer(False, 0.0, candidate)
        if force is None:
            return Answer(True, math.exp(candidate.log_factor), candidate)
        return Answer(False, force * min(1.0, force_ratio), candidate)

    def _best_candidate(self, score: Score) -> Candidate:
        """Return the candidate with the greatest score of all factors."""
        decades = (self.bounds[1] - self.bounds[0]) / math.log(10.0)
        grid = np.linspace(*self.bounds, round(decades * _FACTORS_PER_DECADE) + 1)
        return _maximize(lambda x: self._candidate_at(x, score), grid, _REFINED_FACTORS)

    def _candidate_at(self, log_factor: float, score: Score) -> Candidate:
        """Return the candidate with the greatest score at a factor."""
        greatest = self.max_stiffness(log_factor)
        if not greatest:
            return Candidate(_PENALTY * math.log(_LEAST_RATIO), log_factor, 0.0)
        if self.target.texture_force is None:  # as stiff as it may be
            stiffness = greatest * min(1.0, self.ratios(log_factor, greatest)[LEAK])
            size = log_factor + score(self.ratios(log_factor, stiffness))
            return Candidate(size, log_factor, stiffness)
        least = 0.1 * min(greatest, self.case.conditions.min_stiffness)
        grid = np.linspace(math.log(least), math.log(greatest), _STIFFNESSES)
        best_score, log_stiffness = _maximize(
            lambda y: (score(self.ratios(log_factor, math.exp(y))), y), grid, 1
        )
        return Candidate(best_score, log_factor, math.exp(log_stiffness))

    def limiting_requirements(self, answer: Answer, ratios: Mapping[str, float]) -> tuple[str, ...]:
        """Return the requirements that limit an answer, of its ratios."""
        compared = dict(ratios)
        force = self.target.texture_force
        if force is None or not answer.reachable:
            del compared[FORCE]
        else:
            compared[FORCE] *= force / answer.reachable
        least = min(compared.values())
        names = {name for name, ratio in compared.items() if ratio < EQUAL * least}
        if not names & MET_WITH_MORE_STIFFNESS:  # less stiffness would help
            names -= MET_WITH_LESS_STIFFNESS
        distances = [abs(answer.candidate.log_factor - end) for end in self.bounds]
        if min(distances) < EQUAL - 1.0:
            compared[RANGE] = 1.0
            names.add(RANGE)
        limiting = [name for name in compared if name in names and name != FORCE]
        return tuple(limiting) or (FORCE,)


Scored = TypeVar("Scored", bound=tuple[float, ...])


def _maximize(function: Callable[[float], Scored], grid: FloatArray, refined: int) -> Scored:
    """Return the greatest tuple, by its first item, at a grid or between its best neighbours.

    Args:
        function: the tuple at a point.
        grid: the points tried, ascending.
        refined: number of the best local maxima between whose neighbours SciPy searches.
    """
    from scipy.optimize import minimize_scalar

    tried = [function(float(x)) for x in grid]
    scores = [-math.inf, *[scored[0] for scored in tried], -math.inf]
    last = len(grid) - 1
    peaks = [i for i in range(last + 1) if scores[i + 1] > max(scores[i], scores[i + 2])]
    peaks.sort(key=lambda i: scores[i + 1])
    for peak in peaks[-refined:]:
        refinement = minimize_scalar(
            lambda x: -function(x)[0],
            bounds=(grid[max(peak - 1, 0)], grid[min(peak + 1, last)]),
            method="bounded",
            options={"xatol": _TOLERANCE},
        )
        tried.append(function(float(refinement.x)))
    return max(tried, key=lambda scored: scored[0])


def are_consistent(first: Mapping[str, float], second: Mapping[str, float]) -> bool:
    """Return whether two sets of ratios agree where they may decide."""
    deciding = 2.0 * max(1.0, min(first.values()), min(second.values()))
    for name in first.keys() & second.keys():
        ratios = first[name], second[name]
        if min(ratios) < deciding and abs(math.log(ratios[0] / ratios[1])) >= EQUAL - 1.0:
            return False
    return True
