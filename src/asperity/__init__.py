"""Haptic textures that neither buzz nor feel alive, on the device you have.

Public names are imported when they are first used: starting up costs no SymPy, no SciPy, no
Numba and no matplotlib.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asperity.errors import AsperityError as AsperityError
from asperity.errors import LawError as LawError
from asperity.errors import ParameterError as ParameterError
from asperity.errors import SurfaceFileError as SurfaceFileError

if TYPE_CHECKING:
    from asperity.analysis import Bound as Bound
    from asperity.analysis import Comparison as Comparison
    from asperity.analysis import Leak as Leak
    from asperity.analysis import Passivity as Passivity
    from asperity.analysis import characteristic_number as characteristic_number
    from asperity.analysis import compare as compare
    from asperity.analysis import curl_number as curl_number
    from asperity.analysis import loop_work as loop_work
    from asperity.analysis import one_sided_number as one_sided_number
    from asperity.analysis import worst_loop as worst_loop
    from asperity.analysis.analysis_result import Analysis as Analysis
    from asperity.analysis.analyze import analyze as analyze
    from asperity.analysis.check_limits import limits as limits
    from asperity.analysis.judge_passivity import passivity as passivity
    from asperity.analysis.limits.limit_result import Limits as Limits
    from asperity.analysis.split.potential_table import TabulatedSurface as TabulatedSurface
    from asperity.analysis.split.potential_table import tabulate as tabulate
    from asperity.analysis.split.state import PopThrough as PopThrough
    from asperity.analysis.split.state import SplitState as SplitState
    from asperity.analysis.split.state import pop_through as pop_through
    from asperity.analysis.split.state import split_state as split_state
    from asperity.devices import Device as Device
    from asperity.devices import load_device as load_device
    from asperity.laws import Law as Law
    from asperity.surface import Surface as Surface
    from asperity.textures import Fourier as Fourier
    from asperity.textures import Grating as Grating
    from asperity.textures import HeightMap as HeightMap
    from asperity.textures import Noise as Noise
    from asperity.textures import NoiseProfile as NoiseProfile
    from asperity.textures import Profile as Profile
    from asperity.textures import Sinusoid as Sinusoid
    from asperity.textures import load_texture as load_texture
    from asperity.textures import named_surface as named_surface
    from asperity.textures import surface_names as surface_names

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

__all__ = list(_HOMES)
__all__ += ["AsperityError", "LawError", "ParameterError", "SurfaceFileError", "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'asperity' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
