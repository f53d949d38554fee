"""Haptic textures that neither buzz nor feel alive, on the device you have.

Public names are imported when they are first used: starting up costs no SymPy, no SciPy, no
Numba and no matplotlib.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asperity.errors import AsperityError, LawError, ParameterError, SurfaceFileError

if TYPE_CHECKING:
    from asperity.analysis import (
        Bound,
        Comparison,
        Leak,
        Passivity,
        characteristic_number,
        compare,
        curl_number,
        loop_work,
        one_sided_number,
        worst_loop,
    )
    from asperity.analysis.limit_result import Limits
    from asperity.analysis.limits import limits
    from asperity.analysis.passivity import passivity
    from asperity.devices import Device, load_device
    from asperity.laws import Law
    from asperity.surface import Surface
    from asperity.textures import (
        Fourier,
        Grating,
        HeightMap,
        Noise,
        NoiseProfile,
        Profile,
        Sinusoid,
        load_texture,
        named_surface,
        surface_names,
    )

__version__ = "0.1.0"

_HOMES = {
    "Bound": "asperity.analysis",
    "Comparison": "asperity.analysis",
    "Device": "asperity.devices",
    "Fourier": "asperity.textures",
    "Grating": "asperity.textures",
    "HeightMap": "asperity.textures",
    "Law": "asperity.laws",
    "Leak": "asperity.analysis",
    "Limits": "asperity.analysis.limit_result",
    "Noise": "asperity.textures",
    "NoiseProfile": "asperity.textures",
    "Passivity": "asperity.analysis",
    "Profile": "asperity.textures",
    "Sinusoid": "asperity.textures",
    "Surface": "asperity.surface",
    "characteristic_number": "asperity.analysis",
    "compare": "asperity.analysis",
    "curl_number": "asperity.analysis",
    "limits": "asperity.analysis.limits",
    "load_device": "asperity.devices",
    "load_texture": "asperity.textures",
    "loop_work": "asperity.analysis",
    "named_surface": "asperity.textures",
    "one_sided_number": "asperity.analysis",
    "passivity": "asperity.analysis.passivity",
    "surface_names": "asperity.textures",
    "worst_loop": "asperity.analysis",
}

__all__ = [
    "AsperityError",
    "Bound",
    "Comparison",
    "Device",
    "Fourier",
    "Grating",
    "HeightMap",
    "Law",
    "LawError",
    "Leak",
    "Limits",
    "Noise",
    "NoiseProfile",
    "ParameterError",
    "Passivity",
    "Profile",
    "Sinusoid",
    "Surface",
    "SurfaceFileError",
    "__version__",
    "characteristic_number",
    "compare",
    "curl_number",
    "limits",
    "load_device",
    "load_texture",
    "loop_work",
    "named_surface",
    "one_sided_number",
    "passivity",
    "surface_names",
    "worst_loop",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'asperity' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
