"""The result of checking the six limits for one surface, device and speed, and its sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from asperity.analysis import surface_sentences
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.limits.limit_rules import Limit
from asperity.analysis.limits.perceptibility_result import Perceptibility
from asperity.analysis.limits.perceptibility_sentences import (
    masking_text,
    perceptibility_assumptions,
    remedies_text,
    speed_text,
    texture_amount_text,
)
from asperity.analysis.limits.spectrum import Spectrum
from asperity.analysis.passivity.assess_passivity import stability_limit_text
from asperity.analysis.passivity.verdict import Margin, StabilityLimit
from asperity.core.display import Plottable, Reportable, Tabular
from asperity.core.files import Serializable, attributes_to_dict
from asperity.core.units import format_quantity, round_down
from asperity.devices import Device
from asperity.perception.grip import Grip
from asperity.surface import Surface
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
