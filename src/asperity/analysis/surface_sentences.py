"""Sentences about the surface, its law and the device that results share."""

from __future__ import annotations

import math
from collections.abc import Iterable

from asperity.analysis.energy.leak import Leak
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.surface import Surface

SCOPE_SENTENCE = "Results concern energy and forces; they were not tested with people"
"""The last assumption of a comparison and of an analysis."""


def default_depth_text(surface: Surface) -> str:
    """Return the default max_depth, in a sentence."""
    depth = format_quantity(surface.max_depth, "m")
    return f"Default max depth {depth}: the peak-to-valley height, at most 1 mm"


def depth_range_text(surface: Surface) -> str:
    """Return the depths at which q and q⁺ hold.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> wave, clamps = Sinusoid(1e-4, 1e-3), ("none", "backed", "lateral")
        >>> [depth_range_text(Surface(wave, clamp=clamp)) for clamp in clamps]
        ['depths to 200 µm', 'every depth', 'depths to 400 µm']
    """
    if surface.effective_clamp.holds_whole_force:
        return "every depth"
    return f"depths to {format_quantity(surface.clamped_depth, 'm')}"


def unverified_sentences(device: Device, fields: Iterable[str]) -> list[str]:
    """Return the used numbers of a device that are not verified, and its notes."""
    unverified = [
        f"{field.replace('_', ' ')} {device.data[field].text}"
        for field in fields
        if field in device.data and not device.data[field].verified
    ]
    first = [f"Not verified for the {device.name}: {', '.join(unverified)}"] if unverified else []
    return [*first, *device.notes]


def leak_energy_text(leak: Leak) -> str:
    """Return the energy gained on the worst loop, per period or line length if that is proved.

    Example:
        >>> from asperity.analysis.energy.leak import worst_loop
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> leak_energy_text(worst_loop(Surface(Sinusoid(0.8e-3, 2e-3), "A", max_depth=0.8e-3)))
        '1.28 mJ per period'
    """
    per = "period" if leak.line.periodic else format_quantity(leak.line.length, "m")
    if math.isinf(leak.upper_per_period):
        per = "loop"
    return f"{format_quantity(leak.worst_per_period, 'J')} per {per}"


def law_parameter_sentences(surface: Surface) -> list[str]:
    """Return the parameters of a surface's law, one sentence each.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> law_parameter_sentences(Surface(Sinusoid(1e-4, 1e-3), "F", friction=0.3))[:2]
        ['Given friction 0.3', 'Default max deflection 1 mm']
    """
    sentences = []
    for name, argument in surface.law.arguments.items():
        value = surface.law_parameters[name]
        origin = "Default" if value == argument.default else "Given"
        sentences.append(f"{origin} {name.replace('_', ' ')} {argument.format_value(value)}")
    return sentences
