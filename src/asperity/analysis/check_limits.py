"""Will I feel it? The six limits of the paper's section II.B for a surface on a device."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.compare import DEFAULT_DEVICE, law_to_ask_about
from asperity.analysis.energy.merit import merit
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.limits.felt import DEFAULT_SAMPLES, DEFAULT_SPEED, texture_felt
from asperity.analysis.limits.limit_result import Limits, RenderedWave
from asperity.analysis.limits.limit_rules import RULES, Case, Decision, decide
from asperity.analysis.limits.spectrum import LEAST_SHARE, Spectrum, spectrum
from asperity.analysis.limits.wave_force import wave_forces
from asperity.analysis.passivity.judgement import Allowed
from asperity.analysis.passivity.margin import at_start, start
from asperity.analysis.words.limits import answer, assumptions
from asperity.arguments import DEFAULT_STIFFNESS
from asperity.checks import FloatArray, positive, real
from asperity.devices import Device, load_device
from asperity.errors import ParameterError
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures.naming import TextureLike, as_texture


def limits(
    texture: TextureLike,
    device: str | os.PathLike[str] | Device = DEFAULT_DEVICE,
    speed: float | None = None,
    law: str | Law | None = None,
    stiffness: float | None = None,
    max_depth: float | None = None,
    *,
    time_samples: float | None = None,
    position_samples: float | None = None,
    force_steps: float | None = None,
    **surface_arguments: Any,
) -> Limits:
    """Return which of the six limits of haptic texture synthesis a surface meets on a device.

    α v T < l, β δ < l, α δ < l, γ b < A_F, q k <= K₀, v/l < F₀: for every wave of the texture,
    each with its own length l, amplitude and force A_F. They are necessary to feel the texture as
    it is, not sufficient. What the device's data cannot decide is listed with what is missing.

    Args:
        texture: the surface, or what names it; see :func:`~asperity.analysis.compare.compare`.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        speed: v [m/s] of the scan; 0.1 by default.
        law: letter or name, or a law of your own; by default the one that a comparison recommends.
        stiffness: k [N/m]; by default the one to begin with, as in a comparison; where none is
            known to do, K₀.
        max_depth: depth to which the surface is pressed [m]; by default its peak-to-valley
            height, at most 1 mm.
        time_samples: α, updates that a wave needs; at least 2, by the paper 5 to 10; default 5.
        position_samples: β, position steps that a wave needs; at least 2, default 5.
        force_steps: γ, steps of force that an amplitude needs; at least 1, default 5.
        **surface_arguments: further arguments of :class:`~asperity.surface.Surface`.

    Raises:
        ParameterError: for a value that cannot be used; it names the argument.

    Reference:
        Campion and Hayward, section II.B. Limit 4 is printed as γ b/l < A and limit 5 as
        2πA/l < A₀, which their dimensions forbid; 2 and 3 are one condition as printed.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> result = limits(Sinusoid(amplitude=1e-4, period=1e-3), "pantograph", law="A")
        >>> [(limit.number, limit.holds) for limit in result.limits]
        [(1, True), (2, True), (3, True), (4, None), (5, True), (6, True)]
        >>> result.limit(4).needs, result.speeds
        (('force_resolution',), (0.0, 0.4))
    """
    known = load_device(device)
    v = DEFAULT_SPEED if speed is None else positive("speed", speed, "m/s")
    alpha = _samples("time_samples", time_samples, 2.0)
    beta = _samples("position_samples", position_samples, 2.0)
    gamma = _samples("force_steps", force_steps, 1.0)
    asked = DEFAULT_STIFFNESS if stiffness is None else stiffness
    texture = as_texture(texture)
    if law is None:
        law = law_to_ask_about(texture, known, max_depth, speed=v, **surface_arguments)
    surface = Surface(texture, law, asked, max_depth, **surface_arguments)
    q, one_sided = characteristic_number(surface), one_sided_number(surface)
    begin = start(surface, known, q, one_sided)
    gain, symbol = _gain(q, one_sided, begin.allowed)
    if stiffness is None:
        surface = at_start(surface, known, begin)
    found = spectrum(texture)
    forces = wave_forces(surface, found)
    kept = _kept(found, forces)
    numbers = {field: datum.value for field, datum in known.data.items()}
    numbers |= {} if begin.wall is None else {"max_stiffness": begin.wall}
    shares = np.array([wave.share for wave in found.waves])[kept]
    case = Case(numbers, v, alpha, beta, gamma, found.wavelengths[kept], forces[kept], shares,
                gain.value, surface.stiffness)  # fmt: skip
    decisions = [decide(rule, case, f"{symbol} k ≤ K₀" if rule.number == 5 else None)
                 for rule in RULES]  # fmt: skip
    six = tuple(decision.limit for decision in decisions)
    scan = merit(surface)
    felt = texture_felt(
        surface, known, texture.texture_part(), rms=scan.ripple * surface.stiffness, speed=v,
        time_samples=alpha, position_samples=beta, force_steps=gamma, deep=max_depth is not None,
    )  # fmt: skip
    waves = _rendered(found, kept, case, decisions)
    top = min((one.speeds[1] for one in six if one.speeds is not None), default=math.inf)
    result = Limits(surface, known, v, alpha, beta, gamma, gain, symbol, begin.allowed,
                    begin.margin, six,
                    waves, found, felt, (0.0, top), "", ())  # fmt: skip
    defaults = {"speed": speed is None, "stiffness": stiffness is None,
                "max_depth": max_depth is None,
                "samples": None in {time_samples, position_samples, force_steps}}  # fmt: skip
    said = assumptions(result, defaults, scan.contact_lost)
    return replace(result, answer=answer(result), assumptions=said)


def _samples(name: str, value: float | None, least: float) -> float:
    """Return how many samples are needed; fewer than two of a wave cannot show it."""
    number = DEFAULT_SAMPLES if value is None else real(name, value)
    if number < least:
        raise ParameterError(name, f"must be at least {least:g}", value)
    return number


def _gain(q: Bound, one_sided: Bound, allowed: Allowed) -> tuple[Bound, str]:
    """Return the number that limits the stiffness on this device, and its symbol.

    It is q for any delay, q⁺ for none, and in between where a delay of d samples is known.
    """
    delay = allowed.delay
    if delay is None or math.isinf(delay):
        return q, "q"
    if delay == 0.0:
        return one_sided, "q⁺"
    share = delay / (0.5 + delay)
    lower, upper = (
        share * full + (1.0 - share) * plus
        for full, plus in ((q.lower, one_sided.lower), (q.upper, one_sided.upper))
    )
    return replace(q, lower=lower, upper=upper), "(q⁺/2 + d q)/(1/2 + d)"


def _kept(found: Spectrum, forces: FloatArray) -> NDArray[np.bool_]:
    """Return which waves count: all of a sum, bands that carry height or force."""
    if found.exact:
        return np.ones(len(forces), dtype=bool)
    heights = np.array([wave.share for wave in found.waves])
    squares = forces**2
    pushed = squares / (float(squares.sum()) or 1.0)  # the smooth wall has no force
    return np.asarray((heights >= LEAST_SHARE) | (pushed >= LEAST_SHARE))


def _rendered(
    found: Spectrum, kept: NDArray[np.bool_], case: Case, decisions: Sequence[Decision]
) -> tuple[RenderedWave, ...]:
    """Return the waves that count, each with what every limit says of it."""
    on_waves = [
        (one.limit.number, one.holds, one.top)
        for one in decisions
        if one.holds is not None and one.top is not None and one.limit.number != 5
    ]
    waves = [wave for wave, keep in zip(found.waves, kept, strict=True) if keep]
    return tuple(
        RenderedWave(
            wavelength=wave.wavelength,
            amplitude=wave.amplitude,
            share=wave.share,
            frequency=case.speed / wave.wavelength,
            force=float(case.forces[i]),
            holds={number: bool(holds[i]) for number, holds, _top in on_waves},
            top_speed=min((float(top[i]) for _number, _holds, top in on_waves), default=math.inf),
        )
        for i, wave in enumerate(waves)
    )
