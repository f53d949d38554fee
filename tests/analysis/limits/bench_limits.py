"""A bench device with all data, and the limits of a sinusoid on it."""

from __future__ import annotations

from typing import Any

from asperity.analysis.results.check_limits import Limits, limits
from asperity.devices import Device, parse_device
from asperity.textures import Sinusoid, Texture

NUMBERS = {
    "update_rate": 2000.0,
    "position_resolution": 20e-6,
    "force_resolution": 2e-3,
    "max_stiffness": 900.0,
    "bandwidth": 300.0,
    "friction": 5e-3,
}
A, L, V, D = 5e-5, 0.8e-3, 0.12, 2e-4


def device(**changes: float | None) -> Device:
    """Return a device with all data; None omits a value."""
    content = {field: value for field, value in {**NUMBERS, **changes}.items() if value is not None}
    return parse_device(content, "bench")


def default_limits(texture: Texture | None = None, **arguments: Any) -> Limits:
    """Return the limits, by default of law A at 500 N/m on the bench device."""
    defaults = {"device": device(), "speed": V, "law": "A", "stiffness": 500.0, "max_depth": D}
    return limits(texture or Sinusoid(A, L), **{**defaults, **arguments})


def verdicts(result: Limits) -> dict[int, bool | None]:
    return {limit.number: limit.holds for limit in result.limits}
