"""The six limits of the paper's section II.B for a surface on a device."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.analysis import surface_sentences
from asperity.analysis.bounds.bound import NORM, ONE_SIDED, Bound
from asperity.analysis.energy.scan import scan_force
from asperity.analysis.gain.characteristic import cached_number
from asperity.analysis.limits import limit_rules
from asperity.analysis.limits.limit_rules import Limit
from asperity.analysis.limits.perceptibility import Perceptibility, assess_perceptibility
from asperity.analysis.limits.perceptibility_sentences import (
    masking_text,
    perceptibility_assumptions,
    remedies_text,
    speed_text,
    texture_amount_text,
)
from asperity.analysis.limits.spectrum import MIN_SHARE, Spectrum, compute_spectrum, wave_forces
from asperity.analysis.passivity import verdict
from asperity.analysis.passivity.assess_passivity import stability_limit_text
from asperity.analysis.passivity.verdict import Margin, StabilityLimit
from asperity.analysis.results.compare import DEFAULT_DEVICE, recommended_law
from asperity.core.arguments import DEFAULT_STIFFNESS, FIELD
from asperity.core.checks import FloatArray, check_keywords, check_positive
from asperity.core.display import Plottable, Reportable, Tabular
from asperity.core.files import Serializable, attributes_to_dict
from asperity.core.units import format_quantity, round_down
from asperity.devices import Device, DeviceLike, load_device
from asperity.laws import Law
from asperity.perception.grip import DEFAULT_GRIP, Grip, load_grip
from asperity.rendering import rendered_surface
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
        assumptions: the assumptions, in sentences.
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
    assumptions: tuple[str, ...] = ()

    @property
    def texture(self) -> Texture:
        """The texture."""
        return self.surface.texture

    @property
    def resolved_share(self) -> float:
        """Share of the height variance in waves that meet every decidable limit on waves."""
        total = sum(wave.share for wave in self.waves)
        met = sum(wave.share for wave in self.waves if all(wave.holds.values()))
        return met / total if total > 0.0 else 0.0

    @cached_property
    def answer(self) -> str:
        """Which limits hold and whether the texture is felt, in a few sentences."""
        if not self.waves:
            return "The surface is flat: there is no texture to feel."
        speed = speed_text(self.speed)
        failing = [limit for limit in self.limits if limit.holds is False]
        undecided = [limit for limit in self.limits if limit.holds is None]
        if failing:
            failures = "; ".join(_failure_text(limit) for limit in failing)
            advice = _speed_advice(self, failing)
            text = f"{_met_share_text(self, failing)} at {speed}: {failures}.{advice}"
        elif len(undecided) == len(self.limits):
            text = "No limit can be decided."
        elif undecided:
            holding = [limit for limit in self.limits if limit.holds]
            verb = "hold" if len(holding) > 1 else "holds"
            text = f"As far as can be decided: {_limit_numbers(holding)} {verb} at {speed}."
        else:
            text = f"Yes: all six limits hold at {speed}."
        if undecided:
            missing = dict.fromkeys(one for limit in undecided for one in limit.missing_data)
            numbers = _limit_numbers(undecided)
            data = _join_words([*missing])
            text += f" Not decidable: {numbers}; missing: {data}."
        return f"{text} {texture_force_text(self)}"

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
        return [{
            "device": self.device.id, "law": surface.law.letter,
            "stiffness [N/m]": surface.stiffness, "depth [m]": surface.max_depth,
            "speed [m/s]": self.speed, "stability limit [N/m]": self.stability_limit.stiffness,
            "gain": self.gain.value, "gain method": self.gain.method, **holds,
            "top speed [m/s]": self.speeds[1], "resolved share": self.resolved_share,
            "tier": felt.tier, "texture force RMS [N]": felt.rms,
            "resolved force RMS [N]": felt.resolved_rms, "hand motion [m]": felt.hand_motion,
            "level": felt.level,
        }]  # fmt: skip

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


def speeds_text(speeds: tuple[float, float] | None) -> str:
    """Return an interval of speeds for reading, its end rounded down.

    Example:
        >>> speeds_text((0.0, 0.4)), speeds_text((0.0, math.inf)), speeds_text((0.0, 0.0))
        ('below 0.4 m/s', 'all', 'none')
    """
    if speeds is None:
        return "–"
    if math.isinf(speeds[1]):
        return "all"
    if speeds[1] == 0.0:
        return "none"
    return f"below {speed_text(round_down(speeds[1]))}"


def _met_share_text(result: Limits, failing: Sequence[Limit]) -> str:
    """Return the share of the texture that meets the limits that can be decided."""
    if any(limit.share is None for limit in failing) or result.resolved_share == 0.0:
        return "Not as it is"
    share = percent(result.resolved_share)
    return f"Not all of it, only waves with {share} of the height variance,"


def _failure_text(limit: Limit) -> str:
    """Return both sides of a limit that fails, for the wave that violates it most."""
    left, right = (
        format_quantity(side, limit.unit) if side is not None else "–"
        for side in (limit.left, limit.right)
    )
    return f"limit {limit.number} ({limit.name}) fails, {left} against {right}"


def _speed_advice(result: Limits, failing: Sequence[Limit]) -> str:
    """Return the speeds at which all limits hold, or the limits that hold at no speed."""
    top = result.speeds[1]
    if top == 0.0:
        at_none = [limit for limit in failing if limit.speeds and limit.speeds[1] == 0.0]
        return f" No speed satisfies {_limit_numbers(at_none)}."
    return f" {speeds_text(result.speeds).capitalize()} they hold."


def texture_force_text(result: Limits) -> str:
    """Return the texture force, its perceptibility, and remedies."""
    texture = result.perceptibility
    law = result.surface.law.letter
    text = f"At {stiffness_text(result)} law {law} gives {texture_amount_text(texture)}: "
    if texture.tier == "felt":
        return f"{text}felt."
    return f"{text}{texture.tier}; {masking_text(texture)}. {remedies_text(texture)}".rstrip()


def stiffness_text(result: Limits) -> str:
    """Return the stiffness of the force for reading, rounded down."""
    return format_quantity(round_down(result.surface.stiffness), "N/m")


def percent(share: float) -> str:
    """Return a share for reading, never rounded to none or to all.

    Example:
        >>> percent(0.5), percent(1e-5), percent(0.9999), percent(1.0)
        ('50 %', '< 0.1 %', '> 99.9 %', '100 %')
    """
    if 0.0 < share < 1e-3:
        return "< 0.1 %"
    if 0.999 < share < 1.0 - 1e-12:
        return "> 99.9 %"
    return f"{100.0 * share:.3g} %"


def _limit_numbers(limits: Sequence[Limit]) -> str:
    word = "limit" if len(limits) == 1 else "limits"
    return f"{word} {_join_words([str(limit.number) for limit in limits])}"


def _join_words(words: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]])) if words else "none"


def limits_assumptions(
    result: Limits, defaults: Mapping[str, bool], contact_lost: float
) -> tuple[str, ...]:
    """Return the assumptions of the limits, in sentences.

    Args:
        result: the limits.
        defaults: whether speed, stiffness, max_depth and samples are defaults.
        contact_lost: fraction of the scan without contact.
    """
    surface = result.surface
    sentences = [*surface.texture.preparation, *_default_sentences(result, defaults)]
    sentences.append(f"Waves: {result.spectrum.description}")
    left_out = len(result.spectrum.waves) - len(result.waves)
    if left_out:
        sentences.append(
            f"{left_out} bands with less than 0.1 % of the variance of height and of force are "
            "left out of the limits"
        )
    depth = format_quantity(surface.max_depth, "m")
    sentences.append(f"Forces are those of a scan at constant height, pressed to {depth}")
    if contact_lost > 0.0:
        sentences.append(f"No contact on {percent(contact_lost)} of that scan")
    if result.gain.method == "sampled":
        sentences.append(f"{result.gain_symbol} = {result.gain.value:.4g} is sampled, not proved")
    used = [*dict.fromkeys(limit.device_field for limit in result.limits), "friction"]
    sentences += perceptibility_assumptions(result.perceptibility, result.device, result.grip)
    sentences += surface_sentences.unverified_sentences(result.device, used)
    sentences.append("The limits are necessary, not sufficient; they were not tested with people")
    return tuple(sentences)


def _default_sentences(result: Limits, defaults: Mapping[str, bool]) -> list[str]:
    sentences = []
    if defaults["speed"]:
        sentences.append(f"Default speed {speed_text(result.speed)}")
    if defaults["samples"]:
        counts = (result.time_samples, result.position_samples, result.force_steps)
        shown = ", ".join(f"{name} = {n:g}" for name, n in zip("αβγ", counts, strict=True))
        sentences.append(f"Samples in a wave: {shown}; the paper recommends 5 to 10")
    if defaults["stiffness"]:
        share = result.margin.factor
        limit = result.stability_limit
        default = "" if limit.stiffness else ", a default"
        part = f"{share:g} of what is " if limit.stiffness and share < 1.0 else ""
        sentences.append(
            f"Stiffness {stiffness_text(result)}{default}: {part}{stability_limit_text(limit)}"
        )
    if defaults["max_depth"]:
        sentences.append(surface_sentences.default_depth_text(result.surface))
    return sentences + surface_sentences.law_parameter_sentences(result.surface)


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
    v = limit_rules.DEFAULT_SPEED if speed is None else check_positive("speed", speed, "m/s")
    samples = time_samples, position_samples, force_steps
    settings: dict[str, Any] = {"speed": v} | {
        name: limit_rules.check_sample_count(name, value)
        for name, value in zip(limit_rules.LEAST_SAMPLES, samples, strict=True)
    }
    if law is None:
        law = recommended_law(
            texture, device, max_depth, speed=v, rendering=rendering, **surface_arguments
        )
    k = DEFAULT_STIFFNESS if stiffness is None else stiffness
    surface = Surface(texture, law, k, max_depth, **surface_arguments)
    surface = rendered_surface(surface, rendering)
    q = cached_number(surface, NORM)
    one_sided = cached_number(surface, ONE_SIDED)
    recommended = verdict.recommend_stiffness(surface, device, q, one_sided)
    if stiffness is None:
        surface = verdict.at_recommended_stiffness(surface, device, recommended)
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
    gain = _limiting_number(q, one_sided, recommended.stability_limit)
    result = _evaluate_limits(surface, device, recommended, *gain, perceptibility, hand, settings)
    given = {"speed": speed, "stiffness": stiffness, "max_depth": max_depth}
    defaults = {name: value is None for name, value in given.items()}
    defaults["samples"] = None in {time_samples, position_samples, force_steps}
    assumptions = limits_assumptions(result, defaults, scan.contact_lost)
    return replace(result, assumptions=assumptions)


def _evaluate_limits(
    surface: Surface,
    device: Device,
    recommended: verdict.StiffnessRecommendation,
    gain: Bound,
    gain_symbol: str,
    perceptibility: Perceptibility,
    grip: Grip,
    settings: dict[str, float],
) -> Limits:
    """Return the six limits, without sentences."""
    spectrum = compute_spectrum(surface.texture)
    forces = wave_forces(surface, spectrum)
    is_significant = _significant_waves(spectrum, forces)
    data = {field: datum.value for field, datum in device.data.items()}
    if recommended.wall_stiffness is not None:
        data["max_stiffness"] = recommended.wall_stiffness
    case = limit_rules.LimitCase(
        device=data,
        wavelengths=spectrum.wavelengths[is_significant],
        forces=forces[is_significant],
        shares=spectrum.shares[is_significant],
        gain=gain.value,
        stiffness=surface.stiffness,
        **settings,
    )
    decisions = [
        limit_rules.evaluate_limit(
            rule, case, f"{gain_symbol} k ≤ K₀" if rule.number == 5 else None
        )
        for rule in limit_rules.LIMIT_RULES
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
        perceptibility=perceptibility,
        grip=grip,
        speeds=(0.0, top),
        assumptions=(),
        **settings,
    )


def _limiting_number(
    q: Bound, one_sided: Bound, stability_limit: verdict.StabilityLimit
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
    case: limit_rules.LimitCase,
    decisions: Sequence[limit_rules.Decision],
) -> tuple[RenderedWave, ...]:
    """Return the significant waves, each with its limits."""
    on_waves = [one for one in decisions if one.limit.holds is not None and one.limit.number != 5]
    waves = [spectrum.waves[i] for i in np.flatnonzero(is_significant)]
    return tuple(
        RenderedWave(
            wavelength=wave.wavelength,
            amplitude=wave.amplitude,
            share=wave.share,
            frequency=case.speed / wave.wavelength,
            force=float(case.forces[i]),
            holds={one.limit.number: bool(one.holds[i]) for one in on_waves},
            top_speed=min((float(one.top_speeds[i]) for one in on_waves), default=math.inf),
        )
        for i, wave in enumerate(waves)
    )
