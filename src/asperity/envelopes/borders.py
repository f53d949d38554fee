"""Borders of the amplitudes that a device renders at one wavelength, by root finding."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np

from asperity.core.cache import bypass_results
from asperity.core.files import Serializable
from asperity.envelopes.wave_case import WaveCase
from asperity.textures import Sinusoid

AMPLITUDE_RANGE = (1e-8, 10e-3)
"""Amplitudes searched [m]."""
_SCANNED_PER_DECADE = 3
_NEAR = 0.15
"""Half of the logarithmic interval in which a border is sought first."""
_TOLERANCE = 1e-3
"""Absolute tolerance of the logarithm of an amplitude at a border."""
_TIP = 0.3
"""Least ratio, between scanned amplitudes, near which a narrow region is searched."""


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
        top = min(self.felt_up_to, AMPLITUDE_RANGE[1])
        return 0.0 if math.isnan(self.felt_from) else math.log10(top / self.felt_from)


def find_borders(case: WaveCase, wavelengths: Sequence[float]) -> tuple[WaveBorders, ...]:
    """Return the borders of a law on a device at each wavelength [m], ascending.

    The borders at one wavelength are where those at the next one are sought first.
    """
    found: list[WaveBorders] = []
    with bypass_results():
        for wavelength in wavelengths:
            found.append(_find_wave_borders(case, wavelength, found[-1] if found else None))
    return tuple(found)


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
    return math.nan if math.isnan(ratio) else math.log(min(max(ratio, 1e-30), 1e30))


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
    return math.inf if function(high) >= 0.0 else math.exp(_root_near(function, near, low, high))


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
    found = minimize_scalar(lambda x: -function(x), bounds=bounds, method="bounded")
    return max((float(found.x), scanned[at]), key=function)
