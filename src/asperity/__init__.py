"""Choose a haptic texture law and its stiffness for your device, and know what will go wrong.

Public names are imported when they are first used: starting up costs no SymPy, no SciPy, no
Numba and no matplotlib. ``__init__.pyi`` lists them with their modules, for type checkers and for
this module.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from asperity.core import display as _display

_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_MODULE_OF_NAME = {
    name: module for module, name in re.findall(r"^from (\S+) import (\w+)", _STUB, re.MULTILINE)
}

__all__ = list(_MODULE_OF_NAME)


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF_NAME:
        from asperity.core.errors import nearest_names

        hint = nearest_names(name, __all__).strip()
        raise AttributeError(f"module 'asperity' has no attribute {name!r}; {hint}".rstrip("; "))
    return getattr(import_module(_MODULE_OF_NAME[name]), name)


def __dir__() -> list[str]:
    return __all__


def _load_report() -> Any:
    from asperity import report  # at the first use: it imports every room of the package

    return report


_display.set_renderer(_load_report)
