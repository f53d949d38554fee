"""Comparison of a stiffness with the analysed limit of a device."""

from __future__ import annotations

from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.passivity.recommended_stiffness import recommend_stiffness
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.surface import Surface


def excess_stiffness_reason(surface: Surface, device: Device) -> str:
    """Return why a surface at its stiffness may cycle on a device; empty within the limit.

    Args:
        surface: the surface, with law and stiffness.
        device: the device.

    Example:
        >>> from asperity.devices import load_device
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> steep = Surface(Sinusoid(amplitude=0.1e-3, period=2e-3), "C", stiffness=2000.0)
        >>> excess_stiffness_reason(steep, load_device("touch"))[:43]
        '2000 N/m is above the limit of 364 N/m for '
    """
    q = characteristic_number(surface)
    allowed = recommend_stiffness(surface, device, q, one_sided_number(surface)).stability_limit
    context = f"for law {surface.law.letter} on {device.id}"
    if not allowed.stiffness:
        return f"no stiffness is known to be quiet {context}: asperity analyze says what is missing"
    if surface.stiffness <= allowed.stiffness:
        return ""
    limit = format_quantity(allowed.stiffness, "N/m", digits=3)
    given = format_quantity(surface.stiffness, "N/m")
    return f"{given} is above the limit of {limit} {context} ({allowed.basis}; q = {q.value:.3g})"
