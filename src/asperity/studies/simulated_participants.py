"""Simulated participants, who answer by how strongly they feel each stimulus, and power.

The power of a study is found before the first real participant, by studies of simulated ones.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import expit

from asperity.core.checks import check_positive
from asperity.core.compiled import FloatArray
from asperity.core.errors import ParameterError, find_named
from asperity.core.files import Serializable
from asperity.core.units import count_text
from asperity.studies.design import Presentation, StudyDesign, TrialRecord, Values
from asperity.studies.methods import METHODS
from asperity.studies.scores import Interval, share_interval

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
        felt = [max(strength(interval), _NONE) for interval in presentation.intervals]
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
        wrong = [answer for answer in presentation.answers if answer != presentation.correct]
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
        onset = float(np.interp(math.log(self.threshold), np.log(felt), np.log(values)))
        noisy = math.exp(onset + _SPREAD_OF_ONSETS * rng.standard_normal())
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
    from asperity.analysis.energy.straight_scan import merit
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
            strengths = [max(surface_strength(*make(stimulus)), _NONE) for stimulus in stimuli]
            tables[name] = np.log(strengths)
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


SPREAD = 0.3
"""Deviation of the logarithms of the thresholds of participants."""
_RESAMPLES = 400


@dataclass(frozen=True)
class StudyPlan(Serializable):
    """How often a study would find an effect.

    Attributes:
        participants: their number.
        trials: of each participant.
        effect: by which factor the first condition is stronger than the others.
        simulations: number of simulated studies.
        found: in how many the 95 % interval of the difference of the second from the first
            condition (or of the first pair from chance) leaves out no difference.
        reach: strength of the highest level in the other conditions, over what is just felt;
            ``None`` without levels.
    """

    participants: int
    trials: int
    effect: float
    simulations: int
    found: int
    reach: float | None = None

    @property
    def power(self) -> Interval:
        """Share of the studies that find the effect, and its 95 % interval (Wilson)."""
        return share_interval(self.found, self.simulations)

    @property
    def text(self) -> str:
        """The plan in a sentence."""
        power, low, high = [f"{100.0 * share:.0f} %" for share in self.power]
        people = count_text(self.participants, "participant")
        trials = count_text(self.trials, "trial")
        levels = (
            f" The levels reach {self.reach:.2g} times what is just felt." if self.reach else ""
        )
        return (
            f"With {people} of {trials} each, "
            f"{power} ({low} to {high}) of {self.simulations} simulated studies find "
            f"that the first condition is {self.effect:g} times as strong.{levels}"
        )


def plan(
    design: StudyDesign,
    effect: float,
    participants: int | None = None,
    seed: int = 0,
    simulations: int = 200,
    observer: str = "typical",
    progress: Callable[[float], None] = lambda _share: None,
    level_strength: Strength | None = None,
) -> StudyPlan:
    """Return how often a study would find an effect: its power, by simulation.

    The logarithms of the thresholds of participants deviate by 0.3.

    Args:
        design: the study, with at least two conditions.
        effect: by which factor stimuli of the first condition are stronger at the hand than those
            of the others; 1 tells how often a study finds what is not there.
        participants: their number; by default that of the design.
        seed: of the simulation.
        simulations: number of simulated studies.
        observer: name of the observer, see
            :data:`~asperity.studies.simulated_participants.OBSERVERS`.
        progress: called with the fraction done.
        level_strength: of the stimuli of a study with levels, such as :func:`hand_strength`; by
            default it is the level over the middle of the range.

    Raises:
        ParameterError: for fewer than three participants or two conditions, or an effect or a
            number of simulations that is not positive.
    """
    effect = check_positive("effect", effect)
    count = participants or design.participants
    check_positive("simulations", simulations)
    if count < 3:
        raise ParameterError("participants", "must be at least 3 for an interval", count)
    design.check_conditions(2)
    kind = METHODS[design.kind]
    base = find_observer(observer)
    design = kind.complete(design)
    strength = _planned_strength(design, effect, level_strength)
    found = 0
    trials = 0
    for number in range(simulations):
        rng = np.random.default_rng([seed, number])
        study_seed = int(rng.integers(2**31))
        answered = {}
        for i in range(count):
            threshold = base.threshold * math.exp(SPREAD * rng.standard_normal())
            person = replace(base, threshold=threshold)
            answered[str(i)] = simulate_run(design, i, person, strength, study_seed)
        _, low, high = kind.score(design, answered).differences(study_seed, _RESAMPLES)[0]
        found += not low <= 0.0 <= high
        trials = len(answered["0"])
        progress((number + 1) / simulations)
    reach = None
    if key := design.options.get("level"):
        reach = strength({**design.conditions[1], key: design.range[1]})
    return StudyPlan(count, trials, effect, simulations, found, reach)


def _planned_strength(
    design: StudyDesign, effect: float, level_strength: Strength | None
) -> Strength:
    """Return strengths: those of the second condition, ``effect`` times that in the first one."""
    first, second = design.conditions[:2]
    key = str(design.options.get("level", ""))
    middle = math.sqrt(math.prod(design.range)) if key else 1.0
    at_level = level_strength or (lambda values: float(values[key]) / middle)

    def strength(values: Values) -> float:
        level = at_level({**second, key: values[key]}) if key else 1.0
        return level * (effect if first.items() <= values.items() else 1.0)

    return strength
