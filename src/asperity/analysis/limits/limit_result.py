"""The result of checking the six limits for one surface, device and speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.limits.limit_rules import Limit
from asperity.analysis.limits.perceptibility import Perceptibility
from asperity.analysis.limits.spectrum import Spectrum
from asperity.analysis.passivity.verdict import Margin, StabilityLimit
from asperity.core.display import Plottable, Reportable
from asperity.core.files import Serializable, attributes_to_dict
from asperity.devices import Device
from asperity.surface import Surface
from asperity.textures.texture import Texture

SCHEMA = 2


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
class Limits(Plottable, Reportable):
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
        speeds: scanning speeds [m/s] at which all decidable limits hold, from the first up to but
            excluding the second.
        answer: the result in words.
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
    speeds: tuple[float, float]
    answer: str = ""
    assumptions: tuple[str, ...] = ()

    @property
    def safe_stiffness(self) -> float | None:
        """Stiffness of ``stability_limit`` [N/m]; ``None`` if none is known."""
        return self.stability_limit.stiffness

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

    def limit(self, number: int) -> Limit:
        """Return a limit by the paper's number.

        Raises:
            KeyError: for a number other than 1 to 6.
        """
        return {limit.number: limit for limit in self.limits}[number]

    def __repr__(self) -> str:
        law, count = self.surface.law.letter, sum(bool(limit.holds) for limit in self.limits)
        outcome = f"{count} of 6 hold, {self.perceptibility.tier}"
        return f"<Limits of law {law} on {self.device.id} at {self.speed:g} m/s: {outcome}>"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        surface = self.surface
        after_gain = (
            "safe_stiffness stability_limit margin limits waves spectrum perceptibility "
            "resolved_share speeds answer assumptions"
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
