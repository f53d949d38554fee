"""Choose a haptic texture law and its stiffness for your device, and know what will go wrong.

Public names are imported when they are first used: starting up costs no SymPy, no SciPy, no
Numba and no matplotlib.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asperity.core import display as _display
from asperity.core.errors import AsperityError as AsperityError
from asperity.core.errors import LawError as LawError
from asperity.core.errors import ParameterError as ParameterError
from asperity.core.errors import SurfaceFileError as SurfaceFileError
from asperity.core.version import __version__ as __version__

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
    from asperity.analysis.analyze import analyze as analyze
    from asperity.analysis.assess_passivity import passivity as passivity
    from asperity.analysis.check_limits import limits as limits
    from asperity.analysis.limits.limit_result import Limits as Limits
    from asperity.analysis.results import Analysis as Analysis
    from asperity.analysis.split.baked_field import BakedField as BakedField
    from asperity.analysis.split.baked_field import bake as bake
    from asperity.analysis.split.split_state import PopThrough as PopThrough
    from asperity.analysis.split.split_state import SplitState as SplitState
    from asperity.analysis.split.split_state import pop_through as pop_through
    from asperity.analysis.split.split_state import split_state as split_state
    from asperity.devices import Device as Device
    from asperity.devices import load_device as load_device
    from asperity.laws import Law as Law
    from asperity.recording.recording import Recording as Recording
    from asperity.recording.recording import open_recording as open_recording
    from asperity.recording.replay import Replay as Replay
    from asperity.recording.replay import replay as replay
    from asperity.recording.writer import RecordingWriter as RecordingWriter
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

_PUBLIC_NAMES = {
    "asperity.analysis": (
        "Bound Comparison Leak Passivity characteristic_number "
        "compare curl_number loop_work one_sided_number worst_loop"
    ),
    "asperity.analysis.results": "Analysis",
    "asperity.analysis.analyze": "analyze",
    "asperity.analysis.check_limits": "limits",
    "asperity.analysis.assess_passivity": "passivity",
    "asperity.analysis.limits.limit_result": "Limits",
    "asperity.analysis.split.baked_field": "BakedField bake",
    "asperity.analysis.split.split_state": "PopThrough SplitState pop_through split_state",
    "asperity.devices": "Device load_device",
    "asperity.laws": "Law",
    "asperity.recording.recording": "Recording open_recording",
    "asperity.recording.replay": "Replay replay",
    "asperity.recording.writer": "RecordingWriter",
    "asperity.surface": "Surface",
    "asperity.textures": (
        "Fourier Grating HeightMap Noise NoiseProfile "
        "Profile Sinusoid load_texture named_surface surface_names"
    ),
}
"""Where the public names live."""

_MODULE_OF_NAME = {name: home for home, names in _PUBLIC_NAMES.items() for name in names.split()}

__all__ = list(_MODULE_OF_NAME)
__all__ += ["AsperityError", "LawError", "ParameterError", "SurfaceFileError", "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF_NAME:
        raise AttributeError(f"module 'asperity' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_MODULE_OF_NAME[name]), name)


def __dir__() -> list[str]:
    return __all__


def _load_report() -> Any:
    from asperity import report  # at the first use: it imports every room of the package

    return report


_display.set_renderer(_load_report)
