"""What was taken for a surface and a device, in words."""

from __future__ import annotations

import math
from collections.abc import Iterable

from asperity.analysis.energy.leak import Leak
from asperity.devices import Device
from asperity.surface import Surface
from asperity.units import engineering


def default_depth(surface: Surface) -> str:
    """Return what max_depth was taken, in a sentence."""
    depth = engineering(surface.max_depth, "m")
    return f"Default max depth {depth}: the peak-to-valley height, at most 1 mm"


def depths(surface: Surface) -> str:
    """Return at which depths q and q⁺ hold.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> wave = Sinusoid(1e-4, 1e-3)
        >>> [depths(Surface(wave, clamp=clamp)) for clamp in ("none", "backed", "lateral")]
        ['depths to 200 µm', 'every depth', 'depths to 400 µm']
    """
    if surface.acting_clamp in {"whole", "backed"}:
        return "every depth"
    return f"depths to {engineering(surface.clamped_depth, 'm')}"


def unverified(device: Device, fields: Iterable[str]) -> list[str]:
    """Return which of the device's numbers were used without being verified, and its notes."""
    known = [(field, device.data[field]) for field in fields if field in device.data]
    said = [f"{name.replace('_', ' ')} {datum.text}" for name, datum in known if not datum.verified]
    first = [f"Not verified for the {device.name}: {', '.join(said)}"] if said else []
    return [*first, *device.notes]


def most_gained(leak: Leak) -> str:
    """Return what the worst loop gains: per period, or length of the line, if that is proved.

    Example:
        >>> from asperity.analysis.energy.leak import worst_loop
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> most_gained(worst_loop(Surface(Sinusoid(0.8e-3, 2e-3), "A", max_depth=0.8e-3)))
        '1.28 mJ per period'
    """
    energy = engineering(leak.worst_per_period, "J")
    if math.isinf(leak.upper_per_period):
        return f"{energy} per loop"
    return f"{energy} per {'period' if leak.line.periodic else engineering(leak.line.length, 'm')}"


def law_parameters(surface: Surface) -> list[str]:
    """Return the parameters of a surface's law, one sentence each.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> law_parameters(Surface(Sinusoid(1e-4, 1e-3), "F", friction=0.3))[:2]
        ['Given friction 0.3', 'Default max deflection 1 mm']
    """
    said = []
    for name, argument in surface.law.arguments.items():
        value = surface.law_parameters[name]
        kind = "Default" if value == argument.default else "Given"
        said.append(f"{kind} {name.replace('_', ' ')} {argument.readable(value)}")
    return said
