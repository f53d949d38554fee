"""Textures of one law on a device that differ by a factor: which one meets a target best.

Each requirement is a ratio that has to be at least 1 (docs/theory/envelopes.md). SciPy's optimisers
search the factor and the stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.merit import contact_lost
from asperity.analysis.limits import perceptibility
from asperity.core.arguments import FIELD, SEARCH
from asperity.core.files import Serializable
from asperity.envelopes.borders import AMPLITUDE_RANGE, find_root
from asperity.envelopes.wave_case import Trial, WaveCase
from asperity.surface import Surface
from asperity.textures.synthetic import prepare_texture
from asperity.textures.texture import Texture

RANGE = "range of factors"
FORCE = "texture force"
MOTOR = "motor"
MET = 0.995
"""Ratio from which a requirement counts as met: factor and stiffness are rounded."""
NEAR = 1.01
"""Factor within which ratios count as equal."""
_FALLING, _RISING = {"stability", "leak"}, {"least stiffness", "perceptibility", FORCE}
"""Requirements that a greater stiffness exceeds by less, and by more."""
_LEAST = 1e-30
_FAINT = 1e-6
"""Least stiffness that is searched, relative to the recommended one."""
_PENALTY = 100.0
"""Weight of the logarithm by which a requirement is missed, against force and size."""
_TOLERANCE = 3e-4
_MAX_FACTOR = 100.0
_SAMPLES_PER_DECADE = 4
_REFINED = 3


@dataclass(frozen=True)
class Target(Serializable):
    """What a texture has to reach.

    Attributes:
        texture_force: least RMS of the texture's force [N]; ``None``: the texture is to be as large
            as possible.
        at: where that force acts: ``"motor"`` or ``"hand"``.
        max_leak: greatest energy gained on the worst loop per period [J].
    """

    texture_force: float | None = None
    at: str = MOTOR
    max_leak: float = math.inf


class Candidate(NamedTuple):
    """A factor of the texture with a stiffness; candidates are ordered by their score.

    Attributes:
        score: logarithm of the margin, of the force or of the factor.
        x: natural logarithm of the factor.
        stiffness: [N/m].
        reach: texture force [N], at most the target's, that meets all other requirements; for the
            largest texture its factor; 0 where they are not met.
        is_met: whether the target is met.
    """

    score: float
    x: float
    stiffness: float
    reach: float = 0.0
    is_met: bool = False


class Sample(NamedTuple):
    """A texture at its recommended stiffness.

    Attributes:
        trial: the trial of :class:`~asperity.envelopes.wave_case.WaveCase`.
        leak: energy gained on the worst loop per period and per stiffness [m²].
        lost: fraction of the scan without contact.
    """

    trial: Trial
    leak: float
    lost: float

    def ratios(self, target: Target, stiffness: float) -> dict[str, float]:
        """Return by which factor each requirement is exceeded; all are met from 1 on."""
        if self.trial.waves is None:
            return {"stability": _LEAST, FORCE: _LEAST}
        waves = self.trial.waves.at_stiffness(stiffness)
        response = perceptibility.respond(waves)
        forces = waves.case.forces
        if target.at != MOTOR:
            hand = response.motions / waves.grip.compliance(response.frequencies)
            forces = hand[response.is_resolved]
        force = float(np.linalg.norm(forces)) / math.sqrt(2.0)
        found = {
            "stability": self.trial.recommended.stiffness / stiffness,
            "least stiffness": stiffness / self.trial.min_stiffness,
            "perceptibility": perceptibility.felt_ratio(waves, response),
            "workspace": _workspace_ratio(self.trial.surface.texture, waves.reach),
            "contact": perceptibility.MAX_CONTACT_LOST / max(self.lost, _LEAST),
            "leak": target.max_leak / max(self.leak * stiffness, _LEAST),
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
            greatest, decades = 2.0 * AMPLITUDE_RANGE[1] / self.texture.peak_to_valley, 6
        else:
            fits = _workspace_ratio(self.texture, self.case.device.workspace_size)
            greatest, decades = min(_MAX_FACTOR, 1.5 * fits), 4
        return math.log(greatest / 10**decades), math.log(greatest)

    def scaled(self, factor: float) -> Texture:
        """Return the texture of a factor."""
        name = "magnify" if self.texture.single_wave is None else "magnify_height"
        return prepare_texture(self.texture, **{name: factor})

    def certified(self, x: float, rendering: str = FIELD) -> Sample:
        """Return the sample of a factor, from its logarithm, with the numbers of a comparison."""
        factor, case = math.exp(x), replace(self.case, rendering=rendering)
        is_magnified = rendering == SEARCH and self.texture.single_wave is None
        original = (self.texture, factor) if is_magnified else None
        trial = case.trial(self.scaled(factor), original)
        surface, leak = trial.surface, 0.0
        if math.isfinite(self.target.max_leak) and not surface.facts.conservative:
            leak = worst_loop(surface).worst_per_period / surface.stiffness
        return Sample(trial, leak, contact_lost(surface))

    def sample(self, x: float) -> Sample:
        """Return the sample of a factor, from its logarithm; law H is searched, not baked."""
        if x not in self.samples:
            self.samples[x] = self.certified(x, SEARCH)
        return self.samples[x]

    def top(self, x: float) -> float:
        """Return the recommended stiffness [N/m], relaxed."""
        return self.sample(x).trial.recommended.stiffness * self.relaxed.get("stability", 1.0)

    def ratios(self, x: float, stiffness: float) -> dict[str, float]:
        """Return by which factor each requirement is exceeded; all are met from 1 on."""
        found = self.sample(x).ratios(self.target, stiffness)
        return {name: ratio * self.relaxed.get(name, 1.0) for name, ratio in found.items()}

    def with_force(self, force: float) -> Search:
        """Return the search for another texture force [N]."""
        return replace(self, target=replace(self.target, texture_force=force))

    def margin(self, x: float) -> Candidate:
        """Return the stiffness with the greatest margin at a factor."""
        if not (top := self.top(x)):
            return Candidate(math.log(_LEAST), x, 0.0)

        def excess(y: float) -> float:
            found = self.ratios(x, math.exp(y))
            falling = min(found.pop(name) for name in _FALLING)
            return math.log(min(found.values()) / falling)

        low, high = math.log(_FAINT * top), math.log(top)
        y = find_root(excess, low, high, _TOLERANCE) if excess(low) < 0.0 < excess(high) else high
        score = math.log(min(self.ratios(x, math.exp(y)).values()))
        return Candidate(score, x, math.exp(y), self.target.texture_force or 0.0, score >= 0.0)

    def reach(self, x: float) -> Candidate:
        """Return the greatest stiffness at a factor; its score is the force, or the factor.

        What the other requirements miss is subtracted, with a weight by which the best candidate
        meets them where any does.
        """
        if not (top := self.top(x)):
            return Candidate(_PENALTY * math.log(_LEAST), x, 0.0)
        stiffness = top * min(1.0, self.ratios(x, top)["leak"])
        others, force = self.ratios(x, stiffness), self.target.texture_force
        ratio = others.pop(FORCE)
        missed = min(0.0, math.log(min(others.values())))
        value = math.exp(x) if force is None else min(ratio, 1.0) * force
        reach, is_met = value if math.exp(missed) >= MET else 0.0, force is None or ratio >= 1.0
        return Candidate(
            math.log(value) + _PENALTY * missed, x, stiffness, reach, bool(reach) and is_met
        )

    def best(self, candidate: Callable[[float], Candidate]) -> Candidate:
        """Return the candidate with the greatest score of all factors."""
        from scipy.optimize import minimize_scalar

        low, high = self.bounds
        count = round((high - low) / math.log(10.0) * _SAMPLES_PER_DECADE) + 1
        grid = [float(x) for x in np.linspace(low, high, count)]
        found = [candidate(x) for x in grid]
        scores = [-math.inf, *(one.score for one in found), -math.inf]
        peaks = [i for i in range(count) if scores[i + 1] > max(scores[i], scores[i + 2])]
        for at in sorted(peaks, key=lambda i: found[i].score)[-_REFINED:]:
            refined = minimize_scalar(
                lambda x: -candidate(x).score,
                bounds=(grid[max(at - 1, 0)], grid[min(at + 1, count - 1)]),
                method="bounded",
                options={"xatol": _TOLERANCE},
            )
            found.append(candidate(float(refined.x)))
        return max(found)

    def answer(self) -> Candidate:
        """Return the candidate that meets the target with the greatest margin, or the nearest."""
        if self.target.texture_force is None:
            return self.best(self.reach)
        found = self.best(self.margin)
        return found if found.is_met else self.best(self.reach)

    def binding(self, answer: Candidate, ratios: Mapping[str, float]) -> tuple[str, ...]:
        """Return the requirements that limit an answer, of its ratios."""
        others, force = dict(ratios), self.target.texture_force
        others[FORCE] *= (force or 0.0) / answer.reach if answer.reach else 0.0
        if not others[FORCE]:
            del others[FORCE]
        least = NEAR * min(others.values())
        names = {name for name, ratio in others.items() if ratio < least}
        if not names & _RISING:  # a greater stiffness would not help
            names -= _FALLING
        at_end = min(abs(answer.x - end) for end in self.bounds) < NEAR - 1.0
        return (*(name for name in others if name in names - {FORCE}), *[RANGE] * at_end)


def agree(first: Mapping[str, float], second: Mapping[str, float]) -> bool:
    """Return whether two sets of ratios agree where they may decide."""
    least = 2.0 * max(1.0, *(min(values.values()) for values in (first, second)))
    pairs = [(first[name], second[name]) for name in first.keys() & second.keys()]
    return all(abs(math.log(a / b)) < NEAR - 1.0 for a, b in pairs if min(a, b) < least)
