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
    from asperity.analysis.analysis_result import Analysis
    from asperity.analysis.analyze import analyze
    from asperity.analysis.check_limits import limits
    from asperity.analysis.judge_passivity import passivity
    from asperity.analysis.limits.limit_result import Limits
    from asperity.analysis.split.potential_table import TabulatedSurface, tabulate
    from asperity.analysis.split.state import PopThrough, SplitState, pop_through, split_state
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
    "Analysis": "asperity.analysis.analysis_result",
    "Bound": "asperity.analysis",
    "Comparison": "asperity.analysis",
    "Device": "asperity.devices",
    "Fourier": "asperity.textures",
    "Grating": "asperity.textures",
    "HeightMap": "asperity.textures",
    "Law": "asperity.laws",
    "Leak": "asperity.analysis",
    "Limits": "asperity.analysis.limits.limit_result",
    "Noise": "asperity.textures",
    "NoiseProfile": "asperity.textures",
    "Passivity": "asperity.analysis",
    "PopThrough": "asperity.analysis.split.state",
    "Profile": "asperity.textures",
    "Sinusoid": "asperity.textures",
    "SplitState": "asperity.analysis.split.state",
    "Surface": "asperity.surface",
    "TabulatedSurface": "asperity.analysis.split.potential_table",
    "analyze": "asperity.analysis.analyze",
    "characteristic_number": "asperity.analysis",
    "compare": "asperity.analysis",
    "curl_number": "asperity.analysis",
    "limits": "asperity.analysis.check_limits",
    "load_device": "asperity.devices",
    "load_texture": "asperity.textures",
    "loop_work": "asperity.analysis",
    "named_surface": "asperity.textures",
    "one_sided_number": "asperity.analysis",
    "passivity": "asperity.analysis.judge_passivity",
    "pop_through": "asperity.analysis.split.state",
    "split_state": "asperity.analysis.split.state",
    "surface_names": "asperity.textures",
    "tabulate": "asperity.analysis.split.potential_table",
    "worst_loop": "asperity.analysis",
}

__all__ = [
    "Analysis",
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
    "PopThrough",
    "Profile",
    "Sinusoid",
    "SplitState",
    "Surface",
    "SurfaceFileError",
    "TabulatedSurface",
    "__version__",
    "analyze",
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
    "pop_through",
    "split_state",
    "surface_names",
    "tabulate",
    "worst_loop",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'asperity' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
