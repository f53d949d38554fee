"""What is known of the six limits for one surface, device and speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.limits.felt import Felt
from asperity.analysis.limits.limit_rules import Limit
from asperity.analysis.limits.spectrum import Spectrum
from asperity.analysis.passivity.judgement import Allowed
from asperity.analysis.passivity.margin import Margin
from asperity.devices import Device
from asperity.display import Plotted, Reported
from asperity.files import Record, record
from asperity.surface import Surface
from asperity.textures.texture import Texture

SCHEMA = 1


@dataclass(frozen=True)
class RenderedWave(Record):
    """One wave of the texture on the device.

    Attributes:
        wavelength: l [m].
        amplitude: a [m].
        share: of the variance of the heights.
        frequency: v/l [Hz].
        force: A_F [N], amplitude of the force at this wavelength.
        holds: whether each limit holds, by its number; those that cannot be decided, and the gain
            limit, which is not on waves, are missing.
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
class Limits(Plotted, Reported):
    """The six limits for one surface on one device at one scanning speed.

    Attributes:
        surface: texture, law and the stiffness k of the force.
        device: the device.
        speed: v [m/s].
        time_samples: α, updates in a wave.
        position_samples: β, position steps in a wave.
        force_steps: γ, steps of force in an amplitude.
        gain: what limit 5 multiplies the stiffness by: q, or less where the delay is known.
        gain_symbol: "q", "q⁺" or what lies between.
        allowed: up to which stiffness the law may be rendered, as in a comparison.
        margin: the share of that at which to begin.
        limits: the six, in the paper's order.
        waves: what the texture is made of, the longest first.
        spectrum: all waves, with those that were too small to count.
        felt: whether the texture is felt at this stiffness and speed.
        speeds: speeds [m/s] at which all limits hold that could be decided, from the first up to
            but without the second.
        answer: in words.
        assumptions: what was assumed, in sentences.
    """

    surface: Surface
    device: Device
    speed: float
    time_samples: float
    position_samples: float
    force_steps: float
    gain: Bound
    gain_symbol: str
    allowed: Allowed
    margin: Margin
    limits: tuple[Limit, ...]
    waves: tuple[RenderedWave, ...]
    spectrum: Spectrum
    felt: Felt
    speeds: tuple[float, float]
    answer: str
    assumptions: tuple[str, ...]

    @property
    def safe_stiffness(self) -> float | None:
        """The stiffness of ``allowed`` [N/m]; ``None`` if none is known."""
        return self.allowed.stiffness

    @property
    def texture(self) -> Texture:
        """The texture."""
        return self.surface.texture

    @property
    def share(self) -> float:
        """Share of the height variance in waves that meet every limit on waves that is decided."""
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
        law, held = self.surface.law.letter, sum(bool(limit.holds) for limit in self.limits)
        said = f"{held} of 6 hold, {self.felt.tier}"
        return f"<Limits of law {law} on {self.device.id} at {self.speed:g} m/s: {said}>"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        surface = self.surface
        return {
            "schema": SCHEMA,
            "texture": surface.texture.describe(),
            "law": surface.law.letter,
            **record(self, "device", "speed"),
            **record(surface, "law_parameters", "stiffness", "max_depth"),
            **record(self, "time_samples", "position_samples", "force_steps"),
            "gain": {"symbol": self.gain_symbol} | self.gain.to_dict(),
            **record(self, "safe_stiffness", "allowed", "margin", "limits", "waves", "spectrum"),
            **record(self, "felt", "share"),
            **record(self, "speeds", "answer", "assumptions"),
        }
