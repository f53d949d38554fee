"""Simulated participants, who answer by how strongly they feel each stimulus."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import expit

from asperity.core.compiled import FloatArray
from asperity.core.errors import find_named
from asperity.studies.design import Presentation, StudyDesign, TrialRecord, Values
from asperity.studies.methods import METHODS

if TYPE_CHECKING:
    from asperity.devices import Device
    from asperity.surface import Surface

Strength = Callable[[Values], float]
"""How strong a stimulus is at the hand; what a typical observer just feels is 1."""
_NONE = 1e-9
_SPREAD_OF_RATINGS = 0.2  # of logarithms
_SPREAD_OF_ONSETS = 0.1
_POINTS = 33  # of the search for an onset
_LEVELS = 9  # at which strengths are computed


@dataclass(frozen=True)
class Observer:
    """A simulated participant: a psychometric function of the strength at the hand.

    Attributes:
        threshold: difference of strengths that is known half of the time.
        slope: s of the psychometric function of the logarithm of the strength.
        lapse: share of the questions with a right answer that are answered by a guess.
    """

    threshold: float = 1.0
    slope: float = 4.0
    lapse: float = 0.04

    def answer(
        self, presentation: Presentation, strength: Strength, rng: np.random.Generator
    ) -> str:
        """Return the answer to a presentation.

        Args:
            presentation: what is presented.
            strength: of a stimulus.
            rng: random numbers.
        """
        if presentation.adjusts:
            return self._adjust(presentation, presentation.adjusts, strength, rng)
        felt = [max(strength(one), _NONE) for one in presentation.intervals]
        if presentation.correct:
            return self._find(presentation, max(felt) - min(felt), rng)
        if len(felt) == 1:
            return self._rate(presentation, math.log(felt[0]), rng)
        is_second = rng.random() >= self._logistic(math.log(felt[0] / felt[1]))
        return presentation.answers[is_second]

    def _logistic(self, x: float) -> float:
        return float(expit(self.slope * x))

    def _find(self, presentation: Presentation, difference: float, rng: np.random.Generator) -> str:
        """Return the right answer with the chance of the psychometric function."""
        wrong = [one for one in presentation.answers if one != presentation.correct]
        guess = 1.0 / len(presentation.answers)
        known = self._logistic(math.log(max(difference, _NONE) / self.threshold))
        is_right = rng.random() < guess + (1.0 - guess) * (1.0 - self.lapse) * known
        return str(presentation.correct) if is_right else wrong[rng.integers(len(wrong))]

    def _rate(self, presentation: Presentation, felt: float, rng: np.random.Generator) -> str:
        noisy = felt + _SPREAD_OF_RATINGS * rng.standard_normal()
        if not presentation.answers:
            low, high = presentation.range or (_NONE, 1.0 / _NONE)
            return repr(min(max(10.0 * math.exp(noisy), low), high))
        count = len(presentation.answers)
        return presentation.answers[min(int(count * expit(noisy)), count - 1)]

    def _adjust(
        self, presentation: Presentation, key: str, strength: Strength, rng: np.random.Generator
    ) -> str:
        """Return the value from which on the stimulus is felt, or about so."""
        low, high = presentation.range or (_NONE, 1.0)
        values = np.geomspace(low, high, _POINTS)
        felt = [max(strength({**presentation.intervals[0], key: x}), _NONE) for x in values]
        found = float(np.interp(math.log(self.threshold), np.log(felt), np.log(values)))
        noisy = math.exp(found + _SPREAD_OF_ONSETS * rng.standard_normal())
        return repr(float(min(max(noisy, low), high)))


OBSERVERS = {"typical": Observer(), "guessing": Observer(slope=0.0, lapse=1.0)}
"""Simulated observers by name; ``guessing`` answers by chance, as a negative control."""


def find_observer(name: str) -> Observer:
    """Return the observer of a name.

    Raises:
        ParameterError: for an unknown one, with the nearest.
    """
    return find_named("observer", name, OBSERVERS)


def surface_strength(surface: Surface, device: Device) -> float:
    """Return how strong the texture of a surface is at the hand that scans it.

    It is the root of the sum of squares, over the waves of the force, of the motion of the hand
    over the motion that is felt; see :mod:`asperity.analysis.limits.perceptibility`.

    Args:
        surface: texture, law and stiffness.
        device: the device.
    """
    from asperity.analysis.energy.scan import merit
    from asperity.analysis.limits.perceptibility import assess_perceptibility

    rms = merit(surface).ripple * surface.stiffness
    part = surface.texture.texture_part()
    assessed = assess_perceptibility(surface, device, part, rms=rms, find_remedies=False)
    return assessed.level


def hand_strength(
    design: StudyDesign, make: Callable[[Values], tuple[Surface, Device]]
) -> Strength:
    """Return the strength of the stimuli of a study at the hand.

    It is computed once for each condition and some levels. Between these it is interpolated,
    logarithm by logarithm.

    Args:
        design: the study with all options.
        make: makes the surface and the device of a stimulus.
    """
    options = design.options
    key = str(design.options.get("level", ""))
    low = min(options["range"][0], options.get("reference", math.inf)) if key else 1.0
    levels = np.geomspace(low, options["range"][1], _LEVELS) if key else np.ones(1)
    tables: dict[str, FloatArray] = {}

    def strength(values: Values) -> float:
        rest = {name: value for name, value in values.items() if name != key}
        if (name := repr(rest)) not in tables:
            stimuli = [{**rest, key: float(level)} if key else rest for level in levels]
            found = [max(surface_strength(*make(one)), _NONE) for one in stimuli]
            tables[name] = np.log(found)
        at = math.log(values.get(key, 1.0))
        return math.exp(float(np.interp(at, np.log(levels), tables[name])))

    return strength


def simulate_run(
    design: StudyDesign, number: int, observer: Observer, strength: Strength, seed: int
) -> list[TrialRecord]:
    """Return the trials of a simulated participant; the same seed gives the same ones.

    Args:
        design: the study.
        number: of the participant, from 0.
        observer: the participant.
        strength: of a stimulus.
        seed: of the method and of the answers.
    """
    method = METHODS[design.kind].make(design, number, seed)
    rng = np.random.default_rng([seed, number, 1])
    answered: list[TrialRecord] = []
    while (presentation := method.next()) is not None:
        answer = observer.answer(presentation, strength, rng)
        answered.append(TrialRecord(presentation, answer, str(number), 1, len(answered) + 1))
        method.answer(answer)
    return answered
