"""Textures of one law on a device that differ by a factor: which one meets a target best.

Each requirement is a ratio that has to be at least 1 (docs/theory/envelopes.md). SciPy's optimisers
search the factor and the stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.scan import merit, scan_force
from asperity.analysis.limits import perceptibility
from asperity.core.arguments import FIELD, SEARCH
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable
from asperity.envelopes.wave_borders import AMPLITUDE_RANGE, Trial, WaveCase
from asperity.surface import Surface
from asperity.textures.kinds.prepare_synthetic import prepare_texture
from asperity.textures.texture import Texture

RANGE = "range of factors"
FORCE = "texture force"
MOTOR = "motor"
RMS = "RMS"
MET = 0.995
"""Ratio from which a requirement counts as met: factor and stiffness are rounded."""
NEAR = 1.01
"""Factor within which ratios count as equal."""
_FALLING = {"stability", "leak"}
_RISING = {"least stiffness", "perceptibility", FORCE}
"""Requirements that a greater stiffness exceeds by less, and by more."""
_LEAST = 1e-30
_PENALTY = 100.0
"""Weight of the logarithm by which a requirement is missed, against force and size."""
_TOLERANCE = 1e-3
_MAX_FACTOR = 100.0
_SAMPLES_PER_DECADE = 4
_REFINED = 3
_STIFFNESSES = 48
"""Stiffnesses tried at a factor: the force on the hand has resonances."""


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


class Candidate(NamedTuple):
    """A factor of the texture with a stiffness.

    Attributes:
        score: what is maximized.
        x: natural logarithm of the factor.
        stiffness: [N/m].
    """

    score: float
    x: float
    stiffness: float


class Answer(NamedTuple):
    """The best candidate of a search.

    Attributes:
        is_met: whether it meets the target.
        reach: texture force [N], at most the target's, or factor of the largest texture that meets
            all other requirements; 0 for none.
        found: the candidate.
    """

    is_met: bool
    reach: float
    found: Candidate


Score = Callable[[Mapping[str, float]], float]
Scored = TypeVar("Scored", bound=tuple[float, ...])


class Sample(NamedTuple):
    """A texture at its recommended stiffness.

    Attributes:
        trial: the trial of :class:`~asperity.envelopes.wave_borders.WaveCase`.
        leak: energy gained on the worst loop per period and per stiffness [m²].
        lost: fraction of the scan without contact.
        support: S [1], computed if there is a least one.
        crest: peak of the texture's force on the scan over its RMS if the target is a peak, else 1.
    """

    trial: Trial
    leak: float
    lost: float
    support: float
    crest: float

    def ratios(self, target: Target, stiffness: float) -> dict[str, float]:
        """Return by which factor each requirement is exceeded; all are met from 1 on."""
        if self.trial.waves is None:
            return {"stability": _LEAST, FORCE: _LEAST}
        waves = self.trial.waves.at_stiffness(stiffness)
        response = perceptibility.respond(waves)
        force = self.crest * float(np.linalg.norm(waves.case.forces)) / math.sqrt(2.0)
        if target.at != MOTOR:
            felt = perceptibility.classify_perceptibility(waves, self.trial.doubtful, 0, 0, None)
            force = felt.hand_force / math.sqrt(2.0)
        found = {
            "stability": self.trial.recommended.stiffness / stiffness,
            "least stiffness": stiffness / self.trial.min_stiffness,
            "perceptibility": perceptibility.felt_ratio(waves, response),
            "workspace": _workspace_ratio(self.trial.surface.texture, waves.reach),
            "contact": perceptibility.MAX_CONTACT_LOST / max(self.lost, _LEAST),
            "leak": target.max_leak / max(self.leak * stiffness, _LEAST),
            "support": self.support / max(target.min_support, _LEAST),
            FORCE: force / (target.texture_force or _LEAST),
        }
        return {name: min(max(x, _LEAST), 1.0 / _LEAST) for name, x in found.items()}


def _workspace_ratio(texture: Texture, reach: float) -> float:
    """Return the width of the workspace over the size of a texture with a border."""
    return reach / float(np.hypot(*texture.domain.spans.T).max()) if texture.is_mirrored else 1e30


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
            fits = _workspace_ratio(self.texture, self.case.device.workspace_size)
            greatest = min(_MAX_FACTOR, 1.5 * fits)
            decades = 4
        return math.log(greatest / 10**decades), math.log(greatest)

    def scaled(self, factor: float) -> Texture:
        """Return the texture of a factor."""
        name = "magnify" if self.texture.single_wave is None else "magnify_height"
        return prepare_texture(self.texture, **{name: factor})

    def certified(self, factor: float, rendering: str = FIELD) -> Sample:
        """Return the sample of a factor, with the numbers of a comparison."""
        case = replace(self.case, rendering=rendering)
        is_magnified = rendering == SEARCH and self.texture.single_wave is None
        original = (self.texture, factor) if is_magnified else None
        trial = case.trial(self.scaled(factor), original)
        surface = trial.surface
        leak = 0.0
        if math.isfinite(self.target.max_leak) and not surface.facts.conservative:
            leak = worst_loop(surface).worst_per_period / surface.stiffness
        support = merit(trial.numbered).support if self.target.min_support else 1.0
        scan = scan_force(trial.numbered)
        part = scan if trial.scanned is trial.numbered else scan_force(trial.scanned)
        crest = part.peak / part.ripple if self.target.measure != RMS and part.ripple else 1.0
        return Sample(trial, leak, scan.contact_lost, support, crest)

    def sample(self, x: float) -> Sample:
        """Return the sample of a factor, from its logarithm; law H is searched, not baked."""
        if x not in self.samples:
            self.samples[x] = self.certified(math.exp(x), SEARCH)
        return self.samples[x]

    def top(self, x: float) -> float:
        """Return the recommended stiffness [N/m], relaxed."""
        return self.sample(x).trial.recommended.stiffness * self.relaxed.get("stability", 1.0)

    def ratios(self, x: float, stiffness: float) -> dict[str, float]:
        """Return by which factor each requirement is exceeded; all are met from 1 on."""
        found = self.sample(x).ratios(self.target, stiffness)
        return {name: ratio * self.relaxed.get(name, 1.0) for name, ratio in found.items()}

    def margin(self, ratios: Mapping[str, float]) -> float:
        """Return the logarithm of the least ratio."""
        return math.log(min(ratios.values()))

    def reach(self, ratios: Mapping[str, float]) -> float:
        """Return the logarithm of the ratio of the force, or 0 for the largest texture.

        What the other requirements miss is subtracted, with a weight by which the best candidate
        meets them where any does.
        """
        others = dict(ratios)
        force = math.log(others.pop(FORCE)) if self.target.texture_force else 0.0
        return force + _PENALTY * min(0.0, self.margin(others))

    def candidate(self, x: float, score: Score) -> Candidate:
        """Return the stiffness with the greatest score at a factor."""
        if not (top := self.top(x)):
            return Candidate(_PENALTY * math.log(_LEAST), x, 0.0)
        if self.target.texture_force is None:  # as stiff as it may be
            k = top * min(1.0, self.ratios(x, top)["leak"])
            return Candidate(x + score(self.ratios(x, k)), x, k)
        least = 0.1 * min(top, self.case.conditions.min_stiffness)
        grid = np.linspace(math.log(least), math.log(top), _STIFFNESSES)
        found = _maximize(lambda y: (score(self.ratios(x, math.exp(y))), y), grid, 1)
        return Candidate(found[0], x, math.exp(found[1]))

    def best(self, score: Score) -> Candidate:
        """Return the candidate with the greatest score of all factors."""
        decades = (self.bounds[1] - self.bounds[0]) / math.log(10.0)
        grid = np.linspace(*self.bounds, round(decades * _SAMPLES_PER_DECADE) + 1)
        return _maximize(lambda x: self.candidate(x, score), grid, _REFINED)

    def answer(self) -> Answer:
        """Return the candidate that meets the target with the greatest margin, or the nearest."""
        force = self.target.texture_force
        if force is not None and (found := self.best(self.margin)).score >= 0.0:
            return Answer(True, force, found)
        found = self.best(self.reach)
        ratios = self.ratios(found.x, found.stiffness or 1.0)
        reach = math.exp(found.x) if force is None else force * min(1.0, ratios.pop(FORCE))
        ratios.pop(FORCE, None)
        is_reached = min(ratios.values()) >= MET
        return Answer(force is None and is_reached, reach if is_reached else 0.0, found)

    def binding(self, answer: Answer, ratios: Mapping[str, float]) -> tuple[str, ...]:
        """Return the requirements that limit an answer, of its ratios."""
        others = dict(ratios)
        force = self.target.texture_force
        if force is None or not answer.reach:
            del others[FORCE]
        else:
            others[FORCE] *= force / answer.reach
        least = NEAR * min(others.values())
        names = {name for name, ratio in others.items() if ratio < least}
        if not names & _RISING:  # a greater stiffness would not help
            names -= _FALLING
        if min(abs(answer.found.x - end) for end in self.bounds) < NEAR - 1.0:
            others[RANGE] = 1.0
            names.add(RANGE)
        return tuple(name for name in others if name in names - {FORCE}) or (FORCE,)


def _maximize(function: Callable[[float], Scored], grid: FloatArray, refined: int) -> Scored:
    """Return the greatest tuple, by its first item, at a grid or between its best neighbours."""
    from scipy.optimize import minimize_scalar

    found = [function(float(x)) for x in grid]
    scores = [-math.inf, *(one[0] for one in found), -math.inf]
    last = len(grid) - 1
    peaks = [i for i in range(last + 1) if scores[i + 1] > max(scores[i], scores[i + 2])]
    for at in sorted(peaks, key=lambda i: scores[i + 1])[-refined:]:
        one = minimize_scalar(
            lambda x: -function(x)[0],
            bounds=(grid[max(at - 1, 0)], grid[min(at + 1, last)]),
            method="bounded",
            options={"xatol": _TOLERANCE},
        )
        found.append(function(float(one.x)))
    return max(found, key=lambda one: one[0])


def agree(first: Mapping[str, float], second: Mapping[str, float]) -> bool:
    """Return whether two sets of ratios agree where they may decide."""
    least = 2.0 * max(1.0, *(min(values.values()) for values in (first, second)))
    pairs = [(first[name], second[name]) for name in first.keys() & second.keys()]
    return all(abs(math.log(a / b)) < NEAR - 1.0 for a, b in pairs if min(a, b) < least)
