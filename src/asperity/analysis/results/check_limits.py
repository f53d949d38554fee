"""The six limits of the paper's section II.B for a surface on a device."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.analysis.bounds.bound import NORM, ONE_SIDED, Bound
from asperity.analysis.energy.straight_scan import scan_force
from asperity.analysis.gain.characteristic import cached_number
from asperity.analysis.limits.limit_rules import (
    DEFAULT_SPEED,
    LIMIT_RULES,
    Decision,
    Limit,
    LimitCase,
    check_sample_count,
    evaluate_limit,
)
from asperity.analysis.limits.perceptibility import Perceptibility, assess_perceptibility
from asperity.analysis.limits.spectrum import MIN_SHARE, Spectrum, compute_spectrum
from asperity.analysis.limits.wave_scan import wave_forces
from asperity.analysis.passivity.recommended_stiffness import (
    Margin,
    StabilityLimit,
    StiffnessRecommendation,
    recommend_stiffness,
    render_on_device,
)
from asperity.analysis.results.compare import DEFAULT_DEVICE, recommended_law
from asperity.core.arguments import DEFAULT_STIFFNESS, FIELD
from asperity.core.checks import FloatArray, check_keywords, check_positive
from asperity.core.display import Plottable, Reportable, Tabular, Text
from asperity.core.files import Serializable, attributes_to_dict
from asperity.devices import Device, DeviceLike, load_device
from asperity.laws import Law
from asperity.perception.grip import DEFAULT_GRIP, Grip, load_grip
from asperity.surface import SURFACE_KEYWORDS, Surface
from asperity.textures.catalogue import TextureLike, as_texture
from asperity.textures.texture import Texture

SCHEMA = 4


@dataclass(frozen=True)
class RenderedWave(Serializable):
    """One wave of the texture on the device.

    Attributes:
        wavelength: l [m].
        amplitude: a [m].
        share: of the variance of the heights.
        frequency: v/l [Hz].
        force: A_F [N], amplitude of the force at this wavelength.
        holds: whether each limit holds, by its number, without undecidable limits and without the
            gain limit, which does not concern waves.
        top_speed: speed [m/s] below which all of these hold; 0 if one holds at no speed.
    """

    wavelength: float
    amplitude: float
    share: float
    frequency: float
    force: float
    holds: dict[int, bool]
    top_speed: float


@dataclass(frozen=True)
class Limits(Plottable, Reportable, Tabular):
    """The six limits for one surface on one device at one scanning speed.

    Attributes:
        surface: texture, law and the stiffness k of the force.
        device: the device.
        speed: v [m/s].
        time_samples: α, updates in a wave.
        position_samples: β, position steps in a wave.
        force_steps: γ, steps of force in an amplitude.
        gain: factor of the stiffness in limit 5: q, or less where the delay is known.
        gain_symbol: "q", "q⁺" or the combination of both.
        stability_limit: stability limit of the stiffness, as in a comparison.
        margin: safety margin below it.
        limits: the six limits, in the paper's order.
        waves: the significant waves of the texture, the longest first.
        spectrum: all waves, also insignificant ones.
        perceptibility: perceptibility at this stiffness and speed.
        grip: the hand that holds the device.
        speeds: scanning speeds [m/s] at which all decidable limits hold, from the first up to but
            excluding the second.
        contact_lost: fraction of the scan without contact.
        defaults: names of the arguments that were not given; "samples" for any of the three.
    """

    surface: Surface
    device: Device
    speed: float
    time_samples: float
    position_samples: float
    force_steps: float
    gain: Bound
    gain_symbol: str
    stability_limit: StabilityLimit
    margin: Margin
    limits: tuple[Limit, ...]
    waves: tuple[RenderedWave, ...]
    spectrum: Spectrum
    perceptibility: Perceptibility
    grip: Grip
    speeds: tuple[float, float]
    contact_lost: float
    defaults: tuple[str, ...]
    answer = Text[str]("Which limits hold and whether the texture is felt, in a few sentences.")
    assumptions = Text[tuple[str, ...]]("The assumptions, in sentences.")

    @property
    def texture(self) -> Texture:
        """The texture."""
        return self.surface.texture

    @property
    def resolved_share(self) -> float:
        """Share of the height variance in waves that meet every decidable limit on waves."""
        total = sum(wave.share for wave in self.waves)
        met = sum(wave.share for wave in self.waves if all(wave.holds.values()))
        if total == 0.0:
            return 0.0
        return met / total

    def limit(self, number: int) -> Limit:
        """Return a limit by the paper's number.

        Raises:
            KeyError: for a number other than 1 to 6.
        """
        return {limit.number: limit for limit in self.limits}[number]

    def __repr__(self) -> str:
        law = self.surface.law.letter
        count = sum(bool(limit.holds) for limit in self.limits)
        outcome = f"{count} of 6 hold, {self.perceptibility.tier}"
        return f"<Limits of law {law} on {self.device.id} at {self.speed:g} m/s: {outcome}>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return one row: law, stiffness, whether each limit holds, what is felt; SI units."""
        surface = self.surface
        felt = self.perceptibility
        holds = {f"limit {limit.number} holds": limit.holds for limit in self.limits}
        return [
            {
                "device": self.device.id,
                "law": surface.law.letter,
                "stiffness [N/m]": surface.stiffness,
                "depth [m]": surface.max_depth,
                "speed [m/s]": self.speed,
                "stability limit [N/m]": self.stability_limit.stiffness,
                "gain": self.gain.value,
                "gain method": self.gain.method,
                **holds,
                "top speed [m/s]": self.speeds[1],
                "resolved share": self.resolved_share,
                "tier": felt.tier,
                "texture force RMS [N]": felt.rms,
                "resolved force RMS [N]": felt.resolved_rms,
                "hand motion [m]": felt.hand_motion,
                "level": felt.level,
            }
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        surface = self.surface
        after_gain = (
            "stability_limit margin limits waves spectrum perceptibility resolved_share speeds "
            "answer assumptions"
        )
        return {
            "schema": SCHEMA,
            "texture": surface.texture.describe(),
            "law": surface.law.letter,
            **attributes_to_dict(self, "device", "speed"),
            **attributes_to_dict(surface, "law_parameters", "stiffness", "max_depth"),
            **attributes_to_dict(self, "time_samples", "position_samples", "force_steps"),
            "gain": {"symbol": self.gain_symbol} | self.gain.to_dict(),
            **attributes_to_dict(self, *after_gain.split()),
        }


def limits(
    texture: TextureLike,
    device: DeviceLike = DEFAULT_DEVICE,
    speed: float | None = None,
    law: str | Law | None = None,
    stiffness: float | None = None,
    max_depth: float | None = None,
    *,
    time_samples: float | None = None,
    position_samples: float | None = None,
    force_steps: float | None = None,
    rendering: str = FIELD,
    grip: str | os.PathLike[str] | Grip = DEFAULT_GRIP,
    **surface_arguments: Any,
) -> Limits:
    """Check the six limits of haptic texture synthesis for a surface on a device.

    α v T < l, β δ < l, α δ < l, γ b < A_F, q k <= K₀, v/l < F₀: for every wave of the texture,
    each with its own length l, amplitude and force A_F. They are necessary, not sufficient, to
    feel the texture undistorted. Undecidable limits are listed with the missing device data.

    Args:
        texture: the surface, or what names it; see
            :func:`~asperity.analysis.results.compare.compare`.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        speed: v, speed of the scan [m/s]; 0.1 by default.
        law: letter or name, or a user-defined law; by default the law recommended by a comparison.
        stiffness: k [N/m]; by default the recommended stiffness, as in a comparison; K₀ where no
            stable stiffness is known.
        max_depth: depth to which the surface is pressed [m]; by default its peak-to-valley
            height, at most 1 mm.
        time_samples: α, updates that a wave needs; at least 2, by the paper 5 to 10; default 5.
        position_samples: β, position steps that a wave needs; at least 2, default 5.
        force_steps: γ, force steps that an amplitude needs; at least 1, default 5.
        rendering: see :func:`~asperity.analysis.results.analyze.analyze`.
        grip: see :func:`~asperity.analysis.results.compare.compare`.
        **surface_arguments: further arguments of :class:`~asperity.surface.Surface`.

    Raises:
        ParameterError: for a value that cannot be used; it names the argument.

    Reference:
        Campion and Hayward, section II.B. Limit 4 is printed as γ b/l < A and limit 5 as
        2πA/l < A₀, with inconsistent dimensions; 2 and 3 are one condition as printed.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> result = limits(Sinusoid(amplitude=1e-4, period=1e-3), "pantograph", law="A")
        >>> [(limit.number, limit.holds) for limit in result.limits]
        [(1, True), (2, True), (3, True), (4, None), (5, True), (6, True)]
        >>> result.limit(4).missing_data, result.speeds
        (('force_resolution',), (0.0, 0.4))
    """
    check_keywords(surface_arguments, SURFACE_KEYWORDS, limits)
    device = load_device(device)
    texture = as_texture(texture)
    samples = {
        "time_samples": time_samples,
        "position_samples": position_samples,
        "force_steps": force_steps,
    }
    settings = _scan_settings(speed, samples)
    if law is None:
        conditions = {"speed": settings["speed"], "rendering": rendering}
        law = recommended_law(texture, device, max_depth, **conditions, **surface_arguments)
    k = DEFAULT_STIFFNESS if stiffness is None else stiffness
    surface = Surface(texture, law, k, max_depth, **surface_arguments)
    surface = render_on_device(surface, device, rendering)
    q = cached_number(surface, NORM)
    one_sided = cached_number(surface, ONE_SIDED)
    recommended = recommend_stiffness(surface, device, q, one_sided)
    if stiffness is None:
        surface = surface.to_stiffness(recommended.start)
    scan = scan_force(surface)
    hand = load_grip(grip)
    perceptibility = assess_perceptibility(
        surface,
        device,
        texture.texture_part(),
        rms=scan.ripple * surface.stiffness,
        explicit_depth=max_depth is not None,
        grip=hand,
        **settings,
    )
    arguments = {"speed": speed, "stiffness": stiffness, "max_depth": max_depth}
    return _evaluate_limits(
        surface,
        device,
        recommended,
        q,
        one_sided,
        settings,
        perceptibility=perceptibility,
        grip=hand,
        contact_lost=scan.contact_lost,
        defaults=_default_names(arguments, samples),
    )


def _default_names(
    arguments: Mapping[str, float | None], samples: Mapping[str, float | None]
) -> tuple[str, ...]:
    """Return the names of the arguments that were not given."""
    names = [name for name, value in arguments.items() if value is None]
    if None in samples.values():
        names.append("samples")
    return tuple(names)


def _scan_settings(speed: float | None, samples: Mapping[str, float | None]) -> dict[str, Any]:
    """Return speed and numbers of samples, checked."""
    settings = {"speed": DEFAULT_SPEED}
    if speed is not None:
        settings["speed"] = check_positive("speed", speed, "m/s")
    for name, count in samples.items():
        settings[name] = check_sample_count(name, count)
    return settings


def _evaluate_limits(
    surface: Surface,
    device: Device,
    recommended: StiffnessRecommendation,
    q: Bound,
    one_sided: Bound,
    settings: Mapping[str, Any],
    **others: Any,
) -> Limits:
    """Return the six limits; ``others`` are further attributes of the result."""
    gain, gain_symbol = _limiting_number(q, one_sided, recommended.stability_limit)
    spectrum = compute_spectrum(surface.texture)
    forces = wave_forces(surface, spectrum)
    is_significant = _significant_waves(spectrum, forces)
    data = {field: datum.value for field, datum in device.data.items()}
    if recommended.wall_stiffness is not None:
        data["max_stiffness"] = recommended.wall_stiffness
    case = LimitCase(
        device=data,
        wavelengths=spectrum.wavelengths[is_significant],
        forces=forces[is_significant],
        shares=spectrum.shares[is_significant],
        gain=gain.value,
        stiffness=surface.stiffness,
        **settings,
    )
    decisions = [
        evaluate_limit(rule, case, f"{gain_symbol} k ≤ K₀" if rule.number == 5 else None)
        for rule in LIMIT_RULES
    ]
    six = tuple(decision.limit for decision in decisions)
    top = min((limit.speeds[1] for limit in six if limit.speeds is not None), default=math.inf)
    return Limits(
        surface=surface,
        device=device,
        gain=gain,
        gain_symbol=gain_symbol,
        stability_limit=recommended.stability_limit,
        margin=recommended.margin,
        limits=six,
        waves=_rendered_waves(spectrum, is_significant, case, decisions),
        spectrum=spectrum,
        speeds=(0.0, top),
        **settings,
        **others,
    )


def _limiting_number(
    q: Bound, one_sided: Bound, stability_limit: StabilityLimit
) -> tuple[Bound, str]:
    """Return the number that limits the stiffness on this device, and its symbol.

    It is q for an unknown delay, q⁺ without delay, and in between for d samples of delay.
    """
    delay = stability_limit.delay
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


def _significant_waves(spectrum: Spectrum, forces: FloatArray) -> NDArray[np.bool_]:
    """Return which waves count: all waves of a sum, and bands with enough height or force."""
    if spectrum.exact:
        return np.ones(len(forces), dtype=bool)
    squares = forces**2
    force_shares = squares / (float(squares.sum()) or 1.0)  # the smooth wall has no force
    return np.asarray((spectrum.shares >= MIN_SHARE) | (force_shares >= MIN_SHARE))


def _rendered_waves(
    spectrum: Spectrum,
    is_significant: NDArray[np.bool_],
    case: LimitCase,
    decisions: Sequence[Decision],
) -> tuple[RenderedWave, ...]:
    """Return the significant waves, each with its limits."""
    on_waves = [
        rule for rule in decisions if rule.limit.holds is not None and rule.limit.number != 5
    ]
    waves = [spectrum.waves[i] for i in np.flatnonzero(is_significant)]
    return tuple(
        RenderedWave(
            wavelength=wave.wavelength,
            amplitude=wave.amplitude,
            share=wave.share,
            frequency=case.speed / wave.wavelength,
            force=float(case.forces[i]),
            holds={rule.limit.number: bool(rule.holds[i]) for rule in on_waves},
            top_speed=min((float(rule.top_speeds[i]) for rule in on_waves), default=math.inf),
        )
        for i, wave in enumerate(waves)
    )
