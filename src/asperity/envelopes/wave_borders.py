"""Which amplitudes of a sinusoid a device renders with a law: the wall firm, the texture felt.

The numbers are those of a comparison at the recommended stiffness; only the points of the scan are
fewer, since a single wave needs no more. The borders at a wavelength are found by root finding.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import NORM, ONE_SIDED, Bound, JacobianMeasure
from asperity.analysis.energy.straight_scan import scan_force
from asperity.analysis.gain.characteristic import cached_number
from asperity.analysis.gain.surface_cache import is_shipped_law
from asperity.analysis.limits import perceptibility, wave_scan
from asperity.analysis.limits.limit_rules import (
    DEFAULT_SAMPLES,
    DEFAULT_SPEED,
    LEAST_SAMPLES,
    check_sample_count,
)
from asperity.analysis.passivity.recommended_stiffness import (
    StiffnessRecommendation,
    recommend_stiffness,
    render_on_device,
)
from asperity.core.arguments import FIELD, SEARCH
from asperity.core.cache import bypass_results
from asperity.core.checks import check_keywords, check_positive
from asperity.core.files import Serializable
from asperity.devices import Device
from asperity.laws import Law, find_law
from asperity.perception.grip import DEFAULT_GRIP, Grip, load_grip
from asperity.rendering import is_searched
from asperity.surface import Surface
from asperity.textures import Sinusoid
from asperity.textures.fields.bake import BakeGoal
from asperity.textures.texture import Texture

DEFAULT_MIN_STIFFNESS = 100.0
"""Least stiffness of a wall [N/m]: a press of 1 N sinks in by at most 10 mm."""

Original = tuple[Texture, float]
# Points of a period of one wave: forces that bend differ by 1e-4 from those of 16384 points.
_SCAN_POINTS = 256


@dataclass(frozen=True)
class RenderConditions(Serializable):
    """What rendering a texture means.

    A device renders a texture with a law if the recommended stiffness is at least ``min_stiffness``
    and the texture is felt at that stiffness on a scan.

    Attributes:
        speed: of the scan [m/s].
        min_stiffness: least stiffness of the wall [N/m].
        grip: the hand.
        max_depth: depth to which the texture is pressed [m]; ``None`` for its peak-to-valley
            height, at most 1 mm.
        time_samples: α, updates that a wave needs.
        position_samples: β, position steps that a wave needs.
        force_steps: γ, force steps that an amplitude needs.
    """

    speed: float = DEFAULT_SPEED
    min_stiffness: float = DEFAULT_MIN_STIFFNESS
    grip: Grip = field(default_factory=load_grip)
    max_depth: float | None = None
    time_samples: float = DEFAULT_SAMPLES
    position_samples: float = DEFAULT_SAMPLES
    force_steps: float = DEFAULT_SAMPLES

    @property
    def scan(self) -> dict[str, float]:
        """Speed and samples, as the limits take them."""
        return {name: getattr(self, name) for name in ("speed", *LEAST_SAMPLES)}


_UNITS = {"speed": "m/s", "min_stiffness": "N/m", "max_depth": "m"}


def make_conditions(function: Callable[..., Any], **keywords: Any) -> RenderConditions:
    """Return conditions from keywords of a function; ``None`` is the default.

    Raises:
        ParameterError: for an unknown keyword or a value that cannot be used.
    """
    check_keywords(keywords, {*_UNITS, *LEAST_SAMPLES, "grip"}, function)
    values = {name: value for name, value in keywords.items() if value is not None}
    for name in _UNITS.keys() & values.keys():
        values[name] = check_positive(name, values[name], _UNITS[name])
    for name in LEAST_SAMPLES.keys() & values.keys():
        values[name] = check_sample_count(name, values[name])
    return RenderConditions(**values | {"grip": load_grip(values.get("grip", DEFAULT_GRIP))})


@dataclass(frozen=True)
class Trial:
    """A surface on a device at the recommended stiffness.

    Attributes:
        surface: the surface as it is rendered; at the recommended stiffness if there is one.
        recommended: the recommended stiffness, 0 for none, with its limit and safety margin.
        q: characteristic number.
        waves: waves of the texture on a scan; ``None`` without a recommended stiffness.
        min_stiffness: least stiffness of the wall [N/m].
        numbered: surface of which the numbers are computed: it is smaller by the factor.
        factor: lengths of the surface over those of ``numbered``.
        scanned: surface without form and waviness, whose scan has the force of the texture.
        doubtful: numbers of the device that are not trusted.
    """

    surface: Surface
    recommended: StiffnessRecommendation
    q: Bound
    waves: wave_scan.WaveScan | None
    min_stiffness: float
    numbered: Surface
    factor: float
    scanned: Surface
    doubtful: Mapping[str, float] = field(default_factory=dict)

    @property
    def firm(self) -> float:
        """Limit of the stiffness times safety margin, before rounding, over the least one."""
        limit = self.recommended.stability_limit.stiffness or 0.0
        return self.recommended.margin.factor * limit / self.min_stiffness

    @property
    def wall(self) -> float:
        """K₀ over q times the least stiffness: limit 5 of the paper holds from 1 on."""
        wall = self.recommended.wall_stiffness
        if wall is None:
            return math.inf
        return wall / (self.q.value * self.min_stiffness)

    def felt(self) -> float:
        """Return the ratio of :func:`~asperity.analysis.limits.perceptibility.felt_ratio`."""
        if self.waves is None:
            return 0.0
        return perceptibility.felt_ratio(self.waves, perceptibility.respond_felt(self.waves))

    @property
    def force_steps(self) -> float:
        """Amplitude of the force over γ force steps; infinite where the steps are unknown."""
        if self.waves is None:
            return 0.0
        resolved = perceptibility.respond_felt(self.waves).is_resolved
        return perceptibility.force_step_ratio(self.waves.case, resolved)

    @property
    def is_rendered(self) -> bool:
        """Whether the device renders the texture."""
        return min(self.firm, self.felt()) >= 1.0


@dataclass(frozen=True)
class WaveCase:
    """A law on a device, for any texture.

    Attributes:
        law: letter, or a user-defined law.
        law_parameters: its parameters.
        device: the device.
        conditions: what rendering means.
        rendering: how law H is rendered; see :func:`~asperity.rendering.rendered_surface`.
    """

    law: str | Law
    law_parameters: Mapping[str, float]
    device: Device
    conditions: RenderConditions
    rendering: str = FIELD

    @property
    def letter(self) -> str:
        """Letter of the law."""
        return find_law(self.law).letter

    def surface(self, texture: Texture) -> Surface:
        """Return a texture with this law, as a loop renders it."""
        depth = self.conditions.max_depth
        own = self.law_parameters
        surface = Surface(texture, self.law, max_depth=depth, law_parameters=own)
        return render_on_device(surface, self.device, self.rendering)

    def recommend(self, texture: Texture, original: Original | None = None) -> Trial:
        """Return a texture at its recommended stiffness, without its waves."""
        surface = self.surface(texture)
        numbered = surface
        factor = 1.0
        if original is not None and is_shipped_law(surface.law):
            # A law of the user may have lengths that are not parameters.
            numbered = self._unmagnified(surface, *original)
            factor = original[1]
        q = self._number(numbered, NORM)
        # A law with curl is limited by the wall's gain K₀/q alone, whatever q⁺ is.
        is_conservative = surface.facts.conservative
        one_sided = self._number(numbered, ONE_SIDED) if is_conservative else q
        recommended = recommend_stiffness(surface, self.device, q, one_sided)
        if k := recommended.stiffness:
            surface = surface.to_stiffness(k)
            numbered = numbered.to_stiffness(k)
        least = self.conditions.min_stiffness
        return Trial(surface, recommended, q, None, least, numbered, factor, numbered)

    def _unmagnified(self, surface: Surface, texture: Texture, factor: float) -> Surface:
        """Return the surface whose lengths are shorter by a factor: its numbers are the same."""
        units = {name: argument.unit for name, argument in surface.law.arguments.items()}
        shorter = {
            name: value / factor if units[name] == "m" else value
            for name, value in surface.law_parameters.items()
        }
        depth = float(f"{surface.max_depth / factor:.9g}")  # one number for equal depths
        conditions = replace(self.conditions, max_depth=depth)
        return replace(self, conditions=conditions, law_parameters=shorter).surface(texture)

    def _number(self, surface: Surface, measure: JacobianMeasure) -> Bound:
        """Return a number of a surface; of law H that is searched, the one to which it is baked."""
        number = cached_number(surface, measure)
        if self.rendering == SEARCH and is_searched(surface):
            return replace(number, upper=BakeGoal.max_gain * number.upper)
        return number

    def trial(self, texture: Texture, original: Original | None = None) -> Trial:
        """Return a texture at its recommended stiffness, with its waves.

        Args:
            texture: the texture.
            original: a texture of which it is a magnification, and the factor, if q is to be
                computed there.
        """
        trial = self.recommend(texture, original)
        conditions = self.conditions
        if not trial.recommended.stiffness:
            return trial
        surface = trial.surface
        points = _SCAN_POINTS if texture.single_wave else None
        ripple = trial.factor * scan_force(trial.numbered, points).ripple
        waves, doubtful, _rms, scanned = wave_scan.scan_waves(
            surface,
            self.device,
            texture.texture_part(),
            conditions.grip,
            rms=ripple * surface.stiffness,
            explicit_depth=conditions.max_depth is not None,
            points=points,
            **conditions.scan,
        )
        scanned = trial.numbered if scanned is surface else scanned
        return replace(trial, waves=waves, doubtful=doubtful, scanned=scanned)

    def try_wave(self, wavelength: float, amplitude: float) -> Trial:
        """Return the trial of a sinusoid [m]."""
        return self.trial(Sinusoid(amplitude, wavelength))


AMPLITUDE_RANGE = (1e-8, 10e-3)
"""Amplitudes searched [m]."""
_SCANNED_PER_DECADE = 3
# Half of the logarithmic interval in which a border is sought first.
_NEAR = 0.15
# Absolute tolerance of the logarithm of an amplitude at a border.
_TOLERANCE = 1e-3
# Least ratio, between scanned amplitudes, near which a narrow region is searched.
_TIP = 0.3


AMPLITUDE_LIMITS = {4: "force_limit", 5: "gain_limit"}
"""Attributes of :class:`WaveBorders` that are limits of the paper on the amplitude, by number."""


@dataclass(frozen=True)
class WaveBorders(Serializable):
    """Borders of the amplitudes of a wave with one law on one device.

    NaN: there is no border, as no amplitude qualifies. Infinity: none up to 10 mm.

    Attributes:
        wavelength: l [m].
        felt_from: least amplitude that is rendered [m].
        felt_up_to: greatest amplitude that is rendered [m].
        firm_up_to: greatest amplitude whose recommended stiffness is at least the least one [m].
        gain_limit: amplitude up to which q times the least stiffness is at most K₀ [m], limit 5.
        force_limit: amplitude from which the force has γ force steps [m], limit 4.
        stiffness: recommended stiffness at ``felt_from`` [N/m].
    """

    wavelength: float
    felt_from: float
    felt_up_to: float
    firm_up_to: float
    gain_limit: float
    force_limit: float
    stiffness: float

    @property
    def decades(self) -> float:
        """Width of the rendered range in decades of amplitude; 0 for none."""
        if math.isnan(self.felt_from):
            return 0.0
        return math.log10(self.top / self.felt_from)

    @property
    def top(self) -> float:
        """Greatest amplitude that is rendered, of those searched [m]."""
        return min(self.felt_up_to, AMPLITUDE_RANGE[1])


def find_borders(case: WaveCase, wavelengths: Sequence[float]) -> tuple[WaveBorders, ...]:
    """Return the borders of a law on a device at each wavelength [m], ascending.

    The borders at one wavelength are where those at the next one are sought first.
    """
    borders: list[WaveBorders] = []
    with bypass_results():
        for wavelength in wavelengths:
            borders.append(_find_wave_borders(case, wavelength, borders[-1] if borders else None))
    return tuple(borders)


def _find_wave_borders(case: WaveCase, wavelength: float, near: WaveBorders | None) -> WaveBorders:
    """Return the borders at a wavelength, with those at one near by or ``None``."""
    recommend = cache(lambda x: case.recommend(Sinusoid(math.exp(x), wavelength)))
    trial = cache(lambda x: case.try_wave(wavelength, math.exp(x)))
    guess = dict.fromkeys(("firm_up_to", "gain_limit", "felt_from", "felt_up_to"), math.nan)
    if near is not None:  # the gain depends on the ratio of amplitude and wavelength
        guess = {name: _log(getattr(near, name)) for name in guess}
        for name in ("firm_up_to", "gain_limit"):
            guess[name] += math.log(wavelength / near.wavelength)
    firm = _last_above(lambda x: _log(recommend(x).firm), guess["firm_up_to"])
    gain = _last_above(lambda x: _log(recommend(x).wall), guess["gain_limit"])
    top = math.log(min(firm, AMPLITUDE_RANGE[1]))
    if not top > math.log(AMPLITUDE_RANGE[0]):
        nan = math.nan
        return WaveBorders(wavelength, nan, nan, firm, gain, nan, nan)
    known = guess["felt_from"], guess["felt_up_to"]
    low, high = _range_above(lambda x: _log(trial(x).felt()), top, known)
    steps = math.nan
    if math.isfinite(trial(top).force_steps):
        steps = _range_above(lambda x: _log(trial(x).force_steps), top, (low, high))[0]
    end = firm if high == top else math.exp(high)
    stiffness = math.nan if math.isnan(low) else trial(low).recommended.stiffness
    return WaveBorders(wavelength, math.exp(low), end, firm, gain, math.exp(steps), stiffness)


def _log(ratio: float) -> float:
    """Return the logarithm of a ratio that may be zero, infinite or NaN."""
    if math.isnan(ratio):
        return math.nan
    return math.log(min(max(ratio, 1e-30), 1e30))


LogRatio = Callable[[float], float]


def find_root(function: LogRatio, low: float, high: float, tolerance: float = _TOLERANCE) -> float:
    """Return where a function changes its sign between two values, by Brent's method."""
    from scipy.optimize import brentq

    return float(brentq(function, low, high, xtol=tolerance))


def _root_near(function: LogRatio, near: float, low: float, high: float) -> float:
    """Return a root between two values, in a narrow interval about a third one if there is one."""
    first = max(near - _NEAR, low)
    last = min(near + _NEAR, high)
    if first < last and (function(first) < 0.0) != (function(last) < 0.0):
        return find_root(function, first, last)
    return find_root(function, low, high)


def _last_above(function: LogRatio, near: float) -> float:
    """Return the amplitude [m] up to which a falling ratio is at least 1; see WaveBorders."""
    low, high = map(math.log, AMPLITUDE_RANGE)
    if function(low) < 0.0:
        return math.nan
    if function(high) >= 0.0:
        return math.inf
    return math.exp(_root_near(function, near, low, high))


def _range_above(function: LogRatio, top: float, near: tuple[float, float]) -> tuple[float, float]:
    """Return the logarithms of the amplitudes between which a ratio is at least 1, NaN for none.

    The ratio rises with the amplitude, and may fall again below ``top``.

    Args:
        function: logarithm of the ratio.
        top: logarithm of the greatest amplitude.
        near: a range that may be close.
    """
    low = near[0] - _NEAR
    high = near[0] + _NEAR
    if high < top and function(top) >= 0.0 and function(low) < 0.0 <= function(high):
        return find_root(function, low, high), top
    low = math.log(AMPLITUDE_RANGE[0])
    count = math.ceil((top - low) / math.log(10.0) * _SCANNED_PER_DECADE) + 1
    scanned = [float(x) for x in np.linspace(low, top, max(count, 3))]
    best = max(scanned, key=function)
    if math.log(_TIP) <= function(best) < 0.0:
        scanned = sorted({*scanned, best := _maximum(function, scanned, scanned.index(best))})
    if function(best) < 0.0:
        return math.nan, math.nan
    at = scanned.index(best)
    rises = [(a, b) for a, b in pairwise(scanned[: at + 1]) if function(a) < 0.0 <= function(b)]
    falls = [(a, b) for a, b in pairwise(scanned[at:]) if function(b) < 0.0 <= function(a)]
    return (
        find_root(function, *rises[-1]) if rises else low,
        find_root(function, *falls[0]) if falls else top,
    )


def _maximum(function: LogRatio, scanned: Sequence[float], at: int) -> float:
    """Return where a function is greatest between the neighbours of a scanned value."""
    from scipy.optimize import minimize_scalar

    bounds = scanned[max(at - 1, 0)], scanned[min(at + 1, len(scanned) - 1)]
    peak = minimize_scalar(lambda x: -function(x), bounds=bounds, method="bounded")
    return max((float(peak.x), scanned[at]), key=function)
