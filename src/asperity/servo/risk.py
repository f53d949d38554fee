"""Whether a stiffness is above what the analysis allows on a device, and why."""

from __future__ import annotations

from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.passivity.allowed import allowed_stiffness
from asperity.devices import Device
from asperity.surface import Surface
from asperity.units import engineering


def risk(surface: Surface, device: Device) -> str:
    """Return why a surface at its stiffness may cycle on a device; empty if it is within limits.

    Args:
        surface: with its law and stiffness.
        device: the device.

    Example:
        >>> from asperity.devices import load_device
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> steep = Surface(Sinusoid(amplitude=0.1e-3, period=2e-3), "C", stiffness=2000.0)
        >>> risk(steep, load_device("touch"))[:43]
        '2000 N/m is above the limit of 364 N/m for '
    """
    q = characteristic_number(surface)
    allowed, _wall = allowed_stiffness(surface, device, q, one_sided_number(surface))
    where = f"for law {surface.law.letter} on {device.id}"
    if not allowed.stiffness:
        return f"no stiffness is known to be quiet {where}: asperity analyze says what is missing"
    if surface.stiffness <= allowed.stiffness:
        return ""
    limit = engineering(allowed.stiffness, "N/m", digits=3)
    given = engineering(surface.stiffness, "N/m")
    return f"{given} is above the limit of {limit} {where} ({allowed.basis}; q = {q.value:.3g})"
