"""Up to which stiffness a device renders a surface, without the rest of the judgement."""

from __future__ import annotations

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity.criteria import criteria
from asperity.analysis.passivity.device_loop import make_loop
from asperity.analysis.passivity.judgement import Allowed, allowed
from asperity.devices import Device
from asperity.surface import Surface


def allowed_stiffness(
    surface: Surface, device: Device, q: Bound, one_sided: Bound
) -> tuple[Allowed, float | None]:
    """Return up to which stiffness a device renders a surface; see :func:`allowed`.

    Args:
        surface: the surface.
        device: the device.
        q: its characteristic number.
        one_sided: its one-sided number.

    Returns:
        The answer, and the K₀ [N/m] that counts for this law: of the lightest direction, at the
        device's rate; ``None`` if none is known.
    """
    loop = make_loop(surface, device, q, one_sided, None)
    judged = {criterion.name: criterion for criterion in criteria(loop)}
    return allowed(loop, judged), None if loop.wall is None else float(loop.wall)
