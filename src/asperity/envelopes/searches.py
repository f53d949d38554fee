"""Textures of one law on a device that differ by a factor: which one meets a target best.

Each requirement is a ratio that has to be at least 1, and the margin is the least of them
(docs/theory/envelopes.md). SciPy's optimisers search the factor and the stiffness.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.merit import contact_lost
from asperity.analysis.limits import perceptibility
from asperity.core.arguments import SEARCH
from asperity.core.files import Serializable
from asperity.envelopes.borders import AMPLITUDE_RANGE, find_root
from asperity.envelopes.wave_case import Trial, WaveCase
from asperity.surface import Surface
from asperity.textures.synthetic import prepare_texture
from asperity.textures.texture import Texture

RANGE = "range of factors"
FORCE = "texture force"
RELAXATION = 1.1
"""Factor by which a requirement is relaxed to see whether it binds."""
MOTOR = "motor"
_LEAST = 1e-30
_FAINT = 1e-6
"""A texture force that is this part of the target is no requirement."""
_TOLERANCE = 1e-4
_LEAST_GAIN = math.log(1.005)
"""Least gain of the margin by which a relaxed requirement counts as one that binds."""
_NEAR_LEAST = 1.25
_GREATEST_HEIGHT = 2.0 * AMPLITUDE_RANGE[1]
_MAX_FACTOR = 100.0
_SAMPLES = 13
_REFINEMENTS = 8
_AGREEMENT = 0.01
"""Relative difference of ratios that count as equal."""


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
    """A factor of the texture with a stiffness; candidates are ordered by their margin.

    Attributes:
        margin: natural logarithm of the least ratio.
        x: natural logarithm of the factor.
        stiffness: [N/m].
    """

    margin: float
    x: float
    stiffness: float


class Answer(NamedTuple):
    """The best candidate of a search.

    Attributes:
        is_met: whether it meets the target.
        reach: texture force that it reaches [N], at most the target's; 0 for none.
        found: the candidate.
    """

    is_met: bool
    reach: float
    found: Candidate


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

    @property
    def top(self) -> float:
        """Recommended stiffness [N/m]."""
        return self.trial.recommended.stiffness

    def ratios(self, target: Target, stiffness: float) -> dict[str, float]:
        """Return by which factor each requirement is exceeded; all are met from 1 on."""
        if self.trial.waves is None:
            return {"stability": _LEAST}
        waves = self.trial.waves.at_stiffness(stiffness)
        response = perceptibility.respond(waves)
        force = float(np.linalg.norm(waves.case.forces))
        if target.at != MOTOR:
            moved = response.motions / waves.grip.compliance(response.frequencies)
            force = float(np.linalg.norm(moved[response.is_resolved]))
        found = {
            "stability": self.top / stiffness,
            "least stiffness": stiffness / self.trial.min_stiffness,
            "perceptibility": perceptibility.felt_ratio(waves, response),
            "workspace": _workspace_ratio(self.trial.surface.texture, waves.reach),
            "contact": perceptibility.MAX_CONTACT_LOST / max(self.lost, _LEAST),
            "leak": target.max_leak / max(self.leak * stiffness, _LEAST),
            FORCE: force / math.sqrt(2.0) / (target.texture_force or _LEAST),
        }
        return {name: min(max(x, _LEAST), 1.0 / _LEAST) for name, x in found.items()}


def _workspace_ratio(texture: Texture, reach: float) -> float:
    """Return the width of the workspace over the size of a texture with a border."""
    size = float(np.hypot(*texture.domain.spans.T).max())
    return reach / size if texture.is_mirrored else math.inf


def make_sample(trial: Trial, target: Target) -> Sample:
    """Return a sample of a trial; the leak only if the target needs it."""
    surface, leak = trial.surface, 0.0
    if math.isfinite(target.max_leak) and not surface.facts.conservative:
        leak = worst_loop(surface).worst_per_period / surface.stiffness
    return Sample(trial, leak, contact_lost(surface))


@dataclass(frozen=True)
class Search:
    """Single waves of one law that differ in height by a factor.

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

    candidates = 33
    refined = 4
    tolerance = _TOLERANCE
    reserve = 0.0
    decades = 6

    @property
    def is_conservative(self) -> bool:
        """Whether the law is conservative."""
        return Surface(self.texture, self.case.law).facts.conservative

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Natural logarithms of the least and the greatest factor."""
        high = self.greatest() * self.relaxed.get(RANGE, 1.0)
        return math.log(self.greatest() / 10**self.decades), math.log(high)

    def greatest(self) -> float:
        """Return the greatest factor."""
        return _GREATEST_HEIGHT / self.texture.peak_to_valley

    def scaled(self, factor: float) -> Texture:
        """Return the texture of a factor."""
        return prepare_texture(self.texture, magnify_height=factor)

    def certified(self, x: float) -> Sample:
        """Return the sample of a factor, from its logarithm, with the numbers of a comparison."""
        return make_sample(self.case.trial(self.scaled(math.exp(x))), self.target)

    def sample(self, x: float) -> Sample:
        """Return the sample of a factor, from its logarithm."""
        if x not in self.samples:
            self.samples[x] = self.certified(x)
        return self.samples[x]

    def neighbours(self, x: float) -> tuple[Sample, Sample, float]:
        """Return the samples on both sides of a factor, and where it lies between them."""
        return self.sample(x), self.sample(x), 0.0

    def top(self, x: float) -> float:
        """Return the recommended stiffness [N/m], relaxed."""
        first, second, share = self.neighbours(x)
        return _between(first.top, second.top, share) * self.relaxed.get("stability", 1.0)

    def ratios(self, x: float, stiffness: float) -> dict[str, float]:
        """Return by which factor each requirement is exceeded; all are met from 1 on."""
        first, second, share = self.neighbours(x)
        part = stiffness / max(_between(first.top, second.top, share), _LEAST)
        found = first.ratios(self.target, part * first.top)
        if share:  # at the same part of the recommended stiffness
            other = second.ratios(self.target, part * second.top)
            found = {name: _between(found[name], other[name], share) for name in found}
        return {name: ratio * self.relaxed.get(name, 1.0) for name, ratio in found.items()}

    def candidate(self, x: float) -> Candidate:
        """Return the stiffness with the greatest margin at a factor."""
        if not (top := self.top(x)):
            return Candidate(math.log(_LEAST), x, 0.0)

        def excess(y: float) -> float:
            rising, falling = _split(self.ratios(x, math.exp(y)))
            return math.log(rising / falling)

        high, low = math.log(top), math.log(_FAINT * top)
        if self.target.texture_force is None:
            high += min(0.0, math.log(self.ratios(x, top)["leak"]))
        elif excess(high) > 0.0 > excess(low):
            high = find_root(excess, low, high, _TOLERANCE)
        found = self.ratios(x, stiffness := math.exp(high))
        if self.target.texture_force is None:
            del found["stability"]  # at the recommended stiffness it is met, by its margin
        return Candidate(math.log(min(found.values())), x, stiffness)

    def best(self) -> Candidate:
        """Return the candidate with the greatest margin, or the largest one that is met."""
        from scipy.optimize import minimize_scalar

        count = self.candidates
        grid = [float(x) for x in np.linspace(*self.bounds, count)]
        found = [self.candidate(x) for x in grid]
        none = Candidate(-math.inf, 0.0, 0.0)
        padded = [none, *found, none]
        peaks = [i for i, one in enumerate(found) if one > max(padded[i], padded[i + 2])]
        for at in sorted(peaks, key=lambda i: found[i])[-self.refined :]:
            refined = minimize_scalar(
                lambda x: -self.candidate(x).margin,
                bounds=(grid[max(at - 1, 0)], grid[min(at + 1, count - 1)]),
                method="bounded",
                options={"xatol": self.tolerance},
            )
            found.append(self.candidate(float(refined.x)))
        best = max(found)
        if self.target.texture_force is not None or best.margin < self.reserve:
            return best
        above = sorted((one for one in found if one.x >= best.x), key=lambda one: one.x)
        last = max(i for i, one in enumerate(above) if one.margin >= self.reserve)
        if last + 1 == len(above):
            return above[last]

        def reserve(x: float) -> float:
            return self.candidate(x).margin - self.reserve

        return self.candidate(find_root(reserve, above[last].x, above[last + 1].x, self.tolerance))

    def with_force(self, force: float) -> Search:
        """Return the search for another texture force [N]."""
        return replace(self, target=replace(self.target, texture_force=force))

    def relax(self, name: str) -> Search:
        """Return the search with a requirement relaxed by 10 %."""
        return replace(self, relaxed={**self.relaxed, name: RELAXATION * self.relaxed.get(name, 1)})

    def answer(self) -> Answer:
        """Return the candidate that meets the target with the greatest margin, or the nearest."""
        found, force = self.best(), self.target.texture_force
        if force is None:
            # The margin of the largest texture is that of the root.
            return Answer(found.margin >= -10.0 * self.tolerance, 0.0, found)
        if found.margin >= 0.0:
            return Answer(True, force, found)
        low, high = math.log(_FAINT * force), math.log(force)
        faint = self.with_force(math.exp(low)).best()
        if faint.margin < 0.0:
            return Answer(False, 0.0, faint)

        def margin(y: float) -> float:
            return self.with_force(math.exp(y)).best().margin

        reach = math.exp(find_root(margin, low, high, self.tolerance))
        return Answer(False, reach, self.with_force(reach).best())

    def binding(self, answer: Answer) -> tuple[str, ...]:
        """Return the requirements that limit an answer, the most effective one first.

        Each of them, relaxed by 10 %, makes a slightly greater force possible, or the texture
        larger; where nothing can be reached it raises the margin. No other one does.
        """
        search, (is_met, reach, found) = self, answer
        attribute, base = "margin", found.margin + _LEAST_GAIN
        if reach:
            search, base = self.with_force(reach * math.exp(_LEAST_GAIN)), 0.0
        elif self.target.texture_force is not None:
            search = self.with_force(_FAINT * self.target.texture_force)
        elif is_met:
            attribute, base = "x", found.x + _LEAST_GAIN
        ratios = self.ratios(found.x, found.stiffness or 1.0)
        ratios.pop(FORCE, None)
        most = _NEAR_LEAST * min(ratios.values())
        tried = [name for name, ratio in ratios.items() if ratio <= most]
        if min(abs(found.x - end) for end in self.bounds) < _LEAST_GAIN:
            tried.append(RANGE)
        values = {name: getattr(search.relax(name).best(), attribute) for name in tried}
        ordered = sorted(tried, key=lambda name: -values[name])
        return tuple(name for name in ordered if values[name] >= base) or tuple(ordered[:1])


def _split(ratios: Mapping[str, float]) -> tuple[float, float]:
    """Return the least of the ratios that rise and of those that fall with the stiffness."""
    falling, constant = {"stability", "leak"}, {"workspace", "contact"}
    rising = min(value for name, value in ratios.items() if name not in falling | constant)
    return rising, min(value for name, value in ratios.items() if name in falling)


def agree(first: Mapping[str, float], second: Mapping[str, float]) -> bool:
    """Return whether two sets of ratios agree where they may decide."""
    pairs = [(one, second.get(name, 1.0 / _LEAST)) for name, one in first.items()]
    least = 2.0 * max(1.0, *(min(values.values()) for values in (first, second)))
    return all(abs(a / b - 1.0) < _AGREEMENT for a, b in pairs if min(a, b) < least)


class MagnifiedSearch(Search):
    """Textures of one law that differ in all lengths by a factor.

    q depends only on the depth relative to the size, so it is that of the texture of factor 1.
    Waves are sampled at some factors, law H without baking it; between them ratios are
    interpolated, and each answer is sampled in turn until it agrees.
    """

    candidates = 2 * _SAMPLES - 1
    refined = 1
    tolerance = 1e-3
    reserve = _AGREEMENT
    decades = 4

    def greatest(self) -> float:
        """See :class:`Search`; up to one and a half times the workspace."""
        fits = _workspace_ratio(self.texture, self.case.device.workspace_size)
        return min(_MAX_FACTOR, 1.5 * fits)

    def scaled(self, factor: float) -> Texture:
        """See :class:`Search`."""
        return prepare_texture(self.texture, magnify=factor)

    def sample(self, x: float) -> Sample:
        """See :class:`Search`: with the q of the texture of factor 1."""
        if x not in self.samples:
            case, factor = replace(self.case, rendering=SEARCH), math.exp(x)
            trial = case.trial(self.scaled(factor), (self.texture, factor))
            self.samples[x] = make_sample(trial, self.target)
        return self.samples[x]

    def neighbours(self, x: float) -> tuple[Sample, Sample, float]:
        """See :class:`Search`."""
        at = sorted(self.samples)
        after = min(bisect_right(at, x), len(at) - 1)
        low, high = at[max(after - 1, 0)], at[after]
        return self.samples[low], self.samples[high], (x - low) / (high - low or 1.0)

    def answer(self) -> Answer:
        """See :class:`Search`: until the sample at the answer agrees."""
        for x in np.linspace(*self.bounds, _SAMPLES):
            self.sample(float(x))
        for _ in range(_REFINEMENTS):
            _margin, x, stiffness = (found := super().answer()).found
            before = self.ratios(x, stiffness)
            self.sample(x)
            if agree(before, self.ratios(x, stiffness)):
                break
        return found


def _between(first: float, second: float, share: float) -> float:
    """Interpolate a ratio: its logarithm, or its reciprocal where one end is no requirement."""
    if share in {0.0, 1.0}:
        return second if share else first
    if min(first, second) == 0.0:
        return 0.0
    if max(first, second) > 1e3 * min(first, second):
        return 1.0 / ((1.0 - share) / first + share / second)
    return math.exp((1.0 - share) * math.log(first) + share * math.log(second))
